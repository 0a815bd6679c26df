"""Looks of a batch that share places: one search, one render of what moved, levels for each."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import RunOptions
from lightpaint.batch.work.work_items import with_paths
from lightpaint.errors import BatchError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.placement.light_changes import read_placement
from lightpaint.progress import Interrupted, Listener

LOOKS = """
[defaults]
scene = "room.xml"
share = "places"
want = ["solve", "predict", "report"]
[defaults.settings]
spp = 64
space = "linear"
hold = 0

[[look]]
paintings = ["day.exr", "night.exr"]
variations = ["warmer"]

[[sequence]]
name = "dusk"
through = ["day", "night"]
frames = 2
"""

NAMES = ["day", "night", "day-warmer", "night-warmer", "dusk-0", "dusk-1"]

#: Where the spot points in the paintings.
THERE = lp.Pose(target=(-0.6, 0, -0.3))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A room whose spot may turn, and two paintings of it, turned: a bright and a dark one."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    scene = lp.load_scene(write_room(tmp_path))
    (tmp_path / "room.lights.toml").write_text("[light.beam]\naim = 60\n", encoding="utf-8")
    basis = lp.render_basis(scene.moved({"beam": THERE}), spp=128, seed=2)
    for name, level in (("day", 4), ("night", 0.04)):
        weights = level * np.array([[1, 0.9, 0.8], [1, 1, 1], [3, 3, 3], [0, 0, 0], [0, 0, 0]])
        write_rgb(tmp_path / f"{name}.exr", basis.planes.mix(weights))
    (tmp_path / "looks.toml").write_text(LOOKS, encoding="utf-8")
    return tmp_path


class RemarkListener(Listener):
    """A listener that keeps the remarks of a batch and the labels of its progress."""

    def __init__(self) -> None:
        self.labels: list[str] = []
        self.remarks: list[str] = []

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        if done == 0:
            self.labels.append(label)

    def say(self, text: str) -> None:
        self.remarks.append(text)


def run_all(folder: Path, **options: Any) -> tuple[Any, RemarkListener]:
    listener = RemarkListener()
    return run_batch(
        plan_batch(folder / "looks.toml", folder / "out"), RunOptions(**options), listener
    ), listener


def directions(folder: Path) -> dict[str, np.ndarray]:
    """Where the spot of each look points."""
    directions_by_name = {}
    for name in NAMES:
        places = read_lighting(folder / "out" / name / "lighting.json").places
        [beam] = [place for place in places if place.name == "beam"]
        directions_by_name[name] = np.array(beam.site.direction)
    return directions_by_name


@pytest.mark.nightly
def test_looks_hang_their_lights_once_and_dim_them_each(folder: Path) -> None:
    outcome, listener = run_all(folder)
    assert sorted(outcome.done) == sorted(NAMES)
    assert listener.labels.count("poses") == 1
    # The basis of all lights, and once the plane of the spot.
    assert listener.labels.count("basis") == 2
    directions_by_name = directions(folder)
    painted = (
        lp.load_scene(folder / "room.xml").moved({"beam": THERE}).light("beam").members[0].site
    )
    assert all(
        np.array_equal(direction, directions_by_name["day"])
        for direction in directions_by_name.values()
    )
    assert np.dot(directions_by_name["day"], painted.direction) > np.cos(np.radians(5))
    day, night = (read_lighting(folder / "out" / x / "lighting.json") for x in ("day", "night"))
    assert night["beam"].emission[0] == pytest.approx(day["beam"].emission[0] / 100, rel=0.05)
    assert read_placement(folder / "out" / "places" / "day.json").looks == ("day", "night")
    remarks = [text for text in listener.remarks if "beam turned by" in text]
    assert len(remarks) == 1
    assert remarks[0].startswith("day, night: ")
    # The gallery shows the plan once, and each report says who shares the places.
    page = (folder / "out" / "index.html").read_text(encoding="utf-8")
    assert page.count("Plan and elevation of the room") == 1
    assert "day and night share places" in page
    for name in ("day", "night"):
        report = json.loads((folder / "out" / name / "report.json").read_text(encoding="utf-8"))
        assert report["placement"]["looks"] == ["day", "night"]
    # Nothing is left to do; another painting of one look moves the lights of all.
    write_rgb(folder / "night.exr", np.full((20, 24, 3), 0.01, np.float32))
    second_outcome, listener = run_all(folder)
    assert sorted(second_outcome.done) == sorted(NAMES)
    assert listener.labels.count("poses") == 1


@pytest.mark.nightly
def test_places_that_were_found_are_not_searched_for_again(folder: Path) -> None:
    """A batch that was stopped after its search goes on from there."""
    first = plan_batch(folder / "looks.toml", folder / "out")
    run_batch(first.select("day"), RunOptions(shares_folder=True))
    outcome, listener = run_all(folder)
    assert "poses" not in listener.labels
    assert sorted(outcome.done) == sorted(set(NAMES) - {"day"})
    # Half a file counts as none.
    (folder / "out" / "places" / "day.json").write_text('{"moves": [', encoding="utf-8")
    assert plan_batch(folder / "looks.toml", folder / "out").groups[0].read_record() is None


@pytest.mark.nightly
def test_workers_place_as_one_process_does(folder: Path) -> None:
    run_all(folder)
    reference_directions = directions(folder)
    (folder / "out").rename(folder / "alone")
    run_all(folder, workers=2)
    assert all(
        np.array_equal(reference_directions[name], direction)
        for name, direction in directions(folder).items()
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('share = "places"', 'share = "levels"'), r"share is 'levels': expected \"places\""),
        (("spp = 64", "spp = 64\nmove_lights = false"), "move_lights is false"),
        (('"predict", "report"]', '"lights"]'), "want has 'lights'"),
        (('share = "places"', 'share = "places"\nuse_lights_file = false'), "no light may move in"),
        (("[[look]]", '[[look]]\npainting = "day.exr"\nname = "x"\nsettings.seed = 1\n[[look]]'),
         "x and day share places, and seed is 1 in one and 0 in the other"),
        (("[[look]]", '[[look]]\nlighting = "a/lighting.json"\nshare = "places"\n[[look]]'),
         "its lighting is given"),
    ],
)  # fmt: skip
def test_looks_that_cannot_share_places(folder: Path, change: tuple[str, str], words: str) -> None:
    text = LOOKS.replace(*change, 1)
    (folder / "looks.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BatchError, match=words):
        plan_batch(folder / "looks.toml", folder / "out")


def test_a_job_with_places_is_sent_and_read_again(folder: Path) -> None:
    first = plan_batch(folder / "looks.toml", folder / "out")
    [task] = [x.steps[0].task for x in first.looks if x.entry.name == "day"]
    moved_task = with_paths(task, lambda text: text.replace(str(folder), "/elsewhere"))
    assert moved_task.places == "/elsewhere/out/places/day.json"
    assert json.loads(moved_task.job)["placement"] == {"path": moved_task.places}


def test_an_interrupt_amid_the_search_leaves_no_places(folder: Path) -> None:
    class Stopped(RemarkListener):
        def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
            if label == "poses" and done:
                raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="6 looks are left; run the same command to continue"):
        run_batch(plan_batch(folder / "looks.toml", folder / "out"), RunOptions(), Stopped())
    assert not (folder / "out" / "places").exists()
    assert len(plan_batch(folder / "looks.toml", folder / "out").chosen_looks) == len(NAMES)
