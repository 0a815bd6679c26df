"""The views of one painter in a notebook: which has the session, and how messages reach them."""

import asyncio
import contextvars
from collections.abc import Callable
from threading import RLock
from typing import Any

from lightpaint.paint.background_threads import error_text, error_tone
from lightpaint.paint.message_frames import is_other_version, parse_request
from lightpaint.paint.protocol import Closing, Failure, Hello, Message, TakeOver
from lightpaint.paint.session_owner import SessionOwner
from lightpaint.paint.studio.studio import Studio

#: Message to a view that does not have the session, or has lost it.
TAKEN = Closing(reason="taken", text="the painter is open at another place")

#: Message numbers of one view, which is view `seq // MESSAGES_PER_VIEW`.
MESSAGES_PER_VIEW = 2**32


class WidgetViews:
    """The places in a notebook that show one painter; the one shown last has the session.

    lock: held while a message is answered. send: sends JSON and buffers to all of them.
    """

    def __init__(
        self, studio: Studio, lock: RLock, send: Callable[[dict[str, Any], list[bytes]], None]
    ) -> None:
        self._studio, self._lock, self._send = studio, lock, send
        self._owner = SessionOwner[int]()

    def receive(self, content: Any, buffers: Any) -> None:
        """Answer a message of a page, even an invalid one."""
        seq = content.get("seq") if isinstance(content, dict) else None
        try:
            answers = self._answer(content, [bytes(x) for x in buffers or ()])
        except Exception as error:  # bugs, too: anywidget would not report them
            answers = [Failure(text=error_text(error), tone=error_tone(error))]
        page = seq // MESSAGES_PER_VIEW if type(seq) is int else None
        for k, message in enumerate(answers):
            self.send(message, seq if k == 0 else None, page=page)

    def _answer(self, content: Any, buffers: list[bytes]) -> list[Message]:
        """Return the answers to a message. Raises LightpaintError."""
        if is_other_version(content):
            text = "lightpaint has been updated: run the cell again"
            return [Closing(reason="version", text=text)]
        seq, request, arrays = parse_request(content, buffers)
        page = seq // MESSAGES_PER_VIEW
        with self._lock:
            if isinstance(request, Hello | TakeOver):
                is_back, displaced = self._owner.give(page)
                if displaced is not None:
                    self.send(TAKEN, page=displaced)
                return [self._studio.greet(is_back=is_back)]
            return self._studio.handle(request, arrays) if page == self._owner.page else [TAKEN]

    def send(self, message: Message, reply: int | None = None, *, page: int | None = None) -> None:
        """Send a message to the page that has the session, or to `page`."""
        address = {"page": self._owner.page if page is None else page}
        self._send(message.content(reply) | address, message.buffers())


class KernelThread:
    """The thread of a notebook's kernel, which sends the messages of all threads.

    It is known by the event loop and context of the cell that runs now; without a loop, as in a
    script, each thread sends its own.
    """

    def __init__(self) -> None:
        self._loop = _running_loop()
        self._context = contextvars.copy_context()

    def call(self, act: Callable[[], None]) -> None:
        """Call `act` soon in the loop, in its context; at once without a loop."""
        if self._loop is None:
            act()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(act, context=self._context)


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
