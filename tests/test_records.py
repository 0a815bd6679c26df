"""Records: a JSON object becomes a dataclass of just the kinds it says, or is refused."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.storage.json_records import MAX_CHARACTERS, read_record, strict_json


@dataclass(frozen=True)
class Part:
    name: str
    size: float = 1.0


@dataclass(frozen=True)
class Whole:
    text: str
    count: int
    number: float
    flag: bool
    kind: Literal["one", "two"]
    rgb: tuple[float, float, float]
    names: tuple[str, ...] = ()
    pairs: tuple[tuple[int, float], ...] = ()
    sums: Mapping[str, str] | None = None
    flux: tuple[float, float, float] | None = None
    parts: tuple[Part, ...] = ()
    place: int | str | None = None
    groups: Mapping[str, Sequence[str]] | None = None
    mode: Literal["a", "b"] | None = None


GOOD: dict[str, Any] = {
    "text": "灯",
    "count": 3,
    "number": 2,
    "flag": False,
    "kind": "two",
    "rgb": [1, 2.5, 3],
    "names": ["a", "b"],
    "pairs": [[1, 2], [3, 4.5]],
    "sums": {"a": "12"},
    "flux": None,
    "parts": [{"name": "a"}, {"name": "b", "size": 2}],
}


def test_each_value_is_of_the_kind_that_was_meant() -> None:
    record = read_record(Whole, GOOD)
    assert record == Whole(
        *("灯", 3, 2.0, False, "two", (1.0, 2.5, 3.0), ("a", "b"), ((1, 2.0), (3, 4.5))),
        *({"a": "12"}, None, (Part("a"), Part("b", 2.0))),
    )
    assert type(record.number) is float
    assert {type(v) for v in record.rgb} == {float}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"text": 1}, "text is a text, not 1"),
        ({"text": None}, "text is a text, not None"),
        ({"text": "x" * (MAX_CHARACTERS + 1)}, "text is a text"),
        ({"count": True}, "count is a whole number >= 0, not True"),
        ({"count": -1}, "not -1"),
        ({"count": 1.0}, "not 1.0"),
        ({"number": "2"}, "number is a number, not '2'"),
        ({"number": True}, "number is a number, not True"),
        ({"flag": 0}, "flag is true or false, not 0"),
        ({"kind": "three"}, "kind is one of 'one', 'two', not 'three'"),
        ({"kind": ["one"]}, "kind is one of"),
        ({"rgb": [1, 2]}, r"rgb is a list \(3 of: a number\), not \[1, 2\]"),
        ({"rgb": [1, 2, 3, 4]}, "3 of"),
        ({"rgb": "123"}, "3 of"),
        ({"rgb": {"r": 1}}, "3 of"),
        ({"names": ["a", 1]}, r"names is a list \(a text\), not \['a', 1\]"),
        ({"names": "ab"}, "names is a list"),
        ({"pairs": [[1, 2, 3]]}, "pairs is a list"),
        ({"sums": {"a": 1}}, "sums is an object"),
        ({"sums": []}, "sums is an object"),
        ({"flux": [1, 2, None]}, "flux is a list"),
        ({"parts": [{"size": 1}]}, "the key name is missing"),
        ({"parts": ["a"]}, "'a' is not an object"),
        ({"more": 1}, "the key 'more' is unknown"),
    ],
)
def test_what_is_something_else(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_record(Whole, GOOD | change)


def test_what_may_be_missing_and_what_may_be_there_too() -> None:
    needed = ("text", "count", "number", "flag", "kind", "rgb")
    least = {key: GOOD[key] for key in needed}
    assert read_record(Whole, least).names == ()
    for key in needed:
        with pytest.raises(ValueError, match=f"the key {key} is missing"):
            read_record(Whole, {k: v for k, v in least.items() if k != key})
    with pytest.raises(ValueError, match="the key names is missing"):
        read_record(Whole, least, required=["names"])
    assert read_record(Whole, GOOD | {"more": 1}, others=True) == read_record(Whole, GOOD)
    for odd in (None, [], "text", 1):
        with pytest.raises(ValueError, match="is not an object"):
            read_record(Whole, odd)


@given(
    st.builds(
        Part,
        name=st.text(st.characters(codec="utf-8")),
        size=st.floats(allow_nan=False, allow_infinity=False),
    )
)
def test_there_and_back(part: Part) -> None:
    assert read_record(Part, strict_json(json.dumps(asdict(part)))) == part


@pytest.mark.parametrize(
    ("text", "words"),
    [
        *((text, "is not a number of JSON") for text in ("NaN", "[Infinity]", "-Infinity")),
        *((text, "is too large") for text in ("1e999", "-1e999", "9" * 400)),
        ('{"a": 1, "a": 2}', "a key is repeated among a, a"),
        (r'"\ud800"', "not Unicode"),
        ("[" * 100_000, "nested too deeply"),
        ("{", "Expecting"),
    ],
)
def test_json_that_nobody_should_write(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        strict_json(text)
    assert strict_json(r'{"a": ["😀", 1e308, 2]}') == {"a": ["😀", 1e308, 2]}


def test_a_value_may_be_of_several_kinds() -> None:
    for place in (None, 2, "left"):
        assert read_record(Whole, {**GOOD, "place": place}).place == place
    record = read_record(Whole, {**GOOD, "groups": {"row": ["a", "b"]}, "mode": "b"})
    assert (record.groups, record.mode) == ({"row": ("a", "b")}, "b")
    for invalid, message in (
        ({"place": 1.5}, "place is a whole number >= 0 or a text, not 1.5"),
        ({"place": True}, "place is a whole number >= 0 or a text, not True"),
        ({"groups": {"row": "ab"}}, "groups is an object"),
        ({"mode": "c"}, "mode is one of 'a', 'b', not 'c'"),
    ):
        with pytest.raises(ValueError, match=message):
            read_record(Whole, {**GOOD, **invalid})


def test_an_exact_reading_refuses_unknown_keys_of_nested_records() -> None:
    newer = {**GOOD, "parts": [{"name": "a", "weight": 1}]}
    assert read_record(Whole, newer).parts == (Part("a"),)
    with pytest.raises(ValueError, match="the key 'weight' is unknown"):
        read_record(Whole, newer, is_exact=True)
    assert read_record(Whole, GOOD, is_exact=True) == read_record(Whole, GOOD)
