"""Relit scenes: only emissions change, and what they render is what was predicted."""

import difflib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import succeed
from renderer import CORNELL, LIGHTS, REPOSITORY, mitsuba_render, one_pass, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import LightingError, OutputError, SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.relit.relit_scene import check_relightable, relight, scene_patch
from lightpaint.relit.verification_render import verify
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene


def lighting_of(scene: Scene, emission: dict[str, tuple[float, float, float]]) -> Lighting:
    """A lighting that sets the given lights and leaves the others."""
    return Lighting(
        tuple(
            LightSetting(x.name, x.plugin, x.parameter, x.unit, rgb, rgb)
            for x in scene.lights
            for rgb in [emission.get(x.name, x.emission)]
        )
    )


def random_lighting(scene: Scene, seed: int) -> Lighting:
    rng = np.random.default_rng(seed)
    colours = rng.uniform(0.05, 4, (len(scene.lights), 3)).tolist()
    return lighting_of(
        scene, {x.name: (r, g, b) for x, (r, g, b) in zip(scene.lights, colours, strict=True)}
    )


def changed_lines(before: Path, after: Path) -> list[str]:
    diff = difflib.ndiff(
        before.read_text(encoding="utf-8").splitlines(),
        after.read_text(encoding="utf-8").splitlines(),
    )
    return [line for line in diff if line[0] in "+-"]


@pytest.mark.parametrize("source", ["room", "cornell"])
def test_prediction_is_the_relit_render_at_the_same_seed(tmp_path: Path, source: str) -> None:
    scene = load_scene(CORNELL if source == "cornell" else write_room(tmp_path))
    lighting = random_lighting(scene, 3)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    planes = one_pass(scene, seed=8, spp=16)
    rendered = mitsuba_render(relit, seed=8, spp=16)
    weights = [lighting.emission[light.name] for light in scene.lights]
    predicted = np.einsum("nhwc,nc->hwc", planes, np.float32(weights))
    # float32, in another order of operations.
    assert np.abs(predicted - rendered).max() <= 1e-5 * rendered.max()


def test_relit_scene_loads_in_plain_mitsuba_from_where_it_lies(tmp_path: Path) -> None:
    scene = load_scene(CORNELL)
    relight(scene, random_lighting(scene, 1), tmp_path / "out" / "relit.xml")
    code = (
        "from lightpaint import use_variant; use_variant('scalar_rgb')\n"
        "import mitsuba as mi\n"
        "print(len(mi.load_file('relit.xml').emitters()))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path / "out",
        capture_output=True,
        text=True,
        check=True,
    )
    assert answer.stdout.split()[-1] == str(len(scene.lights))


def test_nothing_but_emissions_and_the_path_changes(tmp_path: Path) -> None:
    relit = tmp_path / "relit.xml"
    scene = load_scene(CORNELL)
    relight(scene, random_lighting(scene, 1), relit)
    lines = changed_lines(CORNELL, relit)
    removed = [line for line in lines if line.startswith("-")]
    added = [line for line in lines if line.startswith("+")]
    assert len(removed) == len(scene.lights)
    assert len(added) == len(scene.lights) + 1
    assert all("<rgb" in line for line in removed)
    assert sum("<path" in line for line in added) == 1
    assert "<!--" in relit.read_text(encoding="utf-8")


def test_values_given_to_the_scene_change_no_text_and_hold_when_it_is_rendered(
    tmp_path: Path,
) -> None:
    lights = LIGHTS["bulb"].replace("0.5 0.6 0.7", "$level $level $level")
    lights = f'<default name="level" value="7"/>{lights}'
    path = write_room(tmp_path, lights=lights)
    scene = load_scene(path, parameters={"width": 12, "level": "2"})
    lighting = random_lighting(scene, 5)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    assert relit.parameters == {"width": "12"}  # nothing asks for the level any more
    assert relit.size == scene.size == (20, 12)
    relit_file = tmp_path / "out" / "relit.xml"
    for name in ("width", "level"):
        assert relit_file.read_text(encoding="utf-8").count(f'<default name="{name}"') == 1
    assert all("default" not in line for line in changed_lines(path, relit_file))
    changed = [x for x in scene_patch(scene, lighting).splitlines() if x[:1] in "+-"]
    assert not any("default" in line for line in changed)
    assert any("intensity" in line for line in changed)
    assert load_scene(relit_file).size == (20, 24)  # the scene's own


def test_a_result_remembers_what_was_given_to_its_scene(tmp_path: Path) -> None:
    write_room(tmp_path, lights=LIGHTS["bulb"])
    options = ("-D", "width=12", "--spp", "8", "-q")
    write_rgb(tmp_path / "p.exr", np.full((20, 12, 3), 0.1, np.float32))
    succeed(tmp_path, "solve", "room.xml", "p.exr", "-o", "out", *options)
    succeed(tmp_path, "verify", "out", "--spp", "8", "-q")


def test_same_lighting_changes_only_the_numbers_spelling(tmp_path: Path, small_room: Scene) -> None:
    relit = relight(small_room, lighting_of(small_room, {}), tmp_path / "out" / "relit.xml")
    assert [x.emission for x in relit.lights] == [x.emission for x in small_room.lights]


def test_off_is_black_and_never_sampled_and_the_emitter_stays(
    tmp_path: Path, small_room: Scene
) -> None:
    dark = lighting_of(small_room, {"bulb": (0, 0, 0), "panel": (0, 0, 0)})
    relit = relight(small_room, dark, tmp_path / "out" / "relit.xml")
    assert [x.name for x in relit.lights] == [x.name for x in small_room.lights]
    assert relit.light("bulb").emission == (0, 0, 0)
    assert relit.light("bulb").members[0].sampling_weight == 0
    assert relit.light("beam").members[0].sampling_weight == 1
    # And on again from there.
    second = relight(relit, lighting_of(relit, {"bulb": (1, 2, 3)}), tmp_path / "two" / "relit.xml")
    assert second.light("bulb").emission == (1, 2, 3)
    assert second.light("bulb").members[0].sampling_weight == 1


def test_all_lights_off_still_loads(tmp_path: Path, small_room: Scene) -> None:
    black = lighting_of(small_room, {light.name: (0, 0, 0) for light in small_room.lights})
    relit = relight(small_room, black, tmp_path / "out" / "relit.xml")
    assert mitsuba_render(relit, seed=0, spp=4).max() == 0


def test_a_scene_whose_every_lamp_is_outside_rec_709_is_written_and_verified(
    tmp_path: Path,
) -> None:
    """As one lamp of LEDs is that was painted in a pure colour."""
    path = write_room(tmp_path, lights=LIGHTS["bulb"])
    emitters = '[{name = "red", rgb = [6.1, -0.41, -0.07]}]'
    (tmp_path / "room.lights.toml").write_text(f"[light.bulb]\nemitters = {emitters}\n")
    scene = load_scene(path)
    basis = render_basis(scene, spp=16)
    weights = np.array([[3.05, -0.205, -0.035]])
    lamps = reduce_to(constraints_of(scene.requests), basis.lights).lamps
    lighting = Lighting.of_weights(basis, weights, lamps=lamps)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    assert relit.light("bulb").emission == pytest.approx((3.05, -0.205, -0.035))
    assert verify(combine(basis, lighting), relit, spp=16).agrees


def test_verification_agrees_and_a_tampered_scene_does_not(
    tmp_path: Path, small_room: Scene, small_room_basis: Any
) -> None:
    basis = small_room_basis(spp=256)
    lighting = random_lighting(small_room, 5)
    predicted = combine(basis, lighting)
    relit = relight(small_room, lighting, tmp_path / "out" / "relit.xml")
    assert verify(predicted, relit, spp=256).agrees
    brighter = {name: (r * 1.1, g, b) for name, (r, g, b) in lighting.emission.items()}
    other = relight(small_room, lighting_of(small_room, brighter), tmp_path / "other" / "relit.xml")
    assert not verify(predicted, other, spp=256).agrees


def test_lights_written_without_emission_or_as_empty_tags(tmp_path: Path) -> None:
    lights = """<emitter type="point" id="bare"/>
        <shape type="rectangle" id="pane"><emitter type="area"/></shape>
        <emitter type='constant' id="odd > name"><!-- dim --></emitter>"""
    scene = load_scene(write_room(tmp_path, lights=lights))
    lighting = random_lighting(scene, 2)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    for light in relit.lights:
        np.testing.assert_allclose(light.emission, lighting.emission[light.name], rtol=1e-6)
    assert "<!-- dim -->" in (tmp_path / "out" / "relit.xml").read_text(encoding="utf-8")


def test_included_lights_parameters_and_assets(tmp_path: Path) -> None:
    home = tmp_path / "home"
    (home / "parts").mkdir(parents=True)
    meshes = CORNELL.parent / "meshes"
    shutil.copy(meshes / "vase.ply", home / "parts" / "vase.ply")
    (home / "parts" / "lights.xml").write_text(
        f"""<scene version="3.0.0"><!-- kept -->{LIGHTS["bulb"]}
        <include filename="deeper.xml"/></scene>""",
        encoding="utf-8",
    )
    (home / "parts" / "deeper.xml").write_text(
        f'<scene version="3.0.0">{LIGHTS["beam"]}</scene>', encoding="utf-8"
    )
    lights = """<include filename="parts/lights.xml"/>
        <shape type="ply"><string name="filename" value="parts/vase.ply"/></shape>
        <emitter type="point" id="dim"><rgb name="intensity" value="$level"/></emitter>"""
    scene = load_scene(write_room(home, lights=lights), parameters={"level": "2", "width": 12})
    lighting = random_lighting(scene, 4)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    assert relit.size == scene.size == (20, 12)
    for light in relit.lights:
        np.testing.assert_allclose(light.emission, lighting.emission[light.name], rtol=1e-6)
    copy = tmp_path / "out" / "parts" / "lights.xml"
    assert "<!-- kept -->" in copy.read_text(encoding="utf-8")


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8-sig", "utf-16"])
def test_other_encodings_come_back_as_they_were(tmp_path: Path, encoding: str) -> None:
    path = write_room(tmp_path)
    declared = {"latin-1": '<?xml version="1.0" encoding="ISO-8859-1"?>'}.get(encoding, "")
    text = declared + "<!-- Bühne für Örtchen -->" + path.read_text(encoding="utf-8")
    path.write_bytes(text.encode(encoding))
    scene = load_scene(path)
    lighting = random_lighting(scene, 6)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    for light in relit.lights:
        np.testing.assert_allclose(light.emission, lighting.emission[light.name], rtol=1e-6)
    content = (tmp_path / "out" / "relit.xml").read_bytes().decode(encoding)
    assert "Bühne für Örtchen" in content


def test_one_include_with_two_answers_is_refused(tmp_path: Path) -> None:
    (tmp_path / "lamp.xml").write_text(
        '<scene version="3.0.0"><emitter type="point"/></scene>', encoding="utf-8"
    )
    path = write_room(tmp_path, lights='<include filename="lamp.xml"/>' * 2)
    scene = load_scene(path)
    a, b = (light.name for light in scene.lights)
    lighting = lighting_of(scene, {a: (1, 2, 3), b: (1, 2, 3)})
    relight(scene, lighting, tmp_path / "out" / "relit.xml")
    with pytest.raises(SceneError, match="more than once"):
        relight(scene, lighting_of(scene, {a: (1, 2, 3), b: (3, 2, 1)}), tmp_path / "x" / "r.xml")
    assert not (tmp_path / "x").exists()


def test_wrong_lights_and_the_scene_itself_are_refused(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    scene = load_scene(path)
    other = load_scene(CORNELL)
    with pytest.raises(LightingError, match="does not fit"):
        relight(scene, lighting_of(other, {}), tmp_path / "out" / "relit.xml")
    before = path.read_bytes()
    with pytest.raises(OutputError, match="the scene itself"):
        relight(scene, lighting_of(scene, {}), path)
    assert path.read_bytes() == before


def test_a_scene_that_is_gone_by_then_is_said(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path))
    lighting = random_lighting(scene, 1)
    scene.path.rename(tmp_path / "elsewhere.xml")
    with pytest.raises(SceneError, match=r"cannot read .*\.xml: No such file"):
        relight(scene, lighting, tmp_path / "out" / "relit.xml")
    assert not (tmp_path / "out").exists()


def test_includes_and_images_of_the_scene_are_never_overwritten(tmp_path: Path) -> None:
    include = tmp_path / "lights.xml"
    include.write_text(f'<scene version="3.0.0">{LIGHTS["bulb"]}</scene>', encoding="utf-8")
    scene = load_scene(write_room(tmp_path, lights='<include filename="lights.xml"/>'))
    before = include.read_bytes()
    lighting = random_lighting(scene, 1)
    with pytest.raises(OutputError, match=r"lights\.xml belongs to the scene"):
        relight(scene, lighting, tmp_path / "relit.xml")
    with pytest.raises(OutputError, match=r"lights\.xml belongs to the scene"):
        check_relightable(scene, tmp_path / "relit.xml")
    assert include.read_bytes() == before
    assert not (tmp_path / "relit.xml").exists()
    assert relight(scene, lighting, tmp_path / "out" / "relit.xml").lights


def test_relit_beside_the_scene_and_through_a_relative_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(REPOSITORY / "scenes" / "cornell", tmp_path / "cornell")
    monkeypatch.chdir(tmp_path)
    scene = load_scene("cornell/scene.xml")
    lighting = random_lighting(scene, 7)
    assert relight(scene, lighting, "cornell/relit.xml").lights
    assert relight(scene, lighting, "relit.xml").lights
    assert str(tmp_path) not in Path("relit.xml").read_text(encoding="utf-8")
    assert not [name for name in os.listdir() if name.startswith(".")]
