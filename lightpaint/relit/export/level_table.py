"""The levels that a rig gets for drives, as a table for people and as a document for programs."""

import csv
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, fields
from typing import Any, Literal

from lightpaint.dmx.console_rig import ConsoleRig, DmxChannel, RigFixture
from lightpaint.dmx.levels import encode_levels
from lightpaint.dmx.rig_drives import RigDrives
from lightpaint.relit.export.exports import plain_cell
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-dmx 1"] = "lightpaint-dmx 1"


@dataclass(frozen=True)
class LevelRow:
    """A channel of a light: of its dimmer, or of an emitter.

    drive: of the emitter, 0 to 1; None for a dimmer, which several share. universe: as the network
    numbers it. channels: 1 to 512, that of the coarse byte first. value: of all bytes.
    """

    fixture_id: str
    fixture: str
    light: str
    emitter: str
    drive: float | None
    universe: int
    channels: tuple[int, ...]
    value: int


#: What stands for an emitter in the row of a dimmer.
DIMMER = "dimmer"


def level_rows(rig: ConsoleRig, drives: RigDrives, universes: Mapping[int, int]) -> list[LevelRow]:
    """Return a row for each channel that drives set. universes: of the network by those of the rig.

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
        of_light = drives.get(light.name, {})
        places: list[tuple[str, float | None, int]] = [(DIMMER, None, k) for k in light.dimmers]
        for emitter in light.emitters:
            of_emitter = of_light.get(emitter.name, 0.0)
            places += [(emitter.name, of_emitter, k) for k in emitter.channels]
        for name, drive, k in places:
            channel = fixture.channels[k]
            where = fixture.places(channel)
            yield LevelRow(
                *(fixture.fixture_id, fixture.name, light.name, name, drive),
                universes[where[0][0]],
                tuple(index + 1 for _, index in where),
                channel_level(fixture, channel, levels),
            )


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
