"""The map of a sky: its exposure, its marks, and gradients, fills and suns on it."""

from typing import Any

import numpy as np
import pytest
from axe import violations
from painter_page import Painter
from texel_grid import texel_direction

from lightpaint.scene.lights.texels.image_domains import Sky, solid_angles

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: Columns and rows of the sky behind three lights, the first of which is the fourth light.
COLUMNS, ROWS, FIRST = 8, 5, 3
QUERY = f"lights={FIRST + COLUMNS * ROWS}&image={COLUMNS}x{ROWS}"

ARITHMETIC = "async (given) => { const m = await import('/ui/images/texel_arithmetic.js');"
MARKS = "async (given) => { const m = await import('/ui/images/sky_marks.js');"

#: A camera that looks along −z with x to the right, 90° wide and high, in a picture of 48 by 27.
CAMERA = {
    "origin": [0, 0, 0],
    "x_axis": [2 / 48, 0, 0],
    "y_axis": [0, -2 / 27, 0],
    "forward": [-1, 1, -1],
    "is_parallel": False,
}


def sky_image(columns: int, rows: int) -> dict[str, Any]:
    """Return an image as the page has it, with the shares of a sky."""
    places = np.arange(columns * rows).reshape(rows, columns)
    shares = Sky().shares((columns, rows))
    return {
        "name": "sky",
        "places": places.tolist(),
        "shares": shares.tolist(),
        "aspect": 2,
        "lights": places.ravel().tolist(),
    }


def sun(page: Any, size: tuple[int, int], place: tuple[float, float], diameter: float) -> Any:
    """Return what a sun of paint one stop above a mean of 3 adds, (rows, columns, 3)."""
    columns, rows = size
    paint = {"colour": [1, 0.8, 0.5], "stops": 1}
    given = [sky_image(columns, rows), place, diameter, paint, 3]
    pairs = page.evaluate(ARITHMETIC + "return [...m.sunLights(...given)]; }", given)
    added = np.zeros((rows * columns, 3))
    for light, rgb in pairs:
        added[light] = rgb
    return added.reshape(rows, columns, 3)


@pytest.mark.parametrize("diameter", [0.5, 20, 60])
@pytest.mark.parametrize("place", [(5.3, 2.6), (1.2, 15.4), (0.0, 3.0), (8.0, 0.0)])
def test_a_sun_gives_as_much_light_as_an_even_sky(
    page: Any, diameter: float, place: tuple[float, float]
) -> None:
    """π times the radiance of the paint, whatever its size and place, and in the paint's colour."""
    added = sun(page, (16, 9), place, diameter)
    total = np.einsum("rc,rck->k", solid_angles((16, 9)), added)
    np.testing.assert_allclose(total @ LUMINANCE, np.pi * 3 * 2, rtol=1e-9)
    np.testing.assert_allclose(total / total[0], [1, 0.8, 0.5], rtol=1e-9)


def test_a_sun_shines_from_its_place(page: Any) -> None:
    """The mean direction of its light is that of its place, up to the width of a texel's hat."""
    size = (64, 33)
    row, column = 11.4, 40.7
    added = sun(page, size, (row, column), 3)[..., 0] * solid_angles(size)
    directions = np.array([[texel_direction(x, y, size) for x in range(64)] for y in range(33)])
    mean = np.einsum("rc,rck->k", added, directions)
    polar, azimuth = np.pi * row / 32, 2 * np.pi * (column + 0.5) / 64
    sine = np.sin(polar)
    expected = np.array([sine * np.sin(azimuth), np.cos(polar), -sine * np.cos(azimuth)])
    angle = np.degrees(np.arccos(mean / np.linalg.norm(mean) @ expected))
    assert angle < 0.5
    spread = np.degrees(np.arccos(np.clip(directions @ expected, -1, 1)))[added > 0]
    assert spread.max() < 1.5 + 8  # its radius, and the diagonal of a texel


def test_directions_are_those_of_the_scene(page: Any) -> None:
    """As the light itself has them, and back."""
    for column, row in [(0, 1), (3, 2), (7, 3), (5, 4)]:
        direction = page.evaluate(
            ARITHMETIC + "return m.skyDirection(...given); }", [[row, column], ROWS, COLUMNS]
        )
        np.testing.assert_allclose(
            direction, texel_direction(column, row, (COLUMNS, ROWS)), atol=1e-12
        )
        if row not in (0, ROWS - 1):
            place = page.evaluate(
                ARITHMETIC + "return m.skyPlace(...given); }", [direction, ROWS, COLUMNS]
            )
            np.testing.assert_allclose(place, [row, column], atol=1e-9)


def test_a_gradient_changes_stops_evenly(page: Any) -> None:
    """From a row to another; beyond both the paints go on. Half way lies their geometric mean."""
    paints = [{"colour": [1, 1, 1], "stops": -1}, {"colour": [1, 0.5, 0.25], "stops": 3}]
    image = sky_image(COLUMNS, ROWS)
    pairs = page.evaluate(
        ARITHMETIC + "return [...m.gradientLights(...given)]; }",
        [image, [1, 4], [3, 4], paints, 10],
    )
    lights = np.array([rgb for _, rgb in sorted(pairs)]).reshape(ROWS, COLUMNS, 3)
    np.testing.assert_allclose(lights @ LUMINANCE, 10 * 2.0 ** np.array([[-1, -1, 1, 3, 3]] * 8).T)
    assert np.ptp(lights[:2], axis=-1).max() < 1e-9
    ends = np.array([[1, 1, 1], [1, 0.5, 0.25]])
    middle = (ends / (ends @ LUMINANCE)[:, None]).mean(axis=0)
    np.testing.assert_allclose(lights[2, 0], 20 * middle)
    np.testing.assert_allclose(lights[4, 0] / lights[4, 0, 0], ends[1])


@pytest.mark.parametrize("up", [(0, 1, 0), (0.6, 0.8, 0), (0, -1, 0), (0.2, 0.5, -0.84)])
def test_the_horizon_is_level(page: Any, up: tuple[float, float, float]) -> None:
    """Every point of it is at right angles to the vertical, and it goes once around."""
    unit = np.array(up) / np.linalg.norm(up)
    points = page.evaluate(MARKS + "return m.horizonOf({ up: given }); }", unit.tolist())
    assert np.abs(np.array(points) @ unit).max() < 1e-9
    azimuth = np.unwrap(np.arctan2(np.array(points)[:, 0], -np.array(points)[:, 2]))
    np.testing.assert_allclose(azimuth[-1] - azimuth[0], 2 * np.pi, rtol=1e-3)


def unfold(painter: Painter, *, has_rig: bool = True) -> None:
    painter.button("sky", exact=True).click()
    painter.still()
    if not has_rig:
        return
    assert len(painter.requests("show_rig")) == 1
    painter.page.evaluate(
        """(camera) => window.host.tell({ kind: 'rig', cameras: [camera], up: 1, low: [0, 0, 0],
          high: [1, 1, 1], surfaces: [], objects: [], skies: [{ name: 'sky',
          from_world: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }],
          lights: window.host.room.lights.map(() => ({ position: null, direction: null,
            target: null, cutoff: null, beam: null, rail: null,
            immovable_reason: 'a texel' })) })""",
        CAMERA,
    )
    painter.still()


def texels(painter: Painter) -> Any:
    """Return the weights of the texels, (rows, columns, 3)."""
    painter.still()
    return np.array(painter.ui("weights"))[FIRST:].reshape(ROWS, COLUMNS, 3)


def drag(painter: Painter, *places: tuple[float, float]) -> None:
    """Drag from place to place, in columns and rows of the map."""
    box = painter.page.locator(".texel-map")
    box.evaluate("(one) => one.scrollIntoView({ block: 'center' })")
    area = box.bounding_box()
    for k, (column, row) in enumerate(places):
        x = area["x"] + (column + 0.5) / COLUMNS * area["width"]
        y = area["y"] + (row + 0.5) / ROWS * area["height"]
        painter.page.mouse.move(x, y, steps=1 if k == 0 else 5)
        if k == 0:
            painter.page.mouse.down()
    painter.page.mouse.up()
    painter.still()


def choose(painter: Painter, tool: str) -> None:
    group = painter.page.get_by_role("group", name="Drag over the map")
    group.get_by_role("button", name=tool, exact=True).click()


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    return new_painter(QUERY)  # type: ignore[no-any-return]


def map_pixels(painter: Painter) -> Any:
    """Return the codes of the unfolded map, (rows, columns, 3)."""
    painter.still()
    data = painter.page.locator(".texel-map canvas").evaluate(
        """(map) => {
          const copy = new OffscreenCanvas(map.width, map.height).getContext('2d');
          copy.drawImage(map, 0, 0);
          return [...copy.getImageData(0, 0, map.width, map.height).data];
        }"""
    )
    return np.array(data).reshape(ROWS, COLUMNS, 4)[..., :3]


@pytest.mark.nightly
def test_the_map_keeps_its_exposure(painter: Painter) -> None:
    """A place that is painted much brighter leaves the rest of the map as bright as it was."""
    unfold(painter)
    before = map_pixels(painter)
    brightness = painter.page.get_by_role("slider", name="Brightness").last
    brightness.focus()
    brightness.press("End")
    drag(painter, (0, 1), (7, 1))
    after = map_pixels(painter)
    np.testing.assert_array_equal(np.delete(after, 1, axis=0), np.delete(before, 1, axis=0))
    painter.button("sky", exact=True).click()
    painter.button("sky", exact=True).click()
    np.testing.assert_array_equal(map_pixels(painter)[3], before[3])
    painter.page.locator(".map-exposure").get_by_role("button", name="Fit").click()
    assert map_pixels(painter)[3].max() < before[3].max() / 2
    painter.type("Map", "0")
    np.testing.assert_array_equal(map_pixels(painter)[3], before[3])


def test_a_gradient_is_one_step_and_escape_takes_it_back(painter: Painter) -> None:
    unfold(painter)
    choose(painter, "Gradient")
    before = texels(painter)
    mean = (
        np.einsum("rc,rck->k", np.full((ROWS, COLUMNS), 1 / (ROWS * COLUMNS)), before) @ LUMINANCE
    )
    drag(painter, (2, 0), (2, 4))
    after = texels(painter) @ LUMINANCE
    np.testing.assert_allclose(
        np.log2(after / mean), np.linspace(0, 1, 5)[:, None] * np.ones(8), atol=0.02
    )
    assert painter.ui("history")["count"] == 1
    requests = painter.requests("constrain_lights")
    assert requests[-1]["label"] == "sky, gradient"
    assert [request["is_final"] for request in requests].count(True) == 1
    painter.page.mouse.down()
    painter.page.mouse.move(10, 10)
    painter.page.keyboard.press("Escape")
    painter.page.mouse.up()
    np.testing.assert_allclose(texels(painter) @ LUMINANCE, after)
    assert painter.ui("history")["count"] == 1


@pytest.mark.nightly
def test_a_fill_takes_the_half_above_or_below_the_horizon(painter: Painter) -> None:
    """The row at the horizon is above it."""
    unfold(painter)
    choose(painter, "Fill")
    before = texels(painter)
    drag(painter, (5, 0))
    after = texels(painter)
    assert np.ptp(after[:3].reshape(-1, 3), axis=0).max() == 0
    np.testing.assert_array_equal(after[3:], before[3:])
    drag(painter, (1, 4))
    assert np.ptp(texels(painter).reshape(-1, 3), axis=0).max() == 0
    assert painter.ui("history")["count"] == 2


@pytest.mark.nightly
def test_a_sun_is_added_in_one_step(painter: Painter) -> None:
    """On top of what shines there; other texels stay free."""
    unfold(painter)
    choose(painter, "Sun")
    before = texels(painter)
    drag(painter, (3, 1))
    added = texels(painter) - before
    assert (added >= 0).all()
    assert added[1, 3].min() > 0
    assert not added[3:].any()
    request = painter.requests("constrain_lights")[-1]
    assert request["label"].endswith(", sun")
    assert len(request["constraints"]) == np.count_nonzero(added.max(axis=-1)) < 10
    assert painter.page.get_by_role("slider", name="Diameter").is_visible()


@pytest.mark.nightly
def test_marks_say_where_the_camera_looks(painter: Painter) -> None:
    """Along −z is the left edge of the map; a quarter further it is right of the view."""
    unfold(painter)
    labels = {
        label: painter.page.locator(".sky-label", has_text=label).bounding_box()
        for label in ("right", "behind", "left", "camera")
    }
    area = painter.page.locator(".texel-map").bounding_box()

    def middle(label: str) -> float:
        box = labels[label]
        return float((box["x"] + box["width"] / 2 - area["x"]) / area["width"])

    assert middle("right") == pytest.approx(0.25, abs=0.01)
    assert middle("behind") == pytest.approx(0.5, abs=0.01)
    assert middle("left") == pytest.approx(0.75, abs=0.01)
    assert painter.page.locator(".sky-horizon").count() == 1
    assert painter.page.locator(".sky-frame").count() >= 2  # it leaves the map at one side
    # The middle of the third column is 2.5 of 8 columns from −z: 112.5° to the right; up 45°.
    painter.page.locator(".texel-map").hover(
        position={"x": 2.5 / COLUMNS * area["width"], "y": 1.5 / ROWS * area["height"]}
    )
    text = painter.page.locator(".texel-text")
    assert "113° right of the view, 45° up" in text.inner_text()


@pytest.mark.nightly
def test_a_gradient_is_drawn_by_keys(painter: Painter) -> None:
    unfold(painter)
    choose(painter, "Gradient")
    grid = painter.page.get_by_role("grid", name="Texels of sky")
    grid.focus()
    grid.press("Enter")
    for _ in range(4):
        grid.press("ArrowDown")
    assert painter.ui("history").get("count", 0) == 0
    grid.press("Enter")
    painter.still()
    assert painter.requests("constrain_lights")[-1]["label"] == "sky, gradient"
    levels = texels(painter) @ LUMINANCE
    np.testing.assert_allclose(levels[4] / levels[0], 2)


@pytest.mark.nightly
def test_axe_finds_nothing_on_a_map_with_marks(new_painter: Any, axe: str) -> None:
    painter = new_painter(QUERY, axe=axe)
    unfold(painter)
    choose(painter, "Sun")
    assert violations(painter.page, ".side") == []
