"""Planes: the same numbers wherever they are kept, and nobody else indexes them."""

import ast
import errno
import gc
import os
import weakref
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from package_source import tree_of

import lightpaint
import lightpaint as lp
from lightpaint.basis import planes as planes_module
from lightpaint.basis.derived_planes import BlockPlanes, JoinedRow, block_means, in_one_row
from lightpaint.basis.file import basis_file, file_planes, half_floats, lit_planes
from lightpaint.basis.file.file_planes import FilePlanes, SpooledPlanes, spooled
from lightpaint.basis.file.half_floats import EncodedPlanes
from lightpaint.basis.file.lit_planes import LitPlane, LitPlanes
from lightpaint.basis.file.lit_strips import StripsInFile
from lightpaint.basis.planes import MemoryPlanes, Planes, as_planes, joined_planes
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.formats import exr_rows
from lightpaint.images.formats.exr_rows import RowFile
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.lit_pixels import bin_pixels
from lightpaint.lighting.problem import Problem
from lightpaint.progress import cancellable

PACKAGE = Path(lightpaint.__file__).parent

#: The add-on's code runs within Blender, whose lists of pictures are called `images`.
BLENDER = "blender_addon"

N, SIZE = 3, (7, 5)


@pytest.fixture
def images() -> np.ndarray:
    return np.random.default_rng(3).random((N, *SIZE, 3), np.float32)


def test_nobody_outside_the_room_indexes_planes() -> None:
    names = ("images", "half_differences")
    violations = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] not in ("basis", BLENDER)
        if any(name in path.read_text("utf-8") for name in names)
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Attribute) and node.attr in names
    ]
    assert violations == []


def check_alike(planes: Planes, images: np.ndarray, tolerance: float = 0.0) -> None:
    """Everything that planes can be asked is what the array says."""
    rng, (n, height, width, _) = np.random.default_rng(4), images.shape
    tolerances = {"rtol": tolerance, "atol": tolerance}
    assert (planes.count, planes.size) == (n, (height, width))
    np.testing.assert_allclose(planes.array(), images, **tolerances)
    for plane, image in zip(planes, images, strict=True):
        np.testing.assert_allclose(plane, image, **tolerances)
    np.testing.assert_allclose(planes.plane(n - 1), images[-1], **tolerances)
    np.testing.assert_allclose(planes.rows(1, 3), images[:, 1:3], **tolerances)
    flat = images.reshape(n, -1, 3)
    some = np.unique(np.minimum([1, width, 3 * width + 2, 10**6], height * width - 1))
    for pixels in (some, slice(2, 2 * width + 1), slice(height * width - 2, height * width + 9)):
        np.testing.assert_allclose(planes.pixels(pixels), flat[:, pixels], **tolerances)
        np.testing.assert_allclose(
            planes.picked(pixels).array(), flat[:, None, pixels], **tolerances
        )
    w = rng.random((n, 3))
    for factor in (4, 3, 2, 1, 4, 1):  # some planes keep the latest
        np.testing.assert_allclose(
            planes.exact_mix(factor * w),
            np.einsum("nhwc,nc->chw", images.astype(float), factor * w).reshape(3, -1),
            rtol=1e-12 + tolerance,
        )
    expected = np.einsum("nhwc,nc->hwc", images, w)
    np.testing.assert_allclose(planes.mix(w), expected, rtol=1e-5 + tolerance)  # float32 sums
    mask, exact = rng.random((height, width)) < 0.5, images.astype(np.float64)
    power, totals = planes.power_and_totals(mask)
    expected_power = np.square(exact)[:, mask].sum(axis=1)
    np.testing.assert_allclose(power, expected_power, rtol=1e-5 + tolerance)
    np.testing.assert_allclose(totals, exact.sum(axis=(1, 2)), rtol=1e-5 + tolerance)
    lit = [np.square(planes.lit_plane(k)[1], dtype=np.float64).sum() for k in range(n)]
    np.testing.assert_allclose(lit, np.square(exact).sum(axis=(1, 2, 3)), rtol=1e-5)
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
    np.testing.assert_allclose(other.plane(0), images[0], **tolerances)
    np.testing.assert_allclose(planes.plane(1), images[1], **tolerances)


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


def write_planes(
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
    basis = write_planes(path, make_basis, smooth=smooth, size=size)
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    in_memory = lp.read_basis(path)
    assert isinstance(in_memory.planes, EncodedPlanes)
    check_alike(in_memory.planes, basis.images)
    check_alike(in_memory.noise, basis.half_differences)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", room)
    reread = lp.read_basis(path)
    assert isinstance(reread.planes, FilePlanes)
    assert RowFile(path).parts[0].is_packed == (smooth or size != PLAIN)
    check_alike(reread.planes, basis.images)
    check_alike(reread.noise, basis.half_differences)
    some = np.sort(np.random.default_rng(6).permutation(size[0] * size[1])[:500])
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    picked = reread.planes.picked(some)
    assert isinstance(picked, file_planes.PickedPlanes)
    check_alike(picked, basis.images.reshape(N, 1, -1, 3)[:, :, some])
    other = reread.planes.replaced({0: np.zeros((*size, 3), np.float32)})
    assert not other.rows(3, 5)[0].any()
    assert other.rows(3, 5)[1].any()


@pytest.mark.parametrize("room", [1, 2**27])
@pytest.mark.parametrize(
    ("largest", "sparse"),
    [(0, 2**31), (2**31, 2**31), (2**31, 0)],
    ids=["by rows", "whole", "sparse"],
)
@pytest.mark.parametrize("clean", [(), (2,), range(N)], ids=["none", "one", "all"])
@pytest.mark.parametrize("kept", ["in memory", "in files", "full disk"])
def test_lit_pixels_of_many_lights_are_those_of_their_planes(
    tmp_path: Path,
    make_basis: Any,
    monkeypatch: pytest.MonkeyPatch,
    clean: Sequence[int],
    largest: int,
    sparse: int,
    room: int,
    kept: str,
) -> None:
    if kept != "in memory":
        monkeypatch.setattr(lit_planes, "MAX_BYTES_IN_MEMORY", 0)
        monkeypatch.setattr(lit_planes, "SPOOLED_BYTES", 2**15)  # of two lights
    if kept == "full disk":
        monkeypatch.setattr(file_planes.tempfile, "TemporaryFile", Mock(side_effect=OSError))
    # Bright lights have a scale; one is black, one reaches everything, and single channels are 0.
    rng, size = np.random.default_rng(8), (67, 90)
    images = rng.random((N, *size, 3), np.float32) * (rng.random((N, *size, 1)) < 0.1)
    images[0, ..., 1] = 0
    images[1] = 0
    images[2] = 1e6 * rng.random((*size, 3))
    halves = -images / 8
    halves[list(clean)] = 0  # stored in float32
    path = tmp_path / "it.basis.exr"
    basis = basis_file.as_stored(make_basis(images=images, half_differences=halves))
    lp.write_basis(path, basis)
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", largest)
    monkeypatch.setattr(basis_file, "SPARSE_MIN_BYTES", sparse)
    monkeypatch.setattr(basis_file, "MIN_LIGHTS", N)
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", room)
    if largest:  # half of all pixels are lit, and there is room for all
        monkeypatch.setattr(half_floats, "DECODED_MAX_BYTES", room)
        monkeypatch.setattr(half_floats, "MIXED_PIXELS", 1000)
        whole = lp.read_basis(path)
        assert isinstance(whole.planes, EncodedPlanes)
        check_alike(whole.planes, basis.images)
        check_alike(whole.noise, basis.half_differences)
    monkeypatch.setattr(basis_file, "WHOLE_MAX_BYTES", 0)
    assert lp.read_basis(path).planes.lit_entries(slice(0, 9)) is None  # too many are lit
    monkeypatch.setattr(lit_planes, "MAX_LIT_SHARE", 1.0)
    reread = lp.read_basis(path)
    assert isinstance(reread.planes, LitPlanes)
    assert isinstance(reread.noise, LitPlanes)
    assert isinstance(reread.planes._lit, StripsInFile) == (kept == "in files")
    assert reread.planes.is_noisy == (len(clean) < 2)
    check_alike(reread.planes, basis.images)
    check_alike(reread.noise, basis.half_differences)
    # No room for them either: they stay in the file if they do not fit in memory.
    monkeypatch.setattr(lit_planes, "MAX_BYTES", 0)
    assert isinstance(lp.read_basis(path).planes, LitPlanes if largest else FilePlanes)


def test_several_mixes_are_those_made_one_by_one(images: np.ndarray) -> None:
    weights = np.random.default_rng(9).random((4, N, 3))
    all_planes: list[Planes] = [MemoryPlanes(images), CountedPlanes(images)]
    all_planes += [all_planes[1].picked(np.array([1, 4, 30])), JoinedRow(all_planes)]
    for planes in all_planes:
        mixes = planes.mixes(weights)
        np.testing.assert_array_equal(mixes, [planes.mix(one) for one in weights])
        np.testing.assert_allclose(
            mixes, np.einsum("nhwc,knc->khwc", planes.array(), weights), rtol=1e-6
        )


def test_every_other_pixel_is_the_same_in_one_walk_and_plane_by_plane(
    images: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    factors = np.random.default_rng(2).random((N, 3))
    expected = np.einsum("nhwc,nc->nhw", images[:, ::2, ::2], factors)
    for most_bytes in (planes_module.THINNED_MAX_BYTES, 0):
        monkeypatch.setattr(planes_module, "THINNED_MAX_BYTES", most_bytes)
        for planes in (MemoryPlanes(images), CountedPlanes(images)):
            found = list(planes_module.thinned(planes, 2, factors))
            np.testing.assert_allclose(found, expected, rtol=1e-6)  # of float32


class RoundedPlanes(MemoryPlanes):
    """Planes that come from half floats."""

    is_noisy = True


def test_sums_of_many_lights_have_the_round_off_of_singles(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(10)
    planes = RoundedPlanes(rng.random((N, 120, 90, 3), np.float32))
    squares = rng.random((120, 90)), rng.random((120, 90, 3))
    exact = planes.sums(*squares)
    monkeypatch.setattr("lightpaint.basis.planes.MIN_SINGLE_LIGHTS", N)
    for found, expected in zip(planes.sums(*squares), exact, strict=True):
        assert found.dtype == np.float64
        # A product of 4096 numbers in float32, whose errors add up at random.
        np.testing.assert_allclose(found, expected, rtol=64 * 2**-24)
        assert not np.array_equal(found, expected)


class CountedPlanes(file_planes.RowPlanes):
    """Planes of an array, which count the most bytes that are asked of them at a time."""

    def __init__(self, images: np.ndarray) -> None:
        self._images, self.largest = images, 0
        self.count, self.size = len(images), (images.shape[1], images.shape[2])

    def plane(self, i: int) -> np.ndarray:
        self.largest = max(self.largest, self._images[i].nbytes)
        return self._images[i].copy()

    def rows(self, top: int, bottom: int) -> np.ndarray:
        band = self._images[:, top:bottom].copy()
        self.largest = max(self.largest, band.nbytes)
        return band


@pytest.mark.parametrize("side", [1, 2, 3])
def test_means_over_blocks_are_the_same_wherever_planes_lie(
    monkeypatch: pytest.MonkeyPatch, side: int
) -> None:
    """Of a pixel's weight, with smaller blocks at the ends and none where nothing counts."""
    rng = np.random.default_rng(8)
    images = rng.random((N, 67, 90, 3), np.float32)
    weight = rng.random((65, 89))
    weight[side : 2 * side, :side] = 0
    rows, columns = -(-65 // side), -(-89 // side)
    expected = np.zeros((N, rows, columns, 3))
    for row, column in np.ndindex(rows, columns):
        block = np.s_[row * side : min(65, (row + 1) * side), column * side : (column + 1) * side]
        w = np.zeros((67, 90))
        w[:65, :89] = weight
        w = w[block]
        if w.sum() > 0:
            expected[:, row, column] = np.einsum("yx,nyxc->nc", w, images[:, *block]) / w.sum()
    in_memory = block_means(MemoryPlanes(images), weight, side)
    assert isinstance(in_memory, MemoryPlanes)
    np.testing.assert_allclose(in_memory.array(), expected, rtol=1e-6)
    assert not in_memory.plane(0)[1, 0].any()
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    on_request = block_means(CountedPlanes(images), weight, side)
    assert isinstance(on_request, BlockPlanes)
    check_alike(on_request, in_memory.array())
    few = np.array([0, columns - 1, (rows - 1) * columns, rows * columns - 1])
    monkeypatch.setattr(BlockPlanes, "rows", None)  # which a few blocks do not take
    expected_few = in_memory.pixels(few)
    assert on_request.pixels(few).tobytes() == expected_few.tobytes()


@pytest.mark.parametrize("strip_rows", [1, 3, 7])
@pytest.mark.parametrize("side", [1, 2, 4])
@pytest.mark.parametrize("outside", [0, 1])
def test_means_of_lit_pixels_are_those_of_all_pixels(
    monkeypatch: pytest.MonkeyPatch, strip_rows: int, side: int, outside: int
) -> None:
    """Whatever strips they are kept in, with one plane that is kept whole, and one in units of its
    own.
    """
    rng = np.random.default_rng(11)
    images = rng.random((4, *SIZE, 3), np.float32) * (rng.random((4, *SIZE, 1)) < 0.4)
    images = images.astype(np.float16).astype(np.float32)
    weight = rng.random((SIZE[0] - outside, SIZE[1] - outside))
    weight[:3, :2] = 0
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", 1)
    monkeypatch.setattr(LitPlanes, "chunk_rows", strip_rows)
    stored = [LitPlane.of(np.moveaxis(x.astype(np.float16), -1, 0), 1.0) for x in images]
    stored[1] = replace(stored[1], scale=4.0)
    stored[2] = LitPlane.of(np.moveaxis(images[2], -1, 0), 1.0)
    lit = LitPlanes(stored, SIZE)
    assert lit.strip_rows == strip_rows
    np.testing.assert_array_equal(lit.plane(2), images[2])
    images[1] *= 4
    expected = block_means(MemoryPlanes(images), weight, side).array()
    for limit in (2**27, 0):  # in memory, and on request
        monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", limit)
        means = block_means(lit, weight, side)
        assert isinstance(means, BlockPlanes) == (limit == 0)
        np.testing.assert_allclose(means.array(), expected, rtol=1e-6)
        np.testing.assert_allclose(means.rows(1, 2), expected[:, 1:2], rtol=1e-6)


def lit_planes_of_each_kind(seed: int) -> tuple[LitPlanes, np.ndarray]:
    """Five planes by their lit pixels, one of which is kept whole, and one scaled; and their light,
    (5, h, w, 3).
    """
    rng = np.random.default_rng(seed)
    images = rng.random((5, *SIZE, 3), np.float32) * (rng.random((5, *SIZE, 1)) < 0.4)
    images = images.astype(np.float16).astype(np.float32)
    stored = [LitPlane.of(np.moveaxis(x.astype(np.float16), -1, 0), 1.0) for x in images]
    stored[1] = replace(stored[1], scale=4.0)
    stored[2] = LitPlane.of(np.moveaxis(images[2], -1, 0), 1.0)
    images[1] *= 4
    return LitPlanes(stored, SIZE), images


@pytest.mark.parametrize("in_memory", [0, 2**27])
def test_planes_of_several_walks_are_those_of_one_light_each(
    monkeypatch: pytest.MonkeyPatch, in_memory: int
) -> None:
    """Of strips in memory or in a file."""
    monkeypatch.setattr(lit_planes, "MAX_BYTES_IN_MEMORY", in_memory)
    monkeypatch.setattr(lit_planes, "PLANES_PER_WALK", 2)
    lit, images = lit_planes_of_each_kind(13)
    np.testing.assert_array_equal([*lit], images)
    np.testing.assert_array_equal([lit.plane(k) for k in range(lit.count)], images)


def test_mixes_of_lit_pixels_are_those_of_one_after_the_other() -> None:
    """To the bit, and to round-off those of all pixels."""
    lit, images = lit_planes_of_each_kind(12)
    weights = np.random.default_rng(14).normal(size=(3, 5, 3))
    together = lit.mixes(weights)
    np.testing.assert_array_equal(together, np.concatenate([lit.mixes(x[None]) for x in weights]))
    expected = MemoryPlanes(images).mixes(weights)
    np.testing.assert_allclose(together, expected, rtol=1e-5, atol=1e-6)
    exact = lit.exact_mix(weights[0])
    np.testing.assert_array_equal(
        exact.T.astype(np.float32).reshape(together[0].shape), together[0]
    )


def test_work_on_lit_pixels_is_stopped_between_strips(images: np.ndarray) -> None:
    """As where a painter ends while it reads a thousand lights."""

    class StopError(Exception):
        pass

    def stop() -> None:
        raise StopError

    def lit() -> LitPlanes:
        return LitPlanes([LitPlane.of(np.moveaxis(x, -1, 0), 1.0) for x in images], SIZE)

    planes = lit()
    with cancellable(stop):
        with pytest.raises(StopError):
            lit()
        with pytest.raises(StopError):
            block_means(planes, np.ones(SIZE), 2)


def test_no_more_rows_are_averaged_at_a_time_than_a_chunk_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    images = np.ones((N, 128, 40, 3), np.float32)
    for limit in (0, 2**27):
        monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", limit)
        planes = CountedPlanes(images)
        means = block_means(planes, np.ones((128, 40)), 2)
        assert (means.array() == 1).all()
        assert planes.largest == images[:, :16].nbytes


def test_a_fit_of_blocks_reads_strips_of_noisy_planes(
    monkeypatch: pytest.MonkeyPatch, make_basis: Any
) -> None:
    """And sums what a fit of blocks that are kept in memory sums."""
    rng = np.random.default_rng(10)
    images = rng.random((N, 128, 40, 3), np.float32)
    basis = make_basis(images=images, half_differences=rng.normal(0, 0.1, images.shape))
    target = lp.Target.of(basis.current_look * np.float32(0.7))
    fit = Fit(transform=lp.ViewTransform("srgb"))
    counted_planes = CountedPlanes(images), CountedPlanes(basis.half_differences)
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", 1)
    fits = []
    for source in (basis, replace(basis, planes=counted_planes[0], noise=counted_planes[1])):
        problem = Problem.of(source, target, fit=fit)
        for planes in counted_planes:
            planes.largest = 0
        blocks = bin_pixels(problem.views, problem.loss, 2)
        assert blocks is not None
        fits.append((blocks.equations.M, blocks.equations.b, blocks.prior.M, blocks.prior.b))
    for actual, expected in zip(*fits, strict=True):
        np.testing.assert_allclose(actual, expected, rtol=1e-12)
    assert 0 < max(planes.largest for planes in counted_planes) <= images[:, :16].nbytes


def test_strips_of_rows_vanish_with_their_planes(images: np.ndarray) -> None:
    planes = CountedPlanes(images)
    gc.collect()
    gc.disable()
    try:
        strip = weakref.ref(planes.pixels(slice(0, 3)).base)
        assert strip() is not None
        del planes
        assert strip() is None
    finally:
        gc.enable()


def test_strips_of_planes_that_nobody_walks_along_are_released(images: np.ndarray) -> None:
    first, *others = (CountedPlanes(images) for _ in range(1 + file_planes.WALKED_PLANES))
    strip = weakref.ref(first.pixels(slice(0, 1)).base)
    assert strip() is not None
    for planes in others:
        planes.pixels(slice(0, 1))
    gc.collect()
    assert strip() is None
    np.testing.assert_array_equal(first.pixels(slice(0, 3))[:, 0], images[:, 0, 0])


def test_sums_of_squares_made_block_by_block(
    images: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpaint.basis.planes.BLOCK_PIXELS", 4)
    rng = np.random.default_rng(8)
    w, indices = rng.random((N, 3)), np.array([0, 1, 2, 5, 9, 10, 30])
    light = np.einsum("nhwc,nc->hwc", images, w)
    weight = np.zeros((*SIZE, 3))
    weight.reshape(-1, 3)[indices] = 1 + np.square(light.reshape(-1, 3)[indices])

    def squares(pixels: Any, radiance: Any) -> tuple[Any, Any]:
        x = np.einsum("npc,nc->pc", radiance(), w)
        return 1 + np.square(x), 2 * x

    for planes in (MemoryPlanes(images), CountedPlanes(images)):
        sums = planes.sums_of(indices, squares), planes.sums(weight, 2 * light)
        for actual, expected in zip(*sums, strict=True):
            np.testing.assert_allclose(actual, expected, rtol=1e-12)


def test_spooled_planes_are_made_once_and_those_in_memory_stay(
    images: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    for most_bytes, kind in ((file_planes.UNSPOOLED_MAX_BYTES, MemoryPlanes), (0, SpooledPlanes)):
        monkeypatch.setattr(file_planes, "UNSPOOLED_MAX_BYTES", most_bytes)
        planes = CountedPlanes(images)
        copy = spooled(planes)
        assert isinstance(copy, kind)
        planes.rows = None  # type: ignore[method-assign, assignment]
        check_alike(copy, images)
    in_memory = MemoryPlanes(images)
    assert spooled(in_memory) is in_memory


@pytest.mark.parametrize("step", [1, 2, 3])
def test_spooled_planes_have_all_rows_whatever_strips_they_lie_in(
    images: np.ndarray, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    """The last strip is shorter, and rows begin and end within strips, or outside the picture."""
    monkeypatch.setattr(SpooledPlanes, "strip_rows", step)
    planes = SpooledPlanes(CountedPlanes(images))
    check_alike(planes, images)
    height = images.shape[1]
    for top in range(height):
        for bottom in range(top, height + 2):
            np.testing.assert_array_equal(planes.rows(top, bottom), images[:, top:bottom])


def test_planes_are_made_again_where_a_disk_is_full(
    images: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    monkeypatch.setattr(file_planes, "UNSPOOLED_MAX_BYTES", 0)
    planes = CountedPlanes(images)
    assert spooled(planes) is planes


def test_several_pictures_in_one_row(monkeypatch: pytest.MonkeyPatch, images: np.ndarray) -> None:
    others = images[:, :2, :4] + 1
    flat = [x.reshape(N, 1, -1, 3) for x in (images, others)]
    expected = np.concatenate(flat, axis=2)
    in_memory = in_one_row([MemoryPlanes(images), MemoryPlanes(others)])
    assert isinstance(in_memory, MemoryPlanes)
    np.testing.assert_array_equal(in_memory.array(), expected)
    on_request = in_one_row([CountedPlanes(images), MemoryPlanes(others)])
    assert isinstance(on_request, JoinedRow)
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", 1)
    np.testing.assert_array_equal(on_request.array(), expected)
    np.testing.assert_array_equal(on_request.plane(1), expected[1])
    n = on_request.size[1]
    for pixels in (slice(30, 40), slice(36, n), slice(0, 0), slice(1, n, 3), np.array([0, 34, 35])):
        np.testing.assert_array_equal(on_request.pixels(pixels), expected[:, 0, pixels])
    w = np.random.default_rng(9).random((N, 3))
    np.testing.assert_allclose(on_request.mix(w), in_memory.mix(w), rtol=1e-6)
    for actual, expected_sum in zip(
        on_request.sums(expected[0, ..., 0], expected[1]),
        in_memory.sums(expected[0, ..., 0], expected[1]),
        strict=True,
    ):
        np.testing.assert_array_equal(actual, expected_sum)


@pytest.mark.parametrize("size", [1, 2, 3, 16, 31, 1000, 4097])
def test_packed_bytes_are_unpacked_as_they_were(size: int) -> None:
    plain = np.random.default_rng(size).integers(0, 256, size).astype(np.uint8)
    packed = zlib.compress(exr_rows.zip_filtered(plain[None]).tobytes())
    np.testing.assert_array_equal(exr_rows._unpacked(packed, size), plain)
    assert not exr_rows._unpacked(packed[:-5], size).size


def test_a_chunk_of_a_packed_file_is_unpacked_once_for_a_walk(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "it.basis.exr"
    write_planes(path, make_basis, smooth=True, size=PLAIN)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    planes = lp.read_basis(path).planes
    unpacked = []
    plain = exr_rows._unpacked

    def count_chunks(compressed: bytes, size: int) -> np.ndarray:
        unpacked.append(size)
        return plain(compressed, size)

    monkeypatch.setattr(exr_rows, "_unpacked", count_chunks)
    # Strips of seven rows, of which a chunk has sixteen.
    strips = 7 * file_planes.STRIP_CACHE_COUNT * 12 * N * PLAIN[1]
    monkeypatch.setattr(file_planes, "STRIP_CACHE_BYTES", strips)
    planes.power_and_totals(np.ones(PLAIN, np.bool_))
    assert len(unpacked) == N * -(-PLAIN[0] // 16)


@pytest.mark.parametrize("options", [{}, {"transform": lp.ViewTransform("srgb")}])
def test_a_basis_in_a_file_is_solved_as_one_in_memory(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any]
) -> None:
    path = tmp_path / "it.basis.exr"
    basis = write_planes(path, make_basis)
    image = basis.mix(np.full((N, 3), 0.7)) + np.float32(0.1)
    target = lp.Target.of(image, (np.arange(67) > 20)[:, None] * np.ones((67, 90), np.float32))
    expected = lp.solve(basis, target, **options)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    solution = lp.solve(lp.read_basis(path), target, **options)
    # The same sums in the same order.
    np.testing.assert_allclose(solution.weights, expected.weights, rtol=1e-12)
    [one], [other] = lp.analyse(solution), lp.analyse(expected)
    assert one.uncertainty is not None
    assert other.uncertainty is not None
    np.testing.assert_allclose(
        one.uncertainty.standard_error, other.uncertainty.standard_error, rtol=1e-12
    )


def test_a_large_file_that_was_changed_says_so(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "it.basis.exr"
    write_planes(path, make_basis, size=PLAIN)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    with pytest.raises(BasisError, match="changed light"):
        lp.read_basis(path)
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(ImageError, match="cut off"):
        lp.read_basis(path)
