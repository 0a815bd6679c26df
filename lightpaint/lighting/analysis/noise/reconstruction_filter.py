"""The Gaussian reconstruction filter that Mitsuba's film has by default, in place of a box."""

import math

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.lighting.solution import Solution

#: Share of Mitsuba's Gaussian, whose standard deviation is half a pixel, that lies in each of both
#: neighbours along an axis: beyond one standard deviation.
TAP = (1 - math.erf(math.sqrt(0.5))) / 2


def added_by_filter(solution: Solution, image: Floats) -> Doubles:
    """Return what the filter adds to a picture of all views with a box filter, (p, 3)."""
    views, size = solution.problem.views, solution.importance.shape
    parts = [views.part(image.reshape(*size, 3), k).astype(np.float64) for k in range(len(views))]
    return np.asarray(views.join([filtered(x) - x for x in parts]).reshape(-1, 3))


def filtered(image: Doubles) -> Doubles:
    """Return a picture with a box filter, (h, w, …), with a Gaussian one."""
    for axis in (0, 1):
        lines = np.moveaxis(image, axis, 0)
        wide = np.concatenate([lines[:1], lines, lines[-1:]])
        image = np.moveaxis((1 - 2 * TAP) * lines + TAP * (wide[:-2] + wide[2:]), 0, axis)
    return image
