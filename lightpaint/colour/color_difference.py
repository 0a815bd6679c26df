"""Visible differences of colours, CIEDE2000 (CIE 142-2001; Sharma, Wu and Dalal 2005), and names
of hues in CIE L*a*b*.

Importing colour-science would take a second, and it takes three times as long per pixel.
"""

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.primaries import REC709

#: 25⁷, the seventh power of the chroma around which its weight levels off.
_SEVENTH = 25.0**7

#: XYZ of linear Rec.709 (SMPTE RP 177, from the primaries), white at Y = 1.
_MATRIX = np.array(
    [
        [0.412390799265959, 0.357584339383878, 0.180480788401834],
        [0.212639005871510, 0.715168678767756, 0.072192315360734],
        [0.019330818715592, 0.119194779794626, 0.950532152249661],
    ]
)

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


def delta_e(a: Floats, b: Floats) -> Floats:
    """Return CIEDE2000, (…,), between two images as shown on a display.

    a, b: (…, 3) linear Rec.709 at the viewing exposure, white = 1. Values outside the display's
    range are clipped, as the display would.
    """
    return ciede2000(lab(np.clip(a, 0, 1)), lab(np.clip(b, 0, 1)))


def lab_of_lights(colors: Doubles) -> Doubles:
    """Return what a white surface looks like in lights, equally bright in all: CIE L*a*b*, (…, 3).

    colors: (…, 3) linear Rec.709, of a luminance > 0; channels may be negative.
    """
    return lab(colors / (colors @ _MATRIX[1])[..., None])


def lab(image: Floats) -> Doubles:
    """Return linear Rec.709 (…, 3), white = 1, as CIE L*a*b* under D65, (…, 3)."""
    x, y = REC709[6:]
    white = np.array([x / y, 1.0, (1 - x - y) / y])
    ratio = np.asarray(image, np.float64) @ (_MATRIX / white[:, None]).T
    small = ratio <= (6 / 29) ** 3
    f = np.where(small, ratio * (29 / 6) ** 2 / 3 + 4 / 29, np.cbrt(ratio))
    fx, fy, fz = np.moveaxis(f, -1, 0)
    return np.stack([116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)], axis=-1)


def ciede2000(first: Doubles, second: Doubles) -> Doubles:
    """Return CIEDE2000, (…,), between colours (…, 3) in L*a*b*."""
    (L1, a1, b1), (L2, a2, b2) = (np.moveaxis(x, -1, 0) for x in (first, second))
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * _levelled(mean)
    C1, h1 = _polar(stretch * a1, b1)
    C2, h2 = _polar(stretch * a2, b2)
    # The hue difference along the shorter arc; greys have no hue.
    are_coloured = C1 * C2 > 0
    turn = np.where(are_coloured, (h2 - h1 + 180) % 360 - 180, 0.0)
    turn = np.where(are_coloured & (h2 - h1 == 180), 180.0, turn)
    h = np.where(are_coloured, _between(h1, h2), h1 + h2)
    L, C = (L1 + L2) / 2, (C1 + C2) / 2
    T = 1 - 0.17 * _cos(h - 30) + 0.24 * _cos(2 * h) + 0.32 * _cos(3 * h + 6)
    T -= 0.20 * _cos(4 * h - 63)
    rotation = -2 * _levelled(C) * np.sin(np.radians(60 * np.exp(-(((h - 275) / 25) ** 2))))
    lighter = (L - 50) ** 2
    dL = (L2 - L1) / (1 + 0.015 * lighter / np.sqrt(20 + lighter))
    dC = (C2 - C1) / (1 + 0.045 * C)
    dH = 2 * np.sqrt(C1 * C2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * C * T)
    # |rotation| < 2, so this is a non-negative quadratic form, up to round-off.
    return np.asarray(np.sqrt(np.maximum(dL**2 + dC**2 + dH**2 + rotation * dC * dH, 0)))


def _levelled(chroma: Doubles) -> Doubles:
    return np.asarray(np.sqrt(chroma**7 / (chroma**7 + _SEVENTH)))


def _polar(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    """Return chroma, and hue in degrees from 0 to 360."""
    return np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360


def _between(h1: Doubles, h2: Doubles) -> Doubles:
    """Return the hue halfway between two hues, along the shorter arc."""
    half = (h1 + h2) / 2
    return np.where(np.abs(h1 - h2) <= 180, half, np.where(half < 180, half + 180, half - 180))


def _cos(degrees: Doubles) -> Doubles:
    return np.asarray(np.cos(np.radians(degrees)))


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
