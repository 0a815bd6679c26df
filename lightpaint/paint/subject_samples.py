"""Further samples of the views of a session, where the newest paint needs them."""

from collections.abc import Callable, Sequence

from lightpaint.basis.basis import Basis
from lightpaint.lighting.solution import Solution
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject
from lightpaint.scene.properties.film import MAX_SPP
from lightpaint.scene.runtime.render_lock import MITSUBA


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
