"""A basis in parts: the same to the last bit however it is cut, whoever renders what, and when."""

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render, render_budget
from lightpaint.basis.render import render_parts as parts_module
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.render_parts import Part, PartRenderer, PartSums, plan_parts
from lightpaint.basis.render.rendered_basis import mean_and_half_difference
from lightpaint.errors import SceneError
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.scene.scene_reader import load_scene

SPP = 32


@pytest.fixture(autouse=True)
def _short_training(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12, 2**13))


@pytest.fixture
def _all_threads() -> Iterator[None]:
    yield
    limit_threads(None)


@pytest.fixture
def guide_table(small_room: Scene) -> np.ndarray:
    return basis_render.train_guide(small_room, 0)


def render_in_order(
    scene: Scene,
    guide_table: np.ndarray | None,
    order: list[Part],
    plan: list[Part],
    start: Basis | None = None,
) -> Basis:
    sums = PartSums(scene, plan, seed=0, start=start)
    renderer = PartRenderer(scene, 0, guide_table)
    for part in order:
        sums.add(part, *renderer.render(part))
    renderer.close()
    return sums.basis(guide_table)


def is_same(one: Basis, other: Basis) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("images", "half_differences", "emitters_seen")
    )


@pytest.mark.parametrize("spp", [2, 3, 64, 1000, 100_000])
@pytest.mark.parametrize("samples", [2**8, 2**12, 2**30])
def test_every_sample_of_every_pixel_is_in_one_part(
    small_room: Scene, spp: int, samples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts_module, "PART_SAMPLES", samples)
    height, _ = small_room.size
    covered = Counter[int]()
    for part in plan_parts(small_room, spp):
        assert part.first == 0
        for row in range(part.top, part.bottom):
            covered[row] += part.spp
    assert covered == dict.fromkeys(range(height), -(-spp // 2))
    with pytest.raises(SceneError, match="too few"):
        plan_parts(small_room, 1)


@pytest.mark.nightly
def test_parts_in_any_order_make_the_basis_of_one_go(
    small_room: Scene, guide_table: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    single_render = render_basis(small_room, spp=SPP)
    monkeypatch.setattr(parts_module, "PART_SAMPLES", 2**12)
    # Kernels of three samples of a pixel, or of all rows.
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 4 * 3 * 24 * 3)
    plan = plan_parts(small_room, SPP)
    assert len(plan) == 4
    shuffled = plan.copy()
    random.Random(3).shuffle(shuffled)
    for order in (plan, shuffled):
        basis = render_in_order(small_room, guide_table, order, plan)
        assert is_same(basis, single_render)
        assert basis.origin == single_render.origin
        np.testing.assert_array_equal(basis.guide_table, single_render.guide_table)


@pytest.mark.usefixtures("_all_threads")
@pytest.mark.parametrize("threads", [1, 2])
def test_threads_decide_no_bit(small_room: Scene, threads: int) -> None:
    single_render = render_basis(small_room, spp=SPP)
    limit_threads(threads)
    assert is_same(render_basis(small_room, spp=SPP), single_render)


@pytest.mark.nightly
def test_any_budget_that_comes_to_the_same_samples_makes_the_same(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Steps of three samples of a pixel of each half.
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 4 * 3 * 24 * 20)
    seconds = iter(range(1000))
    clocks = SimpleNamespace(monotonic=lambda: next(seconds), process_time=lambda: 0.0)
    monkeypatch.setattr(render_budget, "time", clocks)
    basis = render_basis(small_room, time_s=9)
    assert basis.origin.spp % 6 == 0
    assert basis.origin.spp > 6
    monkeypatch.undo()
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12, 2**13))
    single_render = render_basis(small_room, spp=basis.origin.spp)
    assert is_same(basis, single_render)
    assert basis.origin == single_render.origin


def test_what_is_there_counts(small_room: Scene) -> None:
    half = render_basis(small_room, spp=16)
    plan = plan_parts(small_room, 32, start=half)
    in_parts = render_in_order(small_room, half.guide_table, plan, plan, start=half)
    on = render_basis(small_room, spp=32, start=half)
    assert is_same(in_parts, on)
    single_render = render_basis(small_room, spp=32)
    assert in_parts.origin == on.origin == single_render.origin
    # The sums behind a basis are known up to round-off of float32.
    scale = single_render.images.max(axis=(1, 2, 3), keepdims=True)
    assert (np.abs(on.images - single_render.images) / scale).max() < 1e-5


def test_the_training_depends_on_the_seed_alone(small_room: Scene, guide_table: np.ndarray) -> None:
    np.testing.assert_array_equal(basis_render.train_guide(small_room, 0), guide_table)
    for spp in (2, 64):
        np.testing.assert_array_equal(render_basis(small_room, spp=spp).guide_table, guide_table)
    assert (basis_render.train_guide(small_room, 1) != guide_table).any()


@pytest.mark.nightly
def test_what_an_older_version_has_rendered_is_used_but_not_gone_on_with(
    small_room: Scene,
) -> None:
    new = render_basis(small_room, spp=4)
    old = replace(new, origin=replace(new.origin, method="one pass"))
    assert render_basis(small_room, spp=4, start=old).origin.method == "one pass"
    assert is_same(render_basis(small_room, spp=8, start=old), render_basis(small_room, spp=8))


@pytest.mark.usefixtures("_all_threads")
def test_lights_that_are_rendered_one_by_one(tmp_path: Path) -> None:
    """By Mitsuba, which adds in the same order on one thread alone."""
    limit_threads(1)
    integrator = '<integrator type="ptracer"><integer name="max_depth" value="3"/></integrator>'
    lights = LIGHTS["panel"] + LIGHTS["bulb"]
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    plan = plan_parts(scene, 8)
    assert len(plan) == 4
    parts = render_in_order(scene, None, plan[::-1], plan)
    single_render = render_basis(scene, spp=8)
    assert is_same(parts, single_render)
    assert parts.origin == single_render.origin


def test_a_number_that_is_not_finite_becomes_dark_and_leaves_the_others() -> None:
    first, second = (np.full((2, 4, 5, 3), x, np.float32) for x in (8, 4))
    first[1, 2, 3, 0], second[0, 1, 1, 2] = np.nan, np.inf
    mean, half_difference = mean_and_half_difference([first, second], (4, 4))
    broken = np.zeros((2, 4, 5, 3), bool)
    broken[1, 2, 3, 0] = broken[0, 1, 1, 2] = True
    assert (mean == np.where(broken, 0, 1.5)).all()
    assert (half_difference == np.where(broken, 0, 0.5)).all()
