"""Whoever leaves an answer in a folder leaves the same files, and names them before."""

from pathlib import Path
from typing import Any

import pytest
from renderer import write_room

from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.result_folder import (
    ResultFolder,
    answer_files,
    new_answer,
    write_answer,
)
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """A room below a folder, with what it includes."""
    (tmp_path / "scenes").mkdir()
    return load_scene(write_room(tmp_path / "scenes"))


def _twice_as_bright(scene: Scene) -> Lighting:
    settings = []
    for light in scene.lights:
        r, g, b = light.emission
        doubled = 2 * r, 2 * g, 2 * b
        fields = light.name, light.plugin, light.parameter, light.unit
        settings.append(LightSetting(*fields, light.emission, doubled))
    return Lighting(tuple(settings))


def _results(folder: Path, scene: Scene, **options: Any) -> ResultFolder:
    return ResultFolder(folder, tuple(answer_files(folder, scene=scene, **options)), (), ("t",))


def _names(folder: Path) -> set[str]:
    return {str(x.relative_to(folder)) for x in folder.rglob("*") if x.is_file()}


@pytest.mark.parametrize("has_lighting", [False, True])
def test_files_are_named_before_they_are_written(
    scene: Scene, tmp_path: Path, has_lighting: bool
) -> None:
    options = {"scene": scene, "has_lighting": has_lighting}
    (tmp_path / "out").mkdir()
    relit = write_answer(tmp_path / "out", _twice_as_bright(scene), **options)
    written_paths = {tmp_path / "out" / name for name in _names(tmp_path / "out")}
    assert written_paths <= set(answer_files(tmp_path / "out", **options))
    assert (tmp_path / "out" / "lighting.json").exists() != has_lighting
    assert relit is not None
    assert relit.lights[0].emission == _twice_as_bright(scene).lights[0].emission


def test_every_way_of_leaving_an_answer_leaves_the_same_bytes(scene: Scene, tmp_path: Path) -> None:
    """In a staged folder, in one written to directly, and where lighting.json is there already."""
    lighting = _twice_as_bright(scene)
    (tmp_path / "directly").mkdir()
    write_answer(tmp_path / "directly", lighting, scene=scene)
    staged = _results(tmp_path / "staged", scene)
    with new_answer(staged, lighting, scene=scene) as answer:
        assert not (tmp_path / "staged").exists()
        assert answer.relit is not None
        other = answer.seen_through(answer.relit.sensor)
        assert other is answer.relit
    assert not answer.has_moved_paths
    assert _names(tmp_path / "staged") == _names(tmp_path / "directly") | {"result.json"}
    for name in _names(tmp_path / "directly"):
        direct_file, staged_file = (tmp_path / x / name for x in ("directly", "staged"))
        assert direct_file.read_bytes() == staged_file.read_bytes()
    assert read_lighting(tmp_path / "staged" / "lighting.json").emission == lighting.emission


def test_paths_in_a_relit_scene_hold_where_it_comes_to_lie(scene: Scene, tmp_path: Path) -> None:
    """Also where results go to the scene's own folder, beside which they are written first."""
    lighting, folder = _twice_as_bright(scene), scene.path.parent
    with new_answer(_results(folder, scene), lighting, scene=scene) as answer:
        (answer.path / "more.txt").write_text("with the answer")
    assert (folder / "more.txt").read_text() == "with the answer"
    relit = load_scene(folder / "relit.xml", use_lights_file=False)
    assert relit.lights[0].emission == lighting.lights[0].emission
