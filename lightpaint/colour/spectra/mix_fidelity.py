"""The fidelity index Rf of many mixes of one colour, at once.

By ANSI/IES TM-30-18, as `color_rendering` has it. What depends on the colour alone is computed
once: the light with which TM-30 compares, and its 99 samples under it. The light of a sample is
linear in the drives.
"""

from dataclasses import dataclass
from functools import cache, cached_property

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
