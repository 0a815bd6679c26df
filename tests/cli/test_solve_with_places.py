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
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.files import write_bytes, write_text
from lightpaint.images.formats.exr import write_rgb
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject import Subject
from lightpaint.placement.light_changes import AddedLight, Move, PlacementRecord
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
    """Return the subject that `lightpaint paint` serves, without a server."""
    subjects: list[Subject] = []

    def serve(served: Any, **_: Any) -> CommandOutcome:
        subjects.extend(served)
        return CommandOutcome(None)

    monkeypatch.setattr(paint_command, "_serve", serve)
    assert run(folder, "paint", "room.xml", *QUICK[:2]).returncode == 0
    return subjects[0]


@pytest.mark.nightly
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
    printed = completed.stdout + completed.stderr
    assert not any(done in printed for done in ("turned by", "slid by"))
    still = (work_folder / "still" / "lighting.json").read_text(encoding="utf-8")
    assert "moved_from" not in still
    searched = run(work_folder, *(x for x in words if x != "--no-move"), "-o", "searched")
    assert searched.returncode == 0, searched.stderr
    assert "turned by" in searched.stdout + searched.stderr
    found = (work_folder / "searched" / "lighting.json").read_text(encoding="utf-8")
    assert "moved_from" in found
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


def run_refused(folder: Path, *words: str) -> str:
    """The one line that a command ends in."""
    completed = run(folder, "solve", *words)
    assert completed.returncode == 2
    [line] = [x for x in completed.stderr.splitlines() if x.startswith("lightpaint solve: ")]
    return line.removeprefix("lightpaint solve: ")


def test_a_basis_without_its_scene_has_its_lights_where_they_were(work_folder: Path) -> None:
    line = run_refused(work_folder, "room.basis.exr", "p.exr", "-o", "b", "--places", "places.json")
    assert line == (
        "lights can only hang elsewhere in their scene: give the scene, or leave --places out"
    )
    assert not (work_folder / "b").exists()


def test_places_are_not_overwritten_by_the_answer(work_folder: Path) -> None:
    """Not even by force: somebody hung these lights."""
    (work_folder / "out").mkdir(exist_ok=True)
    text = (work_folder / "places.json").read_text()
    places = work_folder / "out" / "report.json"
    places.write_text(text)
    line = run_refused(
        work_folder, "room.xml", "p.exr", "-o", "out", "--force", "--places", "out/report.json"
    )
    assert line.startswith("out/report.json is an input of this command, which would overwrite")
    assert places.read_text() == text


@pytest.mark.parametrize("text", ["{}", '{"format": "lightpaint-places 1"', "[1]"])
def test_damaged_places_are_not_to_be_deleted(work_folder: Path, text: str) -> None:
    (work_folder / "damaged.json").write_text(text)
    line = run_refused(
        work_folder, "room.xml", "p.exr", "-o", "c", "--places", "damaged.json", *QUICK
    )
    assert line.startswith("damaged.json has no places of lights: ")
    assert line.endswith("; export it again from the painter, or leave --places out")
    assert not (work_folder / "c").exists()
