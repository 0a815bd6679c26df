"""Lightings between lightings, and lightings varied by a word."""

from typing import Any

import numpy as np
import pytest
from batches import small_basis
from hypothesis import assume, given
from hypothesis import strategies as st

from lightpaint.batch.manifest.keys import (
    SHIFTED_WORDS,
    SOLVED_WORDS,
    VARIATIONS,
    shift,
    vary,
)
from lightpaint.batch.manifest.sequence import OFF_STOPS, frame_position, interpolate
from lightpaint.colour.color import cct_and_duv, kelvin_to_rgb, luminance
from lightpaint.errors import LightingError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import DEFAULT_HOLD
from lightpaint.pipeline.job.settings import Settings

#: float64 through logarithms, cube roots and the inverse of a 3 x 3 matrix.
PRECISION = 1e-9

AMOUNT = st.floats(1e-3, 1e3)
WEIGHTS = st.lists(st.tuples(AMOUNT, AMOUNT, AMOUNT), min_size=3, max_size=3)
SHARE = st.floats(0, 1)


def lighting(weights: Any) -> Lighting:
    return Lighting.of_weights(small_basis(), np.array(weights, dtype=np.float64))


def emissions(lighting_: Lighting) -> Any:
    return np.array(list(lighting_.emission.values()))


@given(WEIGHTS, WEIGHTS, st.sampled_from(["log", "oklab"]))
def test_the_ends_are_the_lightings_themselves(one: Any, other: Any, space: Any) -> None:
    ends = [lighting(one), lighting(other)]
    for share, end in ((0.0, ends[0]), (1.0, ends[1])):
        np.testing.assert_array_equal(
            emissions(interpolate(ends, share, space=space)), emissions(end)
        )


@given(WEIGHTS, WEIGHTS, SHARE)
def test_in_stops_brightness_is_the_geometric_mean(one: Any, other: Any, share: float) -> None:
    ends = [lighting(one), lighting(other)]
    # Within OFF_STOPS stops of each other, beyond which the darker one is cut off.
    logs = np.log2(luminance(emissions(ends[0]))), np.log2(luminance(emissions(ends[1])))
    near = np.abs(logs[0] - logs[1]) < OFF_STOPS - 0.01
    mean_stops = np.log2(luminance(emissions(interpolate(ends, share, space="log"))))
    expected = (1 - share) * logs[0] + share * logs[1]
    np.testing.assert_allclose(mean_stops[near], expected[near], atol=1e-6)  # Duv of round trips


def test_red_to_blue_lamps_pass_no_green_and_whites_stay_white() -> None:
    red, blue = (3.0, 0.9, 0.0), (0.0, 0.9, 4.0)
    whites = [np.array(kelvin_to_rgb(kelvin)) for kelvin in (2200, 9000)]
    ends = [lighting([red, whites[0], red]), lighting([blue, 5 * whites[1], (0, 0, 0)])]
    for share in np.linspace(0.05, 0.95, 10):
        mixed, white, blackout = emissions(interpolate(ends, share, space="log"))
        # Channel by channel the first one is (0.3, 0.9, 0.1) somewhere on its way.
        assert mixed[1] < 0.9 * mixed.max()
        kelvin, duv = cct_and_duv(white)  # type: ignore[misc]
        assert abs(duv) < 1e-4
        assert 1e6 / kelvin == pytest.approx((1 - share) * 1e6 / 2200 + share * 1e6 / 9000, 1e-4)
        # A lamp that goes off keeps its colour to the end.
        np.testing.assert_allclose(blackout / blackout[0], np.array(red) / red[0], atol=PRECISION)


@given(WEIGHTS, st.floats(1e-3, 1e3), SHARE)
def test_the_colour_on_the_way_does_not_depend_on_brightness(
    one: Any, gain: float, share: float
) -> None:
    ends = [np.array(one), np.array(one)[::-1]]
    assume(np.ptp(np.log2(luminance(ends[0]))) < OFF_STOPS - abs(np.log2(gain)) - 0.01)
    hues = []
    for factor in (1.0, gain):
        colours = emissions(
            interpolate([lighting(ends[0]), lighting(factor * ends[1])], share, space="log")
        )
        hues.append(colours / luminance(colours)[:, None])
    np.testing.assert_allclose(*hues, atol=1e-6)


@given(WEIGHTS, st.floats(0.05, 0.95), st.sampled_from(["log", "oklab"]))
def test_there_and_back_are_the_same_frames(one: Any, share: float, space: Any) -> None:
    ends = [lighting(one), lighting(np.array(one)[::-1] * 1.5)]
    forwards = emissions(interpolate(ends, share, space=space))
    backwards = emissions(interpolate(ends[::-1], 1 - share, space=space))
    np.testing.assert_allclose(forwards, backwards, rtol=1e-6, atol=1e-9 * forwards.max())


@pytest.mark.parametrize("space", ["log", "oklab"])
def test_what_can_only_be_dimmed_stays_grey_and_what_is_off_comes_up(space: Any) -> None:
    ends = [
        lighting([[0.3] * 3, [0.0] * 3, [1, 0.5, 0]]),
        lighting([[7.0] * 3, [2.0] * 3, [0] * 3]),
    ]
    frames = [emissions(interpolate(ends, x, space=space)) for x in np.linspace(0, 1, 9)]
    for frame in frames:
        assert np.ptp(frame[0]) == np.ptp(frame[1]) == 0
        assert frame[2, 2] <= PRECISION
    for k in (0, 1):
        assert (np.diff([frame[k, 0] for frame in frames]) > 0).all()
    assert (np.diff([frame[2, 0] for frame in frames]) < 0).all()


def test_oklab_is_that_of_its_paper() -> None:
    # Ottosson 2020: the middle of white and black is the cube of half, in linear light.
    ends = [lighting(np.ones((3, 3))), lighting(np.zeros((3, 3)))]
    np.testing.assert_allclose(emissions(interpolate(ends, 0.5, space="oklab")), 1 / 8)


@given(st.integers(2, 200), st.integers(2, 9))
def test_frames_go_evenly_from_the_first_to_the_last(frames: int, keys: int) -> None:
    positions = [sum(frame_position(k, frames, keys)) for k in range(frames)]
    np.testing.assert_allclose(positions, np.linspace(0, keys - 1, frames), atol=PRECISION)
    firsts = [frame_position(k, frames, keys)[0] for k in range(frames)]
    assert min(firsts) == 0
    assert max(firsts) == keys - 2


def test_other_lights_are_refused() -> None:
    lit_lighting = lighting(np.ones((3, 3)))
    other = Lighting(lit_lighting.lights[:2])
    with pytest.raises(LightingError, match="of different lights"):
        interpolate([lit_lighting, other], 0.5, space="log")


@given(WEIGHTS, st.sampled_from(sorted(SHIFTED_WORDS)))
def test_warmer_is_as_bright_and_redder(weights: Any, word: str) -> None:
    before = lighting(weights)
    after = shift(before, SHIFTED_WORDS[word], dimmer_lights={"lamp 2"})
    original, other = emissions(before), emissions(after)
    np.testing.assert_allclose(luminance(other), luminance(original), rtol=PRECISION)
    np.testing.assert_array_equal(original[2], other[2])
    redder = np.log(other[:2, 0] / other[:2, 2]) - np.log(original[:2, 0] / original[:2, 2])
    assert (redder * SHIFTED_WORDS[word] >= -PRECISION).all()
    # A white of the middle of the range does turn.
    white = shift(lighting([[1.0, 0.8, 0.6]] * 3), SHIFTED_WORDS[word])
    ratio = emissions(white)[0, 0] / emissions(white)[0, 2]
    assert (ratio - 1 / 0.6) * SHIFTED_WORDS[word] > 0.1


def test_words_that_ask_for_another_solve() -> None:
    assert set(VARIATIONS) == {*SHIFTED_WORDS, *SOLVED_WORDS}
    settings, constraints = Settings(hold=2.0, unpainted=0.0), Constraints()
    assert vary("fewer lights", settings, constraints, 5)[1].sparse == 3
    assert vary("fewer lights", settings, constraints, 1)[1].sparse == 1
    sparse_constraints = Constraints.of(sparse=2)
    assert vary("fewer lights", settings, sparse_constraints, 12)[1].sparse == 2
    assert vary("white only", settings, constraints, 5)[0].colors == "white"
    assert vary("held harder", settings, constraints, 5)[0].hold == 8.0
    assert vary("held harder", Settings(unpainted=0.5), constraints, 5)[0].hold == 4 * DEFAULT_HOLD
