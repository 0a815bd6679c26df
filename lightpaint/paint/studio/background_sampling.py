"""Samples that are added in the background, where the newest paint needs them."""

from collections.abc import Callable, Sequence
from typing import Protocol

from lightpaint.basis.basis import Basis
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import LatestWork
from lightpaint.paint.protocol import Message, ProgressReport
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject
from lightpaint.progress import Progress, silent
from lightpaint.scene.properties.film import MAX_SPP
from lightpaint.scene.runtime.render_lock import MITSUBA

#: Name of this task in reports of progress.
SAMPLING = "sampling"


class SamplingHost(Protocol):
    """The part of the studio that background sampling uses."""

    subjects: tuple[Subject, ...]
    is_open: bool

    @property
    def has_scenes(self) -> bool:
        """True if there are scenes, and not only bases."""

    @property
    def version(self) -> int:
        """Number that grows with every change of the paintings and requests."""

    def use_bases(self, bases: Sequence[Basis]) -> None:
        """Continue the session with these bases."""

    def denoise_planes(self) -> None:
        """Denoise the planes of the current bases, where that is not done yet."""

    def publish(self, message: Message) -> None:
        """Send a message to pages."""

    def report_progress(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report how far a task is. Raises StoppedError once the studio is closed."""


class BackgroundSampling:
    """A thread's loop that adds samples after each exact answer, until the brush moves."""

    def __init__(self, host: SamplingHost) -> None:
        self._host = host
        self._loop = LatestWork(self._add, host.publish)
        self._is_reported = False  # whether pages show that samples are added
        self.stop = self._loop.stop

    @property
    def is_wanted(self) -> bool:
        """True if the settings say how sure the lights are to be."""
        return self._host.has_scenes and self._host.subjects[0].settings.error is not None

    def run(self) -> None:
        """Add samples until `stop`, if they are wanted."""
        if self.is_wanted:
            self._loop.run()

    def give(self, snapshot: SessionSnapshot, solution: Solution) -> None:
        """Replace the exact answer that samples are added for."""
        if self.is_wanted:
            self._loop.give((snapshot, solution))

    def _add(self, answer: tuple[SessionSnapshot, Solution]) -> None:
        """Add a round of samples; once there are enough, denoise the planes that have them."""
        snapshot, solution = answer

        def is_outdated() -> bool:
            return not self._host.is_open or self._host.version != snapshot.version

        # Samples are of the scene, in which no light is moved.
        bases = None
        if not (is_outdated() or snapshot.requests.placed):
            bases = add_round(
                self._host.subjects,
                snapshot,
                solution,
                is_enough=is_outdated,
                progress=self._report,
            )
        # After a round the next exact answer says whether another one follows.
        if self._is_reported and (bases is None or is_outdated()):
            self._is_reported = False
            self._host.publish(ProgressReport(task=SAMPLING, done=1, total=1, unit=""))
        if bases is not None:
            self._host.use_bases(bases)
        elif not (is_outdated() or snapshot.requests.placed):
            self._host.denoise_planes()

    def _report(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self._is_reported = True
        self._host.report_progress(label, done, total, unit)


def add_round(
    subjects: Sequence[Subject],
    snapshot: SessionSnapshot,
    solution: Solution,
    *,
    is_enough: Callable[[], bool],
    progress: Progress = silent,
) -> list[Basis] | None:
    """Return the bases of all views after a round of samples; None if none is needed or was taken.

    snapshot, solution: the paintings, and their exact answer. is_enough: whether to leave the rest
    of the round; asked between passes. progress: hears, as `SAMPLING`, which share of the precision
    that was asked for is reached, in percent.
    """
    # Imported here: saved bases need no renderer.
    from lightpaint.basis.cache.cached_render import top_up_basis
    from lightpaint.basis.render.pixel_top_up import kept_loaded
    from lightpaint.basis.render.render_origin import ONE_PASS
    from lightpaint.pipeline.needed_samples import Certainty, needed_counts

    settings, bases = snapshot.settings, list(snapshot.bases)
    painted = [bases[k] for k in snapshot.painted_views]
    is_possible = all(x.origin.method == ONE_PASS and x.origin.mean_spp < MAX_SPP for x in painted)
    if settings.error is None or not is_possible:
        return None
    certainty = Certainty.of(solution)
    if certainty.error <= settings.error:
        return None
    counts = needed_counts(certainty, painted, settings.error)
    rounds = list(zip(snapshot.painted_views, counts, strict=True))
    # Squared errors fall as samples grow.
    share = (settings.error / certainty.error) ** 2
    have = sum(x.origin.mean_spp * x.size[0] * x.size[1] for x in painted)
    grown = min(share * (1 + 2 * sum(int(x.sum()) for x in counts) / have), 0.99)

    def of_view(number: int) -> Progress:
        def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
            taken = (number + done / max(total, 1)) / len(rounds)
            progress(SAMPLING, round(100 * (share + (grown - share) * taken)), 100, "percent")

        return hear

    scenes = [subjects[k].loaded_scene for k in snapshot.painted_views]
    with MITSUBA.low_priority(), kept_loaded(scenes) as tracers:
        for number, (k, its) in enumerate(rounds):
            if is_enough():
                break
            bases[k] = top_up_basis(
                scenes[number],
                bases[k],
                its,
                use_cache=settings.use_cache,
                is_enough=is_enough,
                progress=of_view(number),
                tracers=tracers,
            )
    taken = zip(bases, snapshot.bases, strict=True)
    return bases if any(a.origin != b.origin for a, b in taken) else None
