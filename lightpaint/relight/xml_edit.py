"""Changing a few elements of an XML file and nothing else.

Positions are byte offsets into the UTF-8 form of the text, byte-order mark included, which
is how Mitsuba's parser counts; the file's own encoding comes back when it is written.
"""

import codecs
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from lightpaint.errors import SceneError

_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}


@dataclass
class Element:
    """An element of the file: where its tags are and what stands directly in it.

    start: of its `<`; inner: just behind its start tag; end: just behind the whole element.
    """

    tag: str
    attributes: Mapping[str, str]
    start: int
    inner: int
    end: int = -1
    children: list["Element"] = field(default_factory=list)

    @property
    def is_empty_tag(self) -> bool:
        """Written as `<tag/>`."""
        return self.end == self.inner

    def child_named(self, name: str) -> "Element | None":
        """The child whose `name` attribute says so."""
        return next((c for c in self.children if c.attributes.get("name") == name), None)


class XmlFile:
    """The text of an XML file, and the edits to be made in it."""

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        self._encoding = _encoding(raw)
        try:
            self.text = raw.decode(self._encoding).encode("utf-8")
            self.root, self._elements = _parse(self.text)
        except (UnicodeDecodeError, LookupError, expat.ExpatError) as error:
            raise SceneError(f"cannot edit {path} ({self._encoding}): {error}") from None
        self._path = path
        self._edits: list[tuple[int, int, bytes]] = []

    def element_at(self, offset: int) -> Element:
        """The element whose `<` stands at `offset`."""
        try:
            return self._elements[offset]
        except KeyError:
            raise SceneError(
                f"cannot find the light at byte {offset} of {self._path}: has it changed?"
            ) from None

    def replace(self, element: Element, text: str) -> None:
        """Put `text` in the place of `element`."""
        self._edits.append((element.start, element.end, text.encode()))

    def insert_first(self, element: Element, lines: list[str]) -> None:
        """Put `lines` before everything else in `element`, each on a line of its own."""
        indent = _indent_before(self.text, element.start)
        if element.is_empty_tag:
            # <emitter …/> opens up to hold them.
            slash = self.text.rindex(b"/", element.start, element.end)
            body = "".join(f"\n{indent}    {line}" for line in lines)
            closing = f">{body}\n{indent}</{element.tag}>"
            self._edits.append((slash, element.end, closing.encode()))
            return
        inner = f"{indent}    "
        if element.children:
            first = element.children[0].start
            between = self.text[element.inner : first]
            if b"\n" in between:
                inner = _indent_before(self.text, first)
        body = "".join(f"\n{inner}{line}" for line in lines)
        self._edits.append((element.inner, element.inner, body.encode()))

    def edited(self) -> bytes:
        """The whole file with all edits made, in its own encoding."""
        text = self.text
        for start, end, new in sorted(self._edits, key=lambda e: e[0], reverse=True):
            text = text[:start] + new + text[end:]
        # What the encoding lacks is written as a character reference, which XML allows.
        return text.decode("utf-8").encode(self._encoding, "xmlcharrefreplace")


def tag(element: str, /, **attributes: str) -> str:
    """An empty element, its attributes escaped."""
    listed = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
    return f"<{element}{listed}/>"


def _encoding(raw: bytes) -> str:
    for mark, name in _MARKS.items():
        if raw.startswith(mark):
            return name
    declared = re.match(rb"\s*<\?xml[^>]*encoding\s*=\s*[\"']([\w.-]+)", raw)
    return declared[1].decode("ascii").lower() if declared else "utf-8"


def _parse(text: bytes) -> tuple[Element, dict[int, Element]]:
    parser = expat.ParserCreate(encoding="utf-8")
    stack: list[Element] = []
    elements: dict[int, Element] = {}

    def start(name: str, attributes: Any) -> None:
        at = parser.CurrentByteIndex
        element = Element(name, dict(attributes), at, _behind_tag(text, at))
        if stack:
            stack[-1].children.append(element)
        stack.append(element)
        elements[at] = element

    def end(_name: str) -> None:
        element = stack.pop()
        if text[element.inner - 2 : element.inner] == b"/>":
            element.end = element.inner
        else:
            element.end = _behind_tag(text, parser.CurrentByteIndex)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(text, True)
    return elements[min(elements)], elements


def _behind_tag(text: bytes, start: int) -> int:
    """Where the tag that opens at `start` has ended; `>` may stand inside quotes."""
    quoted = re.compile(rb"""<(?:[^"'>]|"[^"]*"|'[^']*')*>""")
    found = quoted.match(text, start)
    if found is None:
        raise expat.ExpatError(f"tag at byte {start} does not end")
    return found.end()


def _indent_before(text: bytes, offset: int) -> str:
    line = text[text.rfind(b"\n", 0, offset) + 1 : offset]
    return line.decode() if not line.strip() else ""
