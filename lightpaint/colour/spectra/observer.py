"""Observers of pictures of spectra: the eye, or a camera by its three sensitivities.

A picture is linear Rec.709 in either case. For the eye that is a matrix of CIE 1931 XYZ. A camera
has no such matrix, since two spectra of one colour differ to it; its input transform is the matrix
which comes closest. As the Academy recommends (P-2013-001, 2015): white balance first, then the
3 x 3 matrix that keeps white and shows the colours of a set of surfaces with the least differences
in L*a*b*. Surfaces are the 190 of RAWtoACES, and the light is D65, the white of Rec.709.
"""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Doubles
from lightpaint.colour.color import ciede2000, lab, matching_functions
from lightpaint.colour.primaries import REC709, colour_science, rgb_to_xyz
from lightpaint.colour.spectra.spectrum import (
    WAVELENGTHS,
    named_spectrum,
    read_sensitivities,
    spectrum_of,
)
from lightpaint.errors import ColorError

#: Digits of a sensitivity in files, of the largest of its channel.
DIGITS = 6

#: Smallest of the singular values of the colours of surfaces, relative to the largest, below which
#: three channels are taken for fewer.
INDEPENDENT = 1e-3


@dataclass(frozen=True)
class Observer:
    """An observer of a picture of spectra.

    name: for people. sensitivities: (81, 3) at WAVELENGTHS, the response of a camera's channels to
    power, 1 at the largest of each; empty for the eye.
    """

    name: str = "CIE 1931 2°"
    sensitivities: tuple[RGB, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if self.sensitivities and len(self.sensitivities) != len(WAVELENGTHS):
            raise ColorError(
                f"an observer has {len(self.sensitivities)} wavelengths: expected "
                f"{len(WAVELENGTHS)}"
            )

    @property
    def is_camera(self) -> bool:
        """True unless it is the eye."""
        return bool(self.sensitivities)

    def curves(self, waves: Doubles) -> Doubles:
        """Return its curves (k, 3), >= 0, at wavelengths (k,) in nm: the CIE's for the eye."""
        grid, values = WAVELENGTHS.astype(np.float64), np.array(self.sensitivities)
        if not self.is_camera:
            metres, values = matching_functions()
            grid = metres * 1e9
        found = np.stack([np.interp(waves, grid, x, left=0, right=0) for x in values.T], axis=-1)
        return np.asarray(np.maximum(found, 0))  # a value of the CIE's table is −3e-22

    @cached_property
    def matrix(self) -> Doubles:
        """(3, 3) from integrals over its curves to linear Rec.709, for luminance."""
        if not self.is_camera:
            return np.asarray(np.linalg.inv(rgb_to_xyz(REC709)))
        return _input_transform(self.sensitivities)

    def response(self, waves: Doubles) -> Doubles:
        """Return the linear Rec.709 (k, 3) of light of 1 nm at wavelengths (k,). D65 of luminance 1
        is white (1, 1, 1).
        """
        return np.asarray(self.curves(waves) @ self.matrix.T)

    @cached_property
    def color_error(self) -> float:
        """Mean CIEDE2000 of the colours of the surfaces in D65 to what the eye sees."""
        surfaces, seen = _surfaces_in_d65()
        found = surfaces @ self.response(WAVELENGTHS.astype(np.float64))
        return float(ciede2000(lab(found), lab(seen)).mean())


#: The CIE's standard observer of 1931, 2 degrees.
EYE = Observer()


def read_observer(path: Path) -> Observer:
    """Return the camera whose sensitivities a table has: nanometres, red, green and blue.

    Values are responses per power of light, not per photon; the scale of a channel does not count.
    Raises ColorError for a file without such curves.
    """
    waves, values = read_sensitivities(path)
    if not (largest := values.max(axis=0)).all():
        raise ColorError(path, " has a channel that is 0: expected red, green and blue")
    curves = [np.interp(WAVELENGTHS, waves, x, left=0, right=0) for x in (values / largest).T]
    rows = np.stack(curves, axis=1).tolist()
    sensitivities = tuple((_rounded(r), _rounded(g), _rounded(b)) for r, g, b in rows)
    observer = Observer(path.name, sensitivities)
    try:
        _ = observer.matrix
    except ColorError as error:
        raise ColorError(path, error.sentence) from None
    return observer


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


@lru_cache(8)
def _input_transform(sensitivities: tuple[RGB, ...]) -> Doubles:
    """Return the matrix (3, 3) of a camera, by the Academy's procedure (P-2013-001).

    Raises ColorError if a channel sees what another sees.
    """
    from scipy.optimize import least_squares

    surfaces, seen = _surfaces_in_d65()
    d65, curves = _d65(), np.array(sensitivities)
    white = d65 @ curves
    raw = surfaces @ curves / white
    spread = np.linalg.svd(raw, compute_uv=False)
    if spread[-1] < INDEPENDENT * spread[0]:
        raise ColorError(
            " has channels that see the same: expected three different curves, of red, green and "
            "blue"
        )

    def matrix_of(parameters: Doubles) -> Doubles:
        # Rows that sum to 1 keep white.
        first = parameters.reshape(3, 2)
        return np.asarray(np.column_stack([first, 1 - first.sum(axis=1)]))

    def difference(parameters: Doubles) -> Doubles:
        return np.asarray(np.ravel(lab(raw @ matrix_of(parameters).T) - lab(seen)))

    # The linear least-squares answer under that condition is the start.
    reduced = raw[:, :2] - raw[:, 2:]
    start = np.linalg.lstsq(reduced, seen - raw[:, 2:], rcond=None)[0].T.ravel()
    found = least_squares(difference, start, xtol=1e-12, ftol=1e-12).x
    return np.asarray(matrix_of(found) / white)


@lru_cache(1)
def _surfaces_in_d65() -> tuple[Doubles, Doubles]:
    """Return the light of surfaces in D65 of luminance 1, (k, 81), for each nanometre's share of a
    sum over WAVELENGTHS; and their linear Rec.709 (k, 3) to the eye, with D65 as (1, 1, 1).
    """
    training = colour_science().characterisation.read_training_data_rawtoaces_v1()
    surfaces = np.array(training.values, np.float64).T * _d65()
    response = EYE.response(WAVELENGTHS.astype(np.float64))
    return surfaces, surfaces @ response / (_d65() @ response)


def _d65() -> Doubles:
    """Return D65 as shares (81,) of a sum over WAVELENGTHS, of luminance 1."""
    powers = np.array(spectrum_of(*named_spectrum("D65", Path())))
    y = EYE.curves(WAVELENGTHS.astype(np.float64))[:, 1]
    return np.asarray(powers / (powers @ y))
