"""Which light that is not there would help most? Gains of additional columns of the basis.

Each is put beside the lights that there are, the problem is solved again under the same
constraints, and what is missed then is compared. Of many that are tried some seem to help by
their noise alone. So the weights are found on one half of the samples and what they miss is
measured on the other, and the other way around: noise that was fitted does not come again.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.planes import mix
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.analysis.noise.noise import denoised_matrix, pseudo_inverse
from lightpaint.lighting.constraints.reduced_problem import ReducedProblem, reduced_problems
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.placement.candidates import Candidates

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


def find_additions(
    candidates: Candidates,
    *,
    count: int,
    least: float = 0.0,
    surely: bool = True,
    too_near: npt.NDArray[np.bool_] | None = None,
) -> list[Addition]:
    """At most `count` lights to add, each the one that helps most beside those before it.

    least: the gain a light has to be worth. surely: whether it has to stand out from noise,
    with all doubt for the lights there are; if not, what only seems to help is named too, as
    where to look closer. Once there is none, there are no more.
    too_near: (m, m), pairs of candidates of which one at most is wanted.
    """
    folds = [_Fold(candidates, k) for k in range(2)]
    whole = _Solver(candidates, candidates.pictures, candidates.noise)
    chosen: list[int] = []
    found: list[Addition] = []
    left = np.ones(candidates.count, dtype=bool)
    before, picture = _missed(folds, chosen), candidates.picture(whole.weights(chosen))
    while len(chosen) < count and left.any():
        estimates = np.where(left, whole.estimated_gains(chosen), -1)
        tried = [int(k) for k in np.argsort(-estimates)[:SOLVED] if left[k]]
        # Held against the most that may be said for the lights without it.
        doubt = max(before - whole.objective(chosen), 0.0)
        gains = {k: before - _missed(folds, [*chosen, k]) for k in tried}
        order = sorted(tried, key=lambda k: -gains[k])
        worth = [k for k in order if gains[k] - doubt > max(least, 0)]
        errors = SURE if surely else 1.0
        best = next(
            (k for k in worth if gains[k] - doubt >= errors * _standard_error(folds, [*chosen, k])),
            None,
        )
        if best is not None:
            gains[best] -= doubt
            before -= doubt
        elif surely or chosen or gains[order[0]] <= 0:
            break
        else:
            # Nothing stands out yet: look closer where most seems to be gained.
            best = order[0]
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
    """The problem of all lights and candidates; solved with some of these off.

    Noise in its images makes lights come out too dim, and a candidate with less of it would make
    up for that: so the power of the noise is taken out.
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
        """(n + m, 3), the best with the candidates `chosen`; the others are 0."""
        x = np.zeros(len(self.reduction.unknowns))
        for problem, here, values in self._solved(chosen):
            x[problem.unknowns[here]] = values
        return self.reduction.weights(x)

    def objective(self, chosen: Iterable[int]) -> float:
        """Return the miss at these weights, by the images they were solved with."""
        return float(self.equations.objective(self.weights(chosen)).sum())

    def estimated_gains(self, chosen: Iterable[int]) -> Doubles:
        """(m,), what each candidate would gain if the same lights stayed at their limits."""
        gains = np.zeros(len(self.reduction.unknowns))
        for problem, here, x in self._solved(chosen):
            inside = (x > problem.lower[here]) & (x < problem.upper[here])
            free = here[inside]
            gradient = problem.b - problem.M[:, here] @ x
            # What is left of a column once the free unknowns have made up for it as they can.
            cross = problem.M[free]
            inverse = pseudo_inverse(problem.M[np.ix_(free, free)])
            power = np.diag(problem.M)
            alone = power - np.einsum("ik,ij,jk->k", cross, inverse, cross, optimize=True)
            safe = np.where(alone > ALONE * power, alone, np.inf)
            gains[problem.unknowns] = np.square(np.maximum(gradient, 0)) / safe
        places = self.reduction.places[self.first :]
        return np.array([gains[list(its)].sum() for its in places])

    def _solved(self, chosen: Iterable[int]) -> Iterator[tuple[ReducedProblem, Indices, Doubles]]:
        """Each problem, which of its unknowns are not off, and their best values."""
        off = set(range(self.first, len(self.reduction.knobs)))
        off -= {self.first + k for k in chosen}
        unknowns = {i for knob in off for i in self.reduction.places[knob]}
        for problem in self.problems:
            left = [k for k, i in enumerate(problem.unknowns.tolist()) if i not in unknowns]
            here = np.array(left, dtype=np.intp)
            p = problem.restricted(here)
            x = minimise(p.M, p.b, lower=p.lower, upper=p.upper, caps=p.caps).x
            yield problem, here, x


class _Fold:
    """One half of the samples to solve with, the other to measure by."""

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
        on = w.any(axis=1)
        missed = c.image - mix(self.pictures[on], w[on])
        noise = mix(self.noise_images[on], w[on]).astype(np.float64)
        squared = np.square(missed) - np.square(noise)
        return np.asarray((c.importance * squared).sum(axis=-1))


def _missed(folds: Sequence[_Fold], chosen: Sequence[int]) -> float:
    return sum(fold.missed(chosen) for fold in folds) / len(folds)


def _standard_error(folds: Sequence[_Fold], chosen: Sequence[int]) -> float:
    """Of what is missed with `chosen`.

    That of the mean of two maps, pixel by pixel, is told by their difference: what one half of
    the samples shows and the other does not is noise.
    """
    a, b = (fold.missed_map(chosen) for fold in folds)
    return float(np.sqrt(np.square(a - b).sum())) / 2
