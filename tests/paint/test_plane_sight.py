"""Which points of measuring planes the pictures of cameras show, and the cells around them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lit_planes import BULB, box, floor, lit_scene

import lightpaint as lp
from lightpaint.paint.studio.plane_measurements import plane_sight
from lightpaint.photometry.planes_file import read_planes

#: The camera of `lit_scene` is at (0, 1, 2.5), and looks at (0, 0.8, 0).
GLASS = """<shape type="rectangle" id="pane"><transform name="to_world"><scale value="0.4"/>
    <translate x="-0.5" y="1" z="1.5"/></transform><bsdf type="{kind}"/></shape>"""

ORTHOGRAPHIC = """<sensor type="orthographic" id="camera"><transform name="to_world">
    <lookat origin="0 2 2" target="0 0 0" up="0 1 0"/></transform>"""


@pytest.mark.parametrize("kind", ["thindielectric", "null", "diffuse"])
def test_what_stands_before_points_covers_them(tmp_path: Path, kind: str) -> None:
    """A box hides the points of the floor behind it by similar triangles; glass hides nothing."""
    content = BULB + floor(4) + box("box", (0.2, 0, 0), (0.6, 0.5, 0.4)) + GLASS.format(kind=kind)
    scene = lit_scene(tmp_path, content)
    x, z = (v.ravel() for v in np.meshgrid(np.linspace(-1.9, 1.9, 20), np.linspace(-1.9, 1.9, 20)))
    points = np.stack([x, np.zeros_like(x), z], axis=1)
    eye = np.array([0, 1, 2.5])
    is_expected = ~meets_box(eye, points, (0.2, 0, 0), (0.6, 0.5, 0.4))
    if kind == "diffuse":
        is_expected &= ~meets_box(eye, points, (-0.9, 0.6, 1.5), (-0.1, 1.4, 1.5))
    assert 0 < (~is_expected).sum() < len(points)
    np.testing.assert_array_equal(plane_sight(scene, points).is_seen, is_expected)


def meets_box(eye: Any, points: Any, low: Any, high: Any) -> Any:
    """Return whether the way from the eye to each point leads through a box, by slabs."""
    ways = points - eye
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (np.array(low) - eye) / ways, (np.array(high) - eye) / ways
    enter, leave = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
    return (enter <= leave) & (leave > 0) & (enter < 1 - 1e-3)


def test_points_are_seen_along_parallel_rays(tmp_path: Path) -> None:
    """Of two points of an orthographic picture the floor covers the one under it."""
    scene = lit_scene(tmp_path, BULB + floor(4))
    text = scene.path.read_text(encoding="utf-8")
    begin, end = text.index("<sensor"), text.index("<sampler")
    scene.path.write_text(text[:begin] + ORTHOGRAPHIC + text[end:], encoding="utf-8")
    sight = plane_sight(lp.load_scene(scene.path), np.array([[0.2, 0, -1.0], [0.2, -0.5, -1.0]]))
    assert sight.camera is not None
    assert sight.camera.is_parallel
    assert sight.is_seen.tolist() == [True, False]


def test_cells_meet_and_fill_their_plane(tmp_path: Path) -> None:
    scene = lit_scene(tmp_path, BULB + floor(4))
    path = tmp_path / "lit.planes.toml"
    path.write_text(
        '[plane.floor]\nshape = "floor"\ngrid = 0.5\n'
        "[plane.slanted]\ncorners = [[0, 1, 0], [2, 1, 0], [1.5, 1, 1], [0, 1, 1]]\ngrid = 0.1\n"
        "[plane.listed]\npoints = [[0, 1, 0]]\n",
        encoding="utf-8",
    )
    found, slanted, listed = read_planes(path, scene).planes
    assert listed.sides is None
    for plane, tolerance in ((found, 1e-6), (slanted, 0.003)):  # of a quadrilateral in second order
        assert plane.sides is not None
        across, along = plane.sides[:, 0], plane.sides[:, 1]
        area = np.linalg.norm(np.cross(across, along), axis=1).sum()
        assert area == pytest.approx(plane.area_m2, rel=1e-4)
        place = {tuple(cell): k for k, cell in enumerate(plane.cells.tolist())}
        for (row, column), k in place.items():
            for side, other in ((across, (row, column + 1)), (along, (row + 1, column))):
                if (m := place.get(other)) is not None:
                    edges = plane.points[k] + side[k] / 2, plane.points[m] - side[m] / 2
                    np.testing.assert_allclose(*edges, atol=tolerance)
