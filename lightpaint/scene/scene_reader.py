"""Reads a Mitsuba scene and chooses the lights to adjust."""

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Self

from lightpaint.errors import SceneError
from lightpaint.files import file_length
from lightpaint.keywords import keywords
from lightpaint.scene.checks.xml_checks import MAX_XML
from lightpaint.scene.lights.emitters import Emitter, check_emitters
from lightpaint.scene.lights.hung_luminaires import hang_luminaires
from lightpaint.scene.lights.image_split import images_to_split, with_split
from lightpaint.scene.lights.light import Light, lights_of
from lightpaint.scene.lights.light_choice import choose_lights
from lightpaint.scene.lights.lights_file import LightsFile, lights_file_for
from lightpaint.scene.lights.texels.image_domains import GridSize
from lightpaint.scene.lights.texels.texel import (
    TexelLayout,
    mirrored_pairs,
    parse_map_size,
    parse_size,
)
from lightpaint.scene.mitsuba_scene import Scene, inspect_scene, up_of
from lightpaint.scene.properties.film import check_film, sensor_index
from lightpaint.scene.properties.integrator import IntegratorChoice
from lightpaint.scene.runtime.mitsuba_errors import explain_old_scene, mitsuba_errors
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_tree import ParsedScene

#: Endings of pictures and lightings, which people give in place of a scene.
OTHER_ENDINGS = frozenset(
    [
        ".exr",
        ".hdr",
        ".json",
        ".png",
        ".jpg",
        ".jpeg",
        ".tif",
        ".tiff",
        ".psd",
        ".ora",
        ".kra",
        ".webp",
    ]
)


@keywords()
@MITSUBA.acquired()
def load_scene(
    path: str | Path,
    *,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    variant: str | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    lights_file: str | Path | None = None,
    use_lights_file: bool = True,
    only_luminaires: bool = False,
    group_alike: bool = True,
    integrator: str | None = None,
    split: Mapping[str, object] | None = None,
    symmetric: Iterable[str] | None = None,
    map_size: object = None,
    lamps: Iterable[str] = (),
) -> Scene:
    """Read a Mitsuba scene XML and find its lights.

    Args:
        path: The XML file.
        sensor: Index or id of the sensor to look through (by default the first).
        parameters: Values for the `$name` parameters of the XML (Mitsuba's `-D`).
        variant: Mitsuba variant to use, if the process has none yet.
        lights: Names or patterns (`window_*`) of the lights to adjust, by default all. Other lights
            are kept as they are.
        groups: Name → names or patterns of emitters that are adjusted as one light.
        lights_file: TOML file with lights and groups, used instead of the one beside the scene.
            `lights` replaces its list; `groups` are added to its groups, or replace those with the
            same names, and without `lights` are adjusted as well.
        use_lights_file: False to ignore the lights file beside the scene.
        only_luminaires: Whether to read only the luminaires of the lights file, which belong to
            the scene, and to adjust all lights.
        group_alike: Whether more than 24 similar emitters without names become one light, unless
            they are selected by their generated names. The lights file can disable this.
        integrator: Integrator to render with instead of the scene's own, such as `path`, `direct`
            or `path:max_depth=8`. It inherits max_depth, rr_depth and hide_emitters.
        split: Name or pattern → columns and rows, such as `(16, 8)`: a sky, an area light or a
            projector becomes an image of that many texels, each a light `NAME.xCOLUMN.yROW`; or a
            text such as `16x8+x4.y3`, a sky of which a texel is split again. By default the splits
            of the lights file, which this replaces.
        symmetric: Names or patterns of split lights whose images are equal to their mirror images,
            so that two texels, left and right, are one light, called like the left one. By default
            the ones of the lights file, which this replaces.
        map_size: Columns and rows, such as `(1024, 512)`, at which `relight` writes the images of
            split lights; by default one pixel for each texel.
        lamps: Names or patterns of lights whose colour may lie outside Rec.709, besides those
            whose emitters the lights file lists: `["*"]` for a relit scene.

    Raises:
        SceneError: If the scene is invalid, with Mitsuba's own message if Mitsuba rejects it.
        BackendError: If Mitsuba cannot run.

    Examples:
        >>> [light.name for light in lp.load_scene("room.xml").lights]
        ['panel', 'bulb']
        >>> lp.load_scene("room.xml", lights=["bulb"]).lights
        (Light('bulb', ...),
         Light('rest', ..., fixed))
    """
    _check_path(path)
    backend = use_variant(variant)
    path = Path(path)
    _check_file(path)
    values = {key: str(value) for key, value in (parameters or {}).items()}
    integrator_choice = None if integrator is None else IntegratorChoice.of(integrator)
    with explain_old_scene(path), mitsuba_errors(path):
        parsed = ParsedScene(path, values, backend.variant, integrator_choice)
    index = sensor_index(sensor, parsed.sensor_names, path)
    file = lights_file_for(path, lights_file, beside_scene=use_lights_file)
    file = file.with_more(lights, groups)
    selection = file.only_luminaires() if only_luminaires else file
    sizes = _image_sizes(selection, split)
    with explain_old_scene(path), mitsuba_errors(path):
        parsed, whole = _inspected(parsed, index, selection, file.groups)
    sizes = images_to_split(sizes, whole["emitters"], str(path))
    images = _SplitImages(sizes, _symmetric_images(selection, symmetric, sizes)).mirrored()
    selection = replace(selection, groups={**images.pairs, **selection.groups})
    with explain_old_scene(path), mitsuba_errors(path):
        facts = images.in_facts(whole, parsed)
    check_film(path, facts["film"], facts["spp"])
    check_emitters(path, facts["emitters"])
    lamp_names = [*selection.requests.lamps, *lamps]
    facts["emitters"] = _with_colors_of_lamps(facts["emitters"], lamp_names)
    chosen = _select_lights(path, facts["emitters"], selection, group_alike=group_alike)
    if len(adjusted := _adjusted_images(chosen)) < len(images.sizes):
        # An image of which nothing is adjusted stays as it is, in full detail.
        selection = selection.without_groups_of(images.symmetric - adjusted)
        images = images.only(adjusted)
        facts = images.in_facts(whole, parsed)
        facts["emitters"] = _with_colors_of_lamps(facts["emitters"], lamp_names)
        chosen = _select_lights(path, facts["emitters"], selection, group_alike=group_alike)
    return Scene(
        path=path,
        parameters=values,
        lights=chosen,
        lights_file=selection.path,
        requests=selection.requests,
        parsed=parsed,
        split=images.sizes,
        symmetric=images.symmetric,
        map_size=None if map_size is None else parse_map_size(map_size),
        **facts,
    )


@dataclass(frozen=True)
class _SplitImages:
    """Lights that become images of texels.

    sizes: columns and rows, or layouts, by name of the light. symmetric: names of those that are
    equal to their mirror images.
    """

    sizes: Mapping[str, GridSize | TexelLayout]
    symmetric: frozenset[str]

    def mirrored(self) -> Self:
        """Return the images, of which symmetric ones have symmetric layouts."""
        sizes = dict(self.sizes)
        for name in self.symmetric:
            size = sizes[name]
            layout = size.made_symmetric() if isinstance(size, TexelLayout) else TexelLayout(size)
            sizes[name] = layout if layout.splits else layout.size
        return replace(self, sizes=sizes)

    @property
    def pairs(self) -> dict[str, Sequence[str]]:
        """The texels of symmetric images with their mirror images, each pair under one name."""
        pairs: dict[str, Sequence[str]] = {}
        for name in sorted(self.symmetric):
            size = self.sizes[name]
            layout = size if isinstance(size, TexelLayout) else TexelLayout(size)
            pairs = {**mirrored_pairs(name, layout), **pairs}
        return pairs

    def only(self, names: Collection[str]) -> Self:
        """Return the images with these names."""
        sizes = {name: size for name, size in self.sizes.items() if name in names}
        return replace(self, sizes=sizes, symmetric=self.symmetric.intersection(sizes))

    def in_facts(self, facts: Mapping[str, Any], parsed: ParsedScene) -> dict[str, Any]:
        """Return the facts of `inspect_scene` with these images in texels."""
        return with_split(facts, parsed, self.sizes, self.symmetric)


def _inspected(
    parsed: ParsedScene, sensor: int, selection: LightsFile, groups: Mapping[str, Iterable[str]]
) -> tuple[ParsedScene, dict[str, Any]]:
    """Return a scene with the luminaires of its lights file, and the facts of `inspect_scene`.

    groups: of the lights file, also those that are not selected.
    """
    facts = inspect_scene(parsed, sensor)
    if not (luminaires := selection.requests.luminaires):
        return parsed, facts
    up, scale = up_of(parsed, sensor, facts["emitters"]), selection.requests.cd_per_unit
    parsed = hang_luminaires(parsed, luminaires, groups, up, scale)
    return parsed, inspect_scene(parsed, sensor)


@MITSUBA.acquired()
def with_layout(scene: Scene, image: str, layout: TexelLayout) -> Scene:
    """Return a scene whose sky `image` has other texels, each a light that shows what it does now.

    Its texels must have been lights of their own; texels of a symmetric sky are one with their
    mirror images.
    """
    split = {**scene.split, image: layout}
    with mitsuba_errors(scene.path):
        facts = inspect_scene(scene.parsed, scene.sensor)
        facts = with_split(facts, scene.parsed, split, scene.symmetric)
    light_of = {name: light.name for light in scene.lights for name in light.member_names}
    pairs = mirrored_pairs(image, layout) if image in scene.symmetric else {}
    light_of |= {name: pair for pair, names in pairs.items() for name in names}
    members: dict[str, list[str]] = {}
    for emitter in facts["emitters"]:
        members.setdefault(light_of.get(emitter.name, emitter.name), []).append(emitter.name)
    fixed = [light.name for light in scene.lights if light.is_fixed]
    lights = lights_of(facts["emitters"], members, fixed)
    return replace(scene, **facts | {"film": scene.film}, lights=lights, split=split)


def _with_colors_of_lamps(
    emitters: Sequence[Emitter], patterns: Sequence[str]
) -> tuple[Emitter, ...]:
    """Return the emitters, with lamps made adjustable whose colour is outside Rec.709.

    A relit scene has such colours. patterns: names or patterns of lamps.
    """

    def is_lamp(emitter: Emitter) -> bool:
        return any(emitter.name == x or fnmatchcase(emitter.name, x) for x in patterns)

    return tuple(
        replace(x, obstacle="") if x.is_outside_gamut and is_lamp(x) else x for x in emitters
    )


def _image_sizes(
    selection: LightsFile, split: Mapping[str, object] | None
) -> dict[str, GridSize | TexelLayout]:
    """Return columns and rows, or layouts, of images by name of the light: `split`, or the sizes of
    the file.
    """
    if split is None:
        return selection.requests.split
    return {name: parse_size(size, f"split: {name}") for name, size in split.items()}


def _symmetric_images(
    selection: LightsFile, symmetric: Iterable[str] | None, sizes: Collection[str]
) -> frozenset[str]:
    """Return the names of symmetric images: `symmetric`, or the images of the file that are
    split."""
    is_of_file = symmetric is None
    patterns = selection.requests.symmetric if symmetric is None else set(symmetric)
    names: set[str] = set()
    for pattern in sorted(patterns):
        matches = [x for x in sizes if x == pattern] or [
            x for x in sizes if fnmatchcase(x, pattern)
        ]
        if not matches and not is_of_file:
            raise SceneError(f"symmetric: {pattern!r} is not split into texels: split it")
        names.update(matches)
    return frozenset(names)


def _adjusted_images(lights: Sequence[Light]) -> set[str]:
    """Return the names of the images of which some texel is adjusted."""
    members = (member for light in lights if not light.is_fixed for member in light.members)
    return {member.texel.image for member in members if member.texel is not None}


def _select_lights(
    path: Path, emitters: Sequence[Emitter], selection: LightsFile, *, group_alike: bool
) -> tuple[Light, ...]:
    """Return the lights that a lights file selects. group_alike: unless it disables this."""
    return choose_lights(
        emitters,
        scene=str(path),
        lights=selection.lights,
        groups=selection.groups,
        group_alike=group_alike and selection.group_alike,
        named=selection.requests.names,
    )


def _check_path(path: object) -> None:
    """Raise SceneError for a scene that is in memory, since lights are changed in its XML."""
    if isinstance(path, str | os.PathLike):
        return
    if isinstance(path, Mapping):
        how = (
            "write it with mi.parser.write_file(mi.parser.parse_dict(mi.parser.ParserConfig("
            "mi.variant()), scene), 'scene.xml'), and load that"
        )
    else:
        how = "give the file that it was loaded from"
    raise SceneError(
        f"load_scene takes the path of a Mitsuba XML, not a {type(path).__name__}: {how}"
    )


def _check_file(path: Path) -> None:
    """Raise SceneError for a missing or long file, and for a picture or a lighting."""
    file_length(path, "scene file", SceneError, limit=MAX_XML)
    if path.suffix.lower() in OTHER_ENDINGS:
        raise SceneError(f"{path} is not a scene: this command takes a Mitsuba XML first")
