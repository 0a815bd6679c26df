"""Spectra of lights on a grid of 5 nm, and their colours.

A spectrum is its power per nanometre at WAVELENGTHS, straight between these and dark beyond. That
is the grid on which CIE 13.3 and TM-30 are defined, and finer than LEDs are wide. Only its shape
counts: it is scaled to luminance 1.
"""

from functools import cache

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import C2, matching_functions
from lightpaint.colour.primaries import REC709, rgb_to_xyz
from lightpaint.errors import ColorError

#: Nanometres of a spectrum, and the distance between two.
STEP = 5
WAVELENGTHS = np.arange(380, 780 + STEP, STEP)

#: Digits of a power in files, of which a measurement has three.
DIGITS = 6

#: Largest error of X, Y and Z relative to the largest of them, above which the grid loses lines.
LOST = 0.01

#: Power per nanometre at each of WAVELENGTHS, for luminance 1.
Spectrum = tuple[float, ...]


def spectrum_of(waves: Floats, powers: Floats) -> Spectrum:
    """Return the spectrum of power (k,) at rising wavelengths (k,), straight between its points and
    dark beyond them.

    Where the grid would lose a line between its wavelengths, it holds means around these instead.
    Raises ColorError for a spectrum without power that eyes see.
    """
    values = np.interp(WAVELENGTHS, waves, powers, left=0, right=0)
    grid, observer = matching_functions()
    exact = np.interp(grid * 1e9, waves, powers, left=0, right=0) @ observer
    if np.abs(values @ _observer() - exact).max() > LOST * exact.max():
        fine = np.arange(WAVELENGTHS[0] - STEP, WAVELENGTHS[-1] + STEP + 0.05, 0.1)
        power = np.interp(fine, waves, powers, left=0, right=0)
        hats = np.maximum(0, 1 - np.abs(fine - WAVELENGTHS[:, None]) / STEP)
        values = hats @ power / hats.sum(axis=1)
    return scaled(values)


def scaled(values: Doubles) -> Spectrum:
    """Return powers (81,) as a spectrum. Raises ColorError if nobody sees them."""
    y = float((values @ _observer())[1])
    if not y > 0:
        raise ColorError("has no power that eyes see: leave this emitter out")
    return tuple(float(f"{x / y:.{DIGITS}g}") for x in values)


def xyz_of_powers(powers: Spectrum | Doubles) -> Doubles:
    """Return CIE 1931 XYZ (3,) of power per nanometre at WAVELENGTHS, in its unit."""
    return np.asarray(np.asarray(powers, np.float64) @ _observer())


def rgb_of_powers(powers: Spectrum | Doubles) -> Doubles:
    """Return linear Rec.709 (3,) of power per nanometre at WAVELENGTHS; may be negative."""
    return np.asarray(np.linalg.solve(rgb_to_xyz(REC709), xyz_of_powers(powers)))


def black_body(kelvin: float) -> Spectrum:
    """Return the spectrum of a black body."""
    metres = WAVELENGTHS * 1e-9
    return scaled(metres**-5.0 / np.expm1(C2 / (metres * kelvin)))


@cache
def _observer() -> Doubles:
    """Return the integrals (81, 3) of the colour matching functions with each power's hat."""
    waves, observer = matching_functions()
    nanometres = waves * 1e9
    hats = np.maximum(0, 1 - np.abs(nanometres - WAVELENGTHS[:, None]) / STEP)
    return np.asarray(hats @ observer)
