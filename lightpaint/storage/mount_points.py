"""Mount points of Linux that Python does not report."""

import os
from contextlib import suppress
from pathlib import Path


def is_mounted(folder: Path) -> bool:
    """Return True if something is mounted at `folder`, a real path, or it is the root of a disk."""
    if os.path.ismount(folder):
        return True
    with suppress(OSError):
        # Only this file shows a bind mount from the same disk. It writes blanks as \040.
        for line in Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape").splitlines():
            if line.split()[4].replace("\\040", " ") == str(folder):
                return True
    return False
