"""Lights that are images, on a painter's page: one row with a map, whose texels are painted."""

from typing import Any

import numpy as np
import pytest
from axe import violations
from painter_page import Painter

#: Three lights, and an image of 4 by 3 texels behind them.
QUERY, FIRST, COLUMNS, ROWS = "lights=15&image=4x3", 3, 4, 3
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    return new_painter(QUERY)  # type: ignore[no-any-return]


def weights(painter: Painter) -> Any:
    """Return the weights of the texels, (12, 3)."""
    return np.array(painter.ui("weights"))[FIRST:]


def last_request(painter: Painter) -> dict[str, Any]:
    return painter.requests("constrain_lights")[-1]


def unfold(painter: Painter) -> None:
    painter.button("sky", exact=True).click()
    painter.still()


def drag(
    painter: Painter, *places: tuple[int, int], modifier: str = "", is_cancelled: bool = False
) -> None:
    """Drag over the middles of texels, given by column and row, and wait for the answer.

    is_cancelled: press Escape before the end.
    """
    painter.page.locator(".texel-map").scroll_into_view_if_needed()
    box = painter.page.locator(".texel-map").bounding_box()
    if modifier:
        painter.page.keyboard.down(modifier)
    for k, (column, row) in enumerate(places):
        x = box["x"] + (column + 0.5) / COLUMNS * box["width"]
        y = box["y"] + (row + 0.5) / ROWS * box["height"]
        painter.page.mouse.move(x, y, steps=1 if k == 0 else 6)
        if k == 0:
            painter.page.mouse.down()
    if is_cancelled:
        painter.page.keyboard.press("Escape")
    painter.page.mouse.up()
    if modifier:
        painter.page.keyboard.up(modifier)
    painter.still()


def test_an_image_is_one_row_with_its_map(painter: Painter) -> None:
    page = painter.page
    assert page.locator(".light").count() == 4
    row = page.get_by_role("group", name="sky", exact=True)
    assert row.locator("canvas.image-map").evaluate("map => [map.width, map.height]") == [4, 3]
    row.get_by_role("button", name="Solo: show sky alone").click()
    assert painter.ui("solo") == list(range(FIRST, 15))
    row.get_by_role("button", name="Lock sky as it is in the answer").click()
    assert last_request(painter)["label"] == "lock sky"
    assert len(last_request(painter)["constraints"]) == 12
    assert row.get_by_text("12 locked").is_visible()
    row.get_by_role("button", name="Reset sky").click()
    assert set(map(str, last_request(painter)["constraints"].values())) == {"{}"}
    page.get_by_role("searchbox", name="Search lights").fill("sky.x0.*")
    painter.still()
    assert page.locator(".light").count() == 1


@pytest.mark.nightly
def test_the_slider_scales_all_texels_in_one_step(painter: Painter) -> None:
    before = weights(painter)
    painter.type("sky, level", "+1")
    np.testing.assert_allclose(weights(painter), 2 * before, rtol=1e-9)
    assert last_request(painter)["label"] == "sky, +1.0 st"
    assert painter.ui("history")["count"] == 1
    painter.type("sky, level", "off")
    assert not weights(painter).any()
    painter.type("sky, level", "as now")
    np.testing.assert_allclose(weights(painter), before, rtol=1e-9)


def test_texels_are_painted_locked_and_released_in_one_step_each(painter: Painter) -> None:
    unfold(painter)
    page = painter.page
    painter.page.get_by_role("group", name="Paint of texels").get_by_label("Hex").fill("#ff0000")
    page.keyboard.press("Enter")
    slider = page.get_by_role("slider", name="Brightness").last
    slider.focus()
    slider.press("ArrowRight")
    before = weights(painter)
    mean = float(before.mean(axis=0) @ LUMINANCE)
    drag(painter, (0, 1), (2, 1))
    painted = weights(painter)
    np.testing.assert_allclose(painted[4:7] @ LUMINANCE, mean * 2**0.1, rtol=1e-6)
    assert not painted[4:7, 1:].any()
    np.testing.assert_array_equal(np.delete(painted, [4, 5, 6], 0), np.delete(before, [4, 5, 6], 0))
    requests = painter.requests("constrain_lights")
    assert [one["is_final"] for one in requests].count(True) == 1
    assert list(requests[-1]["constraints"]) == ["sky.x0.y1", "sky.x1.y1", "sky.x2.y1"]
    assert requests[-1]["label"] == "3 texels of sky, painted"
    assert painter.ui("history")["count"] == 1
    assert page.locator(".texel-lock").count() == 3
    painter.button("Release", exact=True).click()
    drag(painter, (0, 1), (1, 1))
    assert page.locator(".texel-lock").count() == 1
    page.get_by_role("group", name="Drag over the map").get_by_role("button", name="Lock").click()
    drag(painter, (3, 2))
    assert last_request(painter)["constraints"]["sky.x3.y2"]["lock"] == list(painted[11])
    assert page.locator(".texel-lock").count() == 2


@pytest.mark.nightly
@pytest.mark.parametrize("query", ["", "&model"], ids=["page", "notebook"])
def test_escape_cancels_a_stroke_on_the_map(new_painter: Any, query: str) -> None:
    painter = new_painter(QUERY + query)
    unfold(painter)
    page = painter.page
    drag(painter, (0, 0))
    before, constraints = weights(painter), painter.ui("constraints")
    drag(painter, (0, 0), (2, 1), is_cancelled=True)
    assert not painter.requests("constrain_lights")[-1]["is_final"]
    np.testing.assert_array_equal(weights(painter), before)
    assert painter.ui("constraints") == constraints
    assert painter.ui("history")["count"] == 1
    assert page.locator(".texel-lock").count() == 1
    # What is painted next is the only change.
    drag(painter, (3, 2))
    assert list(last_request(painter)["constraints"]) == ["sky.x3.y2"]
    assert page.locator(".texel-lock").count() == 2
    assert painter.ui("history")["count"] == 2
    painter.button("Release", exact=True).click()
    drag(painter, (0, 0), (3, 2), is_cancelled=True)
    assert page.locator(".texel-lock").count() == 2


@pytest.mark.nightly
def test_constraints_of_an_image_hold_for_each_texel(painter: Painter) -> None:
    page = painter.page
    painter.type("key, level", "-1")
    unfold(painter)
    drag(painter, (1, 1))
    locked = last_request(painter)["constraints"]
    panel = page.get_by_role("group", name="Constraints on sky")
    others = [f"sky.x{x}.y{y}" for y in range(ROWS) for x in range(COLUMNS) if (x, y) != (1, 1)]

    def expect(**constraints: Any) -> None:
        painter.still()
        request = last_request(painter)
        assert request["label"] == "sky, constraints"
        assert request["constraints"] == dict.fromkeys(others, constraints)

    panel.get_by_label("Max").fill("0.5")
    page.keyboard.press("Enter")
    expect(limits={"max": 0.5})
    # A share is one of each texel, and no luminance is the same.
    assert panel.get_by_label("Unit").locator("option").count() == 1
    panel.get_by_label("Colour").select_option("kelvin")
    expect(limits={"max": 0.5}, kelvin=[2700, 6500])
    panel.get_by_label("From").fill("3000")
    page.keyboard.press("Enter")
    expect(limits={"max": 0.5}, kelvin=[3000, 6500])
    assert painter.ui("history")["count"] == 5
    assert painter.ui("constraints")["sky.x1.y1"] == locked["sky.x1.y1"]
    # A locked texel gets them once it is released.
    painter.button("Release", exact=True).click()
    drag(painter, (1, 1))
    expected = {"limits": {"max": 0.5}, "kelvin": [3000, 6500]}
    assert last_request(painter)["constraints"] == {"sky.x1.y1": expected}
    # What one texel has alone stays when the image loses what all have.
    page.evaluate("() => painter.session.constrainLight(4, { limits: { min: 0.1, max: 0.5 } })")
    painter.still()
    assert panel.get_by_label("Max").input_value() == ""
    panel.get_by_label("Colour").select_option("color")
    panel.get_by_label("Colour").select_option("any")
    painter.still()
    assert last_request(painter)["constraints"] == {
        **{name: {"limits": {"max": 0.5}} for name in [*others, "sky.x1.y1"]},
        "sky.x1.y0": {"limits": {"min": 0.1, "max": 0.5}},
    }


@pytest.mark.nightly
def test_an_image_that_is_locked_offers_no_constraints(painter: Painter) -> None:
    unfold(painter)
    panel = painter.page.get_by_role("group", name="Constraints on sky")
    assert panel.count() == 1
    painter.page.get_by_role("button", name="Lock sky as it is in the answer").click()
    painter.still()
    assert panel.count() == 0


@pytest.mark.nightly
def test_escape_on_the_map_leaves_the_selection_of_lights(painter: Painter) -> None:
    unfold(painter)
    painter.page.evaluate("() => painter.store.set({ selectedLights: [0, 1] })")
    drag(painter, (0, 0), (1, 1), is_cancelled=True)
    assert painter.ui("selectedLights") == [0, 1]
    painter.page.keyboard.press("Escape")
    painter.still()
    assert painter.ui("selectedLights") == []


@pytest.mark.nightly
def test_a_texel_gives_its_light_as_paint(painter: Painter) -> None:
    unfold(painter)
    drag(painter, (1, 0), modifier="Alt")
    assert not painter.requests("constrain_lights")
    drag(painter, (2, 2))
    np.testing.assert_allclose(weights(painter)[10], weights(painter)[1], rtol=1e-6)


@pytest.mark.nightly
def test_keys_reach_each_texel_and_readers_hear_of_it(new_painter: Any, axe: str) -> None:
    painter = new_painter(QUERY, axe=axe)
    unfold(painter)
    page = painter.page
    page.get_by_role("grid", name="Texels of sky").focus()
    for key in ("ArrowDown", "End", "ArrowLeft"):
        page.keyboard.press(key)
    cell = page.get_by_role("gridcell")
    assert (cell.get_attribute("aria-label") or "").startswith("Column 3, row 2: ")
    page.keyboard.press("Enter")
    painter.still()
    assert list(last_request(painter)["constraints"]) == ["sky.x2.y1"]
    assert (cell.get_attribute("aria-label") or "").endswith(", locked")
    assert violations(page, ".light.is-image") == []


@pytest.mark.nightly
def test_in_a_symmetric_image_two_texels_are_one_light(painter: Painter) -> None:
    """Of the left and the right column, and of the two between them."""
    painter.page.evaluate(
        """() => {
          const state = window.host.state();
          const [image] = state.images;
          image.places = image.places.map(([a, b]) => [a, b, b, a]);
          window.host.tell({ ...state, reply: 0 });
        }"""
    )
    unfold(painter)
    drag(painter, (3, 1))
    assert list(last_request(painter)["constraints"]) == ["sky.x0.y1"]
    assert painter.page.locator(".texel-lock").count() == 2


@pytest.mark.nightly
def test_lists_of_lights_have_an_image_once(painter: Painter) -> None:
    page = painter.page
    page.evaluate(
        """() => painter.store.set({ probe: {
          object: 'floor', index: 2, place: [1, 1], light: [1, 1, 1], paint: [1, 1, 1],
          shares: [0.4, 0, 0, ...Array(12).fill(0.05)]
        } })"""
    )
    painter.still()
    status = page.locator("#lp-status").inner_text()
    assert "sky60 %" in status
    assert "sky.x" not in status
    rows = page.evaluate(
        """async () => {
          const { rowsOf } = await import('/ui/lamp_table.js');
          const ui = painter.store.value;
          const lights = ui.lights.map(({ name }) => name);
          const looks = [1, 2].map((factor) => ({
            lights, weights: ui.weights.map((rgb, k) => rgb.map((x) => (k < 3 ? x : factor * x)))
          }));
          return rowsOf(ui, ...looks).map(({ name, text }) => [name, text]);
        }"""
    )
    assert rows[0] == ["sky", "+1.0 st"]
    assert len(rows) == 4


@pytest.mark.nightly
def test_a_notebook_paints_texels_too(new_painter: Any) -> None:
    painter = new_painter(f"{QUERY}&model")
    unfold(painter)
    drag(painter, (1, 1))
    assert list(last_request(painter)["constraints"]) == ["sky.x1.y1"]
    assert painter.page.locator(".texel-lock").count() == 1


@pytest.mark.nightly
def test_finer_texels_of_a_sun_are_painted_and_locked_each_by_itself(new_painter: Any) -> None:
    """A texel among 4 by 3 is split again: the map has the places of the finer ones, 12 by 7."""
    painter = new_painter("lights=39&image=4x3&finer=1,1")
    page = painter.page
    row = page.get_by_role("group", name="sky", exact=True)
    assert row.locator("canvas.image-map").evaluate("map => [map.width, map.height]") == [12, 7]
    row.get_by_role("button", name="Lock sky as it is in the answer").click()
    assert len(last_request(painter)["constraints"]) == 36
    unfold(painter)
    # One mark for each texel, however many places it covers.
    assert page.locator(".texel-lock").count() == 36
    row.get_by_role("button", name="Reset sky").click()
    box = page.locator(".texel-map").bounding_box()

    def press(column: int, row: int) -> None:
        page.mouse.click(
            box["x"] + (column + 0.5) / 12 * box["width"],
            box["y"] + (row + 0.5) / 7 * box["height"],
        )
        painter.still()

    page.locator(".texel-map").scroll_into_view_if_needed()
    box = page.locator(".texel-map").bounding_box()
    press(4, 3)
    assert list(last_request(painter)["constraints"]) == ["sky.sun1.x4.y3"]
    press(10, 3)
    assert list(last_request(painter)["constraints"]) == ["sky.x3.y1"]
    here = page.locator(".texel-here").bounding_box()
    assert here["width"] == pytest.approx(box["width"] / 4, abs=1)
    assert here["height"] == pytest.approx(box["height"] * 3 / 7, abs=1)
    # The keys go from texel to texel: from a coarse one over its three places to a finer one.
    page.locator(".texel-map").focus()
    for key in ("ArrowLeft", "ArrowLeft", "Enter"):
        page.keyboard.press(key)
    painter.still()
    assert list(last_request(painter)["constraints"]) == ["sky.sun1.x6.y3"]
