"""A solve with spectra from files to files, and what does not go with it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import run as run_command
from command import run_refused, spawn, succeed
from spectral_room import DRIVES, LEVELS, paint_spectral_room, write_spectral_room
from webs import batwing, cosine, ies_text, street, write_web

from lightpaint import Constraints, Job, Painting, SceneFile, Settings, run
from lightpaint.colour.spectrum import EYE, read_observer
from lightpaint.errors import LightpaintError, SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.pipeline.job.sources import spectral_scene
from lightpaint.pipeline.look import verify_result
from lightpaint.relit.formats import spectra_csv
from lightpaint.relit.relit_scene import relight
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render
from lightpaint.sentences import Hint


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A room whose lamps have three LEDs each, and a sky that stays."""
    return write_spectral_room(tmp_path)


def _job(path: Path, picture: Path, **fields: object) -> Job:
    settings = {"spp": 256, "seed": 1, "spectral": True, "literal": True, "use_cache": False}
    constraints = fields.pop("constraints", Constraints())
    return Job(
        (SceneFile(str(path)),),
        (Painting(str(picture)),),
        path.with_name("out"),
        constraints=constraints,
        settings=Settings(**{**settings, **fields}),
    )


def test_a_painting_becomes_a_drive_of_each_emitter(room: Path):
    [look] = run(_job(room, paint_spectral_room(room), verify_spp=256))
    assert look.verification is not None
    assert look.verification.agrees
    # With other random numbers, from the files alone.
    assert verify_result(room.with_name("out")).agrees
    lighting = read_lighting(room.with_name("out") / "lighting.json")
    assert set(lighting) == {*DRIVES, "rest"}
    for lamp, drives in DRIVES.items():
        # The noise of picture and basis moves them by a hundredth.
        assert list(lighting[lamp].drives.values()) == pytest.approx(drives, abs=0.03)
    report = json.loads((room.with_name("out") / "report.json").read_text())
    assert set(report["rendering"]) == set(DRIVES)
    assert {x["name"] for x in report["surfaces"]} >= {"floor", "ball"}
    text = (room.with_name("out") / "relit.xml").read_text()
    assert text.count('<spectrum name="') == len(DRIVES)
    assert spectra_csv(lighting).splitlines()[0] == "nm,panel,bulb"


#: A camera, of Gaussians, and its wavelengths.
CAMERA_WAVES = np.arange(380, 781, 10.0)
CAMERA = np.stack([np.exp(-0.5 * ((CAMERA_WAVES - x) / 35) ** 2) for x in (600, 540, 460)], axis=1)

WRONG = {
    "suggest": ({"suggest": 1}, "spectral=True does not go with suggest"),
    "refine": ({"refine": 1}, "spectral=True does not go with refine"),
    "start": (
        {"constraints": Constraints.of(start={"panel": (1, 1, 1)})},
        "spectral=True starts from the scene as it is",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_does_not_go_with_spectra_is_refused(case: str, room: Path):
    fields, message = WRONG[case]
    write_rgb(room.with_name("painting.exr"), np.ones((20, 24, 3), np.float32))
    with pytest.raises(LightpaintError, match=message):
        _job(room, room.with_name("painting.exr"), **fields)


def test_a_lamp_without_spectra_is_named(room: Path):
    write_rgb(room.with_name("painting.exr"), np.ones((20, 24, 3), np.float32))
    file = room.with_name("room.lights.toml")
    file.write_text('lights = ["panel"]\n')
    with pytest.raises(SceneError, match="has no emitters for light 'panel'") as refusal:
        _job(room, room.with_name("painting.exr"))
    assert Hint("lights") in refusal.value.sentence.parts  # the command line writes --lights
    file.write_text('[light.panel]\nemitters = [{name = "a", xy = [0.3, 0.3], Y = 1}]\n')
    with pytest.raises(SceneError, match="no spectrum of a for light 'panel'"):
        _job(room, room.with_name("painting.exr"))


def test_a_lamp_that_is_off_is_verified_as_well(room: Path) -> None:
    """And reasons for what is missed name the lamp, not its emitters."""
    picture = paint_spectral_room(room)
    off = Constraints.of({"bulb": {"off": True}})
    [look] = run(_job(room, picture, constraints=off))
    lighting = read_lighting(room.with_name("out") / "lighting.json")
    assert lighting.emission["bulb"] == (0, 0, 0)
    assert look.verification is not None
    assert look.verification.agrees


def test_a_camera_sees_its_own_picture(room: Path) -> None:
    """It is solved, verified, relit and verified again as the camera sees it."""
    table = np.column_stack([CAMERA_WAVES, CAMERA])
    np.savetxt(room.with_name("camera.csv"), table, delimiter=",", header="nm,R,G,B")
    camera = {"observer": str(room.with_name("camera.csv"))}
    job = _job(room, paint_spectral_room(room, read_observer(Path(camera["observer"]))), **camera)
    assert any("seen by the camera camera.csv" in str(x) for x in job.remarks)
    [look] = run(job)
    assert look.basis.origin.observer == "camera.csv"
    assert look.verification is not None
    assert look.verification.agrees
    # Without the lights file and the camera's.
    room.with_name("camera.csv").unlink()
    assert verify_result(room.with_name("out")).agrees
    lighting = read_lighting(room.with_name("out") / "lighting.json")
    assert lighting.observer.name == "camera.csv"
    for lamp, drives in DRIVES.items():
        assert list(lighting[lamp].drives.values()) == pytest.approx(drives, abs=0.03)
    relit = relight(load_scene(room), lighting, room.with_name("again.xml"))
    picture = render(relit, spp=256, seed=5, stream=Stream.SECOND_VERIFICATION)
    difference = picture.image.mean(axis=(0, 1)) - look.predicted.image.mean(axis=(0, 1))
    # Four standard errors of each channel's mean over the picture.
    noise = np.hypot(
        *(np.square(x.half_difference).sum(axis=(0, 1)) for x in (picture, look.predicted))
    )
    assert (np.abs(difference) < 4 * np.sqrt(noise) / picture.image[..., 0].size).all()
    # The eye sees something else.
    eye = replace(relit, observer=EYE)
    seen = render(eye, spp=256, seed=5, stream=Stream.SECOND_VERIFICATION).image.mean(axis=(0, 1))
    assert (np.abs(seen - picture.image.mean(axis=(0, 1))) > 4 * np.abs(difference)).any()


def test_a_template_is_the_picture_that_is_solved_with(room: Path) -> None:
    """As the camera sees it; the solve over it renders no basis."""
    table = np.column_stack([CAMERA_WAVES, CAMERA])
    np.savetxt(room.with_name("camera.csv"), table, delimiter=",", header="nm,R,G,B")
    seen = ("--spectral", "--observer", "camera.csv", "--spp", 16)
    cache = {"LIGHTPAINT_CACHE": str(room.with_name("cache"))}
    succeed(room.parent, "template", "room.xml", *seen, **cache)
    pictures = {x.stem for x in (room.parent / "template" / "lights").glob("*.png")}
    assert pictures == {f"{lamp}_{x}" for lamp in DRIVES for x in LEVELS} | {"rest"}
    solve = ("solve", "room.xml", "template/template.exr", "--no-template", "--no-verify")
    completed = run_command(room.parent, *solve, *seen, "-o", "out", **cache)
    assert completed.returncode == 0, completed.stderr
    assert "basis of 16 samples per pixel kept from an earlier run" in completed.stderr
    lighting = read_lighting(room.with_name("out") / "lighting.json")
    scene = load_scene(room)
    current = spectral_scene(scene, constraints_of(scene.requests)).lights
    for light in current[: 2 * len(LEVELS)]:
        lamp, _, emitter = light.name.partition("/")
        drive = light.emission[0] / LEVELS[emitter]
        # The picture is the sum in float32, of which sRGB's exposure is none.
        assert lighting[lamp].drives[emitter] == pytest.approx(drive, abs=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--observer", "camera.csv"), "a camera sees spectra alone: also pass --spectral"),
        (("--spectral", "--observer", "none.csv"), "no such observer: none.csv"),
    ],
)
def test_a_template_refuses_what_a_solve_does(options: tuple, message: str, room: Path) -> None:
    assert message in run_refused(room.parent, "template", "room.xml", *options)


def test_a_camera_needs_spectra() -> None:
    with pytest.raises(LightpaintError, match="a camera sees spectra alone: also pass spectral=T"):
        Settings(observer="camera.csv")


#: Photometric webs: of positive spots, of spots of which some are negative, and without an axis.
WEBS = {"cosine": cosine, "batwing": batwing, "street": street}


@pytest.mark.parametrize(
    "web", ["batwing", *(pytest.param(x, marks=pytest.mark.nightly) for x in ("cosine", "street"))]
)
def test_a_luminaire_mixes_spectra_into_its_web(web: str, room: Path) -> None:
    """The verification is Mitsuba's own render of the written scene."""
    planes = np.arange(0, 361, 30.0).tolist() if web == "street" else [0.0]
    write_web(room.with_name("lamp.ies"), ies_text(WEBS[web], planes))
    file = room.with_name("room.lights.toml")
    text = file.read_text().replace("[light.bulb]", '[light.bulb]\nphotometry = "lamp.ies"')
    file.write_text("cd_per_unit = 1000\n" + text)
    picture = paint_spectral_room(room)
    [look] = run(_job(room, picture, verify_spp=256))
    assert look.verification is not None
    assert look.verification.agrees
    assert verify_result(room.with_name("out")).agrees
    lighting = read_lighting(room.with_name("out") / "lighting.json")
    for lamp, drives in DRIVES.items():
        assert list(lighting[lamp].drives.values()) == pytest.approx(drives, abs=0.03)
    relit = (room.with_name("out") / "relit.xml").read_text()
    assert relit.count('<spectrum name="') >= len(DRIVES)
    assert ('type="ies"' in relit) == (web != "cosine")
    remarks = [str(x) for x in _job(room, picture).remarks]
    assert any("import lightpaint.mitsuba" in x for x in remarks) == (web != "cosine")


def test_scalar_variants_and_saved_bases_are_refused_in_one_line(room: Path) -> None:
    folder = room.parent
    write_rgb(folder / "painting.exr", np.ones((20, 24, 3), np.float32))
    solve = ("solve", "room.xml", "painting.exr", "--spectral")
    line = run_refused(folder, *solve, "--variant", "scalar_rgb", by=spawn)
    assert "spectra are only rendered where one pass renders all lights: use -m llvm_ad_rgb" in line
    assert "--integrator" not in line
    succeed(folder, "basis", "room.xml", "--spp", 2, "-o", "room.basis.exr")
    line = run_refused(folder, "solve", "room.basis.exr", "painting.exr", "--spectral")
    assert "--spectral cannot change a saved basis" in line
    line = run_refused(folder, *solve, "--rf", "panel=120")
    assert "--rf panel is 120" in line
    line = run_refused(folder, *solve, "--kelvin", "panel=2700:6500")
    assert "has a range of kelvin" in line


def test_named_spectra_without_the_option_are_remarked_on(room: Path) -> None:
    picture = room.with_name("painting.exr")
    write_rgb(picture, np.ones((20, 24, 3), np.float32))
    solve = ("solve", "room.xml", "painting.exr", "--spp", 2, "--no-verify")
    said = " ".join(run_command(room.parent, *solve, "--no-cache").stderr.split())
    remark = "bulb, panel have spectra, of which pictures in RGB show the colour alone: --spectral"
    assert said.count(remark) == 1
    assert not any("have spectra" in str(x) for x in _job(room, picture).remarks)
