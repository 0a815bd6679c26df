"""The part that lamps play in a picture: presets and references ask them by it."""

from dataclasses import replace
from typing import Any

import numpy as np

import lightpaint as lp
from lightpaint.basis.lights import Lights
from lightpaint.images.denoiser import Features
from lightpaint.paint import protocol
from lightpaint.paint.presets.lamp_roles import BLOCKS, LampRoles, find_roles
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

H, W = 24, 32

SKY = [f"sky.x{x}.y{y}" for y in range(8) for x in range(16)]


def session_in(basis: lp.Basis) -> Session:
    store = MemoryStore(Identity.of([basis]))
    look = basis.current_look
    return Session([basis], [look], store, settings=Settings(), transform=lp.ViewTransform())


def under_a_sky(make_basis: Any) -> lp.Basis:
    """A ball under a sky of 16x8 texels, whose column 4 stands at its right, and a small lamp."""
    y, x = np.mgrid[:H, :W]
    across, up = (x - W / 2) / 10, (H / 2 - y) / 10
    out = np.sqrt(np.maximum(0, 1 - across**2 - up**2))
    normal = np.where((out > 0)[..., None], np.stack([across, up, out], axis=-1), [0, 0, 1.0])
    images = []
    for name in SKY:
        column, row = (int(part[1:]) for part in name.split(".")[1:])
        angle, height = 2 * np.pi * column / 16, (3.5 - row) / 4
        to_light = np.array([np.sin(angle), height, np.cos(angle)])
        shading = np.maximum(normal @ (to_light / np.linalg.norm(to_light)), 0)
        images.append(shading[..., None] * np.ones(3))
    images.append(np.where(np.hypot(y - 18, x - 6) < 3, 20.0, 0.01)[..., None] * np.ones(3))
    basis: lp.Basis = make_basis(
        images=np.array(images), names=[*SKY, "lamp"], emission=[[0.01] * 3] * (len(SKY) + 1)
    )
    lights = [
        replace(light, plugin="spot" if light.name == "lamp" else "envmap")
        for light in basis.lights
    ]
    position = np.stack([x, -y, np.zeros_like(x)], axis=-1).astype(np.float32)
    features = Features(
        np.full((H, W, 3), 0.5, np.float32), normal.astype(np.float32), position=position
    )
    return replace(basis, lights=Lights.of(lights), features=features)


def test_parts_of_a_sky_are_one_lamp_each(make_basis: Any) -> None:
    roles, _ = find_roles(session_in(under_a_sky(make_basis)).views[0])
    assert len(roles.light) == BLOCKS[0] * BLOCKS[1] + 1
    lights = roles.lights(np.arange(len(roles.light)) == 0)
    found = [name for name, is_one in zip([*SKY, "lamp"], lights, strict=True) if is_one]
    assert found == ["sky.x0.y0", "sky.x1.y0", "sky.x0.y1", "sky.x1.y1"]
    np.testing.assert_array_equal(roles.lamps(lights), np.arange(len(roles.light)) == 0)
    lights[0] = False
    assert not roles.lamps(lights).any()


def test_a_low_sun_in_a_sky_stands_at_a_side(make_basis: Any) -> None:
    session = session_in(under_a_sky(make_basis))
    session.handle(protocol.ApplyPreset("golden_hour"), {})
    view = session.views[0]
    ratio = view.image / view.current
    warmth = np.log2(ratio[..., 0] / ratio[..., 2])
    left, right = warmth[12, 6:10].mean(), warmth[12, 23:27].mean()
    assert abs(left - right) > 1
    roles, _ = find_roles(view)
    assert np.abs(roles.sides[roles.sun]).min() > 0.3


def roles_of(light: np.ndarray, kinds: list[str], normal: np.ndarray | None = None) -> LampRoles:
    nobody = np.zeros(light.shape[1:], np.float32)
    return LampRoles(light.astype(np.float32), kinds, nobody, [], normal)


def test_a_clouded_sky_is_of_daylight_and_not_of_a_lit_cove() -> None:
    x = np.mgrid[:H, :W][1] / W
    sky, cove = np.ones((H, W)), np.where(x < 0.2, 1.0, 0.4)
    spot = np.where(x > 0.95, 9.0, 0.0)
    roles = roles_of(np.array([sky, 0.3 * cove, spot]), ["constant", "area", "spot"])
    assert roles.even_daylight[0]
    assert not roles.even_daylight[2]
    without = roles_of(np.array([0.3 * cove * (x < 0.25), spot]), ["area", "spot"])
    np.testing.assert_array_equal(without.even_daylight, without.is_soft)


def test_the_horizon_is_the_lower_of_two_washes_of_a_wall() -> None:
    y = np.mgrid[:H, :W][0] / H
    normal = np.broadcast_to(np.array([0, 0, 1], np.float32), (H, W, 3))
    upper, lower = np.where(y < 0.4, 1.0, 0.05), np.where(y > 0.4, 1.0, 0.05)
    roles = roles_of(np.array([upper, lower]), ["area", "area"], normal)
    np.testing.assert_array_equal(roles.horizon, [False, True])
    alone = roles_of(np.array([lower]), ["area"], normal)
    np.testing.assert_array_equal(alone.horizon, [False])


def test_a_lamp_in_view_is_brighter_at_the_same_level_than_a_spot_of_its_size() -> None:
    spot = np.zeros((2, H, W))
    spot[0, 3:6, 3:6] = spot[1, 12:15, 20:23] = 1.0
    even = np.full((1, H, W), 0.1)
    roles = roles_of(np.concatenate([spot, even]), ["point", "spot", "constant"])
    seen = replace(roles, seen=np.array([0.4, 0.1, 0.0]))
    flame, other = np.array([True, False, False]), np.array([False, True, False])
    np.testing.assert_array_equal(seen.candle, flame)
    assert seen.level(flame) < seen.level(other)
    assert roles.level(flame) == roles.level(other)
