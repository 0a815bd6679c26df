"""Inner products against dense linear algebra, and their invariances."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from least_squares import inner_products

from lightpaint.basis.planes import BLOCK_PIXELS
from lightpaint.lighting.normal_equations import NormalEquations

# Sums of float64 products, a few thousand of them: round-off well below 1e-12.
PRECISION = 1e-12


def _problem(n: int, size: tuple[int, int], seed: int = 0) -> tuple[Any, Any, Any]:
    rng = np.random.default_rng(seed)
    images = rng.random((n, *size, 3)).astype(np.float32)
    target = rng.random((*size, 3)).astype(np.float32)
    importance = (rng.random(size) * (rng.random(size) < 0.7)).astype(np.float32)
    importance[0, 0] = 1
    return images, target, importance


def _dense_equations(images: Any, target: Any, importance: Any, c: int) -> tuple[Any, Any, Any]:
    """AᵀDA, AᵀDΨ and ΨᵀDΨ of channel `c`, with D as a matrix."""
    A = images[..., c].reshape(len(images), -1).T.astype(np.float64)
    D = np.diag(importance.ravel().astype(np.float64))
    y = target[..., c].ravel().astype(np.float64)
    return A.T @ D @ A, A.T @ D @ y, y @ D @ y


@pytest.mark.parametrize(("n", "size"), [(1, (1, 1)), (1, (9, 7)), (5, (16, 31)), (17, (40, 3))])
def test_equal_to_dense_algebra(n: int, size: tuple[int, int]):
    problem = _problem(n, size)
    M, b, norm2 = inner_products(*problem)
    assert (M.shape, b.shape, norm2.shape) == ((3, n, n), (3, n), (3,))
    assert M.dtype == b.dtype == norm2.dtype == np.float64
    for c in range(3):
        dense_M, dense_b, dense_norm2 = _dense_equations(*problem, c)
        np.testing.assert_allclose(M[c], dense_M, rtol=PRECISION)
        np.testing.assert_allclose(b[c], dense_b, rtol=PRECISION)
        np.testing.assert_allclose(norm2[c], dense_norm2, rtol=PRECISION)


@pytest.mark.parametrize(
    "pixels", [BLOCK_PIXELS - 1, BLOCK_PIXELS, BLOCK_PIXELS + 1, 2 * BLOCK_PIXELS + 17]
)
def test_images_larger_than_a_block(pixels: int):
    images, target, _ = _problem(2, (1, pixels))
    # Every second pixel counts: blocks are counted in pixels that do.
    importance = np.ones((1, pixels), np.float32)
    importance[0, : pixels // 2] = 0.25
    M, b, norm2 = inner_products(images, target, importance)
    rows = np.concatenate([images, target[None]]).astype(np.float64)[:, 0]
    expected = np.einsum("ipc,jpc,p->cij", rows, rows, importance[0].astype(np.float64))
    np.testing.assert_allclose(M, expected[:, :2, :2], rtol=PRECISION)
    np.testing.assert_allclose(b, expected[:, :2, 2], rtol=PRECISION)
    np.testing.assert_allclose(norm2, expected[:, 2, 2], rtol=PRECISION)


def test_a_run_of_pixels_is_not_gathered_and_comes_to_the_same():
    """The fast path and its twin: a black pixel that counts, past a gap, makes all be gathered."""
    images, target, _ = _problem(4, (9, 8))
    run = np.zeros((9, 8), np.float32)
    run[2:7] = np.random.default_rng(2).random((5, 8)) + 0.5
    gathered_pixels, seen_pixels = run.copy(), images.copy()
    gathered_pixels[8, 7] = 1
    seen_pixels[:, 8, 7] = 0
    unpainted = target.copy()
    unpainted[8, 7] = 0
    counted_pixels = CountedPixels(images)
    for actual, expected_sums in zip(
        inner_products(counted_pixels, target, run),
        inner_products(seen_pixels, unpainted, gathered_pixels),
        strict=True,
    ):
        np.testing.assert_allclose(actual, expected_sums, rtol=PRECISION)
    assert CountedPixels.gathered == 0


class CountedPixels(np.ndarray):  # type: ignore[type-arg]
    """Pixels that count how often they are gathered by index."""

    gathered = 0

    def __new__(cls, pixels: Any) -> "CountedPixels":
        return np.asarray(pixels).view(cls)

    def __getitem__(self, index: Any) -> Any:
        CountedPixels.gathered += isinstance(index, tuple) and any(
            isinstance(k, np.ndarray) for k in index
        )
        return super().__getitem__(index)


@pytest.mark.parametrize("garbage", [1e30, np.nan, np.inf])
def test_pixels_without_importance_are_not_read(garbage: float):
    images, target, importance = _problem(3, (8, 9))
    expected = inner_products(images, target, importance)
    images[:, importance == 0] = garbage
    target[importance == 0] = garbage
    for actual, expected_sums in zip(
        inner_products(images, target, importance), expected, strict=True
    ):
        np.testing.assert_array_equal(actual, expected_sums)


def test_importance_counts_pixels():
    """A pixel of importance 3 weighs as three pixels of importance 1."""
    images, target, _ = _problem(3, (6, 4))
    tripled = [np.concatenate([images] * 3, axis=1), np.concatenate([target] * 3)]
    for actual, expected_sums in zip(
        inner_products(images, target, np.full((6, 4), 3.0)),
        inner_products(*tripled, np.ones((18, 4))),
        strict=True,
    ):
        np.testing.assert_allclose(actual, expected_sums, rtol=PRECISION)


def test_the_order_of_pixels_is_of_no_importance():
    images, target, importance = _problem(3, (8, 8))
    actual = inner_products(images[:, ::-1, ::-1], target[::-1, ::-1], importance[::-1, ::-1])
    for a, b in zip(actual, inner_products(images, target, importance), strict=True):
        np.testing.assert_allclose(a, b, rtol=PRECISION)


@given(seed=st.integers(0, 1000), split=st.integers(0, 12))
def test_sums_of_parts_of_the_picture_add(seed: int, split: int):
    images, target, importance = _problem(3, (12, 5), seed)
    top = inner_products(images[:, :split], target[:split], importance[:split])
    bottom = inner_products(images[:, split:], target[split:], importance[split:])
    whole_sums = inner_products(images, target, importance)
    for a, b, whole_sum in zip(top, bottom, whole_sums, strict=True):
        np.testing.assert_allclose(a + b, whole_sum, rtol=PRECISION)


@given(seed=st.integers(0, 1000), scale=st.floats(0.0, 10.0))
def test_objective_is_the_norm_of_the_residual(seed: int, scale: float):
    images, target, importance = _problem(4, (7, 6), seed)
    w = np.random.default_rng(seed).random((4, 3)) * scale
    residual = target - np.einsum("nhwc,nc->hwc", images.astype(np.float64), w)
    expected = (importance[..., None].astype(np.float64) * residual**2).sum(axis=(0, 1))
    equations = NormalEquations(*inner_products(images, target, importance))
    size = equations.target_norm2 + np.einsum("ic,cij,jc->c", w, equations.M, w)
    # Round-off is relative to the terms, which may cancel.
    assert (np.abs(equations.objective(w) - expected) <= PRECISION * size).all()


def test_objective_of_a_perfect_fit_is_not_negative():
    for seed in range(50):
        images, _, importance = _problem(4, (7, 6), seed)
        images = images.astype(np.float64)
        w = np.random.default_rng(seed).random((4, 3))
        target = np.einsum("nhwc,nc->hwc", images, w)
        equations = NormalEquations(*inner_products(images, target, importance))
        objective = equations.objective(w)
        assert (objective >= 0).all()
        assert (objective <= PRECISION * equations.target_norm2).all()


def test_of_basis(make_basis: Any):
    basis = make_basis(3, (5, 4))
    _, target, importance = _problem(3, (5, 4))
    equations = NormalEquations.of(basis, target, importance)
    M, b, norm2 = inner_products(basis.images, target, importance)
    np.testing.assert_array_equal(equations.M, M)
    np.testing.assert_array_equal(equations.b, b)
    np.testing.assert_array_equal(equations.target_norm2, norm2)
