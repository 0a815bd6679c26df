"""The filter along surfaces: linear, blind to light, and nothing crosses an edge."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from nightly import nightly

from lightpaint.images.denoiser import DARKEST, Features
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.images.surface_filter import (
    BAND_ROWS,
    BEND,
    NEAR_PLANE,
    RADIUS,
    SQUARINGS,
    SurfaceFilter,
)

SIZE = (BAND_ROWS + 13, 40)  # of two bands

Make = Callable[..., Features]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def grid(height: int, width: int) -> tuple[Any, Any]:
    y, x = np.mgrid[:height, :width].astype(np.float32)
    return y, x


def wall(size: tuple[int, int] = SIZE, *, albedo: Any = 0.5) -> Features:
    """A flat wall across the view, a pixel a unit wide."""
    y, x = grid(*size)
    position = np.stack([x, y, np.zeros_like(x)], axis=-1)
    normal = np.broadcast_to(np.float32([0, 0, 1]), position.shape)
    return Features(np.broadcast_to(np.float32(albedo), position.shape), normal, position)


def room(rng: np.random.Generator) -> Features:
    """A floor that meets a wall, a ball before both, and sky; with colours and uneven positions."""
    y, x = grid(*SIZE)
    horizon = SIZE[0] * 0.6
    on_floor = y > horizon
    position = np.stack(
        [
            x,
            np.where(on_floor, horizon, y),
            np.where(on_floor, 2 * (horizon - y), np.float32(0)),
        ],
        axis=-1,
    )
    normal = np.where(on_floor[..., None], np.float32([0, -1, 0]), np.float32([0, 0, -1]))
    slopes = np.stack([(x - 15) / 9, (y - 20) / 9], axis=-1)
    within = np.square(slopes).sum(axis=-1) < 1
    depth = -np.sqrt(np.maximum(1 - np.square(slopes).sum(axis=-1), 0))
    ball = np.concatenate([slopes, depth[..., None]], axis=-1)
    position = np.where(within[..., None], [15, 20, -30] + 9 * ball, position)
    normal = np.where(within[..., None], ball, normal)
    normal[:4] = position[:4] = 0
    albedo = rng.random((*SIZE, 3))
    position += rng.normal(size=position.shape) * 0.05
    return Features(*(plane.astype(np.float32) for plane in (albedo, normal, position)))


def filter_pixelwise(features: Features, image: Any, radius: int) -> Any:
    """Filter a picture pixel by pixel, in double precision, as the words of the module say."""
    albedo, normal, position = (
        guide.astype(np.float64)
        for guide in (np.maximum(features.albedo, DARKEST), features.normal, features.position)
    )
    (height, width), is_surface = features.size, normal.any(axis=-1)
    near = [(-1, 0), (1, 0), (0, -1), (0, 1)]

    def is_inside(y: int, x: int) -> bool:
        return 0 <= y < height and 0 <= x < width

    length = np.full((height, width), np.inf)
    for y, x in np.ndindex(height, width):
        for q in ((y + dy, x + dx) for dy, dx in near if is_inside(y + dy, x + dx)):
            if is_surface[y, x] and is_surface[q]:
                length[y, x] = min(length[y, x], np.linalg.norm(position[q] - position[y, x]))
    least = np.array(
        [
            [length[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].min() for x in range(width)]
            for y in range(height)
        ]
    )
    filtered = np.zeros(image.shape)
    for y, x in np.ndindex(height, width):
        total, light = 0.0, np.zeros(3)
        for dy, dx in np.ndindex(2 * radius + 1, 2 * radius + 1):
            q, distance = (y + dy - radius, x + dx - radius), np.hypot(dy - radius, dx - radius)
            if not is_inside(*q):
                continue
            weight = 1.0
            if distance:
                offset = position[q] - position[y, x]
                plane_distance = abs(offset @ normal[y, x]) + abs(offset @ normal[q])
                plane_distance *= (1 / least[y, x] + 1 / least[q]) / 2
                weight = np.exp(-plane_distance / (NEAR_PLANE * (1 + BEND * distance)))
                weight *= max(normal[y, x] @ normal[q], 0) ** (2**SQUARINGS)
                weight *= np.exp(-((distance / (radius / 2)) ** 2) / 2)
            total += weight
            light += weight * image[q] / albedo[q]
        filtered[y, x] = light / total * albedo[y, x]
    return filtered


@pytest.mark.parametrize("radius", [2, nightly(RADIUS)])
def test_it_is_what_its_plain_form_is(radius: int, rng: np.random.Generator):
    features = room(rng)
    image = rng.random((*SIZE, 3), dtype=np.float32)
    filtered = SurfaceFilter(features, radius)(image)
    expected = filter_pixelwise(features, image, radius)
    # Single precision, of sums of 81 terms of any size up to 1, and of exponents up to 30.
    np.testing.assert_allclose(filtered, expected, rtol=1e-4, atol=1e-6)


def test_it_is_linear(rng: np.random.Generator):
    along = SurfaceFilter(room(rng))
    a, b = rng.random((2, *SIZE, 3), dtype=np.float32)
    mixed = along(2 * a - np.float32(0.3) * b)
    np.testing.assert_allclose(mixed, 2 * along(a) - 0.3 * along(b), rtol=1e-4, atol=1e-5)


def test_even_light_stays_as_it_is_on_any_surface(rng: np.random.Generator):
    """Whatever its albedo: a texture is not blurred."""
    features = room(rng)
    lit_image = 3 * np.maximum(features.albedo, DARKEST)
    np.testing.assert_allclose(SurfaceFilter(features)(lit_image), lit_image, rtol=1e-5)


@pytest.mark.parametrize("size", [SIZE, (SIZE[0] + 1, SIZE[1] + 1)])
def test_even_light_of_blocks_comes_back_with_all_albedo(
    size: tuple[int, int], rng: np.random.Generator
):
    """Grain of albedo in each pixel, which blocks of pixels have averaged, is exact again."""
    albedo = rng.uniform(0.1, 0.9, (*size, 3)).astype(np.float32)
    small = 3 * block_mean(albedo, 2)
    enlarged = SurfaceFilter(wall(size, albedo=albedo)).enlarged(small, 2)
    np.testing.assert_allclose(enlarged, 3 * albedo, rtol=1e-5)


def test_the_unit_of_length_does_not_matter(rng: np.random.Generator):
    features = room(rng)
    assert features.position is not None
    larger = Features(features.albedo, features.normal, features.position * np.float32(1024))
    image = rng.random((*SIZE, 3), dtype=np.float32)
    expected = SurfaceFilter(features)(image)
    np.testing.assert_array_equal(SurfaceFilter(larger)(image), expected)


def test_noise_falls_as_that_of_a_mean(rng: np.random.Generator):
    """On a flat wall the weights are a Gaussian, and the variance is Σ w² / (Σ w)² of one pixel."""
    size = (200, 300)
    noise = rng.normal(size=(*size, 3)).astype(np.float32)
    filtered = SurfaceFilter(wall(size))(noise)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    y, x = np.mgrid[-RADIUS : RADIUS + 1, -RADIUS : RADIUS + 1]
    weights = np.exp(-2 * (np.square(x) + np.square(y)) / RADIUS**2)
    expected = np.square(weights).sum() / weights.sum() ** 2
    # Of 168,000 values, some twenty of which are alike: 5 % is four standard errors.
    assert np.square(filtered, dtype=np.float64).mean() == pytest.approx(expected, rel=0.05)


def corner() -> tuple[Features, Any]:
    """Two walls at a right angle."""
    y, x = grid(*SIZE)
    side = x >= 20
    position = np.stack([np.minimum(x, 20), y, np.where(side, x - 20, np.float32(0))], axis=-1)
    normal = np.where(side[..., None], np.float32([-1, 0, 0]), np.float32([0, 0, 1]))
    return Features(np.full((*SIZE, 3), 0.5, np.float32), normal, position), side


def step() -> tuple[Features, Any]:
    """A wall in front of another one, of equal normals."""
    features, (_, x) = wall(), grid(*SIZE)
    before = x < 20
    assert features.position is not None
    moved_position = features.position + before[..., None] * np.float32([0, 0, 40])
    return Features(features.albedo, features.normal, moved_position), before


def sky() -> tuple[Features, Any]:
    """A wall whose upper end borders on nothing."""
    features, (y, _) = wall(), grid(*SIZE)
    is_sky = (y >= 20)[..., None]
    assert features.position is not None
    return Features(features.albedo, features.normal * is_sky, features.position * is_sky), y < 20


@pytest.mark.parametrize("make", [corner, step, sky])
def test_nothing_crosses_an_edge(make: Any):
    features, one_side = make()
    image = np.where(one_side[..., None], np.float32(1), np.float32(0)) * np.ones(3, np.float32)
    np.testing.assert_allclose(SurfaceFilter(features)(image), image, atol=1e-4)


def test_a_picture_too_large_to_keep_weights_of_is_filtered_alike(
    monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
):
    features, image = room(rng), rng.random((*SIZE, 3), dtype=np.float32)
    expected = SurfaceFilter(features)(image)
    monkeypatch.setattr("lightpaint.images.surface_filter.KEPT_PIXELS", 1)
    np.testing.assert_array_equal(SurfaceFilter(features)(image), expected)
