"""What other choices of colours come to is what solving with them does."""

from typing import Any, get_args

import numpy as np
import pytest

from lightpaint.lighting.analysis.appearance.answer_appearance import compare_appearance
from lightpaint.lighting.analysis.appearance.color_choices import MIN_SAMPLE, color_choices
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Colors
from lightpaint.target.painted_target import Target

SIZE = (20, 24)
GREEN = (0.15, 0.6, 0.2)


def _basis(make_basis: Any, *, size: tuple[int, int] = SIZE) -> Any:
    """Two overlapping white lamps."""
    height, width = size
    left = np.linspace(1, 0.1, width) * np.ones((height, 1))
    images = np.repeat(np.stack([left, left[:, ::-1]])[..., None], 3, axis=-1)
    return make_basis(images=images, names=["left", "right"], emission=[[0.3, 0.3, 0.3]] * 2)


def _target(size: tuple[int, int] = SIZE) -> Target:
    """Green on the left, with some of everything."""
    noise = np.random.default_rng(4).uniform(0.8, 1.2, (*size, 1))
    image = np.full((*size, 3), 0.3) * noise
    image[:, : size[1] // 2] = GREEN * noise[:, : size[1] // 2]
    return Target.of(image.astype(np.float32), name="green")


def _choices(solution: Any) -> Any:
    [choices] = color_choices(solution, [compare_appearance(solution).delta_e])
    return choices


@pytest.mark.parametrize("colors", get_args(Colors))
def test_choices_are_what_solving_with_them_gives(make_basis: Any, colors: Colors):
    """In linear light exactly: the equations are the same, and all paint is looked at."""
    basis, target = _basis(make_basis), _target()
    choices = _choices(solve(basis, target, colors=colors))
    assert [choice.colors for choice in choices] == list(get_args(Colors))
    assert [choice.colors for choice in choices if choice.is_chosen] == [colors]
    for choice in choices:
        other = solve(basis, target, colors=choice.colors)
        np.testing.assert_allclose(choice.weights, other.weights, rtol=1e-9, atol=1e-12)
        assert choice.delta_e == pytest.approx(compare_appearance(other).delta_e, rel=1e-4)


@pytest.mark.nightly
@pytest.mark.parametrize("colors", get_args(Colors))
def test_on_a_display_a_sample_of_the_pixels_says_nearly_the_same(make_basis: Any, colors: Colors):
    """Its own rounds end at a change of `ENOUGH`, far below a ΔE of 0.1."""
    size = (100, 110)
    basis, target = _basis(make_basis, size=size), _target(size)
    assert size[0] * size[1] > 2 * MIN_SAMPLE
    choices = _choices(solve(basis, target, colors=colors, space="display"))
    for choice in choices:
        other = compare_appearance(solve(basis, target, colors=choice.colors, space="display"))
        assert choice.delta_e == pytest.approx(other.delta_e, abs=0.1)


def test_the_light_that_would_change_its_hue(make_basis: Any):
    basis, target = _basis(make_basis), _target()
    free, gentle, white, own = _choices(solve(basis, target, colors="white"))
    assert white.is_chosen
    assert white.light == ""
    assert free.delta_e < gentle.delta_e < min(white.delta_e, own.delta_e)
    assert free.light == "left"
    assert free.color[1] > 2 * max(free.color[0], free.color[2])
    assert np.ptp(free.before) < 1


def test_where_colour_is_no_choice_nothing_is_told(make_basis: Any):
    basis, target = _basis(make_basis), _target()
    fixed = Constraints.of({"*": {"color": "#fff"}})
    assert _choices(solve(basis, target, constraints=fixed)) == ()
    locked = Constraints.of({"left": {"lock": True}, "right": {"off": True}})
    assert _choices(solve(basis, target, constraints=locked)) == ()
    red = make_basis(images=basis.images * [1, 0, 0], names=basis.names)
    assert _choices(solve(red, target)) == ()


def test_all_else_that_is_asked_stays(make_basis: Any):
    basis, target = _basis(make_basis), _target()
    constraints = Constraints.of({"right": {"lock": True}}, sparse=1)
    free, *_ = _choices(solve(basis, target, constraints=constraints, colors="white"))
    np.testing.assert_allclose(free.weights[1], 0.3, rtol=1e-6)
    # Of a choice of few lights, those that were chosen.
    few = Constraints.of(sparse=1)
    for choice in _choices(solve(basis, target, constraints=few)):
        assert choice.weights[0].any()
        assert not choice.weights[1].any()


def test_a_light_that_cannot_be_white_leaves_that_out(make_basis: Any):
    basis, target = _basis(make_basis), _target()
    limits = {"left": {"limits": {"min": [0.1, 0.1, 0.1], "max": [0.2, 0.9, 0.3]}}}
    choices = _choices(solve(basis, target, constraints=Constraints.of(limits)))
    assert "free" in [choice.colors for choice in choices]


def test_several_views_have_one_lighting_and_a_look_each(make_basis: Any):
    basis, target = _basis(make_basis), _target()
    plain = Target.of(np.full((*SIZE, 3), 0.3, np.float32), name="plain")
    solution = solve([basis, basis], [target, plain])
    each = [compare_appearance(view).delta_e for view in solution.views]
    choices = color_choices(solution, each)
    assert [[x.delta_e for x in view_choices if x.is_chosen] for view_choices in choices] == [
        [each[0]],
        [each[1]],
    ]
    for one, other in zip(*choices, strict=True):
        assert one.weights is other.weights
