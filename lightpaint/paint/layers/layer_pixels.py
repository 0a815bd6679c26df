"""The pixels of one layer in one view, in tiles that exist only where it has coverage; and the
selection of a view, which is kept as such pixels.

A selection is a soft mask that strokes, fills, adjustments and gradients keep to. A client that
paints multiplies coverage by the mask before it sends pixels, so that the session replays the same
bits without the mask. The mask is the pixels of a layer that is in no stack: selecting is a step,
which undo, reopening and a crash treat like any other.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools
from lightpaint.errors import PaintError
from lightpaint.paint.store.history_steps import Patch, Pixels, Region, replay

#: Side of a tile, in pixels.
TILE_SIDE = 64

#: Coverage, or importance, below which a pixel is uncovered.
MIN_COVERAGE = 1e-3

#: The id under which steps hold the masks; layers of a stack have ids from 0.
SELECTION_ID = -1

#: The value of a fully selected pixel. Masks have 8 bits, so that inverting twice changes nothing.
FULL = 255


class _Tile(NamedTuple):
    """Pixels of a tile; arrays of one value take no memory. total, least: of its coverage."""

    pixels: Pixels
    total: float
    least: float


class LayerSummary(NamedTuple):
    """Bounds and coverage of a layer, as in `LayerPixels`: all that others ask without its pixels.

    least_coverage: of the view, up to 1.
    """

    bounds: Region
    mean_coverage: float
    least_coverage: float


class LayerPixels:
    """Colour and coverage of a layer. Updated in place.

    They are exchanged as `Pixels`: `image` is the colour, `importance` the coverage (of a layer
    `pixels`, its importance). Uncovered pixels are black, so that equal layers made in different
    ways agree to the bit.

    Attributes:
        revision: A number that grows with every change.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size, self.revision = size, 0
        self._loaded: dict[tuple[int, int], _Tile] | None = {}
        self._load: Callable[[], dict[tuple[int, int], _Tile]] | None = None
        self._summary: LayerSummary | None = None

    @classmethod
    def replayed(cls, size: tuple[int, int], patches: Sequence[Patch]) -> "LayerPixels":
        """Return a layer after its patches, which are all of one view and layer."""
        layer = cls(size)
        bounds = enclosing([patch.region for patch in patches])
        if is_empty(bounds):
            return layer
        top, bottom, left, right = bounds
        black = np.zeros((bottom - top, right - left, 3), np.float32)
        layer.put(bounds, replay(patches, Pixels.unpainted(black), bounds))
        return layer

    @classmethod
    def stored(
        cls,
        size: tuple[int, int],
        patches: Sequence[Patch],
        summary: LayerSummary,
        on_other: Callable[[], None],
    ) -> "LayerPixels":
        """Return a layer after its patches, which are read when its pixels are needed.

        summary: of these pixels. on_other: called if they turn out to have another one.
        """
        layer = cls(size)

        def load() -> dict[tuple[int, int], _Tile]:
            replayed = cls.replayed(size, patches)
            if replayed.summary != summary:
                layer._summary = None
                on_other()
            return replayed._tiles

        layer._loaded, layer._load, layer._summary = None, load, summary
        return layer

    @property
    def _tiles(self) -> dict[tuple[int, int], _Tile]:
        if self._loaded is None:
            assert self._load is not None
            self._loaded = self._load()
            self._load = None
        return self._loaded

    @property
    def is_loaded(self) -> bool:
        """True if its pixels are in memory."""
        return self._loaded is not None

    def load(self) -> None:
        """Read its pixels, if they are not in memory."""
        _ = self._tiles

    @property
    def summary(self) -> LayerSummary:
        """Bounds and coverage."""
        if self._summary is None:
            height, width = self.size
            tiles = [self._tiles[key] for key in sorted(self._tiles)]  # sorted, for the same sum
            count = -(-height // TILE_SIDE) * -(-width // TILE_SIDE)
            least = min((tile.least for tile in tiles), default=0.0)
            self._summary = LayerSummary(
                enclosing([self._tile_region(key) for key in self._tiles]),
                sum(tile.total for tile in tiles) / (height * width),
                least if len(tiles) == count else 0.0,
            )
        return self._summary

    @property
    def bounds(self) -> Region:
        """The smallest region of whole tiles that contains all covered pixels."""
        return self.summary.bounds

    @property
    def bands(self) -> list[Region]:
        """The bounds of its covered pixels in each row of tiles, in whole tiles."""
        rows = sorted({row for row, _ in self._tiles})
        return [
            enclosing([self._tile_region(key) for key in self._tiles if key[0] == row])
            for row in rows
        ]

    @property
    def mean_coverage(self) -> float:
        """Mean over the view of the coverage, or importance, up to 1."""
        return self.summary.mean_coverage

    @property
    def covers_all(self) -> bool:
        """True if no pixel of the view is uncovered."""
        return self.summary.least_coverage >= MIN_COVERAGE

    @property
    def is_marked(self) -> bool:
        """True if any pixel has an "at least" mark."""
        return any(tile.pixels.at_least is not None for tile in self._tiles.values())

    def part(self, region: Region) -> Pixels:
        """Return a copy of the pixels of a region."""
        top, bottom, left, right = region
        shape = bottom - top, right - left
        image, coverage = np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32)
        marks: Bools | None = None
        for key in self._keys(region):
            if (tile := self._tiles.get(key)) is None:
                continue
            to, source = self._areas(key, region)
            coverage[to] = tile.pixels.importance[source]
            if not _is_black(tile.pixels.image):
                image[to] = tile.pixels.image[source]
            if tile.pixels.at_least is not None:
                marks = np.zeros(image.shape, bool) if marks is None else marks
                marks[to] = tile.pixels.at_least[source]
        return Pixels(image, coverage, marks)

    def is_empty_in(self, region: Region) -> bool:
        """Return whether no tile of a region has coverage."""
        return not any(key in self._tiles for key in self._keys(region))

    def coverage(self, region: Region) -> npt.NDArray[np.float32]:
        """Return a copy of the coverage, or importance, of a region."""
        top, bottom, left, right = region
        coverage = np.zeros((bottom - top, right - left), np.float32)
        for key in self._keys(region):
            if (tile := self._tiles.get(key)) is not None:
                to, source = self._areas(key, region)
                coverage[to] = tile.pixels.importance[source]
        return coverage

    def put(self, region: Region, pixels: Pixels) -> None:
        """Replace the pixels of a region."""
        tiles = self._tiles  # before its summary is forgotten
        self._summary = None
        self.revision += 1
        is_black = _is_black(pixels.image)
        for key in self._keys(region):
            source, to = self._areas(key, region)
            tile_region = self._tile_region(key)
            if is_black and pixels.at_least is None and enclosing([tile_region, region]) == region:
                # A mask over the whole picture has hundreds of such tiles.
                coverage = pixels.importance[source].copy()
                black = np.broadcast_to(np.float32(0), (*coverage.shape, 3))
                self._keep(tiles, key, Pixels(black, coverage))
                continue
            tile = self.part(tile_region)
            is_covered = pixels.importance[source] > 0
            tile.image[to] = np.where(is_covered[..., None], pixels.image[source], np.float32(0))
            tile.importance[to] = pixels.importance[source]
            marks = tile.at_least
            if pixels.at_least is not None or marks is not None:
                marks = np.zeros(tile.image.shape, bool) if marks is None else marks
                marks[to] = (
                    False
                    if pixels.at_least is None
                    else pixels.at_least[source] & is_covered[..., None]
                )
            self._keep(tiles, key, Pixels(tile.image, tile.importance, marks))

    def copy(self) -> "LayerPixels":
        """Return a copy that shares no mutable array."""
        copied = LayerPixels(self.size)
        copied._loaded = dict(self._tiles)  # tiles are replaced, and never written to
        return copied

    @staticmethod
    def _keep(tiles: dict[tuple[int, int], _Tile], key: tuple[int, int], pixels: Pixels) -> None:
        """Replace a tile."""
        if not pixels.importance.any():
            tiles.pop(key, None)
            return
        counted = np.minimum(pixels.importance, 1)
        total, least = float(counted.sum(dtype=np.float64)), float(counted.min())
        marks = pixels.at_least if pixels.at_least is not None and pixels.at_least.any() else None
        packed = Pixels(_packed(pixels.image), _packed(pixels.importance), marks)
        tiles[key] = _Tile(packed, total, least)

    def _keys(self, region: Region) -> Iterator[tuple[int, int]]:
        top, bottom, left, right = region
        if is_empty(region):
            return
        for row in range(top // TILE_SIDE, -(-bottom // TILE_SIDE)):
            for column in range(left // TILE_SIDE, -(-right // TILE_SIDE)):
                yield row, column

    def _tile_region(self, key: tuple[int, int]) -> Region:
        top, left = (TILE_SIDE * k for k in key)
        height, width = self.size
        return top, min(top + TILE_SIDE, height), left, min(left + TILE_SIDE, width)

    def _areas(
        self, key: tuple[int, int], region: Region
    ) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Return where a tile lies in a region, and the region in the tile."""
        # Written out, since a picture has hundreds of tiles, and a stroke crosses many layers.
        top, bottom, left, right = region
        y, x = TILE_SIDE * key[0], TILE_SIDE * key[1]
        first, last = max(y, top), min(y + TILE_SIDE, bottom)
        start, end = max(x, left), min(x + TILE_SIDE, right)
        in_region = slice(first - top, last - top), slice(start - left, end - left)
        return in_region, (slice(first - y, last - y), slice(start - x, end - x))


def enclosing(regions: Sequence[Region]) -> Region:
    """Return the smallest region that holds all of these; an empty one for none."""
    filled = [region for region in regions if not is_empty(region)]
    if not filled:
        return 0, 0, 0, 0
    tops, bottoms, lefts, rights = zip(*filled, strict=True)
    return min(tops), max(bottoms), min(lefts), max(rights)


def is_empty(region: Region) -> bool:
    """Return whether a region has no pixel."""
    top, bottom, left, right = region
    return top >= bottom or left >= right


def shared(first: Region, second: Region) -> Region:
    """Return the region that is in both; an empty one if none is."""
    return (
        *(max(first[0], second[0]), min(first[1], second[1])),
        *(max(first[2], second[2]), min(first[3], second[3])),
    )


def relative(region: Region, origin: Region) -> Region:
    """Return a region as seen from the corner of another."""
    top, bottom, left, right = region
    return top - origin[0], bottom - origin[0], left - origin[2], right - origin[2]


def _is_black(image: npt.NDArray[np.float32]) -> bool:
    """Return whether a picture is known to be black, as the picture of a mask, without looking at
    it."""
    return not any(image.strides) and not image[:1, :1].any()


def _packed(array: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the same values, without memory for each if all are equal."""
    first = array.flat[0]
    if not any(array.strides) and not np.signbit(first):
        return array
    if array.reshape(-1)[-1] == first and (array == first).all() and not np.signbit(first):
        return np.broadcast_to(np.float32(first), array.shape)
    return array


def selection_mask(selection: LayerPixels) -> npt.NDArray[np.uint8]:
    """Return the mask (rows, columns) in the bounds of a selection."""
    share = selection.part(selection.bounds).importance
    return np.asarray(np.rint(share * np.float32(FULL)), np.uint8)


def selection_patch(
    selection: LayerPixels, view: int, region: Region, arrays: Mapping[str, npt.NDArray[Any]]
) -> Patch | None:
    """Return the change of a view's selection to the mask of a region; None if there is none.

    Nothing is selected outside the region. Raises PaintError if the mask is none.
    """
    height, width = selection.size
    top, bottom, left, right = region
    if not (0 <= top <= bottom <= height and 0 <= left <= right <= width):
        raise PaintError(f"a selection at {list(region)}, and the picture is {width}x{height}")
    mask = arrays.get("mask")
    if mask is None or mask.dtype != np.uint8 or mask.shape != (bottom - top, right - left):
        found = "none" if mask is None else f"{mask.dtype} {list(mask.shape)}"
        raise PaintError(f"a mask of {list(region)} is {found}: expected bytes of that size")
    after = LayerPixels(selection.size)
    if not is_empty(region):
        after.put(region, _mask_pixels(np.asarray(mask, np.float32) / np.float32(FULL)))
    bounds = enclosing([selection.bounds, after.bounds])
    if is_empty(bounds):
        return None
    patch = Patch(
        bounds,
        _mask_pixels(selection.part(bounds).importance),
        _mask_pixels(after.part(bounds).importance),
        view,
        SELECTION_ID,
    )
    return None if patch.before.equals(patch.after) else patch


def put_selection(selection: LayerPixels, patch: Patch, *, is_back: bool) -> None:
    """Change a selection by a patch, or back. Updated in place."""
    selection.put(patch.region, patch.before if is_back else patch.after)


def _mask_pixels(share: npt.NDArray[np.float32]) -> Pixels:
    """Return a mask as pixels without colour."""
    return Pixels(np.broadcast_to(np.float32(0), (*share.shape, 3)), share)
