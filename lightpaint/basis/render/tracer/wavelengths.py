"""Light along a path: RGB, or power at wavelengths that all emitters share.

Mitsuba's spectra hold four wavelengths. A path of a spectral render carries several of them,
packets, along the same rays: each surface and each emitter is asked for all, with the same random
numbers. The wavelengths of a path are evenly spaced, and its number in the sequence of the pixel
shifts them, so that the paths of a pixel cover all; estimates are unbiased.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Iterable
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.basis.render.tracer.sobol import TIME
from lightpaint.colour import STEP, Spectrum

#: The first wavelength in nanometres, and the number of bins of 1 nm that follow.
FIRST_NM, BINS = 380, 400

#: Packets of four wavelengths of a path where all emitters are broad, and where one is narrow.
BROAD_PACKETS, NARROW_PACKETS = 2, 4

#: Width in nanometres of a broad spectrum: twice the distance between eight wavelengths.
BROAD_NM = 100.0


def packets_for(spectra: Iterable[Spectrum]) -> int:
    """Return the number of packets that a path needs for emitters of these spectra.

    Eight wavelengths show lamps of a white LED as cleanly as RGB does, and narrow LEDs with twice
    the variance; sixteen show those as well (docs/benchmarks.md).
    """
    is_broad = all(width_of(x) >= BROAD_NM for x in spectra)
    return BROAD_PACKETS if is_broad else NARROW_PACKETS


def width_of(spectrum: Spectrum) -> float:
    """Return the width in nanometres of an even spectrum whose power is as concentrated."""
    power = np.array(spectrum)
    return float(STEP * power.sum() ** 2 / np.square(power).sum())


class PowerByWavelength(NamedTuple):
    """Light at the wavelengths of a path.

    first_bin: bin of the first; others follow at `spacing_of` their number. packets: values at four
    each.
    """

    first_bin: Any
    packets: list[Any]

    def at(self, k: int):
        """Return the value at wavelength k."""
        return self.packets[k // 4][k % 4]


def spacing_of(packets: int) -> int:
    """Return the distance in bins between two wavelengths of a path."""
    return BINS // (4 * packets)


class RgbPaths:
    """Paths whose light is RGB."""

    packets = 1

    def along(self, numbers, term):
        """Return the paths of a sample with their wavelengths. term: number of the sample."""
        return self

    def at(self, si, packet):
        """Return a surface interaction, at the wavelengths of a packet."""
        return si

    def from_camera(self, weight):
        """Return the light per radiance along a camera ray of this weight, for each packet."""
        return [weight]

    def light(self, values):
        """Return light as planes take it."""
        return values[0]

    def gray(self, values):
        """Return the mean of light over its channels."""
        # dr.mean would compile the number of paths into the kernel as a constant.
        red, green, blue = values[0]
        return (red + green + blue) * (1 / 3)


class SpectralPaths(RgbPaths):
    """Paths whose light is power at wavelengths.

    packets: of four wavelengths. first_bin: of each path, if these are known.
    """

    def __init__(self, packets, first_bin=None) -> None:
        self.packets, self._first_bin = packets, first_bin

    def along(self, numbers, term):
        spacing = spacing_of(self.packets)
        shift = mi.UInt32(numbers.pair(term, TIME).y * spacing)
        return SpectralPaths(self.packets, dr.minimum(shift, spacing - 1))

    def at(self, si, packet):
        spacing = spacing_of(self.packets)
        first = mi.Float(self._first_bin) + (FIRST_NM + 0.5 + 4 * spacing * packet)
        there = mi.SurfaceInteraction3f(si)
        there.wavelengths = mi.Spectrum(*(first + spacing * k for k in range(4)))
        return there

    def from_camera(self, weight):
        # The camera chose wavelengths of its own, whose weights do not belong to these.
        _, of_wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(mi.Float(0)))
        return [mi.Spectrum(weight[0] / of_wavelengths[0])] * self.packets

    def light(self, values):
        return PowerByWavelength(self._first_bin, values)

    def gray(self, values):
        total = sum(x[0] + x[1] + x[2] + x[3] for x in values)
        return total * (1 / (4 * self.packets))


def each_emission(waves, emitter, si, active):
    """Return what `emitter` emits at `si`, for each packet."""
    return [emitter.eval(waves.at(si, k), active) for k in range(waves.packets)]


def each_direction(waves, emitter, si, number, active):
    """Return a direction sample of `emitter`, and its radiance for each packet."""
    sampled = [
        emitter.sample_direction(waves.at(si, k), number, active) for k in range(waves.packets)
    ]
    return sampled[0][0], [radiance for _, radiance in sampled]


def each_bsdf_value(waves, bsdf, si, wo, active):
    """Return the value of a BSDF for each packet, and its density."""
    context = mi.BSDFContext()
    value, pdf = bsdf.eval_pdf(context, waves.at(si, 0), wo, active)
    others = [bsdf.eval(context, waves.at(si, k), wo, active) for k in range(1, waves.packets)]
    return [value, *others], pdf


def each_bsdf_sample(waves, bsdf, si, lobe, direction, active):
    """Return a BSDF sample, and its weight for each packet.

    The direction is the direction of the first packet: no surface chooses it by the wavelength.
    """
    sampled = [
        bsdf.sample(mi.BSDFContext(), waves.at(si, k), lobe, direction, active)
        for k in range(waves.packets)
    ]
    return sampled[0][0], [weight for _, weight in sampled]


def products(*factors):
    """Return the products of light, for each packet, with light and numbers."""
    packets = max(len(x) for x in factors if isinstance(x, list))
    values = []
    for k in range(packets):
        first, *others = (x[k] if isinstance(x, list) else x for x in factors)
        for factor in others:
            first = first * factor
        values.append(first)
    return values


def is_any(values):
    """Return whether some light is not black."""
    found = dr.any(values[0] != 0)
    for value in values[1:]:
        found |= dr.any(value != 0)
    return found
