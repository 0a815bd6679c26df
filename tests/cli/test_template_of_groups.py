"""Light groups to paint on, and paintings over them: with a template, and without one."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from light_groups import interleaved
from nightly import nightly
from PIL import Image

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.formats.exr import read_parts
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.templates import template_of_basis
from lightpaint.target.template import read_template

SIZE = (48, 64)


def light_pool(seed: int) -> np.ndarray:
    """Return a soft pool of light on surfaces of several colours, (h, w, 3)."""
    rng = np.random.default_rng(seed)
    albedo = np.kron(np.random.default_rng(9).uniform(0.2, 0.8, (6, 8, 3)), np.ones((8, 8, 1)))
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    far = np.hypot(y - rng.uniform(0, 1), x - rng.uniform(0, 1.3))
    return (albedo * 0.7 * np.exp(-3 * far)[..., None]).astype(np.float32)


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    """Light groups of three lamps, with their sum."""
    lamps = {f"RGBA_{name}": light_pool(k) for k, name in enumerate(("key", "fill", "rim"))}
    return interleaved(tmp_path / "shot.exr", {"RGBA": sum(lamps.values()), **lamps})


def save(path: Path, light: np.ndarray, view: ViewTransform | None = None) -> None:
    """Write a picture as another program shows it, in 8 bits."""
    display = (view or ViewTransform()).encode(light)
    Image.fromarray(np.round(255 * display).astype(np.uint8)).save(path)


def brighten_key(shot: Path) -> np.ndarray:
    """Return what the groups show with the key a stop up, painted where it does most."""
    basis = read_light_groups(shot).basis
    key = basis.image("key")
    return basis.current_look + key * (key.mean(axis=-1) > 0.25)[..., None]


def test_light_groups_are_painted_on_and_answered(shot: Path, tmp_path: Path):
    output = succeed(tmp_path, "template", "--lights", "shot.exr")
    first = (
        "template/template.png: the current look; paint over it in any program, "
        "save that under another name beside it, and solve for it\n"
    )
    assert first in output
    basis = read_light_groups(shot).basis
    template = read_template(tmp_path / "template")
    np.testing.assert_array_equal(template.image, basis.current_look)
    assert template.transform == ViewTransform()
    names = {path.name for path in (tmp_path / "template" / "lights").iterdir()}
    assert names == {"key.png", "fill.png", "rim.png"}
    save(tmp_path / "template" / "warm.png", brighten_key(shot))
    completed = run(tmp_path, "solve", "shot.exr", "template/warm.png")
    assert completed.returncode == 0, completed.stderr
    assert "painted: what differs from template/template.png" in completed.stderr
    report = json.loads((tmp_path / "warm" / "report.json").read_text())
    assert report["lights"]["key"]["stops"] > 0.3


LOOKS_OF_SHOT = """
[defaults]
{source}
want = ["solve"]

[[look]]
painting = "template/warm.png"
"""


@pytest.mark.parametrize("source", ["light_groups = 'shot.exr'", nightly("basis = 'b.basis.exr'")])
def test_a_batch_takes_paintings_beside_a_template_without_optional_files(
    shot: Path, tmp_path: Path, source: str
):
    basis = read_light_groups(shot).basis
    write_basis(tmp_path / "b.basis.exr", basis)
    written = {file.name for file in template_of_basis(basis, tmp_path / "template")}
    assert not written & {"clean.exr", "albedo.exr"}
    save(tmp_path / "template" / "warm.png", brighten_key(shot))
    (tmp_path / "looks.toml").write_text(LOOKS_OF_SHOT.format(source=source))
    succeed(tmp_path, "batch", "looks.toml", "-o", "out", "--dry-run")
    succeed(tmp_path, "batch", "looks.toml", "-o", "out")
    succeed(tmp_path, "solve", "shot.exr", "template/warm.png", "-o", "alone")
    of_batch, alone = (
        read_lighting(tmp_path / folder / "lighting.json").emission
        for folder in ("out/warm", "alone")
    )
    assert of_batch == alone


@pytest.mark.nightly
@pytest.mark.parametrize("view", [nightly(ViewTransform()), ViewTransform("filmic", 1.0)])
def test_a_painting_over_the_beauty_is_known_as_such(
    shot: Path, tmp_path: Path, view: ViewTransform
):
    """It was read as sRGB, and all of it counted: `3.6 (3.4 as the scene is now)`."""
    save(tmp_path / "warm.png", brighten_key(shot), view)
    completed = run(tmp_path, "solve", "shot.exr", "warm.png", "--hold", "1")
    assert completed.returncode == 0, completed.stderr
    assert f"what differs from the look of shot.exr through {view.spoken}" in completed.stderr
    report = json.loads((tmp_path / "warm" / "report.json").read_text())
    assert report["view"]["name"] == view.name
    assert report["painting"]["importance_mean"] < 0.5
    assert report["seen"]["delta_e"] < 0.7 * report["seen"]["asked"]
    assert report["lights"]["key"]["stops"] > 0.3
    # Nobody looks for a look where a view is said, or that all of it counts.
    for option in (("--no-template",), ("--view", "linear", "--exposure", "0")):
        completed = run(tmp_path, "solve", "shot.exr", "warm.png", *option, "--force")
        assert "the look of" not in completed.stderr


def test_a_saved_basis_is_painted_on(shot: Path, tmp_path: Path):
    write_basis(tmp_path / "b.basis.exr", read_light_groups(shot).basis)
    succeed(tmp_path, "template", "b.basis.exr", "-o", "look.exr")
    [part] = read_parts(tmp_path / "look.exr")
    np.testing.assert_array_equal(part.rgb(), read_light_groups(shot).basis.current_look)
    assert (tmp_path / "look.png").is_file()


def test_what_is_no_template_of_groups_is_refused(shot: Path, tmp_path: Path):
    assert "give a scene, a basis, or light groups" in run_refused(tmp_path, "template")
    refusal = run_refused(tmp_path, "template", "room.xml", "--lights", "shot.exr")
    assert "room.xml and --lights shot.exr at once" in refusal
    assert "--spp cannot be used" in run_refused(tmp_path, "template", "shot.exr", "--spp", 4)
    assert "shot.exr" in run_refused(tmp_path, "template", "shot.exr", "-o", "shot.exr", "--force")
    assert "no such file" in run_refused(tmp_path, "template", "--lights", "none.exr")
