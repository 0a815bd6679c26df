"""Renders with spectra: by hand, against the RGB render, and against Mitsuba's own path."""

from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.colour.color import delta_e, luminance, matching_functions
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.primaries import REC709, rgb_to_xyz
from lightpaint.colour.spectrum import (
    WAVELENGTHS,
    Spectrum,
    named_spectrum,
    rgb_of_powers,
    spectrum_of,
)
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.pipeline.job.job_checks import remarks_of_scene
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.properties.film import MeasuringPoints
from lightpaint.scene.scene_reader import load_scene

WAVES = np.arange(380, 781.0)


def _led(peak: float, width: float) -> Spectrum:
    return spectrum_of(WAVES, np.exp(-0.5 * ((WAVES - peak) / width) ** 2))


def _lamp(**spectra: Spectrum) -> Lamp:
    emitters = (
        LampEmitter(name, tuple(rgb_of_powers(x).tolist()), spectrum=x)
        for name, x in spectra.items()
    )
    return Lamp(tuple(emitters))


def _room(folder: Path, *lights: str) -> Path:
    return write_room(folder, lights="".join(LIGHTS[name] for name in lights))


D65 = spectrum_of(*named_spectrum("D65", Path()))
RED, GREEN, BLUE = _led(632, 8), _led(523, 14), _led(455, 10)
LEDS = _lamp(red=RED, green=GREEN, blue=BLUE)

#: A floor of which the camera sees a spot below the lamp, and that reflects each wavelength by the
#: share in PAIRS.
PAIRS = "380:0.05, 480:0.1, 560:0.2, 600:0.7, 780:0.8"
FLOOR = f"""<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="perspective"><float name="fov" value="0.1"/><transform name="to_world">
        <lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
        </film></sensor>
    <shape type="rectangle"><bsdf type="diffuse">
        <spectrum name="reflectance" value="{PAIRS}"/></bsdf></shape>
    <emitter type="point" id="lamp"><point name="position" x="0" y="0" z="2"/>
        <rgb name="intensity" value="1 1 1"/></emitter>
</scene>"""


def test_one_bounce_is_spectrum_times_reflectance_times_observer(tmp_path: Path):
    (tmp_path / "floor.xml").write_text(FLOOR)
    scene = load_scene(tmp_path / "floor.xml").with_lamps({"lamp": LEDS})
    basis = render_basis(scene, spp=256)
    assert basis.names == ("lamp/red", "lamp/green", "lamp/blue")
    metres, observer = matching_functions()
    waves = metres * 1e9
    points = [x.split(":") for x in PAIRS.split(",")]
    reflectance = np.interp(waves, *np.array(points, float).T)
    for emitter in LEDS.emitters:
        power = np.interp(waves, WAVELENGTHS, emitter.spectrum or (), left=0, right=0)
        xyz = (power * reflectance) @ observer / np.pi / 2**2
        expected = np.linalg.solve(rgb_to_xyz(REC709), xyz)
        image = basis.image(f"lamp/{emitter.name}")
        # Each pixel has 16 wavelengths in 256 places: a tenth of a nanometre apart.
        assert image.mean(axis=(0, 1)) == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
        assert image.std(axis=(0, 1)).max() < 0.01 * np.abs(expected).max()


def test_light_at_points_is_intensity_over_squared_distance(tmp_path: Path):
    (tmp_path / "floor.xml").write_text(FLOOR)
    scene = load_scene(tmp_path / "floor.xml")
    up = np.array([[0.0, 0.0, 1.0]])
    points = MeasuringPoints(np.array([[0.0, 0.0, 1e-3]]), up, np.zeros(1, bool))
    at_floor = scene.with_lamps({"lamp": LEDS}).at_points(points)
    basis = render_basis(at_floor, spp=64)
    for name in LEDS.names:
        assert luminance(basis.image(f"lamp/{name}"))[0, 0] == pytest.approx(1 / 4, rel=5e-3)
    in_rgb = render_basis(scene.at_points(points), spp=64)
    assert in_rgb.image("lamp")[0, 0] == pytest.approx(1 / 4, rel=2e-3)


def test_a_room_under_d65_is_that_of_rgb(tmp_path: Path):
    scene = load_scene(_room(tmp_path, "panel", "bulb"))
    in_rgb = render_basis(scene, spp=512, seed=1)
    names = [light.name for light in scene.lights]
    spectral = render_basis(scene.with_lamps(dict.fromkeys(names, _lamp(d65=D65))), spp=512, seed=1)
    for name in names:
        a, b = (_blocks(x) for x in (in_rgb.image(name), spectral.image(f"{name}/d65")))
        white = np.percentile(luminance(a), 95)
        assert delta_e(a / white, b / white).max() < 1  # colours are upsampled to spectra


#: Materials of RGB and their largest ΔE to RGB under D65: colours are upsampled, saturated ones as
#: well, and Mitsuba has a metal's indices of refraction for three colours and for all wavelengths.
MATERIALS = {
    "grey": ('type="diffuse"><rgb name="reflectance" value=".5 .5 .5"/>', 0.3),
    "saturated": ('type="diffuse"><rgb name="reflectance" value=".9 0 0"/>', 0.3),
    "plastic": ('type="roughplastic"><rgb name="diffuse_reflectance" value=".1 .3 .6"/>', 0.3),
    "gold": ('type="roughconductor"><string name="material" value="Au"/>', 5.0),
}


@pytest.mark.parametrize("material", MATERIALS)
def test_materials_under_d65_are_those_of_rgb(material: str, tmp_path: Path):
    bsdf, largest = MATERIALS[material]
    scene = load_scene(_floor_of(tmp_path, bsdf))
    in_rgb = render_basis(scene, spp=64, seed=1).image("lamp").mean(axis=(0, 1))
    spectral = render_basis(scene.with_lamps({"lamp": _lamp(d65=D65)}), spp=64, seed=1)
    a, b = (x / in_rgb.max() for x in (in_rgb, spectral.image("lamp/d65").mean(axis=(0, 1))))
    assert delta_e(a, b) < largest
    assert scene.rgb_metals == []


def test_metals_whose_indices_are_rgb_are_named(tmp_path: Path):
    """Mitsuba shows them too dark (findings/mitsuba_rgb_conductors_are_darker_...)."""
    bsdf = 'type="roughconductor"><rgb name="eta" value="1.5"/><rgb name="k" value="3"/>'
    scene = load_scene(_floor_of(tmp_path, bsdf)).with_lamps({"lamp": _lamp(d65=D65)})
    assert scene.rgb_metals == ["roughconductor"]
    [remark] = [x for x in map(str, remarks_of_scene(scene)) if "eta and k in RGB" in x]
    assert remark.startswith("roughconductor: ")
    assert not [x for x in map(str, remarks_of_scene(scene.in_rgb)) if "eta and k" in x]


def _floor_of(folder: Path, bsdf: str) -> Path:
    plain = f'type="diffuse">\n        <spectrum name="reflectance" value="{PAIRS}"/>'
    assert plain in FLOOR
    (folder / "floor.xml").write_text(FLOOR.replace(plain, bsdf))
    return folder / "floor.xml"


def _blocks(image: np.ndarray) -> np.ndarray:
    return image[:20, :24].reshape(5, 4, 6, 4, 3).mean(axis=(1, 3))


def _with_drives(basis: Basis, drives: dict[str, float]) -> Lighting:
    weights = np.zeros((len(basis.lights), 3))
    for name, drive in drives.items():
        weights[basis.names.index(name)] = drive
    weights[basis.is_fixed] = 1
    lamps = {}
    for k, light in enumerate(basis.lights):
        if light.lamp:
            [emitter] = [x for x in LEDS.emitters if light.name.endswith(f"/{x.name}")]
            level = (1.0, 1.0, 1.0)
            lamps[k] = Lamp((LampEmitter(emitter.name, level, spectrum=emitter.spectrum),))
    return Lighting.of_weights(basis, weights, lamps=lamps)


def test_mitsubas_own_path_shows_the_relit_scene(tmp_path: Path):
    """Of narrow LEDs its pictures have much noise, which the comparison knows."""
    path = _room(tmp_path, "panel", "bulb", "sky")
    scene = load_scene(path, lights=["panel", "bulb"])
    scene = scene.with_lamps({"panel": LEDS, "bulb": LEDS})
    basis = render_basis(scene, spp=1024, seed=1)
    drives = {"panel/red": 3.0, "panel/green": 5.0, "bulb/blue": 0.3, "bulb/red": 0.5}
    lighting = _with_drives(basis, drives)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert relit.is_spectral
    predicted = combine(basis, lighting)
    found = verify(predicted, relit, spp=4096, seed=2)
    assert found.agrees
    a, b = (_blocks(x.image) for x in (predicted, found.verified))
    white = np.percentile(luminance(a), 95)
    assert delta_e(a / white, b / white).mean() < 0.5


def test_lights_that_cannot_be_rendered_with_spectra_are_named(tmp_path: Path):
    scene = load_scene(_room(tmp_path, "panel", "bulb"))
    with pytest.raises(SceneError, match="has no emitters for light 'bulb'"):
        scene.with_lamps({"panel": LEDS})
    plain = Lamp((LampEmitter("red", (1.0, 0.0, 0.0)),))
    with pytest.raises(SceneError, match="has no spectrum of red for light 'panel'"):
        scene.with_lamps({"panel": plain, "bulb": LEDS})


def test_identities_tell_spectra_apart(tmp_path: Path):
    scene = load_scene(_room(tmp_path, "panel"))
    first, second = (scene.with_lamps({"panel": _lamp(a=x)}) for x in (RED, GREEN))
    assert len({scene.identity, first.identity, second.identity}) == 3
    assert first.light_identities != second.light_identities
