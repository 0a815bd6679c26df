"""`solve` with the places of a painter's export; without a search where it has none."""

import json
import os
import shlex
from pathlib import Path
from typing import Any

import pytest
from command import run
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.cli.commands import paint_command
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.files import write_bytes, write_text
from lightpaint.images.formats.exr import write_rgb
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject import Subject
from lightpaint.placement.placement import AddedLight, Move
from lightpaint.placement.placement_record import PlacementRecord
from lightpaint.scene.lights.new_emitter import NewEmitter

#: Where the bulb goes.
POSITION = (0.4, 1.2, 0.1)

#: For a quick answer.
QUICK = ("--spp", "4", "--no-verify")


def place_of(lighting: Path, name: str) -> Any:
    """The position that a lighting says a light has."""
    return json.loads(lighting.read_text())["places"][name]["position"]


@pytest.fixture(scope="module")
def work_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room whose lights file lets its spot turn, a painting, a basis, and places of lights."""
    folder = tmp_path_factory.mktemp("room")
    scene = lp.load_scene(write_room(folder, lights=LIGHTS["bulb"] + LIGHTS["beam"]))
    goal = scene.moved({"beam": lp.Pose(target=(-0.6, 0, -0.3))})
    write_rgb(folder / "p.exr", lp.render_basis(goal, spp=64).current_look)
    write_basis(folder / "room.basis.exr", lp.render_basis(scene, spp=4))
    bulb = scene.light("bulb").members[0].site
    moved = scene.moved({"bulb": lp.Pose(position=POSITION)}).light("bulb").members[0].site
    new = NewEmitter("fill", "point", lp.Pose(position=(-0.3, 1.4, 0.4)))
    record = PlacementRecord(
        (Move("bulb", bulb, moved, gain_share=0.0),), (AddedLight(new, gain_share=0.0),), 0.0, 0.0
    )
    write_text(folder / "places.json", record.to_json())
    write_bytes(folder / "room.lights.toml", b"[light.beam]\naim = true\n")
    return folder


def opened_subject(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Subject:
    """What `lightpaint paint` would serve."""
    subjects: list[Subject] = []

    def serve(served: Any, **_: Any) -> CommandOutcome:
        subjects.extend(served)
        return CommandOutcome(None)

    monkeypatch.setattr(paint_command, "_serve", serve)
    assert run(folder, "paint", "room.xml", *QUICK[:2]).returncode == 0
    return subjects[0]


def test_the_command_of_a_session_moves_no_light_by_itself(
    work_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in the painter, whatever the lights file lets lights do; a search is one command less."""
    monkeypatch.chdir(work_folder)
    subject = opened_subject(work_folder, monkeypatch)
    line = subject.command({"": "p.exr"}, SessionRequests())
    words = shlex.split(line[line.index("&& lightpaint") : -1])[2:]
    assert "--no-move" in words
    completed = run(work_folder, *words, "--no-verify", "-o", "still")
    assert completed.returncode == 0, completed.stderr
    assert "move" not in completed.stdout + completed.stderr
    searched = run(work_folder, *(x for x in words if x != "--no-move"), "-o", "searched")
    assert searched.returncode == 0, searched.stderr
    assert "turned by" in searched.stdout + searched.stderr
    placed = subject.command(
        {"": "p.exr"}, SessionRequests().with_poses({"bulb": {"position": POSITION}})
    )
    assert "--places" in placed
    assert "--no-move" not in placed
    (work_folder / "room.lights.toml").rename(work_folder / "kept.toml")
    try:
        other = opened_subject(work_folder, monkeypatch)
        assert "--no-move" not in other.command({"": "p.exr"}, SessionRequests())
    finally:
        os.rename(work_folder / "kept.toml", work_folder / "room.lights.toml")


def test_lights_hang_as_the_file_says(work_folder: Path) -> None:
    options = ("--places", "places.json", "--lock", "fill=0.3", *QUICK)
    completed = run(work_folder, "solve", "room.xml", "p.exr", "-o", "hung", *options)
    assert completed.returncode == 0, completed.stderr
    assert place_of(work_folder / "hung" / "lighting.json", "bulb") == pytest.approx(POSITION)
    assert "turned by" not in completed.stdout + completed.stderr
