"""Names that people have for colours of light."""

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.color_difference import lab

#: Distance from Planck's locus, and lowest temperature, of what is called white.
WHITE_DUV, WARMEST = 0.015, 2100.0

#: Temperatures up to which white is warm, and from which on it is cool.
WARM, COOL = 3700.0, 7500.0

#: Hue angles of CIE L*a*b*, in degrees, at which words end.
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


def spoken_hue(rgb: Floats) -> str:
    """`warm white`, `green`: a colour of light, (3,) linear Rec.709, however bright; not black."""
    shown = np.asarray(rgb, np.float64) / np.max(rgb)
    seen = cct_and_duv(shown)
    if seen is not None and abs(seen[1]) <= WHITE_DUV and seen[0] >= WARMEST:
        return "warm white" if seen[0] < WARM else "cool white" if seen[0] > COOL else "white"
    _, a, b = lab(shown)
    angle = float(np.degrees(np.arctan2(b, a))) % 360
    return next(word for end, word in HUES if angle <= end)
