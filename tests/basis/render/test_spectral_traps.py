"""Renders with spectra where these and RGB are easily confused: by hand, and against Mitsuba."""

from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from nightly import nightly
from spectral_room import DRIVES, write_spectral_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.colour.color import ciede2000, delta_e, lab, luminance
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.spectrum import (
    EYE,
    WAVELENGTHS,
    Observer,
    Spectrum,
    named_spectrum,
    spectrum_of,
)
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.lamp_parts import part_lamps
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification import LightShares, with_light_tests
from lightpaint.relit.verification_render import verify
from lightpaint.scene.properties import film
from lightpaint.scene.runtime.variant import spectral_variant, use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

WAVES = np.arange(380, 781.0)
LED = spectrum_of(WAVES, np.exp(-0.5 * ((WAVES - 632) / 8) ** 2))
D65 = spectrum_of(*named_spectrum("D65", Path()))
CAMERA = Observer(
    "camera",
    tuple(
        tuple(float(f"{np.exp(-0.5 * ((w - x) / 35) ** 2):.6g}") for x in (600, 540, 460))
        for w in WAVELENGTHS
    ),
)

#: A wall that the camera looks at, of a material, below a lamp, and maybe another light.
WALL = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective"><float name="fov" value="0.1"/><transform name="to_world">
        <lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
        </film></sensor>
    <shape type="rectangle">{material}</shape>
    <emitter type="point" id="lamp"><point name="position" x="0" y="0" z="2"/>
        <rgb name="intensity" value="1 1 1"/></emitter>
    {light}
</scene>"""
DIFFUSE = '<bsdf type="diffuse">{}</bsdf>'
GREY = DIFFUSE.format('<spectrum name="reflectance" value="380:0.5, 780:0.5"/>')


def _wall(
    folder: Path, spectrum: tuple[float, ...], observer: Observer = EYE, **parts: str
) -> Basis:
    """Return the basis of a wall, whose lamp has an emitter of that spectrum."""
    path = folder / "wall.xml"
    path.write_text(WALL.format(**{"material": GREY, "light": "", **parts}))
    scene = load_scene(path, lights=["lamp"])
    lamp = Lamp((LampEmitter("led", (1.0, 1.0, 1.0), spectrum=spectrum),))
    return render_basis(scene.with_lamps({"lamp": lamp}, observer), spp=256)


def _mean(basis: Basis, name: str) -> np.ndarray:
    return np.asarray(basis.image(name).mean(axis=(0, 1)), np.float64)


@pytest.mark.parametrize("observer", [EYE, CAMERA], ids=["eye", "camera"])
def test_one_bounce_is_what_the_observer_sees(observer: Observer, tmp_path: Path):
    found = _mean(_wall(tmp_path, LED, observer), "lamp/led")
    power = np.interp(WAVES, WAVELENGTHS, LED)
    # A grey wall of .5, 2 below a lamp of luminous intensity 1.
    expected = (
        0.5 / np.pi / 4 * (power @ observer.response(WAVES)) / (power @ EYE.curves(WAVES)[:, 1])
    )
    assert found == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())  # bins of 1 nm


@pytest.mark.parametrize(
    "rgb", [".9 .02 .02", "0 .5 0", ".02 .02 .8", ".9 .9 0"], ids=["red", "green", "blue", "yellow"]
)
def test_saturated_reflectances_keep_their_colour_in_daylight(rgb: str, tmp_path: Path):
    """Mitsuba makes spectra of them; what these are under LEDs is a guess."""
    material = DIFFUSE.format(f'<rgb name="reflectance" value="{rgb}"/>')
    found = _mean(_wall(tmp_path, D65, material=material), "lamp/led")
    expected = np.array([float(x) for x in rgb.split()])
    assert delta_e(found * np.pi * 4, expected) < 0.5


def test_the_colour_of_a_light_that_stays_is_relative_to_d65(tmp_path: Path):
    """Of an `rgb` emission. A number is white in RGB, and light of equal energy in spectra."""
    light = '<emitter type="point" id="rest"><point name="position" x="0" y="0" z="2"/>{}</emitter>'
    emissions = {
        '<rgb name="intensity" value="1 .5 .2"/>': [1, 0.5, 0.2],
        '<spectrum name="intensity" value="1"/>': EYE.response(WAVES).sum(axis=0)
        * mi.MI_CIE_Y_NORMALIZATION,
    }
    for text, expected in emissions.items():
        basis = _wall(tmp_path, LED, light=light.format(text))
        [rest] = [x for x in basis.names if x != "lamp/led"]
        assert _mean(basis, rest) == pytest.approx(np.array(expected) * 0.5 / np.pi / 4, rel=3e-3)


def test_a_conductor_reflects_by_its_eta_and_k(tmp_path: Path):
    """A mirror shows the camera a panel, of which Fresnel's equations say what is left."""
    eta, k = ([0.4, 1.6], [3.5, 1.2]), ([2.0, 4.5], [3.0, 2.0])
    pairs = [f"380:{a}, 780:{b}" for (a, b) in (eta[0], k[0])]
    material = (
        f'<bsdf type="conductor"><spectrum name="eta" value="{pairs[0]}"/>'
        f'<spectrum name="k" value="{pairs[1]}"/></bsdf>'
    )
    panel = """<shape type="rectangle" id="panel"><transform name="to_world">
        <rotate x="1" angle="180"/><translate z="6"/></transform>
        <emitter type="area"><rgb name="radiance" value="1 1 1"/></emitter></shape>"""
    path = tmp_path / "mirror.xml"
    path.write_text(WALL.format(material=material, light=panel))
    scene = load_scene(path, lights=["panel"])
    lamp = Lamp((LampEmitter("led", (1.0, 1.0, 1.0), spectrum=D65),))
    found = _mean(render_basis(scene.with_lamps({"panel": lamp}), spp=256), "panel/led")
    n, kappa = (np.interp(WAVES, [380, 780], x) for x in (eta[0], k[0]))
    reflected = ((n - 1) ** 2 + kappa**2) / ((n + 1) ** 2 + kappa**2)
    power = np.interp(WAVES, WAVELENGTHS, D65)
    expected = (power * reflected) @ EYE.response(WAVES) / (power @ EYE.curves(WAVES)[:, 1])
    assert found == pytest.approx(expected, rel=2e-3)  # bins of 1 nm


def _gaussian(peak: float, width: float) -> Spectrum:
    return spectrum_of(WAVES, np.exp(-0.5 * ((WAVES - peak) / width) ** 2))


LEDS = {"red": LED, "green": _gaussian(523, 14), "blue": _gaussian(455, 10)}
#: A blue LED with a phosphor.
PHOSPHOR = np.exp(-0.5 * ((WAVES - 575) / 55) ** 2)
WHITE = spectrum_of(WAVES, PHOSPHOR + 0.5 * np.exp(-0.5 * ((WAVES - 450) / 9) ** 2))


@pytest.mark.parametrize("name", [*LEDS, "white"])
def test_sixteen_paths_show_colours_as_all_wavelengths_do(name: str):
    """Of 190 surfaces, whose greatest difference is below 0.3."""
    use_variant()
    from lightpaint.basis.render.tracer.wavelengths import (
        BINS,
        FIRST_NM,
        packets_for,
        spacing_of,
    )

    spectrum = {**LEDS, "white": WHITE}[name]
    packets = packets_for([spectrum])
    assert packets == (2 if name == "white" else 4)
    assert packets_for([spectrum, LED]) == 4
    shifts = ((np.arange(16) + 0.5) / 16 * spacing_of(packets)).astype(int)
    bins = (shifts[:, None] + spacing_of(packets) * np.arange(4 * packets)).ravel()
    fine = FIRST_NM + 0.5 + np.arange(BINS)
    training = colour_science().characterisation.read_training_data_rawtoaces_v1()
    values = np.array(training.values, np.float64).T
    surfaces = np.array([np.interp(fine, WAVELENGTHS, x) for x in values])
    light = np.interp(fine, WAVELENGTHS, spectrum)[:, None] * EYE.response(fine)
    light /= luminance(light.sum(axis=0))
    few = surfaces[:, bins] @ light[bins] * (BINS / len(bins))
    assert ciede2000(lab(few), lab(surfaces @ light)).max() < 0.3


@pytest.fixture(scope="module")
def relit_room(tmp_path_factory: pytest.TempPathFactory):
    """A room of LEDs, predicted with hardly any noise; its relit scene; the light of its
    LEDs, and the picture of a red one.
    """
    folder = tmp_path_factory.mktemp("room")
    scene = load_scene(write_spectral_room(folder))
    lamps = lamps_by_name(constraints_of(scene.requests), basis_lights(scene))
    basis = render_basis(scene.with_lamps(lamps), spp=4096, seed=1)
    weights, parts = np.ones((len(basis.lights), 3)), {}
    for name, drives in DRIVES.items():
        for part, drive in zip(part_lamps(lamps[name]), drives, strict=True):
            k = basis.names.index(f"{name}/{part.names[0]}")
            weights[k], parts[k] = drive * part.emitters[0].emission[0], part
    lighting = Lighting.of_weights(basis, weights, lamps=parts)
    relit = relight(scene, lighting, folder / "relit.xml")
    red = basis.image("panel/red") * np.float32(lighting["panel/red"].weight[0])
    return combine(basis, lighting), relit, LightShares.of(basis, lighting), red


def test_plain_mitsuba_shows_the_relit_file(relit_room):
    """Its own film converts by 106.857 once, as the file and the basis do."""
    predicted, relit, *_ = relit_room
    with spectral_variant():
        scene = mi.load_file(str(relit.path))
        image = np.array(mi.render(scene, spp=2**14, seed=7))[..., :3]
        del scene
    expected = predicted.image
    assert image.shape == expected.shape
    a, b = (x[:20, :24].reshape(5, 4, 6, 4, 3).mean(axis=(1, 3)) for x in (expected, image))
    white = np.percentile(a @ [0.2126, 0.7152, 0.0722], 95)
    assert delta_e(a / white, b / white).mean() < 0.5


def test_wavelengths_of_the_emitters_leave_less_noise(tmp_path: Path, monkeypatch):
    """On a wall under one LED, all noise is that of wavelengths."""
    basis = _wall(tmp_path, LED)
    part = Lamp((LampEmitter("led", (1.0, 1.0, 1.0), spectrum=LED),))
    lighting = Lighting.of_weights(basis, np.ones((1, 3)), lamps={0: part})
    relit = relight(load_scene(tmp_path / "wall.xml"), lighting, tmp_path / "relit.xml")
    variances, means = [], []
    for share in (1.0, film.EVEN_SHARE):
        monkeypatch.setattr(film, "EVEN_SHARE", share)
        picture = render(relit, spp=256, seed=3, stream=Stream.VERIFICATION)
        variances.append(float(np.square(picture.half_difference).mean()))
        means.append(picture.image.mean(axis=(0, 1)))
    # Mitsuba's four wavelengths of a path are a quarter of the range apart. Of 64 pixels, the ratio
    # of variances is within a third of its mean.
    assert variances[0] > 10 * variances[1]
    error = 4 * (variances[0] / 64) ** 0.5
    assert means[0] == pytest.approx(means[1], abs=error)
    assert means[1] == pytest.approx(_mean(basis, "lamp/led"), abs=error)


@pytest.mark.parametrize("count", [16, nightly(100)], ids=["some", "many"])
def test_a_verification_knows_the_noise_of_narrow_emitters(count: int, relit_room):
    """If the prediction is true, its differences are standard normal: the sum of the picture in
    each channel, and that along the picture of each emitter.
    """
    predicted, relit, shares, _ = relit_room
    found = [
        with_light_tests(verify(predicted, relit, spp=64, seed=k), predicted, shares)
        for k in range(count)
    ]
    z = np.array([[*x.z_mean, *x.z_lights.values()] for x in found])
    assert z.shape == (count, 3 + 5)
    # Four standard errors of means, and of a standard deviation. Tests of pictures of few blocks
    # have a narrower distribution.
    assert np.abs(z.mean(axis=0)).max() < 4 / count**0.5
    assert z.std(axis=0).max() < 1 + 4 / (2 * count) ** 0.5
    assert z[:, :3].std() > 1 - 4 / (2 * count) ** 0.5


def test_a_verification_sees_an_error_in_a_narrow_emitter(relit_room):
    """Of a third, in the light of that emitter."""
    predicted, relit, shares, red = relit_room
    wrong = replace(predicted, image=predicted.image + red / 3)
    found = with_light_tests(verify(wrong, relit, spp=1024, seed=1), wrong, shares)
    assert not found.agrees
    # In a picture of six blocks the two red ones look alike.
    assert max(found.z_lights, key=found.z_lights.__getitem__).endswith("/red")
