"""Options stand anywhere on the line, and paths are never taken for their values."""

import argparse
import itertools
from pathlib import Path
from typing import Any

import pytest
from command import run_refused

from lightpaint.cli.options.parser import command_parser

PARSER = command_parser()


def parse(*line: str) -> dict[str, Any]:
    return vars(PARSER.parse_args(line))


PIECES = [
    ["room.xml"],
    ["a.png"],
    ["--spp", "64"],
    ["-o", "out"],
    ["--suggest"],
    ["--exposure", "-1.5"],
    ["--lock", "lamp=2"],
]


def test_every_order_is_the_same_line() -> None:
    expected = parse("solve", *itertools.chain(*PIECES))
    assert (expected["source"], expected["targets"]) == ("room.xml", ["a.png"])
    assert (expected["spp"], expected["output"], expected["exposure"]) == (64, "out", -1.5)
    assert expected["suggest"] == 3
    orders = [x for x in itertools.permutations(PIECES) if x.index(PIECES[0]) < x.index(PIECES[1])]
    for order in orders[::7]:
        assert parse("solve", *itertools.chain(*order)) == expected, order


@pytest.mark.parametrize(
    ("line", "suggest", "paths"),
    [
        ("--suggest room.xml a.png", 3, ["room.xml", "a.png"]),
        ("--suggest 2 room.xml a.png", 2, ["room.xml", "a.png"]),
        ("--suggest=2 room.xml a.png", 2, ["room.xml", "a.png"]),
        ("room.xml --sug a.png b.png", 3, ["room.xml", "a.png", "b.png"]),
        ("room.xml a.png --suggest", 3, ["room.xml", "a.png"]),
        ("room.xml --suggest --spp 4 a.png", 3, ["room.xml", "a.png"]),
        ("room.xml --suggest -- 2", 3, ["room.xml", "2"]),
    ],
)
def test_an_optional_number_takes_no_path(line: str, suggest: int, paths: list[str]) -> None:
    values = parse("solve", *line.split())
    assert values["suggest"] == suggest
    assert [values["source"], *values["targets"]] == paths


@pytest.mark.parametrize(
    ("line", "name", "value"),
    [
        (["--exposure", "-2"], "exposure", -2.0),
        (["--exposure", "-.5"], "exposure", -0.5),
        (["--exposure", "-1e-1"], "exposure", -0.1),
        (["-o", "-1"], "output", "-1"),
        (["-o-1"], "output", "-1"),
        (["-s", "-1"], "sensor", "-1"),
        (["-s0"], "sensor", "0"),
        (["--layer", ""], "layer", ""),
        (["-o", ""], "output", ""),
        (["--layer", "-"], "layer", "-"),
        (["--mask=-m.png"], "masks", ["-m.png"]),
        (["-Dwidth=-3"], "parameters", [("width", "-3")]),
        (["-D", "a=b=c"], "parameters", [("a", "b=c")]),
        (["--resi"], "resize", True),
    ],
)
def test_values_that_look_like_something_else(line: list[str], name: str, value: object) -> None:
    for before, paths_after in (([], ["r.xml", "a.png"]), (["r.xml"], ["a.png"])):
        assert parse("solve", *before, *line, *paths_after)[name] == value


def test_behind_two_dashes_everything_is_a_path() -> None:
    values = parse("solve", "--spp", "8", "r.xml", "--", "--spp", "-a.png")
    assert (values["spp"], values["source"], values["targets"]) == (8, "r.xml", ["--spp", "-a.png"])
    values = parse("relight", "--", "-r.xml", "a.json")
    assert (values["scene"], values["lightings"]) == ("-r.xml", ["a.json"])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("solve r.xml --sp a.png", "ambiguous option: --sp"),
        ("solve r.xml --bogus a.png", "unrecognized arguments: --bogus (see lightpaint solve -"),
        ("solve r.xml a.png --resoluton 1/2", "--resoluton; did you mean --resolution? (see light"),
        ("solve r.xml a.png --resoluton=1/2", "--resoluton=1/2; did you mean --resolution? (see"),
        ("solve r.xml -z a.png", "unrecognized arguments: -z (see lightpaint solve --help)"),
        ("solve r.xml a.png --spp", "argument --spp: expected one argument"),
        ("solve r.xml --spp --resize a.png", "argument --spp: expected one argument"),
        ("solve r.xml -a.png --seed --spp", "argument --seed: expected one argument"),
        ("solve --seed --spp -- -r.xml -a.png", "argument --seed: expected one argument"),
        ("solve --suggest 0 r.xml a.png", "'0' is not a whole number >= 1"),
        ("solve --suggest 1.5 r.xml a.png", "'1.5' is not a whole number >= 1"),
        ("lights", "the following arguments are required: SCENE (see lightpaint lights --help)"),
        ("lights r.xml b.xml", "unrecognized arguments: b.xml (see lightpaint lights --help)"),
        ("relight r.xml", "(see lightpaint relight --help)"),
        ("--spp 4 solve r.xml a.png", "the command comes first: lightpaint COMMAND --spp"),
        ("slove r.xml", "invalid choice: 'slove'"),
        ("slove r.xml", "'doctor'); did you mean 'solve'?"),
        ("solve r.xml p.exr --colors gentel", "did you mean 'gentle'?"),
    ],
)
def test_slips_name_the_help_of_their_command(tmp_path: Path, line: str, message: str) -> None:
    assert message in run_refused(tmp_path, *line.split())


@pytest.mark.parametrize("line", ["--help", "r.xml --help", "r.xml --spp 4 --help --bogus"])
def test_help_is_found_anywhere(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        parse("solve", *line.split())
    assert end.value.code in (0, None)
    assert "usage: lightpaint solve" in capsys.readouterr().out


def test_options_take_no_value_one_or_an_optional_number() -> None:
    """What is put in order knows of no others."""
    [commands] = [x for x in command_parser()._actions if isinstance(x, argparse._SubParsersAction)]
    options = [x for c in commands.choices.values() for x in c._actions if x.option_strings]
    assert {x.nargs for x in options} <= {None, 0, "?"}
    assert all(isinstance(x.const, int) for x in options if x.nargs == "?")
