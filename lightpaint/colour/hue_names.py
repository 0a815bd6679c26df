"""Everyday names for colours of light."""

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.color_difference import lab

#: Maximum distance from Planck's locus, and minimum temperature, of light that is called white.
WHITE_DUV, WARMEST = 0.015, 2100.0

#: Temperatures in kelvin below which white is warm, and above which it is cool.
WARM, COOL = 3700.0, 7500.0

#: Upper end of the range of each name, as a hue angle of CIE L*a*b* in degrees.
HUES = (
    (20.0, "pink"),
    (55.0, "red"),
    (80.0, "orange"),
    (112.0, "yellow"),
    (170.0, "green"),
    (235.0, "turquoise"),
    (308.0, "blue"),
    (340.0, "purple"),
    (360.0, "pink"),
)


def hue_name(rgb: Floats) -> str:
    """Return the everyday name of a light's colour, such as `warm white` or `green`.

    rgb: (3,) linear Rec.709, of any brightness but black.
    """
    scaled_rgb = np.asarray(rgb, np.float64) / np.max(rgb)
    temperature = cct_and_duv(scaled_rgb)
    if temperature is not None and abs(temperature[1]) <= WHITE_DUV and temperature[0] >= WARMEST:
        return (
            "warm white"
            if temperature[0] < WARM
            else "cool white"
            if temperature[0] > COOL
            else "white"
        )
    _, a, b = lab(scaled_rgb)
    angle = float(np.degrees(np.arctan2(b, a))) % 360
    return next(word for end, word in HUES if angle <= end)
