# SPDX-License-Identifier: GPL-3.0-or-later
"""lightpaint as a program: where it is, and processes of it that Blender does not wait for."""

import os
import re
import shutil
import subprocess
import threading
from pathlib import Path

from ..shot.shot_files import read_json
from .painter_link import checked_address, is_loopback

#: How to install it, for messages.
INSTALL_TEXT = (
    "lightpaint is not installed, or not on the PATH: run  pip install 'lightpaint[paint,ocio]'  "
    "in a terminal, or name the program in the add-on's preferences"
)

#: A file in the add-on's folder with the path of the program that has written the add-on.
WRITER_FILE = Path(__file__).parent.parent / "PROGRAM"

#: Lines of its errors that are kept.
MAX_LINES = 200

#: Variables by which Blender's own Python would disturb the Python of lightpaint.
BLENDER_VARIABLES = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "LD_PRELOAD")

#: Blender's views that lightpaint has its own curve for, if OpenColorIO is not installed with it.
OWN_CURVES = {"Standard": "srgb", "Filmic": "filmic", "AgX": "agx", "Raw": "linear"}


def find_program(chosen=""):
    """Return the path of the program.

    chosen: path in the preferences; "" for the program that has written this add-on, or else that
    on the PATH. Raises FileNotFoundError, with what to do, if there is none.
    """
    if chosen:
        found = shutil.which(os.path.expanduser(chosen))
        if not found:
            raise FileNotFoundError(f"{chosen} is not a program: correct it in the preferences")
        return found
    writer = writing_program()
    found = (shutil.which(writer) if writer else None) or shutil.which("lightpaint")
    if not found:
        raise FileNotFoundError(INSTALL_TEXT)
    return found


def writing_program():
    """Return the path of the program that has written this add-on; "" if nobody knows it."""
    try:
        return WRITER_FILE.read_text(encoding="utf-8").strip()
    except (OSError, ValueError):
        return ""


class ProgramRun:
    """A running command of lightpaint.

    Attributes:
        first_line: The first line of its output, None until it has come.
        lines: The last lines of what it says.
    """

    def __init__(self, program, arguments, variables=None):
        """Start it. variables: of its environment. Raises OSError if it cannot be started."""
        environment = {k: v for k, v in os.environ.items() if k not in BLENDER_VARIABLES}
        environment.update(variables or {})
        environment["PYTHONIOENCODING"] = "utf-8:replace"
        self.first_line, self.lines = None, []
        self._process = subprocess.Popen(
            [program, *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            encoding="utf-8",
            errors="replace",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._threads = [
            threading.Thread(target=self._read_output, daemon=True),
            threading.Thread(target=self._read_errors, daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def code(self):
        """Exit code; None while it runs."""
        return self._process.poll()

    @property
    def error_text(self):
        """The last thing that it has complained about, without its name before it."""
        for thread in self._threads:
            thread.join(1.0)
        complaint = next((line for line in reversed(self.lines) if line.strip()), "")
        return re.sub(r"^lightpaint( \w+)?: ", "", complaint) or f"exit code {self.code}"

    @property
    def page_url(self):
        """The address of the painter's page; "" until it is known."""
        for line in self.lines:
            if match := re.search(r"https?://\S+#token=\S+", line):
                return match.group()
        return ""

    def stop(self, patience_s=5.0):
        """End it, by force if it does not end itself within some seconds."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(patience_s)
            except subprocess.TimeoutExpired:
                self._process.kill()

    def _read_output(self):
        for line in self._process.stdout or ():
            if self.first_line is None:
                self.first_line = line

    def _read_errors(self):
        for line in self._process.stderr or ():
            self.lines.append(line.rstrip("\n"))
            del self.lines[:-MAX_LINES]


def paint_arguments(shot, session, view, lights_file=""):
    """Return the arguments that open the painter on a shot. lights_file: "" for none."""
    constraints = ["--lights-file", lights_file] if lights_file else []
    return ["paint", "--lights", shot, "-o", session, "--json", *constraints, *view]


def running_painter(session):
    """Return address and token of a painter of this machine that serves a session; None if nothing
    says so.
    """
    try:
        found = read_json(Path(session) / "painter.json")
        address, token = found["address"], found["token"]
        # The file may come from elsewhere, with the shot: it must not lead away from here.
        if is_loopback(checked_address(address, token).hostname):
            return address, token
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return None


def view_options(scene, config):
    """Return options that show pictures as Blender does, and the environment they need.

    config: path of Blender's OpenColorIO configuration; "" if it is not known.
    """
    settings = scene.view_settings
    exposure = [f"--exposure={settings.exposure:g}"]
    if config and os.path.exists(config):
        view = f"ocio:{scene.display_settings.display_device}/{settings.view_transform}"
        return ["--view", view, *exposure], {"OCIO": config}
    return plain_options(scene), {}


def plain_options(scene):
    """Return options with lightpaint's own curve that is next to Blender's."""
    settings = scene.view_settings
    curve = OWN_CURVES.get(settings.view_transform, "srgb")
    return ["--view", curve, f"--exposure={settings.exposure:g}"]
