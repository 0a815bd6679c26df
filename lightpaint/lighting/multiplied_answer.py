"""The answer of a renderer that multiplies lights in other primaries than Rec.709.

A problem adds planes channel by channel. Such a renderer shows N w (see `Basis.mix`), in which all
channels depend on each other. So a problem is solved with the diagonal D of N, what each channel
alone changes, and with (N − D) w of the last answer as light that stays, until its prediction is
what the renderer shows. This Jacobi iteration of a fixed point w = G(w) converges where N is more
diagonal than not, and Anderson's method (Anderson 1965; Walker and Ni 2011) makes it several times
as fast.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import can_be_multiplied, channel_responses
from lightpaint.lighting.problem import problem_as_multiplied
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of

#: Largest number of solves, and the RMS difference of prediction and render, relative to the
#: picture, at which they end.
MAX_SOLVES, SMALL = 24, 5e-5

#: Number of earlier solves of which the next one makes use.
DEPTH = 4

#: Share of the largest change of steps below which a combination of steps is round-off.
ROUND_OFF = 1e-6


def answer_as_multiplied(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer whose prediction is what the renderer shows that multiplies these lights.

    It is the solution itself, unless its basis names other primaries than Rec.709.
    finish: what is done to each answer once it is solved.
    """
    problem, w = solution.problem, solution.weights
    if not all(can_be_multiplied(basis) for basis in problem.views.bases):
        return solution
    planes = [channel_responses(basis) for basis in problem.views.bases]
    iteration = _Anderson(np.sqrt(problem.power))
    best, least = solution, np.inf
    for _ in range(MAX_SOLVES):
        solution = finish(
            solution_of(problem_as_multiplied(problem, w, planes), start=solution.weights)
        )
        found = solution.weights
        rendered = problem.basis.mix(found).astype(np.float64)
        # Where colours clip, views that mix channels have several valleys.
        if (loss := float(problem.loss.pixels.objective(_by_channel(rendered)).sum())) <= least:
            best, least = solution, loss
        if _rms(rendered - solution.basis.mix(found)) <= SMALL * _rms(rendered):
            best = solution
            break
        w = np.maximum(iteration.next(w, found), 0)
    shown = problem_as_multiplied(problem, best.weights)
    return replace(
        best, problem=replace(best.problem, basis=shown.basis, views=shown.views, given=shown.given)
    )


@dataclass
class _Anderson:
    """Anderson's method for w = G(w). scale: (n, 3), the picture that a weight of 1 is worth."""

    scale: Doubles
    steps: list[Doubles] = field(default_factory=list)
    found: list[Doubles] = field(default_factory=list)

    def next(self, w: Doubles, found: Doubles) -> Doubles:
        """Return where to evaluate G next. found: G(w), (n, 3)."""
        self.steps.append(((found - w) * self.scale).ravel())
        self.found.append(found)
        del self.steps[: -DEPTH - 1], self.found[: -DEPTH - 1]
        if len(self.steps) == 1:
            return found
        changes = np.diff(np.stack(self.steps, axis=1))
        shares = np.linalg.lstsq(changes, self.steps[-1], rcond=ROUND_OFF)[0]
        moves = np.diff(np.stack(self.found, axis=-1))
        return np.asarray(found - moves @ shares)


def _by_channel(picture: Doubles) -> Doubles:
    """Return a picture (h, w, 3) as (3, p)."""
    return np.ascontiguousarray(picture.reshape(-1, 3).T)


def _rms(picture: Doubles) -> float:
    return float(np.sqrt(np.square(picture).mean()))
