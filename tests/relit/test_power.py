"""The power of a verification, against how often an error in a light is truly found."""

import numpy as np
import pytest

from lightpaint.images.estimate import Estimate
from lightpaint.relit.verification import (
    ERROR,
    LightShares,
    Verification,
    compare,
    with_light_tests,
)

SIZE, SEEDS = (48, 64), range(100)


def estimate(truth: np.ndarray, sigma: float, rng: np.random.Generator) -> Estimate:
    """Return two halves with independent white noise, of that standard deviation in the mean."""
    noise = rng.normal(scale=sigma * 2**0.5, size=(2, *SIZE, 1))
    return Estimate.of_halves(*(truth + noise).astype(np.float32))


def lamp(strength: float, spread: float) -> np.ndarray:
    """Return the picture of a light around the middle, as wide as that part of the picture."""
    y, x = (np.linspace(-1, 1, n) for n in SIZE)
    picture = np.exp(-(y[:, None] ** 2 + x**2) / spread**2)
    return strength * np.repeat(picture[..., None], 3, axis=-1)


def judge(predicted: Estimate, verified: Estimate, light: Estimate) -> Verification:
    """Return a verification with the test of one light."""
    lights = LightShares.of_pictures(["lamp"], [light])
    return with_light_tests(compare(predicted, verified), predicted, lights)


def power(predicted: Estimate, verified: Estimate, light: Estimate) -> float:
    """Return the power for an error in one light."""
    return (judge(predicted, verified, light).power or {})["lamp"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("strength", "spread"),
    # Half of each sort is found by its sum, half by its pattern; the first and last hardly, always.
    [(0.2, 1.0), (0.8, 1.0), (1.2, 1.0), (9.0, 0.15), (26.0, 0.15), (60.0, 0.15)],
)
def test_as_many_errors_are_found_as_it_says(strength: float, spread: float):
    light, rest = lamp(strength, spread), np.full((*SIZE, 3), 0.5)
    detections, stated_powers = [], []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        predicted = estimate(rest + light, 0.2, rng)
        verified = estimate(rest + (1 - ERROR) * light, 0.2, rng)
        judged = judge(predicted, verified, estimate(light, 0.1, rng))
        detections.append(not judged.agrees)
        stated_powers.append((judged.power or {})["lamp"])
    expected = np.mean(stated_powers)
    # Four standard errors of a share of so many, and what two tests at once have in common.
    error = 4 * np.sqrt(max(expected * (1 - expected), 0.01) / len(SEEDS))
    assert np.mean(detections) == pytest.approx(expected, abs=error + 0.05)


def test_a_light_that_is_only_noise_is_not_seen():
    rng = np.random.default_rng(0)
    room = estimate(np.full((*SIZE, 3), 0.5), 0.1, rng)
    second = estimate(np.full((*SIZE, 3), 0.5), 0.1, rng)
    assert power(room, second, estimate(np.zeros((*SIZE, 3)), 1.0, rng)) < 1e-3


def test_without_noise_all_is_seen():
    room = Estimate(lamp(1, 1).astype(np.float32), np.zeros((*SIZE, 3), np.float32))
    assert power(room, room, room) == 1


def test_the_least_seen_comes_first():
    room = Estimate(lamp(1, 1).astype(np.float32), np.zeros((*SIZE, 3), np.float32))
    judged = compare(room, room)
    assert judged.unseen == ()
    object.__setattr__(judged, "power", {"sun": 0.49, "sky": 0.5, "bulb": 0.01})
    assert judged.unseen == ("bulb", "sun")
