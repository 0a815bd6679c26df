"""Colour rendering of a light by CIE 13.3 and ANSI/IES TM-30, from colour-science, colours of
surfaces under it, and mixes of a lamp's emitters that have one colour: Rf of many at once, the mix
that renders colours best, and the one of least cost that renders them well enough.

Both measures compare with daylight or a black body of the same colour temperature, so they say
something of whites alone.

Rf of mixes is by ANSI/IES TM-30-18, too. What depends on the colour alone is computed once: the
light with which TM-30 compares, and its 99 samples under it. The light of a sample is linear in the
drives.

All mixes of a colour are the means of some of them, its corners. Rf is neither convex nor concave
there, so several searches begin at different mixes. None of them is a proof.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import combinations
from threading import Lock
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.primaries import REC709, adaptation, colour_science, rgb_to_xyz
from lightpaint.colour.spectrum import (
    STEP,
    WAVELENGTHS,
    Spectrum,
    rgb_of_powers,
    scaled,
    xyz_of_powers,
)

#: Largest distance from Planck's locus of a light whose rendering is reported.
LARGEST_DUV = 0.02

#: Most mixes that are computed together, so that their 99 samples stay in the processor's cache.
TOGETHER = 256

#: What Rf of a mix may lack of the Rf of its own spectrum: TM-30 sees the colours of mixes that are
#: equal on 5 nm a few kelvin apart.
MARGIN = 0.05

#: Points of Rf for a mean difference of 1 (CIE 224:2017, Eq 7.1).
SLOPE = 6.73

#: Luminance of the adapting field in cd/m², and of the background relative to white: TM-30.
ADAPTING, BACKGROUND = 100, 20

#: Rf (n,) of drives (n, e).
Fidelity = Callable[[Doubles], Doubles]

#: Places on the way between two corners at which a search may begin, and how many begin.
PLACES, STARTS = np.linspace(0, 1, 17)[1:-1], 3

#: Most corners between which all ways are tried; of more, those to the mean of all.
MANY_CORNERS = 16

#: Steps of a search, the shares by which it finds slopes, and steps towards a mix that is enough.
STEPS, SHARE, HALVINGS = 60, 1e-5, 30


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


@dataclass(frozen=True)
class MixFidelity:
    """Rf of mixes of emitters that have one colour, a white.

    powers: (e, 81), the spectrum of each emitter at full. reference: (99, 3), J', a' and b' of
    CAM02-UCS of TM-30's samples under a black body or daylight of that colour temperature.
    """

    powers: Doubles
    reference: Doubles

    @classmethod
    def of(cls, powers: Doubles, drives: Doubles) -> "MixFidelity | None":
        """Make it of emitters, and of drives (e,) that mix the colour; None if this is not near a
        white, or dark.
        """
        mixed = drives @ powers
        if not mixed.any() or white_of(mixed) is None:
            return None
        return cls(powers, samples_under_reference(scaled(mixed)))

    def rf(self, drives: Doubles) -> Doubles:
        """Return Rf (n,) of each of several drives (n, e)."""
        parts = [drives[k : k + TOGETHER] for k in range(0, len(drives), TOGETHER)]
        return np.concatenate([self._rf(part) for part in parts])

    def _rf(self, drives: Doubles) -> Doubles:
        colour = colour_science()
        of_emitters, white_of_emitters = self._samples
        whites = drives @ white_of_emitters
        scale = 100 / whites[:, 1]
        light = np.tensordot(drives * scale[:, None], of_emitters, axes=1)
        with ONE_AT_A_TIME:
            seen = colour.XYZ_to_CIECAM02(
                light,
                (whites * scale[:, None])[:, None],
                ADAPTING,
                BACKGROUND,
                discount_illuminant=True,
                compute_H=False,
            )
            uniform = colour.JMh_CIECAM02_to_CAM02UCS(np.stack([seen.J, seen.M, seen.h], axis=-1))
        errors = np.linalg.norm(uniform - self.reference, axis=-1).mean(axis=-1)
        return np.asarray(10 * np.logaddexp((100 - SLOPE * errors) / 10, 0))

    @cached_property
    def _samples(self) -> tuple[Doubles, Doubles]:
        """XYZ (e, 99, 3) of the samples, and (e, 3) of white, under each emitter at full."""
        reflectances, observer = _samples_and_observer()
        return (
            np.einsum("ew,ws,wc->esc", self.powers, reflectances, observer, optimize=True),
            self.powers @ observer,
        )


@cache
def _samples_and_observer() -> tuple[Doubles, Doubles]:
    """Return reflectances (81, 99) of TM-30's samples, and the CIE 1964 observer (81, 3)."""
    colour = colour_science()
    with ONE_AT_A_TIME:
        shape = colour.SpectralShape(WAVELENGTHS[0], WAVELENGTHS[-1], STEP)
        samples = colour.quality.cfi2017.load_TCS_CIE2017(shape).values
        observer = colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"].copy().align(shape)
    return np.asarray(samples, np.float64), np.asarray(observer.values, np.float64)


def best_mix(corners: Doubles, rf: Fidelity) -> Doubles:
    """Return the drives (e,) of the highest Rf that is found between corners (k, e)."""
    if len(corners) < 2:
        return np.asarray(corners[0])
    shares = _tried_shares(len(corners))
    values = rf(shares @ corners)
    begin = shares[np.argsort(-values, kind="stable")[:STARTS]]

    def missed(x: Doubles) -> Doubles:
        return -rf(x @ corners)

    tried = np.array([*begin, *(_least(missed, x) for x in begin)]) @ corners
    return np.asarray(tried[int(np.argmax(rf(tried)))])


def cheapest_mix(corners: Doubles, costs: Doubles, rf: Fidelity, least: float) -> Doubles:
    """Return the drives (e,) of the least cost that is found between corners (k, e), with an Rf of
    at least `least`; if none reach it, the mixes of the best Rf.

    costs: (e,), of each emitter at full.
    """
    cheapest = corners[int(np.argmin(corners @ costs))]
    if rf(cheapest[None])[0] >= least:
        return np.asarray(cheapest)
    best = best_mix(corners, rf)
    if rf(best[None])[0] <= least:
        return best
    shares = _tried_shares(len(corners))
    enough = shares[rf(shares @ corners) >= least]
    begin = enough[np.argsort(enough @ corners @ costs, kind="stable")[:STARTS]]
    size = max(float(np.ptp(corners @ costs)), 1e-300)

    def spent(x: Doubles) -> Doubles:
        return np.asarray(x @ corners @ costs / size)

    def spare(x: Doubles) -> Doubles:
        return rf(x @ corners) - least

    # The straight way from the cheapest mix to the best is one more.
    ends = [cheapest, *(_least(spent, x, spare) @ corners for x in begin)]
    tried = np.array([best, *begin @ corners, *(_raised(x, best, rf, least) for x in ends)])
    return np.asarray(tried[int(np.argmin(tried @ costs))])


def _tried_shares(count: int) -> Doubles:
    """Return shares (n, count) of corners: each, their mean, and places between."""
    corners = np.eye(count)
    mean = corners.mean(axis=0)
    ways = [(mean, x) for x in corners]
    if count <= MANY_CORNERS:
        ways += list(combinations(corners, 2))
    between = [(1 - t) * a + t * b for a, b in ways for t in PLACES]
    return np.array([*corners, mean, *between])


def _least(value: Fidelity, start: Doubles, at_least_0: Fidelity | None = None) -> Doubles:
    """Return shares (k,) of corners where a function of shares (n, k) is least, near `start`, and
    another is not negative.
    """
    from scipy.optimize import minimize

    def one(function: Fidelity) -> Callable[[Doubles], float]:
        return lambda x: float(function(x[None])[0])

    def slope(function: Fidelity) -> Callable[[Doubles], Doubles]:
        def slopes(x: Doubles) -> Doubles:
            steps = SHARE * np.eye(len(x))
            values = function(np.concatenate([x + steps, x - steps]))
            return np.asarray((values[: len(x)] - values[len(x) :]) / (2 * SHARE))

        return slopes

    limits = [{"type": "eq", "fun": lambda x: x.sum() - 1, "jac": np.ones_like}]
    if at_least_0 is not None:
        limits += [{"type": "ineq", "fun": one(at_least_0), "jac": slope(at_least_0)}]
    found = minimize(
        one(value),
        start,
        jac=slope(value),
        bounds=[(0, 1)] * len(start),
        constraints=limits,
        method="SLSQP",
        options={"maxiter": STEPS, "ftol": 1e-7},
    )
    shares = np.clip(found.x, 0, 1)
    return np.asarray(shares / shares.sum()) if np.isfinite(shares).all() else start


def _raised(drives: Doubles, best: Doubles, rf: Fidelity, least: float) -> Doubles:
    """Return drives (e,), brought on the straight way to the best ones until they are enough."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS if rf(drives[None])[0] < least else 0):
        middle = (low + high) / 2
        is_enough = rf((drives + middle * (best - drives))[None])[0] >= least
        low, high = (low, middle) if is_enough else (middle, high)
    return np.asarray(drives + high * (best - drives)) if low > 0 else drives
