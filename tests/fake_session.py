"""A session that knows nothing of light: it remembers what was said, and answers by number."""

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from fake_messages import fake_answer, fake_state

from lightpaint.errors import PaintError
from lightpaint.paint.protocol import (
    Acknowledgement,
    ConstrainLight,
    ConstrainLights,
    Message,
    Notice,
    Paint,
    Request,
    SessionState,
)


class FakeSession:
    """Counts strokes; a label of a stroke says what is to go wrong.

    before_paint: called before paint is answered, so that tests can hold it there.
    """

    def __init__(self) -> None:
        self.on_message: Callable[[Message], None] | None = None
        self.before_paint: Callable[[], object] = lambda: None
        self.requests: list[Request] = []
        self.threads: set[int] = set()
        self.pictures: dict[str, npt.NDArray[Any]] = {
            "present": np.arange(2 * 3 * 3, dtype=np.float16).reshape(2, 3, 3),
            "objects": np.array([[-1, 0, 1]], np.int16),
        }

    def handle(self, request: Request, arrays: dict[str, npt.NDArray[Any]]) -> list[Message]:
        self.threads.add(threading.get_ident())
        self.requests.append(request)
        match request:
            case Paint(label="refuse"):
                raise PaintError("this cannot be painted")
            case Paint(label="break"):
                raise ZeroDivisionError("<b>a mistake</b>")
            case Paint(label="nothing"):
                return []
            case Paint():
                self.before_paint()
                weights = np.full((2, 3), float(arrays["image"].sum()))
                return [fake_answer(stroke=request.stroke, weights=weights)]
            case ConstrainLight() | ConstrainLights():
                return [fake_answer()]
        return [Acknowledgement(), Notice(text="said")]

    def state(self) -> SessionState:
        return fake_state(dict.fromkeys(self.pictures, 1))

    def greet(self, *, is_back: bool) -> SessionState:
        return replace(self.state(), is_back=is_back)

    def resource(self, name: str) -> npt.NDArray[Any]:
        if name not in self.pictures:
            raise PaintError(f"no picture is called {name!r}")
        return self.pictures[name]

    def close(self) -> None:
        self.on_message = None
