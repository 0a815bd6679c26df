# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on levels: apply or discard a preview, use looks, and revert everything."""

import bpy

from ..lamps.lamp_levels import (
    PREVIEWS,
    grouped_places,
    keep_drives,
    keep_levels,
    key_levels,
    show_drives,
    show_factors,
)
from ..lamps.lamp_units import working_space
from ..lamps.memory import MEMORY_KEY, recall, remember
from ..shot.layer_setup import revert
from ..shot.shot_home import shot_folder
from .controller import controller, discard_preview
from .shot_operators import ShotOperator


def known_looks(scene):
    """Return the looks of the painter, or those kept in the folder while it does not run."""
    session = controller.session
    if session is not None and session.state.is_open:
        return [(look.name, look.factors) for look in session.state.looks]
    return shot_folder(scene).read_looks()


def apply_levels(scene, view_layer):
    """Make the levels that are shown the scene's own."""
    groups = grouped_places(scene, view_layer)
    keep_levels(groups)
    keep_drives(groups)
    remember(scene, {**recall(scene), PREVIEWS: False})


class PreviewOperator(ShotOperator):
    """An operator on the preview that the lamps show"""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(recall(context.scene).get(PREVIEWS))


class LIGHTPAINT_OT_apply(PreviewOperator):
    """Keep the lamps as the painter shows them: one step of undo"""

    bl_idname, bl_label = "lightpaint.apply", "Apply"

    def run(self, context):
        apply_levels(context.scene, context.view_layer)
        return "the lamps are as painted"


class LIGHTPAINT_OT_discard(PreviewOperator):
    """Put the lamps back to what they were before this preview"""

    bl_idname, bl_label = "lightpaint.discard", "Discard"

    def run(self, context):
        discard_preview(context.scene)
        if controller.session is not None:
            controller.session.hold_lamps()
        return "the lamps are as before the preview"


class LIGHTPAINT_OT_revert(ShotOperator):
    """Put back everything that lightpaint has changed in this file: lamps, light groups, passes"""

    bl_idname, bl_label = "lightpaint.revert", "Revert All"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return MEMORY_KEY in context.scene

    def run(self, context):
        controller.end_paint()
        problems = revert(context.scene)
        controller.left = problems
        return "everything is as before lightpaint"


class LookOperator(ShotOperator):
    """An operator on one of the looks"""

    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(options={"HIDDEN", "SKIP_SAVE"})

    def look(self, context):
        """Return name and multipliers of the chosen look. Raises ValueError if it has gone."""
        looks = known_looks(context.scene)
        if not 0 <= self.index < len(looks):
            raise ValueError("this look is no longer there")
        return looks[self.index]


class LIGHTPAINT_OT_apply_look(LookOperator):
    """Set the lamps to this look: one step of undo"""

    bl_idname, bl_label = "lightpaint.apply_look", "Apply Look"

    def run(self, context):
        name, factors = self.look(context)
        groups = grouped_places(context.scene, context.view_layer)
        show_factors(groups, factors, working_space(bpy.data))
        show_drives(groups, {})
        apply_levels(context.scene, context.view_layer)
        return f"the lamps are set to {name}"


class LIGHTPAINT_OT_key_look(LookOperator):
    """Set the lamps to this look at the current frame, by keyframes: two looks blend over time"""

    bl_idname, bl_label = "lightpaint.key_look", "Key Look"

    def run(self, context):
        name, factors = self.look(context)
        groups = grouped_places(context.scene, context.view_layer)
        show_factors(groups, factors, working_space(bpy.data))
        show_drives(groups, {})
        key_levels(groups, context.scene.frame_current)
        apply_levels(context.scene, context.view_layer)
        return f"{name} is keyed at frame {context.scene.frame_current}"


CLASSES = (
    LIGHTPAINT_OT_apply,
    LIGHTPAINT_OT_discard,
    LIGHTPAINT_OT_revert,
    LIGHTPAINT_OT_apply_look,
    LIGHTPAINT_OT_key_look,
)
