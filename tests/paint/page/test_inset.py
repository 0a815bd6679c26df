"""One picture with the other small in a corner: which is large, where the other lies, and paint."""

from typing import Any

import numpy as np
import pytest
from axe import violations
from painter_page import Painter

LAPTOP = {"width": 1440, "height": 900}

PANES = """async (given) => {
  const { DEFAULTS, panes } = await import('/viewer/drawing/view.js');
  return panes({ ...DEFAULTS, layout: 'inset', ...given.params }, given.canvas, given.size);
}"""


def layout(painter: Painter, *presses: str) -> list[dict[str, Any]]:
    """Press keys, and return the pictures that are drawn, the small one last."""
    for key in presses:
        painter.page.keyboard.press(key)
    painter.still()
    panes: list[dict[str, Any]] = painter.page.evaluate("() => engine.panes()")
    return panes


def choose_inset(painter: Painter) -> list[dict[str, Any]]:
    painter.button("One picture, the other small in a corner").click()
    return layout(painter)


@pytest.mark.parametrize("corner", ["top-left", "top-right", "bottom-left", "bottom-right"])
@pytest.mark.parametrize("canvas", [(1000, 600), (400, 900), (2100, 501)])
def test_the_small_picture_is_whole_and_in_its_corner(
    page: Any, corner: str, canvas: tuple[int, int]
) -> None:
    """In the shape of the picture up to a pixel, whatever the large one is zoomed to."""
    params = {"corner": corner, "zoom": 5, "pan": [7, -3]}
    size = {"width": canvas[0], "height": canvas[1]}
    large, small = page.evaluate(PANES, {"params": params, "canvas": size, "size": [90, 160]})
    assert [large["kind"], small["kind"]] == ["solution", "painting"]
    assert (large["width"], large["height"]) == canvas
    assert small["width"] <= 0.33 * canvas[0]
    assert small["height"] <= 0.33 * canvas[1]
    assert abs(small["scale"] * 160 - small["width"]) <= 1.5
    assert abs(small["scale"] * 90 - small["height"]) <= 1.5
    right = canvas[0] - small["x"] - small["width"]
    below = canvas[1] - small["y"] - small["height"]
    margins = {"left": small["x"], "right": right, "top": small["y"], "bottom": below}
    near = {side: margins[side] for side in corner.split("-")}
    assert len(set(near.values())) == 1
    assert 0 < next(iter(near.values())) <= 0.021 * min(canvas)
    swapped = page.evaluate(
        PANES, {"params": {**params, "large": "left"}, "canvas": size, "size": [90, 160]}
    )
    assert [pane["kind"] for pane in swapped] == ["painting", "solution"]


@pytest.mark.nightly
def test_it_is_swapped_by_key_by_press_and_moved_by_drag(new_painter: Any) -> None:
    painter = new_painter(viewport=LAPTOP)
    assert [pane["kind"] for pane in choose_inset(painter)] == ["solution", "painting"]
    assert [pane["kind"] for pane in layout(painter, "k")] == ["painting", "solution"]
    painter.button("Make it large: Answer").click()
    large, small = layout(painter)
    assert [large["kind"], small["kind"]] == ["solution", "painting"]
    assert painter.calls("begin") == []  # no press on it paints
    stage = painter.page.locator(".stage").bounding_box()
    x, y = stage["x"] + small["x"] + 20, stage["y"] + small["y"] + 20
    painter.page.mouse.move(x, y)
    painter.page.mouse.down()
    painter.page.mouse.move(stage["x"] + 60, stage["y"] + 60, steps=5)
    painter.page.mouse.up()
    large, small = layout(painter)
    assert [large["kind"], small["kind"]] == ["solution", "painting"]
    assert painter.ui("display")["corner"] == "top-left"
    assert small["x"] < 30
    assert small["y"] < 30
    frame = painter.button("Make it large: Painting")
    frame.focus()
    painter.page.keyboard.press("ArrowDown")
    assert painter.ui("display")["corner"] == "bottom-left"
    painter.page.keyboard.press("Enter")
    assert [pane["kind"] for pane in layout(painter)] == ["painting", "solution"]
    assert [pane["kind"] for pane in layout(painter, "v")] == ["painting", "solution"]
    assert painter.ui("display")["layout"] == "side"
    assert painter.page.locator(".inset-frame").count() == 0


@pytest.mark.nightly
def test_the_large_picture_takes_paint_and_zoom(new_painter: Any) -> None:
    """Also the answer; a stroke that goes on over the small one stays in the large one."""
    painter = new_painter(viewport=LAPTOP)
    large, small = choose_inset(painter)
    stage = painter.page.locator(".stage").bounding_box()
    start = (small["x"] - 60, small["y"] + 40)
    painter.page.mouse.move(stage["x"] + start[0], stage["y"] + start[1])
    painter.page.mouse.down()
    painter.page.mouse.move(stage["x"] + start[0] + 100, stage["y"] + start[1], steps=4)
    painter.page.mouse.up()
    [[_, tool, point]] = painter.calls("begin")
    assert tool == "brush"
    expected = [(start[c] - large[side]) / large["scale"] for c, side in enumerate(("left", "top"))]
    assert [point["x"], point["y"]] == pytest.approx(expected, abs=0.5)
    assert len(painter.requests("paint")) >= 1
    painter.page.mouse.move(stage["x"] + 200, stage["y"] + 200)
    painter.page.keyboard.down("Control")
    painter.page.mouse.wheel(0, -240)
    painter.page.keyboard.up("Control")
    zoomed, still = layout(painter)
    assert zoomed["scale"] == pytest.approx(2 * large["scale"])
    assert still == small


def test_both_pictures_are_drawn(new_painter: Any) -> None:
    """By the engine that ships: the small picture has the pixels of the painting, the rest those of
    the answer."""
    painter = new_painter("engine&view=cpu", viewport=LAPTOP)
    page = painter.page
    page.evaluate(
        "async () => { while (engine.mirror.loader.missingSlots().length || !engine.mirror.isReady)"
        " await new Promise((done) => setTimeout(done, 20)); }"
    )
    painter.page.evaluate("() => engine.adjust({ stops: 3, mired: 0, object: null })")
    choose_inset(painter)
    painter.still()
    read = """() => {
      const { screen } = engine; screen.drawNow();
      const shown = engine.panes().map((pane) => {
        const [x, y] = [pane.x + 0.55 * pane.width, pane.y + 0.45 * pane.height];
        const picture = [(x - pane.left) / pane.scale, (y - pane.top) / pane.scale].map(Math.floor);
        const light = engine.lightAt(pane.kind, ...picture);
        return [[...screen.view.read(Math.floor(x), Math.floor(y), 1, 1)].slice(0, 3),
          engine.codes(light, 0)];
      });
      return shown;
    }"""
    (large, answer), (small, painting) = page.evaluate(read)
    np.testing.assert_allclose(large, answer, atol=6)  # pixels are interpolated
    np.testing.assert_allclose(small, painting, atol=6)
    assert np.abs(np.subtract(large, small)).max() > 20


@pytest.mark.nightly
def test_what_is_drawn_over_the_large_picture_stays_around_the_small_one(new_painter: Any) -> None:
    painter = new_painter(viewport=LAPTOP)
    _, small = choose_inset(painter)
    painter.page.keyboard.press("Control+a")
    painter.still()
    path = painter.page.locator(".ants").evaluate("(one) => getComputedStyle(one).clipPath")
    assert path.startswith("polygon(evenodd")
    assert f"{small['x']:.0f}"[:4] in path


@pytest.mark.nightly
def test_axe_finds_nothing_with_an_inset(new_painter: Any, axe: str) -> None:
    painter = new_painter("lights=12", axe=axe)
    choose_inset(painter)
    assert violations(painter.page, ".lightpaint") == []
