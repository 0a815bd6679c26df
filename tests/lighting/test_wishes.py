"""Wishes for illuminance and power: requirements, the least power, and what contradicts."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from qp import least
from scipy.optimize import linprog

from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.light_wishes import wished_light
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.lighting.unknowns.lamp_parts import watts_of
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.lighting.wish_outcomes import planes_answer
from lightpaint.lighting.wish_problems import least_watts, shares_given_up, with_wishes
from lightpaint.photometry.illuminance import (
    Illuminance,
    LightCase,
    MeasuringPlane,
    PowerBudget,
    Ratio,
    Wishes,
)
from lightpaint.report.planes_text import planes_sentences
from lightpaint.target.painted_target import Target

#: Rows are met up to 1e-9 of their size, and the oracles have tolerances of their own.
SAME = 1e-6

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
LAMPS = 4


def _plane(name: str, count: int, **wishes: Any) -> MeasuringPlane:
    points = np.random.default_rng(count).random((count, 3))
    up = np.broadcast_to([0.0, 0.0, 1.0], (count, 3))
    cells = np.column_stack([np.arange(count), np.zeros(count, int)])
    return MeasuringPlane(name, points, up, 0.5, 6.0, (count, 1), cells, Wishes(**wishes))


def _illuminance(basis: Any, planes: Any, *, noise: float = 0.0) -> Illuminance:
    rng = np.random.default_rng(7)
    count = sum(len(plane) for plane in planes)
    light = rng.uniform(40, 400, (count, len(basis.lights), 1)) * LUMINANCE
    return Illuminance(tuple(planes), basis.lights, light, noise * light, 1.0)


def _lamps(count: int, **more: Any) -> Constraints:
    lamp = {"name": "lamp", "rgb": [1, 1, 1], "watts": 40}
    table = {"emitters": [lamp], **more}
    return Constraints.of({f"light {k}": table for k in range(count)})


def _case(make_basis: Any, planes: Any, *, seed: int = 0, count: int = LAMPS) -> Any:
    basis = make_basis(count, (5, 4), seed=seed)
    rng = np.random.default_rng(seed)
    image = rng.uniform(0.1, 0.5, (5, 4, 3)).astype(np.float32)
    target = Target("t", image, np.ones((5, 4), np.float32), everything=True)
    return basis, target, _illuminance(basis, planes)


@pytest.mark.parametrize("seed", list(seeds(4, 30)))
def test_painting_and_wishes_are_one_convex_problem(make_basis, seed):
    desk = _plane("desk", 9, mean=520.0, uniformity=0.55)
    wall = _plane("wall", 6, ratios=(Ratio("desk", 0.4),), most=900.0)
    basis, target, illuminance = _case(make_basis, [desk, wall], seed=seed)
    fit = Fit(literal=True)
    problem = Problem.of(basis, target, constraints=_lamps(LAMPS), fit=fit)
    wished = wished_light(illuminance, PowerBudget(watts=140.0), problem.reduction)
    required = with_wishes(problem, wished)
    assert not required.shares.any()
    solution = solution_of(required.problem)
    assert solution.certificate.converged
    drives = solution.weights @ LUMINANCE

    A, y = stack_rows(basis, target)
    grey = np.kron(np.eye(LAMPS), np.ones((3, 1)))
    C = A @ grey
    E = illuminance.matrix.sum(axis=2)
    mean, other = E[:9].mean(axis=0), E[9:].mean(axis=0)
    rows = np.vstack([mean, E[:9] - 0.55 * mean, -E[9:], other - 0.4 * mean, -40 * np.ones(LAMPS)])
    values = [520.0, *[0.0] * 9, *[-900.0] * 6, 0.0, -140.0]
    limits = [(value, np.inf) for value in values]
    expected = least(C.T @ C, C.T @ y, upper=1.0, rows=rows, limits=limits)
    assert drives == pytest.approx(expected, abs=SAME)
    reading = illuminance.reading("desk", solution.weights)
    assert reading.mean >= 520 * (1 - SAME)
    assert reading.uniformity >= 0.55 * (1 - SAME)


@pytest.mark.parametrize("seed", list(seeds(4, 30)))
def test_the_least_power_is_that_of_all_rows_at_once(make_basis, seed):
    desk = _plane("desk", 60, mean=500.0, uniformity=0.5)
    basis, _, illuminance = _case(make_basis, [desk], seed=seed, count=6)
    reduction = reduce_to(_lamps(6), basis.lights)
    wished = wished_light(illuminance, PowerBudget(), reduction)
    reduction = reduction.with_requirements(wished.requirements)
    found = least_watts(wished, reduction)
    E = illuminance.matrix.sum(axis=2)
    mean = E.mean(axis=0)
    rows = np.vstack([mean, E - 0.5 * mean])
    expected = linprog(
        np.full(6, 40.0), A_ub=-rows, b_ub=-np.append(500.0, np.zeros(60)), bounds=(0, 1)
    )
    # One percent is spent on lamps that share the light more evenly than those of a corner do.
    power = watts_of(reduction.weights(found.x), reduction.lamps)
    assert expected.fun * (1 - SAME) <= power <= 1.01 * expected.fun * (1 + SAME)
    assert np.square(found.x).sum() <= np.square(expected.x).sum()
    assert (rows @ found.x >= np.append(500.0, np.zeros(60)) - 1e-5).all()
    # The price of one lx more is the derivative of the least power.
    price = wished.multipliers_of(found.multipliers)[0]
    assert price == pytest.approx(-expected.ineqlin.marginals[0], rel=SAME)


def test_wishes_beyond_all_lamps_are_met_as_far_as_they_go(make_basis):
    desk = _plane("desk", 8, mean=5000.0)
    basis, target, illuminance = _case(make_basis, [desk])
    problem = Problem.of(basis, target, constraints=_lamps(LAMPS), fit=Fit(literal=True))
    wished = wished_light(illuminance, PowerBudget(), problem.reduction)
    required = with_wishes(problem, wished)
    at_full = illuminance.reading("desk", np.ones((LAMPS, 3))).mean
    assert required.shares[0] == pytest.approx(1 - at_full / 5000, rel=SAME)
    solution = solution_of(required.problem)
    assert solution.weights == pytest.approx(np.ones((LAMPS, 3)), abs=SAME)


@pytest.mark.parametrize("asked", [500.0, 5000.0])
def test_a_black_painting_meets_as_much_as_any(make_basis, asked):
    """The price of giving up a wish must not vanish with the light of the painting."""
    basis, target, illuminance = _case(make_basis, [_plane("desk", 8, mean=asked)])
    black = replace(target, image=np.zeros_like(target.image))
    problem = Problem.of(basis, black, constraints=_lamps(LAMPS), fit=Fit(literal=True))
    wished = wished_light(illuminance, PowerBudget(), problem.reduction)
    required = with_wishes(problem, wished)
    weights = solution_of(required.problem).weights
    at_full = illuminance.reading("desk", np.ones((LAMPS, 3))).mean
    reached = illuminance.reading("desk", weights).mean
    assert reached == pytest.approx(min(asked, at_full), rel=SAME)


def test_lights_that_all_stay_give_what_they_give(make_basis):
    basis, target, illuminance = _case(make_basis, [_plane("desk", 8, mean=5000.0)])
    locked = Constraints.of({"*": {"lock": True}})
    problem = Problem.of(basis, target, constraints=locked, fit=Fit(literal=True))
    wished = wished_light(illuminance, PowerBudget(), problem.reduction)
    required = with_wishes(problem, wished)
    now = illuminance.reading("desk", basis.lights.current_weights).mean
    assert required.shares == pytest.approx([1 - now / 5000], rel=SAME)
    assert solution_of(required.problem).weights == pytest.approx(basis.lights.current_weights)


def test_a_budget_is_kept_where_light_is_given_up(make_basis):
    desk = _plane("desk", 8, mean=5000.0)
    basis, _, illuminance = _case(make_basis, [desk])
    reduction = reduce_to(_lamps(LAMPS), basis.lights)
    wished = wished_light(illuminance, PowerBudget(per_area=10.0), reduction, floor_m2=6.0)
    reduction = reduction.with_requirements(wished.requirements)
    found = least_watts(wished, reduction)
    power = watts_of(reduction.weights(found.x), reduction.lamps)
    assert power == pytest.approx(60.0, rel=SAME)
    assert shares_given_up(wished, reduction)[0] > 0


def test_two_desks_share_what_a_budget_leaves(make_basis):
    """The lamps of the second give a tenth more: the sum of shares alone would serve only it."""
    desks = [_plane("first", 4, mean=500.0), _plane("second", 5, mean=500.0)]
    basis, _, illuminance = _case(make_basis, desks, count=2)
    light = np.zeros((9, 2, 1))
    light[:4, 0], light[4:, 1] = 600.0, 660.0
    illuminance = replace(illuminance, matrix=light * LUMINANCE)
    reduction = reduce_to(_lamps(2), basis.lights)
    wished = wished_light(illuminance, PowerBudget(watts=40.0), reduction)
    shares = shares_given_up(wished, reduction.with_requirements(wished.requirements))
    # Equal drives d1 + d2 = 1 would give .4 and .34; equal shares need 600 d1 = 660 d2.
    assert shares[:2] == pytest.approx([1 - 600 * 660 / 1260 / 500] * 2, rel=1e-4)


def test_noise_makes_a_wish_ask_for_more(make_basis):
    basis = make_basis(LAMPS, (5, 4))
    desk = _plane("desk", 8, mean=500.0, uniformity=0.3, most=1500.0)
    reduction = reduce_to(_lamps(LAMPS), basis.lights)
    sure = wished_light(_illuminance(basis, [desk]), PowerBudget(), reduction)
    noisy = wished_light(_illuminance(basis, [desk], noise=0.02), PowerBudget(), reduction)
    half = np.full((LAMPS, 3), 0.5)
    values, expected = (np.einsum("mnc,nc->m", x.requirements.rows, half) for x in (noisy, sure))
    mean, points, most = (wish.rows for wish in sure.wishes)
    measured, at_full = _illuminance(basis, [desk], noise=0.02), np.ones((LAMPS, 3))
    reading = measured.reading("desk", at_full)
    assert values[mean] / expected[mean] == pytest.approx(
        1 - reading.mean_interval / reading.mean, rel=1e-9
    )
    # Eight points of 2 % each: .71 % of their mean.
    assert reading.mean_error / reading.mean == pytest.approx(0.02 / np.sqrt(8), rel=0.1)
    assert (values[points] < expected[points]).all()
    errors = measured.standard_errors(at_full) / measured.of(at_full)
    assert values[most] / expected[most] == pytest.approx(1 + 1.96 * errors, rel=1e-9)


def test_power_of_which_nothing_is_known_is_not_limited(make_basis):
    desk = _plane("desk", 4, mean=100.0)
    basis, _, illuminance = _case(make_basis, [desk])
    reduction = reduce_to(Constraints(), basis.lights)
    with pytest.raises(ConstraintError, match="the power of 'light 0' and 3 more is unknown"):
        wished_light(illuminance, PowerBudget(watts=100.0), reduction)


def test_a_plane_that_no_lamp_reaches_is_named(make_basis):
    desk = _plane("desk", 4, mean=100.0)
    basis, _, illuminance = _case(make_basis, [desk])
    dark = replace(illuminance, matrix=np.zeros_like(illuminance.matrix))
    with pytest.raises(ConstraintError, match="plane 'desk' gets no light from any lamp"):
        wished_light(dark, PowerBudget(), reduce_to(_lamps(LAMPS), basis.lights))


def test_a_ratio_to_no_plane_is_refused(make_basis):
    desk = _plane("desk", 4, ratios=(Ratio("flor", 0.3),))
    basis, _, illuminance = _case(make_basis, [desk])
    with pytest.raises(ConstraintError, match="a ratio to 'flor', which is not a plane"):
        wished_light(illuminance, PowerBudget(), reduce_to(_lamps(LAMPS), basis.lights))


def test_wishes_hold_in_all_cases(make_basis):
    desk = _plane("desk", 8, mean=400.0)
    basis = make_basis(LAMPS, (5, 4))
    constraints = _lamps(LAMPS - 1).and_then(Constraints.of({"light 3": {"lock": True}}))
    reduction = reduce_to(constraints, basis.lights)
    illuminance = _illuminance(basis, [desk])
    cases = (LightCase("night", {"light 3": 0.0}), LightCase("noon", {"light 3": 2.0}))
    wished = wished_light(illuminance, PowerBudget(), reduction, cases=cases)
    assert [(wish.case, wish.plane) for wish in wished.wishes] == [
        ("night", "desk"),
        ("noon", "desk"),
    ]
    required = reduction.with_requirements(wished.requirements)
    weights = required.weights(least_watts(wished, required).x)
    answer = planes_answer(wished, reduction, weights, floor_m2=0.0)
    night, noon = answer.readings["night", "desk"].mean, answer.readings["noon", "desk"].mean
    sky = illuminance.matrix[:, 3].mean(axis=0) @ basis.lights.current_weights[3]
    assert night == pytest.approx(400, rel=SAME)  # which needs the most, and gets no more than that
    assert noon == pytest.approx(400 + 2 * sky, rel=SAME)
    reached = [outcome.reached for outcome in answer.outcomes]
    assert reached == pytest.approx([night, noon], rel=SAME)


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"light 0": 0.0}, "case 'night' sets 'light 0', which the solve adjusts: lock it"),
        ({"skyy": 0.0}, "case 'night' sets 'skyy': no light has this name"),
    ],
)
def test_cases_are_of_lights_that_stay(make_basis, factors, message):
    basis = make_basis(LAMPS, (5, 4))
    illuminance = _illuminance(basis, [_plane("desk", 4, mean=400.0)])
    reduction = reduce_to(_lamps(LAMPS), basis.lights)
    with pytest.raises(ConstraintError, match=message):
        wished_light(illuminance, PowerBudget(), reduction, cases=[LightCase("night", factors)])


def test_a_plane_that_only_fixed_lights_reach_is_named(make_basis):
    """The light of the sky is no light of lamps, and no other wish keeps these from giving more."""
    basis, _, illuminance = _case(make_basis, [_plane("desk", 4, mean=400.0)])
    only_fixed = illuminance.matrix.copy()
    only_fixed[:, :3] = 0
    constraints = _lamps(3).and_then(Constraints.of({"light 3": {"lock": True}}))
    reduction = reduce_to(constraints, basis.lights)
    wished = wished_light(replace(illuminance, matrix=only_fixed), PowerBudget(), reduction)
    reduction = reduction.with_requirements(wished.requirements)
    weights = reduction.weights(least_watts(wished, reduction).x)
    answer = planes_answer(wished, reduction, weights, floor_m2=0.0)
    lux = answer.readings["", "desk"].mean
    assert 0 < lux < 400
    [missed] = (x for x in planes_sentences(answer) if x.startswith("desk"))
    assert missed == (
        f"desk: {lux:.0f} of 400 lx: none of the lamps that the answer adjusts reaches it."
    )
