"""The diagnosis of the residual: its parts, by their causes.

With the closest weights u of any sign, Ψ − ΣuΦ is orthogonal to every light, so

    ‖Ψ − ΣwΦ‖² = ‖Ψ − ΣuΦ‖² + ‖Σ(u − w)Φ‖²

exactly: no mix of the lights can reach the first part, and w >= 0 forbids the second. The first
part is split further into the noise of the prediction, the noise of the painting if it is a render
or a photograph (`residuals.py`), and the rest. If the lighting answers several views, part of
the second is the compromise with the others. After reweighting, all parts are of the last linear
problem: without clipping by a display, and on a scale of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, as_rgb, in_any_channel
from lightpaint.colour import luminance
from lightpaint.display_text import short_repr
from lightpaint.images import bands_of
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.active_bounds import bounds_of
from lightpaint.lighting.analysis.noise.basis_noise import pseudo_inverse
from lightpaint.lighting.analysis.noise.residuals import Residuals, channel_grain
from lightpaint.lighting.analysis.noise.weight_directions import all_columns
from lightpaint.lighting.answer.certificate import Bound
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solve_again
from lightpaint.progress import with_progress
from lightpaint.threads import parallel_map

#: Blocks along each side of the image for finding where light is missing, and regions along each
#: side that sentences name: left, middle, right.
BLOCKS, REGIONS = 12, 3


@dataclass(frozen=True)
class ErrorEnergies:
    """Sums over pixels. total, out_of_reach, noise, ignored: as in `Diagnosis`, uncut. painted:
    Σ D Ψ².
    """

    total: float
    out_of_reach: float
    noise: float
    ignored: float
    painted: float

    @classmethod
    def of(
        cls,
        solution: Solution,
        predicted: Floats,
        forbidden: Floats,
        unreachable_map: Floats,
        ignored_map: Floats,
    ) -> "ErrorEnergies":
        """Sum, band by band, and fill the maps: (h, w, 3) and (h, w)."""
        [target] = solution.problem.views.targets
        residuals, loss, width = Residuals.of(solution), solution.problem.loss, predicted.shape[1]

        def sums(rows: slice) -> Doubles:
            D, importance = (
                x[rows].astype(np.float64) for x in (solution.weight, solution.importance)
            )
            image, mixed = solution.image[rows].astype(np.float64), predicted[rows]
            missed = image - mixed
            unreachable = missed - forbidden[rows]
            # This excludes noise that the painting shares, where it equals the current look.
            noise = residuals.noise(slice(rows.start * width, rows.stop * width))
            uncounted = _uncounted(importance, target.image[rows])
            outside = target.image[rows].astype(np.float64) - mixed
            is_linear = solution.problem.is_linear
            residual = outside if is_linear else loss.cut(lambda x: x[rows]).residual(mixed)
            unreachable_map[rows] = unreachable
            ignored_map[rows] = uncounted * luminance(outside)
            return np.array(
                [
                    (D * np.square(missed)).sum(),
                    (D * np.square(unreachable)).sum(),
                    (D * np.square(noise.reshape(missed.shape))).sum(),
                    (uncounted[..., None] * np.square(residual)).sum(),
                    (D * np.square(image)).sum(),
                ]
            )

        energies = np.sum(parallel_map(sums, bands_of(predicted.shape)), axis=0).tolist()
        total, out_of_reach, noise, ignored, painted = energies
        return cls(total, out_of_reach, noise, ignored, painted)


def _uncounted(importance: Doubles, image: Floats) -> Doubles:
    """Return the share of pixels, (h, w), that does not count, in which `image` has a colour."""
    # Black target pixels have no colour to miss.
    return np.where(in_any_channel(image > 0), np.maximum(1 - importance, 0), 0)


def grain_power(solution: Solution, unreachable: Floats) -> float:
    """Return the power of the painting's noise in the part out of reach.

    Grain is measured with the weights of the fit: otherwise a mean would give dark pixels the grain
    of bright neighbours, and more than the whole error.
    """
    counted, weight = solution.importance > 0, solution.weight
    power = 0.0
    for c in range(3):
        root_weight = np.sqrt(weight[..., c % weight.shape[2]].astype(np.float64))
        root_weight *= unreachable[..., c]
        power += float(channel_grain(root_weight, counted).sum())
    return power


@dataclass(frozen=True)
class Place:
    """The place with most of the light that is out of reach.

    region: row and column, 0 to 2, of the ninth of the image with most of it, and share, its part
    of the whole. box: top, left, bottom, right, in pixels, of its worst block.
    painted, reached: mean RGB there, of the painting and of the closest mix of any sign.
    object: the object with most of it, anywhere; "" without a known name.
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
    """The residual's energy Σ D (Ψ − ΣwΦ)², all channels together, and its parts.

    Attributes:
        total: The sum of the five parts.
        unreachable: The part that no weights of any sign can reach.
        forbidden: The part that w >= 0 forbids.
        noise: The part due to noise of the basis.
        ignored: Σ max(1 − D, 0)(Ψ − ΣwΦ)², the error that has no weight; in no other part.
        missed: The error relative to the painting, root mean square, in the space of the fit.
        unreachable_map: (h, w, 3), signed: the error for that reason.
        forbidden_map: (h, w, 3), the same for the forbidden part. The sum of both is Ψ − ΣwΦ.
        ignored_map: (h, w), of luminance, weighted.
        bounds: Bounds that hold single lights, the largest gain first.
        place: The worst place; None if nothing is out of reach.
        is_constrained: Whether there are constraints; their effect is part of `forbidden`.
        bounds_left_out: The number of other bounds, with smaller estimates.
        compromise: The part that the best lighting for this view alone would avoid; 0 for one
            view.
        painting_noise: The part due to noise of the painting, if it is a render or a photograph.
        lighting_total: `total` of all views that the lighting answers, as a scale for gains.

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

    __repr__ = short_repr

    @property
    def avoidable(self) -> float:
        """Energy of `forbidden_map`: the part that some weights of any sign would avoid."""
        return self.forbidden + self.compromise

    def gain_share(self, bound: Bound) -> float:
        """Return the gain of `bound` as a share of the lighting's error, in all views together."""
        return bound.gain / self.lighting_total if self.lighting_total > 0 else 0.0

    def share(self, part: float) -> float:
        """Return `part` as a share of the error, 0 to 1."""
        return part / self.total if self.total > 0 else 0.0


def error_shares(diagnosis: Diagnosis) -> dict[str, float]:
    """Return the notable parts of the error with their shares, the largest first.

    No parts if the lights meet the painting.
    """
    if diagnosis.missed < 0.01:
        return {}
    parts = ("unreachable", "forbidden", "compromise", "noise", "painting_noise")
    shares = {part: diagnosis.share(getattr(diagnosis, part)) for part in parts}
    sorted_shares = sorted(shares.items(), key=lambda item: -item[1])
    return {part: share for part, share in sorted_shares if share >= 0.005}


@keywords()
def diagnose(solution: Solution) -> Diagnosis:
    """Split the error of `solution`, of one view, into its parts.

    For one of several views, the bounds hold the lights in all views together.

    Args:
        solution: Of one view: one of `Solution.views`.

    Examples:
        >>> diagnosis = lp.diagnose(lp.solve(basis, target))
        >>> diagnosis.missed < 0.01
        True
    """
    basis, weights = solution.basis, solution.weights
    predicted, free = basis.predict(weights).image, unbounded_weights(solution)
    # The difference of two mixes, so that both maps add up to the error exactly.
    forbidden = basis.mix(free - weights)
    unreachable = np.empty(predicted.shape, np.float32)
    ignored = np.empty(predicted.shape[:2], np.float32)
    energies = ErrorEnergies.of(solution, predicted, forbidden, unreachable, ignored)
    total = energies.total
    out_of_reach = min(energies.out_of_reach, total)
    noise, painting_noise = (
        min(power, out_of_reach) for power in (energies.noise, grain_power(solution, unreachable))
    )
    # The visible noise is the noise of both.
    painting_noise = max(painting_noise - noise, 0.0)
    lacking = out_of_reach - noise - painting_noise
    compromise = min(_compromise(solution), total - out_of_reach)
    whole = solution.whole or solution
    bounds, left_out = bounds_of(whole)
    return Diagnosis(
        total=total,
        unreachable=lacking,
        forbidden=total - out_of_reach - compromise,
        noise=noise,
        ignored=energies.ignored,
        missed=_relative_error(solution, total, energies.painted),
        unreachable_map=unreachable,
        forbidden_map=forbidden,
        ignored_map=ignored,
        bounds=bounds,
        bounds_left_out=left_out,
        lighting_total=total if whole is solution else whole.energy,
        is_constrained=solution.problem.is_constrained,
        compromise=compromise,
        painting_noise=painting_noise,
        place=_place(solution, unreachable) if lacking > 0 else None,
    )


def _relative_error(solution: Solution, total: float, norm2: float) -> float:
    """Return the error relative to the painting, root mean square. norm2: Σ D Ψ²."""
    if not solution.problem.is_linear:
        total, norm2 = sum(solution.certificate.objective), float(solution.norm2.sum())
    return float(np.sqrt(total / norm2)) if norm2 > 0 else 0.0


def _compromise(solution: Solution) -> float:
    """Return the excess of this view's energy over the energy with the best lighting for it alone.

    After reweighting, both are of the same squares: the loss itself has another scale.
    """
    if solution.whole is None:
        return 0.0
    alone = solve_again(solution, solution.problem)
    return max(solution.energy - alone.energy, 0.0)


def unbounded_weights(solution: Solution) -> Doubles:
    """Return the closest weights (n, 3) of any sign; fixed lights stay at 1."""
    equations, weights = solution.equations, solution.weights
    gradient = np.einsum("cij,jc->ic", equations.M, weights) - equations.b.T
    if any(light.is_scalar for light in solution.basis.lights):
        to = all_columns(solution)
        step = to @ pseudo_inverse(to.T @ equations.full_matrix @ to) @ (to.T @ gradient.T.ravel())
        return np.asarray(weights - step.reshape(3, -1).T)
    closest = weights.copy()
    is_movable = equations.reached & ~solution.basis.is_fixed[:, None]
    for c in with_progress(range(3), "channels"):
        moved = np.flatnonzero(is_movable[:, c])
        M = equations.M[c][np.ix_(moved, moved)]
        closest[moved, c] -= pseudo_inverse(M) @ gradient[moved, c]
    return closest


def _place(solution: Solution, unreachable: Floats) -> Place | None:
    """Find the region and block of the image with the most energy out of reach."""
    rows, columns = (_edges(length, BLOCKS) for length in solution.importance.shape)

    def block_sums(part: Callable[[slice], Floats]) -> Floats:
        sums = []
        for top, bottom in pairwise(rows.tolist()):
            band = part(slice(top, bottom))
            sums.append(np.add.reduceat(band.sum(axis=0, dtype=np.float64), columns[:-1], 0))
        return np.stack(sums)

    D = solution.weight
    # Noise averages out: the square of a block's mean is nearly free of it.
    counted = block_sums(lambda part_rows: D[part_rows])
    safe = np.where(counted > 0, counted, 1)
    lacking = block_sums(lambda part_rows: D[part_rows] * unreachable[part_rows]) / safe
    energy = (counted * np.square(lacking)).sum(axis=-1)
    if not energy.any():
        return None
    worst = WorstRegion.of(energy)
    y, x = worst.block
    painted = (block_sums(lambda part_rows: D[part_rows] * solution.image[part_rows]) / safe)[y, x]
    return Place(
        region=worst.region,
        share=worst.share,
        box=(int(rows[y]), int(columns[x]), int(rows[y + 1]), int(columns[x + 1])),
        painted=as_rgb(painted),
        reached=as_rgb(painted - lacking[y, x]),
    )


@dataclass(frozen=True)
class WorstRegion:
    """The region of the picture with most of what blocks (rows, columns) miss.

    region: its row and column. share: of all that is missed. inside: (rows, columns), its blocks.
    block: row and column of the one with most.
    """

    region: tuple[int, int]
    share: float
    inside: Bools
    block: tuple[int, int]

    @classmethod
    def of(cls, amount: Doubles) -> "WorstRegion":
        """Find it. amount: (rows, columns), not all 0."""
        sums = np.zeros((REGIONS, REGIONS))
        rows, columns = (REGIONS * np.arange(length) // length for length in amount.shape)
        np.add.at(sums, np.ix_(rows, columns), amount)
        row, column = divmod(int(np.argmax(sums)), REGIONS)
        inside = (rows == row)[:, None] & (columns == column)
        block = divmod(int(np.argmax(np.where(inside, amount, -1))), amount.shape[1])
        return cls((row, column), float(sums[row, column] / sums.sum()), inside, block)


def _edges(length: int, parts: int) -> npt.NDArray[np.int_]:
    """Return where to cut `length` pixels into that many nearly equal parts, or single pixels."""
    parts = min(length, parts)
    return np.asarray(np.arange(parts + 1) * length // parts, dtype=np.int_)
