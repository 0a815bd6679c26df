"""Planes that paths add their light to, one for each light, on the device that renders.

Import this module only after a JIT variant is set: its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats


class LightPlanes:
    """Sums of the samples of some pixels, undivided, light by light.

    light_of: as `lights_by_instance` returns it. lights: their number. size: rows and columns of
    the pixels, which `add` counts row by row. is_shared: whether several paths may add to one pixel
    at a time, in an order that decides the last bits; else each pixel has one path, which adds in
    order. is_split: whether direct and indirect light have separate planes. start: initial sums, as
    `sums` returns them; zeros if None.

    This is an object rather than arrays of the tracing loop, since Dr.Jit refuses an array that is
    never modified, such as `seen` when all lights are points.
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
    ) -> None:
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
        self._seen = dr.zeros(mi.Float, pixels)

    @classmethod
    def nowhere(cls, light_of: Any, lights: int, *, is_split: bool) -> "LightPlanes":
        """Return planes that store nothing, for training paths.

        lights, is_split: as for the planes of other paths, so that both share a kernel.
        """
        nothing = cls(light_of, lights, (1, 1), is_split=is_split)
        nothing._keeps = dr.opaque(mi.Bool, False)
        return nothing

    def add(self, pixel, emitter, value, bounces, active):
        """Add RGB values to the plane of the light that `emitter` belongs to.

        bounces: the number of surfaces that have scattered them; beyond one the light is indirect.
        NaNs, which one path in a hundred million carries, are dropped: one such pixel would make
        all sums over the picture NaN.
        """
        active = active & dr.all(dr.isfinite(value))
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        light = dr.gather(mi.UInt32, self._light_of, instance, active)
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
        """Run the traced kernel, and wait for it: a running kernel cannot be interrupted."""
        dr.eval(self._sums, self._seen)
        dr.sync_thread()

    def sums(self) -> Floats:
        """Return a copy of the sums, (lights, rows, columns, 3).

        Split, (2 lights, rows, columns, 3): direct light of each, then indirect light of each.
        """
        return np.array(self._sums).reshape(self.count, *self.size, 3)

    def seen(self) -> Floats:
        """Return how many camera rays of each pixel saw an emitter, (rows, columns)."""
        return np.array(self._seen).reshape(self.size)


def lights_by_instance(scene: Any, plane_of: Mapping[str, int]) -> Any:
    """Return a UInt32 array from the Dr.Jit instance id of an emitter to its light's plane.

    plane_of: index of the plane by the emitter's name. Emitters of no light are black and do no
    harm in the first plane.
    """
    instances = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr())).tolist()
    table = np.zeros(max(instances) + 1, dtype=np.uint32)
    for instance, emitter in zip(instances, scene.emitters(), strict=True):
        table[instance] = plane_of.get(emitter.id(), 0)
    return mi.UInt32(table)
