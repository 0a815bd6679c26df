"""Panels of a scene: their outline wherever they point, and a scene without them."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

from lightpaint.placement.paths.panel_lights import (
    Outline,
    PanelSite,
    is_panel,
    panel_site,
    without_panels,
)
from lightpaint.scene.properties.pose import Pose
from lightpaint.scene.properties.site import rotation_between
from lightpaint.scene.scene_reader import load_scene

OUTLINE = Outline((0.0, -1.0, 0.0), ((0.5, 0.0, 0.0), (0.0, 0.0, 0.2)))


def test_an_outline_turns_by_the_smallest_rotation() -> None:
    ways = np.random.default_rng(0).normal(size=(20, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    for way, sides in zip(ways, OUTLINE.turned(ways), strict=True):
        expected = np.array(OUTLINE.half_sides) @ rotation_between(OUTLINE.direction, way).T
        assert sides == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("y", [-1.0, 1.0])
def test_an_outline_keeps_its_sides_where_it_points_back(y: float) -> None:
    [sides] = OUTLINE.turned(np.array([[0.0, y, 0.0]]))
    assert np.linalg.norm(sides, axis=1) == pytest.approx([0.5, 0.2])
    assert sides @ sides.T == pytest.approx(np.diag([0.25, 0.04]))
    assert sides[:, 1] == pytest.approx(0)


def test_a_square_has_its_side_towards_all_directions() -> None:
    site = PanelSite((0, 0, 0), (0.6, 0.0, 0.8), side=3.0)
    assert np.linalg.norm(site.half_sides, axis=1) == pytest.approx([1.5, 1.5])
    assert site.half_sides @ np.array(site.direction) == pytest.approx([0, 0], abs=1e-6)
    assert site.radius == pytest.approx(1.5 * 2**0.5)


def test_a_panel_of_a_scene_has_its_outline_where_it_is_moved(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    path.write_text(path.read_text().replace('<scale value="0.3"/>', '<scale x="0.5" y="0.2"/>'))
    room = load_scene(path)
    panel = room.light("panel")
    site = panel_site(room, panel, panel.members[0].site)
    moved = room.moved({"panel": Pose(position=(0.4, 1.5, 0), target=(1, 0, 0.3))})
    there = moved.light("panel").members[0].site
    turned = panel_site(room, panel, there)
    assert turned.half_sides == pytest.approx(
        panel_site(moved, moved.light("panel"), there).half_sides
    )
    assert np.linalg.norm(site.half_sides, axis=1) == pytest.approx([0.5, 0.2])
    assert site.side**2 == pytest.approx(4 * 0.5 * 0.2)


def test_paths_do_not_meet_panels_that_are_left_out(tmp_path: Path) -> None:
    room = load_scene(write_room(tmp_path))
    assert is_panel(room.light("panel"))
    bare = without_panels(room, ["panel", "bulb"])
    assert [x.name for x in bare.lights] == [x.name for x in room.lights if x.name != "panel"]
    assert without_panels(room, ["bulb"]) is room
    counts = [x.while_loaded(lambda loaded: len(loaded.shapes())) for x in (room, bare)]
    assert counts[0] - counts[1] == 1
    # The scene itself still has it.
    assert room.while_loaded(lambda loaded: len(loaded.shapes())) == counts[0]
