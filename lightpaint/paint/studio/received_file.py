"""Files that pages send in parts, one after the other."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.files import one_line
from lightpaint.paint.protocol import AddReference, ImportLayers


class ReceivedFile:
    """A file that arrives in parts; the next one takes its place.

    max_bytes: of the largest that is taken. It is in memory until it has arrived.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._parts: list[bytes] = []

    def take(
        self,
        message: ImportLayers | AddReference,
        arrays: Mapping[str, npt.NDArray[Any]],
    ) -> list[bytes] | None:
        """Take a part; return all parts after the last one, None before.

        Raises PaintError for anything else than the next part.
        """
        part, name = arrays.get("part"), one_line(message.name)
        if part is None or part.dtype != np.uint8:
            raise PaintError("a part of a file without its bytes")
        if message.size > self._max_bytes:
            raise PaintError(
                f"{name} has {message.size / 1e9:.1f} GB: expected at most "
                f"{self._max_bytes / 1e9:.1f} GB"
            )
        if message.start == 0:
            self._parts = []
        end = message.start + part.size
        if message.start != sum(map(len, self._parts)) or end > message.size:
            raise PaintError(f"{name} did not arrive in order: send it again")
        self._parts.append(part.tobytes())
        if end < message.size:
            return None
        parts, self._parts = self._parts, []
        return parts
