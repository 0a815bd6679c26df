"""How far the noise of the basis may have moved the answer: error bars from half differences.

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
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise.directions import (
    Room,
    answer_to,
    moving,
    rooms,
)
from lightpaint.lighting.analysis.noise.noise import (
    SINGULAR,
    Noise,
    lacking_gradient,
    noise_sums,
    pseudo_inverse,
    without_noise,
)
from lightpaint.lighting.analysis.noise.outliers import doubt, weakest
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import again
from lightpaint.screen import shortly

#: Standard errors on either side of a 95 % interval, and the part of all cases that is outside.
SIDES, OUTSIDE = 1.96, 0.05

NORMAL = NormalDist()

#: Standard deviations beyond a bound from which on a normal tail is taken for an exponential one.
FAR = 30.0

#: Part of what the prediction's own noise should miss of any other picture: who misses less was
#: given a sum of the basis itself, whose noise is the same and cancels.
SAME_NOISE = 1e-4

#: Steps in which it is decided how much of the noise to take out of M.
SHARES = 8


@keywords()
@dataclass(frozen=True)
class Uncertainty:
    """What noise does to a solve. All are estimates themselves, good to a third or so.

    Of a channel of a light that reaches nothing that counts nothing is known: NaN.

    Attributes:
        weights: (n, 3), as solved.
        scatter: (n, 3), standard deviation of the weights from one seed to another. Of a light that
            is off or at a limit, what is left of it on the side where it may go (see `_one_sided`).
        bias: (n, 3), how much higher the weights would be without the noise power in M.
        interval: The 95 % interval of each weight, lower and upper ends, (n, 3) each. Of what is
            off or at a limit it has one side, which is never empty.
        objective_error: (3,), standard deviation of the objective.
        objective_noise: (3,), what the prediction's own noise adds to it.
        excess: (3,), by how much the objective of these weights, were they rendered without noise,
            may be expected to exceed the least possible.
        target_norm2: (3,), ‖Ψ‖², to hold it against.
        untold: (n,), the lights that cannot be told at these samples: little but stray bright
            pixels is seen of them, and their interval is wider than they are bright.

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

    __repr__ = shortly

    @property
    def relative_excess(self) -> float:
        """What these errors miss of the painting, root mean square."""
        norm2 = float(self.target_norm2.sum())
        # An estimate, which is below zero where hardly anything is left to gain.
        return float(np.sqrt(max(self.excess.sum(), 0) / norm2)) if norm2 > 0 else 0.0

    @property
    def standard_error(self) -> Doubles:
        """Root mean square of scatter and bias, (n, 3): what the answer is off by."""
        return np.hypot(self.scatter, self.bias)


@keywords()
def error_bars(solution: Solution) -> Uncertainty | None:
    """Standard error and bias of every weight that a solve or `refine` found.

    None where nothing is known of the noise of the basis: that is not the same as none. After
    reweighting they are of the last linear problem.

    What is kept or locked has an error of 0; of what reaches nothing none is known. What is off or
    at a limit may have been pushed there by noise: it has an interval on one side (`_one_sided`).

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

    # How firmly lights are held, had there been no bias. A render of the mix shows all of an
    # earlier error, of which a step by the noisy M leaves a part; the unbiased answer, on which the
    # interval hangs, has the scatter of its own M.
    scatters = solved if problem.refinement is None else unbiased
    *sides, excess = _scatter(solution, noise, scatters, unbiased, weights + bias)
    doubts = doubt(solution, noise.power)
    if doubts.any():
        weak = weakest(solution, noise.power, doubts, corrected)
        # A step from a render of the mix is asked of M alone.
        if problem.refinement is not None:
            right = np.einsum("cij,jc->ci", weak, before) + step
        few = NormalEquations(weak, right, equations.target_norm2)
        far = answer_to(solution, few)
        *sides, _ = _scatter(solution, noise, few, few, far)
        sides = [np.hypot(side, far - weights - bias) for side in sides]
    by_channel = excess.reshape(3, -1).sum(axis=1)
    by_channel += np.einsum("ic,cij,jc->c", bias, equations.M, bias)
    told = np.where(solution.reached, 1, np.nan)
    interval = _interval(solution, bias * told, sides)
    return Uncertainty(
        weights,
        np.maximum(*sides) * told,
        bias * told,
        interval,
        noise.objective_error,
        noise.objective_noise,
        by_channel,
        solution.norm2,
        ((doubts >= 0.5) | noise.is_hidden).any(axis=1) & _is_wide(weights, interval),
    )


def _scatter(
    solution: Solution,
    noise: Noise,
    scatters: NormalEquations,
    unbiased: NormalEquations,
    at: Doubles,
) -> tuple[Doubles, Doubles, Doubles]:
    """Standard deviations below and above the weights, (n, 3) each, and the excess, (3 n,).

    scatters: the equations by which the noise of the gradient moves them. unbiased, at: those
    whose gradient there, (n, 3), says how firmly they are held.
    """
    problem = solution.problem
    gradient = problem.pulled(unbiased).gradient(at).T.ravel()
    asked, missed = problem.pulled(scatters), problem.equations.whole
    M, C = asked.whole, noise.whole.reshape(gradient.size, -1)
    below, above, excess = (np.zeros(gradient.size) for _ in range(3))
    for room in rooms(solution, asked):
        to, held = room.columns, room.held
        steps, covariance = _propagated(to.T @ M @ to, to.T @ C @ to, room, to.T @ gradient)
        excess += np.einsum("pq,qp->p", missed, to @ covariance @ to.T)
        both = ((room.emitted @ held.kept(covariance)) * room.emitted).sum(axis=1)
        own = room.emitted @ (held.own * steps)
        below += both + np.square(np.minimum(own, 0)).sum(axis=1)
        above += both + np.square(np.maximum(own, 0)).sum(axis=1)
    down, up = (np.sqrt(np.maximum(side, 0)).reshape(3, -1).T for side in (below, above))
    return down, up, excess


def _interval(solution: Solution, bias: Doubles, sides: list[Doubles]) -> tuple[Doubles, Doubles]:
    """Lower and upper ends, (n, 3) each, within what is allowed. sides: below and above."""
    weights = solution.weights
    low, high = solution.problem.about_answer.weight_ranges
    below, above = (SIDES * np.hypot(side, bias) for side in sides)
    return (
        np.minimum(np.maximum(weights - below, low), weights),
        np.maximum(np.minimum(weights + above, high), weights),
    )


def _is_wide(weights: Doubles, interval: tuple[Doubles, Doubles]) -> Bools:
    """(n,), whether a light may be more than its own luminance brighter or dimmer than it is."""
    known = np.isfinite(interval[0])
    solved, low, high = (np.where(known, x, 0) @ LUMINANCE for x in (weights, *interval))
    return np.asarray(np.maximum(solved - low, high - solved) > solved)


@keywords()
def correct_noise(solution: Solution, *, share: float | None = None) -> Solution:
    """The solution of the equations without that share of the noise power in M and b.

    Where blocks of pixels were fitted, most of the noise is averaged out already, and the solution
    stays as it is. Where squares stand for another loss, less is taken out until that says, too,
    that the step is a good one: far from the answer they say nothing.

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
    if solution.problem.block_side > 1:
        return solution
    noise = noise_sums(solution)
    e = solution.equations
    least = without_noise(e, noise.power)
    if share is None:
        share = _best_share(solution, noise, least)
    while True:
        corrected = NormalEquations(
            (1 - share) * e.M + share * least, e.b - share * noise.drawn, e.target_norm2
        )
        problem = replace(solution.problem, corrected=corrected, noise_removed=share)
        found = again(solution, problem)
        taken = NormalEquations(share * (e.M - least), share * noise.drawn, np.zeros(3))
        if problem.is_linear or share == 0 or _loss(found, taken) <= _loss(solution, taken):
            return found
        share = share / 2 if share > 1 / SHARES else 0.0


def _loss(solution: Solution, taken: NormalEquations) -> float:
    """Return what a solution misses and what pulls at it, less the noise that is taken out."""
    pull, weights = solution.problem.pull, solution.weights
    pulled = 0.0 if pull is None else float(pull.objective(weights).sum())
    # As of `NormalEquations.objective`, which knows of no squares below zero.
    noise = np.einsum("ic,cij,jc->", weights, taken.M, weights) - 2 * (taken.b.T * weights).sum()
    return sum(solution.certificate.objective) + pulled - float(noise)


def _best_share(solution: Solution, noise: Noise, least: Doubles) -> float:
    """The share s that makes the expected excess of the objective least, in steps of SHARES.

    What is left of the bias costs (1 − s)² δᵀMδ, and the scatter costs tr(M Cov(w)), which
    grows as M_s = M − s N becomes smaller. None of it where the target is made of this basis, as
    a template is. least: M without all noise.
    """
    e, n = solution.equations, len(solution.weights)
    if e.objective(solution.weights).sum() < SAME_NOISE * noise.objective_noise.sum():
        return 0.0
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
    return replace(solution, lighting=lighting).told(objective_error=error)


def _propagated(M: Doubles, C: Doubles, room: Room, gradient: Doubles) -> tuple[Doubles, Doubles]:
    """How far what holds may be left, (h,), and the covariance of all unknowns, (k, k).

    M: (k, k); C: (k, k), covariance of the noise of the gradient, (k,). Cov(x) = M⁻¹ C M⁻¹ over
    what is free, and over what noise alone may hold.
    """
    free = room.free
    # Left, with what is free making the best of it.
    ways = room.held.ways - free @ (
        pseudo_inverse(free.T @ M @ free) @ (free.T @ M @ room.held.ways)
    )
    stiffness, alone = (((M @ w) * w).sum(axis=0) for w in (ways, room.held.ways))
    # The others do all that some could do.
    counts = stiffness > SINGULAR * alone
    safe = np.where(counts, stiffness, 1)
    pushed = np.where(counts, np.maximum(ways.T @ gradient, 0), 0) / safe
    noise = np.maximum(((C @ ways) * ways).sum(axis=0), 0)
    spread = np.where(counts, np.sqrt(noise), 0) / safe
    ends = [_one_sided(u, s) for u, s in zip(pushed.tolist(), spread.tolist(), strict=True)]
    free = np.hstack([free, ways[:, pushed < SIDES * spread]])
    inverse = free @ pseudo_inverse(free.T @ M @ free) @ free.T
    return np.minimum(ends, room.held.room) / SIDES, inverse @ C @ inverse


def _one_sided(pushed: float, spread: float) -> float:
    """End of the 95 % interval of something that is at a bound, from there on.

    Were it free it would be beyond the bound by `pushed`, u, with the standard deviation s of
    `spread`. Of what is known not to be beyond, the end is U with

        P(X > U) = 0.05 P(X > 0),   X ~ N(-u, s²),

    which is 1.96 s at u = 0, about 3 s²/u far beyond, and never 0: whatever the true value is, it
    is below U in 95 % of all cases or more.
    """
    if spread <= 0:
        return 0.0
    u = pushed / spread
    if u > FAR:
        # The tail of a normal distribution is nearly exp(-u t - t²/2) there.
        return spread * (math.hypot(u, math.sqrt(-2 * math.log(OUTSIDE))) - u)
    beyond = math.erfc(u / math.sqrt(2)) / 2
    return spread * (-NORMAL.inv_cdf(OUTSIDE * beyond) - u)


def _with_errors(light: LightSetting, error: Doubles, interval: Doubles) -> LightSetting:
    """A light with its standard error, (3,), and its interval, (3, 2); NaN where nothing tells."""
    r, g, b = (None if np.isnan(e) else float(e) for e in error)
    ends = ((float(low), float(high)) for low, high in interval)
    red, green, blue = (None if np.isnan(low) else (low, high) for low, high in ends)
    return replace(light, standard_error=(r, g, b), interval=(red, green, blue))
