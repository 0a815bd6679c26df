"""Planes: one picture for each light, accessed by pixels, independent of their storage.

A basis has two sets of planes: the images, and half the differences of the two halves of samples.
Code outside this package uses the protocol below and never indexes an array of planes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, release_freed_memory
from lightpaint.errors import BasisError
from lightpaint.progress import counting, with_progress
from lightpaint.threads import one_thread, parallel_map

#: Number of pixels multiplied at a time, whose float64 copies stay in the processor's cache.
BLOCK_PIXELS = 2**13

#: Number of lights up to which the product of a block is too small for BLAS to use threads; from
#: which noisy planes are multiplied in float32; and from which a block has fewer pixels, since its
#: matrices, of several channels at a time, would take most of the memory of a solve.
FEW_LIGHTS, MIN_SINGLE_LIGHTS, LARGE_BLOCK_LIGHTS = 256, 128, 512

#: Rows of a strip of which some pixels are collected, and the maximum number of bytes of these.
THINNED_ROWS, THINNED_MAX_BYTES = 8, 2**27

#: A function from some pixels, and a function that returns their light, (n, p, 3), to weights, (p,
#: 1) or (p, 3), and an image, (p, 3).
SquaresOfLight = Callable[[slice | Indices, Callable[[], Floats]], tuple[Floats, Floats]]

#: Share of the pixels, those with the most noise, that do not count. A single stray sample may have
#: more than all the others, and four times as many samples would not remove it.
STRAY_SHARE = 1 / 1000


@dataclass(frozen=True)
class LitEntries:
    """The lit pixels of all planes among p pixels, in any order.

    lights, columns: (m,), the light and the pixel of each. values: (3, m) float32. shape: (n, p).
    """

    lights: Indices
    columns: Indices
    values: Floats
    shape: tuple[int, int]

    @cached_property
    def places(self) -> Indices:
        """Their places in an array (n, p), (m,)."""
        return self.lights * self.shape[1] + self.columns


class Planes(Protocol):
    """The planes of n lights, (h, w, 3) each, float32 whatever the stored type.

    Returned arrays are read-only by convention: they may share the memory of the planes.

    count: number of lights. size: (height, width) in pixels. is_noisy: whether most planes are
    stored in half floats, whose rounding their noise hides.
    """

    count: int
    size: tuple[int, int]
    is_noisy: bool

    def __iter__(self) -> Iterator[Floats]:
        """Yield the planes, (h, w, 3) each."""

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3), indexed in row-major order."""

    @property
    def strip_pixels(self) -> int:
        """Number of consecutive pixels that are best looked for together, by `lit_entries`."""

    def lit_entries(self, where: slice | Indices) -> LitEntries | None:
        """Return the lit ones of some pixels of all planes; None if the planes do not know them."""

    def picked(self, where: slice | Indices) -> "Planes":
        """Return these pixels as planes with a single row, (1, p, 3) each."""

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return Σ w_i Φ_i, (h, w, 3). weights: (n, 3), one per light and channel."""

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several such sums, (k, h, w, 3), in one walk. weights: (k, n, 3)."""

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64. weights: (n, 3)."""

    def sums(self, weight: Floats, image: Floats) -> tuple[Doubles, Doubles, Doubles]:
        """Return M (3, n, n), b (3, n) and ‖Ψ‖² (3,) over all pixels, in one walk.

        weight: (h, w), (h, w, 1) or, if it differs between channels, (h, w, 3), >= 0. image: Ψ, (h,
        w, 3).
        """

    def sums_of(
        self, counted: Indices, squares: SquaresOfLight
    ) -> tuple[Doubles, Doubles, Doubles]:
        """Return the same sums over the counted pixels, one block at a time.

        squares: computes weights and image of a block from the light in it.
        """

    def power_and_totals(self, mask: Bools) -> tuple[Doubles, Doubles]:
        """Return ‖Φᵢ‖² over the counted pixels and Σ Φᵢ over all pixels, (n, 3) float64 each, in
        one walk. mask: (h, w).
        """

    def replaced(self, planes: Mapping[int, Floats]) -> "Planes":
        """Return planes in which some lights have other planes, (h, w, 3) each."""

    def array(self) -> Floats:
        """Return all planes, (n, h, w, 3): for interactive use and small images."""


class PlanesBase(Planes):
    """Implementation shared by all planes: sums and squares, computed block by block."""

    is_noisy = False

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""
        return slice(None), self.plane(i).reshape(-1, 3).T

    @property
    def strip_pixels(self) -> int:
        """Number of consecutive pixels that are best looked for together, by `lit_entries`."""
        return 1

    def lit_entries(self, where: slice | Indices) -> LitEntries | None:
        """Return the lit ones of some pixels of all planes; None if the planes do not know them."""
        return None

    def __repr__(self) -> str:
        height, width = self.size
        return f"{type(self).__name__}({self.count} of {width}x{height})"

    def __iter__(self) -> Iterator[Floats]:
        return (self.plane(k) for k in with_progress(range(self.count), "lights"))

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return Σ w_i Φ_i, (h, w, 3)."""
        return np.asarray(self.mixes(np.asarray(weights)[None])[0])

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64. weights: (n, 3)."""
        pixels = self.size[0] * self.size[1]
        mixed = np.empty((3, pixels))

        def fill(block: slice) -> None:
            mixed[:, block] = mix_channels(self.pixels(block), weights)

        parallel_map(fill, walked_blocks(self, pixels), unit="blocks")
        _release_after_walk(self)
        return mixed

    @one_thread()
    def power_and_totals(self, mask: Bools) -> tuple[Doubles, Doubles]:
        """Return ‖Φᵢ‖² over the counted pixels and Σ Φᵢ over all pixels, (n, 3) each."""
        power, totals = np.zeros((2, self.count, 3))
        counted = mask.ravel()
        # NumPy sums over such short axes slowly, but multiplies matrices fast; by blocks, which
        # need no copy of the basis, a product is as exact as a sum.
        step, kind = block_of(self)
        for start in with_progress(range(0, len(counted), step)):
            weights = counted[start : start + step].astype(kind)
            block = self.pixels(slice(start, start + step))
            for c in range(3):
                lit = np.ascontiguousarray(block[..., c], kind)
                totals[:, c] += lit @ np.ones_like(weights)
                power[:, c] += np.square(lit) @ weights
        return power, totals

    def sums(self, weight: Floats, image: Floats) -> tuple[Doubles, Doubles, Doubles]:
        """Return M (3, n, n), b (3, n) and ‖Ψ‖² (3,), in one walk over the pixels with weight."""
        height, width = self.size
        # Pixels without weight contribute nothing and need not be read.
        is_per_channel = weight.shape[2:] == (3,)
        weights = weight.reshape(height * width, 3 if is_per_channel else 1)
        counted = np.flatnonzero(weights.any(axis=1) if is_per_channel else weights)
        colours = image.reshape(-1, 3)
        return self.sums_of(counted, lambda where, _: (weights[where], colours[where]))

    def sums_of(
        self, counted: Indices, squares: SquaresOfLight
    ) -> tuple[Doubles, Doubles, Doubles]:
        """Return M (3, n, n), b (3, n) and ‖Ψ‖² (3,) of squares computed one block at a time."""
        n = self.count
        gram = np.zeros((3, n + 1, n + 1))
        step, kind = block_of(self)
        # Pixels without weight in between cost less than gathering the others.
        spare = 0 if n <= FEW_LIGHTS else step // 8
        blocks = blocks_of(self, counted)
        length = max((block.size for block in blocks), default=0)
        rooms = Rooms(n, (n + 1) * (length + spare), kind)
        # A block of a thousand lights takes a second: each of its channels is a step.
        with one_thread(), counting(3 * len(blocks), "products") as advance:
            for block in blocks:
                where = as_slice(block, spare=spare)
                light = _LightOf(self, where)
                _add_products(gram, light, *squares(where, light.dense), rooms, advance)
                del light
        del rooms
        _release_after_walk(self)
        return gram[:, :n, :n], gram[:, :n, n], gram[:, n, n]


class Rooms:
    """Memory for matrices of the light of some pixels, as many as channels are worked on at once.

    Products of many lights take long enough for each channel to have a thread: BLAS's own threads
    would wait for each other half of the time.
    """

    def __init__(self, n: int, length: int, kind: Any, *, are_kept: bool = False) -> None:
        """Make rooms.

        n: number of lights. length: of the longest matrix. are_kept: whether the matrix of a
        channel is needed after the work on the next one.
        """
        self._is_parallel = n > FEW_LIGHTS
        self._rooms = np.empty((3 if self._is_parallel or are_kept else 1, length), kind)

    @property
    def kind(self) -> Any:
        """Type of the numbers."""
        return self._rooms.dtype

    def array(self, c: int, shape: tuple[int, int]) -> npt.NDArray[Any]:
        """Return a matrix of this shape for channel c, with what was in it before."""
        room: npt.NDArray[Any] = self._rooms[c % len(self._rooms)][: shape[0] * shape[1]]
        return room.reshape(shape)

    def each_channel(self, work: Callable[[int], None]) -> None:
        """Do `work(c)` for each channel."""
        if self._is_parallel:
            parallel_map(work, range(3))
            return
        for c in with_progress(range(3)):
            work(c)


class _LightOf:
    """The light of some pixels of all planes, by their lit pixels if the planes know these."""

    def __init__(self, planes: PlanesBase, where: slice | Indices) -> None:
        self._planes, self._where = planes, where
        self._lit = planes.lit_entries(where)
        if self._lit is None:
            self.dense()  # now, or each channel's thread would read it

    def dense(self) -> Floats:
        """Return all of it, (n, p, 3)."""
        return self._dense

    @cached_property
    def _dense(self) -> Floats:
        return self._planes.pixels(self._where)

    def multiply(self, c: int, factors: npt.NDArray[Any], into: npt.NDArray[Any]) -> None:
        """Write the light of channel c times factors, (p,), into an array, (n, p)."""
        if self._lit is None:
            np.multiply(self._dense[..., c], factors, out=into)
            return
        into[...] = 0
        into.reshape(-1)[self._lit.places] = self._lit.values[c] * factors[self._lit.columns]


def _add_products(
    gram: Doubles,
    light: _LightOf,
    weights: Floats,
    painted: Floats,
    rooms: Rooms,
    advance: Callable[[], None],
) -> None:
    """Add the weighted products of lights and image, (3, n + 1, n + 1), over some pixels.

    advance: is called after each channel.
    """
    n, kind = gram.shape[1] - 1, rooms.kind
    roots = np.broadcast_to(np.sqrt(weights, dtype=kind), painted.shape)

    def add(c: int) -> None:
        # (n + 1, block): the target goes along as one more row.
        block = rooms.array(c, (n + 1, len(roots)))
        light.multiply(c, roots[:, c], block[:n])
        np.multiply(painted[:, c], roots[:, c], out=block[n], casting="same_kind")
        gram[c] += block @ block.T
        advance()

    rooms.each_channel(add)


class MemoryPlanes(PlanesBase):
    """Planes in memory. images: (n, h, w, 3) float32."""

    def __init__(self, images: Floats) -> None:
        self._images = images
        self.count, self.size = len(images), (images.shape[1], images.shape[2])

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return np.asarray(self._images[i])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        return self._images[:, top:bottom]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        return self._images.reshape(len(self._images), -1, 3)[:, where]

    def picked(self, where: slice | Indices) -> "MemoryPlanes":
        """Return these pixels as planes with a single row."""
        return MemoryPlanes(self.pixels(where)[:, None])

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3)."""
        return np.stack([mix(self._images, one) for one in weights])

    def replaced(self, planes: Mapping[int, Floats]) -> "MemoryPlanes":
        """Return planes in which some lights have other planes, (h, w, 3) each."""
        images = self._images.copy()
        for k, plane in planes.items():
            images[k] = plane
        return MemoryPlanes(images)

    def array(self) -> Floats:
        """Return all planes, (n, h, w, 3), without copying."""
        return self._images


def as_planes(planes: Planes | Floats) -> Planes:
    """Return an array (n, h, w, 3) as planes in memory, and planes unchanged.

    Raises BasisError for an array of other axes.
    """
    if isinstance(planes, np.ndarray):
        if planes.ndim != 4:
            raise BasisError(f"images of shape {planes.shape}: need (n, h, w, 3)")
        return MemoryPlanes(planes)
    return planes


def joined_planes(
    parts: Sequence[Planes], width: int
) -> tuple[MemoryPlanes, tuple[MemoryPlanes, ...]]:
    """Return the planes of several pictures as one, (n, rows, width, 3), and views of its parts.

    The pixels of the pictures follow each other along the rows, and the last row is padded with
    zeros. The returned parts share the memory of the joint planes.
    """
    ends = np.cumsum([0, *(part.size[0] * part.size[1] for part in parts)])
    n, rows = parts[0].count, -(-int(ends[-1]) // width)
    joint = np.zeros((n, rows * width, 3), np.float32)
    views = []
    for part, (start, end) in zip(parts, pairwise(ends), strict=True):
        for plane, image in zip(joint[:, start:end], part, strict=True):
            if image.any():  # zeros that nobody writes, as of unknown noise, take no memory
                plane[...] = image.reshape(-1, 3)
        views.append(MemoryPlanes(joint[:, start:end].reshape(n, *part.size, 3)))
    return MemoryPlanes(joint.reshape(n, rows, width, 3)), tuple(views)


def thinned(planes: Planes, step: int, factors: Doubles) -> Iterator[Floats]:
    """Yield Σ_c factors Φ_i of every `step`-th pixel along each side of each plane, (h', w').

    factors: (n, 3), of channels. Few such pixels are collected in one walk along the rows: a single
    plane of many lights takes as long as many rows of it.
    """
    (height, width), n, single = planes.size, planes.count, factors.astype(np.float32)
    rows = -(-THINNED_ROWS // step) * step
    if 4 * n * -(-height // step) * -(-width // step) > THINNED_MAX_BYTES:
        for plane, one in zip(planes, single, strict=True):
            yield plane[::step, ::step] @ one
        return
    parts = []
    for top in with_progress(range(0, height, rows)):
        strip = planes.pixels(slice(top * width, min(top + rows, height) * width))
        picked = strip.reshape(n, -1, width, 3)[:, ::step, ::step]
        parts.append(sum(picked[..., c] * single[:, c, None, None] for c in range(3)))
    yield from np.concatenate(parts, axis=1)


def block_of(planes: Planes) -> tuple[int, Any]:
    """Return the number of pixels whose light is multiplied at a time, and the type of products.

    Products of many lights take most of a solve, and half as long in float32. Their round-off, 10⁻⁷
    to 10⁻⁶ of M, is far below the round-off of half floats; sums over blocks are float64 all the
    same.
    """
    is_single = planes.count >= MIN_SINGLE_LIGHTS and planes.is_noisy
    parts = 4 if planes.count >= LARGE_BLOCK_LIGHTS else 2 if is_single else 1
    return BLOCK_PIXELS // parts, np.float32 if is_single else np.float64


def _release_after_walk(planes: Planes) -> None:
    """Return the memory of a walk over many lights, which the C library keeps for each thread."""
    if planes.count >= LARGE_BLOCK_LIGHTS:
        release_freed_memory()


def walked_blocks(planes: Planes, stop: int, start: int = 0) -> list[slice]:
    """Return the parts of consecutive pixels of which the light of all planes, in float64 as well,
    is in memory at a time, by each thread.
    """
    step = BLOCK_PIXELS // (1 if planes.count < LARGE_BLOCK_LIGHTS else 8)
    return [slice(first, min(first + step, stop)) for first in range(start, stop, step)]


def blocks_of(planes: Planes, counted: Indices) -> list[Indices]:
    """Return the blocks of some pixels, in order, whose light is multiplied at a time.

    Of planes in strips, a block has whole strips: looking for a part of one takes as long.
    """
    step, _ = block_of(planes)
    strip = planes.strip_pixels
    if strip == 1:
        return [counted[start : start + step] for start in range(0, counted.size, step)]
    length = strip * max(1, round(step / strip))
    ends = np.searchsorted(counted, range(strip, planes.size[0] * planes.size[1], strip)).tolist()
    edges = [0]
    for end, following in pairwise([*ends, counted.size]):
        if following - edges[-1] > length:
            edges.append(end)
    return [block for block in np.split(counted, edges[1:]) if block.size]


def as_slice(pixels: Indices, *, spare: int = 0) -> slice | Indices:
    """Return contiguous pixels as a slice, which avoids a copy, and others unchanged.

    spare: number of further pixels that the slice may have.
    """
    first, last = int(pixels[0]), int(pixels[-1])
    return slice(first, last + 1) if last - first + 1 <= pixels.size + spare else pixels


def mix_channels(lit: Floats, weights: Doubles) -> Doubles:
    """Return Σ w_i Φ_i of pixels (n, p, 3), channel by channel, (3, p) float64. weights: (n, 3)."""
    return np.stack([weights[:, c] @ lit[..., c].astype(np.float64) for c in range(3)])


def mix(images: Floats, weights: Doubles) -> npt.NDArray[np.float32]:
    """Return Σ w_i Φ_i in float32, without a copy of the images.

    images: (n, h, w, 3) float32; weights: (n, 3), one per light and channel. Returns (h, w, 3).
    """
    n, height, width, _ = images.shape
    weights = np.asarray(weights, np.float32)
    if images.strides[-1] != images.itemsize:  # stored with channels first
        is_per_channel = [np.einsum("nhw,n->hw", images[..., c], weights[:, c]) for c in range(3)]
        return np.stack(is_per_channel, axis=-1)
    # One weight for each value of a row lets the innermost loop run along the whole row, rather
    # than over three channels at a time.
    along_row = np.tile(weights, (1, width))
    rows = images.reshape(n, height, width * 3)
    mixed = np.einsum("nhk,nk->hk", rows, along_row)
    return np.asarray(mixed.reshape(height, width, 3), np.float32)


@dataclass(frozen=True)
class IndirectLight:
    """The part of the images that was scattered by more than one surface.

    planes, noise: as in `Basis`, for that part alone.
    """

    planes: Planes
    noise: Planes


def relative_variances(planes: Planes, noise: Planes) -> Doubles:
    """Return Σ noise² / Σ light² for each light, (n,), over all pixels but those with stray
    samples; infinite for a black light.
    """
    return np.array([_relative_variance(*pair) for pair in zip(planes, noise, strict=True)])


def _relative_variance(light: Floats, noise: Floats) -> float:
    light_squares, noise_squares = (
        np.square(x, dtype=np.float64).sum(axis=-1).ravel() for x in (light, noise)
    )
    count = noise_squares.size - int(np.ceil(STRAY_SHARE * noise_squares.size))
    counted = np.argpartition(noise_squares, count - 1)[:count]
    light_total = light_squares[counted].sum()
    return float(noise_squares[counted].sum() / light_total) if light_total > 0 else np.inf
