"""Lights that a session moves: poses in undo, looks and files, planes that renders have."""

import json
import math
import re
import shlex
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np
import pytest
from moving import MovingStudio, exact_answer, opened_rig, pixel_of, place_lights, stroke
from patience import PATIENCE_S
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.cli import main
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.errors import LightpaintError
from lightpaint.paint import protocol
from lightpaint.paint.rig import lamp_rig, page_geometry
from lightpaint.paint.rig.light_placer import SearchNotes
from lightpaint.paint.session.live_answer import changed_requests
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.scene.properties.pose import Site
from lightpaint.scene.scene_reader import load_scene

#: Where the bulb goes.
POSITION = [0.4, 1.2, 0.1]

#: Middle of the ball of the test room, which is .3 in radius.
BALL = (0.3, 0.3, 0.2)


@pytest.mark.parametrize(
    ("pose", "label"),
    [
        ({"target": [0.0, 0.0, 0.0]}, "aim beam"),
        ({"cutoff": 40.0, "beam": 30.0}, "cone of beam"),
        ({"position": POSITION}, "move beam"),
        ({"position": POSITION, "target": [0.0, 0.0, 0.0]}, "move beam"),
    ],
)
def test_a_step_is_named_by_what_it_changes(pose: Any, label: str) -> None:
    lights = Lights([BasisLight("beam", "spot", "intensity", "W/sr", (1.0, 1.0, 1.0), "")])
    requests, move = SessionRequests(), protocol.MoveLights({"beam": pose})
    assert changed_requests(requests, lights, move, lights.current_weights)[0] == label


def test_a_drag_that_is_cancelled_leaves_no_trace(moving: MovingStudio) -> None:
    session, before = moving.studio.session, moving.plane("bulb")
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}, is_final=False))
    assert not np.array_equal(moving.plane("bulb"), before)
    moving.send(protocol.MoveLights({}))
    assert np.array_equal(moving.plane("bulb"), before)
    assert (session.requests.poses, session.store.position) == ({}, 0)


def test_a_moved_light_has_the_plane_of_its_place(moving: MovingStudio) -> None:
    """At once about, and rendered soon; the other planes and the current look stay."""
    session = moving.studio.session
    before = {name: moving.plane(name) for name in session.basis.names}
    look = session.basis.current_look.copy()
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}, is_final=False))
    quick = moving.plane("bulb")
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.rendered()
    moved_scene = moving.scene.moved({"bulb": lp.Pose(position=POSITION)})
    truth = lp.render_basis(moved_scene, spp=512, seed=7).image("bulb")
    for plane, bound in ((quick, 0.15), (moving.plane("bulb"), 0.15)):  # noise of few samples
        assert np.square(plane - truth).sum() < bound * np.square(truth).sum()
        assert plane.mean() == pytest.approx(truth.mean(), rel=0.1)
    assert np.square(before["bulb"] - truth).sum() > 0.3 * np.square(truth).sum()
    for name in session.basis.names:
        if name != "bulb":
            assert np.array_equal(moving.plane(name), before[name])
    assert np.array_equal(session.basis.current_look, look)


@pytest.mark.nightly
def test_a_drag_computes_every_few_pixels_of_a_light_and_all_of_them_once_asked(
    moving: MovingStudio,
) -> None:
    """A draft has the very pixels of the whole plane, repeated; the page gets them without."""
    pictures: list[protocol.DraggedPlane] = []

    def receive(message: protocol.Message) -> None:
        if isinstance(message, protocol.DraggedPlane):
            pictures.append(message)

    def drag(position: list[float], step: int) -> np.ndarray:
        moving.send(
            protocol.MoveLights({"bulb": {"position": position}}, is_final=False, step=step)
        )
        return np.array(moving.plane("bulb"))

    moving.studio.on_message = receive
    whole = drag(POSITION, 1)
    drag([0.0, 1.0, 0.0], 3)
    draft = drag(POSITION, 3)
    parts = whole[::3, ::3]
    repeated = np.repeat(np.repeat(parts, 3, axis=0), 3, axis=1)[: len(whole), : whole.shape[1]]
    scale = whole.max()
    assert np.abs(draft - repeated).max() < 1e-5 * scale  # precision
    assert pictures[-1].step == 3
    assert pictures[-1].data.shape == parts.shape
    sent = pictures[-1].data.astype(np.float64)
    assert np.abs(sent / sent.max() - parts / parts.max()).max() < 2e-3  # of halves
    assert np.abs(drag(POSITION, 1) - whole).max() < 1e-5 * scale


@pytest.mark.nightly
def test_a_panel_of_the_scene_is_dragged_with_its_outline(moving: MovingStudio) -> None:
    """On release its plane is rendered with its shape, which its place in the file follows."""
    site = moving.scene.light("panel").members[0].site
    assert site.position is not None
    position = np.add(site.position, [0.4, -0.3, 0.2]).tolist()
    moving.send(protocol.MoveLights({"panel": {"position": position}}, is_final=False))
    quick = moving.plane("panel")
    moving.send(protocol.MoveLights({"panel": {"position": position}}))
    moving.rendered()
    rendered = moving.plane("panel")
    # The panel itself is seen, and brighter than all that it lights.
    assert np.square(quick - rendered).sum() < 0.1 * np.square(rendered).sum()
    lit = rendered < 0.5
    assert quick[lit].mean() == pytest.approx(rendered[lit].mean(), rel=0.15)  # few samples
    scene = moving.studio.rig.moved_scene(moving.studio.session.requests.placed)
    assert scene.light("panel").members[0].site.position == pytest.approx(position)


@pytest.mark.nightly
def test_a_receiver_with_a_lock_may_change_the_session_while_it_is_sent_planes(
    moving: MovingStudio,
) -> None:
    """As the notebook does: it takes its own lock, then that of the studio."""
    studio, lock = moving.studio, RLock()

    def receive(message: Any) -> None:
        with lock:
            moving.messages.append(message)

    studio.on_message = receive
    with lock:
        moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
        moving.wait(lambda: not studio.rig.unrendered(studio.session.requests.placed))
        for _ in range(10):  # meanwhile a thread offers what it has rendered
            time.sleep(0.1)
            assert studio._access.lock.acquire(timeout=PATIENCE_S)
            studio._access.lock.release()
    moving.rendered()


@pytest.mark.nightly
def test_undo_looks_and_the_file_know_places(moving: MovingStudio) -> None:
    session, at_rest = moving.studio.session, moving.plane("bulb")
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.rendered()
    moved_plane = moving.plane("bulb")
    moving.send(protocol.SaveLook("moved"))
    moving.send(protocol.Undo())
    assert session.requests.poses == {}
    assert np.array_equal(moving.plane("bulb"), at_rest)
    moving.send(protocol.Redo())
    assert np.array_equal(moving.plane("bulb"), moved_plane)
    moving.send(protocol.MoveLights({"bulb": {}}))
    assert np.array_equal(moving.plane("bulb"), at_rest)
    moving.send(protocol.LoadLook(1))
    assert session.requests.poses == {"bulb": {"position": POSITION}}
    assert np.array_equal(moving.plane("bulb"), moved_plane)
    moving.close()
    reopened = MovingStudio(moving.folder)
    try:
        assert reopened.studio.session.requests.poses == {"bulb": {"position": POSITION}}
        reopened.rendered()
        assert np.allclose(reopened.plane("bulb"), moved_plane)
    finally:
        reopened.close()


def test_the_scene_is_read_before_the_renderer_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """A painter of a kept basis has read no scene before, so that Mitsuba has no variant."""
    order = list[str]()

    class UnreadSubject:
        @property
        def loaded_scene(self) -> None:
            order.append("scene")

    @contextmanager
    def rendering() -> Iterator[None]:
        order.append("renderer")
        yield

    monkeypatch.setattr(page_geometry, "in_this_thread", rendering)
    monkeypatch.setattr(lamp_rig, "open_view", lambda *_: order.append("view"))
    lamp_rig.LampRig([UnreadSubject()]).open([None])  # type: ignore[list-item]
    assert order == ["scene", "renderer", "view"]


def test_a_drag_that_is_given_up_moves_nothing(moving: MovingStudio) -> None:
    before = moving.plane("bulb")
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}, is_final=False))
    assert not np.array_equal(moving.plane("bulb"), before)
    stroke(moving)
    assert np.array_equal(moving.plane("bulb"), before)
    assert moving.studio.session.requests.poses == {}


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_exports_and_verification_have_the_new_places(moving: MovingStudio) -> None:
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    stroke(moving)
    moving.send(protocol.Export(("lighting", "relit", "report")))
    exported = moving.wait(lambda: next((m for m in moving.messages if m.kind == "exported"), None))
    assert exported.fields["command"] == ""
    relit = load_scene(moving.folder / "relit.xml")
    assert relit.light("bulb").members[0].site.position == pytest.approx(POSITION)
    moving.send(protocol.Verify())
    verified = moving.wait(lambda: next((m for m in moving.messages if m.kind == "verified"), None))
    assert verified.fields["agrees"], verified.fields["text"]


IMPOSSIBLE: list[tuple[str, Any, str]] = [
    ("bulb", {"position": [math.nan, 0, 0]}, "bulb: position is (nan"),
    ("bulb", {"position": [1, 2]}, "expected three numbers"),
    ("bulb", {"position": "here"}, "expected three numbers"),
    ("bulb", {"height": 2}, "a pose has no 'height'"),
    ("bulb", {"target": [0, 0, 0]}, "points nowhere"),
    ("beam", {"cutoff": 120}, "cutoff is 120"),
    ("sun", {"position": [0, 1, 0]}, "infinitely far away"),
    ("sky", {"position": [0, 1, 0]}, "is of the kind constant"),
    ("ghost", {"position": [0, 1, 0]}, "no light is called 'ghost'"),
]


def test_poses_that_no_light_can_have(moving: MovingStudio) -> None:
    version = moving.studio.session.version
    for light, pose, text in IMPOSSIBLE:
        with pytest.raises(LightpaintError) as refusal:
            moving.send(protocol.MoveLights({light: pose}))
        assert text in str(refusal.value)
        assert "\n" not in str(refusal.value)
        session = moving.studio.session
        assert (session.version, session.requests.poses) == (version, {}), (light, pose)


def test_hostile_places_are_refused_in_one_line(moving: MovingStudio) -> None:
    """In one studio: none of them changes anything, as none of a valid place does after them."""
    moves: list[Any] = [
        protocol.MoveLights({"bulb": {"position": place}})
        for place in ([10**400, 0, 0], [1e300, 0, 0], [math.inf, 0, 0], [[1], 2, 3])
    ]
    beam_place = list(moving.scene.light("beam").members[0].site.position)
    moves += [protocol.MoveLights({"beam": x}) for x in ({"cutoff": 10**400}, {"cutoff": 0})]
    moves += [
        protocol.MoveLights({"beam": {"target": beam_place}}),
        protocol.MoveLights({"bulb": {"position": POSITION}}, view=7),
        protocol.MoveLights({"bulb": {"position": POSITION}}, is_final=False, view=-1),
        protocol.PointLight(99, "aim", (12.0, 12.0)),
        protocol.PointLight(-1, "aim", (12.0, 12.0)),
        protocol.AddLight("panel", position=(1e30, 0.0, 0.0)),
    ]
    version = moving.studio.session.version
    for move in moves:
        with pytest.raises(LightpaintError) as refusal:
            moving.send(move)
        assert "\n" not in str(refusal.value)
        assert len(str(refusal.value)) < 160
    assert (moving.studio.session.version, moving.studio.session.requests.placed) == (version, {})


@pytest.mark.nightly
def test_a_camera_that_sees_nothing_still_lets_lights_move(tmp_path: Path) -> None:
    """Their planes are black, and a search ends in one line."""
    path = write_room(tmp_path)
    text = re.sub(
        r'(<lookat origin=)"[^"]*" (target=)"[^"]*"',
        r'\1"0 60 0" \2"0 90 1"',
        path.read_text(),
        count=1,
    )
    path.write_text(text)
    moving = MovingStudio(tmp_path)
    try:
        stroke(moving)
        opened_rig(moving)
        moving.send(protocol.AddLight("spot", position=(0.0, 1.0, 0.0)))
        moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
        assert not moving.plane("bulb").any()
        assert not moving.plane("spot_1").any()
        moving.send(protocol.PlaceLights())
        assert "sees nothing that light falls on" in place_lights(moving)["text"]
    finally:
        moving.close()


def test_the_rig_says_where_lights_hang_and_what_cannot_move(moving: MovingStudio) -> None:
    rig = opened_rig(moving)
    places = dict(zip(moving.studio.session.basis.names, rig.lights, strict=True))
    assert places["bulb"].position == pytest.approx((-0.5, 1, 0.5))
    assert math.dist(places["beam"].target, BALL) == pytest.approx(0.3, abs=0.01)
    assert places["sky"].immovable_reason
    assert not places["panel"].immovable_reason
    assert places["sky"].immovable_reason
    assert rig.up == 1
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    last = moving.wait(lambda: [m for m in moving.messages if m.kind == "rig"][1:])[-1]
    assert last.lights[moving.light("bulb")].position == pytest.approx(POSITION)


def test_a_light_in_a_wall_is_told_of(moving: MovingStudio) -> None:
    """It may be meant, as on the way through one; undo brings it back."""
    moving.send(protocol.MoveLights({"bulb": {"position": [0, 1, -1.5]}}))
    notices = moving.wait(lambda: [m for m in moving.messages if m.kind == "notice"])
    assert notices[0].fields["text"].startswith("bulb lights nothing that is seen from there")


def point_light(moving: MovingStudio, name: str, click: Any, place: Any, **fields: Any) -> Any:
    """The place of a light after it was pointed by a click."""
    opened_rig(moving)
    light = moving.light(name)
    moving.send(protocol.PointLight(light, click, pixel_of(moving, place), **fields))
    return moving.studio.rig.state(moving.studio.session.requests.poses).lights[light]


def test_pages_see_points_where_the_camera_does(moving: MovingStudio) -> None:
    [camera] = opened_rig(moving).cameras
    axes = np.stack([camera.x_axis, camera.y_axis, camera.forward], axis=1)
    for point in ((0.3, 0.3, 0.2), (-0.5, 1, 0.5), (0.1, 1.2, -0.9)):
        x, y, s = np.linalg.solve(axes, np.array(point) - camera.origin)
        assert s > 0
        assert (x / s, y / s) == pytest.approx(pixel_of(moving, point), abs=1e-3)


def test_a_spot_is_aimed_at_what_was_clicked(moving: MovingStudio) -> None:
    place = point_light(moving, "beam", "aim", (-0.4, 0, 0.3))
    assert place.position == pytest.approx((0.8, 1.8, 1.5))
    assert place.target == pytest.approx((-0.4, 0, 0.3), abs=2e-3)


def test_a_highlight_is_the_mirrored_ray_of_the_eye(moving: MovingStudio) -> None:
    """On the floor: the mirror image of the eye, the place and the light are on one line."""
    floor_point = np.array([0.0, 0.0, 0.6])
    place = point_light(moving, "beam", "highlight", floor_point)
    mirrored_eye = np.array([0, -1, 3.5])
    way, towards = floor_point - mirrored_eye, np.array(place.position) - floor_point
    assert np.linalg.norm(np.cross(way, towards)) < 2e-3 * np.linalg.norm(way)
    assert way @ towards > 0
    assert place.target == pytest.approx(floor_point, abs=2e-3)


def test_a_shadow_ends_on_the_line_through_its_edge(moving: MovingStudio) -> None:
    edge, floor_point = np.array([0.3, 0.6, 0.2]), np.array([-0.6, 0, 0.6])
    pixel = pixel_of(moving, edge - (0, 0.01, 0))
    place = point_light(moving, "bulb", "shadow", floor_point, edge=pixel)
    line = np.array(place.position) - floor_point
    hit = BALL + 0.3 * (edge - BALL) / 0.3
    assert np.linalg.norm(np.cross(line, hit - floor_point)) < 0.12 * np.linalg.norm(
        line
    )  # a pixel is .1
    assert line @ (hit - floor_point) > (hit - floor_point) @ (hit - floor_point)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "click", "place", "text"),
    [
        ("bulb", "aim", (12.0, 12.0), "bulb shines all around"),
        ("sun", "aim", (12.0, 12.0), "infinitely far away"),
        ("beam", "aim", (0.5, 0.5), "nothing is seen there"),
        ("beam", "aim", (-3.0, 0.5), "outside the picture"),
        ("beam", "aim", (math.nan, 0.5), "outside the picture"),
        ("beam", "shadow", (12.0, 12.0), "a shadow needs two places"),
        ("sky", "highlight", (12.0, 12.0), "is of the kind constant"),
    ],
)
def test_clicks_that_point_no_light(
    moving: MovingStudio, name: str, click: Any, place: Any, text: str
) -> None:
    with pytest.raises(LightpaintError) as refusal:
        moving.send(protocol.PointLight(moving.light(name), click, place))
    assert text in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert moving.studio.session.requests.poses == {}


@pytest.fixture
def dim_room(tmp_path: Path) -> Iterator[MovingStudio]:
    """The room with a bulb, and a sky that shows what is in it."""
    room = MovingStudio(tmp_path, LIGHTS["bulb"].replace("0.5 0.6 0.7", "5 6 7") + LIGHTS["sky"])
    yield room
    room.close()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_lights_that_may_move_come_closer_in_one_step(dim_room: MovingStudio) -> None:
    """The painting is the look with the bulb elsewhere."""
    moving = dim_room
    session = moving.studio.session
    position = (-0.1, 1.2, 0.6)
    moved_scene = moving.scene.moved({"bulb": lp.Pose(position=position)})
    painted_basis = lp.render_basis(moved_scene, spp=256, seed=5)
    look = painted_basis.mix(painted_basis.current_weights)
    whole_picture = (0, look.shape[0], 0, look.shape[1])
    moving.send(
        protocol.Paint(0, whole_picture, True),
        image=look,
        importance=np.ones(look.shape[:2], np.float32),
    )
    before = exact_answer(moving)
    moving.send(protocol.PlaceLights())
    result = place_lights(moving)
    assert "bulb" in result["names"], result
    after = exact_answer(moving.rendered())
    assert after["delta_e"] < 0.7 * before["delta_e"]
    assert session.store.position == 2
    moving.send(protocol.Undo())
    assert session.requests.poses == {}


def test_a_search_for_places_can_be_stopped(moving: MovingStudio) -> None:
    stroke(moving)
    moving.send(protocol.PlaceLights())
    moving.send(protocol.PlaceLights(run=False))
    assert place_lights(moving)["text"] == "Stopped: every light stays where it was."
    assert moving.studio.session.requests.poses == {}


def paint_moved_bulb(moving: MovingStudio, position: tuple[float, float, float]) -> None:
    """Paint the look with the bulb elsewhere."""
    moved_scene = moving.scene.moved({"bulb": lp.Pose(position=position)})
    painted_basis = lp.render_basis(moved_scene, spp=64, seed=5)
    look = painted_basis.mix(painted_basis.current_weights)
    moving.send(
        protocol.Paint(0, (0, look.shape[0], 0, look.shape[1]), True),
        image=look,
        importance=np.ones(look.shape[:2], np.float32),
    )


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_search_ends_with_the_best_so_far_and_leaves_a_note(
    dim_room: MovingStudio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The best by then becomes a step, and the note is there when the session opens again."""
    moving, position = dim_room, (-0.1, 1.2, 0.6)
    paint_moved_bulb(moving, position)
    old = moving.scene.light("bulb").members[0].site
    move = lp.Move("bulb", old, Site(position), gain_share=0.5)
    placement = lp.Placement((moving.scene,), (move,), (), 0.1, 0.05)
    has_begun = threading.Event()

    def search(*_: Any, is_enough: Callable[[], bool], **__: Any) -> lp.Placement:
        has_begun.set()
        moving.wait(is_enough)
        return placement

    monkeypatch.setattr("lightpaint.paint.rig.light_placer.place", search)
    moving.send(protocol.PlaceLights())
    assert has_begun.wait(60)
    moving.send(protocol.PlaceLights(run=False, keeps_best=True))
    text = place_lights(moving)["text"]
    assert text.startswith("Stopped with the best so far: bulb")
    assert "ΔE" in text
    store = moving.studio.session.store
    [listed] = moving.send(protocol.ListSteps())
    [note] = listed.fields["searches"]
    assert (note["title"], note["text"]) == ("let lights move", text)
    assert note["after"] == store.last_id == listed.fields["steps"][-1]["id"]
    [tried] = note["tried"]
    assert tried.startswith("bulb: slide by up to ")
    moving.send(protocol.Undo())
    assert moving.send(protocol.ListSteps())[0].fields["searches"]  # its step can be done again
    identity = store.identity
    moving.close()
    with Store.open(moving.folder / "session.db", identity) as opened:
        assert [x.text for x in SearchNotes(opened).listed()] == [text]


def test_a_search_in_vain_says_so_in_the_history_and_is_no_step(
    dim_room: MovingStudio, monkeypatch: pytest.MonkeyPatch
) -> None:
    moving = dim_room
    stroke(moving)
    nothing = lp.Placement((moving.scene,), (), (), 0.1, 0.1)
    monkeypatch.setattr("lightpaint.paint.rig.light_placer.place", lambda *_, **__: nothing)
    [before] = moving.send(protocol.EstimatePlaces())
    assert before.fields["text"].startswith("bulb: slide by up to ")
    low, high = before.fields["seconds"]
    assert 0 < low < high
    assert not before.fields["is_measured"]
    moving.send(protocol.PlaceLights())
    assert place_lights(moving)["text"].startswith("Nothing better within these freedoms")
    [listed] = moving.send(protocol.ListSteps())
    assert listed.fields["searches"][0]["text"].startswith("Nothing better within these freedoms")
    assert len(listed.fields["steps"]) == 1
    [after] = moving.send(protocol.EstimatePlaces())
    assert after.fields["is_measured"]
    [new] = moving.send(protocol.EstimatePlaces("spot", 2))
    assert new.fields["text"] == "At most 2 new spots, anywhere free."
    with pytest.raises(LightpaintError, match="max_count is 9"):
        moving.send(protocol.EstimatePlaces("spot", 9))


def test_what_cannot_be_placed_is_said(moving: MovingStudio) -> None:
    with pytest.raises(LightpaintError, match="nothing is painted yet"):
        moving.send(protocol.PlaceLights())
    stroke(moving)
    locks = {name: {"lock": True} for name in ("bulb", "beam", "sun")}
    moving.send(protocol.ConstrainLights(locks))
    with pytest.raises(LightpaintError, match="no light is free to move"):
        moving.send(protocol.PlaceLights())


@pytest.mark.nightly
def test_what_comes_no_closer_to_the_eye_is_not_done(
    dim_room: MovingStudio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The painting is the current look: every move is a step away, whatever a search says."""
    session = dim_room.studio.session
    look = session.basis.current_look.copy()
    whole_picture = (0, look.shape[0], 0, look.shape[1])
    dim_room.send(
        protocol.Paint(0, whole_picture, True),
        image=look,
        importance=np.ones(look.shape[:2], np.float32),
    )
    old = dim_room.scene.light("bulb").members[0].site
    move = lp.Move("bulb", old, Site((0.8, 0.2, -0.5)), gain_share=0.1)
    placement = lp.Placement((dim_room.scene,), (move,), (), 0.1, 0.05)
    monkeypatch.setattr("lightpaint.paint.rig.light_placer.place", lambda *_, **__: placement)
    dim_room.send(protocol.PlaceLights())
    assert "no closer to the eye" in place_lights(dim_room)["text"]
    assert session.requests.placed == {}
    assert session.store.position == 1


def compared_picture(moving: MovingStudio, look: int) -> np.ndarray:
    """The picture of a look, with the planes that its lights have by now."""
    return moving.studio.resource(f"look_plane/{look}").astype(np.float32)


@pytest.mark.nightly
def test_compared_looks_have_their_own_places_and_added_lights(moving: MovingStudio) -> None:
    """Estimated at first, rendered soon, whatever the session does with these lights meanwhile."""
    studio, session = moving.studio, moving.studio.session
    moving.send(protocol.SaveLook("before"))
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.send(protocol.AddLight("point", position=(-0.3, 1.4, 0.4)))
    moving.rendered()
    moving.send(protocol.SaveLook("after"))
    truth = session.basis.mix(session.weights)
    before, after = studio.state().looks
    assert (before.places, after.places) == ("", studio.state().places)
    assert set(after.lights) - set(before.lights) == {"point_1"}
    studio.rig._rendered.clear()  # as in a session that was opened again
    for _ in range(2):
        moving.send(protocol.Undo())
    assert studio.state().places == ""
    moving.messages.clear()
    moving.send(protocol.CompareLooks((after.id,)))
    name = f"look_plane/{after.id}"

    def arrivals() -> int:
        return sum(m.kind == "renewed" and name in m.resources for m in moving.messages)

    moving.wait(arrivals)
    estimate = compared_picture(moving, after.id)
    moving.wait(lambda: arrivals() == 2)
    rendered = compared_picture(moving, after.id)
    assert np.abs(rendered - truth).max() < 2e-3 * truth.max()  # halves
    assert not np.array_equal(estimate, rendered)
    here = session.basis.mix(session.weights)
    assert np.square(estimate - truth).sum() < 0.2 * np.square(here - truth).sum()
    moving.send(protocol.CompareLooks())
    with pytest.raises(LightpaintError, match="no picture"):
        compared_picture(moving, after.id)


def test_looks_with_lights_in_different_places_are_not_mixed(moving: MovingStudio) -> None:
    moving.send(protocol.SaveLook("here"))
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.send(protocol.SaveLook("there"))
    with pytest.raises(LightpaintError, match="hang lights in different places"):
        moving.send(protocol.MixLooks(1, 2, 0.5, "between"))
    with pytest.raises(LightpaintError, match="there is no look 7"):
        moving.send(protocol.CompareLooks((7,)))


@pytest.mark.nightly
def test_a_mix_of_moved_looks_has_a_thumbnail_of_their_places(moving: MovingStudio) -> None:
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.rendered()
    moving.send(protocol.SaveLook("there"))
    moving.send(protocol.CopyLook(1))
    moving.send(protocol.Undo())
    moving.send(protocol.MixLooks(1, 2, 0.5, "between"))
    thumbnails = [moving.studio.resource(f"look/{k}").astype(float) for k in (1, 3)]
    assert np.abs(thumbnails[0] - thumbnails[1]).max() <= 1


def test_the_number_of_a_deleted_look_does_not_return(moving: MovingStudio) -> None:
    moving.send(protocol.SaveLook("first"))
    moving.send(protocol.DropLook(1))
    moving.send(protocol.SaveLook("second"))
    assert [look.id for look in moving.studio.state().looks] == [2]


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_exported_places_give_the_same_lamps_in_the_terminal(moving: MovingStudio) -> None:
    """Up to the noise of 16 samples, of which the two locked lights have others here and there.

    Unpainted parts are held near the look before the move.
    """
    moving.send(protocol.MoveLights({"bulb": {"position": POSITION}}))
    moving.send(protocol.AddLight("point", position=(-0.3, 1.4, 0.4)))
    stroke(moving)
    moving.send(protocol.ConstrainLights({x: {"lock": True} for x in ("bulb", "point_1")}))
    exact_answer(moving.rendered())
    moving.send(protocol.Export(("target", "lighting")))
    moving.wait(lambda: next((m for m in moving.messages if m.kind == "exported"), None))
    folder, requests = moving.folder, moving.studio.session.requests
    paintings = {"": str(folder / "painting.exr")}
    options = ["--spp", "16", "--no-cache", "--no-verify"]
    line = command_for_paintings(str(folder / "room.xml"), paintings, options, requests)
    words = shlex.split(line)[1:]
    assert main([*words, "-o", str(folder / "terminal")]) == 0
    here, there = (
        {name: its["emission"] for name, its in json.loads(file.read_text())["lights"].items()}
        for file in (folder / "lighting.json", folder / "terminal" / "lighting.json")
    )
    assert here.keys() == there.keys()
    assert here["bulb"] == pytest.approx([0.5, 0.6, 0.7])
    for name, emission in here.items():
        assert there[name] == pytest.approx(emission, rel=2e-2, abs=1e-3), name


@pytest.mark.nightly
def test_a_report_searches_for_no_places(tmp_path: Path) -> None:
    """In the painter no light moves unless somebody moves it, whatever the lights file permits."""
    (tmp_path / "room.lights.toml").write_text("[light.beam]\naim = true\n")
    moving = MovingStudio(tmp_path)
    try:
        stroke(moving)
        moving.send(protocol.Export(("report",)))
        moving.wait(lambda: next((m for m in moving.messages if m.kind == "exported"), None))
    finally:
        moving.close()
    numbers = json.loads((tmp_path / "answer" / "report.json").read_text())
    assert moving.studio.rig.freedoms
    assert not numbers.get("placement")
