"""Files for rigs: the levels that they get for drives, as a table, a document for programs, a list
of cues; and a copy of a show (MVR) in which fixtures have the colours and places of an answer.

Only elements of fixtures change; all other files are copied as they are. pymvr would write a show
anew, in another order, and without what it does not know.
"""

import csv
import io
import json
import uuid
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, Literal
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from lightpaint import dmx
from lightpaint.arrays import Doubles, Position
from lightpaint.colour import REC709, luminance, rgb_to_xyz
from lightpaint.lighting import Lighting
from lightpaint.relit.export.exports import plain_cell
from lightpaint.scene.properties.site import EmitterPlace, rotation_between
from lightpaint.storage.rig_archive import RigArchive, reading
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-dmx 1"] = "lightpaint-dmx 1"

#: The full level of a channel, whatever its bytes.
FULL_LEVEL = 65535

COLUMNS = ("cue", "label", "fade", "fixture", "channel", "value")

#: Unit of the emission of spots, which the fixtures of a rig are.
SPOT_UNIT = "W/sr"

#: Y of the brightest fixture.
FULL_Y = 100.0

#: x and y of a fixture that is dark.
DARK_XY = (0.3127, 0.3290)

#: Metres from a light to its new focus point, if it has no target.
FOCUS_DISTANCE = 5.0


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


def light_channels(light: dmx.RigLight) -> list[tuple[str, int]]:
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


def level_rows(
    rig: dmx.ConsoleRig, drives: dmx.RigDrives, universes: Mapping[int, int]
) -> list[LevelRow]:
    """Return a row for each channel that drives set. universes: of the network by the universes of
    the rig.

    All other channels of a fixture are at rest.
    """
    levels = dmx.encode_levels(rig, drives)
    return [row for fixture in rig.fixtures for row in _rows(fixture, drives, levels, universes)]


def _rows(
    fixture: dmx.RigFixture,
    drives: dmx.RigDrives,
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


def _aim_channels(fixture: dmx.RigFixture, light: dmx.RigLight) -> list[tuple[str, int]]:
    """Return pan and tilt of the head of which a light is the first one, if it is aimed."""
    heads = [x for x in fixture.heads if fixture.is_aimed and x.lights[0] == light.name]
    return [(axis.name, axis.channel) for head in heads for axis in head.axes]


def _setting(
    fixture: dmx.RigFixture, place: int, levels: Mapping[int, bytes], universes: Mapping[int, int]
) -> tuple[int, tuple[int, ...], int]:
    """Return universe, channels and value of a row."""
    channel = fixture.channels[place]
    where = fixture.places(channel)
    numbers = tuple(index + 1 for _, index in where)
    return universes[where[0][0]], numbers, channel_level(fixture, channel, levels)


def channel_level(
    fixture: dmx.RigFixture, channel: dmx.DmxChannel, levels: Mapping[int, bytes]
) -> int:
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
    rig: dmx.ConsoleRig, drives: dmx.RigDrives, universes: Mapping[int, int]
) -> dict[str, Any]:
    """Return the rows and all 512 levels of each universe as plain values."""
    levels = dmx.encode_levels(rig, drives)
    names = [field.name for field in fields(LevelRow)]
    rows = level_rows(rig, drives, universes)
    return {
        "format": FORMAT,
        "lightpaint": __version__,
        "rig": rig.name,
        "channels": [dict(zip(names, astuple(row), strict=True)) for row in rows],
        "universes": {str(universes[number]): [*levels[number]] for number in levels},
    }


def level_json(rig: dmx.ConsoleRig, drives: dmx.RigDrives, universes: Mapping[int, int]) -> str:
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
    drives: dmx.RigDrives
    directions: Mapping[str, Position] | None = None


def cue_list_csv(rig: dmx.ConsoleRig, cues: Sequence[Cue]) -> str:
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
        dmx.check_drives(rig, cue.drives)
        if cue.directions is not None:
            # From one cue to the next heads go the shortest way.
            aimed, _ = dmx.aimed_rig(aimed, cue.directions)
        levels = dmx.encode_levels(aimed, cue.drives)
        for fixture in aimed.fixtures:
            counts = Counter(channel.attribute for channel in fixture.channels)
            names = {
                channel: channel.attribute
                if counts[channel.attribute] == 1
                else f"{channel.geometry}.{channel.attribute}"
                for channel in fixture.channels
            }
            for channel in _set_channels(fixture):
                level = channel_level(fixture, channel, levels)
                value = round(level / channel.highest * FULL_LEVEL)
                words = (cue.label, fixture.fixture_id or fixture.name, names[channel])
                label, name, attribute = map(plain_cell, words)
                table.writerow((number, label, f"{cue.fade_s:g}", name, attribute, value))
    return text.getvalue()


def _set_channels(fixture: dmx.RigFixture) -> list[dmx.DmxChannel]:
    """Return the channels that a fixture's lights set, and axes that are aimed, in order."""
    used = {k for light in fixture.lights for _, k in light_channels(light)}
    if fixture.is_aimed:
        used |= {axis.channel for head in fixture.heads for axis in head.axes}
    return [fixture.channels[k] for k in sorted(used)]


@dataclass(frozen=True)
class ShowCopy:
    """The bytes of the copy, and the names of lights that it has no fixture for."""

    data: bytes
    left: tuple[str, ...]


def show_copy(path: Path, lighting: Lighting) -> ShowCopy:
    """Return the copy of the show at `path`.

    A colour is xyY, where the brightest fixture has a Y of 100. Raises RigError for a file that is
    not such a show.
    """
    emissions = _emissions(lighting)
    places = {x.name: x for x in lighting.places if x.moved_from is not None}
    with RigArchive(path, path.name, dmx.KIND) as archive:
        root = archive.xml(dmx.DESCRIPTION)
        with reading(path.name):
            fixtures, _ = dmx.named_fixtures([*dmx.show_nodes(root)], path.name)
            taken: set[str] = set()
            colors: dict[str, Doubles] = {}
            for fixture in fixtures:
                own = {x for x in emissions if _is_of(x, fixture.name)}
                taken |= own
                if own:
                    colors[fixture.name] = np.sum([emissions[x] for x in own], axis=0)
            brightest = max((float(luminance(x)) for x in colors.values()), default=0.0)
            for fixture in fixtures:
                if fixture.name in colors:
                    _set_text(fixture.node.element, "Color", _xyy(colors[fixture.name], brightest))
                if (place := places.get(fixture.name)) is not None:
                    _move(fixture, place)
        data = _packed(archive, tostring(root, encoding="UTF-8", xml_declaration=True))
    return ShowCopy(data, tuple(x for x in emissions if x not in taken))


def _emissions(lighting: Lighting) -> Mapping[str, Doubles]:
    """Return the emission of every adjusted emitter that may be a fixture."""
    return {
        member: np.array(light.emission, float)
        for light in lighting.lights
        if not light.is_fixed and light.unit == SPOT_UNIT
        for member in light.members
    }


def _is_of(light: str, fixture: str) -> bool:
    """Return whether a light is a fixture's, or one of its pixels."""
    return light == fixture or light.rpartition(" px")[0] == fixture


def _xyy(emission: Doubles, brightest: float) -> str:
    xyz, level = rgb_to_xyz(REC709) @ emission, float(luminance(emission))
    if level <= 0 or xyz.sum() <= 0:
        return f"{DARK_XY[0]},{DARK_XY[1]},0"
    x, y = xyz[:2] / xyz.sum()
    return f"{x:.6f},{y:.6f},{FULL_Y * level / brightest:.6f}"


def _set_text(element: Element, tag: str, text: str) -> None:
    child = element.find(tag)
    if child is None:
        child = SubElement(element, tag)
    child.text = text


def _move(fixture: dmx.NamedFixture, place: EmitterPlace) -> None:
    """Move a fixture as its light has moved; what has a focus point gets a new one."""
    old, node = place.moved_from, fixture.node
    assert old is not None
    motion = np.eye(4)
    is_turned = None not in (old.direction, place.direction)
    has_focus = bool(fixture.data.focus)
    if is_turned and not has_focus:
        assert old.direction is not None
        assert place.direction is not None
        motion[:3, :3] = rotation_between(old.direction, np.array(place.direction))
    if old.position is not None and place.position is not None:
        # About where the light was, to where it is.
        motion[:3, 3] = np.array(place.position) - motion[:3, :3] @ np.array(old.position)
    to_parent = np.linalg.inv(node.parent)
    _set_text(node.element, "Matrix", _matrix_text(to_parent @ motion @ node.matrix))
    if has_focus and place.position is not None and place.direction is not None:
        target = np.eye(4)
        target[:3, 3] = np.array(place.position) + FOCUS_DISTANCE * np.array(place.direction)
        name = str(uuid.uuid5(uuid.NAMESPACE_OID, f"{fixture.data.uuid} focus")).upper()
        point = SubElement(
            node.siblings, "FocusPoint", {"name": f"Focus {fixture.name}", "uuid": name}
        )
        _set_text(point, "Matrix", _matrix_text(to_parent @ target))
        SubElement(point, "Geometries")
        _set_text(node.element, "Focus", name)


def _matrix_text(matrix: Doubles) -> str:
    """Return a matrix as MVR has it: rows are axes, the last one the place in millimetres."""
    rows = [*matrix[:3, :3].T, dmx.MM * matrix[:3, 3]]
    return "".join(f"{{{','.join(f'{x:.9g}' for x in row)}}}" for row in rows)


def _packed(archive: RigArchive, description: bytes) -> bytes:
    """Return the archive with another description."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new:
        for member in archive.members:
            own = copy(member)
            own.filename = archive.name_of(member)
            is_description = member.filename == dmx.DESCRIPTION
            new.writestr(own, description if is_description else archive.read(member.filename))
    return buffer.getvalue()
