"""The non-negative least-squares solve of all channels: one problem each, or one for three."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.solve.normal_equations import Doubles, NormalEquations
from lightpaint.solve.optimum import Method, minimise
from lightpaint.solve.quadratic import UNREACHED


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
    power = np.einsum("cii->ic", equations.M)
    lit = power > UNREACHED * power.max(initial=0)  # (n, 3)
    residuals, sweeps, needed = np.zeros(3), [0, 0, 0], tolerance
    for channels in ([0, 1, 2],) if any(is_scalar) else ([0], [1], [2]):
        problem = _unknowns(lit, channels, is_scalar)
        M, b = _assemble(equations, problem)
        begin = np.array([weights[i, cs[0]] for i, cs in problem])
        best = minimise(
            M, b, start=begin, method=method, tolerance=tolerance, max_sweeps=max_sweeps
        )
        for (i, cs), value in zip(problem, best.x, strict=True):
            weights[i, cs] = value
        for c in channels:
            residuals[c], sweeps[c] = best.kkt_residual, best.sweeps
        needed = max(needed, best.tolerance)
    reached = tuple(lit.any(axis=1).tolist())
    return SolverResult(weights, residuals, (sweeps[0], sweeps[1], sweeps[2]), reached, needed)


def _unknowns(
    lit: npt.NDArray[np.bool_], channels: list[int], is_scalar: Sequence[bool]
) -> list[tuple[int, list[int]]]:
    """(light, channels it moves together) of each unknown weight."""
    unknowns: list[tuple[int, list[int]]] = []
    for i in range(len(lit)):
        if is_scalar and is_scalar[i]:
            unknowns += [(i, channels)] if lit[i].any() else []
        else:
            unknowns += [(i, [c]) for c in channels if lit[i, c]]
    return unknowns


def _assemble(
    equations: NormalEquations, unknowns: list[tuple[int, list[int]]]
) -> tuple[Doubles, Doubles]:
    """M and b in the unknowns: those of the channels, summed where one weight serves several."""
    size = len(unknowns)
    M, b = np.zeros((size, size)), np.zeros(size)
    for c in range(3):
        here = np.array([k for k, (_, cs) in enumerate(unknowns) if c in cs], dtype=int)
        lights = np.array([unknowns[k][0] for k in here], dtype=int)
        M[np.ix_(here, here)] += equations.M[c][np.ix_(lights, lights)]
        b[here] += equations.b[c, lights]
    return M, b
