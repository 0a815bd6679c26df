"""All formats in which an answer can be exported, and the files of some of them."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.light_images import joined_texels
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError
from lightpaint.files import write_text
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import Listener
from lightpaint.relit.export.colors import with_own_colors
from lightpaint.relit.formats.blender_format import BlenderFormat
from lightpaint.relit.formats.export_format import AnyMap, ExportContext, ExportFormat, Source
from lightpaint.relit.formats.nuke_format import NukeFormat
from lightpaint.relit.formats.plain_formats import CsvFormat, JsonFormat, MitsubaFormat
from lightpaint.relit.formats.usd_format import UsdFormat
from lightpaint.relit.light_maps import sky_maps_of, slide_images_of, wall_images_of
from lightpaint.relit.relight import scene_of
from lightpaint.sentences import Hint

#: All formats by their names, as commands and manifests have them.
FORMS: dict[str, ExportFormat] = {
    x.name: x
    for x in (
        *(CsvFormat(), JsonFormat(), MitsubaFormat()),
        *(UsdFormat(), BlenderFormat(), NukeFormat()),
    )
}


def names_of_forms(forms: Iterable[str], source: Source) -> dict[str, str]:
    """Return the file name for each format, after checking its requirements.

    Raises LightpaintError for an unknown format, or one whose requirements are not met.
    """
    names = {}
    for form in forms:
        if form not in FORMS:
            raise LightpaintError(f"there is no form {form!r}: known are {', '.join(FORMS)}")
        names[form] = FORMS[form].name_for(source)
    if source.stage is not None and UsdFormat.name not in names:
        raise LightpaintError(Hint("stage"), " belongs to the form usd: leave it out, or add that")
    return names


def writers_of(
    names: Mapping[str, str], lighting: Lighting, source: Source, folder: Path, listen: Listener
) -> tuple[dict[str, Callable[[], str | Floats]], str]:
    """Return a function that makes the text or image of each file, by name, and a remark or "".

    names: file names by format, from `names_of_forms`. folder: folder of the files. listen:
    receives remarks on what a format leaves out. Raises LightpaintError if the lighting belongs to
    another source.
    """
    elsewhere, remark = lighting, ""
    if not all(FORMS[form].keeps_lighting for form in names):
        elsewhere, remark = _exported(lighting, source)
    maps = _maps(names, elsewhere, source)
    export = ExportContext(elsewhere, source, folder, listen, maps)
    writers: dict[str, Callable[[], str | Floats]] = {}
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


def write_content(path: Path, content: str | Floats) -> None:
    """Write what a writer has made."""
    if isinstance(content, str):
        write_text(path, content)
    else:
        write_rgb(path, content)


def _maps(names: Collection[str], lighting: Lighting, source: Source) -> list[AnyMap]:
    """Return the maps of image lights that some of the formats refer to."""
    if source.scene is None or not any(FORMS[form].refers_to_maps for form in names):
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


def _check_groups(export: ExportContext) -> None:
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
