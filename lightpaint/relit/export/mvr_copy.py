"""A copy of a show (MVR) in which fixtures have the colours and places of an answer.

Only elements of fixtures change; all other files are copied as they are. pymvr would write a show
anew, in another order, and without what it does not know.
"""

import io
import uuid
import zipfile
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import REC709, luminance, rgb_to_xyz
from lightpaint.dmx import DESCRIPTION, KIND, MM, NamedFixture, named_fixtures, show_nodes
from lightpaint.lighting import Lighting
from lightpaint.scene.properties.site import EmitterPlace, rotation_between
from lightpaint.storage.rig_archive import RigArchive, reading

#: Unit of the emission of spots, which the fixtures of a rig are.
SPOT_UNIT = "W/sr"

#: Y of the brightest fixture.
FULL_Y = 100.0

#: x and y of a fixture that is dark.
DARK_XY = (0.3127, 0.3290)

#: Metres from a light to its new focus point, if it has no target.
FOCUS_DISTANCE = 5.0


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
    with RigArchive(path, path.name, KIND) as archive:
        root = archive.xml(DESCRIPTION)
        with reading(path.name):
            fixtures, _ = named_fixtures([*show_nodes(root)], path.name)
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


def _move(fixture: NamedFixture, place: EmitterPlace) -> None:
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
    rows = [*matrix[:3, :3].T, MM * matrix[:3, 3]]
    return "".join(f"{{{','.join(f'{x:.9g}' for x in row)}}}" for row in rows)


def _packed(archive: RigArchive, description: bytes) -> bytes:
    """Return the archive with another description."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new:
        for member in archive.members:
            own = copy(member)
            own.filename = archive.name_of(member)
            is_description = member.filename == DESCRIPTION
            new.writestr(own, description if is_description else archive.read(member.filename))
    return buffer.getvalue()
