"""The test of a verification for an error in one light: its z where all is true, and its power."""

from functools import cache
from statistics import NormalDist

import numpy as np
import pytest

from lightpaint.images.estimate import Estimate
from lightpaint.relit.verification import (
    ERROR,
    LIMIT,
    LightShares,
    detection_power,
    differences,
    largest_difference,
    light_tests,
    limit_of_tests,
)

SIZE, SEEDS = (40, 64), 250

#: Kinds of noise, and how many paths a pixel's half is like: smooth, skew, fireflies.
PATHS = {"smooth": 30.0, "skew": 1.0, "fireflies": 0.03}


def pictures() -> np.ndarray:
    """Return what three lights of different colours do, (n, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    colors = np.array([[1.0, 0.8, 0.6], [0.5, 0.7, 1.0], [0.9, 0.9, 0.9]])
    places = np.array([[0.2, 0.3], [0.8, 1.2], [0.4, 0.9]])
    pools = [np.exp(-6 * np.hypot(y - a, x - b)) + 0.02 for a, b in places]
    return np.stack([p[..., None] * c for p, c in zip(pools, colors, strict=True)])


def render(images: np.ndarray, paths: float, rng: np.random.Generator) -> list[Estimate]:
    """Return a render of each light, whose paths are few, so that noise is skew as in renders."""
    noise = rng.gamma(paths, 1 / paths, (len(images), 2, *SIZE, 1))
    return [
        Estimate.of_halves(*(x * n).astype(np.float32)) for x, n in zip(images, noise, strict=True)
    ]


def total(estimates: list[Estimate]) -> Estimate:
    """Return the sum of some renders."""
    images, halves = zip(*((x.image, x.half_difference) for x in estimates), strict=True)
    return Estimate(np.sum(images, axis=0), np.sum(halves, axis=0))


def shares(images: list[Estimate]) -> LightShares:
    """Return the lights of a prediction."""
    return LightShares.of_pictures([f"light {k}" for k in range(len(images))], images)


@cache
def found(kind: str, error_share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return z, (seeds, n), and power, (seeds, n), where the first light's render is off."""
    z, power = [], []
    images = pictures()
    true = images * np.array([1 + error_share, 1, 1])[:, None, None, None]
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        parts = render(images, 8 * PATHS[kind], rng)
        predicted, lights = total(parts), shares(parts)
        verified = total(render(true, PATHS[kind], rng))
        tests = light_tests(predicted, verified, lights.blocks, lights.noise)
        z.append(tests.z)
        stated_power = detection_power(predicted, verified, lights, tests, error=ERROR)
        power.append([stated_power[name] for name in lights.names])
    return np.array(z), np.array(power)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", list(PATHS))
def test_z_of_each_light_strays_no_further_than_a_normal_number_where_all_is_true(kind: str):
    z, _ = found(kind, 0.0)
    for z_of_light in z.T:
        # Four standard errors of a mean, of a standard deviation, and of shares of so many seeds.
        assert abs(z_of_light.mean()) < 4 / np.sqrt(SEEDS)
        assert 0.7 < z_of_light.std() < 1 + 4 / np.sqrt(2 * SEEDS)
        for limit in (1.64, 1.96, 2.58):
            tail = 2 * NormalDist().cdf(-limit)
            assert np.mean(np.abs(z_of_light) > limit) < tail + 4 * np.sqrt(tail / SEEDS)


def test_what_is_black_in_both_renders_says_nothing() -> None:
    """As below a stage: no light reaches the lower half, which is exactly 0."""
    rng = np.random.default_rng(1)
    images = pictures() + 1.0
    images[:, SIZE[0] // 2 :] = 0
    parts, verified = render(images, 2.0, rng), total(render(images, 2.0, rng))
    lights = shares(parts)
    tests = light_tests(total(parts), verified, lights.blocks, lights.noise)
    assert np.isfinite(tests.z).all()
    assert np.abs(tests.z).max() < LIMIT


def test_z_is_no_standard_normal_where_a_light_is_off():
    """A test above can see what it is for."""
    z, _ = found("smooth", ERROR)
    assert z[:, 0].mean() < -4
    assert abs(z[:, 1:].mean()) < 2


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "error"), [("smooth", 0.01), ("smooth", ERROR), ("skew", 0.15)])
def test_errors_in_a_light_are_found_as_often_as_the_sensitivity_says(kind: str, error: float):
    images, misses, stated_powers = pictures(), [], []
    true = images * np.array([1 - error, 1, 1])[:, None, None, None]
    for seed in range(150):
        rng = np.random.default_rng(seed)
        parts = render(images, 8 * PATHS[kind], rng)
        predicted, lights = total(parts), shares(parts)
        verified = total(render(true, PATHS[kind], rng))
        tests = light_tests(predicted, verified, lights.blocks, lights.noise)
        misses.append(tests.z[0])
        stated_powers.append(tests.mean(error)[0])
    # The mean of z is what is said: its scatter of 1, and some for what the error itself changes.
    room = 4 / np.sqrt(len(stated_powers)) + 0.05 * np.mean(stated_powers)
    assert np.mean(misses) == pytest.approx(np.mean(stated_powers), abs=room)


@pytest.mark.nightly
def test_looks_and_lights_alarm_no_more_often_than_is_stated():
    """Renders of growing length, looked at six times, each time by all tests."""
    single_limit, looks, runs = 2.5, 6, 250
    limit, alarms, careless = limit_of_tests(looks, once=single_limit), 0, 0
    images = pictures()
    tail = limit_of_tests(1, once=single_limit)
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        parts = render(images, 30.0, rng)
        predicted, lights = total(parts), shares(parts)
        halves = np.zeros((2, *SIZE, 3))
        beyond, wrongly = False, False
        for look in range(looks):
            growth = max(1, 2 ** (look - 1))
            second_render = total(render(images, 3.0 * growth, rng))
            halves += growth * np.stack(
                [
                    second_render.image + second_render.half_difference,
                    second_render.image - second_render.half_difference,
                ]
            )
            verified = Estimate.of_halves(*(halves / 2**look).astype(np.float32))
            tests = light_tests(predicted, verified, lights.blocks, lights.noise)
            z = dict(zip(lights.names, tests.z.tolist(), strict=True))
            z_values = differences(predicted, verified)
            beyond |= largest_difference(*z_values, z, limit=limit) > limit
            wrongly |= max(*map(abs, z_values[0]), z_values[1], *map(abs, z.values())) > tail
        alarms, careless = alarms + beyond, careless + wrongly
    # Three channels and the lights as one alarm either way, the pattern one way. A channel's noise
    # is of the same paths as another's, so it is less.
    stated = 9 * NormalDist().cdf(-single_limit)
    assert alarms / runs <= stated + 4 * np.sqrt(stated / runs)
    assert careless > 2 * alarms


def test_one_test_has_the_limit_and_many_lie_further_out():
    assert limit_of_tests(1) == pytest.approx(LIMIT, rel=1e-9)  # float64 in the tail
    assert limit_of_tests(12) > limit_of_tests(2) > LIMIT
    # One light's z counts as it is; one of many lights' for less, and at its limit for the limit.
    assert largest_difference([0, 0, 0], 0, {"lamp": -4.0}, limit=LIMIT) == pytest.approx(4)
    many = {f"light {k}": limit_of_tests(12) * (k == 7) for k in range(12)}
    assert largest_difference([0, 0, 0], 0, many, limit=LIMIT) == pytest.approx(LIMIT)
