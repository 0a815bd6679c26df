"""The table of lights: no pixels, one order, read only."""

import dataclasses

import numpy as np
import pytest

from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.errors import BasisError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit, resolve_fit
from lightpaint.lighting.linear_problem import Sums, reduce_lights, summed_problem
from lightpaint.lighting.linear_solve import solve_squares
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.scene.lights.lights_file import SceneRequests


def lamp(name: str, emission: float = 0.5, **options: bool) -> BasisLight:
    return BasisLight(name, "point", "intensity", "W/sr", (emission,) * 3, **options)


def test_it_is_a_sequence_in_one_order() -> None:
    lights = Lights((lamp("a"), lamp("b", 1.0, is_fixed=True), lamp("c", 2.0, is_scalar=True)))
    assert (len(lights), lights[1].name, [x.name for x in lights[1:]]) == (3, "b", ["b", "c"])
    assert lights.names == ("a", "b", "c")
    assert lights.current_weights.tolist() == [[0.5] * 3, [1.0] * 3, [2.0] * 3]
    assert lights.is_fixed.tolist() == [False, True, False]
    assert lights.is_scalar.tolist() == [False, False, True]
    assert Lights.of(lights) is lights
    assert Lights.of(list(lights)) == lights


def test_nobody_changes_what_all_share() -> None:
    lights = Lights((lamp("a"),))
    with pytest.raises(ValueError, match="read-only"):
        lights.current_weights[0] = 7
    with pytest.raises(dataclasses.FrozenInstanceError):
        lights.records = ()  # type: ignore[misc]


def test_names_do_not_repeat() -> None:
    with pytest.raises(BasisError, match="repeat"):
        Lights((lamp("a"), lamp("a")))


def test_a_lighting_and_a_solve_need_no_pixel() -> None:
    requests = SceneRequests({"light": {"b": {"lock": [0.25] * 3}}}, "hall.toml")
    lights = Lights((lamp("a"), lamp("b")), requests)
    M = np.tile(np.diag([2.0, 3.0]), (3, 1, 1))
    sums = Sums(NormalEquations(M, np.tile([4.0, 9.0], (3, 1)), np.full(3, 50.0)), np.ones((2, 3)))
    problem = summed_problem(lights, "it", sums, constraints=Constraints(), fit=Fit(literal=True))
    optimum = solve_squares(problem, problem.start)
    np.testing.assert_allclose(optimum.weights, [[2.0] * 3, [0.25] * 3])
    assert optimum.lighting.weights_for(lights).tolist() == optimum.weights.tolist()
    assert Lighting.of_weights(lights, optimum.weights).emission == optimum.lighting.emission
    assert len(reduce_lights(Constraints(), lights, resolve_fit(Fit())).knobs) == 2
