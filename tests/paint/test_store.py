"""The session file: what was done is there again, whatever ended the process that did it."""

import os
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nightly import examples
from stored_sessions import IDENTITY, SIZE, Plain, big, content, look, patch, step, told

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import OutputError, PaintError
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store import database
from lightpaint.paint.store.compression import pack, unpack
from lightpaint.paint.store.database import set_aside
from lightpaint.paint.store.history_steps import (
    Identity,
    Patch,
    Pixels,
    Step,
    StoredLook,
    ViewIdentity,
    replay,
)
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.pipeline.job.settings import Settings

ACTIONS = st.lists(
    st.tuples(st.just("append"), st.integers(0, 10**6))
    | st.tuples(st.sampled_from(["undo", "redo", "reopen"]), st.just(0))
    | st.tuples(st.sampled_from(["put", "drop", "rename", "copy"]), st.integers(0, 3)),
    max_size=25,
)


@pytest.fixture
def without_process_check(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever ends the process here is not the current."""
    monkeypatch.setattr(database, "SYNCHRONOUS", "OFF")


@pytest.mark.usefixtures("without_process_check")
@settings(
    max_examples=examples(20, 40), suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(ACTIONS)
def test_any_sequence_is_there_again(
    tmp_path_factory: pytest.TempPathFactory, actions: list[tuple[str, int]]
) -> None:
    path = tmp_path_factory.mktemp("any") / "session.db"
    steps: list[Step] = []
    position, looks = 0, dict[int, StoredLook]()
    store, memory = Store.open(path, IDENTITY), MemoryStore(IDENTITY)
    for k, (action, value) in enumerate(actions):
        if action == "append":
            steps = [*steps[:position], step(value)]
            position += 1
            for each_store in (store, memory):
                each_store.append(step(value))
        elif action in ("undo", "redo"):
            position = min(max(position + (1 if action == "redo" else -1), 0), len(steps))
            for each_store in (store, memory):
                each_store.move_to(position)
        elif action == "reopen":
            store.close()
            store = Store.open(path, IDENTITY)
        elif action == "put":
            looks[value] = look(value, k)
            for each_store in (store, memory):
                each_store.put_look(look(value, k))
        elif action == "drop" and value in looks:
            del looks[value]
            for each_store in (store, memory):
                each_store.drop_look(value)
        elif action in ("rename", "copy") and value in looks:
            number = value if action == "rename" else value + 10
            looks[number] = replace(looks[value], id=number, fields={"name": f"other {k}"})
            for each_store in (store, memory):
                [kept_look] = [x for x in each_store.looks() if x.id == value]
                each_store.put_look(replace(kept_look, id=number, fields={"name": f"other {k}"}))
    expected = Plain(steps, position, looks)
    assert content(store)[:2] == content(memory)[:2] == content(expected)[:2]
    for each_store in (store, memory):
        assert sorted(content(each_store)[2]) == sorted(content(expected)[2])
    content_before = content(store)
    store.close()
    store = Store.open(path, IDENTITY)
    assert content(store)[:2] == content_before[:2]
    assert content(store)[2] == sorted(content_before[2])
    store.close()
    memory.close()


@given(st.lists(st.integers(0, 10**6), max_size=30), st.integers(0, 1))
def test_the_canvas_is_every_patch_put_down_in_order(seeds: list[int], view: int) -> None:
    steps = [step(seed) for seed in seeds]
    rng = np.random.default_rng(0)
    start = Pixels.unpainted(rng.random((*SIZE, 3)).astype(np.float32))
    image, importance, _ = start.copy()
    at_least = np.zeros(image.shape, bool)
    for a_step in steps:
        for a_patch in a_step.patches:
            if a_patch.view == view:
                top, bottom, left, right = a_patch.region
                area, after = np.s_[top:bottom, left:right], a_patch.after
                image[area], importance[area] = after.image, after.importance
                at_least[area] = False if after.at_least is None else after.at_least
    replayed = replay(
        [a_patch for a_step in steps for a_patch in a_step.patches if a_patch.view == view], start
    )
    assert replayed.equals(Pixels(image, importance, at_least))


def test_every_bit_of_a_number_is_kept(tmp_path: Path) -> None:
    odd = np.array([np.nan, -0.0, np.inf, 1e-45, 3.4e38, 1], np.float32).reshape(1, 2, 3)
    amount = np.array([[0, 1e-45]], np.float32)
    with Store.open(tmp_path / "session.db", IDENTITY) as store:
        marks = np.array([True, False, True, False, False, True]).reshape(1, 2, 3)
        before, after = Pixels(odd, amount), Pixels(-odd, amount, marks)
        change = Patch((0, 1, 0, 2), before, after)
        store.append(Step("stroke", "odd", {}, (change,)))
        [read_patch] = store.steps[0].patches
        assert told(read_patch.before) == told(before)
        assert told(read_patch.after) == told(after)
        assert not read_patch.after[0].flags.writeable


def test_what_is_unpacked_is_no_longer_than_it_says() -> None:
    for damaged in (pack(np.zeros(10**6)), pack(np.zeros(3)), b"", b"junk"):
        with pytest.raises(PaintError, match="a damaged picture"):
            unpack(damaged, "float64", (4,))


# Other processes

PLACES = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}

WRITER = """
import sys
from pathlib import Path
from stored_sessions import IDENTITY, look, step
from lightpaint.paint.store.session_file import Store
store = Store.open(Path(sys.argv[1]), IDENTITY)
print("open", len(store.steps), flush=True)
for number in range(len(store.steps), 10**6):
    store.append(step(number))
    print("step", number, flush=True)
    if number % 5 == 0:
        store.put_look(look(number % 7, number))
        print("look", number, flush=True)
"""


def start_writer(path: Path) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        env=PLACES,
    )


def test_killed_at_any_moment_all_that_was_acknowledged_is_there(tmp_path: Path) -> None:
    path, chance = tmp_path / "session.db", random.Random(0)
    steps = 0
    for _ in range(5):
        with start_writer(path) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == f"open {steps}\n"
            output = "".join(process.stdout.readline() for _ in range(chance.randrange(3, 12)))
            time.sleep(chance.uniform(0, 0.02))  # in the middle of whatever comes next
            process.kill()
            # It may have been killed in the middle of a line.
            lines = (output + process.stdout.read()).splitlines(keepends=True)
            acknowledged_lines = [line.split() for line in lines if line.endswith("\n")]
        acknowledged = [int(words[1]) for words in acknowledged_lines if words[0] == "step"]
        looks = {
            int(words[1]) % 7: int(words[1]) for words in acknowledged_lines if words[0] == "look"
        }
        with Store.open(path, IDENTITY) as store:
            # One more may have been written, and not been told of yet.
            step_count = len(store.steps)
            least = steps + len(acknowledged)
            assert step_count in (least, least + 1)
            assert store.position == step_count
            assert (
                content(store)[1] == content(Plain([step(k) for k in range(step_count)], 0, {}))[1]
            )
            kept_looks = {kept_look.id: kept_look for kept_look in store.looks()}
            for number, steps_then in looks.items():
                latest = int(kept_looks[number].fields["name"].split()[1])
                assert latest >= steps_then
                assert told(kept_looks[number].arrays.values()) == told(
                    look(number, latest).arrays.values()
                )
        steps = step_count
    assert steps > 6


def test_the_second_process_is_told_and_the_lock_dies_with_the_first(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    with start_writer(path) as process:
        assert process.stdout is not None
        process.stdout.readline()
        for opening in (lambda: Store.open(path, IDENTITY), lambda: set_aside(path)):
            with pytest.raises(PaintError, match=r"is in use: another .* \(folder=\.\.\.\)$"):
                opening()
        process.kill()
        process.stdout.read()
    Store.open(path, IDENTITY).close()


def test_a_second_store_of_the_same_process_is_told_too(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY), pytest.raises(PaintError, match="is in use"):
        Store.open(path, IDENTITY)


# Full disks


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A small file system of its own."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("the right to mount")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_loses_nothing_and_is_written_when_there_is_room(disk: Path) -> None:
    path, number = disk / "session.db", 0
    store = Store.open(path, IDENTITY)
    while store.unsaved is None:
        store.append(big(number))
        number += 1
        assert number < 1000
    assert f"since {path} cannot be written (database or disk is full)" in store.unsaved
    written_steps = number - 1
    # Life goes on in memory: paint, undo, looks.
    store.append(big(number))
    store.put_look(look(1, 1))
    store.move_to(number)
    assert store.flush() is not None
    content_before = content(store)
    assert len(content_before[1]) == number + 1
    copy = disk.parent / "copy.db"
    for ending in ("", "-wal"):
        shutil.copy(f"{path}{ending}", f"{copy}{ending}")
    with Store.open(copy, IDENTITY) as copied_store:  # as if it were killed now
        assert content(copied_store)[1] == content_before[1][:written_steps]
        assert copied_store.looks() == []
    subprocess.run(["mount", "-o", "remount,size=8m", str(disk)], check=True)
    assert store.flush() is None
    assert store.unsaved is None
    store.append(big(0))
    content_before = content(store)
    store.close()
    with Store.open(path, IDENTITY) as reopened:
        assert content(reopened) == content_before


def test_what_cannot_be_written_at_the_end_is_said(disk: Path) -> None:
    store = Store.open(disk / "session.db", IDENTITY)
    while store.unsaved is None:
        store.append(big(0))
    with pytest.raises(OutputError, match=r"the last steps are lost: .* is full"):
        store.close()
    with Store.open(disk / "session.db", IDENTITY) as reopened:
        assert len(reopened.steps) > 0


LIMITED = """
import resource, sys
from pathlib import Path
from stored_sessions import IDENTITY, big, content
from lightpaint.paint.store.session_file import Store
store, number = Store.open(Path(sys.argv[1]), IDENTITY), 0
before = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, before[1]))
while store.unsaved is None:
    store.append(big(number))
    number += 1
    assert number < 100
store.append(big(number))
store.move_to(number)
assert store.flush() is not None
resource.setrlimit(resource.RLIMIT_FSIZE, before)
assert store.flush() is None
was = content(store)
store.close()
with Store.open(Path(sys.argv[1]), IDENTITY) as again:
    assert content(again) == was
    assert (again.position, len(again.steps)) == (number, number + 1)
"""


def test_a_limit_of_file_sizes_loses_nothing_either(tmp_path: Path) -> None:
    completed = subprocess.run(
        [sys.executable, "-c", LIMITED, str(tmp_path / "session.db")],
        env=PLACES,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stderr


# What is not a session of this picture


def identity_of_views(*views: ViewIdentity) -> Identity:
    return replace(IDENTITY, views=views)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (
            identity_of_views(ViewIdentity("camera", (12, 20))),
            "of 10x12 pixels, and room.xml has 20x12",
        ),
        (identity_of_views(ViewIdentity("side", SIZE)), "through camera, and this is through side"),
        (replace(IDENTITY, lights=("panel", "sun")), "lights panel, bulb, and room.xml has"),
    ],
)
def test_a_session_of_something_else_is_refused_and_can_be_put_aside(
    tmp_path: Path, other: Identity, message: str
) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        store.append(step(1))
    with pytest.raises(PaintError, match=message) as refusal:
        Store.open(path, other)
    assert "(folder=...)" in str(refusal.value)
    assert "(new=True)" in str(refusal.value)
    assert set_aside(path) == tmp_path / "session-1.db"
    with Store.open(path, other) as store:
        assert store.steps == []
    assert set_aside(path) == tmp_path / "session-2.db"
    assert set_aside(path) is None
    with Store.open(tmp_path / "session-1.db", IDENTITY) as store:
        assert [a_step.label for a_step in store.steps] == ["stroke 1"]


def test_a_scene_that_has_changed_keeps_its_session(tmp_path: Path) -> None:
    with Store.open(tmp_path / "session.db", IDENTITY) as store:
        store.append(step(1))
    with Store.open(tmp_path / "session.db", replace(IDENTITY, basis="other")) as store:
        assert len(store.steps) == 1


def test_a_view_may_come_later_and_none_may_go(tmp_path: Path) -> None:
    path, path_of_both = (
        tmp_path / "session.db",
        identity_of_views(*IDENTITY.views, ViewIdentity("side", (4, 6))),
    )
    with Store.open(path, IDENTITY) as store:
        store.append(step(1))
    with Store.open(path, path_of_both) as store:
        assert len(store.steps) == 1
    with pytest.raises(PaintError, match="a session of 2 views, and this is of 1"):
        Store.open(path, IDENTITY)


def _execute(path: Path, statement: str) -> None:
    other = sqlite3.connect(path)
    other.execute(statement)
    other.commit()
    other.close()


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(b"junk" * 1000),
        lambda path: path.write_bytes(path.read_bytes()[:40_000]),
        lambda path: _execute(path, "DROP TABLE step"),
        lambda path: _execute(path, "PRAGMA user_version=2"),
        lambda path: _execute(path, "PRAGMA user_version=9"),
        lambda path: _execute(path, "PRAGMA application_id=9"),
    ],
)
def test_a_damaged_file_is_said_in_one_line_and_can_be_put_aside(
    tmp_path: Path, damage: Any
) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(4):
            store.append(step(number))
    damage(path)
    with (
        pytest.raises(PaintError, match=r"new=True") as refusal,
        Store.open(path, IDENTITY) as store,
    ):
        content(store)
    assert "\n" not in str(refusal.value)
    assert set_aside(path) is not None
    Store.open(path, IDENTITY).close()


@pytest.mark.parametrize(
    ("damage", "loss"),
    [
        ("UPDATE step SET fields='{' WHERE id = 2", "1 step could not be read"),
        ("UPDATE step SET fields='{}x'", "4 steps could not be read"),
        ("UPDATE step SET places='[1]' WHERE id = 2", "1 step could not be read"),
        ("UPDATE step SET places='[[0,5,2,0,1]]' WHERE id = 3", "1 step could not be read"),
        ("UPDATE pixels SET before=x'00' WHERE step = 3", "1 step could not be read"),
        ("UPDATE pixels SET change=NULL WHERE step = 3", "1 step could not be read"),
        ("UPDATE about SET value='x'", "nothing that counts was lost"),
        ("INSERT INTO look VALUES (9, '{}')", "the look of number 9 could not be read"),
        ("UPDATE look_array SET data=x'00' WHERE look=1 AND name='weights'", "the look look 1"),
        ("UPDATE look_array SET data=x'00' WHERE name='thumbnail'", "nothing that counts"),
    ],
)
def test_what_can_be_read_of_a_damaged_session_is_there(
    tmp_path: Path, damage: str, loss: str
) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(4):
            store.append(step(number))
        for number in (1, 2):
            store.put_look(look(number, number))
        _, steps, looks = content(store)
    _execute(path, damage)
    before = path.read_bytes()
    with Store.open(path, IDENTITY) as store:
        if not store.remarks:  # what nobody has looked at yet
            store.recover()
        position, steps_left, kept_looks = content(store)
        [remark] = store.remarks
        assert loss in remark
        assert "\n" not in remark
        assert f"is kept as {tmp_path / 'session-1.db'}" in remark
        assert position == len(steps_left)
        assert all(item in steps for item in steps_left)
        assert {item[0] for item in kept_looks} <= {item[0] for item in looks}
        store.append(step(5))
    # But for the header, where it counts how often it was opened to be written.
    assert (tmp_path / "session-1.db").read_bytes()[100:] == before[100:]
    with Store.open(path, IDENTITY) as store:
        assert store.remarks == []
        assert len(store.steps) == len(steps_left) + 1


@pytest.mark.usefixtures("without_process_check")
def test_bytes_and_pages_that_are_others_never_end_in_more_than_a_line(tmp_path: Path) -> None:
    """All over the file: what is there afterwards is as it was, and what is not is said."""
    whole_file, path = tmp_path / "whole.db", tmp_path / "session.db"
    with Store.open(whole_file, IDENTITY) as store:
        for number in range(12):
            store.append(step(number))
        for number in (1, 2, 3):
            store.put_look(look(number, number))
        _, steps, looks = content(store)
    data, rng = whole_file.read_bytes(), np.random.default_rng(0)
    page, refusals, recover, lines = 16384, 0, 0, []
    for k in range(60):
        damaged = bytearray(data)
        offset = int(rng.integers(0, len(data)))
        if k % 3 == 0:
            damaged[offset] ^= int(rng.integers(1, 256))
        elif k % 3 == 1:
            damaged[offset : offset + 100] = rng.bytes(min(100, len(data) - offset))
        else:
            begin = offset // page * page
            damaged[begin : begin + page] = bytes(page)
        for old in tmp_path.glob("session*"):
            old.unlink()
        path.write_bytes(damaged)
        try:
            store = Store.open(path, IDENTITY)
        except PaintError as error:
            refusals += 1
            lines.append(str(error))
            assert path.read_bytes() == damaged
            continue
        with store:
            try:
                content(store)
            except (PaintError, KeyError):
                store.recover()
            _, steps_left, kept_looks = content(store)
            is_whole = len(steps_left) == len(steps) and len(kept_looks) == len(looks)
            assert is_whole or store.remarks
            for a_step in steps_left:
                # Labels have no check of their own: a byte of one may be another.
                assert any(a_step[3] == original[3] for original in steps)
            if store.remarks:
                recover += 1
                assert list(tmp_path.glob("session-*.db"))
    assert not any("\n" in line for line in lines)
    assert refusals < 20
    assert recover > 15


@pytest.mark.parametrize(
    ("tables", "steps_left", "lost_text"),
    [
        (("step", "pixels"), (0, 2), "an unknown number of steps could not be read"),
        (("look", "look_array"), (4, 0), "an unknown number of looks could not be read"),
    ],
)
def test_what_nobody_can_count_is_not_called_nothing(
    tmp_path: Path, tables: tuple[str, str], steps_left: tuple[int, int], lost_text: str
) -> None:
    """The first pages of two tables lie side by side: one bad block of a disk takes both."""
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(4):
            store.append(step(number))
        for number in (1, 2):
            store.put_look(look(number, number))
    with closing(sqlite3.connect(path)) as other:
        roots = dict(other.execute("SELECT name, rootpage FROM sqlite_schema"))
    page, data = 16384, bytearray(path.read_bytes())
    for table in tables:
        data[(roots[table] - 1) * page : roots[table] * page] = bytes(page)
    path.write_bytes(data)
    with Store.open(path, IDENTITY) as store:
        _, steps, looks = content(store)
        assert (len(steps), len(looks)) == steps_left
        [remark] = store.remarks
        assert lost_text in remark


def test_of_a_file_that_was_cut_off_its_beginning_is_read(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(4):
            store.append(step(number))
        _, steps, _ = content(store)
        store.put_look(look(1, 1))
    with closing(sqlite3.connect(path)) as other:
        roots = dict(other.execute("SELECT name, rootpage FROM sqlite_schema"))
    assert roots["look"] == max(roots["step"], roots["pixels"]) + 1
    os.truncate(path, (roots["look"] - 1) * 16384)
    with Store.open(path, IDENTITY) as store:
        _, steps_left, looks = content(store)
        assert (steps_left, looks) == (steps, [])
        [remark] = store.remarks
        assert "an unknown number of looks could not be read" in remark


def test_a_painting_is_reached_though_a_look_is_damaged(tmp_path: Path, make_basis: Any) -> None:
    """And so it is where a step is, of which the session says what it lost."""
    basis = make_basis(2, SIZE, names=IDENTITY.lights)
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        light = Pixels(np.ones((4, 4, 3), np.float32), np.ones((4, 4), np.float32))
        none = Pixels.unpainted(np.zeros((4, 4, 3), np.float32))
        for top in (0, 4, 8):
            store.append(Step("stroke", f"{top}", {}, (Patch((top, top + 4, 0, 4), none, light),)))
        for number in (1, 2):
            store.put_look(look(number, number))
    for damage in (
        "UPDATE look_array SET data=x'00' WHERE look=1 AND name='weights'",
        "UPDATE pixels SET change=x'00' WHERE step = 2",
    ):
        _execute(path, damage)
    with Store.open(path, IDENTITY) as store:
        look_fields: dict[str, Any] = {"settings": Settings(), "transform": ViewTransform("srgb")}
        session = Session([basis], [basis.current_look], store, **look_fields)
        importance = session.views[0].pixels(session.views[0].full_region).importance
        np.testing.assert_array_equal(importance[:, 0], [1] * 4 + [0] * 4 + [1] * 4)
        library = LookLibrary(session, PictureTable())
        assert [info.name for info in library.infos()] == ["look 2"]
        [remark] = store.remarks
        assert "1 step, the look look 1 could not be read" in remark


# A file that is removed while it is painted on


@pytest.mark.parametrize("is_all", [True, False])
def test_a_session_whose_file_is_removed_is_written_anew(tmp_path: Path, is_all: bool) -> None:
    path = tmp_path / "s" / "session.db"
    with Store.open(path, IDENTITY) as store:
        store.append(step(1))
        store.put_look(look(1, 1))
        shutil.rmtree(path.parent) if is_all else path.unlink()
        store.append(step(2))
        assert store.unsaved is None
        content_before = content(store)
        copy = tmp_path / "copy.db"
        for ending in ("", "-wal"):  # as if it were killed now
            shutil.copy(f"{path}{ending}", f"{copy}{ending}")
        with Store.open(copy, IDENTITY) as copied_store:
            assert content(copied_store) == content_before
        path.unlink()  # at the end, too
    with Store.open(path, IDENTITY) as reopened:
        assert content(reopened) == content_before
        reopened.append(step(3))
    assert [file.name for file in path.parent.iterdir()] == ["session.db"]


def test_another_file_in_its_place_is_left_alone_and_said(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    store = Store.open(path, IDENTITY)
    store.append(step(1))
    path.unlink()
    path.write_bytes(b"of somebody else")
    store.append(step(2))
    assert store.unsaved is not None
    assert f"{path} is another file now: move that one away" in store.unsaved
    assert path.read_bytes() == b"of somebody else"
    path.unlink()
    assert store.flush() is None
    content_before = content(store)
    store.close()
    with Store.open(path, IDENTITY) as reopened:
        assert content(reopened) == content_before


def test_a_place_that_is_gone_and_cannot_be_made_is_said(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    store = Store.open(folder / "session.db", IDENTITY)
    store.append(step(1))
    shutil.rmtree(folder)
    folder.write_text("a file", "utf-8")
    store.append(step(2))
    assert store.unsaved is not None
    assert "in memory only: cannot write" in store.unsaved
    assert len(content(store)[1]) == 2
    with pytest.raises(OutputError, match="the last steps are lost"):
        store.close()


def test_one_array_of_a_look_is_read_alone(tmp_path: Path) -> None:
    """A list of looks has the weights of each, and no picture."""
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        store.put_look(look(1, 1))
    with Store.open(path, IDENTITY) as store:
        statements: list[str] = []
        store._database.set_trace_callback(statements.append)
        [read_look] = store.looks()
        assert read_look.arrays["weights"].size
        [statement] = statements
        assert "name = 'weights'" in statement
        with pytest.raises(KeyError):
            read_look.arrays["no such array"]


def test_a_place_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", "utf-8")
    with pytest.raises(OutputError, match="cannot write"):
        Store.open(tmp_path / "file" / "session.db", IDENTITY)
    (tmp_path / "session.db").mkdir()
    with pytest.raises(OutputError, match="cannot write"):
        Store.open(tmp_path / "session.db", IDENTITY)


@pytest.mark.usefixtures("without_process_check")
def test_room_of_what_was_cut_off_is_used_again(tmp_path: Path) -> None:
    """So that a day of trying and undoing costs no more than what is there in the end."""
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(20):
            store.append(big(number))
    size = path.stat().st_size
    for _ in range(3):
        with Store.open(path, IDENTITY) as store:
            store.move_to(0)
            for number in range(20):
                store.append(big(number))
    assert path.stat().st_size < 1.2 * size
    with Store.open(path, IDENTITY) as store:
        store.move_to(0)
        store.append(step(3))
    Store.open(path, IDENTITY).close()
    assert path.stat().st_size < 0.3 * size


def test_what_nobody_should_keep_is_refused_before_anything_changes() -> None:
    with MemoryStore(IDENTITY) as store:
        for bad_step in (
            Step("requests", "", {"x": float("nan")}),
            Step("requests", "", {"x": object()}),
            Step(
                "stroke", "", {}, (replace(patch(np.random.default_rng(0)), region=(0, 1, 0, 1)),)
            ),
        ):
            with pytest.raises(PaintError):
                store.append(bad_step)
        with pytest.raises(PaintError):
            store.move_to(1)
        with pytest.raises(PaintError):
            store.drop_look(1)
        assert content(store) == (0, [], [])
