"""The levels that a rig gets for drives: a table, a document for programs, a list of cues."""

import csv
import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any, Literal

from lightpaint.arrays import Position
from lightpaint.dmx import (
    ConsoleRig,
    DmxChannel,
    RigDrives,
    RigFixture,
    RigLight,
    aimed_rig,
    check_drives,
    encode_levels,
)
from lightpaint.relit.export.exports import plain_cell
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-dmx 1"] = "lightpaint-dmx 1"

#: The full level of a channel, whatever its bytes.
FULL_LEVEL = 65535

COLUMNS = ("cue", "label", "fade", "fixture", "channel", "value")


@dataclass(frozen=True)
class LevelRow:
    """A channel that a light sets.

    emitter: which it sets; `dimmer`, the name of a filter, x or y of a chromaticity, `kelvin` or
    `wheel` for one that sets several; pan or tilt of a head that is aimed, by the first light on
    it. drive: of the emitter, 0 to 1; None for several. universe: as the network numbers it.
    channels: 1 to 512, the channel of the coarse byte first. value: of all bytes. An emitter
    without a channel of its own has a row for its drive alone; of a wheel only the slot that is on.
    """

    fixture_id: str
    fixture: str
    light: str
    emitter: str
    drive: float | None
    universe: int | None
    channels: tuple[int, ...]
    value: int | None


#: What stands for an emitter in the rows of a dimmer, of a colour temperature, and of a wheel.
DIMMER, KELVIN, WHEEL = "dimmer", "kelvin", "wheel"


def light_channels(light: RigLight) -> list[tuple[str, int]]:
    """Return what a light sets, and the place of the channel among the channels of its fixture."""
    if not light.is_controlled:
        return []
    return [
        *((DIMMER, k) for k in (*light.masters, *light.dimmers)),
        *((name, k) for name, k in zip("xy", light.chromaticity, strict=False)),
        *((KELVIN, k) for k in light.whites),
        *((WHEEL, k) for k in (light.wheel.channels if light.wheel else ())),
        *((x.name, k) for x in light.filters for k in x.channels),
        *((x.name, k) for x in light.emitters for k in x.channels),
    ]


def level_rows(rig: ConsoleRig, drives: RigDrives, universes: Mapping[int, int]) -> list[LevelRow]:
    """Return a row for each channel that drives set. universes: of the network by the universes of
    the rig.

    All other channels of a fixture are at rest.
    """
    levels = encode_levels(rig, drives)
    return [row for fixture in rig.fixtures for row in _rows(fixture, drives, levels, universes)]


def _rows(
    fixture: RigFixture,
    drives: RigDrives,
    levels: Mapping[int, bytes],
    universes: Mapping[int, int],
) -> Iterator[LevelRow]:
    for light in fixture.lights:
        of_light = {x.name: drives.get(light.name, {}).get(x.name, 0.0) for x in light.emitters}
        named, set_by = (fixture.fixture_id, fixture.name, light.name), light_channels(light)
        for name, k in set_by:
            drive, setting = of_light.get(name), _setting(fixture, k, levels, universes)
            yield LevelRow(*named, name, drive, *setting)
        for name in sorted(of_light.keys() - {name for name, _ in set_by}):
            if light.has_slots_for_emitters and not of_light[name]:
                continue  # a slot that is not shown
            yield LevelRow(*named, name, of_light[name], None, (), None)
        for name, k in _aim_channels(fixture, light):
            yield LevelRow(*named, name, None, *_setting(fixture, k, levels, universes))


def _aim_channels(fixture: RigFixture, light: RigLight) -> list[tuple[str, int]]:
    """Return pan and tilt of the head of which a light is the first one, if it is aimed."""
    heads = [x for x in fixture.heads if fixture.is_aimed and x.lights[0] == light.name]
    return [(axis.name, axis.channel) for head in heads for axis in head.axes]


def _setting(
    fixture: RigFixture, place: int, levels: Mapping[int, bytes], universes: Mapping[int, int]
) -> tuple[int, tuple[int, ...], int]:
    """Return universe, channels and value of a row."""
    channel = fixture.channels[place]
    where = fixture.places(channel)
    numbers = tuple(index + 1 for _, index in where)
    return universes[where[0][0]], numbers, channel_level(fixture, channel, levels)


def channel_level(fixture: RigFixture, channel: DmxChannel, levels: Mapping[int, bytes]) -> int:
    """Return the level of a channel, of all its bytes, in levels of the rig's universes."""
    values = [levels[universe][index] for universe, index in fixture.places(channel)]
    return int.from_bytes(bytes(values), "big")


def level_csv(rows: list[LevelRow]) -> str:
    """Return a table with a line for each channel."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([field.name for field in fields(LevelRow)])
    table.writerows([[_cell(value) for value in astuple(row)] for row in rows])
    return text.getvalue()


def level_document(
    rig: ConsoleRig, drives: RigDrives, universes: Mapping[int, int]
) -> dict[str, Any]:
    """Return the rows and all 512 levels of each universe as plain values."""
    levels = encode_levels(rig, drives)
    names = [field.name for field in fields(LevelRow)]
    rows = level_rows(rig, drives, universes)
    return {
        "format": FORMAT,
        "lightpaint": __version__,
        "rig": rig.name,
        "channels": [dict(zip(names, astuple(row), strict=True)) for row in rows],
        "universes": {str(universes[number]): [*levels[number]] for number in levels},
    }


def level_json(rig: ConsoleRig, drives: RigDrives, universes: Mapping[int, int]) -> str:
    """Return the document as text."""
    document = level_document(rig, drives, universes)
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=2) + "\n"


def _cell(value: Any) -> str:
    match value:
        case None:
            return ""
        case tuple():
            return " ".join(map(str, value))
        case float():
            return f"{value:.9g}"
        case _:
            return plain_cell(str(value))


@dataclass(frozen=True)
class Cue:
    """A look with a name.

    fade_s: seconds to get there. directions: where its lights point, by name, if pan and tilt are
    to follow.
    """

    label: str
    fade_s: float
    drives: RigDrives
    directions: Mapping[str, Position] | None = None


def cue_list_csv(rig: ConsoleRig, cues: Sequence[Cue]) -> str:
    """Return a table of cues, counted from 1, with all channels that give light, and with pan and
    tilt of cues that have directions.

    A fixture goes by its id, or by its name if it has none; a channel by its attribute, after its
    geometry where a fixture has several. Values are 0 to 65535, whatever bytes a channel has.
    Raises RigError for drives that do not fit the rig.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    aimed = rig
    for number, cue in enumerate(cues, start=1):
        check_drives(rig, cue.drives)
        if cue.directions is not None:
            # From one cue to the next heads go the shortest way.
            aimed, _ = aimed_rig(aimed, cue.directions)
        levels = encode_levels(aimed, cue.drives)
        for fixture in aimed.fixtures:
            names = _channel_names(fixture)
            for channel in _set_channels(fixture):
                level = channel_level(fixture, channel, levels)
                value = round(level / channel.highest * FULL_LEVEL)
                words = (cue.label, fixture.fixture_id or fixture.name, names[channel])
                label, name, attribute = map(plain_cell, words)
                table.writerow((number, label, f"{cue.fade_s:g}", name, attribute, value))
    return text.getvalue()


def _set_channels(fixture: RigFixture) -> list[DmxChannel]:
    """Return the channels that a fixture's lights set, and axes that are aimed, in order."""
    used = {k for light in fixture.lights for _, k in light_channels(light)}
    if fixture.is_aimed:
        used |= {axis.channel for head in fixture.heads for axis in head.axes}
    return [fixture.channels[k] for k in sorted(used)]


def _channel_names(fixture: RigFixture) -> dict[DmxChannel, str]:
    counts = Counter(channel.attribute for channel in fixture.channels)
    return {
        channel: channel.attribute
        if counts[channel.attribute] == 1
        else f"{channel.geometry}.{channel.attribute}"
        for channel in fixture.channels
    }
