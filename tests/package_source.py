"""Syntax trees of a module's source, for tests of how the package is written."""

import ast
from collections.abc import Iterator
from pathlib import Path


def tree_of(file: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(file.read_text(encoding="utf-8"))


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield a tree and all statements in it, with what catches errors, as they stand in its source.

    Expressions are left out: `ast.walk` takes four times as long for a dozen of them a statement.
    """
    remaining = [tree]
    while remaining:
        node = remaining.pop()
        yield node
        for block in ("cases", "finalbody", "orelse", "handlers", "body"):
            inner = getattr(node, block, ())
            if isinstance(inner, list):  # and not the expression of a lambda
                remaining += reversed(inner)
