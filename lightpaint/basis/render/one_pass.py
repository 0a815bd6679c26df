"""The one-pass basis: a path tracer that keeps apart what each light contributes.

Radiance is a sum over the emitters that a path reaches, by chance (a ray that hits one) or
by choice (next-event estimation). This integrator traces the very paths of Mitsuba's own
`path`, and adds each such contribution to the image of its emitter instead of to one image.
It draws random numbers in the same order too, so that with equal seeds the sum over the
lights equals `mi.render` up to round-off, and one pass serves all lights.

That is its plain mode, which tests hold against Mitsuba's. For a basis two things are done
better, at the same cost: numbers come from an evenly spread sequence instead of from chance
(see sobol.py), and emitters are chosen by what earlier passes have learned (see guide.py).

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

# mypy: disable-error-code="no-untyped-call"

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.render.guide import Guide
from lightpaint.basis.render.half_sums import HalfSums
from lightpaint.basis.render.integrators import depth_limit, needs_a_bounce
from lightpaint.basis.render.paths import Planes, camera_rays, trace
from lightpaint.basis.render.sobol import SobolPairs
from lightpaint.scene.integrator import Integrator
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed


class Tracer:
    """A loaded scene, all lights at unit emission, that adds passes to `HalfSums`.

    Close it before another scene is loaded. seed: of all random numbers.
    learned: what an earlier one had learned of the same scene, if there was one.
    """

    def __init__(self, scene: Scene, seed: int, learned: Floats | None) -> None:
        self.scene = scene
        self.loaded = scene.load({light.name: (1.0, 1.0, 1.0) for light in scene.lights})
        self.light_of = lights_by_instance(self.loaded, scene.plane_of)
        self.guide = Guide(self.loaded, self.light_of, scene.eye(self.loaded), learned)
        # One stream of numbers for each half and for the rehearsal, far from all others.
        self.streams = [pass_seed(seed, Stream.NUMBERS, k) for k in range(3)]

    def rehearse(self, spp: int) -> None:
        """Render a pass only to learn from it: without guidance it is the noisiest."""
        nowhere = HalfSums(len(self.scene.lights), self.scene.size)
        self._trace(nowhere.planes[0], nowhere.seen, spp, Guided(self.streams[2], 0, self.guide))

    def learn(self, rows: range, first: int, spp: int) -> None:
        """Learn from some samples of some rows, whose light is not kept.

        first: samples of a pixel that were learned from before.
        """
        planes, seen = dr.zeros(mi.Float, 3 * len(self.scene.lights)), dr.zeros(mi.Float, 1)
        numbers = Guided(self.streams[2], first, self.guide)
        self._trace(planes, seen, spp, numbers, rows, is_kept=False)

    def add_pass(self, sums: HalfSums, half: int, spp: int) -> None:
        """Add `spp` samples per pixel to one of the halves of `sums`."""
        numbers = Guided(self.streams[half], sums.spp[half], self.guide)
        self._trace(sums.planes[half], sums.seen, spp, numbers)
        sums.spp[half] += spp
        sums.passes[half] += 1

    def part(self, half: int, rows: range, first: int, spp: int) -> tuple[Floats, Floats]:
        """Return the sums of some samples of some rows, (n, rows, w, 3), and rays that saw an
        emitter.

        first: samples of a pixel of that half that come before.
        """
        n, width = len(self.scene.lights), self.scene.size[1]
        planes = dr.zeros(mi.Float, n * len(rows) * width * 3)
        seen = dr.zeros(mi.Float, len(rows) * width)
        numbers = Guided(self.streams[half], first, self.guide)
        self._trace(planes, seen, spp, numbers, rows)
        shape = len(rows), width
        return np.array(planes).reshape(n, *shape, 3), np.array(seen).reshape(shape)

    def close(self) -> None:
        """Release the scene and all that refers to it."""
        del self.loaded, self.light_of, self.guide

    def _trace(
        self,
        planes: Any,
        seen: Any,
        spp: int,
        numbers: "Guided",
        rows: range | None = None,
        *,
        is_kept: bool = True,
    ) -> None:
        accumulate(
            self.loaded,
            self.scene.integrator,
            camera=self.scene.camera(self.loaded),
            light_of=self.light_of,
            planes=planes,
            seen=seen,
            spp=spp,
            guided=numbers,
            block=self.scene.film.block,
            must_bounce=needs_a_bounce(self.scene),
            rows=rows,
            is_kept=is_kept,
        )
        # A running kernel cannot be interrupted, and what is not waited for is still running.
        dr.sync_thread()


def lights_by_instance(scene: Any, plane_of: Mapping[str, int]) -> Any:
    """Return a UInt32 array from the Dr.Jit instance id of an emitter to its light's plane.

    plane_of: index of the plane by the emitter's name.
    """
    instances = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr())).tolist()
    table = np.zeros(max(instances) + 1, dtype=np.uint32)
    for instance, emitter in zip(instances, scene.emitters(), strict=True):
        # What is in no light is black, so that it does not matter to which it adds nothing.
        table[instance] = plane_of.get(emitter.id(), 0)
    return mi.UInt32(table)


@dataclass(frozen=True)
class Guided:
    """The guidance for drawing numbers and emitters.

    stream, first: the samples of a pixel are terms `first` … of the pixel's own sequence;
    passes that are averaged go on in one stream, passes that must be independent have two.
    guide: chooses emitters, and learns from the pass.
    """

    stream: int
    first: int
    guide: Guide


def accumulate(
    scene: Any,
    integrator: Integrator,
    *,
    camera: Any,
    light_of: Any,
    planes: Any,
    seen: Any,
    spp: int,
    seed: int = 0,
    guided: Guided | None = None,
    block: int = 1,
    must_bounce: bool = False,
    rows: range | None = None,
    is_kept: bool = True,
) -> int:
    """Trace `spp` paths per pixel and add what they carry, undivided, to `planes`.

    scene: an `mi.Scene`; camera: one of its sensors, with a box-filtered film.
    light_of: what `lights_by_instance` returns.
    planes: Float array of n·h·w·3 values, laid out (n, h, w, 3).
    seen: Float array of h·w values; counts the camera rays that see an emitter.
    guided: None draws all numbers at random, from `seed`, in Mitsuba's order.
    block: side of the blocks of the film's pixels that are pixels here.
    must_bounce: whether paths that only pass surfaces carry nothing (see integrators.py).
    rows: those of the picture that are rendered, which are then all that `planes` and `seen` have;
    guided alone. Their samples are the same as of the whole picture.
    is_kept: whether pixels are kept apart; else these have one, for all.
    Returns the number of paths per pixel, which some samplers round up.
    """
    width, height = (int(v) // block for v in camera.film().crop_size())
    sampler = None
    if guided is None:
        sampler = camera.sampler().clone()
        sampler.set_sample_count(spp)
        spp = int(sampler.sample_count())
        sampler.set_samples_per_wavefront(spp)
        sampler.seed(seed, width * height * spp)

    rows = range(height) if rows is None else rows
    sample = dr.arange(mi.UInt32, width * len(rows) * spp)
    its = sample // dr.opaque(mi.UInt32, spp)
    row = its // width
    pixel = (row * dr.opaque(mi.UInt32, rows.step) + dr.opaque(mi.UInt32, rows.start)) * width
    pixel += its - row * width
    numbers = None
    if guided is not None:
        term = sample - its * dr.opaque(mi.UInt32, spp) + dr.opaque(mi.UInt32, guided.first)
        numbers = SobolPairs(pixel, dr.opaque(mi.UInt32, guided.stream), term)
    ray, weight = camera_rays(camera, sampler, numbers, pixel, width, height)
    guide = guided.guide if guided is not None else None
    trace(
        scene,
        sampler,
        numbers,
        guide,
        ray,
        weight,
        Planes(
            planes,
            seen,
            light_of,
            its & dr.opaque(mi.UInt32, 0xFFFFFFFF if is_kept else 0),
            dr.opaque(mi.UInt32, width * len(rows) if is_kept else 1),
        ),
        hide_emitters=integrator.hide_emitters,
        must_bounce=must_bounce,
        max_depth=mi.UInt32(depth_limit(integrator)),
        rr_depth=mi.UInt32(integrator.rr_depth),
    )
    dr.eval(planes, seen)
    if guide is not None:
        guide.update()
    return spp
