"""Loading scenes: which lights there are, what they are called, and what is refused."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from lit_planes import lit_scene
from renderer import CORNELL, LIGHTS, mitsuba_render, write_room

from lightpaint.errors import BackendError, SceneError
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene


def test_lights_in_document_order_with_what_they_emit(small_room: Scene) -> None:
    assert [light.name for light in small_room.lights] == list(LIGHTS)
    assert [light.plugin for light in small_room.lights] == [
        "area",
        "point",
        "spot",
        "directional",
        "constant",
    ]
    emissions = [light.emission for light in small_room.lights]
    expected = [(4, 3, 2), (0.5, 0.6, 0.7), (3, 3, 3), (1, 0.9, 0.8), (0.1, 0.2, 0.3)]
    np.testing.assert_allclose(emissions, expected, rtol=1e-6)  # float32
    assert small_room.size == (20, 24)
    assert small_room.spp == 16


def test_names_come_from_emitter_else_shape_else_plugin_and_number(tmp_path: Path) -> None:
    lights = """
        <emitter type="point"/>
        <shape type="sphere" id="globe"><emitter type="area"/></shape>
        <emitter type="point"/>
        <shape type="sphere"><emitter type="area" id="lantern"/></shape>
        <shape type="cube"><emitter type="area"/></shape>
        <shape type="sphere" id="point_1"><emitter type="area"/></shape>"""
    path = write_room(tmp_path, lights=lights)
    names = [light.name for light in load_scene(path).lights]
    assert names == ["point_0", "globe", "point_1", "lantern", "area_2", "point_1_2"]
    assert [light.name for light in load_scene(path).lights] == names


def test_names_of_mitsubas_own_writer_are_used_where_there_is_no_id(tmp_path: Path) -> None:
    lights = """
        <emitter type="point" name="over the table"/>
        <emitter type="point" id="own" name="other"/>
        <shape type="sphere" name="paper lantern"><emitter type="area" name="emitter"/></shape>
        <shape type="sphere"><emitter type="area" name="glow"/></shape>
        <shape type="sphere"><emitter type="area" name="emitter"/></shape>
        <shape type="sphere" id="globe" name="sphere"><emitter type="area" name="glow"/></shape>"""
    scene = load_scene(write_room(tmp_path, lights=lights))
    names = ["over the table", "own", "paper lantern", "glow", "area_2", "globe"]
    assert [light.name for light in scene.lights] == names
    assert [x.has_name for x in scene.emitters] == [True, True, True, True, False, True]


def test_a_scene_in_memory_is_refused_with_what_to_do(tmp_path: Path) -> None:
    variant = use_variant().variant
    import mitsuba as mi

    scene = {
        "type": "scene",
        "sensor": {"type": "perspective"},
        "over the table": {"type": "point"},
        "paper lantern": {"type": "sphere", "emitter": {"type": "area"}},
    }
    with pytest.raises(SceneError, match="not a dict: write it with ") as refusal:
        load_scene(scene)  # type: ignore[arg-type]
    written = tmp_path / "scene.xml"
    advice = str(refusal.value).partition("write it with ")[2].partition(", and load")[0]
    assert advice.startswith("mi.parser.write_file(mi.parser.parse_dict(")
    config = mi.parser.ParserConfig(variant)
    mi.parser.write_file(mi.parser.parse_dict(config, scene), str(written))
    assert [x.name for x in load_scene(written).lights] == ["over the table", "paper lantern"]
    with pytest.raises(SceneError, match="not a Scene: give the file"):
        load_scene(mi.load_dict(scene))  # type: ignore[arg-type]


def test_a_pattern_splits_all_lights_of_such_names_that_can_be(tmp_path: Path) -> None:
    panes = "".join(
        LIGHTS["panel"].replace('id="panel"', f'id="{name}"') for name in ("w_1", "w_2", "w_3")
    )
    path = write_room(tmp_path, lights=panes + LIGHTS["bulb"].replace('"bulb"', '"w_4"'))
    scene = load_scene(path, split={"w_*": "2x2", "w_3": (3, 2)}, symmetric=["w_[12]"])
    assert scene.split == {"w_1": (2, 2), "w_2": (2, 2), "w_3": (3, 2)}
    assert scene.symmetric == {"w_1", "w_2"}
    assert len(scene.lights) == 2 + 2 + 6 + 1
    with pytest.raises(SceneError, match=r"no light 'x\*' to split into texels; it has w_1, w_2"):
        load_scene(path, split={"x*": "2x2"})
    with pytest.raises(SceneError, match=r"symmetric: 'x\*' is not split"):
        load_scene(path, split={"w_*": "2x2"}, symmetric=["x*"])
    path.with_suffix(".lights.toml").write_text("[light.'w_[23]']\nsplit = [2, 2]\n")
    assert load_scene(path).split == {"w_2": (2, 2), "w_3": (2, 2)}


def test_emission_is_read_from_the_loaded_light_not_from_its_text(tmp_path: Path) -> None:
    lights = """
        <emitter type="point" id="grey"><spectrum name="intensity" value="3"/></emitter>
        <emitter type="point" id="silent"/>"""
    scene = load_scene(write_room(tmp_path, lights=lights))
    np.testing.assert_allclose(scene.light("silent").emission, [1, 1, 1], rtol=1e-6)
    # What was read, set as a colour, is the picture that Mitsuba makes of the scene itself.
    read = {light.name: light.emission for light in scene.lights}
    render = mitsuba_render(scene, read, seed=1, spp=4)
    np.testing.assert_allclose(render, mitsuba_render(scene, seed=1, spp=4), rtol=1e-5, atol=1e-6)


def test_parameters_and_includes(tmp_path: Path) -> None:
    (tmp_path / "more.xml").write_text(
        f'<scene version="3.0.0">{LIGHTS["bulb"]}</scene>', encoding="utf-8"
    )
    path = write_room(tmp_path, lights='<include filename="more.xml"/>' + LIGHTS["sky"])
    scene = load_scene(path, parameters={"width": 10})
    assert scene.size == (20, 10)
    assert {light.name for light in scene.lights} == {"bulb", "sky"}
    assert scene.light("bulb").members[0].file == 1


def test_a_scene_that_was_prepared_before_it_was_written_is_whole(tmp_path: Path) -> None:
    """Mitsuba's writer puts all of it into a shape that merges meshes."""
    import mitsuba as mi

    original = load_scene(write_room(tmp_path))
    config = mi.parser.ParserConfig(use_variant().variant)
    state = mi.parser.parse_file(config, str(tmp_path / "room.xml"))
    mi.parser.transform_all(config, state)
    mi.parser.write_file(state, str(tmp_path / "written.xml"))
    assert 'type="merge"' in (tmp_path / "written.xml").read_text("utf-8")
    written = load_scene(tmp_path / "written.xml")
    assert written.size == original.size
    emissions = [np.array([x.emission for x in scene.lights]) for scene in (original, written)]
    np.testing.assert_allclose(*emissions, rtol=1e-6)
    images = [mitsuba_render(scene, seed=1, spp=16) for scene in (original, written)]
    np.testing.assert_allclose(*images, rtol=1e-3, atol=1e-4)


def test_identity_follows_files_that_only_the_parser_reads(tmp_path: Path) -> None:
    (tmp_path / "lamp.spd").write_text("400 1\n700 2\n", encoding="ascii")
    light = """<emitter type="point"><spectrum name="intensity" filename="lamp.spd"/></emitter>"""
    path = write_room(tmp_path, lights=light)
    first = load_scene(path).identity
    (tmp_path / "lamp.spd").write_text("400 1\n700 3\n", encoding="ascii")
    assert load_scene(path).identity != first


def test_a_sensor_in_a_shape_is_not_the_camera(tmp_path: Path) -> None:
    meter = """<shape type="rectangle"><sensor type="irradiancemeter"><film type="hdrfilm">
        <integer name="width" value="1"/><integer name="height" value="1"/></film></sensor>
        </shape>"""
    path = write_room(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('<sensor type="persp', meter + '<sensor type="persp'))
    scene = load_scene(path)
    assert scene.sensor_names == ("camera",)
    assert scene.size == (20, 24)
    assert mitsuba_render(scene, seed=0, spp=2).shape == (20, 24, 3)


def test_light_that_is_no_light_is_named(tmp_path: Path) -> None:
    light = '<emitter type="point" id="hole"><rgb name="intensity" value="1 -2 1"/></emitter>'
    with pytest.raises(SceneError, match="'hole' has a negative intensity"):
        load_scene(write_room(tmp_path, lights=light))
    with pytest.raises(SceneError, match=r"'hole' has the intensity .*: not finite"):
        load_scene(write_room(tmp_path, lights=light.replace("-2", "inf")))


@pytest.mark.nightly
def test_another_variant_afterwards_is_noticed(tmp_path: Path) -> None:
    code = (
        "import lightpaint as lp, sys; s = lp.load_scene(sys.argv[1])\n"
        "import mitsuba as mi; mi.set_variant('scalar_rgb')\n"
        "try: lp.load_scene(sys.argv[1])\n"
        "except lp.LightpaintError as error: print(error)"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, str(write_room(tmp_path))],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "mi.set_variant('scalar_rgb') was called" in answer.stdout


def test_found_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_scene(CORNELL).lights  # its meshes are found beside it


def test_identity_follows_content_and_not_dates(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    first = load_scene(path).identity
    path.touch()
    assert load_scene(path).identity == first
    assert load_scene(path, parameters={"spp": 3}).identity != first
    path.write_text(path.read_text(encoding="utf-8").replace("0.7 0.5 0.4", "0.7 0.5 0.5"))
    assert load_scene(path).identity != first


NO_SENSOR = f'<scene version="3.0.0">{LIGHTS["sky"]}</scene>'

SEEN = NO_SENSOR.replace("<emitter", '<sensor type="perspective"/><emitter')


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("this is not XML", "refuses"),
        ('<scene version="3.0.0">', "refuses"),
        ("<scene/>", "version"),
        ('<bsdf version="3.0.0" type="diffuse"/>', "<scene>"),
        (NO_SENSOR, "no sensor"),
        ('<scene version="3.0.0"><sensor type="perspective"/></scene>', "no lights"),
        (SEEN.replace("constant", "no_such_plugin"), "no_such_plugin"),
        (NO_SENSOR.replace("0.1 0.2 0.3", "$colour"), "parameters={'colour': ...}"),
        ('<scene version="3.0.0"><include filename="gone.xml"/></scene>', "gone.xml"),
        (
            '<scene version="3.0.0"><sensor type="perspective"/>'
            '<shape type="ply"><string name="filename" value="gone.ply"/></shape></scene>',
            "gone.ply",
        ),
        (
            SEEN.replace(
                "<emitter", '<shape type="disk" id="a"/><shape type="disk" id="a"/><emitter'
            ),
            'duplicate ID: "a" (the first is at line 1, col 53)',
        ),
        (
            SEEN.replace("<emitter", '<shape type="disk"><ref id="oak"/></shape><emitter'),
            'unresolved reference to "oak". Make sure',
        ),
    ],
)
def test_what_cannot_be_loaded_is_refused_in_one_line(
    tmp_path: Path, text: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as refusal:
        load_scene(path)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).count("Mitsuba refuses") <= 1
    assert capfd.readouterr() == ("", "")


def test_missing_file_unknown_sensor_and_light(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such scene file"):
        load_scene(tmp_path / "gone.xml")
    path = write_room(tmp_path)
    for sensor in ("nobody", "7", -1):
        with pytest.raises(SceneError, match=r"0 \(camera\)"):
            load_scene(path, sensor=sensor)
    assert load_scene(path, sensor="0").sensor == load_scene(path, sensor="camera").sensor == 0
    with pytest.raises(SceneError, match="panel, bulb"):
        load_scene(path).light("nobody")


def test_a_process_keeps_its_variant() -> None:
    backend = use_variant()
    assert use_variant(backend.variant) is backend
    with pytest.raises(BackendError, match="start a new one"):
        use_variant("scalar_rgb" if backend.variant != "scalar_rgb" else "llvm_ad_rgb")


def test_a_scene_is_shown_on_one_screen(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path))
    assert repr(scene) == (
        f"Scene({scene.path}, 5 lights, 24x20 through camera: "
        f"{', '.join(light.name for light in scene.lights)})"
    )
    assert "Light('bulb', point intensity 0.5 0.6 0.7 W/sr)" in repr(scene.lights)
    bulbs = (f'<emitter type="point" id="bulb_{k}"/>' for k in range(302))
    many = load_scene(write_room(tmp_path, lights="".join(bulbs), name="many.xml"))
    for text in (repr(many), repr(many.lights), repr(many.emitters)):
        assert len(text) < 1000
        assert "bulb_1" in text or "more" in text
    assert "and 2" in repr(many)


def test_a_light_that_shines_nowhere_is_refused(tmp_path: Path):
    """Its images were NaN, which ended in an error while the answer was written."""
    emitter = '<vector name="direction" x="0" y="0" z="0"/>'
    emitter = f'<emitter type="directional" id="far">{emitter}</emitter>'
    path = write_room(tmp_path)
    path.write_text(path.read_text().replace("</scene>", f"{emitter}</scene>"))
    with pytest.raises(SceneError, match=r"'far' .* has a direction that is not a number"):
        load_scene(path)


def test_a_direction_that_is_rounded_to_zero_has_no_sign(tmp_path: Path) -> None:
    spot = (
        '<emitter type="spot" id="beam"><transform name="to_world"><lookat origin="0, 2, 0" '
        'target="-0.001, 0, -0.001" up="0, 0, 1"/></transform></emitter>'
    )
    form = lit_scene(tmp_path, spot).light("beam").form
    assert form == "at (0.00, 2.00, 0.00) towards (0.00, -1.00, 0.00)"
