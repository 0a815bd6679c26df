"""New lights that a painting asks for are found, under all that was asked of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from renderer import write_room

import lightpaint as lp
from lightpaint.errors import SceneError
from lightpaint.pipeline.look import spoken_change
from lightpaint.placement.free_space import seen_by_camera
from lightpaint.placement.new_lights import Mirror
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

THERE = (0.45, 1.2, 0.5)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("room")))


@pytest.fixture(scope="module")
def basis(room: Scene) -> lp.Basis:
    return lp.render_basis(room, spp=256, seed=1)


def solved(basis: lp.Basis, painted: Scene) -> lp.Solution:
    goal = lp.render_basis(painted, spp=256, seed=2).current_look
    return lp.solve(basis, lp.Target.of(goal), space="linear", hold=0)


def emitter(kind: Any, **options: Any) -> NewEmitter:
    target = None if kind == "point" else (-0.5, 0.0, -0.2)
    return NewEmitter("true", kind, lp.Pose(position=THERE, target=target), **options)


def place_of(light: lp.AddedLight) -> Any:
    return np.array(light.site.position, dtype=float)


def test_a_missing_point_is_found_with_its_colour(room: Scene, basis: lp.Basis) -> None:
    painted = room.with_new_emitters([emitter("point", emission=(1.5, 1.0, 0.5))])
    placement = lp.place(
        room, basis, solved(basis, painted), new=[lp.NewLights("point", name="key")]
    )
    [light] = placement.additions
    assert light.name == "key_1"
    assert place_of(light) == pytest.approx(THERE, abs=0.06)
    assert light.emitter.emission == pytest.approx((1.5, 1.0, 0.5), rel=0.15)
    assert light.flux == pytest.approx(tuple(4 * np.pi * x for x in light.emitter.emission))
    assert placement.missed_after < 0.1 * placement.missed_before
    assert [x.name for x in placement.scene.emitters][-1] == "key_1"
    assert light.place_error is not None
    assert light.place_error < 0.1
    assert not light.is_hardly_visible
    assert "a new point at (0.4" in str(light)


@pytest.mark.nightly
def test_a_missing_spot_is_found_with_its_cone(room: Scene, basis: lp.Basis) -> None:
    pose = lp.Pose(position=THERE, target=(-0.5, 0.0, -0.2), cutoff=28, beam=14)
    true = NewEmitter("true", "spot", pose, emission=(8, 8, 8))
    painted = room.with_new_emitters([true])
    new = lp.NewLights("spot", count=1, freedom=lp.Freedom(line=((-1, 1.2, 0.5), (1, 1.2, 0.5))))
    placement = lp.place(room, basis, solved(basis, painted), new=[new])
    [light] = placement.additions
    assert light.name == "new"
    assert place_of(light) == pytest.approx(THERE, abs=0.06)
    assert np.dot(light.site.direction or (), true.site.direction or ()) > np.cos(np.radians(4))
    assert light.site.cutoff == pytest.approx(28, abs=3)
    assert placement.missed_after < 0.1 * placement.missed_before


@pytest.mark.nightly
def test_a_panel_is_found_by_its_flux(room: Scene, basis: lp.Basis) -> None:
    pose = lp.Pose(position=(0.4, 2.1, 0.9), target=(-0.2, 0.0, -0.2))
    true = NewEmitter("true", "panel", pose, size=(0.4, 0.4), emission=(60, 60, 60))
    painted = room.with_new_emitters([true])
    new = lp.NewLights("panel", count=1, size=(0.2, 0.8))
    placement = lp.place(room, basis, solved(basis, painted), new=[new])
    [light] = placement.additions
    assert placement.missed_after < 0.15 * placement.missed_before
    # What arrives in the picture is told better than distance and size.
    away = [
        np.linalg.norm(np.subtract(x, (0, 0, 0))) for x in (light.site.position, true.pose.position)
    ]
    assert light.flux[1] / away[0] ** 2 == pytest.approx(60 * 0.16 * np.pi / away[1] ** 2, rel=0.2)
    [panel] = [x for x in placement.scene.emitters if x.name == "new"]
    assert panel.plugin == "area"


@pytest.mark.nightly
@pytest.mark.parametrize("in_view", [None, True])
def test_a_panel_is_hung_in_the_picture_only_on_request(
    room: Scene, basis: lp.Basis, in_view: bool | None
) -> None:
    """The painting has one that the camera sees; a person rather paints its light on walls."""
    pose = lp.Pose(position=(-0.3, 1.2, 0.3), target=(-0.1, 0.9, 2.0))
    true = NewEmitter("true", "panel", pose, size=(0.3, 0.3), emission=(60, 60, 60))
    painted = room.with_new_emitters([true])
    new = lp.NewLights("panel", count=1, in_view=in_view)
    placement = lp.place(room, basis, solved(basis, painted), new=[new])
    places = np.array([place_of(light) for light in placement.additions]).reshape(-1, 3)
    seen = room.while_loaded(lambda loaded: seen_by_camera(room, loaded, places))
    assert seen.tolist() == ([True] if in_view else [False] * len(places))


@pytest.mark.nightly
def test_nothing_is_added_where_nothing_is_missed(room: Scene, basis: lp.Basis) -> None:
    placement = lp.place(room, basis, solved(basis, room), new=[lp.NewLights("point")])
    assert placement.additions == ()
    assert placement.scene is room


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("freedom", "distance"),
    [
        nightly(lp.Freedom(surfaces=("wall",), clear=0.2), lambda p: p[2] - (-1 + 0.2)),
        nightly(
            lp.Freedom(rails=(((-1, 1.4, 0.5), (1, 1.4, 0.5)), ((-1, 1.4, 0.5), (-1, 1.4, -0.5)))),
            lambda p: p[1] - 1.4,
        ),
        (lp.Freedom(rails=(((-1, 1.4, 0.5), (1, 1.4, 0.5)),), surfaces=("wall",), clear=0.2), None),
    ],
)
def test_new_lights_hang_where_they_may(
    room: Scene, basis: lp.Basis, freedom: lp.Freedom, distance: Any
) -> None:
    true_emitter = NewEmitter(
        "true", "point", lp.Pose(position=(-0.4, 1.3, -0.6)), emission=(2, 2, 2)
    )
    painted = room.with_new_emitters([true_emitter])
    new = lp.NewLights("point", count=1, freedom=freedom)
    placement = lp.place(room, basis, solved(basis, painted), new=[new])
    [light] = placement.additions
    place = place_of(light)
    offs = [place[2] + 0.8, np.hypot(place[1] - 1.4, place[2] - 0.5)]
    deviation = distance(place) if distance else min(offs, key=abs)
    assert deviation == pytest.approx(0, abs=1e-6)


@pytest.mark.nightly
def test_constraints_out_of_view_and_distance_hold(room: Scene, basis: lp.Basis) -> None:
    others = [
        NewEmitter(f"true_{k}", "point", lp.Pose(position=(x, 1.4, 0.3)), emission=(1, 1, 1))
        for k, x in enumerate((-0.8, -0.5))
    ]
    solution = solved(basis, room.with_new_emitters(others))
    new = lp.NewLights("point", count=2, apart=0.8, in_view=False, name="rim")
    constraints = lp.Constraints.of({"rim_*": {"color": "3000K", "limits": {"max": 0.7}}})
    placement = lp.place(room, basis, solution, new=[new], constraints=constraints)
    assert placement.additions
    warm = lp.Constraints.of({"bulb": {"color": "3000K"}})
    bulb = lp.solve(basis, solution.problem.views.targets[0], constraints=warm, space="linear")
    colour = np.array(bulb.lighting.emission["bulb"])
    for light in placement.additions:
        emission = np.array(light.emitter.emission)
        assert light.seen_at is None or is_hidden(room, place_of(light))
        assert emission @ (0.2126, 0.7152, 0.0722) <= 0.7 + 1e-6
        assert emission / emission[1] == pytest.approx(colour / colour[1], rel=1e-4)
    places = [place_of(light) for light in placement.additions]
    if len(places) == 2:
        assert np.linalg.norm(places[0] - places[1]) >= 0.8 - 1e-9


def is_hidden(scene: Scene, place: Any) -> bool:
    """Whether a surface lies between the camera and a place, which it then does not see."""
    import mitsuba as mi

    loaded = scene.load()
    eye = np.array(scene.eye(loaded), dtype=float).ravel()
    away = place - eye
    ray = mi.Ray3f(mi.Point3f(*map(float, eye)), mi.Vector3f(*map(float, away)))
    hit = loaded.ray_intersect(ray)
    return bool(np.array(hit.t)[0] < 0.999)


@pytest.mark.nightly
def test_new_lights_are_like_one_of_the_scene(room: Scene, basis: lp.Basis) -> None:
    painted = room.with_new_emitters([emitter("spot", emission=(9, 9, 9))])
    new = lp.NewLights(like="beam", count=1, name="beam")
    placement = lp.place(room, basis, solved(basis, painted), new=[new])
    [light] = placement.additions
    assert light.name == "beam_1"
    assert light.emitter.kind == "spot"
    assert light.site.cutoff == pytest.approx(30)


@pytest.mark.nightly
def test_a_pair_stays_a_mirror_image(tmp_path: Path) -> None:
    pair_text = """
    <emitter type="point" id="left"><point name="position" x="-0.6" y="1.3" z="0.3"/>
        <rgb name="intensity" value="0.5"/></emitter>
    <emitter type="point" id="right"><point name="position" x="0.6" y="1.3" z="0.3"/>
        <rgb name="intensity" value="0.5"/></emitter>"""
    path = write_room(tmp_path)
    path.write_text(path.read_text().replace("</scene>", pair_text + "</scene>"))
    scene = load_scene(path)
    poses = {"left": lp.Pose(position=(-0.9, 0.9, 0.5)), "right": lp.Pose(position=(0.9, 0.9, 0.5))}
    basis = lp.render_basis(scene, spp=256, seed=1)
    solution = solved(basis, scene.moved(poses))
    free = {"left": lp.Freedom(within=0.8)}
    placement = lp.place(scene, basis, solution, free, pairs=[lp.MirroredPair(("left", "right"))])
    assert {move.name for move in placement.moves} == {"left", "right"}
    sites = [placement.scene.light(name).members[0].site for name in ("left", "right")]
    a, b = (np.array(site.position, dtype=float) for site in sites)
    assert a * (-1, 1, 1) == pytest.approx(b, abs=1e-6)
    assert a == pytest.approx((-0.9, 0.9, 0.5), abs=0.08)
    # What both remove is told once.
    leader, image = placement.moves
    assert (leader.name, leader.mirrors, image.mirrors) == ("left", "", "left")
    assert image.gain_share == leader.gain_share
    for tell in (str, spoken_change):
        assert "of what was missed" in tell(leader)
        assert "of what was missed" not in tell(image)
        assert "the mirror image of left, whose gain is for both" in tell(image)


def test_mirrors() -> None:
    mirror = Mirror.of(" y = -1.5 ")
    rng = np.random.default_rng(3)
    for place in rng.normal(size=(20, 3)):
        assert mirror.place(mirror.place(place)) == pytest.approx(place)
        middle = (place + mirror.place(place)) / 2
        assert middle[1] == pytest.approx(-1.5)
    assert str(mirror) == "y = -1.5"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"kind": "lamp"}, "of the kind 'lamp'"),
        ({"count": 0}, "count is 0"),
        ({"count": 2.5}, "count is 2.5"),
        ({"count": True}, "count is True"),
        ({"apart": -1}, "apart is -1"),
        ({"apart": np.nan}, "apart is nan"),
        ({"name": ""}, "name is ''"),
        ({"freedom": lp.Freedom(within=1)}, "no place yet"),
        ({"freedom": lp.Freedom(aim=True)}, "a new point has no direction"),
        ({"freedom": lp.Freedom(cone=(10, 20))}, "a new point has no cone"),
        ({"kind": "spot", "freedom": lp.Freedom(aim=20)}, "unless they are like one"),
        ({"size": (1, 2)}, "a new point has no size"),
        ({"kind": "panel", "size": (2, 1)}, r"size is \(2, 1\)"),
        ({"kind": "panel", "size": 3}, "size is 3"),
    ],
)
def test_new_lights_that_mean_nothing(values: Mapping[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        lp.NewLights(**values)


@pytest.mark.parametrize(
    ("lights", "mirror", "words"),
    [
        (("a", "a"), "x = 0", "names of two lights"),
        (("a",), "x = 0", "names of two lights"),
        ("ab", "x = 0", "names of two lights"),
        (("a", "b"), "w = 0", "a plane like"),
        (("a", "b"), "x = nan", "a plane like"),
        (("a", "b"), 3, "a plane like"),
    ],
)
def test_pairs_that_mean_nothing(lights: Any, mirror: Any, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        lp.MirroredPair(lights, mirror)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"new": [lp.NewLights(like="lamp")]}, "no light 'lamp'"),
        ({"new": [lp.NewLights(like="sky")]}, "'sky' is not one"),
        (
            {"new": [lp.NewLights(freedom=lp.Freedom(surfaces=("attic",)))]},
            "no shape 'attic' to hang lights on: it has floor",
        ),
        (
            {"new": [lp.NewLights(freedom=lp.Freedom(surfaces=("ball",)))]},
            "'ball' is neither",
        ),
        (
            {"new": [lp.NewLights(freedom=lp.Freedom(box=((0.2, 0.2, 0.1), (0.4, 0.4, 0.3))))]},
            "'new_1' has no free place",
        ),
        (
            {"new": [lp.NewLights(freedom=lp.Freedom(box=((0, -3, 0), (1, -2, 1))))]},
            "'new_1' has no free place",
        ),
        ({"pairs": [lp.MirroredPair(("bulb", "lamp"))]}, "no light 'lamp'"),
        ({"pairs": [lp.MirroredPair(("bulb", "beam"))]}, "of two kinds"),
    ],
)
def test_what_cannot_be_placed(
    room: Scene, basis: lp.Basis, arguments: dict[str, Any], words: str
) -> None:
    solution = lp.solve(basis, lp.Target.of(basis.current_look), space="linear", hold=0)
    with pytest.raises(SceneError, match=words):
        lp.place(room, basis, solution, **arguments)


def test_a_camera_that_sees_nothing(basis: lp.Basis, tmp_path: Path) -> None:
    path = write_room(tmp_path)
    path.write_text(path.read_text().replace('target="0 0.8 0"', 'target="0 0.8 9"'))
    solution = lp.solve(basis, lp.Target.of(basis.current_look), space="linear", hold=0)
    with pytest.raises(SceneError, match="sees nothing that light falls on"):
        lp.place(load_scene(path), basis, solution, new=[lp.NewLights("point")])
