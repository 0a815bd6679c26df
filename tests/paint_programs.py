"""Paint programs that tests drive, where they are installed."""

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from patience import PATIENCE_S


def run(folder: Path, *command: str, **environment: str) -> None:
    """Run a program that has 100 s, a home of its own, and none of our Python."""
    (folder / "home").mkdir(exist_ok=True)
    own = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "XDG_", "VIRTUAL"))}
    # Where its own Python looks for modules is decided by the first one on the path.
    path = [*(str(Path(part).parent) for part in command if Path(part).is_absolute()), os.defpath]
    own |= {"HOME": str(folder / "home"), "PATH": os.pathsep.join(path), **environment}
    started = subprocess.Popen(
        command,
        cwd=folder,
        env=own,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        output, _ = started.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        os.killpg(started.pid, signal.SIGKILL)  # the program as well as what started it
        output, _ = started.communicate()
    assert started.returncode == 0, output.decode(errors="replace")[-2000:]


def needs(command: str, program: str) -> str:
    """The path of a program. Scripts are written for the versions that these names stand for."""
    path = shutil.which(command)
    if path is None:
        pytest.skip(program)
    return path
