"""Colour science at the edge of the program.

Everything here takes linear Rec.709 (D65) with a last axis of 3. colour-science is imported
when first needed: it takes longer than most solves. What every result shows, temperatures and
hexadecimal digits, goes without it; the tests hold it to be the same.
"""

import math
import re
from functools import cache
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from lightpaint.arrays import Floats
from lightpaint.colour.display import decode_display, encode_display, to_8_bit
from lightpaint.colour.science import colour_science
from lightpaint.errors import ColorError

#: Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: Correlated colour temperatures that there is a locus for, in kelvin.
KELVIN_RANGE = (1000.0, 100_000.0)

#: |Duv| beyond which a colour has no correlated colour temperature (CIE 15:2018, 9.5).
LARGEST_DUV = 0.05

#: Planck's locus in CIE 1960 (u, v): Chebyshev series in 1e6/(510 T) - 1, fitted to the sums over
#: the CIE 1931 colour matching functions at 1 nm, from 990 K to 120,000 K. Off by 2e-7 at most.
# fmt: off
_PLANCK = np.array([
    [0.310064372, 0.144460337, 0.004151973, -0.00805193, 0.0023251, -0.000300677, -0.00013721,
     0.000137339, -7.1779e-05, 2.6637e-05, -5.212e-06, -2.535e-06, 3.612e-06, -2.513e-06,
     1.096e-06, -2.9e-07, -9.9e-08, 1.12e-07, -9.5e-08],
    [0.333545117, 0.040050121, -0.026126688, 0.007177663, 0.000500788, -0.001575486, 0.000925363,
     -0.000342544, 7.0151e-05, 1.7739e-05, -3.0815e-05, 2.2122e-05, -1.1068e-05, 3.769e-06,
     -1.46e-07, -8.42e-07, 8.46e-07, -4.37e-07, 2.04e-07],
]).T
# fmt: on


def luminance(rgb: Floats) -> Floats:
    """Relative luminance, (…,), of linear Rec.709 colours (…, 3)."""
    return np.asarray(rgb @ LUMINANCE)


def delta_e(a: Floats, b: Floats) -> Floats:
    """CIEDE2000 between two images as a display would show them, (…,).

    a, b: (…, 3) linear Rec.709 at the exposure they are looked at, white = 1. What a display
    cannot show is clipped, as the display would.
    """
    colour = colour_science()

    def lab(image: Floats) -> Any:
        xyz = colour.RGB_to_XYZ(np.clip(image, 0, 1), "ITU-R BT.709", apply_cctf_decoding=False)
        return colour.XYZ_to_Lab(xyz)

    return np.asarray(colour.delta_E(lab(a), lab(b), method="CIE 2000"))


def kelvin_to_rgb(kelvin: float, duv: float = 0.0) -> Floats:
    """Linear Rec.709 of luminance 1, (3,), of a correlated colour temperature.

    The locus is Planck's at all temperatures; `duv` is the distance from it in CIE 1960 (u, v),
    positive towards green (Ohno 2013). D65 is 6504 K with a Duv of 0.0032.
    Rec.709 does not contain all of them: below 1901 K a black body's blue is negative. Lights
    cannot emit that, so negative components are set to 0 before the luminance is.

    Raises ColorError outside of 1000 to 100,000 K and of a Duv of ±0.05.
    """
    lowest, highest = KELVIN_RANGE
    if not lowest <= kelvin <= highest:
        raise ColorError(f"a colour temperature of {kelvin:g} K: need {lowest:g} to {highest:g} K")
    if not abs(duv) <= LARGEST_DUV:
        raise ColorError(f"a Duv of {duv:g}: need -{LARGEST_DUV:g} to {LARGEST_DUV:g}")
    at, along = _locus(1e6 / kelvin), _locus(1e6 / kelvin, slope=1)
    u, v = at + duv * _towards_green(along)
    # From CIE 1960 (u, v) to XYZ of Y = 1.
    xyz = np.array([1.5 * u / v, 1, (4 - u - 10 * v) / (2 * v)])
    rgb = np.maximum(np.linalg.solve(_rgb_to_xyz(), xyz), 0)
    return np.asarray(rgb / luminance(rgb))


def cct_and_duv(rgb: Floats) -> tuple[float, float] | None:
    """Correlated colour temperature in kelvin and Duv of a colour (3,), by Ohno 2013.

    None where it has none: for black, for a colour more than 0.05 from Planck's locus, and
    beyond 1000 and 100,000 K. Raises ColorError unless it is three finite numbers.
    """
    rgb = _three(rgb)
    if rgb.max() <= 0:
        return None
    xyz = _rgb_to_xyz() @ (rgb / rgb.max())
    if xyz.min() <= 0:
        return None
    x, y, z = xyz
    uv = np.array([4 * x, 6 * y]) / (x + 15 * y + 3 * z)
    # The nearest point of a fine grid, and from there Newton's steps to where the difference is
    # at a right angle to the locus.
    mireds, points = _grid()
    nearest = int(np.argmin(np.square(points - uv).sum(axis=1)))
    mired = float(mireds[nearest])
    for _ in range(4):
        away, along = uv - _locus(mired), _locus(mired, slope=1)
        mired += float(away @ along / (along @ along - away @ _locus(mired, slope=2)))
        mired = min(max(mired, mireds[0]), mireds[-1])
    away, along = uv - _locus(mired), _locus(mired, slope=1)
    kelvin, duv = 1e6 / mired, float(away @ _towards_green(along))
    lowest, highest = KELVIN_RANGE
    # The ends of the range come back as they went in, but for the interpolation of the table.
    if not (lowest - 0.1 <= kelvin <= highest + 10 and abs(duv) <= LARGEST_DUV + 1e-5):
        return None
    return kelvin, duv


def hex_to_rgb(text: str) -> Floats:
    """Linear Rec.709 in [0, 1], (3,), of a display colour like `#ffaa66` or `#fa6`.

    Raises ColorError for any other text.
    """
    found = re.fullmatch(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})", text.strip())
    if found is None:
        raise ColorError(f"{text!r} is no colour: need six hexadecimal digits, like #ffaa66")
    digits = found[1] if len(found[1]) == 6 else "".join(digit * 2 for digit in found[1])
    return decode_display(np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)]) / 255)


def rgb_to_hex(rgb: Floats) -> str:
    """The display colour of a light, like `#ffaa66`: its brightest channel at full.

    rgb: (3,) linear Rec.709. Black is `#000000`; negative components are shown as 0.
    Raises ColorError unless it is three finite numbers.
    """
    rgb = _three(rgb)
    brightest = float(rgb.max())
    shown = rgb / brightest if brightest > 0 else np.zeros(3)
    r, g, b = to_8_bit(encode_display(shown))
    return f"#{r:02x}{g:02x}{b:02x}"


def _three(rgb: Floats) -> Floats:
    values = np.asarray(rgb, dtype=np.float64)
    if values.shape != (3,) or not all(map(math.isfinite, values)):
        raise ColorError(f"{rgb!r} is no colour: need three finite numbers")
    return values


def _locus(mired: Any, *, slope: int = 0) -> Floats:
    """(u, v) of a black body of 1e6/mired kelvin, (2, …), or its derivative by mired."""
    series = chebder(_PLANCK, slope) if slope else _PLANCK
    return np.asarray(chebval(np.asarray(mired) / 510 - 1, series) / 510**slope)


def _towards_green(along: Floats) -> Floats:
    """Unit vector at a right angle to a direction of the locus towards larger mireds."""
    return np.asarray(np.array([-along[1], along[0]]) / np.hypot(*along))


@cache
def _grid() -> tuple[Floats, Floats]:
    """Mireds somewhat beyond KELVIN_RANGE, (k,), and their (u, v), (k, 2)."""
    mireds = np.linspace(8.5, 1010, 1001)
    return mireds, _locus(mireds).T


@cache
def _rgb_to_xyz() -> Floats:
    """Linear Rec.709 to XYZ, (3, 3), from its chromaticities (ITU-R BT.709-6, item 1.3)."""
    primaries = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in primaries]).T
    white = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
    return np.asarray(columns * np.linalg.solve(columns, white))
