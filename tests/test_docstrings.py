"""Docstrings say what a function does, and what a class, a property or a module is."""

import ast
from collections.abc import Iterator
from pathlib import Path

import lightpaint

PACKAGE = Path(lightpaint.__file__).parent

#: Words with which a docstring becomes a riddle.
FORBIDDEN = frozenset(
    [
        "What",
        "Of",
        "Who",
        "Whose",
        "Whether",
        "How",
        "Where",
        "Which",
        "That",
        "Those",
        "From",
        "With",
        "By",
        "Let",
        "One",
        "Some",
        "As",
        "At",
    ]
)

#: Words that name a thing, with which the docstring of a function does not begin.
ARTICLES = frozenset(["The", "A", "An", "All", "Its", "It", "This", "These"])


def docstrings(file: Path) -> Iterator[tuple[str, str, bool]]:
    """Yield name, first word and whether it is that of a function, for each docstring."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            continue
        if text := ast.get_docstring(node):
            name = "module" if isinstance(node, ast.Module) else node.name
            yield name, text.split()[0].strip(".,:;"), _is_function(node)


def _is_function(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and not any(
        "property" in ast.unparse(decorator) for decorator in node.decorator_list
    )


def faults(file: Path) -> list[tuple[str, str]]:
    """Return names and first words that break the rule."""
    return [
        (name, word)
        for name, word, is_function in docstrings(file)
        if word in FORBIDDEN or (is_function and word in ARTICLES)
    ]


def test_docstrings_begin_with_a_verb_or_a_noun() -> None:
    files = sorted(PACKAGE.rglob("*.py"))
    assert files
    by_file = {str(file.relative_to(PACKAGE)): faults(file) for file in files}
    assert {name: words for name, words in by_file.items() if words} == {}


def test_the_rule_finds_what_it_forbids(tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text(
        'def f():\n    """What it is."""\n\n\ndef g():\n    """The sum."""\n\n\n'
        'class C:\n    """The class."""\n\n    @property\n    def p(self):\n        """How."""\n',
        encoding="utf-8",
    )
    assert faults(file) == [("f", "What"), ("g", "The"), ("p", "How")]
