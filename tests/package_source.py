"""Syntax trees of a module's source, for tests of how the package is written."""

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path


def tree_of(file: Path) -> ast.Module:
    """Return the syntax tree of a file, which is the same object as long as its text is."""
    return _parsed(file.read_text(encoding="utf-8"))


@cache
def _parsed(text: str) -> ast.Module:
    """Parse it once for all tests, without looking for garbage, of which there is none.

    Nodes of the package, of which there are millions, would be gone through again and again.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        return ast.parse(text)
    finally:
        if was_enabled:
            gc.enable()


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
