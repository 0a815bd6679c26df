"""The session of a studio: its lock and its owner, and what its threads send to pages, in order."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from operator import eq
from threading import RLock
from typing import Any, Generic, NamedTuple, TypeVar

from lightpaint.errors import PaintError
from lightpaint.lighting import Lighting
from lightpaint.paint.background_threads import BackgroundThreads, StoppedError
from lightpaint.paint.layers.canvas import ViewLayers
from lightpaint.paint.protocol import Message, ProgressReport
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import Picture, PictureTable
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.progress import Progress
from lightpaint.scene.runtime.render_lock import MITSUBA


class SessionAccess:
    """Access to a session that opens once its first bases are there.

    Attributes:
        lock: Held while the session is read or changed.
        current: The session; None before there is a basis.
        failure_text: Why there is none, or why its bases got no better; empty without a failure.
    """

    def __init__(self) -> None:
        self.lock = RLock()
        self.current: Session | None = None
        self.failure_text = ""
        self._looks: LookLibrary | None = None

    def open(self, session: Session, looks: LookLibrary) -> None:
        """Give threads the session and its looks."""
        with self.lock:
            self.current, self._looks = session, looks

    @property
    def session(self) -> Session:
        """The session. Raises PaintError before there is a basis."""
        if self.current is None:
            raise self._absence
        return self.current

    @property
    def is_ready(self) -> bool:
        """True once the session has its lights, and not only a picture of the scene."""
        return self.current is not None and not self.current.is_waiting

    @property
    def ready_session(self) -> Session:
        """The session, whose lights are rendered. Raises PaintError before they are."""
        if not self.is_ready:
            raise self._absence
        return self.session

    @property
    def looks(self) -> LookLibrary:
        """The looks of the session. Raises PaintError before there is a basis."""
        if self._looks is None:
            raise self._absence
        return self._looks

    @property
    def _absence(self) -> PaintError:
        missing = "first picture is" if self.current is None else "lights are"
        return PaintError(self.failure_text or f"the {missing} still being rendered")

    @property
    def store(self) -> Store | None:
        """The session's store; None before there is a basis."""
        return None if self.current is None else self.current.store

    @property
    def version(self) -> int:
        """Number that grows with every change. Raises PaintError before there is a basis."""
        return self.session.version

    def snapshot(self) -> SessionSnapshot:
        """Return the current paintings and requests. Raises PaintError before there is a basis."""
        with self.lock:
            return self.ready_session.snapshot()

    def layers(self) -> tuple[ViewLayers, ...]:
        """Return the current layers of each view. Raises PaintError before there is a basis."""
        with self.lock:
            views = self.session.views
            return tuple(ViewLayers.of(view, views.layers) for view in views)

    def keep_compositions(self) -> None:
        """Write what the layers come to into the session file, so that it opens sooner."""
        with self.lock:
            compositions = self.session.compositions()
        if compositions is not None:
            self.session.store.put_compositions(*compositions)

    def snapshot_at_rest(self) -> SessionSnapshot | None:
        """Return the snapshot; None before there is a basis and while a stroke is open."""
        with self.lock:
            is_at_rest = self.is_ready and not self.session.is_open
            return self.session.snapshot() if is_at_rest else None

    def snapshot_and_lighting(
        self, requests: SessionRequests | None = None
    ) -> tuple[SessionSnapshot, Lighting]:
        """Return a snapshot and the last answer. Raises PaintError before there is a basis.

        requests: replace the requests of the session, if given.
        """
        with self.lock:
            snapshot = self.ready_session.snapshot(requests)
            weights = self.session.weights
        return snapshot, snapshot.lighting_of(weights)


_Page = TypeVar("_Page")


class Transfer(NamedTuple, Generic[_Page]):
    """A session that was given to a page.

    is_back: whether the page had it before, and no other since. displaced: the connection that lost
    it and must be notified; None for none.
    """

    is_back: bool
    displaced: _Page | None


class SessionOwner(Generic[_Page]):
    """The page that owns a session, if any.

    is_same: whether two connections belong to one page, which reconnected.

    Attributes:
        page: The connection that has the session.
    """

    def __init__(self, is_same: Callable[[_Page, _Page], bool] = eq) -> None:
        self.page: _Page | None = None
        self._last: _Page | None = None
        self._is_same = is_same

    def is_free_for(self, page: _Page) -> bool:
        """Return whether `page` may have the session without taking it from another."""
        return self.page is None or self._is_same(self.page, page)

    def give(self, page: _Page) -> Transfer[_Page]:
        """Give the session to `page`, even if another page has it."""
        is_back = self._last is not None and self._is_same(self._last, page)
        displaced = self.page if self.page != page else None
        self.page = self._last = page
        return Transfer(is_back, displaced)

    def release(self, page: _Page) -> bool:
        """Take the session from `page`, which has left; return whether it had it."""
        has_had = self.page == page
        if has_had:
            self.page = None
        return has_had


class Publisher:
    """The way from the threads of a session to its pages.

    session_lock: The session's lock, held while a message is made and not while it is sent.

    Attributes:
        on_message: Receives messages that answer no request, from the threads that publish them.
        pictures: The pictures that pages can fetch.
        is_open: False once the session has ended, so that nothing is sent any more.
        last_progress: The last report of `report_progress`.
    """

    def __init__(self, session_lock: AbstractContextManager[Any]) -> None:
        self.on_message: Callable[[Message], None] | None = None
        self.pictures = PictureTable()
        self.is_open = True
        self.last_progress: ProgressReport | None = None
        # Locks are taken in this order: `_order_lock`, which keeps messages in order; a lock of the
        # receiver, as the notebook has; `_session_lock`. So a background thread sends no message
        # while it holds `_session_lock`. Whoever handles a request holds the receiver's lock
        # already.
        self._order_lock, self._session_lock = RLock(), session_lock

    def close(self) -> None:
        """Send nothing any more, and let reports of progress end the tasks that make them."""
        self.is_open = False

    def publish(self, message: Message | None) -> None:
        """Send a message to the page, if there is one."""
        if message is not None and self.on_message is not None and self.is_open:
            self.on_message(message)

    def publish_made(self, make: Callable[[], Message | None]) -> None:
        """Make a message under the session's lock and send it.

        Messages of several threads are sent in the order in which they were made.
        """
        self.publish_all_made(lambda: [make()])

    def publish_all_made(
        self, make: Callable[[], Sequence[Message | None]]
    ) -> Sequence[Message | None]:
        """Make messages under the session's lock, and send them before those made later.

        Returns the messages.
        """
        with self._order_lock:
            with self._session_lock:
                messages = make()
            for message in messages:
                self.publish(message)
        return messages

    def publish_picture(self, name: str, picture: Picture) -> None:
        """Store a picture and announce it to the page."""
        self.publish_made(lambda: self.pictures.put_all({name: picture}))

    def report_progress(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report how far a task is. Raises StoppedError once the session has ended."""
        if not self.is_open:
            raise StoppedError
        self.last_progress = report = ProgressReport(task=label, done=done, total=total, unit=unit)
        with MITSUBA.aside():  # the receiver may wait for a render of its own
            self.publish(report)

    def reporter(
        self, check: Callable[[], None], task: str | None = None, steps: str | None = None
    ) -> Progress:
        """Return a listener that calls `check`, which raises to stop, and reports progress.

        task, steps: the label and the unit in the place of those that the work gives.
        """

        def report(label: str, done: int, total: int, unit: str = "passes") -> None:
            check()
            self.report_progress(task or label, done, total, steps or unit)

        return report


class StudioLinks(NamedTuple):
    """The session, pages and threads that the parts of a studio work with.

    access: the session. publisher: sends messages and pictures to pages. threads: run background
    work.
    """

    access: SessionAccess
    publisher: Publisher
    threads: BackgroundThreads
