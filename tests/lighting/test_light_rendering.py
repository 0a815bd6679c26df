"""How lamps of a lighting render colours, and the table of their spectra."""

import csv

import numpy as np
import pytest

from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.spectra.spectrum import WAVELENGTHS, black_body, rgb_of_powers
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.light_rendering import renderings_of
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.relit.export.spectra_table import spectra_csv
from lightpaint.report.page.rendering_section import rendering_numbers, rendering_section


def _light(name: str, kelvin: float, drive: float, watts: float | None = 50) -> LightSetting:
    spectrum = black_body(kelvin)
    red, green, blue = (200 * rgb_of_powers(spectrum)).tolist()
    lamp = Lamp((LampEmitter("bulb", (red, green, blue), watts=watts, spectrum=spectrum),))
    rgb = (drive * red, drive * green, drive * blue)
    unit_flux = (0.5, 0.5, 0.5)
    return LightSetting(name, "spot", "intensity", "W/sr", rgb, rgb, unit_flux=unit_flux, lamp=lamp)


PLAIN = LightSetting("plain", "spot", "intensity", "W/sr", (1, 1, 1), (1, 1, 1))
LIGHTING = Lighting(
    (_light("warm", 2800, 0.5), _light("cold", 6500, 0, None), PLAIN), cd_per_unit=10
)


def test_a_black_body_renders_as_its_reference():
    [(name, found)] = renderings_of(LIGHTING).items()
    assert name == "warm"
    assert found.color is not None
    assert found.color.kelvin == pytest.approx(2800, abs=1)
    assert [found.color.ra, found.color.rf, found.color.rg] == pytest.approx([100] * 3, abs=0.05)
    # 100 units of intensity into half a steradian, 10 cd each, of 25 W.
    assert found.lm_per_w == pytest.approx(100 * 0.5 * 10 / 25, rel=1e-3)


def test_the_report_has_them():
    assert "2800 K" in rendering_section(LIGHTING)
    numbers = rendering_numbers(LIGHTING)
    assert numbers is not None
    assert set(numbers["warm"]) == {
        *("kelvin", "duv", "ra", "r9", "rf", "rg"),
        *("best_rf", "lm_per_w"),
    }
    nothing = Lighting((PLAIN,))
    assert rendering_section(nothing) == ""
    assert rendering_numbers(nothing) is None


def test_the_table_has_the_power_of_each_lamp():
    rows = list(csv.reader(spectra_csv(LIGHTING).splitlines()))
    assert rows[0] == ["nm", "warm", "cold"]
    table = np.array(rows[1:], float)
    np.testing.assert_array_equal(table[:, 0], WAVELENGTHS)
    np.testing.assert_allclose(table[:, 1], 100 * np.array(black_body(2800)), rtol=1e-3)
    assert not table[:, 2].any()
    with pytest.raises(LightpaintError, match="has no spectra"):
        spectra_csv(Lighting((PLAIN,)))
