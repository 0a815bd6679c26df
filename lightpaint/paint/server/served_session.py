"""The interface between a painter's server and the session that it serves."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy.typing as npt

from lightpaint.paint.protocol import (
    Message,
    Request,
)


class ServedSession(Protocol):
    """The part of a session that the server uses."""

    on_message: Callable[[Message], None] | None

    def handle(self, request: Request, arrays: dict[str, npt.NDArray[Any]]) -> list[Message]:
        """Return the answers; the first one replies to the request. Raises LightpaintError."""

    def greet(self, *, is_back: bool) -> Message:
        """Return the state for a page. is_back: it had the session before, and no other since."""

    def state(self) -> Message:
        """Return the state, and change nothing."""

    def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture. Raises PaintError for an unknown name."""
