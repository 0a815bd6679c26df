"""What a picture costs: squares of what it misses, or a loss that squares stand for near an answer.

`Squares` are the linear problem: Σ D (Ψ − x)² in linear light, M and b are made of them. They are
the loss where nothing else is asked. A `PaintingLoss` knows "at least this bright" and what a
display shows; `reweighted.py` finds the squares that stand for it where it is least.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour.transform import ViewTransform

#: Pixels that go through the transform at once.
STRIP = 2**16

#: From arrays of all views to the part of one of them.
Cut = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]


@dataclass(frozen=True)
class Squares:
    """Σ weight (image − x)²: a loss, and what stands for one where it was made.

    image: (h, w, 3). weight: (h, w, 1), or (h, w, 3) where channels differ, >= 0. share: of the
    same shape, by how much the image follows the current look.
    """

    image: Floats
    weight: Floats
    share: Floats

    #: Light itself is compared.
    transform = None

    @cached_property
    def importance(self) -> Floats:
        """(h, w), the most that any channel counts."""
        return np.asarray(self.weight.max(axis=-1))

    @cached_property
    def norm2(self) -> Doubles:
        """‖Ψ‖², (3,)."""
        return self.objective(np.zeros_like(self.image))

    def objective(self, x: Floats) -> Doubles:
        """(3,), of a picture x (h, w, 3)."""
        missed = np.subtract(self.image, x, dtype=np.float64)
        return np.asarray((self.weight * np.square(missed)).sum(axis=(0, 1)))

    def squares(self, x: Floats, *, from_clipping: bool = False) -> "Squares":
        """These, at every x."""
        return self

    def meant(self, x: Floats) -> Floats:
        """The image, whatever x is."""
        return self.image

    def missed(self, x: Floats) -> Doubles:
        """What x misses of the image, (h, w, 3)."""
        return np.asarray(np.subtract(self.image, x, dtype=np.float64))

    def same_squares(self, a: Floats, b: Floats) -> bool:
        """They are the same everywhere."""
        return True

    def cut(self, part: Cut) -> "Squares":
        """Those of some of the pixels."""
        return Squares(part(self.image), part(self.weight), part(self.share))


@dataclass(frozen=True)
class PaintingLoss:
    """With the importance D, the part q of it that is for the current look C, and the view
    transform V:

        F(x) = Σ D [(1 − q) ‖V(ψ) − V(x)‖² + q ‖V(C) − V(x)‖²]

    ψ is the painting Ψ; but where Ψ says only "at least this bright", it is x if that is brighter.
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

    def cut(self, part: Cut) -> "PaintingLoss":
        """That of some of the pixels."""
        return replace(
            self,
            painted=part(self.painted),
            importance=part(self.importance),
            share=part(self.share),
            current=part(self.current),
            at_least=part(self.at_least),
        )

    def shown(self, image: Floats) -> Doubles:
        """V of linear pixels, (…, 3)."""
        out = np.array(image, np.float64)
        if self.transform is not None:
            for its in _strips(out):
                its[:] = self.transform.encode(its)
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

    @cached_property
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
        if self.transform is not None:
            return False
        differ = self._exceeds(a) != self._exceeds(b)
        return not differ[self.importance > 0].any()

    def squares(self, x: Floats, *, from_clipping: bool = False) -> Squares:
        """Squares with F's own gradient at x, (h, w, 3).

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
        return Squares(image, self.importance[..., None] * factor, share)

    def _of_strip(
        self,
        x: Floats,
        wanted: Floats,
        current: Floats,
        exceeds: Bools,
        q: Floats,
        *,
        from_clipping: bool,
    ) -> tuple[Floats, Floats, Floats]:
        """image, factor and share of some pixels, (p, 3) each. As of `squares`."""
        if self.transform is None:
            counts = (1 - q) * ~exceeds
            factor, gradient = counts + q, counts * (wanted - x) + q * (current - x)
            from_current = q * np.ones(3)
        else:
            own, shown = self.transform.jacobian(x), self.transform.encode(x)
            factor, gradient, from_current = np.zeros((3, *x.shape))
            for part, goal, moves in ((1 - q, wanted, exceeds), (q, current, None)):
                if not part.any():
                    continue
                missed = self.transform.encode(goal) - shown
                slope = _with_chords(own, missed, goal - x) if from_clipping else own
                if moves is not None and moves.any():
                    # What is wanted there moves along with x.
                    slope = slope - self.transform.jacobian(goal) * moves[:, None, :]
                gradient += part * np.einsum("pkc,pk->pc", slope, missed)
                # The squares of channels that the transform mixes, from above by those of single
                # ones.
                mixed = np.einsum("pkc,pkd->pcd", slope, slope)
                factor += part * np.abs(mixed).sum(axis=-1)
            if q.any():
                steep = np.einsum("pkc,pkc->pc", own, self.transform.jacobian(current))
                from_current = q * steep
        some = factor > 0
        safe = np.where(some, factor, 1)
        image = x + np.where(some, gradient / safe, 0)
        return image, factor, np.where(some, from_current / safe, 0)

    def _exceeds(self, x: Floats) -> Bools:
        return self.at_least & (x > self.painted) if self._may_exceed else self.at_least

    @cached_property
    def _may_exceed(self) -> bool:
        return bool(self.at_least.any())

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
        apart = np.where(self.at_least & (self.current >= self.painted), 0, apart)
        return np.asarray(q * (1 - q) * apart)


#: F, of pictures x, (h, w, 3) linear; seen through its transform, or as linear light.
Loss = Squares | PaintingLoss


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
