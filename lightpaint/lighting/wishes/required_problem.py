"""A painting and wishes for illuminance together: one convex problem."""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.constraints.constraints import Requirements
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.wishes.linear_programs import shares_given_up
from lightpaint.lighting.wishes.wished_light import WishedLight

#: What is given up of a wish is more than its least share by this part of it, so that round-off
#: leaves room for an answer.
ROOM = 1e-8


@dataclass(frozen=True)
class RequiredProblem:
    """A problem whose answer meets wishes.

    problem: with the wishes as requirements. wished: the wishes. shares: (w,), what had to be given
    up of each, 0 of those that are met.
    """

    problem: Problem
    wished: WishedLight
    shares: Doubles


def with_wishes(problem: Problem, wished: WishedLight) -> RequiredProblem:
    """Return the problem under wishes; where these contradict the limits of lamps or each other,
    under as much of them as possible.
    """
    if wished.is_empty:
        return RequiredProblem(problem, wished, np.zeros(0))
    within = _within_reach(problem, wished)
    if within is not None:
        return RequiredProblem(within, wished, np.zeros(len(wished.wishes)))
    requirements, shares = requirements_within_reach(wished, problem.reduction)
    return RequiredProblem(_required(problem, requirements), wished, shares)


def _within_reach(problem: Problem, wished: WishedLight) -> Problem | None:
    """Return the problem that meets all wishes, with the answer of its squares to start from; None
    if that is not found at once.

    What tinted light would add to a wish is nothing to rely on: a painting chooses the colours.
    """
    required = _required(problem, wished.requirements)
    middle = required.reduction.at_middle_colors()
    equations = problem.with_pull(problem.solved)
    found = solve_reduced(equations, middle, problem.start, max_updates=0)
    return replace(required, start=found.weights) if found.converged else None


def _required(problem: Problem, requirements: Requirements) -> Problem:
    return replace(
        problem,
        constraints=replace(problem.constraints, requirements=requirements),
        reduction=problem.reduction.with_requirements(requirements),
        full=problem.full.with_requirements(requirements),
    )


def requirements_within_reach(
    wished: WishedLight, reduction: Reduction
) -> tuple[Requirements, Doubles]:
    """Return the requirements, as much of them as lights can reach, and the share of each wish that
    had to be given up, (w,). reduction: of the lights, without requirements.
    """
    requirements = wished.requirements
    own = reduction.at_middle_colors()
    shares = shares_given_up(wished, own.with_requirements(requirements))
    if shares.any():
        requirements = requirements.lowered(wished.slack_of(shares) * (1 + ROOM))
    return requirements, shares


def without_wishes(problem: Problem) -> Problem:
    """Return the problem without requirements."""
    return replace(
        problem,
        constraints=replace(problem.constraints, requirements=None),
        reduction=replace(problem.reduction, requirements=None),
        full=replace(problem.full, requirements=None),
    )
