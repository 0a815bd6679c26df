"""All formats in which an answer can be exported, a class each, and the files of some of them."""

import csv
import io
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Floats, as_rgb
from lightpaint.basis import joined_texels
from lightpaint.colour import WAVELENGTHS, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import write_bytes, write_text
from lightpaint.images.formats import write_rgb
from lightpaint.lighting import Lighting, LightSetting
from lightpaint.progress import Listener
from lightpaint.relit import exported_answer
from lightpaint.relit.export.exports import blender_script, plain_cell, scene_script
from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.export.nuke import needs_copy, nuke_lights, nuke_script, spoken_unreadable
from lightpaint.relit.export.program_axes import SkyMap
from lightpaint.relit.export.rig_files import show_copy
from lightpaint.relit.export.usd import check_usd, usd_overrides
from lightpaint.relit.export.usd_groups import usd_multipliers
from lightpaint.relit.relit_scene import scene_of, scene_patch
from lightpaint.sentences import Hint, Sentence

#: Width of a 95 % interval, relative to the brightest channel, above which a light is hardly known.
UNBOUNDED = 1.0


class BlenderFormat(exported_answer.ExportFormat):
    """A Python script that sets lights, or light groups, by name."""

    name, file, file_of_groups = "blender", "set_scene.py", "set_lights.py"
    refers_to_maps = True

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the script for lights."""
        lighting, scene, maps = export.lighting, export.source.scene, export.maps
        assert scene is not None
        slides = [one for one in maps if isinstance(one, exported_answer.SlideImage)]
        return lambda: scene_script(
            *(lighting.target, scene.files[0].name, exported_answer.emitters_of(scene, lighting)),
            places=lighting.places,
            up=lighting.up,
            skies={one.name: one.file for one in maps if isinstance(one, SkyMap)},
            walls={
                one.name: one.file for one in maps if isinstance(one, exported_answer.WallImage)
            },
            slides={one.name: (one.file, one.position, one.axes, one.half_size) for one in slides},
            drives={x: light.drives for light in lighting.lights for x in _drive_owners(light)},
        )

    def of_groups(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the script for light groups."""
        groups = export.source.light_groups
        assert groups is not None
        return lambda: blender_script(groups, export.lighting)


class UsdFormat(exported_answer.ExportFormat):
    """A layer with the lights of the answer; of light groups, over the stage that they are of."""

    name, file, file_of_groups = "usd", "lights.usda", "lights.usda"
    refers_to_maps = True

    def name_for(self, source: exported_answer.Source) -> str:
        """Return the name of the file. Raises LightpaintError, also without USD's package, or
        without a stage for light groups.
        """
        name = super().name_for(source)
        check_usd()
        if source.light_groups is not None and source.stage is None:
            raise LightpaintError(
                "usd multiplies the lights that light groups were rendered from: give their "
                "stage with ",
                Hint("stage"),
            )
        return name

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the layer, and say which images USD has no light for."""
        scene, maps = export.source.scene, export.maps
        assert scene is not None
        emitters = exported_answer.emitters_of(scene, export.lighting)
        walls = [one for one in maps if isinstance(one, exported_answer.WallImage)]
        if meshes := sorted(wall.name for wall in walls if not wall.is_rectangle):
            export.listen.say(f"USD has no image for {some_names(meshes)}, a mesh: set it by hand")
        if slides := [one for one in maps if isinstance(one, exported_answer.SlideImage)]:
            export.listen.say(
                f"USD has no projector for {some_names(one.name for one in slides)}: give a light "
                f"the slide by hand, {some_names(one.file for one in slides)}"
            )
        skies = {one.name: one.file for one in maps if isinstance(one, SkyMap)}
        panels = {wall.name: wall.file for wall in walls if wall.is_rectangle}
        return lambda: _layer(export, emitters, skies, panels)

    def of_groups(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of a layer with multipliers."""
        return lambda: _layer_of_groups(export)


def _drive_owners(light: LightSetting) -> tuple[str, ...]:
    """Return the names of the emitters of a light that has drives; none of another light."""
    return light.members if light.drives else ()


def _layer(
    export: exported_answer.ExportContext,
    emitters: Sequence[tuple[str, str, RGB]],
    skies: Mapping[str, str],
    panels: Mapping[str, str],
) -> str:
    """Return a layer with these emitters, and say which of them its stage lacks."""
    source, lighting, listen = export.source, export.lighting, export.listen
    assert source.scene is not None
    name = source.scene.files[0].name
    overridden = usd_overrides(
        emitters,
        source.stage,
        export.folder,
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
    if overridden.in_part:
        listen.say(
            f"{stage_name} hides {some_names(overridden.in_part)}, or links it to some prims alone"
        )
    _say_spaces(overridden.unknown_spaces, source.stage, listen)
    return overridden.text


def _say_spaces(names: Sequence[str], stage: Path | None, listen: Listener) -> None:
    """Say which colour spaces of a stage are unknown, if any are."""
    if names:
        listen.say(
            f"{stage} has colours of lights in {some_names(names)}, a colour space that USD does "
            "not know: the layer has linear Rec.709"
        )


def _layer_of_groups(export: exported_answer.ExportContext) -> str:
    """Return a layer with these multipliers, and say which lights its stage lacks."""
    source, lighting = export.source, export.lighting
    assert source.stage is not None
    assert source.light_groups is not None
    overridden = usd_multipliers(
        _free_weights(lighting),
        source.stage,
        export.folder,
        by_frame={frame: _free_weights(lit) for frame, lit in lighting.by_frame.items()},
        primaries=source.light_groups.basis.origin.primaries,
        about=f"lightpaint: lights of {source.light_groups.name} as solved for {lighting.target}",
    )
    if overridden.left:
        export.listen.say(
            f"{source.stage} has no light with the path, tag or name "
            f"{some_names(overridden.left)}, or it is animated: set it by hand"
        )
    _say_spaces(overridden.unknown_spaces, source.stage, export.listen)
    return overridden.text


def _free_weights(lighting: Lighting) -> dict[str, RGB]:
    """Return the multipliers of adjusted lights, by their names."""
    return {light.name: light.weight for light in lighting.lights if not light.is_fixed}


class NukeFormat(exported_answer.ExportFormat):
    """A script with nodes of lights, or of layers."""

    name, file, file_of_groups = "nuke", "lights.nk", "relit.nk"
    needed_source = Sentence(
        "nuke needs the scene or the light groups of the lighting: give ",
        Hint("scene"),
        " for the lights, or ",
        Hint("light_groups"),
        " for multipliers of their layers",
    )

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the lights, which says which of them Nuke lacks."""
        lighting, scene = export.lighting, export.source.scene
        assert scene is not None

        def write() -> str:
            lights, left = exported_answer.rig_lights(scene, lighting)
            if left:
                export.listen.say(f"Nuke has no light like {some_names(left)}: set it by hand")
            about = f"the lights of {scene.files[0].name} as solved for {lighting.target}"
            up = lighting.up if lighting.places else scene.up
            return nuke_lights(lights, up=up, about=about, left=left)

        return write

    def of_groups(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the multipliers."""
        groups = export.source.light_groups
        assert groups is not None
        if needs_copy(groups):
            raise OutputError(
                f"Nuke cannot tell the layers of {groups.path} apart: solve writes a copy of them "
                "beside its relit.nk"
            )
        for remark in spoken_unreadable(groups, export.folder):
            export.listen.say(remark)
        return lambda: nuke_script(groups, export.lighting, export.folder)


class TableFormat(exported_answer.ExportFormat):
    """A table of fixtures."""

    needs_source = False

    @staticmethod
    @abstractmethod
    def text_of(lighting: Lighting) -> str:
        """Return the table of a lighting."""

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return a function that makes the text of the table for the exported lighting."""
        return lambda: self.text_of(export.lighting)

    of_groups = of_scene


class CsvFormat(TableFormat):
    """A table of fixtures for spreadsheets."""

    name, file, file_of_groups = "csv", "fixtures.csv", "fixtures.csv"
    text_of = staticmethod(fixtures_csv)


class JsonFormat(TableFormat):
    """The same table for programs."""

    name, file, file_of_groups = "json", "fixtures.json", "fixtures.json"
    text_of = staticmethod(fixtures_json)


def spectra_csv(lighting: Lighting) -> str:
    """Return a table with a row for each wavelength, and a column for each lamp: power per
    nanometre, for the luminance of its emission in the scene's unit.

    Raises LightpaintError for a lighting without spectra.
    """
    spectra = {
        light.name: light.powers for light in lighting.of_lamps().lights if light.powers is not None
    }
    if not spectra:
        raise LightpaintError(
            "the lighting has no spectra: give the emitters of its lamps a spectrum in the lights "
            "file, and solve again"
        )
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["nm", *map(plain_cell, spectra)])
    for k, wave in enumerate(WAVELENGTHS.tolist()):
        table.writerow([wave, *(f"{powers[k]:.6g}" for powers in spectra.values())])
    return text.getvalue()


class SpectraFormat(TableFormat):
    """A table of the lamps' spectra."""

    name, file, file_of_groups = "spectra", "spectra.csv", "spectra.csv"
    text_of = staticmethod(spectra_csv)


class MitsubaFormat(exported_answer.ExportFormat):
    """A patch of the scene's XML."""

    name, file = "mitsuba", "relit.patch"
    keeps_lighting = True

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the patch."""
        scene = export.source.scene
        assert scene is not None
        return lambda: scene_patch(scene, export.lighting)


class MvrFormat(exported_answer.ExportFormat):
    """A copy of the show with the colours and places of the answer."""

    name, file, file_of_groups = "mvr", "relit.mvr", "relit.mvr"
    needs_source, needs_rig = False, True

    def of_scene(self, export: exported_answer.ExportContext) -> exported_answer.Writer:
        """Return the writer of the copy, and say which lights the show lacks."""
        assert export.source.rig is not None
        copied = show_copy(export.source.rig, export.lighting)
        if len(copied.left) == len(export.lighting.fixed ^ {*export.lighting}):
            raise LightpaintError(
                f"{export.source.rig} has no fixture for any light of the lighting, such as "
                f"{some_names(copied.left)}: give the show that its scene was made from"
            )
        if copied.left:
            export.listen.say(
                f"{export.source.rig} has no fixture for {some_names(copied.left)}: left out"
            )
        return lambda: copied.data

    of_groups = of_scene


#: All formats by their names, as commands and manifests have them.
FORMS: dict[str, exported_answer.ExportFormat] = {
    x.name: x
    for x in (
        *(CsvFormat(), JsonFormat(), MitsubaFormat(), UsdFormat()),
        *(BlenderFormat(), NukeFormat(), MvrFormat(), SpectraFormat()),
    )
}


def names_of_forms(forms: Iterable[str], source: exported_answer.Source) -> dict[str, str]:
    """Return the file name for each format, after checking its requirements.

    Raises LightpaintError for an unknown format, or one whose requirements are not met.
    """
    names = {}
    for form in forms:
        if form not in FORMS:
            raise LightpaintError(f"there is no form {form!r}: known are {', '.join(FORMS)}")
        names[form] = FORMS[form].name_for(source)
    has_rig_form = any(FORMS[form].needs_rig for form in names)
    if has_rig_form and source.rig is None:
        form = next(form for form in names if FORMS[form].needs_rig)
        raise LightpaintError(f"{form} needs the show that the lights are of: give ", Hint("rig"))
    if source.rig is not None and not has_rig_form:
        raise LightpaintError(
            Hint("rig"), " belongs to mvr and cues: leave it out, or add one of them"
        )
    if source.stage is not None and UsdFormat.name not in names:
        raise LightpaintError(Hint("stage"), " belongs to the form usd: leave it out, or add that")
    return names


def writers_of(
    names: Mapping[str, str],
    lighting: Lighting,
    source: exported_answer.Source,
    folder: Path,
    listen: Listener,
) -> tuple[dict[str, Callable[[], str | bytes | Floats]], str]:
    """Return a function that makes the content of each file, by name, and a remark or "".

    names: file names by format, from `names_of_forms`. folder: folder of the files. listen:
    receives remarks on what a format leaves out. Raises LightpaintError if the lighting belongs to
    another source.
    """
    elsewhere, remark = lighting, ""
    if not all(FORMS[form].keeps_lighting for form in names):
        elsewhere, remark = _exported(lighting, source)
    maps = _maps(names, elsewhere, source)
    export = exported_answer.ExportContext(elsewhere, source, folder, listen, maps)
    writers: dict[str, Callable[[], str | bytes | Floats]] = {}
    for form, name in names.items():
        format_ = FORMS[form]
        kept = replace(export, lighting=lighting) if format_.keeps_lighting else export
        if source.light_groups is None:
            writers[name] = format_.of_scene(kept)
            continue
        if format_.needs_source:
            _check_groups(kept)
        writers[name] = format_.of_groups(kept)
    return writers | {one.file: partial(np.asarray, one.image) for one in maps}, remark


def write_content(path: Path, content: str | bytes | Floats) -> None:
    """Write what a writer has made."""
    if isinstance(content, str):
        write_text(path, content)
    elif isinstance(content, bytes):
        write_bytes(path, content)
    else:
        write_rgb(path, content)


def _maps(
    names: Collection[str], lighting: Lighting, source: exported_answer.Source
) -> list[exported_answer.AnyMap]:
    """Return the maps of image lights that some of the formats refer to."""
    if source.scene is None or not any(FORMS[form].refers_to_maps for form in names):
        return []
    finders = (
        exported_answer.sky_maps_of,
        exported_answer.wall_images_of,
        exported_answer.slide_images_of,
    )
    return [one for maps_of in finders for one in maps_of(source.scene, lighting)]


def _exported(lighting: Lighting, source: exported_answer.Source) -> tuple[Lighting, str]:
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


def _check_groups(export: exported_answer.ExportContext) -> None:
    """Raise LightpaintError for light groups that the lighting is not of, or not of all frames."""
    lighting, groups = export.lighting, export.source.light_groups
    assert groups is not None
    lighting.weights_for(groups.basis)
    if lighting.animation and groups.sequence is None:
        raise LightpaintError(
            f"the lights change over a shot, and {groups.path} is one of its frames: give all, "
            "like ",
            Hint("light_groups", "shot.####.exr"),
        )


def with_own_colors(
    lighting: Lighting, current: Mapping[str, RGB]
) -> tuple[Lighting, tuple[str, ...]]:
    """Return the lighting for other programs, and the names of lights that differ from the answer.

    The solve gives a hardly visible light an arbitrary colour, often a saturated one. If an
    interval is wider than the light is bright, and the light's colour in the scene lies within the
    intervals of all channels at some brightness, it keeps that colour, at its solved brightness or
    at the nearest one that fits. Colours with a constraint are kept.

    current: emission in the scene by light name, in the same units.
    """
    names = []
    for light in lighting.lights:
        rgb = _own_color(light, current[light.name])
        if rgb is not None:
            names.append(light.name)
            lighting = lighting.with_emission(light.name, rgb)
    return lighting, tuple(names)


def _own_color(light: LightSetting, current: RGB) -> RGB | None:
    """Return the emission in the scene's colour; None if the painting determines another colour."""
    color, solved_emission = np.array(current, np.float64), np.array(light.emission, np.float64)
    ends = light.interval
    if (
        light.is_fixed
        or light.constraint
        or ends is None
        or not color.any()
        or not solved_emission.any()
    ):
        return None
    ends_known = [x for x in ends if x is not None]
    if (
        len(ends_known) < 3
        or max(high - low for low, high in ends_known) <= UNBOUNDED * solved_emission.max()
    ):
        return None
    if np.allclose(
        solved_emission * color.max(),
        color * solved_emission.max(),
        rtol=0,
        atol=1e-6 * color.max() * solved_emission.max(),
    ):
        return None  # it has that colour already
    # The range of factors for the current emission that fits all channels.
    lowest, highest = 0.0, np.inf
    for (low, high), value in zip(ends_known, color, strict=True):
        if value == 0:
            lowest = lowest if low <= 0 else np.inf
        else:
            lowest, highest = max(lowest, low / value), min(highest, high / value)
    if lowest > highest:
        return None
    times = float(luminance(solved_emission)) / float(luminance(color))
    return as_rgb(color * min(max(times, lowest), highest))
