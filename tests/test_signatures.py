"""What public functions have in common: whoever knows one knows the others."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import lightpaint

PACKAGE = Path(lightpaint.__file__).parent

#: What a place to be written to is called.
PLACES = ("path", "folder")


def _writers() -> Iterator[tuple[str, list[str]]]:
    """Name and positional parameters of every function that writes something."""
    # What the command line writes goes to the terminal.
    for file in sorted(set(PACKAGE.rglob("*.py")) - set(PACKAGE.glob("cli/**/*.py"))):
        source = file.read_text(encoding="utf-8")
        if "\ndef write_" not in source:
            continue  # every worker of the tests comes by here
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("write_"):
                place = f"{file.relative_to(PACKAGE)}:{node.name}"
                yield place, [argument.arg for argument in node.args.args]


def test_there_are_writers_and_the_public_ones_are_among_them() -> None:
    names = {place.partition(":")[2] for place, _ in _writers()}
    assert {name for name in lightpaint.__all__ if name.startswith("write_")} <= names
    assert len(names) > 10


@pytest.mark.parametrize(("place", "parameters"), [*_writers()], ids=str)
def test_the_place_comes_first(place: str, parameters: list[str]) -> None:
    assert parameters[0] in PLACES
    assert not set(PLACES) & set(parameters[1:])
