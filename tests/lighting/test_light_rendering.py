"""How lamps of a lighting render colours, and the table of their spectra."""

import csv
import math

import numpy as np
import pytest

from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.spectrum import WAVELENGTHS, black_body, rgb_of_powers
from lightpaint.errors import LightpaintError
from lightpaint.lighting.analysis.rendered_colors import renderings_of
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import read_constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.relit.formats import spectra_csv
from lightpaint.report.page.lights_table import rendering_numbers, rendering_section
from lightpaint.report.phrases import rendering_sentences
from lightpaint.target.painted_target import Target


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


#: Peaks of LEDs: nanometres, width and watts.
LEDS = {"red": (630, 12, 12), "green": (525, 16, 20), "blue": (455, 12, 14), "white": (575, 60, 60)}


def _toml(rf: float) -> str:
    emitters = []
    for name, (peak, width, watts) in LEDS.items():
        pairs = [[nm, round(math.exp(-0.5 * ((nm - peak) / width) ** 2), 6)] for nm in GRID]
        emitters.append(f'{{name = "{name}", spectrum = {pairs}, Y = 4, watts = {watts}}}')
    return f"[light.par]\nrf = {rf:g}\nemitters = [{', '.join(emitters)}]\n"


GRID = range(380, 781, 10)


@pytest.mark.parametrize("rf", [60.0, 99.0])
def test_a_lights_file_asks_for_an_rf_and_the_sentence_says_what_came(rf, make_basis, tmp_path):
    (tmp_path / "hall.lights.toml").write_text(_toml(rf))
    constraints = read_constraints(tmp_path / "hall.lights.toml")
    assert f"Rf ≥ {rf:g}" in repr(constraints)
    basis = make_basis(1, (4, 4), names=["par"])
    image = basis.mix(np.asarray(kelvin_to_rgb(3200.0))[None])
    target = Target("t", image, np.ones((4, 4), np.float32), everything=True)
    solution = solve(basis, target, constraints=constraints, literal=True)
    write_lighting(tmp_path / "a.json", solution.lighting)
    lighting = read_lighting(tmp_path / "a.json")
    assert lighting["par"].drives == solution.lighting["par"].drives
    plain = solve(basis, target, constraints=Constraints.of(_without_rf(constraints)), literal=True)
    # The picture is the same.
    assert lighting["par"].emission == plain.lighting["par"].emission
    found, before = (renderings_of(x)["par"] for x in (lighting, plain.lighting))
    assert found.color is not None
    assert before.color is not None
    assert found.plain_rf == pytest.approx(before.color.rf)
    assert found.plain_watts == pytest.approx(before.watts)
    [sentence] = rendering_sentences({"par": found})
    if rf == 60:
        assert 60 <= found.color.rf < 60.2
        expected = (
            f"par: Rf {found.color.rf:.1f}, as asked for. It takes {found.watts:.3g} W, instead"
        )
    else:
        expected = (
            f"par: Rf {found.color.rf:.1f} is the most these emitters give at this colour; 99 was "
            "asked for. It takes"
        )
    assert sentence.startswith(expected)
    assert sentence in rendering_section(lighting)
    numbers = rendering_numbers(lighting)
    assert numbers is not None
    assert numbers["par"]["wanted_rf"] == rf


def _without_rf(constraints: Constraints) -> dict:
    [(name, table, _)] = constraints.lights
    return {name: {key: value for key, value in table.items() if key != "rf"}}
