"""Patterns of a manifest: they find what `glob` finds, and end."""

import os
import time
from glob import glob
from pathlib import Path

import pytest

from lightpaint.batch.manifest import entries
from lightpaint.batch.manifest.file_names import files_matching
from lightpaint.batch.manifest.looks_file import read_manifest
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.errors import BatchError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    names = ["a.exr", "b.exr", "b.png", ".hidden.exr", "x/c.exr", "x/y/d.exr", "x/y/z/e.exr"]
    for name in [*names, ".x/f.exr", "x[1]/g.exr"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "pattern",
    [
        *("*.exr", "?.exr", "[ab].*", "**/*.exr", "x/**", "**", "**/y/*", "*/*.exr", ".*.exr"),
        *("**/**/**/*.exr", "x/**/z/*", "nowhere/*.exr", "*/nowhere", "./*.exr", "x/../*.exr"),
    ],
)
def test_they_find_what_glob_finds(folder: Path, pattern: str) -> None:
    for glob_pattern in (pattern, str(folder / pattern)):
        expected = {x for x in glob(glob_pattern, recursive=True) if Path(x).is_file()}
        matches = files_matching(glob_pattern)
        assert {os.path.normpath(x) for x in matches} == {os.path.normpath(x) for x in expected}
        assert len(set(matches)) == len(matches)


def test_brackets_of_the_manifests_folder_are_no_pattern(folder: Path) -> None:
    matches = files_matching("*.exr", folder / "x[1]")
    assert matches == [str(folder / "x[1]" / "g.exr")]
    assert files_matching(str(folder / "x" / "*.exr"), folder / "x[1]") == [
        str(folder / "x" / "c.exr")
    ]


@pytest.mark.parametrize("pattern", ["/**/*", "/proc/**/*", "/usr/**/**", "/usr/**/**/**/*x*/**"])
def test_one_that_means_the_whole_machine_ends_soon(folder: Path, pattern: str) -> None:
    (folder / "looks.toml").write_text(f'[[look]]\nscene = "room.xml"\npainting = "{pattern}"\n')
    began_s = time.monotonic()
    with pytest.raises(BatchError, match="more than 20000 files to look at: name a folder"):
        plan_batch("looks.toml", "out")
    assert time.monotonic() - began_s < 15


def test_a_loop_of_links_has_an_end(folder: Path) -> None:
    (folder / "x" / "again").symlink_to(folder)
    assert len(files_matching("**/d.exr")) == 1


def test_looks_have_a_number(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "room.xml").touch()
    manifest = folder / "looks.toml"
    text = '[[look]]\nscene = "room.xml"\npainting = "a.exr"\nsensors = {}\n'
    names = [f"sensor {k}" for k in range(100_000)]
    manifest.write_text(text.format(names))
    [first, *_] = read_manifest(manifest).mistakes.lines
    assert "sensors is" in first
    assert "10000 at most" in first
    monkeypatch.setattr(entries, "MAX_LOOKS", 20)
    manifest.write_text(text.format(names[:21]))
    with pytest.raises(BatchError, match="asks for more than 20 looks"):
        plan_batch(manifest, "out")
