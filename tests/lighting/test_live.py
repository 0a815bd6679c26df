"""What follows the brush is, after any strokes, what the painting as a whole would have made."""

from dataclasses import replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.appearance import held_answer
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit, resolve_for_targets
from lightpaint.lighting.live.live_solver import ANSWERS_PER_READING, LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.loss.painting import unpainted_weight_of
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.target.painted_target import Target

SIZES = (37, 41), (31, 17)
SUMS = ("M", "b", "target_norm2")


class _Brush:
    """Arrays that are painted on, of a basis in which an emitter is seen."""

    def __init__(self, make_basis: Any, seed: int, size: tuple[int, int]) -> None:
        rng = np.random.default_rng(seed)
        emitter_mask = np.zeros(size, bool)
        emitter_mask[2:5, 3:9] = True
        current = np.random.default_rng(99).random((4, 3))
        planes = rng.random((4, *size, 3)) ** 2
        self.basis: Basis = make_basis(images=planes, emission=current, seen=emitter_mask)
        self.image = self.basis.current_look.copy()
        self.importance = np.zeros(size, np.float32)
        self.view = LiveView(self.basis, self.image, self.importance)

    def stroke(self, rng: Any) -> None:
        """Paint a rectangle: a colour, an importance, or both, but never over the emitter."""
        height, width = self.importance.shape
        top, left = rng.integers(0, height - 1), rng.integers(0, width - 1)
        bottom, right = rng.integers(top + 1, height + 1), rng.integers(left + 1, width + 1)
        region = slice(int(top), int(bottom)), slice(int(left), int(right))
        kind = rng.choice(["colour", "importance", "both", "erase"])
        if kind in ("colour", "both"):
            self.image[region] = rng.random((*self.importance[region].shape, 3))
        if kind in ("importance", "both"):
            self.importance[region] = rng.random(self.importance[region].shape)
            self.importance[self.basis.emitters_seen] = 0
        if kind == "erase":
            self.importance[region] = 0
        self.view.update(region, with_importance=kind != "colour")

    @property
    def target(self) -> Target:
        """The whole painting, as somebody reads it from a file."""
        image, importance = self.image.copy(), self.importance.copy()
        return Target("t", image, importance, False, through_view=True, over_look=True)


def _paint_views(make_basis: Any, seed: int, views: int, count: int) -> list[_Brush]:
    brushes = [_Brush(make_basis, seed + k, SIZES[k]) for k in range(views)]
    rng = np.random.default_rng([seed, 2])
    for brush in brushes:
        brush.view.tiles().equations(1.0)
        for _ in range(count):
            brush.stroke(rng)
            if rng.random() < 0.5:
                brush.view.tiles().equations(1.0)
        if not brush.importance.any():
            brush.importance[10:20, 5:9] = 0.5
            brush.view.update((slice(10, 20), slice(5, 9)))
    return brushes


def _resolve_fit(targets: list[Target], **fit: Any) -> Fit:
    return resolve_for_targets(Fit(**fit), targets)


@given(
    st.integers(0, 10_000),
    st.integers(1, 6),
    st.integers(1, 2),
    st.sampled_from([{"unpainted": 0.0, "hold": 0.0}, {"unpainted": 0.3}, {"hold": 2.0}]),
)
def test_sums_under_a_brush_are_those_of_the_whole_problem(
    make_basis: Any, seed: int, count: int, views: int, fit: dict[str, float]
) -> None:
    brushes = _paint_views(make_basis, seed, views, count)
    targets = [brush.target for brush in brushes]
    resolved_fit = _resolve_fit(targets, space="linear", **fit)
    problem = Problem.of([brush.basis for brush in brushes], targets, fit=resolved_fit)
    rest = unpainted_weight_of(problem.views, resolved_fit)
    live = reduce(add, (brush.view.tiles().equations(rest) for brush in brushes))
    # ‖Ψ‖² is another constant: here paint and rest are two residuals of a pixel, there one.
    for name in ("M", "b"):
        live_sums, expected = getattr(live, name), getattr(problem.equations, name)
        # The current look, and 1 less what is painted, are in single precision.
        np.testing.assert_allclose(
            live_sums, expected, rtol=2e-6, atol=2e-6 * np.abs(expected).max()
        )


@given(st.integers(0, 10_000), st.integers(1, 6))
def test_no_stroke_leaves_a_trace_in_the_sums(make_basis: Any, seed: int, count: int) -> None:
    """What is painted has the bits of a view that begins with it; the rest but for round-off."""
    [brush] = _paint_views(make_basis, seed, 1, count)
    rebuilt = LiveView(brush.basis, brush.image, brush.importance)
    paint, rebuilt_sums = (view.tiles().equations(0.0) for view in (brush.view, rebuilt))
    paint_and_hold, both_anew = (view.tiles().equations(0.7) for view in (brush.view, rebuilt))
    for name in SUMS:
        assert getattr(paint, name).tobytes() == getattr(rebuilt_sums, name).tobytes()
        np.testing.assert_allclose(
            getattr(paint_and_hold, name), getattr(both_anew, name), rtol=1e-6
        )


def test_undoing_a_stroke_gives_back_the_bits(make_basis: Any) -> None:
    [brush] = _paint_views(make_basis, 1, 1, 4)
    before, region = brush.view.tiles().equations(0.0), (slice(5, 30), slice(2, 19))
    image, importance = brush.image[region].copy(), brush.importance[region].copy()
    brush.image[region], brush.importance[region] = (1.0, 0.5, 0.2), 1.0
    brush.view.update(region)
    stroke = brush.view.tiles().equations(0.0)
    brush.image[region], brush.importance[region] = image, importance
    brush.view.update(region)
    undone = brush.view.tiles().equations(0.0)
    for name in SUMS:
        assert getattr(undone, name).tobytes() == getattr(before, name).tobytes()
    assert stroke.M.tobytes() != before.M.tobytes()


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("fit", [{"hold": 1.0}, {"unpainted": 0.1, "colors": "free"}])
@pytest.mark.parametrize(
    "words", [{}, {"light 1": {"lock": True}}, {"light 0": {"limits": {"max": "40%"}}}]
)
def test_the_answer_under_a_brush_is_that_of_a_solve(
    make_basis: Any,
    monkeypatch: pytest.MonkeyPatch,
    words: dict[str, Any],
    fit: dict[str, Any],
    count: int,
) -> None:
    """Before it is held to the current lights, of which test_contrast.py has a test."""
    monkeypatch.setattr(held_answer, "PULLS", ())
    constraints = Constraints.of(light=words)
    brushes = _paint_views(make_basis, 5, count, 0)
    resolved_fit = _resolve_fit([brush.target for brush in brushes], space="linear", **fit)
    views = [brush.view for brush in brushes]
    live = LiveSolver(views, fit=resolved_fit, constraints=constraints, is_sketch=True)
    rng, answer = np.random.default_rng(3), brushes[0].basis.current_weights
    for _ in range(4):
        for brush in brushes:
            brush.stroke(rng)
            answer = live.answer(answer)
    targets = [brush.target for brush in brushes]
    bases = [brush.basis for brush in brushes]
    problem = Problem.of(bases, targets, constraints=constraints, fit=resolved_fit)
    assert problem.restraint is not None
    # Of one convex problem, whose sums agree in single precision.
    np.testing.assert_allclose(live.answer(answer), solution_of(problem).weights, atol=2e-5)


def test_wishes_and_gamuts_of_a_stroke_are_those_of_the_painting_soon_and_at_rest(
    make_basis: Any,
) -> None:
    [brush] = _paint_views(make_basis, 6, 1, 0)
    fit = _resolve_fit([brush.target], space="linear", colors="gentle", hold=1.0)

    def new_solver() -> LiveSolver:
        return LiveSolver([brush.view], fit=fit, constraints=Constraints(), is_sketch=True)

    live, start = new_solver(), brush.basis.current_weights
    live.answer(start, while_painting=True)
    brush.image[5:30, 5:30], brush.importance[5:30, 5:30] = (0.9, 0.5, 0.1), 1.0
    brush.importance[brush.basis.emitters_seen] = 0
    brush.view.update((slice(5, 30), slice(5, 30)))
    old = live.answer(start, while_painting=True)
    for _ in range(ANSWERS_PER_READING - 1):
        soon = live.answer(start, while_painting=True)
    expected = new_solver().answer(start)
    # Of one convex problem, in double precision; an old reading expects other lights.
    np.testing.assert_allclose(soon, expected, atol=1e-9)
    assert np.abs(old - expected).max() > 1e-3
    brush.image[5:30, 5:30] *= 0.5
    brush.view.update((slice(5, 30), slice(5, 30)), with_importance=False)
    live.answer(start, while_painting=True)
    np.testing.assert_allclose(live.answer(start), new_solver().answer(start), atol=1e-9)


def test_rounds_under_a_brush_come_to_the_answer_of_a_display(make_basis: Any) -> None:
    [brush] = _paint_views(make_basis, 8, 1, 5)
    resolved_fit = _resolve_fit([brush.target], space="display", hold=1.0)
    live = LiveSolver([brush.view], fit=resolved_fit, constraints=Constraints())
    answer = brush.basis.current_weights
    for _ in range(60):
        answer = live.answer(answer)
    problem = Problem.of(brush.basis, brush.target, fit=resolved_fit)
    exact = problem.objective(solution_of(problem).weights).sum()
    assert problem.objective(answer).sum() <= 1.001 * exact


@pytest.mark.parametrize("space", ["display", "linear"])
@pytest.mark.parametrize("views", [1, 2])
def test_planes_that_are_replaced_answer_as_if_they_had_been_there(
    make_basis: Any, space: Any, views: int
) -> None:
    """And what is not painted is held near the look of before."""
    brushes = _paint_views(make_basis, 5, views, 4)
    resolved_fit = _resolve_fit([brush.target for brush in brushes], space=space)
    live = LiveSolver([b.view for b in brushes], fit=resolved_fit, constraints=Constraints())
    start = live.answer(brushes[0].basis.current_weights)
    rebuilt_views = []
    for brush in brushes:
        basis, rng = brush.basis, np.random.default_rng(3)
        plane = rng.random((*basis.size, 3)).astype(np.float32) ** 2
        former = Estimate(basis.current_look, basis.current_noise)
        moved_basis = replace(
            basis, planes=MemoryPlanes(basis.images.copy()).replaced({1: plane}), former=former
        )
        brush.view.replace_planes(moved_basis, [1])
        rebuilt_views.append(LiveView(moved_basis, brush.image, brush.importance))
    live.follow_planes()
    rebuilt_solver = LiveSolver(rebuilt_views, fit=resolved_fit, constraints=Constraints())
    followed, expected = live.answer(start), rebuilt_solver.answer(start)
    np.testing.assert_allclose(followed, expected, rtol=1e-9, atol=1e-12)  # of float64 sums
    assert not np.allclose(followed, start)
