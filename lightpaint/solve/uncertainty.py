"""How far the noise of the basis may have moved the answer: error bars from half differences.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise, and the inverse
of M turns that into the covariance of the weights (docs/method.md, "How sure").
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis, mix
from lightpaint.errors import BasisError
from lightpaint.solve.constrained import free_directions, preferring, solve_constrained
from lightpaint.solve.lighting import LightSetting
from lightpaint.solve.normal_equations import BLOCK, Doubles, NormalEquations
from lightpaint.solve.quadratic import UNREACHED
from lightpaint.solve.solve import Solution, chosen_reduction, solution_of
from lightpaint.solve.solver import solve_normal_equations

#: Standard errors on either side of a 95 % interval.
SIDES = 1.96

#: The largest part of M, in any direction of the weights, that is taken to be noise. Beyond,
#: the estimate of it is itself noise, and what is left of M would soon be indefinite.
LARGEST_NOISE = 0.5

#: Steps in which it is decided how much of the noise to take out of M.
SHARES = 8

#: Eigenvalues of M, scaled to a unit diagonal, below which a direction changes no pixel.
SINGULAR = 1e-12


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


@dataclass(frozen=True)
class Noise:
    """Sums over pixels of products of half differences, per channel.

    power: (3, n, n), N_ij = Σ D h_i h_j, what the noise adds to M. drawn: (3, n), what the
    noise of the current look, where that is solved for, adds to b.
    gradient: (3, n, 3, n), covariance of the gradient. objective: as in `Uncertainty`.
    """

    power: Doubles
    drawn: Doubles
    gradient: Doubles
    objective_error: Doubles
    objective_noise: Doubles


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
    bias = np.asarray(_solved(basis, unbiased, weights) - weights)

    scatter, excess = np.zeros_like(weights), np.zeros(3)
    # How firmly lights are off, had there been no bias.
    gradient = np.einsum("cij,jc->ic", corrected, weights + bias) - right.T
    # A render of the mix shows all of an earlier error, of which a step by the noisy M leaves
    # a part; the unbiased answer, on which the interval hangs, has the scatter of its own M.
    M_of_scatter = solution.solved.M if solution.refinement is None else corrected
    for unknowns in unknown_groups(basis, equations):
        to = _columns(unknowns, len(weights))
        M = to.T @ _block_diagonal(M_of_scatter) @ to
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
    assert solution.constraints is not None
    weights = solution.lighting.weights_for(basis)
    reduction = chosen_reduction(basis, solution)
    solved = solution.solved if solution.refinement is None else unbiased
    if strength := solution.constraints.prefer_current:
        present = basis.present_weights
        solved = preferring(solved, basis, present, strength)
        unbiased = preferring(unbiased, basis, present, strength)
    bias = solve_constrained(unbiased, reduction, weights).weights - weights
    to = free_directions(solved, reduction, weights)
    inverse = pseudo_inverse(to.T @ _block_diagonal(solved.M) @ to)
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


def lacking_gradient(solution: Solution, noise: Noise) -> tuple[Doubles, Doubles]:
    """Some weights, (n, 3), and what noise made b − M w lack there on average, (3, n)."""
    if (r := solution.refinement) is not None:
        return r.before, r.lacking
    n = noise.power.shape[1]
    # At no light at all the noise of the basis lacks nothing in M: all of it is still to come.
    nothing = np.zeros((n, 3))
    if solution.noise_removed == 0:
        return nothing, -noise.drawn
    weights = np.array([light.weight for light in solution.lighting.lights])
    lack = np.einsum("cij,jc->ci", noise.power, weights) - noise.drawn
    return weights, (1 - solution.noise_removed) * lack


def correct_noise(basis: Basis, solution: Solution, *, share: float | None = None) -> Solution:
    """The solution of the equations without that share of the noise power in M and b.

    share: 0 to 1; that of which most is to be expected, if not given (see `_best_share`).
    What was solved before, `solution`, is where it starts. docs/method.md has what it is worth.
    Raises BasisError where nothing is known of the noise.
    """
    if not basis.knows_noise:
        raise BasisError(
            f"{basis.origin.scene} says nothing of its noise, so that none can be corrected: "
            "leave --correct-noise out, and denoise the layers or render them with more samples"
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
    M = solution.equations.M
    right = NormalEquations(least, solution.equations.b - noise.drawn, noise.objective_noise)
    bias = _solved(basis, right, weights) - weights
    shares = np.linspace(0, 1, SHARES + 1)
    cost = np.square(1 - shares) * np.einsum("ic,cij,jc->", bias, M, bias)
    for c in range(3):
        on = np.flatnonzero((weights[:, c] > 0) & ~basis.is_fixed)
        here = np.ix_(on, on)
        C = noise.gradient[c, :, c][here]
        for k, s in enumerate(shares):
            inverse = pseudo_inverse((1 - s) * M[c][here] + s * least[c][here])
            cost[k] += np.einsum("ij,ji->", M[c][here], inverse @ C @ inverse)
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


def without_noise(equations: NormalEquations, power: Doubles) -> Doubles:
    """M without the noise in it, (3, n, n), positive semidefinite.

    power: (3, n, n), N. M − N, but in no direction less than 1 − LARGEST_NOISE of M.
    """
    made = np.empty_like(equations.M)
    for c in range(3):
        root, inverse = _roots(equations.M[c])
        values, vectors = np.linalg.eigh(inverse @ power[c] @ inverse.T)
        values = np.clip(values, 0, LARGEST_NOISE)
        made[c] = equations.M[c] - root @ ((vectors * values) @ vectors.T) @ root.T
    return made


def unknown_groups(basis: Basis, equations: NormalEquations) -> list[list[tuple[int, list[int]]]]:
    """(light, channels it moves together) of each unknown weight, by independent problem."""
    power = np.einsum("cii->ic", equations.M)
    lit = power > UNREACHED * power.max(initial=0)
    is_coupled = any(light.is_scalar and not light.is_fixed for light in basis.lights)
    groups = []
    for channels in [[0, 1, 2]] if is_coupled else [[0], [1], [2]]:
        group: list[tuple[int, list[int]]] = []
        for i, light in enumerate(basis.lights):
            if light.is_fixed:
                continue
            if light.is_scalar:
                group += [(i, channels)] if lit[i].any() else []
            else:
                group += [(i, [c]) for c in channels if lit[i, c]]
        groups.append(group)
    return groups


def noise_sums(basis: Basis, solution: Solution, weights: Doubles) -> Noise:
    """One pass over the pixels that count."""
    n = len(weights)
    importance = solution.importance.ravel()
    # (pixels, 1), or (pixels, 3) where channels differ.
    weight, share = (x.reshape(-1, x.shape[2]) for x in (solution.weight, solution.current_shares))
    residual, mixed = residual_and_noise(basis, solution, weights)
    present = mix(basis.half_differences, basis.present_weights).reshape(-1, 3)
    images, halves = (x.reshape(n, -1, 3) for x in (basis.images, basis.half_differences))
    # A dimmer, a tie or a limit on luminance spans channels, as the one weight of a scalar light.
    is_coupled = bool(solution.constraints) or any(light.is_scalar for light in basis.lights)
    power, drawn = np.zeros((3, n, n)), np.zeros((3, n))
    gradient = np.zeros((3, n, 3, n))
    pulled = _pulled(basis, solution, weights)
    unseen = ~basis.emitters_seen.ravel()
    counted = np.flatnonzero((importance > 0) | (unseen & pulled.any()))
    for start in range(0, counted.size, BLOCK):
        pixels = counted[start : start + BLOCK]
        rows = []
        for c in range(3):
            D = weight[pixels, c % weight.shape[1]].astype(np.float64)
            h = halves[:, pixels, c].astype(np.float64)
            rows.append(D * (h * residual[pixels, c] - images[:, pixels, c] * mixed[pixels, c]))
            if pulled.any():
                lit = np.where(unseen[pixels], images[:, pixels, c], 0).astype(np.float64)
                rows[c] += pulled[:, c, None] * lit * h
            power[c] += (D * h) @ h.T
            shared = D * share[pixels, c % share.shape[1]]
            drawn[c] += h @ (shared * present[pixels, c])
            gradient[c, :, c] += rows[c] @ rows[c].T
        if is_coupled:
            # One path carries all three channels, so their noise goes together.
            for c, d in ((0, 1), (0, 2), (1, 2)):
                product = rows[c] @ rows[d].T
                gradient[c, :, d] += product
                gradient[d, :, c] += product.T
    return Noise(
        power,
        drawn,
        gradient,
        objective_error=2 * np.sqrt(np.square(weight * residual * mixed).sum(axis=0)),
        objective_noise=(weight * np.square(mixed)).sum(axis=0),
    )


def _pulled(basis: Basis, solution: Solution, weights: Doubles) -> Doubles:
    """(n, 3), what Φᵢ hᵢ of a pixel adds to the noise of the gradient by the pull to the present.

    The pull, λ ‖Φᵢ‖² (presentᵢ − wᵢ), is as noisy as the images that it is measured by.
    """
    strength = solution.constraints.prefer_current if solution.constraints else 0.0
    return np.asarray(2 * strength * (basis.present_weights - weights))


def residual_and_noise(
    basis: Basis, solution: Solution, weights: Doubles
) -> tuple[Doubles, Doubles]:
    """What the answer misses, and half the difference of what its two halves predict.

    Returns two (pixels, 3): Ψ − Σ w_i Φ_i and Σ w_i h_i, less the noise that Ψ shares where
    it holds the current look.
    """
    residual = solution.image.astype(np.float64) - basis.mix(weights)
    noise: Doubles
    if (r := solution.refinement) is not None:
        noise = np.asarray(r.noise + mix(basis.half_differences, weights - r.before), np.float64)
    else:
        noise = mix(basis.half_differences, weights).astype(np.float64)
        present = mix(basis.half_differences, basis.present_weights)
        noise = np.asarray(noise - solution.current_shares * present, np.float64)
    return residual.reshape(-1, 3), noise.reshape(-1, 3)


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


def _solved(basis: Basis, equations: NormalEquations, start: Doubles) -> Doubles:
    """The weights (n, 3) that solve `equations` under the same bounds as the answer."""
    free = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    weights = start.copy()
    weights[free] = solve_normal_equations(
        equations.holding(basis.is_fixed),
        start[free],
        is_scalar=[basis.lights[k].is_scalar for k in free],
        # Far below the errors that are asked for.
        tolerance=1e-6,
        max_sweeps=2000,
    ).weights
    return weights


def _columns(unknowns: list[tuple[int, list[int]]], n: int) -> Doubles:
    """(3 n, unknowns): 1 where a weight, channel by channel, is that unknown."""
    columns = np.zeros((3, n, len(unknowns)))
    for k, (i, cs) in enumerate(unknowns):
        columns[cs, i, k] = 1
    return columns.reshape(3 * n, -1)


def _block_diagonal(M: Doubles) -> Doubles:
    n = M.shape[1]
    whole = np.zeros((3, n, 3, n))
    for c in range(3):
        whole[c, :, c] = M[c]
    return whole.reshape(3 * n, 3 * n)


def _roots(M: Doubles) -> tuple[Doubles, Doubles]:
    """R with R Rᵀ = M and its pseudo-inverse, without the directions that change nothing."""
    scale = np.sqrt(np.diag(M))
    safe = np.where(scale > 0, scale, 1)
    values, vectors = np.linalg.eigh(M / safe[:, None] / safe)
    seen = values > SINGULAR * values.max(initial=0)
    root = np.sqrt(values[seen])
    inverse = (vectors[:, seen] / root).T / safe
    return np.asarray(safe[:, None] * vectors[:, seen] * root), np.asarray(inverse)


def pseudo_inverse(M: Doubles) -> Doubles:
    """Of a positive semidefinite matrix, whatever the sizes of its unknowns."""
    _, inverse = _roots(M)
    return np.asarray(inverse.T @ inverse)
