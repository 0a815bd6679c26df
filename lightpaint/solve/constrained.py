"""The solve under constraints: the reduced problem, solved, and what held which light."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis
from lightpaint.solve.normal_equations import BLOCK, Doubles, NormalEquations
from lightpaint.solve.optimum import Cap, Optimum, minimise
from lightpaint.solve.reduction import Reduction, Unknown, channel_groups
from lightpaint.solve.solver import UNREACHED, SolverResult

#: Pull of what reaches nothing in one channel towards its start, beside its other channels.
FAINT = 1e-8

#: Gradient, of a problem with unit diagonal and relative to b, that counts as a pull.
PULL = 1e-7


@dataclass(frozen=True)
class ReducedProblem:
    """½ xᵀM x − bᵀx in the unknowns `its` of a reduction, of the channels it couples."""

    channels: list[int]
    its: list[int]
    M: Doubles
    b: Doubles
    lower: Doubles
    upper: Doubles
    caps: tuple[Cap, ...]


def solve_constrained(
    equations: NormalEquations, reduction: Reduction, start: Doubles
) -> SolverResult:
    """Minimise the objective over what `reduction` leaves.

    start: (n, 3), weights to begin with; lights that reach nothing stay as near to them as
    the constraints allow.
    """
    lit = reached(equations)
    equations = _with_faint_pull(equations, lit, start)
    x = np.array([0.0] * len(reduction.unknowns))
    for _, its in reduction.knobs:
        x[list(its)] = _nearest(reduction, its, start)
    residuals, tolerances, sweeps = np.zeros(3), np.zeros(3), [0, 0, 0]
    for problem in problems(equations, reduction):
        optimum = minimise(
            problem.M,
            problem.b,
            lower=problem.lower,
            upper=problem.upper,
            caps=problem.caps,
            start=x[problem.its],
        )
        x[problem.its] = optimum.x
        for c in problem.channels:
            residuals[c], sweeps[c] = optimum.kkt_residual, optimum.sweeps
            tolerances[c] = optimum.tolerance
    return SolverResult(
        weights_of(reduction, x),
        residuals,
        (sweeps[0], sweeps[1], sweeps[2]),
        _reached_knobs(reduction, lit),
        float(tolerances.max()),
    )


def problems(equations: NormalEquations, reduction: Reduction) -> list[ReducedProblem]:
    """One problem for every set of channels that the unknowns couple.

    With w = C x + w₀ it is M' = Σ_c C_cᵀ M_c C_c and b' = Σ_c C_cᵀ (b_c − M_c w₀_c).
    """
    made = []
    for channels in channel_groups(reduction):
        its = [k for k, x in enumerate(reduction.unknowns) if _touches(x, channels)]
        M, b = np.zeros((len(its), len(its))), np.zeros(len(its))
        for c in channels:
            here = [k for k, i in enumerate(its) if _touches(reduction.unknowns[i], [c])]
            C = np.zeros((len(reduction.held), len(here)))
            for k, i in enumerate(here):
                for light, rgb in reduction.unknowns[its[i]].columns:
                    C[light, k] = rgb[c]
            M[np.ix_(here, here)] += C.T @ equations.M[c] @ C
            b[here] += C.T @ (equations.b[c] - equations.M[c] @ reduction.held[:, c])
        place = {i: k for k, i in enumerate(its)}
        caps = tuple(
            replace(cap, unknowns=tuple(place[i] for i in cap.unknowns))
            for cap in reduction.caps
            if cap.unknowns[0] in place
        )
        lower = np.array([reduction.unknowns[i].lower for i in its])
        upper = np.array([reduction.unknowns[i].upper for i in its])
        made.append(ReducedProblem(channels, its, M, b, lower, upper, caps))
    return made


def weights_of(reduction: Reduction, x: Doubles) -> Doubles:
    """w = C x + w₀, (n, 3)."""
    w = reduction.held.copy()
    for value, unknown in zip(x, reduction.unknowns, strict=True):
        for light, rgb in unknown.columns:
            w[light] += value * rgb
    return w


def reached(equations: NormalEquations) -> npt.NDArray[np.bool_]:
    """(n, 3), whether a light reaches something that counts in a channel."""
    power = np.einsum("cii->ic", equations.M)
    return np.asarray(power > UNREACHED * power.max(initial=0))


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
    lit = reached(equations)
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
    partly = lit.any(axis=1)[:, None] & ~lit
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
        return np.clip(start[lights[0]], lower, upper)
    # (unknowns, lights · 3)
    C = np.zeros((len(its), len(lights), 3))
    for k, x in enumerate(unknowns):
        for light, rgb in x.columns:
            C[k, lights.index(light)] = rgb
    C = C.reshape(len(its), -1)
    found: Optimum = minimise(
        C @ C.T, C @ start[lights].ravel(), lower=lower, upper=upper, caps=caps
    )
    return found.x


def _is_free(unknowns: list[Unknown]) -> bool:
    return all((x.columns[0][1] == axis).all() for x, axis in zip(unknowns, np.eye(3), strict=True))


def _touches(unknown: Unknown, channels: list[int]) -> bool:
    return any(rgb[c] for _, rgb in unknown.columns for c in channels)


def _reached_knobs(reduction: Reduction, lit: npt.NDArray[np.bool_]) -> tuple[bool, ...]:
    """Per light, whether what moves it reaches anything; what is held was not left to do so."""
    found = np.ones(len(reduction.held), dtype=bool)
    for lights, _ in reduction.knobs:
        found[list(lights)] = lit[list(lights)].any()
    return tuple(found.tolist())
