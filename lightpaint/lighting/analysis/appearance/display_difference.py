"""How far a picture looks from what was painted: CIEDE2000 over the paint, as displayed."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.planes import Planes
from lightpaint.colour.color_difference import ciede2000, lab
from lightpaint.colour.display.exposure import choose_exposure
from lightpaint.colour.display.srgb import decode_display
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.loss.painting import brighter_will_do, painted_light
from lightpaint.lighting.problem import Problem

#: Painted pixels that are looked at, and pixels of each side of a block that noise is averaged in.
LOOKED_AT, BLOCK = 2**15, 8


@dataclass(frozen=True)
class Looking:
    """What was painted, as far as it is looked at: every `step`-th pixel of each side.

    painted: (h, w, 3) linear. at_least: (h, w, 3), where brighter is as good. weight: (h, w), the
    importance. transform: through which a display shows it. compared: that through which the fit
    compares it; None in linear light.
    """

    painted: Floats
    at_least: Bools
    weight: Doubles
    step: int
    transform: ViewTransform
    compared: ViewTransform | None = None

    @staticmethod
    def at(problem: Problem, *, most: int = LOOKED_AT) -> "Looking":
        """At the painting of a problem, of all its views together. most: pixels, about."""
        views = problem.views
        weight = views.join([target.importance for target in views.targets]).astype(np.float64)
        step = max(int(np.sqrt((weight > 0).sum() / most)), 1)
        if not weight[::step, ::step].any():
            step = 1
        every = (slice(None, None, step), slice(None, None, step))
        return Looking(
            painted_light(views)[every],
            brighter_will_do(views)[every],
            weight[every],
            step,
            transform_of(problem),
            problem.loss.transform,
        )

    @cached_property
    def counts(self) -> Bools:
        """(h, w), what was painted."""
        return self.weight > 0

    def of(self, image: Floats) -> Doubles:
        """(p, 3), the painted pixels of a whole picture (H, W, 3)."""
        return image[:: self.step, :: self.step][self.counts].astype(np.float64)

    def rows(self, planes: Planes) -> Floats:
        """(n, p, 3), the painted pixels of whole pictures (H, W, 3)."""
        return np.stack([x[:: self.step, :: self.step][self.counts] for x in planes])

    def meant(self, pixels: Doubles) -> Doubles:
        """(p, 3), the paint, or light `pixels` (p, 3) where brighter is as good."""
        painted = self.painted[self.counts]
        brighter = self.at_least[self.counts] & (pixels > painted)
        return np.asarray(np.where(brighter, pixels, painted), np.float64)

    def missed(self, pixels: Doubles) -> Doubles:
        """(p,), how far light (p, 3) looks from the paint."""
        return ciede2000(self.lab(pixels), self.lab_meant(pixels))

    def costs(self, pixels: Doubles) -> Doubles:
        """Return what light x, (p, 3), misses of the paint in the fit, (p,): ‖V(ψ) − V(x)‖².

        Importance is not in it.
        """
        missed = self.compare(self.meant(pixels)) - self.compare(pixels)
        return np.asarray(np.square(missed).sum(axis=-1))

    def compare(self, pixels: Doubles) -> Doubles:
        """V of light (p, 3): what the fit compares."""
        encoded = pixels if self.compared is None else self.compared.encode(pixels)
        return np.asarray(encoded, np.float64)

    def lab(self, pixels: Doubles) -> Doubles:
        """L*a*b* (p, 3) of what a display shows of light (p, 3)."""
        if self.transform.name == "srgb":  # encoded and decoded, it is the light itself
            return lab(np.clip(pixels * 2.0**self.transform.stops, 0, 1))
        return lab(decode_display(self.transform.encode(pixels)))

    def lab_meant(self, pixels: Doubles) -> Doubles:
        """L*a*b* (p, 3) of `meant`."""
        return self.lab(self.meant(pixels)) if self._moves else self._painted_lab

    @cached_property
    def _moves(self) -> bool:
        """Whether what is meant follows the light anywhere."""
        return bool(self.at_least[self.counts].any())

    @cached_property
    def _painted_lab(self) -> Doubles:
        return self.lab(self.painted[self.counts].astype(np.float64))

    def mean(self, values: Doubles) -> float:
        """Of the painted pixels, (p,), weighted by importance."""
        return float(np.average(values, weights=self.weight[self.counts]))

    def in_blocks(self, values: Doubles) -> Doubles:
        """(rows, columns, …), means of (p, …) over the paint of each block; 0 where is none."""
        weight = self.weight[self.counts].reshape(-1, *[1] * (values.ndim - 1))
        sums, total = self._sums(weight * values), self.block_weights
        total = total.reshape(*total.shape, *[1] * (values.ndim - 1))
        return np.asarray(sums / np.where(total > 0, total, 1))

    def of_blocks(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(p,), what each painted pixel has of its block's values, (rows, columns)."""
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
        """Top, left, bottom and right of a block, in pixels of the whole picture."""
        top, left = (self.step * BLOCK * k for k in (row, column))
        ends = zip((top, left), self.weight.shape, strict=True)
        bottom, right = (self.step * min(start // self.step + BLOCK, n) for start, n in ends)
        return top, left, bottom, right


def transform_of(problem: Problem) -> ViewTransform:
    """What the painting is seen through or, where it holds light, sRGB that shows something."""
    target = problem.views.targets[0]
    known = problem.fit.transform or target.transform
    if known is not None:
        return known
    return ViewTransform("srgb", choose_exposure(target.image[target.importance > 0][None]))


def _starts(length: int) -> npt.NDArray[np.int_]:
    return np.arange(0, length, BLOCK)
