"""Files appear in a folder together, whenever the process is killed."""

import fcntl
import os
import signal
import stat
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from nightly import nightly

from lightpaint.errors import OutputError
from lightpaint.storage import staging
from lightpaint.storage.staging import JOURNAL, MARK, finish, staged

EARLIER = {"a": "earlier", "deep/b": "earlier", "view/c": "earlier"}
OTHERS = {"notes.txt": "mine", "deep/mine": "mine", "mine/too": "mine"}
LATER = {"a": "later", "deep/b": "later", "d": "later"}

#: Of EARLIER, what has no namesake in LATER.
GONE = ("view/c",)


def fill(folder: Path, contents: dict[str, str]) -> None:
    for name, text in contents.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def read(folder: Path) -> dict[str, str]:
    """What a person sees in it."""
    return {
        name: file.read_text(encoding="utf-8")
        for file in folder.rglob("*")
        if file.is_file() and not (name := file.relative_to(folder).as_posix()).startswith(".")
    }


def hidden(folder: Path) -> list[str]:
    """What is left of staging, beside `folder` and in it."""
    entries = (*folder.parent.iterdir(), *folder.iterdir())
    return [path.name for path in entries if MARK in path.name or path.name == JOURNAL]


def replace(folder: Path) -> None:
    with staged(folder, [folder / name for name in (*EARLIER, "never there")]) as stage:
        fill(stage, LATER)


@pytest.fixture
def look(tmp_path: Path) -> Path:
    """A folder with earlier files, and others."""
    folder = tmp_path / "look"
    fill(folder, EARLIER | OTHERS)
    (folder / "empty").mkdir()
    (folder / "link").symlink_to("nowhere")
    return folder


@pytest.fixture(params=["beside", nightly("within")])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Where files are written before they come to their place."""
    if request.param == "within":
        monkeypatch.setattr(staging, "is_mounted", lambda _folder: True)
    return str(request.param)


@pytest.mark.usefixtures("way")
def test_new_files_take_the_place_of_earlier_ones_and_others_stay(look: Path) -> None:
    look.chmod(0o751)
    own_inode, before = (look / "notes.txt").stat().st_ino, look.stat().st_ino
    replace(look)
    assert look.stat().st_ino == before
    assert read(look) == LATER | OTHERS
    assert (look / "notes.txt").stat().st_ino == own_inode
    assert os.readlink(look / "link") == "nowhere"
    assert (look / "empty").is_dir()
    assert not (look / "view").exists()
    assert stat.S_IMODE(look.stat().st_mode) == 0o751
    assert hidden(look) == []


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("trouble", [OutputError("full"), KeyboardInterrupt(), ValueError()])
def test_trouble_leaves_all_as_it_was(look: Path, trouble: BaseException) -> None:
    def work() -> None:
        with staged(look, [look / "a"]) as stage:
            fill(stage, LATER)
            assert read(look) == EARLIER | OTHERS
            raise trouble

    with pytest.raises(type(trouble)):
        work()
    assert read(look) == EARLIER | OTHERS
    assert hidden(look) == []


def test_a_folder_that_is_not_there_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "look"
    with pytest.raises(OutputError, match=f"^cannot write {folder}/a$"), staged(folder) as stage:
        raise OutputError("cannot write ", stage / "a")
    assert list(tmp_path.iterdir()) == []
    with staged(folder) as stage:
        fill(stage, LATER)
        assert not folder.exists()
    assert read(folder) == LATER
    assert hidden(folder) == []


def test_whoever_works_in_a_folder_stays_in_it(look: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(look / "deep")
    before = look.stat().st_ino
    replace(look)
    assert look.stat().st_ino == before
    monkeypatch.chdir(look)
    replace(Path())
    assert Path("deep/b").read_text(encoding="utf-8") == "later"
    assert read(look) == LATER | OTHERS
    assert hidden(look) == []


def test_a_link_to_a_folder_stays_one(look: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(look)
    replace(tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert read(look) == LATER | OTHERS


def test_what_comes_while_files_are_moved_is_not_lost(
    look: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish_stage = staging._finish_stage

    def late(stage: Path, real: Path, *, is_mine: bool = False) -> None:
        fill(look, {"painting.png": "just saved", "deep/more": "new"})
        (look / "saved").write_text("anew", encoding="utf-8")
        os.replace(look / "saved", look / "notes.txt")
        finish_stage(stage, real, is_mine=is_mine)

    monkeypatch.setattr(staging, "_finish_stage", late)
    replace(look)
    newcomers = {"painting.png": "just saved", "deep/more": "new", "notes.txt": "anew"}
    assert read(look) == LATER | OTHERS | newcomers


#: Where a process may be killed: before each of these.
STEPS = ((os, ("mkdir", "rename", "replace", "unlink", "rmdir", "open", "fsync")),)


def fork() -> int:
    with warnings.catch_warnings():
        # Threads of other tests may wait in this process; the child asks nothing of them.
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def killed_at(step: int, work: Callable[[], None]) -> bool:
    """Do `work` in a process that is killed at its step number `step`; whether it came so far."""
    if (child := fork()) == 0:
        count = 0

        def count_steps(do: Callable[..., object]) -> Callable[..., object]:
            def counting(*args: object, **options: object) -> object:
                nonlocal count
                count += 1
                if count > step:
                    os.kill(os.getpid(), signal.SIGKILL)
                return do(*args, **options)

            return counting

        for module, names in STEPS:
            for name in names:
                setattr(module, name, count_steps(getattr(module, name)))
        try:
            work()
        except BaseException:
            os._exit(1)
        os._exit(0)
    status = os.waitpid(child, 0)[1]
    assert status in (0, signal.SIGKILL)
    return status != 0


def _steps(work: Callable[[Path], None], folder: Path) -> Iterator[int]:
    """Kill `work` at each of its steps, each time on a folder with earlier files."""
    step = 0
    while True:
        look = folder / str(step)
        fill(look, EARLIER | OTHERS)
        is_unfinished = killed_at(step, lambda look=look: work(look))  # type: ignore[misc]
        yield step
        if not is_unfinished:
            return
        step += 1


@pytest.mark.usefixtures("way")
def test_killed_at_any_step_it_comes_to_the_one_or_the_other(tmp_path: Path) -> None:
    """A mixture is there only while files are moved, and only until somebody uses the folder."""
    whole_states = (EARLIER | OTHERS, LATER | OTHERS)
    states = []
    for step in _steps(replace, tmp_path):
        look = tmp_path / str(step)
        is_whole, state = read(look) in whole_states, read(look)
        finish(look)
        states.append(whole_states.index(read(look)))
        # What is whole stays so, but for a journal that was written and of which nothing is done.
        assert not is_whole or state == read(look) or state == whole_states[0]
        assert hidden(look) == [], step
    # First all earlier, later all new, and no way back.
    assert states == sorted(states)
    assert {0, 1} == set(states)
    assert len(states) > 25


@pytest.mark.nightly
def test_killed_while_it_finishes_what_was_killed(tmp_path: Path) -> None:
    def cut_short(look: Path) -> None:
        before, staging._finish_stage = staging._finish_stage, lambda *_, **__: os._exit(0)
        try:
            replace(look)
        finally:
            staging._finish_stage = before

    for step in range(200):
        look = tmp_path / str(step)
        fill(look, EARLIER | OTHERS)
        if (child := fork()) == 0:
            cut_short(look)
        os.waitpid(child, 0)
        assert read(look) == EARLIER | OTHERS
        is_unfinished = killed_at(step, lambda look=look: finish(look))  # type: ignore[misc]
        finish(look)
        assert read(look) == LATER | OTHERS
        assert hidden(look) == []
        if not is_unfinished:
            return
    raise AssertionError("it never came to its end")


@pytest.mark.usefixtures("way")
def test_what_another_process_is_writing_is_left_alone(look: Path) -> None:
    with staged(look) as stage:
        fill(stage, {"a": "later"})
        finish(look)
        replace(look)
        assert (stage / "a").is_file()
    assert read(look) == LATER | OTHERS | {"a": "later"}
    assert hidden(look) == []


def test_an_interrupt_while_it_is_published_waits(
    look: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish_stage = staging._finish_stage

    def interrupted(stage: Path, real: Path, *, is_mine: bool = False) -> None:
        signal.raise_signal(signal.SIGINT)
        finish_stage(stage, real, is_mine=is_mine)

    monkeypatch.setattr(staging, "_finish_stage", interrupted)
    with pytest.raises(KeyboardInterrupt):
        replace(look)
    assert read(look) == LATER | OTHERS
    assert hidden(look) == []


@pytest.mark.parametrize(
    "journal",
    [
        '{"move": ["../stolen"]}',
        '{"gone": ["/etc/passwd"]}',
        '{"move": [], "gone": ["a/../../stolen"]}',
        "{",
        '{"move": "a"}',
    ],
)
def test_a_journal_from_elsewhere_reaches_nothing_outside(look: Path, journal: str) -> None:
    (look.parent / "stolen").write_text("mine", encoding="utf-8")
    stage = look.parent / f".look{MARK}1"
    fill(stage, {JOURNAL: journal, "a": "theirs"})
    finish(look)
    assert (look.parent / "stolen").read_text(encoding="utf-8") == "mine"
    assert read(look) == EARLIER | OTHERS
    assert not stage.exists()


def test_a_disk_without_locks(look: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError("no locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    new_folder, old = (look.parent / f".look{MARK}{k}" for k in range(2))
    for stage in (new_folder, old):
        stage.mkdir()
    os.utime(old, (0, 0))
    replace(look)
    assert read(look) == LATER | OTHERS
    assert hidden(look) == [new_folder.name]


@pytest.mark.skipif(sys.platform != "linux", reason="mounts are asked of Linux")
def test_mounts_are_known() -> None:
    assert staging.is_mounted(Path("/proc"))
    assert not staging.is_mounted(Path(__file__).parent)
