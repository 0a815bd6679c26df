"""A lighting as a list of fixtures: colour, kelvin, lumen, and DMX for each channel.

Lamps of emitters have the drive and the level of each of these instead of DMX values for red, green
and blue.

The list is independent of programs and displays: emissions are linear Rec.709 in the scene's own
unit, the emission of a projector as the irradiance of a plane at distance 1. DMX values, 0 to 255,
are for fixtures with linear response: the colour with its brightest channel at full, and a dimmer.
The fixture with the brightest channel among those with the same unit has its dimmer at full.
"""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

import numpy as np

from lightpaint.arrays import RGB, Position
from lightpaint.colour import LampEmitter
from lightpaint.lighting import Lighting, LightSetting
from lightpaint.relit.export.exports import plain_cell
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-fixtures 1"] = "lightpaint-fixtures 1"

#: Largest code of a DMX channel.
FULL = 255


@dataclass(frozen=True)
class Dmx:
    """DMX values for a fixture: 0 to 255 each. red, green, blue: None for a lamp of emitters."""

    dimmer: int
    red: int | None
    green: int | None
    blue: int | None


@dataclass(frozen=True)
class EmitterDrive:
    """An emitter of a fixture at its drive, with the dimmer of the fixture at full.

    drive: 0 to 1. error: its standard error; None if unknown. level: of its channel of that many
    `bits`. coarse, fine: its first two bytes; fine is None for a channel of one byte.
    """

    name: str
    drive: float
    error: float | None
    bits: int
    level: int
    coarse: int
    fine: int | None


@dataclass(frozen=True)
class WheelSlot:
    """The slot at which a colour wheel is. delta_e: how far that is from the colour of the solve,
    in CIEDE2000; None where the slot was given.
    """

    slot: str
    delta_e: float | None


@dataclass(frozen=True)
class FixturePlace:
    """The place of a fixture, in scene units.

    x, y, z: its position; None at infinity. target_x, target_y, target_z: a point it points at.
    pan: degrees around the up axis, clockwise from above, starting at the scene's far side: −z if y
    is up, y if z is up. tilt: degrees from straight down. cutoff, beam: degrees from the axis of a
    spot. change: `moved`, `new` or "".
    """

    x: float | None = None
    y: float | None = None
    z: float | None = None
    target_x: float | None = None
    target_y: float | None = None
    target_z: float | None = None
    pan: float | None = None
    tilt: float | None = None
    cutoff: float | None = None
    beam: float | None = None
    change: str = ""


@dataclass(frozen=True)
class Fixture:
    """A light with its setting.

    red, green, blue: linear emission in `unit`. y: its luminance. lumen, luminous: None unless the
    lighting has an absolute scale. kelvin, duv, hex: None if undefined. dmx: None for fixed lights.
    emitters: its emitters in the scene. place: place of the emitter, if it has only one and the
    place is known. drives: of a lamp that mixes its light, in the order of its emitters. wheel: of
    a lamp with a colour wheel that is on.
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
    place: FixturePlace | None = None
    drives: tuple[EmitterDrive, ...] = ()
    wheel: WheelSlot | None = None


def fixtures_of(lighting: Lighting) -> list[Fixture]:
    """Return a fixture for every light of `lighting`, in the same order."""
    full = _full_levels([lighting])
    return [_fixture(lighting, light, full) for light in lighting.lights]


def _fixtures_by_frame(lighting: Lighting) -> dict[int, list[Fixture]]:
    """Return the fixtures at each frame of a shot, whose dimmers have one scale over all frames."""
    full = _full_levels([*lighting.by_frame.values()])
    return {
        frame: [_fixture(lit, light, full) for light in lit.lights]
        for frame, lit in lighting.by_frame.items()
    }


def _full_levels(lightings: Sequence[Lighting]) -> dict[str, float]:
    """Return the brightest channel of adjusted lights by unit, for which a dimmer is at full."""
    full: dict[str, float] = {}
    for light in (light for lighting in lightings for light in lighting.lights):
        if not light.is_fixed:
            full[light.unit] = max(full.get(light.unit, 0.0), *light.physical_emission)
    return full


def _fixture(lighting: Lighting, light: LightSetting, full: Mapping[str, float]) -> Fixture:
    light_photometry = lighting.photometry(light)
    dmx = None if light.is_fixed else dmx_of(light.physical_emission, full[light.unit])
    if light.lamp is not None:
        dmx = Dmx(FULL, None, None, None)
    return Fixture(
        light.name,
        light.members,
        light.unit,
        *light.physical_emission,
        light_photometry.y,
        light_photometry.hex,
        light_photometry.kelvin,
        light_photometry.duv,
        light_photometry.luminous,
        light_photometry.luminous_unit,
        light_photometry.flux_lm,
        dmx,
        _place_of(lighting, light),
        _drives_of(light),
        WheelSlot(light.slot, light.slot_delta_e) if light.slot else None,
    )


def _drives_of(light: LightSetting) -> tuple[EmitterDrive, ...]:
    """Return the drives of a lamp of emitters; none of another light."""
    if light.lamp is None:
        return ()
    return tuple(
        _emitter_drive(emitter, light.drives[emitter.name], light.drive_errors[emitter.name])
        for emitter in light.lamp.emitters
    )


def _emitter_drive(emitter: LampEmitter, drive: float, error: float | None) -> EmitterDrive:
    level = emitter.level(drive)
    coarse, *further = level.to_bytes(emitter.bits // 8, "big")
    fine = further[0] if further else None
    return EmitterDrive(emitter.name, drive, error, emitter.bits, level, coarse, fine)


def _place_of(lighting: Lighting, light: LightSetting) -> FixturePlace | None:
    by_name = {place.name: place for place in lighting.places}
    if len(light.members) > 1 or (place := by_name.get(light.members[0])) is None:
        return None
    x, y, z = place.position or (None, None, None)
    at_x, at_y, at_z = place.site.target or (None, None, None)
    pan, tilt = pan_and_tilt(place.direction, lighting.up) if place.direction else (None, None)
    change = "new" if place.new else "moved" if place.moved_from is not None else ""
    cone = place.cutoff, place.beam
    return FixturePlace(x, y, z, at_x, at_y, at_z, pan, tilt, *cone, change)


def pan_and_tilt(direction: Position, up: Position) -> tuple[float, float]:
    """Return pan and tilt in degrees, as in `FixturePlace`; straight down has a pan of 0."""
    axis, way = np.array(up), np.array(direction)
    forward = np.array([0.0, 0.0, -1.0]) if abs(axis[1]) > 0.5 else np.array([0.0, 1.0, 0.0])
    if abs(axis[0]) > 0.5:
        forward = np.array([0.0, 0.0, 1.0])
    right = np.cross(forward, axis)
    tilt = math.degrees(math.acos(float(np.clip(-way @ axis, -1, 1))))
    sideways, forward_part = float(way @ right), float(way @ forward)
    if math.hypot(sideways, forward_part) < 1e-6:
        return 0.0, tilt
    # Adding 0 removes the sign of a negative zero.
    return round(math.degrees(math.atan2(sideways, forward_part)), 6) + 0.0, tilt


def dmx_of(emission: RGB, full: float) -> Dmx:
    """Return the DMX values for an emission. full: the brightest channel for which the dimmer is
    255.
    """
    brightest = max(emission)
    if brightest <= 0 or full <= 0:
        return Dmx(0, 0, 0, 0)
    red, green, blue = (round(FULL * channel / brightest) for channel in emission)
    return Dmx(round(FULL * min(brightest / full, 1.0)), red, green, blue)


COLUMNS = (
    *("fixture", "emitters", "unit", "red", "green", "blue", "luminance", "hex", "kelvin", "duv"),
    *("luminous", "luminous_unit", "lumen", "dmx_dimmer", "dmx_red", "dmx_green", "dmx_blue"),
    *(field.name for field in fields(FixturePlace)),
)


#: Ends of the names of the columns of an emitter, and what they hold.
ENDS, DRIVE_KEYS = ("", "_coarse", "_fine"), ("drive", "coarse", "fine")

#: Columns of colour wheels.
WHEEL_COLUMNS = ("wheel_slot", "wheel_delta_e")


def fixtures_csv(lighting: Lighting) -> str:
    """Return a table with a line for each fixture; undefined numbers are empty cells.

    Of lights that change over a shot there are lines for each frame, whose number comes first.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    lamps = [light.lamp for light in lighting.lights if light.lamp is not None]
    names = [*dict.fromkeys(name for lamp in lamps for name in lamp.names)]
    columns = (*COLUMNS, *(plain_cell(f"drive_{name}{end}") for name in names for end in ENDS))
    if has_wheels := any(lamp.is_wheel for lamp in lamps):
        columns = (*columns, *WHEEL_COLUMNS)
    if not lighting.animation:
        table.writerows(
            [columns, *(_cells_of(x, names, has_wheels=has_wheels) for x in fixtures_of(lighting))]
        )
        return text.getvalue()
    table.writerow(("frame", *columns))
    for frame, fixtures in _fixtures_by_frame(lighting).items():
        rows = (_cells_of(x, names, has_wheels=has_wheels) for x in fixtures)
        table.writerows([[str(frame), *row] for row in rows])
    return text.getvalue()


def _cells_of(fixture: Fixture, emitters: Sequence[str], *, has_wheels: bool) -> list[str]:
    """Return the cells of a fixture's line. emitters: names of the emitters of all fixtures.
    has_wheels: whether one of these has a colour wheel.
    """
    record = asdict(fixture)
    by_name = {x["name"]: x for x in record.pop("drives")}
    drives = [by_name.get(name, {}).get(key) for name in emitters for key in DRIVE_KEYS]
    dmx_values = record.pop("dmx") or dict.fromkeys(("dimmer", "red", "green", "blue"))
    place = record.pop("place") or asdict(FixturePlace())
    wheel = record.pop("wheel") or dict.fromkeys(("slot", "delta_e"))
    record["emitters"] = " ".join(fixture.emitters)
    values = [*record.values(), *dmx_values.values(), *place.values(), *drives]
    return [_cell(x) for x in (*values, *(wheel.values() if has_wheels else ()))]


def fixtures_json(lighting: Lighting) -> str:
    """Return the fixtures as a JSON document, of lights that change also those of each frame."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "lightpaint": __version__,
        "target": lighting.target,
        "cd_per_unit": lighting.cd_per_unit,
        "fixtures": [asdict(fixture) for fixture in fixtures_of(lighting)],
    }
    if lighting.animation:
        document["frames"] = [
            {"frame": frame, "fixtures": [asdict(fixture) for fixture in fixtures]}
            for frame, fixtures in _fixtures_by_frame(lighting).items()
        ]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else plain_cell(str(value))
