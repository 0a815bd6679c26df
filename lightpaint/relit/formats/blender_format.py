"""Scripts that set the lights of Blender."""

from lightpaint.relit.export.exports import blender_script
from lightpaint.relit.export.scene_script import scene_script
from lightpaint.relit.export.sky_maps import SkyMap
from lightpaint.relit.formats.export_format import ExportContext, ExportFormat, Writer
from lightpaint.relit.light_maps import SlideImage, WallImage
from lightpaint.relit.xml_patch import emitters_of


class BlenderFormat(ExportFormat):
    """A Python script that sets lights, or light groups, by name."""

    name, file, file_of_groups = "blender", "set_scene.py", "set_lights.py"
    refers_to_maps = True

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the script for lights."""
        lighting, scene, maps = export.lighting, export.source.scene, export.maps
        assert scene is not None
        slides = [one for one in maps if isinstance(one, SlideImage)]
        return lambda: scene_script(
            *(lighting.target, scene.files[0].name, emitters_of(scene, lighting)),
            places=lighting.places,
            up=lighting.up,
            skies={one.name: one.file for one in maps if isinstance(one, SkyMap)},
            walls={one.name: one.file for one in maps if isinstance(one, WallImage)},
            slides={one.name: (one.file, one.position, one.axes, one.half_size) for one in slides},
        )

    def of_groups(self, export: ExportContext) -> Writer:
        """Return the writer of the script for light groups."""
        groups = export.source.light_groups
        assert groups is not None
        return lambda: blender_script(groups, export.lighting)
