"""Scenes with lights at other places: only these change, in memory as in the file written."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.site import rotation_between
from lightpaint.scene.scene_reader import load_scene

#: Poses of lights without a shape, whose planes are theirs alone.
POSES = {
    "bulb": lp.Pose(position=(0.1, 1.2, 0.3)),
    "beam": lp.Pose(position=(-0.5, 1.7, 1.0), target=(0.2, 0, 0.1), cutoff=40),
    "sun": lp.Pose(target=(-0.2, -1, 0.3)),
}


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def identities(scene: Scene) -> dict[str, str]:
    return dict(zip([x.name for x in scene.lights], scene.light_identities, strict=True))


def current(scene: Scene) -> Lighting:
    """The lighting of the scene as it is."""
    basis = lp.render_basis(scene.reduced("1/2"), spp=2)
    return Lighting.of_weights(basis.lights, np.array([x.emission for x in scene.lights]))


@pytest.mark.parametrize("name", POSES)
def test_only_the_plane_of_a_moved_light_is_another(room: Scene, name: str) -> None:
    before, after = identities(room), identities(room.moved({name: POSES[name]}))
    assert {x for x in before if before[x] != after[x]} == {name}


def test_a_light_with_a_shape_changes_what_the_others_meet(room: Scene) -> None:
    before, after = identities(room), identities(room.moved({"panel": lp.Pose(position=(0, 1, 0))}))
    assert not set(before.values()) & set(after.values())


@pytest.mark.parametrize("name", [*POSES, "panel"])
def test_back_and_forth_is_the_same_place(room: Scene, name: str) -> None:
    site = room.light(name).members[0].site
    ahead = np.array(site.position or (0, 0, 0)) + np.array(site.direction or (0, 0, 0))
    pose_back = lp.Pose(
        position=site.position,
        target=None if site.direction is None else ahead,
        cutoff=site.cutoff,
        beam=site.beam,
    )
    pose = POSES.get(name, lp.Pose(position=(0.2, 1, 0), target=(1, 0, 1)))
    site_back = room.moved({name: pose}).moved({name: pose_back}).light(name).members[0].site
    for key in ("position", "direction", "cutoff", "beam"):
        old, new = getattr(site, key), getattr(site_back, key)
        assert (old is None) == (new is None)
        if old is not None:
            np.testing.assert_allclose(new, old, atol=2e-6)  # single precision


def test_the_file_written_is_the_scene_in_memory(room: Scene, tmp_path: Path) -> None:
    moved_room = room.moved({**POSES, "panel": lp.Pose(position=(0.1, 1.5, 0), target=(0, 0, 0.2))})
    relit = lp.relight(moved_room, current(moved_room), tmp_path / "out" / "relit.xml")
    assert relit.light_identities == moved_room.light_identities
    assert relit.unlit_content == moved_room.unlit_content


def test_plain_mitsuba_renders_it_as_the_basis_predicts(room: Scene, tmp_path: Path) -> None:
    """At one seed both draw the same paths and differ by rounding alone."""
    import mitsuba as mi

    moved_room = room.moved({**POSES, "panel": lp.Pose(position=(0.1, 1.5, 0), target=(0, 0, 0.2))})
    lighting = current(moved_room)
    path = tmp_path / "out" / "relit.xml"
    relit = lp.relight(moved_room, lighting, path)
    basis = lp.render_basis(moved_room, spp=1024)
    predicted = lp.combine(basis, lighting)
    picture = np.array(mi.render(mi.load_file(str(path)), spp=1024, seed=5))
    assert picture.shape == predicted.image.shape
    assert np.mean(picture) == pytest.approx(np.mean(predicted.image), rel=0.01)  # noise
    assert [x.name for x in relit.lights] == [x.name for x in room.lights]


def test_a_second_move_goes_on_from_the_first(room: Scene) -> None:
    moved_once = room.moved({"beam": lp.Pose(position=(0, 1.5, 1))})
    twice = moved_once.moved({"beam": lp.Pose(target=(0, 0, 0))}).light("beam").members[0].site
    assert twice.position == (0, 1.5, 1)
    np.testing.assert_allclose(twice.direction, np.array([0, -1.5, -1]) / np.hypot(1.5, 1))


def test_a_wider_cone_keeps_the_share_of_its_beam(room: Scene) -> None:
    site = room.light("beam").members[0].site
    wider = room.moved({"beam": lp.Pose(cutoff=45)}).light("beam").members[0].site
    shares = [np.divide(*np.array([x.beam, x.cutoff], dtype=float)) for x in (site, wider)]
    assert shares[1] == pytest.approx(shares[0], rel=1e-6)


@pytest.mark.parametrize(
    ("name", "pose", "words"),
    [
        ("sky", lp.Pose(position=(0, 0, 0)), "'sky' .* has no place: it cannot be moved"),
        ("sun", lp.Pose(position=(0, 0, 0)), "'sun' .* infinitely far away"),
        ("bulb", lp.Pose(target=(0, 0, 0)), "'bulb' .* points nowhere"),
        ("panel", lp.Pose(cutoff=20), "'panel' .* has no cone"),
        ("beam", lp.Pose(cutoff=2, beam=1.5), None),
        ("beam", lp.Pose(beam=80), "a beam of 80 is wider"),
        ("lamp", lp.Pose(), "no light 'lamp'"),
    ],
)
def test_what_a_light_cannot_do(room: Scene, name: str, pose: lp.Pose, words: str | None) -> None:
    if words is None:
        assert room.moved({name: pose}).light(name).members[0].site.cutoff == 2
    else:
        with pytest.raises(SceneError, match=words):
            room.moved({name: pose})


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"position": (np.nan, 0, 0)}, "position is .*nan"),
        ({"target": (0, 0)}, "target is .* expected three numbers"),
        ({"target": "abc"}, "target is 'abc'"),
        ({"position": (1e9, 0, 0)}, "position is .*1000000000"),
        ({"position": (1, 2, 3), "target": (1, 2, 3)}, "position and target are both"),
        ({"cutoff": 0}, "cutoff is 0"),
        ({"cutoff": 20, "beam": 30}, "beam is 30 and cutoff 20"),
        ({"beam": np.inf}, "beam is inf"),
    ],
)
def test_poses_that_no_light_can_have(values: dict[str, object], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        lp.Pose(**values)  # type: ignore[arg-type]


def test_the_smallest_rotation() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        a, b = rng.normal(size=(2, 3))
        a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
        for target in (b, a, -a):
            turn = rotation_between(a, target)
            np.testing.assert_allclose(turn @ a, target, atol=1e-12)
            np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=1e-12)
            assert np.linalg.det(turn) == pytest.approx(1)
            angle = np.arccos(np.clip(a @ target, -1, 1))
            assert np.trace(turn) == pytest.approx(1 + 2 * np.cos(angle))
