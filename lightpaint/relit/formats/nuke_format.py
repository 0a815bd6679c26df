"""Scripts of Nuke: lights, or multipliers of the layers of light groups."""

from lightpaint.display_text import some_names
from lightpaint.errors import OutputError
from lightpaint.relit.export.nuke import needs_copy, nuke_script, spoken_unreadable
from lightpaint.relit.export.nuke_lights import nuke_lights
from lightpaint.relit.formats.export_format import ExportContext, ExportFormat, Writer
from lightpaint.relit.rig_lights import rig_lights
from lightpaint.sentences import Hint, Sentence


class NukeFormat(ExportFormat):
    """A script with nodes of lights, or of layers."""

    name, file, file_of_groups = "nuke", "lights.nk", "relit.nk"
    needed_source = Sentence(
        "nuke needs the scene or the light groups of the lighting: give ",
        Hint("scene"),
        " for the lights, or ",
        Hint("light_groups"),
        " for multipliers of their layers",
    )

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the lights, which says which of them Nuke lacks."""
        lighting, scene = export.lighting, export.source.scene
        assert scene is not None

        def write() -> str:
            lights, left = rig_lights(scene, lighting)
            if left:
                export.listen.say(f"Nuke has no light like {some_names(left)}: set it by hand")
            about = f"the lights of {scene.files[0].name} as solved for {lighting.target}"
            up = lighting.up if lighting.places else scene.up
            return nuke_lights(lights, up=up, about=about, left=left)

        return write

    def of_groups(self, export: ExportContext) -> Writer:
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
