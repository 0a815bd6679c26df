"""Half floats for planes, used where their rounding stays invisible.

Rounding to half changes a value by at most 2⁻¹¹ of it. An image is stored in half floats if that is
far below its own noise in every tile, and in float32 if it is so clean that rounding would show:
a picture on a screen or a dome, seen directly, has no noise at all, and a verification would take
its rounding for an error.
Values that are too bright for half floats, or so dim that they lose digits, are first multiplied by
a power of two.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import (
    Bools,
    Doubles,
    Floats,
    Indices,
    copy_as_singles,
    copy_rows_as_singles,
    is_finite,
    read_only,
    release_freed_memory,
    round_to_halves,
)
from lightpaint.basis.file.file_planes import KeptMixes, RowPlanes
from lightpaint.images import grown
from lightpaint.threads import parallel_map

HALF, FLOAT = np.dtype(np.float16), np.dtype(np.float32)

#: Maximum ratio of rounding error to noise in a tile, root mean square, which adds 1/512 to the
#: standard deviation; and the side of a tile in pixels: as in the blocks that are verified.
HIDDEN_SHARE, TILE = 1 / 16, 8

#: Relative noise below which a pixel counts as clean when all neighbours within a radius do, which
#: are those whose noise a verification pools; rounding must then be as small.
CLEAN, CLEAN_RADIUS = 1e-5, 2

#: Maximum size in bytes of planes that are decoded once, in float32, rather than on each walk.
DECODED_MAX_BYTES = 2**26

#: Number of pixels of a light that are decoded and mixed at a time, in a processor's cache.
MIXED_PIXELS = 2**16

#: Number of pixels that are encoded at a time.
STRIP_PIXELS = 2**14

#: Exponent to which the brightest value is scaled; half floats reach 15.
BRIGHTEST = 14


@dataclass(frozen=True)
class PlaneEncoding:
    """The encoding of a plane. kind: stored number type. scale: a power of two that multiplies
    stored numbers.
    """

    kind: np.dtype[Any] = FLOAT
    scale: float = 1.0

    def encoded(self, plane: Floats) -> npt.NDArray[Any]:
        """Return the numbers to store for a plane or part of one."""
        with np.errstate(over="ignore"):
            scaled = plane if self.scale == 1 else plane * np.float32(1 / self.scale)
        return round_to_halves(scaled) if self.kind == HALF else scaled

    def decoded(self, stored: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """Return the light, float32, that stored numbers represent."""
        plane = np.empty(stored.shape, np.float32)
        copy_as_singles(stored, plane)
        if self.scale != 1:
            plane *= np.float32(self.scale)
        return plane


@dataclass(frozen=True)
class EncodedPlane:
    """A plane in its stored encoding. numbers: its three channels, (h, w) each."""

    encoding: PlaneEncoding
    numbers: Sequence[npt.NDArray[Any]] | npt.NDArray[Any]

    @property
    def scale(self) -> float:
        """The power of two that multiplies stored numbers."""
        return self.encoding.scale

    @cached_property
    def is_finite(self) -> bool:
        """True if it has neither infinities nor NaN: looked for once, not at each decoding."""
        return all(is_finite(channel) for channel in self.numbers)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        height, width = self.numbers[0].shape
        return height, width

    def decoded(self) -> npt.NDArray[np.float32]:
        """Return its light, (h, w, 3)."""
        light = np.empty((*self.size, 3), np.float32)
        for k, channel in enumerate(self.numbers):
            copy_as_singles(channel, light[..., k])
        if self.scale != 1:
            light *= np.float32(self.scale)
        return light


class EncodedPlanes(RowPlanes):
    """Planes held in memory in their stored encoding: in half floats where rounding stays
    invisible.

    planes: one for each light. is_decoded_once: whether walks share what the first has decoded, if
    that takes little memory; the stored numbers, which follow from it, are then forgotten. halves:
    (n, 3, h, w), the array that has the numbers of all planes in half floats, if one has.
    """

    def __init__(
        self,
        planes: Sequence[EncodedPlane],
        *,
        is_decoded_once: bool = True,
        halves: npt.NDArray[np.float16] | None = None,
    ) -> None:
        self.count, self.size = len(planes), planes[0].size
        self.is_noisy = 2 * sum(x.encoding.kind == HALF for x in planes) > self.count
        singles_bytes = 12 * self.count * self.size[0] * self.size[1]
        self._is_decoded_once = is_decoded_once and singles_bytes <= DECODED_MAX_BYTES
        self._stored, self._halves = list(planes), halves
        self._lock = Lock()
        self._decoded: npt.NDArray[np.float32] | None = None
        self._mixes = KeptMixes()

    @classmethod
    def sets(
        cls, lights: Iterable[Sequence[EncodedPlane]], count: int, size: tuple[int, int]
    ) -> list["EncodedPlanes"]:
        """Return sets of planes. lights: of each of `count` lights its planes, (height, width) =
        `size`, which are copied one after the other.

        Walks over indirect light, from the third set on, are rare, and need no copy in float32.
        """
        return [
            cls(planes, is_decoded_once=k < 2, halves=halves)
            for k, (planes, halves) in enumerate(_joined(lights, count, size))
        ]

    @property
    def nbytes(self) -> int:
        """Bytes of memory that the planes take."""
        if self._decoded is not None:
            return self._decoded.nbytes
        return sum(channel.nbytes for plane in self._stored for channel in plane.numbers)

    def stored(self, i: int) -> EncodedPlane:
        """Return the plane of light i as it is stored."""
        with self._lock:
            plane = self._stored[i]
            if self._decoded is None:
                return plane
            # Numbers that were decoded are rounded to themselves.
            singles = self._decoded[i].reshape(3, *self.size)
            return EncodedPlane(plane.encoding, plane.encoding.encoded(singles))

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return np.ascontiguousarray(self._channels(i).T).reshape(*self.size, 3)

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""
        return slice(None), self._channels(i)

    def _channels(self, i: int) -> npt.NDArray[np.float32]:
        """Return the plane of light i decoded, (3, pixels)."""
        if self._singles is not None:
            return np.asarray(self._singles[i])
        channels = np.empty((3, self.size[0] * self.size[1]), np.float32)
        self._decode(i, slice(None), channels)
        return channels

    @property
    def _singles(self) -> npt.NDArray[np.float32] | None:
        """All planes decoded, (n, 3, pixels), once for all walks; None if that takes much
        memory.
        """
        if not self._is_decoded_once:
            return None
        pixels = self.size[0] * self.size[1]
        with self._lock:
            if self._decoded is None:
                decoded = np.empty((self.count, 3, pixels), np.float32)
                for i, channels in enumerate(decoded):
                    self._decode(i, slice(None), channels)
                    self._stored[i] = EncodedPlane(self._stored[i].encoding, ())
                self._decoded, self._halves = read_only(decoded), None
                release_freed_memory()
            return self._decoded

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        height, width = self.size
        top, bottom = max(top, 0), min(bottom, height)
        block = self.pixels(slice(top * width, max(bottom, top) * width))
        return block.transpose(0, 2, 1).reshape(self.count, 3, -1, width).transpose(0, 2, 3, 1)

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        if self._singles is not None:
            return self._singles[:, :, where].transpose(0, 2, 1)
        length = self._stored[0].numbers[0].reshape(-1)[where].size
        # Channels first, which is how they are stored and summed.
        block = np.empty((self.count, 3, length), np.float32)
        if self._halves is not None:
            rows = self._halves.reshape(3 * self.count, -1)[:, where]
            copy_rows_as_singles(
                rows, block.reshape(len(rows), -1), self._factors, are_finite=self._are_finite
            )
        for i, (channels, plane) in enumerate(zip(block, self._stored, strict=True)):
            if self._halves is None or plane.encoding.kind != HALF:
                self._decode(i, where, channels)
        return block.transpose(0, 2, 1)

    @cached_property
    def _are_finite(self) -> bool:
        """True if no half float of all planes is infinite or NaN."""
        return all(x.is_finite for x in self._stored if x.encoding.kind == HALF)

    @cached_property
    def _factors(self) -> npt.NDArray[np.float32]:
        """The scale of each channel of each plane, (3 n,)."""
        return np.repeat(np.array([x.scale for x in self._stored], np.float32), 3)

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3), in one walk. weights: (k, n, 3)."""
        if self._singles is not None:
            return super().mixes(weights)
        channels = self._mixed(np.asarray(weights, np.float32))
        images = np.ascontiguousarray(channels.transpose(0, 2, 1))
        return images.reshape(len(weights), *self.size, 3)

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64; read-only."""
        return self._mixes.get(weights, self._exact_mix)

    def _exact_mix(self, weights: Doubles) -> Doubles:
        if self._singles is not None:
            return super().exact_mix(weights)
        return np.asarray(self._mixed(np.asarray(weights, np.float64)[None])[0])

    def _mixed(self, weights: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return several sums Σ w_i Φ_i, (k, 3, p), of the type of their weights, (k, n, 3).

        Each light is decoded and added at once, so that no more than a few of its pixels need room.
        """
        pixels = self.size[0] * self.size[1]
        mixed = np.zeros((len(weights), 3, pixels), weights.dtype)

        def fill(start: int) -> None:
            some = slice(start, min(start + MIXED_PIXELS, pixels))
            light, share = (np.empty(some.stop - start, x) for x in (np.float32, weights.dtype))
            for i, encoded in enumerate(self._stored):
                factors = weights[:, i] * encoded.scale
                for c in np.flatnonzero(factors.any(axis=0)).tolist():
                    stored = encoded.numbers[c].reshape(-1)[some]
                    copy_as_singles(stored, light, are_finite=encoded.is_finite)
                    for into, factor in zip(mixed[:, c, some], factors[:, c], strict=True):
                        into += np.multiply(light, factor, out=share)

        parallel_map(fill, range(0, pixels, MIXED_PIXELS), unit="strips")
        return mixed

    def _decode(self, i: int, where: slice | Indices, into: Floats) -> None:
        """Decode some pixels of light i into an array (3, p)."""
        encoded = self._stored[i]
        for stored, channel in zip(encoded.numbers, into, strict=True):
            copy_as_singles(stored.reshape(-1)[where], channel, are_finite=encoded.is_finite)
        if encoded.encoding.scale != 1:
            into *= np.float32(encoded.encoding.scale)


def _joined(
    lights: Iterable[Sequence[EncodedPlane]], count: int, size: tuple[int, int]
) -> list[tuple[list[EncodedPlane], npt.NDArray[np.float16]]]:
    """Return sets of planes, and for each the array (n, 3, h, w) with their half floats.

    Where one array has the numbers of many planes, some pixels of all are decoded by few calls. It
    has no pages where planes are in float32. lights, count, size: as in `EncodedPlanes.sets`.
    """
    sets: list[tuple[list[EncodedPlane], npt.NDArray[np.float16]]] = []
    for i, planes in enumerate(lights):
        sets = sets or [([], np.empty((count, 3, *size), HALF)) for _ in planes]
        for plane, (encoded, halves) in zip(planes, sets, strict=True):
            is_half = plane.encoding.kind == HALF
            if is_half:
                for channel, into in zip(plane.numbers, halves[i], strict=True):
                    into[...] = channel
            encoded.append(replace(plane, numbers=halves[i]) if is_half else plane)
    return sets


def encoded_plane(channels: Sequence[npt.NDArray[Any]], scale: float) -> EncodedPlane:
    """Return a plane whose stored channels, (h, w) each, are given."""
    numbers = [np.ascontiguousarray(channel) for channel in channels]
    return EncodedPlane(PlaneEncoding(numbers[0].dtype, scale), numbers)


def encode_pair(image: Floats, noise: Floats) -> tuple[EncodedPlane, EncodedPlane]:
    """Return the image of a light and its half difference, (h, w, 3), in their best encodings."""
    image, noise = (
        np.ascontiguousarray(plane.transpose(2, 0, 1), np.float32) for plane in (image, noise)
    )
    strips = [_Strip.of(image, noise, rows) for rows in _strips(noise.shape)]
    exact = _clean_pixels(image, noise)
    return _encode(image, strips, exact), _encode(noise, strips)


@dataclass(frozen=True)
class _Strip:
    """A few rows of a plane.

    Most planes of many lights are dark in most pixels, and only the others take time.

    lit: indices of the numbers that are not +0, in the order of memory, (3, rows, w); a slice if
    all are. hidden: the largest power of a rounding error that noise hides, for each tile and
    channel, as `_power` returns it.
    """

    rows: slice
    shape: tuple[int, ...]
    lit: slice | Indices
    hidden: Doubles

    @classmethod
    def of(cls, image: Floats, noise: Floats, rows: slice) -> "_Strip":
        """Return the strip of an image and its half difference, (3, h, w) each."""
        grain = noise[:, rows]
        # By their bits, since a negative number may have been rounded to −0.
        is_lit = (grain.view(np.uint32) | image[:, rows].view(np.uint32)) != 0
        lit = slice(None) if is_lit.all() else np.flatnonzero(is_lit)
        power = _power(grain.reshape(-1)[lit], lit, grain.shape)
        return cls(rows, grain.shape, lit, HIDDEN_SHARE**2 * power)


def _clean_pixels(image: Floats, noise: Floats) -> Bools | None:
    """Return the pixels, (h, w), that have light but no noise, nor have their neighbours; None if
    there are none. image, noise: (3, h, w).
    """
    is_clean = np.ones(image.shape[1:], bool)
    for light, grain in zip(image, noise, strict=True):
        is_clean &= np.abs(grain) <= np.float32(CLEAN) * np.abs(light)
    red, green, blue = image != 0
    is_clean &= red | green | blue
    if not is_clean.any():
        return None
    inner = inner_pixels(is_clean)
    return inner if inner.any() else None


def inner_pixels(is_clean: Bools) -> Bools:
    """Return the clean pixels, (h, w), whose neighbours within CLEAN_RADIUS are clean as well."""
    near_noise = ~is_clean
    for _ in range(CLEAN_RADIUS):
        near_noise = grown(near_noise)
    return ~near_noise


def _encode(plane: Floats, strips: Sequence[_Strip], exact: Bools | None = None) -> EncodedPlane:
    """Return a plane, (3, h, w), in half floats if noise hides the rounding error in every tile and
    channel; else in float32.

    exact: (h, w), pixels that must keep their values; None for none.
    """
    for scale in dict.fromkeys((1.0, scale_of(plane))):
        encoding, numbers = PlaneEncoding(HALF, scale), np.zeros(plane.shape, HALF)
        for strip in strips:
            values = plane[:, strip.rows].reshape(-1)[strip.lit]
            stored = encoding.encoded(values)
            with np.errstate(over="ignore", invalid="ignore"):
                rounding = encoding.decoded(stored) - values
            if not (_power(rounding, strip.lit, strip.shape) <= strip.hidden).all():
                break
            if exact is not None:
                inside = np.broadcast_to(exact[strip.rows], strip.shape).reshape(-1)[strip.lit]
                if (np.abs(rounding) > CLEAN * np.abs(values))[inside].any():
                    break
            rounded = np.zeros(strip.shape, HALF)
            rounded.reshape(-1)[strip.lit] = stored
            numbers[:, strip.rows] = rounded
        else:
            return EncodedPlane(encoding, numbers)
    return EncodedPlane(PlaneEncoding(), plane)


def scale_of(plane: Floats) -> float:
    """Return the power of two by which stored numbers are multiplied, so that the brightest is
    stored just below 2^BRIGHTEST.
    """
    brightest = float(max(plane.max(initial=0), -plane.min(initial=0)))
    if not 0 < brightest < np.inf:
        return 1.0
    # Within the exponents of float32, so that scaling back and forth changes no bit.
    return float(2.0 ** np.clip(np.frexp(brightest)[1] - BRIGHTEST, -100, 100))


def _strips(shape: tuple[int, ...]) -> Iterator[slice]:
    """Yield the rows of one strip after the other of a plane, (3, h, w): whole rows of tiles."""
    _, height, width = shape
    step = TILE * max(1, STRIP_PIXELS // (TILE * width))
    return (slice(top, min(top + step, height)) for top in range(0, height, step))


def _power(values: Floats, places: slice | Indices, shape: tuple[int, ...]) -> Doubles:
    """Return Σ x² of each tile and channel of a strip, as one row.

    values: its numbers at some places in the order of memory; it is zero elsewhere. shape: (3,
    rows, w).
    """
    tiles = tiles_of(*shape)
    squares = np.square(values, dtype=np.float64)
    power = np.bincount(tiles[places], squares, minlength=int(tiles[-1]) + 1)
    return np.asarray(power, np.float64)


@lru_cache(maxsize=4)
def tiles_of(channels: int, rows: int, width: int) -> npt.NDArray[np.int32]:
    """Return the index of the tile of each number of a strip, in the order of its memory."""
    down, across = -(-rows // TILE), -(-width // TILE)
    first = np.arange(channels)[:, None] * down + np.arange(rows) // TILE
    tiles = first[:, :, None] * across + np.arange(width) // TILE
    return read_only(tiles.astype(np.int32).reshape(-1))
