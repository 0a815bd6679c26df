"""How far the noise of the basis may have moved the answer: error bars from half differences.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise, and the inverse
of M turns that into the covariance of the weights (docs/method.md, "How sure").
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.errors import BasisError
from lightpaint.lighting.analysis.directions import (
    answer_to,
    block_diagonal,
    columns,
    moving,
    pulled_to_present,
    unknown_groups,
)
from lightpaint.lighting.analysis.noise import (
    SINGULAR,
    Noise,
    lacking_gradient,
    noise_sums,
    pseudo_inverse,
    without_noise,
)
from lightpaint.lighting.constraints.constrained import free_directions
from lightpaint.lighting.lighting import LightSetting
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solve import Solution, chosen_reduction, solution_of

#: Standard errors on either side of a 95 % interval.
SIDES = 1.96

#: Steps in which it is decided how much of the noise to take out of M.
SHARES = 8


@dataclass(frozen=True)
class Uncertainty:
    """What noise does to a solve. All are estimates themselves, good to a third or so.

    weights: (n, 3), as solved.
    scatter: (n, 3), standard deviation of the weights from one seed to another. Of a light
    that is off, what is left of it above zero (see `_one_sided`).
    bias: (n, 3), how much higher the weights would be without the noise power in M.
    objective_error: (3,), standard deviation of the objective; objective_noise: (3,), what
    the prediction's own noise adds to it.
    excess: (3,), by how much the objective of these weights, were they rendered without
    noise, may be expected to exceed the least possible. target_norm2: (3,), ‖Ψ‖², to hold
    it against.
    """

    weights: Doubles
    scatter: Doubles
    bias: Doubles
    objective_error: Doubles
    objective_noise: Doubles
    excess: Doubles
    target_norm2: Doubles

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


def error_bars(basis: Basis, solution: Solution) -> Uncertainty | None:
    """Standard error and bias of every weight that `solve` or `refine` found.

    None where nothing is known of the noise of the basis: that is not the same as none.
    After reweighting they are of the last linear problem.

    Lights that are kept or reach nothing have none. Under constraints, what a limit holds has
    none either: the error is of what is free to move there.
    """
    if not basis.knows_noise:
        return None
    weights = solution.lighting.weights_for(basis)
    equations = solution.equations
    noise = noise_sums(basis, solution, weights)
    corrected = without_noise(equations, noise.power)
    before, lacking = lacking_gradient(solution, noise)
    step = solution.solved.b - np.einsum("cij,jc->ci", solution.solved.M, before) + lacking
    right = np.einsum("cij,jc->ci", corrected, before) + step
    unbiased = NormalEquations(corrected, right, equations.target_norm2)
    if solution.constraints:
        return _constrained_error_bars(basis, solution, noise, unbiased)
    bias = np.asarray(answer_to(basis, solution, unbiased) - weights)

    scatter, excess = np.zeros_like(weights), np.zeros(3)
    # How firmly lights are off, had there been no bias.
    gradient = np.einsum("cij,jc->ic", corrected, weights + bias) - right.T
    # A render of the mix shows all of an earlier error, of which a step by the noisy M leaves
    # a part; the unbiased answer, on which the interval hangs, has the scatter of its own M.
    M_of_scatter = solution.solved.M if solution.refinement is None else corrected
    for unknowns in unknown_groups(basis, equations):
        to = columns(unknowns, len(weights))
        M = to.T @ block_diagonal(M_of_scatter) @ to
        C = to.T @ noise.gradient.reshape(len(to), len(to)) @ to
        flat = np.array([weights[i, cs[0]] for i, cs in unknowns])
        errors, spread = _propagated(M, C, flat, to.T @ gradient.T.ravel())
        for (i, cs), error in zip(unknowns, errors, strict=True):
            scatter[i, cs] = error
        for c in {c for _, cs in unknowns for c in cs}:
            excess[c] += spread / len({c for _, cs in unknowns for c in cs})
    excess += np.einsum("ic,cij,jc->c", bias, equations.M, bias)
    return Uncertainty(
        weights,
        scatter,
        bias,
        noise.objective_error,
        noise.objective_noise,
        excess,
        solution.norm2,
    )


def _constrained_error_bars(
    basis: Basis, solution: Solution, noise: Noise, unbiased: NormalEquations
) -> Uncertainty:
    """As `error_bars`, along the directions of the weights that constraints leave."""
    weights = solution.lighting.weights_for(basis)
    reduction = chosen_reduction(basis, solution)
    solved = solution.solved if solution.refinement is None else unbiased
    solved = pulled_to_present(basis, solution, solved)
    bias = answer_to(basis, solution, unbiased) - weights
    to = free_directions(solved, reduction, weights)
    inverse = pseudo_inverse(to.T @ block_diagonal(solved.M) @ to)
    C = to.T @ noise.gradient.reshape(len(to), len(to)) @ to
    covariance = to @ inverse @ C @ inverse @ to.T
    n = len(weights)
    scatter = np.sqrt(np.maximum(np.diag(covariance), 0)).reshape(3, n).T
    by_channel = covariance.reshape(3, n, 3, n)
    M = solution.equations.M
    excess = np.array([(M[c] * by_channel[c, :, c]).sum() for c in range(3)])
    excess += np.einsum("ic,cij,jc->c", bias, M, bias)
    return Uncertainty(
        weights,
        scatter,
        np.asarray(bias),
        noise.objective_error,
        noise.objective_noise,
        excess,
        solution.norm2,
    )


def correct_noise(basis: Basis, solution: Solution, *, share: float | None = None) -> Solution:
    """The solution of the equations without that share of the noise power in M and b.

    share: 0 to 1; that of which most is to be expected, if not given (see `_best_share`).
    What was solved before, `solution`, is where it starts. docs/method.md has what it is worth.
    Raises BasisError where nothing is known of the noise.
    """
    if not basis.knows_noise:
        raise BasisError(
            f"{basis.origin.scene} says nothing of its noise, so that none can be corrected: "
            "use noise_correction=False, and denoise the layers or render them with more samples"
        )
    weights = solution.lighting.weights_for(basis)
    noise = noise_sums(basis, solution, weights)
    e = solution.equations
    least = without_noise(e, noise.power)
    if share is None:
        share = _best_share(basis, solution, noise, least)
    problem = replace(
        solution,
        solved=NormalEquations(
            (1 - share) * e.M + share * least, e.b - share * noise.drawn, e.target_norm2
        ),
        noise_removed=share,
    )
    return solution_of(basis, problem, start=weights)


def _best_share(basis: Basis, solution: Solution, noise: Noise, least: Doubles) -> float:
    """The share s that makes the expected excess of the objective least, in steps of SHARES.

    What is left of the bias costs (1 − s)² δᵀMδ, and the scatter costs tr(M Cov(w)), which
    grows as M_s = M − s N becomes smaller. least: M without all noise.
    """
    weights = solution.lighting.weights_for(basis)
    e, n = solution.equations, len(weights)
    unbiased = NormalEquations(least, e.b - noise.drawn, noise.objective_noise)
    bias = answer_to(basis, solution, unbiased) - weights
    shares = np.linspace(0, 1, SHARES + 1)
    cost = np.square(1 - shares) * np.einsum("ic,cij,jc->", bias, e.M, bias)
    # The pull to the present keeps weights from moving, and is no part of what is missed.
    pull = pulled_to_present(basis, solution, e).M - e.M
    for to in moving(basis, solution):
        M, left, stiff = (to.T @ block_diagonal(x) @ to for x in (e.M, least, pull))
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
        r, g, b = (float(v) for v in error)
        kept = light.is_fixed or light.name in solution.quality.unreached
        lights.append(light if kept else replace(light, standard_error=(r, g, b)))
    r, g, b = (float(v) for v in uncertainty.objective_error)
    quality = replace(solution.quality, objective_error=(r, g, b))
    lighting = replace(solution.lighting, lights=tuple(lights), quality=quality)
    return replace(solution, lighting=lighting)


def _propagated(M: Doubles, C: Doubles, w: Doubles, gradient: Doubles) -> tuple[Doubles, float]:
    """Standard deviation of each weight of one problem, and the excess it causes.

    C: covariance of the gradient's noise. Cov(w) = M⁻¹ C M⁻¹ over the lights that are on,
    and those that are off by no more than noise.
    """
    errors = np.zeros(w.size)
    on = w > 0
    may_be_on = on.copy()
    for i in np.flatnonzero(~on).tolist():
        errors[i] = _one_sided(M, C, on, i, float(gradient[i]))
        may_be_on[i] = errors[i] > 0
    free = np.flatnonzero(may_be_on)
    inverse = pseudo_inverse(M[np.ix_(free, free)])
    covariance = inverse @ C[np.ix_(free, free)] @ inverse
    spread = np.sqrt(np.maximum(np.diag(covariance), 0))
    errors[free] = np.where(on[free], spread, errors[free])
    return errors, float(np.einsum("ij,ij->", M[np.ix_(free, free)], covariance))


def _one_sided(M: Doubles, C: Doubles, on: npt.NDArray[np.bool_], i: int, gradient: float) -> float:
    """Error of a light that is off: how far noise alone could have kept it from being on.

    Were it free it would have the weight u < 0 with some standard deviation s, so it may be
    on by SIDES · s − |u|.
    """
    others = np.flatnonzero(on)
    answer = -pseudo_inverse(M[np.ix_(others, others)]) @ M[others, i]
    stiffness = M[i, i] + M[i, others] @ answer
    if stiffness <= SINGULAR * M[i, i]:
        return 0.0  # the others do all that it could do
    along = np.zeros(on.size)
    along[i], along[others] = 1, answer
    wanted = -max(gradient, 0.0) / stiffness
    spread = float(np.sqrt(np.maximum(along @ C @ along, 0.0))) / stiffness
    return max(0.0, float(spread + wanted / SIDES))
