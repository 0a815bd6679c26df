"""The line between pages and one session: who has it, what is said, and in which order.

One page has the session. Another is told so, and may take it over; the first is told that. What
a page says waits in a queue of its own and is done by one thread, a message after the other; of
live paint that another stroke's part already covers, only the newest. What goes to a page that
is slow is replaced by what is newer where only the newest counts.

Whatever happens in the session is an answer to the page, and never the end of the line.
"""

import asyncio
import traceback
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy.typing as npt

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint.background_threads import told, tone_of
from lightpaint.paint.protocol import (
    Acknowledgement,
    AnswerUpdate,
    Ask,
    CanvasPatch,
    Closing,
    Export,
    ExportResult,
    Failure,
    Fetch,
    LookList,
    Message,
    Notice,
    Observe,
    Paint,
    PictureData,
    PictureUpdate,
    ProgressReport,
    Propose,
    Said,
    SessionState,
    VerificationResult,
)
from lightpaint.paint.server.client import Client, Heard
from lightpaint.paint.store.store import Store
from lightpaint.progress import while_wanted

#: Pages that are told that another has the session, at most.
MOST_PAGES = 16

#: Clients that only observe, at most.
MOST_OBSERVERS = 8

#: Seconds that a program's download waits for the brush to rest, at most.
REST_S = 10.0

#: Seconds for pages to hear the end.
GOODBYE_S = 1.0

#: What observers are told of what goes on.
OBSERVED = (
    SessionState,
    AnswerUpdate,
    LookList,
    PictureUpdate,
    ProgressReport,
    ExportResult,
    VerificationResult,
    Notice,
)

_Made = TypeVar("_Made")


class Painted(Protocol):
    """What a session is to a server."""

    on_message: Callable[[Message], None] | None

    def said(self, said: Said, arrays: dict[str, npt.NDArray[Any]]) -> list[Message]:
        """What is answered; the first answers the message. Raises LightpaintError."""

    def greet(self, *, is_back: bool) -> Message:
        """All that a page has to know; is_back: it had the session before, and nobody since."""

    def state(self) -> Message:
        """Return all that there is to know, and change nothing."""

    def resource(self, name: str) -> npt.NDArray[Any]:
        """A picture. Raises PaintError if there is none of that name."""


class Line:
    """Pages of one session.

    say: hears, in plain text, what somebody at the terminal should know.
    """

    def __init__(
        self, session: Painted, store: Store | None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self.session, self.store, self.say = session, store, say
        self.generations: dict[str, int] = {}
        self._holder: Client | None = None
        self._last: Client | None = None
        self._clients: set[Client] = set()
        self.farewell = "the painter has ended; what was painted is kept"
        self._worker = ThreadPoolExecutor(1, "lightpaint-session")
        self._is_over = False
        self._leaving: asyncio.Future[None] | None = None
        self._rest = asyncio.Event()  # set while no brush is down
        self._rest.set()

    def begin(self) -> None:
        """Hear the session from now on, in the running loop."""
        loop = asyncio.get_running_loop()

        def post(message: Message) -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._post, message)

        self.session.on_message = post

    @property
    def has_page(self) -> bool:
        """Whether a page is there that has heard what there is."""
        return self._holder is not None

    async def end(self) -> None:
        """Finish what pages have said, tell them, and finish what the session is at."""
        self._rest.set()
        await _all([client.answered() for client in self._clients])
        self._is_over = True
        self.session.on_message = None
        for client in self._clients:
            client.send(Closing(reason="ended", text=self.farewell))
        await _all([client.sent() for client in self._clients])
        await asyncio.to_thread(self._worker.shutdown, cancel_futures=True)

    async def serve(self, client: Client) -> None:
        """Answer one page until it leaves."""
        if self._is_over or len(self._clients) >= MOST_PAGES:
            await client.leave(1013)
            return
        self._clients.add(client)
        sending = asyncio.create_task(client.keep_sending())
        answering = asyncio.create_task(self._answering(client))
        try:
            await client.keep_hearing()
            # The last stroke of a page counts, though nobody is there for the answer.
            last = asyncio.ensure_future(client.answered())
            await asyncio.wait((last, answering), return_when=asyncio.FIRST_COMPLETED)
            last.cancel()
        finally:
            self._clients.discard(client)
            if self._holder is client:
                self._holder = None
                self._rest.set()
            client.give_up()  # a task may be at the end of a wait, which swallows the cancelling
            for task in (sending, answering):
                task.cancel()
            # Not gathered: whoever gives this wait up would hear of their end, not of its own.
            await asyncio.wait((sending, answering))

    async def resource(self, name: str) -> npt.NDArray[Any]:
        """A picture of the session. Raises PaintError if there is none of that name."""
        return await self._done(self.session.resource, name)

    async def _done(self, work: Callable[..., _Made], *given: Any) -> _Made:
        """What the session does, one thing at a time. Raises PaintError at the end."""
        if self._is_over:
            raise PaintError(self.farewell)
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._worker, partial(self._while_open, work, *given))

    def _while_open(self, work: Callable[..., _Made], *given: Any) -> _Made:
        """What the session does, which long work of it gives up at the end."""
        with while_wanted(self._check_open):
            return work(*given)

    def _check_open(self) -> None:
        if self._is_over:
            raise PaintError(self.farewell)

    async def _answering(self, client: Client) -> None:
        while True:
            heard = await client.next_heard()
            answers = await self._answers(client, heard)
            for message in answers:
                self._note(message)
                if client is self._holder and not isinstance(message, SessionState):
                    self._tell_observers(message)
            first, *others = answers or [Acknowledgement()]
            for seq in heard.replies or (None,):
                client.send(first, seq)
            for message in others:
                client.send(message)

    async def _answers(self, client: Client, heard: Heard) -> list[Message]:
        """What is said to one message; whatever goes wrong is said, too."""
        try:
            if heard.refusal is not None:
                return [heard.refusal]
            if isinstance(heard.said, Observe) or client.observes:
                return await self._answers_to_observer(client, heard.said)
            if heard.asks_for_session:
                holder = await self._present_holder(client)
                if holder not in (None, client) and not (
                    heard.takes_over or _same_page(holder, client)
                ):
                    return [_taken("the painter is open in another tab")]
                is_back = self._last is client or _same_page(self._last, client)
                self._give(client)
                return [await self._done(partial(self.session.greet, is_back=is_back))]
            if self._holder is not client:
                return [_taken("this tab does not have the session")]
            assert heard.said is not None
            is_live = isinstance(heard.said, Paint | Ask) and not heard.said.done
            (self._rest.clear if is_live else self._rest.set)()
            return await self._done(self.session.said, heard.said, heard.arrays)
        except LightpaintError as error:
            return [Failure(text=str(error), tone=tone_of(error))]
        except Exception as error:
            # A mistake of lightpaint's own: whoever paints goes on, and whoever mends it is told.
            self.say("".join(traceback.format_exception(error)))
            return [Failure(text=told(error, at_length=False))]

    async def _answers_to_observer(self, client: Client, said: Said | None) -> list[Message]:
        """Answer one that never has the session, once no brush is down.

        Raises LightpaintError for what observers may not do.
        """
        if isinstance(said, Observe):
            if client is self._holder:
                raise PaintError("this client has the session: observe with a client of its own")
            others = [one for one in self._clients if one.observes and one is not client]
            if len(others) >= MOST_OBSERVERS:
                raise PaintError(f"{MOST_OBSERVERS} observers are there already: close one of them")
            client.observes = True
            await self._rest.wait()
            return [await self._done(self.session.state)]
        is_export = isinstance(said, Export) and said.run
        if not (is_export or isinstance(said, Fetch | Propose)):
            raise PaintError(
                "an observer may fetch, export and propose: to paint, connect another client"
            )
        await self._rest.wait()
        answers = await self._done(self.session.said, said, {})
        if isinstance(said, Propose):
            for message in answers:
                self._tell_observers(message, but=client)
                if self._holder is not None:
                    self._holder.send(message)
            if self._holder is not None:
                self._holder.send(Notice(text=f"{said.name[:80]} was proposed: see the looks"))
        return answers

    async def at_rest(self) -> None:
        """Wait until no brush is down, but not for ever: who waits may hold it."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._rest.wait(), REST_S)

    def _tell_observers(self, message: Message, but: Client | None = None) -> None:
        """Pass on what concerns them. What waits for a slow one is replaced by what is newer."""
        told = message.answer if isinstance(message, CanvasPatch) else message
        if isinstance(told, OBSERVED):
            for client in self._clients:
                if client.observes and client is not but:
                    client.send(told)

    async def _present_holder(self, client: Client) -> Client | None:
        """Who has the session when `client` asks: what one that has left had said is done first."""
        while (holder := self._holder) not in (None, client) and holder.has_left:
            await holder.answered()
            if self._holder is holder:
                self._holder = None
        return holder

    def _give(self, client: Client) -> None:
        """`client` has the session from now on."""
        before, self._holder, self._last = self._holder, client, client
        self._rest.set()
        if before is None or before is client:
            return
        if _same_page(before, client):  # it is at the other end of a lost connection
            self._leaving = asyncio.ensure_future(before.leave(1001))
        else:
            before.send(_taken("another tab has taken this session over"))

    def _post(self, message: Message) -> None:
        """What the session says by itself."""
        self._note(message)
        self._tell_observers(message)
        if self._holder is not None:
            self._holder.send(message)

    def _note(self, message: Message) -> None:
        """Remember which pictures there are by now."""
        if isinstance(message, SessionState):
            self.generations = dict(message.resources)
        elif isinstance(message, PictureUpdate):
            self.generations = {**self.generations, **message.resources}


async def _all(waits: list[Coroutine[Any, Any, None]]) -> None:
    """Wait for all of them, but not for those who are too slow."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    if tasks:
        await asyncio.wait(tasks, timeout=GOODBYE_S)
    for task in tasks:
        task.cancel()


def _taken(text: str) -> Message:
    return Closing(reason="taken", text=text)


def _same_page(holder: Client | None, client: Client) -> bool:
    """Whether it is the page that has the session, back after its connection was dropped."""
    return holder is not None and client.page != "" and holder.page == client.page


async def pictured(line: Line, name: str) -> Message:
    """A picture as a message, whose bytes can be sent. Raises PaintError."""
    if len(name) > 200:
        raise PaintError("no picture has such a name")
    return PictureData(name=name, data=await line.resource(name))
