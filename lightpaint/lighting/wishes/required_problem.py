"""A painting and wishes for illuminance together: one convex problem."""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.constraints.requirements import Requirements
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.wishes.linear_programs import shares_given_up
from lightpaint.lighting.wishes.wished_light import WishedLight


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
    requirements, shares = requirements_within_reach(wished, problem.reduction)
    required = replace(
        problem,
        constraints=replace(problem.constraints, requirements=requirements),
        reduction=problem.reduction.with_requirements(requirements),
        full=problem.full.with_requirements(requirements),
    )
    return RequiredProblem(required, wished, shares)


def requirements_within_reach(
    wished: WishedLight, reduction: Reduction
) -> tuple[Requirements, Doubles]:
    """Return the requirements, as much of them as lights can reach, and the share of each wish that
    had to be given up, (w,). reduction: of the lights, without requirements.
    """
    requirements = wished.requirements
    # What tinted light would add to a wish is nothing to rely on: a painting chooses the colours.
    own = reduction.at_middle_colors()
    shares = shares_given_up(wished, own.with_requirements(requirements))
    if shares.any():
        requirements = requirements.lowered(wished.slack_of(shares) * (1 + 1e-9))
    return requirements, shares


def without_wishes(problem: Problem) -> Problem:
    """Return the problem without requirements."""
    return replace(
        problem,
        constraints=replace(problem.constraints, requirements=None),
        reduction=replace(problem.reduction, requirements=None),
        full=replace(problem.full, requirements=None),
    )
