"""The places of a notebook at which one painter is shown: who has it, and what is said to whom."""

from collections.abc import Callable
from threading import RLock
from typing import Any

from lightpaint.paint.background_threads import told, tone_of
from lightpaint.paint.frames import said_of
from lightpaint.paint.protocol import VERSION, Closing, Failure, Hello, Message, Said, TakeOver
from lightpaint.paint.studio import Studio

#: Numbers of messages that one place has at which the painter is shown: `seq // MESSAGES`.
MESSAGES = 2**32


class Places:
    """Pages of one studio, of which all hear what is sent, and the one shown last has it.

    lock: held while a message is answered. send: JSON and buffers, to all of them.
    """

    def __init__(
        self, studio: Studio, lock: RLock, send: Callable[[dict[str, Any], list[bytes]], None]
    ) -> None:
        self._studio, self._lock, self._send = studio, lock, send
        self._page = 0

    def hear(self, content: Any, buffers: Any) -> None:
        """Answer a page, whatever it says."""
        seq = content.get("seq") if isinstance(content, dict) else None
        try:
            seq, said, arrays = said_of(content, [bytes(x) for x in buffers or ()])
            page = seq // MESSAGES
            with self._lock:
                if (answers := self._answers(page, said, arrays)) is None:
                    self._tell_taken(page, seq)
                    return
        except Exception as error:  # of our own, too, which anywidget would say nothing of
            answers = [Failure(text=told(error), tone=tone_of(error))]
        for k, message in enumerate(answers):
            self.tell(message, seq if k == 0 else None)

    def _answers(self, page: int, said: Said, arrays: Any) -> list[Message] | None:
        """What is answered; None to a page that does not have it."""
        if isinstance(said, Hello) and said.version != VERSION:
            text = "lightpaint has been updated: run the cell again"
            return [Closing(reason="version", text=text)]
        if isinstance(said, Hello | TakeOver):
            is_back = page == self._page
            self._give(page)
            return [self._studio.greet(is_back=is_back)]
        return self._studio.said(said, arrays) if page == self._page else None

    def _give(self, page: int) -> None:
        """Who was shown last has the session; who had it is told."""
        before, self._page = self._page, page
        if before not in (0, page):
            self._tell_taken(before)

    def _tell_taken(self, page: int, reply: int | None = None) -> None:
        text = "the painter is open at another place"
        self.tell(Closing(reason="taken", text=text), reply, page=page)

    def tell(self, message: Message, reply: int | None = None, *, page: int | None = None) -> None:
        """Say it to who has the painter, or to `page`."""
        about = {"page": self._page if page is None else page}
        self._send(message.content(reply) | about, message.buffers())
