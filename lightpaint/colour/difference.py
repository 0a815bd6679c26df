"""CIEDE2000, as colour-science has it, without waiting for its import.

Sharma, Wu, Dalal: The CIEDE2000 Color-Difference Formula (2005), with their equation numbers.
"""

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.primaries import REC709, rgb_to_xyz

#: Where CIE Lab's cube root begins, and its slope below.
DARK, SLOPE = (6 / 29) ** 3, (29 / 6) ** 2 / 3

#: 25⁷, of the weight of grey.
GREY = 25.0**7


def lab(rgb: Floats) -> Doubles:
    """CIE 1976 L*, a*, b*, three (…,), of linear Rec.709 (…, 3)."""
    to_xyz = rgb_to_xyz(REC709)
    xyz = np.asarray(rgb, np.float64) @ to_xyz.T / to_xyz.sum(axis=1)
    x, y, z = np.moveaxis(np.where(xyz > DARK, np.cbrt(xyz), SLOPE * xyz + 4 / 29), -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def ciede2000(one: Doubles, other: Doubles) -> Doubles:
    """(…,), of two colours in Lab, three (…,) each."""
    (L1, a1, b1), (L2, a2, b2) = one, other
    # Chroma and hue, with a* stretched near grey (2-7).
    saturated = _saturation((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2)
    a1, a2 = (a * (1.5 - 0.5 * saturated) for a in (a1, a2))
    C1, C2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = (np.arctan2(b, a) % (2 * np.pi) for a, b in ((a1, b1), (a2, b2)))
    # Differences, of hue the shorter way around (8-11).
    is_grey = C1 * C2 == 0
    turn = np.where(is_grey, 0, h2 - h1)
    turn = turn - 2 * np.pi * np.sign(turn) * (np.abs(turn) > np.pi)
    dL, dC, dH = L2 - L1, C2 - C1, 2 * np.sqrt(C1 * C2) * np.sin(turn / 2)
    # Means (12-14).
    L, C, total = (L1 + L2) / 2, (C1 + C2) / 2, h1 + h2
    around = np.where(total < 2 * np.pi, np.pi, -np.pi) * (np.abs(h1 - h2) > np.pi)
    h = np.where(is_grey, total, total / 2 + around)
    # Weights, and how much blues turn (15-21).
    cosines = ((-0.17, 1, 30), (0.24, 2, 0), (0.32, 3, -6), (-0.20, 4, 63))
    T = 1 + sum(f * np.cos(k * h - np.radians(at)) for f, k, at in cosines)
    blue = np.exp(-np.square((np.degrees(h) - 275) / 25))
    bright = np.square(L - 50)
    S_L, S_C, S_H = 1 + 0.015 * bright / np.sqrt(20 + bright), 1 + 0.045 * C, 1 + 0.015 * C * T
    R_T = -2 * _saturation(C) * np.sin(np.radians(60) * blue)
    light, colour, hue = dL / S_L, dC / S_C, dH / S_H
    squares = light**2 + colour**2 + hue**2 + R_T * colour * hue
    return np.asarray(np.sqrt(np.maximum(squares, 0)))


def _saturation(chroma: Doubles) -> Doubles:
    """0 of greys, near 1 of what has much chroma."""
    to_7 = chroma**7
    return np.asarray(np.sqrt(to_7 / (to_7 + GREY)))
