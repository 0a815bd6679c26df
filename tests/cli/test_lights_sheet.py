"""`lightpaint lights` draws what each light does, and never at the cost of the listing."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused
from PIL import Image
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.images.formats.png import png_has_text
from lightpaint.pipeline import templates
from lightpaint.pipeline.result_folder import write_answer
from lightpaint.pipeline.templates import SHEET_KEY, recorded_places
from lightpaint.report.rig_plan import CHANGED
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene


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
    monkeypatch.setattr(templates, "use_variant", lambda: slow)
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(room.parent / "cache"))
    completed = run(room.parent, "lights", room)
    assert completed.returncode == 0
    assert len(completed.stdout.splitlines()) == 3
    assert completed.stderr == "lightpaint: no lights.png: rendering is slow here\n"


def test_a_render_for_each_light_is_not_made_just_to_look(
    room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(templates, "why_not_one_pass", lambda _scene: "fog")
    monkeypatch.setattr(templates, "MAX_RENDERS", 1)
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(room.parent / "cache"))
    completed = run(room.parent, "lights", room)
    assert "no lights.png: fog, so that each light needs a render of its own" in completed.stderr
    assert not (room.parent / "lights.png").exists()


@pytest.fixture
def relit(tmp_path: Path) -> Scene:
    """A relit scene whose spot has moved and whose key is new, beside its lighting."""
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["bulb"] + LIGHTS["beam"]))
    pose = lp.Pose(position=(0.5, 1.7, 1.0), target=(-0.6, 0, -0.3))
    key = NewEmitter("key", "point", lp.Pose(position=(-0.7, 1.6, 1)))
    moved = scene.moved({"beam": pose}).with_new_emitters([key])
    lighting = lp.Lighting.current(lp.render_basis(moved, spp=2))
    written = write_answer(tmp_path / "out", lighting, scene=moved)
    assert written is not None
    return load_scene(tmp_path / "out" / "relit.xml")


def test_a_relit_scene_shows_what_its_lighting_has_moved(relit: Scene) -> None:
    by_name = {place.name: place for place in recorded_places(relit)}
    assert by_name["beam"].position == pytest.approx((0.5, 1.7, 1.0))
    assert by_name["beam"].moved_from is not None
    assert by_name["beam"].moved_from.position == pytest.approx((0.8, 1.8, 1.5))
    assert by_name["key"].new == "point"
    assert by_name["bulb"].moved_from is None
    # The scene alone does not know, and a lighting of other places does not count.
    assert all(x.moved_from is None and not x.new for x in relit.emitter_places)
    elsewhere = relit.moved({"beam": lp.Pose(position=(0.4, 1.7, 1.0))})
    [beam] = [x for x in recorded_places(elsewhere) if x.name == "beam"]
    assert beam.moved_from is not None
    assert beam.moved_from.position == pytest.approx((0.5, 1.7, 1.0))
    (relit.path.parent / "lighting.json").write_text("{torn", encoding="utf-8")
    assert recorded_places(relit) == relit.emitter_places
    (relit.path.parent / "lighting.json").unlink()
    assert recorded_places(relit) == relit.emitter_places


def test_the_sheet_of_a_relit_scene_differs_by_the_marks(
    relit: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = relit.path.parent
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(folder / "cache"))
    marks = []
    for name in ("marked", "plain"):
        assert run(folder, "lights", "relit.xml", "-o", f"{name}.png").returncode == 0
        with Image.open(folder / f"{name}.png") as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(int)
        marks.append(int((np.abs(pixels - CHANGED).max(axis=-1) < 12).sum()))
        (folder / "lighting.json").unlink(missing_ok=True)
    # Rings, an arrow and names of two lights, in the plan and in the elevation.
    assert marks[0] > 60
    assert marks[1] == 0
