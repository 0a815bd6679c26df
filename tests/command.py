"""Running the command line as a user does."""

import os
import subprocess
import sys
from pathlib import Path


def run(folder: Path, *arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """`lightpaint …` in `folder`, with these environment variables."""
    return subprocess.run(
        [sys.executable, "-m", "lightpaint", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def succeed(folder: Path, *arguments: object) -> str:
    """What a command that must succeed prints to stdout."""
    done = run(folder, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def refused(folder: Path, *arguments: object) -> str:
    """The one line a user gets for a mistake; nothing may be left in `folder`."""
    before = sorted(p for p in folder.rglob("*"))
    done = run(folder, *arguments)
    assert done.returncode == 2, done.stdout + done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert sorted(p for p in folder.rglob("*")) == before
    return lines[0]
