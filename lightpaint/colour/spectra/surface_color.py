"""Colours of surfaces under a light, as eyes see them that are used to it."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.primaries import REC709, adaptation, rgb_to_xyz
from lightpaint.colour.spectra.spectrum import xyz_of_powers


def adapted_color(powers: Doubles, reflectance: Doubles) -> Doubles:
    """Return linear Rec.709 (3,) of a surface, as a display shows it; white is 1.

    powers: (81,), of the light. reflectance: (81,). The light is adapted to D65 (Bradford), so
    that a white surface is white.
    """
    white, color = xyz_of_powers(powers), xyz_of_powers(powers * reflectance)
    to_rgb = np.linalg.inv(rgb_to_xyz(REC709))
    d65 = rgb_to_xyz(REC709).sum(axis=1)
    adapted = adaptation(white / white[1], d65) @ (color / white[1])
    return np.asarray(to_rgb @ adapted)
