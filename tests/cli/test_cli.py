"""The command line as a user meets it: real files, exit codes, and processes where they matter."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from command import run, run_refused, spawn, succeed
from nightly import nightly
from PIL import Image
from renderer import LIGHTS, REPOSITORY, write_room

from lightpaint import paint_with_light
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import BasisError
from lightpaint.images.estimate import read_estimate
from lightpaint.images.formats.exr import ExrPart, read_parts, rgb_channels, write_parts, write_rgb
from lightpaint.pipeline.look import verify_result
from lightpaint.scene.quality_presets import PRESETS
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

CORNELL = REPOSITORY / "scenes" / "cornell" / "scene.xml"
GALLERY = REPOSITORY / "scenes" / "gallery" / "scene.xml"
WARM = REPOSITORY / "targets" / "cornell" / "warm.exr"
COOL = REPOSITORY / "targets" / "cornell" / "cool.exr"
COOL_MASK = REPOSITORY / "targets" / "cornell" / "cool.mask.exr"

RESULTS = {
    "lighting.json",
    "relit.xml",
    "predicted.exr",
    "verified.exr",
    "comparison.png",
    "report.json",
    "report.html",
    "result.json",
}


@pytest.fixture(scope="module")
def basis_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("basis") / "cornell.basis.exr"
    assert "5 lights" in succeed(path.parent, "basis", CORNELL, "-o", path, "--spp", 8)
    return path


@pytest.fixture(scope="module")
def solved_job(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The main job: a scene and a painting in, a verified lighting out."""
    folder = tmp_path_factory.mktemp("solved")
    return folder / "warm", succeed(folder, "solve", CORNELL, WARM, "--spp", 32, by=spawn)


def test_solve_leaves_everything_it_promises(solved_job: tuple[Path, str]) -> None:
    folder, output = solved_job
    assert {p.name for p in folder.iterdir()} == RESULTS
    assert "Rendered again: equal within noise." in output
    for name in ("ceiling", "left_spot", "right_spot", "lamp", "window"):
        assert name in output
    data = json.loads((folder / "lighting.json").read_text(encoding="utf-8"))
    assert data["format"].startswith("lightpaint-lighting ")
    assert max(data["solve"]["kkt_residual"]) <= 1e-10
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert f"lightpaint solve {CORNELL} {WARM} --spp 32" in page


@pytest.mark.parametrize("size", [(1, 1), (1, 5)])
def test_a_film_of_a_pixel_or_a_line_is_solved(tmp_path: Path, size: tuple[int, int]) -> None:
    """Lights are found and moved: pictures that are made smaller on the way have a pixel left."""
    room = write_room(tmp_path, lights=LIGHTS["bulb"] + LIGHTS["beam"])
    text = room.read_text(encoding="utf-8")
    for side, length in zip(("width", "height"), size, strict=True):
        text = re.sub(rf'(<integer name="{side}" value=")[^"]+', rf"\g<1>{length}", text)
    room.write_text(text, encoding="utf-8")
    Image.new("RGB", size, (120, 100, 80)).save(tmp_path / "p.png")
    succeed(tmp_path, "solve", "room.xml", "p.png", "--spp", 4, "--move", "bulb=0.1")
    assert {p.name for p in (tmp_path / "p").iterdir()} >= RESULTS


def test_the_command_that_a_report_shows_works_from_any_folder(
    basis_file: Path, tmp_path: Path
) -> None:
    """Also where paths were given from the folder it was, which has a name that shells part."""
    room_folder, elsewhere = tmp_path / "it's a room", tmp_path / "elsewhere"
    for folder in (room_folder, elsewhere):
        folder.mkdir()
    shutil.copy(basis_file, room_folder / "a room.basis.exr")
    shutil.copy(WARM, room_folder / "warm & cosy.exr")
    succeed(room_folder, "solve", "a room.basis.exr", "warm & cosy.exr", "-o", "out", "-q")
    answer = (room_folder / "out" / "lighting.json").read_bytes()
    command = json.loads((room_folder / "out" / "report.json").read_text(encoding="utf-8"))[
        "command"
    ]
    assert command in unescape((room_folder / "out" / "report.html").read_text(encoding="utf-8"))
    shutil.rmtree(room_folder / "out")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    options: dict[str, Any] = {"cwd": elsewhere, "env": {**os.environ, "PATH": path}}
    subprocess.run(["sh", "-c", command], **options, check=True, capture_output=True)
    assert (room_folder / "out" / "lighting.json").read_bytes() == answer
    assert not [*elsewhere.iterdir()]


def test_verify_and_relight_take_the_result(solved_job: tuple[Path, str], tmp_path: Path) -> None:
    folder, _ = solved_job
    assert "agree within noise" in succeed(tmp_path, "verify", folder, "--seed", 5)
    # All light is in the picture, and single lights are in the basis alone.
    [document] = json.loads(succeed(tmp_path, "verify", folder, "--json"))["results"]
    assert [*document["power"]["lights"]] == ["all lights"]
    copies = []
    for name in ("one", "two"):
        data = json.loads((folder / "lighting.json").read_text(encoding="utf-8"))
        data["target"] = name
        copies.append(tmp_path / f"{name}.json")
        copies[-1].write_text(json.dumps(data), encoding="utf-8")
    succeed(tmp_path, "relight", CORNELL, *copies, "-o", "looks", "--spp", 4)
    for name in ("one", "two"):
        file_names = {p.name for p in (tmp_path / "looks" / name).iterdir()}
        assert file_names == {"relit.xml", "relit.exr", "relit.png", "result.json"}


def test_verify_tells_a_tampered_scene(solved_job: tuple[Path, str], tmp_path: Path) -> None:
    folder = tmp_path / "warm"
    shutil.copytree(solved_job[0], folder)
    # The copy lies elsewhere: point it at the original's assets.
    relit = folder / "relit.xml"
    origin = os.path.relpath(CORNELL.parent, folder)
    lines = relit.read_text(encoding="utf-8").splitlines()
    lines = [f'<path value="{origin}"/>' if "<path " in line else line for line in lines]
    relit.write_text("\n".join(lines).replace('max_depth" value="6"', 'max_depth" value="3"'))
    completed = run(tmp_path, "verify", folder)
    assert completed.returncode == 1
    assert "DISAGREE" in completed.stdout


@pytest.mark.nightly
def test_several_targets_share_one_basis(tmp_path: Path) -> None:
    completed = run(
        tmp_path,
        "solve",
        CORNELL,
        WARM,
        COOL,
        "--mask",
        COOL_MASK,
        "--no-cache",
        "--spp",
        4,
        "-o",
        "out",
    )
    assert completed.returncode == 0, completed.stderr
    for name in ("warm", "cool"):
        assert {p.name for p in (tmp_path / "out" / name).iterdir()} == RESULTS
    assert completed.stderr.count("basis:") == 1


@pytest.mark.nightly
def test_each_target_with_its_own_mask(basis_file: Path, tmp_path: Path) -> None:
    write_parts(tmp_path / "m.exr", [ExrPart("", {"Y": np.ones((128, 128), np.float32)})])
    masks = ("--mask", "m.exr", "--mask", COOL_MASK)
    succeed(tmp_path, "solve", basis_file, WARM, COOL, *masks, "-o", "both")
    succeed(tmp_path, "solve", basis_file, COOL, "--mask", COOL_MASK, "-o", "cool")
    together = tmp_path / "both" / "cool" / "lighting.json"
    assert together.read_bytes() == (tmp_path / "cool" / "lighting.json").read_bytes()
    assert "3 masks for 2 targets" in run_refused(
        tmp_path, "solve", basis_file, WARM, COOL, *masks, "--mask", "m.exr"
    )


def test_a_basis_of_another_view_is_noticed(tmp_path: Path) -> None:
    sensor = """<sensor type="perspective" id="side"><transform name="to_world">
        <lookat origin="2 1 2" target="0 0.5 0" up="0 1 0"/></transform><film type="hdrfilm">
        <integer name="width" value="24"/><integer name="height" value="20"/></film></sensor>"""
    path = write_room(tmp_path, sensors=sensor)
    scene, side = load_scene(path), load_scene(path, sensor="side")
    basis = render_basis(side, spp=16)
    target = Target("t", basis.images[0], np.ones(basis.size, np.float32), everything=True)
    with pytest.raises(BasisError, match="another sensor"):
        paint_with_light(scene, target, tmp_path / "out", basis=basis)
    room = path.read_text(encoding="utf-8")
    path.write_text(room.replace("0.7 0.5 0.4", "0.7 0.5 0.5"), encoding="utf-8")
    with pytest.raises(BasisError, match="another state"):
        paint_with_light(load_scene(path, sensor="side"), target, tmp_path / "out", basis=basis)
    assert not (tmp_path / "out").exists()
    # What was solved through one sensor is verified through it.
    path.write_text(room, encoding="utf-8")
    look = paint_with_light(side, target, tmp_path / "out", basis=basis)
    assert look.verification is not None
    assert look.verification.agrees
    second_result = verify_result(tmp_path / "out")
    assert second_result.agrees
    assert np.abs(second_result.verified.image - look.verification.verified.image).max() > 0


def test_solving_from_a_basis_needs_no_mitsuba(basis_file: Path, tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "class Wall:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('mitsuba', 'drjit'): raise ImportError(name)\n"
        "sys.meta_path.insert(0, Wall())\n"
        "from lightpaint.cli import main\n"
        "sys.exit(main(sys.argv[1:]))"
    )
    completed = subprocess.run(
        [sys.executable, "-c", code, "solve", str(basis_file), str(WARM)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stderr
    assert {p.name for p in (tmp_path / "warm").iterdir()} == RESULTS - {
        "relit.xml",
        "verified.exr",
    }


def test_lights_as_table_and_json(tmp_path: Path) -> None:
    assert "left_spot" in succeed(tmp_path, "lights", CORNELL, "--no-sheet")
    data = json.loads(succeed(tmp_path, "lights", CORNELL, "--json"))
    assert data["lights"][0]["name"] == "ceiling"
    np.testing.assert_allclose(data["lights"][0]["emission"], [7, 6.8, 6.4], rtol=1e-6)


def test_lights_in_candela_and_lumen_where_the_scene_has_a_unit(tmp_path: Path) -> None:
    plain = succeed(tmp_path, "lights", CORNELL, "--no-sheet")
    assert "K" in plain
    assert "lm" not in plain
    assert "cd/m²" in succeed(tmp_path, "lights", CORNELL, "--unit", 100, "--no-sheet")
    data = json.loads(succeed(tmp_path, "lights", CORNELL, "--json", "--unit", 100))
    assert data["cd_per_unit"] == 100
    lamp = next(light for light in data["lights"] if light["name"] == "lamp")
    photometry, y = lamp["photometry"], np.dot(lamp["emission"], [0.2126, 0.7152, 0.0722])
    assert photometry["luminous_unit"] == "cd"
    assert photometry["luminous"] == pytest.approx(100 * y)
    assert photometry["flux_lm"] == pytest.approx(4 * np.pi * 100 * y, rel=1e-6)
    assert lamp["members"][0]["photometry"] == photometry
    for value in ("0", "-1", "bright", "inf"):
        assert "cd/m²" in run_refused(tmp_path, "lights", CORNELL, f"--unit={value}")


def test_template_is_the_current_look(tmp_path: Path) -> None:
    succeed(tmp_path, "template", CORNELL, "-o", "t.exr", "--spp", 4)
    [part] = read_parts(tmp_path / "t.exr")
    assert part.rgb().shape == (128, 128, 3)
    assert (tmp_path / "t.png").is_file()


@pytest.mark.parametrize(
    ("output", "file"),
    [nightly("t.exr", "t.exr"), nightly("t.exr", "t.png"), ("template", "template.png")],
)
def test_a_painting_is_not_painted_over(tmp_path: Path, output: str, file: str) -> None:
    command = ("template", CORNELL, "--resolution", "1/4", "--spp", 2, "-o", output)
    succeed(tmp_path, *command, "--force")
    painted = (tmp_path / output).parent / file if "." in output else tmp_path / output / file
    painted.write_bytes(b"hours of work")
    assert "may have been painted on" in run_refused(tmp_path, *command)
    assert painted.read_bytes() == b"hours of work"
    succeed(tmp_path, *command, "--force")
    assert painted.read_bytes() != b"hours of work"


def test_painted_over_the_template_in_8_bits_and_solved(tmp_path: Path) -> None:
    output = succeed(tmp_path, "template", CORNELL, "--resolution", "1/4", "--spp", 64)
    assert "template/template.png" in output
    folder = tmp_path / "template"
    names = {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}
    plain = {"template.exr", "template.png", "albedo.exr", "normals.exr", "depth.exr"}
    assert plain | {"template.json"} <= names
    assert {"lights/ceiling.png", "lights/lamp.png"} <= names
    assert "mattes/floor.png" in names
    with Image.open(folder / "template.png") as file:
        pixels = np.array(file.convert("RGB"))
    pixels[8:20, 8:20] = 250, 200, 120
    # Whatever a program calls it, and whatever it forgets of the view.
    Image.fromarray(pixels).save(folder / "warmer.png")
    command = ("solve", CORNELL, "template/warmer.png", "--resolution", "1/4", "--spp", 16)
    completed = run(tmp_path, *command, "-o", "out")
    assert completed.returncode == 0, completed.stderr
    # 12 x 12 of 32 x 32 pixels.
    assert "warmer: 14.1 % painted: what differs from template/template.png" in completed.stderr
    itself = run_refused(tmp_path, *command[:2], "template/template.png", *command[3:])
    assert "template/template.png is the template itself" in itself
    Image.open(folder / "template.png").save(folder / "same.png")
    refusal = run_refused(tmp_path, *command[:2], "template/same.png", *command[3:])
    assert "nothing in template/same.png differs from template/template.png" in refusal
    template_record = folder / "template.json"
    other = template_record.read_text(encoding="utf-8").replace('"camera"', '"balcony"')
    template_record.write_text(other, encoding="utf-8")
    assert "a template of the sensor balcony, not of camera" in run_refused(tmp_path, *command)


def test_a_template_that_is_forced_leaves_nothing_of_the_earlier_one(tmp_path: Path) -> None:
    room = write_room(tmp_path)
    succeed(tmp_path, "template", room, "--spp", 2)
    (tmp_path / "template" / "painting.png").write_bytes(b"mine")
    room.write_text(room.read_text(encoding="utf-8").replace('id="ball"', 'id="globe"'))
    succeed(tmp_path, "template", room, "--spp", 2, "--force")
    mattes = {file.name for file in (tmp_path / "template" / "mattes").iterdir()}
    assert "globe.png" in mattes
    assert "ball.png" not in mattes
    assert (tmp_path / "template" / "painting.png").read_bytes() == b"mine"


def test_results_of_two_solves_never_stand_together(
    solved_job: tuple[Path, str], basis_file: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "look"
    shutil.copytree(solved_job[0], folder)
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    succeed(tmp_path, "solve", basis_file, COOL, "--mask", COOL_MASK, "-o", folder, "--force")
    remaining_names = {p.name for p in folder.iterdir()}
    assert remaining_names == (RESULTS - {"relit.xml", "verified.exr"}) | {"notes.txt"}
    # A folder that no solve has written to is not tidied.
    other = tmp_path / "other"
    other.mkdir()
    (other / "relit.xml").write_text("mine", encoding="utf-8")
    succeed(tmp_path, "solve", basis_file, WARM, "-o", other)
    assert (other / "relit.xml").read_text(encoding="utf-8") == "mine"


@pytest.mark.nightly
def test_whoever_reads_may_leave(basis_file: Path, tmp_path: Path) -> None:
    command = f"{sys.executable} -m lightpaint solve {basis_file} {WARM} {COOL} -o out"
    completed = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} | true"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stderr
    assert "Traceback" not in completed.stderr
    for name in ("warm", "cool"):
        assert (tmp_path / "out" / name / "report.html").is_file()


def test_a_terminal_without_unicode_loses_no_result(tmp_path: Path) -> None:
    completed = spawn(tmp_path, "lights", CORNELL, "--no-sheet", PYTHONIOENCODING="ascii")
    assert completed.returncode == 0, completed.stderr
    assert "W/(m? sr)" in completed.stdout


def test_a_lighting_cannot_name_a_folder_elsewhere(
    solved_job: tuple[Path, str], tmp_path: Path
) -> None:
    data = json.loads((solved_job[0] / "lighting.json").read_text(encoding="utf-8"))
    for target in ("../elsewhere", "/tmp/elsewhere", "..", 5):
        path = tmp_path / "l.json"
        path.write_text(json.dumps({**data, "target": target}), encoding="utf-8")
        run_refused(tmp_path, "relight", CORNELL, path)


def test_doctor_fails_where_something_is_missing(tmp_path: Path) -> None:
    completed = spawn(tmp_path, "doctor", "-m", "llvm_nonsense_rgb")
    assert completed.returncode == 2
    assert "MISSING" in completed.stdout


def test_resize_does_not_stretch(basis_file: Path, tmp_path: Path) -> None:
    write_rgb(tmp_path / "wide.exr", np.ones((64, 128, 3), np.float32))
    assert "another aspect ratio" in run_refused(
        tmp_path, "solve", basis_file, "wide.exr", "--resize"
    )


def test_scalar_variant_says_so_and_serves(tmp_path: Path) -> None:
    room = write_room(tmp_path)
    completed = spawn(tmp_path, "basis", room, "-m", "scalar_rgb", "--spp", 4, "-D", "width=8")
    assert completed.returncode == 0, completed.stderr
    assert "5 times the work; a variant like llvm_ad_rgb renders all in one" in completed.stderr
    assert (tmp_path / "room.basis.exr").is_file()


def test_a_picture_in_place_of_the_scene_is_named(tmp_path: Path) -> None:
    Image.new("RGB", (8, 8), "red").save(tmp_path / "dusk.jpg")
    expected = "dusk.jpg is not a scene: this command takes a Mitsuba XML first"
    assert expected in run_refused(tmp_path, "lights", "dusk.jpg")
    assert "dusk.jpg stands where the scene belongs: give the scene first" in run_refused(
        tmp_path, "solve", "dusk.jpg"
    )
    assert "no painting to solve for" in run_refused(tmp_path, "solve", CORNELL)


def test_doctor_names_what_it_found(tmp_path: Path) -> None:
    output = succeed(tmp_path, "doctor", by=spawn)
    for word in ("mitsuba", "LLVM", "cores", "GPU", "backend"):
        assert word in output
    states = {line.find(" ok ") for line in output.splitlines() if " ok " in line}
    assert len(states) == 1, "the states are a column"
    assert states.pop() >= len("batches on a cluster"), "no subject is wider than its column"


def test_help_does_not_wait_for_mitsuba(tmp_path: Path) -> None:
    code = "import sys, lightpaint.cli as c\ntry: c.main(['--help'])\nfinally: print(*sys.modules)"
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert "solve" in completed.stdout
    loaded = completed.stdout.split()
    assert "mitsuba" not in loaded
    assert "drjit" not in loaded
    for command in ("lights", "basis", "template", "solve", "relight", "verify", "doctor"):
        assert "--help" in succeed(tmp_path, command, "--help")


def test_commands_load_scipy_where_they_need_it() -> None:
    """It takes as long to load as all modules of a command."""
    code = "import sys, lightpaint.cli.commands.render_commands; print(*sys.modules)"
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    loaded = completed.stdout.split()
    assert "lightpaint.photometry.illuminance" in loaded
    assert "scipy" not in loaded


def test_nothing_is_printed_but_one_line_for_mistakes(basis_file: Path, tmp_path: Path) -> None:
    image = np.ones((128, 128, 3), np.float32)
    bad_folder = tmp_path / "bad"
    bad_folder.mkdir()
    write_rgb(bad_folder / "small.exr", image[:64])
    write_parts(
        bad_folder / "unpainted.exr", [ExrPart("", {**rgb_channels(image), "A": image[..., 0] * 0})]
    )
    write_parts(
        bad_folder / "negative.exr", [ExrPart("", {**rgb_channels(image), "W": -image[..., 0]})]
    )
    write_rgb(bad_folder / "nan.exr", image * np.nan)
    content = WARM.read_bytes()
    (bad_folder / "cut.exr").write_bytes(content[: len(content) // 2])
    (bad_folder / "text.exr").write_text("no picture")
    (bad_folder / "file").write_text("in the way")
    folder = tmp_path
    for target, words in {
        "gone.exr": "no such image file",
        "bad/small.exr": "128x64",
        "bad/unpainted.exr": "importance 0 everywhere",
        "bad/negative.exr": "not negative",
        "bad/nan.exr": "NaN or Inf in every pixel",
        "bad/cut.exr": "cut off",
        "bad/text.exr": "is not a picture that can be read",
        "bad": "is a folder",
    }.items():
        assert words in run_refused(folder, "solve", basis_file, target)
        assert words in run_refused(folder, "solve", CORNELL, target)
    assert "cannot write into bad/file" in run_refused(
        folder, "solve", basis_file, WARM, "-o", "bad/file"
    )
    assert "cannot write" in run_refused(folder, "solve", basis_file, WARM, "-o", "bad/file/deeper")
    assert "no layers named like" in run_refused(folder, "solve", WARM, WARM)
    assert "no such scene" in run_refused(folder, "solve", "gone.xml", WARM)
    assert "not a scene" in run_refused(folder, "lights", "bad/text.exr")
    assert "is a folder" in run_refused(folder, "lights", "bad")
    assert "refuses" in run_refused(folder, "lights", "bad/file")
    assert "nothing to render" in run_refused(folder, "lights", GALLERY, "-D", "width=0")
    assert "cannot change a saved basis" in run_refused(
        folder, "solve", basis_file, WARM, "--spp", 9
    )
    assert "no sensor 'nobody'" in run_refused(folder, "lights", CORNELL, "-s", "nobody")
    assert "not key=value" in run_refused(folder, "lights", CORNELL, "-D", "spp")
    assert "spp" in run_refused(folder, "basis", CORNELL, "--spp", "1")
    assert "seed" in run_refused(folder, "basis", CORNELL, "--seed", "-1")
    assert "unpainted" in run_refused(folder, "solve", basis_file, WARM, "--unpainted", "nan")
    assert "overwrite" in run_refused(folder, "solve", basis_file, WARM, WARM)
    assert "must end in .exr" in run_refused(folder, "basis", CORNELL, "-o", "basis.png")
    assert "no such lighting" in run_refused(folder, "relight", CORNELL, "gone.json")
    assert "not a JSON" in run_refused(folder, "relight", CORNELL, "bad/file")
    assert "not a result folder" in run_refused(folder, "verify", "bad")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        nightly(("lights", CORNELL, "-m", "llvm_ad_nonsense_rgb"), "no variant"),
        (("lights", CORNELL, "-m", "scalar_spectral"), "not supported"),
        nightly(("basis", CORNELL, "--spp", "1"), "spp"),
        nightly(("solve", CORNELL, "nan.exr"), "NaN or Inf in every pixel"),
    ],
)
def test_nothing_else_is_printed_by_a_process_of_its_own(
    tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    """Of another variant, of nothing but parsing, and of a scene that is loaded."""
    write_rgb(tmp_path / "nan.exr", np.full((128, 128, 3), np.nan, np.float32))
    assert words in run_refused(tmp_path, *arguments, by=spawn)


def test_deep_images_are_refused_by_name(tmp_path: Path) -> None:
    pixels = np.empty((2, 2), dtype=object)
    for index in np.ndindex(2, 2):
        pixels[index] = np.ones(3, np.float32)
    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
    OpenEXR.File(header, {"R": pixels, "G": pixels, "B": pixels}).write(str(tmp_path / "deep.exr"))
    assert "deep" in run_refused(tmp_path, "solve", CORNELL, "deep.exr")


@pytest.mark.nightly
def test_resize_and_unpainted(basis_file: Path, tmp_path: Path) -> None:
    [part] = read_parts(WARM)
    wide = {k: np.repeat(np.repeat(v, 2, 0), 2, 1) for k, v in part.channels.items()}
    write_parts(tmp_path / "wide.exr", [ExrPart("", wide)])
    succeed(tmp_path, "solve", basis_file, "wide.exr", "--resize")
    succeed(tmp_path, "solve", basis_file, WARM)
    answers = [
        json.loads((tmp_path / name / "lighting.json").read_text(encoding="utf-8"))["lights"]
        for name in ("wide", "warm")
    ]
    for light in answers[0]:
        # Each pixel stands four times and is averaged again: precision of half and float32.
        np.testing.assert_allclose(
            answers[0][light]["emission"], answers[1][light]["emission"], rtol=1e-4, atol=1e-5
        )
    succeed(tmp_path, "solve", basis_file, WARM, "-o", "held", "--unpainted", "100")
    held_lights = json.loads((tmp_path / "held" / "lighting.json").read_text(encoding="utf-8"))[
        "lights"
    ]
    current = json.loads(succeed(tmp_path, "lights", CORNELL, "--json"))["lights"]
    current_lights = {light["name"]: light["emission"] for light in current}

    def gap(lights: dict[str, dict[str, list[float]]]) -> float:
        return sum(
            float(np.abs(np.subtract(lights[n]["emission"], current_lights[n])).sum())
            for n in current_lights
        )

    assert gap(held_lights) < gap(answers[1])


def test_missing_parameter_tells_the_option(tmp_path: Path) -> None:
    room = write_room(tmp_path)
    text = room.read_text(encoding="utf-8").replace('<default name="width" value="24"/>', "")
    room.write_text(text, encoding="utf-8")
    assert "-D width=VALUE" in run_refused(tmp_path, "lights", room)
    assert "sun" in succeed(tmp_path, "lights", room, "-D", "width=9", "--no-sheet")


def test_the_cache_is_listed_and_cleared(tmp_path: Path) -> None:
    def call(*arguments: object) -> str:
        completed = run(tmp_path, *arguments, LIGHTPAINT_CACHE=str(tmp_path / "cache"))
        assert completed.returncode == 0, completed.stderr
        return completed.stdout

    room = write_room(tmp_path)
    call("basis", room, "--spp", "2", "--no-cache")
    assert "room.xml" not in call("cache")
    call("basis", room, "--spp", "2")
    assert "room.xml" in call("cache", "list")
    assert "1 deleted" in call("cache", "clear")
    assert "room.xml" not in call("cache")


CHECKERS = """<shape type="rectangle" id="screen"><transform name="to_world"><scale value="0.4"/>
    <rotate y="1" angle="90"/><translate x="-1" y="1"/></transform><emitter type="area">
    <texture type="checkerboard" name="radiance"/></emitter></shape>"""


@pytest.mark.nightly
def test_groups_and_kept_lights_from_solve_to_relight(tmp_path: Path) -> None:
    room = write_room(tmp_path, lights="".join(LIGHTS.values()) + CHECKERS)
    choice = ("--group", "warm=panel,bulb", "--lights", "warm,s*")
    completed = run(tmp_path, "lights", room, *choice, "--json")
    assert "not adjusted: 'screen' has a textured radiance" in completed.stderr
    listed = {light["name"]: light for light in json.loads(completed.stdout)["lights"]}
    members = {name: [m["name"] for m in light["members"]] for name, light in listed.items()}
    assert members == {
        "warm": ["panel", "bulb"],
        "sun": ["sun"],
        "sky": ["sky"],
        "rest": ["beam", "screen"],
    }
    assert [name for name, light in listed.items() if light["is_fixed"]] == ["rest"]
    assert "  beam" in succeed(tmp_path, "lights", room, *choice, "--no-sheet")

    succeed(tmp_path, "template", room, "-o", "t.exr", "--spp", 16)
    output = succeed(tmp_path, "solve", room, "t.exr", *choice, "--spp", 64, "-o", "out")
    assert "Rendered again: equal within noise." in output
    assert re.search(r"^rest .* fixed ", output, re.MULTILINE)
    assert "agree within noise" in succeed(tmp_path, "verify", "out")
    succeed(tmp_path, "relight", room, "out/lighting.json", "-o", "again", "--spp", 4)
    second_relit, relit = (tmp_path / name / "relit.xml" for name in ("again", "out"))
    assert second_relit.read_bytes() == relit.read_bytes()

    # The same from a basis of its own, which keeps what it was made with.
    succeed(tmp_path, "basis", room, *choice, "--spp", 64, "-o", "b.basis.exr")
    succeed(tmp_path, "solve", "b.basis.exr", "t.exr", "-o", "from_basis")
    answers = [
        json.loads((tmp_path / name / "lighting.json").read_text(encoding="utf-8"))
        for name in ("out", "from_basis")
    ]
    # A basis has no scene, which alone says where lights hang.
    assert [answers[0].pop(key) for key in ("places", "up")]
    assert answers[0] == answers[1]
    line = run_refused(tmp_path, "solve", "b.basis.exr", "t.exr", "--lights", "sky", "-o", "no")
    assert "--lights cannot change a saved basis" in line


def test_a_lights_file_beside_the_scene(tmp_path: Path) -> None:
    room = write_room(tmp_path)
    lights_file = tmp_path / "room.lights.toml"
    lights_file.write_text('lights = ["pair"]\n[groups]\npair = ["sun", "sky"]\n', encoding="utf-8")

    def names(*arguments: object) -> list[str]:
        text = succeed(tmp_path, "lights", room, "--json", *arguments)
        return [light["name"] for light in json.loads(text)["lights"]]

    assert names() == ["pair", "rest"]
    assert "room.lights.toml" in run(tmp_path, "lights", room, "--no-sheet").stderr
    # The command line replaces the list, and adds groups or replaces namesakes.
    assert names("--lights", "pair,b*") == ["bulb", "beam", "pair", "rest"]
    assert names("--group", "pair=panel,bulb") == ["pair", "rest"]
    assert names("--group", "two=bulb,beam") == ["two", "pair", "rest"]
    assert names("--group", "two=bulb,beam", "--lights", "two") == ["two", "rest"]
    assert len(names("--no-lights-file")) == 5
    other = tmp_path / "other.toml"
    other.write_text('[groups]\nall = ["*"]\n', encoding="utf-8")
    assert names("--lights-file", other) == ["all"]

    lights_file.write_text("lights = [", encoding="utf-8")
    line = run_refused(tmp_path, "basis", room)
    assert "room.lights.toml is not TOML" in line
    assert "line 1" in line
    # The look is the sum of the basis of these lights, which the first solve is to find.
    assert "room.lights.toml is not TOML" in run_refused(tmp_path, "template", room, "-o", "t.exr")
    succeed(tmp_path, "template", room, "--spp", 2, "-o", "t.exr", "--no-lights-file")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--group", "bulb"), "is not name=a,b,c"),
        (("--group", "=bulb"), "is not name=a,b,c"),
        (("--group", "g="), "is not a list of names"),
        (("--lights", "bulb,,sky"), "is not a list of names"),
        (("--lights", "blub"), "did you mean 'bulb'"),
        (("--group", "sun=bulb,sky"), "has the name of a light"),
        (("--lights-file", "gone.toml"), "no such lights file: gone.toml"),
    ],
)
def test_wrong_choices_are_refused_in_one_line(
    tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    assert words in run_refused(tmp_path, "lights", write_room(tmp_path), *arguments)


@pytest.mark.nightly
def test_solved_small_and_verified_large(tmp_path: Path) -> None:
    few_samples = ("--resolution", "1/4", "--spp", 16, "--seed", 8)
    arguments = ("solve", CORNELL, WARM, *few_samples, "--verify-spp", 16)
    output = succeed(tmp_path, *arguments)
    # So few samples would not show an error that may be seen.
    assert "Rendered again with 16 samples per pixel: nothing found against it." in output
    sizes = {}
    for name in ("predicted", "verified"):
        [part] = read_parts(tmp_path / "warm" / f"{name}.exr")
        sizes[name] = part.size
    assert sizes == {"predicted": (32, 32), "verified": (128, 128)}
    assert "agree within noise" in succeed(tmp_path, "verify", "warm")
    page = (tmp_path / "warm" / "report.html").read_text(encoding="utf-8")
    assert "32 × 32 pixels, verified at 128 × 128" in page
    # A saved basis of that size takes the painting of full size as well, and says so.
    basis_command = (
        "basis",
        CORNELL,
        "--resolution",
        "32x32",
        "--spp",
        16,
        "--seed",
        8,
        "-o",
        "s.exr",
    )
    assert "kept from an earlier run" in run(tmp_path, *basis_command).stderr
    completed = run(tmp_path, "solve", "s.exr", WARM, "-o", "saved")
    assert completed.returncode == 0, completed.stderr
    assert "128x128 pixels averaged to the basis's 32x32" in completed.stderr
    answers = [
        json.loads((tmp_path / name / "lighting.json").read_text(encoding="utf-8"))["lights"]
        for name in ("warm", "saved")
    ]
    assert answers[0] == answers[1]
    # A basis of another resolution is another basis.
    assert "basis: 1 pass\n" in run(tmp_path, "basis", CORNELL, "--spp", 2, "--seed", 8).stderr
    # A template that was made small is painted small.
    succeed(tmp_path, "template", CORNELL, "--resolution", "1/4", "--spp", 4)
    small = ("solve", *arguments[1:2], "template/template.exr", "--no-template", *arguments[3:])
    succeed(tmp_path, *small, "-o", "small")


@pytest.mark.nightly
def test_a_tampered_scene_is_told_from_a_small_prediction_too(tmp_path: Path) -> None:
    succeed(tmp_path, "solve", CORNELL, WARM, "--resolution", "1/4", "--spp", 64)
    relit = tmp_path / "warm" / "relit.xml"
    text = relit.read_text(encoding="utf-8").replace('max_depth" value="6"', 'max_depth" value="3"')
    relit.write_text(text, encoding="utf-8")
    completed = run(tmp_path, "verify", "warm")
    assert completed.returncode == 1
    assert "DISAGREE" in completed.stdout


@pytest.mark.nightly
def test_a_basis_for_a_time(tmp_path: Path) -> None:
    def spp_of(output: str) -> int:
        return int(output.split(" lights, ")[1].split()[0])

    room = write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["bulb"])
    write_rgb(tmp_path / "warm.exr", np.full((20, 24, 3), 0.3, np.float32))
    arguments = ("basis", room, "--time", "0.05", "--resolution", "1/2", "--seed", 9)
    completed = run(tmp_path, *arguments)
    assert completed.stderr == "basis: 1 second\n"
    first = spp_of(completed.stdout)
    assert spp_of(succeed(tmp_path, *arguments)) > first
    # The verification has as many samples as the basis: a quarter in each pixel, or the fewer in
    # each of a smaller film.
    solved = ("solve", room, "warm.exr", *arguments[2:], "--quality", "final")
    output = succeed(tmp_path, *solved)
    assert re.search(r"Rendered again.*: (equal within noise|nothing found against it)\.", output)
    [part] = read_parts(tmp_path / "warm" / "predicted.exr")
    spp = spp_of(succeed(tmp_path, "basis", room, *arguments[4:], "--spp", 2))
    view = json.loads(part.attributes["lightpaint.view"])
    assert view["spp"] * view["width"] * view["height"] == pytest.approx(spp * 12 * 10, rel=0.1)


def test_budgets_that_contradict_each_other_are_refused(basis_file: Path, tmp_path: Path) -> None:
    refuse = [tmp_path, "basis", CORNELL]
    assert "not allowed with" in run_refused(*refuse, "--time", 3, "--spp", 4)
    assert "not a number of seconds" in run_refused(*refuse, "--time", 0)
    assert "invalid choice" in run_refused(*refuse, "--quality", "good")
    assert "will do" in run_refused(*refuse, "--resolution", "100x100")
    solve = [tmp_path, "solve", CORNELL, WARM]
    assert "error is 0.02 and spp 4" in run_refused(*solve, "--error", "2%", "--spp", 4)
    for budget in ("0", "nan", "100%"):
        assert "expected a share of at least" in run_refused(*solve, "--error", budget)
    assert "not a share like 2%" in run_refused(*solve, "--error", "two")
    options = (("--time", 3), ("--error", "2%"), ("--quality", "final"), ("--resolution", "1/2"))
    for option in options:
        refusal = run_refused(tmp_path, "solve", basis_file, WARM, *option)
        assert f"{option[0]} cannot change a saved basis" in refusal


@pytest.mark.nightly
def test_a_film_that_no_blocks_fit_into_is_solved_small_and_verified_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """A painting and its mask of full size, on a film whose sides have no common factor."""
    small = replace(PRESETS["preview"], pixels=2**11)
    monkeypatch.setitem(PRESETS, "preview", small)
    write_room(tmp_path, lights=LIGHTS["bulb"] + LIGHTS["beam"])
    room = (
        (tmp_path / "room.xml").read_text().replace('"height" value="20"', '"height" value="128"')
    )
    (tmp_path / "room.xml").write_text(room)
    size = ("-D", "width=171")
    succeed(tmp_path, "template", "room.xml", *size, "-o", "look.exr", "--spp", 2)
    mask = np.zeros((128, 171), np.float32)
    mask[50:] = 1
    write_parts(tmp_path / "mask.exr", [ExrPart("mask", {"Y": mask})])
    solve = ("solve", "room.xml", "look.exr", "--mask", "mask.exr", *size, "--quality", "preview")
    completed = run(tmp_path, *solve, "--spp", 8, "--verify-spp", 8)
    assert completed.returncode == 0, completed.stderr
    assert (
        "film of 171x128 reduced to 42x32 blocks of 4x4 pixels: 3 columns of pixels at the right "
        "are left over and ignored" in completed.stderr
    )
    assert "nothing found against it." in completed.stdout  # 5 % of no light would show
    assert read_estimate(tmp_path / "look" / "predicted.exr")[0].size == (32, 42)
    assert read_estimate(tmp_path / "look" / "verified.exr")[0].size == (128, 171)
    # Fewer samples, of what is kept or exactly; both say what they used.
    for option, spp in ((), 8), (("--exact-spp",), 4):
        completed = run(tmp_path, *solve, "--spp", 4, *option)
        assert ("more than the 4 requested" in completed.stderr) == (spp == 8)
        answer = json.loads((tmp_path / "look" / "lighting.json").read_text())
        assert answer["solve"]["basis_spp"] == spp
        _, attributes = read_estimate(tmp_path / "look" / "predicted.exr")
        assert json.loads(attributes["lightpaint.view"])["basis_spp"] == spp
        assert f"{spp} samples per pixel" in (tmp_path / "look" / "report.html").read_text()
