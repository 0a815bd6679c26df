"""Messages of page and session: round trips, and junk that is refused in one line."""

import dataclasses
import json
import re
import struct
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_messages import fake_answer
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from raw_message import RawMessage
from renderer import REPOSITORY

from lightpaint.errors import PaintError
from lightpaint.paint.message_frames import DTYPES, MAX_TEXT, from_frame, parse_request, to_frame
from lightpaint.paint.protocol import (
    VERSION,
    ChangeSettings,
    Event,
    Findings,
    LightAnswer,
    Paint,
    Request,
    TakeOver,
    TieLights,
    typescript,
)
from lightpaint.paint.server.session_clients import MAX_OBSERVERS
from lightpaint.paint.session.look_library import MAX_PROPOSALS

sys.path.insert(0, str(REPOSITORY / "docs" / "site"))

from message_pages import write_messages

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)
FIELDS = st.dictionaries(TEXTS.filter(lambda x: x not in ("kind", "reply", "buffers")), PLAIN)
ARRAYS = st.dictionaries(
    st.sampled_from(["image", "importance", "weights"]),
    st.sampled_from(sorted(DTYPES)).flatmap(
        lambda dtype: arrays.arrays(dtype, arrays.array_shapes(min_dims=0, max_dims=3, min_side=0))
    ),
    max_size=3,
)
#: As long as they are, paint arrays are finite; what a page may say of pixels is the session's.
FINITE = arrays.arrays(
    "float32", (2, 3, 3), elements=st.floats(-1e9, 1e9, width=32, allow_nan=False)
)


@given(FIELDS, ARRAYS, st.none() | st.integers(0, 2**53))
def test_what_a_session_says_arrives(fields: Any, given_arrays: Any, reply: int | None) -> None:
    message = RawMessage("notice", fields, given_arrays)
    frame = to_frame(message.content(reply), message.buffers())
    content, buffers = from_frame(frame)
    assert content.pop("kind") == "notice"
    assert content.pop("reply", None) == reply
    described = content.pop("buffers")
    assert content == json.loads(json.dumps(_finite(fields)))
    assert len(frame) % 8 == 0
    for (name, array), header, buffer in zip(given_arrays.items(), described, buffers, strict=True):
        assert (header["name"], header["shape"]) == (name, list(array.shape))
        received = np.frombuffer(buffer, DTYPES[header["dtype"]]).reshape(array.shape)
        np.testing.assert_array_equal(received, array)
        assert received.dtype.name == array.dtype.name


def _finite(value: Any) -> Any:
    """NaN and Inf have no word in JSON."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


@given(st.integers(0, 2**53 - 1), FINITE, st.integers(0, 100), st.booleans())
def test_paint_arrives_to_the_last_bit(seq: int, image: Any, stroke: int, is_final: bool) -> None:
    fields = {"seq": seq, "stroke": stroke, "region": [1, 3, 0, 3], "is_final": is_final}
    message = RawMessage("paint", fields, {"image": image, "importance": image[..., 0]})
    number, request, received = parse_request(
        *from_frame(to_frame(message.content(), message.buffers()))
    )
    assert number == seq
    assert request == Paint(stroke, (1, 3, 0, 3), is_final)
    assert received["image"].tobytes() == image.tobytes()
    assert not received["importance"].flags.writeable


def test_what_is_said_is_read_as_it_is_meant() -> None:
    for kind, fields, meaning in (
        ("take_over", {}, TakeOver()),
        ("tie", {"ties": [["a", "b"], []]}, TieLights((("a", "b"), ()))),
        (
            "change_settings",
            {"settings": {"hold": None, "space": "display"}},
            ChangeSettings({"hold": None, "space": "display"}),
        ),
    ):
        assert parse_request({"kind": kind, "seq": 0, **fields}, [])[1] == meaning
    names = {name.replace("_", ""): kind.__name__.lower() for name, kind in Request.kinds.items()}
    assert all(kind.startswith(name) for name, kind in names.items())


def _assert_refused(frame: bytes) -> None:
    with suppress(PaintError):
        parse_request(*from_frame(frame))


@given(st.binary(max_size=300))
def test_noise_is_refused(noise: bytes) -> None:
    _assert_refused(noise)
    _assert_refused(struct.pack("<I", max(0, len(noise) - 4)) + noise)


@given(PLAIN)
def test_any_json_is_refused_or_read(content: Any) -> None:
    _assert_refused(to_frame(_finite(content), []))


@given(
    st.fixed_dictionaries(
        {"kind": st.sampled_from([*Request.kinds, "x"]), "seq": st.just(1) | PLAIN},
        optional={
            "buffers": st.lists(
                st.fixed_dictionaries(
                    {},
                    optional={
                        "name": TEXTS | PLAIN,
                        "dtype": st.sampled_from(sorted(DTYPES)) | PLAIN,
                        "shape": st.lists(st.integers(-2, 2**17), max_size=5) | PLAIN,
                    },
                ),
                max_size=3,
            )
            | PLAIN,
            "stroke": PLAIN,
            "region": st.lists(st.integers(-1, 5), max_size=5) | PLAIN,
            "version": PLAIN,
            "settings": PLAIN,
            "ties": PLAIN,
            "outputs": PLAIN,
        },
    ),
    st.binary(max_size=64),
)
def test_nearly_right_messages_are_refused_or_read(content: Any, rest: bytes) -> None:
    _assert_refused(to_frame(_finite(content), []) + rest)


@given(FINITE, st.data())
def test_a_frame_cut_short_is_refused(image: Any, data: Any) -> None:
    message = RawMessage("paint", {"seq": 1, "stroke": 1, "region": [0, 2, 0, 3]}, {"image": image})
    frame = to_frame(message.content(), message.buffers())
    end = data.draw(st.integers(0, len(frame) - 1))
    with pytest.raises(PaintError):
        parse_request(*from_frame(frame[:end]))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64"])
def test_what_is_no_number_is_refused(value: float, dtype: str) -> None:
    array = np.ones((1, 2, 3), dtype)
    array[0, 1, 2] = value
    message = RawMessage("paint", {"seq": 1, "stroke": 1, "region": [0, 1, 0, 2]}, {"image": array})
    with pytest.raises(PaintError, match="NaN or Inf"):
        parse_request(*from_frame(to_frame(message.content(), message.buffers())))


def test_two_buffers_of_one_name_are_refused() -> None:
    header = {"name": "image", "dtype": "uint8", "shape": [1]}
    with pytest.raises(PaintError, match="image"):
        parse_request({"kind": "undo", "seq": 1, "buffers": [header, header]}, [b"a", b"b"])


def test_lengths_that_nobody_has_are_refused_at_once() -> None:
    for length in (MAX_TEXT + 1, 2**32 - 1):
        with pytest.raises(PaintError):
            from_frame(struct.pack("<I", length) + bytes(16))
    header = {"name": "image", "dtype": "float64", "shape": [65536] * 4}
    with pytest.raises(PaintError, match="shorter"):
        from_frame(to_frame({"kind": "paint", "seq": 1, "buffers": [header]}, []))
    deep = b"[" * 50_000
    with pytest.raises(PaintError, match="not JSON"):
        from_frame(struct.pack("<I", len(deep)) + deep)


def test_a_refusal_is_short_whatever_is_refused() -> None:
    for content in ({"version": "x" * 10**5}, {"version": 1, "x\n" * 10**4: 1}):
        with pytest.raises(PaintError) as refusal:
            parse_request({"kind": "hello", "seq": 1, **content}, [])
        assert len(str(refusal.value)) < 500


def test_the_page_is_checked_with_the_types_of_all_messages() -> None:
    text = typescript.declarations()
    for kind, record in {**Request.kinds, **Event.kinds}.items():
        assert f"\n  {kind}: {record.__name__};\n" in text
        assert text.count(f"\nexport interface {record.__name__} {{\n") == 1


def test_every_message_says_what_it_is() -> None:
    for message in (*Request.kinds.values(), *Event.kinds.values()):
        assert message.__doc__
        assert not message.__doc__.startswith(f"{message.__name__}(")
        assert message.__dataclass_params__.frozen


def test_what_is_left_out_and_what_is_null() -> None:
    findings = Findings(
        lights=(LightAnswer((1.0, 0.5, float("inf")), None, None, "#fff", True, 1.0),)
    )
    sent = fake_answer(**{"lights": findings.lights}).fields
    assert "headline" not in sent
    assert sent["lights"] == [
        {
            "emission": [1.0, 0.5, None],
            "stops": None,
            "kelvin": None,
            "swatch": "#fff",
            "is_on": True,
            "share": 1.0,
        }
    ]


def test_the_document_has_the_numbers_of_the_code() -> None:
    text = (REPOSITORY / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert f'"protocol": {VERSION}' in text
    for limit in (MAX_OBSERVERS, MAX_PROPOSALS):
        assert re.search(rf"\b{limit}\b", text)
    for dtype in DTYPES:
        assert f"`{dtype}`" in text
    [conversation] = re.findall(r"^## A conversation\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    messages = {**Request.kinds, **Event.kinds}
    named = {field.name for message in messages.values() for field in dataclasses.fields(message)}
    assert set(re.findall(r"`(\w+)`", conversation)) - set(messages) - named == set()


def test_the_reference_has_every_message_as_it_is(tmp_path: Path) -> None:
    """Each has an entry, with all words of its docstring, and a row for each field."""
    write_messages(tmp_path / "messages")
    for page, messages in (("requests", Request.kinds), ("events", Event.kinds)):
        text = (tmp_path / "messages" / f"{page}.md").read_text(encoding="utf-8")
        entries = dict(re.findall(r"^### `(\w+)`\n(.*?)(?=^##|\Z)", text, re.MULTILINE | re.DOTALL))
        assert set(entries) == set(messages)
        for kind, message in messages.items():
            rows = re.findall(r"^\| `(\w+)\??` \| .+? \| (.*) \|$", entries[kind], re.MULTILINE)
            named = {*(x.name for x in dataclasses.fields(message)), *message.request_buffers}
            assert {name for name, _ in rows} == named
            shown = {*_words(entries[kind].partition("| field")[0]), *named}
            shown |= {word for _, meaning in rows for word in _words(meaning)}
            assert set(_words(message.__doc__ or "")) - shown == set(), kind


def _words(text: str) -> list[str]:
    """Return the words of a text without links, code marks and punctuation."""
    return re.findall(r"\w+", re.sub(r"\]\([^)]*\)", "", text))
