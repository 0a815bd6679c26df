"""The plan of the room: outlines of objects where they stand, with their names."""

from typing import Any

import pytest
from axe import violations
from painter_page import Painter

#: A camera at the front of a room of 10 by 5 by 8 units, which looks along −z.
CAMERA = {
    "origin": [5, 2, 12],
    "x_axis": [2 / 48, 0, 0],
    "y_axis": [0, -2 / 27, 0],
    "forward": [-1, 1, -1],
    "is_parallel": False,
}
OBJECTS = [
    {"name": "stage <b>", "corners": [[1, 1], [9, 1], [9, 4], [1, 4]]},
    {"name": "chair", "corners": [[7, 5], [8, 5], [8, 6], [7, 6]]},
    {"name": "chair", "corners": [[2, 5], [3, 5], [2.5, 6]]},
]


def show_plan(painter: Painter) -> None:
    painter.page.keyboard.press("d")
    painter.page.evaluate(
        """([camera, objects]) => window.host.tell({ kind: 'rig', cameras: [camera], up: 1,
          low: [0, 0, 0], high: [10, 5, 8], surfaces: [], skies: [], objects,
          lights: window.host.room.lights.map((_, k) => ({ position: [1 + k, 4, 4], direction: null,
            target: null, cutoff: null, beam: null, rail: null, immovable_reason: '' })) })""",
        [CAMERA, OBJECTS],
    )
    painter.still()


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    opened = new_painter("lights=3")
    show_plan(opened)
    return opened  # type: ignore[no-any-return]


def test_objects_stand_where_lights_do(painter: Painter) -> None:
    """By one scale: the corners of the room are those of its outline, and the view is upwards."""
    corners = painter.page.evaluate(
        """() => ['.room', ...[1, 2, 3].map((k) => `.plan-objects polygon:nth-of-type(${k})`)].map(
          (name) => [...document.querySelector(name).points].map(({ x, y }) => [x, y]))"""
    )
    room, stage, right, left = corners
    (x0, y0), scale = min(room), (max(room)[0] - min(room)[0]) / 10
    assert len(room) == 4
    top = min(y for _, y in room)
    for outline, entry in zip((stage, right, left), OBJECTS, strict=True):
        expected = [(x0 + scale * x, top + scale * z) for x, z in entry["corners"]]  # type: ignore[attr-defined]
        for point, place in zip(outline, expected, strict=True):
            assert point == pytest.approx(place, abs=0.01)
    assert y0 >= top


def test_objects_have_names(painter: Painter) -> None:
    """Under the pointer; written where there is room; and all of them for screen readers."""
    page = painter.page
    outlines = page.locator(".plan-objects polygon")
    outlines.nth(1).hover()
    page.locator(".tip", has_text="chair").wait_for()
    assert page.locator(".plan-objects text").all_text_contents() == ["stage <b>"]
    assert page.get_by_role("img", name="Objects: stage <b>, chair").count() == 1


def test_axe_finds_nothing_on_the_plan(new_painter: Any, axe: str) -> None:
    painter = new_painter("lights=3", axe=axe)
    show_plan(painter)
    assert violations(painter.page, ".side") == []
