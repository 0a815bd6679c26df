"""A basis in parts: the same to the last bit however it is cut, whoever renders what, and when."""

import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from conftest import BasisFactory
from renderer import LIGHTS, write_room

from lightpaint.basis.basis import Basis
from lightpaint.basis.render import parts as parts_module
from lightpaint.basis.render.parts import (
    Part,
    PartRenderer,
    PartSums,
    lesson,
    plan_parts,
    render_in_parts,
)
from lightpaint.basis.render.render import render_basis
from lightpaint.errors import SceneError
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.scene.scene import Scene, load_scene

SPP = 32


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Sums of one thread are the same to the last bit."""
    limit_threads(1)
    yield
    limit_threads(None)


@pytest.fixture
def _small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts_module, "SAMPLES", 2**8)


@pytest.fixture(scope="module")
def learned(small_room: Scene) -> np.ndarray:
    found = lesson(small_room, SPP, 0)
    assert found is not None
    return found


def made(scene: Scene, learned: np.ndarray | None, order: list[Part], plan: list[Part]) -> Basis:
    sums, renderer = PartSums(scene, plan, seed=0), PartRenderer(scene, 0, learned)
    for part in order:
        sums.add(part, *renderer.render(part))
    renderer.close()
    return sums.basis(learned)


def same(one: Basis, other: Basis) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("images", "half_differences", "emitters_seen")
    )


@pytest.mark.parametrize("spp", [2, 3, 64, 1000, 100_000])
@pytest.mark.parametrize("samples", [2**8, 2**12, 2**30])
def test_every_sample_of_every_pixel_is_in_one_part(
    small_room: Scene, spp: int, samples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts_module, "SAMPLES", samples)
    height, _ = small_room.size
    covered = Counter[tuple[int, int]]()
    begun: dict[tuple[int, int], int] = {}
    for part in plan_parts(small_room, spp):
        for row in range(part.top, part.bottom):
            assert begun.get((part.half, row), 0) == part.first
            begun[part.half, row] = part.first + part.spp
            covered[part.half, row] += part.spp
    assert set(covered.values()) == {-(-spp // 2)}
    assert len(covered) == 2 * height
    with pytest.raises(SceneError, match="too few"):
        plan_parts(small_room, 1)


@pytest.mark.usefixtures("_small_parts")
def test_parts_in_any_order_make_the_same_basis(small_room: Scene, learned: np.ndarray) -> None:
    plan = plan_parts(small_room, SPP)
    assert len({part.top for part in plan}) > 1
    assert len({part.first for part in plan}) > 1
    shuffled = plan.copy()
    random.Random(3).shuffle(shuffled)
    assert same(made(small_room, learned, plan, plan), made(small_room, learned, shuffled, plan))


def test_rows_may_be_cut_anywhere(
    small_room: Scene, learned: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = plan_parts(small_room, SPP)
    monkeypatch.setattr(parts_module, "BYTES", 5 * 24 * 12 * 3)
    cut = plan_parts(small_room, SPP)
    assert (len(whole), len(cut)) == (2, 14)
    assert same(made(small_room, learned, whole, whole), made(small_room, learned, cut, cut))


def test_a_lesson_is_the_same_each_time(small_room: Scene, learned: np.ndarray) -> None:
    again = lesson(small_room, SPP, 0)
    assert again is not None
    np.testing.assert_array_equal(again, learned)


def test_they_are_samples_of_the_same_pictures(
    small_room: Scene, small_room_basis: BasisFactory
) -> None:
    ours, its = render_in_parts(small_room, spp=64), small_room_basis(spp=64, seed=5)
    differences = ours.images - its.images
    noise = np.sqrt(ours.half_differences**2 + its.half_differences**2)
    # Sums over the picture, in standard errors.
    off = differences.sum(axis=(1, 2, 3)) / np.sqrt((noise**2).sum(axis=(1, 2, 3)))
    assert np.abs(off).max() < 4
    assert ours.origin.halves == (32, 32)
    np.testing.assert_array_equal(ours.emitters_seen, its.emitters_seen)


def test_what_is_there_counts(small_room: Scene) -> None:
    half = render_in_parts(small_room, spp=16)
    whole, on = render_in_parts(small_room, spp=32), render_in_parts(small_room, spp=32, start=half)
    assert on.origin == whole.origin
    # The sums behind a basis are known up to round-off of float32.
    scale = whole.images.max(axis=(1, 2, 3), keepdims=True)
    assert (np.abs(on.images - whole.images) / scale).max() < 1e-5
    # And an ordinary render goes on from parts.
    both = render_basis(small_room, spp=64, start=half)
    assert both.origin.halves == (32, 32)


def test_lights_that_are_rendered_one_by_one(tmp_path: Path) -> None:
    integrator = '<integrator type="ptracer"><integer name="max_depth" value="3"/></integrator>'
    lights = LIGHTS["panel"] + LIGHTS["bulb"]
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    plan = plan_parts(scene, 8)
    assert len(plan) == 4
    parts = made(scene, lesson(scene, 8, 0), plan[::-1], plan)
    whole = render_basis(scene, spp=8)
    assert same(parts, whole)
    assert parts.origin == whole.origin
