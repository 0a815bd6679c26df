"""Reduces Mitsuba's errors to one line, while loading and while rendering a scene."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.files import one_line, without_path
from lightpaint.scene.checks.old_scenes import RefusedSceneError
from lightpaint.scene.properties.integrator import (
    IntegratorChoice,
)
from lightpaint.scene.runtime.plugins import UnknownPluginError
from lightpaint.sentences import Hint, Sentence, Word

#: Maximum length of quoted Mitsuba errors, whose cause may be at the end.
MAX_QUOTED_ERROR = 2000


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
    text = re.sub(rf'Error while loading XML file "{file}": ', "", text)
    text = re.sub(rf'Parsing of XML file "{file}" failed', "it is not XML", text)
    return without_path(text, path)
