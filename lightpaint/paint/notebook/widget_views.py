"""The views of one painter in a notebook: which of them has the session, and who receives what."""

from collections.abc import Callable
from threading import RLock
from typing import Any

from lightpaint.paint.background_threads import error_text, error_tone
from lightpaint.paint.frames import parse_request
from lightpaint.paint.protocol import (
    VERSION,
    AnyRequest,
    Closing,
    Failure,
    Hello,
    Message,
    TakeOver,
)
from lightpaint.paint.studio import Studio

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
        self._page = 0

    def receive(self, content: Any, buffers: Any) -> None:
        """Answer a page, whatever it sends."""
        seq = content.get("seq") if isinstance(content, dict) else None
        try:
            seq, request, arrays = parse_request(content, [bytes(x) for x in buffers or ()])
            page = seq // MESSAGES_PER_VIEW
            with self._lock:
                if (answers := self._handle(page, request, arrays)) is None:
                    self._send_taken(page, seq)
                    return
        except Exception as error:  # of our own, too, which anywidget would say nothing of
            answers = [Failure(text=error_text(error), tone=error_tone(error))]
        for k, message in enumerate(answers):
            self.send(message, seq if k == 0 else None)

    def _handle(self, page: int, request: AnyRequest, arrays: Any) -> list[Message] | None:
        """Return the answers to a request; None for a page that does not have the session."""
        if isinstance(request, Hello) and request.version != VERSION:
            text = "lightpaint has been updated: run the cell again"
            return [Closing(reason="version", text=text)]
        if isinstance(request, Hello | TakeOver):
            is_back = page == self._page
            self._hand_over(page)
            return [self._studio.greet(is_back=is_back)]
        return self._studio.handle(request, arrays) if page == self._page else None

    def _hand_over(self, page: int) -> None:
        """Give the session to the page that was shown last, and tell the one that had it."""
        before, self._page = self._page, page
        if before not in (0, page):
            self._send_taken(before)

    def _send_taken(self, page: int, reply: int | None = None) -> None:
        text = "the painter is open at another place"
        self.send(Closing(reason="taken", text=text), reply, page=page)

    def send(self, message: Message, reply: int | None = None, *, page: int | None = None) -> None:
        """Send a message to the page that has the session, or to `page`."""
        about = {"page": self._page if page is None else page}
        self._send(message.content(reply) | about, message.buffers())
