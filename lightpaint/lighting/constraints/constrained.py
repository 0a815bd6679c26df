"""The solve under constraints: the reduced problem, solved, and what held which light."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.algebra.optimum import Method, Optimum, minimise
from lightpaint.lighting.constraints.reduced_problem import problems
from lightpaint.lighting.constraints.reduction import Reduction, Unknown
from lightpaint.lighting.constraints.sparse import best_knobs, only
from lightpaint.lighting.normal_equations import BLOCK, NormalEquations
from lightpaint.lighting.solver import SolverResult

#: Pull of what reaches nothing in one channel towards its start, beside its other channels.
FAINT = 1e-8

#: Gradient, of a problem with unit diagonal and relative to b, that counts as a pull.
PULL = 1e-7

#: Distance from a bound, beside the light's other values, that is round-off of a start.
NEAR = 1e-12

#: Share by which a sum may be short of its limit and be said to be at it.
AT_LIMIT = 1e-9


@dataclass(frozen=True)
class ConstrainedOptimum:
    """A result in the unknowns of a reduction, and what shows that it is one.

    x, multipliers: of its unknowns; cap_multipliers: of its caps. All as of `Optimum`, of
    half the objective.
    """

    result: SolverResult
    x: Doubles
    multipliers: Doubles
    cap_multipliers: Doubles


def solve_constrained(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    method: Method = "polished",
) -> SolverResult:
    """Minimise the objective over what `reduction` leaves.

    start: (n, 3), weights to begin with; lights that reach nothing stay as near to them as
    the constraints allow. method: see `minimise`.
    """
    return constrained_optimum(equations, reduction, start, method=method).result


def free_directions(equations: NormalEquations, reduction: Reduction, start: Doubles) -> Doubles:
    """(3 n, k), directions of the weights, channel by channel, that no limit holds at the optimum.

    Arguments as of `solve_constrained`.
    """
    x = constrained_optimum(equations, reduction, start).x
    lit = equations.reached
    columns = []
    for unknown in reduction.unknowns:
        column = np.zeros((3, len(reduction.held)))
        for light, rgb in unknown.columns:
            column[:, light] += rgb
        columns.append((column * lit.T).ravel())
    C = np.array(columns).reshape(len(columns), 3 * len(reduction.held)).T
    inside = np.array(
        [u.lower < value < u.upper for u, value in zip(reduction.unknowns, x, strict=True)],
        dtype=bool,
    )
    # A sum at its limit leaves only the directions in which it stays the same.
    blocked = []
    for cap in reduction.caps:
        its, coefficients = list(cap.unknowns), np.asarray(cap.coefficients)
        if not cap.lower * (1 + AT_LIMIT) < coefficients @ x[its] < cap.upper * (1 - AT_LIMIT):
            row = np.zeros(x.size)
            row[its] = coefficients
            blocked.append(row)
    kept = np.flatnonzero(inside)
    if not blocked:
        return np.asarray(C[:, kept])
    rows = np.array(blocked)[:, kept]
    _, sizes, right = np.linalg.svd(rows)
    rank = int((sizes > AT_LIMIT * sizes.max(initial=0)).sum())
    return np.asarray(C[:, kept] @ right[rank:].T)


def constrained_optimum(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    method: Method = "polished",
    x: Doubles | None = None,
) -> ConstrainedOptimum:
    """The same as `solve_constrained`, with the values of the unknowns and their multipliers.

    x: the unknowns to begin with, where they are known; else those nearest to `start`.
    """
    lit = equations.reached
    equations = _with_faint_pull(equations, lit, start)
    multipliers = np.zeros(len(reduction.unknowns))
    cap_multipliers = np.zeros(len(reduction.caps))
    cap_at = {cap.unknowns[0]: k for k, cap in enumerate(reduction.caps)}
    if x is None:
        x = np.zeros(len(reduction.unknowns))
        for _, its in reduction.knobs:
            x[list(its)] = _at_bounds(reduction, its, _nearest(reduction, its, start))
    x = x.copy()
    residuals, tolerances, sweeps = np.zeros(3), np.zeros(3), [0, 0, 0]
    for problem in problems(equations, reduction):
        optimum = minimise(
            problem.M,
            problem.b,
            lower=problem.lower,
            upper=problem.upper,
            caps=problem.caps,
            start=x[problem.its],
            method=method,
        )
        x[problem.its], multipliers[problem.its] = optimum.x, optimum.multipliers
        for cap, multiplier in zip(problem.caps, optimum.cap_multipliers, strict=True):
            cap_multipliers[cap_at[problem.its[cap.unknowns[0]]]] = multiplier
        for c in problem.channels:
            residuals[c], sweeps[c] = optimum.kkt_residual, optimum.sweeps
            tolerances[c] = optimum.tolerance
    result = SolverResult(
        weights_of(reduction, x),
        residuals,
        (sweeps[0], sweeps[1], sweeps[2]),
        _reached_knobs(reduction, lit),
        float(tolerances.max()),
    )
    return ConstrainedOptimum(result, x, multipliers, cap_multipliers)


def solve_sparse(
    equations: NormalEquations, reduction: Reduction, start: Doubles, count: int
) -> tuple[Reduction, list[tuple[int, Doubles]]]:
    """Which knobs to use if only `count` may be on.

    Returns the reduction to these, and (number of knobs, weights (n, 3)) for some numbers.
    """
    if not reduction.knobs:
        return reduction, []
    path = best_knobs(problems(equations, reduction), reduction, count)
    curve = []
    for chosen in path:
        solved = solve_constrained(equations, only(reduction, chosen), start)
        curve.append((len(chosen), solved.weights))
    best = max((chosen for chosen in path if len(chosen) <= count), key=len)
    return only(reduction, best), curve


def weights_of(reduction: Reduction, x: Doubles) -> Doubles:
    """w = C x + w₀, (n, 3)."""
    w = reduction.held.copy()
    for value, unknown in zip(x, reduction.unknowns, strict=True):
        for light, rgb in unknown.columns:
            w[light] += value * rgb
    return w


def preferring(
    equations: NormalEquations, basis: Basis, present: Doubles, strength: float
) -> NormalEquations:
    """With strength · Σᵢ ‖Φᵢ‖² (wᵢ − presentᵢ)² added, ‖·‖ over the whole picture.

    The scale is absolute: it does not depend on what is painted, and in units of w it asks
    the same of every light. Pixels in which an emitter is seen do not count.
    """
    power = strength * _power(basis)
    M = equations.M + np.einsum("ic,ij->cij", power, np.eye(len(power)))
    pull = (power * present).T
    norm2 = equations.target_norm2 + (power * present**2).sum(axis=0)
    return NormalEquations(M, equations.b + pull, norm2)


def pulled(equations: NormalEquations, basis: Basis, weights: Doubles) -> tuple[bool, ...]:
    """For each light, whether it would change if it alone were let go.

    The gradient g = M w − b must vanish for a free light that is on, and may not be
    negative for one that is off; where it does not do so, something holds the light.
    """
    lit = equations.reached
    power = np.einsum("cii->ic", equations.M)
    gradient = np.einsum("cij,jc->ic", equations.M, weights) - equations.b.T
    size = np.abs(equations.b.T[lit] / np.sqrt(power[lit])).max(initial=0) or 1.0
    held = []
    for k, light in enumerate(basis.lights):
        its = lit[k]
        g, p, w = gradient[k, its], power[k, its], weights[k, its]
        if light.is_scalar:
            g, p, w = g.sum(keepdims=True), p.sum(keepdims=True), w[:1]
        p = np.where(p > 0, p, 1)
        violation = np.abs(np.minimum(w * np.sqrt(p), g / np.sqrt(p)))
        held.append(bool((violation > PULL * size).any()))
    return tuple(held)


def _power(basis: Basis) -> Doubles:
    """‖Φᵢ‖² over the picture, (n, 3) float64."""
    n = len(basis.lights)
    counted = np.flatnonzero(~basis.emitters_seen.ravel())
    rows = basis.images.reshape(n, -1, 3)
    power = np.zeros((n, 3))
    for start in range(0, counted.size, BLOCK):
        block = rows[:, counted[start : start + BLOCK]].astype(np.float64)
        power += np.einsum("npc,npc->nc", block, block)
    return power


def _with_faint_pull(
    equations: NormalEquations, lit: npt.NDArray[np.bool_], start: Doubles
) -> NormalEquations:
    """A light that reaches something in one channel only is to keep its start in the others."""
    partly = np.asarray(lit.any(axis=1, keepdims=True)) & ~lit
    if not partly.any():
        return equations
    M, b = equations.M.copy(), equations.b.copy()
    power = np.einsum("cii->ic", equations.M).max(axis=1)
    for k, c in np.argwhere(partly):
        M[c, k, k] = FAINT * power[k]
        b[c, k] = FAINT * power[k] * start[k, c]
    return NormalEquations(M, b, equations.target_norm2)


def _nearest(reduction: Reduction, its: tuple[int, ...], start: Doubles) -> Doubles:
    """The x of one knob whose emissions are nearest to `start` (n, 3)."""
    unknowns = [reduction.unknowns[k] for k in its]
    caps = [
        replace(cap, unknowns=tuple(k - its[0] for k in cap.unknowns))
        for cap in reduction.caps
        if cap.unknowns[0] == its[0]
    ]
    lower = np.array([x.lower for x in unknowns])
    upper = np.array([x.upper for x in unknowns])
    lights = sorted({light for x in unknowns for light, _ in x.columns})
    if not caps and len(lights) == 1 and len(its) == 3 and _is_free(unknowns):
        return np.asarray(np.clip(start[lights[0]], lower, upper))
    # (unknowns, lights · 3)
    C = np.zeros((len(its), 3 * len(lights)))
    for k, x in enumerate(unknowns):
        for light, rgb in x.columns:
            C[k, 3 * lights.index(light) :][:3] = rgb
    found: Optimum = minimise(
        C @ C.T, C @ start[lights].ravel(), lower=lower, upper=upper, caps=caps
    )
    return found.x


def _at_bounds(reduction: Reduction, its: tuple[int, ...], x: Doubles) -> Doubles:
    """x, at a bound where only round-off keeps it from there: what is at one has a multiplier."""
    near = NEAR * float(np.abs(x).max(initial=0))
    for bound in ("lower", "upper"):
        limits = np.array([getattr(reduction.unknowns[k], bound) for k in its])
        x = np.where(np.abs(x - limits) <= near, limits, x)
    return x


def _is_free(unknowns: list[Unknown]) -> bool:
    return all((x.columns[0][1] == axis).all() for x, axis in zip(unknowns, np.eye(3), strict=True))


def _reached_knobs(reduction: Reduction, lit: npt.NDArray[np.bool_]) -> tuple[bool, ...]:
    """Per light, whether what moves it reaches anything; what is held was not left to do so."""
    found = np.ones(len(reduction.held), dtype=bool)
    for lights, _ in reduction.knobs:
        found[list(lights)] = lit[list(lights)].any()
    return tuple(found.tolist())
