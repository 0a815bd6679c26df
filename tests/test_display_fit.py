"""Fits in display space and of saturated paintings, from files to results."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.cli import main
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.formats.png import write_png_16
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.template import Template, write_template

TRUTH = np.array([[5.0, 3, 2], [0.2, 0.9, 0.4], [1, 2, 0.5]])


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lights = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["beam"]
    return write_room(tmp_path_factory.mktemp("display"), lights=lights)


@pytest.fixture(scope="module")
def basis(room: Path) -> Basis:
    return render_basis(load_scene(room), spp=64)


@pytest.fixture
def folder(basis: Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """In it, room.basis.exr, a picture of known light, clip.png, and one out of reach, odd.exr."""
    monkeypatch.chdir(tmp_path)
    write_basis(tmp_path / "room.basis.exr", basis)
    image = basis.mix(TRUTH)
    codes = np.round(255 * ViewTransform("srgb", 2.0).encode(image)).astype(np.uint8)
    assert 0.02 < (codes == 255).mean() < 0.8
    Image.fromarray(codes).save("clip.png")
    y = np.linspace(0, 1, image.shape[0], dtype=np.float32)[:, None, None]
    write_rgb(tmp_path / "odd.exr", image * y**2)
    return tmp_path


def _solved(name: str) -> dict[str, Any]:
    return json.loads(Path(name, "lighting.json").read_text())


def _weights(name: str) -> Any:
    return np.array([light["weight"] for light in _solved(name)["lights"].values()])


def test_the_light_of_a_picture_that_clips_is_found(folder: Path):
    """By the command line, at the exposure it was saved with."""
    command = ["solve", "room.basis.exr", "clip.png", "--exposure", "2", "-o", "a"]
    assert main([*command, "--literal"]) == 0
    # Codes are light to 1 %, where they are some hundred.
    np.testing.assert_allclose(_weights("a"), TRUTH, rtol=0.02, atol=0.02)
    # Taken by its word, it asks for less light.
    target = lp.read_target("clip.png", transform=ViewTransform("srgb", 2.0))
    plain = lp.Target("t", target.image, target.importance, target.everything)
    solution = lp.solve(lp.read_basis("room.basis.exr"), plain)
    dimmer = solution.lighting.weights_for(lp.read_basis("room.basis.exr"))
    assert (dimmer.sum(axis=0) < 0.9 * TRUTH.sum(axis=0)).any()
    assert "at least so bright" in Path("a/report.html").read_text()
    assert _solved("a")["solve"]["rounds"] > 1


def test_display_space_on_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["solve", "room.basis.exr", "odd.exr", "-o", "lin"]) == 0
    assert "as srgb" not in capsys.readouterr().out
    display = ["--space", "display", "--exposure", "1"]
    assert main(["solve", "room.basis.exr", "odd.exr", "-o", "dis", *display]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "Fitted as the eye sees it (srgb at +1.0 stops)" in output
    page = Path("dis/report.html").read_text()
    assert "Fitted in display space" in page
    assert "Missed in linear light" in page
    solved = _solved("dis")["solve"]
    assert solved["display"] == "srgb at +1.0 stops"
    assert solved["converged"]
    assert "display" not in _solved("lin")["solve"]
    lighting = lp.read_lighting("dis/lighting.json")
    assert lighting.certificate is not None
    assert lighting.certificate.display == "srgb at +1.0 stops"

    # On the display it is closer, and in light it cannot be.
    basis, painted = lp.read_basis("room.basis.exr"), lp.read_target("odd.exr").image
    D = ~basis.emitters_seen[..., None]
    transform = ViewTransform("srgb", 1.0)
    errors = {}
    for name in ("lin", "dis"):
        x = basis.mix(_weights(name))
        squared = np.square(transform.encode(x) - transform.encode(painted))
        errors[name] = (D * squared).sum(), (D * np.square(x - painted)).sum()
    assert errors["dis"][0] < errors["lin"][0]
    assert errors["dis"][1] > errors["lin"][1]
    assert sum(solved["objective"]) == pytest.approx(errors["dis"][0], rel=1e-4)


def test_the_view_is_that_of_the_picture(folder: Path):
    assert main(["solve", "room.basis.exr", "clip.png", "--space", "display", "-o", "a"]) == 0
    assert _solved("a")["solve"]["display"] == "srgb"
    options = ["--view", "agx", "--space", "display", "-o", "b"]
    assert main(["solve", "room.basis.exr", "clip.png", *options]) == 0
    assert _solved("b")["solve"]["display"] == "agx"


@pytest.mark.nightly
def test_an_exposure_alone_is_one_of_the_templates_view(folder: Path, basis: Basis):
    """And a view alone is at the template's exposure: half of what is asked is the template's."""
    image, transform = basis.mix(TRUTH), ViewTransform("agx", -3.0)
    black = np.zeros_like(image)
    write_template(
        folder,
        Template(image / 2, transform),
        normals=black,
        depth=black[..., 0],
        mattes={},
        lights={},
    )
    write_png_16(folder / "painted.png", transform.encode(image))
    for arguments, view_text in (
        ([], "agx at -3.0 stops"),
        (["--exposure", "-2.5"], "agx at -2.5 stops"),
        (["--view", "filmic"], "filmic at -3.0 stops"),
    ):
        command = ["solve", "room.basis.exr", "painted.png", "--space", "display", "-o", "a"]
        assert main([*command, *arguments]) == 0
        assert _solved("a")["solve"]["display"] == view_text
    command = ["solve", "room.basis.exr", "painted.png", "--exposure", "-2.5", "-o", "a"]
    assert main([*command, "--literal"]) == 0
    # What is half a stop less exposed than it was taken for is that much brighter in all places.
    np.testing.assert_allclose(_weights("a"), TRUTH / 2**0.5, rtol=0.01, atol=0.01)


@pytest.mark.nightly
def test_noise_is_corrected_and_the_scene_refined(room: Path, folder: Path):
    """Steps of the last linear problem: towards what a good basis gives."""
    target = lp.read_target("odd.exr")
    options: dict[str, Any] = {"space": "display", "transform": ViewTransform("srgb", 1.0)}
    best = lp.solve(lp.read_basis("room.basis.exr"), target, transform=options["transform"])
    truth = best.lighting.weights_for(lp.read_basis("room.basis.exr"))
    for extra in ({}, {"noise_correction": True}, {"refine": 1}):
        look = lp.paint_with_light(
            room, target, folder / "out", spp=16, seed=3, use_cache=False, **options, **extra
        )
        assert look.verification is not None
        assert look.verification.agrees
        assert look.solution.certificate.display == "srgb at +1.0 stops"
        weights = look.lighting.weights_for(look.basis)
        assert look.uncertainty is not None
        deviation = np.abs(weights - truth) / np.maximum(look.uncertainty.standard_error, 1e-3)
        # Of nine weights, each with an error that is known to a third.
        assert np.sqrt(np.square(deviation).mean()) < 4


def test_a_space_that_there_is_none(folder: Path):
    with pytest.raises(LightpaintError, match="space is 'Display': expected 'linear' or 'display'"):
        lp.paint_with_light(None, "odd.exr", "a", basis="room.basis.exr", space="Display")
