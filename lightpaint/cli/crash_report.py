"""Reports of bugs in lightpaint: one line for people, and the details in a private file."""

import os
import platform
import sys
import tempfile
import traceback
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from lightpaint.cli.output import lines
from lightpaint.display_text import visible
from lightpaint.files import one_line
from lightpaint.version import __version__

#: Exit code of an unexpected error: EX_SOFTWARE of sysexits.h.
FAULT = 70

#: Longest error text in the line, in characters.
MAX_ERROR_LENGTH = 300


def report_fault(command: str, error: BaseException, arguments: Sequence[str]) -> int:
    """Print that an unexpected error occurred and where the details are; return the exit code.

    command: the sub-command; "" before any. arguments: the arguments after `lightpaint`.
    """
    message = one_line(str(error), limit=MAX_ERROR_LENGTH)
    error_text = f"{type(error).__name__}: {message}" if message else type(error).__name__
    header = (
        f"lightpaint {__version__}, Python {platform.python_version()}, {platform.platform()}",
        f"command: {visible(repr(['lightpaint', *arguments]))}",
        *_libraries(),
    )
    lines_of_traceback = (
        line for text in traceback.format_exception(error) for line in text.splitlines()
    )
    path = _write_details("\n".join([*header, "", *map(visible, lines_of_traceback), ""]))
    details_note = f"the details are in {path}" if path else "the details could not be written"
    lines.complain(command, f"a bug in lightpaint: {error_text}; {details_note}")
    return FAULT


def _libraries() -> list[str]:
    """Return the versions of libraries that are loaded already: loading one might fail again."""
    modules = ((name, sys.modules.get(name)) for name in ("mitsuba", "drjit", "numpy"))
    return [f"{name} {module.__version__}" for name, module in modules if module is not None]


def _write_details(text: str) -> Path | None:
    """Write the details to a file that only the user can read; None if no folder allows it."""
    timestamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    for folder in _folders():
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            # mkstemp creates it for its owner alone, and never replaces a file.
            descriptor, name = tempfile.mkstemp(".txt", f"lightpaint-{timestamp}-", folder)
            with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
            return Path(name)
        except OSError:
            continue
    return None


def _folders() -> list[Path]:
    """Return possible folders: the user's folder for logs, then that for temporary files."""
    places = []
    with suppress(ImportError, OSError, RuntimeError):  # for users without a home folder
        from platformdirs import user_log_path

        places.append(user_log_path("lightpaint"))
    with suppress(OSError):
        places.append(Path(tempfile.gettempdir()))
    return places
