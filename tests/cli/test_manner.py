"""What scripts get: one JSON document on stdout, quiet and verbose, exit codes that say enough."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import LIGHTS, write_room

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.tolerances import Tolerances
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.analysis.appearance.appearance import Appearance

#: A name that steers a terminal, breaks lines, and would end a text of JSON.
BAD = 'b\x1b[2J\r\n\t\x7f\x9b\u202e\u2028"\\'


def document(folder: Path, *arguments: object, code: int = 0) -> Any:
    """What `--json` prints: one document in plain ASCII, which steers nothing."""
    done = run(folder, *arguments, "--json")
    assert done.returncode == code, done.stderr
    assert re.fullmatch(r"[\n\x20-\x7e]*", done.stdout)
    return json.loads(done.stdout)


@pytest.fixture
def work_folder(tmp_path: Path, make_basis: Any) -> Path:
    """A basis, and two paintings: what it makes, and what no lights make."""
    basis = make_basis(2, names=["a", BAD])
    write_basis(tmp_path / "b.basis.exr", basis)
    write_rgb(tmp_path / "good.exr", 2 * basis.images.sum(axis=0))
    noise = np.random.default_rng(1).random(basis.images[0].shape, np.float32)
    write_rgb(tmp_path / "bad.exr", np.where(noise > 0.5, 4, 0).astype(np.float32))
    return tmp_path


def test_of_solve_it_is_what_the_files_say(work_folder: Path) -> None:
    told = document(work_folder, "solve", "b.basis.exr", "good.exr", "bad.exr", "-o", "out")
    assert [result["target"] for result in told["results"]] == ["good", "bad"]
    for result in told["results"]:
        folder = Path("out", result["target"])
        assert result["folder"] == result["view"] == str(folder)
        there = {str(file.relative_to(work_folder)) for file in (work_folder / folder).iterdir()}
        assert set(result["files"]) == there
        assert len(result["files"]) == len(there)
        for name in ("report", "lighting"):
            assert result[name] == json.loads((work_folder / folder / f"{name}.json").read_text())
        assert list(result["lighting"]["lights"]) == ["a", BAD]
        assert f"Mean ΔE {result['report']['seen']['delta_e']:.1f} " in result["verdict"]
        assert result["is_close"] == (result["target"] == "good")
        assert "is_met" not in result


def test_an_answer_that_is_not_close_enough(work_folder: Path) -> None:
    command = ("solve", "b.basis.exr", "bad.exr")
    [result] = document(work_folder, *command)["results"]
    seen = result["report"]["seen"]
    assert seen["share_met"] == max(0, 1 - seen["delta_e"] / seen["asked"])
    missed, met = seen["delta_e"], seen["share_met"]
    shutil.rmtree(work_folder / "bad")

    done = run(work_folder, *command, "--max-miss", missed - 0.01, "-q")
    assert done.returncode == 1
    said = f"lightpaint solve: bad misses a mean ΔE of {missed:.3f}, more than --max-miss"
    assert done.stderr.startswith(said)
    assert len(done.stderr.splitlines()) == 1
    assert (work_folder / "bad" / "lighting.json").is_file()

    command += ("--max-miss", missed, "--min-fit", met)
    assert run(work_folder, *command).returncode == 0
    [result] = document(work_folder, *command[:-1], met + 0.01, code=1)["results"]
    assert result["asked"] == {"max_miss": missed, "min_fit": met + 0.01}
    assert result["is_met"] is False
    # Of several, all that fall short are named in the one line.
    both = ("solve", "b.basis.exr", "bad.exr", "good.exr", "--max-miss", 1, "-o", "both", "-q")
    done = run(work_folder, *both)
    assert done.returncode == 1
    assert "both/bad misses" in done.stderr
    assert "both/good" not in done.stderr


@pytest.mark.parametrize("option", ["--max-miss", "--min-fit"])
@pytest.mark.parametrize("value", ["-1", "nan", "inf", "much", ""])
def test_what_cannot_be_asked_is_refused(work_folder: Path, option: str, value: str) -> None:
    said = run_refused(work_folder, "solve", "b.basis.exr", "good.exr", f"{option}={value}")
    assert f"{option}: {value!r} is not a number" in said


def test_a_share_is_at_most_1(work_folder: Path) -> None:
    said = run_refused(work_folder, "solve", "b.basis.exr", "good.exr", "--min-fit", 80)
    assert "is not a number as a share <= 1" in said


def test_shares_of_what_was_asked() -> None:
    for delta_e, asked, share in ((2, 10, 0.8), (0, 10, 1), (12, 10, 0), (0, 0, 1), (1, 0, 0)):
        seen = Appearance(float(delta_e), 0.0, float(asked))
        assert seen.share_met == pytest.approx(share)
        assert Tolerances().shortfalls(seen) == []
        assert Tolerances().document(seen) == {}
        assert Tolerances(min_fit=seen.share_met, max_miss=delta_e).shortfalls(seen) == []
        assert len(Tolerances(max_miss=delta_e - 1e-9).shortfalls(seen)) == 1


def test_every_command_has_a_document(tmp_path: Path) -> None:
    room = write_room(
        tmp_path, lights=LIGHTS["bulb"].replace("bulb", "b&#10;&#27;") + LIGHTS["sky"]
    )
    small = ("-D", "width=8", "--spp", 2)
    made = document(tmp_path, "basis", room, *small, "--lights", "sky")
    assert made["file"] == "room.basis.exr"
    assert (made["lights"], made["kept"], made["size"]) == (["sky"], ["rest"], [8, 20])
    made = document(tmp_path, "basis", room, *small, "-o", "x\n.exr")
    assert made["lights"] == ["b\n\x1b", "sky"]
    assert (tmp_path / made["file"]).is_file()

    made = document(tmp_path, "template", room, *small)
    assert made["picture"] == "template/template.png"
    assert {made["picture"], made["light"], "template/template.json"} <= set(made["files"])
    assert all((tmp_path / file).is_file() for file in made["files"])

    solve = ("solve", room, "template/template.exr", *small, "--no-template", "-o", "out")
    [solved] = document(tmp_path, *solve)["results"]
    checked = document(tmp_path, "verify", "out", "--spp", 4, "-q")
    assert checked["agrees"] == all(result["agrees"] for result in checked["results"])
    [result] = checked["results"]
    # What each light does, and so its power, a basis knows.
    assert set(result) == {"folder", *solved["report"]["verification"]} - {"power"}

    [relit] = document(tmp_path, "relight", room, "out/lighting.json", *small, "-o", "r")["results"]
    assert relit["files"] == ["r/relit.xml", "r/relit.exr", "r/relit.png"]
    assert (relit["folder"], relit["lighting"]) == ("r", "out/lighting.json")


def test_the_cache_and_the_doctor(work_folder: Path, make_basis: Any, monkeypatch: Any) -> None:
    from lightpaint.basis.cache import cache

    monkeypatch.setenv("LIGHTPAINT_CACHE", str(work_folder / "cache"))
    assert cache.keep(make_basis(2, names=["a", BAD]))
    told = document(work_folder, "cache")
    [entry] = told["kept"]
    assert (entry["scene"], entry["lights"], entry["size"]) == ("scene.xml", 2, [10, 12])
    assert told["folder"] == str(work_folder / "cache")
    assert document(work_folder, "cache", "drop", "scene")["dropped"] == [entry]
    assert document(work_folder, "cache", "clear") == {
        "folder": str(work_folder / "cache"),
        "dropped": [],
        "freed": 0,
    }
    told = document(work_folder, "doctor")
    assert told["ok"]
    assert "mitsuba" in [finding["what"] for finding in told["findings"]]


def test_errors_stay_one_line(work_folder: Path) -> None:
    for how in ("--json", "-q", "-v"):
        assert "no such" in run_refused(work_folder, "solve", "gone.xml", "good.exr", how)
        assert "gone" in run_refused(work_folder, "cache", "drop", "gone", how)
    assert "not allowed with" in run_refused(work_folder, "cache", "-q", "-v")


def test_quiet_and_verbose(work_folder: Path) -> None:
    command = ("solve", "b.basis.exr", "good.exr", "-o", "out")
    plain, quiet, verbose = (run(work_folder, *command, *how) for how in ((), ("-q",), ("-v",)))
    assert quiet.stderr == ""
    assert quiet.stdout == plain.stdout == verbose.stdout
    more = set(verbose.stderr.splitlines()) - set(plain.stderr.splitlines())
    assert set(plain.stderr.splitlines()) <= set(verbose.stderr.splitlines())
    assert all(re.search(r" \[\d+\.\d\d s, \d+\.\d\d s in all\]$", line) for line in more)
    for word in ("space ", "hold 0", "seed 0", "KKT", "report written", "done"):
        assert any(word in line for line in more)
    assert "lightpaint: " in plain.stderr


def test_each_command_takes_them_and_says_its_exit_codes(tmp_path: Path) -> None:
    [commands] = (x for x in command_parser()._actions if isinstance(x.choices, dict))
    for parser in commands.choices.values():
        known = parser._option_string_actions
        assert {"--json", "-q", "--quiet", "-v", "--verbose"} <= set(known)
        assert "Exit codes" in parser.format_help()
    assert json.loads(succeed(tmp_path, "cache", "--json", "list"))
