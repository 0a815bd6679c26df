"""Planes of the emitters of lamps, to which paths add their light at several wavelengths.

The scene is loaded with all lamps at white, whose spectrum is D65. The colour that a path adds to
the plane of an emitter is a sum over its wavelengths: its light there relative to D65, times the
emitter's power, times the response of the observer, in linear Rec.709. So one path serves all
emitters of a lamp.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Doubles, Floats, aligned
from lightpaint.basis.render.tracer.light_planes import LightPlanes
from lightpaint.basis.render.tracer.wavelengths import BINS, FIRST_NM, packets_for, spacing_of
from lightpaint.colour import EYE, WAVELENGTHS, Observer, Spectrum
from lightpaint.scene.scene import Scene


def packets_of(scene: Scene) -> int:
    """Return the number of packets of wavelengths of the paths of a spectral scene."""
    return packets_for(x.spectrum for x in scene.lights if x.spectrum is not None)


class ColorTables:
    """The colour of power in each bin of 1 nm, by plane; and the planes of each emitter.

    plane_count: from the Dr.Jit instance id of an emitter to its number of planes.
    """

    def __init__(self, scene: Scene, light_of: Any) -> None:
        spacing = spacing_of(packets_of(scene))
        tables = [spacing * _color_table(x.spectrum, scene.observer) for x in scene.lights]
        padded = np.concatenate([np.array(tables), np.zeros((len(tables), BINS, 1))], axis=2)
        self._colors = mi.Float(aligned(padded.ravel(), np.float32))
        # The planes of a lamp follow one another.
        names = [light.lamp or light.name for light in scene.lights]
        counts = np.array([names.count(name) for name in names])
        self.plane_count = mi.UInt32(aligned(counts[np.array(light_of)], np.uint32))

    def color(self, plane, light, active):
        """Return the RGB of light at the wavelengths of paths for a plane."""
        first, rgb = plane * BINS + light.first_bin, mi.Color3f(0)
        packets = len(light.packets)
        for k in range(4 * packets):
            place = first + k * spacing_of(packets)
            color = dr.gather(mi.Vector4f, self._colors, place, active)
            value = light.at(k)
            rgb += mi.Color3f(value * color.x, value * color.y, value * color.z)
        return rgb


class SpectralPlanes(LightPlanes):
    """Planes of one emitter of a lamp each. tables: of the scene; others as in `LightPlanes`."""

    def __init__(
        self,
        light_of: Any,
        lights: int,
        size: tuple[int, int],
        *,
        tables: ColorTables,
        is_split: bool = False,
        is_in_blocks: bool = True,
        start: Floats | None = None,
    ) -> None:
        super().__init__(
            light_of, lights, size, is_split=is_split, is_in_blocks=is_in_blocks, start=start
        )
        self._tables = tables

    @dr.syntax
    def add(self, pixel, emitter, value, direction, uv, bounces, active):
        """Add light to the planes of all emitters of the lamp that `emitter` belongs to.

        value: `PowerByWavelength`. The other parameters are those of `LightPlanes`.
        """
        active = mi.Bool(active)
        for packet in value.packets:
            active &= dr.all(dr.isfinite(packet))
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        plane = dr.gather(mi.UInt32, self._light_of, instance, active)
        last = plane + dr.gather(mi.UInt32, self._tables.plane_count, instance, active)
        while active:
            rgb = self._tables.color(plane, value, active)
            self._add_to_light(pixel, mi.UInt32(plane), rgb, bounces, active)
            plane += 1
            active &= plane < last


def _color_table(spectrum: Spectrum | None, observer: Observer) -> Doubles:
    """Return the linear Rec.709 (BINS, 3) of light of 1 in each bin.

    spectrum: of an emitter, whose light is relative to D65, for luminance 1; None for light as it
    is in the scene.
    """
    waves: Doubles = FIRST_NM + 0.5 + np.arange(BINS, dtype=np.float64)
    if spectrum is None:
        share = np.full(BINS, mi.MI_CIE_Y_NORMALIZATION)
    else:
        powers = np.interp(waves, WAVELENGTHS, spectrum)
        share = powers / (powers @ EYE.curves(waves)[:, 1]) / _d65(waves)
    return np.asarray(share[:, None] * observer.response(waves))


def _d65(waves: Doubles) -> Doubles:
    """Return D65 as Mitsuba has it, for an emission of white, at wavelengths (k,)."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(waves))
    si.wavelengths = mi.Spectrum(mi.Float(aligned(waves, np.float32)))
    return np.array(mi.load_dict({"type": "d65"}).eval(si)[0], np.float64)
