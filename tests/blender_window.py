"""Starts a window of Blender in a display of its own, with OpenGL in software."""

import contextlib
import os
import shutil
import signal
import subprocess
from pathlib import Path

from displays import FREE_DISPLAY

#: Options of a window that is the same everywhere, and takes simulated events.
OPTIONS = (
    *("--factory-startup", "--enable-event-simulate", "--python-exit-code", "1"),
    *("-p", "0", "0", "1280", "800"),
)

#: The display; Blender wants GLX.
SCREEN = ("xvfb-run", *FREE_DISPLAY, "-s", "-screen 0 1280x800x24 +extension GLX")

#: Seconds in which everything in a window is done on a busy machine.
WINDOW_S = 300.0


def missing_programs() -> list[str]:
    """Return the programs that are not here."""
    return [name for name in ("blender", "xvfb-run") if shutil.which(name) is None]


def run_in_window(
    script: Path,
    *arguments: object,
    variables: dict[str, str],
    patience_s: float = WINDOW_S,
) -> str:
    """Run a script in a window, and return what Blender has printed."""
    splash = "import bpy; bpy.context.preferences.view.show_splash = False"
    command = [*SCREEN, "blender", *OPTIONS, "--python-expr", splash, "--python", str(script)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment |= {**variables, "LIBGL_ALWAYS_SOFTWARE": "1"}
    # All in one group of processes, so that nothing is left if a window never ends.
    window = subprocess.Popen(
        [*command, "--", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
        start_new_session=True,
    )
    try:
        output, _ = window.communicate(timeout=patience_s)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(window.pid, signal.SIGKILL)
    return output
