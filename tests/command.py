"""Running the command line as a user does: in this process, or in one of its own."""

import os
import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from subprocess import CompletedProcess
from typing import IO

import pytest

from lightpaint.cli import main

Runner = Callable[..., CompletedProcess[str]]


def as_from_a_terminal() -> None:
    """In a process that begins: it ends with its terminal, also where `nohup` runs these tests."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def run(folder: Path, *arguments: object, **variables: str) -> CompletedProcess[str]:
    """`lightpaint …` in `folder`, with these environment variables, in this process.

    One of its own (`spawn`) would load Mitsuba and compile its kernels anew, for seconds. It is
    for what a process is to itself: its variant of Mitsuba, what it imports, signals, its streams.
    """
    words = [str(argument) for argument in arguments]
    with tempfile.TemporaryFile() as stdout, tempfile.TemporaryFile() as stderr:
        with _surroundings(folder, variables), _printing_to(stdout, stderr):
            try:
                code = main(words)
            except SystemExit as end:  # argparse's
                code = int(end.code or 0)
        stdout.seek(0)
        stderr.seek(0)
        return CompletedProcess(words, code, stdout.read().decode(), stderr.read().decode())


def spawn(folder: Path, *arguments: object, **variables: str) -> CompletedProcess[str]:
    """`lightpaint …` in `folder`, with these environment variables, in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "lightpaint", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def succeed(folder: Path, *arguments: object, by: Runner = run, **variables: str) -> str:
    """What a command that must succeed prints to stdout."""
    completed = by(folder, *arguments, **variables)
    assert completed.returncode == 0, completed.stderr
    return completed.stdout


def run_refused(folder: Path, *arguments: object, by: Runner = run) -> str:
    """The one line a user gets for a mistake; nothing may be left in `folder`."""
    before = sorted(p for p in folder.rglob("*"))
    completed = by(folder, *arguments)
    assert completed.returncode == 2, completed.stdout + completed.stderr
    lines = completed.stderr.strip().splitlines()
    assert len(lines) == 1, completed.stderr
    assert completed.stdout == ""
    assert "Traceback" not in completed.stderr
    assert sorted(p for p in folder.rglob("*")) == before
    return lines[0]


@contextmanager
def _surroundings(folder: Path, variables: dict[str, str]) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.chdir(folder)
        for name, value in variables.items():
            patch.setenv(name, value)
        yield


@contextmanager
def _printing_to(*files: IO[bytes]) -> Iterator[None]:
    """What Python, C and C++ print to stdout and stderr goes to these two files."""
    with ExitStack() as stack:
        redirections = (redirect_stdout, redirect_stderr)
        for fd, (file, redirect) in enumerate(zip(files, redirections, strict=True), start=1):
            (sys.stdout, sys.stderr)[fd - 1].flush()
            before = os.dup(fd)
            stack.callback(os.close, before)
            stack.callback(os.dup2, before, fd)
            os.dup2(file.fileno(), fd)
            # Closed, and so flushed, before the descriptor is what it was.
            text = stack.enter_context(open(fd, "w", encoding="utf-8", closefd=False))
            stack.enter_context(redirect(text))
        yield
