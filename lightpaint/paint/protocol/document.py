"""The tables of docs/protocol.md, generated from the dataclasses.

    python -m lightpaint.paint.protocol.document docs/protocol.md

puts them into the document between its marks.
"""

import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, get_origin, get_type_hints

import numpy as np

from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.protocol import (
    Event,
    Request,
    events,
    light_requests,
    message_parts,
    painting_requests,
    requests,
    task_events,
)
from lightpaint.paint.protocol.typescript import field_types


def sections() -> dict[str, str]:
    """Return the generated parts of the document by the names of their marks."""
    records = [record for record in vars(message_parts).values() if _is_part(record)]
    return {
        "requests": "\n".join(_entry(record.kind, record) for record in _in_order(Request.kinds)),
        "events": "\n".join(_entry(record.kind, record) for record in _in_order(Event.kinds)),
        "parts": "\n".join(_entry(record.__name__, record) for record in records),
    }


def _in_order(kinds: Mapping[str, type[Any]]) -> list[type[Any]]:
    """Return messages module by module, those of every client first."""
    modules = (requests, painting_requests, light_requests, events, task_events)
    names = [module.__name__ for module in modules]
    return sorted(kinds.values(), key=lambda message: names.index(message.__module__))


def replace_sections(text: str) -> str:
    """Return a document with its generated parts replaced."""
    for name, section in sections().items():
        pattern = rf"<!-- {name} -->\n.*?<!-- end of {name} -->"
        head, tail = re.split(pattern, text, flags=re.DOTALL)
        text = f"{head}<!-- {name} -->\n\n{section}\n<!-- end of {name} -->{tail}"
    return text


def _is_part(value: Any) -> bool:
    names = (message_parts.__name__, message_parts.__name__, Layer.__module__)
    return getattr(value, "__module__", "") in names and isinstance(value, type)


def _entry(name: str, record: type[Any]) -> str:
    """Return a heading, the docstring, and a table of the fields."""
    paragraphs = (inspect.getdoc(record) or "").split("\n\n")
    lines = [f"### `{name}`", *(" ".join(paragraph.split("\n")) for paragraph in paragraphs)]
    types = [(field, _nested_kind(kind).replace("|", "\\|")) for field, kind in field_types(record)]
    rows = [f"| `{field}` | `{kind}` |" for field, kind in types]
    if rows:
        lines.append("\n".join(["| field | type |", "|---|---|", *rows]))
    hints = get_type_hints(record)
    arrays = [x.name for x in fields(record) if get_origin(hints[x.name]) is np.ndarray]
    buffers = [
        f"`{x}` {description}" for x, description in getattr(record, "request_buffers", {}).items()
    ]
    if arrays or buffers:
        lines.append("Buffers: " + ", ".join(buffers or [f"`{x}`" for x in arrays]) + ".")
    return "\n\n".join(lines) + "\n"


def _nested_kind(kind: str) -> str:
    """Return a type in which a message within another one is called by its kind."""
    for event in Event.kinds.values():
        kind = kind.replace(f"Omit<{event.__name__}, 'kind' | 'arrays'>", event.kind)
    return kind


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(replace_sections(file.read_text(encoding="utf-8")), encoding="utf-8")
