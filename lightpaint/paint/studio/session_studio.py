"""The studio: one session, and the background work that runs while the brush moves.

Requests of pages and cells are answered at once, by one thread at a time. Rendering the basis,
exact answers, denoising, exports and verification have threads of their own, which publish through
`on_message`.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Position
from lightpaint.lighting import Lighting, Solution
from lightpaint.paint import background_threads, protocol
from lightpaint.paint.protocol import (
    Message,
    Notice,
    PictureData,
    PreviousAnswer,
    SessionPending,
    SessionState,
    Tone,
)
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.rig.light_placer import LightPlacer
from lightpaint.paint.rig.moved_looks import LookComparison
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.session_state import offer_ground, state_fields
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import Publisher, SessionAccess, StudioLinks
from lightpaint.paint.store.history_steps import Identity, Pixels
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.studio.background_jobs import BackgroundJobs
from lightpaint.paint.studio.console_switch import Console, ConsoleSwitch
from lightpaint.paint.studio.exact_answers import (
    ChoiceSolver,
    ExactAnswers,
    OutdatedError,
    raise_outdated,
)
from lightpaint.paint.studio.file_imports import LayerImports, ReferenceImports
from lightpaint.paint.studio.mixed_pictures import MixedPictures
from lightpaint.paint.studio.plane_measurements import PlaneMeasurements
from lightpaint.paint.studio.session_bases import BackgroundSampling, PlaneDenoiser, SessionBases
from lightpaint.paint.studio.session_exports import FinalRenders
from lightpaint.paint.subject import Subject
from lightpaint.progress import cancellable

#: Requests that need no lights: a session whose lights are not rendered yet keeps them, and
#: answers then.
KEPT_REQUESTS = (
    protocol.Paint
    | protocol.ChangeLayers
    | protocol.Select
    | protocol.DropStroke
    | protocol.Undo
    | protocol.Redo
    | protocol.GoToStep
    | protocol.ListSteps
    | protocol.ClearPainting
    | protocol.StartOver
    | protocol.ConstrainLight
    | protocol.ConstrainLights
    | protocol.TieLights
    | protocol.SetMaster
    | protocol.ShowRig
    | protocol.ChangeSettings
    | protocol.AddReference
    | protocol.DropReference
)


class Studio:
    """A painting session with its renders and background jobs.

    Args:
        subjects: The views to be painted, under one lighting.
        open_store: Opens the store of their session once their lights are known.
        console: The console that its answer can be sent to, if there is one.

    Attributes:
        publisher: Sends messages that answer no request, and pictures, to pages.
        rig: The lights of the scene and their places.
        on_unsaved: Receives, in plain text, that work cannot be written, and later that it is.
        on_failure: Receives why there is nothing to paint, from another thread.
        failure: That error, afterwards.
    """

    def __init__(
        self,
        subjects: Sequence[Subject],
        open_store: Callable[[Identity], Store],
        *,
        console: Console | None = None,
    ) -> None:
        self.subjects = tuple(subjects)
        self.on_unsaved: Callable[[str], None] = lambda _: None
        self.on_failure: Callable[[Exception], None] | None = None
        self.failure: Exception | None = None
        self._access = access = SessionAccess()
        self.publisher = publisher = Publisher(access.lock)
        self._threads = background_threads.BackgroundThreads(publisher.publish)
        links = StudioLinks(access, publisher, self._threads)
        self.rig = LampRig(self.subjects)
        denoiser = PlaneDenoiser(
            publisher.publish_picture,
            lambda: publisher.is_open,
            use_cache=self.subjects[0].settings.use_cache,
        )
        self._mover = LightMover(
            links,
            self.rig,
            clean_planes=denoiser.clean_planes,
            on_rendered=lambda: self._exact_answers.notify(),
        )
        self._bases = SessionBases(
            links,
            self.subjects,
            open_store,
            denoiser,
            self._mover,
            on_new_bases=self._show_new_bases,
            warn=self._publish_save_state,
        )
        self._sampling = BackgroundSampling(links, self.subjects, self._bases)
        self._choices = ChoiceSolver(links, denoiser.clean_planes)
        self._exact_answers = ExactAnswers(links, self._follow_exact)
        self._console = ConsoleSwitch(
            console,
            find_directions=self._directions if self.has_scenes else None,
            warn=lambda text: publisher.publish(Notice(text=text, tone="warn")),
        )
        self._write_retry = background_threads.UnsavedRetry(
            lambda: self.store, self._publish_save_state
        )
        self._comparison = LookComparison(links, self._mover)
        self._mixes = MixedPictures(links)
        self._jobs = BackgroundJobs(links, self._mover, clean_planes=denoiser.clean_planes)
        self._shown_ground = 0  # number of the look under the painting that pages have
        self._layer_imports = LayerImports(links, self._exact_answers.notify)
        self._reference_imports = ReferenceImports(links)
        self._renders = FinalRenders(links, self.subjects, self._jobs.exact_answer)
        self._placer = LightPlacer(links, self.rig, self._hang_lights)
        self._planes = PlaneMeasurements(
            links,
            self.subjects,
            self.rig,
            show=self.state,
            on_measured=self._exact_answers.notify,
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
    def is_ready(self) -> bool:
        """True once the lights of the session are rendered."""
        return self._access.is_ready

    @property
    def has_scenes(self) -> bool:
        """True if there are scenes, and not only bases."""
        return self.subjects[0].scene is not None

    def _directions(self, session: Session) -> Mapping[str, Position]:
        """Return where the lights of a session point, by name."""
        return self.rig.directions(session.requests.placed)

    def start(self) -> None:
        """Start to obtain the bases."""
        self._threads.start(self._obtain_bases, "obtain")
        self._threads.start(self._exact_answers.run, "settle")
        self._threads.start_low_priority(self._choices.run, "choices")
        self._threads.start(self._write_retry.run, "write")

    def close(self) -> None:
        """End the session; all work is kept, even a stroke whose end never arrived."""
        self._console.close()
        self.publisher.close()
        self._exact_answers.stop()
        self._choices.stop()
        self._sampling.stop()
        self._mover.stop()
        self._comparison.stop()
        self._mixes.stop()
        self._planes.stop()
        self._write_retry.stop()
        self._bases.close()
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
        first = self.subjects[0]
        with self._access.lock:
            session = self._access.current
            fields: dict[str, Any] = {
                "version": protocol.VERSION,
                "scene": first.name,
                "folder": str(first.folder.absolute()),
                "can_render": first.scene is not None,
                "can_report": first.scene is not None or len(self.subjects) == 1,
            }
            if session is None or (session.is_waiting and self._access.failure_text):
                progress = self.publisher.last_progress  # of the first picture
                return SessionPending(**fields, text=self._access.failure_text, progress=progress)
            findings = self._exact_answers.findings_of(session)
            choices = self._choices.choices_at(session.version)
            fields |= {"answer": findings, "weights": session.weights, "choices": choices}
            return SessionState(**fields, **self._state_fields(session), **session.edit_state)

    def _state_fields(self, session: Session) -> dict[str, Any]:
        """Return fields of the state, including fields of background jobs."""
        painted = [view.name for view in session.views if view.is_painted]
        sensors = [""] if len(session.views) == 1 else painted
        return {
            **state_fields(
                session,
                self.publisher.pictures,
                self._access.looks,
                target_spp=self.subjects[0].target_spp,
                addresses=self._console.addresses,
            ),
            "renders": self._renders.infos,
            "console": self._console.info,
            "verifications": self._jobs.verifications(session.version),
            "command": self._jobs.solve_command(sensors, session.requests),
        }

    def greet(self, *, is_back: bool) -> Message:
        """Return the state to a page that connects, and keep the open stroke of another page.

        is_back: the page had the session before, and no other since: it resends its open stroke.
        """
        with self._access.lock:
            session = self._access.current
            if session is not None and session.is_open:
                self.rig.step = 1
                session.client_left(with_stroke=not is_back)
                self._mover.follow(self.publisher.publish)
                self._exact_answers.notify()
            state = self.state()
            return replace(state, is_back=is_back)

    def handle(
        self, message: protocol.Request, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Return the immediate answers to a request. Raises LightpaintError if it is refused."""
        if isinstance(message, protocol.Hello | protocol.TakeOver):
            return [self.greet(is_back=True)]
        if isinstance(message, protocol.Fetch):
            return [PictureData(name=message.name, data=self.resource(message.name))]
        with self._access.lock:
            is_kept = isinstance(message, KEPT_REQUESTS)
            session = self._access.session if is_kept else self._access.ready_session
            looks = self._access.looks
            view, self.rig.step = 0, 1
            version = session.version
            if isinstance(message, protocol.MoveLights | protocol.PointLight):
                view = session.views[message.view].view  # before anything has moved
                self.rig.step = 1 if message.is_final else message.step
            match message:
                case protocol.SaveLook() | protocol.RenameLook() | protocol.CopyLook():
                    return [looks.handle(message)]
                case protocol.MixLooks() | protocol.DropLook() | protocol.Propose():
                    return [looks.handle(message)]
                case protocol.ListSteps():
                    steps = session.history.list_steps(message.count)
                    return [replace(steps, searches=self._placer.notes.listed())]
                case protocol.ShowPrevious():
                    return [PreviousAnswer(weights=session.history.previous_weights())]
                case protocol.MixLights():
                    return self._mixes.handle(message, arrays)
                case protocol.CompareLooks():
                    return self._comparison.handle(message)
                case protocol.Export() | protocol.Verify() | protocol.Explain():
                    return self._jobs.handle(message)
                case protocol.RenderFinal() | protocol.StopRender() | protocol.DropRender():
                    return self._renders.handle(message)
                case protocol.SwitchConsole() | protocol.BlackOut():
                    return self._console.handle(message, session)
                case protocol.ImportLayers():
                    return self._layer_imports.handle(message, arrays)
                case protocol.AddReference() | protocol.DropReference():
                    return self._reference_imports.handle(message, arrays)
                case protocol.Preview():
                    return self._jobs.start_preview(message, session.preview_requests(message))
                case protocol.ShowRig():
                    return self._mover.show_rig()
                case protocol.PlaceLights():
                    return self._placer.handle(message)
                case protocol.EstimatePlaces():
                    return self._placer.estimate(message)
                case protocol.PointLight():
                    messages = session.handle(self._mover.move_of(message), arrays)
                case protocol.AddLight():
                    name, values = self._mover.hang(message)
                    messages = session.hang_lights(f"add {name}", {name: values})
                case protocol.LoadLook():
                    messages = looks.load(message)
                case _:
                    messages = session.handle(message, arrays)
            messages = self._show_moves(messages, view=view)
            if isinstance(message, protocol.Paint):
                messages = self._mixes.with_draft(message, messages)
            has_changed = session.version != version
            if has_changed:
                self._console.follow(session)
        if has_changed:  # a selection changes no light
            self._exact_answers.notify()
            self._planes.follow()
        return messages

    def _show_moves(
        self,
        messages: list[Message],
        send: Callable[[Message], None] | None = None,
        *,
        view: int = 0,
    ) -> list[Message]:
        """Show the lights that a request has moved, and return its answers.

        These are the whole state if lights were added or removed, or if another look lies under the
        painting. send: receives messages about moved lights; by default they are published at once.
        view: as in `LightMover.follow`.
        """
        has_others = self._mover.follow(send or self.publisher.publish, view)
        has_others |= self._offer_new_ground()
        return [self.state(), *self._mover.rig_messages()] if has_others else messages

    def _offer_new_ground(self) -> bool:
        """Offer the look under the painting if it is another; return whether it is."""
        session = self._access.session
        if session.ground == self._shown_ground:
            return False
        self._shown_ground = session.ground
        for view in session.views:
            offer_ground(self.publisher.pictures, view, session.transform)
        return True

    def _hang_lights(self, label: str, placed: Placed, before: Placed) -> bool:
        """Move lights and add others, by name, in one step, and notify pages.

        before: their expected places; returns False, and changes nothing, if these have changed.
        """

        def hang() -> list[Message]:
            if self._access.session.requests.placed != before:
                return []
            news: list[Message] = []
            answers = self._show_moves(self._access.session.hang_lights(label, placed), news.append)
            return [*news, *answers]

        is_done = bool(self.publisher.publish_all_made(hang))
        if is_done:
            self._exact_answers.notify()
            self._planes.follow()
        return is_done

    def load(
        self, paintings: Mapping[int, Pixels], requests: SessionRequests, label: str
    ) -> list[Message]:
        """Replace the paintings, by view, and the requests: one step. Returns the `patch` messages.

        Raises LightpaintError for requests that are refused; nothing is changed then.
        """
        with self._access.lock:
            messages = self._show_moves(self._access.session.load(paintings, requests, label))
        self._exact_answers.notify()
        self._planes.follow()
        return messages

    def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture by name. Raises PaintError if there is none."""
        with self._access.lock:
            return self.publisher.pictures[name]

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
        """Start the work that follows an exact answer and its analysis, and show it."""
        with self._access.lock:
            self._console.follow(self._access.session)
        self._choices.give(snapshot, solution)
        self._sampling.give(snapshot, solution)

    def _obtain_bases(self) -> None:
        """Obtain bases of more and more samples, and denoise each."""
        background_threads.lower_priority()
        try:
            self._bases.obtain()
            self._sampling.run()
        except background_threads.StoppedError:
            pass
        except Exception as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        """Report that bases cannot be obtained; without any, there is nothing to paint."""
        is_ready = self._access.is_ready
        is_reported = not is_ready and self.on_failure is not None
        self._access.failure_text = background_threads.error_text(error, at_length=not is_reported)
        self.publisher.publish(Notice(text=self._access.failure_text, tone="warn"))
        if not is_ready:
            self.failure = error
            self.publisher.publish_made(self.state)
        if is_reported and self.publisher.is_open:
            self.on_failure(error)  # type: ignore[misc]

    def _show_new_bases(self) -> None:
        """Publish the state with new bases, and renew what was found with the earlier ones."""
        self.publisher.publish_made(self.state)
        if not self._access.is_ready:
            return
        self._mover.render_behind()
        self._comparison.renew()
        self._exact_answers.notify()
        self._planes.follow()
