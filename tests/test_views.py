"""One lighting for the paintings of several views."""

import json
from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.basis import Basis
from lightpaint.basis.render import render_basis
from lightpaint.cli import main
from lightpaint.errors import BasisError
from lightpaint.images.exr import write_rgb
from lightpaint.scene.scene import load_scene
from lightpaint.solve.normal_equations import NormalEquations
from lightpaint.solve.solve import solve, solve_views
from lightpaint.target.target import Target

CLOSE = """<sensor type="perspective" id="close"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="1 1 2" target="0 0.5 0" up="0 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="14"/><integer name="height" value="10"/>
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


def test_a_lighting_that_both_views_show_comes_back(bases: list[Basis]) -> None:
    weights = np.random.default_rng(0).uniform(0.1, 2, (4, 3))
    views = [(basis, painting(basis, weights, "x")) for basis in bases]
    first, second = solve_views(views)
    assert first.lighting == second.lighting
    # float32 pixels of the paintings.
    np.testing.assert_allclose(first.lighting.weights_for(bases[0]), weights, rtol=1e-4)


def test_views_add(bases: list[Basis]) -> None:
    rng = np.random.default_rng(1)
    views = [(basis, painting(basis, rng.uniform(0, 2, (4, 3)), "x")) for basis in bases]
    solution = solve_views(views)[0]
    together = sum(
        (NormalEquations.of(b, t.image, t.importance) for b, t in views[1:]),
        NormalEquations.of(views[0][0], views[0][1].image, views[0][1].importance),
    )
    found = solution.lighting.weights_for(bases[0])
    best = together.objective(found).sum()
    assert best == pytest.approx(sum(solution.quality.objective))
    # No other lighting does better: not that of either view alone, nor any nearby.
    for basis, target in views:
        alone = solve(basis, target).lighting.weights_for(basis)
        assert together.objective(alone).sum() >= best
    for _ in range(50):
        near = np.maximum(found + rng.normal(scale=0.05, size=found.shape), 0)
        assert together.objective(near).sum() >= best


def test_one_view_is_the_ordinary_solve(bases: list[Basis]) -> None:
    target = painting(bases[0], np.random.default_rng(2).uniform(0, 2, (4, 3)), "x")
    assert solve_views([(bases[0], target)])[0].lighting == solve(bases[0], target).lighting


def test_other_lights_are_refused(bases: list[Basis], tmp_path: Path) -> None:
    other = render_basis(load_scene(write_room(tmp_path, lights=LIGHTS["sky"])), spp=2)
    weights = np.ones((4, 3))
    views = [
        (bases[0], painting(bases[0], weights, "x")),
        (other, painting(other, weights[:1], "y")),
    ]
    with pytest.raises(BasisError, match="have other lights"):
        solve_views(views)


def test_from_the_command_line(
    room: Path,
    bases: list[Basis],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    weights = np.random.default_rng(3).uniform(0.2, 2, (4, 3))
    given = []
    for name, basis in zip(("camera", "close"), bases, strict=True):
        write_rgb(tmp_path / f"{name}.exr", basis.mix(weights))
        given += ["--target", f"{name}={name}.exr"]
    command = ["solve", str(room), *given, "--spp", "64", "-o", "out", "--lock", "bulb"]
    assert main(command) == 0
    told = json.loads((tmp_path / "out" / "lighting.json").read_text(encoding="utf-8"))
    assert told["target"] == "camera + close"
    assert told["lights"]["bulb"]["emission"] == pytest.approx([0.5, 0.6, 0.7])
    for name in ("camera", "close"):
        for file in ("predicted.exr", "verified.exr", "comparison.png", "report.html"):
            assert (tmp_path / "out" / name / file).is_file()
    assert main(["verify", "out"]) == 0
    assert main(["verify", "out/close"]) == 0
    assert capsys.readouterr().out.count("agree within noise") >= 5

    for arguments, words in (
        (["camera.exr", "--target", "close=close.exr"], "at once"),
        (["--target", "close=close.exr", "--target", "close=close.exr"], "twice"),
        (["--target", "attic=close.exr"], "no sensor 'attic'"),
        (["--target", "close=close.exr", "--refine", "1"], "--refine cannot be had"),
        ([], "no painting"),
    ):
        assert main(["solve", str(room), *arguments, "--spp", "64"]) == 2
        assert words in capsys.readouterr().err
