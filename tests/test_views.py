"""One lighting for the paintings of several views."""

import json
import shlex
import weakref
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.cli import main
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import BasisError, OutputError, TargetError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.joined_views import joint_basis
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.paint.protocol import ConstrainLight, Export, Message, Paint
from lightpaint.paint.store.history_steps import ViewIdentity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import session_identity
from lightpaint.paint.subject_factory import make_subjects
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.one_call import paint_with_light
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

CLOSE = """<sensor type="perspective" id="close"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="1 1 2" target="0 0.5 0" up="0 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="14"/><integer name="height" value="10"/>
    </film></sensor>"""


SAME = """<sensor type="perspective" id="same"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 1 3.5" target="0 0.8 0" up="0 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/>
    </film></sensor>"""


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lights = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["beam"] + LIGHTS["sky"]
    return write_room(tmp_path_factory.mktemp("views"), lights=lights, sensors=CLOSE)


@pytest.fixture(scope="module")
def bases(room: Path) -> list[Basis]:
    return [render_basis(load_scene(room, sensor=name), spp=64) for name in ("camera", "close")]


def painting(basis: Basis, weights: np.ndarray, name: str) -> Target:
    return Target(name, basis.mix(weights), np.ones(basis.size, np.float32), everything=False)


@pytest.mark.nightly
def test_what_is_painted_in_two_views_is_solved_alike(room: Path, tmp_path: Path) -> None:
    sources = [SceneFile(str(room), sensor=name) for name in ("camera", "close")]
    options = ["--spp=16", "--resolution=1/2"]
    subjects = make_subjects(
        sources,
        tmp_path,
        settings=Settings(spp=16, resolution="1/2", verify=False),
        command=lambda paintings, requests: command_for_paintings(
            str(room), paintings, options, requests
        ),
    )
    identity = session_identity(
        subjects, {k: subject.loaded_scene for k, subject in enumerate(subjects)}
    )
    assert identity is not None
    assert identity.views == (ViewIdentity("camera", (10, 12)), ViewIdentity("close", (5, 7)))
    exported = Event()
    messages: list[Message] = []

    def hear(message: Message) -> None:
        messages.append(message)
        if message.kind in ("exported", "notice"):
            exported.set()

    studio = Studio(subjects, MemoryStore)
    studio.on_message = hear
    studio._obtain_bases()
    for k, light in enumerate((0.9, 0.1)):
        arrays = {"image": np.full((3, 4, 3), light), "importance": np.ones((3, 4))}
        floats = {key: value.astype(np.float32) for key, value in arrays.items()}
        studio.handle(Paint(k, (1, 4, 2, 6), is_final=True, view=k), floats)
    studio.handle(ConstrainLight(1, {"lock": True}), {})
    studio.handle(Export(("target", "lighting", "relit", "report")), {})
    assert exported.wait(60)
    assert messages[-1].kind == "exported", messages[-1].fields
    files = messages[-1].fields["files"]
    names = ["painting-camera.exr", "painting-close.exr", "lighting.json", "relit.xml"]
    reports = [f"answer/{name}/report.html" for name in ("camera", "close")]
    assert files == [str(tmp_path / name) for name in (*names, *reports)]
    words = shlex.split(messages[-1].fields["command"])[1:]
    assert main([*words, "-o", str(tmp_path / "again")]) == 0
    emission = read_lighting(tmp_path / "lighting.json").emission
    for other in ("again", "answer"):
        stored_emission = read_lighting(tmp_path / other / "lighting.json").emission
        for name, expected in emission.items():
            np.testing.assert_allclose(stored_emission[name], expected, rtol=1e-9)
    studio.close()


def test_a_lighting_that_both_views_show_comes_back(bases: list[Basis]) -> None:
    weights = np.random.default_rng(0).uniform(0.1, 2, (4, 3))
    views = [(basis, painting(basis, weights, "x")) for basis in bases]
    first, second = solve(*zip(*views, strict=True)).views
    assert first.lighting.lights == second.lighting.lights
    # float32 pixels of the paintings.
    np.testing.assert_allclose(first.lighting.weights_for(bases[0]), weights, rtol=1e-4)


def test_views_add(bases: list[Basis]) -> None:
    rng = np.random.default_rng(1)
    views = [(basis, painting(basis, rng.uniform(0, 2, (4, 3)), "x")) for basis in bases]
    solutions = solve(*zip(*views, strict=True)).views
    solution = solutions[0]
    joint_progress = sum(
        (NormalEquations.of(b, t.image, t.importance) for b, t in views[1:]),
        NormalEquations.of(views[0][0], views[0][1].image, views[0][1].importance),
    )
    weights = solution.lighting.weights_for(bases[0])
    best = joint_progress.objective(weights).sum()
    assert best == pytest.approx(sum(sum(s.certificate.objective) for s in solutions))
    # No other lighting does better: not that of either view alone, nor any nearby.
    for basis, target in views:
        single_weights = solve(basis, target).lighting.weights_for(basis)
        assert joint_progress.objective(single_weights).sum() >= best
    for _ in range(50):
        near = np.maximum(weights + rng.normal(scale=0.05, size=weights.shape), 0)
        assert joint_progress.objective(near).sum() >= best


def test_one_view_is_the_ordinary_solve(bases: list[Basis]) -> None:
    target = painting(bases[0], np.random.default_rng(2).uniform(0, 2, (4, 3)), "x")
    [one] = solve([bases[0]], [target]).views
    assert one.lighting == solve(bases[0], target).lighting


def test_other_lights_are_refused(bases: list[Basis], tmp_path: Path) -> None:
    other = render_basis(load_scene(write_room(tmp_path, lights=LIGHTS["sky"])), spp=2)
    weights = np.ones((4, 3))
    views = [
        (bases[0], painting(bases[0], weights, "x")),
        (other, painting(other, weights[:1], "y")),
    ]
    with pytest.raises(BasisError, match="have different lights"):
        solve(*zip(*views, strict=True))


def test_from_the_command_line(
    room: Path,
    bases: list[Basis],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    weights = np.random.default_rng(3).uniform(0.2, 2, (4, 3))
    options = []
    for name, basis in zip(("camera", "close"), bases, strict=True):
        write_rgb(tmp_path / f"{name}.exr", basis.mix(weights))
        options += ["--target", f"{name}={name}.exr"]
    command = ["solve", str(room), *options, "--spp", "64", "-o", "out", "--lock", "bulb"]
    assert main(command) == 0
    document = json.loads((tmp_path / "out" / "lighting.json").read_text(encoding="utf-8"))
    assert document["target"] == "camera + close"
    assert document["lights"]["bulb"]["emission"] == pytest.approx([0.5, 0.6, 0.7])
    for name in ("camera", "close"):
        for file in (
            "predicted.exr",
            "verified.exr",
            "comparison.png",
            "report.html",
            "report.json",
        ):
            assert (tmp_path / "out" / name / file).is_file()
    assert main(["verify", "out"]) == 0
    assert main(["verify", "out/close"]) == 0
    output = capsys.readouterr().out
    assert output.count("Rendered again: equal within noise.") == 2
    assert output.count("agree within noise") >= 3

    for arguments, words in (
        (["camera.exr", "--target", "close=close.exr"], "at once"),
        (["--target", "close=close.exr", "--target", "close=close.exr"], "twice"),
        (["--target", "attic=close.exr"], "no sensor 'attic'"),
        (["--target", "close=close.exr", "-s", "camera"], "-s cannot be used"),
        ([], "no painting"),
    ):
        assert main(["solve", str(room), *arguments, "--spp", "64"]) == 2
        assert words in capsys.readouterr().err


def test_error_bars_are_those_of_all_views_together(bases: list[Basis]) -> None:
    weights = np.random.default_rng(4).uniform(0.2, 2, (4, 3))
    targets = [painting(basis, weights, "x") for basis in bases]

    def errors(*views: int) -> np.ndarray:
        solution = solve([bases[k] for k in views], [targets[k] for k in views])
        return error_bars(solution).standard_error

    single_errors = errors(0)
    np.testing.assert_allclose(
        single_errors, error_bars(solve(bases[0], targets[0])).standard_error
    )


def test_the_same_view_twice_has_the_scatter_of_independent_ones(make_basis: Any) -> None:
    """Its bias stays as it is. Of lights that are not few bright pixels, which decide otherwise."""
    rng = np.random.default_rng(4)
    images = rng.uniform(0.2, 1, (4, 20, 24, 3))
    noise = 0.05 * images * rng.standard_normal(images.shape)
    basis = make_basis(images=images + noise, half_differences=noise)
    target = painting(basis, rng.uniform(0.2, 2, (4, 3)), "x")
    single_errors, twice = (
        error_bars(solve([basis] * k, [target] * k)).standard_error for k in (1, 2)
    )
    assert (twice < single_errors * (1 + 1e-9)).all()
    assert (twice > single_errors * (np.sqrt(0.5) - 1e-9)).all()


@pytest.mark.nightly  # by day, those of two views are those of their joint problem, above
def test_error_bars_of_two_views_hold(room: Path) -> None:
    scenes = [load_scene(room, sensor=name) for name in ("camera", "close")]
    weights = np.random.default_rng(6).uniform(0.2, 2, (4, 3))
    targets = [painting(render_basis(s, spp=2048, seed=99), weights, "x") for s in scenes]
    is_inside = []
    for seed in range(12):
        solution = solve([render_basis(s, spp=16, seed=seed) for s in scenes], targets)
        low, high = error_bars(solution).interval
        is_inside.append((low <= weights) & (weights <= high))
    # 95 % are to be; 144 values, those of one seed and light together, so that some 36 count.
    assert 0.85 <= np.mean(is_inside) <= 0.995


def test_what_is_given_up_for_other_views(bases: list[Basis]) -> None:
    rng = np.random.default_rng(5)
    views = [(basis, painting(basis, rng.uniform(0, 2, (4, 3)), "x")) for basis in bases]
    solutions = solve(*zip(*views, strict=True)).views
    for (basis, target), solution in zip(views, solutions, strict=True):
        diagnosis, single = diagnose(solution), solve(basis, target)
        # What no mix reaches is orthogonal to what some mix of any sign would: each from its map.
        D = target.importance[..., None].astype(np.float64)
        attained, out_of_reach = (
            (D * np.square(map_, dtype=np.float64)).sum()
            for map_ in (diagnosis.forbidden_map, diagnosis.unreachable_map)
        )
        assert diagnosis.forbidden + diagnosis.compromise == pytest.approx(attained, rel=1e-4)
        assert diagnosis.unreachable + diagnosis.noise == pytest.approx(out_of_reach, rel=1e-4)
        gap = sum(solution.certificate.objective) - sum(single.certificate.objective)
        assert diagnosis.compromise == pytest.approx(gap, rel=1e-3)
        assert diagnosis.compromise > 0.1 * diagnosis.total
        # Each is met by itself, so that nothing else can be in the way.
        assert diagnosis.forbidden < 1e-3 * diagnosis.total


def test_bases_share_the_memory_of_the_joint_one(bases: list[Basis]) -> None:
    joint, parts = joint_basis(bases)
    for part, basis in zip(parts, bases, strict=True):
        np.testing.assert_array_equal(part.images, basis.images)
        np.testing.assert_array_equal(part.half_differences, basis.half_differences)
        assert np.shares_memory(part.images, joint.images)
    # What fills the last row is dark.
    assert joint.images.sum() == pytest.approx(sum(b.images.sum() for b in bases), rel=1e-5)


def test_views_share_no_random_numbers(tmp_path: Path) -> None:
    # Two sensors at one place see one picture, and their noise is not the same.
    room = write_room(tmp_path, lights=LIGHTS["sky"], sensors=SAME)
    a, b = (render_basis(load_scene(room, sensor=k), spp=16) for k in (0, 1))
    x, y = np.sign(a.half_differences.ravel()), np.sign(b.half_differences.ravel())
    noisy = (x != 0) & (y != 0)
    assert noisy.sum() > 300
    # Channels go together, so that a third of them counts: 5 standard errors.
    assert abs((x * y)[noisy].mean()) < 5 / np.sqrt(noisy.sum() / 3)


@pytest.mark.nightly
def test_no_pixel_is_held_twice(room: Path, tmp_path: Path) -> None:
    scenes = [load_scene(room, sensor=name) for name in ("camera", "close")]
    bases = [render_basis(scene, spp=4) for scene in scenes]
    watched = [weakref.ref(basis.images) for basis in bases]
    targets = [painting(basis, np.ones((4, 3)), "x") for basis in bases]
    alive: list[bool] = []

    def look(label: str, *_: object) -> None:
        if label == "verification of close":
            alive.extend(ref() is not None for ref in watched)

    paint_with_light(scenes, targets, tmp_path / "out", basis=bases, spp=4, progress=look)
    assert bases == []
    assert alive
    assert not any(alive)


@pytest.mark.nightly
def test_paintings_of_two_views_seen_through_two_transforms(room: Path, tmp_path: Path) -> None:
    scenes = [load_scene(room, sensor=name) for name in ("camera", "close")]
    transforms = [ViewTransform("agx", 1.0), ViewTransform("srgb")]
    targets = [
        replace(painting(render_basis(s, spp=4), np.ones((4, 3)), "x"), transform=view)
        for s, view in zip(scenes, transforms, strict=True)
    ]
    with pytest.raises(TargetError, match=r"painted through agx at \+1 stops and srgb"):
        paint_with_light(scenes, targets, tmp_path / "out", spp=4, space="display")
    looks = paint_with_light(
        scenes, targets, tmp_path / "out", spp=4, space="display", transform=ViewTransform("srgb")
    )
    assert len(looks) == 2


def test_a_file_where_a_view_s_folder_is_to_be(room: Path, tmp_path: Path) -> None:
    scenes = [load_scene(room, sensor=name) for name in ("camera", "close")]
    targets = [painting(render_basis(s, spp=4), np.ones((4, 3)), "x") for s in scenes]
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "close").write_text("mine", encoding="utf-8")
    with pytest.raises(OutputError, match=r"cannot write into .*close"):
        paint_with_light(scenes, targets, tmp_path / "out", spp=4)
    assert (tmp_path / "out" / "close").read_text(encoding="utf-8") == "mine"
