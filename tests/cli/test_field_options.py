"""Options that fields of records declare: one annotation says name, help, values and default."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, Literal

import pytest

from lightpaint.batch.run_options import RunOptions
from lightpaint.cli.options.option_groups import add_fields
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.output.vocabulary import OPTIONS, RECORDS, SPELLINGS
from lightpaint.pipeline.job.settings import Settings
from lightpaint.relit.formats import FORMS
from lightpaint.validation import FieldOption, Option, number, options_of, whole

#: Fields that no option of their own sets, and why.
WITHOUT = {
    Settings: {
        "transform": "--view and --exposure make it, over that of the painting",
        "command": "it is the command line",
    },
    RunOptions: {},
}

DECLARED = [x for record in RECORDS for x in options_of(record).values()]


@cache
def commands() -> list[argparse.ArgumentParser]:
    """The parsers of all commands, made once."""
    [found] = (x for x in command_parser()._actions if isinstance(x, argparse._SubParsersAction))
    return list(found.choices.values())


def actions_of(field: str) -> Iterator[argparse.Action]:
    """The options of all commands that set a field."""
    for command in commands():
        yield from (x for x in command._actions if x.dest == field)


@pytest.mark.parametrize("record", RECORDS)
def test_every_field_has_an_option_or_says_why_not(record: type) -> None:
    names = {field.name for field in fields(record)}
    assert names == {*options_of(record), *WITHOUT[record]}
    assert not set(options_of(record)) & set(WITHOUT[record])


@pytest.mark.parametrize("declared", DECLARED, ids=lambda x: x.field)
def test_some_command_takes_the_option_with_the_default_of_the_field(declared: FieldOption) -> None:
    actions = [x for x in actions_of(declared.field) if declared.option.name in x.option_strings]
    assert actions
    assert {x.default for x in actions} == {declared.default}


@pytest.mark.parametrize("declared", DECLARED, ids=lambda x: x.field)
def test_errors_name_the_option(declared: FieldOption) -> None:
    if declared.name_of_false:
        assert SPELLINGS[f"{declared.field}=False"] == declared.name_of_false
    if declared.default is not True:
        assert OPTIONS[declared.field] == declared.option.name


@dataclass(frozen=True)
class Film:
    """A record as somebody might add one."""

    balance: Annotated[
        float | None, number("kelvin"), Option("--white-balance K", "white", theme="Painting")
    ] = None
    stock: Annotated[Literal["day", "night"], Option("--stock", "film", theme="Painting")] = "day"
    rolls: Annotated[
        int, whole(0, 9), Option("--rolls N", "number", theme="Painting", bare=3, least=1)
    ] = 0
    is_fresh: Annotated[bool, Option("--no-fresh", "old", theme="Painting")] = True
    is_pushed: Annotated[bool | None, Option("--push", "pushed", theme="Painting")] = None


def parsed(*words: str) -> dict[str, Any]:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_fields(parser, Film, *options_of(Film))
    return vars(parser.parse_args(words))


def test_without_options_a_record_has_its_defaults() -> None:
    assert Film(**parsed()) == Film()


@pytest.mark.parametrize(
    ("words", "field", "value"),
    [
        ("--white-balance 3200", "balance", 3200.0),
        ("--stock night", "stock", "night"),
        ("--rolls", "rolls", 3),
        ("--rolls 9", "rolls", 9),
        ("--no-fresh", "is_fresh", False),
        ("--push", "is_pushed", True),
        ("--no-push", "is_pushed", False),
    ],
)
def test_an_option_sets_its_field(words: str, field: str, value: Any) -> None:
    assert Film(**parsed(*words.split())) == Film(**{field: value})


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--white-balance 0", "argument --white-balance: '0' is not a number of kelvin > 0"),
        ("--rolls 0", "argument --rolls: '0' is not a whole number >= 1"),
        ("--rolls 10", "argument --rolls: '10' is too large: expected at most 9"),
        ("--stock dusk", "argument --stock: invalid choice: 'dusk'"),
    ],
)
def test_what_the_field_refuses_is_an_error_of_the_option(words: str, message: str) -> None:
    with pytest.raises(argparse.ArgumentError) as refusal:
        parsed(*words.split())
    assert str(refusal.value).startswith(message)


def test_export_names_all_formats_that_there_are() -> None:
    # Help loads no format: their libraries take a second.
    [export] = (command for command in commands() if command.prog.endswith(" export"))
    [to] = (x for x in export._actions if "--to" in x.option_strings)
    names = str(to.metavar).split(",")
    assert {*names} == {*FORMS, "cues"}
    assert all(f"{name}:" in str(to.help) or f"{name}," in str(to.help) for name in names)
