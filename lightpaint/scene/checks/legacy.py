"""Scenes of Mitsuba 0.6, told where Mitsuba 3 refuses them.

Mitsuba 3 renames the parameters of a file that says it is older than 2 (maxDepth to max_depth), and
knows of nothing else that has changed. There is no converter.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.file_reading import read_bytes
from lightpaint.files import one_line
from lightpaint.scene.checks.tokens import attributes, markup

#: Elements that are a parameter; a `<default>` may be called as people like.
_PARAMETERS = frozenset(
    b"boolean float integer string rgb spectrum transform point vector ref texture bsdf".split()
)
_CAMEL = re.compile(r"[a-z]+[A-Z][A-Za-z]*")

#: What Mitsuba 3 has instead of elements and plugins of 0.6 that many scenes use.
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


@contextmanager
def words_for_old_scenes(path: Path) -> Iterator[None]:
    """Where Mitsuba refuses the scene at `path` for its age, say that."""
    try:
        yield
    except SceneError as error:
        # Its cause is Mitsuba's own, where it was that which refused the scene.
        sign = _sign_of_age(path) if error.__cause__ is not None else ""
        raise (_of_age(path, sign, str(error)) if sign else error) from error.__cause__


def _of_age(path: Path, sign: str, said: str) -> SceneError:
    reason = said.removeprefix("Mitsuba refuses ").removeprefix(f"{path}: ")
    found = _REFUSED.search(reason)
    successor = SUCCESSORS.get(found[1] or found[2]) if found else None
    hint = "write what Mitsuba 3 has instead"
    if successor is not None:
        hint = f"write {successor} there"
    elif not sign.startswith("version"):
        hint = "say version 0.6.0 in <scene>, and Mitsuba 3 renames its parameters by itself"
    if found and "integrator plugin" in reason:
        reason, _, hint = reason.partition("; ")
    return SceneError(
        f"{path} is a scene of Mitsuba 0.6 ({sign}), of which Mitsuba 3 reads only a part, and it "
        f"stops: {reason}; {hint}, or export the scene for Mitsuba 3"
    )


def _sign_of_age(path: Path) -> str:
    """What shows that it is of Mitsuba 0.6; "" if nothing does."""
    try:
        text = read_bytes(path, "scene file", SceneError)
        tags = [found for found in markup(text) if found["tag"] is not None]
    except (SceneError, ValueError):
        return ""
    version = attributes(tags[0]).get("version", "") if tags else ""
    if re.match(r"\s*0\.", version):
        return f"version {one_line(version)}"
    for found in tags:
        if found["tag"] == b"lookAt":
            return "it has <lookAt>"
        name = attributes(found).get("name", "") if found["tag"] in _PARAMETERS else ""
        if _CAMEL.fullmatch(name):
            return f"it has the parameter {one_line(name)}, not in snake_case"
    return ""
