"""Silences libraries that print to the terminal, or warn of files."""

import errno
import fcntl
import io
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

#: File descriptors belong to the whole process: concurrent threads would restore each other's.
_silence_lock = threading.RLock()


@contextmanager
def unsilenced() -> Iterator[None]:
    """Print within the block without being silenced by another thread's library call."""
    with _silence_lock:
        yield


@contextmanager
def silenced() -> Iterator[None]:
    """Keep messages of C and C++ libraries about damaged files off the user's terminal.

    They write to the process's file descriptors and, through Python, to `sys.stdout`, which in a
    notebook is somewhere else. An ImageError reports the same faults. Descriptors that were closed
    when the process started stay closed.
    """
    with _silence_lock:
        _flush_standard_streams()
        null_device = os.open(os.devnull, os.O_WRONLY)
        saved_descriptors = [(fd, _copy_if_open(fd)) for fd in (1, 2) if fd != null_device]
        try:
            for fd, _ in saved_descriptors:
                os.dup2(null_device, fd)
            with redirect_stdout(io.StringIO()):
                yield
        finally:
            _flush_standard_streams()
            for fd, copy in saved_descriptors:
                if copy is None:
                    os.close(fd)
                else:
                    os.dup2(copy, fd)
                    os.close(copy)
            os.close(null_device)


@contextmanager
def without_pillow_warnings() -> Iterator[None]:
    """Ignore Pillow's warnings of what it mends in a file, such as an Exif block that is cut off.

    What it cannot mend is an error.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning, module=r"PIL\b")
        yield


def _flush_standard_streams() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # None if the process started with it closed
            stream.flush()


def _copy_if_open(fd: int) -> int | None:
    try:
        # At least 3, so that the copy does not take the place of a closed standard descriptor.
        return fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 3)
    except OSError as error:
        if error.errno != errno.EBADF:
            raise
        return None
