"""Names: a class or a module is called like no other, so that a search finds one thing."""

import ast
import io
import re
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import lightpaint

HERE = Path(lightpaint.__file__).parent

#: Names that two classes have, each with its reason.
CLASSES_TWICE: dict[str, str] = {}

#: Names that two modules have, each with its reason.
MODULES_TWICE: dict[str, str] = {}


def _classes() -> Iterator[tuple[str, str]]:
    for path in HERE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                yield node.name, str(path.relative_to(HERE))


def _modules() -> Iterator[tuple[str, str]]:
    for path in HERE.rglob("*.py"):
        if path.name != "__init__.py":
            yield path.stem, str(path.relative_to(HERE))


def _twice(names: Iterator[tuple[str, str]]) -> dict[str, list[str]]:
    places = defaultdict(list)
    for name, place in names:
        places[name].append(place)
    return {name: files for name, files in places.items() if len(files) > 1}


def test_no_two_classes_have_one_name() -> None:
    assert _twice(_classes()).keys() == CLASSES_TWICE.keys()


def test_no_two_modules_have_one_name() -> None:
    assert _twice(_modules()).keys() == MODULES_TWICE.keys()


#: Names in backticks that are none of the code: files, processors and examples.
FOREIGN = re.compile(r"Haswell|\w+_\d+|statue_head|ViewLayer\.\w+|shot_key_v1")


def _names_in_backticks(token: tokenize.TokenInfo) -> Iterator[str]:
    """Names with an underscore, a dot or a capital, which are not words of a language."""
    for name in re.findall(r"`([A-Za-z_]\w*(?:\.\w+)*)(?:\(\))?`", token.string):
        if ("_" in name or "." in name or name[0].isupper()) and not FOREIGN.fullmatch(name):
            yield name


def test_names_in_docstrings_and_comments_are_there() -> None:
    """Renamed without its mentions, a thing is looked for in vain."""
    known_names: Counter[str] = Counter()
    mentions = []
    for path in HERE.rglob("*.py"):
        source = io.StringIO(path.read_text(encoding="utf-8"))
        for token in tokenize.generate_tokens(source.readline):
            is_docstring = token.type == tokenize.STRING and token.string.endswith('"""')
            if is_docstring or token.type == tokenize.COMMENT:
                mentions += [(name, path.name) for name in _names_in_backticks(token)]
            else:
                known_names.update(re.findall(r"\w+", token.string))
    missing = {(name, file) for name, file in mentions if not known_names[name.rpartition(".")[2]]}
    assert not missing
