"""Which light that is not there would help most? Gains of additional columns of the basis.

Each is put beside the lights that there are, the problem is solved again under the same
constraints, and what is missed then is compared. Of many that are tried some seem to help by
their noise alone. So the weights are found on one half of the samples and what they miss is
measured on the other, and the other way around: noise that was fitted does not come again.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis, mix
from lightpaint.errors import SizeError
from lightpaint.images.blocks import block_mean, whole_factor
from lightpaint.images.exr import Floats
from lightpaint.solve.constrained import preferring, weights_of
from lightpaint.solve.constraints import Constraints
from lightpaint.solve.normal_equations import Doubles, NormalEquations, inner_products
from lightpaint.solve.optimum import minimise
from lightpaint.solve.reduced_problem import ReducedProblem, problems
from lightpaint.solve.reduction import Reduction, Unknown, reduce_to
from lightpaint.solve.solve import Solution, chosen_reduction
from lightpaint.solve.uncertainty import pseudo_inverse

#: Candidates that the problem is solved for again, of those that seem to help most.
SOLVED = 8

#: Share of a column that others cannot make up for, below which it is taken for none.
ALONE = 1e-6

#: Standard errors by which a gain must be above 0. Under no gain at all the measured one is
#: negative on average, since what was fitted to one half does not fit the other.
SURE = 3.0


@dataclass(frozen=True)
class Addition:
    """One light to add, given those before it.

    candidate: index of its image. gain: by how much the objective falls with it, all channels
    together. weights: (n + k, 3), of the n lights of the basis and of the k additions so far,
    itself the last. without, with_it: (h, w, 3) linear, the picture solved before and with it.
    """

    candidate: int
    gain: float
    weights: Doubles
    without: Floats
    with_it: Floats


@dataclass(frozen=True)
class Candidates:
    """A solved problem, and images of lights to try, all of one size.

    images, noise: (n + m, h, w, 3), the n lights of the basis and m candidates at unit emission,
    and half the differences of halves of their samples. halves: (n + m, 2), shares of the
    samples in half A and B. image, importance: what is solved for. reduction: what may be done
    with the n lights. pull: of `prefer current`, for these.
    """

    images: Floats
    noise: Floats
    halves: Doubles
    image: Floats
    importance: Floats
    reduction: Reduction
    pull: NormalEquations | None
    count: int

    @classmethod
    def of(cls, basis: Basis, solution: Solution, added: Basis) -> "Candidates":
        """added: images of candidates, at the size of `basis` or a whole part of it.

        Lights in it that are fixed are no candidates. Raises SizeError for other sizes.
        """
        size = added.size
        factor = whole_factor(basis.size, size)
        if factor is None:
            raise SizeError(
                f"candidates of {size[1]}x{size[0]} for a basis of {basis.size[1]}x"
                f"{basis.size[0]}: render them at a whole part of its size"
            )
        image, importance = _reduced(solution.image, solution.importance, factor)
        free = ~added.is_fixed
        count = int(free.sum())
        images, noise = (
            np.concatenate([[block_mean(one, factor) for one in its], more[free]])
            for its, more in (
                (basis.images, added.images),
                (basis.half_differences, added.half_differences),
            )
        )
        return cls(
            images,
            noise,
            np.concatenate([_shares(basis, len(basis.lights)), _shares(added, count)]),
            image,
            importance,
            _with_free_lights(_reduction(basis, solution), count),
            _pull(basis, solution, count),
            count,
        )

    @property
    def lights(self) -> int:
        """n, the lights of the basis."""
        return len(self.images) - self.count

    def picture(self, weights: Doubles) -> Floats:
        """Σ w_i Φ_i, (h, w, 3). weights: (n + m, 3)."""
        return mix(self.images, weights)

    def half(self, k: int) -> Floats:
        """The images as half A (0) or B (1) of the samples has them."""
        sign = 1 if k == 0 else -1
        scale = sign * 2 * self.halves[:, 1 - k]
        return np.asarray(self.images + self.noise * _column(scale), np.float32)

    def noise_of_half(self, k: int) -> Floats:
        """What has the variance of `half(k)`, as its square."""
        return np.asarray(self.noise * _column(2 * np.sqrt(self.halves[:, 1 - k])), np.float32)

    def equations(self, images: Floats) -> NormalEquations:
        """Of these images, and of what is solved for."""
        return NormalEquations(*inner_products(images, self.image, self.importance))


def find_additions(
    candidates: Candidates,
    *,
    count: int,
    least: float = 0.0,
    sure: float = SURE,
    too_near: npt.NDArray[np.bool_] | None = None,
) -> list[Addition]:
    """At most `count` lights to add, each the one that helps most beside those before it.

    least: the gain a light has to be worth; sure: its standard errors. Once there is none,
    there are no more. too_near: (m, m), pairs of candidates of which one at most is wanted.
    """
    folds = [_Fold(candidates, k) for k in range(2)]
    whole = _Solver(candidates, candidates.equations(candidates.images))
    chosen: list[int] = []
    found: list[Addition] = []
    left = np.ones(candidates.count, dtype=bool)
    before, picture = _missed(folds, chosen), candidates.picture(whole.weights(chosen))
    while len(chosen) < count and left.any():
        estimates = np.where(left, whole.estimated_gains(chosen), -1)
        tried = [int(k) for k in np.argsort(-estimates)[:SOLVED] if left[k]]
        gains = {k: before - _missed(folds, [*chosen, k]) for k in tried}
        worth = sorted((k for k in tried if gains[k] > max(least, 0)), key=lambda k: -gains[k])
        best = next((k for k in worth if _standard_errors(folds, chosen, k) >= sure), None)
        if best is None:
            break
        chosen.append(best)
        before -= gains[best]
        weights = whole.weights(chosen)
        kept = [*range(candidates.lights), *(candidates.lights + k for k in chosen)]
        without, picture = picture, candidates.picture(weights)
        found.append(Addition(best, gains[best], weights[kept], without, picture))
        left[best] = False
        if too_near is not None:
            left &= ~too_near[best]
    return found


class _Solver:
    """The problem of all lights and candidates; solved with some of these off."""

    def __init__(self, candidates: Candidates, equations: NormalEquations) -> None:
        self.reduction = candidates.reduction
        if candidates.pull is not None:
            equations = equations + candidates.pull
        self.problems = problems(equations, self.reduction)
        self.first = len(self.reduction.knobs) - candidates.count

    def weights(self, chosen: Iterable[int]) -> Doubles:
        """(n + m, 3), the best with the candidates `chosen`; the others are 0."""
        x = np.zeros(len(self.reduction.unknowns))
        for problem, here, values in self._solved(chosen):
            x[[problem.its[k] for k in here]] = values
        return weights_of(self.reduction, x)

    def estimated_gains(self, chosen: Iterable[int]) -> Doubles:
        """(m,), what each candidate would gain if the same lights stayed at their limits."""
        gains = np.zeros(len(self.reduction.unknowns))
        for problem, here, x in self._solved(chosen):
            inside = (x > problem.lower[here]) & (x < problem.upper[here])
            free = np.asarray(here, dtype=int)[inside]
            gradient = problem.b - problem.M[:, here] @ x
            # What is left of a column once the free unknowns have made up for it as they can.
            cross = problem.M[free]
            inverse = pseudo_inverse(problem.M[np.ix_(free, free)])
            power = np.diag(problem.M)
            alone = power - np.einsum("ik,ij,jk->k", cross, inverse, cross, optimize=True)
            safe = np.where(alone > ALONE * power, alone, np.inf)
            gains[problem.its] = np.square(np.maximum(gradient, 0)) / safe
        knobs = self.reduction.knobs[self.first :]
        return np.array([gains[list(its)].sum() for _, its in knobs])

    def _solved(self, chosen: Iterable[int]) -> Iterator[tuple[ReducedProblem, list[int], Doubles]]:
        """Each problem, which of its unknowns are not off, and their best values."""
        off = set(range(self.first, len(self.reduction.knobs)))
        off -= {self.first + k for k in chosen}
        unknowns = {i for knob in off for i in self.reduction.knobs[knob][1]}
        for problem in self.problems:
            here = [k for k, i in enumerate(problem.its) if i not in unknowns]
            yield problem, here, _best(problem, here)


class _Fold:
    """One half of the samples to solve with, the other to measure by."""

    def __init__(self, candidates: Candidates, solve_half: int) -> None:
        self.candidates, self.measured = candidates, 1 - solve_half
        self.solver = _Solver(candidates, candidates.equations(candidates.half(solve_half)))
        self.equations = candidates.equations(candidates.half(self.measured))
        noise = candidates.noise_of_half(self.measured)
        self.noise, _, _ = inner_products(noise, candidates.image, candidates.importance)
        self.known: dict[tuple[int, ...], Doubles] = {}

    def weights(self, chosen: Sequence[int]) -> Doubles:
        key = tuple(chosen)
        if key not in self.known:
            self.known[key] = self.solver.weights(chosen)
        return self.known[key]

    def missed(self, chosen: Sequence[int]) -> float:
        """Σ D r² without what the noise of the measuring half adds, which is not missed."""
        w, e = self.weights(chosen), self.equations
        value = e.target_norm2 - 2 * np.einsum("ci,ic->c", e.b, w)
        value += np.einsum("ic,cij,jc->c", w, e.M - self.noise, w)
        return float(value.sum())

    def missed_map(self, chosen: Sequence[int]) -> Doubles:
        """The same for each pixel, (h, w) float64."""
        c, w = self.candidates, self.weights(chosen)
        missed = c.image - mix(c.half(self.measured), w)
        noise = mix(c.noise_of_half(self.measured), w).astype(np.float64)
        squared = np.square(missed) - np.square(noise)
        return np.asarray(c.importance * squared.sum(axis=-1))


def _missed(folds: Sequence[_Fold], chosen: Sequence[int]) -> float:
    return sum(fold.missed(chosen) for fold in folds) / len(folds)


def _standard_errors(folds: Sequence[_Fold], chosen: Sequence[int], new: int) -> float:
    """A gain over its standard error.

    That of the mean of two maps of the gain, pixel by pixel, is told by their difference:
    what one half of the samples shows and the other does not is noise.
    """
    a, b = (fold.missed_map(chosen) - fold.missed_map([*chosen, new]) for fold in folds)
    error = float(np.sqrt(np.square(a - b).sum()))
    return float((a + b).sum()) / error if error > 0 else np.inf


def _best(problem: ReducedProblem, here: Sequence[int]) -> Doubles:
    """The best of the unknowns at `here`, the others 0."""
    place = {k: j for j, k in enumerate(here)}
    caps = [
        replace(cap, unknowns=tuple(place[i] for i in cap.unknowns))
        for cap in problem.caps
        if cap.unknowns[0] in place
    ]
    lower, upper = problem.lower[here], problem.upper[here]
    M: Doubles = problem.M[np.ix_(here, here)]
    return minimise(M, problem.b[here], lower=lower, upper=upper, caps=caps).x


def _reduction(basis: Basis, solution: Solution) -> Reduction:
    if solution.constraints:
        return chosen_reduction(basis, solution)
    return reduce_to(Constraints(), basis.lights)


def _with_free_lights(reduction: Reduction, count: int) -> Reduction:
    """`reduction` with that many lights more, of which nothing is asked."""
    n = len(reduction.held)
    held = np.vstack([reduction.held, np.zeros((count, 3))])
    labels = [*reduction.labels, *[""] * count]
    more = Reduction(
        held, labels, [*reduction.unknowns], [*reduction.caps], [*reduction.knobs]
    )
    for k in range(n, n + count):
        more.add([Unknown(((k, axis),)) for axis in np.eye(3)], None)
    return more


def _pull(basis: Basis, solution: Solution, count: int) -> NormalEquations | None:
    """What draws the lights to their present emission; nothing draws the candidates."""
    if not (solution.constraints and solution.constraints.prefer_current):
        return None
    n = len(basis.lights)
    nothing = NormalEquations(np.zeros((3, n, n)), np.zeros((3, n)), np.zeros(3))
    strength = solution.constraints.prefer_current
    pull = preferring(nothing, basis, basis.present_weights, strength)
    return NormalEquations(
        np.pad(pull.M, ((0, 0), (0, count), (0, count))),
        np.pad(pull.b, ((0, 0), (0, count))),
        pull.target_norm2,
    )


def _reduced(image: Floats, importance: Floats, factor: int) -> tuple[Doubles, Doubles]:
    """Means of blocks, weighted with importance, and the importance of whole blocks."""
    weight = block_mean(importance.astype(np.float64), factor)
    weighted = block_mean(image * importance[..., None].astype(np.float64), factor)
    return weighted / np.where(weight > 0, weight, 1)[..., None], weight * factor**2


def _shares(basis: Basis, count: int) -> Doubles:
    """(count, 2), the part of the samples that half A and B have."""
    a, b = basis.origin.halves
    return np.tile([a / (a + b), b / (a + b)], (count, 1))


def _column(values: Doubles) -> Doubles:
    return values[:, None, None, None]
