"""Pieces of HTML that several parts of the report are made of. What goes in is escaped before."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


class Html(str):
    """What is HTML already, where text is escaped."""


#: Rows of a table, or names of a list, that are shown of many, and how many more are not worth a
#: fold.
SHOWN, SPARE = 10, 3


def table(
    headings: Iterable[str], rows: Sequence[str], *, kind: str = "", shown: int = SHOWN
) -> str:
    """A table under its headings, those rows first that matter most; of many the rest is folded.

    kind: its class. It scrolls by itself where it is wider than the page.
    """
    heads = "".join(f'<th scope="col">{heading}</th>' for heading in headings)

    def part(rows: Iterable[str]) -> str:
        return (
            f'<div class="scroll" tabindex="0"><table class="{kind}"><thead><tr>{heads}</tr>'
            f"</thead><tbody>{''.join(rows)}</tbody></table></div>"
        )

    if len(rows) <= shown + SPARE:
        return part(rows)
    return part(rows[:shown]) + folded(f"{len(rows) - shown} more", part(rows[shown:]))


def folded(summary: str, content: str) -> str:
    """Content that opens if it is asked for, or if the browser's search finds something in it."""
    return f'<details class="more"><summary>{summary}</summary>{content}</details>'


def name_of(name: str) -> Html:
    """A name, escaped here, that may break behind what joins its words, and in very long ones."""
    words = re.findall(r"[^_./-]{1,14}[_./-]*|[_./-]+", name, re.DOTALL)
    return Html("<wbr>".join(map(escape, words)))


def listed(names: Sequence[str]) -> Html:
    """Names with commas, escaped here; of many the rest is folded."""
    first, more = names, ""
    if len(names) > SHOWN + SPARE:
        first, rest = names[:SHOWN], names[SHOWN:]
        more = folded(f"and {len(rest)} more", ", ".join(map(name_of, rest)))
    return Html(", ".join(map(name_of, first)) + more)


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
    """Terms and what they are, escaped here unless it is HTML."""
    texts = ((k, v if isinstance(v, Html) else escape(str(v))) for k, v in told)
    return "".join(f"<dt>{escape(k)}</dt><dd>{v}</dd>" for k, v in texts)
