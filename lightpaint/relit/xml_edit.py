"""Changing a few elements of an XML file and nothing else.

Positions are byte offsets into the UTF-8 form of the text, byte-order mark included, which
is how Mitsuba's parser counts; the file's own encoding comes back when it is written. What that
parser (pugixml) puts up with is read here too: a bare `&` or `<` in an attribute, `--` in a
comment, white space before the XML declaration.
"""

import codecs
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

from lightpaint.errors import SceneError

_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
    # Without a mark, by the first character, which is `<`.
    b"<\0\0\0": "utf-32-le",
    b"\0\0\0<": "utf-32-be",
    b"<\0": "utf-16-le",
    b"\0<": "utf-16-be",
}

_NAME = rb"[A-Za-z_:\x80-\xff][\w:.\-\x80-\xff]*"
_QUOTED = rb"""(?:"[^"]*"|'[^']*')"""
_COMMENT = rb"<!--.*?-->"
_INSTRUCTION = rb"<\?.*?\?>"  # XML declarations look the same
_CDATA = rb"<!\[CDATA\[.*?\]\]>"
#: With declarations inside, one level deep. `(?>` keeps a broken one from being tried forever.
_DECLARATION = rb"<!(?:%b|[^\"'>])*>" % _QUOTED
_DOCTYPE = rb"<!DOCTYPE(?>%b|%b|%b|%b|[^<>\"'])*>" % (
    _QUOTED,
    _COMMENT,
    _INSTRUCTION,
    _DECLARATION,
)
_END_TAG = rb"</(?P<closed>%b)\s*>" % _NAME
_START_TAG = rb"<(?P<tag>%b)(?P<attributes>(?:\s+%b\s*=\s*%b)*)\s*(?P<empty>/?)>" % (
    _NAME,
    _NAME,
    _QUOTED,
)
_MARKUP = re.compile(
    b"|".join([_COMMENT, _INSTRUCTION, _CDATA, _DOCTYPE, _END_TAG, _START_TAG]), re.DOTALL
)
_ATTRIBUTE = re.compile(rb"(%b)\s*=\s*(%b)" % (_NAME, _QUOTED))
_REFERENCE = re.compile(r"&(?:#x([0-9a-fA-F]+)|#([0-9]+)|(lt|gt|amp|quot|apos));")
_ENTITIES = {"lt": "<", "gt": ">", "amp": "&", "quot": '"', "apos": "'"}


@dataclass
class Element:
    """An element of the file: where its tags are and what stands directly in it.

    name: of the property that it is, in snake_case also where an old scene writes camelCase;
    start: of its `<`; inner: just behind its start tag; end: just behind the whole element.
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
        """Written as `<tag/>`."""
        return self.end == self.inner

    def child_named(self, name: str) -> "Element | None":
        """The child of that name, in snake_case."""
        return next((c for c in self.children if c.name == name), None)


class XmlFile:
    """The text of an XML file, and the edits to be made in it.

    Raises SceneError if a tag cannot be read, lacks its end or is closed by another's.
    """

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        self._encoding = _encoding(raw)
        try:
            # Like Mitsuba, take any other bytes for UTF-8 as they are.
            self.text = (
                raw if self._encoding == "utf-8" else raw.decode(self._encoding).encode("utf-8")
            )
            self.root, self._elements = _parse(self.text)
        except ValueError as error:
            raise SceneError(f"cannot edit {path}: {error}") from None
        self._path = path
        first_break = re.search(rb"\r?\n", self.text)
        self._newline = first_break[0].decode() if first_break else "\n"
        self._edits: list[tuple[int, int, bytes]] = []

    def element_at(self, offset: int) -> Element:
        """The element whose `<` stands at `offset`."""
        try:
            return self._elements[offset]
        except KeyError:
            raise SceneError(
                f"cannot find the light at byte {offset} of {self._path}: has it changed?"
            ) from None

    def place_of(self, element: Element) -> str:
        """File and line, for error messages."""
        return f"{self._path}, line {_line(self.text, element.start)}"

    def replace(self, element: Element, text: str) -> None:
        """Put `text` in the place of `element`."""
        self._edits.append((element.start, element.end, text.encode()))

    def insert_first(self, element: Element, lines: list[str]) -> None:
        """Put `lines` before everything else in `element`, each on a line of its own."""
        indent = _indent_before(self.text, element.start)
        if element.is_empty_tag:
            # <emitter …/> opens up to hold them.
            slash = self.text.rindex(b"/", element.start, element.end)
            body = "".join(f"{self._newline}{indent}    {line}" for line in lines)
            closing = f">{body}{self._newline}{indent}</{element.tag}>"
            self._edits.append((slash, element.end, closing.encode()))
            return
        inner = f"{indent}    "
        if element.children:
            first = element.children[0].start
            between = self.text[element.inner : first]
            if b"\n" in between:
                inner = _indent_before(self.text, first)
        body = "".join(f"{self._newline}{inner}{line}" for line in lines)
        self._edits.append((element.inner, element.inner, body.encode()))

    def edited(self) -> bytes:
        """The whole file with all edits made, in its own encoding."""
        text = self.text
        # From the back, and what is replaced before what is inserted in front of it.
        for start, end, new in sorted(self._edits, key=lambda e: e[:2], reverse=True):
            text = text[:start] + new + text[end:]
        if self._encoding == "utf-8":
            return text
        # What the encoding lacks is written as a character reference, which XML allows.
        return text.decode("utf-8").encode(self._encoding, "xmlcharrefreplace")


def tag(element: str, /, **attributes: str) -> str:
    """An empty element, its attributes escaped.

    Raises SceneError if one holds a `$`, which cannot be escaped.
    """
    for key, value in attributes.items():
        if "$" in value:
            raise SceneError(
                f"cannot write <{element} {key}={value!r}>: Mitsuba reads $ as the start of a "
                "parameter; rename the folder or file, or choose other parameters=..."
            )
    listed = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
    return f"<{element}{listed}/>"


def _encoding(raw: bytes) -> str:
    """As Mitsuba's parser sees it: Latin-1 is the only declaration that it heeds."""
    for mark, name in _MARKS.items():
        if raw.startswith(mark):
            return name
    latin = rb"<\?xml[^>]*?encoding\s*=\s*[\"'](?:iso-8859-1|latin1)[\"']"
    return "latin-1" if re.match(latin, raw, re.IGNORECASE) else "utf-8"


def _parse(text: bytes) -> tuple[Element, dict[int, Element]]:
    """(root, all elements by offset). What comes behind the root is not looked at.

    Raises ValueError, with the line, if the tags do not match.
    """
    elements: dict[int, Element] = {}
    opened: list[Element] = []
    is_old = False
    for markup in _markup(text):
        if markup["tag"] is not None:
            attributes = _attributes(markup["attributes"])
            if not opened:
                is_old = _is_old(attributes.get("version", ""))
            name = attributes.get("name", "")
            element = Element(
                tag=_decoded(markup["tag"]),
                attributes=attributes,
                name=_snake_case(name) if is_old else name,
                start=markup.start(),
                inner=markup.end(),
            )
            if opened:
                opened[-1].children.append(element)
            opened.append(element)
            elements[element.start] = element
        closed = markup["closed"]
        if closed is not None and (not opened or opened[-1].tag != _decoded(closed)):
            raise ValueError(
                f"line {_line(text, markup.start())}: </{_decoded(closed)}> closes "
                + (_opening(text, opened[-1]) if opened else "nothing")
            )
        if closed is not None or markup["empty"]:
            element = opened.pop()
            element.end = markup.end()
            if not opened:
                return element, elements
    missing = f"{_opening(text, opened[-1])} has no end tag" if opened else "it has no element"
    raise ValueError(missing)


def _markup(text: bytes) -> Iterator[re.Match[bytes]]:
    """Everything in angle brackets, in order; a `<` that opens nothing raises ValueError."""
    at = text.find(b"<")
    while at >= 0:
        found = _MARKUP.match(text, at)
        if found is None:
            start = _decoded(text[at : at + 40]).split("\n")[0].strip()
            raise ValueError(f"line {_line(text, at)}: cannot read {start!r}")
        yield found
        at = text.find(b"<", found.end())


def _attributes(text: bytes) -> dict[str, str]:
    """By name, white space made spaces and references resolved; the first of a name counts."""
    attributes: dict[str, str] = {}
    for key, quoted in _ATTRIBUTE.findall(text):
        value = re.sub(r"\r\n|[\r\n\t]", " ", _decoded(quoted[1:-1]))
        attributes.setdefault(_decoded(key), _REFERENCE.sub(_resolved, value))
    return attributes


def _resolved(reference: re.Match[str]) -> str:
    hexadecimal, decimal, entity = reference.groups()
    if entity:
        return _ENTITIES[entity]
    code = int(hexadecimal, 16) if hexadecimal else int(decimal)
    return chr(code) if code <= sys.maxunicode else reference[0]


def _is_old(version: str) -> bool:
    """Whether Mitsuba turns camelCase names into snake_case in a file of that version."""
    major = re.match(r"\s*(\d+)", version)
    return major is not None and int(major[1]) < 2


def _snake_case(name: str) -> str:
    """The rule of Mitsuba: only capitals right behind a small letter begin a word."""
    return re.sub(r"([a-z])([A-Z]+)", lambda m: f"{m[1]}_{m[2].lower()}", name)


def _decoded(text: bytes) -> str:
    return text.decode("utf-8", "replace")


def _line(text: bytes, offset: int) -> int:
    return text.count(b"\n", 0, offset) + 1


def _opening(text: bytes, element: Element) -> str:
    return f"<{element.tag}> of line {_line(text, element.start)}"


def _indent_before(text: bytes, offset: int) -> str:
    line = text[text.rfind(b"\n", 0, offset) + 1 : offset]
    return line.decode() if not line.strip() else ""
