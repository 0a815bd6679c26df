"""The loss of a search is that of columns without their noise."""

import numpy as np
import pytest

from lightpaint.arrays import Doubles, Floats
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.look_goals import LookGoal
from lightpaint.placement.placement_fit import PlacementFit, Slopes

PIXELS = 20_000
TRUE = np.random.default_rng(3).random((PIXELS, 3)) + 0.2


@pytest.fixture(name="rng")
def fixture_rng() -> np.random.Generator:
    """The same numbers for a test, whichever run before it."""
    return np.random.default_rng(4)


def fit_to(goal: Doubles, noise: Doubles | None = None) -> PlacementFit:
    """The fit of one light of any colour, black as yet. noise: half differences of the goal."""
    reduction = Reduction(np.zeros((1, 3)), ("",), (Knob.of_any_colour(0),))
    noise = np.zeros_like(goal) if noise is None else noise
    look = LookGoal(goal, np.ones_like(goal), reduction, None, noise)
    return PlacementFit(np.zeros((1, 2 * PIXELS, 3), np.float32), [look])


def column(rng: np.random.Generator, image: Doubles, noise: float) -> Floats:
    """A column of two halves of `image`, whose mean has noise of that deviation."""
    halves = image + np.sqrt(2) * noise * rng.normal(size=(2, *image.shape))
    parts = halves.mean(axis=0), (halves[0] - halves[1]) / 2
    return np.concatenate(parts).astype(np.float32)[None]


def test_a_noisy_true_column_misses_less_than_a_clean_false_one(rng: np.random.Generator) -> None:
    fit = fit_to(2 * TRUE)
    false = TRUE * (1 + 0.1 * rng.normal(size=TRUE.shape))
    clean, noisy = fit.fitted(column(rng, false, 0.0)), fit.fitted(column(rng, TRUE, 0.2))
    assert noisy.missed < 0.5 * clean.missed
    assert noisy.weights == pytest.approx(np.full((1, 3), 2.0), rel=0.02)  # noise: not too dim
    # What the noise of the halves' product leaves is as often above 0 as below.
    assert abs(noisy.missed) < 0.02 * fit.norm2


def test_noise_that_goal_and_column_share_is_none_of_the_residual(rng: np.random.Generator) -> None:
    """Where a picture is held to the current look, which is a sum of the columns themselves."""
    current = column(rng, TRUE, 0.2)
    image, half = current[0, :PIXELS], current[0, PIXELS:]
    fit = fit_to(2.0 * image, 2.0 * half)
    fitted = fit.fitted(current)
    assert fitted.weights == pytest.approx(np.full((1, 3), 2.0), rel=1e-6)
    assert abs(fitted.missed) < 1e-6 * fit.norm2
    other = fit.fitted(column(rng, TRUE, 0.2))
    assert other.weights == pytest.approx(np.full((1, 3), 2.0), rel=0.02)


def test_the_loss_of_pixels_sums_to_that_of_the_fit(rng: np.random.Generator) -> None:
    fit = fit_to(2 * TRUE)
    fitted = fit.fitted(column(rng, TRUE, 0.1))
    total = fit.missed_map(fitted.columns, fitted.weights).sum()
    assert total == pytest.approx(fitted.missed, abs=1e-6 * fit.norm2)  # float32 columns


def test_the_gradient_of_the_loss_is_that_of_finite_differences(rng: np.random.Generator) -> None:
    """Of a column that a number changes linearly, noise included, and that of the goal."""
    fit = fit_to(2 * TRUE, 0.1 * rng.normal(size=TRUE.shape))
    # Not at the truth, where float32 columns are too coarse for a gradient of nothing but noise.
    false = TRUE * rng.uniform(0.5, 1.5, TRUE.shape)
    start, slope = column(rng, false, 0.1), column(rng, rng.random((PIXELS, 3)), 0.1)

    def missed_energy(step: float) -> float:
        return fit.fitted(start + np.float32(step) * slope).missed

    _, gradient = fit.newton(fit.fitted(start), Slopes(slope, [0], [0]))
    step = 0.001
    assert -2 * gradient[0] == pytest.approx(
        (missed_energy(step) - missed_energy(-step)) / (2 * step), rel=1e-3
    )


def test_a_pixel_that_is_nothing_but_noise_is_left_out(rng: np.random.Generator) -> None:
    """Its noise would otherwise be taken off the loss of all the others."""
    fit, noisy = fit_to(2 * TRUE), column(rng, TRUE, 0.01)
    noisy[0, PIXELS + 7] = 20
    fitted = fit.fitted(noisy)
    assert fitted.missed < -0.01 * fit.norm2
    left_out = fit.noisy_pixels(fitted)
    assert np.flatnonzero(left_out).tolist() == [7]
    without = fit.without_pixels(left_out)
    assert abs(without.fitted(noisy).missed) < 1e-3 * fit.norm2
    assert not without.noisy_pixels(without.fitted(noisy)).any()


def test_the_gradient_along_other_paths_has_no_bias_by_noise(rng: np.random.Generator) -> None:
    """Slopes of one set of paths and the residual of another: 0 at the truth, on average."""
    fit = fit_to(2 * TRUE)
    change = rng.random((PIXELS, 3))
    start, there = column(rng, TRUE, 0.2), fit.fitted(column(rng, TRUE, 0.2))
    slope = column(rng, change, 0.2)
    slope += 0.5 * (start - column(rng, TRUE, 0.0))  # of the noise that the column has
    matrix, gradient = fit.newton(fit.fitted(start), Slopes(slope, [0], [0]), there)
    assert abs(gradient[0] / matrix[0, 0]) < 0.02  # noise


def test_the_fit_of_a_half_is_to_the_samples_of_that_half(rng: np.random.Generator) -> None:
    first, second = (TRUE + 0.1 * rng.normal(size=TRUE.shape) for _ in range(2))
    goal_halves = 2 * first, 2 * second
    fit = fit_to((goal_halves[0] + goal_halves[1]) / 2, (goal_halves[0] - goal_halves[1]) / 2)
    fit.columns = np.concatenate([(first + second) / 2, (first - second) / 2])[None]
    for sign, half in ((1, first), (-1, second)):
        alone = fit.of_half(sign)
        np.testing.assert_allclose(alone.columns[0, :PIXELS], half, atol=1e-12)
        # Half the samples have twice the variance.
        np.testing.assert_allclose(alone.columns[0, PIXELS:], 0.5**0.5 * (first - second))
        # Goal and column are the same but for the factor, and so is their noise.
        fitted = alone.fitted(alone.columns)
        assert fitted.weights == pytest.approx(np.full((1, 3), 2.0), rel=1e-9)
        assert abs(fitted.missed) < 1e-9 * fit.norm2
