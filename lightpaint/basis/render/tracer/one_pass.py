"""The one-pass basis: a path tracer that separates the contributions of lights.

Radiance is a sum over the emitters that a path reaches, by chance (a ray that hits one) or
by choice (next-event estimation). This integrator traces the same paths as Mitsuba's own `path`,
and adds each contribution to the image of its emitter instead of to one image. It draws random
numbers in the same order too, so that with equal seeds the sum over the lights equals `mi.render`
up to round-off, and one pass serves all lights.

That is its plain mode, `trace_plainly`, which tests compare with Mitsuba's. For a basis it improves
two things at the same cost: it takes numbers from a low-discrepancy sequence instead of a random
one (see sobol.py), and chooses emitters by a trained guide (guide_training.py).

Import this module only after a JIT variant is set: its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-call"

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats, Indices, aligned
from lightpaint.basis.render.integrators import (
    depth_limit,
    has_indirect_planes,
    needs_a_bounce,
)
from lightpaint.basis.render.tracer.emitter_guide import EmitterGuide
from lightpaint.basis.render.tracer.light_planes import LightPlanes, lights_by_instance
from lightpaint.basis.render.tracer.path_tracer import Rules, View, trace_paths, trace_samples
from lightpaint.basis.render.tracer.sobol import SobolPairs
from lightpaint.scene.runtime.kernel_threads import kernels
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed

#: Number of emitters sampled at the first vertex, and at later ones if there are fewer emitters
#: than that.
FIRST_EMITTER_SAMPLES = 8
LATER_EMITTER_SAMPLES = {32: 2, 128: 4, 2**32: 8}

#: Streams of numbers; those below are of the halves of all pixels.
TRAINING_STREAM, FIRST_TOP_UP_STREAM = 2, 3


class Tracer:
    """A tracer of a loaded scene, with all lights at unit emission, into `LightPlanes`.

    Close it before another scene is loaded. seed: of all random numbers. guide_table: of a trained
    guide; without one, the guide has to be trained first. emitter_samples: at the first vertex and
    at later ones, if not the default. loaded: scene loaded by the tracer of another view. views:
    the scene through other sensors, whose tracers will share the scene loaded here.

    The samples of a pixel are terms of one sequence for each half, however they are divided into
    calls. So their sum depends neither on that nor on the number of threads.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        guide_table: Floats | None = None,
        *,
        emitter_samples: tuple[int, int] | None = None,
        loaded: Any = None,
        views: Sequence[Scene] = (),
    ) -> None:
        self.scene = scene
        unit = {light.name: (1.0, 1.0, 1.0) for light in scene.lights}
        self.loaded = scene.load(unit, views=views) if loaded is None else loaded
        self.light_of = lights_by_instance(self.loaded, scene.plane_of)
        self.guide = EmitterGuide(self.loaded, self.light_of, scene.eye(self.loaded), guide_table)
        self.guide_table = guide_table
        if emitter_samples is None:
            emitter_samples = FIRST_EMITTER_SAMPLES, later_emitter_samples(self.guide.count)
        self._emitter_samples = emitter_samples
        # One stream of numbers for each half, for the training, and for each half of a top-up, far
        # from all others.
        self._streams = [pass_seed(seed, Stream.NUMBERS, k) for k in range(5)]

    def learn(self, rows: range, first: int, spp: int) -> None:
        """Learn from some samples of some rows, whose light is not kept.

        first: number of samples of a pixel that earlier passes took.
        """
        lights, is_split = len(self.scene.lights), has_indirect_planes(self.scene)
        nowhere = LightPlanes.nowhere(self.light_of, lights, is_split=is_split)
        with kernels():
            self._trace(TRAINING_STREAM, nowhere, *self._of_rows(rows, first, spp))
            self.guide.evaluate()
        self.guide.update()

    def end_training(self) -> Floats:
        """Stop training, and return the table of the guide, (2, cells, emitters)."""
        self.guide_table = self.guide.table()
        self.guide.freeze()
        return self.guide_table

    @property
    def is_trained(self) -> bool:
        """True once the guide is trained."""
        return self.guide_table is not None

    def planes(self, rows: range, start: Floats | None = None) -> LightPlanes:
        """Return planes of some rows, to which nothing is added yet.

        start: sums of samples that come before, (planes, rows, columns, 3), which they begin with.
        """
        size = len(rows), self.scene.size[1]
        is_split = has_indirect_planes(self.scene)
        lights = len(self.scene.lights)
        return LightPlanes(self.light_of, lights, size, is_split=is_split, start=start)

    def pixel_planes(self, pixels: int) -> LightPlanes:
        """Return empty planes of a number of single pixels."""
        is_split = has_indirect_planes(self.scene)
        return LightPlanes(self.light_of, len(self.scene.lights), (1, pixels), is_split=is_split)

    def add(self, planes: LightPlanes, half: int, rows: range, first: int, spp: int) -> None:
        """Add the light of some samples of some rows, of one half, to `planes` of these rows.

        first: samples of a pixel of that half that come before.
        """
        with kernels():
            self._trace(half, planes, *self._of_rows(rows, first, spp))
            planes.evaluate()

    def top_up(
        self, planes: LightPlanes, half: int, pixels: Indices, first: Indices, spp: Indices
    ) -> None:
        """Add the light of further samples of single pixels, of one half, to `planes` of these.

        pixels: (p,), of the picture, counted along its rows, each once; `planes` are (1, p). first:
        (p,), samples that such calls have taken before. spp: (p,), how many to take.
        """
        with kernels():
            self._trace(FIRST_TOP_UP_STREAM + half, planes, pixels, first, spp)
            planes.evaluate()

    def close(self) -> None:
        """Release the scene and all that refers to it."""
        del self.loaded, self.light_of, self.guide

    def _of_rows(self, rows: range, first: int, spp: int) -> tuple[Indices, Indices, Indices]:
        """Return the pixels of some rows, and for each of them the same samples."""
        width = self.scene.size[1]
        pixels = (np.array(rows)[:, None] * width + np.arange(width)).ravel()
        return pixels, np.full(pixels.size, first), np.full(pixels.size, spp)

    def _trace(
        self, stream: int, planes: LightPlanes, pixels: Indices, first: Indices, spp: Indices
    ) -> None:
        view = view_of(self.scene, self.loaded)
        place = dr.arange(mi.UInt32, pixels.size)
        # Values that differ between calls are no constants of the kernel, which is compiled once.
        pixel, begin, end = (mi.UInt32(aligned(x, np.uint32)) for x in (pixels, first, first + spp))
        numbers = SobolPairs(pixel, dr.opaque(mi.UInt32, self._streams[stream]))
        first_emitters, later = self._emitter_samples
        rules = rules_of(self.scene)._replace(
            first_emitter_samples=dr.opaque(mi.UInt32, first_emitters),
            later_emitter_samples=dr.opaque(mi.UInt32, later),
        )
        trace_samples(view, numbers, self.guide, planes, rules, pixel, place, begin, end)


def later_emitter_samples(emitters: int) -> int:
    """Return how many of a number of emitters are sampled at vertices after the first."""
    return next(samples for fewer, samples in LATER_EMITTER_SAMPLES.items() if emitters < fewer)


def view_of(scene: Scene, loaded: Any) -> View:
    """Return the view of the loaded `scene` through its camera."""
    camera = scene.camera(loaded)
    width, height = (int(v) // scene.film.block for v in camera.film().crop_size())
    return View(loaded, camera, width, height)


def rules_of(scene: Scene) -> Rules:
    """Return the rules by which the integrator of `scene` follows paths."""
    integrator = scene.integrator
    return Rules(
        hide_emitters=integrator.hide_emitters,
        must_bounce=needs_a_bounce(scene),
        max_depth=mi.UInt32(depth_limit(integrator)),
        rr_depth=mi.UInt32(integrator.rr_depth),
    )


def trace_plainly(scene: Scene, loaded: Any, *, seed: int, spp: int) -> Floats:
    """Render all planes with Mitsuba's own numbers and choices, (n, h, w, 3).

    loaded: `scene`, by its `load`. spp: samples per pixel, which some samplers round up.
    """
    view = view_of(scene, loaded)
    sampler = view.camera.sampler().clone()
    sampler.set_sample_count(spp)
    spp = int(sampler.sample_count())
    sampler.set_samples_per_wavefront(spp)
    pixels = view.width * view.height
    sampler.seed(seed, pixels * spp)
    pixel = dr.arange(mi.UInt32, pixels * spp) // dr.opaque(mi.UInt32, spp)
    light_of = lights_by_instance(loaded, scene.plane_of)
    size = view.height, view.width
    planes = LightPlanes(light_of, len(scene.lights), size, is_shared=True)
    rules = rules_of(scene)
    trace_paths(view, sampler, None, None, planes, rules, pixel, pixel, mi.UInt32(0))
    planes.evaluate()
    return planes.sums() / spp
