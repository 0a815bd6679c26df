"""A rig as a scene: Mitsuba sees the lights where they hang, and as bright as they are."""

import json
import math
import struct
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command import succeed
from rig_files import (
    EXAMPLE,
    UPRIGHT,
    channel,
    fixture,
    gdtf,
    layered,
    unzipped,
    write_mvr,
    zipped,
)

from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.colour.luminous_flux import spot_flux
from lightpaint.colour.spectrum import read_spectrum
from lightpaint.dmx import rig_scene
from lightpaint.dmx.mvr import PlacedModel, read_rig, read_show
from lightpaint.dmx.rig_scene import (
    STARTING_SHARE,
    Room,
    cd_per_unit,
    lights_of,
    lights_text,
    room_of_scene,
    room_of_show,
    scene_text,
)
from lightpaint.errors import SceneError
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.scene.scene_reader import load_scene

ROOM = EXAMPLE.with_name("room.xml")


def test_mitsuba_sees_each_light_where_it_hangs_and_points(tmp_path: Path) -> None:
    rig = read_rig(EXAMPLE)
    unit = cd_per_unit(rig)
    path = tmp_path / "rig.xml"
    path.write_text(scene_text(rig, unit, Room()), encoding="utf-8")
    scene = load_scene(path, use_lights_file=False)
    assert scene.up == (0.0, 0.0, 1.0)
    assert [x.name for x in scene.emitters] == [x.name for x in lights_of(rig)]
    for emitter, light in zip(scene.emitters, lights_of(rig), strict=True):
        site = emitter.site
        assert site.position is not None
        assert site.direction is not None
        # Written to a micrometre.
        assert np.allclose(site.position, light.position, atol=1e-5)
        assert np.allclose(site.direction, light.direction, atol=1e-5)
        full = sum(x.candela for x in light.emitters)
        assert math.isclose(emitter.emission[0] * unit, STARTING_SHARE * full, rel_tol=1e-5)
        assert site.cutoff is not None
        assert site.beam is not None
        lumens = full * spot_flux(math.radians(site.cutoff), math.radians(site.beam))
        # The PARs have 7000 lm; the intensities of the washes were rounded.
        expected = 7000 if light.name.startswith("1") else 16000
        assert math.isclose(lumens, expected, rel_tol=1e-5 if expected == 7000 else 0.25)


def test_a_room_keeps_its_sensor_and_is_found_from_the_scene(tmp_path: Path) -> None:
    rig = read_rig(EXAMPLE)
    room = room_of_scene(ROOM, tmp_path)
    assert (room.has_sensor, room.has_integrator) == (True, True)
    (tmp_path / "rig.xml").write_text(scene_text(rig, 500, room), encoding="utf-8")
    scene = load_scene(tmp_path / "rig.xml", use_lights_file=False)
    assert len(scene.emitters) == 6
    assert "through seats" in repr(scene)


def test_a_room_without_a_sensor_gets_one(tmp_path: Path) -> None:
    room = tmp_path / "room.xml"
    room.write_text('<scene version="3.0.0"><shape type="sphere"/></scene>', encoding="utf-8")
    found = room_of_scene(room, tmp_path)
    assert (found.has_sensor, found.has_integrator) == (False, False)
    text = scene_text(read_rig(EXAMPLE), 500, found)
    assert text.count("<sensor") == text.count("<integrator") == 1


ROOM_TEXT = """<?xml version="1.0"?><!-- a <room> --><scene version="3.0.0">
<shape type="sphere"><bsdf type="diffuse"/></shape><sensor type="perspective"/></scene>"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_a_room_is_read_in_every_encoding_that_mitsuba_reads(tmp_path: Path, encoding: str) -> None:
    room = tmp_path / "room.xml"
    room.write_text(ROOM_TEXT, encoding=encoding)
    found = room_of_scene(room, tmp_path)
    assert (found.has_sensor, found.has_integrator) == (True, False)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</shape>", "", "line 2: </scene> ends nothing"),
        ("</scene>", "", "it ends before </scene>"),
        (ROOM_TEXT, "no such thing", "expected one <scene"),
        (' version="3.0.0"', "", "expected one <scene"),
        ("</scene>", "</scene><scene/>", "expected one <scene"),
        ("<shape", "<5 <shape", "line 2: cannot read '<5"),
    ],
)
def test_a_damaged_room_is_refused_by_its_name(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    room = tmp_path / "room.xml"
    room.write_text(ROOM_TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(SceneError, match=words) as raised:
        room_of_scene(room, tmp_path)
    assert str(raised.value).startswith(f"{room}, ")


def test_lights_alone_are_a_scene_to_include() -> None:
    text = scene_text(read_rig(EXAMPLE), 500, None)
    assert text.count("<emitter") == 6
    assert not any(x in text for x in ("<sensor", "<shape", "<integrator", "<include"))


def test_the_lights_file_has_all_emitters() -> None:
    rig = read_rig(EXAMPLE)
    data = tomllib.loads(lights_text(rig, 500))
    assert data["cd_per_unit"] == 500
    assert data["lights"] == [light.name for light in lights_of(rig)] == [*data["light"]]
    for light in lights_of(rig):
        listed = data["light"][light.name]["emitters"]
        for found, emitter in zip(listed, light.emitters, strict=True):
            assert found["name"] == emitter.name
            assert np.allclose(found["xy"], emitter.xy, rtol=1e-4)  # five digits
            assert math.isclose(found["cd"], emitter.candela, rel_tol=1e-5)
            assert (found["max"], found["watts"]) == (1, emitter.watts)
            assert found["bits"] == (8 if light.name.startswith("1") else 16)


#: A red of 630 nm as an instrument measures it, with noise below zero.
MEASURED = {600: -0.002, 610: 0.08, 620: 0.55, 630: 1.0, 640: 0.45, 650: 0.05, 660: -0.001}


def _show_of_measured_red(folder: Path, *, color: str = "") -> Path:
    points = "".join(
        f'<MeasurementPoint WaveLength="{nm}" Energy="{x}"/>' for nm, x in MEASURED.items()
    )
    measured = f'<Measurement Physical="100" LuminousIntensity="0">{points}</Measurement>'
    emitters = f'<Emitters><Emitter Name="Red"{color}>{measured}</Emitter></Emitters>'
    lamp = gdtf(channel("ColorAdd_R", "1"), described=emitters)
    fixtures = fixture("A"), fixture("B", number="2", address="2")
    return write_mvr(folder / "a.mvr", layered(*fixtures), lamp=lamp)


def test_measured_spectra_are_files_beside_the_lights_file(tmp_path: Path) -> None:
    succeed(tmp_path, "rig", _show_of_measured_red(tmp_path), "-o", "show.xml")
    # Two fixtures of one type share it.
    assert [x.name for x in tmp_path.glob("*.csv")] == ["show.Lamp.red.csv"]
    waves, powers = read_spectrum(tmp_path / "show.Lamp.red.csv")
    clipped = np.maximum([*MEASURED.values()], 0)
    expected = np.interp(waves, [*MEASURED], clipped, left=0, right=0)
    assert powers / powers.max() == pytest.approx(expected, abs=1e-5)
    scene = load_scene(tmp_path / "show.xml")
    lamps = lamps_by_name(constraints_of(scene.requests), basis_lights(scene))
    assert {x.name for x in scene.with_lamps(lamps).lights} >= {"1 A/red", "2 B/red"}


def test_a_spectrum_of_another_colour_than_the_files_does_not_count(tmp_path: Path) -> None:
    show = _show_of_measured_red(tmp_path, color=' Color="0.3,0.6,40"')
    [light, _] = lights_of(read_rig(show))
    assert light.emitters[0].spectrum is None
    assert light.emitters[0].xy == (0.3, 0.6)
    show = _show_of_measured_red(tmp_path, color=' Color="0.7,0.29,20"')
    assert lights_of(read_rig(show))[0].emitters[0].spectrum is not None


def test_names_with_marks_survive_both_files(tmp_path: Path) -> None:
    name = "Wäsche &amp; #1 'x'"
    show = write_mvr(tmp_path / "a.mvr", layered(fixture(name)))
    rig = read_rig(show)
    [light] = lights_of(rig)
    assert light.name == "1 Wäsche & #1 'x'"
    assert [*tomllib.loads(lights_text(rig, 1))["light"]] == [light.name]
    (tmp_path / "a.xml").write_text(scene_text(rig, 1, Room()), encoding="utf-8")
    assert load_scene(tmp_path / "a.xml", use_lights_file=False).emitters[0].name == light.name


def test_models_of_other_formats_are_named(tmp_path: Path) -> None:
    models = [PlacedModel(x, np.eye(4)) for x in ("a.3ds", "b.3ds", "c.obj")]
    show = write_mvr(tmp_path / "a.mvr", layered(fixture()))
    found = room_of_show(show, models)
    assert found.files == {}
    assert found.remarks == (
        "2 models in .3ds left out: give a scene as the room, or export .glb",
        "1 model in .obj left out: give a scene as the room, or export .glb",
    )


def test_without_trimesh_models_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rig_scene, "_trimesh", lambda: None)
    show = write_mvr(tmp_path / "a.mvr", layered(fixture()))
    [remark] = room_of_show(show, [PlacedModel("a.glb", np.eye(4))]).remarks
    assert "pip install trimesh" in remark


def _glb() -> bytes:
    """One triangle in glTF's axes, y up, in metres."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], "<f4").tobytes()
    view = {"buffer": 0, "byteOffset": 0, "byteLength": len(points)}
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    accessor |= {"min": [0, 0, 0], "max": [1, 2, 0]}  # type: ignore[dict-item]
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(points)}],
        "bufferViews": [view],
        "accessors": [accessor],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(points)
    head = struct.pack("<4sIII4s", b"glTF", 2, size, len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(points), b"BIN\0") + points


def test_models_in_gltf_become_meshes_in_their_places_with_z_up(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    box = (
        f'<SceneObject name="s"><Matrix>{UPRIGHT}{{0,0,1000}}</Matrix><Geometries>'
        '<Geometry3D fileName="box.glb"/></Geometries></SceneObject>'
    )
    path = write_mvr(tmp_path / "a.mvr", layered(fixture(), box))
    files = unzipped(path.read_bytes())
    path.write_bytes(zipped({**files, "box.glb": _glb()}))
    found = room_of_show(path, read_show(path).models)
    assert found.remarks == ()
    [data] = found.files.values()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    points = np.frombuffer(data[start : start + 36], "<f4").reshape(3, 3)
    assert np.allclose(sorted(points.tolist()), [(0, 0, 1), (0, 0, 3), (1, 0, 1)])
