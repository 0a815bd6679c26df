"""The pixels that count, with each light's part of them: the data of a descent."""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import Planes
from lightpaint.lighting.loss.loss import Loss, PixelLoss
from lightpaint.lighting.normal_equations import NormalEquations

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

    def predicted(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i, (3, p), in float64: a float32's round-off would hide the last steps."""
        picture = np.empty((3, len(self.pixels)))

        def mix(strip: slice, _: PixelLoss) -> None:
            lit = self.planes.pixels(strip)
            for c in range(3):
                picture[c, strip] = weights[:, c] @ lit[..., c].astype(np.float64)

        self.pixels.map_strips(mix)
        return picture

    def objective_and_gradient(self, weights: Doubles) -> tuple[float, Doubles]:
        """Return the loss of weights, (n, 3), and half its gradient, (n, 3)."""

        def strip_terms(strip: slice, pixels: PixelLoss) -> tuple[float, Doubles]:
            rows = self.planes.pixels(strip).transpose(2, 0, 1).astype(np.float64, order="C")
            x = np.stack([w @ lit for w, lit in zip(weights.T, rows, strict=True)])
            value, slope = pixels.objective_and_gradient(x)
            return value, np.stack([lit @ s for lit, s in zip(rows, slope, strict=True)], axis=1)

        values, slopes = zip(*self.pixels.map_strips(strip_terms), strict=True)
        return sum(values), np.asarray(sum(slopes))

    def slope(self, image: Doubles, weight: Doubles, x: Doubles, ahead: Doubles) -> float:
        """Return half of the slope at which Σ weight (image − x)² falls at x on the way to
        `ahead`."""

        def strip_slope(strip: slice, _: PixelLoss) -> float:
            here_x = x[:, strip]
            return float(
                (weight[:, strip] * (image[:, strip] - here_x) * (ahead[:, strip] - here_x)).sum()
            )

        return sum(self.pixels.map_strips(strip_slope))

    def equations(self, image: Doubles, weight: Doubles) -> NormalEquations:
        """Return the linear problem of squares, (3, p) each."""
        shape = (*self.planes.size, 3)
        picture, weights = image.T.reshape(shape), weight.T.reshape(shape)
        return NormalEquations(*self.planes.sums(weights, picture))
