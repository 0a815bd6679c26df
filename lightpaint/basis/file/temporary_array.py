"""An array in a file without a name, of which memory holds only what is read or written."""

import mmap
import os
import tempfile

import numpy as np


class TemporaryArray:
    """An array of zeros, float32, in a file that goes when it does.

    Raises OSError if the folder for temporary files has no room.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        with tempfile.TemporaryFile() as file:
            if hasattr(os, "posix_fallocate"):  # else a full disk ends the process later
                os.posix_fallocate(file.fileno(), 0, 4 * int(np.prod(shape)))
            self.array = np.memmap(file, np.float32, "r+", shape=shape)  # keeps it open

    def release(self) -> None:
        """Release the memory of what was read or written, which stays in the file."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self.array._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]
