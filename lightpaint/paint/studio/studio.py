"""The studio: one session, and the background work that runs while the brush moves.

Requests are answered at once, by one thread at a time. Rendering the basis, exact answers,
denoising, exports and verification have threads of their own, which publish through `on_message`.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from threading import RLock
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache.denoised_planes import DenoisedPlanes
from lightpaint.errors import PaintError
from lightpaint.lighting.answer.lighting import Lighting
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
    PictureData,
    PictureUpdate,
    ProgressReport,
    SessionPending,
    SessionState,
    Tone,
)
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.rig.light_placer import LightPlacer
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.picture_table import Picture, PictureTable
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.session_state import offered_transforms, state_fields
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session.view_pictures import offer_layers, offer_transforms, offer_view
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store
from lightpaint.paint.studio.background_jobs import BackgroundJobs
from lightpaint.paint.studio.background_sampling import BackgroundSampling
from lightpaint.paint.studio.exact_answers import ExactAnswers, OutdatedError, raise_outdated
from lightpaint.paint.studio.plane_denoiser import PlaneDenoiser
from lightpaint.paint.subject import Subject, obtain_bases, painting_transform
from lightpaint.progress import cancellable
from lightpaint.scene.runtime.render_lock import MITSUBA


class Studio:
    """A painting session with its renders and background jobs.

    Args:
        subjects: The views to be painted, under one lighting.
        open_store: Opens the store of their session once their lights are known.

    Attributes:
        on_message: Receives messages that answer no request, from other threads.
        on_unsaved: Receives, in plain text, that work cannot be written, and later that it is.
        on_failure: Receives why there is nothing to paint, from another thread.
        failure: That error, afterwards.
    """

    def __init__(
        self, subjects: Sequence[Subject], open_store: Callable[[Identity], Store]
    ) -> None:
        self.subjects, self._open_store = tuple(subjects), open_store
        self.on_message: Callable[[Message], None] | None = None
        self.on_unsaved: Callable[[str], None] = lambda _: None
        self.on_failure: Callable[[Exception], None] | None = None
        self.failure: Exception | None = None
        self.pictures = PictureTable()
        self._session: Session | None = None
        self._looks: LookLibrary | None = None
        self._progress: ProgressReport | None = None  # of the first picture
        self._lock, self.is_open, self._failed = RLock(), True, ""
        # Locks are taken in this order: `_publish_lock`, which keeps messages in order; a lock of
        # the receiver, as the notebook has; `_lock`. So a background thread sends no message while
        # it holds `_lock`. Whoever handles a request holds the receiver's lock already.
        self._publish_lock = RLock()
        self._denoiser = PlaneDenoiser(
            self.publish_picture,
            lambda: self.is_open,
            use_cache=self.subjects[0].settings.use_cache,
        )
        self._sampling = BackgroundSampling(self)
        self._exact_answers = ExactAnswers(self, self._sampling.give)
        self._write_retry = UnsavedRetry(lambda: self.store, self._publish_save_state)
        self._threads = BackgroundThreads(self.publish)
        self._jobs = BackgroundJobs(self, self._threads)
        self._mover = LightMover(self, LampRig(self.subjects), self._threads)
        self._placer = LightPlacer(self, self._mover.rig, self._threads)

    @property
    def session(self) -> Session:
        """The session. Raises PaintError before there is a basis."""
        if self._session is None:
            raise PaintError(self._failed or "the first picture is still being rendered")
        return self._session

    @property
    def version(self) -> int:
        """Number that grows with every change. Raises PaintError before there is a basis."""
        return self.session.version

    @property
    def store(self) -> Store | None:
        """The session's store; None before there is a basis."""
        return None if self._session is None else self._session.store

    @property
    def has_scenes(self) -> bool:
        """True if there are scenes, and not only bases."""
        return self.subjects[0].scene is not None

    def start(self) -> None:
        """Start to obtain the bases."""
        self._threads.start(self._obtain_bases, "obtain")
        self._threads.start(self._exact_answers.run, "settle")
        self._threads.start(self._write_retry.run, "write")

    def close(self) -> None:
        """End the session; all work is kept, even a stroke whose end never arrived."""
        self.is_open = False
        self._exact_answers.stop()
        self._sampling.stop()
        self._mover.stop()
        self._write_retry.stop()
        with self._lock:
            if self._session is not None:
                # Everything is stored before any solve, so a pending answer can be dropped.
                with suppress(OutdatedError), cancellable(raise_outdated):
                    self._session.client_left(with_stroke=True)
                self._session.store.close()

    def wait(self) -> None:
        """Wait, after `close`, until all background work has ended.

        A render that Mitsuba runs in another thread cannot be left alone at the end of a process.
        """
        self._threads.join_all()

    # Requests of a page

    def state(self) -> SessionState | SessionPending:
        """Return the whole state, for a client that connects."""
        first = self.subjects[0]
        with self._lock:
            session = self._session
            fields: dict[str, Any] = {
                "version": protocol.VERSION,
                "scene": first.name,
                "folder": str(first.folder.absolute()),
                "can_render": self.has_scenes,
                "can_report": self.has_scenes or len(self.subjects) == 1,
            }
            if session is None:
                return SessionPending(**fields, text=self._failed, progress=self._progress)
            findings = self._exact_answers.findings_of(session)
            fields |= {"answer": findings, "weights": session.weights}
            return SessionState(**fields, **self._state_fields(session), **session.edit_state)

    def greet(self, *, is_back: bool) -> Message:
        """Return the state to a page that connects, and keep the open stroke of another page.

        is_back: the page had the session before, and no other since: it resends its open stroke.
        """
        with self._lock:
            if self._session is not None and self._session.is_open:
                self._session.client_left(with_stroke=not is_back)
                self._mover.follow(self.publish)
                self._exact_answers.notify()
            state = self.state()
            return replace(state, is_back=is_back)

    def handle(
        self, message: protocol.AnyRequest, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Return the immediate answers to a request. Raises LightpaintError if it is refused."""
        if isinstance(message, protocol.Hello | protocol.TakeOver):
            return [self.greet(is_back=True)]
        if isinstance(message, protocol.Fetch):
            return [PictureData(name=message.name, data=self.resource(message.name))]
        with self._lock:
            session, looks = self.session, self._looks
            assert looks is not None
            match message:
                case protocol.SaveLook() | protocol.RenameLook() | protocol.CopyLook():
                    return [looks.handle(message)]
                case protocol.MixLooks() | protocol.DropLook() | protocol.Propose():
                    return [looks.handle(message)]
                case protocol.Export() | protocol.Verify() | protocol.Explain():
                    return self._jobs.handle(message)
                case protocol.Preview():
                    return self._jobs.start_preview(message, session.preview_requests(message))
                case protocol.ShowRig():
                    return self._mover.show_rig()
                case protocol.PlaceLights():
                    return self._placer.handle(message)
                case protocol.PointLight():
                    messages = session.handle(self._mover.move_of(message), arrays)
                case protocol.AddLight():
                    name, values = self._mover.hang(message)
                    messages = session.hang_lights(f"add {name}", {name: values})
                case protocol.LoadLook():
                    messages = looks.load(message)
                case _:
                    messages = session.handle(message, arrays)
            messages = self._followed(messages)
        self._exact_answers.notify()
        return messages

    def _followed(
        self, messages: list[Message], send: Callable[[Message], None] | None = None
    ) -> list[Message]:
        """Return the answers to a request, after lights have followed it: the whole state where
        some have come or gone.

        send: receives messages about these lights; by default they are published at once.
        """
        has_others = self._mover.follow(send or self.publish)
        return [self.state(), *self._mover.rig_messages()] if has_others else messages

    def hang_lights(self, label: str, placed: Placed, *, before: Placed) -> bool:
        """Move lights and add others, by name, in one step, and notify pages.

        before: their expected places; returns False, and changes nothing, if these have changed.
        """
        with self._publish_lock:
            with self._lock:
                if self.session.requests.placed != before:
                    return False
                news: list[Message] = []
                answers = self._followed(self.session.hang_lights(label, placed), news.append)
            for message in (*news, *answers):
                self.publish(message)
        self._exact_answers.notify()
        return True

    def snapshot(self) -> SessionSnapshot:
        """Return the current paintings and requests. Raises PaintError before there is a basis."""
        with self._lock:
            return self.session.snapshot()

    def snapshot_and_lighting(
        self, requests: SessionRequests | None = None
    ) -> tuple[SessionSnapshot, Lighting]:
        """Return a snapshot and the last answer. requests: replace the session's, if given."""
        with self._lock:
            session = self.session
            snapshot = session.snapshot() if requests is None else session.snapshot(requests)
            weights = session.weights
        return snapshot, Lighting.of_weights(snapshot.bases[0], weights)

    def load(
        self, paintings: Mapping[int, Pixels], requests: SessionRequests, label: str
    ) -> list[Message]:
        """Replace the paintings, by view, and the requests: one step. Returns the `patch` messages.

        Raises LightpaintError for requests that are refused; nothing is changed then.
        """
        with self._lock:
            messages = self._followed(self.session.load(paintings, requests, label))
        self._exact_answers.notify()
        return messages

    def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture by name. Raises PaintError if there is none."""
        with self._lock:
            return self.pictures[name]

    # Background

    def publish(self, message: Message | None) -> None:
        """Send a message to the page, if there is one."""
        if message is not None and self.on_message is not None and self.is_open:
            self.on_message(message)

    def publish_made(self, make: Callable[[], Message | None]) -> None:
        """Make a message under the lock and send it, in the order in which messages were made."""
        with self._publish_lock:
            with self._lock:
                message = make()
            self.publish(message)

    def clean_planes(self, bases: Sequence[Basis]) -> Sequence[DenoisedPlanes | None]:
        """Return the denoised planes of these bases; None for each that has none yet."""
        if any(basis.former is not None for basis in bases):
            return [None] * len(bases)
        return self._denoiser.planes_for(bases)

    def denoised(self, bases: Sequence[Basis]) -> Sequence[DenoisedPlanes | None]:
        """Return the denoised planes of bases without moved lights; None for each that has none."""
        return self._denoiser.planes_for(bases)

    def planes_rendered(self) -> None:
        """Note that rendered planes have replaced quick ones."""
        self._exact_answers.notify()

    def finish_planes(self, check: Callable[[], None]) -> None:
        """Replace the quick planes of moved lights by rendered ones. check: raises to stop."""
        self._mover.finish(self.session.requests.placed, check)

    @property
    def unmoved_bases(self) -> tuple[Basis, ...]:
        """Bases of all views, with every light at its place in the scene."""
        return self.session.bases

    @property
    def rig(self) -> LampRig:
        """The lights and their places."""
        return self._mover.rig

    def publish_picture(self, name: str, picture: Picture) -> None:
        """Store a picture and tell the page that there is a new one."""

        def renewed() -> Message:
            self.pictures.put(name, picture)
            return PictureUpdate(resources={name: self.pictures.generations[name]})

        self.publish_made(renewed)

    def report_progress(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report how far a task is. Raises StoppedError once the studio is closed."""
        if not self.is_open:
            raise StoppedError
        report = ProgressReport(task=label, done=done, total=total, unit=unit)
        if self._session is None:
            self._progress = report
        with MITSUBA.aside():  # the receiver may wait for a render of its own
            self.publish(report)

    def _publish_save_state(self, text: str, tone: Tone) -> None:
        """Report whether the work can be written."""
        self.on_unsaved(text)
        self.publish(Notice(text=text, tone=tone))

    def _obtain_bases(self) -> None:
        """Obtain bases of more and more samples, and denoise each."""
        lower_priority()
        try:
            with MITSUBA.low_priority():
                for bases in obtain_bases(self.subjects, self.report_progress):
                    self.use_bases(bases)
                    self._denoiser.denoise(self.session)
            self.publish(ProgressReport(task="basis", done=1, total=1, unit=""))
            self._denoiser.write_cache()
            self._sampling.run()
        except StoppedError:
            pass
        except Exception as error:
            is_reported = self._session is None and self.on_failure is not None
            self._failed = error_text(error, at_length=not is_reported)
            self.publish(Notice(text=self._failed, tone="warn"))
            if self._session is None:
                self.failure = error
                self.publish_made(self.state)
            if is_reported and self.is_open:
                self.on_failure(error)  # type: ignore[misc]

    def denoise_planes(self) -> None:
        """Denoise the planes of the current bases, where that is not done yet, and keep them."""
        self._denoiser.denoise(self.session)
        self._denoiser.write_cache()

    def use_bases(self, bases: Sequence[Basis]) -> None:
        """Continue the session with these bases."""
        current_looks = self._denoiser.load_cached(bases)
        clean_planes = self._denoiser.planes_for(bases)
        small_planes = self._denoiser.small_planes_for(bases)
        with self._lock:
            if not self.is_open:
                raise StoppedError
            if self._session is None:
                self._session, self._looks = self._make_session(bases, current_looks)
            else:
                self._session.improve(bases, current_looks)
            session = self._session
            of_views = session.views, bases, clean_planes, small_planes
            for view, basis, clean, small in zip(*of_views, strict=True):
                offer_view(self.pictures, view, basis, session.transform, clean, small)
            offer_transforms(self.pictures, offered_transforms(session))
            offer_layers(self.pictures, session.views)
            self._mover.offer_all(session)
        self.publish_made(self.state)
        self._mover.render_behind()
        self._exact_answers.notify()

    def _make_session(
        self, bases: Sequence[Basis], current_looks: Sequence[Floats]
    ) -> tuple[Session, LookLibrary]:
        """Return the session of the first bases, and its looks. Raises LightpaintError."""
        store = self._open_store(Identity.of(bases))
        try:
            session = Session(
                bases,
                current_looks,
                store,
                settings=self.subjects[0].settings,
                transform=painting_transform(self.subjects, bases),
                constraints=self.subjects[0].constraints,
                plane_source=self._mover.rig if self.has_scenes else None,
            )
            looks = LookLibrary(session, self.pictures)
            for remark in store.remarks:
                self._publish_save_state(remark, "warn")
            return session, looks
        except BaseException:
            store.close()  # free for the next try, for example with other constraints
            raise

    def _state_fields(self, session: Session) -> dict[str, Any]:
        """Return fields of the state, including those of background jobs."""
        assert self._looks is not None
        painted = [view.name for view in session.views if view.is_painted]
        sensors = [""] if len(session.views) == 1 else painted
        return {
            **state_fields(
                session, self.pictures, self._looks, target_spp=self.subjects[0].target_spp
            ),
            "verifications": self._jobs.verifications(session.version),
            "command": self._jobs.solve_command(sensors, session.requests),
        }

    def session_at_rest(self) -> tuple[Session, SessionSnapshot] | None:
        """Return session and snapshot; None before there is a basis and while a stroke is open."""
        with self._lock:
            session = self._session
            return None if session is None or session.is_open else (session, session.snapshot())
