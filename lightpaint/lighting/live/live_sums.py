"""The sums behind answers under a brush: of light by tiles, and of a display over a small film."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from math import ceil

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices, Slices
from lightpaint.basis import Basis, Planes, array_name, array_once, multipliers_in, read_look
from lightpaint.colour import ViewTransform, from_rec709, to_rec709
from lightpaint.images import block_mean, block_sums, enlarged
from lightpaint.lighting.live.tiles import MAX_CHEAP_LIGHTS, TiledEquations
from lightpaint.lighting.loss.expected_lights import (
    ON_EMITTERS,
    FlameWishes,
    KeptResults,
    Wash,
    alike_lights,
    are_outlined,
    counted_wishes,
    joint_cover,
    wish_places,
    wish_shares,
)
from lightpaint.lighting.loss.painting_loss import PaintedPixels, join_pixels
from lightpaint.lighting.loss.pixel_loss import STRIP_PIXELS
from lightpaint.lighting.loss.reweighting import interpolate, search_step
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.target import Wish, extend_marked
from lightpaint.threads import one_thread, parallel_map

#: Maximum number of pixels of an averaged picture in display space: the pixels of one strip.
MAX_FILM_PIXELS = STRIP_PIXELS

#: Round-off, in float32, of an importance and its complement, whose sum is 1.
IMPORTANCE_ROUND_OFF = 1e-6

#: Returns the wishes of a painting's layers, with areas averaged over blocks of this side.
LayerWishes = Callable[[int], Sequence[Wish]]

#: Returns where brighter than the painting is as good, (h, w, 3); None for nowhere.
AtLeast = Callable[[], Bools | None]

#: Number of lightings whose pictures are kept: from one answer to the next, the last ones and the
#: current lighting stay the same.
KEPT_PICTURES = 4

#: Drafts that are found from one another, until all lights are added up again: round-off grows.
DRAFTS_PER_SUM = 64


class PaintedTiles:
    """Equations of painted pixels and of the rest, each at weight 1, in linear light."""

    def __init__(self, basis: Basis, image: Floats, importance: Floats) -> None:
        self._importance, self._seen = importance, basis.emitters_seen
        self._current_weights, self._is_moved = basis.current_weights, basis.former is not None
        self._paint = TiledEquations(basis.planes, image, importance)
        self._unpainted = np.where(basis.emitters_seen, np.float32(0), np.float32(1))
        rest = basis.planes, basis.current_look, self._unpainted
        self._rest = TiledEquations(*rest, twin=self._paint)
        self._whole = self._rest.base.copy()
        everything = slice(0, len(importance)), slice(0, importance.shape[1])
        self._set_unpainted(everything)
        # Region in which the sums of the rest are out of date.
        self._is_old: Slices | None = everything

    def _set_unpainted(self, region: Slices) -> None:
        unpainted = np.maximum(1 - self._importance[region], 0)
        self._unpainted[region] = np.where(self._seen[region], 0, unpainted)

    def _update_rest(self, region: Slices) -> None:
        """Update the sums of the rest; as the complement of the paint where both add up to 1."""
        side = self._rest.side
        pixels = tuple(
            slice(part.start * side, part.stop * side) for part in self._rest.tiles_in(region)
        )
        if self._is_moved:  # the rest is held near a look of other planes
            self._rest.update(region)
            return
        counted = self._importance[pixels] + self._unpainted[pixels]
        expected = np.where(self._seen[pixels], np.float32(0), np.float32(1))
        if np.abs(counted - expected).max(initial=0) <= IMPORTANCE_ROUND_OFF:
            self._rest.update_as_complement(region, self._whole, self._paint, self._current_weights)
        else:
            self._rest.update(region)

    def update(self, region: Slices, *, with_importance: bool) -> None:
        """Update the sums after a rectangle was painted."""
        self._paint.update(region, with_M=with_importance)
        if not with_importance:
            return
        replaced = self._unpainted[region].copy()
        self._set_unpainted(region)
        if not np.array_equal(replaced, self._unpainted[region]):
            self._is_old = (
                region if self._is_old is None else _bounding_region(self._is_old, region)
            )

    def equations(self, rest_weight: float) -> NormalEquations:
        """Return the equations with this weight of the rest."""
        equations = self._paint.equations
        if not rest_weight:
            return equations
        if self._is_old is not None:
            self._update_rest(self._is_old)
            self._is_old = None
        rest = self._rest.equations
        return NormalEquations(
            equations.M + rest_weight * rest.M,
            equations.b + rest_weight * rest.b,
            equations.target_norm2 + rest_weight * rest.target_norm2,
        )


class SmallFilm:
    """The picture averaged to `max_pixels`, and the paint of each by its importance.

    at_least: returns where brighter than the painting is as good. An average is such paint if more
    than half of the importance in it is.
    """

    def __init__(
        self,
        basis: Basis,
        image: Floats,
        importance: Floats,
        max_pixels: int = MAX_FILM_PIXELS,
        at_least: AtLeast = lambda: None,
    ) -> None:
        height, width = importance.shape
        self._side: int = max(1, ceil((height * width / max_pixels) ** 0.5))
        side = self._side
        self._image, self._importance, self._seen = image, importance, basis.emitters_seen
        self._planes, self._at_least, self._marks = basis.planes, at_least, np.zeros((3, 0), bool)
        rows, columns = -(-height // side), -(-width // side)
        self._size = rows, columns
        # Emitters do not count in a block that shows anything else.
        unseen = (~self._seen).astype(np.float64)
        self._shown = np.where(_spread(block_sums(unseen, side), side, unseen.shape) > 0, unseen, 1)
        name = array_name(f"averages of {side}", basis.emitters_seen)
        #: (3, n, p) float32, which suffices for averages: sums of it take half the time.
        self.rows: Floats = array_once(basis.planes, name, lambda: self._averages(basis.planes))
        self._owns_rows, self._primaries = False, basis.origin.primaries
        self._draft: tuple[Floats, Floats, int] | None = None
        # Of the wishes as they were read last.
        self._kept_sums, self._kept_places = KeptResults(), KeptResults()
        #: (3, p), of the visible surfaces; 1 where it is not known.
        self.albedo: Floats = np.ones(self.rows.shape[::2], np.float32)
        if basis.features is not None:
            self.albedo = _planes(self.average(basis.features.albedo))
        self._current = _planes(self.average(basis.current_look))
        self._read_look = self.average(read_look(basis))
        self._painted = self._current.copy()
        # The paint as the wash averages it: importance beyond 1 is no larger cover.
        self._washed = self._current.copy()
        self._transform: ViewTransform | None = None
        self._seen_painted = self._seen_current = self._current
        self._a, self._left, self._cover = np.zeros((3, rows * columns))
        self.update((slice(0, height), slice(0, width)))

    def _averages(self, planes: Planes) -> Floats:
        """Return the averages of all planes, (3, n, p)."""
        small = np.stack([self.average(x) for x in planes])
        by_channel = small.reshape(len(small), -1, 3).transpose(2, 0, 1)
        return np.ascontiguousarray(by_channel, np.float32)

    def average(self, image: Floats) -> Floats:
        """Return (h', w', 3) means over blocks of a picture (h, w, 3)."""
        side, (height, width) = self._side, image.shape[:2]
        if side == 1 or (self._shown.all() and not (height % side or width % side)):
            return block_mean(image, side)
        # Rows are added as they lie in memory, in float32: six times as fast as sums of blocks.
        sums = np.zeros((self._size[0], 3 * width), np.float32)
        rows, shown = image.reshape(height, -1), self._shown_values
        for k in range(min(side, height)):
            added = rows[k::side] * shown[k::side]
            sums[: len(added)] += added
        columns = np.arange(0, width, side)
        sums_by_pixel = sums.reshape(len(sums), -1, 3).astype(np.float64)
        total = np.add.reduceat(sums_by_pixel, columns, axis=1)
        return np.asarray(total / self._shown_in_block, np.float32)

    @cached_property
    def _shown_values(self) -> Floats:
        """Value 1 for each value of a pixel that counts, else 0, (h, 3 w) float32."""
        return np.repeat(self._shown.astype(np.float32), 3, axis=1)

    @cached_property
    def _shown_in_block(self) -> Doubles:
        """Number of pixels that count in each block, (h', w', 1)."""
        return block_sums(self._shown, self._side)[..., None]

    def replace_planes(self, basis: Basis, lights: Iterable[int]) -> None:
        """Average the replaced planes of some lights, by number."""
        self._planes, self._draft, self._kept_sums = basis.planes, None, KeptResults()
        if not self._owns_rows:
            self.rows, self._owns_rows = self.rows.copy(), True
        for k in lights:
            self.rows[:, k] = _planes(self.average(basis.planes.plane(k)))
        for kept in ("_multiplied_rows", "_alike"):
            self.__dict__.pop(kept, None)

    def update(self, region: Slices) -> None:
        """Average anew the blocks that a rectangle touches."""
        side, (height, width) = self._side, self._importance.shape
        (top, bottom), (left, right) = (
            _block_range(part, side, length)
            for part, length in zip(region, (height, width), strict=True)
        )
        if top >= bottom or left >= right:
            return
        pixels = slice(top, bottom), slice(left, right)
        a = self._importance[pixels] * self._shown[pixels]
        light = self._image[pixels] * a[..., None]
        rest = np.where(self._seen[pixels], 0, np.maximum(1 - a, 0))
        total, lit, unpainted = (block_sums(x, side) for x in (a, light, rest))
        rows = slice(top // side, -(-bottom // side))
        columns = slice(left // side, -(-right // side))
        painted, washed, current = (
            x.reshape(3, *self._size)[:, rows, columns]
            for x in (self._painted, self._washed, self._current)
        )
        painted[...] = _painted_means(lit, total, current)
        cover, covered_light = total, lit
        if (a > 1).any():
            share = np.minimum(a, 1)
            cover = block_sums(share, side)
            covered_light = block_sums(self._image[pixels] * share[..., None], side)
        washed[...] = _painted_means(covered_light, cover, current)
        for sums, own in ((self._a, total), (self._left, unpainted), (self._cover, cover)):
            sums.reshape(self._size)[rows, columns] = own
        if self._transform is not None:
            seen = self._seen_painted.reshape(3, *self._size)[:, rows, columns]
            planes = np.ascontiguousarray(painted).reshape(3, -1)
            seen[...] = self._transform.encode_planes(planes).reshape(seen.shape)
        if (at_least := self._at_least()) is not None:
            if not self._marks.size:
                self._marks = np.zeros(self._painted.shape, bool)
            marked = block_sums(at_least[pixels] * a[..., None], side)
            marks = self._marks.reshape(3, *self._size)[:, rows, columns]
            marks[...] = (marked > 0.5 * total[..., None]).transpose(2, 0, 1)

    def set_transform(self, transform: ViewTransform | None) -> None:
        """Set the view transform of the comparison; None keeps the last one."""
        if transform is not None and transform != self._transform:
            self._seen_painted, self._seen_current = (
                np.array(transform.encode_planes(x), np.float64)
                for x in (self._painted, self._current)
            )
        self._transform = transform

    @property
    def side(self) -> int:
        """Pixels along the side of a block."""
        return self._side

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of blocks."""
        return self._size

    @property
    def look(self) -> Doubles:
        """(3, p), the current look."""
        return self._current

    @property
    def paint(self) -> tuple[Doubles, Doubles, Bools]:
        """The paint of each block, (3, p), its mean importance, (p,), and where brighter is as
        good, (3, p).
        """
        marks = self._marks if self._marks.size else np.zeros(self._painted.shape, bool)
        return self._painted, self._a / self._side**2, marks

    @property
    def has_emitters_alone(self) -> Bools:
        """(h', w'), blocks in which nothing but emitters is in view."""
        return np.asarray(self._counts.reshape(self._size) == 0)

    def mix(self, weights: Doubles) -> Floats:
        """Return the averaged picture (h', w', 3) of a lighting, linear. weights: (n, 3)."""
        # In float32, as the averages are: many lights would be copied as float64.
        columns = multipliers_in(self._primaries, weights).T.astype(np.float32)
        channels = [w @ rows for w, rows in zip(columns, self._multiplied_rows, strict=True)]
        return self._picture(np.stack(channels))

    @cached_property
    def _multiplied_rows(self) -> Floats:
        """`rows` in the primaries in which the renderer multiplies."""
        if not self._primaries:
            return self.rows
        own = from_rec709(self._primaries).astype(np.float32)
        return np.tensordot(own, self.rows, axes=1)

    def _picture(self, channels: Floats) -> Floats:
        """Return channels in these primaries, (3, p), as a picture (h', w', 3)."""
        if self._primaries:
            channels = to_rec709(self._primaries) @ channels
        return np.asarray(channels.T.reshape(*self._size, 3), np.float32)

    def draft(self, weights: Doubles) -> Floats:
        """Return the same as `mix` but for round-off, from the last draft if few lights differ."""
        columns = multipliers_in(self._primaries, weights).T.astype(np.float32)
        channels, before, count = self._draft or (None, columns, 0)
        changed = np.flatnonzero((columns != before).any(axis=0))
        with one_thread():
            if channels is None or count == DRAFTS_PER_SUM or 2 * len(changed) > len(weights):
                count, pairs = 0, zip(columns, self._multiplied_rows, strict=True)
                channels = np.stack([w @ rows for w, rows in pairs])
            else:
                steps = (columns - before)[:, changed]
                rows = (x[changed] for x in self._multiplied_rows)
                channels = channels + [w @ x for w, x in zip(steps, rows, strict=True)]
        self._draft = channels, columns, count + 1
        return self._picture(channels)

    def lights_at(self, row: int, column: int) -> Floats:
        """Return the light of all planes in the block of a pixel, the nearest outside, (n, 3)."""
        rows, columns = self._size
        y, x = min(row // self._side, rows - 1), min(column // self._side, columns - 1)
        return np.ascontiguousarray(self.rows[:, :, y * columns + x].T)

    def wash(self, layers: LayerWishes, *, is_sketch: bool) -> Wash:
        """Return the paint, the look under it and the light of each lamp, averaged.

        layers: returns the wishes of its layers, averaged over blocks of a side. is_sketch: whether
        the paint lies over the look.
        """
        counts = self._counts
        importance = np.where(counts > 0, self._cover / np.where(counts > 0, counts, 1), 0)
        painted: Floats = self._washed.T.reshape(*self._size, 3)
        look = self._current.T.reshape(*self._size, 3)
        small_importance = importance.reshape(self._size)
        covers = layers(self._side)
        wishes, flames = counted_wishes(covers, self._counted_share), self._flames(covers, layers)
        if is_sketch and self._marks.any():
            marks = self._marks.T.reshape(*self._size, 3)
            painted = extend_marked(painted, small_importance, marks, wishes, look)
        shares = wish_shares(wishes, painted, small_importance, self._read_look)
        exact = joint_cover([x for x in wishes if x.is_exact], self._size)
        strokes = joint_cover([x for x in wishes if x.has_strokes], self._size)
        places = self._kept_places.of(shares, lambda x: wish_places(x, self._size))
        return Wash(
            self.rows,
            painted.reshape(-1, 3).T,
            self._current,
            importance,
            counts,
            shares,
            exact,
            strokes,
            places,
            flames,
            are_outlined(wishes),
            self._alike,
            self._kept_sums,
        )

    @cached_property
    def _alike(self) -> Indices:
        """Pairs of lights that shine alike, (m, 2)."""
        return alike_lights(self.rows)

    def _flames(self, covers: Sequence[Wish], layers: LayerWishes) -> FlameWishes:
        """Return the wishes for emitters in view. covers: the wishes averaged over blocks."""
        seen = 1 - self._counted_share
        may_be = any(
            x.is_exact and 0 < ON_EMITTERS * x.area.sum() <= np.minimum(x.area, seen).sum()
            for x in covers
        )
        # Blocks do not tell an emitter from what is beside it.
        wishes = layers(1) if may_be else ()
        return FlameWishes.of(self._planes, self._seen, self._image, self._importance, wishes)

    @property
    def has_mark(self) -> Bools:
        """Blocks in which brighter than the painting is as good in any channel, (p,)."""
        no_marks = np.zeros(self._a.shape, bool)
        return np.asarray(self._marks.any(axis=0)) if self._marks.size else no_marks

    @cached_property
    def _counts(self) -> Doubles:
        """Number of pixels in each block without emitters, (p,)."""
        return block_sums((~self._seen).astype(np.float64), self._side).ravel()

    @cached_property
    def _counted_share(self) -> Doubles:
        """Share of the pixels of each block without emitters, (h', w')."""
        pixels = block_sums(np.ones(self._seen.shape), self._side)
        return np.asarray(self._counts.reshape(self._size) / pixels)

    def pixels(self, rest_weight: float, transform: ViewTransform | None) -> PaintedPixels:
        """Return the loss of these pixels; an average counts as much as all pixels in it."""
        rest = rest_weight * self._left
        weight = self._a + rest
        share = np.where(weight > 0, rest / np.where(weight > 0, weight, 1), 0)
        seen = None if transform is None else (self._seen_painted, self._seen_current)
        marks = self._marks if self._marks.any() else None
        return PaintedPixels(self._painted, weight, share, self._current, marks, transform, seen)


class Films:
    """The films of several views as one, with their pixels behind each other."""

    def __init__(self, films: Sequence[SmallFilm]) -> None:
        self._films = films
        self.join()

    def join(self) -> None:
        """Join the planes of the films again, after some were replaced."""
        rows = [film.rows for film in self._films]
        self._rows = rows[0] if len(rows) == 1 else np.concatenate(rows, axis=2)
        self._kept: dict[tuple[bytes, ViewTransform | None], tuple[Doubles, Doubles]] = {}

    @property
    def rows(self) -> Floats:
        """The light of each pixel of all films, (3, n, p)."""
        return self._rows

    @property
    def albedo(self) -> Floats:
        """The albedo of all blocks, (3, p)."""
        return np.concatenate([film.albedo for film in self._films], axis=1)

    @property
    def parts(self) -> Sequence[SmallFilm]:
        """The film of each view."""
        return self._films

    @property
    def has_mark(self) -> Bools:
        """See `SmallFilm.has_mark`, of all blocks, (p,)."""
        return np.concatenate([film.has_mark for film in self._films])

    def wash(self, layers: Sequence[LayerWishes], *, is_sketch: bool) -> Wash:
        """Return the washes of all views behind each other.

        layers: of each, and is_sketch: as for `SmallFilm.wash`.
        """
        with one_thread():
            pairs = zip(self._films, layers, strict=True)
            washes = [film.wash(wishes, is_sketch=is_sketch) for film, wishes in pairs]
            return Wash.joined(washes)

    def pixels(self, rest_weight: float, transform: ViewTransform | None) -> PaintedPixels:
        """Return the loss of all pixels, as `SmallFilm.pixels` does."""
        parts = [film.pixels(rest_weight, transform) for film in self._films]
        return parts[0] if len(parts) == 1 else join_pixels(parts)

    def picture(self, weights: Doubles) -> Doubles:
        """Return the picture of weights (n, 3), (3, p)."""
        return self._mixed(weights)

    def objective(self, pixels: PaintedPixels, weights: Doubles) -> float:
        """Return the loss of weights (n, 3), all channels together."""
        return float(pixels.objective(*self._shown(weights, pixels)).sum())

    def improve(
        self,
        pixels: PaintedPixels,
        starts: Sequence[Doubles],
        best: Callable[[NormalEquations, Doubles], Doubles],
        pull: NormalEquations | None,
        project: Callable[[Doubles], Doubles],
    ) -> Doubles:
        """Improve weights (n, 3) by one round of reweighting; the loss is the loss of the best
        start, or less.

        The round is one of `reweighting.rounds`, but in float32, and with the step of
        `search_step`. project: moves weights between two allowed ones onto the constraints.
        """

        def missed(w: Doubles) -> float:
            value = self.objective(pixels, w)
            return value if pull is None else value + float(pull.objective(w).sum())

        values = [missed(w) for w in starts]
        k = int(np.argmin(values))
        start, value = starts[k], values[k]
        equations = self._equations(pixels, self._shown(start, pixels)[0])
        best_weights = best(equations, start)
        pulled = equations if pull is None else equations + pull
        promised = float((pulled.objective(start) - pulled.objective(best_weights)).sum())
        return search_step(
            start,
            value,
            lambda share: project(interpolate(start, best_weights, share)),
            missed,
            promised=promised,
        )

    def _equations(self, pixels: PaintedPixels, picture: Doubles) -> NormalEquations:
        """Return the linear problem of the squares at a picture, (3, p), summed in float32."""
        squares = pixels.squares(picture, from_clipping=False)
        image, weight = (x.astype(np.float32) for x in squares)

        def gram(channel: int) -> Floats:
            rows = self._rows[channel]
            return np.asarray((rows * weight[channel]) @ rows.T)

        # Threads of BLAS wait for each other, the longer the busier the machine: many lights take
        # a thread for each channel instead.
        with one_thread():
            is_cheap = self._rows.shape[1] <= MAX_CHEAP_LIGHTS
            M = np.stack(list(map(gram, range(3))) if is_cheap else parallel_map(gram, range(3)))
            b = np.stack([r @ x for r, x in zip(self._rows, weight * image, strict=True)])
        norm2 = (np.square(image) * weight).sum(axis=1, dtype=np.float64)
        return NormalEquations(M.astype(np.float64), b.astype(np.float64), norm2)

    def _shown(self, weights: Doubles, pixels: PaintedPixels) -> tuple[Doubles, Doubles]:
        """Return the picture of these weights, and its values in the comparison, (3, p) each."""
        key = weights.tobytes(), pixels.transform
        if (found := self._kept.pop(key, None)) is None:
            picture = self._mixed(weights)
            found = picture, pixels.encode(picture)
        self._kept[key] = found  # the last one
        while len(self._kept) > KEPT_PICTURES:
            del self._kept[next(iter(self._kept))]
        return found

    def _mixed(self, weights: Doubles) -> Doubles:
        """Return the picture of these weights, (3, p)."""
        w = weights.astype(np.float32)
        with one_thread():
            mixed = np.stack([w[:, c] @ rows for c, rows in enumerate(self._rows)])
        return mixed.astype(np.float64)


def _bounding_region(first: Slices, second: Slices) -> Slices:
    """Return the smallest region that holds both."""
    (top, left), (below, right) = (
        [min(a.start, b.start) for a, b in zip(first, second, strict=True)],
        [max(a.stop, b.stop) for a, b in zip(first, second, strict=True)],
    )
    return slice(top, below), slice(left, right)


def _block_range(along: slice, side: int, length: int) -> tuple[int, int]:
    """Return the range of all blocks that a slice touches."""
    start, stop, _ = along.indices(length)
    return start // side * side, min(-(-stop // side) * side, length)


def _spread(blocks: Doubles, side: int, size: tuple[int, ...]) -> Doubles:
    """Return the value of its block for each pixel, (h, w)."""
    return np.asarray(enlarged(blocks, side)[: size[0], : size[1]])


def _painted_means(light: Doubles, total: Doubles, current: Doubles) -> Doubles:
    """Return the mean paint of blocks, (3, h', w'); the current look where nothing is painted.

    light: (h', w', 3), sums of weight times paint; total: (h', w'), of the weight.
    """
    is_painted = total > 0
    mean = light / np.where(is_painted, total, 1)[..., None]
    return np.where(is_painted, mean.transpose(2, 0, 1), current)


def _planes(image: Floats) -> Doubles:
    return np.ascontiguousarray(image.reshape(-1, 3).T, np.float64)
