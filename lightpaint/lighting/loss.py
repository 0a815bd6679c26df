"""What a pixel costs where that is not one square per channel, and squares that stand for it.

With the importance D, the part q of it that is for the current look C, and the view V:

    F(x) = Σ D [(1 − q) ‖V(ψ) − V(x)‖² + q ‖V(C) − V(x)‖²]

ψ is the painting Ψ; but where Ψ says only "at least this bright", it is x if that is brighter.
V is the identity in linear light, and F then is convex.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.view import View

#: Pixels that go through the view at once.
STRIP = 2**16


@dataclass(frozen=True)
class Squares:
    """Σ D f (y − x)², with F's own gradient at the x that it was made for.

    image: (h, w, 3), y. factor: (h, w, 3), f >= 0, of the importance. share: (h, w, 3), by how
    much y follows the current look.
    """

    image: Doubles
    factor: Doubles
    share: Doubles


@dataclass(frozen=True)
class Loss:
    """F, of pictures x of one size.

    painted: (h, w, 3), Ψ, linear. importance: (h, w), D. share: (h, w), q. current: (h, w, 3), C,
    linear. at_least: (h, w, 3), where brighter is as good; None for nowhere. view: V, None for
    linear light.
    """

    painted: Floats
    importance: Floats
    share: Floats
    current: Floats
    at_least: npt.NDArray[np.bool_] | None = None
    view: View | None = None

    def shown(self, image: Floats) -> Doubles:
        """V of linear pixels, (…, 3)."""
        out = np.array(image, np.float64)
        if self.view is not None:
            for its in _strips(out):
                its[:] = self.view.encode(its)
        return out

    def objective(self, x: Floats) -> Doubles:
        """F less the least that any picture could have, per channel, (3,). x: (h, w, 3)."""
        shown = self.shown(x)
        wanted = self._shown_painting
        if (exceeds := self._exceeds(x)).any():
            its = exceeds.any(axis=-1)
            wanted = wanted.copy()
            wanted[its] = self.shown(self._moved(x)[its])
        q, D = self.share[..., None], self.importance[..., None]
        terms = (1 - q) * np.square(wanted - shown)
        if self.share.any():
            terms += q * (np.square(self._shown_current - shown)) - self._inevitable
        return np.asarray((D * terms).sum(axis=(0, 1)))

    @property
    def norm2(self) -> Doubles:
        """The objective of a black picture, (3,): ‖Ψ‖² where nothing else is asked."""
        return self.objective(np.zeros_like(self.painted))

    def meant(self, x: Floats) -> Doubles:
        """What was to be there, (h, w, 3) linear, of a picture x: x itself where that will do."""
        q = self.share[..., None]
        return np.asarray((1 - q) * self._moved(x) + q * self.current, np.float64)

    def missed(self, x: Floats) -> Doubles:
        """V(ψ) − V(x), (h, w, 3): what a picture misses of the painting."""
        return np.asarray(self.shown(self._moved(x)) - self.shown(x))

    def same_squares(self, a: Floats, b: Floats) -> bool:
        """Whether the squares made for two pictures are the same, and so exact between them."""
        if self.view is not None:
            return False
        differ = self._exceeds(a) != self._exceeds(b)
        return not differ[self.importance > 0].any()

    def squares(self, x: Floats, *, from_clipping: bool = False) -> Squares:
        """The squares at x, (h, w, 3).

        from_clipping: where the display clips x but not what is wanted there, F is flat. With it
        x is drawn back from there, as strongly as the chord between the two is steep.
        """
        image, factor, share = np.zeros((3, *x.shape))
        rows = [a.reshape(-1, a.shape[-1]) for a in (x, self._moved(x), self.current)]
        exceeds, q = self._exceeds(x).reshape(-1, 3), self.share.reshape(-1, 1)
        for where in _parts(x):
            lit, wanted, now = (a[where].astype(np.float64) for a in rows)
            made = self._of_strip(
                lit, wanted, now, exceeds[where], q[where], from_clipping=from_clipping
            )
            for whole, part in zip((image, factor, share), made, strict=True):
                whole.reshape(-1, 3)[where] = part
        return Squares(image, factor, share)

    def _of_strip(
        self,
        x: Floats,
        wanted: Floats,
        current: Floats,
        exceeds: npt.NDArray[np.bool_],
        q: Floats,
        *,
        from_clipping: bool,
    ) -> tuple[Floats, Floats, Floats]:
        """image, factor and share of some pixels, (p, 3) each. As of `squares`."""
        if self.view is None:
            counts = (1 - q) * ~exceeds
            factor, gradient = counts + q, counts * (wanted - x) + q * (current - x)
            from_current = q * np.ones(3)
        else:
            own, shown = self.view.jacobian(x), self.view.encode(x)
            factor, gradient, from_current = np.zeros((3, *x.shape))
            for part, goal, moves in ((1 - q, wanted, exceeds), (q, current, None)):
                if not part.any():
                    continue
                missed = self.view.encode(goal) - shown
                slope = _with_chords(own, missed, goal - x) if from_clipping else own
                if moves is not None and moves.any():
                    # What is wanted there moves along with x.
                    slope = slope - self.view.jacobian(goal) * moves[:, None, :]
                gradient += part * np.einsum("pkc,pk->pc", slope, missed)
                # The squares of channels that the view mixes, from above by those of single ones.
                mixed = np.einsum("pkc,pkd->pcd", slope, slope)
                factor += part * np.abs(mixed).sum(axis=-1)
            if q.any():
                steep = np.einsum("pkc,pkc->pc", own, self.view.jacobian(current))
                from_current = q * steep
        some = factor > 0
        safe = np.where(some, factor, 1)
        image = x + np.where(some, gradient / safe, 0)
        return image, factor, np.where(some, from_current / safe, 0)

    def _exceeds(self, x: Floats) -> npt.NDArray[np.bool_]:
        if self.at_least is None:
            return np.zeros(x.shape, bool)
        return self.at_least & (x > self.painted)

    def _moved(self, x: Floats) -> Doubles:
        """ψ at x, (h, w, 3)."""
        return np.asarray(np.where(self._exceeds(x), x, self.painted), np.float64)

    @cached_property
    def _shown_painting(self) -> Doubles:
        return self.shown(self.painted)

    @cached_property
    def _shown_current(self) -> Doubles:
        return self.shown(self.current)

    @cached_property
    def _inevitable(self) -> Doubles:
        """What the painting and the current look cost each other, (h, w, 3), without D."""
        q = self.share[..., None]
        apart = np.square(self._shown_painting - self._shown_current)
        if self.at_least is not None:
            apart = np.where(self.at_least & (self.current >= self.painted), 0, apart)
        return np.asarray(q * (1 - q) * apart)


def _with_chords(own: Floats, missed: Floats, way: Floats) -> Doubles:
    """Derivatives (p, 3, 3) with chords of display values that are flat and miss something."""
    flat = ~own.any(axis=-1) & (missed * way > 0)
    chord = np.where(flat, missed / np.where(flat, way, 1), 0)
    return np.asarray(own + chord[..., None] * np.eye(3))


def _parts(image: Floats) -> Iterator[slice]:
    pixels = image.size // image.shape[-1]
    return (slice(start, start + STRIP) for start in range(0, pixels, STRIP))


def _strips(image: Doubles) -> Iterator[Doubles]:
    """A contiguous image (…, 3) by parts (p, 3) that look at its memory."""
    rows = image.reshape(-1, 3)
    return (rows[where] for where in _parts(image))
