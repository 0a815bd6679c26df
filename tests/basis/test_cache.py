"""The cache of bases: found again, gone on with, never mixed, never in the way."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import run
from nightly import nightly
from renderer import LIGHTS, assert_equal_bits, same_basis, write_room

from lightpaint.basis.cache import basis_cache
from lightpaint.basis.cache.basis_cache import SUFFIX, SUMS_SUFFIX, TAG
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file import basis_file
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import is_on_the_way
from lightpaint.errors import LightpaintError, OutputError, SceneError
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job_bases import obtain
from lightpaint.progress import Interrupted
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: What one is called that no program has written to its end.
DAMAGED = "da" * 16


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


def test_what_is_kept_is_copied_rather_than_written_again(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the cache holds exactly it: its samples, its lights and all that a file has."""
    basis, path = obtain_basis(scene, spp=8), tmp_path / "a.basis.exr"
    write_basis(path, basis)
    expected = path.read_bytes()
    written: list[Basis] = []
    monkeypatch.setattr(basis_file, "write_basis", lambda path, basis: written.append(basis))
    basis_cache.write_from_cache(path, basis)
    assert not written
    assert path.read_bytes() == expected
    lights = [replace(light, name=f"{light.name} of the hall") for light in basis.lights]
    others = [
        replace(basis, lights=lights),
        replace(basis, features=None),
        replace(basis, indirect=None),
        replace(basis, origin=replace(basis.origin, halves=(5, 5))),
        replace(basis, origin=replace(basis.origin, seed=7)),  # never rendered
    ]
    for other in others:
        basis_cache.write_from_cache(path, other)
    assert written == others
    assert path.read_bytes() == expected


def test_more_samples_are_added(scene: Scene) -> None:
    obtain_basis(scene, spp=8)
    assert obtain_basis(scene, spp=20).origin.spp == 20
    # As many as are asked for at once, whatever number of runs has rendered them.
    assert obtain_basis(scene, spp=20).origin == render_basis(scene, spp=20).origin
    assert [entry.origin.spp for entry in basis_cache.entries() if entry.origin] == [20]


@pytest.mark.parametrize("use_cache", [True, False])
def test_what_was_just_rendered_is_as_from_its_file(scene: Scene, use_cache: bool) -> None:
    """The same command gives the same files to the bit, whether it renders or not."""
    fresh_basis = obtain_basis(scene, spp=16, use_cache=use_cache)
    rendered = render_basis(scene, spp=16)
    assert (fresh_basis.images != rendered.images).any()  # rounded
    if not use_cache:
        obtain_basis(scene, spp=16)
    cached = _cached_bases()[0]
    for name in ("images", "half_differences"):
        assert getattr(cached, name).tobytes() == getattr(fresh_basis, name).tobytes()


@pytest.mark.nightly
def test_what_is_large_is_read_from_its_file_as_soon_as_it_is_kept(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = obtain_basis(scene, spp=16)
    basis_cache.delete_entries(basis_cache.entries())
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    large = obtain_basis(scene, spp=16)
    assert isinstance(large.planes, FilePlanes)
    assert isinstance(large.noise, FilePlanes)
    assert large.lights == expected.lights
    assert large.images.tobytes() == expected.images.tobytes()


def _obtain_basis(scene: Scene, **settings: object) -> tuple[Basis, list[str]]:
    """The basis that a job with these settings obtains, and what it says."""
    messages: list[str] = []

    class Hears:
        def __call__(self, *_: object) -> None: ...

        def say(self, text: str) -> None:
            messages.append(text)

    return obtain(scene, Settings(**settings), Hears()), messages  # type: ignore[arg-type]


def test_what_is_kept_beyond_what_is_asked_for_is_said(scene: Scene) -> None:
    obtain_basis(scene, spp=32)
    basis, messages = _obtain_basis(scene, spp=16)
    assert basis.origin.spp == 32
    assert messages == [
        "basis of 32 samples per pixel kept from an earlier run: more than the 16 requested, so "
        "the answer may differ a little from one with exactly these (exact_spp=True)"
    ]
    # One more than an odd number makes the halves equal, and is no news.
    for spp in (31, 32):
        assert "renders it again" in "".join(_obtain_basis(scene, spp=spp)[1])


def test_exactly_what_is_asked_for_whatever_is_kept(scene: Scene) -> None:
    fresh_basis = obtain_basis(scene, spp=16, use_cache=False)
    obtain_basis(scene, spp=32)
    before = [entry.path.read_bytes() for entry in basis_cache.entries()]
    exact, messages = _obtain_basis(scene, spp=16, exact_spp=True)
    assert messages == []
    same_basis(exact, fresh_basis)
    # The one with more samples is not thrown away.
    assert [entry.path.read_bytes() for entry in basis_cache.entries()] == before
    basis_cache.delete_entries(basis_cache.entries())
    obtain_basis(scene, spp=8)
    same_basis(obtain_basis(scene, spp=16, exact_spp=True), fresh_basis)
    [entry] = basis_cache.entries()
    assert entry.origin == fresh_basis.origin
    log: list[int] = []
    same_basis(obtain_basis(scene, spp=16, exact_spp=True, progress=passes(log)), fresh_basis)
    assert log == []


@pytest.mark.parametrize("integrator", ["path", nightly("volpathmis")])
def test_the_first_samples_of_what_is_asked_for_are_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, integrator: str
) -> None:
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 4 * 4 * 24 * 20)
    path = write_room(
        tmp_path, integrator=f'<integrator type="{integrator}"/>', lights=LIGHTS["bulb"]
    )
    scene = load_scene(path)
    pass_counts: list[int] = []
    fresh_basis = obtain_basis(scene, spp=64, use_cache=False, progress=passes(pass_counts))
    for after in (2, 3):
        pass_count = 0

        def press_ctrl_c(_label: str, count: int, _total: int) -> None:
            nonlocal pass_count
            pass_count += count > 0
            if pass_count == after:  # noqa: B023 (called in this round)
                os.kill(os.getpid(), signal.SIGINT)

        with pytest.raises(Interrupted):
            obtain_basis(scene, spp=64, exact_spp=True, progress=press_ctrl_c)
        [unfinished] = _cached_bases()
        exact = replace(unfinished, sums=basis_cache.sums_of(unfinished))
        assert is_on_the_way(scene, exact, 64)
        assert not is_on_the_way(scene, unfinished, 64)
        log: list[int] = []
        continuation = obtain_basis(scene, spp=64, exact_spp=True, progress=passes(log))
        assert_equal_bits(continuation, fresh_basis)
        assert not sums_files()
        assert 0 < sum(count > 0 for count in log) < max(pass_counts)
        basis_cache.delete_entries(basis_cache.entries())
    # One that fewer samples ended has other passes.
    assert not is_on_the_way(scene, obtain_basis(scene, spp=6, use_cache=False), 64)


def sums_files() -> list[Path]:
    return list(basis_cache.folder().glob(f"*{SUMS_SUFFIX}"))


def _render_and_kill(scene: Scene, spp: int, after: int) -> None:
    """Render in a process that is killed once that many steps are done, all of them kept."""
    code = f"""
import os, signal, sys
import lightpaint as lp, lightpaint.scene.scene_render
from lightpaint.basis.cache.cached_render import obtain_basis
sys.modules["lightpaint.basis.render.render_budget"].KEEP_EVERY_S = 0
lightpaint.scene.scene_render.SAMPLES_PER_PASS = {4 * 4 * 24 * 20}
def kill(label, done, total):
    if done == {after}:
        os.kill(os.getpid(), signal.SIGKILL)
obtain_basis(lp.load_scene({str(scene.path)!r}), spp={spp}, progress=kill)
"""
    process = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
    assert process.returncode == -signal.SIGKILL, process.stderr.decode()


def test_a_render_that_was_killed_goes_on_to_the_bits_of_one(scene: Scene) -> None:
    single_render = obtain_basis(scene, spp=64, use_cache=False)
    _render_and_kill(scene, 64, 3)
    [cached] = _cached_bases()
    assert 0 < cached.origin.spp < 64
    log: list[int] = []
    assert_equal_bits(obtain_basis(scene, spp=64, progress=passes(log)), single_render)
    assert log
    assert not sums_files()


@pytest.mark.nightly
@pytest.mark.parametrize("damage", ["cut", "missing", "of others"])
def test_without_its_sums_what_is_unfinished_counts_and_is_not_exact(
    scene: Scene, damage: str
) -> None:
    single_render = obtain_basis(scene, spp=32, use_cache=False)
    obtain_basis(scene, spp=8, is_final=False)
    [file] = sums_files()
    if damage == "cut":
        file.write_bytes(file.read_bytes()[:1000])
    elif damage == "missing":
        file.unlink()
    else:
        np.savez(file, sums_a=np.zeros(3, np.float32), sums_b=np.zeros(3, np.float32))
    [entry] = basis_cache.entries()
    before = entry.path.read_bytes()
    same_basis(obtain_basis(scene, spp=32), single_render, of_file=True)
    entry.path.write_bytes(before)
    # All of it is rendered again where the same samples are asked for.
    assert_equal_bits(obtain_basis(scene, spp=32, exact_spp=True), single_render)


def test_sums_go_with_their_basis(scene: Scene) -> None:
    obtain_basis(scene, spp=2, is_final=False)
    obtain_basis(scene, spp=8, is_final=False)
    [file], [entry] = sums_files(), basis_cache.entries()
    assert entry.size == entry.path.stat().st_size + file.stat().st_size
    basis_cache.delete_entries([entry])
    assert not sums_files()


def _cached_bases() -> list[Basis]:
    return [read_basis(entry.path) for entry in basis_cache.entries()]


def test_exact_samples_and_a_time_go_ill_together(scene: Scene) -> None:
    with pytest.raises(SceneError, match="not with time_s"):
        obtain_basis(scene, time_s=1, exact_spp=True)
    with pytest.raises(LightpaintError, match="exact_spp is True and time_s 1"):
        Settings(time_s=1, exact_spp=True)


@pytest.mark.nightly
def test_a_basis_of_blocks_says_when_it_takes_more(tmp_path: Path) -> None:
    path = write_room(tmp_path, integrator='<integrator type="volpathmis"/>', lights=LIGHTS["bulb"])
    small = load_scene(path).reduced("1/3")
    assert _obtain_basis(small, spp=4)[1] == [
        "basis of 18 samples per pixel, not 4: a block needs a sample in each pixel for each half"
    ]
    # No fewer can be had.
    message = (
        "basis of 18 samples per pixel kept from an earlier run (use_cache=False renders it again)"
    )
    assert _obtain_basis(small, spp=4)[1] == [message]
    assert _obtain_basis(small, spp=36)[1] == []
    assert "more than the 4 requested" in _obtain_basis(small, spp=4)[1][0]


@pytest.mark.nightly
def test_another_scene_sensor_or_seed_is_another_basis(scene: Scene, tmp_path: Path) -> None:
    obtain_basis(scene, spp=2)
    obtain_basis(scene, spp=2, seed=1)
    obtain_basis(load_scene(scene.path, parameters={"width": 20}), spp=2)
    text = scene.path.read_text(encoding="utf-8")
    scene.path.write_text(text.replace("0.7 0.5 0.4", "0.7 0.5 0.5"), encoding="utf-8")
    obtain_basis(load_scene(scene.path), spp=2)
    assert len(basis_cache.entries()) == 4


def test_no_cache_leaves_none(scene: Scene) -> None:
    obtain_basis(scene, spp=2, use_cache=False)
    assert basis_cache.entries() == []


@pytest.mark.parametrize("damage", ["cut", "junk", "empty"])
def test_a_damaged_one_is_made_anew(scene: Scene, damage: str) -> None:
    obtain_basis(scene, spp=2)
    [entry] = basis_cache.entries()
    content = entry.path.read_bytes()
    entry.path.write_bytes(
        {"cut": content[: len(content) // 2], "junk": b"junk", "empty": b""}[damage]
    )
    log: list[int] = []
    obtain_basis(scene, spp=2, progress=passes(log))
    assert log
    assert read_basis(entry.path).origin.spp == 2


@pytest.mark.nightly
def test_the_longest_unused_goes_first(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(3):
        obtain_basis(scene, spp=2, seed=seed)
    oldest, *_ = by_age = basis_cache.entries()
    for age, entry in enumerate(by_age):
        os.utime(entry.path, (1000 + age, 1000 + age))
    monkeypatch.setattr(basis_cache, "MAX_BYTES", int(2.5 * oldest.size))
    obtain_basis(scene, spp=2, seed=3)
    remaining_files = {entry.path for entry in basis_cache.entries()}
    assert by_age[2].path in remaining_files
    assert len(remaining_files) == 2
    left_over = basis_cache.entries()
    assert basis_cache.delete_entries(left_over) == sum(entry.size for entry in left_over)
    assert basis_cache.entries() == []


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
        assert basis_cache.keep(replace(basis, origin=origin))
    content = next(empty_cache.glob(f"*{SUFFIX}")).read_bytes()
    (empty_cache / f"{DAMAGED}{SUFFIX}").write_bytes(
        content[: content.index(b"lightpaint-basis") + 20]
    )

    def scenes(pattern: str) -> list[str]:
        return sorted(
            x.origin.scene if x.origin else "?" for x in basis_cache.entries_named(pattern)
        )

    assert scenes("hall.xml") == scenes("hall") == scenes("h*") == ["hall.xml"] * 2
    assert scenes("*.xml") == ["hall.xml"] * 2 + ["room.xml"]
    assert scenes(DAMAGED) == scenes("da*") == ["?"]
    assert scenes("hal") == scenes("") == []
    [file] = {entry.path.name for entry in basis_cache.entries_named("room")}
    assert scenes(file) == scenes(file.removesuffix(SUFFIX)) == ["room.xml"]
    environment = {"LIGHTPAINT_CACHE": str(empty_cache)}
    size = sum(entry.size for entry in basis_cache.entries_named("hall"))
    completed = run(tmp_path, "cache", "drop", "hall", "h*", **environment)
    assert completed.returncode == 0, completed.stderr
    assert completed.stdout.count("hall.xml") == 2
    assert f"2 deleted from {empty_cache}: {size / 1e6:.1f} MB are free" in completed.stdout
    assert scenes("*") == ["?", "room.xml"]
    for line, message in (
        (["drop", "hall"], "no basis of 'hall' is kept in"),
        (["drop", "room", "gone"], "no basis of 'gone' is kept in"),  # and the other stays
        (["drop"], "cache drop needs the name of a scene"),
        (["clear", "room"], "cache clear takes no name: did you mean cache drop room"),
        (["list", "room"], "cache list takes no name"),
    ):
        completed = run(tmp_path, "cache", *line, **environment)
        assert completed.returncode == 2
        assert message in completed.stderr
        assert len(completed.stderr.splitlines()) == 1
    assert "it has room.xml" in run(tmp_path, "cache", "drop", "gone", **environment).stderr
    assert scenes("*") == ["?", "room.xml"]
    assert "of at most 8590 MB" in run(tmp_path, "cache", **environment).stdout
    assert run(tmp_path, "cache", "clear", **environment).stdout.startswith("2 deleted")
    assert basis_cache.entries() == []


def bases_of(make_basis: Any, *scenes: str) -> None:
    for k, scene in enumerate(scenes):
        basis = make_basis(2)
        origin = replace(basis.origin, scene=scene, scene_identity=f"{k:032x}")
        assert basis_cache.keep(replace(basis, origin=origin))


def test_a_folder_with_other_files_is_no_cache(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing in a folder of work is listed, deleted or written, whatever it is called."""
    work = tmp_path / "work"
    work.mkdir()
    write_basis(work / "evening.basis.exr", make_basis(2))
    write_basis(work / f"{'0f' * 16}.basis.exr", make_basis(2))
    (work / f"{'0f' * 16}.clean.npz").write_bytes(b"mine")
    (work / "parts" / "wheel").mkdir(parents=True)
    os.utime(work / "parts" / "wheel", (0, 0))
    before = sorted(work.rglob("*"))
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(work))
    for line in (["clear"], ["list"], ["drop", "*"]):
        completed = run(tmp_path, "cache", *line, LIGHTPAINT_CACHE=str(work))
        assert completed.returncode == 2
        [line_] = completed.stderr.splitlines()
        assert f"LIGHTPAINT_CACHE names {work}, which has other files in it" in line_
        assert "evening.basis.exr" in line_
    assert not basis_cache.keep(make_basis(2))
    with pytest.raises(OutputError, match="name a folder that is new or empty"):
        basis_cache.find("0", "sensor", 0, (4, 4))
    assert sorted(work.rglob("*")) == before


def test_no_page_opens_for_pictures_that_nothing_can_cache(tmp_path: Path) -> None:
    """The address would be printed first, and a browser would wait there."""
    scene = write_room(tmp_path)
    completed = run(
        tmp_path, "paint", str(scene), "--no-browser", "--port=0", LIGHTPAINT_CACHE=str(tmp_path)
    )
    assert completed.returncode == 2
    assert completed.stdout == ""
    assert f"LIGHTPAINT_CACHE names {tmp_path}, which has other files" in completed.stderr


def test_only_our_own_files_are_deleted(empty_cache: Path, make_basis: Any) -> None:
    """Also of a folder that is ours: by name, and by what is inside."""
    bases_of(make_basis, "hall.xml")
    [basis_path] = empty_cache.glob("*.basis.exr")
    others = {
        empty_cache / "evening.basis.exr": basis_path.read_bytes(),
        empty_cache / f"{'ab' * 16}.basis.exr": b"not by this program",
        empty_cache / f"{'ab' * 16}.clean.npz": b"not by this program",
        empty_cache / ".evening.basis.exr.abcdefgh" / "evening.basis.exr": b"being written",
        empty_cache / f".{'ab' * 16}.basis.exr.abcdefgh" / "something else": b"mine",
    }
    for path, data in others.items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
        os.utime(path.parent if path.parent != empty_cache else path, (0, 0))
    leftover = empty_cache / f".{'cd' * 16}.basis.exr.abcdefgh"
    leftover.mkdir()
    os.utime(leftover, (0, 0))
    bases_of(make_basis, "again.xml")  # which prunes
    assert not leftover.exists()
    completed = run(empty_cache, "cache", "clear", LIGHTPAINT_CACHE=str(empty_cache))
    assert completed.stdout.startswith("1 deleted"), completed.stderr
    assert {path: path.read_bytes() for path in others} == others
    assert {path.name for path in empty_cache.glob("[!.]*") if path not in others} == {TAG}


def test_a_folder_from_before_there_was_a_mark_is_taken_on(
    empty_cache: Path, make_basis: Any
) -> None:
    bases_of(make_basis, "hall.xml")
    (empty_cache / TAG).unlink()
    (empty_cache / ".drjit").mkdir()
    assert [entry.origin.scene for entry in basis_cache.entries() if entry.origin] == ["hall.xml"]
    bases_of(make_basis, "hall.xml", "room.xml")
    assert (empty_cache / TAG).read_text().startswith("Signature: 8a477f597d28d172789f06886806bc55")
    # Once it is ours, what others put there is no reason to lose it.
    (empty_cache / "notes.txt").write_text("mine")
    assert len(basis_cache.entries()) == 2
    # The mark of another program's cache is none of ours.
    (empty_cache / TAG).write_text("Signature: 8a477f597d28d172789f06886806bc55\n# by another")
    with pytest.raises(OutputError, match="other files"):
        basis_cache.entries()


def test_what_somebody_else_has_put_there_is_not_believed(
    empty_cache: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = make_basis(2)
    request = (basis.origin.scene_identity, "sensor", 0, basis.size)
    assert basis_cache.keep(basis)
    assert basis_cache.find(*request) is not None
    [path] = empty_cache.glob("*.basis.exr")
    owner = path.stat().st_uid
    monkeypatch.setattr(basis_cache, "is_trusted_owner", lambda status: status.st_uid != owner)
    assert basis_cache.find(*request) is None
    assert basis_cache.entries() == []
    assert basis_cache.cached_spp(*request) == 0
    assert basis_cache.find_most_sampled(*request[:2], samples=1, largest=2**30) is None


def test_who_is_believed() -> None:
    """Who runs the program, and who runs the machine."""
    me = os.geteuid()
    for owner, believed in ((me, True), (0, True), (me + 1, False)):
        assert (
            basis_cache.is_trusted_owner(os.stat_result((0o644, 1, 1, 1, owner, *5 * [0])))
            == believed
        )


@pytest.mark.parametrize("jump_s", [-10 * 365 * 86400.0, 10 * 365 * 86400.0])
def test_a_clock_that_jumps_costs_no_basis(
    empty_cache: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, jump_s: float
) -> None:
    bases_of(make_basis, "hall.xml", "room.xml")
    clock_s = time.time() + jump_s
    monkeypatch.setattr(
        "lightpaint.basis.cache.basis_cache.time", SimpleNamespace(time=lambda: clock_s)
    )
    bases_of(make_basis, "hall.xml")
    assert len(basis_cache.entries()) == 2
    for entry in basis_cache.entries():
        os.utime(entry.path, (clock_s, clock_s))
    assert len(basis_cache.entries()) == 2
    origin = make_basis(2).origin
    assert basis_cache.find(f"{0:032x}", origin.sensor, origin.seed, make_basis(2).size) is not None
