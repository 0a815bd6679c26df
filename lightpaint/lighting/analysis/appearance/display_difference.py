"""The visible difference of a picture from the paint: CIEDE2000, as displayed."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Planes
from lightpaint.colour import ViewTransform, ciede2000, lab
from lightpaint.lighting.loss.painting import at_least_mask, target_light
from lightpaint.lighting.problem import Problem, display_light, display_transform

#: Painted pixels that are compared, and pixels along the side of a block that averages noise.
MAX_COMPARED_PIXELS, BLOCK = 2**15, 8


@dataclass(frozen=True)
class PaintComparison:
    """The compared pixels of a painting: every `step`-th one along each side.

    painted: (h, w, 3) linear. at_least: (h, w, 3), where brighter is as good. weight: (h, w), the
    importance. transform: the view of a display. compared: the view transform of the fit; None in
    linear light.
    """

    painted: Floats
    at_least: Bools
    weight: Doubles
    step: int
    transform: ViewTransform
    compared: ViewTransform | None = None

    @staticmethod
    def of_problem(problem: Problem, *, max_pixels: int = MAX_COMPARED_PIXELS) -> "PaintComparison":
        """Choose pixels of the painting of a problem, in all its views, about `max_pixels`."""
        views = problem.views
        weight = views.join([target.importance for target in views.targets])
        step = max(int(np.sqrt((weight > 0).sum() / max_pixels)), 1)
        if not weight[::step, ::step].any():
            step = 1
        compared = (slice(None, None, step), slice(None, None, step))
        return PaintComparison(
            # Copies, which do not keep the whole pictures.
            target_light(views)[compared].astype(np.float64),
            at_least_mask(views)[compared].copy(),
            weight[compared].astype(np.float64),
            step,
            display_transform(problem),
            problem.loss.transform,
        )

    def within(self, area: Floats) -> "PaintComparison":
        """Return the comparison of a part of the paint, (H, W) from 0 to 1; of all of it if no
        compared pixel lies there.
        """
        weight = self.weight * area[:: self.step, :: self.step]
        return replace(self, weight=weight) if weight.any() else self

    @cached_property
    def counts(self) -> Bools:
        """(h, w), the painted pixels."""
        return self.weight > 0

    def pixels(self, image: Floats) -> Doubles:
        """Return the painted pixels of a whole picture (H, W, 3), (p, 3)."""
        return image[:: self.step, :: self.step][self.counts].astype(np.float64)

    def rows(self, planes: Planes) -> Floats:
        """Return the painted pixels of whole pictures (H, W, 3), (n, p, 3)."""
        return np.stack([x[:: self.step, :: self.step][self.counts] for x in planes])

    def goal(self, pixels: Doubles) -> Doubles:
        """Return the goal, (p, 3): the paint, or light `pixels` (p, 3) where brighter is as
        good."""
        painted = self.painted[self.counts]
        brighter = self.at_least[self.counts] & (pixels > painted)
        return np.asarray(np.where(brighter, pixels, painted), np.float64)

    def difference(self, pixels: Doubles) -> Doubles:
        """Return the difference of light (p, 3) from the paint, CIEDE2000 (p,)."""
        return ciede2000(self.lab(pixels), self.lab_goal(pixels))

    def fit_errors(self, pixels: Doubles) -> Doubles:
        """Return the error of light x, (p, 3), in the fit, (p,): ‖V(ψ) − V(x)‖².

        Importance is not included.
        """
        missed = self.compare(self.goal(pixels)) - self.compare(pixels)
        return np.asarray(np.square(missed).sum(axis=-1))

    def share_removed(self, before: Floats, after: Floats) -> float:
        """Return the share of the error of a whole picture that another does not have.

        before, after: (H, W, 3) linear. Errors are the errors of the fit, with importance. Negative
        if the error grows; 0 without an error before.
        """
        now, then = (self.mean(self.fit_errors(self.pixels(x))) for x in (before, after))
        return 1 - then / now if now > 0 else 0.0

    def compare(self, pixels: Doubles) -> Doubles:
        """Return V of light (p, 3): the values that the fit compares."""
        encoded = pixels if self.compared is None else self.compared.encode(pixels)
        return np.asarray(encoded, np.float64)

    def lab(self, pixels: Doubles) -> Doubles:
        """Return L*a*b* (p, 3) of light (p, 3) on the display."""
        return lab(display_light(pixels, self.transform))

    def lab_goal(self, pixels: Doubles) -> Doubles:
        """Return L*a*b* (p, 3) of the goal."""
        return self.lab(self.goal(pixels)) if self._has_moving_goal else self._painted_lab

    @cached_property
    def _has_moving_goal(self) -> bool:
        """True if the goal follows the light anywhere."""
        return bool(self.at_least[self.counts].any())

    @cached_property
    def _painted_lab(self) -> Doubles:
        return self.lab(self.painted[self.counts].astype(np.float64))

    def mean(self, values: Doubles) -> float:
        """Return the mean of (p,) over the painted pixels, weighted by importance."""
        return float(np.average(values, weights=self.weight[self.counts]))

    def in_blocks(self, values: Doubles) -> Doubles:
        """Return means of (p, …) over the paint of each block, (rows, columns, …); 0 without
        paint."""
        weight = self.weight[self.counts].reshape(-1, *[1] * (values.ndim - 1))
        sums, total = self._sums(weight * values), self.block_weights
        total = total.reshape(*total.shape, *[1] * (values.ndim - 1))
        return np.asarray(sums / np.where(total > 0, total, 1))

    def spread_blocks(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the block's value, of (rows, columns), for each painted pixel, (p,)."""
        height, width = self.weight.shape
        tall = values.repeat(BLOCK, axis=0)[:height]
        return np.asarray(tall.repeat(BLOCK, axis=1)[:, :width][self.counts])

    @cached_property
    def block_weights(self) -> Doubles:
        """(rows, columns), the importance in each block."""
        return self._sums(self.weight[self.counts])

    def _sums(self, values: Doubles) -> Doubles:
        image = np.zeros((*self.weight.shape, *values.shape[1:]))
        image[self.counts] = values
        rows, columns = (_starts(length) for length in self.weight.shape)
        return np.asarray(np.add.reduceat(np.add.reduceat(image, rows, 0), columns, 1))

    def box(self, row: int, column: int) -> tuple[int, int, int, int]:
        """Return top, left, bottom and right of a block, in pixels of the whole picture."""
        top, left = (self.step * BLOCK * k for k in (row, column))
        ends = zip((top, left), self.weight.shape, strict=True)
        bottom, right = (self.step * min(start // self.step + BLOCK, n) for start, n in ends)
        return top, left, bottom, right


def _starts(length: int) -> npt.NDArray[np.int_]:
    return np.arange(0, length, BLOCK)
