"""Docstrings say what a function does, and what a class, a property or a module is."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from package_source import statements, tree_of

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
    for node in statements(tree_of(file)):
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


#: Functions whose docstrings describe columns of a table that they return, and a class that has
#: fields of another one.
DESCRIBE_OTHERS = frozenset(["to_dataframe", "to_xarray", "Settings"])

#: Words before a colon that describe no parameter, each in one place.
NO_PARAMETERS = frozenset([("additions", "help"), ("threads", "unknown")])

#: `name:` or `name, other:` at the beginning of a line or of a sentence.
DESCRIBED = re.compile(r"(?:^|\. )\s*((?:\*{0,2}[a-z_]\w*, )*\*{0,2}[a-z_]\w*): ", re.MULTILINE)


def described(node: ast.ClassDef | ast.FunctionDef) -> set[str]:
    """Return the names that a docstring describes as parameters or attributes."""
    parameters = DESCRIBED.findall(ast.get_docstring(node) or "")
    return {name.strip("*") for names in parameters for name in names.split(", ")}


def names_in(node: ast.ClassDef | ast.FunctionDef) -> set[str]:
    """Return the parameters of a function, or all that a class defines."""
    tree: ast.AST = node.args if isinstance(node, ast.FunctionDef) else node
    names = set()
    for part in ast.walk(tree):
        match part:
            case ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.Attribute(attr=name):
                names.add(name)
            case ast.AnnAssign(target=ast.Name(id=name)):
                names.add(name)
    return names


def stale_parameters(file: Path) -> list[tuple[str, str]]:
    """Return functions and classes with parameters that only their docstrings have."""
    return [
        (node.name, name)
        for node in statements(tree_of(file))
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name not in DESCRIBE_OTHERS
        if (described_names := described(node))
        for name in sorted(described_names - names_in(node))
        if not {(node.name, name), (file.stem, name)} & NO_PARAMETERS
    ]


def test_described_parameters_are_there() -> None:
    """A parameter that was renamed keeps no description under its old name."""
    by_file = {
        str(file.relative_to(PACKAGE)): stale_parameters(file) for file in PACKAGE.rglob("*.py")
    }
    assert {name: stale for name, stale in by_file.items() if stale} == {}


def test_a_stale_parameter_is_found(tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text(
        'def f(new, other):\n    """Add. old, other: two numbers. new: a third."""\n',
        encoding="utf-8",
    )
    assert stale_parameters(file) == [("f", "old")]
