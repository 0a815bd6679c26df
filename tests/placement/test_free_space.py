"""Places for lights: in the open, in sight of what is seen, and far apart."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from renderer import LIGHTS, write_room

from lightpaint.arrays import as_position
from lightpaint.placement.free_space import far_apart, free_space, pixels_of
from lightpaint.scene.scene_reader import load_scene

#: A closed box, two wide, with a sphere of radius 0.5 in its middle, seen from a corner.
BOX = """<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective" id="camera"><float name="fov" value="90"/>
        <float name="near_clip" value="{near}"/>
        <transform name="to_world"><lookat origin="0.9 0.9 0.9" target="0 0 0" up="0 1 0"/>
        </transform><film type="hdrfilm"><integer name="width" value="24"/>
        <integer name="height" value="20"/></film></sensor>
    <shape type="cube" id="box"><boolean name="flip_normals" value="true"/>
        <transform name="to_world"><scale value="{size}"/></transform></shape>
    <shape type="sphere" id="ball"><float name="radius" value="{radius}"/></shape>
    <emitter type="point" id="lamp"><point name="position" x="0" y="0.8" z="0"/></emitter>
</scene>"""


def _space(path: Path, seed: int = 0) -> tuple[Any, Any, Any]:
    scene = load_scene(path)
    loaded = scene.load()
    return scene, loaded, free_space(scene, loaded, seed=seed)


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_places_are_in_the_open_at_any_scale(tmp_path: Path, scale: float):
    path = tmp_path / "box.xml"
    text = BOX.format(size=scale, radius=0.5 * scale, near=0.01 * scale)
    text = text.replace("0.9 0.9 0.9", " ".join([str(0.9 * scale)] * 3))
    path.write_text(text.replace('y="0.8"', f'y="{0.8 * scale}"'), encoding="utf-8")
    _, _, space = _space(path)
    places = space.places / scale
    assert len(places) > 1000
    assert np.abs(places).max() < 1  # in the box
    assert np.linalg.norm(places, axis=1).min() > 0.5  # and not in the ball
    # On all sides of it: also behind the camera and where the ball hides it.
    for sign in np.ndindex(2, 2, 2):
        assert ((places > 0) == np.array(sign, dtype=bool)).all(axis=1).any()
    assert 0.2 < space.spread / scale < 2


def test_the_same_seed_gives_the_same_places(tmp_path: Path):
    path = write_room(tmp_path)
    first, second, other = (_space(path, seed)[2].places for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, second)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_out_in_the_open_places_stay_near(tmp_path: Path):
    """Rays that hit nothing end; a floor to the horizon does not make all else small."""
    path = write_room(tmp_path, lights=LIGHTS["sky"])
    wide = path.read_text(encoding="utf-8").replace(
        '<rotate x="1" angle="-90"/>', '<scale value="10000"/><rotate x="1" angle="-90"/>', 1
    )
    path.write_text(wide, encoding="utf-8")
    _, _, space = _space(path)
    assert len(space.places) > 100
    assert np.linalg.norm(space.places, axis=1).max() < 100


def test_nothing_in_view_is_no_place(tmp_path: Path):
    path = write_room(tmp_path)
    text = path.read_text(encoding="utf-8").replace("0 0.8 0", "0 9 9", 1)
    path.write_text(text, encoding="utf-8")
    assert _space(path)[2].places.shape == (0, 3)


def test_where_places_are_in_the_picture(tmp_path: Path):
    scene, loaded, _ = _space(write_room(tmp_path))
    # What the camera looks at is in the middle; what is behind it is not in the picture.
    middle, behind_camera = pixels_of(scene, loaded, np.array([[0, 0.8, 0], [0, 1, 5.0]]))
    assert middle == pytest.approx((0.5, 0.5), abs=1e-3)
    assert behind_camera is None
    above, right = pixels_of(scene, loaded, np.array([[0, 1.2, 0], [0.3, 0.8, 0]]))
    assert above is not None
    assert right is not None
    assert above[1] < 0.5 < right[0]


@given(st.integers(0, 1000), st.integers(1, 30), st.integers(0, 40))
def test_far_apart(seed: int, count: int, there: int):
    places = np.random.default_rng(seed).random((there, 3))
    chosen = far_apart(places, count)
    assert len(chosen) == min(count, there)
    assert len({as_position(place) for place in chosen}) == len(chosen)
    if len(chosen) < 2 or len(chosen) == there:
        return
    # No place that was left out is farther from the chosen ones than these are from each other.
    distances = np.linalg.norm(chosen[:, None] - chosen, axis=2) + 9 * np.eye(len(chosen))
    to_chosen = np.linalg.norm(places[:, None] - chosen, axis=2).min(axis=1)
    assert to_chosen.max() <= distances.min() + 1e-12


def test_far_from_what_is_taken():
    places = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]])
    np.testing.assert_array_equal(far_apart(places, 1, start=np.array([[3.0, 0, 0]])), places[:1])
    # What is taken itself is no other place.
    assert len(far_apart(places, 3, start=places[:1])) == 2
    assert far_apart(np.zeros((0, 3)), 3, start=places).shape == (0, 3)
