"""One page on its socket: what it says, in order; what is said to it, as fast as it can hear."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.frames import of_frame, said_of, to_frame
from lightpaint.paint.protocol import (
    VERSION,
    AnswerUpdate,
    Closing,
    Failure,
    Hello,
    LookList,
    Message,
    Paint,
    PictureUpdate,
    ProgressReport,
    Said,
    SessionState,
    Standing,
    TakeOver,
)

#: Messages of a page that wait to be answered, and bytes of them, before no more are taken from its
#: socket.
MOST_HEARD, MOST_HEARD_BYTES = 64, 2**27

#: Messages that wait to be sent, and seconds that one may take: who is slower has gone, or comes
#: back and is told the state anew.
MOST_UNSENT, SLOWEST_S = 512, 60.0

#: Bytes of pictures and the like that wait to be sent, before what the page asks for next is done.
MOST_UNSENT_BYTES = 2**26


class Socket(Protocol):
    """What Starlette's WebSocket has of it."""

    async def receive(self) -> Any: ...
    async def send_bytes(self, data: bytes) -> None: ...
    async def close(self, code: int = 1000) -> None: ...


@dataclass
class Heard:
    """One message of a page, or why it is none.

    replies: its number, and those of live paint that it has made superfluous. size: bytes.
    """

    replies: list[int] = field(default_factory=list)
    said: Said | None = None
    arrays: dict[str, npt.NDArray[Any]] = field(default_factory=dict)
    refusal: Message | None = None
    size: int = 0

    @property
    def asks_for_session(self) -> bool:
        """Whether it is answered by all there is to know."""
        return isinstance(self.said, Hello | TakeOver)

    @property
    def takes_over(self) -> bool:
        """Whether the session is to be taken from another page."""
        return isinstance(self.said, TakeOver)


class Client:
    """One page. page: a name that it has made up for itself, by which it is known when it is back
    after a dropped connection; "" if it has none.

    Attributes:
        observes: Whether it has begun as an observer, which it stays.
        has_left: Whether it says no more; what it has said may wait to be answered.
    """

    def __init__(self, socket: Socket, page: str = "") -> None:
        self.page = page[:64]
        self._socket = socket
        self._heard: list[Heard] = []
        self._unsent: list[tuple[Message, int | None]] = []
        self._is_heard, self._is_taken = asyncio.Event(), asyncio.Event()
        self._is_to_send, self._is_sent = asyncio.Event(), asyncio.Event()
        self._is_answered, self._is_to_take = asyncio.Event(), asyncio.Event()
        self._is_sent.set()
        self._is_answered.set()
        self._is_gone = False
        self.has_left = self.observes = False

    async def keep_hearing(self) -> None:
        """Take what the page says until it leaves, but no more than waits already."""
        try:
            while not self._is_gone:
                message = await self._socket.receive()
                if message["type"] != "websocket.receive":
                    return
                frame = message.get("bytes")
                heard = _heard(frame)
                heard.size = len(frame or b"")
                await self._takes(heard)
        finally:
            self.has_left = True
            self._is_to_take.set()

    async def _takes(self, heard: Heard) -> None:
        """Have it answered, in its turn."""
        if not self._covers_last(heard):
            self._heard.append(heard)
        self._is_answered.clear()
        self._is_heard.set()
        while self._hears_too_much and not self._is_gone:
            self._is_taken.clear()
            await self._is_taken.wait()

    @property
    def _hears_too_much(self) -> bool:
        waiting = len(self._heard)
        return waiting >= MOST_HEARD or sum(x.size for x in self._heard) > MOST_HEARD_BYTES

    async def next_heard(self) -> Heard:
        """What is to be answered next; what was before it has been, and most of it was taken."""
        while self._unsent_bytes > MOST_UNSENT_BYTES and not (self._is_gone or self.has_left):
            self._is_to_take.clear()
            await self._is_to_take.wait()
        while not self._heard:
            self._is_answered.set()
            self._is_heard.clear()
            await self._is_heard.wait()
        self._is_taken.set()
        return self._heard.pop(0)

    def give_up(self) -> None:
        """Say no more to it, and take no more from it."""
        self._is_gone = True
        self._unsent.clear()
        for event in (self._is_sent, self._is_to_send, self._is_taken, self._is_to_take):
            event.set()

    def _covers_last(self, heard: Heard) -> bool:
        """Put `heard` in the place of live paint that waits and that it covers, if it does."""
        if not self._heard or not (last := self._heard[-1]).said:
            return False
        old, new = last.said, heard.said
        if not (isinstance(old, Paint) and isinstance(new, Paint)):
            return False
        if old.done or (old.stroke, old.view) != (new.stroke, new.view):
            return False
        if not _is_within(old.region, new.region):
            return False
        heard.replies[:0] = last.replies
        self._heard[-1] = heard
        return True

    def send(self, message: Message, reply: int | None = None) -> None:
        """Say something to the page, as soon as it can hear. reply: what it answers."""
        if self._is_gone:
            return
        if reply is None and (sort := _sort(message)) is not None:
            for k, (other, its) in enumerate(self._unsent):
                if its is None and _sort(other) == sort:
                    message = _merged(other, message)
                    del self._unsent[k]
                    break
        self._unsent.append((message, reply))
        self._is_sent.clear()
        self._is_to_send.set()
        if len(self._unsent) > MOST_UNSENT:
            self.give_up()

    async def keep_sending(self) -> None:
        """Send until the page has gone."""
        while not self._is_gone:
            while not self._unsent:
                self._is_sent.set()
                self._is_to_send.clear()
                await self._is_to_send.wait()
                if self._is_gone:
                    break
            if self._is_gone:
                break
            message, reply = self._unsent.pop(0)
            self._is_to_take.set()
            frame = to_frame(message.content(reply), message.buffers())
            try:
                await asyncio.wait_for(self._socket.send_bytes(frame), SLOWEST_S)
            except Exception:  # whatever a socket says that has nobody at its end
                self.give_up()
        await self.leave(1013)

    @property
    def _unsent_bytes(self) -> int:
        arrays = [array for message, _ in self._unsent for array in message.arrays.values()]
        return sum(array.nbytes for array in arrays)

    async def answered(self) -> None:
        """Wait until all that the page has said is answered."""
        await self._is_answered.wait()

    async def sent(self) -> None:
        """Wait until the page has heard everything."""
        await self._is_sent.wait()

    async def leave(self, code: int) -> None:
        """Close the socket, if it is still there."""
        self.give_up()
        try:
            await asyncio.wait_for(self._socket.close(code), 1.0)
        except Exception:  # it is not
            return


def _heard(frame: bytes | None) -> Heard:
    """What a frame says; of one that says nothing, why."""
    content: dict[str, Any] = {}
    try:
        if frame is None:
            raise PaintError("messages are binary frames")
        content, buffers = of_frame(frame)
        if _is_other_version(content):
            text = "lightpaint has been updated: load this page again"
            return Heard(_number(content), None, {}, Closing(reason="version", text=text))
        seq, said, arrays = said_of(content, buffers)
        return Heard([seq], said, arrays)
    except PaintError as error:
        return Heard(_number(content), None, {}, Failure(text=str(error)))


def _is_other_version(content: Mapping[str, Any]) -> bool:
    """Whether it is the first message of a page of another version, whatever else it says."""
    version = content.get("version")
    return (
        content.get("kind") in ("hello", "observe") and type(version) is int and version != VERSION
    )


def _number(content: Mapping[str, Any]) -> list[int]:
    seq = content.get("seq")
    return [seq] if type(seq) is int and 0 <= seq < 2**53 else []


def _is_within(inner: tuple[int, ...], outer: tuple[int, ...]) -> bool:
    top, bottom, left, right = outer
    return top <= inner[0] and inner[1] <= bottom and left <= inner[2] and inner[3] <= right


def _sort(message: Message) -> tuple[Any, ...] | None:
    """Of messages that nobody asked for: those of which only the newest counts."""
    if isinstance(message, ProgressReport):
        return "progress", message.what
    is_newest = isinstance(message, AnswerUpdate | PictureUpdate | LookList | SessionState)
    return (message.kind,) if is_newest else None


def _merged(old: Message, new: Message) -> Message:
    if isinstance(old, PictureUpdate) and isinstance(new, PictureUpdate):
        return PictureUpdate(resources={**old.resources, **new.resources})
    if isinstance(old, AnswerUpdate) and isinstance(new, AnswerUpdate):
        # Live answers leave out what is asked, which the one that is replaced may have said.
        names = [one for one in Standing.__dataclass_fields__ if getattr(new, one) is None]
        return replace(new, **{name: getattr(old, name) for name in names})
    return new
