"""The cache of bases: found again, gone on with, never mixed, never in the way."""

import os
from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

from lightpaint.basis import cache
from lightpaint.basis.file import read_basis
from lightpaint.basis.render.obtain import obtain_basis
from lightpaint.scene.scene import Scene, load_scene


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(folder))
    return folder


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def passes(log: list[int]) -> object:
    """A progress report that counts rendered passes."""
    return lambda _label, done, _total: log.append(done)


def test_a_second_time_renders_nothing(scene: Scene) -> None:
    log: list[int] = []
    first = obtain_basis(scene, spp=8)
    second = obtain_basis(scene, spp=8, progress=passes(log))
    assert log == []
    np.testing.assert_array_equal(first.images, second.images)
    assert obtain_basis(scene, spp=4).origin.spp == 8


def test_more_samples_are_added(scene: Scene) -> None:
    obtain_basis(scene, spp=8)
    assert obtain_basis(scene, spp=20).origin.spp == 20
    assert obtain_basis(scene, spp=20).origin.passes == (2, 2)
    assert [entry.origin.spp for entry in cache.entries() if entry.origin] == [20]


def test_another_scene_sensor_or_seed_is_another_basis(scene: Scene, tmp_path: Path) -> None:
    obtain_basis(scene, spp=2)
    obtain_basis(scene, spp=2, seed=1)
    obtain_basis(load_scene(scene.path, parameters={"width": 20}), spp=2)
    text = scene.path.read_text(encoding="utf-8")
    scene.path.write_text(text.replace("0.7 0.5 0.4", "0.7 0.5 0.5"), encoding="utf-8")
    obtain_basis(load_scene(scene.path), spp=2)
    assert len(cache.entries()) == 4


def test_no_cache_leaves_none(scene: Scene) -> None:
    obtain_basis(scene, spp=2, use_cache=False)
    assert cache.entries() == []


@pytest.mark.parametrize("damage", ["cut", "junk", "empty"])
def test_a_damaged_one_is_made_anew(scene: Scene, damage: str) -> None:
    obtain_basis(scene, spp=2)
    [entry] = cache.entries()
    whole = entry.path.read_bytes()
    entry.path.write_bytes({"cut": whole[: len(whole) // 2], "junk": b"junk", "empty": b""}[damage])
    log: list[int] = []
    obtain_basis(scene, spp=2, progress=passes(log))
    assert log
    assert read_basis(entry.path).origin.spp == 2


def test_the_longest_unused_goes_first(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(3):
        obtain_basis(scene, spp=2, seed=seed)
    oldest, *_ = by_age = cache.entries()
    for age, entry in enumerate(by_age):
        os.utime(entry.path, (1000 + age, 1000 + age))
    monkeypatch.setattr(cache, "LARGEST", int(2.5 * oldest.size))
    obtain_basis(scene, spp=2, seed=3)
    left = {entry.path for entry in cache.entries()}
    assert by_age[2].path in left
    assert len(left) == 2
    assert cache.clear() == 2
    assert cache.entries() == []


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "file" / "cache"))
    assert obtain_basis(scene, spp=4).origin.spp == 4


def test_separate_renders_are_kept_as_well(tmp_path: Path) -> None:
    log: list[int] = []
    path = write_room(tmp_path, integrator='<integrator type="volpathmis"/>')
    scene = load_scene(path)
    obtain_basis(scene, spp=4)
    assert obtain_basis(scene, spp=4, progress=passes(log)).origin.spp == 4
    assert log == []
