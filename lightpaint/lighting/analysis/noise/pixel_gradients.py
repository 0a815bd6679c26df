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
from lightpaint.images.estimate import box_mean
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
    its own tangent.
    """

    mean: Doubles
    half: Doubles
    bend: Doubles | None = None

    @classmethod
    def of(cls, solution: Solution, residuals: Residuals) -> "PixelGradients":
        """Return the gradients at the weights of a solution."""
        problem, everything = solution.problem, slice(None)
        if problem.is_linear or problem.refinement is not None:
            weight = problem.squares.weight
            D = weight.reshape(-1, weight.shape[2]).astype(np.float64)
            return cls(D * residuals.residual(everything), -D * residuals.noise(everything))
        pixels = problem.loss.pixels
        light, change, steady = _steadied(solution, residuals.predicted, residuals.half)
        tangent = _Tangent(pixels, steady)
        look = look_change = None
        if residuals.current is not None:
            shown = solution.basis.current_look.reshape(-1, 3)
            look, look_change, steady = _steadied(solution, shown, residuals.current)
            tangent = _Tangent(pixels, tangent.light, steady)
            look -= steady
        whole = _gradient(pixels, light)
        light -= tangent.light
        mean = tangent.start() + tangent.along(light, look)
        return cls(mean.T, tangent.along(change, look_change).T, (whole - mean).T)


@dataclass(frozen=True)
class _Tangent:
    """The tangent of G at some light, (3, p), and at a current look, if the loss depends on one."""

    pixels: PixelLoss
    light: Doubles
    look: Doubles | None = None

    def start(self) -> Doubles:
        """Return G where the tangent touches it, (3, p)."""
        return self._at(0.0, self.light, self.look)

    def along(self, change: Doubles, look_change: Doubles | None) -> Doubles:
        """Return the change of the tangent with changes of the light and of the look, (3, p)."""
        changes = [change] if look_change is None else [change, look_change]
        size = np.max([np.abs(x).max(axis=0) for x in changes], axis=0)
        step = STEP * self.light.max(axis=0) / np.where(size > 0, size, 1)
        above, below = (self._at(sign * step, change, look_change) for sign in (1, -1))
        return np.asarray((above - below) / np.where(step > 0, 2 * step, 1))

    def _at(self, step: Doubles | float, change: Doubles, look_change: Doubles | None) -> Doubles:
        """Return G after `step` of the changes."""
        pixels = self.pixels
        if self.look is not None and look_change is not None:
            pixels = pixels.over_look(self.look + step * look_change)
        return _gradient(pixels, self.light + step * change)


def _gradient(pixels: PixelLoss, light: Doubles) -> Doubles:
    """Return G of light, (3, p) each."""
    image, weight = pixels.squares(light, from_clipping=False)
    image -= light
    image *= weight
    return image


def _steadied(solution: Solution, light: Floats, noise: Floats) -> tuple[Doubles, Doubles, Doubles]:
    """Return light, its half differences and the steadier light of all views, (3, p) each.

    light, noise: (p, 3).
    """
    views, size = solution.problem.views, solution.importance.shape
    counted = (solution.importance > 0).astype(np.float64)[..., None]
    pictures = light.reshape(*size, 3), noise.reshape(*size, 3), counted
    parts = []
    for k in range(len(views)):
        image, half, counts = (views.part(x, k).astype(np.float64) for x in pictures)
        parts.append(steadier_light(image, half, counts))
    return planes_of(light), planes_of(noise), planes_of(views.join(parts))


def steadier_light(light: Doubles, noise: Doubles, counted: Doubles) -> Doubles:
    """Return light moved towards the mean of its neighbours as far as only noise differs there.

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
    return np.asarray(light + share * (beside - light))


def _mean_beside(image: Doubles, counted: Doubles, radius: int) -> Doubles:
    """Return the mean of the pixels around each one, or the pixel itself where none counts."""
    margin = ((radius, radius), (radius, radius), (0, 0))
    inner, area = slice(radius, -radius), (2 * radius + 1) ** 2

    def sum_beside(own: Doubles) -> Doubles:
        return np.asarray(area * box_mean(np.pad(own, margin), radius)[inner, inner] - own)

    sums, counts = sum_beside(image * counted), np.rint(sum_beside(counted))
    return np.where(counts > 0, sums / np.where(counts > 0, counts, 1), image)
