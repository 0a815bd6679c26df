"""Files are replaced whole or not at all."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from lightpaint.errors import OutputError
from lightpaint.files import check_files, check_writable, replacing, sweep, write_bytes, write_text


@pytest.fixture
def old(tmp_path: Path) -> Path:
    path = tmp_path / "answer.json"
    path.write_bytes(b"old")
    return path


def _fail_halfway(path: Path, problem: BaseException) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(b"half of")
        raise problem


def test_the_new_content_takes_the_place_of_the_old(old: Path):
    write_text(old, "ñ\n")
    assert old.read_bytes() == "ñ\n".encode()
    assert os.listdir(old.parent) == [old.name]


def test_the_old_file_is_there_until_the_block_ends(old: Path):
    with replacing(old) as temporary:
        assert temporary != old
        temporary.write_bytes(b"half of")
        assert old.read_bytes() == b"old"
    assert old.read_bytes() == b"half of"


def test_writers_see_the_true_name_and_the_same_disk(tmp_path: Path):
    # Some choose the format by the ending, and os.replace is atomic on one file system only.
    with replacing(tmp_path / "a.b.exr") as temporary:
        assert temporary.name == "a.b.exr"
        assert temporary.parent.parent == tmp_path
        temporary.touch()


@pytest.mark.parametrize("problem", [ValueError, KeyboardInterrupt, SystemExit, MemoryError])
def test_an_interrupted_write_leaves_old_content_and_no_debris(
    old: Path, problem: type[BaseException]
):
    with pytest.raises(problem):
        _fail_halfway(old, problem())
    assert old.read_bytes() == b"old"
    assert os.listdir(old.parent) == [old.name]


@pytest.mark.parametrize("has_begun", [False, True])
def test_what_a_kill_leaves_is_swept_up_and_nothing_else(old: Path, has_begun: bool):
    script = "import sys; from pathlib import Path; from lightpaint.files import replacing\n"
    script += "with replacing(Path(sys.argv[1])) as beside:\n"
    script += "    beside.touch()\n" * has_begun + "    import os; os.kill(os.getpid(), 9)"
    completed = subprocess.run([sys.executable, "-c", script, str(old)], check=False)
    assert completed.returncode == -signal.SIGKILL
    assert len(os.listdir(old.parent)) == 2
    others = [old.parent / f".{name}" for name in ("git", "a.txt.12345678", "b.json.abcdefgh")]
    for other in others:
        other.mkdir()
        (other / "somebody's").touch()
    (old.parent / ".c.txt.12345678").touch()
    before = set(old.parent.iterdir())
    sweep(old.parent)
    [removed] = before - set(old.parent.iterdir())
    assert removed.name.startswith(f".{old.name}.")
    sweep(old.parent / "nowhere")


def test_a_full_disk_is_an_output_error_that_names_the_file(old: Path):
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(OutputError, match=r"answer\.json: No space left"):
        _fail_halfway(old, full)
    assert old.read_bytes() == b"old"
    assert os.listdir(old.parent) == [old.name]


def test_a_block_that_writes_nothing_does_not_remove_the_old_file(old: Path):
    with pytest.raises(OutputError), replacing(old):
        pass
    assert old.read_bytes() == b"old"


def test_missing_folders_are_made(tmp_path: Path):
    write_bytes(tmp_path / "a" / "b" / "c.bin", b"\0")
    assert (tmp_path / "a" / "b" / "c.bin").read_bytes() == b"\0"


def test_a_folder_that_is_a_file(old: Path):
    with pytest.raises(OutputError, match="cannot write"):
        write_bytes(old / "below.bin", b"")
    with pytest.raises(OutputError, match="cannot write into"):
        check_writable(old)
    with pytest.raises(OutputError, match="cannot write into"):
        check_writable(old / "below")
    assert old.read_bytes() == b"old"


def test_a_file_that_is_a_folder(tmp_path: Path):
    folder = tmp_path / "folder"
    (folder / "inside").mkdir(parents=True)
    with pytest.raises(OutputError, match="folder"):
        write_bytes(folder, b"")
    assert os.listdir(tmp_path) == ["folder"]
    assert os.listdir(folder) == ["inside"]


def test_check_writable_leaves_nothing_behind(tmp_path: Path):
    check_writable(tmp_path / "a" / "b")
    assert os.listdir(tmp_path) == []


def test_what_is_read_is_not_written_over_under_any_name(tmp_path: Path) -> None:
    painting = tmp_path / "painting.exr"
    painting.touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "symbolic").symlink_to(painting)
    os.link(painting, tmp_path / "hard")
    for name in ("painting.exr", "symbolic", "hard", "folder/../painting.exr"):
        with pytest.raises(OutputError, match="is an input of this command"):
            check_files([tmp_path / "other", tmp_path / name], [tmp_path / "none", painting])
    check_files([tmp_path / "other"], [painting])


def test_a_folder_where_a_file_should_go(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="is a folder, but a file is to be written there"):
        check_files([tmp_path], [])


def test_names_that_are_not_utf_8(tmp_path: Path) -> None:
    name = Path(os.fsdecode(b"evening\xff"))
    for check in (lambda: check_files([tmp_path / name], []), lambda: check_writable(name)):
        with pytest.raises(OutputError, match=r"the name .*evening\\udcff is not UTF-8: choose"):
            check()


def test_a_way_through_nothing_leads_nowhere(tmp_path: Path) -> None:
    (tmp_path / "look").mkdir()
    with pytest.raises(OutputError, match="No such file"):
        check_writable(tmp_path / "nothing" / ".." / "look")
    check_writable(tmp_path / "look" / ".." / "new" / "look")
