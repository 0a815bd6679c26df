"""The noise of some pixels in the gradient of each light, and what is summed of it.

Of many lights most pixels are black, and these are not looked at: where neither a light nor its
half difference is, nothing is added.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, read_only
from lightpaint.basis import LitEntries
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95, Peaks, most_noise

#: Half differences by which the pixel beside may differ. Beyond, it shows something else: an edge,
#: or a highlight that both halves have met.
MAX_HALVES_APART = 1.5

#: Share of a pixel's own value in a factor where all of the noise power is in the equations.
UNCORRECTED = 0.5

#: Numbers of some lights for which the steps to their rows stay in the processor's cache.
CACHED_NUMBERS = 2**16

#: Fewest lights of which pixels are added before they are multiplied, and the number of pixels of
#: a sum. On 640x360 pixels, standard errors of weights are off by .5 % so, in the root mean square.
MANY_LIGHTS, FOLDED_PIXELS = 128, 8

#: Number of paths below which the least sum is the same share of the measured one.
MIN_PATHS = 0.1

#: Seed of the signs with which they are added.
FOLD_SEED = 5


def factor(values: Doubles, halves: Doubles, own_share: float) -> Doubles:
    """Return values, of which a share is a pixel's own, and the rest the value of the pixel beside.

    values, halves: (…, pixels), of pixels in the order of the picture, and their half differences.
    """
    if own_share == 1:
        return values
    return mixed_with_beside(values, values_beside(values), halves, own_share)


def mixed_with_beside(
    values: Doubles, beside: Doubles, halves: Doubles, own_share: float
) -> Doubles:
    """Return values mixed with the values of the pixels beside, where these are alike.

    All of the same shape. halves: half differences of the values.
    """
    if own_share == 1:
        return values
    apart = beside - values
    # Factors of 0 and 1 take a third of the time of `where`, whose branches nobody can foresee.
    apart *= np.abs(apart) <= MAX_HALVES_APART * np.abs(halves)
    apart *= 1 - own_share
    apart += values
    return np.asarray(apart)


def values_beside(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return for each pixel the value of the other one of its pair, (…, pixels).

    The last of an odd number takes the pixel before it, and a single one itself.
    """
    beside, count = np.empty_like(values), values.shape[-1]
    even = count // 2 * 2
    beside[..., :even:2], beside[..., 1:even:2] = values[..., 1:even:2], values[..., :even:2]
    if count % 2:
        beside[..., -1] = values[..., max(count - 2, 0)]
    return beside


def folded(rows: Doubles) -> Doubles:
    """Return rows, (n, p), of fewer pixels, (n, k), with about the same products of all pairs.

    Each of the k is the sum of some pixels with random signs: so products of two pixels cancel, and
    the expectation of R Rᵀ stays the same (Charikar, Chen and Farach-Colton 2002). That is enough
    for the variance of a weight, vᵀ R Rᵀ v, which is a sum of squares, but not for an inverse. Few
    lights keep all of their pixels.
    """
    n, pixels = rows.shape
    count = pixels // FOLDED_PIXELS
    if n < MANY_LIGHTS or count == 0:
        return rows
    some = FOLDED_PIXELS * count
    parts = rows[:, :some].reshape(n, FOLDED_PIXELS, count)
    sums = np.einsum("nfk,fk->nk", parts, _signs(count).astype(rows.dtype))
    return sums if some == pixels else np.concatenate([sums, rows[:, some:]], axis=1)


@cache
def _signs(count: int) -> npt.NDArray[np.int8]:
    """Return random signs, (FOLDED_PIXELS, count), the same on every machine."""
    signs = np.random.default_rng(FOLD_SEED).integers(0, 2, (FOLDED_PIXELS, count), np.int8)
    return read_only(2 * signs - 1)


@dataclass(frozen=True)
class NoiseSums:
    """Sums over some pixels, as in `Noise`.

    light, light_squares, power_squares: (3, n), Σ D Φ, Σ (D Φ)² and Σ (D h²)². fourth: (3, n),
    fourth powers of the half differences of the gradient. peaks: the pixels that decide, of each
    channel.
    """

    power: Doubles
    target_noise: Doubles
    doubt: Doubles
    gradient: Doubles
    light: Doubles
    light_squares: Doubles
    power_squares: Doubles
    fourth: Doubles
    peaks: tuple[Peaks, ...]

    @classmethod
    def zeros(cls, n: int) -> "NoiseSums":
        """Return sums over no pixels."""
        peaks = tuple(Peaks.empty(n) for _ in range(3))
        power, gradient = np.zeros((3, n, n)), np.zeros((3, n, 3, n))
        target_noise, doubt, light, light_squares, power_squares, fourth = np.zeros((6, 3, n))
        own = light, light_squares, power_squares, fourth
        return cls(power, target_noise, doubt, gradient, *own, peaks)

    def add(self, part: "NoiseSums") -> None:
        """Add the sums over other pixels."""
        for field in fields(self)[:-1]:
            total = getattr(self, field.name)
            total += getattr(part, field.name)
        for peaks, more in zip(self.peaks, part.peaks, strict=True):
            peaks.merge(more)

    @property
    def power_error(self) -> Doubles:
        """(3, n), standard errors of Σ D h²."""
        return np.asarray(np.sqrt(self.power_squares))

    def least_power(self, total: Doubles) -> Doubles:
        """Return the least ‖Φ‖² that each light may have without noise, by its light alone, (3, n).

        That is ‖Φ‖² ≥ (Σ D Φ)² / Σ D. total: (3,), Σ D.
        """
        is_lit = self.light_squares > 0
        squares = np.where(is_lit, self.light_squares, 1)
        least = self.light * _poisson_lower_limit(np.square(self.light) / squares)
        room = np.maximum(total, np.finfo(float).tiny)[:, None]
        return np.where(is_lit, np.square(least), 0) / room


def _poisson_lower_limit(paths: Doubles) -> Doubles:
    """Return the least ratios of the true to a measured sum of a number of paths.

    It is Wilson and Hilferty's Poisson limit.
    """
    some = np.maximum(paths, MIN_PATHS)
    limit = 1 - 1 / (9 * some) - NORMAL_95 / (3 * np.sqrt(some))
    return np.asarray(np.maximum(limit, 0.1) ** 3)


@dataclass(frozen=True)
class ChannelPixels:
    """Pixels of a channel, some or all, as all lights share them.

    c: the channel. D: their weight. mean, half: factors of the half differences and of the light of
    each light in its gradient. missing: |residual|. unseen: where no emitter is. All (p,). weights,
    pulled: (n,), of the lights; is_radiance: (n,), whether weights are radiances; has_pull: whether
    any light is pulled, in any channel. samples: per pixel. own_share: of a pixel in a factor.
    of_noise, of_light, doubt: (p,), by which half differences and light add to `target_noise` and
    `doubt`; None if they do not.
    """

    c: int
    D: Doubles
    half: Doubles
    mean: Doubles
    missing: Doubles
    unseen: Bools
    weights: Doubles
    pulled: Doubles
    is_radiance: Bools
    has_pull: bool
    samples: float
    own_share: float
    of_noise: Doubles | None
    of_light: Doubles | None
    doubt: Doubles

    @property
    def own_share_of_pull(self) -> float:
        """Share of a pixel in a factor of the pull, which the noise correction leaves as it is."""
        return max(self.own_share, UNCORRECTED)

    def most_noise(self, lights: Indices, light: Doubles) -> Doubles:
        """Return the largest relative variance of the light, (m,), of some lights."""
        return most_noise(light, self.is_radiance[lights], self.samples)


#: A function from pixels of a channel, sums to which to add (None for none), and an array (n, p) to
#: write to, to the noise in the gradient, (n, p).
RowsOf = Callable[[ChannelPixels, NoiseSums | None, Doubles], Doubles]


def dense_rows(
    pixels: ChannelPixels, noise: Floats, light: Floats, sums: NoiseSums | None, room: Doubles
) -> Doubles:
    """Return the noise in the gradient, (n, p); add all else to `sums`.

    noise, light: (n, p), half differences and light. room: (n, p), written to.
    """
    c, kind, own = pixels.c, pixels.D.dtype, pixels.own_share
    h, lit = (x.astype(kind, copy=False) for x in (noise, light))
    step = max(1, CACHED_NUMBERS // max(h.shape[1], 1))
    if sums is not None:
        np.multiply(np.sqrt(pixels.D), h, out=room)
        sums.power[c] += room @ room.T
    for first in range(0, len(h), step):
        some = slice(first, first + step)
        half, own_light, row = h[some], lit[some], room[some]
        if sums is not None:
            sums.power_squares[c, some] += _fourth_powers(row)
        row[...] = half * pixels.mean + factor(own_light, half, own) * pixels.half
        if sums is not None:
            weighed = pixels.D * own_light
            sums.light[c, some] += own_light @ pixels.D
            sums.light_squares[c, some] += np.vecdot(weighed, weighed)
            size = pixels.missing + pixels.weights[some, None] * own_light
            shown = pixels.D * half * size
            sums.peaks[c].add(
                weighed * size,
                row,
                shown,
                lambda of, at: pixels.most_noise(of, lit[of, at]),
                first=first,
            )
        if pixels.has_pull:
            power = factor(own_light, half, pixels.own_share_of_pull) * half
            row += pixels.pulled[some, None] * np.where(pixels.unseen, power, 0)
    if sums is None:
        return room
    if pixels.of_noise is not None:
        sums.target_noise[c] += h @ pixels.of_noise
    if pixels.of_light is not None:
        sums.target_noise[c] += lit @ pixels.of_light
        sums.doubt[c] += lit @ pixels.doubt
    sums.fourth[c] += _fourth_powers(room)
    return room


def _fourth_powers(rows: Doubles) -> Doubles:
    """Return the sum of fourth powers of each row, (n,).

    Of light in physical units they may be beyond the range of float32: squares are divided by the
    largest of their row before.
    """
    squares = np.square(rows)
    largest = squares.max(axis=1, initial=0)
    largest[largest == 0] = 1
    squares /= largest[:, None]
    return np.asarray(np.vecdot(squares, squares) * np.square(largest, dtype=np.float64))


@dataclass(frozen=True)
class LitPairs:
    """The pixels in which lights or their half differences are not black.

    lights, columns, places: (m,), of each, as in `LitEntries`. noise, light: (3, m). shape: (n, p).
    """

    lights: Indices
    columns: Indices
    places: Indices
    noise: Floats
    light: Floats
    shape: tuple[int, int]

    @classmethod
    def of(cls, noise: LitEntries, light: LitEntries) -> "LitPairs":
        """Return the lit pixels of half differences and light, of the same pixels."""
        shape = light.shape
        if np.array_equal(noise.lights, light.lights) and np.array_equal(
            noise.columns, light.columns
        ):
            values = noise.values, light.values
            return cls(light.lights, light.columns, light.places, *values, shape)
        is_lit = np.zeros(shape[0] * shape[1], np.bool_)
        is_lit[light.places] = True
        only_noise = np.flatnonzero(~is_lit[noise.places])
        lights, columns = (
            np.concatenate([getattr(light, name), getattr(noise, name)[only_noise]])
            for name in ("lights", "columns")
        )
        places = lights * shape[1] + columns
        halves, values = np.empty((2, 3, places.size), np.float32)
        values[:, : light.places.size], values[:, light.places.size :] = light.values, 0
        room = np.zeros(is_lit.size, np.float32)
        for into, channel in zip(halves, noise.values, strict=True):
            room[noise.places] = channel
            into[...] = room[places]
        return cls(lights, columns, places, halves, values, shape)

    @cached_property
    def places_beside(self) -> Indices:
        """The place of the other pixel of each one's pair, (m,)."""
        columns = np.arange(self.shape[1])
        return self.places + (values_beside(columns) - columns)[self.columns]

    def rows(self, pixels: ChannelPixels, sums: NoiseSums | None, room: Doubles) -> Doubles:
        """Return the noise in the gradient, (n, p); add all else to `sums`.

        room: (n, p), written to.
        """
        c, at, of = pixels.c, self.columns, self.lights
        h, light = (x[c].astype(room.dtype, copy=False) for x in (self.noise, self.light))
        room[...] = 0
        flat = room.reshape(-1)
        flat[self.places] = light
        if sums is not None and pixels.of_light is not None:
            sums.target_noise[c] += room @ pixels.of_light
            sums.doubt[c] += room @ pixels.doubt
        beside = flat[self.places_beside]
        mixed = mixed_with_beside(light, beside, h, pixels.own_share)
        row = h * pixels.mean[at] + mixed * pixels.half[at]
        if sums is not None:
            weighed = pixels.D[at] * light
            sums.light[c] += self._of_lights(weighed)
            sums.light_squares[c] += self._of_lights(np.square(weighed))
            size = pixels.missing[at] + pixels.weights[of] * light
            shown = pixels.D[at] * h * size
            sums.peaks[c].add_entries(
                of,
                weighed * size,
                row,
                shown,
                lambda of, large: pixels.most_noise(of, light[large]),
                self._of_lights,
            )
        if pixels.has_pull:
            power = mixed_with_beside(light, beside, h, pixels.own_share_of_pull) * h
            row += pixels.pulled[of] * pixels.unseen[at] * power
        if sums is not None:
            if pixels.of_noise is not None:
                flat[self.places] = h
                sums.target_noise[c] += room @ pixels.of_noise
            rooted = np.sqrt(pixels.D)[at] * h
            flat[self.places] = rooted
            sums.power[c] += room @ room.T
            for total, values in ((sums.power_squares, rooted), (sums.fourth, row)):
                total[c] += self._of_lights(np.square(np.square(values), dtype=np.float64))
        flat[self.places] = row
        return room

    @cached_property
    def _runs(self) -> Indices:
        """Return where the pixels of another light begin, which follow each other by strips."""
        return np.flatnonzero(np.diff(self.lights, prepend=-1))

    def _of_lights(self, values: npt.NDArray[Any]) -> Doubles:
        """Return the sum of values, (m,), of each light, (n,)."""
        if not values.size:
            return np.zeros(self.shape[0])
        of_runs = np.add.reduceat(values, self._runs, dtype=np.float64)
        return np.asarray(np.bincount(self.lights[self._runs], of_runs, self.shape[0]), np.float64)
