"""Error bars: the effect of the basis's noise on the answer, from half differences.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise, and the inverse
of M turns that into the covariance of the weights (docs/method.md, "How sure").
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Bools, Doubles, as_rgb
from lightpaint.colour.color import LUMINANCE
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise.directions import (
    BlockFreedom,
    block_freedoms,
    solve_for,
)
from lightpaint.lighting.analysis.noise.noise import (
    NULL_EIGENVALUE,
    Noise,
    denoised_matrix,
    gradient_bias,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.outliers import noise_doubts, weakest_matrix
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.screen import short_repr

#: Standard errors on either side of a 95 % interval, and the share of all cases outside.
NORMAL_95, OUTSIDE_SHARE = 1.96, 0.05

NORMAL = NormalDist()

#: Standard deviations beyond a bound from which a normal tail is approximated by an exponential.
FAR_DEVIATIONS = 30.0


@keywords()
@dataclass(frozen=True)
class Uncertainty:
    """The effect of noise on a solve. All values are estimates, good to a third or so.

    A channel in which a light reaches nothing that counts is undetermined: NaN.

    Attributes:
        weights: (n, 3), as solved.
        scatter: (n, 3), standard deviation of the weights between seeds. For a light that is off
            or at a limit, the part on the side where it may go (see `_one_sided`).
        bias: (n, 3), the rise of the weights without the noise power in M.
        interval: The 95 % interval of each weight, lower and upper ends, (n, 3) each. At 0 or at a
            limit it has one side, which is never empty.
        objective_error: (3,), standard deviation of the objective.
        objective_noise: (3,), the part of the prediction's own noise in it.
        excess: (3,), the expected excess of the objective over the least possible, for these
            weights rendered without noise.
        target_norm2: (3,), ‖Ψ‖², as a scale.
        untold: (n,), the lights that these samples do not determine: their pictures are little
            but stray bright pixels, and their interval is wider than they are bright.

    Examples:
        >>> bars = lp.error_bars(lp.solve(basis, target))
        >>> low, high = bars.interval
        >>> bool((low <= bars.weights).all() and (bars.weights <= high).all())
        True
    """

    weights: Doubles
    scatter: Doubles
    bias: Doubles
    interval: tuple[Doubles, Doubles]
    objective_error: Doubles
    objective_noise: Doubles
    excess: Doubles
    target_norm2: Doubles
    untold: Bools

    __repr__ = short_repr

    @property
    def relative_excess(self) -> float:
        """The error that these errors make in the picture, relative to the painting, root mean
        square.
        """
        norm2 = float(self.target_norm2.sum())
        # An estimate, which may be below zero where hardly any gain remains.
        return float(np.sqrt(max(self.excess.sum(), 0) / norm2)) if norm2 > 0 else 0.0

    @property
    def standard_error(self) -> Doubles:
        """Root mean square of scatter and bias, (n, 3): the error of the answer."""
        return np.hypot(self.scatter, self.bias)


@keywords()
def error_bars(solution: Solution) -> Uncertainty | None:
    """Estimate standard error and bias of every weight of a solve or `refine`.

    None if the noise of the basis is unknown, which is not the same as none. After reweighting they
    are of the last linear problem.

    Kept or locked lights have an error of 0; that of lights which reach nothing is unknown. Noise
    may
    have pushed a weight to 0 or to a limit: it has an interval on one side (`_one_sided`).

    Args:
        solution: From `solve`, `refine` or `correct_noise`.

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
    corrected = denoised_matrix(equations, noise.power)
    before, lacking = gradient_bias(solution, noise)
    step = solved.b - np.einsum("cij,jc->ci", solved.M, before) + lacking
    right = np.einsum("cij,jc->ci", corrected, before) + step
    unbiased = NormalEquations(corrected, right, equations.target_norm2)
    bias = np.asarray(solve_for(solution, unbiased) - weights)

    # Curvature without bias. A render of the mix shows all of an earlier error, of which a step by
    # the noisy M leaves a part; the unbiased answer, which determines the interval, has the scatter
    # of its own M.
    scatters = solved if problem.refinement is None else unbiased
    *sides, excess = _scatter(solution, noise, scatters, unbiased, weights + bias)
    doubts = noise_doubts(solution, noise.power)
    if doubts.any():
        weak = weakest_matrix(solution, noise.power, doubts, corrected)
        # A step from a render of the mix depends on M alone.
        if problem.refinement is not None:
            right = np.einsum("cij,jc->ci", weak, before) + step
        weak_equations = NormalEquations(weak, right, equations.target_norm2)
        far = solve_for(solution, weak_equations)
        *sides, _ = _scatter(solution, noise, weak_equations, weak_equations, far)
        sides = [np.hypot(side, far - weights - bias) for side in sides]
    by_channel = excess.reshape(3, -1).sum(axis=1)
    by_channel += np.einsum("ic,cij,jc->c", bias, equations.M, bias)
    is_determined = np.where(solution.reached, 1, np.nan)
    interval = _interval(solution, bias * is_determined, sides)
    return Uncertainty(
        weights,
        np.maximum(*sides) * is_determined,
        bias * is_determined,
        interval,
        noise.objective_error,
        noise.objective_noise,
        by_channel,
        solution.norm2,
        ((doubts >= 0.5) | noise.is_hidden).any(axis=1) & _is_wide(weights, interval),
    )


def gradient_response(solution: Solution) -> Doubles:
    """Return how noise of the gradient moves the weights, (3 n, 3 n): channel by channel.

    It is the matrix whose product with the covariance of the gradient on both sides makes the
    scatter of `error_bars`, but for bounds that hold.
    """
    noise = noise_sums(solution)
    pulled = solution.problem.with_pull(solution.problem.solved)
    gradient = pulled.gradient(solution.weights).T.ravel()
    M, C = pulled.full_matrix, noise.full_covariance.reshape(gradient.size, -1)
    made = np.zeros_like(M)
    for room in block_freedoms(solution, pulled):
        to = room.columns
        _, free = _movable(to.T @ M @ to, to.T @ C @ to, room, to.T @ gradient)
        along = to @ free
        made += along @ pseudo_inverse(along.T @ M @ along) @ along.T
    return made


def _scatter(
    solution: Solution,
    noise: Noise,
    scatters: NormalEquations,
    unbiased: NormalEquations,
    weights: Doubles,
) -> tuple[Doubles, Doubles, Doubles]:
    """Return standard deviations below and above the weights, (n, 3) each, and the excess, (3 n,).

    scatters: the equations by which the noise of the gradient moves the weights. unbiased,
    weights: the equations and weights, (n, 3), whose gradient tells how firmly bounds hold.
    """
    problem = solution.problem
    gradient = problem.with_pull(unbiased).gradient(weights).T.ravel()
    pulled, missed = problem.with_pull(scatters), problem.equations.full_matrix
    M, C = pulled.full_matrix, noise.full_covariance.reshape(gradient.size, -1)
    below, above, excess = (np.zeros(gradient.size) for _ in range(3))
    for room in block_freedoms(solution, pulled):
        columns, active = room.columns, room.active
        steps, covariance = _propagate(
            columns.T @ M @ columns, columns.T @ C @ columns, room, columns.T @ gradient
        )
        excess += np.einsum("pq,qp->p", missed, columns @ covariance @ columns.T)
        variance = ((room.emitted @ active.constrained(covariance)) * room.emitted).sum(axis=1)
        own_steps = room.emitted @ (active.own_exits * steps)
        below += variance + np.square(np.minimum(own_steps, 0)).sum(axis=1)
        above += variance + np.square(np.maximum(own_steps, 0)).sum(axis=1)
    down, up = (np.sqrt(np.maximum(side, 0)).reshape(3, -1).T for side in (below, above))
    return down, up, excess


def _interval(solution: Solution, bias: Doubles, sides: list[Doubles]) -> tuple[Doubles, Doubles]:
    """Return lower and upper ends, (n, 3) each, within the constraints. sides: below and above."""
    weights = solution.weights
    low, high = solution.problem.local_reduction.weight_ranges
    below, above = (NORMAL_95 * np.hypot(side, bias) for side in sides)
    return (
        np.minimum(np.maximum(weights - below, low), weights),
        np.maximum(np.minimum(weights + above, high), weights),
    )


def _is_wide(weights: Doubles, interval: tuple[Doubles, Doubles]) -> Bools:
    """Return, (n,), whether the interval of a light's luminance reaches farther than the luminance
    itself.
    """
    is_known = np.isfinite(interval[0])
    solved, low, high = (np.where(is_known, x, 0) @ LUMINANCE for x in (weights, *interval))
    return np.asarray(np.maximum(solved - low, high - solved) > solved)


def with_error_bars(solution: Solution, uncertainty: Uncertainty | None) -> Solution:
    """Return `solution` with the standard errors of lights and objective, if known."""
    if uncertainty is None:
        return solution
    ends = np.stack(uncertainty.interval, axis=-1)
    lights = tuple(
        light
        if light.is_fixed or not any(light.reached)
        else replace(_with_errors(light, error, interval), untold=bool(untold))
        for light, error, interval, untold in zip(
            solution.lighting.lights,
            uncertainty.standard_error,
            ends,
            uncertainty.untold,
            strict=True,
        )
    )
    lighting = replace(solution.lighting, lights=lights)
    error = as_rgb(uncertainty.objective_error)
    return replace(solution, lighting=lighting).with_certificate_fields(objective_error=error)


def _propagate(
    M: Doubles, C: Doubles, room: BlockFreedom, gradient: Doubles
) -> tuple[Doubles, Doubles]:
    """Return how far the active bounds may be left, (h,), and the covariance of all unknowns, (k,
    k).

    M: (k, k); C: (k, k), covariance of the noise of the gradient, (k,). Cov(x) = M⁻¹ C M⁻¹ over
    the directions of `_movable`.
    """
    ends, free = _movable(M, C, room, gradient)
    inverse = free @ pseudo_inverse(free.T @ M @ free) @ free.T
    return ends, inverse @ C @ inverse


def _movable(
    M: Doubles, C: Doubles, room: BlockFreedom, gradient: Doubles
) -> tuple[Doubles, Doubles]:
    """Return how far the active bounds may be left, (h,), and what noise may move, (k, m).

    These are the free directions, and those of bounds that noise alone may have activated.
    Arguments: as of `_propagate`.
    """
    free = room.free
    # Directions that leave a bound while the free unknowns adapt.
    ways = room.active.exits - free @ (
        pseudo_inverse(free.T @ M @ free) @ (free.T @ M @ room.active.exits)
    )
    stiffness, alone = (((M @ w) * w).sum(axis=0) for w in (ways, room.active.exits))
    # Other lights can replace those without stiffness.
    counts = stiffness > NULL_EIGENVALUE * alone
    safe = np.where(counts, stiffness, 1)
    pushed = np.where(counts, np.maximum(ways.T @ gradient, 0), 0) / safe
    noise = np.maximum(((C @ ways) * ways).sum(axis=0), 0)
    spread = np.where(counts, np.sqrt(noise), 0) / safe
    ends = [_one_sided(u, s) for u, s in zip(pushed.tolist(), spread.tolist(), strict=True)]
    free = np.hstack([free, ways[:, pushed < NORMAL_95 * spread]])
    return np.minimum(ends, room.active.distances) / NORMAL_95, free


def _one_sided(pushed: float, spread: float) -> float:
    """Return the end of the 95 % interval of a value at a bound, from there on.

    Without the bound it would be beyond it by `pushed`, u, with the standard deviation s of
    `spread`. Since it cannot be beyond, the end is U with

        P(X > U) = 0.05 P(X > 0),   X ~ N(-u, s²),

    which is 1.96 s at u = 0, about 3 s²/u far beyond, and never 0: whatever the true value is, it
    is below U in 95 % of all cases or more.
    """
    if spread <= 0:
        return 0.0
    u = pushed / spread
    if u > FAR_DEVIATIONS:
        # The tail of a normal distribution is nearly exp(-u t - t²/2) there.
        return spread * (math.hypot(u, math.sqrt(-2 * math.log(OUTSIDE_SHARE))) - u)
    beyond = math.erfc(u / math.sqrt(2)) / 2
    return spread * (-NORMAL.inv_cdf(OUTSIDE_SHARE * beyond) - u)


def _with_errors(light: LightSetting, error: Doubles, interval: Doubles) -> LightSetting:
    """Return a light with its standard error, (3,), and its interval, (3, 2); NaN if
    undetermined."""
    r, g, b = (None if np.isnan(e) else float(e) for e in error)
    ends = ((float(low), float(high)) for low, high in interval)
    red, green, blue = (None if np.isnan(low) else (low, high) for low, high in ends)
    return replace(light, standard_error=(r, g, b), interval=(red, green, blue))
