"""No code reads the sentences of our own errors, and none makes an error of another's text."""

import ast
from collections.abc import Iterator
from pathlib import Path

from package_source import statements, tree_of

import lightpaint
from lightpaint import errors

PACKAGE = Path(lightpaint.__file__).parent

#: Names of our errors, and of tuples of them.
OURS = {name for name, value in vars(errors).items() if name.endswith(("Error", "_ERRORS"))}


def parents_in(tree: ast.AST) -> dict[ast.AST, ast.AST]:
    return {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}


def _is_ours(handler: ast.ExceptHandler) -> bool:
    """Whether a handler catches nothing but our errors."""
    caught = handler.type
    kinds = caught.elts if isinstance(caught, ast.Tuple) else [caught]
    return all(isinstance(kind, ast.Name) and kind.id in OURS for kind in kinds)


def readings(file: Path) -> Iterator[str]:
    """Places where a module searches, cuts or copies the text of an error of ours."""
    handlers = (x for x in statements(tree_of(file)) if isinstance(x, ast.ExceptHandler))
    for handler in filter(_is_ours, handlers):
        parents = parents_in(handler)
        for node in ast.walk(handler):
            if not (isinstance(node, ast.Name) and node.id == handler.name):
                continue
            use = parents[node]
            is_text = isinstance(use, ast.Call) and getattr(use.func, "id", "") == "str"
            if isinstance(use, ast.FormattedValue):
                use, is_text = parents[use], True
            if not is_text:
                continue
            # Into words for people, such as `Notice(text=str(error))`, it may go.
            reader = parents[use]
            copies = isinstance(reader, ast.Call) and ast.unparse(reader.func).endswith("Error")
            if copies or not isinstance(reader, ast.Call | ast.keyword | ast.Return):
                yield f"{file.relative_to(PACKAGE)}:{node.lineno}: {ast.unparse(reader)}"


def test_no_code_reads_our_errors() -> None:
    files = [x for x in PACKAGE.rglob("*.py") if "blender_addon" not in x.parts]
    assert [found for file in sorted(files) for found in readings(file)] == []
