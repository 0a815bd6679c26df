"""A sky is split into texels on the command line, and comes back as an image."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from PIL import Image
from renderer import LIGHTS, write_room
from texel_grid import texel_names

from lightpaint.images.formats.exr import write_rgb
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import Painting, SceneFile
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

SPLIT = "--split", "sky=4x3"


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Solve for the sky of a room, half of which turned red, and return the folder."""
    folder = tmp_path_factory.mktemp("image_lights")
    room = write_room(folder, lights=LIGHTS["sky"] + LIGHTS["bulb"])
    image = np.full((3, 4, 3), (0.1, 0.2, 0.3), np.float32)
    image[1, :2] = (1.5, 0.3, 0.1)
    write_rgb(folder / "red.exr", image)
    red = LIGHTS["sky"].replace("constant", "envmap")
    red = red.replace(
        '<rgb name="radiance" value="0.1 0.2 0.3"/>', '<string name="filename" value="red.exr"/>'
    )
    target = load_scene(write_room(folder, lights=red + LIGHTS["bulb"], name="red.xml"))
    write_rgb(folder / "target.exr", render(target, spp=512, stream=Stream.TEMPLATE).image)
    output = succeed(folder, "solve", room, "target.exr", *SPLIT, "--spp", 128, "-o", "out")
    (folder / "stdout.txt").write_text(output)
    return folder


def test_the_answer_is_one_row_and_an_image(solved: Path) -> None:
    output = (solved / "stdout.txt").read_text()
    rows = [line for line in output.splitlines() if line.startswith(("sky", "bulb"))]
    assert len(rows) == 2
    assert rows[0].startswith("sky, 4x3 texels")
    assert "Rendered again: equal within noise" in output
    image = read_emitted_image(solved / "out" / "relit.sky.exr", is_linear=True)
    assert image.shape == (3, 4, 3)
    middle = image[1]
    assert middle[:2, 0].min() > 2 * middle[2:, 0].max()


def test_the_report_shows_the_map_and_folds_the_texels(solved: Path) -> None:
    page = (solved / "out" / "report.html").read_text()
    assert page.count("sky now, all around") == 2  # alt and title
    assert page.count("sky solved, all around") == 2
    assert "the 12 texels of sky, row by row from the top" in page


def test_the_results_are_written_and_verified_again(solved: Path) -> None:
    assert run(solved, "verify", "out").returncode == 0
    succeed(solved, "relight", "room.xml", "out/lighting.json", "-o", "again", "--spp", 2)
    again = (solved / "again" / "relit.sky.exr").read_bytes()
    assert again == (solved / "out" / "relit.sky.exr").read_bytes()


def test_a_larger_map_is_what_mitsuba_interpolates(solved: Path) -> None:
    """An odd multiple of the columns, and one of the spaces between rows, is the same function."""
    arguments = ["relight", "room.xml", "out/lighting.json", "--spp", 2]
    succeed(solved, *arguments, "--map-size", "12x5", "-o", "large")
    small, large = (solved / name / "relit.sky.exr" for name in ("out", "large"))
    assert read_emitted_image(large, is_linear=True).shape == (5, 12, 3)
    use_variant()
    import drjit as dr
    import mitsuba as mi

    directions = np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = []
    for path in (small, large):
        si = dr.zeros(mi.SurfaceInteraction3f, len(directions))
        si.wi = -mi.Vector3f(directions.T)
        seen.append(np.array(mi.load_dict({"type": "envmap", "filename": str(path)}).eval(si)))
    # Differences of float32 in the image's coordinates.
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-5 * seen[0].max())
    error = run_refused(solved, *arguments, "--map-size", "2x2", "-o", "small_map")
    assert "the map size is 2x2: expected at least 4x3, a pixel for each texel of 'sky'" in error


@pytest.mark.nightly
def test_the_report_of_a_smaller_basis_reads_the_image_where_it_is(solved: Path) -> None:
    """Features of the larger film are rendered before the results are in their folder."""
    small = "--resolution", "1/2", "--spp", 8
    output = succeed(solved, "solve", "room.xml", "target.exr", *SPLIT, *small, "-o", "small")
    assert "sky, 4x3 texels" in output
    assert (solved / "small" / "relit.sky.exr").exists()


def test_other_programs_get_a_map_of_the_sky(solved: Path) -> None:
    arguments = ["export", "out/lighting.json", "--scene", "room.xml", "--to"]
    output = succeed(solved, *arguments, "blender", "-o", "exported", "--map-size", "64x32")
    assert "sky.latlong.exr" in output
    written = read_emitted_image(solved / "exported" / "sky.latlong.exr", is_linear=True)
    assert written.shape == (32, 64, 3)
    assert "'sky': 'sky.latlong.exr'" in (solved / "exported" / "set_scene.py").read_text()
    assert (
        "sky.x0.y0"
        in succeed(solved, *arguments, "csv", "-o", "exported")
        + (solved / "exported" / "fixtures.csv").read_text()
    )


def test_the_list_of_lights_has_one_row_for_the_image(solved: Path) -> None:
    output = succeed(solved, "lights", "room.xml", *SPLIT, "--no-sheet")
    assert [line.split()[0] for line in output.splitlines()] == ["light", "sky", "bulb"]
    document = json.loads(succeed(solved, "lights", "room.xml", *SPLIT, "--json"))
    names = [light["name"] for light in document["lights"]]
    assert names == [*texel_names("sky", (4, 3)), "bulb"]


@pytest.mark.parametrize("radiance", ["0.1 0.2 0.3", "0 0 0"], ids=["lit", "off"])
def test_a_template_has_one_picture_for_the_image(tmp_path: Path, radiance: str) -> None:
    """Of all texels as they are now, or of white ones if the image is off."""
    sky = LIGHTS["sky"].replace("0.1 0.2 0.3", radiance)
    scene = write_room(tmp_path, lights=sky + LIGHTS["bulb"])
    succeed(tmp_path, "template", scene, *SPLIT, "--spp", 16, "-o", "template")
    pictures = sorted((tmp_path / "template" / "lights").iterdir())
    assert [x.name for x in pictures] == ["bulb.png", "sky.png"]
    means = np.asarray(Image.open(pictures[1]), np.float64).mean(axis=(0, 1))
    assert means.max() > 100
    is_grey = np.ptp(means) < 10
    assert is_grey == (radiance == "0 0 0")


def test_none_ignores_what_the_lights_file_splits(solved: Path) -> None:
    (solved / "split.toml").write_text("[light.sky]\nsplit = [4, 3]\n")
    arguments = ["lights", "room.xml", "--lights-file", "split.toml", "--no-sheet"]
    assert "4x3 texels" in succeed(solved, *arguments)
    assert "texels" not in succeed(solved, *arguments, "--split", "none")


@pytest.mark.parametrize(
    ("split", "part"),
    [
        ("sky=1x1", "split: sky is 1x1: an image around the scene has at least"),
        ("sky=400x250", "at most 4,096"),
        ("moon=8x4", "has no light 'moon' to split into texels; it has sky"),
        ("bulb=8x4", "is of the kind point: only envmap, constant, area and projector lights"),
        ("sky", "is not NAME=COLUMNSxROWS, such as sky=16x8"),
    ],
)
def test_a_wrong_split_is_one_line(solved: Path, split: str, part: str) -> None:
    assert part in run_refused(solved, "lights", "room.xml", "--split", split, "--no-sheet")


def test_an_image_that_does_not_load_is_one_line(solved: Path) -> None:
    (solved / "broken.exr").write_bytes(b"no image")
    sky = '<emitter type="envmap" id="sky"><string name="filename" value="broken.exr"/></emitter>'
    write_room(solved, lights=sky, name="broken.xml")
    assert "broken" in run_refused(solved, "lights", "broken.xml", *SPLIT, "--no-sheet")


def test_a_job_with_a_split_is_sent_elsewhere(solved: Path) -> None:
    scene = SceneFile(str(solved / "room.xml"), split={"sky": "4x3"})
    job = Job((scene,), (Painting(str(solved / "target.exr")),), solved / "elsewhere")
    sent = Job.from_json(job.to_json())
    assert sent == job
    assert len(scene.content.lights) == 13
