"""The add-on in a real window of Blender: clicks, a painter, undo."""

import json
from pathlib import Path

import pytest
from blender_window import missing_programs, run_in_window

HERE = Path(__file__).parent


@pytest.mark.nightly
@pytest.mark.long
def test_a_window_of_blender_follows_the_painter(tmp_path: Path, variables: dict[str, str]) -> None:
    if missing := missing_programs():
        pytest.skip(f"{', '.join(missing)} (a window of Blender)")
    output = run_in_window(HERE / "window.py", tmp_path, "-", variables=variables)
    found = json.loads((tmp_path / "found.json").read_text())
    assert "error" not in found, found["error"] + output
    assert found["is done"]
    assert found["unpainted"]
    assert found["applied"]
    assert found["left by revert"] == []
    assert found["is painter ended"]
