"""The reference of the painter's messages, written from their dataclasses.

A docstring says what a message is, and then, as `name: meaning.`, what its fields are.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_type_hints

from docstring_fields import described_fields

from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.protocol import (
    Event,
    Request,
    answer_parts,
    events,
    light_requests,
    message_parts,
    painting_requests,
    requests,
    task_events,
)
from lightpaint.paint.protocol.typescript import field_types, is_array


@dataclass(frozen=True)
class Entry:
    """A message, or a type within messages: its name in JSON, and what its docstring says of it.

    meanings: of its fields, by name.
    """

    name: str
    record: type[Any]
    text: tuple[str, ...]
    meanings: Mapping[str, str]

    @property
    def summary(self) -> str:
        """The first sentence."""
        return re.split(r"(?<=\.) ", self.text[0])[0]


#: Title, introduction and sections of each page: titles of these, and the modules that they show.
PAGES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "requests": (
        "What clients send",
        "Fields marked `?` may be left out.",
        {"Session": requests, "Painting and looks": painting_requests, "Lights": light_requests},
    ),
    "events": (
        "What clients receive",
        "Fields marked `?` are absent if there is nothing to say. A message's kind used as a type"
        " stands for that message's fields.",
        {"State and answers": events, "Tasks": task_events},
    ),
    "types": (
        "Types within messages",
        "Fields marked `?` are absent, or may be left out.",
        {"Scene, session and layers": message_parts, "Answers": answer_parts},
    ),
}


def write_messages(folder: Path) -> None:
    """Write the pages of all messages into a new folder, and one that lists them."""
    folder.mkdir(parents=True)
    pages = {page: _sections(page) for page in PAGES}
    places = {x.name: page for page, some in pages.items() for one in some.values() for x in one}
    index = [_INDEX]
    for page, (title, introduction, _) in PAGES.items():
        parts = [f"# {title}", introduction]
        index += [f"## {title}", "| | |\n|---|---|"]
        for section, entries in pages[page].items():
            parts.append(f"## {section}")
            for entry in entries:
                parts += _entry(entry, places, page)
                index[-1] += f"\n| [`{entry.name}`]({_place(entry.name, page)}) | {entry.summary} |"
        text = "\n\n".join(parts)
        (folder / f"{page}.md").write_text(text + "\n", encoding="utf-8")
    index.append("```{toctree}\n:hidden:\n\n" + "\n".join(PAGES) + "\n```")
    (folder / "index.md").write_text("\n\n".join(index) + "\n", encoding="utf-8")


_INDEX = """# Messages of the painter

These pages come from the dataclasses of `lightpaint/paint/protocol/`. [The
protocol](../protocol.md) says how messages travel; the [JSON schemas](../schemas/index.rst)
have the same for programs."""


def _sections(page: str) -> dict[str, list[Entry]]:
    """Return the entries of a page by section, in the order of their modules."""
    modules = PAGES[page][2]
    if page == "types":
        return {
            section: [_read(x.__name__, x) for x in vars(module).values() if _is_part(x, module)]
            for section, module in modules.items()
        }
    kinds = (Request if page == "requests" else Event).kinds
    return {
        section: [_read(k, x) for k, x in kinds.items() if x.__module__ == module.__name__]
        for section, module in modules.items()
    }


def _is_part(value: Any, module: Any) -> bool:
    home = getattr(value, "__module__", "")
    return isinstance(value, type) and home in (module.__name__, Layer.__module__)


def _read(name: str, record: type[Any]) -> Entry:
    """Return an entry, with meanings of fields that it has from a base."""
    text, meanings = described_fields(record)
    for base in record.__mro__[1:]:
        meanings = {**described_fields(base)[1], **meanings}
    return Entry(name, record, tuple(text), meanings)


def _entry(entry: Entry, places: Mapping[str, str], page: str) -> list[str]:
    """Return a heading, the text, and a table of the fields."""
    hints = get_type_hints(entry.record)
    rows = [(f"`{x}`", _linked(kind, places, page), x) for x, kind in _types(entry.record)]
    for field in fields(entry.record):
        if is_array(hints[field.name]):
            rows.append((f"`{field.name}`", "array", field.name))
    buffers: Mapping[str, str] = getattr(entry.record, "request_buffers", {})
    rows += [(f"`{x}`", f"array {meaning}", "") for x, meaning in buffers.items()]
    named = {**places, entry.name: ""}
    lines = [f"### `{entry.name}`", *(_mentions(x, named, page) for x in entry.text)]
    if getattr(entry.record, "is_observed", False):
        lines.append("Observers receive it, too.")
    if rows:
        table = ["| field | type | meaning |", "|---|---|---|"]
        for name, kind, field_name in rows:
            meaning = _mentions(entry.meanings.get(field_name.rstrip("?"), ""), named, page)
            table.append(f"| {name} | {kind} | {meaning.replace('|', chr(92) + '|')} |")
        lines.append("\n".join(table))
    return lines


def _types(record: type[Any]) -> list[tuple[str, str]]:
    """Return fields and their types, of which a nested message is called by its kind."""
    return [(name, _nested_kind(kind)) for name, kind in field_types(record)]


def _nested_kind(kind: str) -> str:
    for event in Event.kinds.values():
        kind = kind.replace(f"Omit<{event.__name__}, 'kind' | 'arrays'>", event.kind)
    return kind


def _linked(kind: str, places: Mapping[str, str], page: str) -> str:
    """Return a type as code, with a link to the entry that it contains."""
    code = f"`{kind}`".replace("|", "\\|")
    names = [x for x in re.findall(r"\w+", kind) if x in places]
    return f"[{code}]({_place(names[0], places[names[0]], page)})" if names else code


def _mentions(text: str, places: Mapping[str, str], page: str) -> str:
    """Return a text in which other messages that it names are links."""

    def link(match: re.Match[str]) -> str:
        home = places.get(match[1])
        return f"[{match[0]}]({_place(match[1], home, page)})" if home else match[0]

    return re.sub(r"`(\w+)`", link, text)


def _place(name: str, home: str, page: str = "") -> str:
    """Return the address of an entry, from a page."""
    return f"{'' if home == page else home + '.md'}#{name.lower()}"
