"""An array in an unnamed file; memory holds only the parts being read or written."""

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
        """Release the memory of the parts read or written; the file keeps them."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self.array._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]
