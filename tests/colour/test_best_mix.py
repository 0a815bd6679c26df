"""Mixes of one colour by their Rf: beside colour-science, and beside many mixes by chance."""

from dataclasses import replace

import numpy as np
import pytest

from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.rendering_indices import MARGIN, MixFidelity, fidelity
from lightpaint.colour.spectrum import WAVELENGTHS, rgb_of_powers, spectrum_of

#: Peak and width in nanometres, and watts.
LEDS = {
    "red": (632, 8, 12),
    "green": (525, 14, 20),
    "blue": (455, 10, 14),
    "white": (575, 60, 9),
    "amber": (595, 8, 15),
    "lime": (555, 45, 8),
    "cyan": (500, 12, 22),
}
RGBW, RGBALC = ("red", "green", "blue", "white"), ("red", "green", "blue", "amber", "lime", "cyan")


def _lamp(names: tuple[str, ...], **fields: object) -> Lamp:
    emitters = []
    for name in names:
        peak, width, watts = LEDS[name]
        powers = np.exp(-0.5 * ((WAVELENGTHS - peak) / width) ** 2)
        spectrum = spectrum_of(WAVELENGTHS, powers)
        color = tuple((2 * rgb_of_powers(spectrum)).tolist())
        emitters.append(LampEmitter(name, color, watts=watts, spectrum=spectrum))
    return Lamp(tuple(emitters), **fields)


def _white(kelvin: float) -> np.ndarray:
    return np.asarray(kelvin_to_rgb(kelvin))


def _tried(lamp: Lamp, white: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return many mixes of a white, and their Rf."""
    corners = lamp.mixes(white)
    shares = np.random.default_rng(0).dirichlet(np.full(len(corners), 0.5), count)
    assert lamp.powers_at_full is not None
    model = MixFidelity.of(lamp.powers_at_full, corners[0])
    assert model is not None
    mixes = shares @ corners
    return mixes, model.rf(mixes)


@pytest.mark.parametrize("names", [RGBW, RGBALC])
@pytest.mark.parametrize("kelvin", [2700.0, 4500.0, 6500.0])
def test_many_mixes_have_the_rf_of_colour_science(names: tuple[str, ...], kelvin: float):
    lamp = _lamp(names)
    mixes, found = _tried(lamp, _white(kelvin), 12)
    expected = [fidelity(x @ lamp.powers_at_full) for x in mixes]
    # Colours of mixes that are one on finer wavelengths differ on 5 nm.
    assert found == pytest.approx(expected, abs=MARGIN)


def test_coloured_light_has_no_rf():
    lamp = _lamp(RGBW)
    assert MixFidelity.of(lamp.powers_at_full, np.array([1.0, 0, 0, 0])) is None
    assert MixFidelity.of(lamp.powers_at_full, np.zeros(4)) is None


@pytest.mark.parametrize("names", [RGBW, RGBALC])
@pytest.mark.parametrize("kelvin", [2700.0, 4500.0])
def test_the_best_is_no_worse_than_any_of_many(names: tuple[str, ...], kelvin: float):
    lamp, white = _lamp(names), _white(kelvin)
    best = lamp.best_rendering(white)
    assert lamp.mix(best) == pytest.approx(white, abs=1e-6)
    assert best.min() >= 0
    assert best.max() <= 1
    _, values = _tried(lamp, white, 3000)
    assert fidelity(best @ lamp.powers_at_full) >= values.max() - MARGIN


@pytest.mark.parametrize("names", [RGBW, RGBALC])
@pytest.mark.parametrize("least", [70.0, 85.0])
@pytest.mark.parametrize("prefer", ["watts", "white"])
def test_a_least_rf_costs_no_more_than_with_any_of_many(
    names: tuple[str, ...], least: float, prefer: str
):
    lamp, white = _lamp(names, least_rf=least, prefer=prefer), _white(3200.0)
    found = lamp.drives_for(white)
    assert lamp.mix(found) == pytest.approx(white, abs=1e-6)
    assert fidelity(found @ lamp.powers_at_full) >= least
    mixes, values = _tried(lamp, white, 3000)
    costs = lamp.emitter_costs
    cheapest = (mixes @ costs)[values >= least + MARGIN].min()
    size = abs(cheapest)
    assert found @ costs <= cheapest + 1e-6 * size
    # And not less than that of the lamp without it.
    plain = replace(lamp, least_rf=None).drives_for(white)
    assert found @ costs >= plain @ costs - 1e-9 * size


def test_out_of_reach_the_best_counts():
    lamp, white = _lamp(RGBW, least_rf=99.0), _white(3200.0)
    found = lamp.drives_for(white)
    best = lamp.best_rendering(white)
    assert fidelity(found @ lamp.powers_at_full) < 99
    assert found == pytest.approx(best, abs=1e-9)


def test_the_fewest_emitters_that_are_enough():
    lamp = _lamp(RGBALC, least_rf=80.0, prefer="fewest")
    found = lamp.drives_for(_white(3200.0))
    assert fidelity(found @ lamp.powers_at_full) >= 80
    assert (found > 0).sum() == 3


def test_a_brush_waits_for_no_search():
    assert not _lamp(RGBW, least_rf=85.0).while_painting.searches_rendering
    assert not _lamp(RGBW, prefer="rf").while_painting.searches_rendering
    assert _lamp(RGBW, prefer="white").while_painting.prefer == "white"
