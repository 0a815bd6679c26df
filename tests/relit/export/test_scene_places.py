"""Places in set_scene.py, whose lamps shine along their -z and whose z is up."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import in_blender
from exported_places import DOWN, OLD, PLACES, RGB, WAY, z_up
from fake_blender import FakeMatrix, fake_blender, run_in

from lightpaint.relit.export.exports import scene_script
from lightpaint.scene.properties.site import EmitterPlace

#: Blender's matrices and cones are float32.
FLOAT32 = 1e-5

STAYED = (EmitterPlace("spot", OLD.position, DOWN, 30.0, 20.0), PLACES[1])
CONE = (math.radians(60), 0.25)


def script(places: Any, up: Any = (0.0, 1.0, 0.0)) -> str:
    emitters = [(place.name, "radiance" if place.size else "intensity", RGB) for place in places]
    return scene_script("evening", "hall.xml", emitters, places=places, up=up)


def lamps(scale: float = 1.0) -> dict[str, tuple[str, list[list[float]]]]:
    """Type and matrix of the lamps in the file: they shine down, and are scaled and rolled."""
    lamp_settings = {}
    for name, kind, point in (
        ("spot", "SPOT", OLD.position),
        ("bulb", "POINT", PLACES[1].position),
        ("sun", "SUN", (8.0, 9.0, 9.0)),
    ):
        matrix = np.eye(4)
        matrix[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
        matrix[:3, :3] *= 2
        matrix[:3, 3] = scale * z_up(point)
        lamp_settings[name] = (kind, matrix.tolist())
    return lamp_settings


def fake_with(patch: Any, arguments: Any) -> Any:
    """A fake Blender with these lamps."""
    modules = fake_blender()
    objects = modules[0].data.objects
    for name, (kind, matrix) in arguments.items():
        data = modules[0].data.lights.new(name, kind)
        data.spot_size, data.spot_blend = CONE
        objects.new(name, data).matrix_world = FakeMatrix(matrix)
    return modules


def hung_in(modules: Any) -> dict[str, Any]:
    """The same as blender_hung.py prints."""
    transforms = {}
    for item in modules[0].data.objects.values():
        data = item.data
        cone = [data.spot_size, data.spot_blend] if data.type == "SPOT" else None
        size = [data.size, data.size_y] if data.type == "AREA" else None
        matrix = list(item.matrix_world)
        transforms[item.name] = {"type": data.type, "matrix": matrix, "cone": cone, "size": size}
    return transforms


def assert_hangs(lamp: Any, position: Any, direction: Any) -> None:
    matrix = np.array(lamp["matrix"])
    np.testing.assert_allclose(matrix[:3, 3], z_up(position), atol=FLOAT32)
    if direction is not None:
        way = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        np.testing.assert_allclose(way, z_up(direction), atol=FLOAT32)
    assert np.linalg.det(matrix[:3, :3]) > 0


def assert_cone(lamp: Any, cutoff: float, beam: float) -> None:
    """Blender's spot is dark from half its size on, and full where the cosine is so much nearer."""
    size, blend = lamp["cone"]
    assert size == pytest.approx(2 * math.radians(cutoff), abs=FLOAT32)
    edge = math.cos(size / 2)
    inner = math.degrees(math.acos(edge + blend * (1 - edge)))
    assert inner == pytest.approx(beam, abs=math.degrees(FLOAT32) * 10)


def assert_all_hung(before: Any, first: Any, second: Any, third: Any) -> None:
    """Fail unless the lamps of a file hang where the script puts them.

    before, first, second, again: lamps before the script, after it, after a second run of it, and
    after the script of another answer.
    """
    assert_hangs(first["spot"], PLACES[0].position, WAY)
    assert_cone(first["spot"], 40, 10)
    scale = np.linalg.norm(np.array(first["spot"]["matrix"])[:3, :3], axis=0)
    np.testing.assert_allclose(scale, 2, atol=FLOAT32)
    assert_hangs(first["sun"], (8.0, 9.0, 9.0), WAY)
    np.testing.assert_allclose(first["bulb"]["matrix"], before["bulb"]["matrix"], atol=FLOAT32)
    for place, kind in zip(PLACES[3:], ("SPOT", "POINT", "AREA"), strict=True):
        assert first[place.name]["type"] == kind
        assert_hangs(first[place.name], place.position, place.direction)
    assert_cone(first["key"], 25, 5)
    assert first["window light"]["size"] == [2.0, 0.5]
    height = np.array(first["window light"]["matrix"])[:3, 1]
    assert height @ z_up(WAY) == pytest.approx(0, abs=FLOAT32)
    for name, lamp in first.items():
        np.testing.assert_allclose(second[name]["matrix"], lamp["matrix"], atol=FLOAT32)
    assert set(first) == set(second)
    # Another answer in which nothing moved: all is as it was.
    assert set(third) == set(before)
    for name, lamp in before.items():
        np.testing.assert_allclose(third[name]["matrix"], lamp["matrix"], atol=FLOAT32)
    assert third["spot"]["cone"] == pytest.approx(before["spot"]["cone"], abs=FLOAT32)


@pytest.mark.nightly
def test_lamps_in_blender_hang_as_in_the_answer(tmp_path: Path, blender: list[str]) -> None:
    (tmp_path / "set_scene.py").write_text(script(PLACES), encoding="utf-8")
    (tmp_path / "again.py").write_text(script(STAYED), encoding="utf-8")
    rig = np.eye(4)
    rig[:3, :3] = [[0, -2, 0], [2, 0, 0], [0, 0, 2]]
    rig[:3, 3] = 5, 6, 7
    inputs = {"rig": rig.tolist(), "lamps": lamps(), "cone": CONE}
    (tmp_path / "lamps.json").write_text(json.dumps(inputs), encoding="utf-8")
    output = in_blender(blender, Path(__file__).parent / "blender_hung.py", tmp_path)
    snapshots = json.loads(next(x for x in output.splitlines() if x.startswith("SEEN"))[5:])
    assert_all_hung(*snapshots)


def test_lamps_hang_as_in_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    modules = fake_with(monkeypatch, lamps())
    snapshots = [hung_in(modules)]
    for text in (script(PLACES), script(PLACES), script(STAYED)):
        run_in(modules, text, monkeypatch)
        snapshots.append(hung_in(modules))
    assert_all_hung(*snapshots)


def test_new_lamps_have_the_watts_of_their_light(monkeypatch: pytest.MonkeyPatch) -> None:
    modules = fake_with(monkeypatch, lamps())
    run_in(modules, script(PLACES), monkeypatch)
    objects = modules[0].data.objects
    # Intensity over all directions; radiance over a half space, π, and 2 by .5.
    for name, factor in (("key", 4 * math.pi), ("fill", 4 * math.pi), ("window light", math.pi)):
        data = objects[name].data
        np.testing.assert_allclose(np.array(data.color) * data.energy, factor * np.array(RGB))


def test_lamps_that_hang_elsewhere_than_in_the_scene_stay(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file in centimetres: neither the lamps nor what they are moved by fit."""
    modules = fake_with(monkeypatch, lamps(scale=100))
    before = hung_in(modules)
    run_in(modules, script(PLACES), monkeypatch)
    after = hung_in(modules)
    assert after == before
    output = capsys.readouterr().out
    for name in ("spot", "sun", "key", "fill", "window light"):
        assert f"{name!r} is not a lamp, or not where the scene has it" in output


@pytest.mark.parametrize(("version", "is_told"), [((4, 1, 1), True), ((4, 2, 0), False)])
def test_an_old_blender_is_told_of(
    version: tuple[int, ...],
    is_told: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    modules = fake_with(monkeypatch, lamps())
    modules[0].app.version = version
    run_in(modules, script(PLACES), monkeypatch)
    assert ("use 4.2 or newer" in capsys.readouterr().out) == is_told


def test_lamps_tell_the_axes_where_no_camera_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera that looks straight down has -z upwards in a scene whose y is up."""
    modules = fake_with(monkeypatch, lamps())
    run_in(modules, script(PLACES, up=(0.0, 0.0, -1.0)), monkeypatch)
    assert_hangs(hung_in(modules)["spot"], PLACES[0].position, WAY)


def test_half_a_turn_is_a_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    upwards = EmitterPlace("spot", OLD.position, (0.0, 1.0, 0.0), 30.0, 20.0, moved_from=OLD)
    modules = fake_with(monkeypatch, lamps())
    run_in(modules, script([upwards]), monkeypatch)
    spot = hung_in(modules)["spot"]
    assert_hangs(spot, OLD.position, (0.0, 1.0, 0.0))
    assert spot["cone"] == list(CONE)


def test_lamps_get_their_drives_as_custom_properties(monkeypatch: pytest.MonkeyPatch) -> None:
    drives = {"spot": {"red": 0.25, "white": 1.0}, "gone": {"red": 1.0}}
    text = scene_script("evening", "hall.xml", [("spot", "intensity", RGB)], drives=drives)
    modules = fake_with(monkeypatch, lamps())
    run_in(modules, text, monkeypatch)
    found = {x.name: x.data.get("lightpaint_drives") for x in modules[0].data.objects.values()}
    assert found == {"spot": {"red": 0.25, "white": 1.0}, "bulb": None, "sun": None}
