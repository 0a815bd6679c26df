"""The covariance of sums over pixels by the noise of a painting, beside that of many paintings."""

import numpy as np
import pytest

from lightpaint.arrays import Doubles
from lightpaint.images.neighbourhoods import film_filtered
from lightpaint.lighting.analysis.noise.noise_of_sums import covariance_of_sums

SIZE, SEEDS = (48, 64), 60
TOLERANCE = 4 * np.sqrt(2 / (10 * SEEDS))
Y, X = np.mgrid[: SIZE[0], : SIZE[1]]

#: A highlight of a few pixels, which is nearly all that tells the sums, and has most of the noise.
HIGHLIGHT = np.exp(-(np.square(Y - 20) + np.square(X - 30)) / 8)
FACTORS = np.stack([
    np.stack([(X - 30) * HIGHLIGHT + 0.01 * np.sin(X / 7)] * 3),
    np.stack([(Y - 20) * HIGHLIGHT, (Y - 20) * HIGHLIGHT, 0.01 * np.cos(Y / 5)]),
])  # fmt: skip
EVERYWHERE = np.ones(SIZE, bool)

#: Standard deviation of the noise of one path in all channels, and of a tenth of it in each.
DEVIATION = 0.02 + HIGHLIGHT


def paintings(*, is_filtered: bool) -> list[Doubles]:
    """Noise of renders, (3, h, w)."""
    noises = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        of_path, of_channels = rng.normal(size=(1, *SIZE)), rng.normal(size=(3, *SIZE))
        noise = DEVIATION * (of_path + 0.1 * of_channels)
        noises.append(np.stack([film_filtered(x) for x in noise]) if is_filtered else noise)
    return noises


@pytest.mark.parametrize("is_filtered", [False, True])
def test_the_variance_by_one_painting_is_that_of_its_noise(is_filtered: bool) -> None:
    """In closed form, where the pixels that count most are noisiest: a mean over a block would be
    far less."""
    # A filter of the noise is one of the factors.
    seen = [[film_filtered(x) for x in its] for its in FACTORS] if is_filtered else FACTORS
    missed = 0.3 * np.cos(X / 20 + Y / 30)  # smooth, as what lights cannot make
    found = np.mean(
        [
            covariance_of_sums(x + missed, np.zeros_like(x), FACTORS, EVERYWHERE)
            for x in paintings(is_filtered=is_filtered)
        ],
        axis=0,
    )
    for k, factors in enumerate(np.array(seen)):
        powers = np.square(factors.sum(axis=0)) + 0.01 * np.square(factors).sum(axis=0)
        true = float((np.square(DEVIATION) * powers).sum())
        # Four standard errors of a mean over `SEEDS` paintings, of ten pixels or so. Taps reach
        # beyond a highlight, and neighbours count as alike: a third either way.
        assert 0.65 * (1 - TOLERANCE) < found[k, k] / true < 1.35 * (1 + TOLERANCE)


def test_what_the_prediction_scatters_is_not_noise_of_the_painting() -> None:
    noises, halves = paintings(is_filtered=False), paintings(is_filtered=False)[::-1]
    alone, beside = (
        np.mean(
            [
                covariance_of_sums(x, share * half, FACTORS, EVERYWHERE)
                for x, half in zip(noises, halves, strict=True)
            ],
            axis=0,
        )
        for share in (0, 1)
    )
    # The difference of two estimates, where it is positive: far below each.
    assert np.trace(beside) < 0.5 * np.trace(alone)


def test_smooth_light_that_is_missing_and_small_films_have_no_noise() -> None:
    missed = np.stack([0.5 * np.cos(X / 20 + Y / 30)] * 3)
    power = np.square(np.einsum("qchw,chw->qhw", FACTORS, missed)).sum()
    covariance = covariance_of_sums(missed, 0 * missed, FACTORS, EVERYWHERE)
    assert np.trace(covariance) < 1e-5 * power
    small = (..., slice(4), slice(6))
    assert not covariance_of_sums(
        missed[small], missed[small], FACTORS[small], EVERYWHERE[small]
    ).any()


def test_borders_count_as_the_rest() -> None:
    """Paint on a half of the picture: taps over its edge tell nothing."""
    counted = X < 32
    noises = [0.1 * np.random.default_rng(seed).normal(size=(3, *SIZE)) for seed in range(SEEDS)]
    factors = np.ones((1, 3, *SIZE)) * counted
    found = [covariance_of_sums(x * counted, 0 * x, factors, counted)[0, 0] for x in noises]
    assert np.mean(found) == pytest.approx(0.01 * 3 * counted.sum(), rel=0.1)  # of 60 paintings
