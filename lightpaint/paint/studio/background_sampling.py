"""Samples that are added in the background, where the newest paint needs them."""

from collections.abc import Callable, Sequence

from lightpaint.basis.basis import Basis
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import LatestWork
from lightpaint.paint.protocol import ProgressReport
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.studio.session_bases import SessionBases
from lightpaint.paint.subject import Subject
from lightpaint.progress import Progress, silent
from lightpaint.scene.limits import MAX_SPP
from lightpaint.scene.runtime.render_lock import MITSUBA

#: Name of this task in reports of progress.
SAMPLING = "sampling"


class BackgroundSampling:
    """A thread's loop that adds samples after each exact answer, until the brush moves."""

    def __init__(
        self,
        subjects: Sequence[Subject],
        access: SessionAccess,
        bases: SessionBases,
        publisher: Publisher,
    ) -> None:
        self._subjects, self._access = subjects, access
        self._bases, self._publisher = bases, publisher
        self._loop = LatestWork(self._add, publisher.publish)
        self._is_reported = False  # whether pages show that samples are added
        self.stop = self._loop.stop

    @property
    def is_wanted(self) -> bool:
        """True if the settings say how sure the lights are to be."""
        first = self._subjects[0]
        return first.scene is not None and first.settings.error is not None

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
            return not self._publisher.is_open or self._access.version != snapshot.version

        # Samples are of the scene, in which no light is moved.
        bases = None
        if not (is_outdated() or snapshot.requests.placed):
            bases = add_round(
                self._subjects,
                snapshot,
                solution,
                is_enough=is_outdated,
                progress=self._report,
            )
        # After a round the next exact answer says whether another one follows.
        if self._is_reported and (bases is None or is_outdated()):
            self._is_reported = False
            self._publisher.publish(ProgressReport(task=SAMPLING, done=1, total=1, unit=""))
        if bases is not None:
            self._bases.use(bases)
        elif not (is_outdated() or snapshot.requests.placed):
            self._bases.denoise()

    def _report(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self._is_reported = True
        self._publisher.report_progress(label, done, total, unit)


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
        for number, (k, view_counts) in enumerate(rounds):
            if is_enough():
                break
            bases[k] = top_up_basis(
                scenes[number],
                bases[k],
                view_counts,
                use_cache=settings.use_cache,
                is_enough=is_enough,
                progress=of_view(number),
                tracers=tracers,
            )
    taken = zip(bases, snapshot.bases, strict=True)
    return bases if any(a.origin != b.origin for a, b in taken) else None
