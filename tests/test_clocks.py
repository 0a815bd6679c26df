"""Clocks that are set while something runs, by years: whoever looks at them finds another time.

What takes how long, what is left, and what counts as abandoned do not hang on the time of day.
"""

import os
import time
from itertools import count
from pathlib import Path

import pytest
from patience import PATIENCE_S
from stored_sessions import IDENTITY, content, look, step

import lightpaint as lp
from lightpaint.paint.store.session_file import Store
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.storage.staging import staged

#: Seconds by which the clock is wrong, one after the other.
JUMPS_S = (0.0, 1e7, -1e7, 3e9, -1.7e9, -2e6)


@pytest.fixture
def jumping(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the clock jump by years between any two readings."""
    real, looks = time.time, count()
    monkeypatch.setattr(time, "time", lambda: real() + JUMPS_S[next(looks) % len(JUMPS_S)])


@pytest.mark.usefixtures("jumping")
def test_a_basis_of_so_many_seconds_takes_these(small_room: Scene, tmp_path: Path) -> None:
    reports: list[tuple[int, int]] = []

    def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
        reports.append((done, total))

    begin_s = time.monotonic()
    basis = lp.render_basis(small_room, time_s=1.0, progress=hear)
    assert basis.origin.spp >= 1
    # Compilation and the last pass come on top.
    assert time.monotonic() - begin_s < PATIENCE_S
    assert all(0 <= done <= total for done, total in reports)
    lp.write_basis(tmp_path / "room.basis.exr", basis)
    assert lp.read_basis(tmp_path / "room.basis.exr").origin == basis.origin


@pytest.mark.usefixtures("jumping")
def test_what_another_process_is_writing_is_not_abandoned(tmp_path: Path) -> None:
    """Though it seems to be of last year, or of the next."""
    folder = tmp_path / "evening"
    with staged(folder) as stage:
        (stage / "a.txt").write_text("first")
        for age_s in JUMPS_S:
            os.utime(stage, (max(0.0, age_s), max(0.0, age_s)))
            with staged(tmp_path / "evening") as other:
                (other / "b.txt").write_text("second")
            assert (stage / "a.txt").is_file()
    assert {file.name for file in folder.iterdir()} >= {"a.txt"}


@pytest.mark.usefixtures("jumping")
def test_steps_and_looks_keep_their_order(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, IDENTITY) as store:
        for number in range(6):
            store.append(step(number))
            store.put_look(look(number, number))
        was = content(store)
    with Store.open(path, IDENTITY) as store:
        assert content(store) == was
