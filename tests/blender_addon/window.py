"""The whole way in a window of Blender, by clicks and keys; it keeps pictures if asked to."""

import os
import sys
from collections.abc import Iterator
from typing import Any

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import ScriptedPainter, contents, controller, has_answer
from window_steps import (
    click,
    keep_rendered_picture,
    open_tab,
    press,
    run_steps,
    show_camera,
    until,
)

#: Places of buttons in the window, from its upper left corner.
PAINT, APPLY = (931, 130), (896, 187)


def energies() -> list[float]:
    return [lamp.energy for lamp in bpy.data.lights]


def walk(found: dict[str, Any]) -> Iterator[float]:
    """Do what a user does, and note what comes of it."""
    yield 0.5
    before, rendered = contents(), energies()
    show_camera()
    yield from open_tab()
    yield from keep_rendered_picture("panel")
    yield from click(PAINT)
    yield from until(lambda: controller.render is not None, "a render")
    yield from until(lambda: controller.session and controller.session.state.is_open, "a painter")
    found["unpainted"] = energies() == rendered
    yield from keep_rendered_picture("painter")
    painter = ScriptedPainter()
    render = bpy.context.scene.render
    painter.brighten(render.resolution_x, render.resolution_y, gain=4.0)
    yield from until(has_answer, "an answer")
    yield from until(lambda: energies() != rendered, "lamps that follow")
    painter.ask("save_look", name="Evening")
    yield from until(lambda: controller.session.state.looks, "a look")
    yield from until(lambda: controller.session.message, "a sentence")
    yield from keep_rendered_picture("following")
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


run_steps(walk)
