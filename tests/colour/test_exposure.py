"""The exposure that pictures are shown at: metered, lamps in view left out, nights left dark."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import BasisFactory

from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.display.exposure import choose_exposure

SIZE = (60, 80)


def room(median: float, *, spread: float = 1.0) -> np.ndarray:
    """Return a grey picture, log-normal about its median, `spread` stops wide."""
    stops = np.random.default_rng(0).normal(0, spread, SIZE)
    return np.repeat((median * 2**stops)[..., None], 3, axis=-1)


def with_window(image: np.ndarray, light: float, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the picture with an emitter in its first rows, and where that is."""
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[: round(share * SIZE[0])] = True
    return np.where(emitter_mask[..., None], light, image), emitter_mask


def median_code(image: np.ndarray, stops: float) -> float:
    """Return the median light at that exposure, in stops from middle grey."""
    return float(np.log2(np.median(image) * 2**stops / 0.18))


@pytest.mark.parametrize("light", [20.0, 1000.0])
@pytest.mark.parametrize("share", [0.02, 0.1])
def test_a_window_in_view_does_not_darken_the_room(light: float, share: float):
    image, emitter_mask = with_window(room(0.15), light, share)
    assert choose_exposure(image, emitter_mask) == 0


@pytest.mark.parametrize("unit", [1e-3, 40.0, 1e4])
def test_a_room_in_any_unit_comes_to_middle_grey(unit: float):
    image, emitter_mask = with_window(room(0.2 * unit), 100 * unit, 0.05)
    # Exposed for its highlights, a picture of little contrast may be a stop brighter.
    assert 0 <= median_code(image[~emitter_mask], choose_exposure(image, emitter_mask)) <= 1.06


def test_where_nobody_knows_of_emitters_highlights_cost_a_stop_at_most():
    image, _ = with_window(room(200.0), 1e5, 0.05)
    assert median_code(image, choose_exposure(image)) == pytest.approx(-1, abs=0.06)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e3])
def test_a_night_with_a_lit_place_stays_a_night(unit: float):
    image = room(0.01)
    image[-3:] = 0.6  # what the lamp lights, not the lamp
    stops = choose_exposure(unit * image, np.zeros(SIZE, bool))
    assert median_code(unit * image, stops) < -2


def test_lamps_alone_are_metered_where_nothing_else_is_seen():
    image = np.full((*SIZE, 3), 100.0)
    assert choose_exposure(image, np.ones(SIZE, bool)) == choose_exposure(image) < 0


@pytest.mark.parametrize("bright", [0.03, 0.125, 0.3, 1.0, 1.4])
def test_an_ordinary_picture_is_shown_as_it_is(bright: float):
    assert choose_exposure(np.full((4, 4, 3), bright)) == 0


@pytest.mark.parametrize("bright", [1e-6, 0.01, 2.0, 1e6])
def test_a_picture_that_would_show_nothing_is_brought_back(bright: float):
    # A stop above middle grey, as nothing in it is brighter.
    stops = choose_exposure(np.full((4, 4, 3), bright))
    assert np.log2(bright * 2**stops / 0.36) == pytest.approx(0, abs=0.0501)


def test_black_has_no_exposure():
    assert choose_exposure(np.zeros((4, 4, 3))) == 0


def test_a_basis_says_where_emitters_are_and_light_groups_do_not(make_basis: BasisFactory):
    image, emitter_mask = with_window(room(0.8), 50.0, 0.05)
    basis = make_basis(images=np.repeat(image[None], 2, axis=0), seen=emitter_mask)
    assert meter_exposure(image, basis) == choose_exposure(image, emitter_mask)
    groups = replace(basis, origin=replace(basis.origin, halves=(0, 0)))
    assert meter_exposure(image, groups) == choose_exposure(image)
    doubled = np.concatenate([image.reshape(1, -1, 3)] * 2, axis=1)
    assert meter_exposure(doubled, basis, basis) == choose_exposure(image, emitter_mask)
