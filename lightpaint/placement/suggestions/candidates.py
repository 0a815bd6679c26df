"""A solved problem and the images of candidate lights, at one size.

All images come in two halves of the samples, so that results of one can be tested on the other (see
additions.py).
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import mix
from lightpaint.errors import SizeError
from lightpaint.images.pixel_blocks import block_mean, whole_factor
from lightpaint.lighting.normal_equations import NormalEquations, inner_products
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.look_goals import pull_with_more, reduced_goal
from lightpaint.threads import one_thread


@dataclass(frozen=True)
class Candidates:
    """A solved problem, and images of candidate lights, all of one size.

    pictures, noise: (n + m, h, w, 3), the n lights of the basis and m candidates at unit emission,
    and half the differences of halves of their samples. halves: (n + m, 2), shares of the
    samples in half A and B. image, (h, w, 3), and importance, (h, w, 1 or 3): the goal; after
    reweighting, that of the last linear problem. reduction: the unknowns of the n lights. pull: of
    `prefer current`, for these.
    """

    pictures: Floats
    noise: Floats
    halves: Doubles
    image: Floats
    importance: Floats
    reduction: Reduction
    pull: NormalEquations | None
    count: int

    @classmethod
    def of(cls, basis: Basis, solution: Solution, added: Basis) -> "Candidates":
        """Make candidates. added: their images, of the size of `basis`, or of blocks of its pixels.

        Fixed lights in it are no candidates. Raises SizeError for other sizes.
        """
        size = added.size
        factor = whole_factor(basis.size, size)
        if factor is None:
            raise SizeError(
                f"candidates of {size[1]}x{size[0]} for a basis of {basis.size[1]}x"
                f"{basis.size[0]}: render them on blocks of its pixels"
            )
        image, importance, _ = reduced_goal(solution.problem, factor)
        free = ~added.is_fixed
        count = int(free.sum())
        pictures, noise = (
            np.stack(
                [block_mean(plane, factor) for plane in planes]
                + [plane for plane, is_free in zip(new_planes, free, strict=True) if is_free]
            )
            for planes, new_planes in ((basis.planes, added.planes), (basis.noise, added.noise))
        )
        return cls(
            pictures,
            noise,
            np.concatenate([_shares(basis, len(basis.lights)), _shares(added, count)]),
            image,
            importance,
            _with_free_lights(solution.problem.local_reduction, count),
            pull_with_more(solution, count),
            count,
        )

    @property
    def lights(self) -> int:
        """The number n of lights of the basis."""
        return len(self.pictures) - self.count

    def picture(self, weights: Doubles) -> Floats:
        """Return Σ w_i Φ_i, (h, w, 3). weights: (n + m, 3)."""
        return mix(self.pictures, weights)

    def half(self, k: int) -> Floats:
        """Return the images of half A (0) or B (1) of the samples."""
        sign = 1 if k == 0 else -1
        scale = sign * 2 * self.halves[:, 1 - k]
        return np.asarray(self.pictures + self.noise * _column(scale), np.float32)

    def noise_of_half(self, k: int) -> Floats:
        """Return images whose squares are the variance of `half(k)`."""
        return np.asarray(self.noise * _column(2 * np.sqrt(self.halves[:, 1 - k])), np.float32)

    def equations(self, images: Floats) -> NormalEquations:
        """Return the equations of these images with the goal."""
        with one_thread():
            return NormalEquations(*inner_products(images, self.image, self.importance))


def _with_free_lights(reduction: Reduction, count: int) -> Reduction:
    """Return `reduction` with that many lights more, without constraints."""
    n = len(reduction.fixed_weights)
    more = tuple(Knob.of_any_colour(k) for k in range(n, n + count))
    return Reduction(
        np.vstack([reduction.fixed_weights, np.zeros((count, 3))]),
        (*reduction.labels, *[""] * count),
        (*reduction.knobs, *more),
    )


def _shares(basis: Basis, count: int) -> Doubles:
    """Return the shares of half A and B in the samples, (count, 2)."""
    a, b = basis.origin.halves
    return np.tile([a / (a + b), b / (a + b)], (count, 1))


def _column(values: Doubles) -> Doubles:
    return values[:, None, None, None]
