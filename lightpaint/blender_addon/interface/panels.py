# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel, in the sidebar of the 3D view and in the render properties."""

import blf
import bpy

from ..lamps.lamp_levels import PREVIEWS
from ..lamps.memory import recall
from ..shot.shot_home import is_kept, shot_folder
from .controller import controller
from .shot_operators import known_looks

#: Reasons that are listed at most; the rest is counted.
MAX_REASONS = 8

#: Words about a file without a name.
UNSAVED_TEXT = "save this file to keep what you paint"

#: The label of a preview without a message of its own.
PREVIEW_TEXT = "the lamps show a preview: apply or discard it"

#: Height of a line of a sentence, in buttons.
LINE_HEIGHT = 0.75

#: Pixels beside a sentence: borders, tabs and an icon, at Blender's usual size.
BESIDE_PIXELS = 84

#: Width of a panel in pixels where there is none to ask.
USUAL_PIXELS = 300


class LightpaintPanel:
    """Contents of both panels."""

    bl_label = "lightpaint"

    def draw(self, context):
        layout, scene = self.layout, context.scene
        column = layout.column(align=True)
        column.scale_y = 1.4
        text = "Open Page" if controller.is_painting else "Paint"
        column.operator("lightpaint.paint", text=text, icon="BRUSH_DATA")
        row = layout.row(align=True)
        row.operator("lightpaint.prepare", icon="LIGHT")
        row.operator("lightpaint.render", icon="RENDER_STILL")
        draw_preview_buttons(layout)
        draw_messages(layout, context)
        self.draw_looks(layout, scene)
        row = layout.row(align=True)
        row.operator("lightpaint.stop", icon="X")
        row.operator("lightpaint.revert", icon="TRASH")

    def draw_looks(self, layout, scene):
        looks = known_looks(scene)
        if not looks:
            return
        box = layout.box()
        box.label(text="Looks")
        for index, (name, _) in enumerate(looks):
            row = box.row(align=True)
            row.operator("lightpaint.apply_look", text=name, translate=False).index = index
            row.operator("lightpaint.key_look", text="", icon="KEY_HLT").index = index


class ImagePanel:
    """Ways without the painter."""

    bl_label, bl_options = "Without the Painter", {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("lightpaint.paint_over", icon="IMAGE_DATA")
        column.operator("lightpaint.solve_image", icon="LIGHT_AREA")
        self.layout.operator("lightpaint.look_like", icon="IMAGE_REFERENCE")


class EditorPanel:
    """A panel beside an image that is painted over."""

    bl_label = "lightpaint"

    def draw(self, context):
        column = self.layout.column()
        column.scale_y = 1.4
        column.operator("lightpaint.solve_image", icon="LIGHT_AREA")
        draw_preview_buttons(self.layout)
        draw_messages(self.layout, context)


class ShotPanel:
    """The settings of a shot."""

    bl_label, bl_options = "Shot", {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, settings = self.layout, context.scene.lightpaint_settings
        layout.use_property_split = True
        layout.prop(settings, "grouping")
        layout.prop(settings, "lights_file")
        layout.prop(settings, "folder")
        draw_text(layout, context, str(shot_folder(context.scene).path), icon="FILE_FOLDER")


def draw_preview_buttons(layout):
    """Draw what ends a preview: always, so that nothing jumps while somebody paints."""
    row = layout.row(align=True)
    row.operator("lightpaint.apply", icon="CHECKMARK")
    row.operator("lightpaint.discard", icon="LOOP_BACK")


def draw_messages(layout, context):
    """Draw what there is to say: on the file, the work, the painter, and what is in no group."""
    session = controller.session
    if not is_kept(context.scene):
        draw_text(layout, context, UNSAVED_TEXT, icon="FILE_TICK")
    texts = [(controller.message, controller.is_error)]
    if session is not None:
        texts.append((session.message, session.is_over))
    is_idle = not controller.message and not controller.is_busy
    if recall(context.scene).get(PREVIEWS) and is_idle:
        texts.append((PREVIEW_TEXT, False))  # a painter has ended, or the file was saved with one
    for text, is_error in texts:
        if text:
            draw_text(layout, context, text, icon="ERROR" if is_error else "INFO")
    if controller.left:
        box = layout.box()
        box.label(text="In no light group:")
        for reason in controller.left[:MAX_REASONS]:
            draw_text(box, context, reason, icon="DOT")
        if len(controller.left) > MAX_REASONS:
            box.label(text=f"and {len(controller.left) - MAX_REASONS} more")


def draw_text(layout, context, text, icon="NONE"):
    """Draw a sentence on as many lines as it needs."""
    scale = context.preferences.system.ui_scale
    width = context.region.width if context.region else USUAL_PIXELS * scale
    lines = wrap(text, width - BESIDE_PIXELS * scale, context)
    column = layout.column(align=True)
    column.scale_y = LINE_HEIGHT if len(lines) > 1 else 1.0
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else "BLANK1", translate=False)


def wrap(text, width, context):
    """Return a text as lines of at most so many pixels; longer words, like paths, are cut."""
    points = context.preferences.ui_styles[0].widget.points
    blf.size(0, points * context.preferences.system.ui_scale)

    def fits(line):
        return len(line) == 1 or blf.dimensions(0, line)[0] <= width

    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if fits(longer):
            lines[-1] = longer
            continue
        lines += [word] if lines[-1] else []
        rest = word
        while not fits(rest):
            length = next(k for k in range(len(rest) - 1, 0, -1) if fits(rest[:k]))
            lines[-1:] = [rest[:length], rest := rest[length:]]
        lines[-1] = rest
    return lines


class InView:
    """The place of panels in the sidebar of the 3D view."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "lightpaint"


class InRender:
    """The place of panels in the render properties."""

    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"


class LIGHTPAINT_PT_view(InView, LightpaintPanel, bpy.types.Panel):
    pass


class LIGHTPAINT_PT_view_image(InView, ImagePanel, bpy.types.Panel):
    bl_parent_id = "LIGHTPAINT_PT_view"


class LIGHTPAINT_PT_view_shot(InView, ShotPanel, bpy.types.Panel):
    bl_parent_id = "LIGHTPAINT_PT_view"


class LIGHTPAINT_PT_image(EditorPanel, bpy.types.Panel):
    bl_space_type, bl_region_type, bl_category = "IMAGE_EDITOR", "UI", "lightpaint"


class LIGHTPAINT_PT_render(InRender, LightpaintPanel, bpy.types.Panel):
    bl_options = {"DEFAULT_CLOSED"}


class LIGHTPAINT_PT_render_image(InRender, ImagePanel, bpy.types.Panel):
    bl_parent_id = "LIGHTPAINT_PT_render"


class LIGHTPAINT_PT_render_shot(InRender, ShotPanel, bpy.types.Panel):
    bl_parent_id = "LIGHTPAINT_PT_render"


CLASSES = (
    LIGHTPAINT_PT_view,
    LIGHTPAINT_PT_view_image,
    LIGHTPAINT_PT_view_shot,
    LIGHTPAINT_PT_image,
    LIGHTPAINT_PT_render,
    LIGHTPAINT_PT_render_image,
    LIGHTPAINT_PT_render_shot,
)
