"""A tokenizer for XML files: tags, comments, declarations and their content.

It accepts everything that Mitsuba's parser (pugixml) tolerates: a bare `&` or `<` in an attribute,
`--` in a comment, white space before the XML declaration. Positions are byte offsets into the UTF-8
text including a byte-order mark, as that parser counts them.
"""

import codecs
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.sentences import Hint

_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
    # Without a byte-order mark, detected by the first character, `<`.
    b"<\0\0\0": "utf-32-le",
    b"\0\0\0<": "utf-32-be",
    b"<\0": "utf-16-le",
    b"\0<": "utf-16-be",
}
_LATIN = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"'](?:iso-8859-1|latin1)[\"']", re.IGNORECASE)

# Possessive quantifiers (`*+`), so that invalid text fails at once instead of backtracking forever.
_NAME = rb"[A-Za-z_:\x80-\xff][\w:.\-\x80-\xff]*+"
_QUOTED = rb"""(?:"[^"]*+"|'[^']*+')"""
_SKIPPED = rb"<!--(?s:.*?)-->|<\?(?s:.*?)\?>"  # XML declarations look like processing instructions
#: Declarations inside a document type declaration, one level deep.
_DECLARATION = rb"<!(?:%b|[^\"'>])*+>" % _QUOTED
_MARKUP = re.compile(
    rb"%b|<!\[CDATA\[(?s:.*?)\]\]>"
    rb"|<!DOCTYPE(?>%b|%b|%b|[^<>\"'])*+>"
    rb"|</(?P<end>%b)\s*+>"
    rb"|<(?P<tag>%b)(?P<attributes>(?>(?:\s++%b\s*+=\s*+%b)*))\s*+(?P<empty>/?)>"
    % (_SKIPPED, _QUOTED, _SKIPPED, _DECLARATION, _NAME, _NAME, _NAME, _QUOTED)
)
#: An attribute with the space before it: its name, and its value in quotes.
ATTRIBUTE = re.compile(rb"\s*+(%b)\s*+=\s*+(%b)" % (_NAME, _QUOTED))
_REFERENCE = re.compile(r"&(?:#x0*([0-9a-fA-F]{1,8})|#0*([0-9]{1,8})|(lt|gt|amp|quot|apos));")
_ENTITIES = {"lt": "<", "gt": ">", "amp": "&", "quot": '"', "apos": "'"}


def encoding_of(raw: bytes) -> str:
    """Return the encoding that Mitsuba's parser detects; it ignores all declarations except
    Latin-1.
    """
    for mark, name in _MARKS.items():
        if raw.startswith(mark):
            return name
    return "latin-1" if _LATIN.match(raw) else "utf-8"


def markup(text: bytes) -> Iterator[re.Match[bytes]]:
    """Yield all tokens in angle brackets, in order. Raises ValueError for a `<` that starts no
    token.

    text: UTF-8, possibly with invalid bytes. A start tag has the groups `tag`, `attributes` and
    `empty` (its `/`), an end tag the group `end` (its name).
    """
    position = text.find(b"<")
    while position >= 0:
        match = _MARKUP.match(text, position)
        if match is None:
            start = one_line(decoded(text[position : position + 40]).split("\n")[0])
            raise ValueError(f"line {line_of(text, position)}: cannot read {start!r} as XML")
        yield match
        position = text.find(b"<", match.end())


def attributes(tag: re.Match[bytes]) -> dict[str, str]:
    """Return attributes by name, with references resolved; of repeated attributes the first."""
    values: dict[str, str] = {}
    for key, quoted in ATTRIBUTE.findall(tag["attributes"]):
        value = re.sub(r"\r\n|[\r\n\t]", " ", decoded(quoted[1:-1]))
        values.setdefault(decoded(key), _REFERENCE.sub(_character, value))
    return values


def line_of(text: bytes, offset: int) -> int:
    """Return the line number of a byte offset, counted from 1."""
    return text.count(b"\n", 0, offset) + 1


def decoded(text: bytes) -> str:
    """Return text as Unicode, with invalid bytes replaced."""
    return text.decode("utf-8", "replace")


def _character(reference: re.Match[str]) -> str:
    hexadecimal, decimal, entity = reference.groups()
    if entity:
        return _ENTITIES[entity]
    code = int(hexadecimal, 16) if hexadecimal else int(decimal)
    return chr(code) if code <= sys.maxunicode else reference[0]


def place_of_node(state: Any, node: Any) -> str:
    """Return file and line of a node of a parsed scene as text; "" if it is not in a file."""
    try:
        file = Path(str(state.files[node.file_index]))
        line = line_of(file.read_bytes(), int(node.offset))
    except (IndexError, OSError, OverflowError, TypeError):
        return ""
    prefix = f"{file.name}, " if node.file_index else ""
    return f"{prefix}line {line}: "


def tag(element: str, /, **attributes: str) -> str:
    """Return an empty element with escaped attributes.

    Raises SceneError if an attribute contains `$`, which cannot be escaped.
    """
    # Imported late, since it imports many network modules.
    from xml.sax.saxutils import quoteattr

    for key, value in attributes.items():
        if "$" in value:
            raise SceneError(
                f"cannot write <{element} {key}={value!r}>: Mitsuba reads $ as the start of a "
                "parameter; rename the folder or file, or choose other ",
                Hint("parameters"),
            )
    attribute_text = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
    return f"<{element}{attribute_text}/>"
