"""The pixels that count, with each light's part of them, the data of a descent: one by one, or
averaged in blocks where single ones are mostly noise.

The mean display value of a noisy pixel differs from the display value of its mean light, since the
curve of the display is bent, and steepest in the dark. A fit of noisy pixels makes up for that with
light that nobody painted, and a lamp that shows only in stray pixels may get any weight. The remedy
is the average of a block: many more samples of nearly the same light. The noise of the current
look, as the display shows it, determines the size of blocks.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices, in_all_channels
from lightpaint.basis import (
    Basis,
    Planes,
    array_name,
    array_once,
    as_planes,
    block_means,
    in_one_row,
    mix_channels,
    spooled,
    walked_blocks,
)
from lightpaint.colour import ViewTransform
from lightpaint.images import Estimate, block_sums, enlarged
from lightpaint.lighting.joined_views import Views
from lightpaint.lighting.loss import pixel_loss
from lightpaint.lighting.loss.weight_penalty import pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.progress import with_progress

#: Share of pixels with other squares up to which a problem is updated rather than summed anew.
MAX_UPDATED_SHARE = 0.25

#: Share of pixels without importance from which a copy of the others is worth its time.
MIN_SKIPPED_SHARE = 0.1

#: Largest RMS noise of the current look, relative to the display's range, at which single pixels
#: are fitted: the noise of some 32 samples per pixel on the shipped scenes (docs/benchmarks.md).
NOISY_DISPLAY = 0.035

#: Sides of blocks to try, and the fewest blocks along the shorter side of a picture.
BLOCK_SIDES, MIN_BLOCKS = (1, 2, 3, 4, 6, 8), 16
#: Pixels that suffice to measure the noise of a picture, and rows of a strip of them.
NOISE_PIXELS, STRIP_ROWS = 2**16, 24

#: Strength of the pull to the current lighting in proportion to the noise of a light.
PRIOR_STRENGTH = 0.1


@dataclass(frozen=True)
class LitPixels:
    """The loss of some pixels, and the pictures that lights make of them.

    planes: of these pixels. which: (p,), which pixels of a picture they are; None for all.
    """

    planes: Planes
    pixels: pixel_loss.PixelLoss
    which: Indices | None = None

    @classmethod
    def whole(cls, basis: Basis, loss: pixel_loss.Loss) -> "LitPixels":
        """Return all pixels."""
        return cls(basis.planes, loss.pixels)

    @classmethod
    def of(cls, basis: Basis, loss: pixel_loss.Loss) -> "LitPixels":
        """Return the pixels that count."""
        whole = cls.whole(basis, loss)
        counted = np.flatnonzero(whole.pixels.importance)
        if counted.size > (1 - MIN_SKIPPED_SHARE) * len(whole.pixels):
            return whole
        return cls(basis.planes.picked(counted), whole.pixels.subset(counted), counted)

    def summed(self, squares: pixel_loss.Squares, equations: NormalEquations) -> "SummedSquares":
        """Return squares of the whole picture, whose problem is known, for these pixels."""
        pixels = squares.pixels
        assert isinstance(pixels, pixel_loss.SquaredPixels)
        which = slice(None) if self.which is None else self.which
        return SummedSquares(pixels.image[:, which], pixels.weight[:, which], equations)

    def predicted(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i, (3, p), in float64: a float32's round-off would hide the last steps."""
        return self.planes.exact_mix(weights)

    def objective(self, weights: Doubles) -> Doubles:
        """Return the loss of weights, (n, 3), per channel, (3,)."""
        picture = self.predicted(weights)
        parts = self.pixels.map_strips(lambda strip, pixels: pixels.objective(picture[:, strip]))
        return np.asarray(sum(parts))

    def objective_and_gradient(self, weights: Doubles) -> tuple[float, Doubles]:
        """Return the loss of weights, (n, 3), and half its gradient, (n, 3)."""

        def strip_terms(strip: slice, pixels: pixel_loss.PixelLoss) -> tuple[float, Doubles]:
            light = _StripLight(self.planes, strip)
            w = weights.T
            parts = [np.stack([w[c] @ lit for c, lit in enumerate(x)]) for x in light]
            value, slope = pixels.objective_and_gradient(np.concatenate(parts, axis=1))
            return value, light.products(slope)

        values, slopes = zip(*self.pixels.map_strips(strip_terms), strict=True)
        return sum(values), np.asarray(sum(slopes))

    def products(self, picture: Doubles) -> Doubles:
        """Return the inner products of each light with a picture (3, p), (n, 3)."""

        def strip_products(strip: slice, _: pixel_loss.PixelLoss) -> Doubles:
            return _StripLight(self.planes, strip).products(picture[:, strip])

        return np.asarray(sum(self.pixels.map_strips(strip_products)))

    def slope(self, image: Doubles, weight: Doubles, x: Doubles, ahead: Doubles) -> float:
        """Return half of the slope at which Σ weight (image − x)² falls at x on the way to
        `ahead`."""

        def strip_slope(strip: slice, _: pixel_loss.PixelLoss) -> float:
            here_x = x[:, strip]
            return float(
                (weight[:, strip] * (image[:, strip] - here_x) * (ahead[:, strip] - here_x)).sum()
            )

        return sum(self.pixels.map_strips(strip_slope))

    def equations(
        self, image: Doubles, weight: Doubles, known: "SummedSquares | None" = None
    ) -> NormalEquations:
        """Return the linear problem of squares, (3, p) each.

        known: squares with their problem, which is updated where few pixels have others (Schoeneman
        et al. 1993, Eq 7-9).
        """
        if known is not None:
            # Images do not count where they have no weight, as of pixels that exceed their goal.
            is_other = (image != known.image) & (weight > 0)
            is_other |= weight != known.weight
            changed = np.flatnonzero(is_other.any(axis=0))
            if changed.size <= MAX_UPDATED_SHARE * len(self.pixels):
                return known.updated(self.planes, changed, image, weight)
        shape = (*self.planes.size, 3)
        picture, weights = image.T.reshape(shape), weight.T.reshape(shape)
        return NormalEquations(*self.planes.sums(weights, picture))

    def equations_at(self, weights: Doubles) -> NormalEquations:
        """Return the linear problem of the squares at the picture of weights, (n, 3).

        No more than a block of these squares is in memory.
        """

        def squares(where: slice | Indices, light: Callable[[], Floats]) -> tuple[Doubles, Doubles]:
            x = mix_channels(light(), weights)
            image, weight = self.pixels.subset(where).squares(x, from_clipping=False)
            return weight.T, image.T

        counted = np.flatnonzero(self.pixels.importance)
        return NormalEquations(*self.planes.sums_of(counted, squares))


class _StripLight:
    """The light of a strip of pixels, block by block, of which one is in memory at a time.

    Its only block, of few lights, stays in memory.
    """

    def __init__(self, planes: Planes, strip: slice) -> None:
        self._planes, self._blocks = planes, walked_blocks(planes, strip.stop, strip.start)
        self._only: Doubles | None = None

    def __iter__(self) -> Iterator[Doubles]:
        """Yield the light of each block, (3, n, p) float64."""
        if self._only is not None:
            yield self._only
            return
        for block in self._blocks:
            light = self._planes.pixels(block).transpose(2, 0, 1).astype(np.float64, order="C")
            if len(self._blocks) == 1:
                self._only = light
            yield light

    def products(self, picture: Doubles) -> Doubles:
        """Return the inner products of each light with a picture of the strip, (3, p), (n, 3)."""
        products, begin = np.zeros((self._planes.count, 3)), 0
        for light in self:
            part = picture[:, begin : begin + light.shape[2]]
            products += np.stack([x @ y for x, y in zip(light, part, strict=True)], axis=1)
            begin += light.shape[2]
        return products


@dataclass(frozen=True)
class SummedSquares:
    """Squares of all pixels with their linear problem. image, weight: (3, p)."""

    image: Doubles
    weight: Doubles
    equations: NormalEquations

    def updated(
        self, planes: Planes, changed: Indices, image: Doubles, weight: Doubles
    ) -> NormalEquations:
        """Return the problem of other squares, (3, p) each, which differ in these pixels alone."""
        equations = self.equations
        if not changed.size:
            return equations
        lit = planes.picked(changed)
        for sign, squares in ((-1, (self.image, self.weight)), (1, (image, weight))):
            picture, weights = (x[:, changed].T[None] for x in squares)
            equations = equations + NormalEquations(*lit.sums(weights, picture)).scaled(sign)
        return equations


class DeferredSquares(pixel_loss.Squares):
    """The squares of a loss at one picture, made when they are asked for, until they are released.

    They are as large as several pictures, and most answers need only their sums.
    """

    def __init__(
        self, lit: LitPixels, weights: Doubles, made: pixel_loss.Squares | None = None
    ) -> None:
        """Keep the source of the squares. lit: of all pixels. weights: (n, 3), of the picture.
        made: the squares, if there are some now.
        """
        self._lit, self._weights = lit, weights
        if made is not None:
            self._arrays = made.image, made.weight, made.share

    @cached_property
    def _arrays(self) -> tuple[Floats, Floats, Floats]:
        x, pixels = self._lit.predicted(self._weights), self._lit.pixels
        image, weight = pixels.squares(x, from_clipping=False)
        size = self._lit.planes.size
        shares = pixels.shares(x, weight)
        return (
            pixel_loss.image_in_place(image, size),
            pixel_loss.image_in_place(weight, size),
            pixel_loss.image_in_place(shares, size),
        )

    @property
    def image(self) -> Floats:
        """(h, w, 3)."""
        return self._arrays[0]

    @property
    def weight(self) -> Floats:
        """(h, w, 3), >= 0."""
        return self._arrays[1]

    @property
    def share(self) -> Floats:
        """(h, w, 3), the share of the image that follows the current look."""
        return self._arrays[2]

    def release(self) -> None:
        """Forget the arrays, which are made again when somebody asks for them."""
        for name in ("_arrays", "importance", "pixels"):
            self.__dict__.pop(name, None)


@dataclass(frozen=True)
class BinnedPixels:
    """Blocks of all views behind each other, as a picture of one row.

    Attributes:
        basis: (n, 1, p, 3) images of the lights, means over each block, weighted by importance.
        loss: The loss of a picture of these blocks; one counts as much as all its pixels.
        side: Pixels along the side of a block.
    """

    basis: Basis
    loss: pixel_loss.Loss
    side: int

    @cached_property
    def equations(self) -> NormalEquations:
        """The linear problem at the current lighting, with the importance of all pixels of a
        block."""
        goal = self.loss.goal(self.basis.current_look)
        return NormalEquations.of(self.basis, goal, self.loss.importance[..., None])

    @cached_property
    def prior(self) -> NormalEquations:
        """The pull s Σᵢ Nᵢ (wᵢ − presentᵢ)², Nᵢ the noise's power in the blocks of light i, s
        `PRIOR_STRENGTH`.

        Samples determine a light as far as its power exceeds its noise; for a light that is all
        noise the current lighting is the best guess. M contains N anyway, where it pulls towards 0.
        """
        current = self.basis.current_weights
        current_picture = LitPixels.whole(self.basis, self.loss).predicted(current)
        _, weight = self.loss.pixels.squares(current_picture, from_clipping=False)
        power = np.zeros(current.shape)
        for where in with_progress(walked_blocks(self.basis.noise, weight.shape[1])):
            halves = self.basis.noise.pixels(where).astype(np.float64)
            power += np.einsum("cp,npc->nc", weight[:, where], np.square(halves))
        return pull_to_current(PRIOR_STRENGTH * power, current)


def block_side(bases: Sequence[Basis], transform: ViewTransform | None) -> int:
    """Return the side, in pixels, of blocks whose noise is small on a display; 1 for no blocks.

    The noise is the noise of the current look, not of the painting, so that no stroke changes the
    problem elsewhere. The side is 1 for unknown noise, and in linear light, where the equations
    are corrected for noise.
    """
    if transform is None or not all(basis.knows_noise for basis in bases):
        return 1
    shortest = min(min(basis.size) for basis in bases)
    sides = [side for side in BLOCK_SIDES if shortest >= MIN_BLOCKS * side]
    if len(sides) < 2:
        return 1
    strips = [_strips(basis) for basis in bases]
    for side in sides:
        noise = [_display_noise(look, half, seen, transform, side) for look, half, seen in strips]
        if np.sqrt(np.mean(np.concatenate(noise))) <= NOISY_DISPLAY:
            return side
    return sides[-1]


def _strips(basis: Basis) -> tuple[Floats, Floats, Bools]:
    """Return the current look of enough of a picture, its half difference, and the pixels of
    emitters.

    The strips, of whole blocks of any side, are spread over the picture.
    """
    step = max(1, basis.emitters_seen.size // NOISE_PIXELS)
    rows = np.flatnonzero(np.arange(basis.size[0]) // STRIP_ROWS % step == 0)
    weights = basis.current_weights
    pixels = np.flatnonzero(np.repeat(np.isin(np.arange(basis.size[0]), rows), basis.size[1]))
    picture = (len(rows), basis.size[1], 3)
    name = array_name("strips", weights, pixels)

    def mixed(planes: Planes) -> Floats:
        return array_once(planes, name, lambda: planes.picked(pixels).mix(weights).reshape(picture))

    return mixed(basis.planes), mixed(basis.noise), basis.emitters_seen[rows]


def _display_noise(
    look: Floats, half: Floats, seen: Bools, transform: ViewTransform, side: int
) -> Doubles:
    """Return squared half differences of display values of blocks, (k,), without emitters."""
    unseen = (~seen).astype(np.float64)
    counts = block_sums(unseen, side)
    safe = np.where(counts > 0, counts, 1)[..., None]
    light, noise = (block_sums(x * unseen[..., None], side) / safe for x in (look, half))
    ends = (transform.encode(np.maximum(light + sign * noise, 0)) for sign in (1, -1))
    return np.asarray(np.square(np.subtract(*ends, dtype=np.float64) / 2)[counts > 0].ravel())


def bin_pixels(views: Views, loss: pixel_loss.Loss, side: int) -> BinnedPixels | None:
    """Return the blocks of a loss over all `views`, with pixels weighted by importance.

    None for a loss that only fits single pixels.
    """
    images: list[Planes] = []
    halves: list[Planes] = []
    looks: list[Estimate] = []
    parts: list[tuple[pixel_loss.Cut, Doubles]] = []
    for k, basis in enumerate(views.bases):
        cut = partial(views.part, k=k)
        view_loss = loss.cut(cut)
        counts = view_loss.importance.astype(np.float64)
        # Emitters that may be brighter count in a block that has nothing else.
        glows = basis.emitters_seen & in_all_channels(view_loss.exceeds(np.inf))
        weights = enlarged(block_sums(np.where(glows, 0, counts), side), side)
        counts[glows & (weights[: counts.shape[0], : counts.shape[1]] > 0)] = 0
        # Each step of the solve needs the images again, but only some sums need their noise.
        images.append(spooled(block_means(basis.planes, counts, side)))
        halves.append(block_means(basis.noise, counts, side))
        if basis.former is not None:
            looks.append(
                Estimate(
                    *(
                        block_means(as_planes(x[None]), counts, side).plane(0).reshape(1, -1, 3)
                        for x in (basis.former.image, basis.former.half_difference)
                    )
                )
            )
        parts.append((cut, counts))
    if (blocks := loss.block_means(parts, side)) is None:
        return None
    row, noise = in_one_row(images), in_one_row(halves)
    look = None
    if looks:
        pictures = zip(*((x.image, x.half_difference) for x in looks), strict=True)
        look = Estimate(*(np.concatenate(parts, axis=1) for parts in pictures))
    basis = views.bases[0].on_pixels(row, noise, np.zeros(row.size, dtype=bool), look)
    return BinnedPixels(basis, blocks, side)
