"""Messages as they travel, whatever they say: what no dataclass of the protocol would."""

from collections.abc import Mapping
from typing import Any

import numpy.typing as npt

from lightpaint.paint.protocol import Message
from lightpaint.paint.protocol.base import plain


class RawMessage(Message):
    """A message of any kind, with any fields and arrays."""

    def __init__(
        self,
        kind: str,
        fields: Mapping[str, Any] | None = None,
        arrays: Mapping[str, npt.NDArray[Any]] | None = None,
    ) -> None:
        self.kind = kind  # type: ignore[misc]
        self._fields, self._arrays = dict(fields or {}), dict(arrays or {})

    @property
    def fields(self) -> dict[str, Any]:
        return dict(plain(self._fields))

    @property
    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        return self._arrays
