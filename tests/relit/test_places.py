"""An answer says where its lights are, and whoever applies it hangs them there."""

import ast
import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.batch.manifest.sequence import interpolate
from lightpaint.errors import LightingError
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.pipeline.result_folder import with_places
from lightpaint.progress import silent
from lightpaint.relit.export.fixtures import fixtures_csv, pan_and_tilt
from lightpaint.relit.exported_answer import Source
from lightpaint.relit.formats import names_of_forms, writers_of
from lightpaint.relit.relit_scene import scene_patch
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

TURNED = lp.Pose(position=(0.5, 1.7, 1.0), target=(-0.6, 0, -0.3), cutoff=20)
NEW = NewEmitter("key", "spot", lp.Pose(position=(-0.7, 1.6, 1), target=(0, 0, 0), cutoff=25))


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def answer_of(scene: Scene) -> lp.Lighting:
    """The current lighting, with the places of the scene."""
    basis = lp.render_basis(scene, spp=2)
    return with_places(lp.Lighting.current(basis), scene)


def test_a_file_has_the_places_of_its_answer(room: Scene, tmp_path: Path) -> None:
    moved_room = room.moved({"beam": TURNED}).with_new_emitters([NEW])
    lighting = answer_of(moved_room)
    write_lighting(tmp_path / "a.json", lighting)
    reread = read_lighting(tmp_path / "a.json")
    assert reread.places == lighting.places
    assert reread.up == lighting.up == (0, 1, 0)
    data = json.loads((tmp_path / "a.json").read_text())["places"]
    assert data["beam"]["moved_from"]["position"] == [0.8, 1.8, 1.5]
    assert data["key"]["new"] == "spot"
    assert "moved_from" not in data["bulb"]
    assert "sky" not in data


@pytest.mark.parametrize("of", ["file", "memory"])
def test_whoever_applies_an_answer_hangs_its_lights_there(
    room: Scene, tmp_path: Path, of: str
) -> None:
    """From the scene as it is in its file, or from one in which they hang there already."""
    moved_room = room.moved({"beam": TURNED}).with_new_emitters([NEW])
    lighting = answer_of(moved_room)
    relit = lp.relight(room if of == "file" else moved_room, lighting, tmp_path / "r" / "relit.xml")
    sites = {x.name: x.site for x in moved_room.emitters}
    assert {x.name for x in relit.emitters} == {*sites}
    assert all(x.site.is_near(sites[x.name]) for x in relit.emitters)
    assert not relit.light("beam").members[0].site.is_near(room.light("beam").members[0].site)


def test_a_lighting_without_places_moves_nothing(room: Scene, tmp_path: Path) -> None:
    lighting = replace(answer_of(room), places=())
    relit = lp.relight(room, lighting, tmp_path / "r" / "relit.xml")
    assert relit.light_identities == room.light_identities


def test_a_patch_moves_the_light(room: Scene) -> None:
    patch = scene_patch(room, answer_of(room.moved({"beam": TURNED})))
    added = [line for line in patch.splitlines() if line.startswith("+") and "lookat" in line]
    assert len(added) == 1
    assert 'origin="0.5, 1.7, 1"' in added[0]


def test_other_programs_hang_the_lights_too(room: Scene, tmp_path: Path) -> None:
    pytest.importorskip("pxr.UsdLux", reason="usd-core")
    from pxr import Usd, UsdLux

    source = Source(scene=room)
    lighting = answer_of(room.moved({"beam": TURNED}).with_new_emitters([NEW]))
    names = names_of_forms(["usd", "blender"], source)
    writers, _ = writers_of(names, lighting, source, tmp_path, silent)
    script = {
        target.id: ast.literal_eval(node.value)
        for node in ast.parse(writers["set_scene.py"]()).body
        if isinstance(node, ast.Assign) and isinstance(target := node.targets[0], ast.Name)
        if target.id in ("MOVED", "ADDED", "PRESENT")
    }
    assert script["MOVED"]["beam"][0] == pytest.approx(TURNED.position)
    assert script["ADDED"]["key"][:2] == ("SPOT", NEW.pose.position)
    assert script["PRESENT"]["beam"] == (0.8, 1.8, 1.5)
    (tmp_path / "lights.usda").write_text(writers["lights.usda"](), encoding="utf-8")
    stage = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    key = UsdLux.SphereLight(stage.GetPrimAtPath("/lights/key"))
    assert tuple(key.GetLocalTransformation().ExtractTranslation()) == NEW.pose.position
    beam = stage.GetPrimAtPath("/lights/beam").GetAttribute("xformOp:transform").Get()
    assert tuple(beam.ExtractTranslation()) == pytest.approx(TURNED.position)


def test_no_lamp_travels_between_two_looks(room: Scene) -> None:
    answer, other_answer = answer_of(room), answer_of(room.moved({"beam": TURNED}))
    with pytest.raises(LightingError, match="beam at different places"):
        interpolate([answer, other_answer], 0.5, space="log")
    assert interpolate([other_answer, other_answer], 0.5, space="log").places == other_answer.places


def test_a_list_of_fixtures_says_where_each_hangs(room: Scene) -> None:
    text = fixtures_csv(answer_of(room.moved({"beam": TURNED})))
    rows = {row["fixture"]: row for row in csv.DictReader(io.StringIO(text))}
    beam, sun, panel = rows["beam"], rows["sun"], rows["panel"]
    assert [float(beam[key]) for key in "xyz"] == pytest.approx(TURNED.position)
    target = np.array([float(beam[f"target_{key}"]) for key in "xyz"])
    way = np.subtract(TURNED.target, TURNED.position)
    np.testing.assert_allclose(target - TURNED.position, way / np.linalg.norm(way), atol=1e-5)
    assert (beam["change"], sun["change"]) == ("moved", "")
    assert sun["x"] == ""
    assert float(sun["tilt"]) > 0
    assert float(panel["tilt"]) == pytest.approx(0, abs=0.01)
    assert float(beam["cutoff"]) == pytest.approx(20)


@pytest.mark.parametrize(
    ("direction", "up", "pan", "tilt"),
    [
        ((0, -1, 0), (0, 1, 0), 0, 0),
        ((0, 0, -1), (0, 1, 0), 0, 90),
        ((1, 0, 0), (0, 1, 0), 90, 90),
        ((-1, -1, 0), (0, 1, 0), -90, 45),
        ((0, 1, 0), (0, 0, 1), 0, 90),
        ((1, 0, 0), (0, 0, 1), 90, 90),
        ((0, 0, 1), (0, 0, 1), 0, 180),
    ],
)
def test_pan_is_clockwise_from_above_and_tilt_from_straight_down(
    direction: tuple[float, ...], up: tuple[float, ...], pan: float, tilt: float
) -> None:
    x, y, z = np.array(direction) / np.linalg.norm(direction)
    assert pan_and_tilt((x, y, z), up) == pytest.approx((pan, tilt), abs=1e-5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "places",
    [
        {"beam": {"position": [1, 2]}},
        {"beam": {"position": ["a", 1, 2]}},
        {"beam": {"new": "lamp"}},
        {"beam": 3},
        [1],
    ],
)
def test_damaged_places_are_one_line(room: Scene, tmp_path: Path, places: object) -> None:
    write_lighting(tmp_path / "a.json", answer_of(room))
    data = json.loads((tmp_path / "a.json").read_text())
    (tmp_path / "a.json").write_text(json.dumps({**data, "places": places}))
    with pytest.raises(LightingError, match=r"a\.json") as refusal:
        read_lighting(tmp_path / "a.json")
    assert "\n" not in str(refusal.value)
