"""Rounds that move some of many lights come to the answer that all of them have."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.lighting import linear_solve
from lightpaint.lighting.constraints.constraint_table import Constraints, Requirements
from lightpaint.lighting.fit import Fit, resolve_for_targets
from lightpaint.lighting.live import live_solver as live_module
from lightpaint.lighting.live import many_lights
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.lighting.unknowns import some_lights
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.lighting.unknowns.some_lights import SomeLights
from lightpaint.target.painted_target import Target

LIGHTS, SIZE = 24, (30, 40)


@pytest.fixture
def moves_some(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take eight lights for many, and move five of them in a round."""
    monkeypatch.setattr(live_module, "MANY_LIGHTS", 8)
    monkeypatch.setattr(many_lights, "MOVED_LIGHTS", 5)


def _basis(make_basis: Any) -> Any:
    """Return lights that each light a place, and a little of everything."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    centers = rng.random((LIGHTS, 2)) * SIZE
    spread = [np.exp(-((y - b) ** 2 + (x - a) ** 2) / 60) for b, a in centers]
    planes = (np.array(spread)[..., None] + 0.02) * rng.uniform(0.5, 1, (LIGHTS, 1, 1, 3))
    return make_basis(images=planes, emission=rng.uniform(0.2, 1, (LIGHTS, 3)))


def _painted(
    make_basis: Any, fit: Fit, required: Requirements | None = None, **constraints: Any
) -> tuple[LiveSolver, Target, Any]:
    """Return a live solver of a painting that makes some places brighter and others darker."""
    basis = _basis(make_basis)
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    for rows, columns, factor in (((5, 18), (4, 20), 2.0), ((12, 28), (22, 38), 0.3)):
        region = slice(*rows), slice(*columns)
        image[region] *= factor
        importance[region] = 1
    view = LiveView(basis, image, importance)
    target = Target("t", image, importance, False, through_view=True, over_look=True)
    resolved = resolve_for_targets(fit, [target])
    every = replace(Constraints.of(**constraints), requirements=required)
    live = LiveSolver([view], fit=resolved, constraints=every)
    problem = Problem.of(basis, target, constraints=every, fit=resolved)
    return live, target, problem


@pytest.mark.usefixtures("moves_some")
@pytest.mark.parametrize("colors", ["free", "own"])
@pytest.mark.parametrize("space", ["display", "linear"])
@pytest.mark.parametrize(
    "constraints",
    [
        {},
        {"light": {"light 1": {"lock": True}, "light 2": {"limits": {"max": "40%"}}}},
        {"tie": [{"lights": ["light 3", "light 4", "light 5"]}]},
    ],
)
def test_rounds_of_some_lights_come_to_the_answer_of_all(
    make_basis: Any, space: Any, colors: Any, constraints: Any
) -> None:
    fit = Fit(space=space, colors=colors, hold=1.0)
    live, _, problem = _painted(make_basis, fit, **constraints)
    answer = problem.basis.current_weights
    losses = []
    for _ in range(60):
        answer = live.answer(answer)
        losses.append(float(problem.objective(answer).sum()))
    exact = float(problem.objective(solution_of(problem).weights).sum())
    assert losses[-1] <= 1.002 * exact
    # The first round takes those that help most, and none makes it worse; its films are in float32.
    assert losses[0] > 1.01 * exact
    assert np.all(np.diff(losses) <= 1e-4 * losses[0])
    if "light" in constraints:
        np.testing.assert_allclose(answer[1], problem.basis.current_weights[1], rtol=1e-12)


@pytest.mark.usefixtures("moves_some")
@pytest.mark.parametrize("space", ["display", "linear"])
def test_no_round_breaks_a_requirement(make_basis: Any, space: Any) -> None:
    """A desk that the painting darkens needs its light, and all lights together have a limit."""
    rng = np.random.default_rng(5)
    rows = np.stack([rng.uniform(0.2, 1, (LIGHTS, 3)), np.full((LIGHTS, 3), -1.0)])
    current = _basis(make_basis).current_weights
    now = np.einsum("mnc,nc->m", rows, current)
    required = Requirements(rows, np.zeros(2), np.array([1.1 * now[0], 1.3 * now[1]]))
    live, _, problem = _painted(make_basis, Fit(space=space, hold=1.0), required=required)
    answer, losses = current, []
    for _ in range(30):
        answer = live.answer(answer)
        # Solves end within 1e-9 of a row's size.
        assert np.all(np.einsum("mnc,nc->m", rows, answer) >= required.least - 1e-6 * np.abs(now))
        losses.append(float(problem.objective(answer).sum()))
    assert losses[-1] < losses[0]


def _expect_kept_picture(live: LiveSolver, answer: Any, rounds: int) -> None:
    """Expect the picture of an answer, carried over so many rounds, to be the sum of all lights."""
    kept = live._many._pictures[answer.tobytes()]
    assert live._many._rows is not None
    expected = np.einsum("cnp,nc->cp", live._many._rows, answer)
    # Each round adds the roundings of weights and of a sum in float32.
    np.testing.assert_allclose(kept, expected, rtol=rounds * 2.0**-21)


@pytest.mark.usefixtures("moves_some")
def test_a_picture_is_carried_from_round_to_round(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(many_lights, "ROUNDS_PER_SUM", 8)
    picture_of, sums = many_lights._picture, []

    def counted(rows: Any, weights: Any) -> Any:
        sums.append(weights)
        return picture_of(rows, weights)

    monkeypatch.setattr(many_lights, "_picture", counted)
    live, _, problem = _painted(make_basis, Fit(space="display", hold=1.0))
    answer, [view], carried = problem.basis.current_weights, live._views, 0
    for k in range(30):
        region = slice(5 + k % 20, 10 + k % 20), slice(4, 20)
        view._image[region] *= 1 + 0.3 * (-1) ** k
        view.update(region)
        answer = live.answer(answer, while_painting=True)
        if answer.tobytes() in live._many._pictures:
            _expect_kept_picture(live, answer, 8)
            carried += 1
    assert carried > 20
    assert 3 < len(sums) < 12  # the first, the current lights', and one after eight rounds


@pytest.mark.usefixtures("moves_some")
def test_a_view_that_is_painted_later_has_a_picture_of_its_own(make_basis: Any) -> None:
    """The weights that a round begins with are the same; the pictures have more pixels."""
    basis = _basis(make_basis)
    views = [
        LiveView(basis, basis.current_look.copy(), np.zeros(SIZE, np.float32)) for _ in range(2)
    ]
    fit = _painted(make_basis, Fit(space="display", hold=1.0))[2].fit
    live, answer = LiveSolver(views, fit=fit, constraints=Constraints()), basis.current_weights
    for view in views:
        region = slice(5, 18), slice(4, 20)
        view._image[region] *= 2
        view._importance[region] = 1
        view.update(region)
        answer = live.answer(answer)
    assert live._many._rows is not None
    assert live._many._rows.shape[2] == 2 * views[0].film(None).rows.shape[2]
    _expect_kept_picture(live, answer, 1)


@pytest.mark.usefixtures("moves_some")
def test_a_round_moves_only_some_lights_and_other_rounds_the_others(make_basis: Any) -> None:
    live, _, problem = _painted(make_basis, Fit(space="display", hold=1.0))
    answer, moved = problem.basis.current_weights, set()
    for _ in range(12):
        following = live.answer(answer)
        changed = np.flatnonzero(~np.isclose(following, answer, rtol=1e-9).all(axis=1))
        assert len(changed) <= 5
        moved |= set(changed.tolist())
        answer = following
    assert len(moved) > 15


def test_the_unknowns_of_some_lights_are_those_that_they_have_among_all(make_basis: Any) -> None:
    basis = _basis(make_basis)
    constraints = Constraints.of(
        light={"light 2": {"limits": {"max": "40%"}}, "light 7": {"lock": True}},
        tie=[{"lights": ["light 3", "light 9"]}],
    )
    whole = reduce_to(constraints, basis.lights)
    some = SomeLights.of(whole, [9, 7, 2, 0], 4)
    assert some.lights.tolist() == [0, 2, 3, 9]  # the tie comes together, the locked one never
    assert some.put_back(some.reduction) is whole
    x = np.arange(len(some.reduction.unknowns)) / 10
    whole_x = np.zeros(len(whole.unknowns))
    whole_x[[i for k in some.places for i in whole.places[k]]] = x
    expected = whole.weights(whole_x)
    np.testing.assert_array_equal(some.reduction.weights(x), expected[some.lights])


def test_the_nearest_allowed_weights_are_found_a_few_lights_at_a_time(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = _basis(make_basis)
    constraints = Constraints.of(
        light={
            "light 2": {"limits": {"max": "40%"}},
            "light 7": {"lock": True},
            "light 8": {"color": [1.0, 0.8, 0.5]},
            "light 20": {"limits": {"min": 0.1, "max": 0.2}},
        },
        tie=[{"lights": ["light 3", "light 9", "light 21"]}],
    )
    reduction, rng = reduce_to(constraints, basis.lights), np.random.default_rng(0)
    power, weights = rng.uniform(0.1, 1, (LIGHTS, 3)), rng.uniform(-0.2, 1, (LIGHTS, 3))
    power[5], power[6, 1] = 0, 0  # a light that reaches nothing, and a channel of another
    together = linear_solve.nearest_allowed(power, reduction, weights)
    monkeypatch.setattr(linear_solve, "MANY_APART", 1)
    monkeypatch.setattr(some_lights, "KNOBS_APART", 4)
    apart = linear_solve.nearest_allowed(power, reduction, weights)
    # Both are optimal to 1e-12 of their scale.
    np.testing.assert_allclose(apart, together, rtol=1e-9, atol=1e-11)
    assert abs(apart - weights).max() > 0.1
