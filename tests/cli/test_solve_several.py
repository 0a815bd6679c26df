"""`solve` of several paintings: a gallery beside the results, and one bad painting alone."""

import json
from pathlib import Path

import pytest
from batches import write_batch
from command import run, run_refused, succeed

from lightpaint.cli.options.answer_options import VARIATIONS
from lightpaint.lighting.answer.lighting_file import read_lighting


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_batch(tmp_path)
    return tmp_path


PAINTINGS = ("p0.exr", "p1.exr", "p2.exr")


def test_a_gallery_lies_beside_several_answers(folder: Path) -> None:
    output = succeed(folder, "solve", "b.basis.exr", *PAINTINGS, "-o", "out")
    assert "out/index.html: 3 looks: all done" in output
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert [look["look"] for look in summary["looks"]] == ["p0", "p1", "p2"]
    assert all((folder / "out" / look["picture"]).is_file() for look in summary["looks"])
    # And one alone has none.
    succeed(folder, "solve", "b.basis.exr", "p0.exr", "-o", "one")
    assert not (folder / "one" / "index.html").exists()


def test_a_bad_painting_fails_alone_where_that_is_asked(folder: Path) -> None:
    (folder / "p1.exr").write_bytes(b"no picture")
    command = ("solve", "b.basis.exr", *PAINTINGS, "-o", "out")
    assert "p1.exr" in run_refused(folder, *command)
    completed = run(folder, *command, "--keep-going", "-q")
    assert completed.returncode == 1
    [line] = completed.stderr.splitlines()
    assert line.startswith("lightpaint solve: p1: ")
    assert "3 looks: 1 failed" in completed.stdout
    assert (folder / "out" / "p2" / "lighting.json").is_file()
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["looks"][0]["look"] == "p1"
    for name in PAINTINGS:
        (folder / name).write_bytes(b"no picture")
    completed = run(folder, *command, "--keep-going", "-q")
    assert completed.returncode == 1
    assert len(completed.stderr.splitlines()) == 3


def test_somebody_elses_page_is_kept(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "index.html").write_text("mine", encoding="utf-8")
    for command in (("solve", "b.basis.exr", *PAINTINGS), ("batch", "looks.toml")):
        refusal = run_refused(folder, *command, "-o", "out")
        assert "out/index.html is there, and of no batch: name another folder (-o)" in refusal
    succeed(folder, "solve", "b.basis.exr", *PAINTINGS, "-o", "out", "--force")
    assert (folder / "out" / "index.html").read_text() != "mine"


def test_a_painting_called_as_a_file_of_the_gallery_is_refused(folder: Path) -> None:
    (folder / "p1.exr").rename(folder / "thumbnails.exr")
    refusal = run_refused(folder, "solve", "b.basis.exr", "p0.exr", "thumbnails.exr", "-o", "out")
    assert "thumbnails is a folder of the gallery of several looks" in refusal


@pytest.mark.nightly
def test_variations_are_what_a_batch_makes_of_them(folder: Path) -> None:
    words = ("warmer", "cooler", "fewer lights", "white only", "held harder")
    (folder / "looks.toml").write_text(
        f'[[look]]\nbasis = "b.basis.exr"\npainting = "p0.exr"\nvariations = {json.dumps(words)}\n'
    )
    document_printed = json.loads(
        succeed(folder, "batch", "looks.toml", "-o", "many", "--json", "-q")
    )
    typed = ",".join(word.replace(" ", "-") for word in words)
    assert typed == VARIATIONS
    output = succeed(
        folder,
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
    rows = json.loads((folder / "few" / "summary.json").read_text())["looks"]
    assert {(x["look"], x.get("variation")) for x in rows} == {
        (x["look"], x.get("variation")) for x in document_printed["looks"]
    }
    for row in rows:
        name = row["look"]
        solve_lighting, batch_lighting = (
            read_lighting(folder / x / name / "lighting.json") for x in ("few", "many")
        )
        assert solve_lighting.emission == batch_lighting.emission
    # Without a folder they lie beside each other, with the gallery of both.
    document_printed = json.loads(
        succeed(folder, "solve", "b.basis.exr", "p0.exr", "--variations", "warmer", "--json", "-q")
    )
    assert [x["folder"] for x in document_printed["results"]] == ["p0"]
    [variation] = document_printed["variations"]
    assert (variation["variation"], variation["of"], variation["folder"]) == (
        "warmer",
        "p0",
        "p0-warmer",
    )
    assert all((folder / file).is_file() for file in variation["files"])
    assert "p0-warmer/lighting.json" in variation["files"]
    assert (folder / "p0-warmer" / "predicted.exr").is_file()
    assert "2 looks" in (folder / "index.html").read_text()


def test_what_is_wrong_with_variations_is_one_line(folder: Path) -> None:
    command = ("solve", "b.basis.exr", "p0.exr", "p1.exr", "-o", "out")
    line = run_refused(folder, *command, "--variations", "warm")
    assert "there is no variation 'warm': known are warmer, cooler, fewer-lights" in line
    (folder / "p0-warmer.exr").write_bytes((folder / "p1.exr").read_bytes())
    line = run_refused(folder, *command, "p0-warmer.exr", "--variations", "warmer")
    assert "would both go to out/p0-warmer" in line
    assert not (folder / "out").exists()
