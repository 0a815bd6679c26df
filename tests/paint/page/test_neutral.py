"""The tool that makes what is pressed neutral: its tint, its layer, and its one step."""

from typing import Any

import numpy as np
import pytest
from painter_page import Painter

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

MODULE = "async (given) => { const m = await import('/engine/neutral.js');"

#: The pixels around a place of the picture that ships, and all of them.
READ = """([x, y]) => {
  const { width, height } = engine.mirror.canvas;
  const { image } = engine.mirror.drawnPainting;
  return [[...image], width, height];
}"""


def adjusted(light: Any, tint: Any) -> Any:
    """Return light with a tint at the same luminance, pixel by pixel, as a layer has it."""
    tinted = light * tint
    return tinted * (light @ LUMINANCE / (tinted @ LUMINANCE))[..., None]


def tint_of(page: Any, pixels: Any) -> Any:
    return page.evaluate(MODULE + "return m.neutralTint(given); }", np.asarray(pixels).tolist())


def test_a_flat_colour_becomes_neutral(page: Any) -> None:
    """By the reciprocal of each channel, at the same luminance."""
    colour = np.array([0.8, 0.4, 0.1])
    tint = tint_of(page, [colour] * 9)
    np.testing.assert_allclose(tint, 1 / colour / (1 / colour @ LUMINANCE))
    result = adjusted(colour[None], tint)[0]
    np.testing.assert_allclose(result, colour @ LUMINANCE)


@pytest.mark.parametrize("seed", range(4))
def test_the_mean_of_an_uneven_area_becomes_neutral(page: Any, seed: int) -> None:
    """Though each pixel keeps its own luminance."""
    pixels = np.random.default_rng(seed).uniform(0.05, 1, (40, 3)) * [1, 0.7, 0.3]
    mean = adjusted(pixels, tint_of(page, pixels)).mean(axis=0)
    np.testing.assert_allclose(mean, mean @ LUMINANCE, rtol=1e-6)


@pytest.mark.parametrize("colour", [[0, 0, 0], [0.5, 0.2, 0], [1, 1e-3, 1e-3]])
def test_light_of_one_colour_has_no_tint(page: Any, colour: list[float]) -> None:
    assert tint_of(page, [colour] * 4) is None


@pytest.mark.nightly
def test_only_a_disc_is_sampled(page: Any) -> None:
    """Of a fiftieth of the height, cut at the edge of the picture."""
    height, width = 200, 300
    image = np.zeros((height, width, 3))
    image[:] = np.stack([*np.meshgrid(range(width), range(height)), np.ones((height, width))], -1)
    given = [image.ravel().tolist(), [height, width], {"x": 100, "y": 50}]
    pixels = np.array(page.evaluate(MODULE + "return m.pixelsAround(...given); }", given))
    assert len(pixels) == pytest.approx(np.pi * 2**2, abs=4)
    assert np.hypot(pixels[:, 0] + 0.5 - 100, pixels[:, 1] + 0.5 - 50).max() <= 2
    given[2] = {"x": 0, "y": 0}
    assert np.array(page.evaluate(MODULE + "return m.pixelsAround(...given); }", given)).max() <= 2


def open_shipped(new_painter: Any) -> Painter:
    """A painter with the engine that ships, whose pictures are all there."""
    painter: Painter = new_painter("engine&view=cpu")
    painter.page.evaluate(
        "async () => { while (engine.mirror.loader.missingSlots().length || !engine.mirror.isReady)"
        " await new Promise((done) => setTimeout(done, 20)); }"
    )
    return painter


def press(painter: Painter, x: float, y: float) -> None:
    """Press the neutral tool at a place of the picture, in its pixels."""
    painter.page.keyboard.press("u")
    painter.still()
    place = painter.page.evaluate(
        """([x, y]) => {
          const { left, top } = engine.element.getBoundingClientRect();
          const pane = engine.panes()[0];
          return [left + pane.left + x * pane.scale, top + pane.top + y * pane.scale];
        }""",
        [x, y],
    )
    painter.page.mouse.click(*place)
    painter.still()


def painted(painter: Painter) -> Any:
    """Return the light of the painting as it is drawn, (h, w, 3)."""
    image, width, height = painter.page.evaluate(READ, [0, 0])
    return np.array(image).reshape(height, width, 3)


def test_a_press_makes_a_layer_over_the_whole_picture(new_painter: Any) -> None:
    """The place is neutral and as bright as before; so is all else as bright. One step."""
    painter = open_shipped(new_painter)
    before = painted(painter)
    press(painter, 36, 8)
    after = painted(painter)
    near = (slice(7, 9), slice(35, 37))
    assert np.ptp(before[near].mean(axis=(0, 1))) > 0.01
    mean = after[near].mean(axis=(0, 1))
    np.testing.assert_allclose(mean, mean @ LUMINANCE, rtol=0.02)  # a disc of three pixels
    np.testing.assert_allclose(after @ LUMINANCE, before @ LUMINANCE, rtol=1e-3)
    [layer] = painter.ui("layers")[1:]
    assert layer["kind"] == "adjust"
    assert layer["gain"] == 1
    assert layer["name"] == "Whole picture, neutral at Back wall"
    steps = [one for one in painter.requests("paint") if one["is_final"]]
    assert [step["label"] for step in steps] == ["Whole picture, neutral at Back wall"]


@pytest.mark.nightly
def test_black_cannot_become_neutral(new_painter: Any) -> None:
    painter = open_shipped(new_painter)
    painter.page.evaluate("() => engine.mirror.drawnPainting.image.fill(0)")
    press(painter, 24, 13)
    assert painter.page.get_by_text("Nothing is neutral here").is_visible()
    assert painter.requests("paint") == []


@pytest.mark.nightly
def test_the_tool_is_used_by_keys_and_on_either_picture(new_painter: Any) -> None:
    painter = new_painter()
    painter.page.keyboard.press("u")
    assert painter.ui("tool") == "neutral"
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("ArrowRight")
    painter.page.keyboard.press("Enter")
    assert len(painter.calls("neutralize")) == 1
    right = painter.page.evaluate("() => engine.panes()[1]")
    stage = painter.page.locator(".stage").bounding_box()
    x, y = (right[a] + 0.5 * right[b] for a, b in (("x", "width"), ("y", "height")))
    painter.page.mouse.click(stage["x"] + x, stage["y"] + y)
    painter.still()
    [_, point] = painter.calls("neutralize")[-1]
    expected = [(x - right["left"]) / right["scale"], (y - right["top"]) / right["scale"]]
    assert [point["x"], point["y"]] == pytest.approx(expected, abs=0.6)
    assert painter.calls("begin") == []
