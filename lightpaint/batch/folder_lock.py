"""One batch at a time in a folder."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.errors import OutputError


@contextmanager
def alone(folder: Path, *, may_share: bool) -> Iterator[None]:
    """Raise OutputError where another batch is at work in `folder`.

    may_share: whether others that may, too, are let work there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
    try:
        with suppress(PermissionError):
            try:
                kind = fcntl.LOCK_SH if may_share else fcntl.LOCK_EX
                fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OutputError(
                    f"another batch is at work in {folder}: wait for it, or name another folder "
                    "(folder=...)"
                ) from None
            except OSError:
                pass  # a disk that knows no locks
        yield
    finally:
        os.close(descriptor)
