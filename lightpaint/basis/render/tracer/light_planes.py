"""Planes on the device to which paths add their light, one for each light.

For a render with spectra, the scene is loaded with all lamps at white, whose spectrum is D65. The
colour that a path adds to the plane of an emitter is a sum over its wavelengths: its light there
relative to D65, times the emitter's power, times the response of the observer, in linear Rec.709.
So one path serves all emitters of a lamp.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Doubles, Floats, aligned
from lightpaint.basis.render.tracer.texel_table import TexelTable
from lightpaint.basis.render.tracer.wavelengths import BINS, FIRST_NM, packets_for, spacing_of
from lightpaint.colour import EYE, WAVELENGTHS, Observer, Spectrum
from lightpaint.scene import Scene


class LightPlanes:
    """Undivided sums of the samples of some pixels, light by light.

    light_of: from `lights_by_instance`. lights: number of lights. size: rows and columns of pixels,
    which `add` indexes in row-major order. is_shared: whether several paths may add to a pixel at
    the same time, in an order that then affects the last bits; otherwise each pixel has a single
    path, which adds in order. is_split: whether direct and indirect light have separate planes.
    start: initial sums, in the form returned by `sums`; None for zeros. texels: of
    images; None if there are none.

    Float32 sums of many samples would lose what each of them adds. So the tracer calls `end_block`
    after each block of samples, and blocks are summed in turn.

    The sums are attributes of this object rather than variables of the tracing loop, because Dr.Jit
    rejects a loop variable that never changes, such as `seen` where all lights are points.
    """

    def __init__(
        self,
        light_of: Any,
        lights: int,
        size: tuple[int, int],
        *,
        is_shared: bool = False,
        is_split: bool = False,
        start: Floats | None = None,
        texels: TexelTable | None = None,
    ) -> None:
        self._texels = texels
        self.count, self.size = lights * (2 if is_split else 1), size
        self._first_indirect = lights if is_split else 0
        pixels = size[0] * size[1]
        self._light_of = light_of
        self._keeps = dr.opaque(mi.Bool, True)
        self._mode = dr.ReduceMode.Auto if is_shared else dr.ReduceMode.NoConflicts
        self._pixels = dr.opaque(mi.UInt32, pixels)
        if start is None:
            self._sums = dr.zeros(mi.Float, self.count * pixels * 3)
        else:
            self._sums = mi.Float(start.ravel())
        self._ended = None  # Sums of ended blocks
        self._seen = dr.zeros(mi.Float, pixels)

    def discard_light(self) -> None:
        """Discard all light, of paths from which the guide only learns. They have the kernel of
        other paths.
        """
        self._keeps = dr.opaque(mi.Bool, False)

    def add(self, pixel, emitter, value, direction, uv, bounces, active):
        """Add RGB values to the plane of the light that `emitter` belongs to.

        direction: unit vector to the emitter. uv: texture coordinates of the place on its surface,
        or on its slide. One of the two decides between the texels of an image. bounces: number of
        surfaces that scattered the light; with more than one it is indirect. Values that are not
        finite are skipped: one path in a hundred million has them, and a single one would spoil all
        sums over the picture.
        """
        active = active & dr.all(dr.isfinite(value))
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        if self._texels is not None:
            is_image = self._texels.is_image(instance, active)
            for light, factor, part in self._texels.shares(instance, direction, uv, is_image):
                self._add_to_light(pixel, light, factor * value, bounces, part)
            active &= ~is_image
        light = dr.gather(mi.UInt32, self._light_of, instance, active)
        self._add_to_light(pixel, light, value, bounces, active)

    def _add_to_light(self, pixel, light, value, bounces, active):
        """Add RGB values to the plane of a light."""
        if self._first_indirect:
            light[bounces > 1] += self._first_indirect
        place = dr.fma(light, self._pixels, pixel) * 3
        for channel in range(3):
            self._add_one(self._sums, value[channel], place + channel, active)

    def note_seen(self, pixel, active):
        """Count a camera ray that sees an emitter, directly or through clear glass."""
        self._add_one(self._seen, mi.Float(1), pixel, active)

    def _add_one(self, array, value, place, active):
        add, active = dr.ReduceOp.Add, active & self._keeps
        dr.scatter_reduce(add, array, value, place, active, mode=self._mode)

    def evaluate(self) -> None:
        """Run the recorded kernels, and wait for them: a running kernel cannot be interrupted."""
        dr.eval(self._sums, self._ended, self._seen)
        dr.sync_thread()

    def end_block(self) -> None:
        """Add the sums to the sums of ended blocks, after `evaluate`, and begin a new block."""
        self._ended = self._sums if self._ended is None else self._ended + self._sums
        self._sums = dr.zeros(mi.Float, dr.width(self._ended))
        self.evaluate()

    def sums(self, *, shares_memory: bool = False) -> Floats:
        """Return the sums, (lights, rows, columns, 3).

        If split: (2 lights, rows, columns, 3), first the direct light of all lights, then the
        indirect. shares_memory: whether to return the sums themselves, if nothing more will be
        added, rather than a copy.
        """
        if self._ended is None:
            sums = np.asarray(self._sums) if shares_memory else np.array(self._sums)
        else:
            sums = np.array(self._ended + self._sums)
        return sums.reshape(self.count, *self.size, 3)

    def seen(self) -> Floats:
        """Return the number of camera rays in each pixel that saw an emitter, (rows, columns)."""
        return np.array(self._seen).reshape(self.size)


def lights_by_instance(scene: Any, plane_of: Mapping[str, int]) -> Any:
    """Return a UInt32 array from the Dr.Jit instance id of an emitter to the plane of its light.

    plane_of: index of the plane by the emitter's name. Emitters that belong to no light are black,
    so they may be assigned to the first plane.
    """
    instances = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr())).tolist()
    table = np.zeros(max(instances) + 1, dtype=np.uint32)
    for instance, emitter in zip(instances, scene.emitters(), strict=True):
        table[instance] = plane_of.get(emitter.id(), 0)
    return mi.UInt32(table)


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
        start: Floats | None = None,
    ) -> None:
        super().__init__(light_of, lights, size, is_split=is_split, start=start)
        self._tables = tables

    @dr.syntax
    def add(self, pixel, emitter, value, direction, uv, bounces, active):
        """Add light to the planes of all emitters of the lamp that `emitter` belongs to.

        value: `PowerByWavelength`. The other parameters are as in `LightPlanes`.
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
