"""Lightings by sums alone: those that a basis would have led to, and no picture of it anywhere."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import BasisFactory
from light_groups import interleaved, pictures
from renderer import LIGHTS, write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render, render_parts
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.errors import BatchError, TargetError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.linear_problem import Sums, reason_against_sums, sum_rows, summed_problem
from lightpaint.lighting.linear_solve import solve_squares
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.target.painted_target import Target

ROWS = [slice(0, 5), slice(5, 12)]


def cut_rows(basis: Basis, rows: slice) -> Basis:
    return Basis(
        basis.lights,
        basis.images[:, rows],
        basis.half_differences[:, rows],
        basis.emitters_seen[rows],
        basis.origin,
    )


def solve_sums(basis: Basis, sums: Sums, **constraint_words: Any) -> np.ndarray:
    constraints = constraint_words.pop("constraints", Constraints())
    fit = Fit(literal=True, **constraint_words)
    problem = summed_problem(basis.lights, "it", sums, constraints=constraints, fit=fit)
    return solve_squares(problem, problem.start).weights


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"constraints": Constraints.of({"light 1": {"limits": {"max": 0.4}}}, prefer_current=0.1)},
        {"constraints": Constraints.of(sparse=2)},
        {"constraints": Constraints.of(start={"light 1": (0.2, 0.3, 0.4)})},
        {"colors": "white"},
        {"emitters": "skip"},
    ],
)
def test_the_lighting_is_that_of_the_whole_basis(
    make_basis: BasisFactory, settings: dict[str, Any]
) -> None:
    emitter_mask = np.zeros((12, 10), bool)
    emitter_mask[3:6, 2:4] = True
    basis = make_basis(3, seen=emitter_mask)
    rng = np.random.default_rng(2)
    mix = np.einsum("nhwc,n->hwc", basis.images, [0.7, 0.9, 0.0]).astype(np.float32)
    image = mix + 0.2 * rng.random(mix.shape, np.float32)
    importance = rng.random((12, 10), np.float32) * (np.arange(12) > 1)[:, None]
    target = Target.of(image, importance.astype(np.float32))
    fit = Fit(literal=True, **{k: v for k, v in settings.items() if k != "constraints"})
    assert reason_against_sums(target, fit) == ""
    first, second = (sum_rows(cut_rows(basis, rows), target, rows, fit) for rows in ROWS)
    expected = solve(basis, target, literal=True, **settings).weights
    # Sums of float64 in another order.
    np.testing.assert_allclose(solve_sums(basis, first + second, **settings), expected, atol=1e-9)


def test_what_needs_pictures_says_so() -> None:
    image = np.ones((4, 4, 3), np.float32)
    target = Target.of(image, np.eye(4))
    for fit in (Fit(), Fit(hold=1.0), Fit(space="display"), Fit(colors="gentle")):
        assert bool(reason_against_sums(target, fit)) == (fit != Fit())
    white = replace(target, at_least=np.ones((4, 4, 3), bool))
    assert "brighter" in reason_against_sums(white, Fit(literal=True))


def test_where_nothing_counts(make_basis: BasisFactory) -> None:
    basis = make_basis(2, images=np.zeros((2, 12, 10, 3)))
    target = Target.of(np.zeros((12, 10, 3)))
    sums = sum_rows(cut_rows(basis, ROWS[0]), target, ROWS[0], Fit())
    with pytest.raises(TargetError, match="no light reaches"):
        solve_sums(basis, sums)


LOOKS = """
[defaults]
scene = "room.xml"
settings = { spp = 16, literal = true }

[[look]]
paintings = ["bright.exr", "dark.exr"]
want = ["WANT"]
"""


@pytest.fixture(scope="module")
def batch_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sums")
    write_room(folder, lights=LIGHTS["panel"] + LIGHTS["bulb"])
    rng = np.random.default_rng(0)
    for name, light in (("bright", 0.8), ("dark", 0.2)):
        write_rgb(folder / f"{name}.exr", light * rng.random((20, 24, 3), np.float32))
    return folder


def lighting_of(answer: Lighting) -> np.ndarray:
    return np.array(list(answer.emission.values()))


def label_listener(labels: list[str]) -> Any:
    return lambda label, *_: labels.append(label)


@pytest.fixture
def _one_thread() -> Iterator[None]:
    limit_threads(1)
    yield
    limit_threads(None)


@pytest.mark.usefixtures("_one_thread")
def test_a_batch_of_lightings(batch_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render_parts, "PART_SAMPLES", 2**10)
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(batch_folder / "cache"))
    lightings = {}
    for step in ("lights", "solve"):
        (batch_folder / "looks.toml").write_text(LOOKS.replace("WANT", step), encoding="utf-8")
        output_folder = batch_folder / step
        outcome = run_batch(plan_batch(batch_folder / "looks.toml", output_folder))
        assert not outcome.failed
        assert run_batch(plan_batch(batch_folder / "looks.toml", output_folder)).done == []
        answers = {
            name: read_lighting(output_folder / name / "lighting.json")
            for name in ("bright", "dark")
        }
        lightings[step] = {name: lighting_of(answer) for name, answer in answers.items()}
    file_names = {file.name for file in (batch_folder / "lights" / "bright").iterdir()}
    assert file_names == {"lighting.json", "relit.xml", "result.json"}
    for name, lights in lightings["lights"].items():
        # A basis in a file is rounded where a sixteenth of its noise hides it; sums are not.
        errors = np.array([light.standard_error for light in answers[name].lights])
        assert (np.abs(lights - lightings["solve"][name]) < errors / 8).all()
    # Of a basis that is kept by now the same comes without rendering.
    text = LOOKS.replace("WANT", "lights")
    (batch_folder / "looks.toml").write_text(text, encoding="utf-8")
    labels: list[str] = []
    outcome = run_batch(
        plan_batch(batch_folder / "looks.toml", batch_folder / "kept"), None, label_listener(labels)
    )
    assert outcome.done == ["bright", "dark"]
    assert "basis" not in labels
    for name in ("bright", "dark"):
        kept_weights = lighting_of(read_lighting(batch_folder / "kept" / name / "lighting.json"))
        # Sums of float64 in another order.
        np.testing.assert_allclose(kept_weights, lightings["solve"][name], rtol=1e-9)
    # Of one that nobody has, nothing is kept.
    cache = [file for file in (batch_folder / "cache").rglob("*.basis.exr") if file.is_file()]
    assert len(cache) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("literal = true", "settings need literal = true"),
        ('want = ["lights"]', "leave the rest out"),
        ("spp = 16", "refine needs images"),
    ],
)
def test_what_does_not_go_with_it_is_said_before_anything_is_rendered(
    batch_folder: Path, change: str, message: str
) -> None:
    replacements = {
        "literal = true": "literal = false",
        'want = ["lights"]': 'want = ["lights", "verify"]',
        "spp = 16": "spp = 16, refine = 1",
    }[change]
    text = LOOKS.replace("WANT", "lights").replace(change, replacements)
    (batch_folder / "wrong.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BatchError, match=message):
        plan_batch(batch_folder / "wrong.toml", batch_folder / "wrong")


def test_light_groups_are_lit_without_a_picture_too(tmp_path: Path) -> None:
    """Their noise is not known, so that rounding is told from their pixels."""
    images = pictures()
    layers = {f"RGBA_{name}": x for name, x in zip("abc", images, strict=True)}
    interleaved(tmp_path / "groups.exr", layers)
    write_rgb(tmp_path / "bright.exr", 2 * images[0] + images[2])
    write_rgb(tmp_path / "dark.exr", np.maximum(images.sum(axis=0) / 4 - 0.05, 0))
    lightings, remaining_files = {}, {}
    for step in ("lights", "solve"):
        text = LOOKS.replace('scene = "room.xml"', 'light_groups = "groups.exr"')
        text = text.replace("spp = 16, ", "").replace("WANT", step)
        (tmp_path / "looks.toml").write_text(text, encoding="utf-8")
        outcome = run_batch(plan_batch(tmp_path / "looks.toml", tmp_path / step))
        assert (outcome.done, outcome.failed) == (["bright", "dark"], {})
        assert run_batch(plan_batch(tmp_path / "looks.toml", tmp_path / step)).done == []
        for name in outcome.done:
            folder = tmp_path / step / name
            lightings[step, name] = read_lighting(folder / "lighting.json")
            remaining_files[step, name] = {file.name for file in folder.iterdir()}
    for name in ("bright", "dark"):
        assert lightings["lights", name].emission == lightings["solve", name].emission
        assert remaining_files["lights", name] == {"lighting.json", "result.json"}
        assert remaining_files["solve", name] > remaining_files["lights", name]
    bright = np.array(list(lightings["lights", "bright"].emission.values()))
    # float32 pixels.
    np.testing.assert_allclose(bright, [[2.0] * 3, [0.0] * 3, [1.0] * 3], atol=1e-6)
