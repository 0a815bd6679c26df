"""The loss of a painting, channel by channel."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.loss.loss import PixelLoss


@dataclass(frozen=True)
class PaintedPixels(PixelLoss):
    """Pixels of a `PaintingLoss`, which has the formula.

    painted, current: (3, p), linear. importance, share: (p,). at_least: (3, p), None where brighter
    is nowhere as good. seen: V of painted and of current, where somebody has it.
    """

    painted: Doubles
    importance: Doubles
    share: Doubles
    current: Doubles
    at_least: Bools | None
    transform: ViewTransform | None
    seen: tuple[Doubles, Doubles] | None = None

    def at(self, which: slice | Indices) -> "PaintedPixels":
        """Some of them."""
        return replace(
            self,
            painted=self.painted[:, which],
            importance=self.importance[which],
            share=self.share[which],
            current=self.current[:, which],
            at_least=None if self.at_least is None else self.at_least[:, which],
            seen=None if self.seen is None else (self.seen[0][:, which], self.seen[1][:, which]),
        )

    def weighed(self, by: Doubles) -> "PaintedPixels":
        """With `by`, (p,), as much importance."""
        return replace(self, importance=self.importance * by)

    @property
    def clips(self) -> bool:
        """Whether a display clips them."""
        return self.transform is not None

    @property
    def has_pieces(self) -> bool:
        """Whether light itself is compared."""
        return self.transform is None

    def shown(self, x: Doubles) -> Doubles:
        """V(x), of (3, p)."""
        if self.transform is None:
            return x
        return np.asarray(self.transform.encode_planes(x), np.float64)

    def _with_slopes(self, x: Doubles) -> tuple[Doubles, Doubles]:
        """V(x), and its derivatives as `ViewTransform.with_slopes` has them."""
        assert self.transform is not None
        shown, slopes = self.transform.with_slopes(x)
        return np.asarray(shown, np.float64), np.asarray(slopes, np.float64)

    def exceeds(self, x: Doubles) -> Bools | None:
        """Where x, (3, p), is brighter than paint of which that is as good; None for nowhere."""
        if self.at_least is None:
            return None
        found = self.at_least & (x > self.painted)
        return found if found.any() else None

    def objective(self, x: Doubles) -> Doubles:
        """F of (3, p), per channel, (3,)."""
        return np.asarray(sum(self.each(lambda where, its: its._objective(x[:, where]))))

    def _objective(self, x: Doubles, shown: Doubles | None = None) -> Doubles:
        shown, q = self.shown(x) if shown is None else shown, self.share
        missed = self._shown_painting - shown
        if (exceeds := self.exceeds(x)) is not None:
            its = np.flatnonzero(exceeds.any(axis=0))
            moved = np.where(exceeds, x, self.painted)[:, its]
            missed[:, its] = self.shown(moved) - shown[:, its]
        terms = np.square(missed)
        if self._is_shared:
            terms *= 1 - q
            terms += q * np.square(self._shown_current - shown)
            terms -= self._inevitable
        return np.asarray(terms @ self.importance)

    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """image and weight, (3, p) each, of squares with F's gradient at x, (3, p)."""
        image, weight = np.empty((2, *x.shape))

        def fill(where: slice, its: "PaintedPixels") -> None:
            lit = x[:, where]
            gradient, factor = its.gradient(lit, from_clipping=from_clipping)
            some = factor > 0
            gradient /= factor if some.all() else np.where(some, factor, 1)
            np.add(lit, gradient, out=image[:, where])
            np.multiply(factor, its.importance, out=weight[:, where])

        self.each(fill)
        return image, weight

    def objective_and_gradient(self, x: Doubles) -> tuple[float, Doubles]:
        """F of few pixels, (3, p), and half its gradient, (3, p)."""
        seen = None if self.transform is None else self._with_slopes(x)
        slope, _ = self.gradient(x, seen=seen)
        slope *= -self.importance
        return float(self._objective(x, None if seen is None else seen[0]).sum()), slope

    def gradient(
        self,
        x: Doubles,
        *,
        from_clipping: bool = False,
        seen: tuple[Doubles, Doubles] | None = None,
    ) -> tuple[Doubles, Doubles]:
        """Half of F's, downwards, and how much a square counts, without importance; (3, p) each."""
        q, exceeds = self.share, self.exceeds(x)
        if self.transform is None:
            counts = (1 - q) * (np.ones_like(x) if exceeds is None else ~exceeds)
            return counts * (self.painted - x) + q * (self.current - x), counts + q
        shown, own = self._with_slopes(x) if seen is None else seen
        slope, missed, way = own, self._shown_painting - shown, self.painted - x
        if exceeds is not None:
            # What is wanted there moves along with x.
            its = np.flatnonzero(exceeds.any(axis=0))
            moved = np.where(exceeds, x, self.painted)[:, its]
            moved_shown, moved_slope = self._with_slopes(moved)
            missed[:, its] = moved_shown - shown[:, its]
            slope = own.copy()
            slope[..., its] -= moved_slope * exceeds[:, its]
            way[exceeds] = 0
        if from_clipping:
            slope = _with_chords(own, slope, missed, way)
        gradient, factor = _of_squares(slope, missed)
        if self._is_shared:
            slope, missed = own, self._shown_current - shown
            if from_clipping:
                slope = _with_chords(own, slope, missed, self.current - x)
            of_current = _of_squares(slope, missed)
            gradient, factor = (
                (1 - q) * a + q * b for a, b in zip((gradient, factor), of_current, strict=True)
            )
        return gradient, factor

    def shares(self, x: Doubles, weight: Doubles) -> Doubles:
        """By how much squares made at x follow the current look, (3, p). weight: theirs."""
        share = np.zeros_like(x)

        def fill(where: slice, its: "PaintedPixels") -> None:
            steep = its._steep(x[:, where]) * its.share * its.importance
            np.divide(steep, weight[:, where], out=share[:, where], where=weight[:, where] > 0)

        if self.share.any():
            self.each(fill)
        return share

    def _steep(self, x: Doubles) -> Doubles:
        """What light adds to V(x) as strongly as to V(C), (3, p)."""
        if self.transform is None:
            return np.ones_like(x)
        own, current = (self._with_slopes(y)[1] for y in (x, self.current))
        both = own * current
        return both if both.ndim == 2 else np.asarray(both.sum(axis=0))

    def same_squares(self, a: Doubles, b: Doubles) -> bool:
        """Whether the squares made for two pictures are the same, and so exact between them."""
        if self.transform is not None:
            return False
        return self.at_least is None or not (self._over(a) != self._over(b)).any()

    def _over(self, x: Doubles) -> Bools:
        assert self.at_least is not None
        return np.asarray(self.at_least & (x > self.painted))

    @cached_property
    def _is_shared(self) -> bool:
        return bool(self.share.any())

    @cached_property
    def _shown_painting(self) -> Doubles:
        return self.shown(self.painted) if self.seen is None else self.seen[0]

    @cached_property
    def _shown_current(self) -> Doubles:
        return self.shown(self.current) if self.seen is None else self.seen[1]

    @cached_property
    def _inevitable(self) -> Doubles:
        """What the painting and the current look cost each other, (3, p), without importance."""
        apart = np.square(self._shown_painting - self._shown_current)
        if self.at_least is not None:
            apart[self.at_least & (self.current >= self.painted)] = 0
        return np.asarray(self.share * (1 - self.share) * apart)


def joined(parts: Sequence[PaintedPixels]) -> PaintedPixels:
    """Pixels of several pictures as those of one, where brighter is nowhere as good."""
    first = parts[0]

    def put(get: Callable[[PaintedPixels], Doubles]) -> Doubles:
        return np.concatenate([get(part) for part in parts], axis=-1)

    return PaintedPixels(
        put(lambda its: its.painted),
        put(lambda its: its.importance),
        put(lambda its: its.share),
        put(lambda its: its.current),
        None,
        first.transform,
        (put(lambda its: its._shown_painting), put(lambda its: its._shown_current)),
    )


def _of_squares(slope: Doubles, missed: Doubles) -> tuple[Doubles, Doubles]:
    """Half the gradient of what is missed, squared, downwards, and what squares of single channels
    count that are nowhere below; (3, p) each, by the derivatives.
    """
    if slope.ndim == 2:
        return slope * missed, np.square(slope)
    mixed = np.einsum("kcp,kdp->cdp", slope, slope)
    return np.einsum("kcp,kp->cp", slope, missed), np.abs(mixed, out=mixed).sum(axis=1)


def _with_chords(own: Doubles, slope: Doubles, missed: Doubles, way: Doubles) -> Doubles:
    """`slope` with chords of display values that are flat by `own` and miss something."""
    is_flat = own == 0 if own.ndim == 2 else ~own.any(axis=1)
    flat = is_flat & (missed * way > 0)
    if not flat.any():
        return slope
    slope = slope.copy()
    if slope.ndim == 2:
        slope[flat] += missed[flat] / way[flat]
        return slope
    k, its = np.nonzero(flat)
    slope[k, k, its] += missed[k, its] / way[k, its]
    return slope
