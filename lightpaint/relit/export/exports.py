"""Exports: a script for Blender by names of lights; of light groups a table, Nuke, an image."""

import csv
import hashlib
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Position
from lightpaint.basis import LightGroups, multipliers_in
from lightpaint.colour import ACESCG, REC2020, from_rec709, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import LightingError
from lightpaint.files import write_text
from lightpaint.images.formats import ExrPart, rgb_channels, write_parts
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting, LightSetting, key_slopes
from lightpaint.relit.export import program_axes
from lightpaint.relit.export.nuke import LAYERS, copied_part, needs_copy, nuke_script
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
    drives: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> str:
    """Return the script, which leaves emitters without a plain colour, such as a sky, to the user.

    emitters: name, Mitsuba's parameter and emission of each adjusted emitter. places: places of all
    emitters in the answer. up: the scene's up axis. skies, walls: file of the map of each sky, and
    of the image of each wall, by its name. slides: by name of a projector, file of its slide,
    position, rows of its axes, and half the width and height of the slide at distance 1. drives: of
    the emitters that mix a light, 0 to 1, by name of the light.
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
        drives=_table(drives),
        sky_axes=repr(np.round(program_axes.blender_axes(up), 12).tolist()),
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
    rotations = program_axes.axis_conversions(up, UP)
    own_conversion = program_axes.conversion_of(places, [np.eye(3)], {})
    current = {
        place.name: old for place in places if (old := program_axes.old_position(place)) is not None
    }
    moved_places, new_places = {}, {}
    for place in filter(program_axes.is_changed, places):
        cone = _cone(place) if program_axes.has_new_cone(place) else None
        if place.new:
            axes = own_conversion.frame(place).tolist()
            new_places[place.name] = (LAMPS[place.new], place.position, axes, cone, place.size)
        else:
            moved_places[place.name] = (place.position, place.direction, cone)
    return {
        "rotations": repr([np.round(rotation, 12).tolist() for rotation in rotations]),
        "present": _table(current),
        "same_place": repr(program_axes.SAME_PLACE * own_conversion.size),
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


#: All files that `write_exports` may write.
EXPORTS = ("lights.csv", "set_lights.py", "relit.nk", LAYERS, "relit.exr")

#: Renderers whose groups a Blender script can set; a pattern may describe Blender's layers, too.
BLENDER = ("Blender", "pattern")

#: Positions where a spreadsheet may interpret text as a formula: at the beginning of a cell, which
#: in some countries is also after a semicolon, and before any formula prefix, including full-width
#: signs.
_FORMULA = re.compile(r"(\A|[;\t\r\n])(?=['=+\-@\t\r\n＝＋－＠])")

#: The largest finite float16.
LARGEST_HALF = 65504.0


@keywords()
def write_exports(
    folder: str | Path,
    groups: LightGroups,
    lighting: Lighting,
    *,
    home: str | Path | None = None,
) -> list[Path]:
    """Write `lighting`, solved from `groups`, into `folder` for other programs.

    The files are lights.csv, a table of multipliers; set_lights.py for Blender's light groups,
    unless another renderer wrote the file; relit.nk for Nuke, with relit_layers.exr if Nuke could
    not distinguish the layers of the file; and relit.exr, the sum with these multipliers. Of a shot
    the scripts are for all frames, and there is no relit.exr.

    Args:
        folder: Folder to write to.
        groups: The light groups of the solve.
        lighting: The answer.
        home: Folder to which the files will be moved, which relit.nk names; by default `folder`.

    Returns:
        The written files.

    Raises:
        LightingError: If `lighting` has other lights.
        OutputError: If `folder` cannot be written.

    Examples:
        >>> groups = lp.read_light_groups("groups.exr")
        >>> lighting = lp.solve(groups.basis, lp.Target.of(groups.basis.image("key"))).lighting
        >>> [file.name for file in lp.write_exports(".", groups, lighting)]
        ['lights.csv', 'relit.nk', 'relit.exr']
    """
    folder = Path(folder)
    texts = {"lights.csv": lights_table(groups, lighting)}
    if groups.renderer.startswith(BLENDER):
        texts["set_lights.py"] = blender_script(groups, lighting)
    parts: dict[str, ExrPart] = {}
    if groups.sequence is None:  # or each frame has its own picture
        parts["relit.exr"] = relit_part(groups, lighting)
        if needs_copy(groups):
            parts[LAYERS] = copied_part(groups)
    if groups.sequence is None or not needs_copy(groups):
        texts["relit.nk"] = nuke_script(groups, lighting, Path(home or folder))
    for name, text in texts.items():
        write_text(folder / name, text)
    for name, part in parts.items():
        write_parts(folder / name, [part])
    return [folder / name for name in EXPORTS if name in texts or name in parts]


def lights_table(groups: LightGroups, lighting: Lighting) -> str:
    """Return a CSV of names, layers and multipliers, with the resulting luminance of a white light.

    Stops are `off` at 0, and `unknown` for lights that reach nothing painted. Of lights that change
    over a shot there are rows for each frame, whose number comes first.
    """
    headings = ("light", "layer", "red", "green", "blue", "luminance", "stops", "kept", "unreached")
    if not lighting.animation:
        rows = [headings, *_light_cells(groups, lighting)]
    else:
        rows = [("frame", *headings)]
        for frame, lit in lighting.by_frame.items():
            rows += [(str(frame), *cells) for cells in _light_cells(groups, lit)]
    return "".join(_row(*cells) for cells in rows)


def _light_cells(groups: LightGroups, lighting: Lighting) -> list[tuple[str, ...]]:
    """Return the cells of each light's row."""
    rows = []
    layers = {
        light.name: layer.name
        for light, layer in zip(groups.basis.lights, groups.layers, strict=False)
    }
    unreached = lighting.certificate.unreached if lighting.certificate is not None else ()
    for light in lighting.lights:
        y = float(luminance(np.array(light.weight)))
        # Adding 0 removes the sign of a negative zero.
        stops = f"{round(math.log2(y), 3) + 0.0:+.3f}" if y > 0 else "off"
        is_known = light.name not in unreached and any(light.reached)
        stops = stops if is_known else "unknown"
        numbers = [f"{v:.9g}" for v in (*own_multipliers(groups, light.weight), y)]
        is_fixed_text = "yes" if light.is_fixed else "no"
        # Undetermined channels, whose multipliers are unchanged.
        notes = "".join(
            c for c, is_reached in zip("RGB", light.reached, strict=True) if not is_reached
        )
        names = map(plain_cell, (light.name, layers.get(light.name, "")))
        rows.append((*names, *numbers, stops, is_fixed_text, notes))
    return rows


def plain_cell(text: str) -> str:
    """Return `text` for a cell of a table, with a `'` before anything that may look like a formula.

    An existing `'` in such a position is doubled, so removing one in each position restores the
    text.
    """
    return _FORMULA.sub(r"\1'", text)


def _row(*cells: str) -> str:
    # With both characters as line end, the writer quotes cells that contain either.
    row = io.StringIO()
    csv.writer(row, lineterminator="\r\n").writerow(cells)
    return row.getvalue().removesuffix("\r\n") + "\n"


def blender_script(groups: LightGroups, lighting: Lighting) -> str:
    """Return a Python script for Blender that multiplies the lights in each light group."""
    rows = [
        f"    {light.name!r}: {_rgb(own_multipliers(groups, light.weight))},\n"
        for light in _free(lighting)
    ]
    primaries = groups.basis.origin.primaries
    return filled_script(
        "set_lights.py.in",
        target=_in_docstring(lighting.target),
        source=_in_docstring(groups.name),
        multipliers="{\n" + "".join(rows) + "}",
        keys="{\n" + "".join(_key_rows(groups, lighting)) + "}",
        render=repr(render_identity(groups)),
        to_render=repr((from_rec709(primaries) if primaries else np.eye(3)).round(9).tolist()),
    )


def render_identity(groups: LightGroups) -> str:
    """Return the identity of the render that multipliers belong to.

    Frames of a shot are one render of one scene, whichever is solved for: theirs is the hash of the
    files of the first.
    """
    if groups.sequence is None:
        return groups.basis.origin.scene_identity
    path = groups.sequence.path(groups.sequence.frames[0])
    digest = hashlib.sha256()
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        if file.is_file():
            with file.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()[:32]


def own_multipliers(groups: LightGroups, weight: Iterable[float]) -> list[float]:
    """Return the multipliers of red, green and blue in the primaries in which the renderer of light
    groups multiplies. weight: in Rec.709.
    """
    return list(map(float, multipliers_in(groups.basis.origin.primaries, np.array([*weight]))))


def _key_rows(groups: LightGroups, lighting: Lighting) -> list[str]:
    """Return the keys of each adjusted light: frame, multipliers, and their slopes per frame."""
    keys, rows = lighting.animation, []
    slopes = key_slopes(keys) if keys else np.empty((0, 0, 3))
    for i, light in enumerate(lighting.lights):
        if light.is_fixed or not keys:
            continue
        rows.append(f"    {light.name!r}: [\n")
        for key, slope in zip(keys, slopes, strict=True):
            own = (_rgb(own_multipliers(groups, x)) for x in (key.weights[i], slope[i]))
            rows.append(f"        ({key.frame}, {', '.join(own)}),\n")
        rows.append("    ],\n")
    return rows


def relit_part(groups: LightGroups, lighting: Lighting) -> ExrPart:
    """Return Σ multiplier × layer with the rest and the alpha of the beauty, in the file's
    precision.
    """
    image = groups.basis.mix(_weights(groups, lighting))
    channels = rgb_channels(image)
    if groups.beauty is not None and groups.beauty.alpha is not None:
        channels["A"] = groups.beauty.alpha.astype(np.float32)
    if groups.is_half:
        channels = {
            name: np.clip(pixels, -LARGEST_HALF, LARGEST_HALF).astype(np.float16)
            for name, pixels in channels.items()
        }
    return ExrPart("relit", channels)


def _weights(groups: LightGroups, lighting: Lighting) -> Doubles:
    """Return the weights (n, 3) of the lights of a frame, which may have a `rest` or lack it where
    the lighting does not.
    """
    if groups.basis.names == tuple(lighting):
        return lighting.weights_for(groups.basis)
    names = groups.basis.names[: len(groups.layers)]
    if sorted(names) != sorted(light.name for light in lighting.lights if light.plugin != "rest"):
        raise LightingError(
            f"{groups.path} has the light groups {some_names(names)}, the lighting is of "
            f"{some_names(lighting)}: render all frames with the same groups"
        )
    lights = [lighting[name].weight for name in names]
    return np.array([*lights, *([(1.0, 1.0, 1.0)] * groups.has_rest)], np.float64)


def _free(lighting: Lighting) -> list[LightSetting]:
    return [light for light in lighting.lights if not light.is_fixed]


def _rgb(values: Iterable[float]) -> str:
    return "(" + ", ".join(f"{v:.9g}" for v in values) + ")"
