"""What Linux knows of processes and names, and Python does not say or do."""

import ctypes
import errno
import os
from contextlib import suppress
from pathlib import Path

#: Of renameat2(2) and openat(2), in <linux/fs.h> and <fcntl.h>.
RENAME_EXCHANGE, AT_FDCWD = 2, -100


def exchange(one: Path, other: Path) -> None:
    """Give each of two files or folders the other's name, in one step.

    Raises OSError where the system or the disk cannot.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "renameat2"):
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    names = (os.fsencode(one), os.fsencode(other))
    if libc.renameat2(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def is_mounted(folder: Path) -> bool:
    """Whether something is mounted at `folder`, a real path, or is the root of a disk."""
    if os.path.ismount(folder):
        return True
    with suppress(OSError):
        # Bound from the same disk, only this tells it. Blanks are written as \040 there.
        for line in Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape").splitlines():
            if line.split()[4].replace("\\040", " ") == str(folder):
                return True
    return False


def is_somebody_in(folder: Path) -> bool:
    """Whether a process, a shell above all, works in `folder`, a real path, or below it.

    It would go on in what `folder` was when names are exchanged. Not all are known: those of
    other people cannot be asked.
    """
    for name in os.listdir("/proc") if os.path.isdir("/proc") else ():
        if name.isdigit():
            with suppress(OSError):
                works_in = Path(os.readlink(f"/proc/{name}/cwd"))
                if works_in == folder or folder in works_in.parents:
                    return True
    return False
