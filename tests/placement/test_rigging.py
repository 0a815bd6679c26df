"""Keys that let lights move: a wrong value is refused in one line that names file and key."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.errors import ConstraintError, LightpaintError
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.placement.applied_rigging import freedoms_of
from lightpaint.placement.rigging import rigging_of
from lightpaint.scene.lights.lights_file import read_lights_file
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

SHEET = """
[light.beam]
aim = 30
cone = [10, 45]
kelvin = [2700, 4000]
move = { on = "track" }
[light."bul*"]
move = 0.5
[on.track]
line = [[-1.0, 1.8, 0.0], [1.0, 1.8, 0.0]]
[on.ceiling]
shapes = ["wall"]
clear = 0.1
[[new]]
kind = "spot"
count = 3
on = ["track", "ceiling"]
aim = true
apart = 0.5
in_view = false
kelvin = [2700, 4000]
[[pair]]
lights = ["beam", "bulb"]
mirror = "x = 0"
"""


def sheet(folder: Path, text: str) -> lp.Rigging:
    """The rigging of a lights file with that text."""
    path = folder / "room.lights.toml"
    path.write_text(text, encoding="utf-8")
    return rigging_of(read_lights_file(path).requests)


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path), use_lights_file=False)


def test_a_sheet_is_read_whole_and_its_constraints_stay_constraints(tmp_path: Path) -> None:
    rigging = sheet(tmp_path, SHEET)
    assert [name for name, _, _ in rigging.lights] == ["bul*", "beam"]
    assert dict(rigging.lights[1][1]) == {
        "aim": 30, "cone": [10, 45], "move": {"on": "track"}
    }  # fmt: skip
    assert [name for name, _, _ in rigging.on] == ["track", "ceiling"]
    assert rigging.new[0][0]["count"] == 3
    assert rigging.pairs[0][0]["mirror"] == "x = 0"
    constraints = constraints_of(read_lights_file(tmp_path / "room.lights.toml").requests)
    assert [(name, dict(table)) for name, table, _ in constraints.lights] == [
        ("beam", {"kelvin": [2700, 4000]})
    ]


def test_freedoms_follow_from_names_and_patterns(room: Scene) -> None:
    rigging = lp.Rigging.of(
        {
            "b*": {"aim": 20, "move": 0.5},
            "beam": {"move": {"on": "track"}},
            "bulb": {"move": {"along": [0, 0, 2], "within": 0.25}},
        },
        on={"track": {"line": [[-1, 1.8, 0], [1, 1.8, 0]]}},
    )
    # `aim` of the pattern is for the spot alone: the bulb points nowhere.
    with pytest.raises(ConstraintError, match=r"light\.\*ulb\.aim: light 'bulb' has no direction"):
        freedoms_of(lp.Rigging.of({"*ulb": {"aim": 20}}), room)
    freedoms = freedoms_of(rigging, room)
    assert freedoms["beam"] == lp.Freedom(rails=(((-1, 1.8, 0), (1, 1.8, 0)),), aim=20)
    assert freedoms["bulb"].line is not None
    np.testing.assert_allclose(freedoms["bulb"].line, [(-0.5, 1, 0.25), (-0.5, 1, 0.75)])


def test_the_later_of_two_sources_wins_key_by_key(room: Scene) -> None:
    file = lp.Rigging.of({"beam": {"aim": 20, "cone": [10, 30]}}, where="file")
    options = lp.Rigging.of({"beam": {"aim": True, "beam": [5, 9]}}, where="line")
    assert freedoms_of(file.and_then(options), room) == {
        "beam": lp.Freedom(aim=True, cone=(10, 30), beam=(5, 9))
    }
    assert file.and_then(file.and_then(options)) == file.and_then(options)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[light.beam]\naim = 0", "light.beam.aim is 0: expected degrees"),
        ("[light.beam]\naim = nan", "light.beam.aim is nan: expected degrees"),
        ("[light.beam]\naim = 'much'", "light.beam.aim is 'much'"),
        ("[light.beam]\ncone = [40, 10]", r"light.beam.cone is \[40, 10\]: expected two angles"),
        ("[light.beam]\ncone = 40", "light.beam.cone is 40"),
        ("[light.beam]\nbeam = [20, 5]", r"light.beam.beam is \[20, 5\]: expected two angles"),
        ("[light.beam]\nbeam = 'soft'", "light.beam.beam is 'soft': expected two angles"),
        ("[[new]]\nkind = 'panel'\nbeam = true", "new has the key 'beam': a panel has none"),
        ("[light.beam]\nmove = -1", "light.beam.move.within is -1: expected a distance"),
        ("[light.beam]\nmove = true", "light.beam.move is True: expected a distance"),
        ("[light.beam]\nmove = {}", "light.beam.move has nothing: expected one of"),
        ("[light.beam]\nmove = { within = 1, on = 'x' }", "has within and on: expected one of"),
        ("[light.beam]\nmove = { along = [0, 0, 1] }", "has along: expected one of"),
        ("[light.beam]\nmove = { along = [0, 0, 0], within = 1 }", "expected a direction"),
        ("[light.beam]\nmove = { box = [[0, 0], [1, 1]] }", "expected two corners"),
        ("[light.beam]\nmove = { box = [[0, 0, inf], [1, 1, 1]] }", "expected two corners"),
        ("[light.beam]\nmove = { upon = 'x' }", "light.beam.move has the key 'upon'"),
        ("[light.beam]\nmoves = 1", "known are lock.*move, aim, cone"),
        ("[on.track]\nline = [[0, 0, 0], [0, 0, 0]]", "on.track.line is .*two different points"),
        ("[on.track]\nclear = 1", "on.track has neither line nor shapes"),
        ("[on.x]\nshapes = ['a']\nclear = -1", "on.x.clear is -1"),
        ("[on.x]\nline = [[0,0,0],[1,0,0]]\nshapes = ['a']", "on.x has both line and shapes"),
        ("[on.x]\nshapes = []", r"on.x.shapes is \[\]: expected a name"),
        ("on = 3", r"on is 3: expected tables \[on.NAME\]"),
        ("new = 3", r"new is 3: expected tables \[\[new\]\]"),
        ("[[new]]\ncount = 2", "new has neither kind nor like"),
        ("[[new]]\nkind = 'lamp'", "new.kind is 'lamp': expected one of point, spot, panel"),
        ("[[new]]\nkind = 'spot'\ncount = 0", "new.count is 0: expected a whole number"),
        ("[[new]]\nkind = 'spot'\napart = nan", "new.apart is nan"),
        ("[[new]]\nkind = 'spot'\nin_view = 1", "new.in_view is 1: expected true or false"),
        ("[[new]]\nkind = 'point'\naim = true", "a point light points nowhere"),
        ("[[new]]\nkind = 'panel'\nsize = [1]", "new.size is .*the smallest and the largest side"),
        ("[[new]]\nkind = 'spot'\nkelvin = 1", "new.kelvin"),
        ("[[new]]\nkind = 'spot'\n[[new]]\nkind = 'x'", "new 2.kind is 'x'"),
        ("[[new]]\nkind = 'spot'\nlock = true", "new has the key 'lock'"),
        ("[[pair]]\nlights = ['a', 'a']\nmirror = 'x = 0'", "pair.lights is .*two lights"),
        ("[[pair]]\nlights = ['a', 'b']\nmirror = 'w = 0'", "pair.mirror is 'w = 0'"),
        ("[[pair]]\nlights = ['a', 'b']\nmirror = 'x = nan'", "pair.mirror is 'x = nan'"),
        ("[[pair]]\nlights = ['a', 'b']", 'pair.mirror is None: expected a plane like "x = 0"'),
    ],
)
def test_a_wrong_value_is_one_line_with_its_file_and_key(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "room.lights.toml"
    path.write_text(text, encoding="utf-8")

    def read() -> None:
        rigging_of(read_lights_file(path).requests)
        constraints_of(read_lights_file(path).requests)

    with pytest.raises(LightpaintError, match=words) as refusal:
        read()
    assert "room.lights.toml" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("lights", "words"),
    [
        ({"lamp": {"aim": 10}}, "light.lamp.aim: no light 'lamp'; there are panel, bulb"),
        ({"beem": {"aim": 10}}, "did you mean 'beam'"),
        ({"sky": {"move": 1}}, "light.sky.move: light 'sky' is of the kind constant"),
        ({"bulb": {"cone": [10, 20]}}, "light.bulb.cone: light 'bulb' has no cone"),
        ({"beam": {"move": {"on": "track"}}}, r"move.on: no rail, surface or shape 'track'"),
    ],
)
def test_what_cannot_move_says_so(
    room: Scene, lights: dict[str, dict[str, Any]], words: str
) -> None:
    with pytest.raises(ConstraintError, match=words):
        freedoms_of(lp.Rigging.of(lights), room)
