# SPDX-License-Identifier: GPL-3.0-or-later
"""The three steps: prepare, render, paint."""

import bpy

from ..lamps.lamp_levels import adopt_levels, grouped_places
from ..lamps.memory import recall
from ..shot.cycles_render import ShotRender, current_digest
from ..shot.layer_setup import prepare
from ..shot.shot_home import shot_folder
from .controller import controller


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


def has_memory(scene):
    """Return whether lightpaint has changed anything in a scene."""
    return bool(recall(scene))


CLASSES = (
    LIGHTPAINT_OT_prepare,
    LIGHTPAINT_OT_render,
    LIGHTPAINT_OT_paint,
    LIGHTPAINT_OT_stop,
)
