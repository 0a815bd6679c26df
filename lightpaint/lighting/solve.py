"""From basis and painting to lighting."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis.basis import Basis
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduced_problem import (
    ReducedOptimum,
    solve_reduced,
)
from lightpaint.lighting.constraints.white_neighbours import next_whites
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.linear_solve import Answer, answer_of, solve_linear, solve_reduction
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Squares, image_of
from lightpaint.lighting.loss.pixel_bins import BinnedPixels, binned_pixels, block_side
from lightpaint.lighting.loss.reweighting import Asked, Descent, descend, value_of
from lightpaint.lighting.loss.warm_start import near_optimum
from lightpaint.lighting.loss.weight_penalty import dimming_of, to_present
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.target.target import Target

#: Times that lights go on to other whites, of a loss that is no linear problem, at most, and the
#: part of it that this has to gain.
WHITES_TRIED, WORTH = 20, 1e-7


@keywords(Fit)
def solve(
    basis: Basis | Sequence[Basis],
    target: Target | Sequence[Target],
    *,
    constraints: Constraints | None = None,
    start: Lighting | None = None,
    resize: bool = False,
    **fit: Any,
) -> Solution:
    """Find the non-negative light colours whose image comes closest to `target`.

    Lights that are kept have weight 1; the others make up what they leave of the target.

    Args:
        basis: Of one view; or of several, for the one lighting that comes closest to all: a pixel
            counts the same in whichever view it is, and `views` of the solution has the answer to
            each.
        target: Of one view; or of several, in the same order.
        constraints: What else is asked of the lights; it goes before what the lights file of the
            scene asks, which a basis that was rendered here knows.
        start: Lighting to begin with (the present one by default): a good guess saves sweeps, the
            answer is the same, but for what no painted pixel tells: lights that reach none keep the
            start.
        resize: Whether a target of another size than the basis, of the same shape, is resampled.
        **fit: Any of `Fit`, by name: `unpainted=0.1` also holds what is not painted to the current
            look, `transform=lp.ViewTransform("agx")` comes closest in what that shows instead of in
            linear light.

    Returns:
        The lighting, the problem it solves, and the certificate.

    Raises:
        SizeError: If basis and target differ in size, and not in whole blocks of pixels.
        KeywordError: For a name that neither this nor `Fit` has.
        TargetError: If nothing counts.
        ConstraintError: If a constraint does not fit the lights.
        BasisError: If views differ in lights.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> np.round(solution.lighting.emission["panel"], 3).tolist()
        [2.0, 1.5, 1.0]
        >>> solution
        Solution(closest there is (KKT residual ...)...)
    """
    how = Fit(**fit)
    problem = Problem.of(basis, target, constraints=constraints, fit=how, resize=resize)
    begin = problem.start if start is None else start.weights_for(problem.basis)
    return solution_of(replace(problem, start=begin))


def solution_of(problem: Problem, *, start: Doubles | None = None) -> Solution:
    """The solution of a problem. start: (n, 3), where to begin, its own start by default.

    Where its loss is no linear problem, one that stands for it is found first. Lamps that keep
    their colour and come out dim are drawn to it the more, and all is solved once again.
    """
    begin = problem.start if start is None else start
    blocks = _blocks_of(problem)
    solution = _solved_once(problem, begin, blocks)
    if not problem.keeps_color.any() or problem.fit.colors != "gentle":
        return solution
    dimming = dimming_of(problem.basis.present_weights, solution.weights)
    if problem.dimming is not None or (dimming[problem.keeps_color] == 1).all():
        return solution
    drawn = replace(solution.problem, dimming=dimming)
    if problem.is_linear:
        nearer = _one(drawn, solution.weights)
    else:
        nearer = _descended(drawn, solution.weights, solution.reached, blocks, is_near=True)
    before = solution.certificate
    told = nearer.told(curve=before.curve, rounds=before.rounds + nearer.certificate.rounds)
    return replace(told, tried=solution.tried)


def _blocks_of(problem: Problem) -> BinnedPixels | None:
    """Return the blocks of pixels that are fitted; None where single pixels are."""
    if problem.is_linear:
        return None
    side = block_side(problem.views.bases, problem.loss.transform)
    return binned_pixels(problem.views, problem.loss, side) if side > 1 else None


def _solved_once(problem: Problem, begin: Doubles, blocks: BinnedPixels | None) -> Solution:
    """Return the solution of a problem with the pull that it has.

    begin: (n, 3). blocks: as of `_blocks_of`.
    """
    if problem.is_linear:
        return _linear(problem, begin)
    # The painting is first taken at its word, which also tells what lights reach.
    every = replace(problem, constraints=_of_all(problem.constraints))
    first = _linear(replace(every, loss=problem.squares), begin)
    reached = first.reached
    every = every.reduced(first.problem.reduction)
    solution = _descended(every, first.weights, reached, blocks)
    if problem.constraints.sparse is not None:
        # The lights are chosen where all of them would lead.
        chosen = _linear(
            replace(solution.problem, constraints=problem.constraints), solution.weights
        )
        its = chosen.problem
        held = replace(problem, reduction=its.reduction, full=its.full)
        reached = chosen.reached
        solution = replace(_descended(held, chosen.weights, reached, blocks), tried=chosen.tried)
        first = chosen
    return solution.told(curve=first.certificate.curve)


def again(solution: Solution, problem: Problem) -> Solution:
    """The solution of `problem`, which differs from that of `solution` in what is solved.

    After reweighting it is one more step of the last linear problem, in which lights may reach
    less than they do, and which says nothing of other lights than those that were chosen.
    """
    if problem.is_linear:
        return _linear(replace(problem, reduction=problem.full), solution.weights)
    assert solution.reweighting is not None
    step = _one(problem, solution.weights, solution.reached)
    before, reweighting = solution.certificate, solution.reweighting
    converged = step.certificate.converged and reweighting.converged
    kept = {name: getattr(before, name) for name in ("curve", "rounds")}
    told = step.told(converged=converged, **kept)
    return replace(told, tried=solution.tried, reweighting=reweighting)


def _linear(problem: Problem, start: Doubles) -> Solution:
    """The solution of the squares. With `sparse`, of the best lights in it."""
    return _solution(solve_linear(problem, start))


def _one(problem: Problem, start: Doubles, reached: Bools | None = None) -> Solution:
    """The solution of the squares as the reduction has the lights. reached: as of `answer_of`."""
    return _solution(solve_reduction(problem, start, reached))


def _solution(answer: Answer[Problem]) -> Solution:
    return Solution(answer.problem, answer.lighting, answer.tried)


def _descended(
    problem: Problem,
    start: Doubles,
    reached: Bools,
    blocks: BinnedPixels | None,
    *,
    is_near: bool = False,
) -> Solution:
    """Descend from weights (n, 3) within what is asked to the least of the loss.

    reached: as of `answer_of`. blocks: as of `_blocks_of`. is_near: whether the start is near the
    least. Which whites are mixed by lights that keep to a range of them, and which lights are kept
    within their gamuts, stays as the reduction has it while the loss falls, and is decided anew
    where it is least.
    """
    solution = _descended_between(problem, start, reached, blocks, is_near=is_near)
    if not (problem.reduction.white_knobs or problem.reduction.gamut_knobs):
        return solution
    count, value = solution.certificate.rounds, _missed(solution)
    for _ in range(WHITES_TRIED):
        at = solution.problem
        equations = at.pulled(at.solved)
        reduction, optimum = next_whites(equations, at.reduction, solution.weights)
        if all(a is b for a, b in zip(reduction.knobs, at.reduction.knobs, strict=True)):
            break
        is_confined = reduction.gamut_knobs != at.reduction.gamut_knobs
        at = at.reduced(reduction)
        nearer = _descended_between(at, optimum.weights, reached, blocks, is_near=True)
        count, missed = count + nearer.certificate.rounds, _missed(nearer)
        # What left its gamut may not, whatever that costs.
        if not is_confined and missed > value * (1 - WORTH):
            break
        solution, value = nearer, missed
    return solution.told(rounds=count)


def _missed(solution: Solution) -> float:
    """The loss, and what pulls at the weights."""
    problem, w = solution.problem, solution.weights
    pull = 0.0 if problem.pull is None else float(problem.pull.objective(w).sum())
    return float(problem.objective(w).sum()) + pull


def _descended_between(
    problem: Problem,
    start: Doubles,
    reached: Bools,
    blocks: BinnedPixels | None,
    *,
    is_near: bool = False,
) -> Solution:
    """Descend to the least of the loss over what the reduction is. Others as of `_descended`."""
    basis, loss, pull, equations = problem.basis, problem.loss, problem.pull, problem.equations
    if blocks is not None:
        basis, loss, equations = blocks.basis, blocks.loss, blocks.equations
        pull = blocks.prior if pull is None else pull + blocks.prior

    def best_of(equations: NormalEquations, begin: Doubles) -> ReducedOptimum:
        asked = equations if pull is None else equations + pull
        return solve_reduced(asked, problem.reduction, begin, method=problem.fit.method)

    def weights_of(equations: NormalEquations, begin: Doubles) -> Doubles:
        return best_of(equations, begin).weights

    def led_from(begin: Doubles) -> Descent:
        near = None
        if not is_near:
            near = near_optimum(basis, loss, equations, begin, weights_of, pull=pull)
        begin, from_clipping = (begin, not is_near) if near is None else (near, False)
        return descend(basis, loss, begin, weights_of, pull=pull, from_clipping=from_clipping)

    found = led_from(start)
    present, lit = nearest_to_present(problem), LitPixels.of(basis, loss)

    def missed(weights: Doubles) -> float:
        return value_of(lit.pixels, Asked(pull), weights, lit.predicted(weights))

    if missed(found.weights) > missed(present):
        # Another valley: from the present every step leads downhill.
        found = led_from(present)
    optimum = best_of(found.equations, found.reweighting.at)
    if blocks is not None:
        solved = _of_blocks(problem, found, blocks)
    else:
        solved = replace(problem, squares=found.squares, equations=found.equations)
    equations = solved.pulled(solved.solved)
    solution = _solution(answer_of(solved, optimum, found.weights, equations, reached))
    converged = optimum.converged and found.reweighting.converged
    told = solution.told(converged=converged, rounds=1 + found.reweighting.rounds)
    return replace(told, reweighting=found.reweighting)


def nearest_to_present(problem: Problem) -> Doubles:
    """The weights (n, 3) nearest to the present ones, of what is asked of the lights."""
    present = problem.basis.present_weights
    pull = to_present(problem.basis.power, present)
    return solve_reduced(pull, problem.reduction, present).weights


def _of_blocks(problem: Problem, found: Descent, blocks: BinnedPixels) -> Problem:
    """Return the problem of all pixels, with squares that stand for its loss where blocks led.

    What is solved are the equations of the blocks, and their prior: without most of the noise.
    """
    at, loss = found.reweighting.at, problem.loss
    x = LitPixels.whole(problem.basis, loss).predicted(at)
    image, weight = loss.pixels.squares(x, from_clipping=False)
    parts = (image, weight, loss.pixels.shares(x, weight))
    squares = Squares(*(image_of(part, problem.basis.size) for part in parts))
    return replace(
        problem,
        squares=squares,
        equations=NormalEquations.of(problem.basis, squares.image, squares.weight),
        corrected=found.equations + blocks.prior,
        noise_removed=1 - 1 / blocks.side**2,
        block_side=blocks.side,
    )


def _of_all(constraints: Constraints) -> Constraints:
    """Without the choice of a few lights."""
    return replace(constraints, sparse=None) if constraints.sparse is not None else constraints
