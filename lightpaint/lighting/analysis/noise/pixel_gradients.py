"""The gradient of a loss by the light of each pixel, without the bias that noise gives it.

The gradient by the weights is Σ Φᵢ G(x), with half the negative gradient G of the loss by the light
x of a pixel. For squares G = D (Ψ − x) is straight, and errors of x cancel in the mean. Where the
loss compares what a display shows, G is bent: slope, residual and clipping follow from the same
noisy x, and a pixel that is too dark by chance weighs more than one that is too bright. The tangent
of G at a steadier light x̃, which the neighbours give, is straight in x again:

    G(x̃) + G′(x̃) (x − x̃)

Where x̃ is not the true light, the tangent is wrong to second order only (docs/method.md).
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.images import box_mean
from lightpaint.lighting.analysis.noise.residuals import Residuals
from lightpaint.lighting.loss.loss import PixelLoss, planes_of
from lightpaint.lighting.solution import Solution

#: Pixels on either side whose mean steadies the light of a pixel, and over which its noise and the
#: change of light are compared.
BESIDE, WINDOW = 1, 3

#: Step of the differences that stand for derivatives, relative to the light of a pixel.
STEP = 1e-2


@dataclass(frozen=True)
class PixelGradients:
    """Half the negative gradient of the loss by the light of each pixel, at an answer.

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
        pixels, look = problem.loss.pixels, None
        light = _Steadied.of(solution, residuals.predicted, residuals.half)
        if residuals.current is not None:
            shown = solution.basis.current_look.reshape(-1, 3)
            look = _Steadied.of(solution, shown, residuals.current)
        tangent = _Tangent(pixels, light, look)
        whole, start = _gradient(pixels, planes_of(residuals.predicted)), tangent.start()
        mean = start + tangent.along([x.distance for x in tangent.pictures])
        half = tangent.along([x.noise for x in tangent.pictures])
        left = [x.noise_left for x in tangent.pictures]
        ends = [tangent.at([sign * x for x in left]) for sign in (1, -1)]
        doubt = (ends[0] + ends[1]) / 2 - start
        return cls(mean.T, half.T, (whole - mean).T, doubt.T)


@dataclass(frozen=True)
class _Steadied:
    """A picture and its steadier light, (3, p) each.

    steady: the steadier light. distance: of the picture from it. noise: half differences of the
    picture. noise_left: those of the light between both that the steadier light does not average.
    """

    steady: Doubles
    distance: Doubles
    noise: Doubles
    noise_left: Doubles

    @classmethod
    def of(cls, solution: Solution, light: Floats, noise: Floats) -> "_Steadied":
        """Steady a picture of all views. light: (p, 3); noise: (p, 3), its half differences."""
        views, size = solution.problem.views, solution.importance.shape
        counted = (solution.importance > 0).astype(np.float64)[..., None]
        pictures = light.reshape(*size, 3), noise.reshape(*size, 3), counted
        parts = []
        for k in range(len(views)):
            image, half, counts = (views.part(x, k).astype(np.float64) for x in pictures)
            parts.append(steadier_light(image, half, counts))
        steady, share = (planes_of(views.join(x)) for x in zip(*parts, strict=True))
        own = planes_of(noise)
        return cls(steady, planes_of(light) - steady, own, np.sqrt(1 - np.square(share)) * own)


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
        """Return the change of the tangent, (3, p), with those of the pictures, (3, p) each."""
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


def steadier_light(light: Doubles, noise: Doubles, counted: Doubles) -> tuple[Doubles, Doubles]:
    """Return light moved towards the mean of its neighbours as far as only noise differs there,
    and the share of the way that it moves, (h, w, 3) each.

    The share is V / (V + B) with the variance V and the squared change B around the pixel, without
    the pixel itself: how far it moves does not depend on its own noise.

    light, noise: (h, w, 3), an image and its half differences. counted: (h, w, 1), 1 for pixels
    that count as neighbours, else 0.
    """
    beside, noise_beside = (_mean_beside(x, counted, BESIDE) for x in (light, noise))
    variance = np.square(noise)
    change = np.square(light - beside) - variance - np.square(noise_beside)
    V, B = (_mean_beside(x, counted, WINDOW) for x in (variance, change))
    total = V + np.maximum(B, 0)
    share = np.divide(V, total, out=np.zeros_like(V), where=V > 0)
    return np.asarray(light + share * (beside - light)), share


def _mean_beside(image: Doubles, counted: Doubles, radius: int) -> Doubles:
    """Return the mean of the pixels around each one, or the pixel itself where none counts."""
    margin = ((radius, radius), (radius, radius), (0, 0))
    inner, area = slice(radius, -radius), (2 * radius + 1) ** 2

    def sum_beside(own: Doubles) -> Doubles:
        return np.asarray(area * box_mean(np.pad(own, margin), radius)[inner, inner] - own)

    sums, counts = sum_beside(image * counted), np.rint(sum_beside(counted))
    return np.where(counts > 0, sums / np.where(counts > 0, counts, 1), image)
