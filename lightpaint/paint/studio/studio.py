"""The studio: one session, and the background work that runs while the brush moves.

Requests are answered at once, by one thread at a time. Rendering the basis, exact answers,
denoising, exports and verification have threads of their own, which publish through `on_message`.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy.typing as npt

from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.solution import Solution
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import (
    BackgroundThreads,
    StoppedError,
    UnsavedRetry,
    error_text,
    lower_priority,
)
from lightpaint.paint.protocol import (
    Message,
    Notice,
    SessionPending,
    SessionState,
    Tone,
)
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.rig.look_comparison import LookComparison
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store
from lightpaint.paint.studio.background_jobs import BackgroundJobs
from lightpaint.paint.studio.exact_answers import (
    ChoiceSolver,
    ExactAnswers,
    OutdatedError,
    raise_outdated,
)
from lightpaint.paint.studio.request_handler import RequestHandler
from lightpaint.paint.studio.session_bases import BackgroundSampling, PlaneDenoiser, SessionBases
from lightpaint.paint.subject import Subject
from lightpaint.progress import cancellable


class Studio:
    """A painting session with its renders and background jobs.

    Args:
        subjects: The views to be painted, under one lighting.
        open_store: Opens the store of their session once their lights are known.

    Attributes:
        publisher: Sends messages that answer no request, and pictures, to pages.
        rig: The lights of the scene and their places.
        on_unsaved: Receives, in plain text, that work cannot be written, and later that it is.
        on_failure: Receives why there is nothing to paint, from another thread.
        failure: That error, afterwards.
    """

    def __init__(
        self, subjects: Sequence[Subject], open_store: Callable[[Identity], Store]
    ) -> None:
        self.subjects = tuple(subjects)
        self.on_unsaved: Callable[[str], None] = lambda _: None
        self.on_failure: Callable[[Exception], None] | None = None
        self.failure: Exception | None = None
        self._access = access = SessionAccess()
        self.publisher = publisher = Publisher(access.lock)
        self._threads = threads = BackgroundThreads(publisher.publish)
        self.rig = LampRig(self.subjects)
        denoiser = PlaneDenoiser(
            publisher.publish_picture,
            lambda: publisher.is_open,
            use_cache=self.subjects[0].settings.use_cache,
        )
        self._mover = LightMover(
            access,
            publisher,
            self.rig,
            threads,
            clean_planes=denoiser.clean_planes,
            on_rendered=lambda: self._exact_answers.notify(),
        )
        self._bases = SessionBases(
            self.subjects,
            open_store,
            access,
            publisher,
            denoiser,
            self._mover,
            on_new_bases=self._show_new_bases,
            warn=self._publish_save_state,
        )
        self._sampling = BackgroundSampling(self.subjects, access, self._bases, publisher)
        self._choices = ChoiceSolver(access, publisher, denoiser.clean_planes)
        self._exact_answers = ExactAnswers(access, publisher, self._follow_exact)
        self._write_retry = UnsavedRetry(lambda: self.store, self._publish_save_state)
        self._comparison = LookComparison(access, publisher, self._mover, threads)
        self._requests = RequestHandler(
            access,
            publisher,
            self._mover,
            self._comparison,
            BackgroundJobs(
                access, publisher, self._mover, threads, clean_planes=denoiser.clean_planes
            ),
            self._exact_answers,
            self._choices,
            threads,
        )

    @property
    def on_message(self) -> Callable[[Message], None] | None:
        """Receiver of messages that answer no request, which come from other threads."""
        return self.publisher.on_message

    @on_message.setter
    def on_message(self, receive: Callable[[Message], None] | None) -> None:
        self.publisher.on_message = receive

    @property
    def session(self) -> Session:
        """The session. Raises PaintError before there is a basis."""
        return self._access.session

    @property
    def store(self) -> Store | None:
        """The session's store; None before there is a basis."""
        return self._access.store

    @property
    def has_scenes(self) -> bool:
        """True if there are scenes, and not only bases."""
        return self.subjects[0].scene is not None

    def start(self) -> None:
        """Start to obtain the bases."""
        self._threads.start(self._obtain_bases, "obtain")
        self._threads.start(self._exact_answers.run, "settle")
        self._threads.start_low_priority(self._choices.run, "choices")
        self._threads.start(self._write_retry.run, "write")

    def close(self) -> None:
        """End the session; all work is kept, even a stroke whose end never arrived."""
        self.publisher.close()
        self._exact_answers.stop()
        self._choices.stop()
        self._sampling.stop()
        self._mover.stop()
        self._comparison.stop()
        self._write_retry.stop()
        with self._access.lock:
            if self._access.current is not None:
                # Everything is stored before any solve, so a pending answer can be dropped.
                with suppress(OutdatedError), cancellable(raise_outdated):
                    self.session.client_left(with_stroke=True)
                self._access.keep_compositions()
                self.session.store.close()

    def wait(self) -> None:
        """Wait, after `close`, until all background work has ended.

        A render that Mitsuba runs in another thread cannot be left alone at the end of a process.
        """
        self._threads.join_all()

    # Requests of a page

    def state(self) -> SessionState | SessionPending:
        """Return the whole state, for a client that connects."""
        return self._requests.state()

    def greet(self, *, is_back: bool) -> Message:
        """Return the state to a page that connects, and keep the open stroke of another page.

        is_back: the page had the session before, and no other since: it resends its open stroke.
        """
        return self._requests.greet(is_back=is_back)

    def handle(
        self, message: protocol.Request, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Return the immediate answers to a request. Raises LightpaintError if it is refused."""
        return self._requests.handle(message, arrays)

    def load(
        self, paintings: Mapping[int, Pixels], requests: SessionRequests, label: str
    ) -> list[Message]:
        """Replace the paintings, by view, and the requests: one step. Returns the `patch` messages.

        Raises LightpaintError for requests that are refused; nothing is changed then.
        """
        return self._requests.load(paintings, requests, label)

    def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture by name. Raises PaintError if there is none."""
        return self._requests.resource(name)

    def snapshot(self) -> SessionSnapshot:
        """Return the current paintings and requests. Raises PaintError before there is a basis."""
        return self._access.snapshot()

    def snapshot_and_lighting(self) -> tuple[SessionSnapshot, Lighting]:
        """Return a snapshot and the last answer. Raises PaintError before there is a basis."""
        return self._access.snapshot_and_lighting()

    # Background

    def _publish_save_state(self, text: str, tone: Tone) -> None:
        """Report whether the work can be written."""
        self.on_unsaved(text)
        self.publisher.publish(Notice(text=text, tone=tone))

    def _follow_exact(self, snapshot: SessionSnapshot, solution: Solution) -> None:
        """Start the work that follows an exact answer and its analysis."""
        self._choices.give(snapshot, solution)
        self._sampling.give(snapshot, solution)

    def _obtain_bases(self) -> None:
        """Obtain bases of more and more samples, and denoise each."""
        lower_priority()
        try:
            self._bases.obtain()
            self._sampling.run()
        except StoppedError:
            pass
        except Exception as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        """Report that bases cannot be obtained; without any, there is nothing to paint."""
        has_session = self._access.current is not None
        is_reported = not has_session and self.on_failure is not None
        self._access.failure_text = error_text(error, at_length=not is_reported)
        self.publisher.publish(Notice(text=self._access.failure_text, tone="warn"))
        if not has_session:
            self.failure = error
            self.publisher.publish_made(self._requests.state)
        if is_reported and self.publisher.is_open:
            self.on_failure(error)  # type: ignore[misc]

    def _show_new_bases(self) -> None:
        """Publish the state with new bases, and renew what was found with the earlier ones."""
        self.publisher.publish_made(self._requests.state)
        self._mover.render_behind()
        self._comparison.renew()
        self._exact_answers.notify()
