"""Pictures without grain: closer to the truth, said so, and without Open Image Denoise, too."""

import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from command import run, succeed
from PIL import Image
from renderer import write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.cli import doctor
from lightpaint.images import denoiser
from lightpaint.images.denoiser import (
    DENOISED_KEY,
    MISSING_REMARK,
    Features,
    denoised,
    denoiser_text,
    oidn_is_installed,
)
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.surfaces import render_features, render_surfaces

HEIGHT, WIDTH = 48, 64


@pytest.fixture(params=["Open Image Denoise", "joint bilateral filter"])
def method(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Once with the library, once as on machines that have none."""
    if request.param != "Open Image Denoise":
        monkeypatch.setitem(sys.modules, "pyoidn", None)
    elif not oidn_is_installed():
        pytest.skip("pyoidn is not installed here")
    return str(request.param)


def _picture() -> tuple[Any, Any, Features]:
    """A wall of two colours under light that falls off, its noisy render, and its features."""
    x = np.linspace(0, 1, WIDTH)[None, :, None] * np.ones((HEIGHT, 1, 1))
    albedo = np.where(x < 0.5, (0.8, 0.3, 0.2), (0.2, 0.3, 0.7)).astype(np.float32)
    truth = (albedo * (2 - 1.5 * x)).astype(np.float32)
    rng = np.random.default_rng(1)
    # As of few samples: the brightness of a pixel is off by half of it.
    noisy = truth * rng.gamma(4, 1 / 4, (HEIGHT, WIDTH, 1)).astype(np.float32)
    normal = np.broadcast_to(np.float32([0, 0, 1]), truth.shape)
    return truth, noisy, Features(albedo, normal)


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
@pytest.mark.parametrize("guided", [True, False])
def test_it_is_closer_to_the_truth(method: str, guided: bool, scale: float):
    truth, noisy, features = _picture()
    denoised_image = denoised(scale * noisy, features if guided else None) / scale
    assert denoised_image.dtype == np.float32
    raw, remaining_noise = (np.square(image - truth).mean() for image in (noisy, denoised_image))
    # A mean over n independent pixels has 1/n of the energy of the noise. Some thirty are alike
    # in a window of 7x7; a quarter is what edges and a missing guide may take of that.
    assert remaining_noise < raw / 4
    assert denoised_image.mean() == pytest.approx(truth.mean(), rel=0.05)


def test_light_below_zero_keeps_its_colour(method: str):
    """Lamps outside Rec.709 have negative channels, with noise of either sign."""
    truth, noisy, features = _picture()
    blue = np.float32([[0.05, 0, 0], [0, 0.2, 0], [-0.15, -0.05, 1]])
    mean = denoised(noisy @ blue, features).mean(axis=(0, 1))
    # Five percent of the mean light, as above.
    largest = float((truth @ blue).mean(axis=(0, 1)).max())
    np.testing.assert_allclose(mean, (truth @ blue).mean(axis=(0, 1)), atol=0.05 * largest)


def test_features_of_another_size_are_not_used(method: str):
    _, noisy, features = _picture()
    np.testing.assert_array_equal(denoised(noisy, features.reduced(2)), denoised(noisy))


@pytest.mark.parametrize(
    ("found", "is_used"), [("2.5.0.1", False), ("2.5.1.0", True), ("?", False)]
)
def test_a_denoiser_that_is_too_old_is_not_used(
    monkeypatch: pytest.MonkeyPatch, found: str, is_used: bool
):
    """It ended in an error of its own, at the end of every solve."""
    old = ModuleType("pyoidn")  # without the functions of later versions
    old.__spec__ = ModuleSpec("pyoidn", None)
    monkeypatch.setitem(sys.modules, "pyoidn", old)
    monkeypatch.setattr(denoiser, "version", lambda _: found)
    monkeypatch.setattr(doctor, "_package", lambda name: doctor.Finding(name, "ok", found))
    assert oidn_is_installed() == is_used
    assert (doctor._denoiser().state == "ok") == is_used
    if not is_used:
        _, noisy, features = _picture()
        expected = denoiser._denoise_with_filter(noisy / noisy.mean(), features) * noisy.mean()
        np.testing.assert_allclose(denoised(noisy, features), expected, rtol=1e-4)  # float32


@pytest.mark.parametrize("value", [0.0, 0.5])
def test_nothing_comes_of_nothing(method: str, value: float):
    flat = np.full((5, 7, 3), value, np.float32)
    # A network is not an arithmetic: half a percent is what it makes of a flat picture at its best.
    np.testing.assert_allclose(denoised(flat), flat, rtol=0.01)


def test_borders_are_as_good_as_the_rest():
    """Without a margin Open Image Denoise is off by a third there."""
    if not oidn_is_installed():
        pytest.skip("pyoidn is not installed here")
    flat = np.full((180, 320, 3), 0.5, np.float32)
    normal = np.broadcast_to(np.float32([0, 0, 1]), flat.shape)
    for quality in ("fast", "high"):
        denoised_image = denoised(flat, Features(flat, normal), quality=quality)
        np.testing.assert_allclose(denoised_image, flat, rtol=0.01)


def test_it_says_how(method: str):
    _, _, features = _picture()
    text = denoiser_text(features, raw="a.exr")[DENOISED_KEY]
    assert text.startswith(method)
    assert text.endswith(" with albedo and normals; raw: a.exr")
    assert "albedo" not in denoiser_text(None, raw="a.exr")[DENOISED_KEY]


def test_features_are_what_surfaces_are(tmp_path: Path):
    scene = load_scene(write_room(tmp_path))
    features, surfaces = render_features(scene), render_surfaces(scene)
    # Other samples of the same pixels: they differ where an edge runs through one.
    for actual, expected in (
        (features.albedo, surfaces.albedo),
        (features.normal, surfaces.normal),
    ):
        assert np.median(np.abs(actual - expected)) < 1e-3  # half floats
        assert np.abs(actual - expected).mean() < 0.05


def test_a_render_is_closer_to_one_of_many_samples(tmp_path: Path):
    """Against a render of 64 times the samples, whose own noise is a 64th in energy."""
    if not oidn_is_installed():
        pytest.skip("pyoidn is not installed here")
    scene = load_scene(write_room(tmp_path), parameters={"width": "96"})
    few, many = (render_basis(scene, spp=spp, seed=seed) for spp, seed in ((8, 0), (512, 1)))
    raw, truth = (basis.mix(basis.current_weights) for basis in (few, many))
    noise = np.square(raw - truth).mean()
    for quality in ("fast", "high"):
        remaining_noise = np.square(denoised(raw, few.features, quality=quality) - truth).mean()
        # Measured: 0.16 to 0.2. A picture twenty pixels high is edges for a good part, where a
        # denoiser gains nothing; twice that leaves room for other versions of its networks.
        assert remaining_noise < 0.4 * noise


def test_without_the_library_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    room = write_room(tmp_path)
    completed = run(tmp_path, "template", room, "--spp", 4)
    assert completed.returncode == 0
    assert completed.stderr.count("Open Image Denoise is not installed") == 1
    assert MISSING_REMARK[:40] in completed.stderr
    with Image.open(tmp_path / "template" / "template.png") as file:
        assert file.text[DENOISED_KEY].startswith("joint bilateral filter")
    succeed(tmp_path, "solve", room, "template/template.exr", "--no-template", "--spp", 4)
