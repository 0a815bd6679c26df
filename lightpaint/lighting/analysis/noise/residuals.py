"""The residual of an answer, the noise of its prediction, and the grain of its painting.

A render that serves as a painting has noise, which no lights make and no brush paints. A second
difference along both axes,

    a = N r,  N = [1 −2 1]ᵀ [1 −2 1],

ignores smooth parts, and straight edges along an axis. Noise that is independent between pixels
gives it the variance 36 σ² and no correlation at a distance: E[a(x) a(x + d)] = 0. An edge or a
stroke continues there, so these products are subtracted.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.images import box_mean, enlarged
from lightpaint.lighting.solution import Solution

_Kind = TypeVar("_Kind", bound=np.generic)

#: Σ N², the variance of a for noise of variance 1.
POWER = 36.0

#: Pixels along the sides of blocks, and blocks on either side, over which products are averaged.
BLOCK, BLOCKS_AROUND = 8, 2

#: Largest ⟨a²⟩ / ⟨|a|⟩² of noise: π/2 if it is normal, more with fireflies. A painted lamp of a few
#: pixels, alone on dark ground, is far beyond.
MAX_PEAK = 12.0

#: Largest ratio of noise from taps two pixels apart to noise from neighbours, in the whole picture
#: and in a block. Mitsuba's Gaussian filter correlates neighbours: 2.3 to 3.7 times, and 5 in
#: blocks. Paint has wider edges: 4.3 times and more.
MAX_RATIO, MAX_BLOCK_RATIO = 4.0, 6.0


@dataclass(frozen=True)
class Residuals:
    """The residual of an answer, and the noise of its prediction, for any pixels.

    The noise is Σ w_i h_i minus the part that Ψ shares where it equals the current look.

    image: (p, 3), Ψ. predicted: (p, 3), Σ w_i Φ_i. half: (p, 3), Σ w_i h_i. current: (p, 3), noise
    of the current look; None where nothing follows it. share: (p, 1) or (p, 3), as far as it does;
    None where `half` has that already.
    """

    image: Floats
    predicted: Floats
    half: Floats
    current: Floats | None
    share: Floats | None

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
        shared = share.reshape(-1, share.shape[2]) if is_shared else None
        return cls(image, mixed, half, current, shared)

    def residual(self, pixels: slice | Indices) -> Doubles:
        """Return Ψ − Σ w_i Φ_i of some pixels, (p, 3)."""
        return self.image[pixels].astype(np.float64) - self.predicted[pixels]

    def noise(self, pixels: slice | Indices) -> Doubles:
        """Return the half difference of the prediction at some pixels, (p, 3)."""
        half = self.half[pixels].astype(np.float64)
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
    a, whole = residual.astype(np.float64), counted
    for axis in (0, 1):
        first, middle, last = _taps(a, step, axis)
        a = first - 2 * middle
        a += last
        whole = np.logical_and.reduce(_taps(whole, step, axis))
    a *= whole
    products = np.square(a)
    for window, shifted in _distant_windows(3 * step):
        pairs = a[window] * a[shifted]
        pairs /= 2
        products[window] -= pairs
        products[shifted] -= pairs
    share = np.maximum(_neighbourhood_means(whole.astype(np.float64)), 1e-12)
    power = _neighbourhood_means(products) / share
    size = _neighbourhood_means(np.abs(a, out=products)) / share
    variance = np.clip(power, 0, MAX_PEAK * np.square(size)) / POWER
    variance = enlarged(variance, BLOCK)[: a.shape[0], : a.shape[1]]
    # The border gets the values beside it.
    return np.pad(variance, step, mode="edge")


def _taps(image: npt.NDArray[_Kind], step: int, axis: int) -> list[npt.NDArray[_Kind]]:
    """Return `image` three times, `step` pixels apart along an axis."""
    lines = np.moveaxis(image, axis, 0)
    length = len(lines) - 2 * step
    return [np.moveaxis(lines[k * step :][:length], 0, axis) for k in range(3)]


def _distant_windows(distance: int) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Yield windows at this distance from each other: across, down and along both diagonals."""
    first, last, whole = slice(None, -distance), slice(distance, None), slice(None)
    yield (whole, first), (whole, last)
    yield (first, whole), (last, whole)
    yield (first, first), (last, last)
    yield (first, last), (last, first)


def _neighbourhood_means(image: Doubles) -> Doubles:
    """Return the mean over each block and those around it; the last block may be cut."""
    rows, columns = (np.arange(0, length, BLOCK) for length in image.shape)
    sums = np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1)
    return np.asarray(box_mean(sums, BLOCKS_AROUND), np.float64)
