"""How far the noise of the basis may have moved the answer: error bars from half differences.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise, and the inverse
of M turns that into the covariance of the weights (docs/method.md, "How sure").
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, as_rgb
from lightpaint.errors import BasisError
from lightpaint.lighting.analysis.directions import (
    Room,
    answer_to,
    moving,
    rooms,
)
from lightpaint.lighting.analysis.noise import (
    SINGULAR,
    Noise,
    lacking_gradient,
    noise_sums,
    pseudo_inverse,
    without_noise,
)
from lightpaint.lighting.lighting import LightSetting
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import again
from lightpaint.screen import shortly

#: Standard errors on either side of a 95 % interval.
SIDES = 1.96

#: Steps in which it is decided how much of the noise to take out of M.
SHARES = 8


@dataclass(frozen=True)
class Uncertainty:
    """What noise does to a solve. All are estimates themselves, good to a third or so.

    Attributes:
        weights: (n, 3), as solved.
        scatter: (n, 3), standard deviation of the weights from one seed to another. Of a light that
            is off, what is left of it above zero (see `_one_sided`).
        bias: (n, 3), how much higher the weights would be without the noise power in M.
        objective_error: (3,), standard deviation of the objective.
        objective_noise: (3,), what the prediction's own noise adds to it.
        excess: (3,), by how much the objective of these weights, were they rendered without noise,
            may be expected to exceed the least possible.
        target_norm2: (3,), ‖Ψ‖², to hold it against.

    Examples:
        >>> bars = lp.error_bars(lp.solve(basis, target))
        >>> low, high = bars.interval
        >>> bool((low <= bars.weights).all() and (bars.weights <= high).all())
        True
    """

    weights: Doubles
    scatter: Doubles
    bias: Doubles
    objective_error: Doubles
    objective_noise: Doubles
    excess: Doubles
    target_norm2: Doubles

    __repr__ = shortly

    @property
    def relative_excess(self) -> float:
        """What these errors miss of the painting, root mean square."""
        norm2 = float(self.target_norm2.sum())
        return float(np.sqrt(self.excess.sum() / norm2)) if norm2 > 0 else 0.0

    @property
    def standard_error(self) -> Doubles:
        """Root mean square of scatter and bias, (n, 3): what the answer is off by."""
        return np.hypot(self.scatter, self.bias)

    @property
    def interval(self) -> tuple[Doubles, Doubles]:
        """The 95 % interval of each weight, lower and upper ends, (n, 3) each."""
        side = SIDES * self.standard_error
        return np.maximum(self.weights - side, 0), self.weights + side


def error_bars(solution: Solution) -> Uncertainty | None:
    """Standard error and bias of every weight that a solve or `refine` found.

    None where nothing is known of the noise of the basis: that is not the same as none. After
    reweighting they are of the last linear problem.

    Lights that are kept or reach nothing have none. What a limit holds that was asked for has none
    either: the error is of what is free to move there. What is off may be on by as much as noise
    could hide, and no more (see `_one_sided`).

    Args:
        solution: As `solve`, `refine` or `correct_noise` made it.

    Examples:
        >>> bars = lp.error_bars(lp.solve(basis, target))
        >>> bars.standard_error.shape
        (2, 3)
    """
    problem, weights = solution.problem, solution.weights
    if not problem.basis.knows_noise:
        return None
    equations, solved = problem.equations, problem.solved
    noise = noise_sums(solution)
    corrected = without_noise(equations, noise.power)
    before, lacking = lacking_gradient(solution, noise)
    step = solved.b - np.einsum("cij,jc->ci", solved.M, before) + lacking
    right = np.einsum("cij,jc->ci", corrected, before) + step
    unbiased = NormalEquations(corrected, right, equations.target_norm2)
    bias = np.asarray(answer_to(solution, unbiased) - weights)

    # How firmly lights are off, had there been no bias.
    asked = problem.pulled(unbiased)
    gradient = asked.gradient(weights + bias).T.ravel()
    # A render of the mix shows all of an earlier error, of which a step by the noisy M leaves
    # a part; the unbiased answer, on which the interval hangs, has the scatter of its own M.
    scatters = problem.pulled(solved if problem.refinement is None else unbiased)
    M, C = scatters.whole, noise.gradient.reshape(gradient.size, -1)
    missed = equations.whole
    variance, excess = np.zeros(gradient.size), np.zeros(gradient.size)
    for room in rooms(solution, scatters):
        to = room.columns
        errors, covariance = _propagated(to.T @ M @ to, to.T @ C @ to, room, to.T @ gradient)
        excess += np.einsum("pq,qp->p", missed, to @ covariance @ to.T)
        covariance[room.off], covariance[:, room.off] = 0, 0
        variance += np.einsum("pi,ij,pj->p", to, covariance, to, optimize=True)
        variance += np.square(to) @ np.square(errors)
    scatter = np.sqrt(np.maximum(variance, 0)).reshape(3, -1).T
    by_channel = excess.reshape(3, -1).sum(axis=1)
    by_channel += np.einsum("ic,cij,jc->c", bias, equations.M, bias)
    return Uncertainty(
        weights,
        scatter,
        bias,
        noise.objective_error,
        noise.objective_noise,
        by_channel,
        solution.norm2,
    )


def correct_noise(solution: Solution, *, share: float | None = None) -> Solution:
    """The solution of the equations without that share of the noise power in M and b.

    Args:
        solution: What was solved before; it starts there.
        share: 0 to 1; that of which most is to be expected, if not given (see `_best_share`).
            docs/method.md has what it is worth.

    Raises:
        BasisError: Where nothing is known of the noise.

    Examples:
        >>> corrected = lp.correct_noise(lp.solve(basis, target))
        >>> 0 <= corrected.problem.noise_removed <= 1
        True
    """
    basis = solution.basis
    if not basis.knows_noise:
        raise BasisError(
            f"{basis.origin.scene} says nothing of its noise, so that none can be corrected: "
            "use noise_correction=False, and denoise the layers or render them with more samples"
        )
    noise = noise_sums(solution)
    e = solution.equations
    least = without_noise(e, noise.power)
    if share is None:
        share = _best_share(solution, noise, least)
    corrected = NormalEquations(
        (1 - share) * e.M + share * least, e.b - share * noise.drawn, e.target_norm2
    )
    return again(solution, replace(solution.problem, corrected=corrected, noise_removed=share))


def _best_share(solution: Solution, noise: Noise, least: Doubles) -> float:
    """The share s that makes the expected excess of the objective least, in steps of SHARES.

    What is left of the bias costs (1 − s)² δᵀMδ, and the scatter costs tr(M Cov(w)), which
    grows as M_s = M − s N becomes smaller. least: M without all noise.
    """
    e, n = solution.equations, len(solution.weights)
    unbiased = NormalEquations(least, e.b - noise.drawn, noise.objective_noise)
    bias = answer_to(solution, unbiased) - solution.weights
    shares = np.linspace(0, 1, SHARES + 1)
    cost = np.square(1 - shares) * np.einsum("ic,cij,jc->", bias, e.M, bias)
    # What pulls at the weights keeps them from moving, and is no part of what is missed.
    pull = solution.problem.pull
    stiffness = np.zeros((3 * n, 3 * n)) if pull is None else pull.whole
    for to in moving(solution):
        M, left, stiff = (to.T @ x @ to for x in (e.whole, block_diagonal(least), stiffness))
        C = to.T @ noise.gradient.reshape(3 * n, 3 * n) @ to
        for k, s in enumerate(shares):
            inverse = pseudo_inverse((1 - s) * M + s * left + stiff)
            cost[k] += np.einsum("ij,ji->", M, inverse @ C @ inverse)
    return float(shares[np.argmin(cost)])


def with_error_bars(solution: Solution, uncertainty: Uncertainty | None) -> Solution:
    """`solution` with the standard errors of lights and objective, where they are known."""
    if uncertainty is None:
        return solution
    lights: list[LightSetting] = []
    for light, error in zip(solution.lighting.lights, uncertainty.standard_error, strict=True):
        kept = light.is_fixed or light.name in solution.certificate.unreached
        lights.append(light if kept else replace(light, standard_error=as_rgb(error)))
    lighting = replace(solution.lighting, lights=tuple(lights))
    error = as_rgb(uncertainty.objective_error)
    return replace(solution, lighting=lighting).told(objective_error=error)


def _propagated(M: Doubles, C: Doubles, room: Room, gradient: Doubles) -> tuple[Doubles, Doubles]:
    """Errors of unknowns that are off, (k,), and the covariance of all, (k, k), 0 for what is held.

    M: (k, k); C: (k, k), covariance of the noise of the gradient, (k,). Cov(x) = M⁻¹ C M⁻¹ over
    what is free, and what is off by no more than noise.
    """
    errors = np.zeros(room.x.size)
    for i in room.off.tolist():
        errors[i] = _one_sided(M, C, room.free, i, float(gradient[i]))
    free = np.hstack([room.free, np.eye(room.x.size)[:, errors > 0]])
    inverse = free @ pseudo_inverse(free.T @ M @ free) @ free.T
    return errors, inverse @ C @ inverse


def _one_sided(M: Doubles, C: Doubles, free: Doubles, i: int, gradient: float) -> float:
    """Error of an unknown that is off: how far noise alone could have kept it from being on.

    Were it free it would have the value u < 0 with some standard deviation s, so it may be
    on by SIDES · s − |u|. free: (k, m), what the others may do.
    """
    along = -free @ (pseudo_inverse(free.T @ M @ free) @ (free.T @ M[:, i]))
    along[i] = 1
    stiffness = M[i] @ along
    if stiffness <= SINGULAR * M[i, i]:
        return 0.0  # the others do all that it could do
    wanted = -max(gradient, 0.0) / stiffness
    spread = float(np.sqrt(np.maximum(along @ C @ along, 0.0))) / stiffness
    return max(0.0, float(spread + wanted / SIDES))
