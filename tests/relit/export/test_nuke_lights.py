"""The lights of an answer as nodes of Nuke, read back as Nuke reads them."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run
from exported_files import export
from hypothesis import example, given
from hypothesis import strategies as st
from renderer import LIGHTS, SCREEN, write_room

import lightpaint as lp
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.pipeline.result_folder import with_places
from lightpaint.relit.export.nuke import STRAIGHT, rotate_of
from lightpaint.relit.exported_answer import Source
from lightpaint.relit.formats import names_of_forms
from lightpaint.relit.relit_scene import scene_of
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: Numbers are written with nine digits.
DIGITS = 1e-8

TURNED = lp.Pose(position=(0.5, 1.7, 1.0), target=(-0.6, 0, -0.3), cutoff=20, beam=12)
NEW = NewEmitter("key", "spot", lp.Pose(position=(-0.7, 1.6, 1), target=(-0.7, 0, 1), cutoff=25))


def nodes_in(script: str) -> list[dict[str, str]]:
    """Return the knobs of each node, with its class as `class`, as Tcl's parser takes them."""
    version, _, rest = script.partition("\n")
    assert version == "version 12.0 v1"
    nodes = []
    # A node is a class, and a list in braces; a backslash hides the character after it.
    pattern = r"(\w+) (\{(?:[^{}\\]|\\.|\{[^{}\\]*\})*\})\n"
    assert re.fullmatch(f"(?:{pattern})*", rest)
    for kind, body in re.findall(pattern, rest):
        words = re.findall(r'"(?:[^"\\]|\\.)*"|\{[^{}]*\}|[^\s{}"]+', body[1:-1])
        knobs = dict(zip(words[::2], words[1::2], strict=True))
        nodes.append({"class": kind, **{name: _value(word) for name, word in knobs.items()}})
    return nodes


def _value(word: str) -> str:
    if word[0] == "{":
        return word[1:-1]
    if word[0] != '"':
        return word
    return re.sub(r"\\(.)", lambda x: "\n" if x[1] == "n" else x[1], word[1:-1])


def vector(knob: str) -> Any:
    return np.array([float(x) for x in knob.split()])


def turned_by(rotate: Any) -> Any:
    """Return the matrix of `rotate` in the order ZXY: about z first, then x, then y."""
    x, y, z = np.radians(rotate)
    about_x = [[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]]
    about_y = [[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]]
    about_z = [[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]]
    return np.array(about_y) @ np.array(about_x) @ np.array(about_z)


def rig_of(scene: Scene, lighting: lp.Lighting, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Return the Light2 nodes by name, and what was said. Check the rest of the script."""
    remarks = export(lighting, Source(scene=scene), folder, "nuke", "lights.nk")
    note, *lights, gathered = nodes_in((folder / "lights.nk").read_text(encoding="utf-8"))
    assert note["class"] == "StickyNote"
    assert (gathered["class"], gathered["inputs"]) == ("Scene", str(len(lights)))
    assert {x["class"] for x in lights} <= {"Light2"}
    assert {x["inputs"] for x in lights} <= {"0"}
    names = [x["name"] for x in (note, *lights, gathered)]
    assert len({*names}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) for name in names)
    return {x["name"]: x for x in lights} | {"note": note}, remarks


def answer_of(scene: Scene) -> lp.Lighting:
    """The current lighting, with the places of the scene."""
    basis = lp.render_basis(scene, spp=2)
    return with_places(lp.Lighting.current(basis), scene)


@pytest.mark.parametrize("up", ["y", "z"])
def test_every_light_hangs_and_shines_as_in_the_answer(tmp_path: Path, up: str) -> None:
    room = load_scene(write_room(tmp_path))
    moved_room = room.moved({"beam": TURNED}).with_new_emitters([NEW])
    lighting = answer_of(moved_room)
    rotation = np.eye(3)
    if up == "z":
        lighting = replace(lighting, up=(0, 0, 1))
        rotation = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    lights, remarks = rig_of(room, lighting, tmp_path)
    emitters = {x.name: x for x in scene_of(room, lighting).emitters}
    assert {*lights} == {"panel", "bulb", "beam", "sun", "key", "note"}
    for name in ("panel", "bulb", "beam", "sun", "key"):
        light, site = lights[name], emitters[name].site
        if site.position is None:
            assert "translate" not in light
        else:
            expected = rotation @ site.position
            np.testing.assert_allclose(vector(light["translate"]), expected, atol=DIGITS)
        if site.direction is None:
            assert "rotate" not in light
        else:
            assert light["rot_order"] == "ZXY"
            way = turned_by(vector(light["rotate"])) @ [0, 0, -1]
            np.testing.assert_allclose(way, rotation @ site.direction, atol=1e-5)
        assert light.get("falloff_type") == (None if name == "sun" else "Quadratic")
    types = {name: lights[name]["light_type"] for name in emitters if name != "sky"}
    assert types == {
        **{"panel": "spot", "bulb": "point", "beam": "spot", "sun": "directional", "key": "spot"}
    }
    # The cone from edge to edge, and the part of it that lies within the penumbra.
    for name, cutoff, beam in (("beam", 20, 12), ("key", 25, 18.75)):
        outer, penumbra = (float(lights[name][f"cone_{x}"]) for x in ("angle", "penumbra_angle"))
        assert outer / 2 == pytest.approx(cutoff, rel=1e-6)
        assert (outer + penumbra) / 2 == pytest.approx(beam, rel=1e-6)
    assert lights["panel"]["cone_angle"] == "180"
    assert lights["note"]["label"].startswith("lightpaint: the lights of room.xml as solved for")
    assert lights["note"]["label"].endswith("\nSet by hand: sky")
    assert remarks == ["Nuke has no light like sky: set it by hand"]
    assert "moved by lightpaint" in lights["beam"]["label"]
    assert "new spot, added by lightpaint" in lights["key"]["label"]
    assert "lightpaint" not in lights["bulb"]["label"]


def test_a_white_card_is_as_bright_as_a_white_wall(tmp_path: Path) -> None:
    """Nuke's diffuse radiance is color · intensity · cos / d²; Mitsuba's is that of E / π."""
    room = load_scene(write_room(tmp_path))
    lighting = answer_of(room)
    lights, _ = rig_of(room, lighting, tmp_path)
    distance = 3.0
    area = 0.6 * 0.6
    irradiance = {
        "bulb": np.array([0.5, 0.6, 0.7]) / distance**2,
        "beam": np.array([3, 3, 3]) / distance**2,
        "panel": area * np.array([4, 3, 2]) / distance**2,
        "sun": np.array([1, 0.9, 0.8]),
    }
    for name, expected in irradiance.items():
        light = lights[name]
        assert vector(light["color"]).max() == 1
        falloff = 1 if name == "sun" else distance**2
        card = vector(light["color"]) * float(light["intensity"]) / falloff
        # Emissions are read from float32.
        np.testing.assert_allclose(card, expected / math.pi, rtol=1e-6)
    kelvin = lighting.photometry(next(x for x in lighting.lights if x.name == "sun")).kelvin
    assert lights["sun"]["label"] == f"{kelvin:.0f} K"


@given(st.tuples(*[st.floats(-1, 1, allow_subnormal=False)] * 3))
@example((0.0, 1.0, 0.0))
@example((0.0, -1.0, 0.0))
@example((-0.0, 1.0, -0.0))
@example((0.0, 0.0, 1.0))
@example((1e-9, -1.0, 0.0))
def test_any_direction_has_a_rotation(direction: tuple[float, float, float]) -> None:
    length = np.linalg.norm(direction)
    if length < 1e-6:
        return
    x, y, z = np.array(direction) / length
    rotate = rotate_of((x, y, z))
    assert rotate[2] == 0
    np.testing.assert_allclose(turned_by(rotate) @ [0, 0, -1], (x, y, z), atol=STRAIGHT)


def test_straight_down_keeps_the_usual_roll() -> None:
    assert rotate_of((0.0, -1.0, 0.0)) == (-90, 0, 0)
    assert rotate_of((-0.0, 1.0, -0.0)) == (90, 0, 0)
    assert rotate_of((0.0, -1.0, 4e-8))[1] == 0


NAMES = ("grün", "7 [exit]", "灯", "a.b", "a b", "root", 'say "home" {', "Scene")


def test_odd_names_stay_readable_and_nuke_evaluates_none(tmp_path: Path) -> None:
    bulb = LIGHTS["bulb"]
    texts = []
    for k, name in enumerate(NAMES):
        escaped = name.replace('"', "&quot;")
        texts.append(bulb.replace('id="bulb"', f'id="{escaped}"').replace("-0.5", f"{k / 10}"))
    room = load_scene(write_room(tmp_path, lights="".join(texts)))
    lights, remarks = rig_of(room, answer_of(room), tmp_path)
    assert remarks == []
    by_place = {round(10 * vector(x["translate"])[0]): x for k, x in lights.items() if k != "note"}
    assert len(by_place) == len(NAMES)
    first_rows = [by_place[k]["label"].split("\n")[0] for k in range(len(NAMES))]
    assert first_rows[:5] == ["grün", "7 _exit_", "灯", "a.b", "a b"]
    assert first_rows[6] == "say _home_ _"
    # Brackets, dollars and backslashes would be substituted.
    script = (tmp_path / "lights.nk").read_text(encoding="utf-8")
    assert not re.search(r"[\[\]$]", script)
    assert by_place[5]["name"] == "root_"
    assert {by_place[3]["name"], by_place[4]["name"]} == {"a_b", "a_b_"}


def test_what_has_no_node_is_named_and_what_is_off_is_black(tmp_path: Path) -> None:
    ball = LIGHTS["panel"].replace('"rectangle"', '"sphere"').replace('"panel"', '"lampion"')
    room = load_scene(write_room(tmp_path, lights=ball + SCREEN + LIGHTS["bulb"] + LIGHTS["sky"]))
    lighting = answer_of(room).with_emission("bulb", (0, 0, 0))
    lights, remarks = rig_of(room, lighting, tmp_path)
    assert {*lights} == {"bulb", "note"}
    assert lights["bulb"]["intensity"] == "0"
    for name in ("lampion", "screen", "sky"):
        assert name in lights["note"]["label"]
        assert name in remarks[0]


def test_a_fixed_light_belongs_to_the_rig(tmp_path: Path) -> None:
    room = load_scene(write_room(tmp_path))
    members = {x.name: [x.name] for x in room.emitters}
    basis = lp.render_basis(room.with_lights(members, ["sun"]), spp=2)
    lights, _ = rig_of(room, with_places(lp.Lighting.current(basis), room), tmp_path)
    np.testing.assert_allclose(
        vector(lights["sun"]["color"]) * float(lights["sun"]["intensity"]) * math.pi,
        [1, 0.9, 0.8],
        rtol=1e-6,
    )


def test_a_scene_and_light_groups_have_files_of_their_own() -> None:
    with pytest.raises(lp.LightpaintError, match="nuke needs the scene or the light groups"):
        names_of_forms(["nuke"], Source())


def test_the_command_writes_the_lights(tmp_path: Path) -> None:
    write_room(tmp_path)
    write_lighting(tmp_path / "lighting.json", answer_of(load_scene(tmp_path / "room.xml")))
    arguments = ("export", "lighting.json", "--to", "nuke", "--scene", "room.xml", "-o", "out")
    completed = run(tmp_path, *arguments)
    assert completed.returncode == 0, completed.stderr
    assert "Nuke has no light like sky: set it by hand" in completed.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["lights.nk"]
    assert len(nodes_in((tmp_path / "out" / "lights.nk").read_text(encoding="utf-8"))) == 6
