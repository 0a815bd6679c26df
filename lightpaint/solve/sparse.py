"""As few lights as possible: the best lighting of one light, of two, of three, …

Which K of n lights come closest is a combinatorial question. It is answered greedily, each
step judged by the exact optimum of all three channels together: lights are added to none and
taken from all, and exchanged one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.solve.normal_equations import Doubles, NormalEquations
from lightpaint.solve.quadratic import UNREACHED
from lightpaint.solve.solver import solve_normal_equations

#: Candidates solved for exactly at each step: those whose gain if nothing else moved is greatest.
SHORTLIST = 12

#: An exchange has to lower the objective by this share of ‖Ψ‖²: less is round-off.
GAIN = 1e-12


@dataclass(frozen=True)
class SparsePath:
    """Lightings of few lights, from none to K.

    chosen: for each count the lights that are on, kept ones apart, in the order they came in;
    a light may leave again in exchange for a better one. objective: (K + 1,), over all
    channels; relative_objective: over ‖Ψ‖². weights: (K + 1, n, 3), 0 for all others.
    """

    chosen: tuple[tuple[int, ...], ...]
    objective: Doubles
    relative_objective: Doubles
    weights: Doubles

    @property
    def order(self) -> tuple[int, ...]:
        """All lights of the path in the order in which they first came in."""
        return tuple(dict.fromkeys(i for lights in self.chosen for i in lights))


def sparse_path(
    equations: NormalEquations,
    most: int | None = None,
    *,
    is_scalar: Sequence[bool] = (),
    is_fixed: Sequence[bool] = (),
) -> SparsePath:
    """The best lighting found for each number of lights from 0 to `most` (all by default).

    is_scalar: per light, whether one weight serves its three channels. is_fixed: lights that
    stay at weight 1; they count nothing. The path ends early once no light can help.
    """
    n = equations.b.shape[1]
    fixed = np.array(is_fixed, bool) if len(is_fixed) else np.zeros(n, bool)
    free = np.flatnonzero(~fixed)
    coupled = [bool(is_scalar[i]) for i in free.tolist()] if len(is_scalar) else [False] * free.size
    search = _Search(equations.holding(fixed), coupled)
    most = free.size if most is None else min(most, free.size)

    fewer = search.from_all(most)
    lights: tuple[int, ...] = ()
    found = [search.solve(lights)]
    chosen = [lights]
    while len(lights) < most:
        lights, best = search.grow(lights, found[-1])
        lights, best = search.exchange(lights, best)
        # What is left when lights are taken from all of them may be better.
        if len(lights) in fewer:
            left = search.exchange(*fewer[len(lights)])
            if left[1].objective < best.objective - GAIN * search.norm2:
                lights, best = _in_the_order_of(chosen[-1], left[0]), left[1]
        if best.objective >= found[-1].objective - GAIN * search.norm2:
            break
        found.append(best)
        chosen.append(lights)

    weights = np.zeros((len(found), n, 3))
    weights[:, fixed] = 1
    weights[:, free] = np.array([each.weights for each in found]).reshape(-1, free.size, 3)
    objective = np.array([each.objective for each in found])
    norm2 = float(equations.target_norm2.sum())
    return SparsePath(
        tuple(tuple(int(free[i]) for i in lights) for lights in chosen),
        objective,
        objective / (norm2 if norm2 > 0 else 1.0),
        weights,
    )


def _in_the_order_of(before: tuple[int, ...], lights: tuple[int, ...]) -> tuple[int, ...]:
    kept = tuple(i for i in before if i in lights)
    return (*kept, *(i for i in lights if i not in kept))


@dataclass(frozen=True)
class _Found:
    weights: Doubles  # (n, 3)
    objective: float


class _Search:
    """Subsets of the lights of one problem, each solved exactly and once."""

    def __init__(self, equations: NormalEquations, is_scalar: Sequence[bool]) -> None:
        self.equations, self.is_scalar = equations, list(is_scalar)
        self.power = np.einsum("cii->ic", equations.M)
        lit = self.power > UNREACHED * self.power.max(initial=0)
        self.candidates = np.flatnonzero(lit.any(axis=1)).tolist()
        self.norm2 = float(equations.target_norm2.sum())
        self._known: dict[frozenset[int], _Found] = {}

    def solve(self, lights: Sequence[int], near: Doubles | None = None) -> _Found:
        """The optimum of these lights with all others off. near: weights to start from."""
        key = frozenset(lights)
        if key not in self._known:
            on = sorted(key)
            some = NormalEquations(
                self.equations.M[:, on][:, :, on],
                self.equations.b[:, on],
                self.equations.target_norm2,
            )
            weights = np.zeros(self.power.shape)
            result = solve_normal_equations(
                some,
                weights[on] if near is None else near[on],
                is_scalar=[self.is_scalar[i] for i in on],
            )
            weights[on] = result.weights
            self._known[key] = _Found(weights, float(some.objective(result.weights).sum()))
        return self._known[key]

    def grow(self, lights: tuple[int, ...], now: _Found) -> tuple[tuple[int, ...], _Found]:
        """One light more: the one that helps most."""
        tries = [(*lights, i) for i in self.shortlist(lights, now)]
        return min(
            ((each, self.solve(each, now.weights)) for each in tries),
            key=lambda pair: pair[1].objective,
            default=(lights, now),
        )

    def exchange(self, lights: tuple[int, ...], now: _Found) -> tuple[tuple[int, ...], _Found]:
        """Swap single lights for others as long as that helps."""
        improved = len(lights) > 1
        while improved:
            improved = False
            for i in lights:
                rest = tuple(j for j in lights if j != i)
                other, found = self.grow(rest, self.solve(rest, now.weights))
                if found.objective < now.objective - GAIN * self.norm2:
                    lights, now, improved = other, found, True
                    break
        return lights, now

    def from_all(self, most: int) -> dict[int, tuple[tuple[int, ...], _Found]]:
        """By count: lights taken from the optimum of all, each time the one missed least."""
        now = self.solve(self.candidates)
        lights = tuple(np.flatnonzero(now.weights.any(axis=1)).tolist())
        sets = {}
        while lights:
            now = self.solve(lights, now.weights)
            if len(lights) <= most:
                sets[len(lights)] = lights, now
            share = np.square(now.weights * np.sqrt(self.power)).sum(axis=1)
            faint = sorted(lights, key=lambda i: share[i])[:SHORTLIST]
            tries = [tuple(j for j in lights if j != i) for i in faint]
            lights = min(tries, key=lambda each: self.solve(each, now.weights).objective)
        return sets

    def shortlist(self, lights: tuple[int, ...], now: _Found) -> list[int]:
        """The lights that would lower the objective most if all others stayed as they are."""
        M, w = self.equations.M, now.weights
        pull = (self.equations.b - np.einsum("cij,jc->ci", M, w)).T  # (n, 3)
        scalar = np.array(self.is_scalar, bool)
        apart = np.maximum(pull, 0) ** 2 / np.where(self.power > 0, self.power, np.inf)
        total = self.power.sum(axis=1)
        tied = np.maximum(pull.sum(axis=1), 0) ** 2 / np.where(total > 0, total, np.inf)
        gain = np.where(scalar, tied, apart.sum(axis=1))
        others = [i for i in self.candidates if i not in lights]
        return sorted(others, key=lambda i: -gain[i])[:SHORTLIST]
