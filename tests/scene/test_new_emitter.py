"""A light that no file has yet: in memory and in the written file it is the same light."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.errors import SceneError
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

POINT = NewEmitter("key", "point", lp.Pose(position=(0.4, 1.2, 0.6)), emission=(2, 1, 0.5))
SPOT = NewEmitter("aimed", "spot", lp.Pose(position=(-0.7, 1.6, 1), target=(0, 0, 0), cutoff=25))
PANEL = NewEmitter(
    "sheet", "panel", lp.Pose(position=(0, 1.5, 0.8), target=(0, 0, -0.2)), size=(0.5, 0.2)
)


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def relit(scene: Scene, path: Path) -> Scene:
    basis = lp.render_basis(scene, spp=4, seed=1)
    return lp.relight(scene, lp.Lighting.of_weights(basis, basis.current_weights), path)


def test_a_written_scene_has_the_new_lights_of_memory(room: Scene, tmp_path: Path) -> None:
    lit_room = room.with_new_emitters([POINT, SPOT, PANEL])
    relit_room = relit(lit_room, tmp_path / "relit" / "relit.xml")
    assert [x.name for x in relit_room.emitters] == [x.name for x in lit_room.emitters]
    assert relit_room.light_identities == lit_room.light_identities
    for new in (POINT, SPOT, PANEL):
        light, relit_light = lit_room.light(new.name), relit_room.light(new.name)
        assert light.emission == relit_light.emission == pytest.approx(new.emission)
        for site in (light.members[0].site, relit_light.members[0].site):
            assert site.position == pytest.approx(new.pose.position, abs=1e-6)
            assert site.direction == (
                None if new is POINT else pytest.approx(new.site.direction, abs=1e-6)
            )
    assert lit_room.light("aimed").members[0].site.beam == pytest.approx(25 * 0.75)


def test_the_text_of_the_user_is_left_as_it_is(room: Scene, tmp_path: Path) -> None:
    """The new elements stand behind all others; without them it is the file without them."""
    with_them = relit(room.with_new_emitters([SPOT]), tmp_path / "one" / "relit.xml")
    without = relit(room, tmp_path / "two" / "relit.xml")
    text, plain = with_them.path.read_text(), without.path.read_text()
    start = text.index('<emitter type="spot" id="aimed">')
    end = text.index("</emitter>", start) + len("</emitter>")
    assert text[:start].rstrip() + text[end:] == plain


def test_planes_of_the_others_stay_if_a_point_is_added(room: Scene) -> None:
    lit_room = room.with_new_emitters([POINT, SPOT])
    assert lit_room.light_identities[: len(room.lights)] == room.light_identities


def test_the_flux_of_a_panel_is_that_of_its_area(room: Scene) -> None:
    lit_room = room.with_new_emitters([PANEL])
    assert lit_room.light("sheet").unit_flux == pytest.approx((np.pi * 0.1,) * 3)


def test_a_new_light_moves_like_another(room: Scene, tmp_path: Path) -> None:
    pose = lp.Pose(position=(0.2, 1.4, 0.2), target=(0.1, 0, 0))
    moved_room = room.with_new_emitters([SPOT, PANEL]).moved({"aimed": pose, "sheet": pose})
    moved_emitters = [NewEmitter(x.name, x.kind, pose, x.size) for x in (SPOT, PANEL)]
    assert moved_room.light("sheet").members[0].site.position == pytest.approx(pose.position)
    assert moved_room.light("aimed").members[0].site.direction == pytest.approx(
        moved_emitters[0].site.direction
    )
    relit_room = relit(moved_room, tmp_path / "relit" / "relit.xml")
    assert relit_room.light_identities == moved_room.light_identities


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"kind": "lamp"}, "of the kind 'lamp'"),
        ({"name": ""}, "name of 1 to"),
        ({"pose": lp.Pose(target=(0, 0, 0))}, "has no position"),
        ({"kind": "spot"}, "points nowhere"),
        ({"size": (1, 1)}, "it has no size"),
        ({"emission": (1, np.nan, 1)}, "expected three amounts"),
        ({"emission": (1, 2)}, "expected three amounts"),
    ],
)
def test_new_lights_that_cannot_be(values: dict[str, object], words: str) -> None:
    good = {"name": "x", "kind": "point", "pose": lp.Pose(position=(0, 0, 0))}
    with pytest.raises(SceneError, match=words):
        NewEmitter(**(good | values))  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [None, (1,), (0, 1), (np.inf, 1)])
def test_panels_without_a_size(size: object) -> None:
    pose = lp.Pose(position=(0, 1, 0), target=(0, 0, 0))
    with pytest.raises(SceneError, match="expected its width and height"):
        NewEmitter("x", "panel", pose, size=size)  # type: ignore[arg-type]


def test_a_name_that_is_taken(room: Scene) -> None:
    with pytest.raises(SceneError, match="has a light 'bulb' already"):
        room.with_new_emitters([NewEmitter("bulb", "point", lp.Pose(position=(0, 1, 0)))])
