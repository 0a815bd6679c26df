"""The non-negative least-squares solve of all channels: one problem each, or one for three."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.algebra.clipped_newton import clipped_newton
from lightpaint.lighting.algebra.optimum import Method, Optimum, minimise
from lightpaint.lighting.algebra.threads import one_thread, side_by_side
from lightpaint.lighting.normal_equations import NormalEquations

#: Lights up to which the channels are solved in the same calls; beyond, each on a thread.
FEW = 64

#: (light, channels it moves together) of each unknown weight.
Unknowns = list[tuple[int, list[int]]]


@dataclass(frozen=True)
class SolverResult:
    """Weights of one solve and how good they are, per colour channel.

    weights: (n, 3) >= 0.
    kkt_residual: (3,), largest violation of the optimality conditions, after scaling.
    sweeps: (3,), Gauss–Seidel passes over the lights.
    reached: (n,) bool, False for lights that no weighted pixel sees: they keep their start.
    tolerance: what kkt_residual was to come down to, or round-off if that is more.
    """

    weights: Doubles
    kkt_residual: Doubles
    sweeps: tuple[int, int, int]
    reached: tuple[bool, ...]
    tolerance: float

    @property
    def converged(self) -> bool:
        """Whether every channel met the tolerance."""
        return bool((self.kkt_residual <= self.tolerance).all())


def solve_normal_equations(
    equations: NormalEquations,
    start: Doubles,
    *,
    is_scalar: Sequence[bool] = (),
    method: Method = "polished",
    tolerance: float = 1e-12,
    max_sweeps: int = 20_000,
) -> SolverResult:
    """Minimise the objective over w >= 0.

    start: (n, 3), weights to begin with; lights that reach nothing keep them.
    is_scalar: per light, whether one weight serves its three channels. Without such lights
    the channels are problems of their own; with some, one problem couples them.
    method, tolerance, max_sweeps: see `minimise`.
    """
    weights = np.array(start, dtype=np.float64)
    lit: Bools = equations.reached
    best_of = partial(minimise, method=method, tolerance=tolerance, max_sweeps=max_sweeps)
    residuals = np.zeros(3)
    if any(is_scalar):
        best = _coupled(equations, weights, lit, is_scalar, best_of)
        found = dict.fromkeys(range(3), best)
    else:
        left, few = [0, 1, 2], len(lit) <= FEW
        if few and method == "polished" and max_sweeps > 0:
            weights, residuals, is_solved = _at_once(equations, weights, lit, tolerance)
            left = np.flatnonzero(~is_solved).tolist()
        found = _apart(equations, weights, lit, left, best_of, in_threads=not few)
    sweeps, needed = [0, 0, 0], tolerance
    for c, best in found.items():
        residuals[c], sweeps[c] = best.kkt_residual, best.sweeps
        needed = max(needed, best.tolerance)
    reached = tuple(np.asarray(lit.any(axis=1)).tolist())
    return SolverResult(weights, residuals, (sweeps[0], sweeps[1], sweeps[2]), reached, needed)


def _apart(
    equations: NormalEquations,
    weights: Doubles,
    lit: Bools,
    channels: list[int],
    best_of: Callable[..., Optimum],
    *,
    in_threads: bool,
) -> dict[int, Optimum]:
    """The optimum of each of these channels, written into the weights (n, 3)."""

    def solve(c: int) -> Optimum:
        lights = np.flatnonzero(lit[:, c])
        M, b = equations.M[c], equations.b[c]
        if lights.size < b.size:
            M, b = M[np.ix_(lights, lights)], b[lights]
        best = best_of(M, b, start=weights[lights, c])
        weights[lights, c] = best.x
        return best

    found = side_by_side(solve, channels) if in_threads else map(solve, channels)
    return dict(zip(channels, found, strict=True))


def _coupled(
    equations: NormalEquations,
    weights: Doubles,
    lit: Bools,
    is_scalar: Sequence[bool],
    best_of: Callable[..., Optimum],
) -> Optimum:
    """The optimum of the three channels as one problem, written into the weights (n, 3)."""
    unknowns = unknowns_of(lit, is_scalar)
    M, b = _assemble(equations, unknowns)
    best = best_of(M, b, start=np.array([weights[i, cs[0]] for i, cs in unknowns]))
    for (i, cs), value in zip(unknowns, best.x, strict=True):
        weights[i, cs] = value
    return best


def _at_once(
    equations: NormalEquations, start: Doubles, lit: Bools, tolerance: float
) -> tuple[Doubles, Doubles, Bools]:
    """(weights, KKT residuals, which channels that solved); the other channels as at the start."""
    weights = start.copy()
    # What reaches nothing is left out: the others then have the bits that they have without it.
    reached = np.flatnonzero(lit.any(axis=1))
    M, b = equations.M, equations.b
    if reached.size < len(lit):
        M, b = np.ascontiguousarray(M[:, reached][:, :, reached]), b[:, reached]
    # A channel in which nothing asks for light has an answer that takes no steps.
    asks = np.any((b > 0) & lit[reached].T, axis=1)
    if not (asks.any() and np.isfinite(M).all() and np.isfinite(b).all()):
        return weights, np.zeros(3), np.zeros(3, bool)
    counts = lit[reached].T & asks[:, None]
    root = np.sqrt(np.where(counts, np.einsum("cii->ci", M), 1))
    scale = np.where(counts, 1 / root, 0)
    M, b = (M * scale[:, :, None]) * scale[:, None, :], b * scale
    size = np.where(asks, np.abs(b).max(axis=1), 1)
    begin = np.where(counts, np.maximum(start[reached].T, 0) * root, 0)
    with one_thread():
        x, residuals, _ = clipped_newton(M, b, 0.0, np.inf, begin, size, tolerance=tolerance)
    is_solved = asks & (residuals <= tolerance)
    weights[reached] = np.where(counts & is_solved[:, None], x * scale, start[reached].T).T
    return weights, residuals, is_solved


def unknowns_of(lit: Bools, is_scalar: Sequence[bool]) -> Unknowns:
    """(light, channels it moves together) of each unknown weight."""
    unknowns: Unknowns = []
    for i, in_channel in enumerate(lit.tolist()):
        if is_scalar[i]:
            unknowns += [(i, [0, 1, 2])] if any(in_channel) else []
        else:
            unknowns += [(i, [c]) for c in range(3) if in_channel[c]]
    return unknowns


def _assemble(equations: NormalEquations, unknowns: Unknowns) -> tuple[Doubles, Doubles]:
    """M and b in the unknowns: those of the channels, summed where one weight serves several."""
    size = len(unknowns)
    M, b = np.zeros((size, size)), np.zeros(size)
    for c in range(3):
        here = np.array([k for k, (_, cs) in enumerate(unknowns) if c in cs], dtype=int)
        lights = np.array([unknowns[k][0] for k in here], dtype=int)
        M[np.ix_(here, here)] += equations.M[c][np.ix_(lights, lights)]
        b[here] += equations.b[c, lights]
    return M, b
