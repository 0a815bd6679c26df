"""Selecting, by pointer, by key and by numbers: what the interface asks the engine for."""

import time
from typing import Any

import numpy as np
import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter
from patience import PATIENCE_S


def drag(painter: Painter, *places: tuple[float, float], keys: tuple[str, ...] = ()) -> None:
    """Drag over the painting, from place to place in its pixels."""
    left, top, scale = painter.page.evaluate(
        """() => {
          const { x, y } = document.querySelector('.stage').getBoundingClientRect();
          const [pane] = engine.panes();
          return [x + pane.left, y + pane.top, pane.scale];
        }"""
    )
    at = [(left + x * scale, top + y * scale) for x, y in places]
    for key in keys:
        painter.page.keyboard.down(key)
    painter.page.mouse.move(*at[0])
    painter.page.mouse.down()
    for place in at[1:]:
        painter.page.mouse.move(*place, steps=4)
    painter.page.mouse.up()
    for key in keys:
        painter.page.keyboard.up(key)
    painter.still()


def selected(painter: Painter) -> tuple[dict[str, Any], dict[str, Any]]:
    """The last part that was asked for, and how it joins."""
    _, part, options = painter.calls("select")[-1]
    return part, options


def test_a_drag_selects_and_shift_and_alt_say_how_it_joins(painter: Painter) -> None:
    painter.page.keyboard.press("m")
    drag(painter, (10.2, 5.1), (30.4, 20.3))
    part, options = selected(painter)
    assert part == {"kind": "rectangle", "corners": [[10, 5], [30, 20]]}
    assert options == {"mode": "replace", "feather": 0}
    assert painter.calls("begin") == []
    for keys, mode in (
        (("Shift",), "add"),
        (("Alt",), "subtract"),
        (("Shift", "Alt"), "intersect"),
    ):
        drag(painter, (10, 5), (30, 20), keys=keys)
        assert selected(painter)[1]["mode"] == mode
    # Each press of the key is the next shape.
    painter.page.keyboard.press("m")
    drag(painter, (10, 5), (20, 9))
    assert selected(painter)[0] == {"kind": "ellipse", "corners": [[10, 5], [20, 9]]}
    painter.page.keyboard.press("m")
    drag(painter, (10, 5), (30, 6), (20, 20))
    part, _ = selected(painter)
    assert part["kind"] == "lasso"
    assert len(part["corners"]) > 6
    painter.page.keyboard.press("m")
    drag(painter, (10, 5), (10, 5))
    assert selected(painter)[0]["kind"] == "object"
    painter.page.keyboard.press("m")
    drag(painter, (10, 5), (10, 5))
    part, _ = selected(painter)
    assert (part["kind"], part["picture"], part["tolerance"]) == ("colour", "painting", 12)
    # A click of a shape selects nothing, and so does Escape.
    painter.page.keyboard.press("m")
    drag(painter, (10, 5), (10, 5))
    assert painter.calls("changeSelection")[-1][1] == {"kind": "none"}
    count = len(painter.calls("select"))
    painter.give_up()
    assert len(painter.calls("select")) == count


@pytest.mark.nightly
def test_keys_select_all_and_nothing_and_draw_a_shape_from_corner_to_corner(
    painter: Painter,
) -> None:
    painter.page.keyboard.press("Control+a")
    assert selected(painter)[0] == {"kind": "all"}
    painter.page.keyboard.press("Control+Shift+I")
    painter.page.keyboard.press("Control+d")
    kinds = [change["kind"] for _, change in painter.calls("changeSelection")]
    assert kinds == ["invert", "none"]
    painter.page.keyboard.press("m")
    stage = painter.page.locator(".stage")
    stage.focus()
    for key in ("ArrowRight", "Enter", "ArrowRight", "ArrowDown", "ArrowDown", "Enter"):
        stage.press(key)
    (x0, y0), (x1, y1) = selected(painter)[0]["corners"]
    assert x1 > x0
    assert y1 > y0


def test_adjustments_apply_to_what_is_selected_until_nothing_is(painter: Painter) -> None:
    assert painter.ui("adjustedArea") == "spot"
    painter.page.keyboard.press("Control+a")
    painter.page.keyboard.press("a")
    area = painter.page.get_by_role("group", name="Area")
    chosen = area.get_by_role("button", name="Selection", exact=True)
    assert chosen.get_attribute("aria-pressed") == "true"
    painter.page.keyboard.press("g")
    assert chosen.get_attribute("aria-pressed") == "true"
    painter.page.keyboard.press("a")
    painter.button("By numbers", exact=True).click()
    whole = painter.page.get_by_role("combobox", name="Area").locator("option").first
    assert whole.inner_text() == "Selection"
    painter.page.evaluate("() => engine.selections.change({ kind: 'none' })")
    painter.still()
    assert painter.ui("adjustedArea") == "spot"
    assert whole.inner_text() == "Whole picture"


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((820, 1180)), (700, 500)])
def test_the_panel_selects_by_numbers_and_nothing_of_it_is_cut(
    new_painter: Any, axe: str, size: Any
) -> None:
    painter: Painter = new_painter(axe=axe, viewport={"width": size[0], "height": size[1]})
    painter.page.evaluate(
        "() => painter.store.set({ side: true, tool: 'select', open: { select: true } })"
    )
    for label, number in (("Left", "4"), ("Top", "3"), ("Width", "20"), ("Height", "10")):
        painter.type(label, number)
    panel = painter.page.locator(".select-panel")
    panel.get_by_role("button", name="Select", exact=True).click()
    painter.still()
    assert selected(painter)[0] == {"kind": "rectangle", "corners": [[4, 3], [24, 13]]}
    painter.type("Edge", "5")
    for name in ("Grow", "Shrink", "Feather"):
        panel.get_by_role("button", name=name, exact=True).click()
    changes = [change for _, change in painter.calls("changeSelection")]
    assert [(one["kind"], one["pixels"]) for one in changes] == [
        *(("grow", 5), ("grow", -5), ("feather", 5)),
    ]
    painter.choose("Select", "brightness")
    painter.type("From", "70")
    panel.get_by_role("button", name="Answer", exact=True).click()
    panel.get_by_role("button", name="Select", exact=True).click()
    expected = {"kind": "brightness", "picture": "solution", "low": 70, "high": 100}
    assert selected(painter)[0] == expected
    painter.choose("Select", "light")
    name = painter.page.evaluate("() => painter.store.value.lights[1].name")
    panel.get_by_role("combobox", name="Light").select_option(name)
    panel.get_by_role("button", name="Select", exact=True).click()
    assert selected(painter)[0] == {"kind": "light", "light": 1}
    painter.still()
    assert violations(painter.page, ".lightpaint") == []
    # In narrow windows the panels lie over the options of the tool.
    parts = [".is-select"] if size[0] < 760 else [".is-select", ".options"]
    cut = painter.page.evaluate(
        """async (parts) => {
          const { cutOff } = await import('/cut.js');
          return parts.flatMap((part) => cutOff(document.querySelector(part)));
        }""",
        parts,
    )
    assert cut == []


ANTS = """() => {
  const canvas = document.querySelector('canvas.ants');
  const context = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');
  context.drawImage(canvas, 0, 0);
  return [...context.getImageData(0, 0, canvas.width, canvas.height).data];
}"""


@pytest.mark.nightly
@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
def test_ants_march_unless_motion_is_unwanted(new_painter: Any, motion: str) -> None:
    painter: Painter = new_painter(reduced_motion=motion, viewport={"width": 420, "height": 300})
    painter.page.evaluate(
        "() => engine.selections.select({ kind: 'rectangle', corners: [[4, 3], [20, 13]] })"
    )
    painter.still()
    first = second = painter.page.evaluate(ANTS)
    end = time.monotonic() + (0.3 if motion == "reduce" else PATIENCE_S)
    while first == second and time.monotonic() < end:
        painter.page.wait_for_timeout(100)
        second = painter.page.evaluate(ANTS)
    assert (first == second) == (motion == "reduce")
    shown, codes = np.reshape(first, (-1, 4)), {0, 255}
    assert {*shown[shown[:, 3] > 0][:, 0].tolist()} == codes
    # The line is one pixel wide, around the same place in both pictures.
    assert (np.reshape(second, (-1, 4))[:, 3] == shown[:, 3]).all()


# Gradients


def add_gradient(painter: Painter) -> None:
    """Have one between two colours, and make it active."""
    painter.page.evaluate(
        """async () => {
          const { newLayer } = await import('/engine/layers/layer_list.js');
          const gradient = { shape: 'linear', start: [10, 5], end: [30, 15], light: [1, 0.5, 0.2],
            end_light: [0, 0, 1], is_incident: true };
          const layers = [newLayer(1, 'gradient', { name: 'Gradient', gradient })];
          engine.changeLayers({ layers });
          engine.chooseLayer(1);
        }"""
    )
    painter.still()


@pytest.mark.nightly
def test_a_gradient_is_drawn_by_key_and_its_ends_are_moved(painter: Painter) -> None:
    painter.page.keyboard.press("r")
    assert painter.ui("tool") == "gradient"
    painter.page.get_by_role("button", name="Radial", exact=True).click()
    painter.page.get_by_role("button", name="To 2nd colour").click()
    painter.still()
    settings = painter.page.evaluate("() => engine.tool.gradient")
    assert (settings["shape"], settings["hasEnd"], settings["isAdjusting"]) == (
        "radial",
        True,
        False,
    )
    stage = painter.page.locator(".stage")
    stage.focus()
    for key in ("ArrowRight", "Enter", "ArrowRight", "ArrowDown", "Enter"):
        stage.press(key)
    [(_, start, end)] = painter.calls("line")
    assert end["x"] > start["x"]
    assert end["y"] > start["y"]
    add_gradient(painter)
    painter.still()
    handle = painter.page.get_by_role("button", name="End of the gradient")
    handle.focus()
    handle.press("ArrowRight")
    handle.press("Shift+ArrowDown")
    box = painter.page.get_by_role("button", name="Start of the gradient").bounding_box()
    scale = painter.page.evaluate("() => engine.panes()[0].scale")
    painter.page.mouse.move(box["x"] + 12, box["y"] + 12)
    painter.page.mouse.down()
    painter.page.mouse.move(box["x"] + 12 + 4 * scale, box["y"] + 12, steps=3)
    painter.page.mouse.up()
    changes = [change for _, change in painter.calls("changeLayers")]
    assert changes[1]["layers"][0]["gradient"]["end"] == [31, 15]
    assert changes[2]["layers"][0]["gradient"]["end"] == [31, 25]
    last = changes[-1]
    assert last["layers"][0]["gradient"]["start"] == pytest.approx([14, 5], abs=0.2)
    assert last["is_final"] is False  # the engine ends it
    assert painter.calls("begin") == []


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((820, 1180))])
def test_a_gradient_is_changed_in_numbers_and_nothing_of_it_is_cut(
    new_painter: Any, axe: str, size: Any
) -> None:
    painter: Painter = new_painter(axe=axe, viewport={"width": size[0], "height": size[1]})
    add_gradient(painter)
    shown = "{ side: true, openLayer: 1, tool: 'gradient', open: { layers: true } }"
    painter.page.evaluate(f"() => painter.store.set({shown})")
    painter.type("To x", "40")
    painter.page.get_by_role("button", name="Fade out").click()
    painter.page.get_by_role("button", name="Start in current colour").click()
    painter.still()
    gradients = [change["layers"][0]["gradient"] for _, change in painter.calls("changeLayers")[1:]]
    assert gradients[0]["end"] == [40, 15]
    assert gradients[1]["end_light"] is None
    assert gradients[2]["light"] != [1, 0.5, 0.2]
    assert violations(painter.page, ".lightpaint") == []
    cut = painter.page.evaluate(
        """async () => {
          const { cutOff } = await import('/cut.js');
          return ['.is-layers', '.options'].flatMap((part) => cutOff(document.querySelector(part)));
        }"""
    )
    assert cut == []
