"""What somebody asks for that takes long: exports, the verifying render, why it is not closer."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, Literal, Protocol

from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes, as_halves
from lightpaint.errors import PaintError
from lightpaint.lighting.analysis.analysis import analyse, with_findings
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import StoppedError, Threads
from lightpaint.paint.protocol import (
    Explanation,
    ExportResult,
    Message,
    PreviewResult,
    TaskStarted,
    TaskStopped,
    VerificationResult,
)
from lightpaint.paint.session.picture_table import Picture
from lightpaint.paint.session.snapshot import Moment
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.paint.store.steps import of_view
from lightpaint.paint.subject import Subject, painting_of
from lightpaint.progress import Progress, while_wanted

#: What takes long.
Task = Literal["export", "verify", "explain"]

Asked = protocol.Export | protocol.Verify | protocol.Explain


class Home(Protocol):
    """What an errand wants of the studio it goes out from."""

    subjects: tuple[Subject, ...]

    @property
    def version(self) -> int:
        """A number that grows with every change of what is painted and asked."""

    def now(self, wishes: Wishes | None = None) -> tuple[Moment, Lighting]:
        """What is painted and asked, and the last answer. wishes: to be asked instead."""

    def clean(self, bases: Sequence[Basis]) -> Sequence[CleanPlanes | None]:
        """Clean planes of these, where they have been made."""

    def put(self, name: str, picture: Picture) -> None:
        """A picture from now on, of which pages are told."""

    def tell(self, message: Message) -> None:
        """Say it to pages."""

    def hears(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """How far something is. Raises StoppedError once nobody wants it any more."""


def _named(files: Iterable[Path]) -> tuple[str, ...]:
    """Files as a page is told of them."""
    return tuple(str(x.absolute()) for x in files)


class Errands:
    """Those of one studio; one of them writes at a time, and one verifies.

    Of two that verify the later one counts: the answer may be another by then.
    """

    def __init__(self, place: Home, threads: Threads) -> None:
        self._place, self._threads = place, threads
        self._writes, self._renders = Lock(), Lock()
        self._seen: dict[
            int, tuple[int, VerificationResult]
        ] = {}  # renders, by view: of which version
        self._foreseen = 0  # number of the last preview that was asked for
        self._wanted: protocol.Verify | None = None  # that was asked for last; None if stopped
        self._stops = 0  # how often somebody has stopped what is written

    def said(self, message: Asked) -> list[Message]:
        """Begin with it. Raises PaintError for what there is not."""
        works: dict[type, tuple[Task, Callable[[Any], None]]] = {
            protocol.Export: ("export", partial(self._export, stops=self._stops)),
            protocol.Verify: ("verify", self._verified),
            protocol.Explain: ("explain", self._explain),
        }
        if isinstance(message, protocol.Verify):
            if not message.run:
                self._wanted = None
                return [TaskStarted(what="stop")]
            if self._subject(message.view).scene is None:
                raise PaintError("there is no scene to render: it was opened from a saved basis")
            # Here, and not in its thread: what is said next may be that it is to stop.
            self._wanted = message
        elif isinstance(message, protocol.Explain):
            self._subject(message.view)
        elif not message.run:
            self._stops += 1
            return [TaskStarted(what="stop")]
        what, work = works[type(message)]
        self._threads.later(lambda: work(message), what)
        return [TaskStarted(what=what)]

    def foresee(self, message: protocol.Preview, wishes: Wishes) -> list[Message]:
        """Begin to find what a change would do. Raises PaintError for a view that there is none of.

        wishes: what would be asked then. Of two such messages the later one counts.
        """
        self._subject(message.view)
        self._foreseen = message.number
        self._threads.later(lambda: self._foresee(message, wishes), "preview")
        return [TaskStarted(what="preview")]

    def command(self, sensors: Sequence[str], wishes: Wishes) -> str:
        """The command that answers exported paintings alike, where there are commands."""
        subject = self._place.subjects[0]
        paths = {sensor: str(painting_of(subject.folder, sensor)) for sensor in sensors}
        return subject.command(paths, wishes) if paths else ""

    def verified(self, version: int) -> tuple[VerificationResult, ...]:
        """What the last render of each view has shown, and whether it is of an earlier version."""
        seen = list(self._seen.values())
        return tuple(replace(about, is_old=its != version) for its, about in seen)

    def _subject(self, view: int) -> Subject:
        subjects = self._place.subjects
        if view >= len(subjects):
            raise PaintError(f"no view {view}: there are {len(subjects)}")
        return subjects[view]

    def _answer(self) -> tuple[Moment, Lighting]:
        """What is painted now, and the exact answer to it."""
        moment, now = self._place.now()
        solution = moment.solution()
        if solution is None:
            return moment, now
        return moment, with_findings(solution, analyse(solution)).lighting

    def _export(self, message: protocol.Export, stops: int) -> None:
        """Write what is asked for. stops: how often that had been stopped when it was asked."""
        # It brings all rooms, of which painting needs a few.
        from lightpaint.paint.session_exports import OF_PAINTING, export

        def check() -> None:
            if self._stops != stops:
                raise StoppedError

        def hears(label: str, done: int, total: int, unit: str = "passes") -> None:
            del label  # what it is at within an export is no news to a page
            check()
            self._place.hears("export", done, total, unit)

        files: list[Path] = []
        try:
            # Also the exact answer, which may take longer than somebody waits, is given up.
            with while_wanted(check):
                moment, lighting = self._answer()
                with self._writes:
                    check()
                    subjects = self._place.subjects
                    for file in export(subjects, moment, lighting, message.what, hears):
                        files.append(file)  # one by one: those before a stop are there
        except StoppedError:
            if self._stops != stops:
                told = ExportResult(files=_named(files), command="", is_stopped=True)
                self._place.tell(told)
            return
        # It is of the paintings that were written now: those of before may be others.
        is_asked, is_painted = bool(OF_PAINTING & set(message.what)), bool(moment.painted)
        sensors = moment.painted_sensors if is_asked and is_painted else ()
        made = ExportResult(
            files=_named(files),
            command=self.command(sensors, moment.wishes),
            is_unpainted=is_asked and not is_painted,
        )
        self._place.tell(made)

    def _verified(self, asked: protocol.Verify) -> None:
        def check() -> None:
            if self._wanted is not asked:
                raise StoppedError

        try:
            # Also the exact answer, which may take longer than somebody waits, is given up.
            with self._renders, while_wanted(check):
                check()
                self._verify(asked.view, check)
        except StoppedError:
            if self._wanted is None:  # else a page waits for the next one
                self._place.tell(TaskStopped(what="verify"))

    def _verify(self, view: int, check: Callable[[], None]) -> None:
        """Render the answer in a view. check: raises StoppedError once nobody wants that."""
        from lightpaint.paint.session_exports import verified

        def hears(label: str, done: int, total: int, unit: str = "passes") -> None:
            check()
            self._place.hears(label, done, total, unit)

        moment, lighting = self._answer()
        progress: Progress = hears
        picture, said, agrees = verified(
            self._subject(view), moment.bases[view], lighting, progress
        )
        check()
        self._place.put(of_view("verified", view), as_halves(picture))
        is_old = self._place.version != moment.version
        made = VerificationResult(agrees=agrees, text=said, view=view, is_old=is_old)
        self._seen[view] = moment.version, made
        self._place.tell(made)

    def _foresee(self, asked: protocol.Preview, wishes: Wishes) -> None:
        def check() -> None:
            if self._foreseen != asked.number:
                raise StoppedError

        with suppress(StoppedError), while_wanted(check):
            proposed, now = self._place.now(wishes)
            weights = now.weights_for(proposed.bases[0])
            clean = self._place.clean(proposed.bases)[asked.view]
            found = proposed.foresight(weights, asked.view, clean=clean)
            check()
            is_old = self._place.version != proposed.version
            made = PreviewResult(
                number=asked.number,
                view=asked.view,
                text=found.text,
                is_at_cost=found.is_at_cost,
                is_old=is_old,
                before=found.before,
                after=found.after,
            )
            self._place.tell(made)

    def _explain(self, asked: protocol.Explain) -> None:
        moment, _ = self._place.now()
        said, beyond = moment.beyond(asked.view)
        self._place.put(of_view("beyond", asked.view), beyond)
        is_old = self._place.version != moment.version
        self._place.tell(Explanation(sentences=tuple(said), view=asked.view, is_old=is_old))
