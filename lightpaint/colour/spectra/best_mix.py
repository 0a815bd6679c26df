"""Mixes of a lamp's emitters that have one colour: Rf of many at once, the mix that renders colours
best, and the one of least cost that renders them well enough.

Rf is by ANSI/IES TM-30-18, as `color_rendering` has it. What depends on the colour alone is
computed once: the light with which TM-30 compares, and its 99 samples under it. The light of a
sample is linear in the drives.

All mixes of a colour are the means of some of them, its corners. Rf is neither convex nor concave
there, so several searches begin at different mixes. None of them is a proof.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.spectra.color_rendering import (
    ONE_AT_A_TIME,
    samples_under_reference,
    white_of,
)
from lightpaint.colour.spectra.spectrum import STEP, WAVELENGTHS, scaled

#: Most mixes that are computed together, so that their 99 samples stay in the processor's cache.
TOGETHER = 256

#: What Rf of a mix may lack of that of its own spectrum: TM-30 sees the colours of mixes that are
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
    at least `least`; if none reach it, those of the best Rf.

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
