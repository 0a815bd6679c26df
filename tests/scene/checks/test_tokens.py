"""The tokens of XML: what a parser of the standard library finds, and what pugixml puts up with."""

import time
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import given
from hypothesis import strategies as st
from renderer import write_room

from lightpaint.errors import SceneError
from lightpaint.scene.checks.tokens import (
    attributes,
    encoding_of,
    line_of,
    markup,
)
from lightpaint.scene.scene_reader import load_scene


def _tags(text: str) -> list[tuple[str, dict[str, str]]]:
    tokens = markup(text.encode())
    return [(one["tag"].decode(), attributes(one)) for one in tokens if one["tag"] is not None]


NAMES = st.from_regex(r"[A-Za-z_][A-Za-z0-9_.-]{0,5}", fullmatch=True)
VALUES = st.text(st.characters(codec="utf-8", min_codepoint=32), max_size=8)


@given(st.lists(st.tuples(NAMES, st.dictionaries(NAMES, VALUES, max_size=3)), max_size=4))
def test_tags_and_attributes_are_those_of_another_parser(
    made: list[tuple[str, dict[str, str]]],
) -> None:
    lines = [
        f"<{tag} {' '.join(f'{k}={quoteattr(v)}' for k, v in own.items())}/>\n" for tag, own in made
    ]
    text = f"<!-- <a> --><root><![CDATA[<b>]]>{''.join(lines)}</root>"
    expected = [(child.tag, dict(child.attrib)) for child in ElementTree.fromstring(text)]
    assert _tags(text) == [("root", {}), *expected]


@pytest.mark.parametrize(
    ("attribute_text", "expected"),
    [
        ("&lt;&gt;&amp;&quot;&apos;", "<>&\"'"),
        ("&#65;&#x42;&#000000000067;&#x00000000044;", "ABCD"),
        ("a\r\nb\tc\rd", "a b c d"),
        ("a & b < c &d; &#; &#xg;", "a & b < c &d; &#; &#xg;"),
        ("&#1114112;&#x110000;&#4294967361;", "&#1114112;&#x110000;&#4294967361;"),
    ],
)
def test_what_an_attribute_says(attribute_text: str, expected: str) -> None:
    assert _tags(f'<a b="{attribute_text}" b="second"/>') == [("a", {"b": expected})]


@pytest.mark.parametrize(
    "broken", ["<", "<a", "<a b>", "<a b='c>", "< a>", "<!-- ", "<!a>", "</ a>"]
)
def test_what_nobody_can_read(broken: str) -> None:
    with pytest.raises(ValueError, match=r"line 3: cannot read .<.*. as XML"):
        list(markup(f"<r>\n\n{broken}".encode()))


@pytest.mark.parametrize("start", ["<!DOCTYPE a [" + "<!b 'c'>" * 5000, "<a " + "b='c' " * 50_000])
def test_what_is_broken_is_given_up_at_once(start: str) -> None:
    start_s = time.process_time()
    with pytest.raises(ValueError, match="cannot read"):
        list(markup(start.encode()))
    # Many times what it takes; what is tried forever takes minutes.
    assert time.process_time() - start_s < 1


def test_a_document_type_is_passed_over_with_its_entities() -> None:
    text = '<!DOCTYPE a [<!ENTITY e "<x/>"><!-- ]> --><!ENTITY d \'>\'>]><a b="&e;&d;"/>'
    assert _tags(text) == [("a", {"b": "&e;&d;"})]


def test_lines_are_counted_from_one() -> None:
    assert line_of(b"a\nb\r\nc", 5) == 3


def test_encodings() -> None:
    for encoding in ("utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be", "utf-8"):
        assert encoding_of("<a/>".encode(encoding)) == encoding
        assert encoding_of("\ufeff<a/>".encode(encoding)) == encoding
    assert encoding_of(b'<?xml version="1.0" encoding="ISO-8859-1"?>') == "latin-1"
    assert encoding_of(b'<?xml version="1.0" encoding="koi8-r"?>') == "utf-8"


def test_includes_are_looked_at_whatever_the_encoding(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    text = path.read_text(encoding="utf-8").replace(
        "</scene>", '<include filename="ü.xml"/></scene>'
    )
    (tmp_path / "ü.xml").symlink_to("/dev/zero")
    for encoding, head in (("utf-8", ""), ("utf-16", ""), ("latin-1", '<?xml encoding="latin1"?>')):
        path.write_bytes((head + text).encode(encoding))
        with pytest.raises(SceneError, match=r"line \d+: .*ü\.xml is a device or a pipe"):
            load_scene(path)
