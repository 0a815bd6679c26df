"""A job: checked when it is born, and the same wherever it is sent."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from light_groups import channels, interleaved, pictures, write
from picture_files import layered, psd
from PIL import Image
from renderer import LIGHTS, write_room

from lightpaint import Constraints, Job, Painting, SceneFile, Settings, paint_with_light, run
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.errors import (
    BasisError,
    ConstraintError,
    LightpaintError,
    SceneError,
    SizeError,
    TargetError,
)
from lightpaint.images import picture_size
from lightpaint.images.formats.exr import write_rgb
from lightpaint.pipeline.job import job_checks
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

SIDE = """<sensor type="perspective" id="side"><transform name="to_world">
    <lookat origin="2 1 2" target="0 0.5 0" up="0 1 0"/></transform><film type="hdrfilm">
    <integer name="width" value="14"/><integer name="height" value="10"/></film></sensor>"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make_basis: Any) -> Path:
    """A folder with a basis, light groups, paintings of them and a mask."""
    monkeypatch.chdir(tmp_path)
    basis = make_basis(3)
    write_basis(tmp_path / "a.basis.exr", basis)
    write_rgb(tmp_path / "p.exr", 0.7 * basis.images.sum(axis=0))
    write_rgb(tmp_path / "mask.exr", np.ones_like(basis.images[0]))
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(tmp_path / "groups.exr", layers)
    write_rgb(tmp_path / "g.exr", pictures()[0])
    return tmp_path


@pytest.fixture
def room(tmp_path: Path) -> Path:
    lights = LIGHTS["panel"] + LIGHTS["bulb"]
    return write_room(tmp_path, lights=lights, sensors=SIDE)


def test_a_folder_may_be_a_text(room: Path) -> None:
    """As everywhere else in Python, though attributes of a job are paths."""
    scene = load_scene(room)
    target = Target.of(np.ones((*scene.size, 3), np.float32))
    job = Job((scene,), (target,), "evening")  # type: ignore[arg-type]
    assert job.folder == Path("evening")
    assert [view.folder for view in job.views] == [Path("evening")]


def _flat(basis: Basis, **options: Any) -> Target:
    image, importance = basis.images.sum(axis=0), np.ones(basis.size, np.float32)
    return Target("flat", image, importance, everything=True, **options)


def _from_basis(**options: Any) -> Job:
    options = {"basis": BasisFile("a.basis.exr"), "targets": (Painting("p.exr"),)} | options
    return Job((), folder=Path("out"), **options)


@pytest.mark.usefixtures("folder")
def test_a_painting_in_the_folder_of_the_lights(tmp_path: Path):
    (tmp_path / "lights").mkdir()
    for name, image in zip(("key", "fill"), pictures(2), strict=True):
        write(tmp_path / "lights" / f"{name}.exr", ("rgb", channels("", image)))
    painting = write(tmp_path / "lights" / "noon.exr", ("rgb", channels("", pictures()[2])))
    options = {"targets": (Painting(str(painting)),)}
    for basis in (GroupsFile("lights"), read_light_groups("lights")):
        with pytest.raises(BasisError, match=r"noon\.exr is among the lights of lights: pass it"):
            _from_basis(basis=basis, **options)
    job = _from_basis(basis=GroupsFile("lights", leave_out=(str(painting),)), **options)
    assert job.groups is not None
    assert job.groups.basis.names == ("fill", "key")
    assert Job.from_json(job.to_json()) == job
    assert isinstance(reread := Job.from_json(job.to_json()).basis, GroupsFile)
    assert reread.leave_out == (str(painting),)


@pytest.mark.usefixtures("folder")
def test_a_path_that_nuke_would_evaluate_is_told_before_the_solve(tmp_path: Path):
    path = (tmp_path / "groups.exr").rename(tmp_path / "take #2.exr")
    job = _from_basis(basis=GroupsFile(str(path)), targets=(Painting("g.exr"),))
    [warning] = [remark for remark in job.remarks if "Nuke" in remark]
    assert warning.startswith("Nuke would evaluate # in the path")


ASKED = Constraints.of(
    {"light 0": {"lock": "50%"}, "light*": {"kelvin": (2700, 6500), "duv": 0.003}},
    tie=[["light 1", "light 2"], {"lights": ["light 2"], "color": "#ffaa66"}],
    prefer_current=0.1,
)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"targets": (Painting("p.exr", mask="mask.exr", transform=TransformChoice("agx", None)),)},
        {
            "settings": Settings(
                unpainted=0.1, transform=ViewTransform("agx", 1 / 3), space="display"
            )
        },
        {"settings": Settings(seed=np.int64(3), cd_per_unit=np.float32(0.1))},  # type: ignore[arg-type]
        {"constraints": replace(ASKED, ties=())},
        {"settings": Settings(move_lights=False)},
        {"basis": GroupsFile("groups.exr", "RGBA_{name}"), "targets": (Painting("g.exr"),)},
    ],
)
def test_a_round_trip_is_the_same_job(options: Any):
    job = _from_basis(**options)
    reread = Job.from_json(job.to_json())
    assert reread == job
    assert reread.to_json() == job.to_json()
    assert reread.remarks == job.remarks
    for name in ("folder", "settings", "by_sensor", "targets", "basis"):
        assert getattr(reread, name) == getattr(job, name)
    settings = replace(job.settings, resize=not job.settings.resize)
    assert reread != _from_basis(**{**options, "settings": settings})


def test_a_job_in_another_process_gives_the_same_answer(folder: Path):
    job = _from_basis(constraints=Constraints.of({"light 0": {"limits": {"max": "40%"}}}))
    [look] = run(job)
    expected = (folder / "out" / "lighting.json").read_bytes()
    (folder / "job.json").write_text(job.to_json(), encoding="utf-8")
    (folder / "out" / "lighting.json").unlink()
    code = "import sys, lightpaint as lp; lp.run(lp.Job.from_json(open('job.json').read()))"
    subprocess.run([sys.executable, "-c", code], cwd=folder, check=True, env={**os.environ})
    assert (folder / "out" / "lighting.json").read_bytes() == expected
    assert look.lighting.lights[0].constraint == "limits 0 to 40%"


def test_a_job_of_a_scene_is_sent_with_all_that_was_said(room: Path, tmp_path: Path):
    (tmp_path / "l.toml").write_text('[groups]\nboth = ["*"]\n', encoding="utf-8")
    scene = SceneFile(
        str(room), "side", {"width": "12"}, lights_file=str(tmp_path / "l.toml"), lights=("both",)
    )
    write_rgb(tmp_path / "p.exr", np.ones((10, 14, 3), np.float32))
    job = Job((scene,), (Painting(str(tmp_path / "p.exr")),), tmp_path / "out")
    assert [light.name for light in scene.content.lights] == ["both"]
    assert f"lights and groups as in {tmp_path / 'l.toml'}" in job.remarks
    assert Job.from_json(job.to_json()) == job
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("folder")
def test_a_job_in_memory_says_why_it_cannot_be_sent(make_basis: Any):
    basis = make_basis(3)
    for kind, options in {
        "basis": {"basis": basis},
        "target": {"targets": (_flat(basis),)},
    }.items():
        job = _from_basis(**options)
        with pytest.raises(LightpaintError, match=f"cannot be sent: its {kind} is in memory"):
            job.to_json()
        assert job == job
        assert job != _from_basis(**options)


@pytest.mark.usefixtures("folder")
def test_what_is_no_job_is_refused_in_one_line():
    good = json.loads(_from_basis().to_json())
    for bad in (
        "{",
        "[]",
        "{}",
        json.dumps({**good, "format": "lightpaint-job 0"}),
        json.dumps({key: value for key, value in good.items() if key != "folder"}),
        json.dumps({**good, "scenes": [{"file": "x.xml"}]}),
        json.dumps({**good, "basis": {"BasisFile": {}}}),
        json.dumps({**good, "targets": 5}),
        json.dumps({**good, "more": 1}),
        json.dumps({**good, "targets": [{"path": 5}]}),
        json.dumps({**good, "targets": [{"path": "p.exr", "paint": "air"}]}),
        json.dumps({**good, "scenes": [{"path": "x.xml", "sensor": True}]}),
        json.dumps({**good, "basis": {"BasisFile": {"path": "b", "pattern": "*"}}}),
        json.dumps({**good, "basis": {"Path": {}}}),
        json.dumps({**good, "settings": {**good["settings"], "speed": 1}}),
        json.dumps({**good, "settings": {**good["settings"], "refine": "1"}}),
        json.dumps({**good, "by_sensor": 1}),
    ):
        with pytest.raises(LightpaintError, match="this is not a job: ") as refusal:
            Job.from_json(bad)
        assert "\n" not in str(refusal.value)
    with pytest.raises(LightpaintError, match="spp is 1: expected a whole number >= 2"):
        Job.from_json(json.dumps({**good, "settings": {**good["settings"], "spp": 1}}))


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"basis": None}, LightpaintError, "give a scene, a basis, or both"),
        ({"targets": ()}, TargetError, "no painting to solve for"),
        ({"targets": (Painting("p.exr"),) * 2}, BasisError, "a basis has only one view"),
        ({"targets": ("p.exr",)}, TargetError, "the target is a str"),
        ({"constraints": {"a": {"off": True}}}, ConstraintError, "constraints are a dict"),
        ({"constraints": Constraints.of({"x": {}})}, ConstraintError, "no light 'x'"),
        ({"settings": Settings(spp=8)}, BasisError, r"^spp=\.\.\. cannot change a saved basis"),
        (
            {"settings": Settings(quality="final", refine=1)},
            BasisError,
            r"^quality=\.\.\., refine=\.\.\. cannot change a saved basis: leave them out",
        ),
        (
            {"basis": GroupsFile("groups.exr"), "settings": Settings(seed=1)},
            BasisError,
            r"^seed=\.\.\. cannot be used with groups.exr",
        ),
    ],
)
def test_what_cannot_be_done_is_said_at_birth(options: Any, error: type[Exception], message: str):
    with pytest.raises(error, match=message):
        _from_basis(**options)
    assert not Path("out").exists()


def test_what_cannot_be_done_with_a_scene_is_said_before_it_renders(
    room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("lightpaint.pipeline.job_bases.obtain_basis", None)
    scene = load_scene(room)
    (height, width) = scene.size
    image = np.ones((height, width, 3), np.float32)
    target = Target("t", image, image[..., 0], everything=True)

    def check_refusal(
        error: type[Exception], message: str, scenes: Any, targets: Any, **options: Any
    ) -> None:
        with pytest.raises(error, match=message):
            paint_with_light(scenes, targets, tmp_path / "out", **options)
        assert not (tmp_path / "out").exists()

    check_refusal(
        LightpaintError,
        "is 24x20 but the basis is 12x10|resize",
        scene,
        replace(target, image=image[:7, :9], importance=image[:7, :9, 0]),
    )
    check_refusal(TargetError, "2 targets for 1 views", scene, [target, target])
    check_refusal(SceneError, "given twice", [scene, scene], [target, target])
    check_refusal(SceneError, "^the scene is of type ndarray: expected the path of", image, target)
    check_refusal(
        TargetError, "template of the sensor side, not of", scene, replace(target, sensor="side")
    )
    check_refusal(
        SceneError,
        r"^lights=\.\.\. cannot change a scene that is already loaded",
        scene,
        target,
        lights=["bulb"],
    )
    check_refusal(TargetError, r"^mask=\.\.\. cannot change a target", scene, target, mask="m.exr")
    check_refusal(
        ConstraintError,
        "no light 'x'",
        scene,
        target,
        constraints=Constraints.of({"x": {"off": True}}),
    )


def test_the_lights_file_beside_a_scene_holds_and_is_replaced(room: Path, tmp_path: Path):
    lights_file = tmp_path / "room.lights.toml"
    lights_file.write_text("[light.bulb]\noff = true\n", encoding="utf-8")
    write_rgb(tmp_path / "p.exr", np.ones((20, 24, 3), np.float32))
    constraints = Constraints.of({"bulb": {"lock": True}})
    job = Job(
        (SceneFile(str(room)),), (Painting(str(tmp_path / "p.exr")),), tmp_path, None, constraints
    )
    assert [name for name, _, _ in job.all_constraints.lights] == ["bulb", "bulb"]
    assert job.constraints == constraints
    assert f"lights and groups as in {lights_file}" in job.remarks


def test_remarks_say_what_was_done_to_a_painting(folder: Path, make_basis: Any):
    basis = make_basis(3)
    large = np.repeat(np.repeat(basis.images[0], 2, 0), 2, 1)
    target = Target(
        "t",
        large,
        np.ones(large.shape[:2], np.float32),
        everything=True,
        not_finite=3,
        notes=("a note",),
        transform=ViewTransform("agx"),
    )
    job = _from_basis(targets=(target,))
    assert job.remarks == (
        "t: 20x24 pixels averaged to the basis's 10x12",
        "t: painted through agx, whose highlights stand for very much light and dominate the fit: "
        'space="display" fits what the eye sees',
        "t: a note",
        "t: 3 pixels hold NaN or Inf and are ignored",
    )
    quiet = _from_basis(targets=(target,), settings=Settings(resize=True, space="display"))
    assert quiet.remarks == job.remarks[2:]
    groups = read_light_groups(folder / "groups.exr")
    job = _from_basis(basis=groups, targets=(Painting("g.exr"),))
    assert job.remarks[: len(groups.remarks)] == groups.remarks


def test_one_listener_hears_work_and_remarks(folder: Path):
    class Ear:
        def __init__(self) -> None:
            self.heard: list[str] = []

        def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
            self.heard.append(label)

        def say(self, text: str) -> None:
            self.heard.append(text)

    job, ear = _from_basis(targets=(replace(Painting("p.exr").content, notes=("a note",)),)), Ear()
    run(job, ear)
    assert ear.heard == ["p: a note"]
    run(job, lambda *_: None)  # a plain callable lets remarks pass


def test_a_basis_that_was_obtained_serves_the_next_painting(
    room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    from lightpaint.pipeline import job_bases

    rendered: list[Any] = []
    obtain_basis = job_bases.obtain_basis
    monkeypatch.setattr(
        job_bases, "obtain_basis", lambda *a, **k: (rendered.append(a), obtain_basis(*a, **k))[1]
    )
    scene = SceneFile(str(room))
    image = np.ones((20, 24, 3), np.float32)
    jobs = []
    for k in range(2):
        write_rgb(tmp_path / f"{k}.exr", (k + 1) * image)
        settings = Settings(spp=4, use_cache=False)
        painting = (Painting(str(tmp_path / f"{k}.exr")),)
        jobs.append(Job((scene,), painting, tmp_path / f"out{k}", settings=settings))
    assert jobs[0].views[0].scene is jobs[1].views[0].scene
    [first] = run(jobs[0])
    bases = [first.basis]
    [second] = run(jobs[1], bases=bases)
    assert len(rendered) == 1
    assert bases == []
    assert second.basis is first.basis
    np.testing.assert_allclose(
        second.lighting.weights_for(second.basis),
        2 * first.lighting.weights_for(first.basis),
        rtol=1e-6,
        atol=1e-9,
    )


def test_a_painting_over_a_smaller_template_is_solved_at_its_size(room: Path, tmp_path: Path):
    scene = load_scene(room)
    height, width = (length // 2 for length in scene.size)
    image = np.full((height, width, 3), 0.5, np.float32)
    importance = np.ones((height, width), np.float32)
    painted = Target("half", image, importance, everything=False)
    smaller = replace(painted, content=scene.content, over_look=True)

    def job(target: Target, **options: Any) -> Job:
        return Job((scene,), (target,), tmp_path / "out", settings=Settings(**options))

    solved_job = job(smaller)
    assert solved_job.views[0].scene is not None
    assert solved_job.views[0].scene.size == (height, width)
    assert (
        solved_job.remarks[-1]
        == f"half: solved at {width}x{height} pixels, the size of its template"
    )
    # Whoever says how large wins, and a picture that came from elsewhere has no say.
    for target, options in ((smaller, {"resolution": "1/1"}), (painted, {})):
        with pytest.raises(SizeError, match=f"target half is {width}x{height} but the basis is"):
            job(target, **options)
    assert job(smaller, resize=True).views[0].target.size == scene.size


@pytest.mark.parametrize("kind", ["png", "tif", "psd", "ora", "exr"])
def test_a_painting_of_another_size_is_not_decoded(
    folder: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """The heads of both files say it: a large picture takes seconds to decode."""
    pixels, png = np.full((17, 23, 3), 90, np.uint8), io.BytesIO()
    Image.fromarray(pixels).save(png, "PNG")
    contents = {"png": png.getvalue(), "psd": psd(pixels), "ora": layered(png.getvalue())}
    path = folder / f"large.{kind}"
    if kind == "exr":
        write_rgb(path, pixels.astype(np.float32))
    elif kind == "tif":
        tifffile.imwrite(path, pixels, photometric="rgb")
    else:
        path.write_bytes(contents[kind])
    assert picture_size(path) == (17, 23)
    monkeypatch.setattr("lightpaint.pipeline.job.sources.read_target", _not_to_be_called)
    for basis in (BasisFile("a.basis.exr"), GroupsFile("groups.exr")):
        with pytest.raises(SizeError, match=rf"large\.{kind} is 23x17 but the basis is"):
            Job((), (Painting(path.name),), folder / "out", basis)


def test_a_painting_far_larger_than_the_film_is_not_decoded(
    room: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it has whole blocks of pixels, or is to be resampled."""
    monkeypatch.setattr(job_checks, "LARGE_PAINTING", 2000)
    monkeypatch.setattr("lightpaint.pipeline.job.sources.read_target", _not_to_be_called)
    (height, width), scene = load_scene(room).size, SceneFile(str(room))
    for size, error in (((61, 53), SizeError), ((9 * height, 9 * width), AssertionError)):
        Image.fromarray(np.full((*size, 3), 90, np.uint8)).save(folder / "large.png")
        with pytest.raises(error, match=r"large\.png is 53x61|decoded"):
            Job((scene,), (Painting("large.png"),), folder / "out")
    Image.fromarray(np.full((61, 53, 3), 90, np.uint8)).save(folder / "large.png")
    with pytest.raises(AssertionError, match="decoded"):
        Job((scene,), (Painting("large.png"),), folder / "out", settings=Settings(resize=True))


def test_the_size_of_a_damaged_picture_is_left_to_its_reader(folder: Path) -> None:
    for name in ("gone.png", "cut.png"):
        (folder / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
        assert picture_size(folder / name) is None
        with pytest.raises(LightpaintError, match=name):
            Job((), (Painting(name),), folder / "out", BasisFile("a.basis.exr"))


def _not_to_be_called(*_args: object, **_options: object) -> None:
    raise AssertionError("decoded")
