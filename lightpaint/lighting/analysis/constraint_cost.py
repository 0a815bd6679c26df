"""What the constraints cost the picture: the best that the lights could do without them."""

from dataclasses import replace

from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.linear_problem import reduced_by
from lightpaint.lighting.problem import gamuts_for
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of


def without_constraints(solution: Solution) -> Solution | None:
    """The best lighting if nothing were asked of the lights; None where nothing is.

    Nor for one of several views, whose lighting answers the others too.
    """
    problem = solution.problem
    if not problem.constraints or solution.whole is not None:
        return None
    gamuts = gamuts_for(problem.basis, problem.views, problem.fit)
    free = reduced_by(Constraints(), problem.lights, problem.fit, gamuts)
    anew = replace(
        problem,
        constraints=Constraints(),
        reduction=free,
        full=free,
        dimming=None,
        fit=replace(problem.fit, method="polished"),
    )
    return solution_of(anew, start=solution.weights)
