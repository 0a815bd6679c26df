"""Layers of USD over the lights of a stage."""

from collections.abc import Mapping, Sequence

from lightpaint.arrays import RGB
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.sky_maps import SkyMap
from lightpaint.relit.export.usd import check_usd, usd_overrides
from lightpaint.relit.export.usd_groups import usd_multipliers
from lightpaint.relit.formats.export_format import ExportContext, ExportFormat, Source, Writer
from lightpaint.relit.light_maps import SlideImage, WallImage
from lightpaint.relit.xml_patch import emitters_of
from lightpaint.sentences import Hint


class UsdFormat(ExportFormat):
    """A layer with the lights of the answer; of light groups, over the stage that they are of."""

    name, file, file_of_groups = "usd", "lights.usda", "lights.usda"
    refers_to_maps = True

    def name_for(self, source: Source) -> str:
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

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the layer, and say which images USD has no light for."""
        scene, maps = export.source.scene, export.maps
        assert scene is not None
        emitters = emitters_of(scene, export.lighting)
        walls = [one for one in maps if isinstance(one, WallImage)]
        if meshes := sorted(wall.name for wall in walls if not wall.is_rectangle):
            export.listen.say(f"USD has no image for {some_names(meshes)}, a mesh: set it by hand")
        if slides := [one for one in maps if isinstance(one, SlideImage)]:
            export.listen.say(
                f"USD has no projector for {some_names(one.name for one in slides)}: give a light "
                f"the slide by hand, {some_names(one.file for one in slides)}"
            )
        skies = {one.name: one.file for one in maps if isinstance(one, SkyMap)}
        panels = {wall.name: wall.file for wall in walls if wall.is_rectangle}
        return lambda: _layer(export, emitters, skies, panels)

    def of_groups(self, export: ExportContext) -> Writer:
        """Return the writer of a layer with multipliers."""
        return lambda: _layer_of_groups(export)


def _layer(
    export: ExportContext,
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
    return overridden.text


def _layer_of_groups(export: ExportContext) -> str:
    """Return a layer with these multipliers, and say which lights its stage lacks."""
    source, lighting = export.source, export.lighting
    assert source.stage is not None
    assert source.light_groups is not None
    overridden = usd_multipliers(
        _free_weights(lighting),
        source.stage,
        export.folder,
        by_frame={frame: _free_weights(lit) for frame, lit in lighting.by_frame.items()},
        about=f"lightpaint: lights of {source.light_groups.name} as solved for {lighting.target}",
    )
    if overridden.left:
        export.listen.say(
            f"{source.stage} has no light with the path, tag or name "
            f"{some_names(overridden.left)}, or it is animated: set it by hand"
        )
    return overridden.text


def _free_weights(lighting: Lighting) -> dict[str, RGB]:
    """Return the multipliers of adjusted lights, by their names."""
    return {light.name: light.weight for light in lighting.lights if not light.is_fixed}
