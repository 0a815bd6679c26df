"""Planes files: where their points are in scenes, and one line for each mistake."""

from pathlib import Path

import numpy as np
import pytest
from lit_planes import BULB, box, floor, lit_scene, rectangle, write_scene
from webs import cosine, ies_text

from lightpaint.errors import SceneError
from lightpaint.photometry.illuminance import MeasuringPlane, PowerBudget, Ratio, Wishes
from lightpaint.photometry.plane_placement import cell_counts
from lightpaint.photometry.planes_file import PlanesFile, read_planes
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: A floor of 4 by 4, walls at its back (z = −2) and left (x = −2), a ceiling at 3, a cupboard and
#: a table top.
ROOM = "".join(
    [
        BULB,
        floor(4),
        rectangle("back", 4, '<translate y="2" z="-2"/>'),
        rectangle("left", 4, '<rotate y="1" angle="90"/><translate x="-2" y="2"/>'),
        rectangle("ceiling", 4, '<rotate x="1" angle="90"/><translate y="3"/>'),
        box("cupboard", (1, 0, -2), (2, 2, -1)),
        box("table", (-0.5, 0.72, 0), (0.5, 0.76, 1)),
    ]
)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return lit_scene(tmp_path_factory.mktemp("room"), ROOM)


def read(folder: Path, text: str, scene: Scene) -> PlanesFile:
    path = folder / "lit.planes.toml"
    path.write_text(text, encoding="utf-8")
    return read_planes(path, scene)


def plane(folder: Path, text: str, scene: Scene) -> MeasuringPlane:
    [found] = read(folder, f"[plane.a]\n{text}", scene).planes
    return found


def has_point(found: MeasuringPlane, *place: float) -> bool:
    return bool((np.linalg.norm(found.points - place, axis=1) < 1e-4).any())


@pytest.mark.parametrize(
    ("sides", "counts"),
    [
        # EN 12464-1: p = 0.2 · 5^lg d. 4 m: 0.527 m, 8 points; 10 m: 1 m, 10 points.
        ((4.0, 4.0), (8, 8)),
        ((10.0, 6.0), (10, 6)),
        # Of a corridor of 20 by 2 m the shorter side decides: 0.325 m, 6 points.
        ((20.0, 2.0), (60, 6)),
        ((1.0, 1.0), (5, 5)),
    ],
)
def test_the_grid_is_that_of_the_standard(
    sides: tuple[float, float], counts: tuple[int, int]
) -> None:
    assert cell_counts(sides, None) == counts


def test_a_plane_over_a_floor(tmp_path: Path, room: Scene) -> None:
    found = plane(tmp_path, 'shape = "floor"\nheight = 1\ngrid = 0.5', room)
    np.testing.assert_allclose(found.points[:, 1], 1, atol=1e-5)
    np.testing.assert_allclose(found.normals, np.tile((0, 1, 0), (len(found), 1)), atol=1e-6)
    # All cells of 8 by 8 but the four in the cupboard.
    assert len(found) == 60
    assert not has_point(found, 1.25, 1, -1.75)
    assert has_point(found, -1.75, 1, -1.75)
    assert found.area_m2 == pytest.approx(15)
    assert (found.shape, found.picture_size) == (None, (8, 8))
    # The picture is a plan with +x to the right, from above: the cupboard is at its top right.
    picture = found.picture(np.arange(60.0))[::-1]
    assert np.isnan(picture[:2, 6:]).all()
    assert not np.isnan(picture[2:]).any()


def test_a_margin_is_kept_from_walls_and_cupboards_but_not_from_tables(
    tmp_path: Path, room: Scene
) -> None:
    found = plane(tmp_path, 'shape = "floor"\nheight = 0.75\nmargin = 0.5\ngrid = 0.25', room)
    assert found.points[:, [0, 2]].min() > -1.5
    assert found.points[:, [0, 2]].max() < 1.5
    beside = np.abs(found.points[:, [0, 2]] - (1.5, -1.5)) - 0.5
    distance = np.linalg.norm(np.maximum(beside, 0), axis=1)
    # It is measured in 16 directions, between which it is a little less.
    assert distance.min() > 0.5 * np.cos(np.pi / 16) - 0.001
    # At this height the points of the table are in its top, those beside it are not.
    assert not has_point(found, -0.125, 0.75, 0.375)
    assert has_point(found, -0.625, 0.75, 0.375)


def test_points_on_a_floor_are_not_where_something_stands(tmp_path: Path, room: Scene) -> None:
    found = plane(tmp_path, 'shape = ["floor"]\ngrid = 0.5', room)
    assert len(found) == 60
    assert has_point(found, 0.25, 0, 0.25)  # under the table


def test_points_on_walls_face_the_room(tmp_path: Path, room: Scene) -> None:
    found = plane(tmp_path, 'walls = ["back", "left"]\ngrid = 1.0', room)
    assert len(found) == 30  # the cupboard covers two cells of the back
    np.testing.assert_allclose(found.points[:14, 2], -2, atol=1e-5)
    np.testing.assert_allclose(found.normals[:14], np.tile((0, 0, 1), (14, 1)), atol=1e-6)
    np.testing.assert_allclose(found.points[14:, 0], -2, atol=1e-5)
    np.testing.assert_allclose(found.normals[14:], np.tile((1, 0, 0), (16, 1)), atol=1e-6)
    assert found.picture_size == (4, 9)


def test_a_ceiling_is_measured_from_below(tmp_path: Path, room: Scene) -> None:
    found = plane(tmp_path, 'walls = ["ceiling"]\ngrid = 1.0', room)
    assert len(found) == 16
    np.testing.assert_allclose(found.normals, np.tile((0, -1, 0), (16, 1)), atol=1e-6)


def test_listed_points_need_no_shape(tmp_path: Path) -> None:
    found = plane(tmp_path, "points = [[0, 1, 0]]", lit_scene(tmp_path, BULB))
    np.testing.assert_allclose(found.points, [(0, 1, 0)])


def test_a_floor_that_is_an_instance(tmp_path: Path) -> None:
    group = f'<shape type="shapegroup" id="group">{rectangle("tile", 2, "")}</shape>'
    floor_of_tiles = (
        '<shape type="instance" id="floor"><ref id="group"/><transform name="to_world">'
        '<rotate x="1" angle="-90"/></transform></shape>'
    )
    scene = lit_scene(tmp_path, BULB + group + floor_of_tiles)
    found = plane(tmp_path, 'shape = "floor"\ngrid = 1.0', scene)
    assert found.shape == (2, 2)
    np.testing.assert_allclose(found.points[:, 1], 0, atol=1e-6)


def test_three_corners_are_a_parallelogram_and_four_a_quadrilateral(
    tmp_path: Path, room: Scene
) -> None:
    three = plane(tmp_path, "corners = [[-1, 1, 1], [0, 1, 1], [0, 1, 0]]", room)
    assert (three.shape, len(three)) == ((5, 5), 25)
    assert three.area_m2 == pytest.approx(1)
    np.testing.assert_allclose(three.points.mean(axis=0), (-0.5, 1, 0.5), atol=1e-6)
    corners = "[[-1, 1, 1], [1, 1, 1], [0.5, 1, 0], [-0.5, 1, 0]]"
    four = plane(tmp_path, f"corners = {corners}\ngrid = 0.1", room)
    assert four.area_m2 == pytest.approx(1.5)
    inside = np.abs(four.points[:, 0]) <= 0.5 + 0.5 * four.points[:, 2]
    assert inside.all()
    np.testing.assert_allclose(four.normals[0], (0, 1, 0), atol=1e-6)
    triangle = "[[-1, 1, 1], [-1, 1, 1], [1, 1, 1], [-1, 1, 0]]"
    assert plane(tmp_path, f"corners = {triangle}", room).area_m2 == pytest.approx(1)
    upright = plane(tmp_path, "corners = [[-1, 1, 0], [1, 1, 0], [1, 2, 0]]", room)
    np.testing.assert_allclose(upright.normals[0], (0, 0, 1), atol=1e-6)  # towards the camera


def test_listed_points_and_directions(tmp_path: Path, room: Scene) -> None:
    found = plane(tmp_path, "points = [[0, 1, 0], [1, 1.2, 1]]\nn = [0, 0, 2]", room)
    np.testing.assert_allclose(found.normals, [(0, 0, 1), (0, 0, 1)])
    assert (found.shape, found.area_m2, found.is_cylindrical) == (None, 0, False)
    around = plane(tmp_path, 'points = [[0, 1, 0]]\nn = "cylindrical"', room)
    assert around.is_cylindrical
    np.testing.assert_allclose(around.normals, [(0, 1, 0)])


def test_a_room_that_is_a_box_is_no_solid(tmp_path: Path) -> None:
    """Its normals face outwards, as those of the cupboard in it."""
    content = (
        BULB + box("hall", (-3, 0, -3), (3, 3, 3)) + box("block", (0.6, 0, 0.6), (1.6, 2, 1.6))
    )
    scene = lit_scene(tmp_path, content)
    corners = "corners = [[-2.5, 1, -2.5], [2.5, 1, -2.5], [2.5, 1, 2.5]]\ngrid = 1.0"
    found = plane(tmp_path, corners, scene)
    assert len(found) == 24  # of 25, without the one in the block
    assert not has_point(found, 1, 1, 1)


def test_a_scene_with_z_up(tmp_path: Path) -> None:
    path = tmp_path / "up.xml"
    path.write_text(
        """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective">
        <transform name="to_world"><lookat origin="0 -4 1.5" target="0 0 1.5" up="0 0 1"/>
        </transform><film type="hdrfilm"><integer name="width" value="8"/>
        <integer name="height" value="8"/></film></sensor>"""
        + BULB
        + '<shape type="rectangle" id="floor"/></scene>',
        encoding="utf-8",
    )
    found = plane(tmp_path, 'shape = "floor"\nheight = 0.8\ngrid = 0.5', load_scene(path))
    np.testing.assert_allclose(found.points[:, 2], 0.8, atol=1e-6)
    assert found.shape == (4, 4)
    np.testing.assert_allclose(found.points[0], (-0.75, -0.75, 0.8), atol=1e-6)


WISHED = """
[plane.desk]
points = [[0, 1, 0]]
preset = "office"
mean = 300
max = 2000
[plane.surround]
points = [[1, 1, 0]]
uniformity = 0.4
ratio = { to = "desk", at_least = 0.33 }
[power]
per_area = 2.5
"""


def test_wishes_and_power(tmp_path: Path, room: Scene) -> None:
    found = read(tmp_path, WISHED, room)
    desk, surround = found.planes
    assert desk.wishes == Wishes(300, 0.6, 2000, (), "office")
    assert surround.wishes == Wishes(None, 0.4, None, (Ratio("desk", 0.33),))
    assert found.power == PowerBudget(None, 2.5)


MISTAKES = {
    "": "is empty",
    "[plane.a": "is not TOML",
    "[planes.a]": "unknown key 'planes': did you mean 'plane'",
    "[power]\nwatts = 3": "has no plane: expected a table like",
    "[plane.a]": "plane.a has none: expected one of shape, walls, corners, points",
    '[plane.a]\nshape = "floor"\nwalls = ["back"]': "has shape and walls: expected one of",
    '[plane.a]\nshape = "flor"': "no shape 'flor': did you mean 'floor'",
    "[plane.a]\nshape = 3": "plane.a.shape is 3: expected names of shapes",
    '[plane.a]\nshape = "floor"\nhight = 1': "unknown key 'hight': did you mean 'height'",
    '[plane.a]\nshape = "floor"\nheight = "1 m"': "height is '1 m': expected a number >= 0",
    '[plane.a]\nshape = "floor"\ngrid = 0': "grid is 0: expected a number > 0",
    '[plane.a]\nshape = "floor"\ngrid = 0.001': "4000x4000 cells: expected at most",
    '[plane.a]\nshape = "floor"\nmargin = 2': "a margin of 2 leaves nothing of 4.00 x 4.00 m",
    '[plane.a]\nshape = "floor"\nheight = 5': "height is 5, outside of the room",
    '[plane.a]\nwalls = ["back"]\nheight = 1': "has walls, with which height does not go",
    "[plane.a]\ncorners = [[0, 0, 0]]": "expected 3 or 4 points",
    "[plane.a]\ncorners = [[0, 1, 0], [1, 1, 0], [2, 1, 0]]": "corners lie on one line",
    "[plane.a]\ncorners = [[0, 1, 0], [1, 1, 0], [1, 2, 1], [0, 1, 1]]": "not lie in one plane",
    "[plane.a]\npoints = [[1.5, 1, -1.5]]": "lies inside of a solid: all 1 points",
    "[plane.a]\npoints = [[0, nan, 0]]": "expected points",
    "[plane.a]\npoints = []": "expected points",
    "[plane.a]\npoints = [[0, 1, 0]]\nn = 3": "n is 3: expected a direction like",
    "[plane.a]\npoints = [[0, 1, 0]]\nn = [0, 0, 0]": "expected a direction like",
    "[plane.a]\npoints = [[0, 1, 0]]\nmean = -5": "mean is -5: expected a number > 0",
    "[plane.a]\npoints = [[0, 1, 0]]\nuniformity = 2": "at most 1",
    "[plane.a]\npoints = [[0, 1, 0]]\nmean = 500\nmax = 300": "a mean of 500 lx and at most 300",
    '[plane.a]\npoints = [[0, 1, 0]]\npreset = "ofice"': "did you mean 'office'",
    "[plane.a]\npoints = [[0, 1, 0]]\nratio = 0.3": "expected { to =",
    '[plane.a]\npoints = [[0, 1, 0]]\nratio = { to = "b", at_least = 1 }': "the file has no other",
    '[plane.a]\npoints = [[0, 1, 0]]\nratio = { to = "a" }': "expected { to =",
    '[plane."a/b"]\npoints = [[0, 1, 0]]': "cannot be the name of a file",
    "[plane.a]\npoints = [[0, 1, 0]]\n[power]\nwatts = 1\nper_area = 1": "expected one of them",
    "[plane.a]\npoints = [[0, 1, 0]]\n[power]\nwatt = 1": "unknown key 'watt'",
    "plane = 3": "has no plane",
}


def test_a_remark_on_points_behind_a_luminaire_that_becomes_a_panel(tmp_path: Path) -> None:
    """A panel of .6 x .6 m under a ceiling at 3, whose points are .2 m apart: three by three of
    them lie behind it, and the floor has all of its points.
    """
    lamp = '<emitter type="point" id="lamp"><point name="position" x="0" y="2.97" z="0"/></emitter>'
    ceiling = rectangle("ceiling", 3, '<rotate x="1" angle="90"/><translate y="3"/>')
    path = write_scene(tmp_path, lamp + ceiling + floor(3))
    (tmp_path / "lamp.ies").write_text(ies_text(cosine, sizes=(0.6, 0.6, 0)), encoding="ascii")
    (tmp_path / "lit.lights.toml").write_text(
        '[light.lamp]\nphotometry = "lamp.ies"\n', encoding="utf-8"
    )
    scene = load_scene(path)
    text = '[plane.top]\nwalls = ["ceiling"]\ngrid = 0.2\n[plane.low]\nshape = "floor"\ngrid = 0.2'
    found = read(tmp_path, text, scene)
    top, low = found.planes
    assert (len(top), len(low)) == (15 * 15 - 9, 15 * 15)
    [remark] = found.remarks(scene)
    assert (
        remark
        == "plane top: 9 points are left out behind lamp, of the size of its luminous opening"
    )


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_has_one_line(tmp_path: Path, room: Scene, text: str) -> None:
    with pytest.raises(SceneError) as caught:
        read(tmp_path, text, room)
    message = str(caught.value)
    assert MISTAKES[text] in message
    assert "\n" not in message
    assert "lit.planes.toml" in message or "plane.a" in message
    assert len(message) < 400


def test_a_missing_file_has_one_line(tmp_path: Path, room: Scene) -> None:
    with pytest.raises(SceneError, match="no such planes file"):
        read_planes(tmp_path / "none.toml", room)
