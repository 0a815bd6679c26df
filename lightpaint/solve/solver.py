"""The non-negative least-squares solve: projected Gauss–Seidel with a measure of optimality."""

from dataclasses import dataclass

import numpy as np

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
    tolerance: float = 1e-10,
    max_sweeps: int = 20_000,
) -> SolverResult:
    """Minimise the objective over w >= 0, channel by channel.

    start: (n, 3), weights to begin with; lights that reach nothing keep them.
    tolerance: of the KKT residual (see `kkt_residual`).
    """
    weights = np.array(start, dtype=np.float64)
    power = np.einsum("cii->ic", equations.M)
    strongest = power.max(initial=0)
    reached = (power > UNREACHED * strongest).any(axis=1)
    residuals, sweeps = np.zeros(3), [0, 0, 0]
    for c in range(3):
        lit = np.flatnonzero(power[:, c] > UNREACHED * strongest)
        M, b = equations.M[c][np.ix_(lit, lit)], equations.b[c, lit]
        w, residuals[c], sweeps[c] = projected_gauss_seidel(
            M, b, weights[lit, c], tolerance=tolerance, max_sweeps=max_sweeps
        )
        weights[lit, c] = w
    return SolverResult(
        weights, residuals, (sweeps[0], sweeps[1], sweeps[2]), tuple(reached.tolist()), tolerance
    )


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
