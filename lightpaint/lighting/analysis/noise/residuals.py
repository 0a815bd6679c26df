"""The residual of an answer, the noise of its prediction, the grain of its painting, and the
gradient of a loss by the light of each pixel, without the bias that noise gives it.

The gradient by the weights is Σ Φᵢ G(x), with half the negative gradient G of the loss by the light
x of a pixel. For squares G = D (Ψ − x) is straight, and errors of x cancel in the mean. Where the
loss compares what a display shows, G is bent: slope, residual and clipping follow from the same
noisy x, and a pixel that is too dark by chance weighs more than one that is too bright. The tangent
of G at a steadier light x̃, which the neighbours give, is straight in x again:

    G(x̃) + G′(x̃) (x − x̃)

Where x̃ is not the true light, the tangent is wrong to second order only (docs/method.md). A
painting shows the edges and textures of its scene without noise, so light is steadied relative to
it: their ratio changes far less from pixel to pixel than light does.

A render that serves as a painting has noise, which no lights make and no brush paints. A second
difference along both axes,

    a = N r,  N = [1 −2 1]ᵀ [1 −2 1],

ignores smooth parts, and straight edges along an axis. Noise that is independent between pixels
gives it the variance 36 σ² and no correlation at a distance: E[a(x) a(x + d)] = 0. An edge or a
stroke continues there, so these products are subtracted.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.images import bands_of, block_sums, box_mean, enlarged, film_filtered
from lightpaint.lighting.loss.pixel_loss import PixelLoss, planes_of
from lightpaint.lighting.solution import Solution

_Kind = TypeVar("_Kind", bound=np.generic)

#: Σ N², the variance of a for noise of variance 1.
POWER = 36.0

#: Pixels along the sides of blocks, and blocks on either side, over which products are averaged.
BLOCK, BLOCKS_AROUND = 8, 2

#: Rows of a band that is worked on at a time, whole blocks.
BAND_ROWS = 8 * BLOCK

#: Largest ⟨a²⟩ / ⟨|a|⟩² of noise: π/2 if it is normal, more with fireflies. A painted lamp of a few
#: pixels, alone on dark ground, is far beyond.
MAX_PEAK = 12.0

#: Largest ratio of noise from taps two pixels apart to noise from neighbours, in the whole picture
#: and in a block. Mitsuba's Gaussian filter correlates neighbours: 2.3 to 3.7 times, and 5 in
#: blocks. Paint has wider edges: 4.3 times and more.
MAX_RATIO, MAX_BLOCK_RATIO = 4.0, 6.0

#: Pixels on either side whose mean steadies the light of a pixel, and over which its noise and the
#: change of light are compared.
BESIDE, WINDOW = 1, 3

#: Rows beside a pixel on which its steadier light depends.
MARGIN = BESIDE + WINDOW

#: Step of the differences that stand for derivatives, relative to the light of a pixel.
STEP = 1e-2

#: Light of a painting below which a ratio to it says little, relative to its mean.
DARK = 0.01

#: Least change of a ratio from pixel to pixel, relative to what its noise makes, with which the
#: painting does not have the noise of the light itself, as a noisy look that was painted over has.
MIN_INDEPENDENT = 0.5


@dataclass(frozen=True)
class Residuals:
    """The residual of an answer, and the noise of its prediction, for any pixels.

    The noise is Σ w_i h_i minus the part that Ψ shares where it equals the current look, or where
    the filter of a prediction was taken out of it.

    image: (p, 3), Ψ. predicted: (p, 3), Σ w_i Φ_i. half: (p, 3), Σ w_i h_i. current: (p, 3), noise
    of the current look; None where nothing follows it. share: (p, 1) or (p, 3), as far as it does;
    None where `half` has that already. unfiltered: (p, 3), half differences that Ψ has without its
    filter; None of paintings as they are.
    """

    image: Floats
    predicted: Floats
    half: Floats
    current: Floats | None
    share: Floats | None
    unfiltered: Doubles | None = None

    @classmethod
    def of(cls, solution: Solution) -> "Residuals":
        """Return the residuals of a solution."""
        basis, weights, problem = solution.basis, solution.weights, solution.problem
        predicted, r, share = basis.predict(weights), problem.refinement, problem.squares.share
        half, current = predicted.half_difference, None
        if share.any():
            current = basis.current_noise.reshape(-1, 3)
        if r is not None:
            half = r.noise + basis.noise.mix(weights - r.before)
        image, mixed, half = (x.reshape(-1, 3) for x in (solution.image, predicted.image, half))
        is_shared = current is not None and r is None
        shared, unfiltered = share.reshape(-1, share.shape[2]) if is_shared else None, None
        if problem.filter_share and r is None:
            unfiltered = -problem.filter_share * added_by_filter(solution, half)
        return cls(image, mixed, half, current, shared, unfiltered)

    def residual(self, pixels: slice | Indices) -> Doubles:
        """Return Ψ − Σ w_i Φ_i of some pixels, (p, 3)."""
        return self.image[pixels].astype(np.float64) - self.predicted[pixels]

    def noise(self, pixels: slice | Indices) -> Doubles:
        """Return the half difference of the prediction less Ψ at some pixels, (p, 3)."""
        half = self.half[pixels].astype(np.float64)
        if self.unfiltered is not None:
            half -= self.unfiltered[pixels]
        if self.current is None or self.share is None:
            return half
        return half - self.share[pixels] * self.current[pixels]


def channel_grain(residual: Floats, counted: Bools) -> Doubles:
    """Return the variance of a residual's noise in one channel, (h, w) float64; 0 without noise.

    residual: (h, w). counted: (h, w), the pixels that count.
    """
    at_one, at_two = (_tap_variance(residual, counted, step) for step in (1, 2))
    if at_two[counted].sum() > MAX_RATIO * at_one[counted].sum():
        return at_one
    return np.where(at_two <= MAX_BLOCK_RATIO * at_one, at_two, at_one)


def _tap_variance(residual: Floats, counted: Bools, step: int) -> Doubles:
    """Return the variance that N measures with taps `step` pixels apart, (h, w)."""
    if min(counted.shape) <= 2 * step:
        return np.zeros(counted.shape)
    height, width = (side - 2 * step for side in counted.shape)
    bands = range(0, height, BAND_ROWS)
    of_bands = [_tap_sums(residual, counted, step, slice(k, k + BAND_ROWS)) for k in bands]
    whole, products, sizes = (
        np.asarray(box_mean(np.concatenate(x), BLOCKS_AROUND), np.float64)
        for x in zip(*of_bands, strict=True)
    )
    share = np.maximum(whole, 1e-12)
    power, size = products / share, sizes / share
    variance = np.clip(power, 0, MAX_PEAK * np.square(size)) / POWER
    variance = enlarged(variance, BLOCK)[:height, :width]
    # The border gets the values beside it.
    return np.pad(variance, step, mode="edge")


def _tap_sums(
    residual: Floats, counted: Bools, step: int, rows: slice
) -> tuple[Doubles, Doubles, Doubles]:
    """Return sums over blocks of a band of a, (h', w') each: of where all taps count, of a² less
    the products at a distance, and of |a|.

    rows: of a, whose products reach beyond the band. A band fits into a processor's cache.
    """
    reach, height = 3 * step, len(counted) - 2 * step
    first, end = max(rows.start - reach, 0), min(rows.stop + reach, height)
    taps = slice(first, end + 2 * step)
    a, whole = second_difference(residual[taps], counted[taps], step)
    products = np.square(a)
    for window, shifted in distant_windows(reach):
        pairs = a[window] * a[shifted]
        pairs /= 2
        products[window] -= pairs
        products[shifted] -= pairs
    own = slice(rows.start - first, min(rows.stop, height) - first)
    return (
        block_sums(whole[own], BLOCK),
        block_sums(products[own], BLOCK),
        block_sums(np.abs(a[own]), BLOCK),
    )


def second_difference(residual: Floats, counted: Bools, step: int) -> tuple[Doubles, Bools]:
    """Return a = N r with taps `step` pixels apart, 0 where one does not count, and where all do.

    residual, counted: (h, w), of more than 2 `step` pixels along each side. Both results are
    without `step` pixels at each border.
    """
    a, whole = residual.astype(np.float64), counted
    for axis in (0, 1):
        first, middle, last = _taps(a, step, axis)
        a = first - 2 * middle
        a += last
        whole = np.logical_and.reduce(_taps(whole, step, axis))
    a *= whole
    return a, whole


def _taps(image: npt.NDArray[_Kind], step: int, axis: int) -> list[npt.NDArray[_Kind]]:
    """Return `image` three times, `step` pixels apart along an axis."""
    lines = np.moveaxis(image, axis, 0)
    length = len(lines) - 2 * step
    return [np.moveaxis(lines[k * step :][:length], 0, axis) for k in range(3)]


def distant_windows(distance: int) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Yield windows at this distance from each other: across, down and along both diagonals."""
    first, last, whole = slice(None, -distance), slice(distance, None), slice(None)
    yield (whole, first), (whole, last)
    yield (first, whole), (last, whole)
    yield (first, first), (last, last)
    yield (first, last), (last, first)


@dataclass(frozen=True)
class PixelGradients:
    """G, half the negative gradient of the loss by the light of each pixel, at an answer.

    mean: (p, 3), the tangent of G. half: (p, 3), half its difference between the two halves of the
    samples. bend: (p, 3), by how much G itself exceeds the tangent; None for squares, where G is
    its own tangent. doubt: (p, 3), by how much G may be too large in the mean by the noise that is
    left in the steadier light; None for squares.
    """

    mean: Doubles
    half: Doubles
    bend: Doubles | None = None
    doubt: Doubles | None = None

    @classmethod
    def of(cls, solution: Solution, residuals: Residuals) -> "PixelGradients":
        """Return the gradients at the weights of a solution."""
        problem, everything = solution.problem, slice(None)
        if problem.is_linear or problem.refinement is not None:
            weight = problem.squares.weight
            D = weight.reshape(-1, weight.shape[2]).astype(np.float64)
            return cls(D * residuals.residual(everything), -D * residuals.noise(everything))
        everywhere, counted = problem.loss.pixels, (solution.importance > 0).reshape(-1, 1)
        light, look = (residuals.predicted, residuals.half), None
        if residuals.current is not None:
            look = solution.basis.current_look.reshape(-1, 3), residuals.current
        results = np.zeros((4, 3, len(everywhere)))
        for bands in _bands_of_views(solution):
            dark = _dark_light(
                (everywhere.subset(band.own).guide, counted[band.own]) for band in bands
            )
            for band in bands:
                is_whole = band.own == slice(0, len(everywhere))  # lit strips end with padding
                pixels = everywhere if is_whole else everywhere.subset(band.own)
                guide = everywhere.subset(band.around).guide
                own_light = band.steadied(*light, counted, guide, dark)
                own_look = None if look is None else band.steadied(*look, counted)
                _fill_gradients(results[..., band.own], pixels, own_light, own_look)
        mean, half, bend, doubt = (x.T for x in results)
        if residuals.unfiltered is not None:
            weight = problem.squares.weight
            half += weight.reshape(-1, weight.shape[2]) * residuals.unfiltered
        return cls(mean, half, bend, doubt)


def _fill_gradients(
    results: Doubles, pixels: PixelLoss, light: "_Steadied", look: "_Steadied | None"
) -> None:
    """Fill in mean, half, bend and doubt of some pixels, (4, 3, p)."""
    mean, half, bend, doubt = results

    def fill(strip: slice, part: PixelLoss) -> None:
        own = light.part(strip).within_clipping(part)
        tangent = _Tangent(part, own, None if look is None else look.part(strip))
        whole = _gradient(part, light.picture[:, strip])
        start, left = tangent.start(), [x.noise_left for x in tangent.pictures]
        mean[:, strip] = start + tangent.along([x.distance for x in tangent.pictures])
        half[:, strip] = tangent.along([x.noise for x in tangent.pictures])
        bend[:, strip] = whole - mean[:, strip]
        ends = [tangent.at([sign * x for x in left]) for sign in (1, -1)]
        doubt[:, strip] = (ends[0] + ends[1]) / 2 - start

    pixels.map_strips(fill)


@dataclass(frozen=True)
class _RowBand:
    """Rows of a view, as pixels of the long picture of all views.

    own: their pixels. around: these, and the rows beside them that their steadier light depends on.
    rows: the own ones of these rows. width: pixels in a row.
    """

    own: slice
    around: slice
    rows: slice
    width: int

    def steadied(
        self,
        light: Floats,
        noise: Floats,
        counted: Bools,
        guide: Floats | None = None,
        dark: float = 0.0,
    ) -> "_Steadied":
        """Steady the rows of a picture. light: (p, 3); noise: (p, 3), its half differences;
        counted: (p, 1); all of the long picture. guide: (3, around), as in `PixelLoss`.
        """
        pictures = [x[self.around] for x in (light, noise, counted)]
        if guide is not None:
            pictures.append(guide.T)
        images = (x.reshape(-1, self.width, x.shape[1]).astype(np.float64) for x in pictures)
        steady, share = (planes_of(x[self.rows]) for x in steadier_light(*images, dark=dark))
        picture, own = planes_of(light[self.own]), planes_of(noise[self.own])
        return _Steadied(picture, steady, own, np.sqrt(1 - np.square(share)) * own)


def _bands_of_views(solution: Solution) -> Iterator[list[_RowBand]]:
    """Yield the bands of each view."""
    views, first = solution.problem.views, 0
    sizes = [basis.size for basis in views.bases]
    for height, width in sizes if len(sizes) > 1 else [solution.importance.shape]:
        bands = []
        for rows in bands_of((height, width)):
            top, bottom = max(rows.start - MARGIN, 0), min(rows.stop + MARGIN, height)
            own, around = (
                slice(first + width * a, first + width * b)
                for a, b in ((rows.start, rows.stop), (top, bottom))
            )
            bands.append(_RowBand(own, around, slice(rows.start - top, rows.stop - top), width))
        yield bands
        first += height * width


def _dark_light(guides: Iterable[tuple[Floats | None, Bools]]) -> float:
    """Return the light of a guide below which a ratio to it says little.

    guides: of bands of a view, (3, p), and which of their pixels count, (p, 1).
    """
    light = count = 0.0
    for guide, counted in guides:
        if guide is None:
            return 0.0
        guided = counted[:, 0] & (guide > 0).any(axis=0)
        light += float(np.sum(np.maximum(guide, 0) * guided, dtype=np.float64))
        count += 3 * int(guided.sum())
    return DARK * light / max(count, 1)


@dataclass(frozen=True)
class _Steadied:
    """A picture and its steadier light, (3, p) each.

    picture: its light. steady: the steadier light. noise: half differences of the picture.
    noise_left: the half differences of the light between both that the steadier light does not
    average.
    """

    picture: Doubles
    steady: Doubles
    noise: Doubles
    noise_left: Doubles

    @property
    def distance(self) -> Doubles:
        """The difference of the picture from the steadier light, (3, p)."""
        return self.picture - self.steady

    def part(self, strip: slice) -> "_Steadied":
        """Return the same of some pixels."""
        everything = (self.picture, self.steady, self.noise, self.noise_left)
        return _Steadied(*(x[:, strip] for x in everything))

    def within_clipping(self, pixels: PixelLoss) -> "_Steadied":
        """Return the same with pixels left as they are that would enter or leave clipping: no
        tangent leads across its edge.
        """
        light = self.steady + self.distance
        step = 2 * STEP * np.abs(self.steady).max(axis=0)
        was_flat, *are_flat = (
            pixels.squares(x, from_clipping=False)[1] == 0
            for x in (light, self.steady - step, self.steady + step)
        )
        stays = np.logical_or.reduce([x != was_flat for x in are_flat])
        return _Steadied(
            light,
            np.where(stays, light, self.steady),
            self.noise,
            np.where(stays, self.noise, self.noise_left),
        )


@dataclass(frozen=True)
class _Tangent:
    """The tangent of G at the steadier light, and at a steadier look if the loss depends on one."""

    pixels: PixelLoss
    light: _Steadied
    look: _Steadied | None

    @property
    def pictures(self) -> list[_Steadied]:
        """The light and, if there is one, the look."""
        return [self.light] if self.look is None else [self.light, self.look]

    def start(self) -> Doubles:
        """Return G where the tangent touches it, (3, p)."""
        return self.at([np.zeros(1) for _ in self.pictures])

    def along(self, changes: list[Doubles]) -> Doubles:
        """Return the change of the tangent, (3, p), with the changes of the pictures, (3, p)
        each."""
        size = np.max([np.abs(x).max(axis=0) for x in changes], axis=0)
        step = STEP * np.abs(self.light.steady).max(axis=0) / np.where(size > 0, size, 1)
        above, below = (self.at([sign * step * x for x in changes]) for sign in (1, -1))
        return np.asarray((above - below) / np.where(step > 0, 2 * step, 1))

    def at(self, changes: list[Doubles]) -> Doubles:
        """Return G, (3, p), where the pictures change by that much."""
        places = [x.steady + change for x, change in zip(self.pictures, changes, strict=True)]
        pixels = self.pixels if self.look is None else self.pixels.over_look(places[1])
        return _gradient(pixels, places[0])


def _gradient(pixels: PixelLoss, light: Doubles) -> Doubles:
    """Return G of light, (3, p) each."""
    image, weight = pixels.squares(light, from_clipping=False)
    image -= light
    image *= weight
    return image


def steadier_light(
    light: Doubles,
    noise: Doubles,
    counted: Doubles,
    guide: Doubles | None = None,
    *,
    dark: float = 0.0,
) -> tuple[Doubles, Doubles]:
    """Return light moved towards the mean of its neighbours as far as only noise differs there,
    and the share of the way that it moves, (h, w, 3) each.

    The share is V / (V + B) with the variance V and the squared change B around the pixel, without
    the pixel itself: how far it moves does not depend on its own noise. Relative to a guide, B is
    the change of the ratio; of both ways, the one with the larger share counts.

    light, noise: (h, w, 3), an image and its half differences. counted: (h, w, 1), 1 for pixels
    that count as neighbours, else 0. guide: (h, w, 3), a picture without noise of what the light
    shows; 0 where it is unknown. dark: light of the guide below which a ratio to it says little.
    """
    steady, share = np.empty_like(light), np.empty_like(light)
    around = _Neighbours.of(counted[..., 0])
    for c in range(3):  # a channel is contiguous, which takes half of the time
        steady[..., c], share[..., c], _ = _steadied(light[..., c], noise[..., c], around)
    if guide is None:
        return steady, share
    guided = counted * (guide > 0).any(axis=-1, keepdims=True)
    shown = np.maximum(guide, 0)
    around, is_guided = _Neighbours.of(guided[..., 0]), guided[..., 0] > 0
    for c in range(3):
        unit = np.where(is_guided, shown[..., c] + dark, 1)
        ratio, of_ratio, change = _steadied(light[..., c] / unit, noise[..., c] / unit, around)
        is_better = is_guided & (of_ratio > share[..., c]) & (change >= MIN_INDEPENDENT)
        steady[is_better, c] = (ratio * unit)[is_better]
        share[is_better, c] = of_ratio[is_better]
    return steady, share


@dataclass(frozen=True)
class _Neighbours:
    """Means over the pixels around each one that count, or the pixel itself where none does, of
    one channel, (h, w).

    beside: over the pixels within `BESIDE`; around: within `WINDOW`.
    """

    beside: Callable[[Doubles], Doubles]
    around: Callable[[Doubles], Doubles]

    @classmethod
    def of(cls, counted: Doubles) -> "_Neighbours":
        """counted: (h, w), 1 for pixels that count, else 0."""
        return cls(*(_mean_beside(counted, radius) for radius in (BESIDE, WINDOW)))


def _steadied(
    light: Doubles, noise: Doubles, neighbours: _Neighbours
) -> tuple[Doubles, Doubles, Doubles]:
    """Return the light and share of `steadier_light` without a guide, and the squared change from
    pixel to pixel relative to what noise makes of it, of one channel, (h, w) each.
    """
    beside, noise_beside = map(neighbours.beside, (light, noise))
    variance, variance_beside = np.square(noise), np.square(noise_beside)
    squares = variance, variance + variance_beside, np.square(light - beside)
    V, W, changed = map(neighbours.around, squares)
    total = V + np.maximum(changed - W, 0)
    share = np.divide(V, total, out=np.zeros_like(V), where=V > 0)
    change = np.divide(changed, W, out=np.ones_like(V), where=W > 0)
    return light + share * (beside - light), share, change


def _mean_beside(counted: Doubles, radius: int) -> Callable[[Doubles], Doubles]:
    """Return the function for the means of `_Neighbours` within a radius. counted: (h, w)."""
    counts = _sum_beside(counted, radius)
    is_alone, counts = counts == 0, np.maximum(counts, 1)

    def mean(image: Doubles) -> Doubles:
        means = _sum_beside(image * counted, radius)
        means /= counts
        means[is_alone] = image[is_alone]
        return means

    return mean


def _sum_beside(image: Doubles, radius: int) -> Doubles:
    """Return the sum of the pixels around each one, (h, w), without itself."""
    height, width = image.shape
    wide = np.pad(image, radius)
    rows = wide[:height].copy()
    for k in range(1, 2 * radius + 1):
        rows += wide[k : k + height]
    sums = rows[:, :width] - image
    for k in range(1, 2 * radius + 1):
        sums += rows[:, k : k + width]
    return sums


def added_by_filter(solution: Solution, image: Floats) -> Doubles:
    """Return what the filter of Mitsuba's films adds to a picture of all views, (p, 3)."""
    views, size = solution.problem.views, solution.importance.shape
    parts = [views.part(image.reshape(*size, 3), k).astype(np.float64) for k in range(len(views))]
    return np.asarray(views.join([film_filtered(x) - x for x in parts]).reshape(-1, 3))
