"""Tables on the device of the texels of a sky that are split again.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats
from lightpaint.scene.lights.texels.texel_layout import RATIO, TexelLayout

#: Number of a texel where there is none.
NO_TEXELS = np.uint32(2**32 - 1)


class GridCorners:
    """The four places of a grid around one, with their weights.

    left, top: column and row of the first, of which the column may be outside. right, lower: the
    distance from there, in columns and rows.
    """

    def __init__(self, left, top, right, lower) -> None:
        self.left, self.top = left, top
        self.weights = [
            [(1 - right) * (1 - lower), (1 - right) * lower],
            [right * (1 - lower), right * lower],
        ]

    def __iter__(self) -> Iterator[tuple[Any, Any, Any]]:
        """Yield column, row and weight of each."""
        for x in range(2):
            for y in range(2):
                yield self.left + x, self.top + y, self.weights[x][y]


class FinerTexels:
    """The texels of a sky on finer grids; see TexelLayout.

    instance: of its emitter. first: number of the first of them. even: (rows, columns), the image
    that is sampled.
    """

    def __init__(self, instance: int, layout: TexelLayout, first: int, even: Floats) -> None:
        self._instance, self._layout = instance, layout
        self._even = mi.Float(even.ravel())
        self._numbers = []
        finer = [node for node in layout.nodes if node[0]]
        for level in range(1, layout.level + 1):
            columns, rows = layout.grid(level)
            numbers = np.full((rows, columns), NO_TEXELS)
            for k, (its_level, column, row) in enumerate(finer):
                if its_level == level:
                    numbers[row, column] = first + k
            self._numbers.append(mi.UInt32(numbers.ravel()))

    def coarser(self, instance, across, down, coarsest, active):
        """Return the finer texels around a place, the factor of its light, and the corners of the
        coarsest grid with the weights that remain for these.

        across, down: the place on the coarsest grid. coarsest: the corners there. The first result
        is a list of texel, weight and mask; the factor makes up for the brightness of the even
        image.
        """
        is_its = active & (instance == mi.UInt32(self._instance))
        for _ in self._numbers:
            across, down = dr.fma(across, RATIO, 1), down * RATIO
        rows = self._layout.finest[1]
        left, top = dr.floor(across), dr.clip(dr.floor(down), 0, rows - 2)
        corners = GridCorners(mi.Int32(left), mi.Int32(top), across - left, down - top)
        unit = dr.select(is_its, dr.rcp(self._brightness(corners, is_its)), 1)
        found = []
        for level in range(self._layout.level, 0, -1):
            found += self._taken(corners, level, is_its)
            corners = self._passed_on(corners, level)
        return found, unit, _merged(corners, coarsest, is_its)

    def _index(self, column, row, level: int):
        """Return the index of a place of a grid, whose columns wrap around."""
        columns = self._layout.grid(level)[0]
        column = dr.select(column < 0, column + columns, column)
        column = dr.select(column >= columns, column - columns, column)
        return mi.UInt32(row * columns + column)

    def _brightness(self, corners, active):
        """Return the brightness of the even image at a place."""
        level, total = self._layout.level, mi.Float(0)
        for column, row, weight in corners:
            index = self._index(column, row, level)
            total += weight * dr.gather(mi.Float, self._even, index, active)
        return total

    def _taken(self, corners, level: int, active):
        """Return the texels at some corners, and set the weights there to 0."""
        found = []
        for k, (column, row, weight) in enumerate(list(corners)):
            index = self._index(column, row, level)
            texel = dr.gather(mi.UInt32, self._numbers[level - 1], index, active)
            is_there = active & (texel != mi.UInt32(NO_TEXELS))
            found.append((texel, weight, is_there & (weight > 0)))
            corners.weights[k // 2][k % 2] = dr.select(is_there, 0, weight)
        return found

    def _passed_on(self, corners, level: int):
        """Return the corners on the next coarser grid, with the weights that remain."""
        rows = self._layout.grid(level - 1)[1]
        # Columns before the first are negative, and division is towards 0.
        left = (corners.left + (RATIO - 1)) // RATIO - 1
        top = dr.minimum(corners.top // RATIO, rows - 2)
        coarser = GridCorners(left, top, mi.Float(0), mi.Float(0))
        coarser.weights = [[mi.Float(0), mi.Float(0)], [mi.Float(0), mi.Float(0)]]
        for column, row, weight in corners:
            beside = mi.Float(column - (RATIO * left + 1)) / RATIO
            below = mi.Float(row - RATIO * top) / RATIO
            for x, share in enumerate((1 - beside, beside)):
                for y, part in enumerate((1 - below, below)):
                    coarser.weights[x][y] = dr.fma(weight * share, part, coarser.weights[x][y])
        return coarser


def _merged(corners, others, is_its):
    """Return `corners` where `is_its`, and `others` elsewhere."""
    merged = GridCorners(
        dr.select(is_its, corners.left, others.left),
        dr.select(is_its, corners.top, others.top),
        mi.Float(0),
        mi.Float(0),
    )
    merged.weights = [
        [dr.select(is_its, corners.weights[x][y], others.weights[x][y]) for y in range(2)]
        for x in range(2)
    ]
    return merged
