"""Planes in half floats: only where their rounding is far below the noise, and nobody sees it."""

import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.arrays import (
    as_singles,
    copy_as_singles,
    copy_rows_as_singles,
    round_to_halves,
)
from lightpaint.basis.file import basis_file, half_floats
from lightpaint.basis.file.basis_file import FORMAT_KEY, as_stored, read_basis, write_basis
from lightpaint.basis.file.file_parts import SCALE_KEY
from lightpaint.basis.file.file_planes import FilePlanes, RowPlanes
from lightpaint.basis.file.half_floats import (
    FLOAT,
    HALF,
    HIDDEN_SHARE,
    TILE,
    EncodedPlanes,
    PlaneEncoding,
    encode_pair,
    encoded_plane,
)
from lightpaint.basis.planes import IndirectLight, MemoryPlanes, as_planes
from lightpaint.errors import BasisError
from lightpaint.images.formats.exr import read_parts, write_parts

SIZE = (70, 90)
DATA = Path(__file__).parent.parent / "data"


def plane(noise: float, *, seed: int = 1, light: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """An image and its half difference; noise: standard deviation beside the light."""
    rng = np.random.default_rng(seed)
    smooth = light * (0.1 + np.linspace(0, 1, SIZE[1])[:, None] * rng.uniform(0.5, 1, 3))
    grain = noise * smooth * rng.standard_normal((2, *SIZE, 3))
    return (smooth + grain[0]).astype(np.float32), grain[1].astype(np.float32)


def relative_noise(image: np.ndarray, encoding: PlaneEncoding) -> float:
    return float((np.abs(encoding.decoded(encoding.encoded(image)) - image) / np.abs(image)).max())


def encodings_of(image: np.ndarray, half: np.ndarray) -> tuple[PlaneEncoding, PlaneEncoding]:
    encoding, of_noise = encode_pair(image, half)
    return encoding.encoding, of_noise.encoding


def test_rounding_has_the_bits_of_numpy() -> None:
    """Of all bits but for which NaN it is, ties and the ends of ranges among them."""
    with np.errstate(over="ignore", invalid="ignore"):
        ties = np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float32)
        ties = (ties[1:] + ties[:-1]) / 2
    rng = np.random.default_rng(3)
    for bits in (
        rng.integers(0, 2**32, 2**20, dtype=np.uint32),
        *(ties.view(np.uint32) + np.uint32(k) for k in range(3)),
        np.arange(2**15, dtype=np.uint32) + np.uint32((113 << 23) - 2**14),
    ):
        numbers = bits.view(np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            expected = numbers.astype(np.float16)
        halves, is_number = round_to_halves(numbers), ~np.isnan(numbers)
        np.testing.assert_array_equal(
            halves[is_number].view(np.uint16), expected[is_number].view(np.uint16)
        )
        assert np.isnan(halves[~is_number]).all()


@pytest.mark.parametrize("flushes", [False, True])
def test_half_floats_are_converted_with_the_bits_of_numpy(
    flushes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of all half floats, several pieces and few of them; into arrays of either order."""
    monkeypatch.setattr("lightpaint.arrays._flushes_subnormals", lambda: flushes)
    every = np.arange(2**16, dtype=np.uint16).view(np.float16)
    finite = every[np.isfinite(every)]
    for halves in (every, finite[::-1], np.tile(finite, 3), finite[:7], finite[:0]):
        expected = halves.astype(np.float32).view(np.uint32)
        np.testing.assert_array_equal(as_singles(halves).view(np.uint32), expected)
        columns = np.empty((halves.size, 3), np.float32)
        copy_as_singles(halves, columns[:, 1])
        np.testing.assert_array_equal(columns[:, 1].view(np.uint32), expected)


@pytest.mark.parametrize("flushes", [False, True])
def test_rows_of_half_floats_are_scaled_by_powers_of_two(
    flushes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exactly: from parts of rows to parts of others, whose product with both scales is finite."""
    monkeypatch.setattr("lightpaint.arrays._flushes_subnormals", lambda: flushes)
    every = np.arange(2**16, dtype=np.uint16).view(np.float16)
    finite = every[np.isfinite(every)]
    factors = np.array([1, 2.0**-100, 2.0**-20, 2.0**30, 2.0**100], np.float32)
    for halves in (every, finite, finite[:7], finite[:0]):
        rows = np.stack([halves[::-1], *(halves,) * 4])
        room = np.zeros((5, halves.size + 3), np.float32)
        with np.errstate(invalid="ignore"):  # signalling NaN
            expected = rows.astype(np.float32) * factors[:, None]
            are_finite = halves is not every
            copy_rows_as_singles(rows, room[:, 1:-2], factors, are_finite=are_finite)
        np.testing.assert_array_equal(room[:, 1:-2], expected)
        assert not room[:, [0, -2, -1]].any()


def test_noisy_planes_are_halves_and_clean_ones_are_not() -> None:
    for noise, kind in ((0.1, HALF), (0.01, HALF), (1e-3, FLOAT), (0.0, FLOAT)):
        image, half = plane(noise)
        encoding, of_noise = encodings_of(image, half)
        assert (encoding.kind, encoding.scale, of_noise.scale) == (kind, 1, 1)
        assert of_noise.kind == HALF
        # Round to nearest, of 11 binary digits.
        assert relative_noise(image, encoding) <= (2**-11 if kind == HALF else 0)


def test_rounding_is_hidden_in_the_noise_of_every_tile() -> None:
    image, half = plane(0.1)
    half[TILE : 2 * TILE, :TILE] *= 1e-3
    assert encodings_of(image, half)[0].kind == FLOAT
    image[TILE : 2 * TILE, :TILE] = 0.5  # nothing is rounded there
    encoding, _ = encodings_of(image, half)
    assert encoding.kind == HALF
    squared_error = np.square(encoding.decoded(encoding.encoded(image)) - image, dtype=np.float64)
    noise = np.square(half, dtype=np.float64)
    for top in range(0, SIZE[0], TILE):
        for left in range(0, SIZE[1], TILE):
            tile = np.s_[top : top + TILE, left : left + TILE]
            assert (
                squared_error[tile].sum((0, 1)) <= HIDDEN_SHARE**2 * noise[tile].sum((0, 1))
            ).all()


def test_a_picture_seen_directly_beside_noise_keeps_its_values() -> None:
    image, half = plane(0.1)
    screen = np.s_[TILE - 3 : TILE + 4, 2:9]  # a part of each of four tiles
    half[screen] = 0
    encoding, of_noise = encodings_of(image, half)
    assert (encoding.kind, of_noise.kind) == (FLOAT, HALF)
    image[screen] = 0.75  # of few binary digits
    assert encodings_of(image, half)[0].kind == HALF


@pytest.mark.parametrize("light", [1e-30, 1e-7, 1e5, 1e30])
def test_what_half_floats_do_not_reach_is_scaled(light: float) -> None:
    image, half = plane(0.1, light=light)
    encoding, of_noise = encodings_of(image, half)
    assert encoding.kind == of_noise.kind == HALF
    assert encoding.scale != 1
    assert np.log2(encoding.scale) % 1 == 0
    assert relative_noise(image, encoding) <= 2**-11


def test_a_range_beyond_half_floats_is_float() -> None:
    image, half = plane(0.1)
    for array in (image, half):
        array[:TILE] *= np.float32(1e-12)  # a shadow that counts beside lamps in view
    assert [encoding.kind for encoding in encodings_of(image, half)] == [FLOAT, FLOAT]
    assert encodings_of(np.zeros_like(image), np.zeros_like(half)) == (PlaneEncoding(HALF),) * 2


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Noisy, clean, dim and black lights."""
    planes = [plane(0.1), plane(0.05, seed=2), plane(0.0, seed=3), plane(0.1, light=1e-9)]
    planes.append((np.zeros((*SIZE, 3), np.float32),) * 2)
    images, halves = (np.stack(x) for x in zip(*planes, strict=True))
    source: lp.Basis = make_basis(images=images, half_differences=halves)
    return source


@pytest.mark.parametrize("limit", [0, 2**27])
def test_what_is_stored_comes_back(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch, limit: int
) -> None:
    """Where memory holds planes in half floats, and where in float32."""
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", limit)
    images, halves = basis.images.copy(), basis.half_differences.copy()
    path = tmp_path / "a.basis.exr"
    write_basis(path, basis)
    reread = read_basis(path)
    stored = as_stored(basis)
    for actual, expected, before in (
        (reread.images, stored.images, images),
        (reread.half_differences, stored.half_differences, halves),
    ):
        assert actual.dtype == np.float32
        assert actual.tobytes() == expected.tobytes()
        for one, other in zip(actual, before, strict=True):
            # Next to zero, where noise makes light negative, steps are even: 2^-24.
            np.testing.assert_allclose(one, other, rtol=2**-11, atol=6e-7 * other.max(initial=0))
    parts = read_parts(path)
    kinds = [[part.channels[c].dtype for c in ("R", "half_difference.R")] for part in parts[:5]]
    assert kinds == [[HALF, HALF], [HALF, HALF], [FLOAT, HALF], [HALF, HALF], [HALF, HALF]]
    assert [SCALE_KEY in part.attributes for part in parts[:5]] == [False] * 3 + [True, False]


def test_memory_holds_many_planes_in_two_bytes_a_number(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of indirect light, unless its file is there; and with the answer of float32."""
    planes = [plane(0.1, seed=k) for k in range(3)]
    images, halves = (np.stack(x) for x in zip(*planes, strict=True))
    indirect = IndirectLight(MemoryPlanes(0.4 * images), MemoryPlanes(0.4 * halves))
    source = replace(make_basis(images=images, half_differences=halves), indirect=indirect)
    target = lp.Target.of(source.mix(np.full((3, 3), 0.7)))
    write_basis(tmp_path / "a.basis.exr", source)
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    monkeypatch.setattr(basis_file, "INDIRECT_MAX_BYTES", 0)
    rendered, reread = as_stored(source), read_basis(tmp_path / "a.basis.exr")
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 2**27)
    singles = as_stored(source)
    for basis in (rendered, reread):
        assert basis.indirect is not None
        assert singles.indirect is not None
        for actual, other in (
            (basis.planes, singles.planes),
            (basis.noise, singles.noise),
            (basis.indirect.planes, singles.indirect.planes),
            (basis.indirect.noise, singles.indirect.noise),
        ):
            if isinstance(actual, EncodedPlanes):
                assert 2 * actual.nbytes == images.nbytes
            else:
                assert isinstance(actual, FilePlanes)
                assert basis is reread
                assert actual in (basis.indirect.planes, basis.indirect.noise)
            assert actual.array().tobytes() == other.array().tobytes()
        expected = lp.solve(singles, target)
        np.testing.assert_allclose(lp.solve(basis, target).weights, expected.weights, rtol=1e-12)


def test_planes_that_were_decoded_are_written_as_they_came() -> None:
    """The walks share float32, and no half floats stay beside them."""
    flat = np.zeros_like(plane(0.1)[1])
    pairs = [plane(0.1), plane(1e-9), (1 + plane(0.1)[0], flat)]  # noisy, scaled, clean
    encoded = [x for image, noise in pairs for x in encode_pair(image, noise)]
    assert {x.encoding.kind for x in encoded} == {HALF, FLOAT}
    assert any(x.encoding.scale != 1 for x in encoded)
    planes = EncodedPlanes(encoded)
    values = np.stack([x.encoding.decoded(np.stack(x.numbers)) for x in encoded])
    np.testing.assert_array_equal(planes.array(), values.transpose(0, 2, 3, 1))
    assert planes.nbytes == values.nbytes
    for i, before in enumerate(encoded):
        after = planes.stored(i)
        assert after.encoding == before.encoding
        assert after.size == before.size
        assert np.stack(after.numbers).tobytes() == np.stack(before.numbers).tobytes()


@pytest.mark.parametrize("limit", [0, 2**27])
def test_what_is_kept_is_rounded_once(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch, limit: int
) -> None:
    """And the file has the bytes of one of planes as they were rendered."""
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", limit)
    write_basis(tmp_path / "a.exr", basis)
    rounded = []
    encode = half_floats.encode_pair
    monkeypatch.setattr(
        half_floats,
        "encode_pair",
        lambda *arguments: rounded.append(len(arguments)) or encode(*arguments),
    )
    stored = as_stored(basis, lambda complete: write_basis(tmp_path / "b.exr", complete))
    assert len(rounded) == len(basis.lights)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert stored.images.tobytes() == read_basis(tmp_path / "b.exr").images.tobytes()


def test_headers_of_long_names_have_room(tmp_path: Path, make_basis: Any) -> None:
    names = ("Ü" * 900, '"' * 1000, "c")
    planes = [plane(0.1, light=1e-30, seed=k) for k in range(3)]
    images, halves = (np.stack(x) for x in zip(*planes, strict=True))
    basis = make_basis(images=images, half_differences=halves, names=names)
    write_basis(tmp_path / "a.basis.exr", basis)
    assert read_basis(tmp_path / "a.basis.exr").names == names
    assert len(read_parts(tmp_path / "a.basis.exr")) >= 4


def test_a_file_is_half_as_long(tmp_path: Path, make_basis: Any) -> None:
    noise = np.random.default_rng(0).uniform(0.5, 1, (2, 1, 300, 300, 3))
    basis = make_basis(images=noise[0], half_differences=noise[1] / 10)
    write_basis(tmp_path / "a.basis.exr", basis)
    pixels = basis.images.nbytes  # of both sets, at two bytes each
    assert (tmp_path / "a.basis.exr").stat().st_size < 1.02 * pixels


@pytest.mark.parametrize("options", [{"literal": True}, {"transform": lp.ViewTransform("agx")}, {}])
def test_weights_are_the_same_to_far_below_their_error(
    tmp_path: Path, make_basis: Any, options: dict[str, Any]
) -> None:
    rng = np.random.default_rng(8)
    planes = [plane(0.02 * (1 + k), seed=k) for k in range(4)]
    ramps = rng.uniform(0, 1, (4, SIZE[0], 1, 1)) ** 3
    images, halves = (np.stack(x) * ramps for x in zip(*planes, strict=True))
    basis = make_basis(images=images, half_differences=halves)
    painting = lp.Target.of(basis.mix(np.full((4, 3), 0.3)) + np.float32(0.02) * images[1])
    expected = lp.solve(basis, painting, **options)
    bars = lp.error_bars(expected)
    assert bars is not None
    write_basis(tmp_path / "a.basis.exr", basis)
    reread = read_basis(tmp_path / "a.basis.exr")
    assert (reread.images != basis.images).mean() > 0.5
    solution = lp.solve(reread, painting, **options)
    gap = np.abs(solution.weights - expected.weights)
    # HIDDEN of the noise of an image at most, and here its rounding is less: 2^-11 / 0.02.
    assert (gap <= 0.05 * bars.standard_error).all()
    reread_bars = lp.error_bars(solution)
    assert reread_bars is not None
    np.testing.assert_allclose(reread_bars.standard_error, bars.standard_error, rtol=0.01)


def test_a_file_of_the_format_before_is_read() -> None:
    """It was written by the last version that stored all planes in float32."""
    path = DATA / "format_1.basis.exr"
    assert read_parts(path)[0].attributes[FORMAT_KEY] == "lightpaint-basis 1"
    k = np.arange(2 * 4 * 5 * 3, dtype=np.float32).reshape(2, 4, 5, 3)
    reread = read_basis(path)
    np.testing.assert_array_equal(reread.images, np.float32(1) / (3 + k))
    np.testing.assert_array_equal(np.abs(reread.half_differences), np.float32(1) / (700 + k))
    assert reread.names == ("key", "Fülllicht")
    assert reread.lights[0].unit_flux == (1.5, 1.5, 1.5)
    assert reread.lights[1].members == ("a", "b")
    assert reread.origin.halves == (32, 32)
    assert reread.guide_table is not None
    assert reread.features is not None
    assert reread.features.position is None
    assert reread.surface_filter is None
    assert reread.objects is not None
    assert reread.objects.names == ("vase", "")


@pytest.mark.parametrize(
    "text", ["[1]", "[1, 0]", "[1, -2]", '[1, "2"]', "[1, 1e300]", "7", "{", "[true, 1]"]
)
def test_scales_that_are_none(tmp_path: Path, basis: lp.Basis, text: str) -> None:
    path = tmp_path / "a.basis.exr"
    write_basis(path, basis)
    parts = read_parts(path)
    parts[1].attributes[SCALE_KEY] = text  # type: ignore[index]
    write_parts(path, parts)
    with pytest.raises(BasisError, match=r"a\.basis\.exr is a damaged basis"):
        read_basis(path)


def test_a_changed_scale_is_noticed(tmp_path: Path, basis: lp.Basis) -> None:
    path = tmp_path / "a.basis.exr"
    write_basis(path, basis)
    parts = read_parts(path)
    parts[0].attributes[SCALE_KEY] = "[2, 2]"  # type: ignore[index]
    write_parts(path, parts)
    with pytest.raises(BasisError, match="changed light"):
        read_basis(path)


class MadePlanes(RowPlanes):
    """Noise that is made when it is asked for. bytes: of one plane."""

    count, size = 60, (200, 250)
    bytes = 200 * 250 * 3 * 4

    def plane(self, i: int) -> Any:
        return np.random.default_rng(i).random((*self.size, 3), np.float32)


@pytest.mark.nightly
def test_writing_holds_one_light_at_a_time(tmp_path: Path, make_basis: Any) -> None:
    planes: Any = MadePlanes()
    basis = make_basis(images=np.ones((planes.count, 1, 1, 3)))
    fields = {name: getattr(basis, name) for name in ("lights", "origin")}
    large = lp.Basis(
        **fields, planes=planes, noise=planes, emitters_seen=np.zeros(planes.size, dtype=bool)
    )
    tracemalloc.start()
    write_basis(tmp_path / "a.basis.exr", large)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # Two planes, what is stored of them, and what is computed on the way; all are 120 of them.
    assert peak < 10 * MadePlanes.bytes
    reread = read_basis(tmp_path / "a.basis.exr")
    np.testing.assert_allclose(reread.planes.plane(7), planes.plane(7), rtol=2**-11)
    assert as_planes(reread.planes).count == planes.count


def test_planes_that_are_not_finite_are_decoded_as_numpy_does() -> None:
    """That they are is looked for once, and long planes are decoded from their bits."""
    numbers = np.random.default_rng(2).normal(size=(2, 3, 64, 80)).astype(np.float16)
    numbers[0, 1, 5, 7], numbers[0, 2, 9, 3] = np.inf, np.nan
    planes = EncodedPlanes([encoded_plane(x, 1.0) for x in numbers], is_decoded_once=False)
    for k, expected in enumerate(numbers.astype(np.float32)):
        np.testing.assert_array_equal(planes.plane(k).transpose(2, 0, 1), expected)
        np.testing.assert_array_equal(planes.lit_plane(k)[1].reshape(expected.shape), expected)
