"""A lighting as fixtures: what a console is sent makes the light again, as far as 8 bits go."""

import csv
import json
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.relit.export.fixtures import (
    COLUMNS,
    FULL,
    dmx_of,
    fixtures_csv,
    fixtures_json,
    fixtures_of,
)

AMOUNT = st.floats(0, 100)


def light(name: str, emission: Any, unit: str = "W/sr", **fields: Any) -> LightSetting:
    rgb = tuple(map(float, emission))
    return LightSetting(name, "point", "intensity", unit, rgb, rgb, **fields)  # type: ignore[arg-type]


@given(st.tuples(AMOUNT, AMOUNT, AMOUNT), st.floats(0.001, 100))
def test_what_is_sent_is_the_light_within_half_a_code_of_each(emission: Any, more: float) -> None:
    brightest = max(emission)
    full = brightest + more
    sent = dmx_of(emission, full)
    dimmer = sent.dimmer / FULL * full
    assert abs(dimmer - brightest) <= 0.5 / FULL * full * (1 + 1e-12)
    colour = np.array([sent.red, sent.green, sent.blue]) / FULL
    if brightest > 0:
        assert np.abs(colour * brightest - emission).max() <= 0.5 / FULL * brightest * (1 + 1e-12)
        assert max(sent.red, sent.green, sent.blue) == FULL
    else:
        assert (sent.dimmer, *colour) == (0, 0, 0, 0)


def test_the_brightest_of_a_unit_is_at_full_and_what_is_kept_is_sent_nothing() -> None:
    warm = 3 * np.asarray(kelvin_to_rgb(3000.0))
    lights = (
        light("key", warm, unit_flux=(4 * np.pi,) * 3, members=("a", "b")),
        light("fill", 0.5 * warm),
        light("panel", (0.1, 0.1, 0.1), unit="W/(m² sr)"),
        light("off", (0, 0, 0)),
        light("rest", (1, 1, 1), is_fixed=True),
    )
    lighting = Lighting(lights, cd_per_unit=100.0)
    key, fill, panel, dark, rest = fixtures_of(lighting)
    assert [x.dmx.dimmer for x in (key, fill, panel, dark) if x.dmx] == [255, 128, 255, 0]
    assert rest.dmx is None
    assert key.kelvin is not None
    assert abs(key.kelvin - 3000) < 1  # of Planck's locus at 3000 K
    # Lumen: 4π of the intensity times the scale, by luminance.
    expected = 4 * np.pi * 100 * float(luminance(warm))
    assert key.lumen is not None
    np.testing.assert_allclose(key.lumen, expected, rtol=1e-12)
    rows = list(csv.DictReader(fixtures_csv(lighting).splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert [row["fixture"] for row in rows] == ["key", "fill", "panel", "off", "rest"]
    assert rows[0]["emitters"] == "a b"
    assert (rows[1]["lumen"], rows[4]["dmx_red"], rows[3]["kelvin"]) == ("", "", "")
    assert float(rows[0]["luminance"]) == float(f"{luminance(warm):.9g}")
    document = json.loads(fixtures_json(lighting))
    assert document["fixtures"][1]["dmx"]["dimmer"] == 128
    assert document["cd_per_unit"] == 100


def test_no_name_is_a_formula() -> None:
    lighting = Lighting((light("=1+1", (1, 1, 1)), light('"a",\n', (1, 1, 1))))
    rows = list(csv.reader(fixtures_csv(lighting).splitlines(keepends=True)))
    assert rows[1][0] == "'=1+1"
    assert rows[2][0] == '"a",\n'
