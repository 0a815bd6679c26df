"""Outlines of objects on the plan of the room, and the turn of skies."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb
from lightpaint.paint.rig.page_geometry import (
    mesh_parts,
    outline,
    plan_objects,
    polygon_area,
    sky_axes,
)

ROOM = """<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/>
    <integer name="height" value="6"/></film></sensor>
  <shape type="rectangle" id="floor"><transform name="to_world">
    <scale x="5" y="5"/><rotate x="1" angle="-90"/></transform></shape>
  <shape type="cube" id="box"><transform name="to_world"><scale value="0.5"/>
    <rotate y="1" angle="30"/><translate x="1" y="0.5" z="2"/></transform></shape>
  <shape type="sphere" id="ball"><float name="radius" value="0.7"/>
    <point name="center" x="-2" y="0.7" z="-1"/></shape>
  <shape type="cube" id="beam"><transform name="to_world"><scale x="2" y="0.1" z="0.1"/>
    <translate y="2.8"/></transform></shape>
  <shape type="cube" id="neighbour"><transform name="to_world"><translate x="9"/>
    </transform></shape>
  <shape type="rectangle" id="lamp_panel"><transform name="to_world"><translate x="1" y="1"/>
    </transform><emitter type="area" id="lamp"><rgb name="radiance" value="1"/></emitter></shape>
  <emitter type="constant" id="sky"><rgb name="radiance" value="1"/></emitter>
</scene>"""


def test_outlines_of_a_room(tmp_path: Path) -> None:
    """A turned box and a ball; without the floor, what hangs high, lies outside or emits light."""
    (tmp_path / "room.xml").write_text(ROOM)
    scene = lp.load_scene(tmp_path / "room.xml")
    low, high = np.array([-5.0, 0, -5]), np.array([5.0, 3, 5])
    objects = scene.while_loaded(lambda loaded: plan_objects(scene, loaded, 1, low, high))
    assert [entry.name for entry in objects] == ["ball", "box"]
    ball, box = (np.array(entry.corners) for entry in objects)
    np.testing.assert_allclose(np.hypot(*(ball - [-2, -1]).T), 0.7, rtol=0.01)
    assert polygon_area(ball) == pytest.approx(np.pi * 0.49, rel=0.02)
    turn = np.radians(30)
    # Mitsuba turns x towards −z about y.
    axes = 0.5 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    expected = [1, 2] + np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) @ axes
    assert len(box) == 4
    np.testing.assert_allclose(sorted(box.tolist()), sorted(expected.tolist()), atol=1e-4)
    assert polygon_area(box) == pytest.approx(1, rel=1e-4)


@given(st.floats(0, 6.28), st.floats(0.2, 5), st.floats(0.2, 5))
def test_the_outline_of_a_rectangle_has_its_corners(
    turn: float, width: float, depth: float
) -> None:
    cosine, sine = np.cos(turn), np.sin(turn)
    corners = np.array([[0, 0], [width, 0], [width, depth], [0, depth]])
    corners = corners @ np.array([[cosine, sine], [-sine, cosine]])
    inside = np.linspace(0.1, 0.9, 5)[:, None] * corners[2]
    found = outline(np.concatenate([inside, corners, corners + 1e-9]))
    assert len(found) == 4
    assert polygon_area(found) == pytest.approx(width * depth, rel=1e-3)


def test_parts_of_a_mesh_are_told_apart() -> None:
    """Two squares of two triangles each, whose corners are stored twice, beside a lone triangle."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    beside, behind = np.array([5.0, 0, 0]), np.array([0, 0, 9.0])
    vertices = np.concatenate([square, square + beside, square[:3] + behind])
    faces = np.arange(15).reshape(5, 3)
    parts = mesh_parts(vertices, faces)
    assert len(set(parts[:6])) == len(set(parts[6:12])) == len(set(parts[12:])) == 1
    assert len(set(parts)) == 3


@given(st.permutations(range(40)))
def test_a_chain_is_one_part(order: list[int]) -> None:
    """However its faces are numbered."""
    faces = np.array([[order[k], order[k + 1], order[k + 2]] for k in range(38)])
    assert set(mesh_parts(np.eye(40)[:, :3] + np.arange(40)[:, None], faces)) == {0}


@pytest.mark.parametrize("angle", [0, 90, 200])
def test_a_turned_sky_has_its_axes(tmp_path: Path, angle: float) -> None:
    """A direction of the scene, in the axes that Mitsuba's `to_world` takes to the scene's."""
    turn = f'<transform name="to_world"><rotate y="1" angle="{angle}"/></transform>'
    path, rows = tmp_path / "scene.xml", np.ones((4, 8, 3), np.float32)
    write_rgb(tmp_path / "sky.exr", rows)
    sky = '<emitter type="envmap" id="sky"><string name="filename" value="sky.exr"/>'
    text = ROOM.replace(
        '<emitter type="constant" id="sky"><rgb name="radiance" value="1"/>', sky + turn
    )
    path.write_text(text)
    [axes] = sky_axes(lp.load_scene(path, split={"sky": (8, 5)}))
    assert axes.name == "sky"
    radians = np.radians(angle)
    # The rotation about y takes z to x; its inverse is the transpose.
    to_world = np.array(
        [
            [np.cos(radians), 0, np.sin(radians)],
            [0, 1, 0],
            [-np.sin(radians), 0, np.cos(radians)],
        ]
    )
    np.testing.assert_allclose(np.array(axes.from_world), to_world.T, atol=1e-6)


def test_a_scene_without_a_split_sky_has_no_axes(tmp_path: Path) -> None:
    (tmp_path / "room.xml").write_text(ROOM)
    assert sky_axes(lp.load_scene(tmp_path / "room.xml")) == ()
