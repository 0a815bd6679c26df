"""The freedom around an answer: directions and spread of the weights, answers to other equations.

Weights (n, 3) lie flat in a direction, (3 n), channel by channel.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import NormalDist
from typing import Self

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.symmetric_matrices import excess_above, sandwich
from lightpaint.lighting.analysis.noise.basis_noise import (
    NULL_EIGENVALUE,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.unknown_blocks import Block
from lightpaint.progress import with_progress

#: Relative distance at which a sum counts as at its limit.
AT_LIMIT = 1e-9

#: Share of all cases outside of a 95 % interval.
OUTSIDE_SHARE = 0.05

#: Largest standard deviation of a light, relative to its own level, that other lights answer to.
#: One that the paint hardly shows may scatter by thousands of its levels; where its equations say
#: that another light would have to make up for that, no answer under w >= 0 does.
MAX_DEVIATION = 1.0

#: Part of an unknown's effect on the weights of its light that others of this light do not have,
#: from which it counts as a direction of its own.
MIN_APART = 1e-3

#: Level of a light that is off, relative to the mean light of the whole picture.
FAINT = 0.01

NORMAL = NormalDist()

#: Standard deviations beyond a bound from which a normal tail is approximated by an exponential.
FAR_DEVIATIONS = 30.0


@dataclass(frozen=True)
class Directions:
    """Directions D of k unknowns, (k, m): first those along single unknowns, then others.

    unknowns, signs: (s,), of the single ones. others: (k, m - s). Most are single ones, which need
    no products.
    """

    unknowns: Indices
    signs: Doubles
    others: Doubles

    @property
    def count(self) -> int:
        """Number of directions, m."""
        return int(self.unknowns.size + self.others.shape[1])

    def times(self, M: Doubles) -> Doubles:
        """Return M D, (i, m), of M (i, k)."""
        single = M[:, self.unknowns]
        single *= self.signs
        return np.hstack([single, M @ self.others]) if self.others.shape[1] else single

    def dot(self, x: Doubles) -> Doubles:
        """Return Dᵀ x, (m, j) or (m,), of x (k, j) or (k,)."""
        return np.asarray(self.times(np.atleast_2d(x.T)).T.reshape(self.count, *x.shape[1:]))

    def within(self, M: Doubles) -> Doubles:
        """Return Dᵀ M D, (m, m), of a symmetric M (k, k)."""
        return self.between(M, self)

    def between(self, M: Doubles, other: "Directions") -> Doubles:
        """Return Dᵀ M D', (m, m'), of a symmetric M (k, k)."""
        if self.others.shape[1] or other.others.shape[1]:
            return self.dot(other.times(M))
        part = M[np.ix_(self.unknowns, other.unknowns)]
        part *= self.signs[:, None]
        part *= other.signs
        return part

    def effect(self, steps: Doubles) -> Doubles:
        """Return D y, (k, j) or (k,), of steps y, (m, j) or (m,)."""
        single = self.unknowns.size
        moved = self.others @ steps[single:]
        moved[self.unknowns] += (self.signs * steps[:single].T).T
        return np.asarray(moved)

    def joined(self, more: "Directions") -> tuple["Directions", Indices | None]:
        """Return these and more directions, and their places if all of these came before those;
        None if they do.
        """
        unknowns = np.concatenate([self.unknowns, more.unknowns])
        signs = np.concatenate([self.signs, more.signs])
        joint = Directions(unknowns, signs, np.hstack([self.others, more.others]))
        if not self.others.shape[1]:
            return joint, None
        places = np.arange(self.count + more.count)
        ends = [self.unknowns.size, self.count, self.count + more.unknowns.size]
        singles, others, more_singles, more_others = np.split(places, ends)
        return joint, np.concatenate([singles, more_singles, others, more_others])

    def chosen(self, which: Bools) -> "Directions":
        """Return some of the directions. which: (m,)."""
        single = self.unknowns.size
        is_chosen, others = which[:single], self.others[:, which[single:]]
        return Directions(self.unknowns[is_chosen], self.signs[is_chosen], others)


@dataclass(frozen=True)
class ActiveLimits:
    """The active bounds of a block's unknowns, then its active caps.

    exits: (k, h), for each a direction that leaves it, and no other, by one unit. distances: (h,),
    the largest step along it. bound_unknowns: (b,), the unknowns of the first b; sides: (b,), 1 at
    the lower, -1 at the upper bound. sums: (h - b, k), coefficients of the others.
    """

    exits: Directions
    distances: Doubles
    bound_unknowns: Indices
    sides: Doubles
    sums: Doubles

    @property
    def own_exits(self) -> Directions:
        """(k, h), the effects of the directions on their own unknowns."""
        of_caps = self.exits.others[:, self.exits.others.shape[1] - len(self.sums) :]
        return Directions(self.bound_unknowns, self.sides, np.where(self.sums.T != 0, of_caps, 0))

    def constrained(self, covariance: Doubles) -> Doubles:
        """Return a covariance of the unknowns, (k, k), under the active bounds and caps."""
        constrained = covariance.copy()
        constrained[self.bound_unknowns], constrained[:, self.bound_unknowns] = 0, 0
        for row in self.sums:
            members = np.flatnonzero(row)
            along = constrained[np.ix_(members, members)] @ row[members]
            if (variance := float(row[members] @ along)) > 0:
                constrained[np.ix_(members, members)] -= np.outer(along, along) / variance
        return constrained


@dataclass(frozen=True)
class BlockFreedom:
    """The freedom of the unknowns of one block around an answer.

    block: the unknowns, whose effect on the weights is 0 where a light reaches nothing. emitted:
    the same including such lights. free: (k, m), directions without active bounds and caps.
    """

    block: Block
    emitted: Block
    free: Directions
    active: ActiveLimits


def block_freedoms(solution: Solution, equations: NormalEquations) -> Iterator[BlockFreedom]:
    """Yield the freedom of each set of channels that the unknowns couple.

    equations: of the solve.
    """
    reduction, lit = solution.problem.local_reduction, solution.equations.reached
    optimum = solve_reduced(equations, reduction, solution.weights)
    x, (rows, distances) = optimum.x, _active_sums(reduction, optimum)
    for emitted in reduction.blocks:
        block, unknowns = emitted.masked(lit), emitted.unknowns
        has_effect = np.zeros(unknowns.size, bool)
        for e in block.entries:
            has_effect[np.repeat(e.columns, e.counts)[e.values != 0]] = True
        lower, upper = reduction.lower[unknowns], reduction.upper[unknowns]
        is_movable = (lower < upper) & has_effect
        side = np.where(x[unknowns] <= lower, 1, np.where(x[unknowns] >= upper, -1, 0)) * is_movable
        is_inside, is_bound = independent_unknowns(block, is_movable & (side == 0), side != 0)
        inside, bound = np.flatnonzero(is_inside), np.flatnonzero(is_bound)
        caps_here = rows[:, unknowns].any(axis=1)
        sums = rows[caps_here][:, unknowns]
        free, lowering = _keep_sums(sums, inside)
        limits = _active_limits(sums, lowering, bound, side, upper - lower, distances[caps_here])
        yield BlockFreedom(block, emitted, free, limits)


def independent_unknowns(block: Block, inside: Bools, bound: Bools) -> tuple[Bools, Bools]:
    """Return the unknowns inside their bounds and at them, (k,) each, without those whose effect
    others have.

    A gamut has a corner for each unknown, so a light has more of these than channels. Its freedom
    is the freedom of its weights: where corners inside their bounds span a direction, another one
    at its bound keeps nothing from moving along it. Of corners at their bounds, those are kept
    which point farthest away from all kept ones.
    """
    owners, effects = _own_effects(block)
    inside, bound = inside.copy(), bound.copy()
    movable = np.flatnonzero((inside | bound) & (owners >= 0))
    lights, counts = np.unique(owners[movable], return_counts=True)
    for light in lights[counts > effects.shape[1]]:
        own = movable[owners[movable] == light]
        left = effects[own] / np.linalg.norm(effects[own], axis=1, keepdims=True)
        kept = np.zeros(own.size, bool)
        for group in (inside[own], bound[own]):
            while (sizes := np.linalg.norm(left, axis=1) * group).max() > MIN_APART:
                best = int(sizes.argmax())
                kept[best], axis = True, left[best] / sizes[best]
                left = left - np.outer(left @ axis, axis)
        inside[own[~kept]] = bound[own[~kept]] = False
    return inside, bound


def _own_effects(block: Block) -> tuple[Indices, Doubles]:
    """Return the light of each unknown that moves one light alone, (k,), else -1; and its effect
    on the channels of that light, (k, channels).
    """
    k, none = block.unknowns.size, -1
    owners, effects = np.full(k, none), np.zeros((k, len(block.entries)))
    is_shared = np.zeros(k, bool)
    for place, e in enumerate(block.entries):
        lights = e.lights[e.first]
        known = owners[e.columns]
        is_shared[e.columns] |= (e.counts > 1) | ((known != none) & (known != lights))
        owners[e.columns], effects[e.columns, place] = lights, e.values[e.first]
    owners[is_shared | ~effects.any(axis=1)] = none
    return owners, effects


def free_directions(solution: Solution) -> list[Doubles]:
    """Return the free directions around the answer, (3 n, k), for each independent problem."""
    solved, n = solution.problem.with_pull(solution.problem.solved), len(solution.weights)
    return [
        room.block.effects(room.free.effect(np.eye(room.free.count)), n).reshape(3 * n, -1)
        for room in block_freedoms(solution, solved)
    ]


def solve_for(solution: Solution, equations: NormalEquations) -> Doubles:
    """Solve `equations` for weights (n, 3) under the same constraints as the answer."""
    problem = solution.problem
    pulled = problem.with_pull(equations)
    return solve_reduced(pulled, problem.local_reduction, solution.weights).weights


def all_columns(solution: Solution) -> Doubles:
    """Return the effect of every unknown on the weights, (3 n, k), without constraints: only fixed
    lights stay.
    """
    lights = np.flatnonzero(~solution.basis.is_fixed)
    scalar = np.array([light.is_scalar for light in solution.basis.lights], dtype=bool)
    lit = solution.equations.reached
    columns = np.zeros((3, len(scalar), 3, lights.size))
    for k, light in enumerate(lights):
        for c in range(3):
            # With one weight for all channels, the unknown is the unknown of the first channel.
            columns[c, light, 0 if scalar[light] else c, k] = lit[light, c]
    return columns.reshape(3 * len(scalar), -1)


def _active_sums(reduction: Reduction, optimum: ReducedOptimum) -> tuple[Doubles, Doubles]:
    """Return coefficients of active caps and requirements; for the result see `_active_caps`."""
    rows, room = _active_caps(reduction, optimum.x)
    held = np.flatnonzero(optimum.required > 0)
    if not held.size:
        return rows, room
    required = reduction.required[0][held]
    required = -required / np.linalg.norm(required, axis=1, keepdims=True)
    return np.vstack([rows, required]), np.append(room, np.full(held.size, np.inf))


def _active_caps(reduction: Reduction, x: Doubles) -> tuple[Doubles, Doubles]:
    """Return coefficients of active caps, and the distances to their other limits.

    Returns (j, unknowns), negative where the sum may only rise, and (j,).
    """
    rows, room = [], []
    for cap in reduction.caps:
        members, coefficients = list(cap.unknowns), np.asarray(cap.coefficients)
        total = coefficients @ x[members]
        if not cap.lower * (1 + AT_LIMIT) < total < cap.upper * (1 - AT_LIMIT):
            row = np.zeros(x.size)
            row[members] = coefficients if total >= cap.upper * (1 - AT_LIMIT) else -coefficients
            rows.append(row)
            room.append(cap.upper - cap.lower)
    return np.array(rows).reshape(len(rows), x.size), np.array(room)


def _keep_sums(rows: Doubles, inside: Indices) -> tuple[Directions, Doubles]:
    """Return the effects of unknowns inside their bounds on the sums `rows`, (j, k).

    Returns m directions that keep the sums, and (k, j), for each sum a direction that lowers it by
    one and keeps the others; NaN if there is none.
    """
    k = rows.shape[1]
    is_summed = rows[:, inside].any(axis=0)
    single, summed = inside[~is_summed], inside[is_summed]
    if not len(rows):
        return Directions(single, np.ones(single.size), np.zeros((k, 0))), np.zeros((k, 0))
    left, sizes, right = np.linalg.svd(rows[:, summed])
    rank = int((sizes > AT_LIMIT * sizes.max(initial=0)).sum())
    inverse = right[:rank].T @ (left[:, :rank] / sizes[:rank]).T
    lost = np.abs(rows[:, summed] @ inverse - np.eye(len(rows))).max(axis=0, initial=0) > AT_LIMIT
    others, lowering = np.zeros((k, summed.size - rank)), np.zeros(rows.T.shape)
    others[summed], lowering[summed] = right[rank:].T, -inverse
    return Directions(single, np.ones(single.size), others), np.where(lost, np.nan, lowering)


def _active_limits(
    rows: Doubles,
    lowering: Doubles,
    bound: Indices,
    side: Indices,
    ranges: Doubles,
    distances: Doubles,
) -> ActiveLimits:
    """Return the bounds and caps of a block that can be left one by one.

    rows, lowering: of the sums, (j, k) and (k, j), see `_keep_sums`. bound: (b,), unknowns at a
    bound. side: (k,), 1 at the lower, -1 at the upper one. ranges: (k,), between both; distances:
    (j,), of caps from their other limits.
    """
    pushes = rows[:, bound] * side[bound]
    is_single = ~pushes.any(axis=0)
    alone, pushing = bound[is_single], bound[~is_single]
    exits = np.zeros((len(side), pushing.size))
    exits[pushing, np.arange(pushing.size)] = side[pushing]
    # Unknowns inside their bounds compensate the effect on the sums.
    for j, b in np.argwhere(pushes[:, ~is_single] != 0):
        exits[:, b] += lowering[:, j] * (rows[j, pushing[b]] * side[pushing[b]])
    can_leave = np.isfinite(exits).all(axis=0), np.isfinite(lowering).all(axis=0)
    others = np.hstack([exits[:, can_leave[0]], lowering[:, can_leave[1]]])
    bound = np.concatenate([alone, pushing[can_leave[0]]])
    return ActiveLimits(
        Directions(alone, side[alone].astype(np.float64), others),
        np.concatenate([ranges[bound], distances[can_leave[1]]]),
        bound,
        side[bound].astype(np.float64),
        rows[can_leave[1]],
    )


@dataclass(frozen=True)
class WeightSpread:
    """The standard deviations of weights, (n, 3) each.

    inside: within bounds. exits: below and above, when they leave a bound or cap. excess: (3,), of
    the objective. is_far: (n,), lights that scatter further than their own level.
    """

    inside: Doubles
    exits: tuple[Doubles, Doubles]
    excess: Doubles
    is_far: Bools

    def mixed_with(self, weak: "WeightSpread", doubts: Doubles) -> "WeightSpread":
        """Return the spread of lights that may be noise alone, and of others.

        weak: the spread where such lights have as little power as they may. doubts: (n, 3), 0 to 1.
        The expected excess is the excess with these equations.
        """
        inside, below, above = (
            np.sqrt((1 - doubts) * np.square(x) + doubts * np.square(y))
            for x, y in zip((self.inside, *self.exits), (weak.inside, *weak.exits), strict=True)
        )
        return WeightSpread(inside, (below, above), self.excess, self.is_far | weak.is_far)


class WeightResponse:
    """The response of the weights to noise of the gradient.

    The work on the equations serves the noise of the basis and the noise of the painting.
    """

    def __init__(
        self,
        solution: Solution,
        scatters: NormalEquations,
        unbiased: NormalEquations,
        weights: Doubles,
    ) -> None:
        """Prepare the response.

        scatters: the equations by which the noise of the gradient moves the weights. unbiased,
        weights: the equations and weights, (n, 3), whose gradient tells how firmly bounds hold.
        """
        problem = solution.problem
        gradient = problem.with_pull(unbiased).gradient(weights).T
        pulled = problem.with_pull(scatters)
        self._missed, self._levels = problem.equations.M, _levels(solution)
        self._blocks = [
            BlockResponse.of(room, pulled, gradient)
            for room in with_progress(list(block_freedoms(solution, pulled)))
        ]

    def spread(self, covariance: Doubles) -> WeightSpread:
        """Return the spread of the weights. covariance: (3, n, 3, n), of the gradient."""
        n, missed = len(self._levels), self._missed
        free, below, above = np.zeros((3, n, 3))
        excess, is_far = np.zeros(3), np.zeros(n, bool)
        for response in with_progress(self._blocks):
            block, emitted = response.room.block, response.room.emitted
            active = response.room.active
            ends, of_unknowns = response.propagate(block.covariance(covariance))
            sizes = np.zeros(emitted.unknowns.size)
            for e in emitted.entries:
                change = np.abs(e.values) / self._levels[e.lights]
                np.maximum.at(sizes, np.repeat(e.columns, e.counts), change)
            limited, own = limit_deviations(of_unknowns, np.where(sizes > 0, sizes, 1))
            for e, c in zip(block.entries, block.channels, strict=True):
                excess[c] += np.vdot(e.between(missed[c], e), limited[e.place(e)])
            variances = emitted.variances(active.constrained(limited), n)
            if own is not None:
                whole = emitted.variances(active.constrained(own), n)
                variances = np.maximum(variances, whole)
                is_far |= (whole > 0).any(axis=1)
            free += variances
            down, up = _exit_squares(emitted, active.own_exits, ends, n)
            below += down
            above += up
        inside, down, up = (np.sqrt(np.maximum(x, 0)) for x in (free, below, above))
        return WeightSpread(inside, (down, up), excess, is_far)


def _exit_squares(
    emitted: Block, exits: Directions, ends: Doubles, n: int
) -> tuple[Doubles, Doubles]:
    """Return the sums of squares of the steps of weights, (n, 3), below and above, with the
    unknowns that leave their limits. ends: (h,), how far.
    """
    single = exits.unknowns.size
    steps = np.zeros(emitted.unknowns.size)
    steps[exits.unknowns] = exits.signs * ends[:single]
    down, up = np.zeros((2, n, 3))
    for e, c in zip(emitted.entries, emitted.channels, strict=True):
        moved = e.values * steps[np.repeat(e.columns, e.counts)]
        for total, part in ((down, np.minimum(moved, 0)), (up, np.maximum(moved, 0))):
            total[:, c] += np.bincount(e.lights, np.square(part), n)
    if exits.others.shape[1]:
        by_sums = emitted.effects(exits.others * ends[single:], n)
        down += np.square(np.minimum(by_sums, 0)).sum(axis=2).T
        up += np.square(np.maximum(by_sums, 0)).sum(axis=2).T
    return down, up


def limit_deviations(covariance: Doubles, sizes: Doubles) -> tuple[Doubles, Doubles | None]:
    """Return the covariance (k, k) of unknowns with no light deviating further than its own level,
    and the whole one of those that do; None if none does.

    sizes: (k,), the change of a light, relative to its level, with each unknown. Axes of the
    covariance longer than MAX_DEVIATION are shortened to that: a light that is hardly seen is then
    undetermined alone, and lights that look alike are so together.
    """
    moved = np.flatnonzero(covariance.diagonal() > 0)
    scale = sizes[moved]
    relative = covariance[np.ix_(moved, moved)]
    relative *= scale[:, None]
    relative *= scale
    if (excess := excess_above(relative, MAX_DEVIATION**2)) is None:
        return covariance, None
    relative -= excess
    is_far = relative.diagonal() >= (MAX_DEVIATION / 2) ** 2
    relative /= scale[:, None]
    relative /= scale
    far = moved[is_far]
    limited, own = np.zeros((2, *covariance.shape))
    limited[np.ix_(moved, moved)] = relative
    own[np.ix_(far, far)] = covariance[np.ix_(far, far)]
    return limited, own


def _levels(solution: Solution) -> Doubles:
    """Return the levels of lights to which deviations are relative, (n,)."""
    basis = solution.basis
    sizes = np.sqrt(basis.power.sum(axis=1))
    levels = np.maximum(solution.weights, basis.current_weights).max(axis=1)
    brightness = levels * sizes
    faint = FAINT * brightness.mean() / np.where(sizes > 0, sizes, np.inf)
    return np.where(levels > faint, levels, np.where(faint > 0, faint, 1))


def gradient_response(solution: Solution) -> Doubles:
    """Return the response of the weights to noise of the gradient, (3 n, 3 n), channel by channel.

    It is the matrix whose product with the covariance of the gradient on both sides makes the
    scatter of `error_bars`, but for bounds that hold.
    """
    noise, n = noise_sums(solution), len(solution.weights)
    pulled = solution.problem.with_pull(solution.problem.solved)
    gradient, covariance = pulled.gradient(solution.weights).T, noise.full_covariance
    whole = np.zeros((3 * n, 3 * n))
    for room in block_freedoms(solution, pulled):
        response = BlockResponse.of(room, pulled, gradient)
        _, inverse = response.movable_inverse(room.block.covariance(covariance))
        moves = room.block.effects(inverse, n).reshape(3 * n, -1)
        whole += room.block.effects(np.ascontiguousarray(moves.T), n).reshape(3 * n, -1)
    return whole


@dataclass(frozen=True)
class BlockResponse:
    """The response of the unknowns of a block to noise of the gradient.

    inverse: (m, m), of the matrix of the free directions. adapted: (m, h), how far these go where
    a bound or cap is left by one unit. stiffness: (h, h), the matrix of the exits with that;
    counts: (h,), those that no other lights can replace. pushed: (h,), the distances beyond the
    limits at which these exits would end without them.
    """

    room: BlockFreedom
    inverse: Doubles
    adapted: Doubles
    stiffness: Doubles
    counts: Bools
    pushed: Doubles

    @classmethod
    def of(cls, room: BlockFreedom, equations: NormalEquations, gradient: Doubles) -> Self:
        """Return the response under some equations, with the pull. gradient: (3, n)."""
        free, exits = room.free, room.active.exits
        M, push = (
            room.block.matrix(equations.M, equations.coupling),
            room.block.right_side(gradient),
        )
        inverse, across = pseudo_inverse(free.within(M)), free.between(M, exits)
        adapted, alone = inverse @ across, exits.within(M)
        stiffness = alone - across.T @ adapted
        counts = stiffness.diagonal() > NULL_EIGENVALUE * alone.diagonal()
        onwards = np.maximum(exits.dot(push) - adapted.T @ free.dot(push), 0)
        pushed = np.where(counts, onwards, 0) / np.where(counts, stiffness.diagonal(), 1)
        return cls(room, inverse, adapted, stiffness, counts, pushed)

    def movable_inverse(self, C: Doubles) -> tuple[Doubles, Doubles]:
        """Return how far the active bounds may be left, (h,), and the inverse of the matrix, (k,
        k), over all that noise may move.

        C: (k, k), covariance of the noise of the gradient. Noise moves the free directions, and
        the directions of bounds that noise alone may have activated.
        """
        ends, moved, inverse = self._inverse_of_moved(C)
        return ends, moved.effect(np.ascontiguousarray(moved.effect(inverse).T))

    def propagate(self, C: Doubles) -> tuple[Doubles, Doubles]:
        """Return how far the active bounds may be left, (h,), and the covariance of all unknowns,
        (k, k): Cov(x) = M⁻¹ C M⁻¹ over all that noise may move. C: as in `movable_inverse`.
        """
        ends, moved, inverse = self._inverse_of_moved(C)
        covariance = sandwich(inverse, moved.within(C))
        if moved.others.shape[1]:
            return ends, moved.effect(np.ascontiguousarray(moved.effect(covariance).T))
        whole = np.zeros(C.shape)
        whole[np.ix_(moved.unknowns, moved.unknowns)] = (
            covariance * moved.signs * moved.signs[:, None]
        )
        return ends, whole

    def _inverse_of_moved(self, C: Doubles) -> tuple[Doubles, Directions, Doubles]:
        """Return the ends of `movable_inverse`, what noise may move, (k, m'), and the inverse of
        its matrix, (m', m').
        """
        free, exits, adapted = self.room.free, self.room.active.exits, self.adapted
        counts, pushed = self.counts, self.pushed
        # Of directions that leave a limit while the free unknowns adapt.
        across = free.between(C, exits)
        noise = ((free.within(C) @ adapted - 2 * across) * adapted).sum(axis=0)
        noise = np.maximum(noise + exits.within(C).diagonal(), 0)
        spread = np.where(counts, np.sqrt(noise), 0) / np.where(
            counts, self.stiffness.diagonal(), 1
        )
        alone = [_one_sided(u, s) for u, s in zip(pushed.tolist(), spread.tolist(), strict=True)]
        is_moved = pushed < NORMAL_95 * spread
        ends = np.minimum(alone, self.room.active.distances) / NORMAL_95
        if not is_moved.any():
            return ends, free, self.inverse
        # The inverse of the free directions is a part of the whole, by its blocks.
        adapted, chosen = adapted[:, is_moved], exits.chosen(is_moved)
        stiff = pseudo_inverse(self.stiffness[np.ix_(is_moved, is_moved)])
        across = -adapted @ stiff
        own = self.inverse - across @ adapted.T
        moved, order = free.joined(chosen)
        whole = np.block([[own, across], [across.T, stiff]])
        return ends, moved, whole if order is None else whole[np.ix_(order, order)]


def _one_sided(pushed: float, spread: float) -> float:
    """Return the end of the 95 % interval of a value at a bound, from there on.

    Without the bound it would be beyond it by `pushed`, u, with the standard deviation s of
    `spread`. Since it cannot be beyond, the end is U with

        P(X > U) = 0.05 P(X > 0),   X ~ N(-u, s²),

    which is 1.96 s at u = 0, about 3 s²/u far beyond, and never 0: whatever the true value is, it
    is below U in 95 % of all cases or more.
    """
    if spread <= 0:
        return 0.0
    u = pushed / spread
    if u > FAR_DEVIATIONS:
        # The tail of a normal distribution is nearly exp(-u t - t²/2) there.
        return spread * (math.hypot(u, math.sqrt(-2 * math.log(OUTSIDE_SHARE))) - u)
    beyond = math.erfc(u / math.sqrt(2)) / 2
    return spread * (-NORMAL.inv_cdf(OUTSIDE_SHARE * beyond) - u)
