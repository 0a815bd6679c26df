"""Lights that change over a shot: a lighting for each painted frame, tied to its neighbours.

What a frame hardly shows is not determined by its painting: solved alone, such a light would jump
from key to key. So a weak term Σ_k Σ_i s ‖Φ_i‖² (w_{k+1,i} − w_{k,i})² joins the losses of all
frames. The whole is convex where the losses are; block by block, each frame is solved against its
neighbours, from the linear problem at its own answer, until the weights stay.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.loss.weight_penalty import pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of, solve_tethered

#: Strength of the tie between two neighbouring keys, relative to the loss of a painted picture. On
#: a shot of 24 frames (benchmarks/frames.py) it takes a third of the flicker out of four inexact
#: paintings; ten times as much doubles the error of pictures between two.
TIE = 1e-2

#: Largest number of rounds over all frames, and the change of a weight, relative to the largest, at
#: which they end.
MAX_ROUNDS, MAX_CHANGE = 100, 1e-6


def solve_frames(
    problems: Sequence[Problem], frames: Sequence[int], *, tie: float = TIE
) -> list[Solution]:
    """Return the solution of each painted frame, in order. frames: their numbers."""
    solutions = [solution_of(problem) for problem in problems]
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
