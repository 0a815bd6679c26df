"""`solve` of several paintings: a gallery beside the results, and one bad painting alone."""

import json
from pathlib import Path

import pytest
from batches import write_batch
from command import refused, run, succeed

from lightpaint.cli.options.solve_options import VARIATIONS
from lightpaint.lighting.answer.lighting_file import read_lighting


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


def test_a_painting_called_as_a_file_of_the_gallery_is_refused(here: Path) -> None:
    (here / "p1.exr").rename(here / "thumbnails.exr")
    said = refused(here, "solve", "b.basis.exr", "p0.exr", "thumbnails.exr", "-o", "out")
    assert "thumbnails is a folder of the gallery of several looks" in said


def test_variations_are_what_a_batch_makes_of_them(here: Path) -> None:
    words = ("warmer", "cooler", "fewer lights", "white only", "held harder")
    (here / "looks.toml").write_text(
        f'[[look]]\nbasis = "b.basis.exr"\npainting = "p0.exr"\nvariations = {json.dumps(words)}\n'
    )
    told = json.loads(succeed(here, "batch", "looks.toml", "-o", "many", "--json", "-q"))
    typed = ",".join(word.replace(" ", "-") for word in words)
    assert typed == VARIATIONS
    output = succeed(
        here,
        "solve",
        "b.basis.exr",
        "p0.exr",
        "--variations",
        typed,
        "-o",
        "few",
        "--table",
        "full",
    )
    assert "few/index.html: 6 looks: all done" in output
    rows = json.loads((here / "few" / "summary.json").read_text())["looks"]
    assert {(x["look"], x.get("variation")) for x in rows} == {
        (x["look"], x.get("variation")) for x in told["looks"]
    }
    for row in rows:
        name = row["look"]
        ours, theirs = (read_lighting(here / x / name / "lighting.json") for x in ("few", "many"))
        assert ours.emission == theirs.emission
    # Without a folder they lie beside each other, with the gallery of both.
    told = json.loads(
        succeed(here, "solve", "b.basis.exr", "p0.exr", "--variations", "warmer", "--json", "-q")
    )
    assert [x["folder"] for x in told["results"]] == ["p0"]
    [made] = told["variations"]
    assert (made["variation"], made["of"], made["folder"]) == ("warmer", "p0", "p0-warmer")
    assert all((here / file).is_file() for file in made["files"])
    assert "p0-warmer/lighting.json" in made["files"]
    assert (here / "p0-warmer" / "predicted.exr").is_file()
    assert "2 looks" in (here / "index.html").read_text()


def test_what_is_wrong_with_variations_is_one_line(here: Path) -> None:
    command = ("solve", "b.basis.exr", "p0.exr", "p1.exr", "-o", "out")
    line = refused(here, *command, "--variations", "warm")
    assert "there is no variation 'warm': known are warmer, cooler, fewer-lights" in line
    (here / "p0-warmer.exr").write_bytes((here / "p1.exr").read_bytes())
    line = refused(here, *command, "p0-warmer.exr", "--variations", "warmer")
    assert "would both go to out/p0-warmer" in line
    assert not (here / "out").exists()
