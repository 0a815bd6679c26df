"""Pictures of windows of paint programs, in a display of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

from PIL import Image, ImageChops, ImageGrab

#: Pixels of the display; a window is smaller, and the rest is cut off.
SCREEN = (1500, 880)


def own_home(folder: Path) -> dict[str, str]:
    """Return variables for a program that has its home in a folder, and none of our Python."""
    home = folder / "home"
    home.mkdir(exist_ok=True)
    own = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "XDG_", "VIRTUAL"))}
    return {**own, "HOME": str(home), "PATH": os.defpath}


def window_picture(folder: Path, *command: str, patience_s: float) -> Image.Image:
    """Start a program in a display of its own, and return what it shows after so many seconds.

    folder: becomes the program's home, so that nothing of the user's is read or changed.
    """
    screen = ("-screen", "0", f"{SCREEN[0]}x{SCREEN[1]}x24")
    server = subprocess.Popen(["Xvfb", "-displayfd", "1", *screen], stdout=subprocess.PIPE)
    assert server.stdout is not None
    display = f":{int(server.stdout.readline())}"
    own = {**own_home(folder), "DISPLAY": display}
    quiet = subprocess.DEVNULL
    program = subprocess.Popen(
        command, cwd=folder, env=own, stdout=quiet, stderr=quiet, start_new_session=True
    )
    try:
        time.sleep(patience_s)
        picture = ImageGrab.grab(xdisplay=display).convert("RGB")
    finally:
        os.killpg(program.pid, signal.SIGKILL)
        program.wait()
        server.terminate()
        server.wait()
    nothing = Image.new("RGB", picture.size)
    return picture.crop(ImageChops.difference(picture, nothing).getbbox())
