# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: the three steps, prepare, render and paint; and levels: apply or discard a preview,
use looks, and revert everything.
"""

import bpy

from ..lamps.lamp_levels import (
    PREVIEWS,
    adopt_levels,
    grouped_places,
    keep_drives,
    keep_levels,
    key_levels,
    show_drives,
    show_factors,
)
from ..lamps.lamp_units import working_space
from ..lamps.memory import MEMORY_KEY, recall, remember
from ..shot.cycles_render import ShotRender, current_digest
from ..shot.layer_setup import prepare, revert
from ..shot.shot_home import shot_folder
from .controller import controller, discard_preview


def prepare_shot(context):
    """Prepare the view layer of a context. Raises ValueError if that is impossible."""
    scene, view_layer = context.scene, context.view_layer
    if scene.library is not None:
        raise ValueError(f"the scene {scene.name} is linked from another file: open it there")
    if not hasattr(scene, "cycles"):
        raise ValueError("Cycles is switched off: enable it in Preferences > Add-ons")
    grouping = prepare(scene, view_layer, scene.lightpaint_settings.grouping)
    controller.left = grouping.left
    if not grouping.members:
        raise ValueError("nothing in this scene gives light that can be changed")
    return grouping


def check_camera(scene):
    """Raise ValueError if a scene has nothing to render through."""
    if scene.camera is None:
        raise ValueError("the scene has no camera: add one (Shift A), and look through it")


def is_rendered(scene, view_layer, folder):
    """Return whether the render in a folder shows the scene as it is.

    If so, levels that no longer know what was rendered, after undo or reverting, learn it again.
    """
    digest = folder.rendered_digest()
    if not digest or digest != current_digest(scene, view_layer):
        return False
    adopt_levels(grouped_places(scene, view_layer))
    return True


class ShotOperator(bpy.types.Operator):
    """An operator whose errors are one sentence, in the panel and in the status bar"""

    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        is_idle = controller.render is None and not bpy.app.is_job_running("RENDER")
        return context.scene is not None and is_idle

    def execute(self, context):
        try:
            text = self.run(context)
        except (OSError, ValueError, RuntimeError) as error:
            sentence = one_sentence(error)
            controller.say(sentence, is_error=True)
            self.report({"ERROR"}, sentence)
            return {"CANCELLED"}
        if text:
            controller.say(text)
            self.report({"INFO"}, text)
        return {"FINISHED"}


class LIGHTPAINT_OT_prepare(ShotOperator):
    """Give each light a group of its own, and switch on the passes that the painter needs"""

    bl_idname, bl_label = "lightpaint.prepare", "Prepare"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context):
        grouping = prepare_shot(context)
        left = f"; {len(grouping.left)} stay as they are" if grouping.left else ""
        return f"{len(grouping.members)} light groups{left}"


class LIGHTPAINT_OT_render(ShotOperator):
    """Render the light groups into the shot's folder. An unchanged shot is not rendered again"""

    bl_idname, bl_label = "lightpaint.render", "Render"

    again: bpy.props.BoolProperty(name="Render Again", options={"SKIP_SAVE"})

    def invoke(self, context, event):
        self.again = self.again or event.shift
        return self.execute(context)

    def run(self, context):
        # Who paints goes on with the new picture.
        session = controller.session
        is_painting = session is not None and session.is_connected
        then = controller.begin_paint if is_painting else None
        if not begin_shot(context, then=then, again=self.again):
            return "the shot is rendered already (Shift: render it again)"
        return ""


class LIGHTPAINT_OT_paint(ShotOperator):
    """Open the painter in the browser; the lamps follow. Prepares and renders what is missing"""

    bl_idname, bl_label = "lightpaint.paint", "Paint"

    def run(self, context):
        if controller.session is not None and controller.session.is_connected:
            if url := controller.session.page_url:
                bpy.ops.wm.url_open(url=url)
            return ""
        controller.check_program()
        if not begin_shot(context, then=controller.begin_paint):
            controller.begin_paint(context.scene, context.view_layer)
        return ""


class LIGHTPAINT_OT_stop(ShotOperator):
    """End the painter. Its session stays in the shot's folder"""

    bl_idname, bl_label = "lightpaint.stop", "End Painter"

    @classmethod
    def poll(cls, context):
        return controller.session is not None

    def run(self, context):
        controller.end_paint()
        return "the painter has ended; its session is kept in the shot's folder"


def begin_shot(context, *, then=None, again=False):
    """Prepare and render a shot, unless that has been done. Return whether it has to render.

    then: called with scene and view layer after a render.
    """
    scene, view_layer = context.scene, context.view_layer
    check_camera(scene)
    folder = shot_folder(scene)
    folder.check_writable()
    prepare_shot(context)
    if not again and is_rendered(scene, view_layer, folder):
        return False
    controller.end_paint()  # a shot whose file has another name now follows it
    render = ShotRender(scene, view_layer, shot_folder(scene))
    controller.begin_render(render, scene, then=then)
    return True


def one_sentence(error):
    """Return an error in one line."""
    if isinstance(error, OSError) and error.strerror:
        where = f": {error.filename}" if error.filename else ""
        return f"{error.strerror}{where}: choose another folder under Shot"
    return " ".join(str(error).split())


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

    def set_lamps(self, context):
        """Set the lamps to the chosen look. Return its name, and the places of the lamps."""
        name, factors = self.look(context)
        groups = grouped_places(context.scene, context.view_layer)
        show_factors(groups, factors, working_space(bpy.data))
        show_drives(groups, {})
        return name, groups


class LIGHTPAINT_OT_apply_look(LookOperator):
    """Set the lamps to this look: one step of undo"""

    bl_idname, bl_label = "lightpaint.apply_look", "Apply Look"

    def run(self, context):
        name, _ = self.set_lamps(context)
        apply_levels(context.scene, context.view_layer)
        return f"the lamps are set to {name}"


class LIGHTPAINT_OT_key_look(LookOperator):
    """Set the lamps to this look at the current frame, by keyframes: two looks blend over time"""

    bl_idname, bl_label = "lightpaint.key_look", "Key Look"

    def run(self, context):
        name, groups = self.set_lamps(context)
        key_levels(groups, context.scene.frame_current)
        apply_levels(context.scene, context.view_layer)
        return f"{name} is keyed at frame {context.scene.frame_current}"


CLASSES = (
    LIGHTPAINT_OT_prepare,
    LIGHTPAINT_OT_render,
    LIGHTPAINT_OT_paint,
    LIGHTPAINT_OT_stop,
    LIGHTPAINT_OT_apply,
    LIGHTPAINT_OT_discard,
    LIGHTPAINT_OT_revert,
    LIGHTPAINT_OT_apply_look,
    LIGHTPAINT_OT_key_look,
)
