"""Lux over the picture of the answer: where cells are, their colours, and how they are read."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import violations
from painter_page import Painter

import lightpaint as lp
from lightpaint.paint.studio.plane_measurements import plane_sight
from lightpaint.photometry.readings_file import COLOURS, colours_of, isolux_levels

SENSORS = {
    "perspective": {"fov": 70},
    "off centre": {"fov": 50, "principal_point_offset_x": 0.2, "principal_point_offset_y": -0.1},
    "thinlens": {"aperture_radius": 0.1, "focus_distance": 3},
    "orthographic": {},
}

SCENE = """<scene version="3.0.0"><sensor type="{plugin}">{fields}<transform name="to_world">
    {scale}<lookat origin="1 2 5" target="-0.3 0.4 0" up="0.2 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="30"/>
    {crop}</film></sensor>
    <emitter type="point" id="bulb"/></scene>"""

CROP = "".join(
    f'<integer name="crop_{name}" value="{value}"/>'
    for name, value in (("width", 32), ("height", 24), ("offset_x", 4), ("offset_y", 2))
)

CELLS = """async ({ planes, camera }) => {
  const { cellsInView } = await import('/ui/planes/plane_cells.js');
  const all = planes.map((plane) => ({ ...plane, seen: [plane.points.map((_, k) => k)] }));
  return cellsInView({ planes: all, cameras: [camera] }, 0);
}"""


def cells_of(page: Any, points: Any, sides: Any, camera: Any) -> list[dict[str, Any]]:
    """Return the cells of a plane as the page projects them."""
    plane = {"points": points, "sides": sides}
    fields = vars(camera) if hasattr(camera, "origin") else camera
    return page.evaluate(CELLS, {"planes": [plane], "camera": dict(fields)})  # type: ignore[no-any-return]


@pytest.mark.parametrize("crop", ["", CROP])
@pytest.mark.parametrize("name", SENSORS)
def test_points_are_where_the_rays_of_mitsuba_meet_them(
    page: Any, tmp_path: Path, name: str, crop: str
) -> None:
    """The ray of Mitsuba's sensor through the place of a point in the picture leads to the point.

    Within a ten-thousandth of the distance: the camera's axes come from float32 rays.
    """
    import mitsuba as mi

    plugin = "perspective" if name == "off centre" else name
    scale = '<scale value="2"/>' if plugin == "orthographic" else ""
    fields = "".join(f'<float name="{k}" value="{v}"/>' for k, v in SENSORS[name].items())
    text = SCENE.format(plugin=plugin, fields=fields, scale=scale, crop=crop)
    (tmp_path / "seen.xml").write_text(text, encoding="utf-8")
    scene = lp.load_scene(tmp_path / "seen.xml")
    points = np.random.default_rng(1).uniform(-0.8, 0.8, (12, 3))
    sight = plane_sight(scene, points)
    assert sight.is_seen.all()
    cells = cells_of(page, points.tolist(), None, sight.camera)
    order = [cell["point"] for cell in cells]
    places = np.array([cell["corners"][0] for cell in cells])
    assert np.ptp(places, axis=0).min() > 2
    height, width = scene.size

    def distances(loaded: Any) -> Any:
        camera = scene.camera(loaded)
        parts = mi.Point2f((places / (width, height)).T.astype(np.float32))
        ray, _ = camera.sample_ray(camera.shutter_open(), 0.5, parts, mi.Point2f(0.5, 0.5))
        origin, way = (np.array(v, float).reshape(3, -1).T for v in (ray.o, ray.d))
        return np.linalg.norm(np.cross(points[order] - origin, way), axis=1)

    assert scene.while_loaded(distances).max() < 1e-4 * 6


#: At the origin, looking along +z, with a picture of 10 by 10 pixels and tan(45°) at its edges.
PINHOLE = {
    "origin": [0, 0, 0],
    "x_axis": [0.2, 0, 0],
    "y_axis": [0, 0.2, 0],
    "forward": [-1, -1, 1],
    "is_parallel": False,
}


def test_a_cell_is_projected_by_its_corners_and_cut_behind_the_camera(page: Any) -> None:
    """By hand: a point at depth z has the column 5 + 5 x / z."""
    ahead, around, behind = [0, 1, 2], [0, -1, 0], [0, 0, -3]
    sides = [[2, 0, 0, 0, 0, 2]] * 3
    first, second = cells_of(page, [ahead, around, behind], sides, PINHOLE)
    expected = [[0, 10], [10, 10], [5 + 5 / 3, 5 + 5 / 3], [5 - 5 / 3, 5 + 5 / 3]]
    np.testing.assert_allclose(first["corners"], expected)
    assert (first["point"], second["point"]) == (0, 1)
    # Its two corners at depth 1 stay; the others lie where its sides cross the plane of the camera.
    corners = np.array(second["corners"])
    assert len(corners) == 4
    np.testing.assert_allclose(corners[1:3], [[10, 0], [0, 0]])
    assert (corners[[0, 3], 1] < -1000).all()


SCALE = """async (values) => {
  const { roundedUp, colourOf } = await import('/ui/planes/plane_picture.js');
  return [values.map(roundedUp), values.map((x) => colourOf(x / 1000))];
}"""


def test_the_scale_is_that_of_isolux_pictures(page: Any) -> None:
    values = [*np.geomspace(0.3, 9e4, 40).tolist(), 1.0, 20.0, 500.0, 1000.0]
    tops, colours = page.evaluate(SCALE, values)
    np.testing.assert_allclose(tops, [isolux_levels(x)[-1] for x in values])
    shares = np.clip(np.array(values) / 1000, 0, 1)
    assert np.abs(np.array(colours) - colours_of(shares)).max() <= 0.5  # they are whole numbers
    assert len(COLOURS) == 6


def planes_in_view(*, cases: tuple[str, ...] = ("",), camera: Any = PINHOLE) -> dict[str, Any]:
    """A desk of two cells, a floor of one, and a plane that something covers, in each case."""

    def plane(name: str, case: str, points: Any, sides: Any, seen: list[int]) -> dict[str, Any]:
        return {
            "name": f"{name}, {case}" if case else name,
            "plane": name,
            "case": case,
            "size": [1, len(points)],
            "cells": [[0, k] for k in range(len(points))],
            "points": points,
            "sides": sides,
            "seen": [seen],
        }

    planes = [
        each
        for case in cases
        for each in (
            plane(
                "desk", case, [[-0.25, 0, 1], [0.25, 0, 1]], [[0.5, 0, 0, 0, 0.5, 0]] * 2, [0, 1]
            ),
            plane("floor", case, [[0, 0, 1]], [[1.6, 0, 0, 0, 1.6, 0]], [0]),
            plane("niche", case, [[0, 0, 1]], [[1, 0, 0, 0, 1, 0]], []),
        )
    ]
    return {"planes": planes, "floor_m2": None, "budget_watts": None, "cameras": [camera]}


def lux_on(*lights: list[float]) -> dict[str, Any]:
    """Return what an answer gives on planes, from the lx at the points of each."""
    rest = {"mean_error": 1, "uniformity": 1, "wishes": []}
    planes = [
        {"mean": sum(lux) / len(lux), "least": min(lux), "most": max(lux), "lux": lux, **rest}
        for lux in lights
    ]
    return {"planes": planes, "watts": None, "power": None, "is_required": False, "is_old": False}


#: The scale of 800 lx at most ends at 800; desk, floor and niche.
LUX = [800, 400], [0], [100]


def measured(new_painter: Any, light: Any = None, **fields: Any) -> Painter:
    painter: Painter = (
        new_painter(axe=fields.pop("axe", None)) if "axe" in fields else new_painter()
    )
    size = painter.ui("state")["size"]
    # Its picture is as wide as the view of the camera, so that cells have known places.
    camera = {
        **PINHOLE,
        "x_axis": [2 / size[1], 0, 0],
        "y_axis": [0, 2 / size[0], 0],
    }
    planes = planes_in_view(**{"camera": camera, **fields})
    painter.page.evaluate(
        "(given) => window.host.tell({ ...window.host.state(), ...given })",
        {"planes": planes, "reading": light or lux_on(*LUX)},
    )
    painter.still()
    return painter


def switch(painter: Painter) -> Any:
    return painter.page.get_by_role("checkbox", name="Lux in the picture")


def colour_at(painter: Painter, x: float, y: float, kind: str = "solution") -> list[int]:
    """The overlay's colour at a place of a picture, as shares of it."""
    return painter.page.evaluate(  # type: ignore[no-any-return]
        """([u, v, kind]) => {
          const canvas = document.querySelector('.plane-overlay');
          if (canvas.hidden) return null;
          const pane = window.engine.panes().find((each) => each.kind === kind);
          const [rows, columns] = window.painter.store.value.state.size;
          const ratio = canvas.width / canvas.clientWidth;
          const x = (pane.left + u * columns * pane.scale) * ratio;
          const y = (pane.top + v * rows * pane.scale) * ratio;
          const pixel = new OffscreenCanvas(1, 1).getContext('2d');
          pixel.drawImage(canvas, -Math.round(x), -Math.round(y));
          return [...pixel.getImageData(0, 0, 1, 1).data];
        }""",
        [x, y, kind],
    )


def test_planes_are_drawn_over_the_answer_in_the_colours_of_reports(new_painter: Any) -> None:
    painter = measured(new_painter)
    assert colour_at(painter, 0.5, 0.5) is None
    switch(painter).check()
    painter.still()
    top = colours_of(np.array([1, 0.5, 0]))
    # The desk, whose cells are finer, lies over the floor; the niche is covered.
    for place, expected in zip(((0.4, 0.5), (0.6, 0.5), (0.2, 0.5)), top, strict=True):
        assert colour_at(painter, *place) == [*np.round(expected).astype(int), 255]
    assert colour_at(painter, 0.05, 0.5) == [0, 0, 0, 0]
    assert colour_at(painter, 0.4, 0.5, "painting") == [0, 0, 0, 0]
    legend = painter.page.locator(".legend").inner_text().split("\n")
    assert " ".join(legend).split() == ["Lux", "on", "planes", "0", "400", "800", "lx"]


def test_colours_follow_the_brush_and_the_zoom(new_painter: Any) -> None:
    painter = measured(new_painter)
    switch(painter).check()
    version = painter.ui("version") + 1
    light = lux_on([400, 800], [0], [100])
    painter.tell(kind="answer", version=version, stroke=1, exact=False, reading=light, arrays={})
    expected = [*np.round(colours_of(np.array(0.5))).astype(int), 255]
    for _ in range(100):  # under the brush it may come ten times as late as it took last
        if colour_at(painter, 0.4, 0.5) == expected:
            break
        painter.page.wait_for_timeout(50)
    assert colour_at(painter, 0.4, 0.5) == expected
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("+")
    painter.still()
    assert colour_at(painter, 0.4, 0.5) == expected
    assert colour_at(painter, 0.2, 0.5) == [*np.round(colours_of(np.array(0.0))).astype(int), 255]


def test_a_pointer_and_the_arrow_keys_read_lx(new_painter: Any) -> None:
    painter = measured(new_painter)
    switch(painter).check()
    box = painter.page.locator(".stage").bounding_box()
    pane = painter.page.evaluate("() => window.engine.panes()[0]")
    rows, columns = painter.ui("state")["size"]
    places = {"desk 800 lx": 0.4, "desk 400 lx": 0.6, "floor 0 lx": 0.2}
    for text, share in places.items():
        x = box["x"] + pane["left"] + share * columns * pane["scale"]
        painter.page.mouse.move(x, box["y"] + pane["top"] + 0.5 * rows * pane["scale"])
        painter.still()
        assert painter.page.locator(".near").inner_text() == text
        assert painter.page.locator("#lp-status strong").inner_text() == text
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("ArrowDown")
    painter.still()
    assert painter.page.locator("#lp-status strong").inner_text() == "floor 0 lx"


def test_planes_are_hidden_one_by_one_and_say_if_they_are_not_in_view(new_painter: Any) -> None:
    painter = measured(new_painter)
    assert painter.page.get_by_role("button", name="Hide desk in the picture").count() == 0
    switch(painter).check()
    assert painter.page.locator(".plane").nth(2).inner_text().split("\n")[:2] == [
        "niche",
        "not in view",
    ]
    painter.button("Hide desk in the picture").click()
    painter.still()
    assert colour_at(painter, 0.4, 0.5) == [38, 14, 74, 255]
    painter.button("Show desk in the picture").click()
    painter.still()
    assert colour_at(painter, 0.4, 0.5) == [248, 230, 60, 255]


def test_one_case_is_shown_at_a_time(new_painter: Any) -> None:
    light = lux_on(*LUX, [5000, 5000], [0], [0])
    painter = measured(new_painter, light, cases=("night", "noon"))
    switch(painter).check()
    assert painter.page.locator(".legend b").inner_text() == "Lux on planes, night"
    assert colour_at(painter, 0.4, 0.5) == [248, 230, 60, 255]
    painter.choose("Case", "noon")
    painter.still()
    assert painter.page.locator(".legend span").all_inner_texts()[-1] == "5000 lx"


def test_the_overlay_gives_way_to_other_pictures(new_painter: Any) -> None:
    """It is of the answer alone: not where the original scene stands in its place."""
    painter = measured(new_painter)
    switch(painter).check()
    painter.page.locator(".stage").focus()
    painter.page.keyboard.down("y")
    painter.still()
    assert colour_at(painter, 0.4, 0.5, "present") is None
    painter.page.keyboard.up("y")
    painter.still()
    assert colour_at(painter, 0.4, 0.5) == [248, 230, 60, 255]
    # O goes on to no overlay, and lux are the last before it.
    painter.page.keyboard.press("o")
    assert not switch(painter).is_checked()


def test_a_camera_that_bends_its_picture_has_no_overlay(new_painter: Any) -> None:
    painter = measured(new_painter, camera=None)
    assert switch(painter).count() == 0
    note = painter.page.locator(".planes-note").inner_text()
    assert note == "This camera bends the picture: planes cannot be drawn in it."


def test_axe_finds_nothing_in_planes_over_the_picture(new_painter: Any, axe: str) -> None:
    painter = measured(new_painter, axe=axe)
    switch(painter).check()
    painter.still()
    assert violations(painter.page, ".side, .legend") == []
