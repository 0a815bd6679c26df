"""Libraries that talk to the terminal of their own accord, made to keep quiet."""

import errno
import fcntl
import io
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

#: The descriptors belong to the whole process: two threads would put back each other's.
_silencing = threading.RLock()


@contextmanager
def heard() -> Iterator[None]:
    """Say something meanwhile that is not lost because another thread keeps a library quiet."""
    with _silencing:
        yield


@contextmanager
def silenced() -> Iterator[None]:
    """Keep what libraries in C and C++ print about damaged files off the user's terminal.

    They write to the process's own descriptors and, by way of Python, to `sys.stdout`, which
    is another place in a notebook. The same news comes as an ImageError. A descriptor that
    the process was started without stays closed.
    """
    with _silencing:
        _flush_standard_streams()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        saved = [(fd, _copy_if_open(fd)) for fd in (1, 2) if fd != nowhere]
        try:
            for fd, _ in saved:
                os.dup2(nowhere, fd)
            with redirect_stdout(io.StringIO()):
                yield
        finally:
            _flush_standard_streams()
            for fd, copy in saved:
                if copy is None:
                    os.close(fd)
                else:
                    os.dup2(copy, fd)
                    os.close(copy)
            os.close(nowhere)


def _flush_standard_streams() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # which is how Python shows that it is closed
            stream.flush()


def _copy_if_open(fd: int) -> int | None:
    try:
        # Above the standard ones, of which another may be closed and would be taken for it.
        return fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 3)
    except OSError as error:
        if error.errno != errno.EBADF:
            raise
        return None
