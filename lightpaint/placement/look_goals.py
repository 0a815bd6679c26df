"""Goals of looks on small films, with their constraints, for lights that move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.lights import BasisLight
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.constraints.constraints import Constraints, LightConstraint
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduction import Reduction, reduce_to


@dataclass(frozen=True)
class LookGoal:
    """The goal of one look.

    goal: (p, 3); importance: (p, 3), >= 0. reduction: of its unknowns by constraints. pull: penalty
    on weights, beside the picture. noise: (p, 3), half differences of the goal as far as it is the
    current look, whose noise is the basis's own.
    """

    goal: Floats
    importance: Floats
    reduction: Reduction
    pull: NormalEquations | None
    noise: Floats

    @property
    def norm2(self) -> float:
        """‖Ψ‖²."""
        return float((self.importance.astype(np.float64) * np.square(self.goal)).sum())

    def scaled(self, factor: float) -> "LookGoal":
        """Return the goal with its loss multiplied by a factor."""
        pull = None if self.pull is None else self.pull.scaled(factor)
        return replace(self, importance=self.importance * factor, pull=pull)


def goal_of(
    solution: Solution,
    views: Sequence[int],
    sizes: Sequence[tuple[int, int]],
    new: Sequence[BasisLight],
    constraints: Constraints | None,
) -> LookGoal:
    """Return the goal of a look on the pixels of all views, with importance only in its own views.

    views: the place of each of the look's views among all. sizes: of the small films. new,
    constraints: see `fit_of`.
    """
    images: list[Floats] = [np.zeros((height * width, 3)) for height, width in sizes]
    weights: list[Floats] = [np.zeros_like(plane) for plane in images]
    noises: list[Floats] = [np.zeros_like(plane) for plane in images]
    for k, view in enumerate(views):
        problem = solution.problem.view_problem(k)
        reduced = reduced_goal(problem, problem.basis.size[0] // sizes[view][0])
        for listed, image in zip((images, weights, noises), reduced, strict=True):
            whole = np.broadcast_to(image, (*image.shape[:-1], 3))
            listed[view] = whole.reshape(-1, 3)
    all_constraints = solution.problem.constraints.and_then(constraints or Constraints())
    return LookGoal(
        np.concatenate(images),
        np.concatenate(weights),
        _with_new_lights(solution.problem.local_reduction, new, all_constraints),
        pull_with_more(solution, len(new)),
        np.concatenate(noises),
    )


def balanced(goals: Sequence[LookGoal]) -> list[LookGoal]:
    """Return goals with equal weight: scaled to the mean ‖Ψ‖² of all."""
    norms = [look.norm2 for look in goals]
    mean = sum(norms) / len(norms)
    return [
        look if len(goals) == 1 or norm2 == 0 else look.scaled(mean / norm2)
        for look, norm2 in zip(goals, norms, strict=True)
    ]


def _with_new_lights(
    reduction: Reduction, new: Sequence[BasisLight], constraints: Constraints
) -> Reduction:
    """Return `reduction` with the unknowns of new lights after its own."""
    if not new:
        return reduction
    entries = [
        (pattern, table if pattern in (light.name for light in new) else _absolute(table), where)
        for pattern, table, where in constraints.lights
        if any(fnmatchcase(light.name, pattern) or light.name == pattern for light in new)
    ]
    more = reduce_to(Constraints(tuple(entries)), new)
    first = len(reduction.fixed_weights)
    knobs = [
        replace(
            knob,
            lights=tuple(k + first for k in knob.lights),
            unknowns=tuple(
                replace(x, columns=tuple((k + first, rgb) for k, rgb in x.columns))
                for x in knob.unknowns
            ),
        )
        for knob in more.knobs
    ]
    return replace(
        reduction,
        fixed_weights=np.vstack([reduction.fixed_weights, more.fixed_weights]),
        labels=(*reduction.labels, *more.labels),
        knobs=(*reduction.knobs, *knobs),
    )


def _absolute(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the constraints of a pattern that hold for a light that is not there yet.

    A lock, or a limit that is a share, refers to its present emission, which is black.
    """
    constraint = LightConstraint.of(table)
    relative = {"lock"}
    if any(level is not None and level.is_share for level in (constraint.least, constraint.most)):
        relative.add("limits")
    return {key: value for key, value in table.items() if key not in relative}


def pull_with_more(solution: Solution, count: int) -> NormalEquations | None:
    """Return the pull of the lights to their current emission, and none of `count` more."""
    if (pull := solution.problem.pull) is None:
        return None
    coupling = pull.coupling
    return NormalEquations(
        np.pad(pull.M, ((0, 0), (0, count), (0, count))),
        np.pad(pull.b, ((0, 0), (0, count))),
        pull.target_norm2,
        None if coupling is None else np.pad(coupling, ((0, count), (0, 0), (0, 0))),
    )


def reduced_goal(problem: Problem, factor: int) -> tuple[Floats, Floats, Floats]:
    """Return the goal of a view, its importance and its noise on a film of blocks of pixels.

    Goals and noise are means weighted with importance; importance is that of whole blocks.
    """
    squares = problem.squares
    importance = squares.weight.astype(np.float64)
    weight = block_mean(importance, factor)
    total = np.where(weight > 0, weight, 1)
    goal = block_mean(squares.image * importance, factor) / total
    noise = np.zeros_like(goal)
    if squares.share.any():
        shared = squares.share * problem.basis.current_noise
        noise = block_mean(shared * importance, factor) / total
    return goal, weight * factor**2, noise
