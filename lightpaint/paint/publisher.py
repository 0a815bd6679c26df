"""Messages and pictures that the threads of a session send to its pages, in a fixed order."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from threading import RLock
from typing import Any

from lightpaint.paint.background_threads import StoppedError
from lightpaint.paint.protocol import Message, PictureUpdate, ProgressReport
from lightpaint.paint.session.picture_table import Picture, PictureTable
from lightpaint.scene.runtime.render_lock import MITSUBA


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
        """Store a picture and tell the page that there is a new one."""

        def renewed() -> Message:
            self.pictures.put(name, picture)
            return PictureUpdate(resources={name: self.pictures.generations[name]})

        self.publish_made(renewed)

    def report_progress(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report how far a task is. Raises StoppedError once the session has ended."""
        if not self.is_open:
            raise StoppedError
        self.last_progress = report = ProgressReport(task=label, done=done, total=total, unit=unit)
        with MITSUBA.aside():  # the receiver may wait for a render of its own
            self.publish(report)
