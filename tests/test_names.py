"""Names: a class or a module is called like no other, so that a search finds one thing."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import lightpaint

HERE = Path(lightpaint.__file__).parent

#: Names that two classes have, each with its reason.
CLASSES_TWICE = {"Planes": "those of a path while it is traced, and those of a basis"}

#: Names that two modules have, each with its reason.
MODULES_TWICE = {
    "lights": "modules of cli/commands/ are called like the commands that people type",
    "solve": "modules of cli/commands/ are called like the commands that people type",
}


def _classes() -> Iterator[tuple[str, str]]:
    for path in HERE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                yield node.name, str(path.relative_to(HERE))


def _modules() -> Iterator[tuple[str, str]]:
    for path in HERE.rglob("*.py"):
        if path.name != "__init__.py":
            yield path.stem, str(path.relative_to(HERE))


def _twice(named: Iterator[tuple[str, str]]) -> dict[str, list[str]]:
    places = defaultdict(list)
    for name, place in named:
        places[name].append(place)
    return {name: its for name, its in places.items() if len(its) > 1}


def test_no_two_classes_have_one_name() -> None:
    assert _twice(_classes()).keys() <= CLASSES_TWICE.keys()


def test_no_two_modules_have_one_name() -> None:
    assert _twice(_modules()).keys() == MODULES_TWICE.keys()
