"""Light as a display shows it, in the view of a problem."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import ViewTransform, choose_exposure, decode_display
from lightpaint.lighting.problem import Problem


def display_light(pixels: Doubles, transform: ViewTransform) -> Doubles:
    """Return the light that a display emits for light (..., 3), white = 1."""
    if transform.name == "srgb":  # encoding and decoding cancel
        return np.asarray(np.clip(pixels * 2.0**transform.stops, 0, 1))
    return np.asarray(decode_display(transform.encode(pixels)), np.float64)


def display_transform(problem: Problem) -> ViewTransform:
    """Return the view of the painting or, if it holds light, sRGB at a fitting exposure."""
    target = problem.views.targets[0]
    chosen = problem.fit.transform or target.transform
    if chosen is not None:
        return chosen
    return ViewTransform("srgb", choose_exposure(target.image[target.importance > 0][None]))
