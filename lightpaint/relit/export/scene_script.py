"""A Python script for Blender that sets the lights of a scene by name."""

import math
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from string import Template
from types import MappingProxyType
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Position
from lightpaint.colour.primaries import ACESCG, REC2020, from_rec709
from lightpaint.relit.export.program_axes import (
    SAME_PLACE,
    axis_conversions,
    blender_axes,
    conversion_of,
    has_new_cone,
    is_changed,
    old_position,
)
from lightpaint.scene.properties.site import EmitterPlace

#: Blender's quantity for each parameter of Mitsuba's emitters.
KINDS = {
    "radiance": "radiance",
    "intensity": "intensity",
    "irradiance": "irradiance",
}

#: Blender's type for each kind of new light.
LAMPS = {"point": "POINT", "spot": "SPOT", "panel": "AREA"}

#: Working spaces of Blender 5 other than Rec.709, by the names that it has for them in files.
WORKING_SPACES = {"lin_ap1_scene": ACESCG, "lin_rec2020_scene": REC2020}

#: Blender's up axis.
UP = (0.0, 0.0, 1.0)


def scene_script(
    target: str,
    source: str,
    emitters: Iterable[tuple[str, str, RGB]],
    *,
    places: Sequence[EmitterPlace] = (),
    up: Position = (0.0, 1.0, 0.0),
    skies: Mapping[str, str] = MappingProxyType({}),
    walls: Mapping[str, str] = MappingProxyType({}),
    slides: Mapping[str, tuple[Any, ...]] = MappingProxyType({}),
) -> str:
    """Return the script, which leaves emitters without a plain colour, such as a sky, to the user.

    emitters: name, Mitsuba's parameter and emission of each adjusted emitter. places: places of all
    emitters in the answer. up: the scene's up axis. skies, walls: file of the map of each sky, and
    of the image of each wall, by its name. slides: by name of a projector, file of its slide,
    position, rows of its axes, and half the width and height of the slide at distance 1.
    """
    rows, unset_names = [], []
    for name, parameter, emission in emitters:
        if parameter not in KINDS:  # a multiple, which gives no absolute value
            unset_names.append(name)
            continue
        numbers = ", ".join(f"{channel:.9g}" for channel in emission)
        rows.append(f"    {name!r}: ({KINDS[parameter]!r}, ({numbers})),\n")
    return filled_script(
        "set_scene.py.in",
        target=_in_docstring(target),
        source=_in_docstring(source),
        lights="{\n" + "".join(rows) + "}",
        left=repr(tuple(unset_names)),
        skies=_table(skies),
        walls=_table(walls),
        slides=_table(slides),
        sky_axes=repr(np.round(blender_axes(up), 12).tolist()),
        **_placed(places, up),
    )


def filled_script(name: str, **values: str) -> str:
    """Return a script for Blender from a template beside this module, with what all of them
    share.
    """
    folder = resources.files("lightpaint.relit.export")
    template, shared = (
        Template(folder.joinpath(x).read_text(encoding="utf-8"))
        for x in (name, "working_space.py.in")
    )
    spaces = {key: from_rec709(space).round(9).tolist() for key, space in WORKING_SPACES.items()}
    return template.substitute(values, working_space=shared.substitute(spaces=_table(spaces)))


def _placed(places: Sequence[EmitterPlace], up: Position) -> dict[str, str]:
    """Return the places in the form of the script, in the scene's axes."""
    rotations = axis_conversions(up, UP)
    own_conversion = conversion_of(places, [np.eye(3)], {})
    current = {place.name: old for place in places if (old := old_position(place)) is not None}
    moved_places, new_places = {}, {}
    for place in filter(is_changed, places):
        cone = _cone(place) if has_new_cone(place) else None
        if place.new:
            axes = own_conversion.frame(place).tolist()
            new_places[place.name] = (LAMPS[place.new], place.position, axes, cone, place.size)
        else:
            moved_places[place.name] = (place.position, place.direction, cone)
    return {
        "rotations": repr([np.round(rotation, 12).tolist() for rotation in rotations]),
        "present": _table(current),
        "same_place": repr(SAME_PLACE * own_conversion.size),
        "moved": _table(moved_places),
        "added": _table(new_places),
    }


def _cone(place: EmitterPlace) -> tuple[float, float]:
    """Return Blender's spot_size and spot_blend: full up to `beam`, dark from `cutoff` on."""
    assert place.cutoff is not None
    outer = math.cos(math.radians(place.cutoff))
    inner = math.cos(math.radians(place.beam or 0.0))
    return 2 * math.radians(place.cutoff), (inner - outer) / (1 - outer)


def _table(rows: Mapping[str, Any]) -> str:
    return "{\n" + "".join(f"    {name!r}: {row!r},\n" for name, row in rows.items()) + "}"


def _in_docstring(text: str) -> str:
    """Return a foreign name that cannot end the surrounding string literal."""
    return repr(text).replace('"', "'").replace("\\", "/")
