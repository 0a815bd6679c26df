"""The non-negative least-squares solve: projected Gauss–Seidel with a measure of optimality."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.solve.normal_equations import Doubles, NormalEquations

#: Lights whose ⟨Φ, Φ⟩ is below this share of the strongest light's reach nothing that counts.
UNREACHED = 1e-24


@dataclass(frozen=True)
class SolverResult:
    """Weights of one solve and how good they are, per colour channel.

    weights: (n, 3) >= 0.
    kkt_residual: (3,), largest violation of the optimality conditions, after scaling.
    sweeps: (3,), Gauss–Seidel passes over the lights.
    reached: (n,) bool, False for lights that no weighted pixel sees: they keep their start.
    tolerance: what kkt_residual was to come down to.
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
    tolerance: float = 1e-10,
    max_sweeps: int = 20_000,
) -> SolverResult:
    """Minimise the objective over w >= 0.

    start: (n, 3), weights to begin with; lights that reach nothing keep them.
    is_scalar: per light, whether one weight serves its three channels. Without such lights
    the channels are problems of their own; with some, one problem couples them.
    tolerance: of the KKT residual (see `kkt_residual`).
    """
    weights = np.array(start, dtype=np.float64)
    power = np.einsum("cii->ic", equations.M)
    lit = power > UNREACHED * power.max(initial=0)  # (n, 3)
    residuals, sweeps = np.zeros(3), [0, 0, 0]
    for channels in ([0, 1, 2],) if any(is_scalar) else ([0], [1], [2]):
        problem = _unknowns(lit, channels, is_scalar)
        M, b = _assemble(equations, problem)
        begin = np.array([weights[i, cs[0]] for i, cs in problem])
        w, residual, count = projected_gauss_seidel(
            M, b, begin, tolerance=tolerance, max_sweeps=max_sweeps
        )
        for (i, cs), value in zip(problem, w, strict=True):
            weights[i, cs] = value
        for c in channels:
            residuals[c], sweeps[c] = residual, count
    reached = tuple(lit.any(axis=1).tolist())
    return SolverResult(weights, residuals, (sweeps[0], sweeps[1], sweeps[2]), reached, tolerance)


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


def projected_gauss_seidel(
    M: Doubles, b: Doubles, start: Doubles, *, tolerance: float, max_sweeps: int
) -> tuple[Doubles, float, int]:
    """Solve one channel by the paper's iteration (Schoeneman et al. 1993, Eq 6):

        w_i ← max((b_i − Σ_{j≠i} M_ij w_j) / M_ii, 0)

    M: (n, n) with a positive diagonal; b, start: (n,). Returns (w, KKT residual, sweeps).
    """
    if not (b > 0).any():
        # Nothing in the target asks for light: all off is optimal, and exactly so.
        return np.zeros(b.size), 0.0, 0
    scale = 1 / np.sqrt(np.diag(M))
    # Scaled to a unit diagonal, every light weighs the same in the stopping rule, and the
    # division by M_ii is done once for all.
    M = M * scale[:, None] * scale
    b = b * scale
    w = np.maximum(start, 0) / scale
    gradient = M @ w - b
    sweeps = 0
    residual = kkt_residual(gradient, w, b)
    while residual > tolerance and sweeps < max_sweeps:
        for i, row in enumerate(M):
            step = max(w[i] - gradient[i], 0.0) - w[i]
            if step:
                w[i] += step
                gradient += step * row
        sweeps += 1
        residual = kkt_residual(gradient, w, b)
        if sweeps % 64 == 0 or sweeps == max_sweeps or residual <= tolerance:
            # The round-off of all those updates must not decide when to stop.
            gradient = M @ w - b
            residual = kkt_residual(gradient, w, b)
    return w * scale, residual, sweeps


def kkt_residual(gradient: Doubles, w: Doubles, b: Doubles) -> float:
    """How far w >= 0 is from optimal: ‖w − max(w − gradient, 0)‖∞ / ‖b‖∞.

    It is 0 exactly if gradient = M w − b vanishes for every light that is on and is not
    negative for every light that is off. All arguments scaled to a unit diagonal of M.
    """
    if w.size == 0:
        return 0.0
    violation = np.abs(np.minimum(w, gradient)).max()
    size = np.abs(b).max()
    return float(violation / size) if size > 0 else float(violation)
