"""The whole way in a window of Blender, by clicks and keys; it keeps pictures if asked to.

Blender runs this with `--enable-event-simulate`, in a window of 1280 x 800. The environment's
SHOT_SCRIPT may name a file whose `new_shot` builds another scene.
"""

import json
import os
import runpy
import sys
import traceback
from collections.abc import Callable, Iterator
from typing import Any

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import (
    ScriptedPainter,
    contents,
    controller,
    has_answer,
    lightpaint_blender,
)
from shots import new_shot

folder, pictures = sys.argv[-2], sys.argv[-1]

#: Builds the scene.
build_shot = new_shot
if script := os.environ.get("SHOT_SCRIPT"):
    build_shot = runpy.run_path(script)["new_shot"]

#: Places in the window, from its upper left corner: the add-on's tab, its buttons.
TAB, PAINT, APPLY = (1044, 254), (931, 130), (896, 187)

#: Seconds in which Cycles draws the viewport, where pictures are wanted.
SECONDS_OF_VIEWPORT = 45.0

#: Twentieths of a second that anything takes on a busy machine.
PATIENCE = 2000


def window() -> Any:
    return bpy.context.window_manager.windows[0]


def press(kind: str, place: tuple[int, int], **modifiers: bool) -> None:
    """Press a key or a button of the mouse at a place."""
    x, y = place[0], window().height - place[1]
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type=kind, value=value, x=x, y=y, **modifiers)


def click(place: tuple[int, int]) -> Iterator[float]:
    """Move the mouse to a button, which has to notice, and press it."""
    for x in (place[0] - 2, place[0]):
        y = window().height - place[1]
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield 0.3
    press("LEFTMOUSE", place)


def keep_picture(name: str) -> None:
    """Keep a picture of the window, if pictures are wanted."""
    if pictures != "-":
        screen = window().screen
        with bpy.context.temp_override(window=window(), screen=screen, area=screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=os.path.join(pictures, f"{name}.png"))


def until(is_so: Callable[[], object], description: str) -> Iterator[float]:
    """Let Blender go on until something is so."""
    for _ in range(PATIENCE):
        if is_so():
            return
        yield 0.05
    session = controller.session
    raise AssertionError((description, controller.message, session and session.message))


def energies() -> list[float]:
    return [lamp.energy for lamp in bpy.data.lights]


def show_camera() -> None:
    """Look through the camera, as Cycles renders."""
    [area] = [x for x in window().screen.areas if x.type == "VIEW_3D"]
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    space.overlay.show_overlays = False
    if pictures != "-":
        space.shading.type = "RENDERED"


def show_solid() -> None:
    """Show no render: Cycles would slow down all that follows."""
    [area] = [x for x in window().screen.areas if x.type == "VIEW_3D"]
    area.spaces.active.shading.type = "SOLID"


def walk(found: dict[str, Any]) -> Iterator[float]:
    """Do what a user does, and note what comes of it."""
    yield 0.5
    before, rendered = contents(), energies()
    show_camera()
    if pictures != "-":
        yield SECONDS_OF_VIEWPORT
    press("N", (500, 400))
    yield 0.5
    yield from click(TAB)
    yield 1.0
    keep_picture("panel")
    yield from click(PAINT)
    yield from until(lambda: controller.render is not None, "a render")
    yield from until(lambda: controller.session and controller.session.state.is_open, "a painter")
    found["unpainted"] = energies() == rendered
    painter = ScriptedPainter()
    yield 0.5
    keep_picture("painter")
    render = bpy.context.scene.render
    painter.brighten(render.resolution_x, render.resolution_y, gain=4.0)
    yield from until(has_answer, "an answer")
    yield from until(lambda: energies() != rendered, "lamps that follow")
    painter.ask("save_look", name="Evening")
    yield from until(lambda: controller.session.state.looks, "a look")
    if pictures != "-":
        yield from until(lambda: controller.session.message, "a sentence")
        yield SECONDS_OF_VIEWPORT
    keep_picture("following")
    show_solid()
    painted = energies()
    yield from click(APPLY)
    yield from until(lambda: controller.message == "the lamps are as painted", "what is applied")
    found["applied"] = energies() == painted
    yield from undo_and_revert(found, before, rendered, painted)


def undo_and_revert(
    found: dict[str, Any], before: Any, rendered: list[float], painted: list[float]
) -> Iterator[float]:
    """Undo, redo, revert; each is one step."""
    press("Z", (500, 650), ctrl=True)
    yield from until(lambda: energies() == rendered, "one undo that takes it back")
    press("Z", (500, 400), ctrl=True, shift=True)
    yield from until(lambda: energies() == painted, "a redo")
    bpy.ops.lightpaint.revert()
    yield 0.2
    after = contents()
    found["left by revert"] = [key for key in before if before[key] != after.get(key)]
    found["is painter ended"] = controller.session is None


def main() -> None:
    """Prepare the file, then walk while Blender's own loop runs."""
    lightpaint_blender.register()
    with bpy.context.temp_override(window=window()):
        scene = build_shot()
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "shot.blend"))
    found: dict[str, Any] = {"view": scene.view_settings.view_transform}
    steps = walk(found)

    def step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            found["is done"] = True
        except Exception:
            found["error"] = traceback.format_exc()
        with open(os.path.join(folder, "found.json"), "w") as file:
            json.dump(found, file)
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


main()
