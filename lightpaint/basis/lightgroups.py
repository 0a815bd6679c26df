"""The one-pass basis: a path tracer that keeps apart what each light contributes.

Radiance is a sum over the emitters that a path reaches, by chance (a ray that hits one) or
by choice (next-event estimation). This integrator traces the very paths of Mitsuba's own
`path`, and adds each such contribution to the image of its emitter instead of to one image.
It draws random numbers in the same order too, so that with equal seeds the sum over the
lights equals `mi.render` up to round-off, and one pass serves all lights.

One number is better not left to chance: the one that chooses the emitter to sample. Many
lights share the samples of a pixel, and a light that got five of them here and none next
door is noise in its plane even where nothing else is random. Given a place in a sequence,
a pixel's samples take turns through the lights instead (see `_taking_turns`).

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

# Dr.Jit rewrites `_trace` from its source and traces it with arrays of any width, which
# a static checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis
from lightpaint.images.exr import Floats
from lightpaint.scene.parsed import Integrator


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


def lights_by_instance(scene: Any, plane_of: Mapping[str, int]) -> Any:
    """UInt32 array that maps the Dr.Jit instance id of an emitter to the plane of its light.

    plane_of: index of the plane by the emitter's name.
    """
    instances = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr())).tolist()
    table = np.zeros(max(instances) + 1, dtype=np.uint32)
    for instance, emitter in zip(instances, scene.emitters(), strict=True):
        table[instance] = plane_of[emitter.id()]
    return mi.UInt32(table)


def accumulate(
    scene: Any,
    integrator: Integrator,
    *,
    camera: Any,
    light_of: Any,
    planes: Any,
    seen: Any,
    seed: int,
    spp: int,
    turn: tuple[int, int] | None = None,
) -> int:
    """Trace `spp` paths per pixel and add what they carry, undivided, to `planes`.

    scene: an `mi.Scene`; camera: one of its sensors, with a box-filtered film.
    light_of: what `lights_by_instance` returns.
    planes: Float array of n·h·w·3 values, laid out (n, h, w, 3).
    seen: Float array of h·w values; counts the camera rays that see an emitter.
    turn: (sequence, first): the samples of a pixel choose emitters as terms `first` … of the
    pixel's own sequence; passes that are averaged go on in one sequence, passes that must
    be independent have two. None: choose at random, as Mitsuba does.
    Returns the number of paths per pixel, which some samplers round up.
    """
    width, height = (int(v) for v in camera.film().crop_size())
    sampler = camera.sampler().clone()
    sampler.set_sample_count(spp)
    spp = int(sampler.sample_count())
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(seed, width * height * spp)

    sample = dr.arange(mi.UInt32, width * height * spp)
    pixel = sample // dr.opaque(mi.UInt32, spp)
    sequence, first = turn or (0, 0)
    term = sample - pixel * dr.opaque(mi.UInt32, spp) + dr.opaque(mi.UInt32, first)
    ray, weight = _camera_rays(camera, sampler, pixel, width, height)
    _trace(
        scene,
        sampler,
        ray,
        weight,
        pixel,
        dr.opaque(mi.UInt32, width * height),
        light_of,
        planes,
        seen,
        term if turn else None,
        dr.opaque(mi.UInt32, sequence),
        max_depth=mi.UInt32(_depth_limit(integrator)),
        rr_depth=mi.UInt32(integrator.rr_depth),
    )
    dr.eval(planes, seen)
    return spp


def _depth_limit(integrator: Integrator) -> int:
    """Longest path in vertices behind the camera. Mitsuba's −1 means none."""
    return 2 if integrator.plugin == "direct" else integrator.max_depth % 2**32


def _camera_rays(sensor, sampler, pixel, width, height):
    """One ray per sample, drawing random numbers as Mitsuba's SamplingIntegrator does."""
    film = sensor.film()
    corner = mi.Vector2f(pixel % width, pixel // width) + mi.Vector2f(film.crop_offset())
    position = corner + sampler.next_2d()
    scale = mi.ScalarVector2f(1 / width, 1 / height)
    position = dr.fma(position, scale, -mi.ScalarVector2f(film.crop_offset()) * scale)
    aperture = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Vector2f(0)
    time = mi.Float(sensor.shutter_open())
    if sensor.shutter_open_time() > 0:
        time += sampler.next_1d() * sensor.shutter_open_time()
    ray, weight = sensor.sample_ray(time, 0, position, aperture)
    return ray, weight


@dr.syntax
def _trace(
    scene,
    sampler,
    ray,
    weight,
    pixel,
    pixels,
    light_of,
    planes,
    seen,
    term,
    sequence,
    max_depth,
    rr_depth,
):
    """Follow paths as Mitsuba's path.cpp does, step for step."""
    ray = mi.Ray3f(ray)
    throughput = mi.Spectrum(1)
    eta = mi.Float(1)
    depth = mi.UInt32(0)
    active = max_depth > 0

    previous = dr.zeros(mi.Interaction3f)
    previous_pdf = mi.Float(1)
    previous_delta = mi.Bool(True)
    context = mi.BSDFContext()

    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.All, depth == 0, active)

        # The ray hit an emitter. Where next-event estimation at the previous vertex could
        # have found it as well, the two share the credit.
        emitter = si.emitter(scene)
        hit = active & (emitter != None)  # noqa: E711 (compares arrays)
        ds = mi.DirectionSample3f(scene, si, previous)
        emitter_pdf = scene.pdf_emitter_direction(previous, ds, hit & ~previous_delta)
        emission = emitter.eval(si, hit & (previous_pdf > 0))
        _add(
            planes,
            weight * throughput * emission * _mis(previous_pdf, emitter_pdf),
            dr.fma(_light(light_of, emitter, hit), pixels, pixel),
            hit,
        )
        dr.scatter_add(seen, mi.Float(1), pixel, hit & (depth == 0))

        active_next = active & (depth + 1 < max_depth) & si.is_valid()
        bsdf = si.bsdf(ray)

        # Next-event estimation: choose an emitter and a direction towards it.
        smooth = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        choice = sampler.next_2d()
        if dr.hint(term is not None, mode="scalar"):
            choice.x = _taking_turns(pixel, sequence + depth, term)
        ds, radiance = scene.sample_emitter_direction(si, choice, True, smooth)
        lit = smooth & (ds.pdf != 0)
        wo = si.to_local(ds.d)

        bsdf_value, bsdf_pdf, sample, bsdf_weight = bsdf.eval_pdf_sample(
            context, si, wo, sampler.next_1d(), sampler.next_2d(), active_next
        )
        mis = dr.select(ds.delta, 1, _mis(ds.pdf, bsdf_pdf))
        _add(
            planes,
            weight * throughput * bsdf_value * radiance * mis,
            dr.fma(_light(light_of, ds.emitter, lit), pixels, pixel),
            lit,
        )

        # Continue in a direction that the surface chooses.
        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= bsdf_weight
        eta *= sample.eta
        previous = mi.Interaction3f(si)
        previous_pdf = sample.pdf
        previous_delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        depth[si.is_valid()] += 1

        # Russian roulette looks at the surfaces alone, never at emission: the paths, and
        # with them every plane, stay the same whatever the lights do.
        strongest = dr.max(throughput)
        survival = dr.minimum(strongest * dr.square(eta), 0.95)
        roulette = depth >= rr_depth
        survives = sampler.next_1d() < survival
        throughput[roulette] *= dr.rcp(survival)
        active = active_next & (~roulette | survives) & (strongest != 0)


def _taking_turns(pixel, sequence, term):
    """A number in [0, 1) that chooses an emitter: the next one of an evenly spread sequence.

    Multiples of the golden ratio, modulo 1, leave no light out for long (Kronecker's
    sequence); the start is random per pixel, so that every number alone is uniform and any
    part of the sequence gives an unbiased mean.
    """
    start, _ = mi.sample_tea_32(pixel, sequence)
    return mi.Float((start + term * mi.UInt32(0x9E3779B9)) >> 8) * (1 / 2**24)


def _mis(pdf_a, pdf_b):
    """Power heuristic."""
    a, b = dr.square(pdf_a), dr.square(pdf_b)
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)


def _light(light_of, emitter, active):
    return dr.gather(mi.UInt32, light_of, dr.reinterpret_array(mi.UInt32, emitter), active)


def _add(planes, value, row, active):
    for channel in range(3):
        dr.scatter_add(planes, value[channel], dr.fma(row, 3, channel), active)
