"""Where somebody paints: a session, and all that goes on beside it while the brush moves.

Answers to messages come at once, from one thread at a time. The basis that is still being
rendered, exact answers, clean planes, exports and the verifying render have threads of their own,
which say what has come of them through `on_message`.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from threading import RLock
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes
from lightpaint.errors import PaintError
from lightpaint.lighting.analysis.analysis import analyse
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.paint import protocol
from lightpaint.paint.background_jobs import Errands
from lightpaint.paint.background_threads import (
    Settling,
    StoppedError,
    Threads,
    Writing,
    give_way,
    told,
)
from lightpaint.paint.plane_denoiser import Cleaning
from lightpaint.paint.protocol import (
    AnswerUpdate,
    Message,
    Notice,
    PictureData,
    PictureUpdate,
    ProgressReport,
    SampleCount,
    SessionPending,
    SessionState,
    TableInfo,
    Tone,
    TransformInfo,
)
from lightpaint.paint.session import picture_table as pictures
from lightpaint.paint.session.answer_messages import judgement, light_info
from lightpaint.paint.session.look_library import Looks
from lightpaint.paint.session.picture_table import Picture, Pictures
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.snapshot import Moment
from lightpaint.paint.session.view_pictures import offer_transforms, offer_view, view_info
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.paint.store.steps import Identity
from lightpaint.paint.store.store import Store
from lightpaint.paint.subject import Subject, bases_of, transform_of
from lightpaint.progress import while_wanted
from lightpaint.scene.runtime.render_lock import MITSUBA


class OldError(Exception):
    """Somebody has painted on, or left."""


def _give_up() -> None:
    """Have work end that nobody waits for."""
    raise OldError


class Studio:
    """Views under the brush.

    Args:
        subjects: What is painted: views of one lighting.
        open_store: The store of a session of them, opened when their lights are known.

    Attributes:
        on_message: Hears what is said unasked, from other threads.
        on_unsaved: Hears, in plain text, that what is done cannot be written, and that it is.
        on_failure: Hears why there is nothing to paint, from another thread.
        failure: The same, afterwards.
    """

    def __init__(
        self, subjects: Sequence[Subject], open_store: Callable[[Identity], Store]
    ) -> None:
        self.subjects, self._open_store = tuple(subjects), open_store
        self.on_message: Callable[[Message], None] | None = None
        self.on_unsaved: Callable[[str], None] = lambda _: None
        self.on_failure: Callable[[Exception], None] | None = None
        self.failure: Exception | None = None
        self.pictures = Pictures()
        self._session: Session | None = None
        self._looks: Looks | None = None
        self._known: AnswerUpdate | None = None  # the last exact answer, as it was said
        self._progress: ProgressReport | None = None  # of the first picture
        self._lock, self._is_open, self._failed = RLock(), True, ""
        self._telling = RLock()  # taken before the other, by whoever tells of what it made
        self._cleaning = Cleaning(
            self.put, lambda: self._is_open, use_cache=self.subjects[0].settings.use_cache
        )
        self._settling = Settling(self._find, self.tell)
        self._writing = Writing(lambda: self.store, self._tell_kept)
        self._threads = Threads(self.tell)
        self._errands = Errands(self, self._threads)

    @property
    def session(self) -> Session:
        """What is painted. Raises PaintError before there is a basis."""
        if self._session is None:
            raise PaintError(self._failed or "the first picture is still being rendered")
        return self._session

    @property
    def version(self) -> int:
        """A number that grows with every change. Raises PaintError before there is a basis."""
        return self.session.version

    @property
    def store(self) -> Store | None:
        """Where it is kept; None before there is a basis."""
        return None if self._session is None else self._session.store

    @property
    def renders(self) -> bool:
        """Whether there are scenes, and not only bases of them."""
        return self.subjects[0].scene is not None

    def start(self) -> None:
        """Begin to obtain the bases."""
        self._threads.begin(self._obtain, "obtain")
        self._threads.begin(self._settling.settle, "settle")
        self._threads.begin(self._writing.watch, "write")

    def close(self) -> None:
        """End; all that was done is kept, also of a stroke whose end was never heard."""
        self._is_open = False
        self._settling.end()
        self._writing.end()
        with self._lock:
            if self._session is not None:
                # All is kept before anything is solved, and nobody asks for the answer any more.
                with suppress(OldError), while_wanted(_give_up):
                    self._session.left(with_stroke=True)
                self._session.store.close()

    def wait(self) -> None:
        """Until what went on beside it has come to an end, once it is closed.

        What Mitsuba is at in another thread cannot be left alone at the end of a process.
        """
        self._threads.wait()

    # What a page asks

    def state(self) -> SessionState | SessionPending:
        """All there is, for a client that begins."""
        first = self.subjects[0]
        with self._lock:
            session = self._session
            about: dict[str, Any] = {
                "version": protocol.VERSION,
                "scene": first.name,
                "folder": str(first.folder.absolute()),
                "can_render": self.renders,
                "can_report": self.renders or len(self.subjects) == 1,
            }
            if session is None:
                return SessionPending(**about, text=self._failed, progress=self._progress)
            found, known = session.findings, self._known
            if known is not None and known.version == session.version:
                found = known.findings
            about |= {"answer": found, "weights": session.weights}
            return SessionState(**about, **self._of_session(session), **session.about)

    def greet(self, *, is_back: bool) -> Message:
        """The state, for a page that begins. What another one had begun is kept as it was left.

        is_back: it was there before, and nobody since: it sends what it has of a stroke again.
        """
        with self._lock:
            if self._session is not None and self._session.is_open:
                self._session.left(with_stroke=not is_back)
                self._settling.ring()
            state = self.state()
            return replace(state, is_back=is_back)

    def said(self, message: protocol.Said, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Message]:
        """What comes of a message at once. Raises LightpaintError for what cannot be done."""
        if isinstance(message, protocol.Hello | protocol.TakeOver):
            return [self.greet(is_back=True)]
        if isinstance(message, protocol.Fetch):
            return [PictureData(name=message.name, data=self.resource(message.name))]
        with self._lock:
            session, looks = self.session, self._looks
            assert looks is not None
            match message:
                case protocol.SaveLook() | protocol.RenameLook() | protocol.CopyLook():
                    return [looks.said(message)]
                case protocol.MixLooks() | protocol.DropLook() | protocol.Propose():
                    return [looks.said(message)]
                case protocol.Export() | protocol.Verify() | protocol.Explain():
                    return self._errands.said(message)
                case protocol.Preview():
                    return self._errands.foresee(message, session.changed_by(message))
                case protocol.LoadLook():
                    made = looks.load(message)
                case _:
                    made = session.said(message, arrays)
        self._settling.ring()
        return made

    def moment(self) -> Moment:
        """What is painted and asked now. Raises PaintError before there is a basis."""
        with self._lock:
            return self.session.moment()

    def now(self, wishes: Wishes | None = None) -> tuple[Moment, Lighting]:
        """The same, and the last answer. wishes: to be asked instead of what is asked now."""
        with self._lock:
            session = self.session
            moment = session.moment() if wishes is None else session.moment(wishes)
            weights = session.weights
        return moment, Lighting.of_weights(moment.bases[0], weights)

    def load(self, paintings: Mapping[int, Pixels], wishes: Wishes, label: str) -> list[Message]:
        """Go on from other paintings, by view, and what was asked with them: one step, `patch`.

        Raises LightpaintError for what cannot be asked, and has changed nothing then.
        """
        with self._lock:
            made = self.session.load(paintings, wishes, label)
        self._settling.ring()
        return made

    def resource(self, name: str) -> npt.NDArray[Any]:
        """A picture by name. Raises PaintError if there is none."""
        with self._lock:
            return self.pictures[name]

    # Beside it

    def tell(self, message: Message | None) -> None:
        """Say it to the page, if there is one."""
        if message is not None and self.on_message is not None and self._is_open:
            self.on_message(message)

    def _tell_of(self, make: Callable[[], Message | None]) -> None:
        """Say what is made of what there is, in the order in which it came about."""
        with self._telling:
            with self._lock:
                message = make()
            self.tell(message)

    def clean(self, bases: Sequence[Basis]) -> Sequence[CleanPlanes | None]:
        """Clean planes of these, where they have been made."""
        return self._cleaning.shown(bases)

    def put(self, name: str, picture: Picture) -> None:
        """A picture from now on, of which the page is told."""

        def renewed() -> Message:
            self.pictures.put(name, picture)
            return PictureUpdate(resources={name: self.pictures.generations[name]})

        self._tell_of(renewed)

    def hears(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """How far something is. Raises StoppedError where it has ended."""
        if not self._is_open:
            raise StoppedError
        about = ProgressReport(what=label, done=done, total=total, unit=unit)
        if self._session is None:
            self._progress = about
        with MITSUBA.aside():  # whoever hears it may wait for a render of its own
            self.tell(about)

    def _tell_kept(self, text: str, tone: Tone) -> None:
        """Whether what is done can be written."""
        self.on_unsaved(text)
        self.tell(Notice(text=text, tone=tone))

    def _obtain(self) -> None:
        """The bases, better and better."""
        give_way()
        try:
            with MITSUBA.at_leisure():
                for bases in bases_of(self.subjects, self.hears):
                    self._take(bases)
                    self._cleaning.make(self.session.views)
            self.tell(ProgressReport(what="basis", done=1, total=1, unit=""))
            self._cleaning.keep()
        except StoppedError:
            pass
        except Exception as error:
            is_told = self._session is None and self.on_failure is not None
            self._failed = told(error, at_length=not is_told)
            self.tell(Notice(text=self._failed, tone="warn"))
            if self._session is None:
                self.failure = error
                self._tell_of(self.state)
            if is_told and self._is_open:
                self.on_failure(error)  # type: ignore[misc]

    def _take(self, bases: Sequence[Basis]) -> None:
        """Paint on with these bases."""
        presents = self._cleaning.begin(bases)
        shown = self._cleaning.shown(bases)
        with self._lock:
            if not self._is_open:
                raise StoppedError
            if self._session is None:
                self._session, self._looks = self._begun(bases, presents)
            else:
                self._session.improve(bases, presents)
            session = self._session
            for view, clean in zip(session.views, shown, strict=True):
                offer_view(self.pictures, view, session.transform, clean)
            offer_transforms(self.pictures, self._transforms(session))
        self._tell_of(self.state)
        self._settling.ring()

    def _begun(self, bases: Sequence[Basis], presents: Sequence[Floats]) -> tuple[Session, Looks]:
        """What is painted of the first bases, and looks of it. Raises LightpaintError."""
        store = self._open_store(Identity.of(bases))
        try:
            session = Session(
                bases,
                presents,
                store,
                settings=self.subjects[0].settings,
                transform=transform_of(self.subjects, bases),
                constraints=self.subjects[0].constraints,
            )
            looks = Looks(session, self.pictures)
            for remark in store.remarks:
                self._tell_kept(remark, "warn")
            return session, looks
        except BaseException:
            store.close()  # whoever tries again, as with other constraints, finds it free
            raise

    def _transforms(self, session: Session) -> list[Any]:
        own = session.transform.name
        names = [*pictures.TRANSFORMS, *([own] if own not in pictures.TRANSFORMS else [])]
        return [type(session.transform)(name) for name in names]

    def _of_session(self, session: Session) -> dict[str, Any]:
        wanted, basis = self.subjects[0].wanted, session.basis
        painted = [view.name for view in session.views if view.is_painted]
        sensors = [""] if len(session.views) == 1 else painted
        views = tuple(view_info(view) for view in session.views)
        return {
            "size": views[0].size,
            "objects": views[0].objects,
            "lights": tuple(map(light_info, basis.lights, views[0].scales)),
            "views": views,
            "transforms": tuple(x.name for x in self._transforms(session)),
            "transform": TransformInfo(session.transform.name, session.transform.stops),
            "lut": TableInfo(pictures.SIDE, pictures.LOW, pictures.HIGH),
            "resources": self.pictures.named(),
            "looks": self._looks.listed() if self._looks is not None else (),
            "basis": SampleCount(
                spp=basis.origin.spp,
                wanted=wanted or basis.origin.spp,
                done=wanted is None or basis.origin.spp >= wanted,
            ),
            "verified": self._errands.verified(session.version),
            "first": not session.store.steps,
            "stroke": session.stroke,
            "command": self._errands.command(sensors, session.wishes),
        }

    def _find(self) -> None:
        """The exact answer, then what is known of it."""
        with self._lock:
            session = self._session
            if session is None or session.is_open:
                return
            moment = session.moment()

        def check() -> None:
            if moment.version != session.version or not self._is_open:
                raise OldError

        # The next stroke gets the processors at once, and rings when it is done.
        with suppress(OldError), while_wanted(check):
            solution = moment.solution()
            self._tell_answer(lambda: session.settled(moment, solution))
            if solution is None:
                return
            check()
            analyses = analyse(solution)
            judged = judgement(analyses, moment.painted)
            self._tell_answer(lambda: session.settled(moment, solution, judged))

    def _tell_answer(self, make: Callable[[], AnswerUpdate | None]) -> None:
        def known() -> AnswerUpdate | None:
            message = make()
            self._known = message or self._known
            return message

        self._tell_of(known)
