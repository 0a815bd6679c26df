"""Errors of Mitsuba, told in one line: while it loads a scene, and while it renders one."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.files import one_line, without_path
from lightpaint.scene.integrator import (
    IntegratorChoice,
)
from lightpaint.scene.runtime.plugins import UnknownPluginError

#: Characters that are repeated of what Mitsuba says: the cause may stand at the end.
MAX_SAID = 2000


@contextmanager
def mitsuba_errors(path: Path, instead: IntegratorChoice | None = None) -> Iterator[None]:
    """Turn what Mitsuba throws into one line: its own words, without its source places.

    instead: the integrator that was put in.
    """
    try:
        yield
    except MemoryError:
        raise SceneError(f"{path} takes more memory than there is") from None
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{path}, or a file that it refers to, has text that is not UTF-8: {error.reason}"
        ) from None
    except (RuntimeError, ValueError, TypeError, LookupError, OverflowError) as error:
        text = one_line(_without_places(str(error), path), limit=MAX_SAID)
        undefined = re.search(r"undefined parameter: \$(\w+)", text)
        hint = f"; set it with parameters={{'{undefined[1]}': ...}}" if undefined else ""
        if "integrator plugin" in text:
            hint = f"; that is the integrator that was asked for, {instead}"
            hint = hint if instead else '; integrator="path" renders it with another'
        lead = "" if isinstance(error, UnknownPluginError) else "Mitsuba refuses "
        raise SceneError(f"{lead}{path}: {text}{hint}") from error


@contextmanager
def render_errors(path: Path) -> Iterator[None]:
    """Turn what Mitsuba throws while it renders into one line: the reason, and not what it led to.

    Some scenes load, and cannot be rendered: a sensor that is never hit by particles, say.
    """
    try:
        yield
    except RuntimeError as error:
        # Python's own kinds of it, such as RecursionError, are faults, whoever raises them.
        if type(error) is not RuntimeError or not _is_native(error):
            raise
        first: BaseException = error
        while first.__cause__ is not None:
            first = first.__cause__
        text = one_line(_without_places(str(first), path), limit=MAX_SAID)
        raise SceneError(
            f'Mitsuba cannot render {path}: {text}; integrator="path" renders most scenes'
        ) from error


def _is_native(error: BaseException) -> bool:
    """Return whether Mitsuba threw it, and not a listener that heard of the progress."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    module = trace.tb_frame.f_globals.get("__name__", "") if trace is not None else ""
    return str(module).partition(".")[0] in ("drjit", "lightpaint", "mitsuba")


def _without_places(said: str, path: Path) -> str:
    """Mitsuba's words without places in its source, and without the file where that is `path`."""
    if "str_from_cstr" in said:  # the binding's word for it
        return "it, or a file that it refers to, has a name that is not UTF-8"
    said = re.sub(r"\[\w+\.cpp:\d+\]\s*", "", said)
    file = re.escape(str(path))
    said = re.sub(rf"(?:At|(?:Error w|W)hile loading) {file} \((line \d+, col \d+)\)", r"\1", said)
    said = re.sub(rf'Error while loading XML file "{file}": ', "", said)
    said = re.sub(rf'Parsing of XML file "{file}" failed', "it is no XML", said)
    return without_path(said, path)
