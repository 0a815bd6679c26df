"""The formats in which an answer can be exported: their requirements, and their texts."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Floats
from lightpaint.basis.light_images import joined_texels
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import write_text
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import Listener
from lightpaint.relit.export.colors import with_own_colors
from lightpaint.relit.export.exports import blender_script
from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.export.nuke import needs_copy, nuke_script, spoken_unreadable
from lightpaint.relit.export.nuke_lights import nuke_lights
from lightpaint.relit.export.scene_script import scene_script
from lightpaint.relit.export.sky_maps import SkyMap
from lightpaint.relit.export.usd import check_usd, usd_overrides
from lightpaint.relit.export.usd_groups import usd_multipliers
from lightpaint.relit.light_maps import (
    SlideImage,
    WallImage,
    sky_maps_of,
    slide_images_of,
    wall_images_of,
)
from lightpaint.relit.relight import scene_of
from lightpaint.relit.rig_lights import rig_lights
from lightpaint.relit.xml_patch import emitters_of, scene_patch
from lightpaint.scene.scene import Scene

#: Name of the file in each format, for a scene and for light groups; None if not available.
FORMS: dict[str, tuple[str | None, str | None]] = {
    "csv": ("fixtures.csv", "fixtures.csv"),
    "json": ("fixtures.json", "fixtures.json"),
    "mitsuba": ("relit.patch", None),
    "usd": ("lights.usda", "lights.usda"),
    "blender": ("set_scene.py", "set_lights.py"),
    "nuke": ("lights.nk", "relit.nk"),
}


#: Formats that refer to maps of image lights.
WITH_MAPS = ("usd", "blender")


@dataclass(frozen=True)
class Source:
    """The source of a lighting: a scene, light groups, or neither.

    stage: USD stage with lights named as in the scene.
    """

    scene: Scene | None = None
    light_groups: LightGroups | None = None
    stage: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The files from which the source was read."""
        files = [] if self.stage is None else [self.stage]
        if self.scene is not None:
            files += self.scene.read_files
        return files + (self.light_groups.files if self.light_groups is not None else [])


def names_of_forms(forms: Iterable[str], source: Source) -> dict[str, str]:
    """Return the file name for each format, after checking its requirements.

    Raises LightpaintError for an unknown format, or one whose requirements are not met.
    """
    names = {}
    for form in forms:
        if form not in FORMS:
            raise LightpaintError(f"there is no form {form!r}: known are {', '.join(FORMS)}")
        name = FORMS[form][source.light_groups is not None]
        if name is None:
            raise LightpaintError(
                f"{form} needs a scene: give it with scene=..., and leave light_groups=... out"
            )
        if source.light_groups is None and source.scene is None and form not in ("csv", "json"):
            raise LightpaintError(
                "nuke needs the scene or the light groups of the lighting: give scene=... for the "
                "lights, or light_groups=... for multipliers of their layers"
                if form == "nuke"
                else f"{form} needs the scene: give it with scene=..."
            )
        if form == "usd":
            check_usd()
            if source.light_groups is not None and source.stage is None:
                raise LightpaintError(
                    "usd multiplies the lights that light groups were rendered from: give their "
                    "stage with stage=..."
                )
        names[form] = name
    if source.stage is not None and "usd" not in names:
        raise LightpaintError("stage=... belongs to the form usd: leave it out, or add that")
    return names


def writers_of(
    names: Mapping[str, str], lighting: Lighting, source: Source, folder: Path, listen: Listener
) -> tuple[dict[str, Callable[[], str | Floats]], str]:
    """Return a function that makes the text or image of each file, by name, and a remark or "".

    names: file names by format, from `names_of_forms`. folder: folder of the files. listen:
    receives remarks on what a format leaves out. Mitsuba gets the lighting itself, other programs
    the result of `_exported`. Raises LightpaintError if the lighting belongs to another source.
    """
    elsewhere, remark = lighting, ""
    if set(names) != {"mitsuba"}:
        elsewhere, remark = _exported(lighting, source)
    maps = _maps(names, elsewhere, source)
    writers: dict[str, Callable[[], str | Floats]] = {
        name: _writer_of(
            form, lighting if form == "mitsuba" else elsewhere, source, folder, listen, maps
        )
        for form, name in names.items()
    }
    return writers | {one.file: partial(np.asarray, one.image) for one in maps}, remark


def write_content(path: Path, content: str | Floats) -> None:
    """Write what a writer has made."""
    if isinstance(content, str):
        write_text(path, content)
    else:
        write_rgb(path, content)


#: The map of an image light.
AnyMap = SkyMap | WallImage | SlideImage


def _maps(names: Collection[str], lighting: Lighting, source: Source) -> list[AnyMap]:
    """Return the maps of image lights that some of the formats refer to."""
    forms = [form for form in names if form in WITH_MAPS]
    if not forms or source.scene is None:
        return []
    finders = (sky_maps_of, wall_images_of, slide_images_of)
    return [one for maps_of in finders for one in maps_of(source.scene, lighting)]


def _exported(lighting: Lighting, source: Source) -> tuple[Lighting, str]:
    """Return the lighting for other programs, in which undetermined lights keep the scene's
    colours.

    Also returns a remark on these lights, or "". Raises LightingError if the lighting belongs to
    another scene.
    """
    if source.scene is None:
        return lighting, ""
    regrouped_scene = scene_of(source.scene, lighting)
    tied_lighting, names = with_own_colors(
        lighting, {light.name: light.emission for light in regrouped_scene.lights}
    )
    if not names:
        return tied_lighting, ""
    return tied_lighting, (
        f"the painting does not tell the colour of {some_names(joined_texels(names))}: other "
        "programs get the one in the scene"
    )


def _writer_of(
    form: str,
    lighting: Lighting,
    source: Source,
    folder: Path,
    listen: Listener,
    maps: Sequence[AnyMap],
) -> Callable[[], str]:
    """Return a function that makes the text of one format. See `writers_of` for the arguments."""
    if form in ("csv", "json"):
        return lambda: (fixtures_csv if form == "csv" else fixtures_json)(lighting)
    if source.light_groups is not None:
        return _of_groups(form, lighting, source, folder, listen)
    scene = source.scene
    assert scene is not None
    if form == "mitsuba":
        return lambda: scene_patch(scene, lighting)
    if form == "nuke":
        return lambda: _nuke_lights(scene, lighting, listen)
    emitters, name = emitters_of(scene, lighting), scene.files[0].name
    skies = {one.name: one.file for one in maps if isinstance(one, SkyMap)}
    walls = {one.name: one for one in maps if isinstance(one, WallImage)}
    files = {name: wall.file for name, wall in walls.items()}
    slides = [one for one in maps if isinstance(one, SlideImage)]
    if form == "blender":
        return lambda: scene_script(
            *(lighting.target, name, emitters),
            places=lighting.places,
            up=lighting.up,
            skies=skies,
            walls=files,
            slides={one.name: (one.file, one.position, one.axes, one.half_size) for one in slides},
        )
    panels = {name: file for name, file in files.items() if walls[name].is_rectangle}
    if meshes := sorted({*files} - {*panels}):
        listen.say(f"USD has no image for {some_names(meshes)}, a mesh: set it by hand")
    if slides:
        listen.say(
            f"USD has no projector for {some_names(one.name for one in slides)}: give a light the "
            f"slide by hand, {some_names(one.file for one in slides)}"
        )
    return lambda: _usd_layer(lighting, source, emitters, folder, listen, skies, panels)


def _nuke_lights(scene: Scene, lighting: Lighting, listen: Listener) -> str:
    """Return a Nuke script with the lights, and say which of them it lacks."""
    lights, left = rig_lights(scene, lighting)
    if left:
        listen.say(f"Nuke has no light like {some_names(left)}: set it by hand")
    about = f"the lights of {scene.files[0].name} as solved for {lighting.target}"
    up = lighting.up if lighting.places else scene.up
    return nuke_lights(lights, up=up, about=about, left=left)


def _usd_layer(
    lighting: Lighting,
    source: Source,
    emitters: Sequence[tuple[str, str, RGB]],
    folder: Path,
    listen: Listener,
    skies: Mapping[str, str],
    panels: Mapping[str, str],
) -> str:
    """Return a layer of USD with these emitters, and say which of them its stage lacks."""
    assert source.scene is not None
    name = source.scene.files[0].name
    overridden = usd_overrides(
        emitters,
        source.stage,
        folder,
        places=lighting.places,
        up=lighting.up,
        skies=skies,
        panels=panels,
        about=f"lightpaint: the lights of {name} as solved for {lighting.target}",
    )
    stage_name = source.stage or "USD"
    if overridden.left:
        listen.say(
            f"{stage_name} has no single light for {some_names(overridden.left)}: set it by hand"
        )
    if overridden.unplaced:
        listen.say(
            f"{stage_name} has {some_names(overridden.unplaced)} elsewhere than the scene, or "
            "as a mesh: place it by hand"
        )
    return overridden.text


def _usd_of_groups(lighting: Lighting, source: Source, folder: Path, listen: Listener) -> str:
    """Return a layer of USD with these multipliers, and say which lights its stage lacks."""
    assert source.stage is not None
    assert source.light_groups is not None
    overridden = usd_multipliers(
        _free_weights(lighting),
        source.stage,
        folder,
        by_frame={frame: _free_weights(lit) for frame, lit in lighting.by_frame.items()},
        about=f"lightpaint: lights of {source.light_groups.name} as solved for {lighting.target}",
    )
    if overridden.left:
        listen.say(
            f"{source.stage} has no light with the path, tag or name "
            f"{some_names(overridden.left)}, or it is animated: set it by hand"
        )
    return overridden.text


def _free_weights(lighting: Lighting) -> dict[str, RGB]:
    """Return the multipliers of adjusted lights, by their names."""
    return {light.name: light.weight for light in lighting.lights if not light.is_fixed}


def _of_groups(
    form: str, lighting: Lighting, source: Source, folder: Path, listen: Listener
) -> Callable[[], str]:
    """Return a function that makes the text of one format for light groups."""
    groups = source.light_groups
    assert groups is not None
    lighting.weights_for(groups.basis)
    if lighting.animation and groups.sequence is None:
        raise LightpaintError(
            f"the lights change over a shot, and {groups.path} is one of its frames: give all, "
            "like light_groups='shot.####.exr'"
        )
    if form == "blender":
        return lambda: blender_script(groups, lighting)
    if form == "usd":
        return lambda: _usd_of_groups(lighting, source, folder, listen)
    if needs_copy(groups):
        raise OutputError(
            f"Nuke cannot tell the layers of {groups.path} apart: solve writes a copy of them "
            "beside its relit.nk"
        )
    for remark in spoken_unreadable(groups, folder):
        listen.say(remark)
    return lambda: nuke_script(groups, lighting, folder)
