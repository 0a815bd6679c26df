"""A brush's answer in a few steps, and the exact one, are of one solve."""

from typing import Any

import numpy as np
import pytest

from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.linear_problem import SummedProblem, Sums, summed_problem
from lightpaint.lighting.linear_solve import solve_linear
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.white_mixes import Multipliers

SIZE = (6, 7)

#: No constraints, and two lights with a range of white.
FREE = Constraints()
WHITE = Constraints.of({f"light {k}": {"kelvin": [2700, 6500]} for k in (0, 2)})


def problem_of(make_basis: Any, constraints: Constraints, seed: int) -> SummedProblem:
    basis = make_basis(4, SIZE, seed=seed)
    rng = np.random.default_rng(seed)
    painted = basis.mix(rng.exponential(1, (4, 3))).astype(np.float32)
    equations = NormalEquations.of(basis, painted, np.ones(SIZE, np.float32))
    sums = Sums(equations, basis.power)
    fit = Fit(literal=True)
    return summed_problem(basis.lights, "it", sums, constraints=constraints, fit=fit)


@pytest.mark.parametrize("constraints", [FREE, WHITE], ids=["free", "white"])
@pytest.mark.parametrize("seed", range(3))
def test_steps_come_to_the_exact_answer_and_stay(
    make_basis: Any, constraints: Constraints, seed: int
) -> None:
    problem = problem_of(make_basis, constraints, seed)
    exact, near = solve_linear(problem, problem.start), Multipliers()
    weights = problem.start
    for _ in range(20):
        answer = solve_linear(problem, weights, steps=3, near=near)
        weights = answer.weights
    least, value = (float(problem.objective(w).sum()) for w in (exact.weights, weights))
    # Float64: the solve ends at 1e-12.
    assert value == pytest.approx(least, rel=1e-9)
    again = solve_linear(problem, weights, steps=3, near=near)
    np.testing.assert_allclose(again.weights, weights, rtol=1e-9, atol=1e-9)
    assert again.optimum.converged


def test_the_lighting_of_an_answer_has_its_weights_and_certificate(make_basis: Any) -> None:
    problem = problem_of(make_basis, WHITE, 1)
    answer = solve_linear(problem, problem.start)
    assert answer.lighting.weights_for(problem.lights).tolist() == answer.weights.tolist()
    certificate = answer.lighting.certificate
    assert certificate is not None
    assert certificate.objective == pytest.approx(problem.objective(answer.weights), rel=1e-12)
