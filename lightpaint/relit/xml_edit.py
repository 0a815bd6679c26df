"""Edits single elements of an XML file, and leaves everything else unchanged.

Positions are byte offsets into the UTF-8 form of the text (see scene/checks/tokens.py); the file is
written in its own encoding.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.scene.checks.tokens import (
    ATTRIBUTE,
    attributes,
    decoded,
    encoding_of,
    line_of,
    markup,
)


@dataclass
class Element:
    """An element of the file: positions of its tags, and its children.

    name: the property's name, converted to snake_case if an old scene has camelCase. start: offset
    of its `<`. inner: offset just after its start tag. end: offset just after the whole element.
    """

    tag: str
    attributes: Mapping[str, str]
    name: str
    start: int
    inner: int
    end: int = -1
    children: list["Element"] = field(default_factory=list)

    @property
    def is_empty_tag(self) -> bool:
        """True if it is written as `<tag/>`."""
        return self.end == self.inner

    def child_named(self, name: str) -> "Element | None":
        """Return the child with that name, in snake_case."""
        return next((c for c in self.children if c.name == name), None)


class XmlFile:
    """The text of an XML file, and the edits to make in it.

    Raises SceneError if the file cannot be read, or if a tag is invalid, not closed, or closed by
    another tag.
    """

    def __init__(self, path: Path) -> None:
        try:
            raw = path.read_bytes()
        except OSError as error:
            raise SceneError("cannot read ", path, f": {error.strerror or error}") from None
        self._encoding = encoding_of(raw)
        try:
            # Like Mitsuba, treat any other bytes as UTF-8, unchanged.
            self.text = (
                raw if self._encoding == "utf-8" else raw.decode(self._encoding).encode("utf-8")
            )
            self.root, self._elements = _parse(self.text)
        except ValueError as error:
            raise SceneError("cannot edit ", path, f": {error}") from None
        self._path = path
        first_break = re.search(rb"\r?\n", self.text)
        self._newline = first_break[0].decode() if first_break else "\n"
        self._edits: list[tuple[int, int, bytes]] = []

    def element_at(self, offset: int) -> Element:
        """Return the element whose `<` is at `offset`."""
        try:
            return self._elements[offset]
        except KeyError:
            raise SceneError(
                f"cannot find the element at byte {offset} of ", self._path, ": has it changed?"
            ) from None

    def place_of(self, element: Element) -> str:
        """Return file and line, for error messages."""
        return f"{self._path}, line {line_of(self.text, element.start)}"

    def replace(self, element: Element, text: str) -> None:
        """Replace `element` by `text`."""
        self._edits.append((element.start, element.end, text.encode()))

    def replace_by_lines(self, element: Element, lines: Sequence[str]) -> None:
        """Replace `element` by `lines`, indented as it is."""
        indent = _indent_before(self.text, element.start)
        self.replace(element, f"{self._newline}{indent}".join(lines))

    def remove(self, element: Element) -> None:
        """Leave out `element`, and its line if nothing else is on it."""
        start, end = element.start, element.end
        line = self.text.rfind(b"\n", 0, start) + 1
        stop = self.text.find(b"\n", end)
        if stop >= 0 and not (self.text[line:start] + self.text[end:stop]).strip():
            start, end = line, stop + 1
        self._edits.append((start, end, b""))

    def set_attribute(self, element: Element, name: str, value: str) -> None:
        """Set an attribute of `element` that it has. value: text without special characters."""
        tag_text = self.text[element.start : element.inner]
        found = re.search(rf"\s{name}\s*=\s*(\"[^\"]*\"|'[^']*')".encode(), tag_text)
        assert found is not None
        start, end = (element.start + at for at in found.span(1))
        self._edits.append((start + 1, end - 1, value.encode()))

    def insert_first(self, element: Element, lines: list[str]) -> None:
        """Insert `lines` before everything else in `element`, each on a separate line."""
        indent = _indent_before(self.text, element.start)
        if element.is_empty_tag:
            # Split <emitter …/> into a start and an end tag.
            slash = self.text.rindex(b"/", element.start, element.end)
            body = "".join(f"{self._newline}{indent}    {line}" for line in lines)
            closing = f">{body}{self._newline}{indent}</{element.tag}>"
            self._edits.append((slash, element.end, closing.encode()))
            return
        inner = f"{indent}    "
        if element.children:
            first = element.children[0].start
            inner_text = self.text[element.inner : first]
            if b"\n" in inner_text:
                inner = _indent_before(self.text, first)
        body = "".join(f"{self._newline}{inner}{line}" for line in lines)
        self._edits.append((element.inner, element.inner, body.encode()))

    def insert_last(self, element: Element, lines: list[str]) -> None:
        """Insert `lines` after everything else in `element`, each on a separate line."""
        if element.is_empty_tag:
            self.insert_first(element, lines)
            return
        close = self.text.rindex(b"</", element.inner, element.end)
        indent = _indent_before(self.text, element.start)
        inner = f"{indent}    "
        if element.children:
            last = element.children[-1].start
            inner = _indent_before(self.text, last) or inner
        place = len(self.text[:close].rstrip())
        body = "".join(f"{self._newline}{inner}{line}" for line in lines)
        if b"\n" not in self.text[place:close]:
            body += f"{self._newline}{indent}"
        self._edits.append((place, place, body.encode()))

    def edited_copy(self, element: Element, name: str) -> str:
        """Return `element`, within which all edits must be, with these applied, and called `name`.

        It and what is in it lose their ids, which the element in the file keeps. name: text
        without special characters.
        """
        text = self._edited_text()
        copied = text[element.start : element.end + len(text) - len(self.text)]
        parts: list[bytes] = []
        end, left_out = 0, {b"id", b"name"}
        for piece in markup(copied):
            if piece["tag"] is not None:
                start, stop = piece.span("attributes")
                named = b' name="%b"' % name.encode() if end == 0 else b""
                parts += [copied[end:start], named, _without(copied[start:stop], left_out)]
                end, left_out = stop, {b"id"}
        return decoded(b"".join([*parts, copied[end:]]))

    def _edited_text(self) -> bytes:
        """Return the whole file with all edits applied, in UTF-8."""
        text = self.text
        # From back to front; replacements before insertions at the same offset.
        for start, end, new in sorted(self._edits, key=lambda e: e[:2], reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def edited(self) -> bytes:
        """Return the whole file with all edits applied, in its own encoding."""
        text = self._edited_text()
        if self._encoding == "utf-8":
            return text
        # Characters missing in the encoding become character references, which XML allows.
        return text.decode("utf-8").encode(self._encoding, "xmlcharrefreplace")


def _parse(text: bytes) -> tuple[Element, dict[int, Element]]:
    """Return (root, all elements by offset), ignoring text after the root.

    Raises ValueError, with the line, if the tags do not match.
    """
    elements: dict[int, Element] = {}
    open_elements: list[Element] = []
    is_old = False
    for piece in markup(text):
        if piece["tag"] is not None:
            values = attributes(piece)
            if not open_elements:
                is_old = _is_old(values.get("version", ""))
            name = values.get("name", "")
            element = Element(
                tag=decoded(piece["tag"]),
                attributes=values,
                name=_snake_case(name) if is_old else name,
                start=piece.start(),
                inner=piece.end(),
            )
            if open_elements:
                open_elements[-1].children.append(element)
            open_elements.append(element)
            elements[element.start] = element
        end = None if piece["end"] is None else decoded(piece["end"])
        if end is not None and (not open_elements or open_elements[-1].tag != end):
            raise ValueError(
                f"line {line_of(text, piece.start())}: </{end}> closes "
                + (_opening(text, open_elements[-1]) if open_elements else "nothing")
            )
        if end is not None or piece["empty"]:
            element = open_elements.pop()
            element.end = piece.end()
            if not open_elements:
                return element, elements
    missing = (
        f"{_opening(text, open_elements[-1])} has no end tag"
        if open_elements
        else "it has no element"
    )
    raise ValueError(missing)


def _is_old(version: str) -> bool:
    """Return whether Mitsuba converts camelCase names to snake_case in a file of this version."""
    major = re.match(r"\s*(\d+)", version)
    return major is not None and int(major[1]) < 2


def _snake_case(name: str) -> str:
    """Return a name in snake_case by Mitsuba's rule: capitals start a word only after a small
    letter.
    """
    return re.sub(r"([a-z])([A-Z]+)", lambda m: f"{m[1]}_{m[2].lower()}", name)


def _opening(text: bytes, element: Element) -> str:
    return f"<{element.tag}> of line {line_of(text, element.start)}"


def _without(attributes_text: bytes, names: Collection[bytes]) -> bytes:
    """Return the attributes of a tag, as they are written, without attributes of these names."""
    return ATTRIBUTE.sub(lambda m: b"" if m[1] in names else m[0], attributes_text)


def _indent_before(text: bytes, offset: int) -> str:
    line = text[text.rfind(b"\n", 0, offset) + 1 : offset]
    return line.decode() if not line.strip() else ""
