"""The cache of bases: found again, gone on with, never mixed, never in the way."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run
from renderer import LIGHTS, same_basis, write_room

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.render.obtain import obtain_basis
from lightpaint.basis.render.render import is_on_the_way
from lightpaint.errors import LightpaintError, SceneError
from lightpaint.pipeline import obtain
from lightpaint.progress import Interrupted
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.settings import Settings


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


def _said(scene: Scene, **settings: object) -> tuple[Basis, list[str]]:
    """The basis that a job with these settings obtains, and what it says."""
    said: list[str] = []

    class Hears:
        def __call__(self, *_: object) -> None: ...

        def say(self, text: str) -> None:
            said.append(text)

    return obtain(scene, Settings(**settings), Hears()), said  # type: ignore[arg-type]


def test_what_is_kept_beyond_what_is_asked_for_is_said(scene: Scene) -> None:
    obtain_basis(scene, spp=32)
    basis, said = _said(scene, spp=16)
    assert basis.origin.spp == 32
    assert said == [
        "basis of 32 samples per pixel kept from an earlier run: more than the 16 asked for, so "
        "the answer may differ a little from one of these (exact_spp=True takes just them)"
    ]
    # One more than an odd number makes the halves equal, and is no news.
    for spp in (31, 32):
        assert "renders it anew" in "".join(_said(scene, spp=spp)[1])


def test_exactly_what_is_asked_for_whatever_is_kept(scene: Scene) -> None:
    fresh = obtain_basis(scene, spp=16, use_cache=False)
    obtain_basis(scene, spp=32)
    before = [entry.path.read_bytes() for entry in cache.entries()]
    exact, said = _said(scene, spp=16, exact_spp=True)
    assert said == []
    same_basis(exact, fresh)
    # The one with more samples is not thrown away.
    assert [entry.path.read_bytes() for entry in cache.entries()] == before
    cache.drop(cache.entries())
    obtain_basis(scene, spp=8)
    same_basis(obtain_basis(scene, spp=16, exact_spp=True), fresh)
    [entry] = cache.entries()
    assert entry.origin == fresh.origin
    log: list[int] = []
    same_basis(obtain_basis(scene, spp=16, exact_spp=True, progress=passes(log)), fresh)
    assert log == []


@pytest.mark.parametrize("integrator", ["path", "volpathmis"])
def test_the_first_samples_of_what_is_asked_for_are_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, integrator: str
) -> None:
    monkeypatch.setattr("lightpaint.scene.render.SAMPLES_PER_PASS", 4 * 4 * 24 * 20)
    path = write_room(
        tmp_path, integrator=f'<integrator type="{integrator}"/>', lights=LIGHTS["bulb"]
    )
    scene = load_scene(path)
    whole: list[int] = []
    fresh = obtain_basis(scene, spp=64, use_cache=False, progress=passes(whole))
    for after in (2, 3):
        done = 0

        def press_ctrl_c(_label: str, now: int, _total: int) -> None:
            nonlocal done
            done += now > 0
            if done == after:  # noqa: B023 (called in this round)
                os.kill(os.getpid(), signal.SIGINT)

        with pytest.raises(Interrupted):
            obtain_basis(scene, spp=64, exact_spp=True, progress=press_ctrl_c)
        assert is_on_the_way(scene, *_kept(), 64)
        log: list[int] = []
        same_basis(obtain_basis(scene, spp=64, exact_spp=True, progress=passes(log)), fresh)
        assert 0 < sum(now > 0 for now in log) < max(whole)
        cache.drop(cache.entries())
    # One that fewer samples ended has other passes.
    assert not is_on_the_way(scene, obtain_basis(scene, spp=6, use_cache=False), 64)


def _kept() -> list[Basis]:
    return [read_basis(entry.path) for entry in cache.entries()]


def test_exact_samples_and_a_time_go_ill_together(scene: Scene) -> None:
    with pytest.raises(SceneError, match="not with time_s"):
        obtain_basis(scene, time_s=1, exact_spp=True)
    with pytest.raises(LightpaintError, match="exact_spp is True and time_s 1"):
        Settings(time_s=1, exact_spp=True)


def test_a_basis_of_blocks_says_when_it_takes_more(tmp_path: Path) -> None:
    path = write_room(tmp_path, integrator='<integrator type="volpathmis"/>', lights=LIGHTS["bulb"])
    small = load_scene(path).reduced("1/3")
    assert _said(small, spp=4)[1] == [
        "basis of 18 samples per pixel, not 4: it takes one in each pixel of a block for each half"
    ]
    # No fewer can be had.
    again = (
        "basis of 18 samples per pixel kept from an earlier run (use_cache=False renders it anew)"
    )
    assert _said(small, spp=4)[1] == [again]
    assert _said(small, spp=36)[1] == []
    assert "more than the 4 asked for" in _said(small, spp=4)[1][0]


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
    left_over = cache.entries()
    assert cache.drop(left_over) == sum(entry.size for entry in left_over)
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


def test_bases_are_dropped_by_scene_or_file(
    tmp_path: Path, empty_cache: Path, make_basis: Any
) -> None:
    origins = [("hall.xml", "0" * 32), ("hall.xml", "1" * 32), ("room.xml", "2" * 32)]
    for scene, identity in origins:
        basis = make_basis(2)
        origin = replace(basis.origin, scene=scene, scene_identity=identity)
        assert cache.keep(replace(basis, origin=origin))
    (empty_cache / f"damaged{cache.SUFFIX}").write_bytes(b"junk")

    def scenes(pattern: str) -> list[str]:
        return sorted(x.origin.scene if x.origin else "?" for x in cache.named(pattern))

    assert scenes("hall.xml") == scenes("hall") == scenes("h*") == ["hall.xml"] * 2
    assert scenes("*.xml") == ["hall.xml"] * 2 + ["room.xml"]
    assert scenes("damaged") == scenes("dam*") == ["?"]
    assert scenes("hal") == scenes("") == []
    [file] = {entry.path.name for entry in cache.named("room")}
    assert scenes(file) == scenes(file.removesuffix(cache.SUFFIX)) == ["room.xml"]
    here = {"LIGHTPAINT_CACHE": str(empty_cache)}
    size = sum(entry.size for entry in cache.named("hall"))
    done = run(tmp_path, "cache", "drop", "hall", "h*", **here)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("hall.xml") == 2
    assert f"2 deleted from {empty_cache}: {size / 1e6:.1f} MB are free" in done.stdout
    assert scenes("*") == ["?", "room.xml"]
    for line, says in (
        (["drop", "hall"], "no basis of 'hall' is kept in"),
        (["drop", "room", "gone"], "no basis of 'gone' is kept in"),  # and the other stays
        (["drop"], "cache drop needs the name of a scene"),
        (["clear", "room"], "cache clear takes no name: cache drop room does"),
        (["list", "room"], "cache list takes no name"),
    ):
        done = run(tmp_path, "cache", *line, **here)
        assert done.returncode == 2
        assert says in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert "it has room.xml" in run(tmp_path, "cache", "drop", "gone", **here).stderr
    assert scenes("*") == ["?", "room.xml"]
    assert "of at most 8590 MB" in run(tmp_path, "cache", **here).stdout
    assert run(tmp_path, "cache", "clear", **here).stdout.startswith("2 deleted")
    assert cache.entries() == []
