"""The expectation of each light that a painting gives, before anything is solved.

A moonlit picture was painted blue wherever its lamps shine: then it is the painting that decides
their colours. A lamp in an unpainted corner, or one under paint whose hue is a little off, is
expected to keep its own. How much colour is asked for where a light shines says how strong the pull
to its colour may be, and how much light, how dim it will be.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, sqrt
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import (
    Basis,
    Planes,
    block_means,
    read_look,
    read_look_noise,
    read_look_side,
)
from lightpaint.colour import LUMINANCE, luminance
from lightpaint.images import block_sums, enlarged
from lightpaint.target import Target, Wish, extend_saturated, number_places, split_wishes
from lightpaint.threads import one_thread

#: Approximate number of blocks of pixels over which the light of a painting is compared.
BLOCKS = 2**13

#: Number of lights whose rows are summed at a time.
CHUNK = 64

#: Light below which a ratio says little, relative to the mean of the look.
DARK = 0.01

#: Change of colour, in stops between channels, from which paint means it, and how sharply:
#: benchmarks/intent.py paints hues that are off by 0.25, benchmarks/briefs.py moods of 1 to 3.
MEANT_STOPS, SHARPNESS = 0.5, 8

#: Largest change in stops that a light is expected to make: one that hardly shines where it is
#: asked for has no mean change to speak of.
MOST_STOPS = 64.0

#: Factor by which a colour that was given as numbers is meant more clearly than a painted one.
EXACT_FACTOR = 4.0

#: Stops within which two places ask for the same, and the shares of a wish that do so from and to
#: which it counts as an adjustment by numbers. 8 bits are coarser than that where it is dark: light
#: that counts as lit, relative to the mean of the look.
UNIFORM_STOPS, ADJUSTED, LIT = 0.05, (0.55, 0.7), 0.2

#: Share of the lit picture from which a wish can show that it was adjusted: in a small one, every
#: change of light is even.
MIN_ADJUSTED = 0.1

#: Approximate number of blocks of a wish that are compared for it.
ADJUSTED_BLOCKS = 2**10

#: Cosine between the light of two lamps in the blocks of a picture from which one may stand in for
#: the other, and the approximate number of these blocks. Lamps beside each other on a bar have .98
#: and more, no others of the scenes in scenes/ more than .73.
ALIKE, ALIKE_BLOCKS = 0.9, 2**11

#: Steps of the iteration that mixes the colours of lamps that are alike.
MIX_STEPS = 200

#: Cosine between the light of a lamp and the light that is missing, from 0 down, from which the
#: lamp does not bring what is missing at all.
AGAINST = -0.25

#: Share of a wish that lies on emitters in view from which it is a wish for their own light, and
#: the approximate number of pixels over which that light is averaged.
ON_EMITTERS, FLAME_PIXELS = 0.5, 2**10


@dataclass(frozen=True)
class FlameWishes:
    """Wishes in numbers for the light of emitters in view themselves, as of a lantern's flame.

    rows: (k, 3, n), the mean of Φ over the emitters' pixels in each wish. light: (k, 3), linear,
    the mean that is painted there.
    """

    rows: Doubles
    light: Doubles

    @classmethod
    def of(
        cls,
        planes: Planes,
        seen: Bools,
        image: Floats,
        importance: Floats | Doubles,
        wishes: Sequence[Wish],
    ) -> Self:
        """Find the wishes of a view. seen: (h, w), where an emitter is in view; image: (h, w, 3);
        importance: (h, w); wishes: with areas of (h, w).
        """
        rows, light = [np.zeros((0, 3, planes.count))], [np.zeros((0, 3))]
        for wish in wishes:
            weight = wish.area.astype(np.float64) * np.minimum(importance, 1)
            own = np.where(seen, weight, 0).ravel()
            if not (wish.is_exact and own.sum() > ON_EMITTERS * weight.sum()):
                continue
            pixels = np.flatnonzero(own)
            pixels = pixels[:: ceil(pixels.size / FLAME_PIXELS)]
            share = own[pixels] / own[pixels].sum()
            found = planes.pixels(pixels).astype(np.float64)
            rows.append(np.einsum("p,npc->cn", share, found)[None])
            light.append(share @ image.reshape(-1, 3)[pixels][None].astype(np.float64))
        return cls(np.concatenate(rows), np.concatenate(light))

    @classmethod
    def joined(cls, views: "Sequence[FlameWishes]") -> Self:
        """Return the wishes of several views behind each other."""
        return cls(*(np.concatenate([getattr(x, k) for x in views]) for k in ("rows", "light")))


class KeptResults:
    """Results for each row of a matrix, computed only for rows that the last matrix had not.

    From one reading of a painting to the next most wishes stay as they are, if not their numbers.
    """

    def __init__(self) -> None:
        self._last: tuple[Doubles, dict[float, int], npt.NDArray[Any]] | None = None

    def of(self, rows: Doubles, compute: Callable[[Doubles], npt.NDArray[Any]]) -> npt.NDArray[Any]:
        """Return the results for rows (k, p), (k, ...). compute: returns them for some rows."""
        # Moments tell which rows to compare; equal values decide.
        moments = np.einsum("kp,p->k", rows, np.arange(1, rows.shape[1] + 1)).tolist()
        before, numbers, known = self._last or (rows, {}, rows)
        places = [numbers.get(x, -1) for x in moments]
        is_new = np.array(
            [n < 0 or not np.array_equal(x, before[n]) for n, x in zip(places, rows, strict=True)],
            bool,
        )
        results = known[places] if not is_new.all() else compute(rows)
        if is_new.any() and not is_new.all():
            results[is_new] = compute(rows[is_new])
        self._last = rows, {x: k for k, x in enumerate(moments)}, results
        return results


@dataclass(frozen=True)
class Wash:
    """A painting, the look under it and the light of each lamp, averaged over blocks of pixels.

    rows: (3, n, p), Φ. painted, look: (3, p), linear. importance: (p,), the share of a block that
    is painted. counts: (p,), the number of its pixels that count. wishes: (k, p), the share of a
    block that each wish covers; exact: (p,), the cover of wishes whose colours were given as
    numbers; strokes: (p,), the cover of layers of strokes. places: (k, p), the number of the
    separate place of each wish to which a block belongs, and 0 for none. flames: the wishes for
    emitters in view. is_outlined: whether layers say where wishes end, and none was found in
    strokes. alike: (m, 2), see `alike_lights`. kept_sums: sums of `rows`, which readings of a
    painting that changes may share.
    """

    rows: Floats
    painted: Floats
    look: Floats
    importance: Doubles
    counts: Doubles
    wishes: Floats
    exact: Doubles
    strokes: Doubles
    places: Indices
    flames: FlameWishes
    is_outlined: bool = False
    alike: Indices = field(default_factory=lambda: np.zeros((0, 2), np.intp))
    kept_sums: KeptResults = field(default_factory=KeptResults, repr=False)

    @classmethod
    def of(cls, basis: Basis, target: Target) -> "Wash":
        """Average a view. target: at the size of the basis."""
        return PaintedBlocks.of(basis, target).wash

    @classmethod
    def joined(cls, views: Sequence["Wash"]) -> "Wash":
        """Return the washes of several views behind each other."""
        if len(views) == 1:
            return views[0]
        names = "rows", "painted", "look", "importance", "counts", "exact", "strokes"
        joined: dict[str, Any] = {
            k: np.concatenate([getattr(x, k) for x in views], axis=-1) for k in names
        }
        pixels = np.cumsum([0, *(x.counts.size for x in views)])
        wishes = np.zeros((sum(len(x.wishes) for x in views), pixels[-1]))
        places = np.zeros(wishes.shape, np.intp)
        first = 0
        for view, start in zip(views, pixels, strict=False):
            own = slice(first, first + len(view.wishes)), slice(start, start + view.counts.size)
            wishes[own], places[own] = view.wishes, view.places
            first += len(view.wishes)
        flames = FlameWishes.joined([x.flames for x in views])
        is_outlined = all(view.is_outlined for view in views)
        alike = np.array(
            sorted(set.intersection(*({(i, j) for i, j in x.alike.tolist()} for x in views))),
            np.intp,
        ).reshape(-1, 2)
        return cls(
            **joined,
            wishes=wishes,
            places=places,
            flames=flames,
            is_outlined=is_outlined,
            alike=alike,
        )

    def sample(self, count: int, count_of_wish: int) -> tuple[Indices, Doubles]:
        """Return about `count` painted blocks, (m,), and the number of painted pixels for which
        each stands, (m,).

        At least `count_of_wish` of them are of each wish, if it has so many.
        """
        amount = self.importance * self.counts
        owners = np.zeros(amount.size, np.intp)
        for k, area in enumerate(self.wishes):
            owners[area > 0.5] = k + 1
        owners[amount <= 0] = -1
        total = max(int((amount > 0).sum()), 1)
        blocks, weights = [], []
        for k in range(len(self.wishes) + 1):
            own = np.flatnonzero(owners == k)
            least = min(max(count * own.size // total, count_of_wish), own.size)
            chosen = own[:: max(1, own.size // max(least, 1))]
            blocks.append(chosen)
            sampled = amount[chosen].sum()
            weights.append(amount[chosen] * (amount[own].sum() / sampled if sampled > 0 else 0))
        return np.concatenate(blocks), np.concatenate(weights)

    def light_sums(self, weights: Doubles) -> Doubles:
        """Return sums of the lights over blocks with each of k weights, (3, n, k).

        weights: (k, p), or (3, k, p) with others for each channel.
        """
        weights = np.asarray(weights, np.float64)
        if weights.ndim == 3:
            return self._light_sums(weights)
        sums = self.kept_sums.of(weights, lambda x: self._light_sums(x).transpose(2, 0, 1))
        return np.asarray(sums.transpose(1, 2, 0))

    def light_in_picture(self) -> Doubles:
        """Return the sum of each light over all pixels that count, (n, 3)."""
        # Not kept: it would take the place of the sums of the wishes.
        return np.asarray(self._light_sums(self.counts[None])[..., 0].T)

    def _light_sums(self, weights: Doubles) -> Doubles:
        """Return the same as `light_sums`, without results that are kept."""
        columns = np.swapaxes(weights, -1, -2)
        # In double precision, so that the order of views and threads does not show.
        with one_thread():
            parts = [
                np.matmul(self.rows[:, first : first + CHUNK].astype(np.float64), columns)
                for first in range(0, self.rows.shape[1], CHUNK)
            ]
        return np.concatenate(parts, axis=1)

    def asked(self) -> Doubles:
        """Return the change that is asked for in each block, (3, p), in stops; 0 without paint."""
        weight = self.importance * self.counts
        dark = DARK * float(np.average(self.look.mean(axis=0), weights=self.counts + 1e-12))
        if not dark > 0:
            return np.zeros(self.look.shape)
        asked, now = (np.maximum(x, 0).astype(np.float64) + dark for x in (self.painted, self.look))
        return np.where(weight > 0, np.log2(asked / now), 0)


@dataclass(frozen=True)
class PaintedBlocks:
    """A view averaged over blocks of pixels, before its wishes are found.

    rows: (3, n, p), Φ. painted, look: (h, w, 3), linear. importance, counts: (h, w), as in `Wash`.
    read_look: (h, w, 3), the look with little noise, under which wishes are found. layers: the
    wishes of a painting with layers, with an area of a value for each block. flames: its wishes for
    emitters in view. alike: (m, 2), see `alike_lights`.
    """

    rows: Floats
    painted: Floats
    look: Floats
    read_look: Floats
    importance: Doubles
    counts: Doubles
    layers: Sequence[Wish]
    flames: FlameWishes
    alike: Indices

    @classmethod
    def of(cls, basis: Basis, target: Target) -> Self:
        """Average a view. target: at the size of the basis."""
        side = _block_side(basis.size)
        counted = _counted_pixels(basis)
        weight = np.minimum(target.importance, 1) * counted
        counts, painted_counts = block_sums(counted, side), block_sums(weight, side)
        look, clean = (
            _weighted_means(x, counted, side) for x in (basis.current_look, read_look(basis))
        )
        importance = painted_counts / np.where(counts > 0, counts, 1)
        # Where nothing is painted, nothing is asked for.
        image = extend_saturated(target, basis.current_look)
        painted = np.where(importance[..., None] > 0, _weighted_means(image, weight, side), look)
        pixels = block_sums(np.ones(basis.size), side)
        layers = [
            replace(wish, area=(block_sums(wish.area, side) / pixels).astype(np.float32))
            for wish in target.wishes
        ]
        layers = counted_wishes(layers, counts / pixels)
        seen = basis.emitters_seen
        flames = FlameWishes.of(basis.planes, seen, target.image, target.importance, target.wishes)
        rows = light_rows(basis.planes, counted, side)
        alike = alike_lights(rows)
        return cls(rows, painted, look, clean, importance, counts, layers, flames, alike)

    @property
    def wash(self) -> Wash:
        """The wash of the view, with its wishes."""
        return self.wash_in(self.read_look)

    def wash_in(self, look: Floats) -> Wash:
        """Return the wash of the view, with the wishes that it shows against a look, (h, w, 3)."""
        wishes = wish_shares(self.layers, self.painted, self.importance, look)
        return Wash(
            self.rows,
            self.painted.reshape(-1, 3).T,
            self.look.reshape(-1, 3).T,
            self.importance.ravel(),
            self.counts.ravel(),
            wishes,
            joint_cover([x for x in self.layers if x.is_exact], self.importance.shape),
            joint_cover([x for x in self.layers if x.has_strokes], self.importance.shape),
            wish_places(wishes, self.importance.shape),
            self.flames,
            are_outlined(self.layers),
            self.alike,
        )


@dataclass(frozen=True)
class NoisyBlocks:
    """The blocks of a view, and the half differences of their light and of the look.

    noise: (3, n, p). look_noise, read_noise: (h, w, 3), of the look and of the one that is read.
    sign_side: side of the squares of blocks that have noise of one sign: it was taken out of their
    mean in the look that is read, so that what is left of it adds up to little.
    """

    blocks: PaintedBlocks
    noise: Floats
    look_noise: Floats
    read_noise: Floats
    sign_side: int

    @classmethod
    def of(cls, basis: Basis, target: Target) -> Self:
        """Average a view whose noise is known. target: at the size of the basis."""
        side, counted = _block_side(basis.size), _counted_pixels(basis)
        look_noise, read_noise = (
            _weighted_means(x, counted, side) for x in (basis.current_noise, read_look_noise(basis))
        )
        return cls(
            PaintedBlocks.of(basis, target),
            light_rows(basis.noise, counted, side),
            look_noise,
            read_noise,
            ceil(read_look_side(basis) / side),
        )

    def disturbed(self, rng: np.random.Generator) -> tuple[Wash, Wash]:
        """Return the wash with more noise, in each square of blocks their half differences of
        either sign, and the same with all signs reversed.
        """
        height, width = self.blocks.importance.shape
        counts = -(-height // self.sign_side), -(-width // self.sign_side)
        signs = enlarged(rng.choice(np.array([-1, 1], np.float32), counts), self.sign_side)
        signs = signs[:height, :width]
        first, second = (
            replace(
                self.blocks,
                rows=self.blocks.rows + x.ravel() * self.noise,
                look=self.blocks.look + x[..., None] * self.look_noise,
                read_look=self.blocks.read_look + x[..., None] * self.read_noise,
            ).wash
            for x in (signs, -signs)
        )
        return first, second


def light_rows(planes: Planes, counted: Doubles, side: int) -> Floats:
    """Return planes averaged over blocks, (3, n, p). counted: (h, w), the weight of each pixel."""
    means = block_means(planes, counted, side).pixels(slice(None))
    return np.ascontiguousarray(means.transpose(2, 0, 1))


def alike_lights(rows: Floats) -> Indices:
    """Return the pairs of lights that shine alike, whatever their colours, (m, 2), in both orders.

    rows: (3, n, p), Φ averaged over blocks.
    """
    n, side = rows.shape[1], max(1, rows.shape[2] // ALIKE_BLOCKS)
    kept = rows[..., : rows.shape[2] // side * side].reshape(3, n, -1, side)
    light = np.tensordot(LUMINANCE.astype(np.float32), kept.mean(axis=-1), axes=1)
    length = np.linalg.norm(light, axis=1, keepdims=True)
    light /= np.where(length > 0, length, 1)
    pairs = [np.zeros((0, 2), np.intp)]
    with one_thread():
        for first in range(0, n, CHUNK):
            i, j = np.nonzero(light[first : first + CHUNK] @ light.T >= ALIKE)
            others = i + first != j
            pairs.append(np.stack([i[others] + first, j[others]], axis=1))
    return np.concatenate(pairs)


def _block_side(size: tuple[int, int]) -> int:
    return max(1, ceil(sqrt(size[0] * size[1] / BLOCKS)))


def _counted_pixels(basis: Basis) -> Doubles:
    """Return 1 for pixels without an emitter in view, (h, w)."""
    return (~basis.emitters_seen).astype(np.float64)


def _weighted_means(image: Floats, weight: Doubles, side: int) -> Doubles:
    """Return means of an image (h, w, 3) over blocks, 0 for those without weight, (h, w)."""
    total = block_sums(weight, side)
    sums = block_sums(image * weight[..., None], side)
    return np.asarray(sums / np.where(total > 0, total, 1)[..., None])


def joint_cover(wishes: Sequence[Wish], size: tuple[int, int]) -> Doubles:
    """Return the share of each block of pixels that some wishes cover together, (p,).

    wishes: see `wish_shares`. size: (h, w), in blocks.
    """
    areas = [wish.area for wish in wishes]
    return np.minimum(
        np.sum(areas, axis=0, dtype=np.float64, initial=0) + np.zeros(size), 1
    ).ravel()


def wish_shares(
    layers: Sequence[Wish], painted: Floats, importance: Doubles, look: Floats
) -> Doubles:
    """Return the share of each block of pixels that wishes cover, (k, p).

    layers: with an area of a value for each block, (h, w); none for a painting without layers.
    painted, look: (h, w, 3) linear; importance: (h, w).
    """
    whole = Wish("painting", importance.astype(np.float32), has_strokes=True)
    wishes = split_wishes(layers or [whole], painted, importance, look)
    return np.array([wish.area.ravel() for wish in wishes], np.float64)


def counted_wishes(wishes: Sequence[Wish], counted: Doubles) -> list[Wish]:
    """Return wishes whose areas are shares of the pixels of a block that count.

    counted: (h, w), the share of a block without emitters in view. An area that fits on the
    emitters lies there: a flame in a lantern is not a wish for the light on the lantern.
    """
    if counted.min(initial=1) == 1:
        return list(wishes)
    known = np.where(counted > 0, counted, 1)
    return [
        replace(wish, area=(np.maximum(wish.area - (1 - counted), 0) / known).astype(np.float32))
        for wish in wishes
    ]


def are_outlined(layers: Sequence[Wish]) -> bool:
    """Return whether layers say where wishes end, and none is found in strokes."""
    return bool(layers) and not any(wish.has_strokes for wish in layers)


def wish_places(shares: Doubles, size: tuple[int, int]) -> Indices:
    """Return the number of the separate place of each wish to which a block belongs, (k, p).

    shares: (k, p), see `wish_shares`. size: (h, w), in blocks.
    """
    places = [number_places(share.reshape(size)).ravel() for share in shares]
    return np.array(places, np.intp).reshape(shares.shape)


def adjusted_share(wash: Wash, stops: Doubles) -> Doubles:
    """Return the share of each block of pixels that was adjusted by a number, (p,).

    An adjustment layer or a curve changes the light by the same ratio everywhere; a brush, and a
    lamp, do not. So a large wish counts as numbers when most of it asks for the same. stops:
    (3, p), see `Wash.asked`.
    """
    share = np.zeros(stops.shape[1])
    look = wash.look.mean(axis=0)
    # The sum of the counts is 0 where an emitter is in view everywhere.
    is_lit = look > LIT * np.average(look, weights=wash.counts + 1e-12)
    weight = wash.counts * wash.importance * is_lit
    least = MIN_ADJUSTED * float(wash.counts @ is_lit)
    for area in wash.wishes:
        if area @ weight <= least:
            continue
        covered = np.flatnonzero(area * weight > 0.5 * wash.counts)
        if not covered.size:
            continue
        own = stops[:, covered[:: ceil(covered.size / ADJUSTED_BLOCKS)]]
        differs = np.abs(own - np.median(own, axis=1, keepdims=True)).max(axis=0)
        uniform = float((differs < UNIFORM_STOPS).mean())
        low, high = ADJUSTED
        share += area * wash.importance * np.clip((uniform - low) / (high - low), 0, 1)
    return np.minimum(share, 1)


@dataclass(frozen=True)
class ExpectedLights:
    """The emission that a painting lets one expect, and how clearly it asks for other colours.

    emission: (n, 3), in the current colours. clarity: (n,), from 0, where a light is expected to
    keep its colour, to 1, where the painting decides. painted: (n, 3), the emission with all of the
    mean change of colour that is painted where a light shines.
    """

    emission: Doubles
    clarity: Doubles
    painted: Doubles

    @classmethod
    def of(cls, wash: Wash, current: Doubles, is_free: Bools | None = None) -> "ExpectedLights":
        """Expect lights of a painting. current: (n, 3), their current emission. is_free: (n,),
        lights that may stand in for others; None for all.

        The change of light i in channel c is the mean change that is asked for, weighted by how
        much of the light in each pixel a unit of it makes: Σ D a Φᵢ / L / Σ Φᵢ / L, with the change
        a in stops and the look L; its level is the luminance of that. The colour that is asked for
        is the RMS of a's range over the channels, with the same weights; numbers count as meant. It
        counts as far as lights that shine alike do not bring it in their own colours.
        """
        dark = DARK * float(np.mean(wash.look)) or 1.0
        stops = wash.asked()
        share = wash.counts / (np.maximum(wash.look, 0) + dark)
        asked_share = wash.importance * share
        exact = np.maximum(wash.exact, adjusted_share(wash, stops))
        spread = np.ptp(stops, axis=0) * (1 + (EXACT_FACTOR - 1) * exact)
        weights = np.stack([share, asked_share * stops, asked_share * spread**2], axis=1)
        sums, moved, squares = wash.light_sums(weights).transpose(2, 1, 0)
        reached, squares = sums.sum(axis=1), squares.sum(axis=1)
        change = moved / np.where(sums > 0, sums, 1)
        amount = np.sqrt(np.maximum(squares / np.where(reached > 0, reached, 1), 0))
        pairs = wash.alike if is_free is None else wash.alike[is_free[wash.alike].all(axis=1)]
        needed, brings = np.ones((2, len(current)))
        if len(pairs):
            needed, brings = _needed_colors(wash.light_in_picture() * current, change, pairs)
        excess = (amount * needed / MEANT_STOPS) ** SHARPNESS
        clarity = np.asarray(brings * excess / (1 + excess), np.float64)
        emission, painted = (
            np.asarray(current * 2.0 ** np.clip(x, -MOST_STOPS, MOST_STOPS))
            for x in (luminance(change)[:, None], change)
        )
        return cls(emission, clarity, painted)

    @classmethod
    def unchanged(cls, current: Doubles) -> "ExpectedLights":
        """Expect lights to stay as they are. current: (n, 3)."""
        return cls(current, np.zeros(len(current)), current)


def _needed_colors(light: Doubles, change: Doubles, pairs: Indices) -> tuple[Doubles, Doubles]:
    """Return the share of the change of colour that each light's neighbours leave, (n,), and how
    far the light itself brings what is missing, (n,): 1 and 1 for lights without any.

    The light T that is asked for where some lights shine alike is the sum of their light times the
    change. The mix of their own colours nearest to it has min ‖T − Σⱼ gⱼ cⱼ‖. The range over the
    channels of what is left of log₂ T, of the range of the change, is needed of other colours, and
    of those lights alone whose own do not point away from what is missing.

    light: (n, 3), in the picture, of the current emission. change: (n, 3), in stops. pairs: (m, 2),
    see `alike_lights`.
    """
    needed, brings = np.ones((2, len(light)))
    lights, first, count = np.unique(pairs[:, 0], return_index=True, return_counts=True)
    # The members of each group, of which the first is the light itself; the last row is dark.
    members = np.full((len(lights), count.max() + 1), len(light))
    members[:, 0] = lights
    for k, (start, many) in enumerate(zip(first, count, strict=True)):
        members[k, 1 : 1 + many] = pairs[start : start + many, 1]
    colors = np.concatenate([light, np.zeros((1, 3))])[members]
    asked = colors.sum(axis=1) * 2.0 ** np.clip(change[lights], -MOST_STOPS, MOST_STOPS)
    mix = _nearest_mixes(colors, asked)
    least = np.finfo(np.float32).tiny
    left, spread = (
        np.ptp(x, axis=1) for x in (np.log2((mix + least) / (asked + least)), change[lights])
    )
    needed[lights] = np.minimum(left / np.where(spread > 0, spread, np.inf), 1)
    own, missing = colors[:, 0], asked - mix
    lengths = np.linalg.norm(own, axis=1) * np.linalg.norm(missing, axis=1)
    cosine = np.vecdot(own, missing) / np.where(lengths > 0, lengths, np.inf)
    brings[lights] = np.clip(1 - cosine / AGAINST, 0, 1)
    return needed, brings


def _nearest_mixes(colors: Doubles, asked: Doubles) -> Doubles:
    """Return the mixes Σⱼ gⱼ cⱼ of k groups with min ‖T − Σⱼ gⱼ cⱼ‖ and g >= 0, (k, 3).

    By the iteration that clips at zero inside every step (Schoeneman et al. 1993, Eq 6). colors:
    (k, m, 3). asked: (k, 3).
    """
    shares, left = np.zeros(colors.shape[:2]), asked.copy()
    squares = np.vecdot(colors, colors)
    squares[squares == 0] = np.inf
    for _ in range(MIX_STEPS):
        for j in range(colors.shape[1]):
            step = np.maximum(np.vecdot(colors[:, j], left) / squares[:, j], -shares[:, j])
            shares[:, j] += step
            left -= step[:, None] * colors[:, j]
    return asked - left
