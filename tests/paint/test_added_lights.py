"""Lights that a session adds to its scene: in undo, looks, files and exports, and their planes."""

import math
from typing import Any

import numpy as np
import pytest
from moving import MovingStudio, exact_answer, opened_rig, pixel_of, place_lights, stroke
from nightly import nightly

import lightpaint as lp
from lightpaint.errors import LightpaintError
from lightpaint.paint import protocol
from lightpaint.scene.scene_reader import load_scene

#: A place on the floor that the camera sees, and one in the air.
FLOOR, AIR = (-0.4, 0.0, 0.3), (-0.3, 1.2, 0.4)


def add_light(moving: MovingStudio, request: protocol.AddLight) -> Any:
    """The state after a light was added, which is its answer."""
    [state, *_] = moving.send(request)
    assert state.kind == "state"
    return state


def names(moving: MovingStudio) -> tuple[str, ...]:
    return moving.studio.session.basis.names


@pytest.mark.parametrize("kind", ["spot", nightly("point"), nightly("panel")])
def test_an_added_light_has_the_plane_of_its_place(moving: MovingStudio, kind: Any) -> None:
    """At once about, and rendered soon; the other planes and the current look stay."""
    session = moving.studio.session
    before = {name: moving.plane(name) for name in session.basis.names}
    look = session.basis.current_look.copy()
    state = add_light(moving, protocol.AddLight(kind, position=AIR))
    name = f"{kind}_1"
    assert [light.name for light in state.lights] == [*before, name]
    assert state.added_lights == (name,)
    assert len(state.weights) == len(state.answer.lights) == len(state.views[0].scales) == 6
    quick = moving.plane(name)
    moving.rendered()
    [added_light] = moving.studio.rig.moved_scene(session.requests.placed).added
    basis = lp.render_basis(moving.scene.with_new_emitters([added_light]), spp=512, seed=7)
    # A panel itself is seen once it is rendered.
    truth, is_lit = basis.image(name), ~basis.emitters_seen
    for plane in (quick, moving.plane(name)):
        error = np.square(plane - truth)[is_lit].sum()
        assert error < 0.15 * np.square(truth)[is_lit].sum()  # noise of few samples
    for other, plane in before.items():
        assert np.array_equal(moving.plane(other), plane)
    assert np.array_equal(session.basis.current_look, look)
    # It is seen: its part of the picture is a fifth, and three fifths are more than it may be.
    assert 0.1 < state.answer.lights[-1].share < 0.6


@pytest.mark.nightly
def test_the_painting_finds_a_light_that_is_missing(moving: MovingStudio) -> None:
    """The painting is the look with one light more; the search shows what it tries."""
    new_light = lp.NewEmitter(
        "lamp", "point", lp.Pose(position=(-0.2, 0.5, 0.7)), emission=(2, 2, 2)
    )
    painted_basis = lp.render_basis(moving.scene.with_new_emitters([new_light]), spp=128, seed=5)
    look = painted_basis.mix(painted_basis.current_weights)
    whole_picture = (0, look.shape[0], 0, look.shape[1])
    moving.send(
        protocol.Paint(0, whole_picture, True),
        image=look,
        importance=np.ones(look.shape[:2], np.float32),
    )
    moving.send(protocol.PlaceLights(new_type="point"))
    result = place_lights(moving)
    assert result["names"] == ["point_1"], result
    assert any("point_1" in m.positions for m in moving.messages if m.kind == "trial")
    added_light = moving.studio.session.requests.added["point_1"]
    assert math.dist(added_light["position"], new_light.pose.position or ()) < 0.3
    assert names(moving)[-1] == "point_1"
    assert moving.studio.session.store.position == 2
    moving.send(protocol.Undo())
    assert moving.studio.session.requests.added == {}


def test_a_click_hangs_a_light_before_the_surface(moving: MovingStudio) -> None:
    opened_rig(moving)
    add_light(moving, protocol.AddLight("spot", pixel=pixel_of(moving, FLOOR)))
    place = moving.studio.session.requests.added["spot_1"]
    x, y, z = place["position"]
    assert (x, z) == pytest.approx((FLOOR[0], FLOOR[2]), abs=2e-3)
    assert 0 < y < 0.1
    assert np.subtract(place["target"], place["position"])[1] > 0


def test_a_spot_that_lights_little_yet_is_not_glaring_once_it_is_aimed(
    moving: MovingStudio,
) -> None:
    """Hung on the floor, it shines up past all that is seen; then it is turned to the ball."""
    opened_rig(moving)
    add_light(moving, protocol.AddLight("spot", pixel=(7.2, 16.0)))
    session = moving.studio.session
    emission, is_surface = (
        session.requests.added["spot_1"]["emission"],
        ~session.basis.emitters_seen,
    )
    look = session.basis.current_look[is_surface].sum()
    moving.send(protocol.MoveLights({"spot_1": {"target": [0.3, 0.3, 0.2]}}))
    shone = moving.plane("spot_1")[is_surface] * emission
    assert 0.01 * look < shone.sum() < look


@pytest.mark.nightly
def test_undo_looks_and_the_file_keep_added_lights(moving: MovingStudio) -> None:
    session, before = moving.studio.session, names(moving)
    add_light(moving, protocol.AddLight("point", position=AIR))
    moving.rendered()
    plane = moving.plane("point_1")
    light = len(before)
    moving.send(protocol.ConstrainLight(light, {"lock": [0.3, 0.2, 0.1]}))
    moving.send(protocol.SaveLook("with"))
    for _ in range(2):
        [state, *_] = moving.send(protocol.Undo())
    assert state.kind == "state"
    assert names(moving) == before
    assert session.weights.shape == (len(before), 3)
    moving.send(protocol.SaveLook("without"))
    moving.send(protocol.LoadLook(1))
    assert names(moving) == (*before, "point_1")
    assert np.array_equal(moving.plane("point_1"), plane)
    assert session.weights[light] == pytest.approx((0.3, 0.2, 0.1))
    moving.send(protocol.LoadLook(2))
    assert names(moving) == before
    moving.send(protocol.Undo())
    moving.close()
    reopened = MovingStudio(moving.folder)
    try:
        assert names(reopened) == (*before, "point_1")
        assert reopened.studio.session.weights[light] == pytest.approx((0.3, 0.2, 0.1))
        reopened.rendered()
        assert np.allclose(reopened.plane("point_1"), plane)
    finally:
        reopened.close()


def test_an_added_light_moves_is_named_anew_and_goes(moving: MovingStudio) -> None:
    session, before = moving.studio.session, names(moving)
    for _ in range(2):
        add_light(moving, protocol.AddLight("point", position=AIR))
    assert names(moving)[-2:] == ("point_1", "point_2")
    old_plane = moving.plane("point_2")
    position = [0.4, 1.2, 0.1]
    moving.send(protocol.MoveLights({"point_2": {"position": position}}))
    assert not np.array_equal(moving.plane("point_2"), old_plane)
    moving.send(protocol.TieLights((("point_1", "point_2"),)))
    moving.send(protocol.RemoveLight("point_1"))
    assert names(moving) == (*before, "point_2")
    assert session.requests.ties == ()
    assert opened_rig(moving).lights[-1].position == pytest.approx(position)
    moving.send(protocol.MoveLights({"point_2": {}}))
    assert np.array_equal(moving.plane("point_2"), old_plane)
    moving.send(protocol.ConstrainLight(len(before), {"lock": [0.3, 0.2, 0.1]}))
    moving.send(protocol.SaveLook("with"))
    moving.send(protocol.RemoveLight("point_2"))
    assert session.requests.placed == {}
    moving.send(protocol.LoadLook(1))
    assert names(moving) == (*before, "point_2")
    moving.send(protocol.Undo())
    moving.send(protocol.Undo())
    assert names(moving) == (*before, "point_2")


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_added_lights_are_solved_for_exported_and_verified(moving: MovingStudio) -> None:
    add_light(moving, protocol.AddLight("spot", position=AIR))
    stroke(moving)
    assert exact_answer(moving)["lights"][-1]["error"]
    moving.send(protocol.Export(("lighting", "relit", "report")))
    moving.wait(lambda: [m for m in moving.messages if m.kind == "exported"])
    relit = load_scene(moving.folder / "relit.xml")
    site = relit.light("spot_1").members[0].site
    assert site.position == pytest.approx(AIR)
    assert site.cutoff == pytest.approx(30)
    moving.send(protocol.Verify())
    verified = moving.wait(lambda: next((m for m in moving.messages if m.kind == "verified"), None))
    assert verified.fields["agrees"], verified.fields["text"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("request_", "text"),
    [
        (protocol.AddLight("spot"), "a new light needs a place"),
        (protocol.AddLight("spot", position=(math.nan, 0, 0)), "position is (nan"),
        (protocol.AddLight("spot", position=(1.0, 2.0)), "expected three numbers"),
        (protocol.AddLight("spot", pixel=(0.5, 0.5)), "nothing is seen there"),
        (protocol.AddLight("spot", pixel=(math.nan, 0.5)), "outside the picture"),
        (protocol.AddLight("spot", pixel=(5.0, 5.0), view=3), "no view 3"),
        (protocol.RemoveLight("bulb"), "a light of the scene: turn it off"),
        (protocol.RemoveLight("ghost"), "no light is called 'ghost'"),
    ],
)
def test_lights_that_cannot_be_added_or_removed(
    moving: MovingStudio, request_: Any, text: str
) -> None:
    version, before = moving.studio.session.version, names(moving)
    with pytest.raises(LightpaintError) as refusal:
        moving.send(request_)
    assert text in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert (moving.studio.session.version, names(moving)) == (version, before)


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_drag_is_answered_and_ends_a_search_which_moves_nothing(
    moving: MovingStudio,
) -> None:
    """Of one light, which takes a third of the time that three take."""
    stroke(moving)
    opened_rig(moving)
    moving.send(protocol.ConstrainLights({name: {"lock": True} for name in ("bulb", "beam")}))
    moving.send(protocol.PlaceLights())
    moving.wait(lambda: [m for m in moving.messages if m.kind == "trial"])
    for is_final in (False, False, True):
        moving.send(protocol.MoveLights({"bulb": {"position": [0.4, 1.2, 0.1]}}, is_final=is_final))
    assert "lights were moved by hand meanwhile" in place_lights(moving)["text"]
    progress = [m for m in moving.messages if m.kind == "progress" and m.task == "place"]
    assert all(m.done < m.total for m in progress)  # it stopped early
    assert set(moving.studio.session.requests.placed) == {"bulb"}


@pytest.mark.nightly
def test_undo_and_removal_while_a_plane_renders(moving: MovingStudio) -> None:
    before = names(moving)
    for last in (protocol.Undo(), protocol.RemoveLight("spot_1")):
        add_light(moving, protocol.AddLight("spot", position=AIR))
        moving.send(protocol.MoveLights({"bulb": {"position": [0.4, 1.2, 0.1]}}))
        moving.send(last)
        moving.send(protocol.Undo())
        moving.rendered()
    moving.send(protocol.Undo())
    moving.send(protocol.Undo())
    assert names(moving) == before
    assert moving.studio.session.requests.placed == {}
    assert not [m for m in moving.messages if m.kind == "notice" and "inside" in m.fields["text"]]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("request_", "text"),
    [
        (protocol.PlaceLights(new_type="spot", max_count=0), "max_count is 0"),
        (protocol.PlaceLights(new_type="spot", max_count=99), "max_count is 99"),
        (
            protocol.PlaceLights(new_type="spot", surfaces=("nowhere",)),
            "no rail, surface or shape 'nowhere'",
        ),
    ],
)
def test_searches_for_impossible_lights(moving: MovingStudio, request_: Any, text: str) -> None:
    with pytest.raises(LightpaintError, match="nothing is painted yet"):
        moving.send(request_)
    stroke(moving)
    with pytest.raises(LightpaintError) as refusal:
        moving.send(request_)
    assert text in str(refusal.value)
    assert "\n" not in str(refusal.value)
