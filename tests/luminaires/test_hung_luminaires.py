"""Luminaires of a lights file in a scene: their place, their level, their scale, their identity."""

import gc
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run
from renderer import LIGHTS, SCREEN, one_pass, write_room
from webs import batwing, cosine, ies_text, street, write_web

from lightpaint.arrays import Doubles
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.errors import ConstraintError, SceneError
from lightpaint.lighting.constraints.absolute_scale import agreed_scale, with_sure_scale
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import Reduction, reduce_to
from lightpaint.luminaires.web_file import read_web
from lightpaint.placement.lights_to_place import why_not_searched
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: The renderer's numbers are float32.
SINGLE = 2e-4

#: Lights without those that are in no luminous unit.
LAMPS = "\n".join(LIGHTS[name] for name in ("panel", "bulb", "beam"))


def _room(folder: Path, toml: str, *, of: str = LAMPS, **chosen: Any) -> Scene:
    """The room of lights `of`, whose lights file has `toml`, and the webs that it names."""
    path = write_room(folder, lights=of)
    planes = np.arange(0, 361, 30).tolist()
    (folder / "lamps").mkdir(exist_ok=True)
    write_web(folder / "lamps" / "lamp.ies", ies_text(batwing, lamps="2 1500", watts=31))
    write_web(folder / "lamps" / "street.ies", ies_text(street, planes))
    (folder / "room.lights.toml").write_text(toml, encoding="utf-8")
    return load_scene(path, **chosen)


def _reduction(scene: Scene, constraints: Constraints | None = None) -> Reduction:
    lights = basis_lights(scene)
    all_constraints = constraints_of(scene.requests)
    if constraints is not None:
        all_constraints = all_constraints.and_then(constraints)
    return reduce_to(with_sure_scale(all_constraints, lights), lights)


def _lux(scene: Scene, name: str, points: Doubles, normal: tuple[float, float, float]) -> Doubles:
    """The illuminance (n,) of an emitter at full, without what is in between."""
    import drjit as dr
    import mitsuba as mi

    loaded = scene.load({light.name: (1.0, 1.0, 1.0) for light in scene.lights})
    emitter = next(x for x in loaded.emitters() if x.id() == name)
    it = dr.zeros(mi.SurfaceInteraction3f, len(points))
    it.p = mi.Point3f(points.T.astype(np.float32))
    ds, arriving = emitter.sample_direction(it, mi.Point2f(0.5))
    found = np.array(arriving.y * dr.maximum(dr.dot(ds.d, mi.Vector3f(*normal)), 0), np.float64)
    del loaded, emitter, ds, arriving, it
    gc.collect()
    return found


def test_a_point_hangs_down_and_keeps_its_place(tmp_path: Path) -> None:
    scene = _room(tmp_path, '[light.bulb]\nphotometry = "lamps/lamp.ies"\nfactor = 0.8')
    bulb = scene.light("bulb")
    assert (bulb.plugin, bulb.emission, bulb.unit) == ("ies", (1, 1, 1), "× at full")
    web = read_web(tmp_path / "lamps" / "lamp.ies")
    assert bulb.unit_flux == pytest.approx((0.8 * web.flux,) * 3)
    # y is up, and the lamp hangs at (-0.5, 1, 0.5).
    angles = np.radians([1.0, 20, 41, 60])
    points = np.column_stack([-0.5 + np.tan(angles), 0 * angles, np.full(4, 0.5)])
    expected = 0.8 * np.interp(np.degrees(angles), web.gammas, web.profile()) * np.cos(angles) ** 3
    assert _lux(scene, "bulb", points, (0, 1, 0)) == pytest.approx(expected, rel=SINGLE)


@pytest.mark.parametrize("key", ["", "cd_per_unit = 1000\n"])
def test_lumens_are_those_that_are_asked_for(tmp_path: Path, key: str) -> None:
    scene = _room(tmp_path, f'{key}[light.beam]\nphotometry = "lamps/street.ies"\nlumens = 2500')
    scale = 1000 if key else 1
    assert scene.cd_per_unit == scale
    assert scene.light("beam").unit_flux == pytest.approx((2500 / scale,) * 3)


def test_a_spot_gives_its_axis_and_a_turn_is_about_it(tmp_path: Path) -> None:
    straight = _room(tmp_path, '[light.beam]\nphotometry = "lamps/street.ies"')
    site = straight.light("beam").members[0].site
    ahead = np.subtract((0, 0, 0), (0.8, 1.8, 1.5))
    assert site.direction == pytest.approx(ahead / np.linalg.norm(ahead), abs=1e-5)
    on_axis, beside = np.array([[0.0, 0, 0]]), np.array([[0.6, 0, 0]])
    before = [_lux(straight, "beam", x, (0, 1, 0)) for x in (on_axis, beside)]
    turned = _room(tmp_path, '[light.beam]\nphotometry = "lamps/street.ies"\nturn = 90')
    after = [_lux(turned, "beam", x, (0, 1, 0)) for x in (on_axis, beside)]
    assert after[0] == pytest.approx(before[0], rel=1e-3)  # in float32, near the axis
    assert abs(after[1] / before[1] - 1).max() > 0.1


def test_a_flat_area_light_keeps_its_shape(tmp_path: Path) -> None:
    scene = _room(tmp_path, '[light.panel]\nphotometry = "lamps/lamp.ies"')
    panel = scene.light("panel")
    assert (panel.plugin, panel.emission) == ("iesarea", (1, 1, 1))
    # 100 m below, its 0.6 m are a point.
    below = np.array([[0.0, -98.1, 0]])
    web = read_web(tmp_path / "lamps" / "lamp.ies")
    expected = web.profile()[0] / 100**2
    assert _lux(scene, "panel", below, (0, 1, 0)) == pytest.approx([expected], rel=SINGLE)


def test_patterns_and_groups(tmp_path: Path) -> None:
    lights = LAMPS + LIGHTS["bulb"].replace('"bulb"', '"bulb_2"')
    of_pattern = _room(tmp_path, '[light."bulb*"]\nphotometry = "lamps/lamp.ies"', of=lights)
    plugins = {x.name: x.plugin for x in of_pattern.lights}
    assert plugins == {"panel": "area", "bulb": "ies", "beam": "spot", "bulb_2": "ies"}
    toml = '[groups]\nrow = ["bulb", "bulb_2"]\n[light.row]\nphotometry = "lamps/lamp.ies"'
    of_group = _room(tmp_path, toml, of=lights)
    row = of_group.light("row")
    assert (row.plugin, row.unit, row.emission) == ("ies", "× at full", (1, 1, 1))
    constraints = Constraints.of(cd_per_unit=1)
    [lamp] = _reduction(of_group, constraints).lamps.values()
    assert lamp.emitters[0].watts == 62  # 31 each


@pytest.mark.parametrize(
    ("more", "watts", "emission"),
    [
        ("", 31, (1, 1, 1)),
        ("watts = 40", 40, (1, 1, 1)),
        # Linear Rec.709 of luminance 1.
        ("color = [2, 1, 0]", 31, tuple(np.array([2, 1, 0]) / (2 * 0.2126 + 0.7152))),
    ],
)
def test_without_emitters_it_has_one_that_dims(
    tmp_path: Path, more: str, watts: float, emission: tuple[float, float, float]
) -> None:
    toml = f'[light."*"]\nphotometry = "lamps/lamp.ies"\n{more}'
    reduction = _reduction(_room(tmp_path, toml))
    assert len(reduction.lamps) == 3
    for lamp in reduction.lamps.values():
        [emitter] = lamp.emitters
        assert (emitter.name, emitter.most, emitter.watts) == ("lamp", 1, watts)
        assert emitter.emission == pytest.approx(emission, rel=1e-4)
    assert reduction.upper == pytest.approx([1, 1, 1])


def test_emitters_in_lumens_mix_into_its_web(tmp_path: Path) -> None:
    emitters = '[{ name = "warm", rgb = [1.2, 1, 0.4], lm = 900, watts = 9 }]'
    toml = f'[light.bulb]\nphotometry = "lamps/lamp.ies"\nlumens = 1800\nemitters = {emitters}'
    scene = _room(tmp_path, toml, of=LIGHTS["bulb"])
    [lamp] = _reduction(scene).lamps.values()
    luminance = float(np.array(lamp.emitters[0].emission) @ [0.2126, 0.7152, 0.0722])
    assert luminance == pytest.approx(0.5, rel=1e-4)  # half of its 1800 lm

    # Their own lumens count, whatever the file has, and a remark says so.
    [remark] = [x for hung in scene.luminaires for x in hung.remarks()]
    assert remark.startswith("lamp.ies: lumens changes nothing beside emitters in lm or cd")
    same = _room(tmp_path, toml.replace("lumens = 1800\n", ""), of=LIGHTS["bulb"])
    fluxes = []
    for x in (scene, same):
        [lamp], [light] = _reduction(x).lamps.values(), basis_lights(x)
        assert light.unit_flux is not None
        fluxes.append(np.array(lamp.emitters[0].emission) * light.unit_flux)
    np.testing.assert_allclose(fluxes[0], fluxes[1], rtol=1e-6)


@pytest.mark.parametrize(
    ("tilt", "factor"), [("", 1.0), ("tilt = 45\nturn = 20", 0.95), ("tilt = 60", 0.9)]
)
def test_a_lamp_that_hangs_tilted_has_the_factor_of_its_file(
    tmp_path: Path, tilt: str, factor: float
) -> None:
    (tmp_path / "lamps").mkdir(exist_ok=True)
    text = ies_text(batwing, tilt="TILT=INCLUDE\n1\n3\n0 45 90\n1 0.95 0.8")
    (tmp_path / "lamps" / "tilted.ies").write_text(text, encoding="ascii")
    scene = _room(tmp_path, f'[light.bulb]\nphotometry = "lamps/tilted.ies"\n{tilt}')
    flux = read_web(tmp_path / "lamps" / "tilted.ies").flux
    assert scene.light("bulb").unit_flux == pytest.approx((factor * flux,) * 3, rel=1e-5)
    told = [x for hung in scene.luminaires for x in hung.remarks() if "TILT" in x]
    assert bool(told) == (factor != 1)


def test_a_spot_is_tilted_by_the_angle_at_which_it_aims(tmp_path: Path) -> None:
    (tmp_path / "lamps").mkdir(exist_ok=True)
    text = ies_text(batwing, tilt="TILT=INCLUDE\n1\n2\n0 90\n1 0.5")
    (tmp_path / "lamps" / "tilted.ies").write_text(text, encoding="ascii")
    scene = _room(tmp_path, '[light.beam]\nphotometry = "lamps/tilted.ies"')
    ahead = np.subtract((0, 0, 0), (0.8, 1.8, 1.5))
    angle = np.degrees(np.arccos(-ahead[1] / np.linalg.norm(ahead)))
    flux = read_web(tmp_path / "lamps" / "tilted.ies").flux
    expected = (1 - 0.5 * angle / 90) * flux
    assert scene.light("beam").unit_flux == pytest.approx((expected,) * 3, rel=1e-5)


@pytest.mark.parametrize("amount", ["lm = 900", "Y = 0.5"])
def test_losses_count_once_for_emitters(tmp_path: Path, amount: str) -> None:
    light = "[light.bulb]\nphotometry = 'lamps/lamp.ies'\n"
    emitters = f"emitters = [{{ name = 'warm', rgb = [1, 1, 1], {amount} }}]\n"
    levels, fluxes = [], []
    for factor in ("", "factor = 0.7\n"):
        scene = _room(tmp_path, light + factor + emitters, of=LIGHTS["bulb"])
        [lamp] = _reduction(scene).lamps.values()
        [bulb] = basis_lights(scene)
        levels.append(lamp.emitters[0].emission[1])
        assert bulb.unit_flux is not None
        fluxes.append(levels[-1] * bulb.unit_flux[1])
    assert fluxes[1] / fluxes[0] == pytest.approx(0.7, rel=1e-6)
    assert levels[1] == pytest.approx(levels[0], rel=1e-6)


def test_lights_beside_it_need_a_scale(tmp_path: Path) -> None:
    scene = _room(tmp_path, '[light.bulb]\nphotometry = "lamps/lamp.ies"')
    with pytest.raises(ConstraintError, match=r"'panel' is in W/\(m² sr\), beside lamps"):
        _reduction(scene)
    _reduction(scene, Constraints.of(cd_per_unit=1))
    others = {
        x: {"emitters": [{"name": "a", "rgb": [1, 1, 1], "lm": 9}]} for x in ("panel", "beam")
    }
    _reduction(scene, Constraints.of(others))
    constraints = constraints_of(scene.requests).and_then(Constraints.of(others))
    assert with_sure_scale(constraints, basis_lights(scene)).cd_per_unit == 1
    dark = Constraints.of({"panel": {"off": True}, "beam": {"off": True}})
    _reduction(scene, dark)


def test_lights_that_stay_as_they_are_need_a_scale_too(tmp_path: Path) -> None:
    scene = _room(tmp_path, '[light.bulb]\nphotometry = "lamps/lamp.ies"', lights=["bulb"])
    with pytest.raises(ConstraintError, match="light 'rest' is in"):
        _reduction(scene)


def test_two_scales_are_refused() -> None:
    assert agreed_scale(None, 1000) == 1000
    assert agreed_scale(1, None) == 1
    with pytest.raises(ConstraintError, match="set cd_per_unit = 1000 in the lights file"):
        agreed_scale(1, 1000)


@pytest.mark.parametrize(
    ("toml", "reason"),
    [
        ('[light.sky]\nphotometry = "lamps/lamp.ies"', "light 'sky' is a constant"),
        ('[light.screen]\nphotometry = "lamps/lamp.ies"', "light 'screen' shows a picture"),
        ('[light.lamp]\nphotometry = "lamps/lamp.ies"', "has no light 'lamp' that could be"),
        ("[light.bulb]\nwatts = 30", "light.bulb has watts without photometry"),
        ('[light.bulb]\nphotometry = "no.ies"', "no such photometric file"),
        ("[light.bulb]\nphotometry = 3", "light.bulb.photometry is 3: expected the name"),
        ('[light.bulb]\nphotometry = "lamps/lamp.ies"\nlumens = 0', "light.bulb.lumens is 0"),
        ('[light.bulb]\nphotometry = "lamps/lamp.ies"\nturn = "a"', "light.bulb.turn is 'a'"),
        ('[light.bulb]\nphotometry = "lamps/lamp.ies"\nmove = 1', "has photometry and move"),
        ('[light.bulb]\nphotometry = "lamps/lamp.ies"\nsplit = [4, 4]', "shows no picture"),
    ],
)
def test_refused_luminaires(tmp_path: Path, toml: str, reason: str) -> None:
    lights = "\n".join([*LIGHTS.values(), SCREEN])
    with pytest.raises(SceneError) as refusal:
        _room(tmp_path, toml, of=lights)
    assert reason in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_web_needs_a_flat_shape(tmp_path: Path) -> None:
    ball = """<shape type="sphere" id="ball_light"><emitter type="iesarea">
        <string name="filename" value="lamps/lamp.ies"/></emitter></shape>"""
    with pytest.raises(SceneError, match="is an iesarea on sphere: expected a rectangle or a disk"):
        _room(tmp_path, "", of=ball)
    flat = ball.replace("sphere", "disk")
    assert _room(tmp_path, "", of=flat).light("ball_light").unit == "× at full"


def test_luminaires_stay_where_they_are(tmp_path: Path) -> None:
    toml = '[light."*"]\nphotometry = "lamps/lamp.ies"'
    reasons = {x.name: why_not_searched(x) for x in _room(tmp_path, toml).lights}
    for name in ("bulb", "panel"):
        assert reasons[name].startswith("is a luminaire, which stays where it hangs")


def test_kelvin_ranges_need_emitters(tmp_path: Path) -> None:
    toml = '[light.bulb]\nphotometry = "lamps/lamp.ies"\nkelvin = [2700, 6500]'
    scene = _room(tmp_path, toml)
    with pytest.raises(ConstraintError, match="has photometry and kelvin, and without emitters"):
        constraints_of(scene.requests)


def test_a_changed_web_changes_the_images_of_its_lights_alone(tmp_path: Path) -> None:
    toml = 'cd_per_unit = 1\n[light.bulb]\nphotometry = "lamps/lamp.ies"'
    scene = _room(tmp_path, toml)
    again = _room(tmp_path, toml)
    assert (again.content, again.light_identities) == (scene.content, scene.light_identities)
    assert tmp_path / "lamps" / "lamp.ies" in {x.resolve() for x in scene.read_files}
    write_web(tmp_path / "lamps" / "lamp.ies", ies_text(cosine))
    changed = load_scene(tmp_path / "room.xml")
    assert changed.content != scene.content
    is_same = [
        a == b for a, b in zip(changed.light_identities, scene.light_identities, strict=True)
    ]
    assert dict(zip(["panel", "bulb", "beam"], is_same, strict=True)) == {
        "panel": True,
        "bulb": False,
        "beam": True,
    }


@pytest.mark.parametrize(("height", "plugin"), [(1.0, "iesarea"), (12.0, "ies")])
def test_a_large_opening_near_a_surface_is_a_panel(
    tmp_path: Path, height: float, plugin: str
) -> None:
    bulb = LIGHTS["bulb"].replace('y="1"', f'y="{height}"')
    path = write_room(tmp_path, lights=bulb)
    # 1.2 m along C0, 0.3 m along C90; the floor is 2 m wide, and nothing is beside it.
    write_web(
        tmp_path / "long.ies", ies_text(cosine, gammas=np.arange(0, 31, 5), sizes=(0.3, 1.2, 0))
    )
    toml = '[light.bulb]\nphotometry = "long.ies"\nturn = 90'
    (tmp_path / "room.lights.toml").write_text(toml, encoding="utf-8")
    scene = load_scene(path)
    assert scene.light("bulb").plugin == plugin
    [hung] = scene.luminaires
    if height == 1:  # its floor, as seen along 1024 directions
        assert hung.distance == pytest.approx(height, rel=0.02)
    said = [x for x in hung.remarks() if "so it is a panel of 1.2 x 0.3 m" in x]
    assert bool(said) == (plugin == "iesarea")
    if plugin == "iesarea":
        loaded = scene.load()
        box = next(x for x in loaded.emitters() if x.id() == "bulb").get_shape().bbox()
        sides = np.array(box.max) - np.array(box.min)
        del loaded, box
        gc.collect()
        # Turned by 90 degrees, C0 is at −z where y is up.
        assert sides == pytest.approx([0.3, 0, 1.2], abs=1e-6)


def test_light_in_an_integrating_sphere(tmp_path: Path) -> None:
    """Of a flux Φ in a sphere of area A and albedo ρ, walls get Φρ/(A(1−ρ)) by way of others."""
    albedo, radius = 0.5, 2.0
    sphere = f"""<scene version="3.0.0"><integrator type="path">
        <integer name="max_depth" value="-1"/></integrator>
        <sensor type="perspective"><float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0.3 0 0" target="0 0 2" up="0 1 0"/></transform>
        <sampler type="independent"/><film type="hdrfilm"><integer name="width" value="8"/>
        <integer name="height" value="8"/></film></sensor>
        <shape type="sphere"><float name="radius" value="{radius}"/>
        <boolean name="flip_normals" value="true"/><bsdf type="diffuse">
        <rgb name="reflectance" value="{albedo}"/></bsdf></shape>
        <emitter type="point" id="lamp"><transform name="to_world"><translate x="0"/></transform>
        </emitter></scene>"""
    (tmp_path / "sphere.xml").write_text(sphere, encoding="utf-8")
    write_web(tmp_path / "lamp.ies", ies_text(cosine, gammas=np.linspace(0, 90, 181)))
    toml = '[light.lamp]\nphotometry = "lamp.ies"'
    (tmp_path / "sphere.lights.toml").write_text(toml, encoding="utf-8")
    scene = load_scene(tmp_path / "sphere.xml")
    [plane] = one_pass(scene, seed=1, spp=256)
    flux, area = read_web(tmp_path / "lamp.ies").flux, 4 * math.pi * radius**2
    # y is up, so the camera sees a half that the lamp lights, and one that it does not.
    dark = plane[:4].mean()
    expected = albedo / math.pi * flux * albedo / (area * (1 - albedo))
    assert dark == pytest.approx(expected, rel=0.03)  # four standard errors of 8192 paths


def test_the_command_line_says_what_is_wrong(tmp_path: Path) -> None:
    _room(tmp_path, '[light.bulb]\nphotometry = "lamps/lamp.ies"')
    found = run(tmp_path, "lights", "room.xml", "--no-sheet")
    assert found.returncode == 0
    assert "6,0" in found.stdout or " lm" in found.stdout
    write_web(tmp_path / "lamps" / "lamp.ies", ies_text(cosine, kind=2))
    refused = run(tmp_path, "lights", "room.xml", "--no-sheet")
    assert refused.returncode == 2
    assert len(refused.stderr.strip().splitlines()) == 1
    assert "lamp.ies: its photometry is of type B: expected type C" in refused.stderr
