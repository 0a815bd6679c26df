"""The convex solve inside a search for places: the best lighting for some columns.

The search is over places only: for each choice of places, the usual solve gives the best weights
under the constraints. So a search has few unknowns, and no bad starts in weights.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import BasisLight
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduced_problem import reduced_problems
from lightpaint.placement.look_goals import LookGoal, balanced, goal_of

#: Share of a column that others cannot replace, below which it counts as none.
LEAST_OWN = 1e-3


@dataclass(frozen=True)
class Fitted:
    """The best weights for some columns. weights: (n, c). missed: Σ D r² and the pull."""

    columns: Floats
    weights: Doubles
    missed: float


@dataclass(frozen=True)
class Ranking:
    """A measure of candidates for a light's place.

    It has the residual without that light, and the columns of other lights that may compensate for
    it.

    root: (p, c), square root of importance; residual: (p, c), weighted with it. others, inverses:
    for each channel the weighted columns (k, p), and the inverse of their inner products.
    """

    root: Floats
    residual: Floats
    others: Sequence[Floats]
    inverses: Sequence[Floats]

    def gains(self, candidates: Floats) -> Doubles:
        """Return about how much less would be missed with each candidate, (k,).

        candidates: (k, p, 3). The lights that shine are taken to stay on.
        """
        gains = np.zeros(len(candidates))
        for c in range(self.root.shape[1]):
            weighted = candidates[:, :, c % 3] * self.root[:, c]
            power = np.einsum("kp,kp->k", weighted, weighted)
            gains += self.gain(
                c, weighted @ self.residual[:, c], weighted @ self.others[c].T, power
            )
        return gains

    def gain(self, c: int, reached: Floats, cross: Floats, power: Floats) -> Floats:
        """Return the gain in a channel, (k,).

        reached, power: (k,), inner products of candidates with the residual and themselves; cross:
        (k, others), with the columns of others.
        """
        alone = power - np.einsum("ki,ki->k", cross @ self.inverses[c], cross)
        # If others can replace it almost completely, its gain is lost in noise.
        is_own = alone > LEAST_OWN * power
        squares = np.square(np.maximum(reached, 0))
        gain: Floats = np.divide(squares, alone, out=np.zeros_like(power), where=is_own)
        return gain

    def at(self, pixels: Indices) -> "Ranking":
        """Return the ranking of candidates that are known at some pixels, (v,), alone."""
        return replace(
            self,
            root=self.root[pixels],
            residual=self.residual[pixels],
            others=[other_columns[:, pixels] for other_columns in self.others],
        )


class PlacementFit:
    """Goals on a small film, and the columns of all lights at their present places.

    Looks that share places have separate weights, so they act as further channels: 3 for each look,
    which share the columns. So a search does not deal with looks. A look counts by its relative
    error, whether it is bright or dark.

    columns: (n, p, 3) at unit emission. goals: of each look.
    """

    def __init__(self, columns: Floats, goals: Sequence[LookGoal]) -> None:
        self.columns, self._looks = columns, balanced(goals)
        importance = np.concatenate([look.importance for look in self._looks], axis=1)
        self._root = np.sqrt(importance.astype(np.float64))
        self._goal = np.concatenate([look.goal for look in self._looks], axis=1) * self._root
        self.norm2 = float(np.square(self._goal).sum())

    @property
    def channels(self) -> range:
        """All channels of all looks; channel c is of the columns' channel c % 3."""
        return range(self._root.shape[1])

    def replaced(self, changed: Mapping[int, Floats]) -> Floats:
        """Return the columns, those of some lights replaced by (p, 3)."""
        return with_columns(self.columns, changed)

    def fitted(self, columns: Floats) -> Fitted:
        """Return the best weights for `columns`, under the constraints of each look."""
        all_weights, missed = [], 0.0
        for k, look in enumerate(self._looks):
            equations, reduction = self._equations(columns, k), look.reduction
            x = np.zeros(len(reduction.unknowns))
            for problem in reduced_problems(equations, reduction):
                x[problem.unknowns] = minimise(
                    problem.M,
                    problem.b,
                    lower=problem.lower,
                    upper=problem.upper,
                    caps=problem.caps,
                ).x
            weights = reduction.weights(x)
            all_weights.append(weights)
            missed += float(equations.objective(weights).sum())
        return Fitted(columns, np.concatenate(all_weights, axis=1), missed)

    def picture(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i in all channels, (p, c)."""
        looks = [weights[:, 3 * k : 3 * k + 3] for k in range(len(self._looks))]
        return np.concatenate([np.einsum("npc,nc->pc", columns, its) for its in looks], axis=1)

    def missed_map(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return D r² of each pixel, (p,), with weights that were found on other paths."""
        return np.asarray(np.square(self._residual(columns, weights)).sum(axis=1))

    def ranking(self, fitted: Fitted) -> "Ranking":
        """Return the ranking of candidates for the place of a light that is not in `fitted`."""
        others, inverses, columns = [], [], fitted.columns
        for c in self.channels:
            free = self._free(fitted.weights, c)
            weighted = (columns[free, :, c % 3] * self._root[:, c]).astype(np.float32)
            power = (weighted @ weighted.T).astype(np.float64)
            others.append(weighted)
            inverses.append(np.linalg.pinv(power, rcond=1e-8, hermitian=True).astype(np.float32))
        residual = self._residual(columns, fitted.weights)
        return Ranking(self._root.astype(np.float32), residual.astype(np.float32), others, inverses)

    def newton(
        self, fitted: Fitted, slopes: Floats, owners: Sequence[int], numbers: Sequence[int]
    ) -> tuple[Doubles, Doubles]:
        """Return Gauss-Newton matrix (q, q) and gradient (q,), the weights eliminated.

        slopes: (s, p, 3), of the columns `owners` by q numbers of poses: each by one of `numbers`,
        which several columns may share.
        """
        residual = self._residual(fitted.columns, fitted.weights)
        count = max(numbers) + 1
        matrix, gradient = np.zeros((count, count)), np.zeros(count)
        for c in self.channels:
            root, weights = self._root[:, c], fitted.weights[:, c]
            weighted_slopes = slopes[:, :, c % 3] * (root * 1.0) * weights[list(owners)][:, None]
            jacobian = np.zeros((count, weighted_slopes.shape[1]))
            for number, row in zip(numbers, weighted_slopes, strict=True):
                jacobian[number] += row
            matrix += jacobian @ jacobian.T
            gradient += jacobian @ residual[:, c]
            free = self._free(fitted.weights, c)
            active = (fitted.columns[free, :, c % 3] * root).astype(np.float64)
            if len(active):
                cross = jacobian @ active.T
                inverse = np.linalg.pinv(active @ active.T, rcond=1e-9, hermitian=True)
                matrix -= cross @ inverse @ cross.T
                gradient -= cross @ (inverse @ (active @ residual[:, c]))
        return matrix, gradient

    def _free(self, weights: Doubles, c: int) -> Bools:
        """Return which lights shine in a channel and may change, (n,)."""
        free = weights[:, c] > 0
        fixed = self._looks[c // 3].reduction.fixed_weights
        free[[k for k, knob in enumerate(fixed) if knob.any()]] = False
        return np.asarray(free)

    def _residual(self, columns: Floats, weights: Doubles) -> Doubles:
        return np.asarray(self._goal - self.picture(columns, weights) * self._root)

    def _equations(self, columns: Floats, k: int) -> NormalEquations:
        """Return the equations of look k."""
        root, goal = (its[:, 3 * k : 3 * k + 3] for its in (self._root, self._goal))
        weighed, pull = columns * root, self._looks[k].pull
        M = np.einsum("ipc,jpc->cij", weighed, weighed, optimize=True)
        b = np.einsum("ipc,pc->ci", weighed, goal)
        equations = NormalEquations(M, b, np.square(goal).sum(axis=0))
        return equations if pull is None else equations + pull


def with_columns(columns: Floats, changed: Mapping[int, Floats]) -> Floats:
    """Return columns (n, p, 3), some of them replaced by (p, 3)."""
    replaced = columns.copy()
    for k, column in changed.items():
        replaced[k] = column
    return replaced


def fit_of(
    bases: Sequence[Basis],
    looks: Sequence[tuple[Solution, Sequence[int]]],
    sizes: Sequence[tuple[int, int]],
    new: Sequence[BasisLight] = (),
    constraints: Constraints | None = None,
) -> PlacementFit:
    """Return the fit of the last linear problem of each look on small films, one of each view.

    looks: solutions, and for each of their views its place among `bases`. new: lights whose
    columns, behind those of the basis, are black as yet. constraints: on these alone, besides
    those of the solutions that are for all lights.
    """
    columns = []
    for basis, size in zip(bases, sizes, strict=True):
        factor = basis.size[0] // size[0]
        planes = np.stack([block_mean(plane, factor) for plane in basis.planes])
        columns.append(planes.reshape(len(planes), -1, 3))
    present = np.concatenate(columns, axis=1)
    black = np.zeros((len(new), *present.shape[1:]), np.float32)
    goals = [goal_of(solution, views, sizes, new, constraints) for solution, views in looks]
    return PlacementFit(np.concatenate([present, black]), goals)
