"""Plans and arrows: the camera follows from what pixels show, and marks stand where lights do."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from conftest import BasisFactory
from PIL import ImageDraw

from lightpaint.images.denoiser import Features
from lightpaint.report.contact_sheet import light_sheet
from lightpaint.report.hung_light import (
    HungLight,
    HungLights,
    LightChange,
    ViewGeometry,
    spoken_fraction,
)
from lightpaint.report.page.placement_section import aim_picture, placement_section
from lightpaint.report.rig_plan import CHANGED, FINER, plan_and_elevation, rig_drawing
from lightpaint.scene.properties.site import EmitterPlace, Site

EYE, FOCAL, SIZE = np.array([0.5, 1.5, 4.0]), 60.0, (48, 64)


def a_room(noise: float = 0.0) -> Features:
    """A floor at y = 0 and a wall at z = -2, seen from EYE along -z, turned down a little."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] + 0.5
    way = np.stack([(x - 32) / FOCAL, (24 - y) / FOCAL, -np.ones(SIZE)], axis=-1)
    down = np.radians(10)
    turn = np.array([[1, 0, 0], [0, np.cos(down), np.sin(down)], [0, -np.sin(down), np.cos(down)]])
    way = way @ turn.T
    with np.errstate(divide="ignore"):
        to_floor = np.where(way[..., 1] < 0, -EYE[1] / way[..., 1], np.inf)
    to_wall = (-2 - EYE[2]) / way[..., 2]
    is_floor = to_floor < to_wall
    position = EYE + np.minimum(to_floor, to_wall)[..., None] * way
    position += noise * np.random.default_rng(0).normal(size=position.shape)
    normal = np.where(is_floor[..., None], [0.0, 1, 0], [0.0, 0, 1])
    albedo = np.full((*SIZE, 3), 0.5)
    return Features(*(a.astype(np.float32) for a in (albedo, normal, position)))


def turned(name: str = "key") -> HungLight:
    """A spot that hung over the floor and pointed down, and now points at the wall."""
    old = Site((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), 20.0, 15.0)
    way = np.array([0.0, -1.5, -2.0])
    x, y, z = way / np.linalg.norm(way)
    new = EmitterPlace(name, (0.0, 3.0, 0.0), (x, y, z), 20.0, 15.0, moved_from=old)
    return HungLight(new, (1.0, 0.8, 0.6))


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_the_camera_follows_from_what_pixels_show(noise: float) -> None:
    geometry = ViewGeometry.of(a_room(noise))
    assert geometry is not None
    assert geometry.camera == pytest.approx(EYE, abs=1e-3 + 40 * noise)
    pixels = [geometry.pixel(tuple(p)) for p in geometry.points[::97]]  # type: ignore[arg-type]
    np.testing.assert_allclose(pixels, geometry.pixels[::97], atol=0.02 + 100 * noise)
    assert geometry.pixel((0.5, 1.5, 9.0)) is None  # behind the camera


def test_a_single_wall_does_not_tell_where_the_camera_is() -> None:
    """Every projection of its points fits, so there is no camera, and no warning either."""
    room = a_room()
    wall = room.normal[..., 2] == 1
    hidden = np.where(wall[..., None], room.normal, 0).astype(np.float32)
    geometry = ViewGeometry.of(Features(room.albedo, hidden, room.position))
    assert geometry is not None
    assert geometry.camera is None
    assert rig_drawing(Features(room.albedo, hidden, room.position), [turned()]) is not None


def test_a_light_points_at_the_first_thing_that_its_axis_meets() -> None:
    geometry = ViewGeometry.of(a_room())
    assert geometry is not None
    light = turned().place
    assert geometry.aim_of(light.site) == pytest.approx((0, 1.5, -2), abs=0.25)
    assert light.moved_from is not None
    assert geometry.aim_of(light.moved_from) == pytest.approx((0, 0, 0), abs=0.25)
    assert geometry.aim_of(Site((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))) is None


def test_a_picture_without_positions_has_no_plan() -> None:
    room = a_room()
    flat = Features(room.albedo, room.normal)
    assert ViewGeometry.of(flat) is None
    assert rig_drawing(flat, [turned()]) is None
    assert aim_picture(np.zeros((*SIZE, 3), np.uint8), flat, (turned(),)) is None
    empty_features = Features(room.albedo, np.zeros_like(room.normal), room.position)
    assert rig_drawing(empty_features, [turned()]) is None


def test_a_plan_marks_what_changed_and_nothing_else() -> None:
    room = a_room()
    still = HungLight(EmitterPlace("still", (1.0, 2.5, 0.0)), (1.0, 1.0, 1.0))
    plain, marked = rig_drawing(room, [still]), rig_drawing(room, [still, turned()])
    assert plain is not None
    assert marked is not None
    near = [np.abs(x.astype(int) - CHANGED).max(axis=-1) < 40 for x in (plain, marked)]
    assert not near[0].any()
    assert near[1].sum() > 50


def marks_along(light: HungLight, start: Any, end: Any) -> float:
    """Return the share of a line in the elevation, from one place to another, that is marked."""
    room, text = a_room(), FINER * max(11, 960 // 72)
    drawing = rig_drawing(room, [light])
    geometry = ViewGeometry.of(room)
    assert drawing is not None
    assert geometry is not None
    panels = plan_and_elevation(geometry, [light], np.array([0.0, 1, 0]), FINER * 960, None)
    plan, elevation = panels
    corner = (FINER * 960 - elevation.size[0]) // 2, plan.size[1] + round(2.4 * text)
    places = np.linspace(start, end, 200)
    pixels = ((elevation.at(places) + corner) / FINER).astype(int)
    # The room is grey, and the mark is orange, or half as much where it ends within a pixel.
    marked = drawing[..., 0].astype(int) - drawing[..., 2] > 0.4 * (CHANGED[0] - CHANGED[2])
    near = [marked[y, x - 1 : x + 2].any() for x, y in pixels]
    return float(np.mean(near))


def test_a_light_that_turned_has_a_dashed_line_in_its_old_direction() -> None:
    """It pointed straight down from a height of 3; a dash is as long as a gap."""
    light = turned()
    old, floor = (0.0, 2.6, 0.0), (0.0, 0.1, 0.0)
    assert marks_along(light, old, floor) == pytest.approx(0.5, abs=0.15)
    same_site = light.place.site
    only_moved = replace(light.place, moved_from=replace(same_site, position=(0.0, 2.0, 0.0)))
    assert marks_along(replace(light, place=only_moved), (0.0, 1.6, 0.0), floor) < 0.05
    narrowed = replace(light.place, moved_from=replace(same_site, cutoff=30.0))
    assert marks_along(replace(light, place=narrowed), old, floor) < 0.05


@pytest.mark.nightly
def test_a_light_that_moved_has_a_ring_and_an_arrow() -> None:
    light = turned()
    old_site = replace(light.place.site, position=(0.0, 1.0, 1.5))
    moved = replace(light, place=replace(light.place, moved_from=old_site))
    assert marks_along(moved, (0.0, 1.0, 1.5), (0.0, 3.0, 0.0)) > 0.85
    assert marks_along(light, (0.0, 1.0, 1.5), (0.0, 3.0, 0.0)) < 0.3


@pytest.mark.nightly
def test_a_new_light_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    draw_text = ImageDraw.ImageDraw.text

    def text(self: Any, xy: Any, label: Any, *rest: Any, **options: Any) -> None:
        texts.append(label)
        draw_text(self, xy, label, *rest, **options)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    new = EmitterPlace("lamp", (1.0, 2.5, 0.0), new="point")
    rig_drawing(a_room(), [HungLight(new, (1.0, 1.0, 1.0)), turned()])
    assert texts.count("lamp (new)") == 2  # in the plan and in the elevation
    assert texts.count("key") == 2


def test_an_arrow_leads_from_where_a_light_pointed_to_where_it_does_now() -> None:
    picture = aim_picture(np.zeros((*SIZE, 3), np.uint8), a_room(), (turned(),))
    assert picture is not None
    zoom = picture.shape[1] / SIZE[1]
    marked = np.abs(picture.astype(int) - CHANGED).max(axis=-1) < 12
    geometry = ViewGeometry.of(a_room())
    assert geometry is not None
    x, y = np.array(geometry.pixel((0, 1.5, -2))) * zoom
    assert marked[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4].any()


@pytest.mark.nightly
@pytest.mark.parametrize("position", [None, (1e6, 1e6, 1e6)])
def test_lights_far_away_do_not_shrink_the_room(position: Any) -> None:
    room = a_room()
    far = HungLight(EmitterPlace("far", position, (0.0, -1.0, 0.0)), (1.0, 1.0, 1.0))
    single, pair = rig_drawing(room, [turned()]), rig_drawing(room, [turned(), far])
    assert single is not None
    assert pair is not None
    assert single.shape == pair.shape


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.2, "a fifth"), (0.19, "a fifth"), (0.5, "half"), (0.08, "8 %"), (0.42, "42 %")],
)
def test_shares_are_said_as_people_say_them(share: float, words: str) -> None:
    assert spoken_fraction(share) == words


def test_the_section_lists_changes_and_shows_both_pictures() -> None:
    numbers: Mapping[str, Any] = {"turn": 37.0}
    change = LightChange("key", "key <turned> by 37°: a fifth of what was missed", numbers)
    hung = HungLights((turned(),), (change,), (0.0, 1.0, 0.0), 0.3, 0.2)
    html = placement_section(hung, np.zeros((*SIZE, 3), np.uint8), a_room())
    assert html.count("<img") == 2
    assert "key &lt;turned&gt; by 37°" in html
    assert "brings a third of what was missed" in html
    assert placement_section(None, np.zeros((*SIZE, 3), np.uint8), a_room()) == ""


def test_a_sheet_of_lights_ends_in_their_plan(make_basis: BasisFactory) -> None:
    room = a_room()
    basis = replace(make_basis(2, size=SIZE), features=room)
    plain = light_sheet(basis, title="room")
    with_plan = light_sheet(basis, title="room", lights=[turned()])
    assert with_plan.shape[1] == plain.shape[1]
    assert len(with_plan) > len(plain)
    assert np.array_equal(with_plan[: len(plain)], plain)
