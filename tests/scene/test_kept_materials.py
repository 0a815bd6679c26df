"""Materials that go from one loaded scene to the next."""

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import write_room

from lightpaint.scene import kept_materials
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

#: A wall that takes long to load, and one that reads a file.
PLASTIC = '<bsdf type="roughplastic" id="wall_paint"><float name="alpha" value="{alpha}"/></bsdf>'
PICTURE = (
    '<bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
    '<string name="filename" value="wall.png"/></texture></bsdf>'
)


@pytest.fixture(autouse=True)
def nothing_is_kept() -> Iterator[None]:
    """Begin and end with no materials of other tests."""
    kept_materials._kept.clear()
    yield
    kept_materials._kept.clear()


def plastic_room(folder: Path, *, alpha: float = 0.2, name: str = "room.xml") -> Scene:
    return load_scene(write_room(folder, wall=PLASTIC.format(alpha=alpha), name=name))


def kept_plastics() -> list[Any]:
    return [x.built for x in kept_materials._kept if x.nodes[1].plugin_name() == "roughplastic"]


def wall_materials(loaded: Any) -> list[Any]:
    """The rough plastics of the walls of a loaded room."""
    materials = [shape.bsdf() for shape in loaded.shapes()]
    return [x for x in materials if x.id() == "wall_paint"]


def test_the_next_load_takes_equal_materials_and_their_owner_is_the_only_one(
    tmp_path: Path,
) -> None:
    scene = plastic_room(tmp_path)
    [plastic] = kept_plastics()
    loaded = scene.load()
    assert wall_materials(loaded)
    assert all(x is plastic for x in wall_materials(loaded))
    # Whoever loads a scene may change it: nobody else gets these again.
    assert not kept_materials._kept


def test_what_somebody_does_to_a_loaded_scene_is_not_in_the_next(tmp_path: Path) -> None:
    import mitsuba as mi

    scene = plastic_room(tmp_path)
    loaded = scene.load()
    parameters = mi.traverse(wall_materials(loaded)[0])
    parameters["alpha"] = 0.7
    parameters.update()
    del loaded, parameters
    gc.collect()
    [alpha] = np.ravel(mi.traverse(wall_materials(scene.load())[0])["alpha"])
    assert alpha == np.float32(0.2)


def test_another_value_is_another_material(tmp_path: Path) -> None:
    plastic_room(tmp_path, alpha=0.2)
    [before] = kept_plastics()
    plastic_room(tmp_path, alpha=0.3, name="other.xml")
    [after] = kept_plastics()
    assert after is not before
    plastic_room(tmp_path, alpha=0.3, name="same.xml")
    assert kept_plastics() == [after]


def test_materials_of_files_are_read_again(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("RGB", (4, 4), (200, 100, 50)).save(tmp_path / "wall.png")
    scene = load_scene(write_room(tmp_path, wall=PICTURE))
    kept_plugins = {x.nodes[1].plugin_name() for x in kept_materials._kept}
    assert "bitmap" not in kept_plugins
    before = render(scene, spp=2, stream=Stream.TEMPLATE).image
    Image.new("RGB", (4, 4), (20, 10, 5)).save(tmp_path / "wall.png")
    after = render(scene, spp=2, stream=Stream.TEMPLATE).image
    assert after.mean() < 0.9 * before.mean()


def test_a_render_with_kept_materials_has_the_same_bits(tmp_path: Path) -> None:
    scene = plastic_room(tmp_path)
    kept = render(scene, spp=4, stream=Stream.TEMPLATE).image
    assert kept_plastics()
    kept_materials._kept.clear()
    built_again = render(scene, spp=4, stream=Stream.TEMPLATE).image
    np.testing.assert_array_equal(kept, built_again)
