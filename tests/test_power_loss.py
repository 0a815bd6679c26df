"""The current ends: what no `fsync` has brought to the disk is gone, though its name may be there.

A disk that writes names before contents is played: what is renamed without having been flushed is
empty afterwards. So do XFS and btrfs, and ext4 where a folder is renamed.
"""

import os
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from lightpaint.batch.plan.journal import Journal, JournalLine
from lightpaint.files import write_text
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.paint.store.session_file import Store
from lightpaint.storage.staging import staged


class Disk:
    """Which files have been flushed as they are."""

    def __init__(self) -> None:
        self._flushed: dict[int, tuple[int, int]] = {}

    def flush(self, descriptor: int) -> None:
        status = os.fstat(descriptor)
        self._flushed[status.st_ino] = status.st_size, status.st_mtime_ns

    def rename(self, path: Path) -> None:
        """What the disk has of a file, or of all in a folder, when its name changes."""
        files = [x for x in path.rglob("*") if x.is_file()] if path.is_dir() else [path]
        for file in files:
            status = file.stat()
            if self._flushed.get(status.st_ino) != (status.st_size, status.st_mtime_ns):
                os.truncate(file, 0)


@pytest.fixture
def _unsafe(monkeypatch: pytest.MonkeyPatch) -> None:
    disk, real = Disk(), {name: getattr(os, name) for name in ("replace", "rename", "fsync")}

    def fsync(descriptor: int) -> None:
        real["fsync"](descriptor)
        disk.flush(descriptor)

    def renaming(name: str) -> Callable[..., None]:
        def rename(source: Path, target: Path, **options: int) -> None:
            disk.rename(Path(source))
            real[name](source, target, **options)

        return rename

    monkeypatch.setattr(os, "fsync", fsync)
    for name in ("replace", "rename"):
        monkeypatch.setattr(os, name, renaming(name))


def lighting(emission: float) -> Lighting:
    setting = LightSetting("a", "point", "intensity", "W/sr", *2 * ((emission,) * 3,))
    return Lighting((setting,), target="t")


@pytest.mark.usefixtures("_unsafe")
def test_a_file_is_the_earlier_or_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "lighting.json"
    for emission in (1.0, 2.0):
        write_lighting(path, lighting(emission))
        assert read_lighting(path).emission == {"a": (emission,) * 3}


@pytest.mark.usefixtures("_unsafe")
def test_so_are_results_that_appear_together(tmp_path: Path) -> None:
    folder = tmp_path / "evening"
    for text in ("first", "second"):
        with staged(folder) as stage:
            (stage / "a.txt").write_text(text)
            write_text(stage / "b.txt", text)
        assert [(folder / x).read_text() for x in ("a.txt", "b.txt")] == [text] * 2
        (folder / "mine.txt").write_text("mine")


@pytest.mark.usefixtures("_unsafe")
def test_so_is_a_journal_that_is_settled(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    for look in ("a", "b"):
        journal.add(JournalLine(look, "answer", "done", "0f"))
    journal.rewrite([("b", "answer")])
    assert [*Journal(tmp_path).lines] == [("b", "answer")]


@pytest.mark.usefixtures("_unsafe")
def test_so_is_a_session_that_is_written_anew(tmp_path: Path) -> None:
    from stored_sessions import IDENTITY, content, step

    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        store.append(step(1))
        path.unlink()
        store.append(step(2))
        before = content(store)
    with Store.open(path, IDENTITY) as store:
        assert content(store) == before


@pytest.mark.usefixtures("_unsafe")
def test_so_is_a_damaged_session_that_is_recovered(tmp_path: Path) -> None:
    from stored_sessions import IDENTITY, content, step

    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(4):
            store.append(step(number))
    with closing(sqlite3.connect(path)) as other, other:
        other.execute("UPDATE pixels SET change = x'00' WHERE step = 3")
    with Store.open(path, IDENTITY) as store:
        store.recover()
        before = content(store)
        assert len(before[1]) == 3
    with Store.open(path, IDENTITY) as store:
        assert content(store) == before
