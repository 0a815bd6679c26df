"""Pictures of ways without the painter, and of the preferences; Blender's window runs this.

Somebody paints over the shot's picture in the image editor; the lamps follow in a view beside it.
"""

import os
import sys
from collections.abc import Iterator
from typing import Any

sys.path.insert(0, os.environ["STEPS_FOLDER"])

import addon_utils
import bpy
from scripted_painter import controller, lightpaint_blender
from window_steps import (
    TAB,
    click,
    folder,
    keep_picture,
    keep_rendered_picture,
    press,
    run_steps,
    until,
    window,
)

#: The brush: its colour, its radius in pixels, and strokes on the wall left of the head.
BLUE, RADIUS, STRENGTH = (0.08, 0.16, 0.9), 26, 0.5
STROKES = (((60, 330), (110, 350), (150, 320)), ((50, 380), (100, 395), (135, 370)))


def areas(kind: str) -> list[Any]:
    return [area for area in window().screen.areas if area.type == kind]


def split_view() -> None:
    """Part the 3D view in two, the left of which becomes an image editor."""
    with bpy.context.temp_override(window=window(), area=areas("VIEW_3D")[0]):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)


def drag(places: tuple[tuple[int, int], ...]) -> Iterator[float]:
    """Draw a stroke through places."""

    def event(kind: str, value: str, place: tuple[int, int]) -> None:
        x, y = place[0], window().height - place[1]
        window().event_simulate(type=kind, value=value, x=x, y=y)

    event("MOUSEMOVE", "NOTHING", places[0])
    yield 0.4
    event("LEFTMOUSE", "PRESS", places[0])
    for place in places:
        event("MOUSEMOVE", "NOTHING", place)
        yield 0.2
    event("LEFTMOUSE", "RELEASE", places[-1])
    yield 0.4


def paint_over() -> Iterator[float]:
    """Open the shot's picture, and draw on it."""
    with bpy.context.temp_override(window=window(), area=areas("VIEW_3D")[0]):
        bpy.ops.lightpaint.paint_over()
    yield from until(lambda: controller.render is controller.solve is None, "a picture")
    yield 1.0
    bpy.context.tool_settings.unified_paint_settings.size = RADIUS
    brush = bpy.context.tool_settings.image_paint.brush
    brush.color, brush.strength = BLUE, STRENGTH
    areas("IMAGE_EDITOR")[0].spaces.active.show_region_ui = False
    yield 0.5
    for stroke in STROKES:
        yield from drag(stroke)


def walk(found: dict[str, Any]) -> Iterator[float]:
    """Do what a user does, and keep pictures."""
    yield 0.5
    split_view()
    yield 0.5
    left, right = sorted(areas("VIEW_3D"), key=lambda area: area.x)
    left.type = "IMAGE_EDITOR"
    space = right.spaces.active
    space.region_3d.view_perspective, space.overlay.show_overlays = "CAMERA", False
    press("N", (700, 600))
    yield 0.5
    yield from click(TAB)
    yield 0.5
    yield from paint_over()
    with bpy.context.temp_override(window=window(), area=right):
        bpy.ops.lightpaint.solve_image()
    yield from until(lambda: controller.solve is None, "an answer")
    yield from keep_rendered_picture("paint-over")
    yield from show_preferences()


def show_preferences() -> Iterator[float]:
    """Install the archive as a user does, and keep a picture of what the preferences then show."""
    lightpaint_blender.unregister()
    for name in [name for name in sys.modules if name.startswith(lightpaint_blender.__name__)]:
        del sys.modules[name]
    bpy.ops.screen.userpref_show(section="ADDONS")
    bpy.ops.preferences.addon_install(filepath=os.path.join(folder, "lightpaint-blender.zip"))
    bpy.ops.preferences.addon_enable(module=lightpaint_blender.__name__)
    [module] = [x for x in addon_utils.modules() if x.__name__ == lightpaint_blender.__name__]
    addon_utils.module_bl_info(module)["show_expanded"] = True
    yield 3.0
    keep_picture("preferences", number=-1)


run_steps(walk)
