"""Names: a class or a module is called like no other, so that a search finds one thing."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from package_source import statements, tree_of

import lightpaint

HERE = Path(lightpaint.__file__).parent

#: Names that two classes have, each with its reason.
CLASSES_TWICE: dict[str, str] = {}

#: Names that two modules have, each with its reason.
MODULES_TWICE: dict[str, str] = {}


def _classes() -> Iterator[tuple[str, str]]:
    for path in HERE.rglob("*.py"):
        for node in statements(tree_of(path)):
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


#: A docstring or a comment, in the first group; or another string, in which neither begins.
LEXEME = re.compile(
    r'''([bfr]{0,2}"""(?:[^\\]|\\.)*?"""|\#[^\n]*)|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*\'''',
    re.DOTALL,
)


def _names_in_backticks(text: str) -> Iterator[str]:
    """Names with an underscore, a dot or a capital, which are not words of a language."""
    for name in re.findall(r"`([A-Za-z_]\w*(?:\.\w+)*)(?:\(\))?`", text):
        if ("_" in name or "." in name or name[0].isupper()) and not FOREIGN.fullmatch(name):
            yield name


def _mentions_and_code(source: str) -> tuple[list[str], str]:
    """Return names in docstrings and comments, and the source without these.

    Python's tokenizer would take thirty times as long.
    """
    mentions: list[str] = []

    def without_prose(lexeme: re.Match[str]) -> str:
        mentions.extend(_names_in_backticks(lexeme[1] or ""))
        return " " if lexeme[1] else lexeme[0]

    code = LEXEME.sub(without_prose, source)
    return mentions, code


def test_doors_list_each_name_once_and_modules_in_order() -> None:
    doors = 0
    for path in HERE.rglob("*/__init__.py"):
        if "lazy_names(__name__)" not in path.read_text("utf-8"):
            continue
        imports = [x for x in statements(tree_of(path)) if isinstance(x, ast.ImportFrom)]
        own = f"lightpaint.{'.'.join(path.parent.relative_to(HERE).parts)}."
        inner = sorted((x.lineno, x) for x in imports if str(x.module).startswith(own))
        homes = [str(node.module) for _, node in inner]
        names = [alias.name for _, node in inner for alias in node.names]
        assert homes == sorted(set(homes)), path
        assert len(names) == len(set(names)), path
        # A module that is imported would stand for the function of its name.
        assert not {x.stem for x in path.parent.glob("*.py")} & set(names), path
        doors += 1
    assert doors >= 18


def test_prose_is_told_from_code() -> None:
    source = """f("#`no_a`", '`no_b`')  # `see_a` "`see_b`\nr'\\'#`no_c`'\n\"""of `see_c`\"""x_y"""
    mentions, code = _mentions_and_code(source)
    assert mentions == ["see_a", "see_b", "see_c"]
    assert re.findall(r"\w+_\w", code) == ["no_a", "no_b", "no_c", "x_y"]


def test_names_in_docstrings_and_comments_are_there() -> None:
    """Renamed without its mentions, a thing is looked for in vain."""
    known_names: set[str] = set()
    mentions = []
    for path in HERE.rglob("*.py"):
        names, code = _mentions_and_code(path.read_text(encoding="utf-8"))
        mentions += [(name, path.name) for name in names]
        known_names.update(re.findall(r"\w+", code))
    missing = {
        (name, file) for name, file in mentions if name.rpartition(".")[2] not in known_names
    }
    assert not missing
