"""Pieces of HTML for several parts of the report; callers escape the contents."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS


class Html(str):
    """A text that is HTML already, and is not escaped."""


def table(
    headings: Iterable[str], rows: Sequence[str], *, kind: str = "", shown: int = ROWS_SHOWN
) -> str:
    """Return a table under its headings, the most important rows first; the rest of many is folded.

    kind: its class. It scrolls if it is wider than the page.
    """
    cells = "".join(f'<th scope="col">{heading}</th>' for heading in headings)

    def part(rows: Iterable[str]) -> str:
        return (
            f'<div class="scroll" tabindex="0"><table class="{kind}"><thead><tr>{cells}</tr>'
            f"</thead><tbody>{''.join(rows)}</tbody></table></div>"
        )

    if len(rows) <= shown + SPARE_ROWS:
        return part(rows)
    return part(rows[:shown]) + fold(f"{len(rows) - shown} more", part(rows[shown:]))


def fold(summary: str, content: str) -> str:
    """Return content that opens on demand, or if the browser's search finds something in it."""
    return f'<details class="more"><summary>{summary}</summary>{content}</details>'


def breakable_name(name: str) -> Html:
    """Return a name, escaped, that may break after joining characters and in very long words."""
    words = re.findall(r"[^_./-]{1,14}[_./-]*|[_./-]+", name, re.DOTALL)
    return Html("<wbr>".join(map(escape, words)))


def name_list(names: Sequence[str]) -> Html:
    """Return names with commas, escaped; the rest of many is folded."""
    first, fold_html = names, ""
    if len(names) > ROWS_SHOWN + SPARE_ROWS:
        first, further_names = names[:ROWS_SHOWN], names[ROWS_SHOWN:]
        fold_html = fold(
            f"and {len(further_names)} more", ", ".join(map(breakable_name, further_names))
        )
    return Html(", ".join(map(breakable_name, first)) + fold_html)


def row(name: str, *cells: str) -> str:
    """Return a row of a table, headed by its name."""
    return f'<tr><th scope="row">{name}</th>{"".join(map(cell, cells))}</tr>'


def cell(content: str) -> str:
    """Return a cell of a row; return a cell unchanged."""
    return content if content.startswith("<td") else f"<td>{content}</td>"


def share_cell(text: str, share: float) -> str:
    """Return a cell with a share in words, and as a bar."""
    return (
        f'<td class="share"><span>{text}</span><div class="bar" aria-hidden="true">'
        f'<i style="width: {100 * share:.2f}%"></i></div></td>'
    )


def facts(entries: Iterable[tuple[str, Any]]) -> str:
    """Return terms with their values, which are escaped here unless they are HTML."""
    texts = ((k, v if isinstance(v, Html) else escape(str(v))) for k, v in entries)
    return "".join(f"<dt>{escape(k)}</dt><dd>{v}</dd>" for k, v in texts)
