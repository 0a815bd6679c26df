"""The convex solve inside a search for places: the best lighting for some columns.

Places are searched for, weights never are: for each choice of places the best weights under the
constraints follow by the same solve as ever. So a search has few unknowns, and no bad starts in
weights.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import BasisLight
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.constraint_reduction import reduce_to
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
    for each channel the columns (k, p), weighed, and the inverse of their inner products.
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
            gains += self.gain(c, its @ self.residual[:, c], its @ self.others[c].T, power)
        return gains

    def gain(self, c: int, reached: Floats, cross: Floats, power: Floats) -> Floats:
        """Return the gain in a channel, (k,).

        reached, power: (k,), inner products of candidates with the residual and themselves; cross:
        (k, others), with the columns of others.
        """
        alone = power - np.einsum("ki,ki->k", cross @ self.inverses[c], cross)
        # What others replace almost wholly has no gain that could be told from noise.
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
            others=[its[:, pixels] for its in self.others],
        )


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
        return with_columns(self.columns, changed)

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

    def ranking(self, fitted: Fitted) -> "Ranking":
        """Return what ranks candidates for the place of a light that is not in `fitted`."""
        others, inverses, columns = [], [], fitted.columns
        for c in range(3):
            free = self._free(fitted.weights[:, c])
            its = (columns[free, :, c] * self._root[:, c]).astype(np.float32)
            power = (its @ its.T).astype(np.float64)
            others.append(its)
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
        for c in range(3):
            root, weights = self._root[:, c], fitted.weights[:, c]
            each = slopes[:, :, c] * (root * 1.0) * weights[list(owners)][:, None]
            jacobian = np.zeros((count, each.shape[1]))
            for number, row in zip(numbers, each, strict=True):
                jacobian[number] += row
            matrix += jacobian @ jacobian.T
            gradient += jacobian @ residual[:, c]
            active = (fitted.columns[self._free(weights), :, c] * root).astype(np.float64)
            if len(active):
                cross = jacobian @ active.T
                inverse = np.linalg.pinv(active @ active.T, rcond=1e-9, hermitian=True)
                matrix -= cross @ inverse @ cross.T
                gradient -= cross @ (inverse @ (active @ residual[:, c]))
        return matrix, gradient

    def _free(self, weights: Doubles) -> Bools:
        """Return which lights shine and may change, (n,)."""
        free = weights > 0
        free[[k for k, knob in enumerate(self.reduction.fixed_weights) if knob.any()]] = False
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


def with_columns(columns: Floats, changed: Mapping[int, Floats]) -> Floats:
    """Return columns (n, p, 3), some of them replaced by (p, 3)."""
    made = columns.copy()
    for k, column in changed.items():
        made[k] = column
    return made


def fit_of(
    bases: Sequence[Basis],
    solution: Solution,
    sizes: Sequence[tuple[int, int]],
    new: Sequence[BasisLight] = (),
    constraints: Constraints | None = None,
) -> PlacementFit:
    """Return the fit of the solution's last linear problem on small films, one of each view.

    new: lights whose columns, behind those of the basis, are black as yet. constraints: on these
    alone, besides those of the solution that are for all lights.
    """
    columns: list[Floats] = []
    goals: list[Floats] = []
    weights: list[Floats] = []
    for k, (basis, size) in enumerate(zip(bases, sizes, strict=True)):
        factor = basis.size[0] // size[0]
        problem = solution.problem.view_problem(k)
        goal, importance = reduced_goal(problem, factor)
        planes = np.stack([block_mean(plane, factor) for plane in basis.planes])
        for listed, image in ((columns, planes), (goals, goal), (weights, importance)):
            whole = np.broadcast_to(image, (*image.shape[:-1], 3))
            listed.append(whole.reshape(*whole.shape[:-3], -1, 3))
    black = np.zeros((len(new), sum(its.shape[1] for its in columns), 3), np.float32)
    all_constraints = solution.problem.constraints.and_then(constraints or Constraints())
    return PlacementFit(
        np.concatenate([np.concatenate(columns, axis=1), black]),
        np.concatenate(goals),
        np.concatenate(weights),
        _with_new_lights(solution.problem.local_reduction, new, all_constraints),
        pull_with_more(solution, len(new)),
    )


def _with_new_lights(
    reduction: Reduction, new: Sequence[BasisLight], constraints: Constraints
) -> Reduction:
    """Return `reduction` with the unknowns of new lights behind its own."""
    if not new:
        return reduction
    lights = [
        entry
        for entry in constraints.lights
        if any(light.name == entry[0] or fnmatchcase(light.name, entry[0]) for light in new)
    ]
    more = reduce_to(Constraints(tuple(lights)), new)
    first = len(reduction.fixed_weights)
    knobs = [
        replace(
            knob,
            lights=tuple(k + first for k in knob.lights),
            unknowns=tuple(
                replace(x, columns=tuple((k + first, rgb) for k, rgb in x.columns))
                for x in knob.unknowns
            ),
        )
        for knob in more.knobs
    ]
    return replace(
        reduction,
        fixed_weights=np.vstack([reduction.fixed_weights, more.fixed_weights]),
        labels=(*reduction.labels, *more.labels),
        knobs=(*reduction.knobs, *knobs),
    )


def pull_with_more(solution: Solution, count: int) -> NormalEquations | None:
    """Return the pull of the lights to their present emission, and none of `count` more."""
    if (pull := solution.problem.pull) is None:
        return None
    coupling = pull.coupling
    return NormalEquations(
        np.pad(pull.M, ((0, 0), (0, count), (0, count))),
        np.pad(pull.b, ((0, 0), (0, count))),
        pull.target_norm2,
        None if coupling is None else np.pad(coupling, ((0, count), (0, 0), (0, 0))),
    )


def reduced_goal(problem: Problem, factor: int) -> tuple[Floats, Floats]:
    """Return the goal of a view and its importance on a film with a pixel for each block of pixels.

    Goals are means weighted with importance; importance is that of whole blocks.
    """
    squares = problem.squares
    importance = squares.weight.astype(np.float64)
    weight = block_mean(importance, factor)
    weighted = block_mean(squares.image * importance, factor)
    return weighted / np.where(weight > 0, weight, 1), weight * factor**2
