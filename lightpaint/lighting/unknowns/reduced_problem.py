"""M and b in the unknowns that constraints leave, and the optimum of this problem.

With w = C x + w₀ the problem is M' = Σ_c C_cᵀ M_c C_c and b' = Σ_c C_cᵀ (b_c − M_c w₀_c), one for
every set of channels that the unknowns couple. Without constraints C is the identity: three
problems in the lights themselves.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra import Method
from lightpaint.lighting.algebra.clipped_newton import MANY_UNKNOWNS
from lightpaint.lighting.algebra.optimum import (
    TOLERANCE,
    Optimum,
    QuadraticFamily,
    minimise,
    minimise_each,
)
from lightpaint.lighting.algebra.quadratic import Cap, clip_to_sums
from lightpaint.lighting.algebra.required_sums import (
    CLOSE,
    MAX_UPDATES,
    RequiredSums,
    SumsWithShares,
)
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.unknown_blocks import Block, KnobGroup, LimitedKnobs
from lightpaint.threads import parallel_map

#: Determinant of the colours that a light mixes, relative to their size, below which they are too
#: alike.
SINGULAR_DETERMINANT = 1e-6

#: Distance from a bound, relative to the light's other values, that is round-off of a start.
BOUND_ROUND_OFF = 1e-12

#: Ridges, relative to the diagonal, that make one of several equal mixes of colours the best: of a
#: solve, whose optimum then is one without it, and of the mixes to start from.
RIDGE, MIX_RIDGE = 1e-12, 1e-9

#: The multipliers of no requirements.
NOTHING = np.zeros(0)

#: Pull towards the start in channels where a light reaches nothing, relative to its other channels.
DARK_PULL = 1e-8


def nearest_unknowns(reduction: Reduction, start: Doubles, reached: Bools) -> Doubles:
    """Return the x (k,) whose emissions are nearest to `start`, (n, 3), within the limits of each
    knob.

    reached: (n,). For a light that reaches something, a luminance at its limit is good enough.
    """
    x = np.zeros(len(reduction.unknowns))
    mixed = reduction.mixed_lights
    for j, group in enumerate(reduction.knob_groups):
        low, high = reduction.lower[group.places], reduction.upper[group.places]
        mixes = None if mixed is None else mixed.groups[j].mixes
        if mixes is None:
            x[group.places] = _nearest_in_group(group, start, low, high)
        else:
            every, emissions = np.arange(len(low)), start[group.lights[:, 0]]
            values = mixes.nearest(every, emissions, np.ones(emissions.shape))
            x[group.places] = _snap_to_bounds(values, low, high)
    for stack in reduction.limited_knobs:
        for k in _clip_to_limits(x, reduction, stack):
            knob = reduction.knobs[k]
            if not (knob.is_free or len(knob.lights) > 1 or reached[knob.lights[0]]):
                x[list(reduction.places[k])] = _nearest_limited(knob, start)
    return x


def nearest_weights(reduction: Reduction, weights: Doubles) -> Doubles:
    """Return the weights (n, 3) nearest to others within the limits of each knob."""
    all_lights = np.ones(len(weights), dtype=bool)
    return reduction.weights(nearest_unknowns(reduction, weights, all_lights))


def _nearest_in_group(group: KnobGroup, start: Doubles, low: Doubles, high: Doubles) -> Doubles:
    """Return the x of knobs, (k, u), between bounds (k, u), whose emissions are nearest to
    `start`.
    """
    current = start[group.lights].reshape(len(low), -1)
    if group.is_free:
        return np.asarray(np.minimum(np.maximum(current, low), high))
    right_side = np.einsum("kue,ke->ku", group.columns, current)
    if group.is_orthogonal:
        values = right_side / np.square(group.columns).sum(axis=2)
        return _snap_to_bounds(values, low, high)
    squares = np.matmul(group.columns, group.columns.swapaxes(1, 2))
    if squares.shape[1] > group.columns.shape[2]:  # equal mixes: one is as good as another
        diagonal = np.arange(squares.shape[1])
        squares[:, diagonal, diagonal] *= 1 + MIX_RIDGE
    values = _solve_mixes(group.columns, current)
    violated = np.flatnonzero(~((values >= low) & (values <= high)).all(axis=1))
    if violated.size:
        low_out, high_out = low[violated], high[violated]
        optima = minimise_each(
            squares[violated],
            right_side[violated],
            lower=low_out,
            upper=high_out,
            start=np.clip(0, low_out, high_out),
        )
        values[violated] = np.stack([optimum.x for optimum in optima])
    return _snap_to_bounds(values, low, high)


def _clip_to_limits(x: Doubles, reduction: Reduction, stack: LimitedKnobs) -> Indices:
    """Move the x of knobs into their limits, in place; return the knobs that were beyond them."""
    a, places = stack.coefficients, stack.unknowns
    now = (a * x[places]).sum(axis=1)
    nearest = np.minimum(np.maximum(now, stack.lower), stack.upper)
    violated = now != nearest
    out = places[violated]
    low, high = reduction.lower[out], reduction.upper[out]
    x[out] = clip_to_sums(a[violated], x[out], low, high, nearest[violated])
    return np.asarray(stack.knobs[violated])


def _solve_mixes(columns: Doubles, emission: Doubles) -> Doubles:
    """Return the x (k, u) with C x = emission, (k, e); nan where C is not square or singular.

    columns: (k, u, e), C transposed.
    """
    x = np.full(columns.shape[:2], np.nan)
    if columns.shape[1] == columns.shape[2]:
        size = np.abs(columns).max(axis=(1, 2)) ** columns.shape[1]
        regular = np.abs(np.linalg.det(columns)) > SINGULAR_DETERMINANT * size
        C = columns[regular].swapaxes(1, 2)
        x[regular] = np.linalg.solve(C, emission[regular, :, None])[..., 0]
    return x


def _nearest_limited(knob: Knob, start: Doubles) -> Doubles:
    """Return the x of a light with limited luminance whose emission is nearest to `start`."""
    assert knob.limit is not None
    C = np.array([unknown.columns[0][1] for unknown in knob.unknowns])
    lower = np.array([unknown.lower for unknown in knob.unknowns])
    upper = np.array([unknown.upper for unknown in knob.unknowns])
    cap = Cap(tuple(range(len(C))), *knob.limit)
    right = C @ start[knob.lights[0]]
    return _snap_to_bounds(
        minimise(C @ C.T, right, lower=lower, upper=upper, caps=(cap,)).x, lower, upper
    )


def _snap_to_bounds(x: Doubles, lower: Doubles, upper: Doubles) -> Doubles:
    """Return x, (k,) or one knob a row, moved into its bounds, and onto those within round-off.

    Only unknowns exactly at a bound have multipliers.
    """
    tolerance = BOUND_ROUND_OFF * np.abs(x).max(axis=-1, keepdims=True, initial=0)
    x = np.where(np.abs(x - lower) <= tolerance, lower, np.maximum(x, lower))
    return np.asarray(np.where(np.abs(x - upper) <= tolerance, upper, np.minimum(x, upper)))


@dataclass(frozen=True)
class ReducedProblem:
    """The problem ½ xᵀM x − bᵀx in some `unknowns` of a reduction, for the channels they
    couple."""

    channels: list[int]
    unknowns: Indices
    M: Doubles
    b: Doubles
    lower: Doubles
    upper: Doubles
    caps: tuple[Cap, ...]

    def restricted(self, unknowns: Indices) -> "ReducedProblem":
        """Return the problem of some of its unknowns, (k,) places among them, with the others at
        0."""
        place = {int(k): j for j, k in enumerate(unknowns)}
        caps = tuple(
            replace(cap, unknowns=tuple(place[i] for i in cap.unknowns))
            for cap in self.caps
            if cap.unknowns[0] in place
        )
        return ReducedProblem(
            self.channels,
            self.unknowns[unknowns],
            self.M[np.ix_(unknowns, unknowns)],
            self.b[unknowns],
            self.lower[unknowns],
            self.upper[unknowns],
            caps,
        )


@dataclass(frozen=True)
class ReducedOptimum:
    """The best weights under a reduction, with the multipliers that prove it.

    x, multipliers: of its unknowns; cap_multipliers: of its caps. All as in `Optimum`, of half the
    objective.
    weights: (n, 3), C x + w₀. kkt_residual, tolerance: (3,), the largest violation of the
    optimality conditions, after scaling, and its limit. sweeps: (3,).
    reached: (n, 3), whether the unknowns that move a light in a channel reach any pixel; true for
    fixed lights.
    required: (m,), multipliers of the requirements, >= 0; none without requirements.
    push: (n, 3), the rise of the gradient that they balance; None without.
    shares: of the requirements that are given up; None where nothing may be.
    """

    x: Doubles
    multipliers: Doubles
    cap_multipliers: Doubles
    weights: Doubles
    kkt_residual: Doubles
    tolerance: Doubles
    sweeps: tuple[int, int, int]
    reached: Bools
    required: Doubles = field(default_factory=lambda: np.zeros(0))
    push: Doubles | None = None
    shares: Doubles | None = None

    def gradient(self, equations: NormalEquations) -> Doubles:
        """Return the gradient (n, 3) at the weights, M w - b, less what requirements balance."""
        gradient = equations.gradient(self.weights)
        return gradient if self.push is None else gradient - self.push

    @property
    def converged(self) -> bool:
        """True if every channel is within its tolerance."""
        return bool((self.kkt_residual <= self.tolerance).all())


def solve_reduced(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    x: Doubles | None = None,
    required: Doubles | None = None,
    close: float = CLOSE,
    max_updates: int = MAX_UPDATES,
    method: Method = "polished",
    tolerance: float = 1e-12,
    max_sweeps: int = 20_000,
) -> ReducedOptimum:
    """Minimise the objective over the unknowns that `reduction` leaves.

    start: (n, 3), weights to begin with; lights that reach nothing stay as near to them as the
    constraints allow. x: the unknowns to begin with, where they are known; else those nearest to
    `start`. required: the multipliers of requirements, (m,), in a similar problem. close: the
    largest miss of a requirement, relative to its size. max_updates: see `RequiredSums.minimise`.
    method, tolerance, max_sweeps: see `minimise`.
    """
    options: dict[str, Any] = {"tolerance": tolerance, "max_sweeps": max_sweeps}
    solver = ReducedSolver(
        reduction, required=required, close=close, max_updates=max_updates, method=method
    )
    return solver.solve(equations, start, x=x, **options)


class ReducedSolver:
    """Solves problems with one pull under one reduction, as `solve_reduced` does.

    The work on a matrix serves the next problem, if that has the same one.
    """

    def __init__(
        self,
        reduction: Reduction,
        *,
        pull: NormalEquations | None = None,
        required: Doubles | None = None,
        close: float = CLOSE,
        max_updates: int = MAX_UPDATES,
        method: Method = "polished",
    ) -> None:
        self._reduction, self._pull, self._method = reduction, pull, method
        self._required, self._close, self._max_updates = required, close, max_updates
        self._required_caps: Doubles | None = None
        self._last: NormalEquations | None = None
        self._pulled: NormalEquations | None = None
        self._families: list[QuadraticFamily] = []
        self._ridged: list[QuadraticFamily] = []
        self._sums: RequiredSums | SumsWithShares | None = None

    def solve(
        self,
        equations: NormalEquations,
        start: Doubles,
        *,
        x: Doubles | None = None,
        **options: Any,
    ) -> ReducedOptimum:
        """Minimise the objective with the pull; for the arguments see `solve_reduced`."""
        reduction, equations = self._reduction, self._with_pull(equations)
        lit = _lit(equations, reduction)
        reached: Bools = np.ones(lit.shape, dtype=bool) if lit.all() else reduction.determined(lit)
        is_reached = np.any(reached, axis=1)
        x = nearest_unknowns(reduction, start, is_reached) if x is None else x.copy()
        shares: Doubles | None = None
        if reduction.requirements is None:
            optima, required = self._solve_blocks(equations, lit, start, x, options), NOTHING
        else:
            optimum, required, shares = self._solve_required(equations, lit, start, x, options)
            optima = [optimum]
        multipliers, cap_multipliers = np.zeros(x.size), np.zeros(len(reduction.caps))
        tolerance = options.get("tolerance", TOLERANCE)
        residuals, tolerances, sweeps = np.zeros(3), np.full(3, tolerance), [0, 0, 0]
        for block, optimum in zip(reduction.blocks, optima, strict=True):
            x[block.unknowns], multipliers[block.unknowns] = optimum.x, optimum.multipliers
            cap_multipliers[block.cap_indices] = optimum.cap_multipliers
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
            required,
            _push(reduction, required),
            shares,
        )

    def _with_pull(self, equations: NormalEquations) -> NormalEquations:
        """Return the equations with the pull; forget the work on another matrix."""
        last, pull, pulled = self._last, self._pull, self._pulled
        is_same = last is not None and last.M is equations.M and last.coupling is equations.coupling
        self._last = equations
        if pulled is None or not is_same:
            self._families, self._sums = [], None
            self._pulled = equations if pull is None else equations + pull
            return self._pulled
        if pull is None:
            return equations
        norm2 = equations.target_norm2 + pull.target_norm2
        return replace(pulled, b=equations.b + pull.b, target_norm2=norm2)

    def _solve_blocks(
        self,
        equations: NormalEquations,
        lit: Bools,
        start: Doubles,
        x: Doubles,
        options: dict[str, Any],
    ) -> list[Optimum]:
        """Solve each block from its part of x; three alike blocks of few lights in the same
        calls."""
        reduction, coupling = self._reduction, equations.coupling
        M, b = _move_fixed_to_right(equations, reduction, lit, start)
        is_large = (
            max((block.unknowns.size for block in reduction.blocks), default=0) > MANY_UNKNOWNS
        )
        alike = reduction.alike_blocks
        if alike is not None and not is_large:
            if (lights := alike.lights) is not None:
                M, b = M[:, lights[:, None], lights], b[:, lights]
            options = {"lower": alike.lower, "upper": alike.upper, **options}
            return minimise_each(M, b, start=x[alike.unknowns], method=self._method, **options)
        if self._method == "polished" and (mixed := reduction.mixed_lights) is not None:
            tolerance = options.get("tolerance", TOLERANCE)
            optimum = mixed.minimise(M, b, coupling, x, tolerance=tolerance)
            if optimum is not None:
                return [optimum]
        if not self._families:
            self._make_families(_block_problems((M, b), coupling, reduction))

        def solve(job: tuple[Block, QuadraticFamily, QuadraticFamily | None]) -> Optimum:
            block, family, ridged = job
            right, begin = block.right_side(b), x[block.unknowns]
            if ridged is not None:
                begin = ridged.minimise(right, begin, **options).x
            return family.minimise(right, begin, **options)

        ridged: list[QuadraticFamily | None] = [*self._ridged] or [None] * len(self._families)
        jobs = list(zip(reduction.blocks, self._families, ridged, strict=True))
        return parallel_map(solve, jobs) if len(jobs) > 1 else [solve(job) for job in jobs]

    def _make_families(self, problems: list[ReducedProblem]) -> None:
        """Make the families of some problems, whose matrices can then go: the scaled ones that are
        kept are as large.
        """
        self._families = [self._family(p, p.M) for p in problems]
        # Many drives give the same light. With a ridge one of them is best, and found in a sixth of
        # the time; it is an optimum without the ridge, too, up to the tolerance.
        self._ridged = [
            self._family(p, p.M + np.diag(RIDGE * p.M.diagonal()))
            for p in (problems if self._reduction.has_equal_mixes else ())
        ]

    def _solve_required(
        self,
        equations: NormalEquations,
        lit: Bools,
        start: Doubles,
        x: Doubles,
        options: dict[str, Any],
    ) -> tuple[Optimum, Doubles, Doubles | None]:
        """Solve under requirements, which make one block; return it, their multipliers, (m,), and
        the shares that are given up.
        """
        reduction = self._reduction
        M, b = _move_fixed_to_right(equations, reduction, lit, start)
        [block] = reduction.blocks
        if self._sums is None:
            self._sums = self._required_sums((M, b), equations.coupling)
        right, begin = block.right_side(b), x[block.unknowns]
        found = self._sums.minimise(
            right,
            begin,
            multipliers=self._required,
            cap_multipliers=self._required_caps,
            close=self._close,
            max_updates=self._max_updates,
            **options,
        )
        optimum = found.optimum
        self._required, self._required_caps = found.multipliers, optimum.cap_multipliers
        if found.miss > self._close:
            residual = max(optimum.kkt_residual, found.miss)
            optimum = replace(optimum, kkt_residual=residual)
        return optimum, found.multipliers, found.shares

    def _required_sums(
        self, sides: tuple[Doubles, Doubles], coupling: Doubles | None
    ) -> RequiredSums | SumsWithShares:
        reduction, required = self._reduction, self._reduction.requirements
        assert required is not None
        [p] = _block_problems(sides, coupling, reduction)
        rows, least = reduction.required
        if p.unknowns.size < rows.shape[1]:
            rows = rows[:, p.unknowns]
        options: dict[str, Any] = {
            "lower": p.lower,
            "upper": p.upper,
            "caps": p.caps,
            "method": self._method,
            "parts": _channel_parts(reduction) if coupling is None else (),
        }
        if required.shares is None:
            return RequiredSums(p.M, rows, least, **options)
        options |= {"sizes": required.share_sizes, "price": required.share_price}
        return SumsWithShares(p.M, rows, least, shares=required.shares, **options)

    def _family(self, problem: ReducedProblem, M: Doubles) -> QuadraticFamily:
        """Return the problems with a matrix (k, k) and the bounds and caps of `problem`."""
        p = problem
        return QuadraticFamily(M, lower=p.lower, upper=p.upper, caps=p.caps, method=self._method)


def _channel_parts(reduction: Reduction) -> list[Indices]:
    """Return the unknowns of each set of channels that only requirements couple; none where some
    unknowns move no light.
    """
    if reduction.blocks[0].unknowns.size < len(reduction.unknowns):
        return []
    apart = replace(reduction, requirements=None, is_joined=False)
    return [block.unknowns for block in apart.blocks]


def _lit(equations: NormalEquations, reduction: Reduction) -> Bools:
    """Return, (n, 3), whether a light reaches something that counts, or that is required."""
    lit = equations.reached
    if reduction.requirements is not None:
        lit = lit | (reduction.requirements.rows != 0).any(axis=0)
    return lit


def _push(reduction: Reduction, required: Doubles) -> Doubles | None:
    """Return what requirements with these multipliers, (m,), balance of the gradient, (n, 3)."""
    if reduction.requirements is None:
        return None
    return np.asarray(np.einsum("m,mnc->nc", required, reduction.requirements.rows))


def reduced_problems(equations: NormalEquations, reduction: Reduction) -> list[ReducedProblem]:
    """Return one problem for every set of channels that the unknowns couple."""
    return _block_problems(
        _move_fixed_to_right(equations, reduction), equations.coupling, reduction
    )


def _move_fixed_to_right(
    equations: NormalEquations,
    reduction: Reduction,
    lit: Bools | None = None,
    start: Doubles | None = None,
) -> tuple[Doubles, Doubles]:
    """Return M and b with fixed lights moved to the right-hand side.

    lit, start: (n, 3), whether a light reaches something that counts, and weights. An unknown of
    several channels, some of which reach nothing, is faintly drawn to its start in those.
    """
    M, b = equations.M, equations.b
    if lit is not None and start is not None and not lit.all():
        is_coupled = len(reduction.channel_groups) < 3
        M, b = _without_dark_channels(equations, lit, start, is_coupled=is_coupled)
    if reduction.has_fixed_light:
        # Fixed lights have no colour to keep: nothing joins their channels.
        b = b - np.einsum("cij,jc->ci", M, reduction.fixed_weights)
    return M, b


def _block_problems(
    sides: tuple[Doubles, Doubles], coupling: Doubles | None, reduction: Reduction
) -> list[ReducedProblem]:
    problems = []
    for block in reduction.blocks:
        lower, upper = reduction.lower[block.unknowns], reduction.upper[block.unknowns]
        M, b = block.matrix(sides[0], coupling), block.right_side(sides[1])
        problems.append(
            ReducedProblem(block.channels, block.unknowns, M, b, lower, upper, block.caps)
        )
    return problems


def _without_dark_channels(
    equations: NormalEquations, lit: Bools, start: Doubles, *, is_coupled: bool
) -> tuple[Doubles, Doubles]:
    """Return M and b without channels in which a light reaches nothing: these keep their weights.

    is_coupled: whether unknowns span channels. A light that reaches something in one channel is
    then pulled to its start in the others.
    """
    M = equations.M * (lit.T[:, :, None] & lit.T[:, None, :])
    b = equations.b * lit.T
    if not is_coupled:
        return M, b
    power = np.einsum("cii->ic", equations.M).max(axis=1)
    for k, c in np.argwhere(lit.any(axis=1, keepdims=True) & ~lit):
        M[c, k, k] = DARK_PULL * power[k]
        b[c, k] = DARK_PULL * power[k] * start[k, c]
    return M, b
