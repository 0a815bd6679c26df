"""An array in an unnamed temporary file; only the parts in use take memory."""

import mmap
import os
import tempfile

import numpy as np


class TemporaryArray:
    """A float32 array, initially zero, in a temporary file that is deleted with it.

    Raises OSError if the temporary folder is full.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        with tempfile.TemporaryFile() as file:
            if hasattr(os, "posix_fallocate"):  # or a full disk would kill the process later
                os.posix_fallocate(file.fileno(), 0, 4 * int(np.prod(shape)))
            self.array = np.memmap(file, np.float32, "r+", shape=shape)  # keeps the file open

    def release(self) -> None:
        """Release the memory of the parts that were read or written; the file keeps their
        content.
        """
        if hasattr(mmap, "MADV_DONTNEED"):
            self.array._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]
