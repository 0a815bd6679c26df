"""What a lights file beside a scene asks of the lights holds for every solve."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.errors import ConstraintError, SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.constraints.constraints_file import read_constraints
from lightpaint.lighting.problem import Problem
from lightpaint.scene.lights.lights_file import SceneRequests, read_lights_file

FILE = '[light.bulb]\nlock = "40%"\n[light.panel]\nkelvin = 3200\n'


@pytest.fixture
def room(tmp_path: Path) -> Path:
    (tmp_path / "room.lights.toml").write_text(FILE, encoding="utf-8")
    return write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["bulb"])


def _target(basis: lp.Basis) -> lp.Target:
    return lp.Target.of(0.7 * basis.mix(basis.current_weights))


def _emission(solution: lp.Solution, name: str) -> Any:
    return pytest.approx(solution.lighting.emission[name], rel=1e-12)


def test_a_solve_from_python_is_that_of_paint_with_light(room: Path, tmp_path: Path):
    scene = lp.load_scene(room)
    basis = lp.render_basis(scene, spp=8)
    write_rgb(tmp_path / "t.exr", _target(basis).image)
    options = {"spp": 8, "noise_correction": False}
    look = lp.paint_with_light(scene, tmp_path / "t.exr", tmp_path / "out", **options)
    # Threads that learn where lights matter may leave one sample in a million to another light.
    solution = lp.solve(look.basis, lp.read_target(tmp_path / "t.exr"))
    assert look.basis.requests == basis.requests == scene.requests
    assert {x.constraint for x in solution.lighting.lights} == {"lock 40%", "3200 K"}
    for light in look.lighting.lights:
        assert light.emission == _emission(solution, light.name)
    # To be asked twice is to be asked once.
    assert look.solution.problem.constraints == solution.problem.constraints
    # What is given goes before the file; what it does not contradict stays.
    constraints = lp.Constraints.of({"bulb": {"off": True}})
    lighting = lp.solve(basis, _target(basis), constraints=constraints).lighting
    assert lighting.emission["bulb"] == (0, 0, 0)
    assert [x.constraint for x in lighting.lights] == ["3200 K", "off"]
    # A basis read from a file knows only what it was rendered of.
    lp.write_basis(tmp_path / "b.exr", basis)
    assert not lp.read_basis(tmp_path / "b.exr").requests.keys


def test_the_file_of_now_counts_and_not_that_of_the_cached_basis(room: Path, tmp_path: Path):
    first = lp.load_scene(room)
    earlier = lp.render_basis(first, spp=8)
    target = _target(earlier)
    lp.paint_with_light(first, target, tmp_path / "one", spp=8)
    (tmp_path / "room.lights.toml").write_text("[light.panel]\noff = true\n", encoding="utf-8")
    scene = lp.load_scene(room)
    labels = []
    cached = lp.paint_with_light(
        scene,
        target,
        tmp_path / "two",
        spp=8,
        progress=lambda *progress_values: labels.append(progress_values[0]),
    )
    assert "basis" not in " ".join(labels)
    lighting_of_scene = lp.paint_with_light(scene, target, tmp_path / "three", basis=earlier)
    topped_up = lp.solve(lp.render_basis(scene, spp=8, start=earlier), target)
    for lighting in (cached.lighting, lighting_of_scene.lighting, topped_up.lighting):
        assert [x.constraint for x in lighting.lights] == ["off", ""]
    # Without a scene the basis in memory is what knows; without the file nobody does.
    lighting_of_basis = lp.paint_with_light(None, target, tmp_path / "four", basis=earlier)
    assert [x.constraint for x in lighting_of_basis.lighting.lights] == ["3200 K", "lock 40%"]
    free = lp.load_scene(room, use_lights_file=False)
    assert not lp.render_basis(free, spp=8).requests.keys


def test_mistakes_are_refused_in_one_line(room: Path, make_basis: Any):
    lights_file = room.with_name("room.lights.toml")
    lights_file.write_text("[lamp.bulb]\noff = true\n", encoding="utf-8")
    with pytest.raises(SceneError, match="unknown key 'lamp'"):
        lp.load_scene(room)
    basis = make_basis(2, names=("panel", "bulb"))
    for keys, message in [
        ({"light": {"bulb": {"lock": "much"}}}, r"hall\.toml: light\.bulb\.lock is 'much'"),
        ({"light": {"blub": {"off": True}}}, r"hall\.toml: light\.blub: no light 'blub'; did you"),
        ({"tie": 3}, r"hall\.toml: tie is 3"),
        ({"prefer_current": "x"}, r"hall\.toml: prefer_current is 'x': expected a strength"),
        ({"near": -1}, r"hall\.toml: near is -1: expected a strength"),
        ({"start": 0}, r"hall\.toml: start is 0: expected emissions"),
        ({"start": {"bulb": [1, 2]}}, r"hall\.toml: start\.bulb is \[1, 2\]: expected"),
        ({"start": {"blub": [1, 1, 1]}}, r"start: no light 'blub'; did you mean 'bulb'"),
        ({"prefer": {"current": "x"}}, r"hall\.toml: prefer\.current is 'x'"),
        ({"prefer": {"past": 1}}, r"hall\.toml: prefer.*known are current"),
        ({"prefer": 1, "prefer_current": 1}, r"hall\.toml: both prefer_current and prefer"),
    ]:
        with pytest.raises(ConstraintError, match=message) as refusal:
            lp.solve(basis.with_requests(SceneRequests(keys, "hall.toml")), _target(basis))
        assert "\n" not in str(refusal.value)


def test_the_same_tie_twice_is_one_tie(make_basis: Any, tmp_path: Path):
    path = tmp_path / "a.lights.toml"
    path.write_text('tie = [["a", "b"]]\nprefer_current = 0.1\n[light."*"]\noff = false\n', "utf-8")
    file = read_constraints(path)
    constraints = lp.Constraints.of(
        {"c": {"lock": True}}, tie=[{"lights": ["b", "a"], "color": "3200K"}]
    )
    combined = file.and_then(constraints)
    assert file.and_then(combined) == combined
    assert combined.ties == constraints.ties
    basis = make_basis(3, names=("a", "b", "c"))
    a, b, c = lp.solve(basis, _target(basis), constraints=combined).lighting.lights
    assert np.array(a.emission) / sum(a.emission) == pytest.approx(
        np.array(b.emission) / sum(b.emission)
    )
    assert c.emission == pytest.approx(basis.lights[2].emission)


@pytest.mark.parametrize(
    "message", ["prefer_current = 0.01", "prefer = { current = 0.01 }", "prefer = 0.01"]
)
def test_the_pull_has_the_name_it_has_in_python_and_the_one_of_older_files(
    tmp_path: Path, message: str
):
    path = tmp_path / "a.lights.toml"
    path.write_text(message, encoding="utf-8")
    assert read_constraints(path) == lp.Constraints.of(prefer_current=0.01)
    assert read_lights_file(path).requests.keys


def test_a_solve_starts_from_the_lighting_in_the_file(make_basis: Any, tmp_path: Path):
    path = tmp_path / "a.lights.toml"
    path.write_text("near = 0.2\n[start]\nbulb = [0.1, 0.2, 0.3]\n", encoding="utf-8")
    constraints = lp.Constraints.of(start={"bulb": (0.1, 0.2, 0.3)}, near=0.2)
    assert read_constraints(path) == constraints
    basis = make_basis(2, names=("panel", "bulb"))
    target = _target(basis)
    by_file = lp.solve(basis.with_requests(read_lights_file(path).requests), target)
    by_argument = lp.solve(basis, target, constraints=constraints)
    np.testing.assert_array_equal(by_file.weights, by_argument.weights)
    assert not np.allclose(by_file.weights, lp.solve(basis, target).weights, rtol=1e-3)


def test_all_views_heed_it(make_basis: Any):
    requests = SceneRequests({"light": {"light 0": {"off": True}}}, "hall.toml")
    bases = [
        make_basis(2, seed=1).with_requests(requests),
        make_basis(2, seed=1).with_requests(requests),
    ]
    problem = Problem.of(bases, [_target(basis) for basis in bases])
    assert list(problem.reduction.labels) == ["off", ""]
    with pytest.raises(lp.LightpaintError, match="the basis is a str: give what"):
        lp.solve("a.basis.exr", _target(bases[0]))
