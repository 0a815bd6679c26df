"""Reduces Mitsuba's errors to one line, while loading and while rendering a scene.

Scenes of Mitsuba 0.6 get better ones: if the version of a file is below 2, Mitsuba 3 converts the
names of its parameters (maxDepth to max_depth), but nothing else, and there is no converter.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.files import one_line, read_bytes, without_path
from lightpaint.scene.checks.tokens import attributes, markup
from lightpaint.scene.properties.integrator import IntegratorChoice
from lightpaint.scene.runtime.plugins import UnknownPluginError
from lightpaint.sentences import Hint, Sentence, Word

#: Maximum length of quoted Mitsuba errors, whose cause may be at the end.
MAX_QUOTED_ERROR = 2000

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
def mitsuba_errors(path: Path, instead: IntegratorChoice | None = None) -> Iterator[None]:
    """Convert Mitsuba's exceptions to one line: its own words, without positions in its source.

    instead: the integrator that replaces the scene's own.
    """
    try:
        yield
    except MemoryError:
        raise SceneError(path, " needs more memory than there is") from None
    except UnicodeDecodeError as error:
        raise SceneError(
            path, f", or a file that it refers to, has text that is not UTF-8: {error.reason}"
        ) from None
    except (RuntimeError, ValueError, TypeError, LookupError, OverflowError) as error:
        text = one_line(_without_places(str(error), path), limit=MAX_QUOTED_ERROR)
        undefined = re.search(r"undefined parameter: \$(\w+)", text)
        remedy = Sentence()
        if undefined:
            remedy = Sentence("set it with ", Hint("parameters", {undefined[1]: ...}))
        if "integrator plugin" in text:
            remedy = Sentence(Hint("integrator", Word("path")), " renders it with another")
            remedy = Sentence(f"the requested integrator is {instead}") if instead else remedy
        prefix = "" if isinstance(error, UnknownPluginError) else "Mitsuba refuses "
        refusal = RefusedSceneError(prefix, path, f": {text}{'; ' * bool(remedy)}", remedy)
        refusal.reason, refusal.remedy = text, remedy
        raise refusal from error


@contextmanager
def render_errors(path: Path) -> Iterator[None]:
    """Convert Mitsuba's exceptions during a render to one line: the first cause.

    Some scenes load but cannot be rendered, for example if particles never hit their sensor.
    """
    try:
        yield
    except RuntimeError as error:
        # Subclasses such as RecursionError are bugs and pass through.
        if type(error) is not RuntimeError or not _is_native(error):
            raise
        first: BaseException = error
        while first.__cause__ is not None:
            first = first.__cause__
        text = one_line(_without_places(str(first), path), limit=MAX_QUOTED_ERROR)
        raise SceneError(
            "Mitsuba cannot render ",
            path,
            f": {text}; ",
            Hint("integrator", Word("path")),
            " renders most scenes",
        ) from error


def _is_native(error: BaseException) -> bool:
    """Return True if the error comes from Mitsuba rather than from a progress callback."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    module = trace.tb_frame.f_globals.get("__name__", "") if trace is not None else ""
    return str(module).partition(".")[0] in ("drjit", "lightpaint", "mitsuba")


def _without_places(text: str, path: Path) -> str:
    """Return Mitsuba's text without positions in its source, and without the file `path`."""
    if "str_from_cstr" in text:  # raised by the Python binding
        return "it, or a file that it refers to, has a name that is not UTF-8"
    text = re.sub(r"\[\w+\.cpp:\d+\]\s*", "", text)
    file = re.escape(str(path))
    text = re.sub(rf"(?:At|(?:Error w|W)hile loading) {file} \((line \d+, col \d+)\)", r"\1", text)
    text = re.sub(rf"previous was at {file} \((line \d+, col \d+)\)", r"the first is at \1", text)
    text = re.sub(r' in property "_arg_\d+"', "", text)  # a reference without a name
    text = re.sub(rf'Error while loading XML file "{file}": ', "", text)
    text = re.sub(rf'Parsing of XML file "{file}" failed', "it is not XML", text)
    return without_path(text, path)


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
