"""Illuminance as a linear function of weights, its readings and their errors; no renderer."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lit_planes import plane_of

from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.errors import SceneError
from lightpaint.photometry.illuminance import Illuminance, MeasuringPlane, Ratio, Wishes
from lightpaint.photometry.readings_file import missed_wishes

LIGHTS = Lights(
    tuple(BasisLight(name, "point", "intensity", "W/sr", (1, 1, 1)) for name in ("a", "b"))
)


def illuminance(*values: np.ndarray, noise: float = 0.0, seed: int = 0) -> Illuminance:
    """Planes with these lx, half of them from each of two lights in green, with relative noise."""
    numbers = np.random.default_rng(seed)
    planes = tuple(
        plane_of([(k, 0, 0) for k in range(len(v))], name=f"p{j}") for j, v in enumerate(values)
    )
    matrix, halves = (np.zeros((sum(map(len, values)), 2, 3)) for _ in range(2))
    every = np.concatenate(values)
    error, half = noise * every * numbers.normal(size=(2, every.size))
    matrix[:, :, 1] = (every + error)[:, None] / 2
    halves[:, :, 1] = half[:, None] / 2
    return Illuminance(planes, LIGHTS, matrix, halves, 1.0)


ONE = np.ones((2, 3))


def test_lux_are_linear_in_the_weights() -> None:
    found = illuminance(np.array([1.0, 2, 3]), np.array([4.0]))
    np.testing.assert_allclose(found.of(ONE), [1, 2, 3, 4])
    weights = np.array([[5.0, 2, 5], [0, 1, 0]])
    np.testing.assert_allclose(found.of(weights), 1.5 * found.of(ONE))
    assert found.points_of("p1") == slice(3, 4)


def test_a_reading_has_mean_least_most_and_uniformity() -> None:
    reading = illuminance(np.array([100.0, 300, 500])).reading("p0", ONE)
    assert (reading.mean, reading.least, reading.most) == pytest.approx((300, 100, 500))
    assert reading.uniformity == pytest.approx(1 / 3)
    assert reading.points == 3
    assert (reading.mean_error, reading.uniformity_error, reading.least_bias) == (0, 0, 0)


def test_a_dark_plane_has_no_uniformity_and_no_error() -> None:
    reading = illuminance(np.zeros(4)).reading("p0", ONE)
    assert (reading.mean, reading.uniformity, reading.uniformity_error) == (0, 0, 0)


def test_stated_errors_are_those_of_the_noise() -> None:
    """Of 400 points with 3 % noise; the noise of an error pooled over them is 4 %, four times."""
    truth = np.linspace(200, 600, 400)
    found = illuminance(truth, noise=0.03)
    errors = found.standard_errors(ONE)
    assert np.sqrt(np.mean((errors / (0.03 * truth)) ** 2)) == pytest.approx(1.1, abs=0.26)
    reading = found.reading("p0", ONE)
    expected = 0.03 * np.sqrt((truth**2).sum()) / 400
    assert reading.mean_error == pytest.approx(expected, rel=0.16)
    assert abs(reading.mean - truth.mean()) < 4 * expected
    assert reading.mean_interval == pytest.approx(1.966 * reading.mean_error, rel=1e-3)


def test_one_point_has_a_wide_interval() -> None:
    reading = illuminance(np.array([100.0]), noise=0.01).reading("p0", ONE)
    assert reading.mean_interval == pytest.approx(12.706 * reading.mean_error, rel=1e-4)


@given(seed=st.integers(0, 1000), points=st.integers(2, 200))
def test_the_least_of_noisy_points_is_too_low_by_no_more_than_the_bound(
    seed: int, points: int
) -> None:
    """The expected minimum, over 200 seeds, of equal points: the largest bias that there is."""
    numbers = np.random.default_rng(seed)
    truth, noise = np.full(points, 100.0), 0.05
    least = (truth * (1 + noise * numbers.normal(size=(200, points)))).min(axis=1)
    bounds = [
        illuminance(truth, noise=noise, seed=seed * 1000 + k).reading("p0", ONE).least_bias
        for k in range(20)
    ]
    bias, error = 100 - least.mean(), least.std() / np.sqrt(200)
    assert bias > 0
    assert np.mean(bounds) > bias - 4 * error - 0.2 * bias


def test_a_point_that_is_clearly_darkest_has_no_bias() -> None:
    truth = np.array([100.0, *np.linspace(500, 600, 50)])
    assert illuminance(truth, noise=0.01).reading("p0", ONE).least_bias == 0


def wished(name: str, wishes: Wishes, value: float) -> tuple[MeasuringPlane, float]:
    points = plane_of([(0, 0, 0), (1, 0, 0)], name=name)
    return MeasuringPlane(
        name, points.points, points.normals, 1.0, 2.0, (1, 2), points.cells, wishes
    ), value


def test_wishes_that_are_missed_have_a_sentence_each() -> None:
    desk, _ = wished("desk", Wishes(mean=500, uniformity=0.6, most=550), 0)
    rest, _ = wished("rest", Wishes(mean=100, ratios=(Ratio("desk", 0.33),)), 0)
    matrix = np.zeros((4, 2, 3))
    matrix[:, 0, 1] = 200, 600, 120, 130
    found = Illuminance((desk, rest), LIGHTS, matrix, np.zeros_like(matrix), 1.0)
    assert missed_wishes(found, ONE) == [
        "desk: a mean of 400 lx, wished for 500",
        "desk: a uniformity of 0.50, wished for 0.6",
        "desk: up to 600 lx, wished for at most 550",
        "rest: 0.31 of the mean of desk, wished for 0.33",
    ]


def test_a_wish_is_missed_where_it_is_not_met_for_sure() -> None:
    """As by a solve: 505 lx ± 2 % are no 500 lx, and 515 are."""
    desk, _ = wished("desk", Wishes(mean=500, uniformity=0.9, most=530), 0)

    def found(lux: float, error: float) -> Illuminance:
        matrix, noise = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))
        matrix[:, 0, 1], noise[:, 0, 1] = lux, (error, -error)
        return Illuminance((desk,), LIGHTS, matrix, noise, 1.0)

    assert missed_wishes(found(515, 0.1), ONE) == []
    narrow = found(500, 5)
    reading = narrow.reading("desk", ONE)
    least = reading.mean - reading.mean_interval
    assert missed_wishes(narrow, ONE) == [
        f"desk: a mean of 500 lx (for sure at least {least:.4g}), wished for 500"
    ]
    wide = missed_wishes(found(520, 40), ONE)
    assert [text.partition(" (")[0] for text in wide] == [
        "desk: a mean of 520 lx",
        "desk: a uniformity of 1.00",
        "desk: up to 520 lx",
    ]


@pytest.mark.parametrize("weights", [np.ones(3), np.ones((1, 3)), 1.0])
def test_weights_of_another_shape_are_refused(weights: Any) -> None:
    with pytest.raises(SceneError, match=r"expected \(2, 3\), a row per light"):
        illuminance(np.ones(3)).of(weights)


def test_other_planes_are_refused() -> None:
    with pytest.raises(SceneError, match="no plane 'desk': there is p0"):
        illuminance(np.ones(3)).reading("desk", ONE)


def test_the_sure_end_has_as_many_digits_as_show_that_it_misses() -> None:
    """0.598 for sure is not 0.60 where 0.6 is wished for, nor 499.97 lx 500 lx."""
    desk, _ = wished("desk", Wishes(mean=500, uniformity=0.6), 0)
    matrix, noise = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))
    matrix[:, 0, 1], noise[:, 0, 1] = (390, 890), (2, -2)
    found = Illuminance((desk,), LIGHTS, matrix, noise, 1.0)
    reading = found.reading("desk", ONE)
    near = replace(desk, wishes=Wishes(uniformity=reading.uniformity - 1e-4))
    [text] = missed_wishes(replace(found, planes=(near,)), ONE)
    words = text.replace(")", "").split()
    asked, end = near.wishes.uniformity, float(words[words.index("least") + 1].rstrip(","))
    assert asked is not None
    assert end < asked <= reading.uniformity
