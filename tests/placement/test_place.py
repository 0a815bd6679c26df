"""Places, directions and cones that a painting asks for are found; noise asks for none."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.errors import SceneError
from lightpaint.pipeline.look import spoken_move
from lightpaint.placement.freedom import FreeLight
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.pose import Site
from lightpaint.scene.scene_reader import load_scene

LINE = ((-1.0, 1.5, 0.0), (1.0, 1.5, 0.0))


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def placed(
    room: Scene, painted: Scene, freedoms: Mapping[str, lp.Freedom], seed: int = 0
) -> lp.Placement:
    """The placement for a picture of `painted`, which another seed rendered."""
    basis = lp.render_basis(room, spp=256, seed=1)
    goal = lp.render_basis(painted, spp=256, seed=2).current_look
    solution = lp.solve(basis, lp.Target.of(goal), space="linear", hold=0)
    return lp.place(room, basis, solution, freedoms, seed=seed)


def angle(one: Site, other: Site) -> float:
    """Degrees between the directions of two sites."""
    a, b = (np.array(x.direction, dtype=float) for x in (one, other))
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def test_a_lamp_is_found_where_the_painting_has_it(room: Scene) -> None:
    position = (0.3, 1.3, 0.2)
    painted = room.moved({"bulb": lp.Pose(position=position)})
    placement = placed(room, painted, {"bulb": lp.Freedom(within=1.5)})
    assert [move.name for move in placement.moves] == ["bulb"]
    assert placement.moves[0].new.position == pytest.approx(position, abs=0.1)
    assert placement.missed_after < 0.3 * placement.missed_before
    site = placement.scene.light("bulb").members[0].site
    assert site.position == pytest.approx(placement.moves[0].new.position, rel=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize("spp", [64, 512])
def test_the_error_of_a_place_is_its_scatter_over_paintings(tmp_path: Path, spp: int) -> None:
    """Over renders that are paintings, bases and paths, each with another seed."""
    path = write_room(tmp_path)
    film = '<integer name="height" value="60"/><rfilter type="box"/>'
    text = path.read_text().replace('value="24"', 'value="80"')
    path.write_text(text.replace('<integer name="height" value="20"/>', film))
    room, seeds, rows = load_scene(path), 8, []
    painted = room.moved({"bulb": lp.Pose(position=(0.3, 1.3, 0.2))})
    for seed in range(seeds):
        basis = lp.render_basis(room, spp=128, seed=seed)
        goal = lp.render_basis(painted, spp=spp, seed=seeds + seed).current_look
        solution = lp.solve(basis, lp.Target.of(goal), space="linear", hold=0)
        freedom = {"bulb": lp.Freedom(within=1.5)}
        [move] = lp.place(room, basis, solution, freedom, seed=seed).moves
        rows.append((*(move.new.position or ()), move.place_error))
    x, y, z, errors = np.array(rows, dtype=float).T
    scatter = sum(np.var(its, ddof=1) for its in (x, y, z))
    # The standard error of `seeds` places along the two axes that are told least, and of as many
    # error bars, which few pixels of a highlight and few fits tell.
    tolerance = 4 * np.sqrt(2 / (2 * (seeds - 1)) + 2 / (10 * seeds))
    assert abs(np.log(np.mean(np.square(errors)) / scatter)) < tolerance


@pytest.mark.nightly
def test_a_search_that_is_enough_ends_with_the_best_so_far(room: Scene) -> None:
    """After a few trials of the first light, which nothing but those has come nearer by."""
    painted = room.moved({"bulb": lp.Pose(position=(0.3, 1.3, 0.2))})
    basis = lp.render_basis(room, spp=64, seed=1)
    goal = lp.render_basis(painted, spp=64, seed=2).current_look
    solution = lp.solve(basis, lp.Target.of(goal), space="linear", hold=0)
    freedoms = {name: lp.Freedom(within=1.5) for name in ("bulb", "beam")}
    tried: list[dict[str, Site]] = []

    def search(most: int) -> lp.Placement:
        tried.clear()
        return lp.place(
            room,
            basis,
            solution,
            freedoms,
            watch=lambda sites: tried.append(dict(sites)),
            is_enough=lambda: len(tried) >= most,
        )

    early = search(4)
    assert len(tried) == 4
    assert early.missed_after <= early.missed_before
    assert all(move.place_error is None for move in early.moves)
    assert search(0).moves == ()
    assert tried == []


@pytest.mark.nightly
def test_a_panel_is_found_where_the_painting_has_it(tmp_path: Path) -> None:
    """A long one, so that its outline counts; the camera sees it, and what it hides."""
    path = write_room(tmp_path)
    path.write_text(path.read_text().replace('<scale value="0.3"/>', '<scale x="0.5" y="0.2"/>'))
    room = load_scene(path)
    there = lp.Pose(position=(0.5, 1.5, -0.3), target=(0.2, 0, 0))
    painted = room.moved({"panel": there})
    placement = placed(room, painted, {"panel": lp.Freedom(within=1.0, aim=40)})
    [move] = placement.moves
    assert move.new.position == pytest.approx(there.position, abs=0.1)
    assert angle(move.new, painted.light("panel").members[0].site) < 6
    assert placement.missed_after < 0.3 * placement.missed_before
    site = placement.scene.light("panel").members[0].site
    assert site.position == pytest.approx(move.new.position, rel=1e-5)


def test_an_area_light_of_another_shape_stays(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    old = '<shape type="rectangle" id="panel"'
    path.write_text(path.read_text().replace(old, '<shape type="cube" id="panel"'))
    room = load_scene(path).reduced("1/4")
    with pytest.raises(SceneError, match="'panel' is an area light, and only rectangles and disks"):
        placed(room, room, {"panel": lp.Freedom(within=1)})


@pytest.mark.nightly
def test_a_spot_is_turned_to_where_the_painting_has_its_beam(room: Scene) -> None:
    painted = room.moved({"beam": lp.Pose(target=(-0.6, 0, -0.3))})
    placement = placed(room, painted, {"beam": lp.Freedom(aim=True)})
    beam = painted.light("beam").members[0].site
    assert [move.name for move in placement.moves] == ["beam"]
    assert angle(placement.moves[0].new, beam) < 4
    assert f"turned by {placement.moves[0].turn:.0f}°" in str(placement.moves[0])
    [move] = placed(room, painted, {"beam": lp.Freedom(aim=10)}).moves
    assert move.is_turned_to_end
    assert "turned by 10° (as far as it may)" in str(move)


@pytest.mark.nightly
def test_nothing_moves_where_nothing_is_missed(
    room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does anybody take time for how certain the places of lights are that stay."""
    monkeypatch.setattr("lightpaint.placement.search.judgement.PlacementJudge.errors", None)
    free = {"bulb": lp.Freedom(within=0.5), "beam": lp.Freedom(aim=40), "sun": lp.Freedom(aim=20)}
    placement = placed(room, room, free)
    assert placement.moves == ()
    assert placement.scene is room
    assert placement.missed_after == placement.missed_before


@pytest.mark.parametrize(
    ("name", "freedom", "words"),
    [
        ("panel", lp.Freedom(cone=(10, 20)), "'panel' has no cone"),
        ("sky", lp.Freedom(aim=True), "'sky' is of the kind constant"),
        ("bulb", lp.Freedom(aim=10), "'bulb' has no direction"),
        ("bulb", lp.Freedom(cone=(10, 20)), "'bulb' has no cone"),
        ("bulb", lp.Freedom(beam=True), "'bulb' has no beam"),
        ("beam", lp.Freedom(beam=(50, 60)), "begins at 50 degrees, and its cone ends at 30: give"),
        ("sun", lp.Freedom(within=1), "'sun' has no place"),
        ("lamp", lp.Freedom(within=1), "no light 'lamp'"),
        (
            "bulb",
            lp.Freedom(box=((0, 0, -9), (1, 1, -8))),
            "^light 'bulb' has no free place that sees anything of the picture: give it more",
        ),
        ("bulb", lp.Freedom(line=((0.2, 0.3, 0.2), (0.4, 0.3, 0.2))), "'bulb' has no free place"),
    ],
)
def test_what_a_light_is_not_free_to_do(
    room: Scene, name: str, freedom: lp.Freedom, words: str
) -> None:
    with pytest.raises(SceneError, match=words):
        placed(room.reduced("1/4"), room.reduced("1/4"), {name: freedom})


@pytest.mark.nightly
def test_a_light_that_hangs_behind_the_wall_may_stay_there(tmp_path: Path) -> None:
    """Its own place counts as one: it is moved nowhere, and that is not an error."""
    hidden = LIGHTS["bulb"].replace('y="1" z="0.5"', 'y="1" z="-2"')
    room = load_scene(write_room(tmp_path, lights=hidden + LIGHTS["sky"])).reduced("1/4")
    assert placed(room, room, {"bulb": lp.Freedom(within=0.2)}).moves == ()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"within": -1}, "within is -1"),
        ({"within": np.nan}, "within is nan"),
        ({"aim": 200}, "aim is 200"),
        ({"cone": (30, 10)}, r"cone is \(30, 10\)"),
        ({"beam": (0.1, 10)}, r"beam is \(0.1, 10\): expected two angles, from 0.5 to 90 degrees"),
        ({"line": ((0, 0, 0), (0, 0, 0))}, "two different points"),
        ({"line": (0, 1)}, "two points of three numbers"),
        ({"box": ((0, 0), (1, 1))}, "two points of three numbers"),
        ({"within": 1, "line": LINE}, "within and line are given"),
    ],
)
def test_freedoms_that_mean_nothing(values: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        lp.Freedom(**values)


@pytest.mark.parametrize(
    "freedom",
    [
        lp.Freedom(within=0.7, aim=25, cone=(10, 40)),
        lp.Freedom(box=((-1, 1, -1), (1, 2, 0.5)), aim=True),
        lp.Freedom(line=LINE, cone=(15, 60)),
        lp.Freedom(line=LINE, cone=(15, 60), beam=True),
        lp.Freedom(cone=(10, 40), beam=(5, 20)),
        lp.Freedom(beam=(5, 20)),
        lp.Freedom(cone=(10, 40), beam=(22, 35)),
        lp.Freedom(aim=5),
    ],
)
def test_steps_stay_within_the_freedom(freedom: lp.Freedom) -> None:
    """Whatever the step: the pose is permitted, and is its own nearest permitted one."""
    start = Site(position=(0.5, 1.5, 0.0), direction=(0.0, -1.0, 0.0), cutoff=30.0, beam=20.0)
    light = FreeLight("spot", start, freedom)
    rng = np.random.default_rng(5)
    site = start
    for _ in range(200):
        site = light.stepped(site, rng.normal(size=sum(light.dimensions(site))))
        second_site = light.permitted(site)
        assert second_site.position == pytest.approx(site.position, abs=1e-9)
        assert second_site.direction == pytest.approx(site.direction, abs=1e-9)
        direction, place = (np.array(x, dtype=float) for x in (site.direction, site.position))
        assert np.linalg.norm(direction) == pytest.approx(1)
        assert angle(site, start) <= freedom.turn + 1e-4
        cutoff, beam = np.array([site.cutoff, site.beam], dtype=float)
        assert beam < cutoff
        if freedom.within is not None:
            assert np.linalg.norm(place - (0.5, 1.5, 0.0)) <= freedom.within + 1e-9
        if freedom.cone is not None:
            assert freedom.cone[0] <= cutoff <= freedom.cone[1]
        else:
            assert cutoff == 30
        if freedom.beams is not None:
            assert freedom.beams[0] <= beam <= freedom.beams[1]
        else:
            # The start's share, but for the least width of an edge.
            assert beam == pytest.approx(min(2 / 3 * cutoff, cutoff - 0.5))


@pytest.mark.parametrize(
    ("cone", "is_told"),
    [
        ((40, 12), True),
        ((20, 10), False),  # in proportion
        ((38, 20.2), False),  # nobody reads 20° (was 20°)
        ((40, 20), False),
    ],
)
def test_a_beam_is_told_that_changed_apart_from_its_cone(
    cone: tuple[float, float], is_told: bool
) -> None:
    old, new = (Site((0, 1, 0), (0, -1, 0), cutoff=a, beam=b) for a, b in ((40, 20), cone))
    move = lp.Move("spot", old, new, gain_share=0.1)
    assert ("beam 20° to 12°" in str(move)) == is_told
    assert ("its beam at 12° (was 20°)" in spoken_move(move)) == is_told
    assert ("beam" in spoken_move(move)) == is_told


@pytest.mark.parametrize(
    ("freedom", "is_slid_to_end", "is_turned_to_end"),
    [
        (lp.Freedom(within=0.2, aim=True), True, False),
        (lp.Freedom(within=0.6, aim=40), False, False),
        (lp.Freedom(within=0.405, aim=35.5), True, True),  # told as 0.4 and 35°, rounded
        (lp.Freedom(within=0.42, aim=37), False, False),
        (lp.Freedom(line=((0, 1, 0), (0.25, 1, 0)), aim=20), True, True),
        (lp.Freedom(line=((0, 1, 0), (0.9, 1, 0)), aim=30), False, True),
        (lp.Freedom(box=((-1, 1, -1), (1, 1, 1))), False, False),  # flat, so not at its edge
        (lp.Freedom(box=((-1, 1, -1), (0.2, 2, 1)), aim=50), True, False),
    ],
)
def test_a_freedom_that_ran_to_its_end_is_told(
    freedom: lp.Freedom, is_slid_to_end: bool, is_turned_to_end: bool
) -> None:
    """A spot that would slide by (0.4, 0, 0) and turn by 35° is taken to the nearest pose."""
    now = Site((0, 1, 0), (0, -1, 0), cutoff=30, beam=20)
    turn = np.radians(35)
    light = FreeLight("spot", now, freedom)
    pose = light.permitted(
        replace(now, position=(0.4, 1, 0), direction=(np.sin(turn), -np.cos(turn), 0))
    )
    assert light.is_slid_to_end(pose) is is_slid_to_end
    assert light.is_turned_to_end(pose) is is_turned_to_end
    assert not light.is_slid_to_end(now)
    move = lp.Move(
        "spot",
        now,
        pose,
        gain_share=0.1,
        place_error=0.01,
        turn_error=1.0,
        is_slid_to_end=is_slid_to_end,
        is_turned_to_end=is_turned_to_end,
    )
    for text in (spoken_move(move), str(move)):
        assert text.count("(as far as it may)") == is_slid_to_end + is_turned_to_end
    assert ("± 0.01 (as far as it may)" in spoken_move(move)) == is_slid_to_end


@pytest.mark.nightly
@pytest.mark.parametrize("edge", ["harder", nightly("softer")])
def test_a_beam_gets_the_edge_that_the_painting_has(room: Scene, edge: str) -> None:
    """A free beam is found; one that keeps its share of the cone is not."""
    now = room.light("beam").members[0].site
    assert now.cutoff is not None
    width = {"harder": 0.9, "softer": 0.2}[edge] * now.cutoff
    painted = room.moved({"beam": lp.Pose(beam=width)})
    placement = placed(room, painted, {"beam": lp.Freedom(beam=True)})
    [move] = placement.moves
    assert move.new.cutoff == now.cutoff
    assert move.new.beam == pytest.approx(width, abs=0.1 * now.cutoff)
    assert f"beam {now.beam:.0f}° to {move.new.beam:.0f}°" in str(move)
    # What is left is noise of the small picture.
    assert placement.missed_after < 0.75 * placement.missed_before
    shut = placed(room, painted, {"beam": lp.Freedom(aim=1)})
    assert shut.missed_after > 0.8 * shut.missed_before


def test_directions_cover_what_is_permitted_and_nothing_else() -> None:
    start = Site(position=(0, 1, 0), direction=(0.6, -0.8, 0.0), cutoff=30.0, beam=20.0)
    light = FreeLight("spot", start, lp.Freedom(aim=50))
    directions = light.directions(10)
    cosines = directions @ np.array(start.direction)
    assert cosines.min() >= np.cos(np.radians(50)) - 1e-12
    rng = np.random.default_rng(2)
    anywhere = rng.normal(size=(2000, 3))
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    permitted = anywhere[anywhere @ np.array(start.direction) >= np.cos(np.radians(45))]
    gaps = np.degrees(np.arccos(np.clip((permitted @ directions.T).max(axis=1), -1, 1)))
    assert gaps.max() < 10
