"""The map of a verification: an error shows, and what the render cannot tell is drawn neutral."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.primaries import to_8_bit
from lightpaint.images.estimate import Estimate
from lightpaint.relit.verification import LIMIT, Verification, compare
from lightpaint.report.answer_pictures import diverging
from lightpaint.report.page.figures import UNMEASURED, verification_picture

#: The left half is evenly lit; light finds the right half, a curtain, once in 128 samples.
SIZE, CURTAIN = (64, 96), np.s_[:, 48:]
HIT = 1 / 128
SIGMA = 0.1
BLOCK = np.s_[24:40, 8:24]


def half(rng: np.random.Generator, spp: int) -> Any:
    """Half of a render: noisy on the left, and mostly exactly 0 on the right."""
    image = 1 + rng.normal(scale=SIGMA / np.sqrt(spp), size=(*SIZE, 1))
    image[CURTAIN] = rng.binomial(spp, HIT, size=image[CURTAIN].shape) / (spp * HIT)
    return image.repeat(3, -1).astype(np.float32)


def renders(seed: int) -> tuple[Estimate, Estimate]:
    """A prediction of many samples, and a render of few."""
    rng = np.random.default_rng(seed)
    predicted, verified = (Estimate.of_halves(half(rng, spp), half(rng, spp)) for spp in (2048, 4))
    return predicted, verified


def raw_picture(verification: Verification) -> Any:
    """The map as it would be, if every difference were drawn."""
    return verification_picture(replace(verification, is_measured=None))[0]


def is_orange(picture: Any) -> Any:
    """Where the map says that the answer is brighter by four standard errors or more."""
    least = to_8_bit(diverging(np.array(4 / LIMIT)))
    return picture[..., 0] >= least[0]


@pytest.mark.parametrize("seed", range(10))
def test_where_most_samples_are_zero_the_map_is_neutral(seed: int):
    verification = compare(*renders(seed))
    assert verification.agrees
    assert verification.is_measured is not None
    picture, share = verification_picture(verification)
    # Two pixels from the border, where neighbours of both kinds are pooled.
    inner = picture[:, 50:]
    np.testing.assert_array_equal(
        inner, np.broadcast_to(to_8_bit(np.full(3, UNMEASURED)), inner.shape)
    )
    assert share == pytest.approx(0.5, abs=0.05)
    assert share == pytest.approx(1 - verification.is_measured.mean())
    # Pixels around which the render found no light at all would look like errors.
    assert is_orange(raw_picture(verification)[CURTAIN]).mean() > 0.05
    # What is lit is drawn as ever.
    np.testing.assert_array_equal(picture[:, :46], raw_picture(verification)[:, :46])


def test_an_error_in_what_is_lit_shows_beside_it():
    """So small that the render as a whole still agrees."""
    predicted, verified = renders(0)
    # Of two standard errors of a pixel, in one square.
    error = np.zeros((*SIZE, 1), np.float32)
    error[BLOCK] = 2 * SIGMA / np.sqrt(8)
    brighter = Estimate(predicted.image + error, predicted.half_difference)
    verification = compare(brighter, verified)
    assert verification.agrees
    picture, share = verification_picture(verification)
    assert share < 0.6
    inside, all_left = picture[BLOCK], picture[:, :46]
    neutral = to_8_bit(diverging(np.array(0.0)))
    assert np.median(inside[..., 0]) > neutral[0] + 10
    assert abs(np.median(all_left[..., 0]) - int(neutral[0])) < 10


def test_a_place_that_the_render_lacks_shows_although_no_sample_finds_light_there():
    """The prediction has so little noise that some should."""
    predicted, verified = renders(0)
    for part in (verified.image, verified.half_difference):
        part[BLOCK] = 0
    picture = verification_picture(compare(predicted, verified))[0]
    assert is_orange(picture[BLOCK]).all()


def test_of_a_render_that_disagrees_every_difference_is_drawn():
    predicted, verified = renders(0)
    dimmer = Estimate(verified.image.copy(), verified.half_difference)
    dimmer.image[:, :48] *= 0.5
    verification = compare(predicted, dimmer)
    assert not verification.agrees
    picture, share = verification_picture(verification)
    assert share == 0
    np.testing.assert_array_equal(picture, raw_picture(verification))


def test_what_is_black_in_both_is_no_question():
    predicted, verified = renders(0)
    for estimate in (predicted, verified):
        estimate.image[CURTAIN] = estimate.half_difference[CURTAIN] = 0
    measured = compare(predicted, verified).is_measured
    assert measured is not None
    assert measured[:, 50:].all()
    assert measured[:, :46].all()
