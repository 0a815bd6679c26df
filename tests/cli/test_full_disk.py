"""Disks that are full, with real processes in places of a real size."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command import succeed
from nightly import nightly
from renderer import CORNELL, REPOSITORY, write_room

from lightpaint.basis.cache.basis_cache import TAG

WARM = REPOSITORY / "targets" / "cornell" / "warm.exr"

#: Larger than any XML or JSON here, smaller than any basis, comparison or report.
SMALL = 48 * 1024


@pytest.fixture(params=["a small file system", nightly("a limit of file sizes")])
def small_disk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[Path, str]]:
    """(a folder with next to no room, shell code to run before a command that writes there)."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if request.param == "a limit of file sizes":
        # Python ignores the signal, and writing fails with EFBIG.
        yield folder, f"ulimit -f {SMALL // 1024}"
        return
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SMALL}", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("the right to mount")
    yield folder, "true"
    subprocess.run(["umount", str(folder)], check=True)


def run(folder: Path, before: str, *arguments: object, **variables: str) -> tuple[int, str, str]:
    command = 'exec "$@"' if before == "true" else f'{before}; exec "$@"'
    completed = subprocess.run(
        ["bash", "-c", command, "bash", sys.executable, "-m", "lightpaint"]
        + [str(argument) for argument in arguments],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in completed.stderr, completed.stderr
    return completed.returncode, completed.stdout, completed.stderr


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.nightly
def test_a_full_cache_costs_no_answer(small_disk: tuple[Path, str], tmp_path: Path) -> None:
    disk, before = small_disk
    arguments: tuple[object, ...] = ("solve", CORNELL, WARM, "--spp", 4, "--no-verify")
    if before != "true":
        # The limit is the process's: let it be between any result and the basis.
        before = "ulimit -f 700"
    for _ in range(2 if before == "true" else 1):
        code, output, errors = run(tmp_path, before, *arguments, LIGHTPAINT_CACHE=str(disk))
        assert code == 0, errors
        assert "results in warm/" in output
        assert (tmp_path / "warm" / "report.html").is_file()
        assert f"the basis could not be saved in {disk}" in errors
        assert {path.name for path in disk.iterdir()} <= {"others", TAG}
        # Nor does it cost one where the disk is full from the beginning.
        if before == "true":
            (disk / "others").write_bytes(bytes(SMALL - 4096))  # but for the mark of the cache


SMALL_SOLVE = ("solve", CORNELL, WARM, "--resolution", "1/4", "--spp", 4)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A cache that has the basis: what fails is writing results."""
    folder = tmp_path_factory.mktemp("full_disk")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(folder / "cache"))
        succeed(folder, *SMALL_SOLVE)
    return str(folder / "cache")


@pytest.mark.nightly
@pytest.mark.parametrize("earlier", [True, nightly(False)])
def test_a_full_disk_leaves_earlier_results_as_they_were(
    small_disk: tuple[Path, str], tmp_path: Path, cache: str, earlier: bool
) -> None:
    disk, before = small_disk
    folder = disk / "look"
    if earlier:
        folder.mkdir()
        for name in ("lighting.json", "relit.xml", "predicted.exr", "comparison.png"):
            (folder / name).write_text(f"the earlier {name}", encoding="utf-8")
        (folder / "notes.txt").write_text("mine", encoding="utf-8")
    contents_before = contents(disk)
    options = ("-o", folder, "--force")
    code, output, errors = run(tmp_path, before, *SMALL_SOLVE, *options, LIGHTPAINT_CACHE=cache)
    assert code == 2, output + errors
    [line] = [x for x in errors.splitlines() if x.startswith("lightpaint solve: ")]
    assert f"cannot write {folder}" in line
    assert "results in" not in output
    assert contents(disk) == contents_before
    assert list(disk.rglob(".*")) == []


@pytest.mark.nightly
def test_a_full_disk_leaves_an_earlier_basis(small_disk: tuple[Path, str], tmp_path: Path) -> None:
    disk, before = small_disk
    path = disk / "room.basis.exr"
    path.write_text("an earlier one", encoding="utf-8")
    room = write_room(tmp_path)
    code, _, errors = run(
        tmp_path, before, "basis", room, "--spp", 4, "--no-cache", "-D", "width=64", "-o", path
    )
    assert code == 2, errors
    assert f"cannot write {path}" in errors
    assert path.read_text(encoding="utf-8") == "an earlier one"
    assert [p.name for p in disk.iterdir()] == ["room.basis.exr"]
