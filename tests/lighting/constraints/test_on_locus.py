"""Lights that keep to a range of white: on the locus, and at whites that no other whites better."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.colour.color import cct_and_duv, kelvin_to_rgb, luminance
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.white_mixes import next_whites

SIZE = (12, 10)

#: What anybody sees of Duv; whites are in fact within 3e-5.
SEEN = 1e-3


def _duvs(weights: Any) -> list[float]:
    chromaticities = [cct_and_duv(w) for w in weights if luminance(w) > 0]
    assert None not in chromaticities
    return [x[1] for x in chromaticities if x is not None]


def _target(make_basis: Any, seed: int, n: int = 5, **fields: Any) -> tuple[lp.Basis, lp.Target]:
    rng = np.random.default_rng(seed)
    basis = make_basis(n, SIZE, seed=seed)
    # Some of it made by coloured lights, which no whites reach.
    image = basis.mix(rng.exponential(1, (n, 3))).astype(np.float32)
    mask = (rng.random(SIZE) < 0.7).astype(np.float32)
    return basis, lp.Target("t", image, mask, everything=False, **fields)


RANGES: list[dict[str, Any]] = [
    {"kelvin": [1901, 100_000]},
    {"kelvin": [2200, 9000]},
    {"kelvin": [2700, 6500], "duv": 0.006},
]


@pytest.mark.parametrize("space", ["linear", "display"])
@pytest.mark.parametrize("words", RANGES)
@pytest.mark.parametrize("seed", range(4))
def test_lights_lie_on_the_locus(make_basis: Any, seed: int, words: Any, space: Any) -> None:
    basis, target = _target(make_basis, seed)
    solution = lp.solve(
        basis, target, constraints=lp.Constraints.of({"*": words}), space=space, hold=1.0
    )
    assert solution.certificate.converged
    for duv in _duvs(solution.weights):
        assert abs(duv - words.get("duv", 0)) < SEEN


@pytest.mark.parametrize("seed", range(6))
def test_the_answer_stays_and_no_neighbours_better_it(make_basis: Any, seed: int) -> None:
    basis, target = _target(make_basis, seed, 4)
    solution = lp.solve(basis, target, colors="white", literal=True)
    problem = solution.problem
    reduction, equations = problem.reduction, problem.equations
    next_windows, next_weights = next_whites(equations, reduction, solution.weights)
    assert [k.window for k in next_windows.knobs] == [k.window for k in reduction.knobs]
    least = equations.objective(solution.weights).sum()
    round_off = 1e-9 * equations.target_norm2.sum()
    assert equations.objective(next_weights.weights).sum() == pytest.approx(least, abs=round_off)
    for k, knob in enumerate(reduction.knobs):
        assert knob.whites is not None
        # With all others solved anew: the pieces that meet where the light is.
        [place] = knob.whites.places(solution.weights[[k]])
        for first in {int(place - 1e-6), min(int(place + 1e-6), knob.whites.last - 1)}:
            neighbour_windows = reduction.with_windows({k: (first, first + 1)})
            neighbour = solve_reduced(equations, neighbour_windows, solution.weights)
            assert equations.objective(neighbour.weights).sum() >= least - round_off
        # With all others as they are: any white, as bright as is best.
        for rgb in knob.whites.colors:
            neighbour, own_errors = solution.weights.copy(), np.zeros((4, 3))
            neighbour[k], own_errors[k] = 0, rgb
            down, power = (
                (equations.gradient(neighbour) * own_errors).sum(),
                equations.M[:, k, k] @ rgb**2,
            )
            neighbour[k] = max(-down / power, 0) * rgb
            assert equations.objective(neighbour).sum() >= least - round_off


def test_a_light_with_less_than_no_picture_is_solved_as_one_without(make_basis: Any) -> None:
    """The noise correction may leave that of a nearly black one."""
    basis, target = _target(make_basis, 1, 4)
    problem = lp.solve(basis, target, colors="white", literal=True).problem
    M, b, norm2 = (getattr(problem.equations, x).copy() for x in ("M", "b", "target_norm2"))
    M[:, 0, :] = M[:, :, 0] = b[:, 0] = 0
    start = np.ones((4, 3))
    _, expected = next_whites(NormalEquations(M, b, norm2), problem.reduction, start)
    below = M.copy()
    below[:, 0, 0] = -1e-15 * M.max()
    _, next_weights = next_whites(NormalEquations(below, b, norm2), problem.reduction, start)
    np.testing.assert_allclose(next_weights.weights[1:], expected.weights[1:], rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_two_lights_are_as_good_as_the_best_of_all_pairs_of_whites(
    make_basis: Any, seed: int
) -> None:
    basis, target = _target(make_basis, seed, 2)
    solution = lp.solve(basis, target, colors="white", literal=True)
    root = np.sqrt(target.importance.astype(np.float64))[None, ..., None]
    A = (basis.images.astype(np.float64) * root).reshape(2, -1, 3)
    y = (target.image * root[0]).astype(np.float64).ravel()
    whites = [kelvin_to_rgb(float(1e6 / m)) for m in np.linspace(1e6 / 9000, 1e6 / 2200, 60)]
    best = min(
        nnls(np.stack([(A[0] * a).ravel(), (A[1] * b).ravel()], axis=1), y)[1] ** 2
        for a, b in product(whites, whites)
    )
    # Of answers that no neighbours better there may be several; what is tried is 6 mireds apart.
    assert sum(solution.certificate.objective) <= best * (1 + 1e-4)


def test_a_light_beyond_its_whites_says_to_which_side(make_basis: Any) -> None:
    basis = make_basis(3, SIZE, seed=2)
    for duv, tint in ((0.02, "greener"), (-0.02, "pinker"), (0.0, "")):
        weights = np.array([kelvin_to_rgb(4000, duv), kelvin_to_rgb(3000), kelvin_to_rgb(5000)])
        image = basis.mix(weights).astype(np.float32)
        target = lp.Target("t", image, np.ones(SIZE, np.float32), everything=False)
        constraints = lp.Constraints.of({"light 0": {"kelvin": [2700, 6500]}})
        bounds = lp.diagnose(lp.solve(basis, target, constraints=constraints)).bounds
        assert {bound.tint for bound in bounds if bound.kind == "colour"} <= {tint}
        assert bool(tint) == any(bound.tint for bound in bounds)


@pytest.mark.parametrize("space", ["linear", "display"])
def test_under_the_brush_all_lights_are_white(make_basis: Any, space: Any) -> None:
    basis = make_basis(4, SIZE, seed=5)
    view = LiveView(basis, image := basis.current_look.copy(), weight := np.zeros(SIZE, np.float32))
    fit = resolve_for_targets(
        lp.Fit(colors="white", space=space, hold=0.3), [_narrow_target(basis)]
    )
    live = LiveSolver([view], fit=fit, constraints=lp.Constraints())
    answer = live.answer(basis.current_weights)
    current = basis.current_weights
    np.testing.assert_allclose(luminance(answer), luminance(current), rtol=1e-9)
    _assert_nearest(answer, current)
    rng = np.random.default_rng(1)
    for _ in range(12):
        top, left = rng.integers(0, 6, 2)
        region = slice(top, top + 5), slice(left, left + 4)
        image[region] *= rng.uniform(0.2, 3, 3)
        weight[region] = 1
        view.update(region)
        answer = live.answer(answer)
        assert max(map(abs, _duvs(answer))) < SEEN
    # Once the brush rests, the painter's answer is that of a whole solve.
    for _ in range(60):
        answer = live.answer(answer)
    target = lp.Target("t", image, weight, everything=False, transform=fit.transform)
    exact = solution_of(Problem.of(basis, target, fit=fit))
    problem = exact.problem
    assert problem.objective(answer).sum() <= 1.02 * problem.objective(exact.weights).sum()


def _narrow_target(basis: lp.Basis) -> lp.Target:
    one = np.ones(SIZE, np.float32)
    return lp.Target("t", basis.current_look, one, False, through_view=True, over_look=True)


def _assert_nearest(answer: Any, current: Any) -> None:
    """Whether each light has the white at its own temperature."""
    for w, current_emission in zip(answer, current, strict=True):
        kelvin, duv = cct_and_duv(w)  # type: ignore[misc]
        assert abs(duv) < SEEN
        if (chromaticity := cct_and_duv(current_emission)) is not None:
            mired = np.clip(1e6 / chromaticity[0], 1e6 / 9000, 1e6 / 2200)
            assert 1e6 / kelvin == pytest.approx(mired, abs=2)  # a chord of 8
