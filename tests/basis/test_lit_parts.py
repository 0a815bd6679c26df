"""Bases of many lights: rounding that noise hides, and parts with lit pixels alone."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.arrays import round_to_halves
from lightpaint.basis.file import basis_file, file_parts, lit_planes
from lightpaint.basis.file.basis_file import FORMAT_KEY, LIT_FORMAT, as_stored, is_file_of
from lightpaint.basis.file.file_parts import MAX_STEP, lit_channels, read_lit_planes
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.basis.file.half_floats import TILE
from lightpaint.basis.file.light_channels import PREFIXES, STEP, noise_numbers
from lightpaint.basis.file.lit_planes import LitPlane, LitPlanes
from lightpaint.basis.file.noise_rounding import (
    HIDDEN_SHARE,
    LARGEST_SHARE,
    MANY_LIGHTS,
    RATIO_DIGITS,
    noise_ratios,
    round_to_noise,
)
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.planes import IndirectLight, MemoryPlanes
from lightpaint.errors import BasisError
from lightpaint.images.formats.exr import read_parts, write_parts

SIZE = (40, 72)


def halves(share: float, *, seed: int, light: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Image and half difference of halves that light this share of the pixels each."""
    rng = np.random.default_rng(seed)
    colours = light * np.exp(rng.normal(0, 2, (2, *SIZE, 1))) * rng.uniform(0.5, 1, 3)
    a, b = (colours * (rng.random((2, *SIZE, 1)) < share)).astype(np.float32)
    return (a + b) / 2, (a - b) / 2


def decoded(plane: LitPlane) -> np.ndarray:
    dense = plane.dense(SIZE[0] * SIZE[1]) * np.float32(plane.scale)
    return dense.T.reshape(*SIZE, 3)


def by_tiles(values: np.ndarray) -> np.ndarray:
    """Σ x² of each tile and channel."""
    squares = np.square(values, dtype=np.float64)
    return squares.reshape(SIZE[0] // TILE, TILE, SIZE[1] // TILE, TILE, 3).sum(axis=(1, 3))


def test_numbers_of_noise_are_rounded_products_to_the_bit() -> None:
    """Of all half floats below infinity with ratios of 1 and −1, whose product is not computed, and
    others.
    """
    light = np.arange(0x7C00, dtype=np.uint16).view(np.float16)
    signs = np.stack([light, -light])
    for ratio in (1, -1, 0, -0.0, 0.5, -0.999, 3e-6):
        ratios = np.full(signs.shape, ratio, np.float16)
        expected = round_to_halves(signs.astype(np.float32) * ratios.astype(np.float32))
        numbers = noise_numbers(signs, ratios)
        np.testing.assert_array_equal(numbers.view(np.uint16), expected.view(np.uint16))


@pytest.mark.parametrize("light", [1e-25, 1.0, 1e20])
def test_noise_hides_the_rounding(light: float) -> None:
    image, noise = halves(0.2, seed=1, light=light)
    rounded = round_to_noise([image, noise])
    assert rounded is not None
    for plane, before in zip(rounded, (image, noise), strict=True):
        error, power = by_tiles(decoded(plane) - before), by_tiles(noise)
        assert (error <= LARGEST_SHARE**2 * power).all()
        # Each of the two roundings of a half difference is hidden so.
        assert np.median(error / power) <= 2 * HIDDEN_SHARE**2
        assert ((plane.numbers.view(np.uint16) & 0b11111) != 0).mean() < 0.02
    alike = np.abs(image) == np.abs(noise)
    kept = np.abs(decoded(rounded[0])) == np.abs(decoded(rounded[1]))
    assert alike.mean() > 0.9
    assert kept[alike].all()


def test_rounding_has_no_bias() -> None:
    """Where all lit pixels have one value, rounding to the nearest would move their sum."""
    rng = np.random.default_rng(4)
    value, lit = np.float32(1.11), rng.random((2, *SIZE, 1)) < 0.3
    a, b = value * lit * np.ones(3, np.float32)
    image, noise = (a + b) / 2, (a - b) / 2
    rounded = round_to_noise([image, noise])
    assert rounded is not None
    one, half = (decoded(plane).astype(np.float64) for plane in rounded)
    # A number between two neighbours, d apart, has the standard deviation d / 2 at most; the three
    # channels of a pixel share their random number.
    spacing = image.max() * 2.0**-RATIO_DIGITS
    error = spacing / 2 * np.sqrt(lit.any(axis=0).sum()) * 3
    assert np.abs(one - image).max() > spacing / 50
    for actual, expected in ((one, image), (one + half, a), (one - half, b)):
        assert abs(actual.sum() - expected.sum(dtype=np.float64)) <= 4 * error


def test_what_is_rounded_does_not_change_when_it_is_rounded_again() -> None:
    rounded = round_to_noise(list(halves(0.2, seed=2)))
    assert rounded is not None
    again = round_to_noise([decoded(plane) for plane in rounded])
    assert again is not None
    for before, after in zip(rounded, again, strict=True):
        np.testing.assert_array_equal(decoded(after), decoded(before))


def test_a_picture_that_is_seen_directly_keeps_its_values() -> None:
    image, noise = halves(0.2, seed=3)
    screen = np.s_[3:12, 20:30]
    image[screen], noise[screen] = 0.7, 0
    assert round_to_noise([image, noise]) is None  # half floats do not hold them
    image[screen] = 0.75
    rounded = round_to_noise([image, noise])
    assert rounded is not None
    assert (decoded(rounded[0])[screen] == 0.75).all()


def test_noise_without_light_is_left_to_other_encodings() -> None:
    image, noise = halves(0.2, seed=3)
    image[5, 5], noise[5, 5] = 0, 1
    assert round_to_noise([image, noise]) is None


def test_ratios_give_their_half_differences_or_none() -> None:
    rng = np.random.default_rng(5)
    light = rng.uniform(0, 3, (3, 500)).astype(np.float16)
    ratios = noise_ratios(light, -light)
    assert ratios is not None
    assert (ratios == np.where(light == 0, 0, -1)).all()
    assert noise_ratios(light, np.full_like(light, np.float16(6e-8))) is None
    assert noise_ratios(np.zeros_like(light), light) is None


@pytest.mark.parametrize("pixels", [[], [0], [2879], [0, 1, 2, 2879], [MAX_STEP], [MAX_STEP - 1]])
def test_lit_pixels_far_apart_come_back(pixels: list[int]) -> None:
    numbers = np.arange(3 * len(pixels)).reshape(3, -1).astype(np.float16) + np.float16(1)
    planes = [LitPlane(np.array(pixels, np.uint32), x, 0.25) for x in (numbers, -numbers)]
    channels = lit_channels(planes, SIZE)
    assert channels is not None
    reread = read_lit_planes(channels, (0.25,) * 4, SIZE)
    for before, after in zip(planes, reread, strict=True):
        np.testing.assert_array_equal(decoded(before), decoded(after))


@pytest.fixture
def many(make_basis: Any) -> Basis:
    """Sparse lights, one of them black, one without noise, one brighter and one dimmer."""
    strengths = np.ones(MANY_LIGHTS)
    strengths[3:5] = 1e6, 1e-12
    pairs = [halves(0.15, seed=k, light=x) for k, x in enumerate(strengths)]
    pairs[1] = (np.zeros((*SIZE, 3), np.float32),) * 2
    pairs[2] = 1 + pairs[2][0], np.zeros((*SIZE, 3), np.float32)
    images, noise = (np.stack(x) for x in zip(*pairs, strict=True))
    basis: Basis = make_basis(images=images, half_differences=noise)
    is_direct = np.random.default_rng(7).random((*SIZE, 1)) < 0.4
    indirect = IndirectLight(
        MemoryPlanes(np.where(is_direct, 0, images)), MemoryPlanes(np.where(is_direct, 0, noise))
    )
    return replace(basis, indirect=indirect)


def all_planes(basis: Basis) -> np.ndarray:
    assert basis.indirect is not None
    sets = basis.planes, basis.noise, basis.indirect.planes, basis.indirect.noise
    return np.stack([planes.array() for planes in sets])


@pytest.mark.parametrize("is_dense", [True, False])
@pytest.mark.parametrize("limits", [{}, {"SINGLES_MAX_BYTES": 0}])
def test_many_lights_come_back_from_their_lit_pixels(
    tmp_path: Path,
    many: Basis,
    monkeypatch: pytest.MonkeyPatch,
    limits: dict[str, int],
    is_dense: bool,
) -> None:
    """In float32, in half floats and by lit pixels, and the same as they were written."""
    for name, value in limits.items():
        monkeypatch.setattr(basis_file, name, value)
    monkeypatch.setattr(basis_file, "MIN_LIGHTS", 2**10 if is_dense else MANY_LIGHTS)
    path, again = tmp_path / "a.basis.exr", tmp_path / "b.basis.exr"
    kept = list[Basis]()
    stored = as_stored(many, kept.append)
    lp.write_basis(path, kept[0])
    reread = lp.read_basis(path)
    assert isinstance(reread.planes, LitPlanes) == (bool(limits) and not is_dense)
    assert read_parts(path)[0].attributes[FORMAT_KEY] == LIT_FORMAT
    assert [STEP in part.channels for part in read_parts(path)][:4] == [True, True, False, True]
    np.testing.assert_array_equal(all_planes(reread), all_planes(stored))
    assert is_file_of(path, reread)
    lp.write_basis(again, reread)
    np.testing.assert_array_equal(all_planes(lp.read_basis(again)), all_planes(stored))


def test_rows_of_many_lights_are_read_on_request(
    tmp_path: Path, many: Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.basis.exr"
    lp.write_basis(path, many)
    expected = all_planes(lp.read_basis(path))
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(lit_planes, "MAX_BYTES", 0)
    reread = lp.read_basis(path)
    assert isinstance(reread.planes, FilePlanes)
    np.testing.assert_array_equal(all_planes(reread), expected)
    assert reread.indirect is not None
    for k, planes in enumerate((reread.planes, reread.noise, reread.indirect.noise)):
        whole = expected[(0, 1, 3)[k]]
        for top, bottom in ((0, 1), (7, 19), (SIZE[0] - 1, SIZE[0]), (4, 4)):
            np.testing.assert_array_equal(planes.rows(top, bottom), whole[:, top:bottom])
        np.testing.assert_array_equal(planes.plane(5), whole[5])


def test_a_file_of_many_lights_is_shorter(
    tmp_path: Path, many: Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    lp.write_basis(tmp_path / "many.exr", many)
    for module in (basis_file, file_parts):
        monkeypatch.setattr(module, "MANY_LIGHTS", MANY_LIGHTS + 1)
    lp.write_basis(tmp_path / "few.exr", many)
    many_bytes, few_bytes = ((tmp_path / f"{name}.exr").stat().st_size for name in ("many", "few"))
    assert many_bytes < 0.6 * few_bytes  # headers are a good part of such small pictures


def _no_integer(steps: np.ndarray) -> None:
    steps[0, 0] = 0.5


def _negative(steps: np.ndarray) -> None:
    steps[0, 1] = -1


def _beyond_the_picture(steps: np.ndarray) -> None:
    steps[0, 0] = MAX_STEP
    steps[0, 1] = MAX_STEP


def _no_number(steps: np.ndarray) -> None:
    steps[0, 2] = np.nan


def _interrupted(steps: np.ndarray) -> None:
    steps[0, 2] = 0


@pytest.mark.parametrize(
    "damage", [_no_integer, _negative, _beyond_the_picture, _no_number, _interrupted]
)
def test_steps_that_are_none(
    tmp_path: Path, many: Basis, damage: Callable[[np.ndarray], None]
) -> None:
    path = tmp_path / "a.basis.exr"
    lp.write_basis(path, many)
    parts = read_parts(path)
    damage(parts[0].channels[STEP])
    write_parts(path, parts)
    with pytest.raises(BasisError, match=r"a\.basis\.exr is a damaged basis: the steps"):
        lp.read_basis(path)


def test_changed_ratios_are_noticed(tmp_path: Path, many: Basis) -> None:
    path = tmp_path / "a.basis.exr"
    lp.write_basis(path, many)
    parts = read_parts(path)
    parts[0].channels[f"{PREFIXES[0][1]}R"][0, 0] += 1
    write_parts(path, parts)
    with pytest.raises(BasisError, match="changed light"):
        lp.read_basis(path)
