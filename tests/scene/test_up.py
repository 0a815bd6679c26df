"""The up direction of a scene, which its camera gives, and pan, tilt and plans that follow it."""

from pathlib import Path

import numpy as np
import pytest

from lightpaint.relit.export.fixtures import pan_and_tilt
from lightpaint.scene.scene_reader import load_scene

SCENE = """<scene version="3.0.0">
    <sensor type="perspective"><transform name="to_world">
        <lookat origin="{origin}" target="{target}" up="{up}"/></transform></sensor>
    <shape type="sphere"/>
    <emitter type="spot" id="spot"><transform name="to_world">
        <lookat origin="0 3 0" target="{spot}" up="0 0 1"/></transform></emitter>
</scene>"""


@pytest.mark.parametrize(
    ("origin", "target", "up", "spot", "expected"),
    [
        ("0 1 5", "0 1 0", "0 1 0", "0 0 0", "y"),  # level, straight along an axis
        ("3 1 5", "0 1 0", "0 1 0", "9 3 0", "y"),  # level, at an angle
        ("0 5 1", "0 0 1", "0 0 1", "0 2.5 -9", "z"),  # level where z is up
        ("3 9 5", "0 0 0", "0 1 0", "0 0 0", "y"),  # steeply down, at an angle
        ("0 9 2", "0 0 0", "0 1 0", "0 0 0", "y"),  # steeply down, along an axis
        ("0 5 0", "0 0 0", "0 0 -1", "0 0 0", "y"),  # straight down
        ("0 5 0", "0 0 0", "0 0 1", "0 0 0", "y"),  # the same with the picture turned
        ("0 5 0", "0 0 0", "1 0 0", "0 0 0", "y"),
        ("0 0 5", "0 0 0", "0 -1 0", "0 2.5 -9", "z"),  # straight down where z is up
    ],
)
def test_up_is_what_people_call_up(
    tmp_path: Path, origin: str, target: str, up: str, spot: str, expected: str
) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE.format(origin=origin, target=target, up=up, spot=spot), encoding="utf-8")
    scene = load_scene(path)
    assert scene.up == tuple(np.eye(3)["xyz".index(expected)])


def test_a_spot_straight_down_has_no_tilt_below_a_camera_that_looks_down(tmp_path: Path) -> None:
    text = SCENE.format(origin="0 5 0", target="0 0 0", up="0 0 1", spot="0 0 0")
    (tmp_path / "scene.xml").write_text(text, encoding="utf-8")
    scene = load_scene(tmp_path / "scene.xml")
    direction = scene.light("spot").members[0].site.direction
    assert direction is not None
    assert pan_and_tilt(direction, scene.up) == pytest.approx((0, 0), abs=1e-4)
