"""Shots stay with a file that is saved, under whatever name."""

from pathlib import Path

import pytest
from blender import found_in_blender


@pytest.mark.nightly
@pytest.mark.long
def test_a_shot_goes_where_its_file_goes(
    blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    script = Path(__file__).parent / "homes.py"
    found = found_in_blender(blender, script, tmp_path, variables)
    assert not found["kept unsaved"]
    assert found["kept saved"]
    assert found["unsaved"][0].startswith(found["temporary"])

    def shot(name: str) -> str:
        return str(tmp_path / f"{name}.lightpaint" / "Scene")

    assert found["saved"] == [shot("a"), ["first"], "the shot is kept in a.lightpaint", False]
    assert found["picture"] == [f"{shot('a')}/painting.png", 1.0]
    assert found["another name"][:2] == [shot("b"), ["second"]]
    assert found["name of another"][:2] == [shot("a"), ["second"]]
    assert "first" in Path(tmp_path, "a.lightpaint1", "Scene", "looks.json").read_text()
    assert found["busy"][:2] == [shot("a"), ["second"]]
    assert found["idle"][:2] == [shot("c"), ["second"]]
    assert found["in the way"][:2] == [shot("c"), ["second"]]
    assert "the shot stays in" in found["in the way"][2]
    assert found["in the way"][3]
    assert found["out of the way"] == [
        shot("d"),
        ["second"],
        "the shot is kept in d.lightpaint",
        False,
    ]
    # The next file without a name does not find what was painted in the one before.
    assert found["new file"][1] == []
    assert "when the painter ends" in found["during a painter"][2]
    assert (tmp_path / "painter-ended").exists()
    assert "last" in Path(tmp_path, "last.lightpaint", "Scene", "looks.json").read_text()
    assert not list(tmp_path.glob("*.part"))
