"""`lightpaint export`: each form is read back by what it is for."""

import ast
import math
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from fake_blender import FakeData, fake_blender, run_in
from light_groups import interleaved, pictures
from renderer import LIGHTS, write_room

from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.relit.formats import with_own_colors
from lightpaint.scene.scene_reader import load_scene

#: Emissions are written with nine digits, and read as float32.
FLOAT32 = 1e-6


@pytest.fixture(scope="module")
def answer_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room whose lights are in it and in a file that it includes, and an answer for it."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "lamps").mkdir()
    bulb_scene = f'<scene version="3.0.0">{LIGHTS["bulb"]}</scene>\n'
    (folder / "lamps" / "bulb.xml").write_text(bulb_scene, encoding="utf-8")
    included = '<include filename="lamps/bulb.xml"/>'
    write_room(folder, lights=LIGHTS["panel"] + LIGHTS["sun"] + included)
    write_rgb(folder / "look.exr", np.full((20, 24, 3), 0.4, np.float32) * [1, 0.8, 0.5])
    succeed(folder, "solve", "room.xml", "look.exr", "--spp", "4", "--unit", "100")
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(folder / "groups.exr", layers)
    write_rgb(folder / "groups" / "look.exr", pictures()[0])
    succeed(folder, "solve", "groups.exr", "groups/look.exr", "-o", "grouped")
    return folder


def exported_values(folder: Path) -> Any:
    """What other programs get: of lights whose colour four samples do not tell, their own."""
    current = {light.name: light.emission for light in load_scene(folder / "room.xml").lights}
    return with_own_colors(read_lighting(folder / "look" / "lighting.json"), current)[0].emission


def test_a_patch_changes_the_lights_and_nothing_else(answer_folder: Path, tmp_path: Path) -> None:
    if shutil.which("patch") is None:
        pytest.skip("patch")
    arguments = ("look/lighting.json", "--to", "mitsuba", "--scene", "room.xml")
    succeed(answer_folder, "export", *arguments, "-o", tmp_path / "out")
    patch = (tmp_path / "out" / "relit.patch").read_text()
    shutil.copy(answer_folder / "room.xml", tmp_path)
    shutil.copytree(answer_folder / "lamps", tmp_path / "lamps")
    subprocess.run(["patch", "-p1"], input=patch, text=True, cwd=tmp_path, check=True)
    expected = read_lighting(answer_folder / "look" / "lighting.json").emission
    actual = {light.name: light.emission for light in load_scene(tmp_path / "room.xml").lights}
    assert set(actual) == set(expected)
    for name, emission in expected.items():
        np.testing.assert_allclose(actual[name], emission, rtol=FLOAT32)
    changed = [x for x in patch.splitlines() if x[0] in "+-" and x[:3] not in ("+++", "---")]
    assert all("rgb" in line or "sampling_weight" in line for line in changed)


class _Socket:
    default_value: Any = None
    is_linked = False


def _blender() -> Any:
    """A fake Blender with lamps by type, and a mesh."""
    modules = fake_blender()
    bpy, objects = modules[0], modules[0].data.objects

    def lamp(name: str, kind: str, **settings: Any) -> None:
        item = objects.new(name, FakeData(type=kind, **settings))
        item.matrix_world = np.diag([2.0, 3.0, 1.0, 1.0])

    inputs = {name: _Socket() for name in ("Color", "Strength")}
    tree = SimpleNamespace(nodes=[SimpleNamespace(type="EMISSION", inputs=inputs)])
    material = SimpleNamespace(name="glow", use_nodes=True, node_tree=tree)
    lamp("bulb", "POINT")
    lamp("sun", "SUN")
    lamp("desk", "AREA", size=0.5, size_y=1.0, shape="RECTANGLE")
    panel = objects.new("panel", None)
    panel.type, panel.material_slots = "MESH", [SimpleNamespace(material=material)]
    return bpy, modules


def test_blender_is_given_watts_of_the_same_light(answer_folder: Path, tmp_path: Path) -> None:
    arguments = ("look/lighting.json", "--to", "blender,csv", "--scene", "room.xml")
    succeed(answer_folder, "export", *arguments, "-o", tmp_path)
    expected = exported_values(answer_folder)
    text = (tmp_path / "set_scene.py").read_text()
    ast.parse(text)
    blender, modules = _blender()
    with pytest.MonkeyPatch.context() as patch:
        run_in(modules, text, patch)
    objects = blender.data.objects
    point = objects["bulb"].data
    # Intensity is flux over all directions, 4π; a sun's irradiance is its own.
    np.testing.assert_allclose(
        np.array(point.color) * point.energy / (4 * math.pi), expected["bulb"], rtol=FLOAT32
    )
    sun = objects["sun"].data
    np.testing.assert_allclose(np.array(sun.color) * sun.energy, expected["sun"], rtol=FLOAT32)
    sockets = objects["panel"].material_slots[0].material.node_tree.nodes[0].inputs
    color, strength = sockets["Color"].default_value, sockets["Strength"].default_value
    np.testing.assert_allclose(np.array(color[:3]) * strength, expected["panel"], rtol=FLOAT32)


def test_light_groups_go_to_nuke_and_blender(answer_folder: Path, tmp_path: Path) -> None:
    arguments = ("grouped/lighting.json", "--to", "nuke", "--to", "csv,blender")
    succeed(answer_folder, "export", *arguments, "--lights", "groups.exr", "-o", tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["fixtures.csv", "relit.nk", "set_lights.py"]
    assert (tmp_path / "relit.nk").read_text().startswith("version 12.0")


def test_a_layer_of_usd_relights_a_stage(answer_folder: Path, tmp_path: Path) -> None:
    pxr = pytest.importorskip("pxr.Usd", reason="usd-core")
    from pxr import UsdLux

    stage = pxr.Stage.CreateNew(str(tmp_path / "hall.usda"))
    UsdLux.RectLight.Define(stage, "/hall/panel")
    UsdLux.SphereLight.Define(stage, "/hall/bulb")
    stage.Save()
    arguments = ("look/lighting.json", "--to", "usd", "--scene", "room.xml")
    completed = run(
        answer_folder,
        "export",
        *arguments,
        "--stage",
        tmp_path / "hall.usda",
        "-o",
        tmp_path / "out",
    )
    assert completed.returncode == 0, completed.stderr
    assert "hall.usda has no single light for sun: set it by hand" in completed.stderr
    expected = exported_values(answer_folder)
    relit = pxr.Stage.Open(str(tmp_path / "out" / "lights.usda"))
    for name, factor in (("panel", 1.0), ("bulb", 4.0)):
        light = UsdLux.LightAPI(relit.GetPrimAtPath(f"/hall/{name}"))
        radiance = light.GetIntensityAttr().Get() * np.array(light.GetColorAttr().Get())
        np.testing.assert_allclose(radiance / factor, expected[name], rtol=FLOAT32)
    assert "--stage belongs to the form usd" in run_refused(
        answer_folder, "export", *arguments[:1], "--to", "csv", "--stage", "hall.usda"
    )
    (tmp_path / "torn.usda").write_text("#usda 1.0\n(", encoding="utf-8")
    for name, message in (("gone.usda", "no such stage"), ("torn.usda", "is not a USD stage")):
        line = run_refused(
            answer_folder, "export", *arguments, "--stage", tmp_path / name, "-o", "none"
        )
        assert message in line


def test_what_it_lacks_is_one_line(answer_folder: Path) -> None:
    lighting = "look/lighting.json"
    mistakes = {
        (lighting, "--to", "maya"): "no form 'maya': known are csv, json, mitsuba, usd",
        (lighting, "--to", "mitsuba"): "mitsuba needs the scene: give it with --scene",
        (lighting, "--to", "nuke"): "give --scene for the lights, or --lights for multipliers",
        (lighting, "--to", "mitsuba", "--lights", "groups.exr"): "leave --lights out",
        (lighting, "--to", "nuke", "--lights", "groups.exr"): "different lights",
        ("room.xml", "--to", "csv"): "is not a JSON file",
        ("gone.json", "--to", "csv"): "no such lighting file",
    }
    for arguments, message in mistakes.items():
        assert message in run_refused(answer_folder, "export", *arguments, "-o", "none")
    (answer_folder / "kept").mkdir()
    (answer_folder / "kept" / "fixtures.csv").write_text("mine", encoding="utf-8")
    assert "exists: name another" in run_refused(
        answer_folder, "export", lighting, "--to", "csv", "-o", "kept"
    )
    assert (
        run(answer_folder, "export", lighting, "--to", "csv", "-o", "kept", "--force").returncode
        == 0
    )
