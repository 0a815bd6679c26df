"""Normal equations that follow the brush: the same bits as those built from scratch."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from least_squares import inner_products
from nightly import examples

from lightpaint.errors import SizeError
from lightpaint.lighting.live.tiles import MAX_SUM_BYTES, TiledEquations, tile_side
from lightpaint.lighting.normal_equations import NormalEquations

HEIGHT, WIDTH = 21, 30


def _picture(seed: int, n: int = 4) -> tuple[Any, Any, Any]:
    rng = np.random.default_rng(seed)
    images = rng.random((n, HEIGHT, WIDTH, 3)).astype(np.float32)
    target = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    importance = (rng.random((HEIGHT, WIDTH)) * (rng.random((HEIGHT, WIDTH)) < 0.5)).astype(
        np.float32
    )
    return images, target, importance


def _bits(equations: NormalEquations) -> tuple[bytes, bytes, bytes]:
    return equations.M.tobytes(), equations.b.tobytes(), equations.target_norm2.tobytes()


@st.composite
def strokes(draw: st.DrawFn) -> list[tuple[slice, slice, int]]:
    """Rectangles, single pixels and empty ones included, and a seed for what is painted."""
    strokes_drawn = []
    for _ in range(draw(st.integers(1, 5))):
        top, left = draw(st.integers(0, HEIGHT)), draw(st.integers(0, WIDTH))
        rows, columns = draw(st.integers(0, HEIGHT)), draw(st.integers(0, WIDTH))
        seed = draw(st.integers(0, 99))
        strokes_drawn.append((slice(top, top + rows), slice(left, left + columns), seed))
    return strokes_drawn


@pytest.mark.parametrize("side", [1, 7, 8, 64, None])
def test_equal_to_the_sums_over_the_whole_picture(side: int | None):
    picture = _picture(0)
    equations = TiledEquations(*picture, side=side).equations
    expected = inner_products(*picture)
    # Another order of summation, in float64.
    for actual, expected_sums in zip(
        (equations.M, equations.b, equations.target_norm2), expected, strict=True
    ):
        np.testing.assert_allclose(actual, expected_sums, rtol=1e-12)


@settings(max_examples=examples(40, 200), deadline=None)
@given(seed=st.integers(0, 20), painted=strokes(), side=st.sampled_from([3, 8, 32]))
def test_update_is_rebuild_and_undo_is_undone_bit_for_bit(
    seed: int, painted: list[tuple[slice, slice, int]], side: int
):
    images, target, importance = _picture(seed)
    tiled = TiledEquations(images, target, importance, side=side)
    before = _bits(tiled.equations)
    undo = []
    for rows, columns, colour in painted:
        region = rows, columns
        rng = np.random.default_rng(colour)
        undo.append((region, target[region].copy(), importance[region].copy()))
        stroke = rng.random(target[region].shape).astype(np.float32)
        weight = np.round(rng.random(importance[region].shape) * 2).astype(np.float32)
        changes_target, changes_importance = colour % 3 != 0, colour % 3 != 1
        if changes_target:
            target[region] = stroke
        if changes_importance:
            importance[region] = weight
        tiled.update(region, with_M=changes_importance)
        rebuilt = TiledEquations(images, target, importance, side=side)
        assert _bits(tiled.equations) == _bits(rebuilt.equations)
    for region, colours, weights in reversed(undo):
        target[region], importance[region] = colours, weights
        tiled.update(region)
    assert _bits(tiled.equations) == before


def test_only_the_tiles_of_the_stroke_are_read():
    images, target, importance = _picture(1)
    tiled = TiledEquations(images, target, importance + 1, side=8)
    images[:, 8:] = np.nan
    images[:, :, 16:] = np.nan
    target[0:8, 3:16] = (0.5, 0.25, 1)
    tiled.update((slice(0, 8), slice(3, 16)), with_M=False)
    assert np.isfinite(tiled.equations.M).all()


def test_pixels_without_importance_may_hold_anything():
    images, target, importance = _picture(2)
    expected = _bits(TiledEquations(images, target, importance).equations)
    images[:, importance == 0] = np.nan
    target[importance == 0] = np.inf
    assert _bits(TiledEquations(images, target, importance).equations) == expected


def test_importance_weighs_the_squared_residual():
    images, target, importance = _picture(3)
    tiled = TiledEquations(images, target, np.full_like(importance, 2.0))
    plain = TiledEquations(images, target, np.ones_like(importance)).equations
    np.testing.assert_allclose(tiled.equations.M, 2 * plain.M, rtol=1e-12)
    np.testing.assert_allclose(tiled.equations.b, 2 * plain.b, rtol=1e-12)


def test_a_region_that_runs_backwards():
    tiled = TiledEquations(*_picture(5))
    before = _bits(tiled.equations)
    with pytest.raises(ValueError, match="go forwards"):
        tiled.update((slice(3, 0, -1), slice(0, 3)))
    assert _bits(tiled.equations) == before


def test_pictures_of_another_size():
    images, target, importance = _picture(6)
    with pytest.raises(SizeError, match="do not fit"):
        TiledEquations(images, target[1:], importance)


@pytest.mark.parametrize(("n", "size"), [(12, (360, 640)), (64, (360, 640)), (256, (1080, 1920))])
def test_the_sums_of_all_tiles_fit(n: int, size: tuple[int, int]):
    side = tile_side(n, *size)
    tiles = -(-size[0] // side) * -(-size[1] // side)
    assert 4 * tiles * 3 * (n + 1) ** 2 * 8 <= MAX_SUM_BYTES or side >= max(size)


def test_two_halves_add_up_and_other_lights_do_not():
    images, target, importance = _picture(7)
    halves = [
        NormalEquations(*inner_products(images[:, part], target[part], importance[part]))
        for part in (slice(0, 10), slice(10, None))
    ]
    sums_of_halves, sums_of_all = halves[0] + halves[1], inner_products(images, target, importance)
    np.testing.assert_allclose(sums_of_halves.M, sums_of_all[0], rtol=1e-12)
    np.testing.assert_allclose(sums_of_halves.b, sums_of_all[1], rtol=1e-12)
    np.testing.assert_allclose(sums_of_halves.target_norm2, sums_of_all[2], rtol=1e-12)
    with pytest.raises(SizeError, match="4 lights and one of 3"):
        sums_of_halves + NormalEquations(*inner_products(images[:3], target, importance))
