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
from lightpaint.cli.output.documents import Tolerances
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance

#: A name that steers a terminal, breaks lines, and would end a text of JSON.
BAD = 'b\x1b[2J\r\n\t\x7f\x9b\u202e\u2028"\\'


def document(folder: Path, *arguments: object, code: int = 0) -> Any:
    """What `--json` prints: one document in plain ASCII, which steers nothing."""
    completed = run(folder, *arguments, "--json")
    assert completed.returncode == code, completed.stderr
    assert re.fullmatch(r"[\n\x20-\x7e]*", completed.stdout)
    return json.loads(completed.stdout)


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
    record = document(work_folder, "solve", "b.basis.exr", "good.exr", "bad.exr", "-o", "out")
    assert [result["target"] for result in record["results"]] == ["good", "bad"]
    for result in record["results"]:
        folder = Path("out", result["target"])
        assert result["folder"] == result["view"] == str(folder)
        file_names = {
            str(file.relative_to(work_folder)) for file in (work_folder / folder).iterdir()
        }
        assert set(result["files"]) == file_names
        assert len(result["files"]) == len(file_names)
        for name in ("report", "lighting"):
            assert result[name] == json.loads((work_folder / folder / f"{name}.json").read_text())
        assert list(result["lighting"]["lights"]) == ["a", BAD]
        assert f"Mean ΔE {result['report']['seen']['delta_e']:.1f} " in result["verdict"]
        assert result["is_close"] == (result["target"] == "good")
        assert "is_met" not in result


def test_an_answer_that_is_not_close_enough(work_folder: Path) -> None:
    command = ("solve", "b.basis.exr", "bad.exr")
    [result] = document(work_folder, *command)["results"]
    appearance = result["report"]["seen"]
    assert appearance["share_met"] == max(0, 1 - appearance["delta_e"] / appearance["asked"])
    miss, share_met = appearance["delta_e"], appearance["share_met"]
    shutil.rmtree(work_folder / "bad")

    completed = run(work_folder, *command, "--max-miss", miss - 0.01, "-q")
    assert completed.returncode == 1
    message = f"lightpaint solve: bad misses a mean ΔE of {miss:.3f}, more than --max-miss"
    assert completed.stderr.startswith(message)
    assert len(completed.stderr.splitlines()) == 1
    assert (work_folder / "bad" / "lighting.json").is_file()

    command += ("--max-miss", miss, "--min-fit", share_met)
    assert run(work_folder, *command).returncode == 0
    [result] = document(work_folder, *command[:-1], share_met + 0.01, code=1)["results"]
    assert result["asked"] == {"max_miss": miss, "min_fit": share_met + 0.01}
    assert result["is_met"] is False
    # Of several, all that fall short are named in the one line.
    command_of_both = (
        "solve",
        "b.basis.exr",
        "bad.exr",
        "good.exr",
        "--max-miss",
        1,
        "-o",
        "both",
        "-q",
    )
    completed = run(work_folder, *command_of_both)
    assert completed.returncode == 1
    assert "both/bad misses" in completed.stderr
    assert "both/good" not in completed.stderr


@pytest.mark.parametrize("option", ["--max-miss", "--min-fit"])
@pytest.mark.parametrize("value", ["-1", "nan", "inf", "much", ""])
def test_what_cannot_be_asked_is_refused(work_folder: Path, option: str, value: str) -> None:
    refusal = run_refused(work_folder, "solve", "b.basis.exr", "good.exr", f"{option}={value}")
    assert f"{option}: {value!r} is not a number" in refusal


def test_a_share_is_at_most_1(work_folder: Path) -> None:
    refusal = run_refused(work_folder, "solve", "b.basis.exr", "good.exr", "--min-fit", 80)
    assert "is not a number as a share <= 1" in refusal


def test_shares_of_what_was_asked() -> None:
    for delta_e, wanted_delta_e, share in (
        (2, 10, 0.8),
        (0, 10, 1),
        (12, 10, 0),
        (0, 0, 1),
        (1, 0, 0),
    ):
        appearance = Appearance(float(delta_e), 0.0, float(wanted_delta_e))
        assert appearance.share_met == pytest.approx(share)
        assert Tolerances().shortfalls(appearance) == []
        assert Tolerances().document(appearance) == {}
        assert (
            Tolerances(min_fit=appearance.share_met, max_miss=delta_e).shortfalls(appearance) == []
        )
        assert len(Tolerances(max_miss=delta_e - 1e-9).shortfalls(appearance)) == 1


def test_every_command_has_a_document(tmp_path: Path) -> None:
    room = write_room(
        tmp_path, lights=LIGHTS["bulb"].replace("bulb", "b&#10;&#27;") + LIGHTS["sky"]
    )
    small = ("-D", "width=8", "--spp", 2)
    record = document(tmp_path, "basis", room, *small, "--lights", "sky")
    assert record["file"] == "room.basis.exr"
    assert (record["lights"], record["kept"], record["size"]) == (["sky"], ["rest"], [8, 20])
    record = document(tmp_path, "basis", room, *small, "-o", "x\n.exr")
    assert record["lights"] == ["b\n\x1b", "sky"]
    assert (tmp_path / record["file"]).is_file()

    record = document(tmp_path, "template", room, *small)
    assert record["picture"] == "template/template.png"
    assert {record["picture"], record["light"], "template/template.json"} <= set(record["files"])
    assert all((tmp_path / file).is_file() for file in record["files"])

    solve = ("solve", room, "template/template.exr", *small, "--no-template", "-o", "out")
    [solved] = document(tmp_path, *solve)["results"]
    checked = document(tmp_path, "verify", "out", "--spp", 4, "-q")
    assert checked["agrees"] == all(result["agrees"] for result in checked["results"])
    [result] = checked["results"]
    assert set(result) == {"folder", *solved["report"]["verification"]}
    # What each light does, a basis knows.
    assert result["power"]["lights"].keys() == {"all lights"}

    [relit] = document(tmp_path, "relight", room, "out/lighting.json", *small, "-o", "r")["results"]
    assert relit["files"] == ["r/relit.xml", "r/relit.exr", "r/relit.png"]
    assert (relit["folder"], relit["lighting"]) == ("r", "out/lighting.json")


def test_the_cache_and_the_doctor(work_folder: Path, make_basis: Any, monkeypatch: Any) -> None:
    from lightpaint.basis.cache import basis_cache

    monkeypatch.setenv("LIGHTPAINT_CACHE", str(work_folder / "cache"))
    assert basis_cache.keep(make_basis(2, names=["a", BAD]))
    record = document(work_folder, "cache")
    [entry] = record["kept"]
    assert (entry["scene"], entry["lights"], entry["size"]) == ("scene.xml", 2, [10, 12])
    assert record["folder"] == str(work_folder / "cache")
    assert document(work_folder, "cache", "drop", "scene")["dropped"] == [entry]
    assert document(work_folder, "cache", "clear") == {
        "folder": str(work_folder / "cache"),
        "dropped": [],
        "freed": 0,
    }
    record = document(work_folder, "doctor")
    assert record["ok"]
    assert "mitsuba" in [finding["what"] for finding in record["findings"]]


def test_errors_stay_one_line(work_folder: Path) -> None:
    for option in ("--json", "-q", "-v"):
        assert "no such" in run_refused(work_folder, "solve", "gone.xml", "good.exr", option)
        assert "gone" in run_refused(work_folder, "cache", "drop", "gone", option)
    assert "not allowed with" in run_refused(work_folder, "cache", "-q", "-v")


def test_quiet_and_verbose(work_folder: Path) -> None:
    command = ("solve", "b.basis.exr", "good.exr", "-o", "out")
    plain, quiet, verbose = (
        run(work_folder, *command, *options) for options in ((), ("-q",), ("-v",))
    )
    assert quiet.stderr == ""
    assert quiet.stdout == plain.stdout == verbose.stdout
    verbose_lines = set(verbose.stderr.splitlines()) - set(plain.stderr.splitlines())
    assert set(plain.stderr.splitlines()) <= set(verbose.stderr.splitlines())
    assert all(re.search(r" \[\d+\.\d\d s, \d+\.\d\d s in all\]$", line) for line in verbose_lines)
    for word in ("space ", "hold 0", "seed 0", "KKT", "report written", "done"):
        assert any(word in line for line in verbose_lines)
    assert "lightpaint: " in plain.stderr


def test_progress_as_json_lines(tmp_path: Path) -> None:
    """Each line of stderr is an object: progress from its begin to its end, remarks, an error."""
    room = write_room(tmp_path, lights=LIGHTS["bulb"])
    write_rgb(tmp_path / "warm.exr", np.full((20, 24, 3), 0.3, np.float32))
    command = ("solve", room, "warm.exr", "--spp", 8, "--json-progress")
    own_cache = str(tmp_path / "cache")  # where no other test has left this room's basis
    completed = run(tmp_path, *command, "-o", "out", LIGHTPAINT_CACHE=own_cache)
    assert completed.returncode == 0, completed.stderr
    objects = [json.loads(line) for line in completed.stderr.splitlines()]
    works = [x for x in objects if "work" in x]
    assert {x["work"] for x in works} == {"basis", "verification"}
    for label in ("basis", "verification"):
        counts = [x["done"] for x in works if x["work"] == label]
        assert counts[0] == 0
        assert counts == sorted(counts)
    assert any(x.get("remark", "").startswith("verification of at most 8") for x in objects)
    refused = run(tmp_path, *command, "-o", "out", "--exposure", 99999)
    assert refused.returncode == 2
    assert "error" in json.loads(refused.stderr.splitlines()[-1])


def test_each_command_takes_them_and_says_its_exit_codes(tmp_path: Path) -> None:
    [commands] = (x for x in command_parser()._actions if isinstance(x.choices, dict))
    for parser in commands.choices.values():
        option_actions = parser._option_string_actions
        assert {"--json", "-q", "--quiet", "-v", "--json-progress"} <= set(option_actions)
        assert "Exit codes" in parser.format_help()
    assert json.loads(succeed(tmp_path, "cache", "--json", "list"))


def test_help_shows_each_option_once_under_what_it_is_for() -> None:
    [commands] = (x for x in command_parser()._actions if isinstance(x.choices, dict))
    for name, parser in commands.choices.items():
        help_text = parser.format_help()
        lines = [line for line in help_text.splitlines() if line.startswith("  -")]
        entries = [re.split(r" {2,}", line.strip())[0] for line in lines]
        for option in (x for x in parser._actions if x.option_strings):
            word = re.compile(rf"(?<!\S){option.option_strings[-1]}(?![\w-])")
            assert sum(bool(word.search(x)) for x in entries) == 1, (name, option.option_strings)
    titles = re.findall(r"^(\S.*):$", commands.choices["solve"].format_help(), re.M)
    assert titles[:3] == ["Arguments", "Painting", "What the painting means"]
    assert titles[-3:] == ["Results", "Constraints", "Places"]
    assert len(set(titles)) == len(titles)


def test_no_command_lists_the_commands(tmp_path: Path):
    listing = succeed(tmp_path)
    assert all(f"\n    {name} " in listing for name in ("solve", "template", "batch", "doctor"))
