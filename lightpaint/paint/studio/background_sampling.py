"""Samples that are added in the background, where the newest paint needs them."""

from collections.abc import Callable, Sequence
from typing import Protocol

from lightpaint.basis.basis import Basis
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import LatestWork
from lightpaint.paint.protocol import Message
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject
from lightpaint.scene.properties.film import MAX_SPP
from lightpaint.scene.runtime.render_lock import MITSUBA


class SamplingHost(Protocol):
    """The studio, as what adds samples sees it."""

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
        """Denoise the planes of the present bases, where that is not done yet."""

    def publish(self, message: Message) -> None:
        """Send a message to pages."""


class BackgroundSampling:
    """A thread's loop that adds samples after each exact answer, until the brush moves."""

    def __init__(self, host: SamplingHost) -> None:
        self._host = host
        self._loop = LatestWork(self._add, host.publish)
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
        if not (is_outdated() or snapshot.requests.poses):
            bases = add_round(self._host.subjects, snapshot, solution, is_enough=is_outdated)
            if bases is not None:
                self._host.use_bases(bases)
            elif not is_outdated():
                self._host.denoise_planes()


def add_round(
    subjects: Sequence[Subject],
    snapshot: SessionSnapshot,
    solution: Solution,
    *,
    is_enough: Callable[[], bool],
) -> list[Basis] | None:
    """Return the bases of all views after a round of samples; None if none is needed or was taken.

    snapshot, solution: the paintings, and their exact answer. is_enough: whether to leave the rest
    of the round; asked between passes.
    """
    # Imported here: saved bases need no renderer.
    from lightpaint.basis.cache.cached_render import top_up_basis
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
    for k, its in zip(snapshot.painted_views, counts, strict=True):
        if is_enough():
            break
        with MITSUBA.low_priority():
            bases[k] = top_up_basis(
                subjects[k].loaded_scene,
                bases[k],
                its,
                use_cache=settings.use_cache,
                is_enough=is_enough,
            )
    taken = zip(bases, snapshot.bases, strict=True)
    return bases if any(a.origin != b.origin for a, b in taken) else None
