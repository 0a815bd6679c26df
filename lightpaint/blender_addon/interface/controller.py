# SPDX-License-Identifier: GPL-3.0-or-later
"""Background work: a render, a painter, a solve. One timer asks them for news.

Nothing here is Blender's data, so undo and loading leave it alone.
"""

import atexit
import contextlib
import os
import traceback
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..lamps.lamp_levels import PREVIEWS, discard_drives, discard_levels, grouped_places
from ..lamps.memory import recall, remember
from ..painter.program import find_program, plain_options, view_options
from ..shot.cycles_render import RENDERING, ShotRender, put_back_output
from ..shot.shot_home import home, move_image_paths, shot_folder
from .live_session import LiveSession

#: Seconds between two looks at what has happened.
TICK_S = 1 / 30


class Controller:
    """The render, the painter and the solve that run now, if any.

    Attributes:
        message: The last sentence for the user; is_error: whether it is about a failure.
        left: What is in no light group, with the reasons.
    """

    def __init__(self):
        self.reset()

    def reset(self):
        """Forget everything: another file was opened."""
        self.render: ShotRender | None = None
        self.session: LiveSession | None = None
        self.solve: Any = None
        self.message, self.is_error, self.left, self._then = "", False, [], None

    def say(self, text, *, is_error=False):
        """Show a sentence in the panel."""
        self.message, self.is_error = text, is_error
        redraw()

    def begin_render(self, render, scene, *, then=None):
        """Start a render. then: called with scene and view layer when it is done."""
        self.render, self._then = render, then
        self.say("Cycles renders the light groups …")
        render.start(scene, waits=bpy.app.background)
        start_timer()
        if bpy.app.background:
            self.tick()

    def begin_paint(self, scene, view_layer):
        """Start the painter on a rendered shot. Raises OSError with what to do."""
        program = self.check_program()
        self.end_paint()
        self.session = LiveSession(shot_folder(scene), scene, view_layer)
        view, variables = view_options(scene, ocio_path())
        fallback = plain_options(scene) if variables else None
        lights_file = bpy.path.abspath(scene.lightpaint_settings.lights_file)
        self.session.start(program, view, variables, fallback, lights_file)
        self.say("")
        start_timer()

    def begin_solve(self, solve, text):
        """Follow a solve that runs in the background."""
        self.solve = solve
        self.say(text)
        start_timer()

    def check_program(self):
        """Return the path of lightpaint. Raises FileNotFoundError, with what to do."""
        preferences = preferences_of()
        return find_program(preferences.program if preferences else "")

    def end_paint(self):
        """End the painter and the connection to it."""
        if self.session is not None:
            self.session.end()
        self.session = None
        self.follow_file()

    @property
    def is_painting(self):
        """True while there is a painter, or one that starts."""
        return self.session is not None and not self.session.is_over

    @property
    def is_busy(self):
        """True while anything works on a shot's files."""
        return self.render is not None or self.solve is not None or self.is_painting

    def follow_file(self):
        """Bring the shots to where the file's name asks for, once nothing works on them."""
        if self.is_busy or not home.has_to_follow:
            return
        source = home.path
        try:
            home.follow()
        except OSError as error:
            text = error.strerror or error
            self.say(f"the shot stays in {source}: {text}", is_error=True)
            return
        move_image_paths(source, home.path)
        self.say(f"the shot is kept in {home.path.name}")

    def tick(self):
        """Look at all that runs. Return whether anything is left that could run."""
        if self.render is not None:
            self._look_at_render()
        if self.session is not None and self.session.tick():
            if self.session.has_moved_lamps and self.solve is None and not self.is_error:
                self.message = ""  # it was about lamps that have changed since
            redraw()
        if self.solve is not None and self.solve.tick():
            text, is_error = self.solve.result
            self.solve = None
            self.say(text, is_error=is_error)
        self.follow_file()
        return self.is_busy

    def _look_at_render(self):
        render = self.render
        if (
            render is None
            or not (render.is_done or render.is_cancelled)
            or bpy.app.is_job_running("RENDER")
        ):
            return
        self.render = None
        error = render.finish()
        if not error:
            # Undoing what comes next shall not take the groups and the rendered levels along.
            push_undo("lightpaint Render")
        self.say(error or "the shot is rendered", is_error=bool(error))
        scene = bpy.data.scenes.get(render.scene_name)
        if not error and self._then and scene is not None:
            try:
                self._then(scene, scene.view_layers[render.layer_name])
            except (OSError, ValueError) as failure:
                self.say(str(failure), is_error=True)


controller = Controller()


def preferences_of():
    """Return the add-on's preferences; None while it is not enabled as one."""
    addon = bpy.context.preferences.addons.get(__package__.rpartition(".")[0])
    return addon.preferences if addon else None


def ocio_path():
    """Return the path of the colour management that Blender uses; "" if it is not known."""
    if chosen := os.environ.get("OCIO"):
        return chosen
    folder = bpy.utils.system_resource("DATAFILES", path="colormanagement")
    return os.path.join(folder, "config.ocio") if folder else ""


def redraw():
    """Draw the panels again."""
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "PROPERTIES", "IMAGE_EDITOR"):
                area.tag_redraw()


def push_undo(message):
    """Make the present state one that undo comes back to."""
    windows = bpy.context.window_manager.windows
    if windows and not bpy.app.background:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.ed.undo_push(message=message)


def start_timer():
    """Make Blender call the controller, if it does not do so already."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_on_timer):
        bpy.app.timers.register(_on_timer, first_interval=TICK_S, persistent=True)


def _on_timer():
    try:
        return TICK_S if controller.tick() else None
    except Exception as error:
        # A timer that fails is never called again, and nobody would know why.
        traceback.print_exc()
        controller.end_paint()
        controller.say(f"lightpaint has failed: {error}", is_error=True)
        return None


@persistent
def on_render_complete(*_):
    """Note that Blender has rendered; this runs in a thread of the render."""
    if controller.render is not None:
        controller.render.is_done = True


@persistent
def on_render_cancel(*_):
    """Note that somebody has stopped a render."""
    if controller.render is not None:
        controller.render.is_cancelled = True


@persistent
def on_undo(*_):
    """Discard a preview that an undone step had taken along, so that one undo takes all back."""
    if controller.session is not None:
        controller.session.forget_places()
        controller.session.hold_lamps()
    for scene in bpy.data.scenes:
        discard_preview(scene)


@persistent
def on_load(*_):
    """End what belongs to another file, and put back what a render had set when this was saved."""
    controller.end_paint()
    controller.reset()
    home.open(bpy.data.filepath)
    for scene in bpy.data.scenes:
        if scene.library is None and RENDERING in recall(scene):
            put_back_output(scene)


@persistent
def on_save(*_):
    """Bring the shots beside a file that has another name now."""
    if home.rename(bpy.data.filepath):
        controller.follow_file()
    if home.has_to_follow and controller.is_painting:
        controller.say("the shot goes beside the file when the painter ends")


def discard_preview(scene):
    """Put back the levels of before a scene's preview, if it shows one. Return whether it does."""
    memory = recall(scene)
    if scene.library is not None or not memory.get(PREVIEWS):
        return False
    for view_layer in scene.view_layers:
        groups = grouped_places(scene, view_layer)
        discard_levels(groups)
        discard_drives(groups)
    remember(scene, {**memory, PREVIEWS: False})
    return True


def _on_exit():
    """End the painter, and let its shot follow the file; Blender's own data has gone by now."""
    if controller.session is not None:
        controller.session.end()
    with contextlib.suppress(OSError):
        home.follow()


HANDLERS = (
    ("render_complete", on_render_complete),
    ("render_cancel", on_render_cancel),
    ("undo_post", on_undo),
    ("load_post", on_load),
    ("save_post", on_save),
)


def register():
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    atexit.register(_on_exit)


def unregister():
    for name, handler in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    controller.end_paint()
    atexit.unregister(_on_exit)
    if bpy.app.timers.is_registered(_on_timer):
        bpy.app.timers.unregister(_on_timer)
