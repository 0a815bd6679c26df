"""Shots in which much is odd or missing: one sentence each, and reverting puts all back."""

from pathlib import Path

import pytest
from blender import found_in_blender

HERE = Path(__file__).parent


@pytest.mark.nightly
@pytest.mark.long
def test_hostile_shots_are_told_apart_and_put_back(
    blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    found = found_in_blender(blender, HERE / "hostile.py", tmp_path, variables)
    assert found["prepared"] == "15 light groups; 6 stay as they are"
    reasons = dict(line.split(": ", 1) for line in found["left"])
    assert reasons.keys() == {"Sphere", "dark", "driven", "keyed", "linked", "negative"}
    assert "node group deep" in reasons["Sphere"]
    assert reasons["driven"] == reasons["keyed"] == "keyframes or a driver decide its light"
    assert "linked from another file" in reasons["linked"]
    names = found["groups"]
    assert len({name.casefold() for name in names}) == len(names) == 15
    assert not [name for name in names if set(name) & set('."\n=')]
    assert max(len(name.encode()) for name in names) == 40
    # Two objects with one lamp change together.
    assert found["shared"] == ["Point", "Point"]
    assert found["kept on rename"]
    assert len(found["grouped"]) < 15
    assert found["kept on regrouping"]
    assert found["rendered"] == "the shot is rendered"
    assert found["rendered in other groups"] == "the shot is rendered"
    assert "rendered already" in found["rendered already"]
    assert "pip install 'lightpaint[paint,ocio]'" in found["not installed"]
    assert "choose another folder" in found["no folder"]
    assert "no camera" in found["no camera"]
    assert "has no pixels" in found["no pixels"]
    assert "there is no picture" in found["no reference"]
    assert "the painter has ended" in found["killed"]
    assert found["again"]
    assert found["reverted"] == []
    assert found["many"] == 315
    assert found["many rendered"] == "the shot is rendered"
    assert found["many reverted"] == []
    messages = [value for value in found.values() if isinstance(value, str)]
    assert not [text for text in messages if "\n" in text or "Traceback" in text]


@pytest.mark.nightly
@pytest.mark.long
def test_a_painter_is_started_as_its_error_asks_for(
    blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    sessions = found_in_blender(blender, HERE / "other_starts.py", tmp_path, variables)
    # The session of the first size is kept under another name.
    assert sessions == ["session-1.db", "session.db"]
