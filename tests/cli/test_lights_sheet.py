"""`lightpaint lights` draws what each light does, and never at the cost of the listing."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from command import run, run_refused
from PIL import Image
from renderer import LIGHTS, write_room

from lightpaint.images.formats.png import png_has_text
from lightpaint.pipeline import light_sheets
from lightpaint.pipeline.light_sheets import SHEET_KEY
from lightpaint.scene.runtime.variant import use_variant


@pytest.fixture
def room(tmp_path: Path) -> Path:
    return write_room(tmp_path, lights=LIGHTS["bulb"] + LIGHTS["sky"])


def test_the_sheet_is_drawn_and_drawn_anew(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, sheet = room.parent, room.parent / "lights.png"
    # A cache of its own: another test's basis of this room would do as well.
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(folder / "cache"))
    first = run(folder, "lights", room)
    assert first.returncode == 0, first.stderr
    lines = first.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["light", "bulb", "sky", "lights.png:"]
    assert "basis:" in first.stderr
    assert png_has_text(sheet, SHEET_KEY)
    with Image.open(sheet) as picture:
        assert picture.info["lightpaint.denoised"]
        assert picture.width > picture.height
    first_sheet = sheet.read_bytes()
    # Its own is replaced, from the basis that was kept.
    second_run = run(folder, "lights", room)
    assert second_run.stdout == first.stdout
    assert "basis:" not in second_run.stderr
    assert sheet.read_bytes() == first_sheet
    json_run = run(folder, "lights", room, "--json", "-o", "other.png")
    assert json.loads(json_run.stdout)["sheet"] == "other.png"
    assert (folder / "other.png").read_bytes() == first_sheet

    # Somebody else's is not, and is no reason to list nothing.
    sheet.write_bytes(b"mine")
    run_without_change = run(folder, "lights", room)
    assert (run_without_change.returncode, run_without_change.stdout) == (
        0,
        "\n".join([*lines[:-1], ""]),
    )
    assert "no lights.png: lights.png exists and is not a light sheet" in run_without_change.stderr
    assert "choose another name with -o, or pass --force" in run_without_change.stderr
    assert sheet.read_bytes() == b"mine"
    assert "is not a light sheet" in run_refused(folder, "lights", room, "-o", "lights.png")
    assert run(folder, "lights", room, "--force").returncode == 0
    assert sheet.read_bytes() == first_sheet


def test_only_where_it_is_wanted(room: Path) -> None:
    for option in ("--no-sheet", "--json"):
        completed = run(room.parent, "lights", room, option)
        assert completed.returncode == 0
        assert "sheet" not in completed.stdout
    assert [path.name for path in room.parent.iterdir()] == ["room.xml"]
    assert "must end in .png" in run_refused(room.parent, "lights", room, "-o", "a.jpg")
    (room.parent / "link.png").symlink_to(room)
    assert "is an input of this command" in run_refused(
        room.parent, "lights", room, "-o", "link.png"
    )
    assert "not allowed with" in run_refused(
        room.parent, "lights", room, "-o", "a.png", "--no-sheet"
    )


def test_where_rendering_is_slow_the_list_is_all(
    room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow = replace(use_variant(), note="rendering is slow here")
    monkeypatch.setattr(light_sheets, "use_variant", lambda: slow)
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(room.parent / "cache"))
    completed = run(room.parent, "lights", room)
    assert completed.returncode == 0
    assert len(completed.stdout.splitlines()) == 3
    assert completed.stderr == "lightpaint: no lights.png: rendering is slow here\n"


def test_a_render_for_each_light_is_not_made_just_to_look(
    room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(light_sheets, "why_not_one_pass", lambda _scene: "fog")
    monkeypatch.setattr(light_sheets, "MAX_RENDERS", 1)
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(room.parent / "cache"))
    completed = run(room.parent, "lights", room)
    assert "no lights.png: fog, so that each light needs a render of its own" in completed.stderr
    assert not (room.parent / "lights.png").exists()
