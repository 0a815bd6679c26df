"""M and b in the unknowns that constraints leave, and the optimum of what they make.

With w = C x + w₀ the problem is M' = Σ_c C_cᵀ M_c C_c and b' = Σ_c C_cᵀ (b_c − M_c w₀_c), one for
every set of channels that the unknowns couple. Where nothing is asked C is the identity: three
problems in the lights themselves.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.optimum import Method, Optimum, minimise, minimise_each
from lightpaint.lighting.algebra.quadratic import Cap, moved_along
from lightpaint.lighting.constraints.knobs import Knob
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.constraints.unknown_blocks import Block
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import side_by_side

#: Pull of what reaches nothing in one channel towards its start, beside its other channels.
FAINT = 1e-8

#: Determinant of the colours that a light mixes, beside their size, below which they are too alike.
SINGULAR = 1e-6

#: Distance from a bound, beside the light's other values, that is round-off of a start.
NEAR = 1e-12


@dataclass(frozen=True)
class ReducedProblem:
    """½ xᵀM x − bᵀx in the unknowns `its` of a reduction, of the channels it couples."""

    channels: list[int]
    its: Indices
    M: Doubles
    b: Doubles
    lower: Doubles
    upper: Doubles
    caps: tuple[Cap, ...]

    def of(self, here: Indices) -> "ReducedProblem":
        """The problem of some of its unknowns, (k,) places among them, while the others are 0."""
        place = {int(k): j for j, k in enumerate(here)}
        caps = tuple(
            replace(cap, unknowns=tuple(place[i] for i in cap.unknowns))
            for cap in self.caps
            if cap.unknowns[0] in place
        )
        return ReducedProblem(
            self.channels,
            self.its[here],
            self.M[np.ix_(here, here)],
            self.b[here],
            self.lower[here],
            self.upper[here],
            caps,
        )


@dataclass(frozen=True)
class ReducedOptimum:
    """The best weights under a reduction, and what shows that they are.

    x, multipliers: of its unknowns; cap_multipliers: of its caps. All as of `Optimum`, of half
    the objective.
    weights: (n, 3), C x + w₀. kkt_residual, tolerance: (3,), the largest violation of the
    optimality conditions, after scaling, and what it was to come down to. sweeps: (3,).
    reached: (n, 3), whether what moves a light in a channel reaches anything; what is held was not
    left to.
    """

    x: Doubles
    multipliers: Doubles
    cap_multipliers: Doubles
    weights: Doubles
    kkt_residual: Doubles
    tolerance: Doubles
    sweeps: tuple[int, int, int]
    reached: Bools

    @property
    def converged(self) -> bool:
        """Whether every channel met its tolerance."""
        return bool((self.kkt_residual <= self.tolerance).all())


def solve_reduced(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    x: Doubles | None = None,
    method: Method = "polished",
    tolerance: float = 1e-12,
    max_sweeps: int = 20_000,
) -> ReducedOptimum:
    """Minimise the objective over what `reduction` leaves.

    start: (n, 3), weights to begin with; lights that reach nothing stay as near to them as the
    constraints allow. x: the unknowns to begin with, where they are known; else those nearest to
    `start`. method, tolerance, max_sweeps: see `minimise`.
    """
    lit = equations.reached
    reached: Bools = np.ones(lit.shape, dtype=bool) if lit.all() else reduction.reached(lit)
    x = nearest(reduction, start, np.any(reached, axis=1)) if x is None else x.copy()
    how: dict[str, Any] = {"method": method, "tolerance": tolerance, "max_sweeps": max_sweeps}
    left = _left(equations, reduction, lit, start)
    optima = _optima(left, equations.across, reduction, x, how)
    multipliers, cap_multipliers = np.zeros(x.size), np.zeros(len(reduction.caps))
    residuals, tolerances, sweeps = np.zeros(3), np.full(3, tolerance), [0, 0, 0]
    for block, optimum in zip(reduction.blocks, optima, strict=True):
        x[block.its], multipliers[block.its] = optimum.x, optimum.multipliers
        cap_multipliers[block.cap_its] = optimum.cap_multipliers
        for c in block.channels:
            residuals[c], sweeps[c] = optimum.kkt_residual, optimum.sweeps
            tolerances[c] = optimum.tolerance
    return ReducedOptimum(
        x,
        multipliers,
        cap_multipliers,
        reduction.weights(x),
        residuals,
        tolerances,
        (sweeps[0], sweeps[1], sweeps[2]),
        reached,
    )


def problems(equations: NormalEquations, reduction: Reduction) -> list[ReducedProblem]:
    """One problem for every set of channels that the unknowns couple."""
    return _problems(_left(equations, reduction), equations.across, reduction)


def _left(
    equations: NormalEquations,
    reduction: Reduction,
    lit: Bools | None = None,
    start: Doubles | None = None,
) -> tuple[Doubles, Doubles]:
    """M and b of what is held taken to the right-hand side.

    lit, start: (n, 3), what reaches something that counts, and weights: an unknown of several
    channels of which a light reaches some is drawn to its start in the others, faintly.
    """
    M, b = equations.M, equations.b
    if lit is not None and start is not None and not lit.all():
        is_coupled = len(reduction.channel_groups) < 3
        M, b = _in_the_dark(equations, lit, start, is_coupled=is_coupled)
    if reduction.holds_any:
        # Lights that are held have no colour to keep: nothing joins their channels.
        b = b - np.einsum("cij,jc->ci", M, reduction.held)
    return M, b


def _problems(
    left: tuple[Doubles, Doubles], across: Doubles | None, reduction: Reduction
) -> list[ReducedProblem]:
    made = []
    for block in reduction.blocks:
        lower, upper = reduction.lower[block.its], reduction.upper[block.its]
        M, b = _of_block(*left, block)
        if across is not None:
            p = block.pairs
            np.add.at(M, (p.one, p.other), p.value * across[p.light, p.channel, p.next])
        made.append(ReducedProblem(block.channels, block.its, M, b, lower, upper, block.caps))
    return made


def _of_block(M: Doubles, b: Doubles, block: Block) -> tuple[Doubles, Doubles]:
    """M' and b' in the unknowns of a block."""
    if block.is_plain:
        [c], lights = block.channels, block.entries[0].lights
        if block.is_in_order and lights.size == b.shape[1]:
            return M[c], b[c]
        return M[c][lights[:, None], lights], b[c, lights]
    made_M, made_b = np.zeros((block.its.size, block.its.size)), np.zeros(block.its.size)
    for c, e in zip(block.channels, block.entries, strict=True):
        part = M[c][e.lights[:, None], e.lights] * e.values[:, None] * e.values
        right = b[c, e.lights] * e.values
        if e.lights.size > e.here.size:
            # Most columns are of one light: the sum over those of several is a short one.
            part = np.add.reduceat(np.add.reduceat(part, e.first, 0), e.first, 1)
            right = np.add.reduceat(right, e.first)
        made_M[e.here[:, None], e.here] += part
        made_b[e.here] += right
    return made_M, made_b


def nearest(reduction: Reduction, start: Doubles, reached: Bools) -> Doubles:
    """The x (k,) whose emissions are nearest to `start`, (n, 3), within what each knob allows.

    reached: (n,). Where a light does reach something, a luminance at its limit is good enough.
    """
    x = np.zeros(len(reduction.unknowns))
    for kind in reduction.kinds:
        low, high = reduction.lower[kind.places], reduction.upper[kind.places]
        present = start[kind.lights].reshape(len(low), -1)
        if kind.is_free:
            x[kind.places] = np.minimum(np.maximum(present, low), high)
            continue
        wanted = np.einsum("kue,ke->ku", kind.columns, present)
        if kind.is_orthogonal:
            its = wanted / np.square(kind.columns).sum(axis=2)
        else:
            squares = np.matmul(kind.columns, kind.columns.swapaxes(1, 2))
            its = _mixed_of(kind.columns, present)
            out = np.flatnonzero(~((its >= low) & (its <= high)).all(axis=1))
            if out.size:
                low_out, high_out = low[out], high[out]
                found = minimise_each(
                    squares[out],
                    wanted[out],
                    lower=low_out,
                    upper=high_out,
                    start=np.clip(0, low_out, high_out),
                )
                its[out] = np.stack([optimum.x for optimum in found])
        x[kind.places] = _within(its, low, high)
    for stack in reduction.stacks:
        a, its, now = stack.coefficients, stack.its, (stack.coefficients * x[stack.its]).sum(axis=1)
        wanted = np.minimum(np.maximum(now, stack.lower), stack.upper)
        out = now != wanted
        low, high = reduction.lower[its[out]], reduction.upper[its[out]]
        x[its[out]] = moved_along(a[out], x[its[out]], low, high, wanted[out])
        for k in stack.knobs[out]:
            knob = reduction.knobs[k]
            if not (knob.is_free or reached[knob.lights[0]]):
                x[list(reduction.places[k])] = _limited(knob, start)
    return x


def _mixed_of(columns: Doubles, emission: Doubles) -> Doubles:
    """Return the x (k, u) with C x = emission, (k, e); nan where C is not square or singular.

    columns: (k, u, e), C transposed.
    """
    x = np.full(columns.shape[:2], np.nan)
    if columns.shape[1] == columns.shape[2]:
        size = np.abs(columns).max(axis=(1, 2)) ** columns.shape[1]
        regular = np.abs(np.linalg.det(columns)) > SINGULAR * size
        C = columns[regular].swapaxes(1, 2)
        x[regular] = np.linalg.solve(C, emission[regular, :, None])[..., 0]
    return x


def _limited(knob: Knob, start: Doubles) -> Doubles:
    """The x of a light with a limit of luminance whose emission is nearest to `start`."""
    assert knob.limit is not None
    C = np.array([unknown.columns[0][1] for unknown in knob.unknowns])
    lower = np.array([unknown.lower for unknown in knob.unknowns])
    upper = np.array([unknown.upper for unknown in knob.unknowns])
    cap = Cap(tuple(range(len(C))), *knob.limit)
    right = C @ start[knob.lights[0]]
    return _within(minimise(C @ C.T, right, lower=lower, upper=upper, caps=(cap,)).x, lower, upper)


def _within(x: Doubles, lower: Doubles, upper: Doubles) -> Doubles:
    """x, (k,) or one knob a row, within its bounds, and at one that only round-off parts it from.

    What is at a bound has a multiplier.
    """
    near = NEAR * np.abs(x).max(axis=-1, keepdims=True, initial=0)
    x = np.where(np.abs(x - lower) <= near, lower, np.maximum(x, lower))
    return np.asarray(np.where(np.abs(x - upper) <= near, upper, np.minimum(x, upper)))


def _optima(
    left: tuple[Doubles, Doubles],
    across: Doubles | None,
    reduction: Reduction,
    x: Doubles,
    how: dict[str, Any],
) -> list[Optimum]:
    """The optimum of each block, begun at its part of x; of three alike by the same calls."""
    if (alike := reduction.alike) is not None:
        (M, b), lights = left, alike.lights
        if lights is not None:
            M, b = M[:, lights[:, None], lights], b[:, lights]
        begin = x[alike.its]
        return minimise_each(M, b, lower=alike.lower, upper=alike.upper, start=begin, **how)

    def solve(p: ReducedProblem) -> Optimum:
        begin = x[p.its]
        return minimise(p.M, p.b, lower=p.lower, upper=p.upper, caps=p.caps, start=begin, **how)

    parts = _problems(left, across, reduction)
    return side_by_side(solve, parts) if len(parts) > 1 else [solve(p) for p in parts]


def _in_the_dark(
    equations: NormalEquations, lit: Bools, start: Doubles, *, is_coupled: bool
) -> tuple[Doubles, Doubles]:
    """M and b with nothing in them of lights that reach nothing in a channel: these stay.

    is_coupled: whether unknowns span channels. A light that reaches something in one is then
    drawn to its start in the others.
    """
    M = equations.M * (lit.T[:, :, None] & lit.T[:, None, :])
    b = equations.b * lit.T
    if not is_coupled:
        return M, b
    power = np.einsum("cii->ic", equations.M).max(axis=1)
    for k, c in np.argwhere(lit.any(axis=1, keepdims=True) & ~lit):
        M[c, k, k] = FAINT * power[k]
        b[c, k] = FAINT * power[k] * start[k, c]
    return M, b
