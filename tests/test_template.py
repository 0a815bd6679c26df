"""A template is the sum of the basis that is solved with, and is painted on without its grain."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from command import run, succeed
from PIL import Image
from renderer import write_room

import lightpaint as lp
from lightpaint.basis.cache import basis_cache
from lightpaint.errors import TargetError
from lightpaint.images.denoiser import DENOISED_KEY
from lightpaint.images.formats.exr import read_parts
from lightpaint.target.template import read_template

#: A solve for the look itself.
UNTOUCHED = ("solve", "room.xml", "template/template.exr", "--no-template", "--spp", 16)


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The same room is rendered elsewhere, with more samples."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room, its template, and nothing but what the template left in the cache."""
    folder = tmp_path_factory.mktemp("template")
    write_room(folder)
    succeed(folder, "template", "room.xml", "--spp", 16)
    return folder


def test_the_first_solve_renders_no_basis(folder: Path):
    completed = run(folder, *UNTOUCHED, "-o", "a")
    assert completed.returncode == 0, completed.stderr
    assert "basis of 16 samples per pixel kept from an earlier run" in completed.stderr
    assert "basis: " not in completed.stderr
    assert "verification" in completed.stderr  # which passes are listed


def test_an_untouched_template_solves_to_the_present_lighting(folder: Path):
    """The look is the basis's own sum in float32, so only its rounding is missed, 6e-8."""
    target = lp.read_target(folder / "template" / "template.exr", find=False)
    look = lp.paint_with_light(folder / "room.xml", target, folder / "b", spp=16)
    weights, current = look.solution.weights, look.basis.current_weights
    assert np.abs(weights - current).max() < 1e-5 * current.max()
    residual = look.basis.mix(weights).astype(np.float64) - target.image
    assert np.sqrt(np.square(residual).sum() / np.square(target.image).sum()) < 1e-6
    # The noise of the target is that of the basis, so there is none to be taken out.
    assert look.solution.problem.noise_removed == 0


@pytest.mark.nightly
def test_files_that_other_seeds_and_lights_need_are_theirs(folder: Path):
    """What is kept is that of the same lights, groups, film and seed."""
    for option in (("--seed", 1), ("--lights", "panel"), ("--resolution", "1/2")):
        entry_count = len(basis_cache.entries())
        succeed(folder, "template", "room.xml", "--spp", 4, "--force", "-o", "other", *option)
        assert len(basis_cache.entries()) == entry_count + 1
    entry_count = len(basis_cache.entries())
    succeed(
        folder,
        "template",
        "room.xml",
        "--spp",
        4,
        "--force",
        "-o",
        "other",
        "--no-cache",
        "--seed",
        7,
    )
    assert len(basis_cache.entries()) == entry_count


def test_pictures_are_clean_and_say_so(folder: Path):
    template = read_template(folder / "template")
    assert template.clean is not None
    assert not np.array_equal(template.clean, template.image)
    with Image.open(folder / "template" / "template.png") as file:
        assert "albedo and normals; raw: template.exr" in file.text[DENOISED_KEY]
    pixels = OpenImageIO.ImageBuf(str(folder / "template" / "template.png")).get_pixels(
        OpenImageIO.UINT16
    )
    np.testing.assert_allclose(pixels[..., :3] / 65535, template.shown, atol=0.6 / 65535)
    for path in (folder / "template" / "lights").glob("*.png"):
        with Image.open(path) as file:
            assert DENOISED_KEY in file.text
    # What is measured says nothing, for it is as it was rendered.
    [part] = read_parts(folder / "template" / "template.exr")
    assert DENOISED_KEY not in part.attributes
    assert DENOISED_KEY in read_parts(folder / "template" / "clean.exr")[0].attributes


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("name", ["template.png", "template.exr", "clean.exr"])
def test_only_paint_counts_whichever_look_it_was_painted_on(folder: Path, name: str, bits: int):
    template = read_template(folder / "template")
    image = template.clean if name != "template.exr" else template.image
    display = template.transform.encode(image)
    display[5:12, 5:12] = (0.9, 0.5, 0.1)
    path = folder / "template" / f"painted {name} {bits}.png"
    codes = np.round(display * (2**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)
    OpenImageIO.ImageBuf(np.ascontiguousarray(codes)).write(str(path))
    importance = lp.read_target(path, template=folder / "template").importance
    painted = np.zeros(importance.shape, bool)
    painted[5:12, 5:12] = True
    assert importance[painted].min() > 0.99
    assert importance[~painted].max() == 0


@pytest.mark.parametrize("name", ["template.png", "template.exr", "clean.exr"])
def test_a_look_that_nobody_painted_on_is_refused(folder: Path, name: str):
    with pytest.raises(TargetError, match=f"{name} is the template itself"):
        lp.read_target(folder / "template" / name, template=folder / "template")


def test_where_each_light_takes_a_render_only_a_kept_basis_is_used(tmp_path: Path):
    """Of an integrator that has no one pass: a render of all lights, until there is a basis."""
    room = write_room(tmp_path)
    arguments = ("--integrator", "volpathmis", "--spp", 4)
    first = run(tmp_path, "template", room, *arguments)
    assert first.returncode == 0, first.stderr
    assert "each light needs a render of its own" in first.stderr
    integrators = [entry.origin.integrator for entry in basis_cache.entries() if entry.origin]
    assert "volpath" not in integrators
    succeed(tmp_path, "basis", room, *arguments)
    second = run(tmp_path, "template", room, *arguments, "--force")
    assert second.returncode == 0, second.stderr
    assert "each light takes" not in second.stderr
    assert "kept from an earlier run" in second.stderr


def test_results_have_their_raw_twins(folder: Path):
    succeed(folder, *UNTOUCHED, "-o", "c")
    with Image.open(folder / "c" / "comparison.png") as file:
        denoiser = file.text[DENOISED_KEY]
    assert denoiser.endswith("; raw: predicted.exr, verified.exr")
    page = (folder / "c" / "report.html").read_text(encoding="utf-8")
    # Current look, prediction and verification; a painting is shown as it is.
    assert page.count('data-raw=""') == 3
    assert 'id="raw"' in page
    assert "Denoised by" in page
    succeed(folder, "relight", "room.xml", "c/lighting.json", "-o", "d", "--spp", 4)
    with Image.open(folder / "d" / "relit.png") as file:
        assert file.text[DENOISED_KEY].endswith("; raw: relit.exr")
