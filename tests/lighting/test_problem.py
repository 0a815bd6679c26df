"""A problem that is painted on is the one that its targets would have made."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.basis.basis import Basis
from lightpaint.colour.transform import ViewTransform
from lightpaint.errors import TargetError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solve import solution_of, solve
from lightpaint.target.target import Target

SIZE = (37, 41)
WHOLE = (slice(None), slice(None))


def _basis(make_basis: Any, seed: int = 0, size: tuple[int, int] = SIZE) -> Basis:
    rng = np.random.default_rng(seed)
    seen = np.zeros(size, bool)
    seen[2:5, 3:9] = True
    present = np.random.default_rng(99).random((4, 3))
    return make_basis(images=rng.random((4, *size, 3)) ** 2, emission=present, seen=seen)


def _target(seed: int, size: tuple[int, int] = SIZE, *, everything: bool = False) -> Target:
    rng = np.random.default_rng([seed, 1])
    importance = rng.random(size).astype(np.float32)
    image = rng.random((*size, 3)).astype(np.float32)
    ones = np.ones(size, np.float32)
    return Target("t", image, ones if everything else importance, everything=everything)


def _strokes(seed: int, count: int, size: tuple[int, int] = SIZE) -> list[tuple[Any, ...]]:
    """Rectangles with a colour, an importance, or both, and sometimes "at least"."""
    rng = np.random.default_rng([seed, 2])
    made = []
    for _ in range(count):
        top, left = rng.integers(0, size[0] - 1), rng.integers(0, size[1] - 1)
        region = (
            slice(int(top), int(rng.integers(top + 1, size[0] + 1))),
            slice(int(left), int(rng.integers(left + 1, size[1] + 1))),
        )
        shape = np.zeros(size)[region].shape
        image = rng.random((*shape, 3)).astype(np.float32) if rng.random() < 0.8 else None
        importance = rng.random(shape).astype(np.float32) if rng.random() < 0.5 else None
        at_least = rng.random((*shape, 3)) < 0.3 if rng.random() < 0.3 else None
        made.append((region, image, importance, at_least))
    return made


def _painted_by_hand(target: Target, seen: Any, strokes: list[tuple[Any, ...]]) -> Target:
    image, importance = target.image.copy(), target.importance.copy()
    if target.everything:
        importance[seen] = 0
    at_least = np.zeros(image.shape, bool) if target.at_least is None else target.at_least.copy()
    for region, colour, weight, brighter in strokes:
        for whole, part in ((image, colour), (importance, weight), (at_least, brighter)):
            if part is not None:
                whole[region] = part
    return replace(target, image=image, importance=importance, at_least=at_least, everything=False)


def _same_problem(one: Problem, other: Problem, *, rtol: float) -> None:
    for what in ("M", "b", "target_norm2"):
        a, b = getattr(one.equations, what), getattr(other.equations, what)
        np.testing.assert_allclose(a, b, rtol=rtol, atol=rtol * np.abs(b).max())
    for what in ("image", "weight", "share"):
        np.testing.assert_array_equal(getattr(one.squares, what), getattr(other.squares, what))
    assert type(one.loss) is type(other.loss)


@given(
    st.integers(0, 10_000),
    st.integers(1, 6),
    st.sampled_from([0.0, 0.3]),
    st.booleans(),
    st.sampled_from([None, ViewTransform("srgb")]),
)
def test_painting_is_a_rebuild(
    make_basis: Any,
    seed: int,
    count: int,
    unpainted: float,
    everything: bool,
    transform: ViewTransform | None,
) -> None:
    basis, target = _basis(make_basis), _target(seed, everything=everything)
    strokes = _strokes(seed, count)
    fit = Fit(unpainted=unpainted, transform=transform)
    problem = Problem.of(basis, target, fit=fit)
    for region, image, importance, at_least in strokes:
        problem = problem.painted(region, image, importance, at_least=at_least)
    by_hand = _painted_by_hand(target, basis.emitters_seen, strokes)
    rebuilt = Problem.of(basis, by_hand, fit=fit)
    # float64 sums of the same products in another order.
    _same_problem(problem, rebuilt, rtol=1e-12)
    # Bit for bit those of one stroke over all of it.
    at_once = Problem.of(basis, _target(seed + 1), fit=fit).painted(
        WHOLE, by_hand.image, by_hand.importance, at_least=by_hand.at_least
    )
    np.testing.assert_array_equal(problem.equations.M, at_once.equations.M)
    np.testing.assert_array_equal(problem.equations.b, at_once.equations.b)


@pytest.mark.parametrize("transform", [None, ViewTransform("srgb")])
@pytest.mark.parametrize(
    "asked", [{}, {"light 1": {"lock": True}}, {"*": {"kelvin": [2700, 6500]}}]
)
def test_the_answer_is_that_of_the_rebuilt_problem(
    make_basis: Any, asked: dict[str, Any], transform: ViewTransform | None
) -> None:
    basis, target, strokes = _basis(make_basis), _target(3), _strokes(5, 5)
    constraints = Constraints.of(asked)
    fit = Fit(unpainted=0.1, transform=transform)
    problem = Problem.of(basis, target, constraints=constraints, fit=fit)
    for region, image, importance, at_least in strokes:
        # As a painter does: from the answer before the stroke.
        solution = solution_of(problem)
        problem = solution.problem.painted(region, image, importance, at_least=at_least)
    by_hand = _painted_by_hand(target, basis.emitters_seen, strokes)
    expected = solve(basis, by_hand, constraints=constraints, unpainted=0.1, transform=transform)
    found = solution_of(problem)
    # Of one convex problem; in display space as near as rounds end.
    np.testing.assert_allclose(found.weights, expected.weights, atol=1e-5 if transform else 1e-7)


def test_undoing_a_stroke_gives_back_the_bits(make_basis: Any) -> None:
    basis, target = _basis(make_basis), _target(1)
    region = (slice(5, 30), slice(2, 19))
    begun = Problem.of(basis, target).painted(region, target.image[region])
    before = begun.equations
    stroke = begun.painted(region, [1.0, 0.5, 0.2], 1.0)
    undone = stroke.painted(region, target.image[region], target.importance[region])
    for what in ("M", "b", "target_norm2"):
        assert getattr(undone.equations, what).tobytes() == getattr(before, what).tobytes()
    assert stroke.equations.M.tobytes() != before.M.tobytes()


def test_strokes_in_several_views(make_basis: Any) -> None:
    sizes = [(20, 30), (31, 17)]
    bases = [_basis(make_basis, k, size) for k, size in enumerate(sizes)]
    targets = [_target(k, size) for k, size in enumerate(sizes)]
    strokes = [_strokes(7 + k, 3, size) for k, size in enumerate(sizes)]
    problem = Problem.of(bases, targets, fit=Fit(unpainted=0.2))
    for k in (0, 1):
        for region, image, importance, at_least in strokes[k]:
            problem = problem.painted(region, image, importance, at_least=at_least, view=k)
    by_hand = [
        _painted_by_hand(t, b.emitters_seen, s)
        for t, b, s in zip(targets, bases, strokes, strict=True)
    ]
    _same_problem(problem, Problem.of(bases, by_hand, fit=Fit(unpainted=0.2)), rtol=1e-12)


def test_what_was_painted_on_is_not_painted_on_again(make_basis: Any) -> None:
    basis, target = _basis(make_basis), _target(2)
    problem = Problem.of(basis, target)
    region = (slice(0, 9), slice(0, 9))
    first = problem.painted(region, [1, 0, 0])
    first.painted(region, [0, 1, 0])
    with pytest.raises(ValueError, match="painted on already"):
        first.painted(region, [0, 0, 1])
    # The problem before the first stroke has pixels of its own, as the caller's target has.
    np.testing.assert_array_equal(problem.squares.image, target.image)
    problem.painted(region, [0, 0, 1])


@pytest.mark.parametrize(
    "stroke",
    [
        {"image": np.ones((3, 3, 3))},
        {"image": [np.nan, 0, 0]},
        {"importance": -1.0},
        {"importance": np.inf},
        {"importance": np.nan},
        {"importance": np.ones((9, 8))},
        # What fits beside what does not: not even the next stroke finds any of it.
        {"image": np.ones((9, 9, 4)), "importance": 0.5},
        {"image": [1, 1, 1], "importance": 0.5, "region": (slice(3, 0, -1), slice(0, 3))},
        {"image": [1, 1, 1], "importance": 0.5, "at_least": np.ones((2, 2, 3), bool)},
    ],
)
def test_a_stroke_that_does_not_fit_changes_nothing(
    make_basis: Any, stroke: dict[str, Any]
) -> None:
    basis, target = _basis(make_basis), _target(4)
    region = (slice(0, 9), slice(0, 9))
    problem = Problem.of(basis, target).painted(region, [0.5, 0.5, 0.5])
    with pytest.raises(ValueError):  # noqa: PT011 (numpy's words for what does not fit)
        problem.painted(**{"region": region, **stroke})
    nowhere = (slice(0, 0), slice(0, 0))
    for there in (nowhere, (slice(1, 2), slice(1, 2))):
        untouched = Problem.of(basis, target).painted(region, [0.5, 0.5, 0.5])
        untouched = untouched.painted(there, [0.1, 0.2, 0.3], 1.0)
        problem = problem.painted(there, [0.1, 0.2, 0.3], 1.0)
        assert problem.equations.M.tobytes() == untouched.equations.M.tobytes()
        assert problem.equations.b.tobytes() == untouched.equations.b.tobytes()


def test_what_is_no_target(make_basis: Any) -> None:
    with pytest.raises(TargetError, match="give what read_target returns"):
        Problem.of(_basis(make_basis), "evening.exr")  # type: ignore[arg-type]
