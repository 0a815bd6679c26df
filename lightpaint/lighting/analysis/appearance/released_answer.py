"""The answer without one reason, solved on all pixels.

Samples of the pixels find and order reasons. The number that a person is told of one is the effect
of removing it, which this solve gives: the same as the solve that follows if it is removed.
"""

from dataclasses import replace

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of


def released_weights(
    solution: Solution, *, fit: Fit | None = None, constraints: Constraints | None = None
) -> Doubles:
    """Return the weights, (n, 3), of the same views with another fit or other constraints.

    solution: of one view; if it is a part of one of several views, all of them are solved. Noise is
    corrected if it was before.
    """
    problem = (solution.whole or solution).problem
    # All constraints, also those of the bases' scenes, are among those of the problem.
    bases = [basis.with_requests(type(basis.requests)()) for basis in problem.views.bases]
    released = Problem.of(
        bases,
        list(problem.views.targets),
        constraints=problem.constraints if constraints is None else constraints,
        fit=fit or problem.fit,
    )
    released_solution = solution_of(replace(released, start=problem.start))
    if problem.corrected is not None and solution.basis.knows_noise:
        released_solution = correct_noise(released_solution)
    return released_solution.weights
