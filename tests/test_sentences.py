"""Sentences keep their arguments as data, through errors, pickles and JSON."""

import copy
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import lightpaint as lp
from lightpaint.batch.manifest.keys import as_key
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.errors import AccessError, BatchError, ColorError, LightpaintError, SizeError
from lightpaint.files import one_line
from lightpaint.sentences import Hint, Lead, Remedy, Sentence, SourceKey, Word

HINT = Hint("resize", True)
RESIZE = Sentence("a.exr is 4x3: export it again, or pass ", HINT)


def test_three_faces_of_one_error() -> None:
    error = SizeError("a.exr is 4x3: export it again, or pass ", HINT)
    assert str(error) == error.args[0] == "a.exr is 4x3: export it again, or pass resize=True"
    assert spoken(error.sentence).endswith("or pass --resize")
    assert error.sentence.spelled(as_key).endswith("or pass settings.resize = true")


def test_a_library_error_carries_its_argument() -> None:
    target = lp.Target.of([[[1.0, 1.0, 1.0]] * 3] * 2)
    with pytest.raises(SizeError) as refusal:
        target.fitted_to((5, 7), resize=False)
    assert spoken(refusal.value.sentence) == str(refusal.value).replace("resize=True", "--resize")


@pytest.mark.parametrize("copied", [lambda x: pickle.loads(pickle.dumps(x)), copy.deepcopy])
@pytest.mark.parametrize(
    "value",
    [
        SizeError(RESIZE),
        AccessError("another (", Hint("folder"), ")"),
        ColorError(Hint("space", Word("display")), " shows it"),
        BatchError.of([Sentence("one ", HINT), "two"]),
    ],
)
def test_copies_keep_the_data(value: LightpaintError, copied: Any) -> None:
    again = copied(value)
    assert type(again) is type(value)
    assert str(again) == str(value)
    assert again.sentence.parts == value.sentence.parts
    assert spoken(again.sentence) == spoken(value.sentence)
    assert getattr(again, "mistakes", None) == getattr(value, "mistakes", None)


def test_an_error_comes_from_another_process_with_its_data() -> None:
    refusing = """
import pickle, sys
from lightpaint.errors import SizeError
from lightpaint.sentences import Hint
try:
    raise SizeError("or pass ", Hint("resize", True))
except SizeError as error:
    sys.stdout.buffer.write(pickle.dumps(error))
"""
    child = subprocess.run([sys.executable, "-c", refusing], capture_output=True, check=True)
    refusal = pickle.loads(child.stdout)
    assert isinstance(refusal, SizeError)
    assert refusal.sentence.parts == ("or pass ", Hint("resize", True))


def test_nested_errors_keep_the_data() -> None:
    inner = SizeError(RESIZE)
    outer = LightpaintError("look 3: ", inner, "; trying again")
    outermost = LightpaintError(one_line(outer.sentence))
    assert str(outermost) == f"look 3: {RESIZE}; trying again"
    assert spoken(outermost.sentence) == f"look 3: {spoken(RESIZE)}; trying again"
    assert ("a: " + RESIZE + ".").parts[1:] == (HINT, ".")
    assert Sentence.joined([RESIZE, HINT]).parts[1:] == (HINT, ", ", HINT)


def test_several_mistakes_are_told_apart() -> None:
    error = BatchError.of([Sentence("one ", HINT), "two"])
    assert str(error) == "one resize=True; two"
    assert [spoken(x) for x in error.mistakes] == ["one --resize", "two"]
    assert BatchError("one, ", HINT).mistakes == ("one, resize=True",)


@pytest.mark.parametrize(
    "value", [..., True, False, 3, "a {name}", Word("count"), {"sky": ...}, {"sky": "16x8"}]
)
def test_records_keep_the_data(value: Any) -> None:
    sentence = Sentence("use ", Hint("x", value), " or not")
    again = Sentence.of_record(json.loads(json.dumps(sentence.record)))
    assert again == sentence
    [hint] = [part for part in again.parts if isinstance(part, Hint)]
    assert hint == Hint("x", value)
    assert type(hint.value) is type(value)


def test_one_line_of_a_long_sentence() -> None:
    long = Sentence("a\nb\x1b " + "x" * 50, Hint("template"), " " + "y" * 50)
    line = one_line(long, limit=80)
    assert isinstance(line, Sentence)
    assert str(line) == one_line(str(long), limit=80)
    assert Hint("template") in line.parts
    assert Hint("template") not in one_line(long, limit=60).parts  # type: ignore[attr-defined]
    assert one_line(long, limit=60) == one_line(str(long), limit=60)


LOCK = SourceKey("room.toml", "light", "a key", "lock")


def test_keys_of_sources() -> None:
    assert LOCK == "room.toml: light.a key.lock"
    assert f"{LOCK}.min" == LOCK / "min"
    assert LOCK.path == "light.a key.lock"
    assert SourceKey("", "new") / 2 / "count" == "new 2.count"
    assert SourceKey.of("anything") / "lock" == "anything.lock"
    assert pickle.loads(pickle.dumps(LOCK)).keys == LOCK.keys
    assert Sentence(Lead(LOCK), "no light") == f"{LOCK}: no light"


def test_a_remedy_is_replaced_as_a_whole() -> None:
    inner = Remedy("choose another (", Hint("folder"), ")")
    outer = Remedy(inner, ", or start afresh (", Hint("new", True), ")")
    sentence = Sentence("it is damaged: ", outer)
    assert sentence == "it is damaged: choose another (folder=...), or start afresh (new=True)"
    assert sentence.spelled({outer: "give one"}.get) == "it is damaged: give one"
    assert sentence.spelled({inner: "give one"}.get).endswith(
        ": give one, or start afresh (new=True)"
    )
    assert spoken(sentence) == "it is damaged: choose another (-o), or start afresh (--new)"


def test_a_path_can_have_another_name() -> None:
    path = Path("/tmp/upload-1/layers")
    error = LightpaintError("cannot read ", path, ": it is damaged")
    assert str(error) == "cannot read /tmp/upload-1/layers: it is damaged"
    shown = error.sentence.spelled(lambda datum: "wall.ora" if datum == path else None)
    assert shown == "cannot read wall.ora: it is damaged"
