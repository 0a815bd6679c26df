"""A window of Blender that a script presses keys and buttons in; imported within Blender only.

Blender runs with `--enable-event-simulate`, in a window of 1280 x 800. Its last arguments are a
folder for what is found, and one for pictures, or "-". SHOT_SCRIPT in the environment may name a
file whose `new_shot` builds another scene than that of tests.
"""

import json
import os
import runpy
import sys
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import bpy
from scripted_painter import controller, lightpaint_blender
from shots import new_shot

folder, pictures = sys.argv[-2], sys.argv[-1]

#: Builds the scene.
build_shot = new_shot
if script := os.environ.get("SHOT_SCRIPT"):
    build_shot = runpy.run_path(script)["new_shot"]

#: The add-on's tab, from the window's upper left corner.
TAB = (1044, 254)

#: Seconds in which Cycles draws the viewport, where pictures are wanted.
SECONDS_OF_VIEWPORT = 100.0

#: Twentieths of a second that anything takes on a busy machine.
PATIENCE = 2000


def window(number: int = 0) -> Any:
    return bpy.context.window_manager.windows[number]


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


def keep_picture(name: str, number: int = 0) -> None:
    """Keep a picture of a window, if pictures are wanted."""
    if pictures != "-":
        shown, screen = window(number), window(number).screen
        with bpy.context.temp_override(window=shown, screen=screen, area=screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=os.path.join(pictures, f"{name}.png"))


def until(is_so: Callable[[], object], description: str) -> Iterator[float]:
    """Let Blender go on until something is so."""
    for _ in range(PATIENCE):
        if is_so():
            return
        yield 0.05
    session = controller.session
    raise AssertionError((description, controller.message, session and session.message))


def show_camera() -> None:
    """Look through the camera, as Cycles renders."""
    [area] = [x for x in window().screen.areas if x.type == "VIEW_3D"]
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    space.overlay.show_overlays = False


def keep_rendered_picture(name: str) -> Iterator[float]:
    """Keep a picture in which Cycles has drawn the view, if pictures are wanted."""
    if pictures != "-":
        shading = max(
            (x for x in window().screen.areas if x.type == "VIEW_3D"), key=lambda area: area.x
        ).spaces.active.shading
        shading.type = "RENDERED"
        # A button under the mouse would look as it did when it was pressed.
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=500, y=120)
        yield SECONDS_OF_VIEWPORT
        keep_picture(name)
        shading.type = "SOLID"  # a render would slow down all that follows


def open_tab() -> Iterator[float]:
    """Open the sidebar of the 3D view at the add-on's tab."""
    press("N", (500, 400))
    yield 0.5
    yield from click(TAB)
    yield 1.0


def run_steps(walk: Callable[[dict[str, Any]], Iterator[float]]) -> None:
    """Prepare the file, then walk while Blender's own loop runs, and write what the walk found."""
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
