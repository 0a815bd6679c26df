"""A folder that an ordinary user can only read: each command says so in one line."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from renderer import write_room

#: Who has no rights anywhere.
NOBODY = "65534"


@pytest.fixture
def as_nobody(tmp_path: Path) -> list[str]:
    """How a command begins that such a user runs."""
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("the right to be somebody else (setpriv)")
    begin = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
    words = [*begin, sys.executable, "-m", "lightpaint"]
    if subprocess.run([*words, "--version"], cwd="/", capture_output=True, check=False).returncode:
        pytest.skip("a Python that others may run")
    return words


@pytest.mark.nightly
def test_what_cannot_be_written_is_said_before_anything_is_rendered(
    tmp_path: Path, as_nobody: list[str]
) -> None:
    room = write_room(tmp_path)
    # pytest's folders are their owner's alone.
    for folder in (tmp_path, *tmp_path.parents):
        if folder.is_relative_to("/tmp") and folder != Path("/tmp"):
            folder.chmod(0o755)
    environment = {**os.environ, "HOME": "/nonexistent", "PYTHONDONTWRITEBYTECODE": "1"}
    for command in ("template", "basis", "paint"):
        completed = subprocess.run(
            [*as_nobody, command, room.name, "--spp", "2"] if command != "paint"
            else [*as_nobody, command, room.name, "--no-browser"],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=100,
        )  # fmt: skip
        assert completed.returncode == 2, completed.stderr
        [line] = completed.stderr.splitlines()
        assert "cannot write into" in line
        assert "Permission denied" in line
