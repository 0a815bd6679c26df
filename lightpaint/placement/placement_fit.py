"""The convex solve inside a search for places: the best lighting for some columns.

Places are searched for, weights never are: for each choice of places the best weights under the
constraints follow by the same solve as ever. So a search has few unknowns, and no bad starts in
weights.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduced_problem import reduced_problems
from lightpaint.lighting.unknowns.reduction import Reduction

#: Share of a column that others cannot replace, below which it counts as none.
LEAST_OWN = 1e-3


@dataclass(frozen=True)
class Fitted:
    """The best weights for some columns. weights: (n, 3). missed: Σ D r² and the pull."""

    columns: Floats
    weights: Doubles
    missed: float


@dataclass(frozen=True)
class Ranking:
    """A measure of candidates for a light's place.

    It knows what is missed without that light, and the columns of others that may make up for it.

    root: (p, 3), square root of importance; residual: (p, 3), weighed with it. others, inverses:
    for each channel the columns (k, p) and the inverse of their inner products.
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
        for c in range(3):
            its = candidates[:, :, c] * self.root[:, c]
            power = np.einsum("kp,kp->k", its, its)
            cross = its @ self.others[c].T
            alone = power - np.einsum("ki,ki->k", cross @ self.inverses[c], cross)
            reached = np.maximum(its @ self.residual[:, c], 0)
            # What others replace almost wholly has no gain that could be told from noise.
            is_own = alone > LEAST_OWN * power
            gains += np.divide(reached**2, alone, out=np.zeros_like(power), where=is_own)
        return gains


class PlacementFit:
    """A goal on a small film, and the columns of all lights where they are now.

    columns: (n, p, 3) at unit emission. goal: (p, 3); importance: (p, 3), >= 0. pull: what holds
    weights, beside the picture.
    """

    def __init__(
        self,
        columns: Floats,
        goal: Floats,
        importance: Floats,
        reduction: Reduction,
        pull: NormalEquations | None,
    ) -> None:
        self.columns, self.reduction, self.pull = columns, reduction, pull
        self._root = np.sqrt(importance.astype(np.float64))
        self._goal = goal * self._root
        self.norm2 = float(np.square(self._goal).sum())

    def replaced(self, changed: Mapping[int, Floats]) -> Floats:
        """Return the columns, those of some lights replaced by (p, 3)."""
        columns = self.columns.copy()
        for k, column in changed.items():
            columns[k] = column
        return columns

    def fitted(self, columns: Floats) -> Fitted:
        """Return the best weights for `columns`, under the constraints."""
        equations = self._equations(columns)
        x = np.zeros(len(self.reduction.unknowns))
        for problem in reduced_problems(equations, self.reduction):
            x[problem.unknowns] = minimise(
                problem.M, problem.b, lower=problem.lower, upper=problem.upper, caps=problem.caps
            ).x
        weights = self.reduction.weights(x)
        return Fitted(columns, weights, float(equations.objective(weights).sum()))

    def missed_map(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return D r² of each pixel, (p,), with weights that were found on other paths."""
        return np.asarray(np.square(self._residual(columns, weights)).sum(axis=1))

    def ranking(self, columns: Floats, fitted: Fitted, light: int) -> "Ranking":
        """Return what ranks candidates for a light's place. fitted: without that light."""
        others, inverses = [], []
        for c in range(3):
            free = self._free(fitted.weights[:, c], light)
            its = (columns[free, :, c] * self._root[:, c]).astype(np.float32)
            power = (its @ its.T).astype(np.float64)
            others.append(its)
            inverses.append(np.linalg.pinv(power, rcond=1e-8, hermitian=True).astype(np.float32))
        residual = self._residual(columns, fitted.weights)
        return Ranking(self._root.astype(np.float32), residual.astype(np.float32), others, inverses)

    def newton(self, fitted: Fitted, slopes: Floats, owners: list[int]) -> tuple[Doubles, Doubles]:
        """Return Gauss-Newton matrix (q, q) and gradient (q,), the weights eliminated.

        slopes: (q, p, 3), of the columns of the lights `owners` by the numbers of their poses.
        """
        residual = self._residual(fitted.columns, fitted.weights)
        matrix, gradient = np.zeros((len(owners),) * 2), np.zeros(len(owners))
        for c in range(3):
            root, weights = self._root[:, c], fitted.weights[:, c]
            jacobian = (slopes[:, :, c] * root).astype(np.float64) * weights[owners][:, None]
            matrix += jacobian @ jacobian.T
            gradient += jacobian @ residual[:, c]
            active = (fitted.columns[self._free(weights), :, c] * root).astype(np.float64)
            if len(active):
                cross = jacobian @ active.T
                inverse = np.linalg.pinv(active @ active.T, rcond=1e-9, hermitian=True)
                matrix -= cross @ inverse @ cross.T
                gradient -= cross @ (inverse @ (active @ residual[:, c]))
        return matrix, gradient

    def _free(self, weights: Doubles, but: int | None = None) -> Bools:
        """Return which lights shine and may change, (n,)."""
        free = weights > 0
        free[[k for k, knob in enumerate(self.reduction.fixed_weights) if knob.any()]] = False
        if but is not None:
            free[but] = False
        return free

    def _residual(self, columns: Floats, weights: Doubles) -> Doubles:
        picture = np.einsum("npc,nc->pc", columns, weights)
        return np.asarray(self._goal - picture * self._root)

    def _equations(self, columns: Floats) -> NormalEquations:
        weighed = columns * self._root
        M = np.einsum("ipc,jpc->cij", weighed, weighed, optimize=True)
        b = np.einsum("ipc,pc->ci", weighed, self._goal)
        equations = NormalEquations(M, b, np.square(self._goal).sum(axis=0))
        return equations if self.pull is None else equations + self.pull
