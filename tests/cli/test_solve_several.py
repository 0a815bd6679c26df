"""`solve` of several paintings: a gallery beside the results, and one bad painting alone."""

import json
from pathlib import Path

import pytest
from batches import write_batch
from command import refused, run, succeed


@pytest.fixture
def here(tmp_path: Path) -> Path:
    write_batch(tmp_path)
    return tmp_path


PAINTINGS = ("p0.exr", "p1.exr", "p2.exr")


def test_a_gallery_lies_beside_several_answers(here: Path) -> None:
    output = succeed(here, "solve", "b.basis.exr", *PAINTINGS, "-o", "out")
    assert "out/index.html: 3 looks: all done" in output
    told = json.loads((here / "out" / "summary.json").read_text())
    assert [look["look"] for look in told["looks"]] == ["p0", "p1", "p2"]
    assert all((here / "out" / look["picture"]).is_file() for look in told["looks"])
    # And one alone has none.
    succeed(here, "solve", "b.basis.exr", "p0.exr", "-o", "one")
    assert not (here / "one" / "index.html").exists()


def test_a_bad_painting_fails_alone_where_that_is_asked(here: Path) -> None:
    (here / "p1.exr").write_bytes(b"no picture")
    command = ("solve", "b.basis.exr", *PAINTINGS, "-o", "out")
    assert "p1.exr" in refused(here, *command)
    done = run(here, *command, "--keep-going", "-q")
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert line.startswith("lightpaint solve: p1: ")
    assert "3 looks: 1 failed" in done.stdout
    assert (here / "out" / "p2" / "lighting.json").is_file()
    told = json.loads((here / "out" / "summary.json").read_text())
    assert told["looks"][0]["look"] == "p1"
    for name in PAINTINGS:
        (here / name).write_bytes(b"no picture")
    done = run(here, *command, "--keep-going", "-q")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 3


def test_somebody_elses_page_is_kept(here: Path) -> None:
    (here / "out").mkdir()
    (here / "out" / "index.html").write_text("mine", encoding="utf-8")
    for command in (("solve", "b.basis.exr", *PAINTINGS), ("batch", "looks.toml")):
        said = refused(here, *command, "-o", "out")
        assert "out/index.html is there, and of no batch: name another folder (-o)" in said
    succeed(here, "solve", "b.basis.exr", *PAINTINGS, "-o", "out", "--force")
    assert (here / "out" / "index.html").read_text() != "mine"
