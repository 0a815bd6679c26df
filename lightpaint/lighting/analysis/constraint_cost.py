"""The cost of the constraints to the picture: the best answer without them."""

from dataclasses import replace

from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.linear_problem import reduce_lights
from lightpaint.lighting.problem import gamuts_for
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of


def without_constraints(solution: Solution) -> Solution | None:
    """Solve without constraints; return None if there are none.

    Also None for one of several views, whose lighting answers the others, too.
    """
    problem = solution.problem
    if not problem.constraints or solution.whole is not None:
        return None
    gamuts = gamuts_for(problem.basis, problem.views, problem.fit)
    free = reduce_lights(Constraints(), problem.lights, problem.fit, gamuts)
    anew = replace(
        problem,
        constraints=Constraints(),
        reduction=free,
        full=free,
        dimming=None,
        fit=replace(problem.fit, method="polished"),
    )
    return solution_of(anew, start=solution.weights)
