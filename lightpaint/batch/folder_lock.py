"""A lock on a batch's folder: one batch at a time."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.errors import OutputError
from lightpaint.sentences import Hint


@contextmanager
def lock_folder(folder: Path, *, shared: bool) -> Iterator[None]:
    """Lock `folder`. Raises OutputError if another batch works in it.

    shared: whether other batches with a shared lock may work there at the same time.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
    try:
        with suppress(PermissionError):
            try:
                kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
                fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OutputError(
                    f"another batch is at work in {folder}: wait for it, or name another folder (",
                    Hint("folder"),
                    ")",
                ) from None
            except OSError:
                pass  # the file system has no locks
        yield
    finally:
        os.close(descriptor)
