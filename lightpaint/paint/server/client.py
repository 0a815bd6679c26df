"""A client on its socket: queues of incoming and outgoing messages."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.message_frames import from_frame, is_other_version, parse_request, to_frame

#: Largest number of queued messages of a page, and of their bytes, before its socket is read on.
MAX_QUEUED, MAX_QUEUED_BYTES = 64, 2**27

#: Maximum number of messages that wait to be sent, and of seconds for one: a slower client is cut
#: off, and receives the whole state when it reconnects.
MAX_UNSENT, SEND_TIMEOUT_S = 512, 60.0

#: Number of unsent bytes beyond which the next request waits.
MAX_UNSENT_BYTES = 2**26


class Socket(Protocol):
    """The part of Starlette's WebSocket that a client uses."""

    async def receive(self) -> Any: ...
    async def send_bytes(self, data: bytes) -> None: ...
    async def close(self, code: int = 1000) -> None: ...


@dataclass
class IncomingMessage:
    """A message of a page, or the reason why it is invalid.

    replies: its number, and the numbers of live paint that it has replaced. size: in bytes.
    """

    replies: list[int] = field(default_factory=list)
    request: protocol.Request | None = None
    arrays: dict[str, npt.NDArray[Any]] = field(default_factory=dict)
    refusal: protocol.Message | None = None
    size: int = 0

    @property
    def asks_for_session(self) -> bool:
        """True if the answer is the whole state."""
        return isinstance(self.request, protocol.Hello | protocol.TakeOver)

    @property
    def takes_over(self) -> bool:
        """True if the client takes the session from another page."""
        return isinstance(self.request, protocol.TakeOver)


class Client:
    """A page or a program on its socket.

    page: a name that the page chose, which identifies it after a dropped connection; "" if it has
    none.

    Attributes:
        is_observer: Whether it began as an observer; it then stays one. is_disconnected: Whether it
            has stopped sending; queued messages may still wait for an answer.
    """

    def __init__(self, socket: Socket, page: str = "") -> None:
        self.page = page[:64]
        self._socket = socket
        self._incoming: list[IncomingMessage] = []
        self._unsent: list[tuple[protocol.Message, int | None]] = []
        self._withheld: list[tuple[protocol.Message, int | None]] | None = None
        self._has_incoming, self._has_room = asyncio.Event(), asyncio.Event()
        self._has_unsent, self._all_sent = asyncio.Event(), asyncio.Event()
        self._all_answered, self._may_read_on = asyncio.Event(), asyncio.Event()
        self._all_sent.set()
        self._all_answered.set()
        self._is_abandoned = False
        self.is_disconnected = self.is_observer = False

    async def receive_all(self) -> None:
        """Queue the client's messages until it disconnects, within the limit of the queue."""
        try:
            while not self._is_abandoned:
                message = await self._socket.receive()
                if message["type"] != "websocket.receive":
                    return
                frame = message.get("bytes")
                incoming = _parse_frame(frame)
                incoming.size = len(frame or b"")
                await self._enqueue(incoming)
        finally:
            self.is_disconnected = True
            self._may_read_on.set()

    async def _enqueue(self, incoming: IncomingMessage) -> None:
        """Queue a message, and wait while the queue is full."""
        if not self._replace_covered(incoming):
            self._incoming.append(incoming)
        self._all_answered.clear()
        self._has_incoming.set()
        while self._is_queue_full and not self._is_abandoned:
            self._has_room.clear()
            await self._has_room.wait()

    @property
    def _is_queue_full(self) -> bool:
        waiting = len(self._incoming)
        return waiting >= MAX_QUEUED or sum(x.size for x in self._incoming) > MAX_QUEUED_BYTES

    async def next_message(self) -> IncomingMessage:
        """Return the next message, once most of the answers before it are sent."""
        while self._unsent_bytes > MAX_UNSENT_BYTES and not (
            self._is_abandoned or self.is_disconnected
        ):
            self._may_read_on.clear()
            await self._may_read_on.wait()
        while not self._incoming:
            self._all_answered.set()
            self._has_incoming.clear()
            await self._has_incoming.wait()
        self._has_room.set()
        return self._incoming.pop(0)

    def abandon(self) -> None:
        """Send nothing more, and read nothing more."""
        self._is_abandoned = True
        self._unsent.clear()
        for event in (self._all_sent, self._has_unsent, self._has_room, self._may_read_on):
            event.set()

    def _replace_covered(self, incoming: IncomingMessage) -> bool:
        """Replace queued live paint that `incoming` covers; return whether there was some."""
        if not self._incoming or not (last := self._incoming[-1]).request:
            return False
        old, new = last.request, incoming.request
        if not (isinstance(old, protocol.Paint) and isinstance(new, protocol.Paint)):
            return False
        if old.is_final or (old.stroke, old.view) != (new.stroke, new.view):
            return False
        if not _is_within(old.region, new.region):
            return False
        incoming.replies[:0] = last.replies
        self._incoming[-1] = incoming
        return True

    def send(self, message: protocol.Message, reply: int | None = None) -> None:
        """Queue a message for the client. reply: number of the message that it answers."""
        if self._is_abandoned:
            return
        if reply is None and self._withheld is not None:
            _append(self._withheld, message)
            return
        _append(self._unsent, message, reply)
        self._all_sent.clear()
        self._has_unsent.set()
        if len(self._unsent) > MAX_UNSENT:
            self.abandon()

    def withhold_events(self) -> None:
        """Withhold events from now on, and drop those withheld already.

        The state is made in another thread, so an event of a later change may arrive first, and the
        client would take the older state for the newer one.
        """
        self._withheld = []

    def release_events(self) -> None:
        """Send the events that were withheld, in their order."""
        events, self._withheld = self._withheld or [], None
        for event, _ in events:
            self.send(event)

    async def send_all(self) -> None:
        """Send queued messages until the client is abandoned."""
        while not self._is_abandoned:
            if not self._unsent:
                self._all_sent.set()
                self._has_unsent.clear()
                await self._has_unsent.wait()
                continue
            message, reply = self._unsent.pop(0)
            self._may_read_on.set()
            frame = to_frame(message.content(reply), message.buffers())
            try:
                await asyncio.wait_for(self._socket.send_bytes(frame), SEND_TIMEOUT_S)
            except Exception:  # errors of a socket whose other end is gone
                self.abandon()
        await self.close(1013)

    @property
    def _unsent_bytes(self) -> int:
        arrays = [array for message, _ in self._unsent for array in message.arrays.values()]
        return sum(array.nbytes for array in arrays)

    async def wait_answered(self) -> None:
        """Wait until all messages of the client are answered."""
        await self._all_answered.wait()

    async def wait_sent(self) -> None:
        """Wait until all messages to the client are sent."""
        await self._all_sent.wait()

    async def close(self, code: int) -> None:
        """Close the socket, if it is still open."""
        self.abandon()
        try:
            await asyncio.wait_for(self._socket.close(code), 1.0)
        except Exception:  # it is closed already
            return


def _parse_frame(frame: bytes | None) -> IncomingMessage:
    """Return the message in a frame, or the reason why it is invalid."""
    content: dict[str, Any] = {}
    try:
        if frame is None:
            raise PaintError("messages are binary frames")
        content, buffers = from_frame(frame)
        if is_other_version(content):
            text = "lightpaint has been updated: load this page again"
            return IncomingMessage(
                _sequence_numbers(content), None, {}, protocol.Closing(reason="version", text=text)
            )
        seq, request, arrays = parse_request(content, buffers)
        return IncomingMessage([seq], request, arrays)
    except PaintError as error:
        return IncomingMessage(
            _sequence_numbers(content), None, {}, protocol.Failure(text=str(error))
        )


def _sequence_numbers(content: Mapping[str, Any]) -> list[int]:
    seq = content.get("seq")
    return [seq] if type(seq) is int and 0 <= seq < 2**53 else []


def _is_within(inner: tuple[int, ...], outer: tuple[int, ...]) -> bool:
    top, bottom, left, right = outer
    return top <= inner[0] and inner[1] <= bottom and left <= inner[2] and inner[3] <= right


def _append(
    queue: list[tuple[protocol.Message, int | None]],
    message: protocol.Message,
    reply: int | None = None,
) -> None:
    """Append a message to a queue, or replace an event there that it outdates."""
    if reply is None and (key := _replacement_key(message)) is not None:
        for k, (queued, reply_to) in enumerate(queue):
            if reply_to is None and _replacement_key(queued) == key:
                message = _merge(queued, message)
                del queue[k]
                break
    queue.append((message, reply))


def _replacement_key(message: protocol.Message) -> tuple[Any, ...] | None:
    """Return a key for events of which only the newest counts; None for others."""
    if isinstance(message, protocol.ProgressReport):
        return "progress", message.task
    if isinstance(message, protocol.DraggedPlane):
        return message.kind, message.light, message.view
    if isinstance(message, protocol.MixedPicture):
        return message.kind, message.slot, message.view
    is_newest = isinstance(
        message,
        protocol.AnswerUpdate | protocol.PictureUpdate | protocol.LookList | protocol.SessionState,
    )
    return (message.kind,) if is_newest else None


def _merge(old: protocol.Message, new: protocol.Message) -> protocol.Message:
    if isinstance(old, protocol.PictureUpdate) and isinstance(new, protocol.PictureUpdate):
        return protocol.PictureUpdate(resources={**old.resources, **new.resources})
    if isinstance(old, protocol.AnswerUpdate) and isinstance(new, protocol.AnswerUpdate):
        # Live answers omit requests, which the replaced one may have contained.
        names = [
            key for key in protocol.EditState.__dataclass_fields__ if getattr(new, key) is None
        ]
        return replace(new, **{name: getattr(old, name) for name in names})
    return new
