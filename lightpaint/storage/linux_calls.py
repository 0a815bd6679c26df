"""What Linux knows of names, and Python does not say."""

import os
from contextlib import suppress
from pathlib import Path


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
