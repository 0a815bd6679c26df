"""The loss of a painting with "at least this bright", in light or as a display shows it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.colour import ViewTransform
from lightpaint.images import BAND_PIXELS, block_sums, by_bands
from lightpaint.lighting.loss import pixel_loss
from lightpaint.threads import parallel_map

#: Relative change of light over which the bend of a display's curve is measured.
BEND_STEP = 1e-3

#: Least curvature of a pixel's loss, relative to the square of the slope, that squares have: where
#: the picture is much too bright, the loss itself may curve downwards.
LEAST_CURVATURE = 0.1

#: Fields of a loss that are pictures.
PICTURES = ("painted", "importance", "share", "current", "at_least")


@dataclass(frozen=True)
class PaintedPixels(pixel_loss.PixelLoss):
    """Pixels of a `PaintingLoss`, in which the formula stands.

    painted, current: (3, p), linear, of any precision. importance, share: (p,). at_least: (3, p),
    None if brighter is nowhere as good. encoded: V of painted and of current, if computed already.
    """

    painted: Floats
    importance: Doubles
    share: Doubles
    current: Floats
    at_least: Bools | None
    transform: ViewTransform | None
    encoded: tuple[Doubles, Doubles] | None = None

    def subset(self, which: slice | Indices) -> "PaintedPixels":
        """Return some of the pixels."""
        return replace(
            self,
            painted=pixel_loss.contiguous_rows(self.painted, which),
            importance=self.importance[which],
            share=self.share[which],
            current=pixel_loss.contiguous_rows(self.current, which),
            at_least=None
            if self.at_least is None
            else pixel_loss.contiguous_rows(self.at_least, which),
            encoded=None
            if self.encoded is None
            else (self.encoded[0][:, which], self.encoded[1][:, which]),
        )

    def scaled(self, factors: Doubles) -> "PaintedPixels":
        """Return the pixels with importance multiplied by `factors`, (p,)."""
        return replace(self, importance=self.importance * factors)

    def over_look(self, look: Doubles) -> "PaintedPixels":
        """Return the same pixels over another current look, (3, p)."""
        return replace(self, current=look, encoded=None)

    @property
    def has_clipping(self) -> bool:
        """True if a display clips the pixels."""
        return self.transform is not None

    @property
    def has_pieces(self) -> bool:
        """True if light itself is compared."""
        return self.transform is None

    @property
    def guide(self) -> Floats:
        """The painting, where it is the whole goal: the current look is noisy, and paint that
        means "at least" hides what is brighter.
        """
        is_goal = self.share == 0
        if self.at_least is not None:
            is_goal &= ~self.at_least.any(axis=0)
        return np.where(is_goal, self.painted, 0)

    def encode(self, x: Floats) -> Doubles:
        """Return V(x), (3, p)."""
        light: Doubles = x.astype(np.float64, copy=False)
        if self.transform is None:
            return light
        return np.asarray(self.transform.encode_planes(light), np.float64)

    def _with_slopes(self, x: Floats) -> tuple[Doubles, Doubles]:
        """Return V(x), and its derivatives in the form of `ViewTransform.with_slopes`."""
        assert self.transform is not None
        shown, slopes = self.transform.with_slopes(x.astype(np.float64, copy=False))
        return np.asarray(shown, np.float64), np.asarray(slopes, np.float64)

    def exceeds(self, x: Doubles) -> Bools | None:
        """Return where x, (3, p), is brighter than paint that means "at least"; None for
        nowhere."""
        if self.at_least is None:
            return None
        exceeded = self.at_least & (x > self.painted)
        return exceeded if exceeded.any() else None

    def objective(self, x: Doubles, shown: Doubles | None = None) -> Doubles:
        """Return F per channel, (3,), of x, (3, p). shown: V(x), if it is known."""

        def strip_objective(strip: slice, part: "PaintedPixels") -> Doubles:
            own = None if shown is None else shown[:, strip]
            return part._objective(np.ascontiguousarray(x[:, strip], np.float64), own)

        return np.asarray(sum(self.map_strips(strip_objective)))

    def _objective(self, x: Doubles, shown: Doubles | None = None) -> Doubles:
        shown, q = self.encode(x) if shown is None else shown, self.share
        missed = self._shown_painting - shown
        if (exceeds := self.exceeds(x)) is not None:
            columns = np.flatnonzero(exceeds.any(axis=0))
            goal = np.where(exceeds, x, self.painted)[:, columns]
            missed[:, columns] = self.encode(goal) - shown[:, columns]
        terms = np.square(missed)
        if self._is_shared:
            terms *= 1 - q
            terms += q * np.square(self._shown_current - shown)
            terms -= self._unavoidable
        return np.asarray(terms @ self.importance)

    @property
    def has_curvature(self) -> bool:
        """True if each display value follows its own channel alone."""
        return self.transform is not None and self.transform.is_per_channel

    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """Return image and weight, (3, p) each, of squares with the gradient of F at x, (3, p)."""
        return self._squares(x, from_clipping=from_clipping, is_curved=False)

    def curved_squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """Return `squares` with ½ F″ as the weight, where that is not much less than V′²."""
        return self._squares(x, from_clipping=from_clipping, is_curved=self.has_curvature)

    def _squares(
        self, x: Doubles, *, from_clipping: bool, is_curved: bool
    ) -> tuple[Doubles, Doubles]:
        image, weight = np.empty((2, *x.shape))

        def fill(strip: slice, part: "PaintedPixels") -> None:
            lit = np.ascontiguousarray(x[:, strip], np.float64)
            encoded = part._with_slopes(lit) if is_curved else None
            gradient, factor = part.gradient(lit, from_clipping=from_clipping, encoded=encoded)
            if encoded is not None:
                bend = part._bend(lit, *encoded)
                factor = np.maximum(factor - bend, LEAST_CURVATURE * factor)
            has_weight = factor > 0
            gradient /= factor if has_weight.all() else np.where(has_weight, factor, 1)
            np.add(lit, gradient, out=image[:, strip])
            np.multiply(factor, part.importance, out=weight[:, strip])

        self.map_strips(fill)
        return image, weight

    def _bend(self, x: Doubles, shown: Doubles, slope: Doubles) -> Doubles:
        """Return what the bend of V takes from ½ F″ at x, without importance: V″ times what is
        missed, (3, p); 0 where the display clips. shown, slope: V(x) and V′(x).
        """
        ahead = BEND_STEP * x
        _, next_slope = self._with_slopes(x + ahead)
        is_bent = (slope > 0) & (next_slope > 0) & (ahead > 0)
        bend = np.where(is_bent, (next_slope - slope) / np.where(is_bent, ahead, 1), 0)
        missed = self._shown_painting - shown
        if (exceeds := self.exceeds(x)) is not None:
            missed[exceeds] = 0
        return np.asarray(
            bend * ((1 - self.share) * missed + self.share * (self._shown_current - shown))
        )

    def objective_and_gradient(self, x: Doubles) -> tuple[float, Doubles]:
        """Return F of few pixels, (3, p), and half its gradient, (3, p)."""
        encoded = None if self.transform is None else self._with_slopes(x)
        slope, _ = self.gradient(x, encoded=encoded)
        slope *= -self.importance
        return float(self._objective(x, None if encoded is None else encoded[0]).sum()), slope

    def gradient(
        self,
        x: Doubles,
        *,
        from_clipping: bool = False,
        encoded: tuple[Doubles, Doubles] | None = None,
    ) -> tuple[Doubles, Doubles]:
        """Return half the negative gradient of F, and the weights of its squares, without
        importance; (3, p) each.
        """
        q, exceeds = self.share, self.exceeds(x)
        if self.transform is None:
            counts = (1 - q) * (np.ones_like(x) if exceeds is None else ~exceeds)
            return counts * (self.painted - x) + q * (self.current - x), counts + q
        shown, own_slope = self._with_slopes(x) if encoded is None else encoded
        slope, missed, distance = own_slope, self._shown_painting - shown, self.painted - x
        if exceeds is not None:
            # The goal there moves along with x.
            columns = np.flatnonzero(exceeds.any(axis=0))
            goal = np.where(exceeds, x, self.painted)[:, columns]
            moved_shown, moved_slope = self._with_slopes(goal)
            missed[:, columns] = moved_shown - shown[:, columns]
            slope = own_slope.copy()
            slope[..., columns] -= moved_slope * exceeds[:, columns]
            distance[exceeds] = 0
        if from_clipping:
            slope = _with_chords(own_slope, slope, missed, distance)
        gradient, factor = _square_terms(slope, missed)
        if self._is_shared:
            slope, missed = own_slope, self._shown_current - shown
            if from_clipping:
                slope = _with_chords(own_slope, slope, missed, self.current - x)
            of_current = _square_terms(slope, missed)
            gradient, factor = (
                (1 - q) * a + q * b for a, b in zip((gradient, factor), of_current, strict=True)
            )
        return gradient, factor

    def shares(self, x: Doubles, weight: Doubles) -> Doubles:
        """Return the share of squares made at x that follow the current look, (3, p). weight:
        theirs.
        """
        if not self._is_shared:
            return super().shares(x, weight)
        share = np.zeros_like(x)

        def fill(strip: slice, part: "PaintedPixels") -> None:
            steep = part._slope_product(x[:, strip]) * part.share * part.importance
            np.divide(steep, weight[:, strip], out=share[:, strip], where=weight[:, strip] > 0)

        self.map_strips(fill)
        return share

    def _slope_product(self, x: Doubles) -> Doubles:
        """Return the product of the slopes of V at x and at C, (3, p)."""
        if self.transform is None:
            return np.ones_like(x)
        own_slope, current = (self._with_slopes(y)[1] for y in (x, self.current))
        product = own_slope * current
        return product if product.ndim == 2 else np.asarray(product.sum(axis=0))

    def has_same_squares(self, a: Doubles, b: Doubles) -> bool:
        """Return whether the squares made for two pictures are equal, and so exact between them."""
        if self.transform is not None:
            return False
        return self.at_least is None or not (self._is_above(a) != self._is_above(b)).any()

    def _is_above(self, x: Doubles) -> Bools:
        assert self.at_least is not None
        return np.asarray(self.at_least & (x > self.painted))

    @cached_property
    def _is_shared(self) -> bool:
        return bool(self.share.any())

    @cached_property
    def _shown_painting(self) -> Doubles:
        return self.encode(self.painted) if self.encoded is None else self.encoded[0]

    @cached_property
    def _shown_current(self) -> Doubles:
        return self.encode(self.current) if self.encoded is None else self.encoded[1]

    @cached_property
    def _unavoidable(self) -> Doubles:
        """The least loss between painting and current look, (3, p), without importance."""
        distance = np.square(self._shown_painting - self._shown_current)
        if self.at_least is not None:
            distance[self.at_least & (self.current >= self.painted)] = 0
        return np.asarray(self.share * (1 - self.share) * distance)


def join_pixels(parts: Sequence[PaintedPixels]) -> PaintedPixels:
    """Join pixels of several pictures into one set."""
    first = parts[0]
    marks = [part.at_least for part in parts]
    at_least = None
    if any(mark is not None for mark in marks):
        nowhere = [np.zeros(part.painted.shape, bool) for part in parts]
        pairs = zip(marks, nowhere, strict=True)
        at_least = np.concatenate([n if mark is None else mark for mark, n in pairs], axis=1)

    def concatenate(read: Callable[[PaintedPixels], Floats]) -> Doubles:
        return np.concatenate([read(part) for part in parts], axis=-1, dtype=np.float64)

    return PaintedPixels(
        concatenate(lambda part: part.painted),
        concatenate(lambda part: part.importance),
        concatenate(lambda part: part.share),
        concatenate(lambda part: part.current),
        at_least,
        first.transform,
        (
            concatenate(lambda part: part._shown_painting),
            concatenate(lambda part: part._shown_current),
        ),
    )


def _square_terms(slope: Doubles, missed: Doubles) -> tuple[Doubles, Doubles]:
    """Return half the negative gradient of squared errors, and weights of single-channel squares
    that are nowhere below; (3, p) each, from the derivatives.
    """
    if slope.ndim == 2:
        return slope * missed, np.square(slope)
    mixed = np.einsum("kcp,kdp->cdp", slope, slope)
    return np.einsum("kcp,kp->cp", slope, missed), np.abs(mixed, out=mixed).sum(axis=1)


def _with_chords(own_slope: Doubles, slope: Doubles, missed: Doubles, distance: Doubles) -> Doubles:
    """Return `slope` with chords in place of derivatives where display values are flat and off.

    own_slope: of the picture itself, which tells where values are flat.
    """
    is_flat = own_slope == 0 if own_slope.ndim == 2 else ~own_slope.any(axis=1)
    flat = is_flat & (missed * distance > 0)
    if not flat.any():
        return slope
    slope = slope.copy()
    if slope.ndim == 2:
        slope[flat] += missed[flat] / distance[flat]
        return slope
    k, columns = np.nonzero(flat)
    slope[k, k, columns] += missed[k, columns] / distance[k, columns]
    return slope


@dataclass(frozen=True)
class PaintingLoss(pixel_loss.Loss):
    """The loss of pictures against a painting, as a display shows both, or as light.

    With the importance D, the part q of it that is for the current look C, and the view
    transform V:

        F(x) = Σ D [(1 − q) ‖V(ψ) − V(x)‖² + q ‖V(C) − V(x)‖²]

    ψ is the painting Ψ; where Ψ means only "at least this bright", it is x if that is brighter.
    V is the identity in linear light, and F then is convex.

    painted: (h, w, 3), Ψ, linear. importance: (h, w), D. share: (h, w), q. current: (h, w, 3), C,
    linear. at_least: (h, w, 3), where brighter is as good. transform: V, None for linear light.
    """

    painted: Floats
    importance: Floats
    share: Floats
    current: Floats
    at_least: Bools
    transform: ViewTransform | None = None

    def cut(self, part: pixel_loss.Cut) -> "PaintingLoss":
        pictures: dict[str, Any] = {name: part(getattr(self, name)) for name in PICTURES}
        return replace(self, **pictures)

    @cached_property
    def pixels(self) -> PaintedPixels:
        """All pixels, channel by channel: of many, in the memory of the pictures."""
        is_long = self.importance.size > pixel_loss.STRIP_PIXELS  # strips of them are copied

        def planes(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
            return image.reshape(-1, 3).T if is_long else pixel_loss.planes_of(image, image.dtype)

        return PaintedPixels(
            planes(self.painted),
            np.asarray(self.importance, np.float64).ravel(),
            np.asarray(self.share, np.float64).ravel(),
            planes(self.current),
            planes(self.at_least) if self._may_exceed else None,
            self.transform,
        )

    def encode(self, image: Floats) -> Doubles:
        """Return V of linear pixels, (…, 3)."""
        if self.transform is None:
            return np.array(image, np.float64)
        planes = pixel_loss.planes_of(image)
        encoded = np.empty_like(planes)
        for start in range(0, planes.shape[1], pixel_loss.STRIP_PIXELS):
            strip = slice(start, start + pixel_loss.STRIP_PIXELS)
            encoded[:, strip] = self.transform.encode_planes(planes[:, strip])
        return pixel_loss.image_of(encoded, image.shape[:-1])

    def goal(self, x: Floats) -> Doubles:
        """Return (1 − q) ψ + q C at a picture x, (h, w, 3) linear."""

        def mean(q: Floats, x: Floats, painted: Floats, at_least: Bools, current: Floats) -> Floats:
            q, psi = q[..., None], np.where(at_least & (x > painted), x, painted)
            return np.asarray((1 - q) * psi.astype(np.float64) + q * current, np.float64)

        arrays = self.share, x, self.painted, self.at_least, self.current
        return np.asarray(by_bands(mean, *arrays))

    def residual(self, x: Floats) -> Doubles:
        """Return V(ψ) − V(x), (h, w, 3)."""
        return np.asarray(self.encode(self._psi(x)) - self.encode(x))

    def exceeds(self, x: Floats | float) -> Bools:
        return self.at_least & (x > self.painted) if self._may_exceed else self.at_least

    @cached_property
    def _may_exceed(self) -> bool:
        return bool(self.at_least.any())

    def _psi(self, x: Floats) -> Doubles:
        """Return ψ at x, (h, w, 3)."""
        return np.asarray(np.where(self.exceeds(x), x, self.painted), np.float64)

    def block_means(
        self, parts: Sequence[tuple[pixel_loss.Cut, Doubles]], side: int
    ) -> "PaintingLoss":
        averages = [self.cut(cut)._block_average(counts, side) for cut, counts in parts]

        def row(name: str) -> npt.NDArray[Any]:
            arrays = [getattr(part, name) for part in averages]
            return np.concatenate([x.reshape(-1, *x.shape[2:]) for x in arrays])[None]

        rows: dict[str, Any] = {name: row(name) for name in PICTURES}
        return replace(self, **rows)

    def _block_average(self, counts: Doubles, side: int) -> "PaintingLoss":
        """Return the loss of means over blocks of one view. counts: (h, w), the importance."""

        def band_average(rows: slice) -> PaintingLoss:
            part = self.cut(lambda image: image[rows])
            return part._whole_block_average(counts[rows], side)

        height, step = len(counts), side * max(1, BAND_PIXELS // (side * counts.shape[1]))
        tops = range(0, height, step)
        bands = parallel_map(lambda top: band_average(slice(top, top + step)), tops)

        def joined(name: str) -> npt.NDArray[Any]:
            return np.concatenate([getattr(band, name) for band in bands])

        rows: dict[str, Any] = {name: joined(name) for name in PICTURES}
        return replace(self, **rows)

    def _whole_block_average(self, counts: Doubles, side: int) -> "PaintingLoss":
        """Return the loss of means over blocks of one view, all at once."""
        total = block_sums(counts, side)
        painted_weight, current_weight = (1 - self.share) * counts, self.share * counts

        def mean(image: Floats, weight: Floats) -> Doubles:
            total = block_sums(weight.astype(np.float64), side)
            sums = block_sums(image * weight[..., None].astype(np.float64), side)
            return np.asarray(sums / np.where(total > 0, total, 1)[..., None])

        return replace(
            self,
            painted=mean(self.painted, painted_weight),
            importance=total,
            share=block_sums(current_weight.astype(np.float64), side)
            / np.where(total > 0, total, 1),
            current=mean(self.current, current_weight),
            at_least=mean(self.at_least.astype(np.float64), painted_weight) > 0.5,
        )


def display_amplitude(light: Doubles, transform: ViewTransform | None) -> Doubles:
    """Return how much values of the loss change with a relative change of light, (3, k).

    light: (3, k), linear. transform: the view transform of the loss; None for linear light.
    """
    if transform is None:
        return np.maximum(light, 0)
    low, high = (transform.encode_planes(light * x) for x in (0.98, 1.02))
    return np.asarray(np.abs(high - low) / 0.04, np.float64)
