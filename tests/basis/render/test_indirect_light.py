"""Indirect light of the one pass: what is left of a render that ends after one bounce."""

import random
from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

from lightpaint.basis.render import integrators
from lightpaint.basis.render.basis_render import render_basis, train_guide
from lightpaint.basis.render.render_parts import PartRenderer, PartSums, plan_parts
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

SPP = 16


def test_direct_light_is_that_of_one_bounce(tmp_path: Path):
    """The same samples of the same paths, as far as the one bounce goes.

    With one light no choice among lights depends on what was learned of later vertices. The sums
    are of float32, so 1e-5 of the brightest pixel is round-off.
    """
    path = write_room(tmp_path)
    name = load_scene(path).lights[0].name
    scenes = [load_scene(path, integrator=x) for x in ("path", "path:max_depth=2")]
    all_bounces, direct = (render_basis(scene.only([name]), spp=SPP) for scene in scenes)
    assert all_bounces.indirect is not None
    assert direct.indirect is None
    direct_images = all_bounces.images - all_bounces.indirect.planes.array()
    np.testing.assert_allclose(
        direct_images, direct.images, rtol=1e-5, atol=1e-5 * direct.images.max()
    )
    noise = all_bounces.half_differences - all_bounces.indirect.noise.array()
    scale = np.abs(direct.half_differences).max()
    np.testing.assert_allclose(noise, direct.half_differences, rtol=1e-4, atol=1e-5 * scale)
    assert all_bounces.indirect.planes.array().sum() > 0.02 * all_bounces.images.sum()


def test_sums_of_both_do_not_depend_on_keeping_them_apart(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
):
    split_basis = render_basis(small_room, spp=SPP)
    monkeypatch.setattr(integrators, "SPLIT_MAX_BYTES", 0)
    together = render_basis(small_room, spp=SPP)
    assert split_basis.indirect is not None
    assert together.indirect is None
    # The same values, added in another order in float32.
    scale = together.images.max()
    np.testing.assert_allclose(split_basis.images, together.images, rtol=1e-5, atol=1e-6 * scale)


def test_parts_in_any_order_make_the_same(small_room: Scene, monkeypatch: pytest.MonkeyPatch):
    from lightpaint.basis.render import render_parts

    monkeypatch.setattr(render_parts, "PART_SAMPLES", 2**11)
    guide_table = train_guide(small_room, 0)
    plan = plan_parts(small_room, SPP)
    assert len(plan) > 2
    order = list(plan)
    random.Random(1).shuffle(order)
    sums, renderer = PartSums(small_room, plan, seed=0), PartRenderer(small_room, 0, guide_table)
    for part in order:
        sums.add(part, *renderer.render(part))
    renderer.close()
    indirect, single_render = (
        sums.basis(guide_table).indirect,
        render_basis(small_room, spp=SPP).indirect,
    )
    assert indirect is not None
    assert single_render is not None
    np.testing.assert_array_equal(indirect.planes.array(), single_render.planes.array())
    np.testing.assert_array_equal(indirect.noise.array(), single_render.noise.array())


def test_what_goes_on_knows_it_as_well(small_room: Scene):
    first, single_render = (render_basis(small_room, spp=spp) for spp in (SPP // 2, SPP))
    continuation = render_basis(small_room, spp=SPP, start=first)
    assert continuation.indirect is not None
    assert single_render.indirect is not None
    scale = single_render.indirect.planes.array().max()
    # Sums are made of means and half differences again, in float32.
    np.testing.assert_allclose(
        continuation.indirect.planes.array(),
        single_render.indirect.planes.array(),
        rtol=1e-5,
        atol=1e-6 * scale,
    )


def test_what_went_on_from_a_basis_without_it_does_not(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as before:
        before.setattr(integrators, "SPLIT_MAX_BYTES", 0)
        first = render_basis(small_room, spp=SPP // 2)
    continuation, single_render = (
        render_basis(small_room, spp=SPP, start=first),
        render_basis(small_room, spp=SPP),
    )
    assert continuation.indirect is None
    scale = single_render.images.max()
    np.testing.assert_allclose(
        continuation.images, single_render.images, rtol=1e-5, atol=1e-6 * scale
    )


def test_planes_of_several_bases_bring_it_along(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A scene that gained a light: its own plane is rendered, the others come from the cache."""
    from lightpaint.basis.cache.cached_render import obtain_basis

    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    scene = load_scene(write_room(tmp_path))
    names = [light.name for light in scene.lights]
    before = obtain_basis(scene.only(names[:2]), spp=SPP)
    basis = obtain_basis(scene.only(names[:3]), spp=SPP)
    assert basis.origin.is_composed
    assert before.indirect is not None
    assert basis.indirect is not None
    indirect_planes = basis.indirect.planes.array()[:2]
    np.testing.assert_array_equal(indirect_planes, before.indirect.planes.array())
    assert (basis.indirect.planes.plane(2) <= basis.planes.plane(2) + 1e-6).all()
