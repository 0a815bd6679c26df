"""Why does it not look like the painting? The residual, split by what stands in the way.

With the weights u of any sign that come closest, Ψ − ΣuΦ is orthogonal to every light, so

    ‖Ψ − ΣwΦ‖² = ‖Ψ − ΣuΦ‖² + ‖Σ(u − w)Φ‖²

exactly: the first part no mix of the lights can reach, the second w >= 0 forbids. Noise is taken
out of the first: what that of the prediction adds, and what that of the painting does, if it is a
render or a photograph (`grain.py`). Where the lighting answers several
views, part of the second is what the best lighting for this view alone would not have missed.
After reweighting, all of it is of the last linear problem: without what a display clips, and on
a scale of its own.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.bound_release import bounds_of
from lightpaint.lighting.analysis.noise.directions import all_columns
from lightpaint.lighting.analysis.noise.grain import grain
from lightpaint.lighting.analysis.noise.noise import pseudo_inverse, residual_and_noise
from lightpaint.lighting.answer.active_bound import Bound
from lightpaint.lighting.answer.lighting import combine
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import again
from lightpaint.screen import shortly

#: Blocks along each side of the image over which it is asked where light is missing, and
#: regions that are spoken of: left, middle, right.
BLOCKS, REGIONS = 12, 3


@dataclass(frozen=True)
class Place:
    """Where most is out of reach of the lights.

    region: row and column, 0 to 2, of the ninth of the image with most of it, and share, how
    much of it that is. box: top, left, bottom, right, in pixels, of its worst block.
    painted, reached: mean RGB there, of the painting and of the closest mix of any sign.
    object: what most of it lies on, wherever; "" for nothing that is known or has a name.
    """

    region: tuple[int, int]
    share: float
    box: tuple[int, int, int, int]
    painted: tuple[float, float, float]
    reached: tuple[float, float, float]
    object: str = ""


@keywords()
@dataclass(frozen=True)
class Diagnosis:
    """The residual's energy Σ D (Ψ − ΣwΦ)², all channels together, and where it comes from.

    Attributes:
        total: The whole of it, the sum of the five parts.
        unreachable: What no weights of any sign can reach.
        forbidden: What they can and w >= 0 cannot.
        noise: What the basis' own noise adds.
        ignored: Σ max(1 − D, 0)(Ψ − ΣwΦ)², where nobody said it mattered; in no other part.
        missed: What is missed relative to the painting, root mean square, in the space of the fit.
        unreachable_map: (h, w, 3), signed: what is painted and missed for that reason.
        forbidden_map: (h, w, 3), the same of what is forbidden. The sum of both is Ψ − ΣwΦ.
        ignored_map: (h, w), of luminance, weighted.
        bounds: What holds single lights, the largest gain first.
        place: None where nothing is out of reach.
        is_constrained: Whether anything was asked of the lights, which then forbids too.
        bounds_left_out: How many more there are, which seem to matter less.
        compromise: What the best lighting for this view alone would not miss; 0 where there is one
            view.
        painting_noise: What noise of the painting adds, which is a render or a photograph then.
        lighting_total: `total` of all views that the lighting answers, to hold gains against.

    Examples:
        >>> diagnosis = lp.diagnose(lp.solve(basis, target))
        >>> diagnosis.unreachable_map.shape
        (16, 16, 3)
    """

    total: float
    unreachable: float
    forbidden: float
    noise: float
    ignored: float
    missed: float
    unreachable_map: Floats
    forbidden_map: Floats
    ignored_map: Floats
    bounds: tuple[Bound, ...]
    place: Place | None
    is_constrained: bool = False
    bounds_left_out: int = 0
    compromise: float = 0.0
    painting_noise: float = 0.0
    lighting_total: float = 0.0

    __repr__ = shortly

    @property
    def avoidable(self) -> float:
        """Energy of `forbidden_map`: what some weights of any sign would not miss."""
        return self.forbidden + self.compromise

    def gained(self, bound: Bound) -> float:
        """The gain of `bound` as a share of what the lighting misses, of all views together."""
        return bound.gain / self.lighting_total if self.lighting_total > 0 else 0.0

    def share(self, part: float) -> float:
        """`part` of what is missed, 0 to 1."""
        return part / self.total if self.total > 0 else 0.0


def parts_of_miss(diagnosis: Diagnosis) -> dict[str, float]:
    """Return the parts of what is missed that are told, and their shares, the largest first.

    None where the lights make what is painted.
    """
    if diagnosis.missed < 0.01:
        return {}
    parts = ("unreachable", "forbidden", "compromise", "noise", "painting_noise")
    shares = {part: diagnosis.share(getattr(diagnosis, part)) for part in parts}
    told = sorted(shares.items(), key=lambda item: -item[1])
    return {part: share for part, share in told if share >= 0.005}


@keywords()
def diagnose(solution: Solution) -> Diagnosis:
    """Split what `solution`, of one view, misses of its target.

    Of one of several views, what holds the lights does so in all views together.

    Args:
        solution: Of one view: one of `Solution.views`.

    Examples:
        >>> diagnosis = lp.diagnose(lp.solve(basis, target))
        >>> diagnosis.missed < 0.01
        True
    """
    basis, loss, weights = solution.basis, solution.problem.loss, solution.weights
    [target] = solution.problem.views.targets
    predicted = combine(basis, solution.lighting)
    free = of_any_sign(solution)
    D = solution.weight.astype(np.float64)
    missed = solution.image.astype(np.float64) - predicted.image
    # The difference of two mixes, so that both maps add up to what is missed, to the bit.
    forbidden = basis.mix(free - weights).astype(np.float64)
    unreachable = missed - forbidden
    total = float((D * np.square(missed)).sum())
    out_of_reach = min(float((D * np.square(unreachable)).sum()), total)
    # Grain is sought in what the fit counts: a mean over pixels of other weights would give dark
    # ones the grain of the bright ones beside them, and more than all that is missed.
    noise, painting_noise = (
        min(float(power.sum()), out_of_reach)
        for power in (
            # Not the noise that the painting shares where it is to look as it does now.
            D * np.square(residual_and_noise(solution)[1]).reshape(missed.shape),
            grain(np.sqrt(D) * unreachable, solution.importance > 0),
        )
    )
    # What is seen of noise is that of both.
    painting_noise = max(painting_noise - noise, 0.0)
    lacking = out_of_reach - noise - painting_noise
    uncounted = np.maximum(1 - solution.importance.astype(np.float64), 0)
    # Where nothing was painted no colour is missed either.
    uncounted = np.where(np.any(target.image > 0, axis=-1), uncounted, 0)
    outside = target.image.astype(np.float64) - predicted.image
    seen = outside if solution.problem.is_linear else loss.missed(predicted.image)
    compromise = min(_given_up(solution), total - out_of_reach)
    whole = solution.whole or solution
    bounds, left_out = bounds_of(whole)
    return Diagnosis(
        total=total,
        unreachable=lacking,
        forbidden=total - out_of_reach - compromise,
        noise=noise,
        ignored=float((uncounted[..., None] * np.square(seen)).sum()),
        missed=_relative(solution, D, total),
        unreachable_map=unreachable,
        forbidden_map=forbidden,
        ignored_map=uncounted * luminance(outside),
        bounds=bounds,
        bounds_left_out=left_out,
        lighting_total=total if whole is solution else whole.energy,
        is_constrained=solution.problem.asks,
        compromise=compromise,
        painting_noise=painting_noise,
        place=_place(solution, unreachable) if lacking > 0 else None,
    )


def _relative(solution: Solution, D: Floats, total: float) -> float:
    """What is missed relative to the painting, root mean square."""
    norm2 = float((D * np.square(solution.image, dtype=np.float64)).sum())
    if not solution.problem.is_linear:
        total, norm2 = sum(solution.certificate.objective), float(solution.norm2.sum())
    return float(np.sqrt(total / norm2)) if norm2 > 0 else 0.0


def _given_up(solution: Solution) -> float:
    """By how much the energy of this view exceeds that of the best lighting for it alone.

    After reweighting, both of the same squares: the loss itself is on another scale.
    """
    if solution.whole is None:
        return 0.0
    alone = again(solution, solution.problem)
    return max(solution.energy - alone.energy, 0.0)


def of_any_sign(solution: Solution) -> Doubles:
    """The weights (n, 3) that come closest if they may be negative; kept lights stay at 1."""
    equations, weights = solution.equations, solution.weights
    whole = equations.whole
    for to in all_columns(solution):
        gradient = np.einsum("cij,jc->ci", equations.M, weights) - equations.b
        step = to @ pseudo_inverse(to.T @ whole @ to) @ (to.T @ gradient.ravel())
        weights = weights - step.reshape(3, -1).T
    return weights


def _place(solution: Solution, unreachable: Floats) -> Place | None:
    """The region and block of the image with the most energy out of reach."""
    D = solution.weight.astype(np.float64)
    rows, columns = (_edges(length, BLOCKS) for length in solution.importance.shape)

    def block_sums(image: Floats) -> Floats:
        return np.add.reduceat(np.add.reduceat(image, rows[:-1], 0), columns[:-1], 1)

    # Noise has either sign: the square of a block's mean is nearly without it.
    counted = block_sums(D)
    safe = np.where(counted > 0, counted, 1)
    lacking = block_sums(D * unreachable) / safe
    energy = (counted * np.square(lacking)).sum(axis=-1)
    if not energy.any():
        return None
    region = np.zeros((REGIONS, REGIONS))
    place_of = [REGIONS * np.arange(length) // length for length in energy.shape]
    np.add.at(region, np.ix_(*place_of), energy)
    worst = np.unravel_index(int(np.argmax(region)), region.shape)
    inside = (place_of[0] == worst[0])[:, None] & (place_of[1] == worst[1])
    y, x = np.unravel_index(int(np.argmax(np.where(inside, energy, -1))), energy.shape)
    painted = (block_sums(D * solution.image) / safe)[y, x]
    return Place(
        region=(int(worst[0]), int(worst[1])),
        share=float(region[worst] / energy.sum()),
        box=(int(rows[y]), int(columns[x]), int(rows[y + 1]), int(columns[x + 1])),
        painted=as_rgb(painted),
        reached=as_rgb(painted - lacking[y, x]),
    )


def _edges(length: int, parts: int) -> npt.NDArray[np.int_]:
    """Where `length` pixels are cut into that many nearly equal parts, or single pixels."""
    parts = min(length, parts)
    return np.asarray(np.arange(parts + 1) * length // parts, dtype=np.int_)
