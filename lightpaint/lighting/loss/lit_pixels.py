"""The pixels that count, with each light's part of them: the data of a descent."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis import Basis, Planes, mix_channels
from lightpaint.lighting.loss.loss import (
    Loss,
    PixelLoss,
    SquaredPixels,
    Squares,
    image_in_place,
)
from lightpaint.lighting.normal_equations import NormalEquations

#: Share of pixels with other squares up to which a problem is updated rather than summed anew.
MAX_UPDATED_SHARE = 0.25

#: Share of pixels without importance from which a copy of the others is worth its time.
MIN_SKIPPED_SHARE = 0.1


@dataclass(frozen=True)
class LitPixels:
    """The loss of some pixels, and the pictures that lights make of them.

    planes: of these pixels. which: (p,), which pixels of a picture they are; None for all.
    """

    planes: Planes
    pixels: PixelLoss
    which: Indices | None = None

    @classmethod
    def whole(cls, basis: Basis, loss: Loss) -> "LitPixels":
        """Return all pixels."""
        return cls(basis.planes, loss.pixels)

    @classmethod
    def of(cls, basis: Basis, loss: Loss) -> "LitPixels":
        """Return the pixels that count."""
        whole = cls.whole(basis, loss)
        counted = np.flatnonzero(whole.pixels.importance)
        if counted.size > (1 - MIN_SKIPPED_SHARE) * len(whole.pixels):
            return whole
        return cls(basis.planes.picked(counted), whole.pixels.subset(counted), counted)

    def summed(self, squares: Squares, equations: NormalEquations) -> "SummedSquares":
        """Return squares of the whole picture, whose problem is known, for these pixels."""
        pixels = squares.pixels
        assert isinstance(pixels, SquaredPixels)
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

        def strip_terms(strip: slice, pixels: PixelLoss) -> tuple[float, Doubles]:
            rows = self.planes.pixels(strip).transpose(2, 0, 1).astype(np.float64, order="C")
            x = np.stack([w @ lit for w, lit in zip(weights.T, rows, strict=True)])
            value, slope = pixels.objective_and_gradient(x)
            return value, np.stack([lit @ s for lit, s in zip(rows, slope, strict=True)], axis=1)

        values, slopes = zip(*self.pixels.map_strips(strip_terms), strict=True)
        return sum(values), np.asarray(sum(slopes))

    def products(self, picture: Doubles) -> Doubles:
        """Return the inner products of each light with a picture (3, p), (n, 3)."""

        def strip_products(strip: slice, _: PixelLoss) -> Doubles:
            rows = self.planes.pixels(strip)
            return np.stack(
                [rows[..., c].astype(np.float64) @ picture[c, strip] for c in range(3)], axis=1
            )

        return np.asarray(sum(self.pixels.map_strips(strip_products)))

    def slope(self, image: Doubles, weight: Doubles, x: Doubles, ahead: Doubles) -> float:
        """Return half of the slope at which Σ weight (image − x)² falls at x on the way to
        `ahead`."""

        def strip_slope(strip: slice, _: PixelLoss) -> float:
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


class DeferredSquares(Squares):
    """The squares of a loss at one picture, made when they are asked for, until they are released.

    They are as large as several pictures, and most answers need only their sums.
    """

    def __init__(self, lit: LitPixels, weights: Doubles) -> None:
        """Keep the source of the squares. lit: of all pixels. weights: (n, 3), of the picture."""
        self._lit, self._weights = lit, weights

    @cached_property
    def _arrays(self) -> tuple[Doubles, Doubles, Doubles]:
        x, pixels = self._lit.predicted(self._weights), self._lit.pixels
        image, weight = pixels.squares(x, from_clipping=False)
        size = self._lit.planes.size
        shares = pixels.shares(x, weight)
        return (
            image_in_place(image, size),
            image_in_place(weight, size),
            image_in_place(shares, size),
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
