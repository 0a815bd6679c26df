"""Looks side by side at full size: two to four, with one zoom and one exposure."""

from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter

#: Size and codes of the canvases, as text of their bytes: as numbers they would take ten seconds.
PIXELS = """() => [...document.querySelectorAll('.look-pane canvas')].map((canvas) => {
  const { width, height } = canvas;
  const copy = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, width, height);
  let bytes = '';
  for (let k = 0; k < data.length; k += 32768)
    bytes += String.fromCharCode(...data.subarray(k, k + 32768));
  return [width, height, btoa(bytes)];
})"""


def pictures(painter: Painter) -> list[np.ndarray]:
    """The pictures of the wall, (h, w, 3), as they are shown."""
    painter.still()
    return [
        np.frombuffer(b64decode(codes), np.uint8).reshape(height, width, 4)[..., :3].astype(int)
        for width, height, codes in painter.page.evaluate(PIXELS)
    ]


def open_wall(painter: Painter, *names: str) -> None:
    painter.button("All looks: pictures and lamps").click()
    dialog = painter.page.get_by_role("dialog")
    assert dialog.get_by_role("button", name="Side by side").is_disabled()
    for name in names:
        dialog.get_by_role("checkbox", name=f"Compare {name}", exact=True).check()
    dialog.get_by_role("button", name="Side by side").click()
    painter.page.locator(".look-pane").first.wait_for()


@pytest.fixture
def open_looks(new_painter: Any) -> Any:
    """Opens a painter with four looks, in each of which another lamp is brighter by a stop."""

    def open_painter(query: str = "lights=5", **options: Any) -> Painter:
        painter: Painter = new_painter(query, **options)
        for k in range(4):
            painter.page.evaluate(
                "(k) => painter.session.lockLight(k, host.weights[k].map((x) => 2 * x + 1), true)",
                k,
            )
            painter.still()
            painter.button("Save look").click()
            painter.still()
        return painter

    return open_painter


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("count", "size", "columns"),
    [
        nightly(2, (1280, 720), 2),
        nightly(3, (1280, 720), 2),
        (4, (1280, 720), 2),
        (3, (820, 1180), 1),
    ],
)
def test_pictures_are_as_large_as_there_is_room(
    open_looks: Any, axe: str, count: int, size: tuple[int, int], columns: int
) -> None:
    painter = open_looks(axe=axe, viewport={"width": size[0], "height": size[1]})
    open_wall(painter, *[f"Look {k + 1}" for k in range(count)])
    shown = pictures(painter)
    assert len(shown) == count
    assert len({picture.shape for picture in shown}) == 1
    boxes = [pane.bounding_box() for pane in painter.page.locator(".look-pane").all()]
    assert len({box["x"] for box in boxes}) == columns
    stage = painter.page.locator(".stage").bounding_box()
    for box in boxes:
        assert box["x"] >= stage["x"]
        assert box["y"] + box["height"] <= stage["y"] + stage["height"] + 1
    height, width, _ = shown[0].shape
    assert abs(width - boxes[0]["width"]) <= 1
    assert abs(height - boxes[0]["height"]) <= 1
    means = [picture.mean() for picture in shown]
    assert len({round(mean, 3) for mean in means}) == count  # none is another's
    assert violations(painter.page, ".lightpaint") == []
    cut = painter.page.evaluate(
        """async () => {
          const { cutOff } = await import('/cut.js');
          return cutOff(document.querySelector('.look-wall'));
        }"""
    )
    assert cut == []


@pytest.mark.nightly
def test_more_than_four_cannot_be_marked(open_looks: Any) -> None:
    painter = open_looks()
    painter.button("Save look").click()
    painter.still()
    painter.button("All looks: pictures and lamps").click()
    boxes = painter.page.get_by_role("dialog").get_by_role("checkbox")
    for k in range(4):
        boxes.nth(k).check()
    assert boxes.nth(4).is_disabled()
    boxes.nth(0).uncheck()
    assert boxes.nth(4).is_enabled()


def test_a_click_takes_one(open_looks: Any) -> None:
    painter = open_looks()
    open_wall(painter, "Look 1", "Look 3", "Look 4")
    painter.button("Take Look 3").click()
    assert [one["look"] for one in painter.requests("load_look")] == [3]
    assert painter.page.locator(".look-wall").count() == 0
    assert painter.ui("mix") is None
    assert painter.calls("showLooks")[-1][1] == 0  # the pictures are back


@pytest.mark.nightly
def test_by_keyboard_alone(open_looks: Any) -> None:
    painter = open_looks()
    open_wall(painter, "Look 1", "Look 2", "Look 3", "Look 4")
    focused = "() => document.activeElement.ariaLabel"
    assert painter.page.evaluate(focused) == "Take Look 1"
    painter.page.keyboard.press("ArrowDown")
    assert painter.page.evaluate(focused) == "Take Look 3"
    painter.page.keyboard.press("ArrowRight")
    assert painter.page.evaluate(focused) == "Take Look 4"
    painter.page.keyboard.press("Enter")
    assert [one["look"] for one in painter.requests("load_look")] == [4]
    open_wall(painter, "Look 1", "Look 2")
    painter.page.keyboard.press("Escape")
    painter.still()
    assert painter.page.locator(".look-wall").count() == 0
    assert len(painter.requests("load_look")) == 1


@pytest.mark.nightly
def test_zoom_pan_and_exposure_are_common(open_looks: Any) -> None:
    painter = open_looks()
    open_wall(painter, "Look 1", "Look 2", "Look 3")
    before = pictures(painter)
    painter.page.keyboard.press(".")
    assert all(a.mean() > b.mean() for a, b in zip(pictures(painter), before, strict=True))
    pane = painter.page.locator(".look-pane").nth(1).bounding_box()
    x, y = pane["x"] + pane["width"] / 2, pane["y"] + pane["height"] / 2
    painter.page.mouse.move(x, y)
    painter.page.keyboard.down("Control")
    painter.page.mouse.wheel(0, -300)
    painter.page.keyboard.up("Control")
    painter.still()
    assert painter.ui("display")["zoom"] > 1.5
    zoomed = pictures(painter)
    painter.page.mouse.down()
    painter.page.mouse.move(x + 60, y + 20, steps=4)
    painter.page.mouse.up()
    assert all((a != b).any() for a, b in zip(pictures(painter), zoomed, strict=True))
    assert painter.ui("display")["pan"][0] < 0
    assert painter.requests("load_look") == []  # a drag takes none


@pytest.mark.nightly
def test_two_fingers_zoom_and_one_pans(open_looks: Any) -> None:
    painter = open_looks()
    open_wall(painter, "Look 1", "Look 2")
    painter.page.evaluate(
        """async () => {
          const frame = () => new Promise((done) => setTimeout(done, 100));
          const pane = document.querySelector('.look-pane');
          const { left, top, width, height } = pane.getBoundingClientRect();
          const touch = (kind, pointerId, x, y) => pane.dispatchEvent(
            new PointerEvent(kind, { pointerId, pointerType: 'touch', bubbles: true,
              clientX: left + x * width, clientY: top + y * height }));
          touch('pointerdown', 1, 0.4, 0.5);
          touch('pointerdown', 2, 0.6, 0.5);
          touch('pointermove', 1, 0.3, 0.5);
          await frame();
          touch('pointermove', 2, 0.7, 0.5);
          await frame();
          touch('pointerup', 1, 0.3, 0.5);
          touch('pointerup', 2, 0.7, 0.5);
        }"""
    )
    painter.still()
    assert painter.ui("display")["zoom"] == pytest.approx(2, rel=0.01)
    assert np.abs(painter.ui("display")["pan"]).max() < 1  # about the middle
    painter.page.locator(".look-pane").first.dispatch_event("click")
    assert painter.requests("load_look") == []


@pytest.mark.nightly
def test_pictures_are_those_of_the_engine(open_looks: Any) -> None:
    """Those that ships draws each look with its own lights, as beside each other in two panes."""
    painter = open_looks("lights=5&engine")
    open_wall(painter, "Look 1", "Look 3", "Look 4")
    wanted = painter.page.evaluate(
        """() => {
          const { screen } = engine;
          const middle = (k) => {
            screen.copies.choose(k);
            return screen.view.lightAt('other', 24, 13);
          };
          return [0, 1, 2].map(middle);
        }"""
    )
    codes = painter.page.evaluate("(all) => all.map((rgb) => engine.codes(rgb, 0))", wanted)
    panes = painter.page.evaluate("() => engine.panes()")
    assert len(panes) == 1
    left, top, scale = (panes[0][name] for name in ("left", "top", "scale"))
    x, y = round(left + 24.5 * scale), round(top + 13.5 * scale)
    for picture, code in zip(pictures(painter), codes, strict=True):
        np.testing.assert_allclose(picture[y, x], code, atol=2)
    assert len({tuple(code) for code in codes}) == 3
    painter.page.keyboard.press("Escape")
    painter.still()
    assert len(painter.page.evaluate("() => engine.panes()")) == 2


@pytest.mark.nightly
def test_a_deleted_look_ends_it(open_looks: Any) -> None:
    painter = open_looks()
    open_wall(painter, "Look 1", "Look 2", "Look 3")
    painter.page.evaluate("() => painter.session.send('drop_look', { look: 3 })")
    painter.still()
    assert painter.page.locator(".look-wall").count() == 0


@pytest.mark.nightly
def test_looks_of_the_strip_are_opened_by_keyboard(open_looks: Any, axe: str) -> None:
    painter = open_looks(axe=axe)
    strip = painter.page.locator(".looks")
    assert strip.get_by_role("button", name="Side by side").count() == 0
    for name in ("Look 3", "Look 1"):
        mark = strip.get_by_role("button", name=f"Compare {name}", exact=True)
        mark.press("Enter")
        assert mark.get_attribute("aria-pressed") == "true"
    assert violations(painter.page, ".looks") == []
    strip.get_by_role("button", name="Side by side").press("Enter")
    painter.page.locator(".look-pane").first.wait_for()
    names = painter.page.locator(".look-pane").all_inner_texts()
    assert [name.strip() for name in names] == ["Look 3", "Look 1"]
    # A deleted look is marked no more.
    painter.page.keyboard.press("Escape")
    for _ in range(2):
        strip.get_by_role("button", name="Delete Look 1").click()
    strip.get_by_role("button", name="Side by side").wait_for(state="detached")
