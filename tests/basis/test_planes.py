"""Planes: the same numbers wherever they are kept, and nobody else indexes them."""

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint
import lightpaint as lp
from lightpaint.basis import basis_file, file_planes
from lightpaint.basis.file_planes import FilePlanes
from lightpaint.basis.planes import MemoryPlanes, Planes, as_planes, joined_planes
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.formats.exr_rows import RowFile

PACKAGE = Path(lightpaint.__file__).parent
N, SIZE = 3, (7, 5)


@pytest.fixture
def images() -> np.ndarray:
    return np.random.default_rng(3).random((N, *SIZE, 3), np.float32)


def test_nobody_outside_the_room_indexes_planes() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] != "basis"
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Attribute) and node.attr in ("images", "half_differences")
    ]
    assert found == []


def check_alike(planes: Planes, images: np.ndarray, tolerance: float = 0.0) -> None:
    """Everything that planes can be asked is what the array says."""
    rng, (n, height, width, _) = np.random.default_rng(4), images.shape
    close = {"rtol": tolerance, "atol": tolerance}
    assert (planes.count, planes.size) == (n, (height, width))
    np.testing.assert_allclose(planes.array(), images, **close)
    for mine, its in zip(planes, images, strict=True):
        np.testing.assert_allclose(mine, its, **close)
    np.testing.assert_allclose(planes.plane(n - 1), images[-1], **close)
    np.testing.assert_allclose(planes.rows(1, 3), images[:, 1:3], **close)
    flat = images.reshape(n, -1, 3)
    some = np.unique(np.minimum([1, width, 3 * width + 2, 10**6], height * width - 1))
    for where in (some, slice(2, 2 * width + 1), slice(height * width - 2, height * width + 9)):
        np.testing.assert_allclose(planes.pixels(where), flat[:, where], **close)
        np.testing.assert_allclose(planes.picked(where).array(), flat[:, None, where], **close)
    w = rng.random((n, 3))
    expected = np.einsum("nhwc,nc->hwc", images, w)
    np.testing.assert_allclose(planes.mix(w), expected, rtol=1e-5 + tolerance)  # float32 sums
    psi, weight = rng.random((height, width, 3)), rng.random((height, width))
    weight[2:4] = 0
    M, b, norm2 = planes.sums(weight, psi)
    A = images.astype(np.float64)
    np.testing.assert_allclose(
        M, np.einsum("hw,ihwc,jhwc->cij", weight, A, A), rtol=1e-12 + 3 * tolerance
    )
    np.testing.assert_allclose(
        b, np.einsum("hw,ihwc,hwc->ci", weight, A, psi), rtol=1e-12 + 3 * tolerance
    )
    np.testing.assert_allclose(norm2, np.einsum("hw,hwc->c", weight, psi**2))
    other = planes.replaced({1: np.ones((height, width, 3), np.float32)})
    assert (other.plane(1) == 1).all()
    np.testing.assert_allclose(other.plane(0), images[0], **close)
    np.testing.assert_allclose(planes.plane(1), images[1], **close)


def test_planes_in_memory(images: np.ndarray) -> None:
    planes = MemoryPlanes(images)
    check_alike(planes, images)
    assert planes.array() is images
    assert as_planes(planes) is planes


def test_planes_of_several_views_lie_behind_each_other(images: np.ndarray) -> None:
    parts = [MemoryPlanes(images), MemoryPlanes(images[:, :2, :4] + 1)]
    joint, (first, second) = joined_planes(parts, 8)
    flat = joint.array().reshape(N, -1, 3)
    np.testing.assert_array_equal(flat[:, :35], images.reshape(N, -1, 3))
    np.testing.assert_array_equal(flat[:, 35:43], second.array().reshape(N, -1, 3))
    assert not flat[:, 43:].any()
    assert np.shares_memory(first.array(), joint.array())
    check_alike(first, images)


def written(
    path: Path, make_basis: Any, *, smooth: bool = False, size: tuple[int, int] = (67, 90)
) -> lp.Basis:
    rng = np.random.default_rng(5)
    images = rng.random((N, *size, 3), np.float32)
    if smooth:  # which ZIP packs well, where noise is left as it is
        images[...] = np.linspace(0, 1, size[1], dtype=np.float32)[:, None]
        images[1] *= 2
    basis: lp.Basis = basis_file.as_stored(make_basis(images=images, half_differences=images / 8))
    lp.write_basis(path, basis)
    return basis


#: Pictures from this size on are stored as they are where ZIP does not pack them well.
PLAIN = 300, 320


@pytest.mark.parametrize("room", [1, 2**27])
@pytest.mark.parametrize(("smooth", "size"), [(False, PLAIN), (False, (67, 90)), (True, PLAIN)])
def test_planes_of_a_file_are_those_in_memory(
    tmp_path: Path,
    make_basis: Any,
    monkeypatch: pytest.MonkeyPatch,
    smooth: bool,
    size: tuple[int, int],
    room: int,
) -> None:
    path = tmp_path / "it.basis.exr"
    basis = written(path, make_basis, smooth=smooth, size=size)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", room)
    found = lp.read_basis(path)
    assert isinstance(found.planes, FilePlanes)
    assert RowFile(path).parts[0].is_packed == (smooth or size != PLAIN)
    check_alike(found.planes, basis.images)
    check_alike(found.noise, basis.half_differences)
    some = np.sort(np.random.default_rng(6).permutation(size[0] * size[1])[:500])
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    picked = found.planes.picked(some)
    assert isinstance(picked, file_planes.PickedPlanes)
    check_alike(picked, basis.images.reshape(N, 1, -1, 3)[:, :, some])
    other = found.planes.replaced({0: np.zeros((*size, 3), np.float32)})
    assert not other.rows(3, 5)[0].any()
    assert other.rows(3, 5)[1].any()


@pytest.mark.parametrize("how", [{}, {"transform": lp.ViewTransform("srgb")}])
def test_a_basis_in_a_file_is_solved_as_one_in_memory(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, how: dict[str, Any]
) -> None:
    path = tmp_path / "it.basis.exr"
    basis = written(path, make_basis)
    image = basis.mix(np.full((N, 3), 0.7)) + np.float32(0.1)
    target = lp.Target.of(image, (np.arange(67) > 20)[:, None] * np.ones((67, 90), np.float32))
    expected = lp.solve(basis, target, **how)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    found = lp.solve(lp.read_basis(path), target, **how)
    # The same sums in the same order.
    np.testing.assert_allclose(found.weights, expected.weights, rtol=1e-12)
    [one], [other] = lp.analyse(found), lp.analyse(expected)
    assert one.uncertainty is not None
    assert other.uncertainty is not None
    np.testing.assert_allclose(
        one.uncertainty.standard_error, other.uncertainty.standard_error, rtol=1e-12
    )


def test_a_large_file_that_was_changed_says_so(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "it.basis.exr"
    written(path, make_basis, size=PLAIN)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    with pytest.raises(BasisError, match="changed light"):
        lp.read_basis(path)
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(ImageError, match="cut off"):
        lp.read_basis(path)
