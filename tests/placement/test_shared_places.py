"""Looks that share places: lights hang once, and each look has levels of its own."""

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.errors import SceneError
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: Where bulb and beam hang in the paintings.
BULB, BEAM = (0.3, 1.3, 0.2), (-0.6, 0.0, -0.3)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("room"))).reduced("1/2")


@pytest.fixture(scope="module")
def bases(room: Scene) -> tuple[Basis, Basis]:
    """The basis of the room, and that of the room as painted."""
    poses = {"bulb": lp.Pose(position=BULB), "beam": lp.Pose(target=BEAM)}
    return lp.render_basis(room, spp=256, seed=1), lp.render_basis(
        room.moved(poses), spp=256, seed=2
    )


def solved(bases: tuple[Basis, Basis], **levels: float) -> lp.Solution:
    """The solution for a picture of the room as painted, with these lights alone."""
    basis, painted = bases
    weights = np.zeros((len(painted.names), 3))
    for name, level in levels.items():
        weights[painted.names.index(name)] = level
    return lp.solve(basis, lp.Target.of(painted.planes.mix(weights)), space="linear", hold=0)


@pytest.mark.nightly
def test_a_dark_look_places_its_lamp_as_a_bright_one_does(
    room: Scene, bases: tuple[Basis, Basis]
) -> None:
    """One look shows the bulb alone, one a ten-thousandth of it and the beam: both are found."""
    looks = [solved(bases, bulb=4, panel=0.2), solved(bases, beam=4e-4, panel=1e-5)]
    free = {"bulb": lp.Freedom(within=1.5), "beam": lp.Freedom(aim=True)}
    placement = lp.place(room, bases[0], looks, free)
    moves = {move.name: move for move in placement.moves}
    assert moves["bulb"].new.position == pytest.approx(BULB, abs=0.15)
    site = painted_direction(room)
    assert np.dot(moves["beam"].new.direction, site) > np.cos(np.radians(6))
    assert placement.missed_after < 0.3 * placement.missed_before
    # Alone, each look says nothing of the other's lamp.
    single = lp.place(room, bases[0], looks[0], free)
    assert {move.name for move in single.moves} == {"bulb"}


def painted_direction(room: Scene) -> np.ndarray:
    """The direction of the beam as painted."""
    moved_room = room.moved({"beam": lp.Pose(target=BEAM)})
    return np.array(moved_room.light("beam").members[0].site.direction)


@pytest.mark.nightly  # by day, two looks share places above
def test_a_look_given_twice_is_one_look(room: Scene, bases: tuple[Basis, Basis]) -> None:
    look, free = solved(bases, bulb=4, panel=0.2), {"bulb": lp.Freedom(within=1.5)}
    one, two = (lp.place(room, bases[0], looks, free) for looks in (look, [look, look]))
    assert one.moves
    assert one.moves[0].new.position == pytest.approx(two.moves[0].new.position, abs=1e-3)
    assert one.missed_after == pytest.approx(two.missed_after, rel=1e-3)


def test_looks_need_a_basis_of_their_view(room: Scene, bases: tuple[Basis, Basis]) -> None:
    look = solved(bases, bulb=1)
    larger = lp.render_basis(room.reduced("1/2"), spp=4)
    with pytest.raises(SceneError, match="a look is through the sensor"):
        lp.place(room, larger, [look], {"bulb": lp.Freedom(within=0.5)})
    with pytest.raises(SceneError, match="no look to place lights for"):
        lp.place(room, bases[0], [], {"bulb": lp.Freedom(within=0.5)})
