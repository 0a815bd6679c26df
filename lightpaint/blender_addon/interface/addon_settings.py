# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences, and the settings of each scene."""

import bpy

from ..lamps.grouping import ALIKE, COLLECTIONS, LAMPS
from ..painter.program import INSTALL_TEXT, find_program
from .panels import draw_text


class LightpaintPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__.rpartition(".")[0]

    program: bpy.props.StringProperty(
        name="Program",
        description="The program lightpaint, if Blender does not find it by itself",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "program")
        try:
            draw_text(
                self.layout, context, f"found: {find_program(self.program)}", icon="CHECKMARK"
            )
        except FileNotFoundError as error:
            draw_text(self.layout, context, str(error), icon="ERROR")
            if self.program:
                draw_text(self.layout, context, INSTALL_TEXT)


class LightpaintSceneSettings(bpy.types.PropertyGroup):
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Folder for the shot's render and painting; empty for one beside the .blend",
        subtype="DIR_PATH",
    )
    lights_file: bpy.props.StringProperty(
        name="Lights File",
        description="What lamps are made of (.lights.toml), so that they get drives; may be empty",
        subtype="FILE_PATH",
    )
    grouping: bpy.props.EnumProperty(
        name="Groups",
        description="What becomes one light group, and so one light in the painter",
        items=(
            (LAMPS, "Each Lamp", "A group for each lamp, mesh with emission, and the world"),
            (ALIKE, "Alike Lamps", "One for lamps of one name: Spot, Spot.001, Spot.002"),
            (COLLECTIONS, "Collections", "One for all lamps of a collection"),
        ),
    )


CLASSES = (LightpaintPreferences, LightpaintSceneSettings)


def register():
    bpy.types.Scene.lightpaint_settings = bpy.props.PointerProperty(type=LightpaintSceneSettings)


def unregister():
    del bpy.types.Scene.lightpaint_settings
