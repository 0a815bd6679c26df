"""Luminaires in relit scenes: spots of plain Mitsuba where these are the same light."""

import gc
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run
from renderer import LIGHTS, write_room
from webs import Distribution, batwing, cosine, ies_text, street, write_web

from lightpaint.arrays import RGB, Doubles
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.luminaires.web import SPOT_TOLERANCE, PhotometricWeb, spots_of
from lightpaint.relit.emission_xml import plugin_remark
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import shares_of_emitters, verify
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

TOML = """[light.bulb]
photometry = "round.ies"
lumens = 900
[light.beam]
photometry = "street.ies"
turn = 30
tilt = 10
factor = 0.8
[light.panel]
photometry = "round.ies"
"""


def _scene(folder: Path, toml: str = TOML, **chosen: Any) -> Scene:
    lights = "\n".join(LIGHTS[name] for name in ("panel", "bulb", "beam"))
    path = write_room(folder, lights=lights)
    write_web(folder / "round.ies", ies_text(batwing))
    write_web(folder / "street.ies", ies_text(street, np.arange(0, 361, 30).tolist()))
    (folder / "room.lights.toml").write_text(toml, encoding="utf-8")
    return load_scene(path, **chosen)


def _answer(scene: Scene, **levels: RGB) -> tuple[Basis, Lighting]:
    basis = render_basis(scene, spp=2)
    emission = {x.name: levels.get(x.name, (0.5, 0.25, 0.125)) for x in scene.lights}
    weights = [(1, 1, 1) if x.is_fixed else emission[x.name] for x in basis.lights]
    return basis, Lighting.of_weights(basis.lights, np.array(weights, float))


def _illuminance(loaded: Any, names: str, points: Doubles) -> Doubles:
    """The illuminance (n, 3) of those emitters whose names match, at points of a floor."""
    import drjit as dr
    import mitsuba as mi

    total = np.zeros((len(points), 3))
    for emitter in loaded.emitters():
        if re.fullmatch(names, emitter.id()):
            it = dr.zeros(mi.SurfaceInteraction3f, len(points))
            it.p = mi.Point3f(points.T.astype(np.float32))
            ds, arriving = emitter.sample_direction(it, mi.Point2f(0.5))
            total += np.array(arriving * dr.maximum(ds.d.y, 0)).T
    return total


def test_an_axial_web_is_written_as_spots_of_plain_mitsuba(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    _, lighting = _answer(scene)
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    text = (tmp_path / "relit" / "relit.xml").read_text(encoding="utf-8")
    assert re.findall(r'type="(\w+)" id="bulb', text)[0] == "spot"
    points = np.random.default_rng(1).uniform([-2, 0, -2], [2, 0, 2], (200, 3))
    loaded = scene.load(lighting.emission)
    expected = _illuminance(loaded, "bulb", points)
    del loaded
    gc.collect()
    written = relit.load()
    found = _illuminance(written, r"bulb(\.spot\d+)?", points)
    del written
    gc.collect()
    hung = next(x for x in scene.luminaires if x.name == "bulb")
    brightest = 0.5 * hung.scale * hung.request.web.peak
    distances = ((points - [-0.5, 1, 0.5]) ** 2).sum(axis=1, keepdims=True)
    # The spots err by SPOT_TOLERANCE of the web's largest candela, at most.
    assert (np.abs(found - expected) <= SPOT_TOLERANCE * brightest / distances + 1e-3).all()
    assert expected.max() > 10


def test_other_webs_need_the_plugin_and_a_remark_says_so(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    remark = plugin_remark(scene)
    assert remark is not None
    assert "beam" in remark
    assert "panel" in remark
    assert "bulb" not in remark
    _, lighting = _answer(scene)
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    assert {x.name: x.plugin for x in relit.emitters if ".spot" not in x.name} == {
        "bulb": "spot",
        "beam": "ies",
        "panel": "iesarea",
    }
    only_spots = _scene(tmp_path, '[light.bulb]\nphotometry = "round.ies"')
    assert plugin_remark(only_spots) is None


@pytest.mark.long
def test_a_render_of_the_relit_scene_agrees(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    basis = render_basis(scene, spp=64)
    weights = np.array([[0.5, 0.25, 0.125], [0.8, 0.7, 0.9], [1.0, 0.5, 0.2]])
    lighting = Lighting.of_weights(basis.lights, weights)
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    verification = verify(combine(basis, lighting), relit, spp=64)
    assert verification.agrees
    wrong = Lighting.of_weights(basis.lights, 1.3 * weights)
    assert not verify(combine(basis, wrong), relit, spp=64).agrees


def test_luminaires_that_stay_as_they_are_are_written_too(tmp_path: Path) -> None:
    scene = _scene(tmp_path, lights=["panel"])
    _, lighting = _answer(scene)
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    plugins = {x.name: x.plugin for x in relit.emitters}
    assert (plugins["bulb"], plugins["beam"]) == ("spot", "ies")
    assert all(x.sampling_weight for x in relit.emitters)


def test_one_that_is_off_is_off(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    _, lighting = _answer(scene, bulb=(0, 0, 0), beam=(0, 0, 0))
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    off = [x for x in relit.emitters if x.name in ("bulb", "beam")]
    assert [(x.emission, x.sampling_weight) for x in off] == [((0, 0, 0), 0)] * 2
    assert len(relit.emitters) == 3


def test_a_relit_scene_is_read_again_with_its_lights_file(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    _, lighting = _answer(scene)
    path = tmp_path / "relit" / "relit.xml"
    relight(scene, lighting, path)
    again = load_scene(path, lights_file=tmp_path / "room.lights.toml")
    assert [x.name for x in again.lights] == ["panel", "bulb", "beam"]
    for light in again.lights:
        assert light.plugin == scene.light(light.name).plugin
        assert light.emission == pytest.approx((0.5, 0.25, 0.125), rel=1e-6)
        assert light.unit_flux == pytest.approx(scene.light(light.name).unit_flux, rel=1e-6)
        old = scene.light(light.name).members[0].site
        assert light.members[0].site.direction == pytest.approx(old.direction, abs=1e-5)
    points = np.random.default_rng(1).uniform([-1, 0, -1], [1, 0, 1], (50, 3))
    found = []
    for each in (scene, again):
        loaded = each.load(lighting.emission)
        found.append(_illuminance(loaded, "beam", points))
        del loaded
        gc.collect()
    assert found[1] == pytest.approx(found[0], rel=1e-3)  # turned once
    _, second = _answer(again)
    twice = relight(again, second, tmp_path / "twice" / "relit.xml")
    assert len(twice.emitters) == len(load_scene(path, use_lights_file=False).emitters)


def test_only_luminaires_are_read_to_relight(tmp_path: Path) -> None:
    whole = f'lights = ["panel"]\n{TOML}off = true\n'
    scene = _scene(tmp_path, whole, only_luminaires=True)
    assert [(x.name, x.plugin) for x in scene.lights] == [
        ("panel", "iesarea"),
        ("bulb", "ies"),
        ("beam", "ies"),
    ]
    assert constraints_of(_scene(tmp_path, whole).requests).lights[-1][1]["off"]
    without = _scene(tmp_path, 'lights = ["panel"]\n', only_luminaires=True)
    assert [x.plugin for x in without.lights] == ["area", "point", "spot"]
    assert without.lights_file is None


def test_commands_relight_and_export_them(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    _, lighting = _answer(scene)
    write_lighting(tmp_path / "lighting.json", lighting)
    relit = run(tmp_path, "relight", "room.xml", "lighting.json", "-o", "here", "--spp", "2")
    assert relit.returncode == 0, relit.stderr
    exported = run(
        tmp_path, *("export", "lighting.json", "--scene", "room.xml"), *("--to", "csv,mitsuba")
    )
    assert exported.returncode == 0, exported.stderr
    patch = (tmp_path / "relit.patch").read_text(encoding="utf-8")
    assert '<emitter type="ies" id="beam">' in patch
    (tmp_path / "room.lights.toml").rename(tmp_path / "else.toml")
    words = ("relight", "room.xml", "lighting.json", "-o", "there", "--spp", "2")
    assert run(tmp_path, *words).returncode == 2  # its lights are in another unit
    assert run(tmp_path, *words, "--lights-file", "else.toml").returncode == 0
    texts = [(tmp_path / x / "relit.xml").read_bytes() for x in ("here", "there")]
    assert texts[0] == texts[1]


def test_spots_share_the_samples_of_their_luminaire(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    basis, lighting = _answer(scene)
    relit = relight(scene, lighting, tmp_path / "relit" / "relit.xml")
    shares = shares_of_emitters(relit, lighting, {"panel": 0.2, "bulb": 0.5, "beam": 0.3})
    assert sorted(shares) == sorted(x.name for x in relit.emitters)
    assert sum(x for name, x in shares.items() if name.startswith("bulb")) == pytest.approx(0.5)
    assert basis.lights.names == ("panel", "bulb", "beam")


def _web(light: Distribution, gammas: Any) -> PhotometricWeb:
    angles = np.array(gammas, float)
    return PhotometricWeb("", angles, np.zeros(1), light(np.zeros((1, 1)), angles[None]), "axial")


@pytest.mark.parametrize(
    ("light", "gammas"),
    [
        (batwing, np.arange(0, 181, 2.5)),
        (cosine, np.arange(0, 91, 1.0)),
        (cosine, np.arange(0, 61, 5.0)),  # which ends where there is light
        (batwing, np.arange(20, 91, 5.0)),  # and begins there
        (lambda c, g: 0 * c + 100 + 90 * np.cos(np.radians(8 * g)), np.arange(0, 91, 1.0)),
    ],
)
def test_spots_add_up_to_the_web(light: Distribution, gammas: Doubles) -> None:
    web = _web(light, gammas)
    parts = spots_of(web)
    assert 0 < len(parts) <= len(gammas) + 1
    # Not at the ends, where it falls to the dark at once.
    angle = np.setdiff1d(np.linspace(0, 179.9, 3599), web.gammas[[0, -1]])
    ramps = [
        np.clip((x.cutoff - angle) / max(x.cutoff - x.beam, 1e-9), 0, 1) * x.candela for x in parts
    ]
    inside = (angle >= gammas[0]) & (angle <= gammas[-1])
    expected = np.where(inside, np.interp(angle, gammas, web.profile()), 0)
    assert np.abs(sum(ramps) - expected).max() <= SPOT_TOLERANCE * web.peak * (1 + 1e-9)


def test_webs_that_are_no_sum_of_spots() -> None:
    assert spots_of(_web(lambda c, g: 0 * c + 100 + 0 * g, np.arange(0, 181, 5.0))) == ()
    assert spots_of(_web(lambda c, g: 0 * c + 100 - g, np.array([0.0, 80, 100]))) == ()
    planes = np.array([0.0, 90, 180, 270, 360])
    table = street(planes[:, None], np.arange(0, 91, 5.0)[None])
    assert spots_of(PhotometricWeb("", np.arange(0, 91, 5.0), planes, table, "none")) == ()
