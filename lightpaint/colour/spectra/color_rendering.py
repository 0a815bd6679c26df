"""Colour rendering of a light by CIE 13.3 and ANSI/IES TM-30, from colour-science, and colours of
surfaces under it.

Both compare with daylight or a black body of the same colour temperature, so they say something of
whites alone.
"""

import warnings
from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.primaries import REC709, adaptation, colour_science, rgb_to_xyz
from lightpaint.colour.spectra.spectrum import (
    WAVELENGTHS,
    Spectrum,
    rgb_of_powers,
    scaled,
    xyz_of_powers,
)

#: Largest distance from Planck's locus of a light whose rendering is told.
LARGEST_DUV = 0.02


@dataclass(frozen=True)
class ColorRendering:
    """Colour rendering of a white light.

    kelvin, duv: its correlated colour temperature. ra, r9: general and ninth special index of CIE
    13.3-1995. rf, rg: fidelity and gamut index of ANSI/IES TM-30-18.
    """

    kelvin: float
    duv: float
    ra: float
    r9: float
    rf: float
    rg: float


def color_rendering(powers: Doubles) -> ColorRendering | None:
    """Return how a light renders colours; None for one that is off, or far from white.

    powers: (81,) at WAVELENGTHS.
    """
    if not powers.any() or white_of(powers) is None:
        return None
    return _of_spectrum(scaled(powers))


def white_of(powers: Doubles) -> tuple[float, float] | None:
    """Return colour temperature and Duv of a light; None if it is far from white."""
    white = cct_and_duv(rgb_of_powers(powers))
    return white if white is not None and abs(white[1]) <= LARGEST_DUV else None


def fidelity(powers: Doubles) -> float:
    """Return the fidelity index Rf of a light; -inf for one that is off, or far from white."""
    found = color_rendering(powers)
    return -np.inf if found is None else found.rf


#: Held by the thread that asks colour-science, whose scale of numbers is one for all threads: two
#: at a time leave it wrong (findings/colour_science_threads_leave_its_scale_wrong.sh).
ONE_AT_A_TIME = Lock()


@lru_cache(1024)
def _of_spectrum(spectrum: Spectrum) -> ColorRendering:
    with ONE_AT_A_TIME:
        return _computed(spectrum)


@lru_cache(256)
def samples_under_reference(spectrum: Spectrum) -> Doubles:
    """Return J', a' and b' of CAM02-UCS, (99, 3), of TM-30's samples under the light with which it
    compares this one.
    """
    quality = colour_science().quality
    with ONE_AT_A_TIME, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as below
        found = quality.colour_fidelity_index(
            _distribution(spectrum), additional_data=True, method="CIE 2017"
        )
    _, reference = found.colorimetry_data
    return np.asarray(reference.Jpapbp, np.float64)


def _computed(spectrum: Spectrum) -> ColorRendering:
    quality = colour_science().quality
    # Both are defined on this grid. On a finer one the splines of colour-science would change it.
    measured = _distribution(spectrum)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of lights that are not near Planck's locus
        cri = quality.colour_rendering_index(measured, additional_data=True)
        tm30 = quality.colour_fidelity_index(
            measured, additional_data=True, method="ANSI/IES TM-30-18"
        )
    white = white_of(np.array(spectrum))
    assert white is not None
    kelvin, duv = white
    numbers = (cri.Q_a, cri.Q_as[9].Q_a, tm30.R_f, tm30.R_g)
    return ColorRendering(kelvin, duv, *map(float, numbers))


def _distribution(spectrum: Spectrum) -> Any:
    return colour_science().SpectralDistribution(np.array(spectrum), WAVELENGTHS)


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
