"""What the camera sees first, of a room whose surfaces are known."""

from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.surfaces import BACKGROUND, Surfaces, render_first_hits, render_surfaces


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Surfaces:
    room = write_room(tmp_path_factory.mktemp("surfaces"), lights=LIGHTS["panel"])
    return render_surfaces(load_scene(room))


def test_coverage_adds_up_to_what_is_not_nothing(seen: Surfaces) -> None:
    assert {"floor", "wall", "ball"} <= set(seen.coverage)
    total = sum(seen.coverage.values())
    # Sixteenths, and exact in binary.
    np.testing.assert_array_equal(total == 0, seen.depth == np.float32(BACKGROUND))
    assert np.max(total) == 1
    assert (np.asarray(total) * 16 % 1 == 0).all()


def test_albedo_is_what_the_materials_say(seen: Surfaces) -> None:
    floor = seen.coverage["floor"] == 1
    assert floor.any()
    np.testing.assert_allclose(seen.albedo[floor], [[0.7, 0.5, 0.4]] * floor.sum(), atol=1e-6)
    assert seen.albedo.min() >= 0
    assert seen.albedo.max() <= 1


def test_normals_are_of_unit_length_and_in_world_space(seen: Surfaces) -> None:
    is_hit = seen.depth < BACKGROUND
    np.testing.assert_allclose(np.linalg.norm(seen.normal[is_hit], axis=-1), 1, atol=1e-6)
    assert not seen.normal[~is_hit].any()
    floor, wall = seen.coverage["floor"] == 1, seen.coverage["wall"] == 1
    np.testing.assert_allclose(seen.normal[floor], [[0, 1, 0]] * floor.sum(), atol=1e-6)
    np.testing.assert_allclose(seen.normal[wall], [[0, 0, 1]] * wall.sum(), atol=1e-6)


def test_depth_is_the_distance_along_the_camera_s_axis(seen: Surfaces) -> None:
    # From (0, 1, 3.5) it looks down by 0.2 in 3.5; the wall is at z = -1, from y = 0 to 2.
    down, ahead = -0.2 / np.hypot(0.2, 3.5), 3.5 / np.hypot(0.2, 3.5)
    nearest, farthest = (4.5 * ahead + (y - 1) * down for y in (2, 0))
    wall = seen.depth[seen.coverage["wall"] == 1]
    assert nearest - 1e-5 <= wall.min()
    assert wall.max() <= farthest + 1e-5
    assert np.ptp(wall) > 0.3 * (farthest - nearest)


@pytest.mark.nightly
def test_one_picture_in_every_variant(seen: Surfaces, tmp_path: Path) -> None:
    import subprocess
    import sys

    room = write_room(tmp_path, lights=LIGHTS["panel"])
    code = f"""
import numpy as np
from lightpaint.scene.scene_reader import load_scene
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.scene.surfaces import BACKGROUND, Surfaces, render_first_hits, render_surfaces
seen = render_surfaces(load_scene({str(room)!r}, variant="scalar_rgb"))
np.savez({str(tmp_path / "seen.npz")!r}, **seen.coverage)
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", code], check=True)
    with np.load(tmp_path / "seen.npz") as other:
        assert set(other.files) == set(seen.coverage)
        for name in other.files:
            # Sixteen samples of an edge: a standard error of an eighth.
            assert np.abs(other[name] - seen.coverage[name]).max() < 0.75
            assert other[name].mean() == pytest.approx(seen.coverage[name].mean(), abs=0.01)


NAMELESS = """
    <bsdf type="diffuse" id="clay"/>
    <shape type="sphere"><point name="center" x="-0.8" y="0.5" z="0"/>
        <float name="radius" value="0.3"/><bsdf type="diffuse">
        <rgb name="reflectance" value="0.1"/></bsdf></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.2"/>
        <translate x="0.9" y="0.2" z="0.5"/></transform><ref id="clay"/></shape>
    <shape type="shapegroup" id="heap"><shape type="sphere"><float name="radius" value="0.1"/>
        </shape></shape>
    <shape type="instance"><ref id="heap"/><transform name="to_world">
        <translate y="1.2"/></transform></shape>
"""


def test_each_pixel_has_an_object_and_each_object_a_name(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + NAMELESS))
    features, objects = render_first_hits(scene)
    surfaces = render_surfaces(scene)
    assert features.size == objects.size == scene.size
    assert scene.shape_names[:3] == ("floor", "wall", "ball")
    assert {"sphere", "clay", "heap"} <= set(scene.shape_names)
    assert {"floor", "wall", "ball", "sphere", "clay"} <= set(objects.names)
    for name in ("floor", "wall", "ball", "sphere", "clay"):
        # Where all samples of a pixel see it, any do.
        is_full = surfaces.coverage[name] == 1
        assert objects.mask(name)[is_full].mean() > 0.95
    assert features.position is not None
    floor, wall = (features.position[surfaces.coverage[name] == 1] for name in ("floor", "wall"))
    # The samples that were counted are others: an edge may run through one of these pixels.
    assert (np.abs(floor[:, 1]) < 1e-5).mean() > 0.95
    assert (np.abs(wall[:, 2] + 1) < 1e-5).mean() > 0.95
    is_background = sum(surfaces.coverage.values()) == 0
    assert (objects.index[is_background] == -1).mean() > 0.95


def test_the_basis_has_them(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"]))
    few = render_basis(scene, spp=2)
    assert few.surface_filter is not None
    assert few.objects is not None
    continuation = render_basis(scene, spp=4, start=few)
    assert continuation.objects is few.objects
