"""Colours of light: temperature, hexadecimal colours, luminance, visible differences, and names of
hues in CIE L*a*b*.

Colours are linear Rec.709 (D65) with a last axis of 3. Planck's law is summed over the CIE 1931
colour matching functions, nanometre by nanometre, as in colour-science. That library takes a second
to import, and every answer reports temperatures. Visible differences are CIEDE2000 (CIE 142-2001;
Sharma, Wu and Dalal 2005), for which it takes three times as long per pixel.
"""

import math
import re
from functools import cache, lru_cache
from importlib.resources import files

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.primaries import REC709, decode_display, encode_display, rgb_to_xyz, to_8_bit
from lightpaint.errors import ColorError

#: Second radiation constant in m K, as rounded in CIE 15:2004.
C2 = 0.014388

#: Mireds of the tabulated black bodies, where the search for the nearest one starts; they extend
#: beyond 1000 and 100,000 K.
TABLE_MIREDS = np.concatenate([[5.0], np.geomspace(10, 2000, 400)])

#: Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: Correlated colour temperatures for which the locus is computed, in kelvin.
KELVIN_RANGE = (1000.0, 100_000.0)

#: |Duv| beyond which a colour has no correlated colour temperature (CIE 15:2018, 9.5).
LARGEST_DUV = 0.05

#: Number of Newton steps from the nearest tabulated black body to the nearest one, with one to
#: spare.
NEWTON_STEPS = 5

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

#: |Duv| beyond which people see a colour, and a colour temperature says nothing of it.
WHITE_DUV = 0.02

#: Maximum distance from Planck's locus, and minimum temperature, of light that is called white.
NAMED_DUV, WARMEST = 0.015, 2100.0

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


def uv_of_black_body(kelvin: Doubles) -> Doubles:
    """Return CIE 1960 (u, v), (k, 2), of black bodies at temperatures (k,)."""
    wavelength, observer = matching_functions()
    radiance = wavelength[:, None] ** -5 / np.expm1(C2 / (wavelength[:, None] * kelvin))
    return uv_of(radiance.T @ observer)


def uv_of(xyz: Floats) -> Doubles:
    """Return CIE 1960 (u, v), (…, 2), of XYZ (…, 3)."""
    X, Y, Z = np.moveaxis(np.asarray(xyz, np.float64), -1, 0)
    return np.asarray(np.stack([4 * X, 6 * Y], axis=-1) / (X + 15 * Y + 3 * Z)[..., None])


def xyz_of(uv: Floats | tuple[float, float]) -> Doubles:
    """Return XYZ with luminance 1, (3,), for CIE 1960 (u, v)."""
    u, v = uv
    return np.asarray(np.array([3 * u, 2 * v, 4 - u - 10 * v]) / (2 * v))


def xy_of(xyz: Floats) -> tuple[float, float]:
    """Return CIE 1931 (x, y) of XYZ (3,)."""
    x, y, _ = (np.asarray(xyz, np.float64) / np.sum(xyz)).tolist()
    return x, y


def xy_of_spectrum(nanometres: Floats, power: Floats) -> tuple[float, float] | None:
    """Return CIE 1931 (x, y) of a spectrum, straight between its points (k,) and dark beyond them.

    nanometres: (k,), rising; a single one is a line. None for a spectrum that nobody sees.
    """
    waves, observer = matching_functions()
    grid = waves * 1e9
    if len(nanometres) == 1:
        xyz = np.array([np.interp(nanometres[0], grid, x, 0, 0) for x in observer.T])
    else:
        xyz = np.interp(grid, nanometres, power, left=0, right=0) @ observer
    return xy_of(xyz) if xyz[1] > 0 else None


def nearest_mired(uv: Floats) -> float:
    """Return the mireds of the tabulated black body nearest to (u, v), (2,)."""
    return float(TABLE_MIREDS[np.argmin(np.square(_table_uv() - uv).sum(axis=1))])


@cache
def _table_uv() -> Doubles:
    return uv_of_black_body(1e6 / TABLE_MIREDS)


@cache
def matching_functions() -> tuple[Doubles, Doubles]:
    """Return wavelengths in metres, (m,), and the colour matching functions (CIE 1931) at these,
    (m, 3).
    """
    text = files("lightpaint.colour").joinpath("cie_1931.csv").read_text("utf-8")
    table = np.loadtxt(text.splitlines(), delimiter=",")
    return table[:, 0] * 1e-9, table[:, 1:]


def luminance(rgb: Floats) -> Floats:
    """Return the relative luminance, (…,), of linear Rec.709 colours (…, 3)."""
    return np.asarray(rgb @ LUMINANCE)


@lru_cache(1024)  # 0.6 ms each, and 64 lights with ranges need 128
def kelvin_to_rgb(kelvin: float, duv: float = 0.0) -> Doubles:
    """Return the linear Rec.709 colour with luminance 1 of a correlated colour temperature, (3,).

    The locus is Planck's at all temperatures; `duv` is the distance from it in CIE 1960 (u, v),
    positive towards green (Ohno 2013). D65 is 6504 K with a Duv of 0.0032. Rec.709 does not contain
    all of these colours: below 1901 K a black body's blue is negative. Lights cannot emit that, so
    negative components are set to 0 before the luminance is scaled to 1. The array is read-only.
    Raises ColorError outside 1000 to 100,000 K and a Duv of ±0.05.
    """
    lowest, highest = KELVIN_RANGE
    if not lowest <= kelvin <= highest:
        raise ColorError(
            f"a colour temperature of {kelvin:g} K is out of range: expected {lowest:g} to "
            f"{highest:g} K"
        )
    if not abs(duv) <= LARGEST_DUV:
        raise ColorError(
            f"a Duv of {duv:g} is out of range: expected -{LARGEST_DUV:g} to {LARGEST_DUV:g}"
        )
    uv, tangent, _ = _locus(1e6 / kelvin)
    xyz = xyz_of(uv + duv * _towards_green(tangent))
    rgb = np.maximum(np.linalg.solve(rgb_to_xyz(REC709), xyz), 0)
    rgb /= luminance(rgb)
    rgb.setflags(write=False)
    return np.asarray(rgb)


def cct_and_duv(rgb: Floats) -> tuple[float, float] | None:
    """Return the correlated colour temperature in kelvin and the Duv of a colour (3,) (Ohno 2013).

    Returns None for black, for a colour more than 0.05 from Planck's locus, and outside 1000 to
    100,000 K. Raises ColorError unless the colour is three finite numbers.
    """
    return _cct_and_duv(*_three_numbers(rgb).tolist())


@lru_cache(maxsize=4096)
def _cct_and_duv(*light: float) -> tuple[float, float] | None:
    rgb = np.array(light)
    if rgb.max() <= 0:
        return None
    xyz = rgb_to_xyz(REC709) @ (rgb / rgb.max())
    if xyz.min() <= 0:
        return None
    uv = uv_of(xyz)
    mired = nearest_mired(uv)
    # Newton's method ends where the difference is perpendicular to the locus, so it returns the
    # temperature that was given to `kelvin_to_rgb`, to 1e-9.
    for _ in range(NEWTON_STEPS):
        uv_at, tangent, bend = _locus(mired)
        mired += float((uv - uv_at) @ tangent / (tangent @ tangent - (uv - uv_at) @ bend))
        mired = min(max(mired, 1e6 / (2 * KELVIN_RANGE[1])), 2e6 / KELVIN_RANGE[0])
    uv_at, tangent, _ = _locus(mired)
    kelvin, duv = 1e6 / mired, float((uv - uv_at) @ _towards_green(tangent))
    lowest, highest = KELVIN_RANGE
    # The ends of the range are only reproduced up to round-off.
    if not (lowest - 0.1 <= kelvin <= highest + 10 and abs(duv) <= LARGEST_DUV + 1e-5):
        return None
    return kelvin, duv


def hex_to_rgb(text: str) -> Floats:
    """Return a display colour such as `#ffaa66` or `#fa6` as linear Rec.709 in [0, 1], (3,).

    Raises ColorError for any other text.
    """
    # colour.notation.HEX_to_RGB also accepts #ffaa6, and takes a second to import.
    match = re.fullmatch(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})", text.strip())
    if match is None:
        raise ColorError(f"{text!r} is not a colour: expected six hexadecimal digits, like #ffaa66")
    digits = match[1] if len(match[1]) == 6 else "".join(digit * 2 for digit in match[1])
    return decode_display(np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)]) / 255)


def rgb_to_hex(rgb: Floats) -> str:
    """Return the display colour of a light, such as `#ffaa66`, with its brightest channel at full.

    rgb: (3,) linear Rec.709. Black is `#000000`; negative components become 0. Raises ColorError
    unless it is three finite numbers.
    """
    rgb = _three_numbers(rgb)
    brightest = float(rgb.max())
    scaled_rgb = rgb / brightest if brightest > 0 else np.zeros(3)
    r, g, b = to_8_bit(encode_display(scaled_rgb))
    return f"#{r:02x}{g:02x}{b:02x}"


def _three_numbers(rgb: Floats) -> Floats:
    values = np.asarray(rgb, dtype=np.float64)
    if values.shape != (3,) or not all(map(math.isfinite, values)):
        raise ColorError(f"{rgb!r} is not a colour: expected three finite numbers")
    return values


def _locus(mired: float) -> tuple[Doubles, Doubles, Doubles]:
    """Return CIE 1960 (u, v) of a black body at 1e6/mired kelvin, and two derivatives by mired."""
    step = 1e-4 * mired
    kelvin = 1e6 / (mired + step * np.array([-1, 0, 1]))
    uv_before, uv_at, uv_after = uv_of_black_body(kelvin)
    return uv_at, (uv_after - uv_before) / (2 * step), (uv_after - 2 * uv_at + uv_before) / step**2


def _towards_green(along: Floats) -> Floats:
    """Return the unit vector towards green, perpendicular to the locus's direction `along`."""
    return np.asarray(np.array([-along[1], along[0]]) / np.hypot(*along))


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
    if temperature is not None and abs(temperature[1]) <= NAMED_DUV and temperature[0] >= WARMEST:
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
