"""The optimum of lamps that mix more emitters than there are channels, by the matrices of lights.

Six drives of a lamp are six unknowns, but its light has three channels, which are independent
wherever the drives may turn freely. So Newton's steps are for emissions: lights that may take any
colour move in each channel by itself, by its own matrix; one with drives at bounds moves along
those that are free, in a small system of all such lights, a Schur complement. The drives then are
those whose emission comes nearest to the new one (emission_mixes.py).

No step raises the objective. They end at a certificate in the drives, as the solves of other
problems do, or are given up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra import clipped_newton
from lightpaint.lighting.algebra.free_factor import KEPT_PROMISE, SHORTEST_PART
from lightpaint.lighting.algebra.optimum import NO_CAPS, Optimum
from lightpaint.lighting.algebra.quadratic import EPSILON, UNREACHED_POWER, kkt_step
from lightpaint.lighting.unknowns.emission_mixes import MAX_EMITTERS, EmissionMixes
from lightpaint.lighting.unknowns.unknown_blocks import Block, Entries, KnobGroup
from lightpaint.progress import cancellation_check
from lightpaint.threads import one_thread

#: Steps after which they are given up, and before which each lamp guesses its bounds by itself.
MAX_STEPS, GUESSED_STEPS = 24, 8

#: Share of a colour, squared, that others must not mix if it is to count as a further one.
MIN_NEW = 1e-8


@dataclass(frozen=True)
class _Group:
    """Knobs of u unknowns and l lights each. mixes: their emissions, if they are lamps.

    places: (k, u). lights: (k, l). columns: (k, u, 3 l).
    """

    places: Indices
    lights: Indices
    columns: Doubles
    mixes: EmissionMixes | None

    @classmethod
    def of(cls, group: KnobGroup, lower: Doubles, upper: Doubles) -> "_Group":
        """Make it of knobs. lower, upper: bounds of all unknowns."""
        low, high = lower[group.places], upper[group.places]
        is_lamp = (
            group.lights.shape[1] == 1
            and 3 <= group.columns.shape[1] <= MAX_EMITTERS
            and not group.is_free
            and bool(np.isfinite([low, high]).all())
        )
        mixes = EmissionMixes.of(group.columns, low, high) if is_lamp else None
        return cls(group.places, group.lights, group.columns, mixes)


@dataclass(frozen=True)
class MixedLights:
    """Unknowns of one block without caps, some of which are drives of lamps of many emitters.

    lower, upper: (k,). columns: as in `Reduction`.
    """

    groups: tuple[_Group, ...]
    lower: Doubles
    upper: Doubles
    columns: tuple[Indices, Indices, Doubles]

    @classmethod
    def of(
        cls,
        groups: Sequence[KnobGroup],
        bounds: tuple[Doubles, Doubles],
        columns: tuple[Indices, Indices, Doubles],
    ) -> "MixedLights | None":
        """Make them of the knobs of a reduction; None if none of them is such a lamp, or if one
        mixes more colours than this can tell apart.
        """
        made = tuple(_Group.of(group, *bounds) for group in groups)
        is_known = all(x.mixes or x.columns.shape[1] <= x.columns.shape[2] for x in made)
        if not (is_known and any(x.mixes for x in made)):
            return None
        return cls(made, *bounds, columns)

    def minimise(
        self,
        M: Doubles,
        b: Doubles,
        coupling: Doubles | None,
        x: Doubles,
        *,
        tolerance: float,
    ) -> Optimum | None:
        """Minimise ½ wᵀM w − bᵀw, w = C x, between the bounds, from x, (k,); None if steps lead
        nowhere, or to one of several lightings that are as good.

        M: (3, n, n); b: (3, n); coupling: (n, 3, 3) or None, as in `NormalEquations`.
        """
        with one_thread():
            steps = _Steps.of(self, M, b, coupling)
            return None if steps is None else steps.to_optimum(x, tolerance)


@dataclass(frozen=True)
class _Point:
    """Unknowns x, (k,), with their scaled emissions w and the gradient M w − b there, (n, 3)."""

    x: Doubles
    w: Doubles
    gradient: Doubles


@dataclass(frozen=True)
class _Steps:
    """The steps of one problem, scaled to a unit diagonal of each M_c.

    root: (n, 3), the factor of an emission; 0 for a light that reaches nothing. M: (3, n, n); b:
    (n, 3); coupling: (n, 3, 3). columns: of each group, (k, u, 3 l). power: (k,), the power of each
    unknown at 1. can_be_whole: of each group, (k,), whether a light may have any emission, and no
    coupling joins its channels.
    """

    lights: MixedLights
    root: Doubles
    M: Doubles
    b: Doubles
    coupling: Doubles | None
    columns: tuple[Doubles, ...]
    power: Doubles
    can_be_whole: tuple[Bools, ...]

    @classmethod
    def of(
        cls, lights: MixedLights, M: Doubles, b: Doubles, coupling: Doubles | None
    ) -> "_Steps | None":
        """Scale a problem; None if it is not convex."""
        diagonal = np.einsum("cii->ic", M)
        is_lit = (diagonal > UNREACHED_POWER * diagonal.max(initial=0)).any(axis=1)
        if not (np.isfinite(M).all() and np.isfinite(b).all() and (diagonal[is_lit] > 0).all()):
            return None
        root = np.sqrt(np.where(is_lit[:, None], diagonal, 0))
        inverse = np.where(root > 0, 1 / np.where(root > 0, root, 1), 0)
        M = M * inverse.T[:, :, None]
        M *= inverse.T[:, None, :]
        if coupling is not None:
            coupling = coupling * inverse[:, :, None] * inverse[:, None, :]
        columns = tuple(
            x.columns * root[x.lights].reshape(len(x.lights), 1, -1) for x in lights.groups
        )
        power = np.zeros(lights.lower.size)
        for group, scaled in zip(lights.groups, columns, strict=True):
            power[group.places] = _powers(M, coupling, group.lights, scaled)
        can_be_whole = tuple(
            _can_be_whole(group.lights, scaled, coupling)
            for group, scaled in zip(lights.groups, columns, strict=True)
        )
        return cls(lights, root, M, b.T * inverse, coupling, columns, power, can_be_whole)

    def to_optimum(self, x: Doubles, tolerance: float) -> Optimum | None:
        """Take steps from x, (k,); see `MixedLights.minimise`."""
        low, high = self.lights.lower, self.lights.upper
        counts = self.power > UNREACHED_POWER * self.power.max(initial=0)
        scale = np.sqrt(np.where(counts, self.power, 1))
        size = self._size(scale, counts)
        point, systems = self._point(np.clip(x, low, high)), list[Doubles]()
        check = cancellation_check()
        for step in range(MAX_STEPS + 1):
            check()
            slope = np.where(counts, self._along_unknowns(point.gradient) / scale, 0)
            off = kkt_step(slope, point.x * scale, low * scale, high * scale)
            residual = float(np.abs(off).max(initial=0)) / size
            lower = None
            if residual > tolerance:
                stays = ((point.x <= low) & (slope > 0)) | ((point.x >= high) & (slope < 0))
                lower, systems = self._step(point, counts & ~stays, guess=step < GUESSED_STEPS)
            if lower is None:
                most = tolerance
                if residual > most:
                    most = max(most, self._round_off(point.w, scale) / size)
                if residual > most or any(clipped_newton.is_suspect(matrix) for matrix in systems):
                    return None
                return Optimum(point.x, slope * scale, NO_CAPS, residual, 0, step, most)
            point = lower
        return None

    def _round_off(self, w: Doubles, scale: Doubles) -> float:
        """Return the round-off of the slopes at emissions w, (n, 3), as in `Quadratic`."""
        terms = np.matmul(np.abs(self.M), np.abs(w).T[:, :, None])[..., 0].T + np.abs(self.b)
        columns = tuple(np.abs(x) for x in self.columns)
        sums = self._along_unknowns(terms, columns) / scale
        return 4 * EPSILON * float(sums.max(initial=0))

    def _point(self, x: Doubles) -> _Point:
        w = self._emissions(x)
        return _Point(x, w, self._gradient(w))

    def _step(
        self, point: _Point, free: Bools, *, guess: bool
    ) -> tuple[_Point | None, list[Doubles]]:
        """Return a point where the objective is lower, or None, and the matrices solved for it.

        free: (k,), the unknowns that no slope keeps at a bound. guess: whether to try fewer first.
        """
        if guess:
            turns, systems = self._newton(point.gradient, self._likely_free(point, free))
            if (lower := self._lower_point(point, turns)) is not None:
                return lower, systems
        turns, systems = self._inward_step(point, free)
        return self._lower_point(point, turns), systems

    def _likely_free(self, point: _Point, free: Bools) -> Bools:
        """Return the free unknowns, (k,), less the unknowns of lamps that each lamp by itself, with
        all others as they are, would leave at their bounds.
        """
        at_low, at_high = point.x <= self.lights.lower, point.x >= self.lights.upper
        likely = free.copy()
        for group in self.lights.groups:
            if group.mixes is None:
                continue
            k = np.flatnonzero((free & (at_low | at_high))[group.places].any(axis=1))
            if k.size:
                lights, places = group.lights[k, 0], group.places[k]
                emission = (point.w[lights] - point.gradient[lights]) / self.root[lights]
                x = group.mixes.nearest(k, emission, np.square(self.root[lights]))
                stays_low = at_low[places] & (x <= self.lights.lower[places])
                stays_high = at_high[places] & (x >= self.lights.upper[places])
                likely[places] &= ~(stays_low | stays_high)
        return likely

    def _inward_step(self, point: _Point, free: Bools) -> tuple[Doubles, list[Doubles]]:
        """Return Newton's step as `_newton` does, of the free unknowns, (k,), less those that it
        would move from a bound outwards, which spoil the step of the others.
        """
        at_low, at_high = point.x <= self.lights.lower, point.x >= self.lights.upper
        while True:
            turns, systems = self._newton(point.gradient, free)
            outward = free & ((at_low & (turns < 0)) | (at_high & (turns > 0)))
            if not outward.any():
                return turns, systems
            free = free & ~outward

    def _lower_point(self, point: _Point, turns: Doubles) -> _Point | None:
        """Return a point after a step, (k,), where the objective is lower; None if there is none.

        The whole step goes to the emissions nearest to its end; a part of it is clipped to the
        bounds, as in `projected_newton`.
        """
        low, high = self.lights.lower, self.lights.upper
        trial, part = self._nearest(point.x + turns), 1.0
        while part >= SHORTEST_PART:
            after = self._point(trial)
            change = after.w - point.w
            slope = float((point.gradient * change).sum())
            if slope + float((after.gradient * change).sum()) <= 2 * KEPT_PROMISE * slope < 0:
                return after
            trial = np.minimum(np.maximum(point.x + part * turns, low), high)
            part /= 4
        return None

    def _nearest(self, x: Doubles) -> Doubles:
        """Return x, (k,), moved between the bounds: for lamps, with the nearest emissions."""
        low, high = self.lights.lower, self.lights.upper
        moved = np.minimum(np.maximum(x, low), high)
        for group in self.lights.groups:
            if group.mixes is None:
                continue
            # Drives that stay between their bounds keep these to the last bit.
            k = np.flatnonzero((moved != x)[group.places].any(axis=1))
            if k.size:
                emission = np.matmul(x[group.places[k]][:, None], group.columns[k])[:, 0]
                metric = np.square(self.root[group.lights[k, 0]])
                moved[group.places[k]] = group.mixes.nearest(k, emission, metric)
        return moved

    def _size(self, scale: Doubles, counts: Bools) -> float:
        """Return the scale of the KKT residual: the largest entry of b and of M x at the bounds
        nearest to 0, in the unknowns.
        """
        dark = np.clip(0, self.lights.lower, self.lights.upper)
        pull = self._gradient(self._emissions(dark)) + self.b
        sizes = (np.abs(self._along_unknowns(y))[counts] / scale[counts] for y in (self.b, pull))
        return max(float(y.max(initial=0)) for y in sizes) or 1.0

    def _emissions(self, x: Doubles) -> Doubles:
        """Return the scaled emissions (n, 3) of unknowns (k,)."""
        w = np.zeros(self.root.shape)
        for group, columns in zip(self.lights.groups, self.columns, strict=True):
            mixed = np.matmul(x[group.places][:, None], columns)
            w[group.lights] = mixed.reshape(*group.lights.shape, 3)
        return w

    def _along_unknowns(self, y: Doubles, columns: tuple[Doubles, ...] | None = None) -> Doubles:
        """Return Cᵀ y, (k,), of y (n, 3). columns: C by groups, if it is another one."""
        made = np.zeros(self.lights.lower.size)
        for group, own in zip(self.lights.groups, columns or self.columns, strict=True):
            of_group = y[group.lights].reshape(len(group.lights), -1, 1)
            made[group.places] = np.matmul(own, of_group)[..., 0]
        return made

    def _gradient(self, w: Doubles) -> Doubles:
        """Return M w − b, (n, 3)."""
        gradient = np.matmul(self.M, w.T[:, :, None])[..., 0].T - self.b
        if self.coupling is not None:
            gradient += np.matmul(self.coupling, w[:, :, None])[..., 0]
        return np.asarray(gradient)

    def _newton(self, gradient: Doubles, free: Bools) -> tuple[Doubles, list[Doubles]]:
        """Return the step of the free unknowns, (k,), to their optimum, and the matrices that it
        solved.

        gradient: (n, 3). free: (k,).
        """
        is_whole, chosen = self._split(free)
        unknown, light, rgb = self.lights.columns
        entry = np.flatnonzero(chosen[unknown])
        rest, whole = np.unique(light[entry]), np.flatnonzero(is_whole)
        part = _Eliminated.of(self.M, gradient, whole, rest)
        systems = [*part.matrix]
        turns, moves = np.zeros(free.size), np.zeros(self.root.shape)
        if rest.size:
            columns = (rgb * self.root[light])[entry]
            block = _block(unknown[entry], np.searchsorted(rest, light[entry]), columns)
            coupling = None if self.coupling is None else self.coupling[rest]
            inverse = 1 / np.sqrt(self.power[chosen])
            matrix = block.matrix(part.rest, coupling) * inverse * inverse[:, None]
            matrix.flat[:: len(matrix) + 1] += clipped_newton.RIDGE * len(matrix) ** 0.5
            right = block.right_side(part.right) * inverse
            turns[chosen] = (
                inverse * clipped_newton.solve_ridged(matrix, right[:, None], len(matrix))[:, 0]
            )
            np.add.at(moves, light[entry], turns[unknown[entry], None] * columns)
            systems.append(matrix)
        moves[whole] = part.step(moves[rest])
        for group, columns in zip(self.lights.groups, self.columns, strict=True):
            k = np.flatnonzero(is_whole[group.lights[:, 0]])
            if columns.shape[2] == 3 and k.size:
                places = group.places[k]
                turns[places] = _least_turns(
                    columns[k] * free[places][:, :, None], moves[group.lights[k, 0]]
                )
        return turns, systems

    def _split(self, free: Bools) -> tuple[Bools, Bools]:
        """Return the lights, (n,), whose free unknowns give any emission, and unknowns, (k,), that
        make up the unknowns of the others.
        """
        is_whole, chosen = np.zeros(len(self.root), bool), np.zeros(free.size, bool)
        for group, columns, can_be_whole in zip(
            self.lights.groups, self.columns, self.can_be_whole, strict=True
        ):
            lights, own_free = group.lights[:, 0], free[group.places]
            whole = can_be_whole & own_free.all(axis=1)
            k = np.flatnonzero(~whole)
            basis = _independent(columns[k], own_free[k])
            whole[k] = can_be_whole[k] & (basis.sum(axis=1) == 3)
            is_whole[lights[whole]] = True
            chosen[group.places[k]] = basis & ~whole[k, None]
        return is_whole, chosen


@dataclass(frozen=True)
class _Eliminated:
    """Newton's equations of each channel without the w lights of any emission.

    matrix: (3, w, w), of these. own: (3, w), their step; beside: (3, w, r), less this for a step of
    the others. rest, right: (3, r, r), (3, r), the equations that remain for the others.
    """

    matrix: Doubles
    own: Doubles
    beside: Doubles
    rest: Doubles
    right: Doubles

    @classmethod
    def of(cls, M: Doubles, gradient: Doubles, whole: Indices, rest: Indices) -> "_Eliminated":
        """Eliminate the lights `whole`, (w,), and keep `rest`, (r,). M: (3, n, n); gradient: (n,
        3).
        """
        rows, count = M[:, whole], whole.size
        matrix, across = rows[:, :, whole], rows[:, :, rest]
        matrix[:, np.arange(count), np.arange(count)] += clipped_newton.RIDGE * count**0.5
        right = np.concatenate([-gradient[whole].T[:, :, None], across], axis=2)
        if count > clipped_newton.MANY_UNKNOWNS:
            solved = np.stack(
                [clipped_newton.solve_ridged(*x, count) for x in zip(matrix, right, strict=True)]
            )
        else:
            solved = clipped_newton.solve_ridged(matrix, right, count)
        pushed = np.matmul(across.swapaxes(1, 2), solved)
        remaining = M[:, rest][:, :, rest] - pushed[:, :, 1:]
        return cls(
            matrix,
            solved[:, :, 0],
            solved[:, :, 1:],
            remaining,
            -gradient[rest].T - pushed[:, :, 0],
        )

    def step(self, others: Doubles) -> Doubles:
        """Return the step, (w, 3), beside a step of the others, (r, 3)."""
        return np.asarray((self.own - np.matmul(self.beside, others.T[:, :, None])[..., 0]).T)


def _least_turns(columns: Doubles, moves: Doubles) -> Doubles:
    """Return the smallest turns (k, u) of columns (k, u, 3) that make moves (k, 3)."""
    squares = np.matmul(columns.swapaxes(1, 2), columns)
    return np.asarray(np.matmul(columns, np.linalg.solve(squares, moves[:, :, None]))[..., 0])


def _powers(M: Doubles, coupling: Doubles | None, lights: Indices, columns: Doubles) -> Doubles:
    """Return the power (k, u) of unknowns at 1, by their scaled columns (k, u, 3 l)."""
    if lights.shape[1] == 1 and coupling is None:
        return np.asarray(np.square(columns).sum(axis=2))  # M has a unit diagonal
    apart = columns.reshape(*columns.shape[:2], -1, 3)
    own = M[:, lights[:, :, None], lights[:, None]]
    powers = np.einsum("kulc,cklm,kumc->ku", apart, own, apart)
    if coupling is not None:
        powers += np.einsum("kulc,klcd,kuld->ku", apart, coupling[lights], apart)
    return np.asarray(powers)


def _can_be_whole(lights: Indices, columns: Doubles, coupling: Doubles | None) -> Bools:
    """Return, (k,), whether columns (k, u, 3 l) make up any emission of one light, which no
    coupling joins. lights: (k, l).
    """
    if columns.shape[2] != 3:
        return np.zeros(len(columns), bool)
    is_whole = _independent(columns, np.ones(columns.shape[:2], bool)).sum(axis=1) == 3
    if coupling is not None:
        is_whole &= ~coupling[lights[:, 0]].any(axis=(1, 2))
    return np.asarray(is_whole)


def _independent(columns: Doubles, free: Bools) -> Bools:
    """Return the free columns, (k, u) of (k, u, e), that make up the others, and no more.

    The first is the longest, and each further one adds most to those before.
    """
    rest = columns * free[:, :, None]
    least = MIN_NEW * np.square(rest).sum(axis=2).max(axis=1, initial=0)
    chosen, rows = np.zeros(free.shape, bool), np.arange(len(free))
    for _ in range(min(rest.shape[1:])):
        power = np.square(rest).sum(axis=2)
        best = power.argmax(axis=1)
        most = power[rows, best]
        is_new = most > least
        chosen[rows[is_new], best[is_new]] = True
        along = rest[rows, best] * (is_new / np.sqrt(np.where(is_new, most, 1)))[:, None]
        rest -= np.matmul(rest, along[:, :, None]) * along[:, None]
    return chosen


def _block(unknowns: Indices, lights: Indices, columns: Doubles) -> Block:
    """Return a block of unknowns, numbered by their order, by the entries of their columns.

    unknowns, lights: (e,), of each entry, in ascending order of unknowns. columns: (e, 3).
    """
    _, first = np.unique(unknowns, return_index=True)
    places = np.arange(first.size)
    entries = tuple(Entries(places, lights, columns[:, c], first) for c in range(3))
    return Block([0, 1, 2], places, entries, (), [])
