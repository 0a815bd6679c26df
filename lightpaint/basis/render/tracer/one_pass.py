"""The one-pass basis: a path tracer that separates the contributions of the lights.

Radiance is a sum over the emitters that a path reaches, either by hitting one or by sampling one
(next-event estimation). This integrator traces exactly the paths of Mitsuba's own `path`, and adds
each contribution to the image of its emitter instead of to a single image. It draws random numbers
in the same order, so with equal seeds the sum over the lights equals `mi.render` up to round-off,
and one pass serves all lights.

That is its plain mode, `trace_plainly`, which tests compare with Mitsuba. For a basis it does two
things better, at the same cost: it uses a low-discrepancy sequence instead of random numbers (see
sobol.py), and a trained guide chooses the emitters (basis_render.py).

Measuring points are surfaces, diffuse and white. These reflect the radiance E / π, so π times the
radiance that leaves one is the irradiance. There the path tracer samples lights as elsewhere, also
lights without a size, which Mitsuba's `irradiancemeter` does not see.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

import gc
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats, Indices, aligned
from lightpaint.basis.render.integrators import depth_limit, has_indirect_planes, needs_a_bounce
from lightpaint.basis.render.render_budget import BLOCK_SPP
from lightpaint.basis.render.tracer.emitter_guide import EmitterGuide
from lightpaint.basis.render.tracer.light_planes import (
    ColorTables,
    LightPlanes,
    SpectralPlanes,
    lights_by_instance,
    packets_of,
)
from lightpaint.basis.render.tracer.path_tracer import Rules, View, trace_paths, trace_samples
from lightpaint.basis.render.tracer.sobol import SobolPairs
from lightpaint.basis.render.tracer.texel_table import TexelTable
from lightpaint.basis.render.tracer.wavelengths import RgbPaths, SpectralPaths
from lightpaint.scene import MeasuringPoints, Scene, Stream, pass_seed
from lightpaint.scene.runtime.kernel_threads import kernels

#: Number of emitter samples at the first vertex, and at later ones: keys are exclusive upper bounds
#: of the number of emitters.
FIRST_EMITTER_SAMPLES = 8
LATER_EMITTER_SAMPLES = {32: 2, 128: 4, 2**32: 8}

#: Side of the tiles of pixels that are traced one after the other. Rays that the processor traces
#: together then start close together, which takes .92 to .98 of the time of pixels in rows.
TILE = 4

#: Indices of number streams; lower ones are the halves of the uniform samples.
TRAINING_STREAM, FIRST_TOP_UP_STREAM = 2, 3


class PointSurfaces:
    """Measuring points on the device. bsdf: the material of their surfaces."""

    def __init__(self, points: MeasuringPoints) -> None:
        self._positions, self._normals = (
            mi.Float(aligned(x.ravel(), np.float32)) for x in (points.positions, points.normals)
        )
        self._is_cylindrical = mi.UInt32(aligned(points.is_cylindrical, np.uint32))
        white = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
        self.bsdf = mi.load_dict({"type": "diffuse", "reflectance": white})

    def at(self, index, number):
        """Return the surface interaction at each point, seen along its normal.

        number: in [0, 1), chooses the direction in which cylindrical irradiance is measured.
        """
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p = dr.gather(mi.Point3f, self._positions, index)
        normal = dr.gather(mi.Normal3f, self._normals, index)
        sin, cos = dr.sincos(dr.two_pi * number)
        around = mi.Normal3f(mi.Frame3f(normal).to_world(mi.Vector3f(cos, sin, 0)))
        si.n = dr.select(dr.gather(mi.UInt32, self._is_cylindrical, index) != 0, around, normal)
        si.sh_frame = mi.Frame3f(si.n)
        si.wi = mi.Vector3f(0, 0, 1)
        return si


class Tracer:
    """A loaded scene with all lights at unit emission, whose samples are traced into `LightPlanes`.

    Close it before loading another scene. seed: seed of all random numbers. guide_table: the table
    of a trained guide; without one, the guide must be trained first. emitter_samples: numbers of
    emitter samples at the first vertex and at later ones, to override the defaults. loaded: the
    scene as loaded by the tracer of another view. views: the scene through other sensors, whose
    tracers will share the loaded scene.

    The samples of a pixel are terms of one sequence for each half, however they are divided into
    passes. So their sum depends neither on the passes nor on the number of threads.
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
        with scene.variant():
            self.loaded = scene.load(unit, views=views, evenly=True) if loaded is None else loaded
            self._texels = TexelTable.of(scene, self.loaded)
            self.light_of = lights_by_instance(self.loaded, planes_by_emitter(scene))
            eye = scene.eye(self.loaded)
            self.guide = EmitterGuide(self.loaded, self.light_of, eye, guide_table)
            self._planes = self._kind_of_planes()
        self.guide_table = guide_table if self.guide.is_trained else None
        if emitter_samples is None:
            emitter_samples = FIRST_EMITTER_SAMPLES, later_emitter_samples(self.guide.count)
        self._emitter_samples = emitter_samples
        # One stream of numbers for each half, one for training, and one for each half of a top-up,
        # all independent.
        self._streams = [pass_seed(seed, Stream.NUMBERS, k) for k in range(5)]

    def _kind_of_planes(self) -> Callable[..., LightPlanes]:
        """Return the function that makes planes of rows and columns of pixels, and options."""
        lights, is_split = len(self.scene.lights), has_indirect_planes(self.scene)
        if not self.scene.is_spectral:
            texels = self._texels
            return partial(LightPlanes, self.light_of, lights, is_split=is_split, texels=texels)
        tables = ColorTables(self.scene, self.light_of)
        return partial(SpectralPlanes, self.light_of, lights, is_split=is_split, tables=tables)

    def learn(self, rows: range, first: int, spp: int) -> None:
        """Train the guide with some samples of some rows, and discard their light.

        first: number of samples per pixel in earlier passes.
        """
        nowhere = self._planes((1, 1))
        nowhere.discard_light()
        with self.scene.variant(), kernels():
            self._trace_rows(TRAINING_STREAM, nowhere, rows, first, spp)
            self.guide.evaluate()
        self.guide.update()

    def end_training(self) -> Floats:
        """Finish training, and return the table of the guide, (2, cells, emitters)."""
        self.guide_table = self.guide.table()
        self.guide.freeze()
        return self.guide_table

    @property
    def is_trained(self) -> bool:
        """True once the guide is trained."""
        return self.guide_table is not None

    def planes(self, rows: range, start: Floats | None = None) -> LightPlanes:
        """Return planes for some rows, without added samples.

        start: initial sums of earlier samples, (planes, rows, columns, 3).
        """
        size = len(rows), self.scene.size[1]
        return self._planes(size, start=start)

    def pixel_planes(self, pixels: int) -> LightPlanes:
        """Return planes for a number of single pixels, without added samples."""
        return self._planes((1, pixels))

    def add(self, planes: LightPlanes, half: int, rows: range, first: int, spp: int) -> None:
        """Trace some samples of some rows for one half, and add their light to the `planes` of
        these rows.

        first: number of earlier samples per pixel of that half.
        """
        with self.scene.variant(), kernels():
            while spp > 0:
                # Blocks begin at multiples of their size, however samples are divided into passes.
                part = min(spp, BLOCK_SPP - first % BLOCK_SPP)
                self._trace_rows(half, planes, rows, first, part)
                planes.evaluate()
                first, spp = first + part, spp - part
                if first % BLOCK_SPP == 0:
                    planes.end_block()

    def top_up(
        self, planes: LightPlanes, half: int, pixels: Indices, first: Indices, spp: Indices
    ) -> None:
        """Trace additional samples of single pixels for one half, and add their light to their
        `planes`.

        pixels: (p,), row-major indices into the picture, without repetitions; `planes` are (1, p).
        first: (p,), number of samples in earlier calls. spp: (p,), number of samples to take.
        """
        with self.scene.variant(), kernels():
            places, stream = np.arange(pixels.size), FIRST_TOP_UP_STREAM + half
            for done in range(0, int(spp.max(initial=0)), BLOCK_SPP):
                part = np.clip(spp - done, 0, BLOCK_SPP)
                self._trace(stream, planes, places, pixels, first + done, part)
                planes.evaluate()
                planes.end_block()

    def close(self) -> None:
        """Release the scene and everything that refers to it, and memory that Dr.Jit keeps."""
        del self.loaded, self.light_of, self.guide, self._texels, self._planes
        gc.collect()
        dr.flush_malloc_cache()

    def _trace_rows(
        self, stream: int, planes: LightPlanes, rows: range, first: int, spp: int
    ) -> None:
        """Trace the same samples of all pixels of some rows, tile by tile."""
        width = self.scene.size[1]
        pixels = (np.array(rows)[:, None] * width + np.arange(width)).ravel()
        places = places_by_tile(len(rows), width)
        begin, count = np.full(pixels.size, first), np.full(pixels.size, spp)
        self._trace(stream, planes, places, pixels[places], begin, count)

    def _trace(
        self,
        stream: int,
        planes: LightPlanes,
        places: Indices,
        pixels: Indices,
        first: Indices,
        spp: Indices,
    ) -> None:
        """Trace samples of pixels in the given order. places: of the pixels in `planes`."""
        view = view_of(self.scene, self.loaded)
        # Values that differ between calls must not become constants of the kernel, which would be
        # recompiled.
        place, pixel, begin, end = (
            mi.UInt32(aligned(x, np.uint32)) for x in (places, pixels, first, first + spp)
        )
        numbers = SobolPairs(pixel, dr.opaque(mi.UInt32, self._streams[stream]))
        first_emitters, later = self._emitter_samples
        rules = rules_of(self.scene)._replace(
            first_emitter_samples=dr.opaque(mi.UInt32, first_emitters),
            later_emitter_samples=dr.opaque(mi.UInt32, later),
        )
        # Dr.Jit records a loop twice to find values that it never changes, so the innermost of
        # three loops eight times, and each time asks every single emitter and surface. The kernel
        # is not faster for it.
        with dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, False):
            trace_samples(view, numbers, self.guide, planes, rules, pixel, place, begin, end)


def places_by_tile(rows: int, columns: int) -> Indices:
    """Return the row-major indices of the pixels of a picture, in the order of its tiles."""
    padded = np.full((-(-rows // TILE) * TILE, -(-columns // TILE) * TILE), -1)
    padded[:rows, :columns] = np.arange(rows * columns).reshape(rows, columns)
    tiles = padded.reshape(len(padded) // TILE, TILE, -1, TILE).swapaxes(1, 2).ravel()
    return tiles[tiles >= 0]


def later_emitter_samples(emitters: int) -> int:
    """Return the number of emitter samples at each vertex after the first."""
    return next(samples for fewer, samples in LATER_EMITTER_SAMPLES.items() if emitters < fewer)


def view_of(scene: Scene, loaded: Any) -> View:
    """Return the view of `scene`, by its camera or at its points. loaded: the loaded scene."""
    camera = scene.camera(loaded)
    width, height = (int(v) // scene.film.block for v in camera.film().crop_size())
    points = None if scene.points is None else PointSurfaces(scene.points)
    paths = SpectralPaths(packets_of(scene)) if scene.is_spectral else RgbPaths()
    return View(loaded, camera, width, height, points, paths)


def rules_of(scene: Scene) -> Rules:
    """Return the limits of the paths that the integrator of `scene` follows."""
    integrator = scene.integrator
    return Rules(
        hide_emitters=integrator.hide_emitters,
        must_bounce=needs_a_bounce(scene),
        # These are not constants of the kernel, which serves paths of any length.
        max_depth=dr.opaque(mi.UInt32, depth_limit(integrator)),
        rr_depth=dr.opaque(mi.UInt32, integrator.rr_depth),
    )


def planes_by_emitter(scene: Scene) -> dict[str, int]:
    """Return the plane of each loaded emitter, by its name; for an image, the plane of a texel."""
    planes = dict(scene.plane_of)
    texels = {x.texel.image: planes[x.name] for x in scene.emitters if x.texel and x.name in planes}
    return planes | texels


def trace_plainly(scene: Scene, loaded: Any, *, seed: int, spp: int) -> Floats:
    """Render all planes with Mitsuba's own random numbers and choices, (n, h, w, 3).

    loaded: `scene` as returned by its `load`. spp: samples per pixel, which some samplers round up.
    """
    view = view_of(scene, loaded)
    sampler = view.camera.sampler().clone()
    sampler.set_sample_count(spp)
    spp = int(sampler.sample_count())
    sampler.set_samples_per_wavefront(spp)
    pixels = view.width * view.height
    sampler.seed(seed, pixels * spp)
    pixel = dr.arange(mi.UInt32, pixels * spp) // dr.opaque(mi.UInt32, spp)
    light_of = lights_by_instance(loaded, planes_by_emitter(scene))
    size = view.height, view.width
    texels = TexelTable.of(scene, loaded)
    planes = LightPlanes(light_of, len(scene.lights), size, is_shared=True, texels=texels)
    rules = rules_of(scene)
    trace_paths(view, sampler, None, None, planes, rules, pixel, pixel, mi.UInt32(0))
    planes.evaluate()
    return planes.sums() / spp
