"""Answers to the requests of pages and cells, which one thread at a time makes at once."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from lightpaint.paint import protocol
from lightpaint.paint.background_threads import BackgroundThreads
from lightpaint.paint.protocol import (
    Message,
    PictureData,
    PreviousAnswer,
    SessionPending,
    SessionState,
)
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.rig.light_placer import LightPlacer
from lightpaint.paint.rig.look_comparison import LookComparison
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.session_state import offer_ground, state_fields
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.studio.background_jobs import BackgroundJobs
from lightpaint.paint.studio.exact_answers import ChoiceSolver, ExactAnswers
from lightpaint.paint.studio.file_imports import LayerImports, ReferenceImports
from lightpaint.paint.studio.final_renders import FinalRenders


class RequestHandler:
    """The requests that a studio answers, each to the part that it is about.

    Args:
        access: The session.
        publisher: Sends messages that answer no request, and has the pictures.
        mover: Moves lights, and adds them by hand.
        comparison: Shows looks whose lights hang elsewhere.
        jobs: Exports, verifies, explains and previews.
        exact_answers: Looks for a new answer after each change.
        choices: Has the answers with other light colours.
        threads: Runs searches for places of lights.
    """

    def __init__(
        self,
        access: SessionAccess,
        publisher: Publisher,
        mover: LightMover,
        comparison: LookComparison,
        jobs: BackgroundJobs,
        exact_answers: ExactAnswers,
        choices: ChoiceSolver,
        threads: BackgroundThreads,
    ) -> None:
        self._access, self._publisher = access, publisher
        self._mover, self._jobs, self._exact_answers = mover, jobs, exact_answers
        self._comparison, self._choices = comparison, choices
        self._shown_ground = 0  # number of the look under the painting that pages have
        self._subjects = mover.rig.subjects
        self._imports = LayerImports(access, publisher, threads, exact_answers.notify)
        self._references = ReferenceImports(access, publisher, threads)
        self._renders = FinalRenders(access, publisher, threads, self._subjects, jobs.exact_answer)
        self._placer = LightPlacer(access, publisher, mover.rig, threads, self._hang_lights)

    def state(self) -> SessionState | SessionPending:
        """Return the whole state, for a client that connects."""
        first = self._subjects[0]
        with self._access.lock:
            session = self._access.current
            fields: dict[str, Any] = {
                "version": protocol.VERSION,
                "scene": first.name,
                "folder": str(first.folder.absolute()),
                "can_render": first.scene is not None,
                "can_report": first.scene is not None or len(self._subjects) == 1,
            }
            if session is None:
                progress = self._publisher.last_progress  # of the first picture
                return SessionPending(**fields, text=self._access.failure_text, progress=progress)
            findings = self._exact_answers.findings_of(session)
            choices = self._choices.choices_at(session.version)
            fields |= {"answer": findings, "weights": session.weights, "choices": choices}
            return SessionState(**fields, **self._state_fields(session), **session.edit_state)

    def greet(self, *, is_back: bool) -> Message:
        """Return the state to a page that connects, and keep the open stroke of another page.

        is_back: the page had the session before, and no other since: it resends its open stroke.
        """
        with self._access.lock:
            session = self._access.current
            if session is not None and session.is_open:
                self._mover.rig.step = 1
                session.client_left(with_stroke=not is_back)
                self._mover.follow(self._publisher.publish)
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
            session, looks = self._access.session, self._access.looks
            view, self._mover.rig.step = 0, 1
            version = session.version
            if isinstance(message, protocol.MoveLights | protocol.PointLight):
                view = session.views[message.view].view  # before anything has moved
                self._mover.rig.step = 1 if message.is_final else message.step
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
                case protocol.CompareLooks():
                    return self._comparison.handle(message)
                case protocol.Export() | protocol.Verify() | protocol.Explain():
                    return self._jobs.handle(message)
                case protocol.RenderFinal() | protocol.StopRender() | protocol.DropRender():
                    return self._renders.handle(message)
                case protocol.ImportLayers():
                    return self._imports.handle(message, arrays)
                case protocol.AddReference() | protocol.DropReference():
                    return self._references.handle(message, arrays)
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
            has_changed = session.version != version
        if has_changed:  # a selection changes no light
            self._exact_answers.notify()
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
        painting. send: receives messages about
        moved lights; by default they are published at once. view: as in `LightMover.follow`.
        """
        has_others = self._mover.follow(send or self._publisher.publish, view)
        has_others |= self._offer_new_ground()
        return [self.state(), *self._mover.rig_messages()] if has_others else messages

    def _offer_new_ground(self) -> bool:
        """Offer the look under the painting if it is another; return whether it is."""
        session = self._access.session
        if session.ground == self._shown_ground:
            return False
        self._shown_ground = session.ground
        for view in session.views:
            offer_ground(self._publisher.pictures, view, session.transform)
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

        is_done = bool(self._publisher.publish_all_made(hang))
        if is_done:
            self._exact_answers.notify()
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
        return messages

    def resource(self, name: str) -> npt.NDArray[Any]:
        """Return a picture by name. Raises PaintError if there is none."""
        with self._access.lock:
            return self._publisher.pictures[name]

    def _state_fields(self, session: Session) -> dict[str, Any]:
        """Return fields of the state, including those of background jobs."""
        painted = [view.name for view in session.views if view.is_painted]
        sensors = [""] if len(session.views) == 1 else painted
        return {
            **state_fields(
                session,
                self._publisher.pictures,
                self._access.looks,
                target_spp=self._subjects[0].target_spp,
            ),
            "renders": self._renders.infos,
            "verifications": self._jobs.verifications(session.version),
            "command": self._jobs.solve_command(sensors, session.requests),
        }
