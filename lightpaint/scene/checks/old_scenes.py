"""Better errors for scenes of Mitsuba 0.6 that Mitsuba 3 rejects.

If the version of a file is below 2, Mitsuba 3 converts the names of its parameters (maxDepth to
max_depth), but nothing else. There is no converter.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.file_reading import read_bytes
from lightpaint.files import one_line
from lightpaint.scene.checks.tokens import attributes, markup
from lightpaint.sentences import Sentence

#: Elements that are parameters; a `<default>` may have any name.
_PARAMETERS = frozenset(
    b"boolean float integer string rgb spectrum transform point vector ref texture bsdf".split()
)
_CAMEL = re.compile(r"[a-z]+[A-Z][A-Za-z]*")

#: Replacements in Mitsuba 3 for common elements and plugins of 0.6.
SUCCESSORS = {
    "lookAt": "lookat",
    **dict.fromkeys(("ldrfilm", "mfilm", "tiledhdrfilm"), "hdrfilm"),
    **dict.fromkeys(("sobol", "halton", "hammersley"), "multijitter"),
    "volpath_simple": "volpath",
    "bump": "bumpmap",
    "mixturebsdf": "blendbsdf",
    **dict.fromkeys(("sky", "sun"), "sunsky"),
    **dict.fromkeys(("phong", "ward"), "roughplastic"),
}
_REFUSED = re.compile(r"unexpected <(\w+)> element|has no \w+ plugin '(\w+)'")


class RefusedSceneError(SceneError):
    """A scene that Mitsuba rejects, and why. The remedy is "" if none is known."""

    reason = ""
    remedy = Sentence()


@contextmanager
def explain_old_scene(path: Path) -> Iterator[None]:
    """Explain the error if Mitsuba rejects the scene at `path` because it was written for 0.6."""
    try:
        yield
    except RefusedSceneError as error:
        sign = _sign_of_old_version(path)
        raise (_old_scene_error(path, sign, error) if sign else error) from error.__cause__


def _old_scene_error(path: Path, sign: str, refusal: RefusedSceneError) -> SceneError:
    reason, remedy = refusal.reason, refusal.remedy
    match = _REFUSED.search(reason)
    successor = SUCCESSORS.get(match[1] or match[2]) if match else None
    hint: str = "write its equivalent of Mitsuba 3"
    if successor is not None:
        hint = f"write {successor} there"
    elif not sign.startswith("version"):
        hint = 'write version="0.6.0" in <scene>, so that Mitsuba 3 renames its parameters'
    if match and "integrator plugin" in reason:
        reason, *suggestion = reason.split("; ", 1)
        hint, remedy = Sentence.joined([*suggestion, remedy], "; "), Sentence()
    advice = Sentence.joined(filter(None, (reason, remedy, hint)), "; ")
    return SceneError(
        f"{path} is a scene of Mitsuba 0.6 ({sign}), which Mitsuba 3 reads only in part; it "
        "stops: ",
        advice,
        ", or export the scene for Mitsuba 3",
    )


def _sign_of_old_version(path: Path) -> str:
    """Return the evidence that a scene was written for Mitsuba 0.6; "" if there is none."""
    try:
        text = read_bytes(path, "scene file", SceneError)
        tags = [tag for tag in markup(text) if tag["tag"] is not None]
    except (SceneError, ValueError):
        return ""
    version = attributes(tags[0]).get("version", "") if tags else ""
    if re.match(r"\s*0\.", version):
        return f"version {one_line(version)}"
    for tag in tags:
        if tag["tag"] == b"lookAt":
            return "it has <lookAt>"
        name = attributes(tag).get("name", "") if tag["tag"] in _PARAMETERS else ""
        if _CAMEL.fullmatch(name):
            return f"it has the parameter {one_line(name)}, not in snake_case"
    return ""
