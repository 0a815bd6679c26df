"""The connections between clients and one session, and the order of requests.

One page owns the session. Another page gets a notice and may take it over; then the first one gets
a notice. Requests of a page wait in its queue, and one thread handles them in order; of live paint
only the newest counts. Events to a slow page replace outdated ones.

An error in the session becomes an answer to the page, and never ends the connection.
"""

import asyncio
import traceback
from collections.abc import Callable, Collection, Coroutine, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy.typing as npt

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint.background_threads import error_text, error_tone
from lightpaint.paint.protocol import (
    Acknowledgement,
    AnswerUpdate,
    CanvasPatch,
    Closing,
    ConstrainLight,
    ConstrainLights,
    Event,
    Export,
    Failure,
    Fetch,
    Message,
    MoveLights,
    Notice,
    Observe,
    Paint,
    PictureData,
    PointLight,
    Propose,
    Request,
    SessionState,
)
from lightpaint.paint.server.client import Client, IncomingMessage
from lightpaint.paint.session_access import SessionOwner
from lightpaint.paint.store.session_file import Store
from lightpaint.progress import cancellable

_Result = TypeVar("_Result")

#: Maximum number of observers.
MAX_OBSERVERS = 8

#: Maximum number of clients.
MAX_PAGES = 16

#: Longest wait, in seconds, of a program's download for the brush to rest.
REST_S = 10.0

#: Seconds for pages to receive the last messages.
CLOSING_S = 1.0

#: Requests during a drag, until one with `is_final`.
LIVE_REQUESTS = (Paint, ConstrainLight, ConstrainLights, MoveLights, PointLight)


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


class SessionThread:
    """A thread for the work of one session.

    check_open: raises PaintError once the session has ended; work in progress is abandoned then.
    """

    def __init__(self, check_open: Callable[[], None]) -> None:
        self._check_open = check_open
        self._worker = ThreadPoolExecutor(1, "lightpaint-session")

    async def run(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Run work after all earlier work, and return its result. Raises what `check_open` does."""
        self._check_open()
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(
            self._worker, partial(self._run_while_open, work, *arguments)
        )

    async def close(self) -> None:
        """Wait for the work in progress, and drop what waits."""
        await asyncio.to_thread(self._worker.shutdown, cancel_futures=True)

    def _run_while_open(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        with cancellable(self._check_open):
            return work(*arguments)


class PageOwner(SessionOwner[Client]):
    """The client that owns the session, if any; a page that reconnected is the same one."""

    def __init__(self) -> None:
        super().__init__(_is_same_page)
        self._leaving: asyncio.Future[None] | None = None

    async def release_disconnected(self, client: Client) -> None:
        """Take the session from another client that has disconnected, after all its requests."""
        while (page := self.page) not in (None, client) and page.is_disconnected:
            await page.wait_answered()
            self.release(page)

    def hand_over(self, client: Client) -> bool:
        """Give the session to `client`, and notify the client that had it.

        Returns whether `client` had the session before, and no other since.
        """
        is_back, displaced = self.give(client)
        if displaced is not None and _is_same_page(displaced, client):
            # The connection to it is lost.
            self._leaving = asyncio.ensure_future(displaced.close(1001))
        elif displaced is not None:
            displaced.send(_taken_message("another tab has taken this session over"))
        return is_back


def _taken_message(text: str) -> Message:
    """Return the notice to a client that does not have the session."""
    return Closing(reason="taken", text=text)


def _is_same_page(first: Client, second: Client) -> bool:
    """Return whether two connections belong to one page, which reconnected."""
    return first is second or (first.page != "" and first.page == second.page)


class Observers:
    """The observers among the clients of a session.

    clients: all of them, as they come and go.
    """

    def __init__(self, clients: Collection[Client]) -> None:
        self._clients = clients

    def admit(self, client: Client) -> None:
        """Make a client an observer, for good. Raises PaintError if there are too many."""
        others = [other for other in self._clients if other.is_observer and other is not client]
        if len(others) >= MAX_OBSERVERS:
            raise PaintError(f"{MAX_OBSERVERS} observers are there already: close one of them")
        client.is_observer = True

    def send(self, message: Message, but: Client | None = None) -> None:
        """Send observers the events that concern them; newer events replace those that wait."""
        event = message.answer if isinstance(message, CanvasPatch) else message
        if isinstance(event, AnswerUpdate) and event.draft is not None:  # for whoever paints
            event = replace(event, draft=None)
        if isinstance(event, Event) and event.is_observed:
            for client in self._clients:
                if client.is_observer and client is not but:
                    client.send(event)


def _check_observer_request(request: Request | None) -> None:
    """Raise PaintError for requests that observers may not make."""
    is_export = isinstance(request, Export) and request.run
    if not (is_export or isinstance(request, Fetch | Propose)):
        raise PaintError(
            "an observer may fetch, export and propose: to paint, connect another client"
        )


class Connections:
    """The clients of one session.

    report: receives plain text for the terminal.
    """

    def __init__(
        self,
        session: ServedSession,
        store: Store | None,
        report: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.session, self.store, self.report = session, store, report
        self.generations: dict[str, int] = {}
        self._clients: set[Client] = set()
        self._owner, self._observers = PageOwner(), Observers(self._clients)
        self.farewell = "the painter has ended; what was painted is kept"
        self._thread = SessionThread(self._check_open)
        self._is_closed = False
        self._brush_up = asyncio.Event()  # set while no brush is down
        self._brush_up.set()

    def attach(self) -> None:
        """Receive the session's events from now on, in the running loop."""
        loop = asyncio.get_running_loop()

        def post(message: Message) -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._publish, message)

        self.session.on_message = post

    @property
    def has_page(self) -> bool:
        """True if a page has the session, and its state."""
        return self._owner.page is not None

    async def close(self) -> None:
        """Answer the queued requests, notify the pages, and finish the session's work."""
        self._brush_up.set()
        await _wait_all([client.wait_answered() for client in self._clients])
        self._is_closed = True
        self.session.on_message = None
        for client in self._clients:
            client.release_events()
            client.send(Closing(reason="ended", text=self.farewell))
        await _wait_all([client.wait_sent() for client in self._clients])
        await self._thread.close()

    async def serve(self, client: Client) -> None:
        """Serve one client until it disconnects."""
        if self._is_closed or len(self._clients) >= MAX_PAGES:
            await client.close(1013)
            return
        self._clients.add(client)
        sending = asyncio.create_task(client.send_all())
        live_answer = asyncio.create_task(self._answer_loop(client))
        try:
            await client.receive_all()
            # The last stroke of a page counts even if the page has gone.
            last = asyncio.ensure_future(client.wait_answered())
            await asyncio.wait((last, live_answer), return_when=asyncio.FIRST_COMPLETED)
            last.cancel()
        finally:
            self._clients.discard(client)
            if self._owner.release(client):
                self._brush_up.set()
            client.abandon()  # a task at the end of a wait may swallow the cancellation
            for task in (sending, live_answer):
                task.cancel()
            # Not gathered, since cancelling this wait would then report their end instead of its
            # own.
            await asyncio.wait((sending, live_answer))

    async def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture of the session. Raises PaintError for an unknown name."""
        return await self._thread.run(self.session.resource, name)

    def _check_open(self) -> None:
        if self._is_closed:
            raise PaintError(self.farewell)

    async def _answer_loop(self, client: Client) -> None:
        while True:
            incoming = await client.next_message()
            answers = await self._handle(client, incoming)
            for message in answers:
                self._update_generations(message)
                if client is self._owner.page and not isinstance(message, SessionState):
                    self._observers.send(message)
            first, *further = answers or [Acknowledgement()]
            for seq in incoming.replies or (None,):
                client.send(first, seq)
            for message in further:
                client.send(message)
            client.release_events()  # events that have to follow a state

    async def _handle(self, client: Client, incoming: IncomingMessage) -> list[Message]:
        """Return the answers to one message; every error becomes an answer."""
        try:
            if incoming.refusal is not None:
                return [incoming.refusal]
            if isinstance(incoming.request, Observe) or client.is_observer:
                return await self._handle_observer(client, incoming.request)
            if incoming.asks_for_session:
                await self._owner.release_disconnected(client)
                if not (incoming.takes_over or self._owner.is_free_for(client)):
                    return [_taken_message("the painter is open in another tab")]
                is_back = self._owner.hand_over(client)
                self._brush_up.set()
                client.withhold_events()
                return [await self._thread.run(partial(self.session.greet, is_back=is_back))]
            if self._owner.page is not client:
                return [_taken_message("this tab does not have the session")]
            assert incoming.request is not None
            is_live = isinstance(incoming.request, LIVE_REQUESTS) and not incoming.request.is_final
            (self._brush_up.clear if is_live else self._brush_up.set)()
            return await self._thread.run(self.session.handle, incoming.request, incoming.arrays)
        except LightpaintError as error:
            return [Failure(text=str(error), tone=error_tone(error))]
        except Exception as error:
            # A bug in lightpaint: painting goes on, and the terminal shows the traceback.
            self.report("".join(traceback.format_exception(error)))
            return [Failure(text=error_text(error, at_length=False))]

    async def _handle_observer(self, client: Client, request: Request | None) -> list[Message]:
        """Return the answers to an observer, once no brush is down.

        Raises LightpaintError for requests that observers may not make.
        """
        if isinstance(request, Observe):
            if client is self._owner.page:
                raise PaintError("this client has the session: observe with a client of its own")
            self._observers.admit(client)
            client.withhold_events()
            await self._brush_up.wait()
            client.withhold_events()  # the state includes earlier ones
            return [await self._thread.run(self.session.state)]
        _check_observer_request(request)
        await self._brush_up.wait()
        answers = await self._thread.run(self.session.handle, request, {})
        if isinstance(request, Propose):
            notice = Notice(text=f"{request.name[:80]} was proposed: see the looks")
            for message in answers:
                self._observers.send(message, but=client)
            if (page := self._owner.page) is not None:
                for message in (*answers, notice):
                    page.send(message)
        return answers

    async def wait_for_rest(self) -> None:
        """Wait until no brush is down, but not forever: the waiting program may hold it."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._brush_up.wait(), REST_S)

    def _publish(self, message: Message) -> None:
        """Send an event of the session to its page and its observers."""
        self._update_generations(message)
        self._observers.send(message)
        if self._owner.page is not None:
            self._owner.page.send(message)

    def _update_generations(self, message: Message) -> None:
        """Store the generation numbers of the pictures in a message."""
        resources: Mapping[str, int] = getattr(message, "resources", {})
        if resources:
            # A state may arrive after a message about a newer picture.
            newest = self.generations | {
                name: max(generation, self.generations.get(name, generation))
                for name, generation in resources.items()
            }
            self.generations = newest


async def _wait_all(waits: list[Coroutine[Any, Any, None]]) -> None:
    """Wait for all coroutines, but not for clients that are too slow."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    if tasks:
        await asyncio.wait(tasks, timeout=CLOSING_S)
    for task in tasks:
        task.cancel()


async def picture_message(connections: Connections, name: str) -> Message:
    """Return a picture as a message, whose bytes can be sent. Raises PaintError."""
    if len(name) > 200:
        raise PaintError("no picture has such a name")
    return PictureData(name=name, data=await connections.resource(name))
