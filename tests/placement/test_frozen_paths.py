"""Columns of frozen paths: the light that plain renders have, at any place, by the same paths."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import REPOSITORY, write_room

import lightpaint as lp
from lightpaint.arrays import Floats, Position
from lightpaint.errors import SceneError
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.placement.paths.frozen_paths import FrozenPaths, PathSums
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.pose import Site
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.surfaces import render_features

#: Where kernels are counted.
COUNT_KERNELS = REPOSITORY / "tests" / "frozen_path_kernels.py"

#: Largest number of vertices that share light: about those of one path for each pixel.
MOST = 3000

#: Lights of the test room that no ray meets by chance.
SEARCHED = ("bulb", "beam", "sun")


@pytest.fixture
def room(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path))


def sites(scene: Scene) -> list[Site]:
    return [scene.light(name).members[0].site for name in SEARCHED]


def along_paths(scene: Scene, work: Callable[[FrozenPaths], Any], **options: Any) -> Any:
    return scene.while_loaded(lambda loaded: work(FrozenPaths(scene, loaded, **options)))


def test_columns_are_the_planes_of_a_basis(room: Scene) -> None:
    """Direct and indirect light, glossy walls included, within the noise of both."""
    basis = lp.render_basis(room, spp=1024)
    names = [light.name for light in basis.lights]
    planes = basis.images[[names.index(name) for name in SEARCHED]]
    columns = along_paths(room, lambda p: p.columns(sites(room)), first_hits=100, bounces=100)
    for plane, column in zip(planes, columns, strict=True):
        assert column.mean() == pytest.approx(plane.mean(), rel=0.02)  # noise
        assert np.square(column - plane).sum() < 0.03 * np.square(plane).sum()  # noise


def test_a_spot_in_a_narrow_cone_is_that_which_shines_all_around(room: Scene) -> None:
    """Only what it lights is traced; later directions in the cone need no further rays."""
    spots = [
        Site((0.1, 1.2, 0.4), (math.sin(x), -math.cos(x), 0.0), cutoff=25.0, beam=10.0)
        for x in (0.0, 0.1)
    ]
    opposite = [Site((0.1, 1.2, 0.4), (0.0, 1.0, 0.0), cutoff=5.0), *spots]

    def compare(paths: FrozenPaths) -> None:
        narrow = [paths.columns([spot])[0] for spot in spots]
        paths._forget()
        wide = paths.columns(opposite)[1:]  # all directions, since one is the other way
        assert all(column.any() for column in narrow)
        np.testing.assert_allclose(narrow, wide, atol=1e-6 * wide.max())  # float32

    along_paths(room, compare, first_hits=4, bounces=4)


def test_more_first_hits_in_some_pixels_are_less_noise_there_alone(room: Scene) -> None:
    [site] = sites(room)[:1]
    pixels = np.array([3, 200, 201])

    def compare(paths: FrozenPaths) -> None:
        others = np.setdiff1d(np.arange(math.prod(paths.size)), pixels)
        before = paths._sums(paths.direct, [site])[0]
        first, second = (paths.with_more_hits(pixels, 32) for _ in range(2))
        one, other = (its._sums(its.direct, [site])[0] for its in (first, second))
        np.testing.assert_array_equal(one[others], before[others])
        assert not np.array_equal(one[pixels], other[pixels])
        np.testing.assert_allclose(one[pixels], other[pixels], rtol=0.05)  # noise

    along_paths(room, compare, first_hits=1, bounces=0)


@pytest.mark.parametrize("first_hits", [1, 9])
def test_sums_of_one_light_are_its_column(room: Scene, first_hits: int) -> None:
    """One kernel with the cone of a spot, and vertices that are cached and summed by NumPy."""
    panel = PanelSite((0.2, 1.5, 0.3), (0.0, -1.0, 0.0), side=0.3)
    placed = [*sites(room), panel, Site((0.1, 1.2, 0.4), (0.0, -1.0, 0.2), cutoff=30.0, beam=30.0)]

    def compare(paths: FrozenPaths) -> None:
        assert paths.indirect is not None
        direct, indirect = (PathSums(paths, x) for x in (paths.direct, paths.indirect))
        for site, column in zip(placed, paths.columns(placed), strict=True):
            image = np.array(direct(site)) + np.array(indirect(site))
            paths.add_panel(image.reshape(-1, 3), site)
            assert image.any()
            scale = column.max()  # float32, and arccos near the axis of a spot
            np.testing.assert_allclose(image.reshape(column.shape), column, atol=1e-5 * scale)

    along_paths(room, compare, first_hits=first_hits, bounces=4)


@pytest.mark.nightly
def test_vertices_of_all_paths_share_kernels(room: Scene) -> None:
    """Each takes a second to compile: none is of a film, a number of paths or a bounce alone.

    There are three of each of these. Where one kernel suffices, Dr.Jit compiles the same twice in
    one run of fifteen, with variables in another order.
    """
    command = [sys.executable, str(COUNT_KERNELS), str(room.path), *SEARCHED]
    completed = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert completed.returncode == 0, completed.stderr
    assert all(1 <= count < 3 for count in json.loads(completed.stdout))


def test_a_search_refines_on_a_larger_film_than_it_compares_on(room: Scene) -> None:
    small = room.reduced("1/2")

    def columns(loaded: Any) -> list[Floats]:
        paths = SearchPaths([small], [room], loaded, seed=1)
        return [film.columns(sites(room)) for film in (paths.compare, paths.refine, paths.judge)]

    compared, refined, judged = room.while_loaded(columns)
    assert refined.shape == judged.shape == (3, 2 * 20 * 24, 3)
    assert np.abs(refined - judged).max() > 0  # paths of their own
    for one, other in zip(compared, refined, strict=True):
        image = block_mean(other[: 20 * 24].reshape(20, 24, 3), 2).reshape(-1, 3)
        assert one.mean() == pytest.approx(image.mean(), rel=0.1)  # noise
        assert np.square(one - image).sum() < 0.2 * np.square(image).sum()  # noise


def test_half_differences_have_the_power_of_the_noise(room: Scene) -> None:
    """Means of other paths differ by the noise of both, half differences are of as much."""

    def columns(loaded: Any) -> list[Floats]:
        paths = SearchPaths([room.reduced("1/2")], [room], loaded, seed=4)
        return [film.columns(sites(room)) for film in (paths.refine, paths.judge, paths.spread)]

    sets = room.while_loaded(columns)
    means, halves = np.split(np.array(sets, dtype=float), 2, axis=2)
    power = np.square(means - means.mean(axis=0)).sum(axis=(0, 2, 3)) / (len(sets) - 1)
    estimate = np.square(halves).sum(axis=(2, 3)).mean(axis=0)
    assert estimate == pytest.approx(power, rel=0.35)  # noise of both, of few bright paths


def test_direct_light_alone_is_that_of_the_direct_integrator(tmp_path: Path) -> None:
    room = load_scene(write_room(tmp_path), integrator="path:max_depth=2")
    basis = lp.render_basis(room, spp=256)
    names = [light.name for light in basis.lights]
    planes = basis.images[[names.index(name) for name in SEARCHED]]
    columns = along_paths(room, lambda p: p.columns(sites(room)), first_hits=100, bounces=9)
    for plane, column in zip(planes, columns, strict=True):
        assert np.square(column - plane).sum() < 0.01 * np.square(plane).sum()  # noise


def test_a_filter_along_surfaces_takes_noise_and_no_light(room: Scene) -> None:
    features = render_features(room)
    truth = along_paths(room, lambda p: p.columns(sites(room)), first_hits=100, bounces=100)

    def render_pair(paths: FrozenPaths) -> tuple[Floats, Floats]:
        raw = paths.columns(sites(room))
        return raw, paths.filtered_along(features).columns(sites(room))

    raw, filtered = along_paths(room, render_pair, first_hits=100, bounces=2, seed=3)
    errors = [np.square(image - truth).sum(axis=(1, 2, 3)) for image in (raw, filtered)]
    assert (errors[1] < 0.7 * errors[0]).all()
    assert filtered.mean() == pytest.approx(truth.mean(), rel=0.05)


@pytest.mark.parametrize("bounces", [6, 8, 20])
def test_no_number_of_paths_changes_the_energy(room: Scene, bounces: int) -> None:
    """Also where they do not fill square grids of cells in a pixel."""
    light, expected = (
        along_paths(room, lambda p: p.indirect_images(sites(room)).sum(), bounces=count)
        for count in (bounces, 100)
    )
    assert light == pytest.approx(expected, rel=0.1)  # noise


def test_vertices_that_share_with_none_are_those_of_all_paths(room: Scene) -> None:
    """In cells so small that each vertex has its own, as without cells."""
    placed = [*sites(room), Site((0.1, 1.2, 0.4), (0.0, -1.0, 0.2), cutoff=30.0, beam=20.0)]
    own, shared = (
        along_paths(room, lambda p: p.indirect_images(placed), bounces=4, seed=2, **options)
        for options in ({}, {"shared": 10**12})
    )
    np.testing.assert_allclose(shared, own, atol=1e-5 * own.max())  # float32


@pytest.mark.nightly
def test_vertices_of_all_paths_share_few_shadow_rays(room: Scene) -> None:
    """As many as those of few paths have less than half their noise, and the same light."""
    truth = along_paths(room, lambda p: p.indirect_images(sites(room)), bounces=400)

    def error(seed: int, **options: Any) -> Floats:
        def squares(paths: FrozenPaths) -> Floats:
            assert paths.indirect is not None
            assert len(paths.indirect) <= MOST
            return np.square(paths.indirect_images(sites(room)) - truth).sum(axis=(1, 2, 3))

        return along_paths(room, squares, first_hits=1, seed=seed, **options)

    few = np.mean([error(seed, bounces=1) for seed in range(3)], axis=0)
    many = np.mean([error(seed, bounces=25, shared=MOST) for seed in range(3)], axis=0)
    assert (many < 0.5 * few).all()


def test_one_place_has_one_column_whatever_came_before(room: Scene) -> None:
    site = Site(position=(0.2, 1.1, 0.4))
    other_site = Site(position=(-0.4, 1.3, 0.1))

    def columns(paths: FrozenPaths) -> list[Floats]:
        return [
            paths.columns([site])[0],
            paths.columns([other_site, site])[1],
            paths.columns([other_site])[0],
        ]

    first, second, other = along_paths(room, columns)
    np.testing.assert_array_equal(first, second)
    assert np.abs(first - other).max() > 0
    third, _, _ = along_paths(room, columns)
    np.testing.assert_array_equal(first, third)
    reseeded, _, _ = along_paths(room, columns, seed=1)
    assert np.abs(first - reseeded).max() > 0


def test_light_falls_with_the_square_of_the_distance(room: Scene) -> None:
    """Against the closed form of a point light, on the floor, which is diffuse."""

    def ratio(paths: FrozenPaths) -> Floats:
        near, far = (
            paths.contributions(paths.direct, [Site(position=(0, y, 0.2))])[0].astype(float)
            for y in (1.0, 1.001)
        )
        points = paths.points(paths.direct).astype(float)
        squares = [
            np.square(points - np.array([0, y, 0.2])).sum(axis=1, keepdims=True)
            for y in (1.0, 1.001)
        ]
        # The cosines are those of a floor at height 0.
        cosines = [y / np.sqrt(squared) for y, squared in zip((1.0, 1.001), squares, strict=True)]
        is_lit = (near > 0).all(axis=1) & (far > 0).all(axis=1) & (np.abs(points[:, 1]) < 1e-4)
        assert is_lit.sum() > 100
        expected = cosines[0] / squares[0] * squares[1] / cosines[1]
        return near[is_lit] / far[is_lit] / expected[is_lit]

    np.testing.assert_allclose(along_paths(room, ratio, bounces=0), 1, atol=1e-4)  # precision


def test_cones_are_those_of_mitsuba(room: Scene) -> None:
    """A spot's own column is what its cone leaves of one that shines all around."""
    beam = room.light("beam").members[0].site

    def render_pair(paths: FrozenPaths) -> tuple[Floats, Floats]:
        vertices = paths.direct
        away = paths.points(vertices).astype(float) - beam.position
        cosine = away @ beam.direction / np.linalg.norm(away, axis=1)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        # Linear in the angle, as Mitsuba documents it.
        share = np.clip((beam.cutoff - angle) / (beam.cutoff - beam.beam), 0, 1)
        light = share[:, None] * paths.contributions(vertices, [beam])[0]
        pixels, starts = vertices.first_of_pixel
        image = np.zeros((paths.size[0] * paths.size[1], 3))
        image[pixels] = np.add.reduceat(light, starts, axis=0)
        return paths.columns([beam])[0].reshape(-1, 3), image

    full_image, image = along_paths(room, render_pair, bounces=0)
    np.testing.assert_allclose(image, full_image, atol=2e-4 * full_image.max())  # single precision


def panel(place: Position, towards: Position, side: float) -> tuple[NewEmitter, PanelSite]:
    """A panel as an emitter, and as the origin of a column."""
    pose = lp.Pose(position=place, target=towards)
    emitter = NewEmitter("seen", "panel", pose, size=(side, side))
    return emitter, PanelSite(place, emitter.site.direction, side=side)


def test_a_panel_that_the_camera_sees_is_in_its_column(tmp_path: Path) -> None:
    """Its front, with the edges that renders have, and all that it lights."""
    room = load_scene(write_room(tmp_path, film='<rfilter type="box"/>'))
    emitter, site = panel((-0.3, 1.2, 0.3), (-0.1, 0.9, 2.0), 0.3)
    basis = lp.render_basis(room.with_new_emitters([emitter]), spp=1024)
    plane = basis.image("seen")
    column = along_paths(room, lambda p: p.columns([site])[0], first_hits=16, bounces=16)
    assert plane.max() == pytest.approx(1, rel=0.01)
    assert np.square(column - plane).sum() < 0.005 * np.square(plane).sum()  # noise


@pytest.mark.nightly
def test_the_back_of_a_panel_is_dark_and_in_the_way(tmp_path: Path) -> None:
    """It hides the wall that it lights, and absorbs light that comes back from there."""
    room = load_scene(write_room(tmp_path, film='<rfilter type="box"/>'))
    emitter, site = panel((0.0, 1.0, -0.6), (0.0, 1.0, -2.0), 0.8)
    basis = lp.render_basis(room.with_new_emitters([emitter]), spp=1024)
    plane = basis.image("seen")

    def columns(paths: FrozenPaths) -> tuple[Floats, Floats]:
        column = paths.columns([site])[0]
        image = np.array(PathSums(paths, paths.direct)(site))
        assert paths.indirect is not None
        image += np.array(PathSums(paths, paths.indirect)(site))
        paths.add_panel(image.reshape(-1, 3), site)
        return column, image.reshape(column.shape)

    for column in along_paths(room, columns, first_hits=144, bounces=64):
        assert plane[10, 12].max() == 0
        # Precision: a pixel at the edge has the mean of the light on all of the wall behind it.
        assert column.mean() == pytest.approx(plane.mean(), rel=0.045)
        assert np.square(column - plane).sum() < 0.012 * np.square(plane).sum()


def test_a_panel_fills_pixels_by_its_area(room: Scene) -> None:
    """In closed form, for one that is parallel to the picture, however it lies on the pixels."""
    width = 2 * math.tan(math.radians(25)) / 24  # of a pixel, at a distance of 1
    eye, ahead = np.array([0.0, 1.0, 3.5]), np.array([0.0, -0.2, -3.5])
    ahead /= np.linalg.norm(ahead)

    def filled(paths: FrozenPaths, side: float, off: float, away: float, axis: int = -1) -> float:
        place = eye + away * ahead + (off, 0, 0)
        lines = paths.sight_lines.near(place.tolist(), side)
        direction = axis * ahead[None]
        half_sides = PanelSite(side=side).half_sides_towards(direction)
        return float(lines.covered(place.tolist(), direction, half_sides).sum())

    def check(paths: FrozenPaths) -> None:
        for side, off in (0.3, 0.0), (0.31, 0.04), (0.01, 0.017):
            expected = (side / (2 * width)) ** 2
            assert filled(paths, side, off, 2.0) == pytest.approx(expected, rel=0.01)  # cells
        assert filled(paths, 0.3, 0.0, 2.0, axis=1) == 0  # its back
        assert filled(paths, 0.3, 0.0, 9.0) == 0  # behind the wall

    along_paths(room, check, first_hits=16, bounces=0)


def test_hidden_emitters_are_not_seen(tmp_path: Path) -> None:
    paths = write_room(tmp_path), "path:max_depth=5"
    rooms = [
        load_scene(paths[0], integrator=paths[1] + more) for more in ("", ",hide_emitters=true")
    ]
    _, site = panel((-0.3, 1.2, 0.3), (-0.1, 0.9, 2.0), 0.3)
    seen, hidden = (
        along_paths(room, lambda p: p.columns([site])[0].max(), bounces=0) for room in rooms
    )
    assert hidden < 0.5 < seen


def test_what_paths_cannot_be_frozen_for(room: Scene, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="first_hits is 7: expected a square number"):
        along_paths(room, lambda p: p, first_hits=7)


def test_all_first_hits_may_be_replaced(room: Scene) -> None:
    """Nothing that is kept remains, as on a film of one pixel."""
    pixels = np.arange(math.prod(room.size))
    columns = along_paths(
        room,
        lambda p: p.with_more_hits(pixels, 4).columns(sites(room)),
        first_hits=1,
        bounces=0,
    )
    assert np.isfinite(columns).all()
    assert columns.any()
