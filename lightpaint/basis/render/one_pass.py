"""The one-pass basis: a path tracer that keeps apart what each light contributes.

Radiance is a sum over the emitters that a path reaches, by chance (a ray that hits one) or
by choice (next-event estimation). This integrator traces the very paths of Mitsuba's own
`path`, and adds each such contribution to the image of its emitter instead of to one image.
It draws random numbers in the same order too, so that with equal seeds the sum over the
lights equals `mi.render` up to round-off, and one pass serves all lights.

That is its plain mode, which tests hold against Mitsuba's. For a basis two things are done
better, at the same cost: numbers come from an evenly spread sequence instead of from chance
(see sequence.py), and emitters are chosen by what earlier passes have learned (see guide.py).

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

# Dr.Jit rewrites `_trace` from its source and traces it with arrays of any width, which
# a static checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.guide import Guide
from lightpaint.basis.render.sobol import APERTURE, FILM, TIME, SobolPairs
from lightpaint.scene.parsed import Integrator
from lightpaint.scene.render import Stream, pass_seed
from lightpaint.scene.scene import Scene


class HalfSums:
    """What two independent halves of the samples have come to, undivided, on the device.

    planes: per half, n·h·w·3 values laid out (n, h, w, 3). seen: h·w counts of camera rays
    that saw an emitter. spp, passes: per half, samples per pixel and passes so far.
    """

    def __init__(self, lights: int, size: tuple[int, int]) -> None:
        self.shape = (lights, *size, 3)
        count = lights * size[0] * size[1] * 3
        self.planes = [dr.zeros(mi.Float, count) for _ in range(2)]
        self.seen = dr.zeros(mi.Float, size[0] * size[1])
        self.spp, self.passes = [0, 0], [0, 0]

    @classmethod
    def of(cls, basis: Basis) -> "HalfSums":
        """The sums that made `basis`, up to round-off."""
        sums = cls(len(basis.lights), basis.size)
        a, b = sums.spp = list(basis.origin.halves)
        sums.passes = list(basis.origin.passes)
        # The mean is (a A + b B) / (a + b), half the difference (A − B) / 2.
        half_a = basis.images + basis.half_differences * (2 * b / (a + b))
        half_b = basis.images - basis.half_differences * (2 * a / (a + b))
        sums.planes = [mi.Float((half_a * a).ravel()), mi.Float((half_b * b).ravel())]
        sums.seen = mi.Float(basis.emitters_seen.ravel().astype(np.float32))
        return sums

    def mean_and_half_difference(self, *, is_last: bool) -> tuple[Floats, Floats]:
        """Of all samples, and between the halves, as arrays of `shape`.

        is_last: the sums are given up meanwhile, which saves as much memory again.
        """
        halves = []
        for half in range(2):
            halves.append(np.array(self.planes[half]).reshape(self.shape))
            if is_last:
                self.planes[half] = None
        (a, b), (mean, half_difference) = self.spp, halves
        # In place, one light at a time: these are the largest arrays there are.
        for plane_a, plane_b in zip(mean, half_difference, strict=True):
            plane_a /= a
            plane_b /= -b
            plane_b += plane_a
            plane_b /= 2
            # A is the mean of all plus the share of B in them times the difference.
            plane_a -= plane_b * np.float32(2 * b / (a + b))
        return mean, half_difference

    def emitters_seen(self) -> npt.NDArray[np.bool_]:
        """(h, w), pixels in which any camera ray saw an emitter."""
        return np.array(self.seen).reshape(self.shape[1:3]) > 0


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
        """A pass that counts for what it learns alone: it is the noisiest, knowing nothing."""
        nowhere = HalfSums(len(self.scene.lights), self.scene.size)
        self._trace(nowhere.planes[0], nowhere.seen, spp, Guided(self.streams[2], 0, self.guide))

    def add_pass(self, sums: HalfSums, half: int, spp: int) -> None:
        """Add `spp` samples per pixel to one of the halves of `sums`."""
        numbers = Guided(self.streams[half], sums.spp[half], self.guide)
        self._trace(sums.planes[half], sums.seen, spp, numbers)
        sums.spp[half] += spp
        sums.passes[half] += 1

    def close(self) -> None:
        """Let go of the scene and all that refers to it."""
        del self.loaded, self.light_of, self.guide

    def _trace(self, planes: Any, seen: Any, spp: int, numbers: "Guided") -> None:
        accumulate(
            self.loaded,
            self.scene.integrator,
            camera=self.scene.camera(self.loaded),
            light_of=self.light_of,
            planes=planes,
            seen=seen,
            spp=spp,
            guided=numbers,
        )
        # A running kernel cannot be interrupted, and what is not waited for is still running.
        dr.sync_thread()


def lights_by_instance(scene: Any, plane_of: Mapping[str, int]) -> Any:
    """UInt32 array that maps the Dr.Jit instance id of an emitter to the plane of its light.

    plane_of: index of the plane by the emitter's name.
    """
    instances = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr())).tolist()
    table = np.zeros(max(instances) + 1, dtype=np.uint32)
    for instance, emitter in zip(instances, scene.emitters(), strict=True):
        table[instance] = plane_of[emitter.id()]
    return mi.UInt32(table)


@dataclass(frozen=True)
class Guided:
    """How to draw numbers and emitters better than by chance.

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
) -> int:
    """Trace `spp` paths per pixel and add what they carry, undivided, to `planes`.

    scene: an `mi.Scene`; camera: one of its sensors, with a box-filtered film.
    light_of: what `lights_by_instance` returns.
    planes: Float array of n·h·w·3 values, laid out (n, h, w, 3).
    seen: Float array of h·w values; counts the camera rays that see an emitter.
    guided: None draws all numbers at random, from `seed`, in Mitsuba's order.
    Returns the number of paths per pixel, which some samplers round up.
    """
    width, height = (int(v) for v in camera.film().crop_size())
    sampler = None
    if guided is None:
        sampler = camera.sampler().clone()
        sampler.set_sample_count(spp)
        spp = int(sampler.sample_count())
        sampler.set_samples_per_wavefront(spp)
        sampler.seed(seed, width * height * spp)

    sample = dr.arange(mi.UInt32, width * height * spp)
    pixel = sample // dr.opaque(mi.UInt32, spp)
    numbers = None
    if guided is not None:
        term = sample - pixel * dr.opaque(mi.UInt32, spp) + dr.opaque(mi.UInt32, guided.first)
        numbers = SobolPairs(pixel, dr.opaque(mi.UInt32, guided.stream), term)
    ray, weight = _camera_rays(camera, sampler, numbers, pixel, width, height)
    guide = guided.guide if guided is not None else None
    _trace(
        scene,
        sampler,
        numbers,
        guide,
        ray,
        weight,
        _Planes(planes, seen, light_of, pixel, dr.opaque(mi.UInt32, width * height)),
        hide_emitters=integrator.hide_emitters,
        max_depth=mi.UInt32(_depth_limit(integrator)),
        rr_depth=mi.UInt32(integrator.rr_depth),
    )
    dr.eval(planes, seen)
    if guide is not None:
        guide.update()
    return spp


def _depth_limit(integrator: Integrator) -> int:
    """Longest path in vertices behind the camera. Mitsuba's −1 means none."""
    return 2 if integrator.plugin == "direct" else integrator.max_depth % 2**32


def _camera_rays(sensor, sampler, numbers, pixel, width, height):
    """One ray per sample, drawing random numbers as Mitsuba's SamplingIntegrator does."""
    film = sensor.film()
    corner = mi.Vector2f(pixel % width, pixel // width) + mi.Vector2f(film.crop_offset())
    position = corner + (sampler.next_2d() if numbers is None else numbers.pair(FILM))
    scale = mi.ScalarVector2f(1 / width, 1 / height)
    position = dr.fma(position, scale, -mi.ScalarVector2f(film.crop_offset()) * scale)
    aperture = mi.Point2f(0)
    if sensor.needs_aperture_sample():
        aperture = sampler.next_2d() if numbers is None else numbers.pair(APERTURE)
    time = mi.Float(sensor.shutter_open())
    if sensor.shutter_open_time() > 0:
        moment = sampler.next_1d() if numbers is None else numbers.pair(TIME).x
        time += moment * sensor.shutter_open_time()
    ray, weight = sensor.sample_ray(time, 0, position, aperture)
    return ray, weight


def _first_hit(scene, ray, hide_emitters):
    """What the camera sees along `ray`, through area lights where these are hidden."""
    pi = scene.ray_intersect_preliminary(ray, True)
    if not hide_emitters:
        return pi
    si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal)
    behind = pi.is_valid() & (si.shape.emitter() != None)  # noqa: E711 (compares arrays)
    skipping = mi.load_dict({"type": "path", "hide_emitters": True})
    beyond = skipping.skip_area_emitters(scene, si.spawn_ray(ray.d), True, behind)
    return dr.select(behind, beyond, pi)


class _Planes:
    """Where paths leave what they carry.

    An object, and not arrays of the loop that traces: Dr.Jit refuses such an array once it
    finds that nothing can ever be added to it, as to `seen` where all lights are points.
    """

    def __init__(self, planes, seen, light_of, pixel, pixels):
        self._planes, self._seen, self._light_of = planes, seen, light_of
        self._pixel, self._pixels = pixel, pixels

    def add(self, emitter, value, active):
        """Add RGB values to the plane of the light that `emitter` belongs to."""
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        light = dr.gather(mi.UInt32, self._light_of, instance, active)
        row = dr.fma(light, self._pixels, self._pixel)
        for channel in range(3):
            dr.scatter_add(self._planes, value[channel], dr.fma(row, 3, channel), active)

    def note_seen(self, active):
        """Count camera rays that see an emitter."""
        dr.scatter_add(self._seen, mi.Float(1), self._pixel, active)


@dr.syntax
def _trace(
    scene,
    sampler,
    numbers,
    guide,
    ray,
    weight,
    planes,
    hide_emitters,
    max_depth,
    rr_depth,
):
    """Follow paths as Mitsuba's path.cpp does, step for step."""
    ray = mi.Ray3f(ray)
    throughput = mi.Spectrum(1)
    eta = mi.Float(1)
    depth = mi.UInt32(0)
    active = max_depth > 0
    pi = _first_hit(scene, ray, hide_emitters)

    previous = dr.zeros(mi.Interaction3f)
    previous_pdf = mi.Float(1)
    previous_delta = mi.Bool(True)
    previous_cell = mi.UInt32(0)
    cell = mi.UInt32(0)
    context = mi.BSDFContext()

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)

        # The ray hit an emitter. Where next-event estimation at the previous vertex could
        # have found it as well, the two share the credit.
        emitter = si.emitter(scene)
        hit = active & (emitter != None)  # noqa: E711 (compares arrays)
        if dr.hint(hide_emitters, mode="scalar"):
            hit &= depth > 0
        ds = mi.DirectionSample3f(scene, si, previous)
        by_choice = hit & ~previous_delta
        if dr.hint(guide is None, mode="scalar"):
            emitter_pdf = scene.pdf_emitter_direction(previous, ds, by_choice)
        else:
            emitter_pdf = emitter.pdf_direction(previous, ds, by_choice)
            emitter_pdf *= guide.probability(previous_cell, emitter, by_choice)
        emission = emitter.eval(si, hit & (previous_pdf > 0))
        mis = _mis(previous_pdf, emitter_pdf)
        planes.add(emitter, weight * throughput * emission * mis, hit)
        planes.note_seen(hit & (depth == 0))

        active_next = active & (depth + 1 < max_depth) & si.is_valid()
        bsdf = si.bsdf(ray)

        # Next-event estimation: choose an emitter and a direction towards it.
        smooth = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        chance = mi.Float(1)
        if dr.hint(guide is None, mode="scalar"):
            ds, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, smooth)
            lit = smooth & (ds.pdf != 0)
        else:
            cell = guide.cell(si)
            number = numbers.at_vertex(depth, 0)
            chosen, chance, number.x = guide.choose(cell, number.x, smooth)
            light = dr.gather(mi.EmitterPtr, guide.emitters, chosen, smooth)
            ds, radiance = light.sample_direction(si, number, smooth)
            ds.pdf *= chance
            lit = smooth & (ds.pdf != 0)
            lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), lit)
        wo = si.to_local(ds.d)

        if dr.hint(numbers is None, mode="scalar"):
            lobe, direction = sampler.next_1d(), sampler.next_2d()
        else:
            lobe_and_roulette = numbers.at_vertex(depth, 1)
            lobe, direction = lobe_and_roulette.x, numbers.at_vertex(depth, 2)
        bsdf_value, bsdf_pdf, sample, bsdf_weight = bsdf.eval_pdf_sample(
            context, si, wo, lobe, direction, active_next
        )
        mis = dr.select(ds.delta, 1, _mis(ds.pdf, bsdf_pdf))
        contribution = weight * throughput * bsdf_value * radiance * mis
        if dr.hint(guide is not None, mode="scalar"):
            guide.learn(cell, chosen, contribution, asked=smooth, lit=lit)
        planes.add(ds.emitter, contribution * dr.rcp(chance), lit)

        # Continue in a direction that the surface chooses.
        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= bsdf_weight
        eta *= sample.eta
        previous = mi.Interaction3f(si)
        previous_pdf = sample.pdf
        previous_delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        previous_cell = mi.UInt32(cell)
        depth[si.is_valid()] += 1

        # Russian roulette looks at the surfaces alone, never at emission: the paths, and
        # with them every plane, stay the same whatever the lights do.
        strongest = dr.max(throughput)
        survival = dr.minimum(strongest * dr.square(eta), 0.95)
        roulette = depth >= rr_depth
        if dr.hint(numbers is None, mode="scalar"):
            survives = sampler.next_1d() < survival
        else:
            survives = lobe_and_roulette.y < survival
        throughput[roulette] *= dr.rcp(survival)
        active = active_next & (~roulette | survives) & (strongest != 0)
        pi = scene.ray_intersect_preliminary(ray, False, active)


def _mis(pdf_a, pdf_b):
    """Power heuristic."""
    a, b = dr.square(pdf_a), dr.square(pdf_b)
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)
