"""Groups and fixed lights through the whole corridor: solve, file, relit scene, render."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, SCREEN, TWIN, mitsuba_render, one_pass, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import BasisError, LightingError, SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.default_solve import solve
from lightpaint.pipeline.job.job_checks import remarks_of_scene
from lightpaint.pipeline.one_call import paint_with_light
from lightpaint.relit.relit_scene import check_relightable, relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

SUNSKY = """<emitter type="sunsky" id="day"><float name="sun_scale" value="0.01"/>
    <float name="sky_scale" value="0.02"/>
    <vector name="sun_direction" x="0.3" y="0.8" z="0.6"/></emitter>"""
MAP = """<emitter type="envmap" id="map"><string name="filename" value="map.exr"/></emitter>"""
INDOORS = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["beam"] + TWIN + SCREEN

#: name → (lights of the scene, groups, chosen)
SCENES: dict[str, tuple[str, dict[str, list[str]], list[str]]] = {
    "one colour": (INDOORS + LIGHTS["sun"], {"pair": ["bulb", "twin"]}, ["pair", "sun"]),
    "several kinds": (INDOORS + LIGHTS["sky"], {"pair": ["panel", "twin"]}, ["pair", "beam"]),
    "with sun and sky": (INDOORS + SUNSKY, {"pair": ["panel", "day"]}, ["pair", "bulb"]),
    "with a map": (INDOORS + MAP, {"pair": ["panel", "map"]}, ["pair", "bulb"]),
}


@pytest.fixture(params=SCENES)
def scene(request: pytest.FixtureRequest, tmp_path: Path) -> Scene:
    lights, groups, chosen = SCENES[request.param]
    rng = np.random.default_rng(0)
    write_rgb(tmp_path / "map.exr", rng.random((8, 16, 3)).astype(np.float32))
    return load_scene(write_room(tmp_path, lights=lights), groups=groups, lights=chosen)


def some_lighting(scene: Scene, *, spp: int = 2) -> Lighting:
    """Weights that no light has now."""
    lighting = Lighting.current(render_basis(scene, spp=spp))
    for k, light in enumerate(scene.lights):
        if not light.is_fixed:
            rgb = (0.5 + k, 0.5 + k, 0.5 + k) if light.is_scalar else (0.5 + k, 1.5, 2.0)
            lighting = lighting.with_emission(light.name, rgb)
    return lighting


def test_predicted_is_the_relit_render_at_the_same_seed(scene: Scene, tmp_path: Path) -> None:
    lighting = some_lighting(scene)
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    planes = one_pass(scene, seed=4, spp=16)
    weights = [light.weight for light in lighting.lights]
    mixed = np.einsum("nhwc,nc->hwc", planes, weights)
    if "map" in {e.name for e in scene.emitters}:
        # A coloured map is importance sampled otherwise: equal in the mean, within noise.
        predicted = combine(render_basis(scene, spp=256), lighting)
        assert verify(predicted, relit, spp=256).agrees
        return
    rendered = mitsuba_render(relit, seed=4, spp=16)
    assert np.abs(mixed - rendered).max() <= 1e-5 * rendered.max()  # float32 throughout


def test_known_weights_come_back_and_the_rest_stays(scene: Scene) -> None:
    basis = render_basis(scene, spp=32)
    lighting = some_lighting(scene)
    target = Target("t", combine(basis, lighting).image, np.ones(basis.size, np.float32), False)
    solution = solve(basis, target)
    for light in solution.lighting.lights:
        assert light.is_fixed == scene.light(light.name).is_fixed
        # The target is float32.
        np.testing.assert_allclose(light.emission, lighting.emission[light.name], rtol=1e-4)
    assert solution.lighting.emission["rest"] == (1, 1, 1)


def test_what_is_kept_stays_byte_for_byte(scene: Scene, tmp_path: Path) -> None:
    relight(scene, some_lighting(scene), tmp_path / "out" / "relit.xml")
    before = scene.path.read_text(encoding="utf-8")
    after = (tmp_path / "out" / "relit.xml").read_text(encoding="utf-8")
    for member in scene.light("rest").members:
        element = re.search(rf'<(\w+) [^>]*id="{member.name}".*?</\1>', before, re.DOTALL)
        assert element is not None
        assert element[0] in after, member.name
    for light in scene.lights:
        for member in () if light.is_fixed else light.members:
            element = re.search(rf'<(\w+) [^>]*id="{member.name}".*?</\1>', before, re.DOTALL)
            assert element is not None
            assert element[0] not in after, member.name


def test_a_lighting_file_needs_no_options(scene: Scene, tmp_path: Path) -> None:
    lighting = some_lighting(scene)
    write_lighting(tmp_path / "lighting.json", lighting)
    read = read_lighting(tmp_path / "lighting.json")
    assert read == lighting
    relight(scene, lighting, tmp_path / "a" / "relit.xml")
    relight(load_scene(scene.path), read, tmp_path / "b" / "relit.xml")
    a, b = (tmp_path / folder / "relit.xml" for folder in "ab")
    assert a.read_bytes() == b.read_bytes()


@pytest.mark.nightly
def test_the_corridor_end_to_end(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=INDOORS)
    first = load_scene(path, groups={"pair": ["bulb", "twin"]}, lights=["pair"])
    basis = render_basis(first, spp=32)
    target = Target(
        "t", 2 * combine(basis, Lighting.current(basis)).image, np.ones(basis.size), False
    )
    choice = {"groups": {"pair": ["bulb", "twin"]}, "lights": ["pair"]}
    look = paint_with_light(path, target, tmp_path / "out", spp=32, **choice)  # type: ignore[arg-type]
    assert look.verification is not None
    assert look.verification.agrees
    assert look.lighting.fixed == {"rest"}
    assert '<td class="change">fixed' in (tmp_path / "out" / "report.html").read_text(
        encoding="utf-8"
    )
    # Twice the light, though only a part of it may change.
    assert min(look.lighting.emission["pair"]) > max(first.light("pair").emission)
    with pytest.raises(BasisError, match="load it with the same lights and groups"):
        paint_with_light(path, target, tmp_path / "out", basis=look.basis)


def test_all_off_but_what_is_kept_still_renders(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=INDOORS), lights=["bulb"])
    basis = render_basis(scene, spp=64)
    lighting = Lighting.current(basis).with_emission("bulb", (0, 0, 0))
    relit = relight(scene, lighting, tmp_path / "out" / "relit.xml")
    assert {e.name: e.sampling_weight for e in relit.emitters}["bulb"] == 0
    assert verify(combine(basis, lighting), relit, spp=64).agrees


def test_a_file_included_twice_can_be_tied_but_not_kept_by_half(tmp_path: Path) -> None:
    bulb = LIGHTS["bulb"].replace('id="bulb"', "")
    (tmp_path / "lamp.xml").write_text(f'<scene version="3.0.0">{bulb}</scene>', encoding="utf-8")
    path = write_room(tmp_path, lights='<include filename="lamp.xml"/>' * 2 + LIGHTS["sky"])
    with pytest.raises(SceneError, match="tie the two into a group"):
        check_relightable(load_scene(path, lights=["point_0"]), tmp_path / "out" / "relit.xml")
    both = "lamp.xml is included more than once: the lights point_0, point_1 are one element of it"
    assert [x for x in remarks_of_scene(load_scene(path)) if x.startswith(both)]
    tied = load_scene(path, groups={"lamps": ["point_*"]})
    assert not [x for x in remarks_of_scene(tied) if "more than once" in x]
    relit = relight(tied, some_lighting(tied), tmp_path / "out" / "relit.xml")
    assert len({e.emission for e in relit.emitters if e.plugin == "point"}) == 1


def test_lightings_that_do_not_fit(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=INDOORS)
    scene = load_scene(path, groups={"pair": ["bulb", "twin"]})
    lighting = some_lighting(scene)
    text = path.read_text(encoding="utf-8")
    # Of two colours, the pair could only be multiplied, and the lighting has it in W/sr.
    path.write_text(text.replace("0.5 0.6 0.7", "0.5 0.5 0.5", 1), encoding="utf-8")
    with pytest.raises(LightingError, match=r"'pair' in W/sr, .* it would be × as authored"):
        relight(load_scene(path), lighting, tmp_path / "out" / "relit.xml")
    path.write_text(text.replace('id="twin"', 'id="gemini"'), encoding="utf-8")
    with pytest.raises(LightingError, match="lacks gemini and names twin"):
        relight(load_scene(path), lighting, tmp_path / "out" / "relit.xml")
    other = load_scene(path, groups={"pair": ["bulb", "panel"]})
    with pytest.raises(LightingError, match="missing gemini; unknown panel"):
        combine(render_basis(other, spp=2), lighting)


def test_an_older_lighting_file_still_reads(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path))
    write_lighting(tmp_path / "lighting.json", some_lighting(scene))
    data = json.loads((tmp_path / "lighting.json").read_text(encoding="utf-8"))
    for light in data["lights"].values():
        light.pop("photometry")
        light.pop("unit_flux", None)
        assert set(light) == {"plugin", "parameter", "unit", "emission", "weight"}
    (tmp_path / "lighting.json").write_text(json.dumps(data), encoding="utf-8")
    relit = relight(scene, read_lighting(tmp_path / "lighting.json"), tmp_path / "o" / "relit.xml")
    assert [light.name for light in relit.lights] == list(data["lights"])
