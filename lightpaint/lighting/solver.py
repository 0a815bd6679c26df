"""The solve: a problem becomes a lighting; or, of a shot, a lighting for each painted frame, tied
to its neighbours.

What a frame hardly shows is not determined by its painting: solved alone, such a light would jump
from key to key. So a weak term Σ_k Σ_i s ‖Φ_i‖² (w_{k+1,i} − w_{k,i})² joins the losses of all
frames. The whole is convex where the losses are; block by block, each frame is solved against its
neighbours, from the linear problem at its own answer, until the weights stay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, release_freed_memory
from lightpaint.colour import Lamp
from lightpaint.lighting.held_mixes import choose_held_mixes, with_mixes_at
from lightpaint.lighting.linear_solve import (
    LinearAnswer,
    at_better_slots,
    at_slots,
    nearest_allowed,
    solve_linear,
    solve_mixed,
    solve_squares,
)
from lightpaint.lighting.loss import lit_pixels
from lightpaint.lighting.loss.reweighting import (
    MANY_LIGHTS,
    MIN_STEP,
    Descent,
    WeightTerms,
    descend,
    find_near_optimum,
    interpolate,
    is_sampled,
    total_loss,
)
from lightpaint.lighting.loss.weight_penalty import is_spoilt_by_contrast, pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns import reduced_problem
from lightpaint.lighting.unknowns.lamp_parts import WholeLamps
from lightpaint.lighting.unknowns.reduction import Reduction, lamps_by_name
from lightpaint.lighting.unknowns.white_mixes import next_whites

#: Maximum number of steps of lights to other whites, for a loss that is not linear, and the share
#: of the loss that a step has to gain.
MAX_WHITE_STEPS, MIN_GAIN = 20, 1e-7

#: Maximum number of steps of lamps of one colour to other mixes of their emitters.
MAX_MIX_STEPS = 6

#: Change of a light's picture at which the first descents of many lights end, before they choose
#: their whites anew.
ROUGH_STEP = 1e-3

#: Strength of the tie between two neighbouring keys, relative to the loss of a painted picture. On
#: a shot of 24 frames (benchmarks/frames.py) it takes a third of the flicker out of four inexact
#: paintings; ten times as much doubles the error of pictures between two.
TIE = 1e-2

#: Largest number of rounds over all frames, and the change of a weight, relative to the largest, at
#: which they end.
MAX_ROUNDS, MAX_CHANGE = 100, 1e-6


def choose_mixes(solution: Solution) -> Solution:
    """Return a solution whose lamps have the mixes that they prefer.

    Of a basis with a picture for each emitter, lamps of one colour get those that they prefer at
    their brightness, to which all lights are solved again; others as in `choose_held_mixes`.
    """
    whole = WholeLamps.of(solution.problem.lights)
    if not whole.has_parts:
        return solution
    by_name = lamps_by_name(solution.problem.constraints, whole.lights)
    lamps = {
        parts: by_name[light.name]
        for light, parts in zip(whole.lights, whole.parts, strict=True)
        if light.name in by_name and light.lamp
    }
    return choose_held_mixes(_with_mixes_at_brightness(solution, lamps))


def _with_mixes_at_brightness(
    solution: Solution, lamps: Mapping[tuple[int, ...], Lamp]
) -> Solution:
    """Solve again until lamps of one colour have the mixes that they prefer at their brightness.

    lamps: by the lights that are their emitters.
    """
    first = solution.problem.reduction
    for _ in range(MAX_MIX_STEPS):
        nearer = with_mixes_at(solution.weights, solution.problem.reduction, lamps)
        if nearer is solution.problem.reduction:
            break
        solution = _solve_with(solution, nearer)
    reduction = solution.problem.reduction
    if reduction is first:
        return solution
    # The brightness may have moved since, and no emitter may be beyond full.
    within = with_mixes_at(solution.weights, reduction, lamps, within=True)
    return _solve_with(solution, within)


def _solve_with(solution: Solution, reduction: Reduction) -> Solution:
    """Solve again with another reduction of the same unknowns."""
    problem = replace(solution.problem, reduction=reduction, full=reduction)
    return solve_again(solution, problem)


def solution_of(problem: Problem, *, start: Doubles | None = None) -> Solution:
    """Solve a problem. start: (n, 3), where to begin, its own start by default.

    If its loss is not linear, rounds of linear problems lead to the optimum. Colour wheels come to
    the slots that are closest there, and the lights to the optimum with these. Contrasts that the
    lights cannot bring are given up where the current lights come closer to the painting.
    """
    begin = problem.start if start is None else start
    solution = _solve_whole(problem, begin)
    found = solution.problem

    def objective(weights: Doubles) -> float:
        return float(found.objective(weights).sum())

    if is_spoilt_by_contrast(found.contrast, solution.weights, found.reference, objective):
        solution = _solve_whole(replace(problem, contrast=None), begin)
    return solution


def _solve_whole(problem: Problem, begin: Doubles) -> Solution:
    """Solve a problem with all its terms from weights (n, 3)."""
    if problem.is_linear:
        return _solution(solve_squares(problem, begin))
    blocks = _blocks_of(problem)
    mixed, reached = _solve_rounds(problem, begin, blocks)

    def with_slots_of(found: Problem, weights: Doubles) -> Solution:
        at_slots = replace(problem, reduction=found.reduction, full=found.full)
        near = reduced_problem.nearest_weights(at_slots.reduction, weights)
        return _descend(at_slots, near, reached, blocks)

    solution = at_slots(mixed, with_slots_of)
    if solution is None:
        return mixed
    solution = at_better_slots(solution, with_slots_of, loss_with_pull)
    final, curve = solution.problem.with_final_slots(), mixed.certificate.curve
    solution = replace(solution, problem=final, tried=mixed.tried)
    return solution.with_certificate_fields(curve=curve)


def _solve_rounds(
    problem: Problem, begin: Doubles, blocks: lit_pixels.BinnedPixels | None
) -> tuple[Solution, Bools]:
    """Solve a loss that is not linear from weights (n, 3), with mixed slots of colour wheels.

    Also return, (n, 3), in which channels lights reach something.
    """
    # The literal squares come first; they also show what each light reaches.
    all_lights = replace(problem, constraints=replace(problem.constraints, sparse=None))
    first = _solution(solve_mixed(replace(all_lights, loss=problem.squares), begin))
    reached = first.reached
    all_lights = all_lights.with_whites(first.problem.reduction)
    if len(begin) >= MANY_LIGHTS:
        release_freed_memory()
    solution = _descend(all_lights, first.weights, reached, blocks)
    if problem.constraints.sparse is not None:
        # The lights are chosen at the optimum of all lights.
        sparse_problem = replace(solution.problem, constraints=problem.constraints)
        chosen = _solution(solve_mixed(sparse_problem, solution.weights))
        sparse = chosen.problem
        restricted = replace(problem, reduction=sparse.reduction, full=sparse.full)
        reached = chosen.reached
        solution = replace(
            _descend(restricted, chosen.weights, reached, blocks), tried=chosen.tried
        )
        first = chosen
    return solution.with_certificate_fields(curve=first.certificate.curve), reached


def _blocks_of(problem: Problem) -> lit_pixels.BinnedPixels | None:
    """Return the blocks of pixels to fit; None for single pixels."""
    side = lit_pixels.block_side(problem.views.bases, problem.loss.transform)
    return lit_pixels.bin_pixels(problem.views, problem.loss, side) if side > 1 else None


def solve_again(solution: Solution, problem: Problem) -> Solution:
    """Solve `problem`, which differs from the problem of `solution` only in its constraints or
    equations.

    After reweighting this is one more step of the last linear problem. Lights may reach less in it
    than in the loss, and it knows only the lights that were chosen.
    """
    if problem.is_linear:
        whole = replace(problem, reduction=problem.full)
        return _solution(solve_squares(whole, solution.weights))
    assert solution.reweighting is not None
    step = _solution(solve_linear(problem, solution.weights, solution.reached))
    certificate, reweighting = solution.certificate, solution.reweighting
    converged = step.certificate.converged and reweighting.converged
    history = {name: getattr(certificate, name) for name in ("curve", "rounds")}
    result = step.with_certificate_fields(converged=converged, **history)
    return replace(result, tried=solution.tried, reweighting=reweighting)


def solve_tethered(solution: Solution, problem: Problem) -> Solution:
    """Solve `problem`, which differs from the problem of `solution` only in its tether."""
    if not problem.is_linear:
        return solve_again(solution, problem)
    step = _solution(solve_linear(problem, solution.weights, solution.reached))
    return replace(step, tried=solution.tried)


def _solution(answer: LinearAnswer[Problem]) -> Solution:
    return Solution(answer.problem, answer.lighting, answer.tried)


def _descend(
    problem: Problem, start: Doubles, reached: Bools, blocks: lit_pixels.BinnedPixels | None
) -> Solution:
    """Descend from weights (n, 3) to the least loss under the constraints.

    reached: as in `solve_linear`. blocks: from `_blocks_of`. The two whites that lights mix, and
    the lights that are confined to their gamuts, stay the same while the loss falls, and are chosen
    anew at its minimum: of many lights at first near it.
    """
    until = ROUGH_STEP if len(start) >= MANY_LIGHTS else MIN_STEP
    if not problem.reduction.has_choices:
        until = MIN_STEP
    low = _least_loss(problem, start, blocks, is_near=False, until=until)
    count = 1 + low.descent.reweighting.rounds
    for _ in range(MAX_WHITE_STEPS if problem.reduction.has_choices else 0):
        reduction, optimum = next_whites(low.pulled, problem.reduction, low.descent.weights)
        is_same = all(a is b for a, b in zip(reduction.knobs, problem.reduction.knobs, strict=True))
        if is_same and until <= MIN_STEP:
            break
        if is_same:
            until = MIN_STEP
        is_confined = reduction.gamut_knobs != problem.reduction.gamut_knobs
        nearer_problem = problem.with_whites(reduction)
        nearer = _least_loss(nearer_problem, optimum.weights, blocks, is_near=True, until=until)
        count += 1 + nearer.descent.reweighting.rounds
        # A light that left its gamut has to return, whatever that costs.
        if not (is_confined or is_same) and nearer.loss > low.loss * (1 - MIN_GAIN):
            if until <= MIN_STEP:
                break
            until = MIN_STEP
        problem, low = nearer_problem, nearer
    return _solution_at(problem, low, reached, blocks).with_certificate_fields(rounds=count)


def loss_with_pull(solution: Solution) -> float:
    """Return the loss with the pull on the weights."""
    problem, w = solution.problem, solution.weights
    pull = 0.0 if problem.pull is None else float(problem.pull.objective(w).sum())
    return float(problem.objective(w).sum()) + pull


@dataclass(frozen=True)
class _LeastLoss:
    """The end of a descent under one reduction.

    optimum: of its last linear problem. loss: of its weights, with the pull. pulled: the equations
    of the squares at these weights, with the pull.
    """

    descent: Descent
    optimum: reduced_problem.ReducedOptimum
    loss: float
    pulled: NormalEquations


def _least_loss(
    problem: Problem,
    start: Doubles,
    blocks: lit_pixels.BinnedPixels | None,
    *,
    is_near: bool,
    until: float,
) -> _LeastLoss:
    """Descend to the least loss over the current reduction.

    The descent begins at `start`, or at the current weights where these lead lower. is_near:
    whether the start is near the least. until: see `run_rounds`.
    """
    basis, loss, pull = problem.basis, problem.loss, problem.pull
    if blocks is not None:
        basis, loss = blocks.basis, blocks.loss
        pull = blocks.prior if pull is None else pull + blocks.prior
    solver = reduced_problem.ReducedSolver(problem.reduction, pull=pull, method=problem.fit.method)

    def weights_of(equations: NormalEquations, begin: Doubles) -> Doubles:
        return solver.solve(equations, begin).weights

    def descend_from(begin: Doubles) -> Descent:
        near_optimum = None
        if not is_near and is_sampled(loss, len(begin)):
            equations = problem.equations if blocks is None else blocks.equations
            near_optimum = find_near_optimum(basis, loss, equations, begin, weights_of, pull=pull)
        begin, from_clipping = (
            (begin, not is_near) if near_optimum is None else (near_optimum, False)
        )
        return descend(
            basis,
            loss,
            begin,
            weights_of,
            pull=pull,
            from_clipping=from_clipping,
            until=until,
            known=(problem.squares, problem.equations) if loss.pixels.has_pieces else None,
        )

    descent = descend_from(start)
    lit = lit_pixels.LitPixels.of(basis, loss)

    def loss_at(weights: Doubles) -> float:
        return total_loss(lit.pixels, WeightTerms(pull), weights, lit.predicted(weights))

    current, reached_loss = _from_current(problem, descent.weights), loss_at(descent.weights)
    if reached_loss > loss_at(current):
        # A worse valley: from the current lighting every step leads downhill.
        descent = descend_from(current)
        reached_loss = loss_at(descent.weights)
    optimum = solver.solve(descent.equations, descent.reweighting.at)
    if len(start) >= MANY_LIGHTS:
        release_freed_memory()
    pulled = descent.equations if pull is None else descent.equations + pull
    return _LeastLoss(descent, optimum, reached_loss, pulled)


def _solution_at(
    problem: Problem, low: _LeastLoss, reached: Bools, blocks: lit_pixels.BinnedPixels | None
) -> Solution:
    """Return the solution at the end of a descent. reached: as in `solve_linear`."""
    descent, optimum = low.descent, low.optimum
    if blocks is not None:
        solved = _problem_of_blocks(problem, descent, blocks)
    else:
        solved = replace(problem, squares=descent.squares, equations=descent.equations)
    equations = solved.with_pull(solved.solved)
    answer = LinearAnswer(solved, optimum, equations, descent.weights, reached)
    solution = _solution(answer)
    converged = optimum.converged and descent.reweighting.converged
    result = solution.with_certificate_fields(converged=converged)
    return replace(result, reweighting=descent.reweighting)


def _from_current(problem: Problem, found: Doubles) -> Doubles:
    """Return weights (n, 3) near the current ones that constraints allow: under requirements the
    first that meet them on the way to an answer.
    """
    requirements = problem.reduction.requirements
    if requirements is None:
        return nearest_to_current(problem)
    begin = reduced_problem.nearest_weights(problem.reduction, problem.reference)
    rows, least = problem.reduction.required
    at_begin, at_end = (
        rows @ reduced_problem.nearest_unknowns(problem.reduction, w, np.ones(len(w), bool)) - least
        for w in (begin, found)
    )
    missed = (at_begin < 0) & (at_end > at_begin)
    parts = at_begin[missed] / (at_begin[missed] - at_end[missed])
    return interpolate(begin, found, float(min(1.0, parts.max(initial=0))))


def nearest_to_current(problem: Problem) -> Doubles:
    """Return the weights (n, 3) nearest to those to start from that constraints allow."""
    current, reduction = problem.reference, problem.reduction
    if len(current) >= MANY_LIGHTS:
        nearest = reduced_problem.nearest_weights(reduction, current)
        if np.allclose(nearest, current, rtol=1e-9, atol=0):
            return nearest
    return nearest_allowed(problem.basis.power, reduction, current)


def _problem_of_blocks(
    problem: Problem, descent: Descent, blocks: lit_pixels.BinnedPixels
) -> Problem:
    """Return the problem of all pixels, with squares that stand for its loss at the answer of
    blocks.

    Its corrected equations are the equations of the blocks with their prior: without most of the
    noise.
    """
    weights, lit = descent.reweighting.at, lit_pixels.LitPixels.whole(problem.basis, problem.loss)
    return replace(
        problem,
        squares=lit_pixels.DeferredSquares(lit, weights),
        equations=lit.equations_at(weights),
        corrected=descent.equations + blocks.prior,
        noise_removed=1 - 1 / blocks.side**2,
        block_side=blocks.side,
    )


def tie_frames(
    solutions: Sequence[Solution], frames: Sequence[int], *, tie: float = TIE
) -> list[Solution]:
    """Return the solution of each painted frame, in order, tied to its neighbours.

    solutions: of each frame by itself. frames: their numbers.
    """
    solutions = list(solutions)
    if len(solutions) == 1 or tie == 0:
        return solutions
    strengths = _strengths(solutions, frames, tie)
    for _ in range(MAX_ROUNDS):
        change = 0.0
        for k, solution in enumerate(solutions):
            tether = _tether(solutions, strengths, k)
            tied = solve_tethered(solution, replace(solution.problem, tether=tether))
            step = np.abs(tied.weights - solution.weights).max(initial=0)
            change = max(change, float(step) / max(float(tied.weights.max(initial=0)), 1e-12))
            solutions[k] = tied
        if change <= MAX_CHANGE:
            break
    reached = np.any([solution.reached for solution in solutions], axis=0)
    return [_with_reached(solution, reached) for solution in solutions]


def _with_reached(solution: Solution, reached: Bools) -> Solution:
    """Return a solution whose lights are determined, in the channels (n, 3), by some frame."""
    lights = tuple(
        replace(light, reached=(bool(r), bool(g), bool(b)))
        for light, (r, g, b) in zip(solution.lighting.lights, reached, strict=True)
    )
    names = tuple(light.name for light in lights if not any(light.reached))
    solution = solution.with_certificate_fields(unreached=names)
    return replace(solution, lighting=replace(solution.lighting, lights=lights))


def _strengths(solutions: Sequence[Solution], frames: Sequence[int], tie: float) -> list[Doubles]:
    """Return the strength (n, 3) of the tie between each two neighbours.

    It is in the scale of the losses, and weaker over longer times.
    """
    spans = np.diff(frames).astype(np.float64)
    strengths = []
    for k, span in enumerate(spans):
        pair = [solution.problem for solution in solutions[k : k + 2]]
        scale = np.mean([x.fit.brightness * x.painted_share for x in pair])
        power = np.mean([x.power for x in pair], axis=0)
        strengths.append(np.asarray(tie * scale * power * spans.mean() / span))
    return strengths


def _tether(solutions: Sequence[Solution], strengths: Sequence[Doubles], k: int) -> NormalEquations:
    """Return the pull of frame k to the weights of its neighbours."""
    pulls = []
    if k > 0:
        pulls.append(pull_to_current(strengths[k - 1], solutions[k - 1].weights))
    if k + 1 < len(solutions):
        pulls.append(pull_to_current(strengths[k], solutions[k + 1].weights))
    return pulls[0] if len(pulls) == 1 else pulls[0] + pulls[1]
