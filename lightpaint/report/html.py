"""Pieces of HTML that several parts of the report are made of. What goes in is escaped before."""

from collections.abc import Iterable
from html import escape
from typing import Any


def table(headings: Iterable[str], rows: Iterable[str]) -> str:
    """A table under its headings."""
    heads = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def row(name: str, *cells: str) -> str:
    """A row of a table, headed by its name."""
    return f'<tr><th scope="row">{name}</th>{"".join(map(cell, cells))}</tr>'


def cell(content: str) -> str:
    """One of a row; what is a cell already stays as it is."""
    return content if content.startswith("<td") else f"<td>{content}</td>"


def share_cell(text: str, share: float) -> str:
    """A share in words, and as a bar."""
    return (
        f'<td class="share"><span>{text}</span><div class="bar" aria-hidden="true">'
        f'<i style="width: {100 * share:.2f}%"></i></div></td>'
    )


def facts(told: Iterable[tuple[str, Any]]) -> str:
    """Terms and what they are, escaped here."""
    return "".join(f"<dt>{escape(k)}</dt><dd>{escape(str(v))}</dd>" for k, v in told)
