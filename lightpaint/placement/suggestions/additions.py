"""The gain of each candidate light as an additional column of the basis.

Each candidate joins the current lights, the problem is solved again under the same constraints, and
the errors are compared. Some of many candidates seem to help by noise alone. So weights are solved
with one half of the samples and errors measured with the other, and vice versa: fitted noise does
not repeat.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis.planes import mix
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.analysis.noise.noise import denoised_matrix, pseudo_inverse
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduced_problem import ReducedProblem, reduced_problems
from lightpaint.placement.suggestions.candidates import Candidates

#: Number of most promising candidates for which the problem is solved again.
SOLVED = 8

#: Share of a column that others cannot replace, below which it counts as none.
ALONE = 1e-6

#: Standard errors by which a gain must be above 0. Without any gain the measured one is negative on
#: average, since a fit of one half does not fit the other.
SURE = 3.0


@dataclass(frozen=True)
class Addition:
    """A light to add, given those before it.

    candidate: index of its image. gain: decrease of the objective with it, all channels together.
    weights: (n + k, 3), of the n lights of the basis and of the k additions so far, itself the
    last. without, with_it: (h, w, 3) linear, the picture solved before and with it.
    """

    candidate: int
    gain: float
    weights: Doubles
    without: Floats
    with_it: Floats


def find_additions(
    candidates: Candidates,
    *,
    count: int,
    least: float = 0.0,
    surely: bool = True,
    too_near: Bools | None = None,
) -> list[Addition]:
    """Find at most `count` lights to add, each with the largest gain given those before it.

    least: the smallest gain. surely: whether a gain has to exceed the noise, with all doubt in
    favour of the current lights; if not, candidates that only seem to help are returned, too, for a
    closer search. The search ends at the first failure.
    too_near: (m, m), pairs of candidates that exclude each other.
    """
    folds = [_Fold(candidates, k) for k in range(2)]
    whole = _Solver(candidates, candidates.pictures, candidates.noise)
    chosen: list[int] = []
    additions: list[Addition] = []
    left = np.ones(candidates.count, dtype=bool)
    before, picture = _missed(folds, chosen), candidates.picture(whole.weights(chosen))
    while len(chosen) < count and left.any():
        tried = _most_promising(whole, chosen, left)
        gains = {k: before - _missed(folds, [*chosen, k]) for k in tried}
        # Compared with the best case for the lights without it.
        doubt = max(before - whole.objective(chosen), 0.0)
        best = _best_beyond_noise(folds, chosen, gains, doubt, least=least, surely=surely)
        if best is not None:
            gains[best] -= doubt
            before -= doubt
        else:
            best = max(gains, key=lambda k: gains[k])
            if surely or chosen or gains[best] <= 0:
                break
            # Nothing stands out yet: search closer around the largest gain.
        chosen.append(best)
        before -= gains[best]
        weights = whole.weights(chosen)
        columns = [*range(candidates.lights), *(candidates.lights + k for k in chosen)]
        without, picture = picture, candidates.picture(weights)
        additions.append(Addition(best, gains[best], weights[columns], without, picture))
        left[best] = False
        if too_near is not None:
            left &= ~too_near[best]
    return additions


def _most_promising(whole: "_Solver", chosen: Sequence[int], left: Bools) -> list[int]:
    """Return the candidates with the largest estimated gains, of those that are `left`, (m,)."""
    estimates = np.where(left, whole.estimated_gains(chosen), -1)
    return [int(k) for k in np.argsort(-estimates)[:SOLVED] if left[k]]


def _best_beyond_noise(
    folds: "Sequence[_Fold]",
    chosen: Sequence[int],
    gains: Mapping[int, float],
    doubt: float,
    *,
    least: float,
    surely: bool,
) -> int | None:
    """Return the candidate with the largest gain that is no noise; None if all may be noise.

    doubt: how much the error without it may be smaller than measured.
    """
    errors = SURE if surely else 1.0
    for k in sorted(gains, key=lambda k: -gains[k]):
        gain = gains[k] - doubt
        if gain > max(least, 0) and gain >= errors * _standard_error(folds, [*chosen, k]):
            return k
    return None


class _Solver:
    """The problem of all lights and candidates, solved with some of these off.

    Noise in its images makes lights come out too dim, and a candidate with less noise would seem to
    help: so the power of the noise is removed.
    """

    def __init__(self, candidates: Candidates, images: Floats, noise: Floats) -> None:
        self.reduction = candidates.reduction
        equations = candidates.equations(images)
        M = denoised_matrix(equations, candidates.equations(noise).M)
        equations = NormalEquations(M, equations.b, equations.target_norm2)
        self.equations = equations
        if candidates.pull is not None:
            equations = equations + candidates.pull
        self.problems = reduced_problems(equations, self.reduction)
        self.first = len(self.reduction.knobs) - candidates.count

    def weights(self, chosen: Iterable[int]) -> Doubles:
        """Return the best weights, (n + m, 3), with the candidates `chosen`; the others are 0."""
        x = np.zeros(len(self.reduction.unknowns))
        for problem, indices, values in self._solved(chosen):
            x[problem.unknowns[indices]] = values
        return self.reduction.weights(x)

    def objective(self, chosen: Iterable[int]) -> float:
        """Return the error at these weights, on the images of their solve."""
        return float(self.equations.objective(self.weights(chosen)).sum())

    def estimated_gains(self, chosen: Iterable[int]) -> Doubles:
        """Return the gain of each candidate, (m,), if the same lights stayed at their limits."""
        gains = np.zeros(len(self.reduction.unknowns))
        for problem, indices, x in self._solved(chosen):
            inside = (x > problem.lower[indices]) & (x < problem.upper[indices])
            free = indices[inside]
            gradient = problem.b - problem.M[:, indices] @ x
            # The part of a column that the free unknowns cannot replace.
            cross = problem.M[free]
            inverse = pseudo_inverse(problem.M[np.ix_(free, free)])
            power = np.diag(problem.M)
            alone = power - np.einsum("ik,ij,jk->k", cross, inverse, cross, optimize=True)
            safe = np.where(alone > ALONE * power, alone, np.inf)
            gains[problem.unknowns] = np.square(np.maximum(gradient, 0)) / safe
        places = self.reduction.places[self.first :]
        return np.array([gains[list(place)].sum() for place in places])

    def _solved(self, chosen: Iterable[int]) -> Iterator[tuple[ReducedProblem, Indices, Doubles]]:
        """Yield each problem, the indices of its unknowns that are not off, and their best
        values.
        """
        off = set(range(self.first, len(self.reduction.knobs)))
        off -= {self.first + k for k in chosen}
        unknowns = {i for knob in off for i in self.reduction.places[knob]}
        for problem in self.problems:
            left = [k for k, i in enumerate(problem.unknowns.tolist()) if i not in unknowns]
            indices = np.array(left, dtype=np.intp)
            p = problem.restricted(indices)
            x = minimise(p.M, p.b, lower=p.lower, upper=p.upper, caps=p.caps).x
            yield problem, indices, x


class _Fold:
    """A half of the samples to solve with, and the other to measure by."""

    def __init__(self, candidates: Candidates, solve_half: int) -> None:
        self.candidates, self.measured = candidates, 1 - solve_half
        self.solver = _Solver(
            candidates, candidates.half(solve_half), candidates.noise_of_half(solve_half)
        )
        self.pictures = candidates.half(self.measured)
        self.noise_images = candidates.noise_of_half(self.measured)
        self.equations = candidates.equations(self.pictures)
        self.noise = candidates.equations(self.noise_images).M
        self.known: dict[tuple[int, ...], Doubles] = {}

    def weights(self, chosen: Sequence[int]) -> Doubles:
        """Return the weights with the candidates `chosen`, cached."""
        key = tuple(chosen)
        if key not in self.known:
            self.known[key] = self.solver.weights(chosen)
        return self.known[key]

    def missed(self, chosen: Sequence[int]) -> float:
        """Return Σ D r² minus the noise of the measuring half."""
        w, e = self.weights(chosen), self.equations
        value = e.target_norm2 - 2 * np.einsum("ci,ic->c", e.b, w)
        value += np.einsum("ic,cij,jc->c", w, e.M - self.noise, w)
        return float(value.sum())

    def missed_map(self, chosen: Sequence[int]) -> Doubles:
        """Return the same for each pixel, (h, w) float64."""
        c, w = self.candidates, self.weights(chosen)
        on = w.any(axis=1)
        missed = c.image - mix(self.pictures[on], w[on])
        noise = mix(self.noise_images[on], w[on]).astype(np.float64)
        squared = np.square(missed) - np.square(noise)
        return np.asarray((c.importance * squared).sum(axis=-1))


def _missed(folds: Sequence[_Fold], chosen: Sequence[int]) -> float:
    return sum(fold.missed(chosen) for fold in folds) / len(folds)


def _standard_error(folds: Sequence[_Fold], chosen: Sequence[int]) -> float:
    """Return the standard error of the loss with `chosen`.

    For the mean of two maps it follows from their difference, pixel by pixel: differences between
    the halves of the samples are noise.
    """
    a, b = (fold.missed_map(chosen) for fold in folds)
    return float(np.sqrt(np.square(a - b).sum())) / 2
