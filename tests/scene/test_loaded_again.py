"""A scene that is loaded again with other lights is the same as if all of it were loaded."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from renderer import write_room

from lightpaint.errors import SceneError
from lightpaint.scene import mitsuba_scene
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_tree import ParsedScene

SCENES = Path(__file__).parents[2] / "scenes"

#: A pane that lets paths through, a shape that shines within another, and one with a camera.
SHAPES = """
  <shape type="rectangle">
    <transform name="to_world"><translate z="0.5"/></transform>
    <bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="diffuse"/></bsdf>
  </shape>
  <shape type="disk" id="flame">
    <transform name="to_world"><scale value="0.1"/></transform>
    <bsdf type="conductor"/>
    <emitter type="area"><rgb name="radiance" value="1 0.5 0.25"/></emitter>
  </shape>
</scene>"""


@pytest.fixture(autouse=True)
def nothing_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mitsuba_scene, "_has_null", {})


@pytest.fixture
def shape_counts(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of shapes of the scenes that Mitsuba loads."""
    counts: list[int] = []
    instantiate = ParsedScene.instantiate

    def counted(self: ParsedScene, *arguments: Any, **options: Any) -> Any:
        loaded = instantiate(self, *arguments, **options)
        counts.append(len(loaded.shapes()))
        return loaded

    monkeypatch.setattr(ParsedScene, "instantiate", counted)
    return counts


def room(folder: Path, edits: dict[str, str] | None = None) -> Path:
    path = write_room(folder)
    text = path.read_text(encoding="utf-8").replace("</scene>", SHAPES)
    for old, new in (edits or {}).items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def facts(scene: Scene) -> dict[str, Any]:
    """All that is known of a scene, but its file's place and its nodes."""
    known = {x.name: getattr(scene, x.name) for x in fields(scene)}
    identities = {"identity": scene.identity, "planes": scene.light_identities}
    return known | identities | {"parsed": None}


@pytest.mark.parametrize("name", ["cornell", "gallery", "stage", "table"])
def test_a_scene_loaded_again_is_the_same(name: str, shape_counts: list[int]):
    path = SCENES / name / "scene.xml"
    first, again = load_scene(path), load_scene(path)
    assert facts(again) == facts(first)
    shining = {
        first.parsed.shape_of[x.node] for x in first.emitters if x.node in first.parsed.shape_of
    }
    assert shape_counts[1] == len(shining) < shape_counts[0]


def test_other_lights_are_those_of_a_scene_loaded_alone(tmp_path: Path, shape_counts: list[int]):
    """Also where paths pass a surface, which counts once something surrounds the scene."""
    load_scene(room(tmp_path))
    edits = {"4 3 2": "1 1 9", 'x="-0.5" y="1" z="0.5"': 'x="-0.4" y="1" z="0.5"'}
    path = room(tmp_path, {**edits, "1 0.5 0.25": "0.1 0.2 0.3"})
    again = load_scene(path)
    assert shape_counts[1] < shape_counts[0]
    mitsuba_scene._has_null.clear()
    alone = load_scene(path)
    assert shape_counts[2] == shape_counts[0]
    assert alone.has_null
    assert facts(again) == facts(alone)


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        ('<rgb name="reflectance" value="1 2 3"/>', "range"),
        ('<float name="opaqueness" value="1"/>', "opaqueness"),
    ],
)
def test_mistakes_in_other_surfaces_are_found(
    parameter: str, message: str, tmp_path: Path, shape_counts: list[int]
):
    load_scene(room(tmp_path))
    load_scene(room(tmp_path, {'"opacity" value="0.5"': '"opacity" value="0.75"'}))
    assert shape_counts[1] == shape_counts[0]
    wrong = f'<bsdf type="diffuse">{parameter}</bsdf></bsdf>'
    with pytest.raises(SceneError, match=message):
        load_scene(room(tmp_path, {'<bsdf type="diffuse"/></bsdf>': wrong}))
