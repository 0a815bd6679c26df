"""Planck's locus: CIE 1960 (u, v) of black bodies by temperature.

Planck's law is summed over the CIE 1931 colour matching functions, nanometre by nanometre, as in
colour-science. That library takes a second to import, and every answer reports temperatures.
"""

from functools import cache
from importlib.resources import files

import numpy as np

from lightpaint.arrays import Doubles, Floats

#: Second radiation constant in m K, as rounded in CIE 15:2004.
C2 = 0.014388

#: Mireds of the tabulated black bodies, where the search for the nearest one starts; they extend
#: beyond 1000 and 100,000 K.
TABLE_MIREDS = np.concatenate([[5.0], np.geomspace(10, 2000, 400)])


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
