"""A lighting as a list of fixtures: colour, kelvin, lumen, and DMX for each channel.

The list is independent of programs and displays: emissions are linear Rec.709 in the scene's own
unit. DMX values, 0 to 255, are for fixtures of linear response: the colour with its brightest
channel at full, and a dimmer. The brightest channel of all fixtures of a unit has the dimmer at
full.
"""

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from lightpaint.arrays import RGB
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.exports import plain_cell
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-fixtures 1"] = "lightpaint-fixtures 1"

#: Codes of a DMX channel, less one.
FULL = 255


@dataclass(frozen=True)
class Dmx:
    """DMX values for a fixture: 0 to 255 each."""

    dimmer: int
    red: int
    green: int
    blue: int


@dataclass(frozen=True)
class Fixture:
    """A light with its setting.

    red, green, blue: linear emission in `unit`. y: its luminance. lumen, luminous: None
    unless the lighting has a scale. kelvin, duv, hex: None without such a colour. dmx: None for
    kept lights. emitters: its emitters in the scene.
    """

    name: str
    emitters: tuple[str, ...]
    unit: str
    red: float
    green: float
    blue: float
    y: float
    hex: str | None
    kelvin: float | None
    duv: float | None
    luminous: float | None
    luminous_unit: str
    lumen: float | None
    dmx: Dmx | None


def fixtures_of(lighting: Lighting) -> list[Fixture]:
    """Return a fixture for every light of `lighting`, in its order."""
    full: dict[str, float] = {}
    for light in lighting.lights:
        if not light.is_fixed:
            full[light.unit] = max(full.get(light.unit, 0.0), *light.emission)
    return [_fixture(lighting, light, full) for light in lighting.lights]


def _fixture(lighting: Lighting, light: LightSetting, full: Mapping[str, float]) -> Fixture:
    measured = lighting.photometry(light)
    dmx = None if light.is_fixed else dmx_of(light.emission, full[light.unit])
    return Fixture(
        light.name,
        light.members,
        light.unit,
        *light.emission,
        measured.y,
        measured.hex,
        measured.kelvin,
        measured.duv,
        measured.luminous,
        measured.luminous_unit,
        measured.flux_lm,
        dmx,
    )


def dmx_of(emission: RGB, full: float) -> Dmx:
    """Return the codes of an emission. full: of the brightest channel at 255."""
    brightest = max(emission)
    if brightest <= 0 or full <= 0:
        return Dmx(0, 0, 0, 0)
    red, green, blue = (round(FULL * channel / brightest) for channel in emission)
    return Dmx(round(FULL * min(brightest / full, 1.0)), red, green, blue)


COLUMNS = (
    *("fixture", "emitters", "unit", "red", "green", "blue", "luminance", "hex", "kelvin", "duv"),
    *("luminous", "luminous_unit", "lumen", "dmx_dimmer", "dmx_red", "dmx_green", "dmx_blue"),
)


def fixtures_csv(lighting: Lighting) -> str:
    """Return a line for each fixture; cells without a number are empty."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for fixture in fixtures_of(lighting):
        record = asdict(fixture)
        sent = record.pop("dmx") or dict.fromkeys(("dimmer", "red", "green", "blue"))
        record["emitters"] = " ".join(fixture.emitters)
        table.writerow([_cell(value) for value in (*record.values(), *sent.values())])
    return text.getvalue()


def fixtures_json(lighting: Lighting) -> str:
    """Return the fixtures as an object of JSON."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "lightpaint": __version__,
        "target": lighting.target,
        "cd_per_unit": lighting.cd_per_unit,
        "fixtures": [asdict(fixture) for fixture in fixtures_of(lighting)],
    }
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else plain_cell(str(value))
