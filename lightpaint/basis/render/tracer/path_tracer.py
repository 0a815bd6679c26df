"""The path tracer of the one-pass basis, which adds each emitter's light to a plane of its own.

It follows Mitsuba's path.cpp step by step, with two optional replacements: `numbers`, a
low-discrepancy sequence instead of the sampler's random numbers, and `guide`, which chooses
emitters by what training has learned. Either both are given or neither. With them, one thread
follows all paths of a pixel one after the other, so that light is added in the order of the
samples.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# Dr.Jit transforms functions decorated with `dr.syntax` and traces them with arrays of any width,
# which a static checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Bools
from lightpaint.basis.render.tracer import wavelengths
from lightpaint.basis.render.tracer.emitter_guide import BELOW_1
from lightpaint.basis.render.tracer.sobol import APERTURE, FILM, TIME

#: Multiples of this, modulo 1, are evenly spread for any number of them.
GOLDEN_RATIO = 0.6180339887


class Rules(NamedTuple):
    """Limits of the traced paths.

    max_depth: maximum number of vertices after the camera. rr_depth: number of vertices after which
    Russian roulette begins. must_bounce: whether paths that only pass through null surfaces are
    black.
    """

    hide_emitters: bool
    must_bounce: bool
    max_depth: Any
    rr_depth: Any

    first_emitter_samples: Any = 1
    later_emitter_samples: Any = 1

    def emitter_samples_at(self, depth):
        """Return the number of emitter samples at a vertex.

        depth: UInt32, number of vertices before it. A depth of −1, the camera, counts as the first
        vertex.
        """
        return dr.select(
            mi.Int32(depth) <= 0,
            mi.UInt32(self.first_emitter_samples),
            mi.UInt32(self.later_emitter_samples),
        )


class View(NamedTuple):
    """The pixels that a camera of the scene sees, or the points at which light is measured.

    width, height: number of pixels into which the film's crop window is divided, its own or larger
    ones. points: `PointSurfaces`, one for each pixel, at which paths start instead of the camera;
    None for a camera. paths: what light is made of.
    """

    scene: Any
    camera: Any
    width: int
    height: int
    points: Any = None
    paths: Any = wavelengths.RgbPaths()


def _camera_rays(view, sampler, numbers, pixel, term):
    """Return one ray per sample, with random numbers drawn in the order of Mitsuba's
    SamplingIntegrator.
    """
    sensor, width, height = view.camera, view.width, view.height
    film = sensor.film()
    corner = mi.Vector2f(pixel % width, pixel // width) + mi.Vector2f(film.crop_offset())
    position = corner + (sampler.next_2d() if numbers is None else numbers.pair(term, FILM))
    scale = mi.ScalarVector2f(1 / width, 1 / height)
    position = dr.fma(position, scale, -mi.ScalarVector2f(film.crop_offset()) * scale)
    aperture = mi.Point2f(0)
    if sensor.needs_aperture_sample():
        aperture = sampler.next_2d() if numbers is None else numbers.pair(term, APERTURE)
    time = mi.Float(sensor.shutter_open())
    if sensor.shutter_open_time() > 0:
        moment = sampler.next_1d() if numbers is None else numbers.pair(term, TIME).x
        time += moment * sensor.shutter_open_time()
    ray, weight = sensor.sample_ray(time, 0, position, aperture)
    return ray, weight


def _first_hit(view, ray, rules):
    """Return the first hit along a camera ray, which passes through area lights if these are
    hidden; or along a ray from a measuring point, which does not.
    """
    scene = view.scene
    pi = scene.ray_intersect_preliminary(ray, view.points is None)
    if not rules.hide_emitters or view.points is not None:
        return pi
    si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal)
    behind = pi.is_valid() & (si.shape.emitter() != None)  # noqa: E711 (compares arrays)
    skipping = mi.load_dict({"type": "path", "hide_emitters": True})
    beyond = skipping.skip_area_emitters(scene, si.spawn_ray(ray.d), True, behind)
    return dr.select(behind, beyond, pi)


class _Start(NamedTuple):
    """Rays that leave measuring points.

    weight: irradiance per radiance along the ray. point, cell: the point, and its guide cell. pdf:
    density with which the direction of the ray was chosen.
    """

    ray: Any
    weight: Any
    point: Any
    cell: Any
    pdf: Any


def _leave_points(view, waves, numbers, guide, planes, rules, pixel, place, term):
    """Add the direct light at measuring points to `planes`, and return rays for the rest.

    A point is the first vertex of its path, as a surface is that a camera sees.
    """
    bsdf, depth = view.points.bsdf, mi.UInt32(0)
    si = view.points.at(pixel, numbers.pair(term, APERTURE).x)
    cell, count = guide.cell(si), rules.emitter_samples_at(depth)
    number, is_lit = numbers.at_vertex(term, depth, 0), rules.max_depth > 1
    # The irradiance is π times the radiance of a white surface.
    weight = [mi.Spectrum(dr.pi)] * waves.packets
    _sample_emitters(
        view.scene,
        waves,
        guide,
        planes,
        place,
        si,
        bsdf,
        weight,
        cell,
        number,
        count,
        depth,
        is_lit,
    )
    lobe, direction, _ = _numbers_of_surface(None, numbers, term, depth)
    sample, bsdf_weight = wavelengths.each_bsdf_sample(waves, bsdf, si, lobe, direction, True)
    ray = si.spawn_ray(si.to_world(sample.wo))
    return _Start(
        ray, wavelengths.products(weight, bsdf_weight), mi.Interaction3f(si), cell, sample.pdf
    )


@dr.syntax
def trace_samples(view, numbers, guide, planes, rules, pixel, place, term, end):
    """Trace the given samples of each pixel one after the other.

    pixel: index in the picture. place: index in `planes`. term, end: range of samples, `end`
    excluded.
    """
    term = mi.UInt32(term)
    while term < end:
        trace_paths(view, None, numbers, guide, planes, rules, pixel, place, term)
        term += 1


@dr.syntax
def trace_paths(view, sampler, numbers, guide, planes, rules, pixel, place, term):
    """Trace one path from the camera, or from a measuring point, for each pixel, and add its light
    to `planes`.

    term: number of the sample. The other parameters are as in `trace_samples`.
    """
    scene, waves = view.scene, view.paths.along(numbers, term)
    if dr.hint(view.points is None, mode="scalar"):
        ray, camera_weight = _camera_rays(view, sampler, numbers, pixel, term)
        weight = waves.from_camera(camera_weight)
    else:
        start = _leave_points(view, waves, numbers, guide, planes, rules, pixel, place, term)
        ray, weight = start.ray, start.weight
    # fmt: off
    throughput = _unit_light(waves)             # Fraction of radiance that reaches the camera
    eta = mi.Float(1)                           # Product of relative indices of refraction
    depth = mi.UInt32(0)                        # Number of vertices after the camera
    active = rules.max_depth > 0                # Paths that continue
    pi = _first_hit(view, ray, rules)           # Intersection of the ray
    previous = dr.zeros(mi.Interaction3f)       # Vertex at which the ray starts
    previous_pdf = mi.Float(1)                  # Density with which its BSDF sampled the ray
    previous_delta = mi.Bool(True)              # Whether that density is a delta function
    previous_cell = mi.UInt32(0)                # Guide cell of the previous vertex
    cell = mi.UInt32(0)                         # Guide cell of the current vertex
    looks_through = mi.Bool(True)               # Whether all surfaces so far were clear
    # fmt: on

    if dr.hint(view.points is not None, mode="scalar"):
        depth = mi.UInt32(1)
        active = rules.max_depth > 1
        previous, previous_pdf, previous_cell = start.point, start.pdf, start.cell
        previous_delta = mi.Bool(False)
        looks_through = mi.Bool(False)

    if dr.hint(rules.must_bounce, mode="scalar"):
        active = _will_bounce(scene, waves, sampler, numbers, term, ray, pi, active, rules)

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)

        # The ray hit an emitter: add its emission.
        emitter = si.emitter(scene)
        hit = active & (emitter != None)  # noqa: E711 (compares arrays)
        if dr.hint(rules.hide_emitters, mode="scalar"):
            hit &= depth > 0
        by_choice = hit & ~previous_delta
        ds = mi.DirectionSample3f(scene, si, previous)
        if dr.hint(guide is None, mode="scalar"):
            pdf = scene.pdf_emitter_direction(previous, ds, by_choice)
        else:
            pdf = emitter.pdf_direction(previous, ds, by_choice)
            pdf *= guide.probability(previous_cell, emitter, by_choice)
            pdf *= rules.emitter_samples_at(depth - 1)
        emission = wavelengths.each_emission(waves, emitter, si, hit & (previous_pdf > 0))
        carried = wavelengths.products(weight, throughput)
        emitted = waves.light(wavelengths.products(carried, emission, _mis(previous_pdf, pdf)))
        planes.add(place, emitter, emitted, ray.d, si.uv, depth, hit)
        planes.note_seen(place, hit & looks_through)

        # Next-event estimation: sample emitters.
        active_next = active & (depth + 1 < rules.max_depth) & si.is_valid()
        bsdf = si.bsdf(ray)
        smooth = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        if dr.hint(guide is None, mode="scalar"):
            ds, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, smooth)
            lit = smooth & (ds.pdf != 0)
            wo = si.to_local(ds.d)
            bsdf_value, bsdf_pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo, lit)
            mis = dr.select(ds.delta, 1, _mis(ds.pdf, bsdf_pdf))
            arriving = carried[0] * bsdf_value * radiance * mis
            planes.add(place, ds.emitter, arriving, ds.d, ds.uv, depth + 1, lit)
        else:
            cell = guide.cell(si)
            number = numbers.at_vertex(term, depth, 0)
            count = rules.emitter_samples_at(depth)
            _sample_emitters(
                scene,
                waves,
                guide,
                planes,
                place,
                si,
                bsdf,
                carried,
                cell,
                number,
                count,
                depth,
                smooth,
            )

        # Sample the BSDF for the next direction.
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, term, depth)
        sample, bsdf_weight = wavelengths.each_bsdf_sample(
            waves, bsdf, si, lobe, direction, active_next
        )
        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput = wavelengths.products(throughput, bsdf_weight)
        eta *= sample.eta
        previous = mi.Interaction3f(si)
        previous_pdf = sample.pdf
        previous_delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        previous_cell = mi.UInt32(cell)
        looks_through &= _passes_clearly(sample)
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rules.rr_depth, fate, active_next)
        pi = scene.ray_intersect_preliminary(ray, False, active)


def _passes_clearly(sample):
    """Return whether a BSDF sample passes straight through, as in clear glass or a hole."""
    flags = mi.BSDFFlags
    return mi.has_flag(sample.sampled_type, flags.DeltaTransmission) | mi.has_flag(
        sample.sampled_type, flags.Null
    )


@dr.syntax
def _will_bounce(scene, waves, sampler, numbers, term, ray, pi, active, rules):
    """Return which of the paths will meet a surface other than a null surface.

    Whether a path counts is only known after it has gathered light, possibly from several lights.
    So each path is traced ahead with the same numbers, up to the first surface that is not null.
    """
    # fmt: off
    sampler = None if sampler is None else sampler.clone()
    pi = mi.PreliminaryIntersection3f(pi)  # Intersection of the ray
    ray = mi.Ray3f(ray)                    # Ray being traced
    throughput = _unit_light(waves)        # Fraction of radiance that reaches the camera
    eta = mi.Float(1)                      # Product of relative indices of refraction
    depth = mi.UInt32(0)                   # Number of vertices after the camera
    active = mi.Bool(active)               # Paths with only null surfaces so far
    bounces = mi.Bool(False)               # Paths that met another surface
    # fmt: on

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
        bsdf = si.bsdf(ray)
        if dr.hint(sampler is not None, mode="scalar"):
            sampler.next_2d()  # the number that chooses an emitter
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, term, depth)
        sample, weight = wavelengths.each_bsdf_sample(waves, bsdf, si, lobe, direction, active)
        passes = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        bounces |= active & si.is_valid() & ~passes

        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput = wavelengths.products(throughput, weight)
        eta *= sample.eta
        goes_on = active & (depth + 1 < rules.max_depth) & si.is_valid() & passes
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rules.rr_depth, fate, goes_on)
        pi = scene.ray_intersect_preliminary(ray, False, active)
    return bounces


@dr.syntax
def _sample_emitters(
    scene, waves, guide, planes, place, si, bsdf, carried, cell, number, count, depth, active
):
    """Sample `count` emitters, and add the light that is not in shadow to `planes`.

    One number, split systematically, chooses all of them, so each emitter gets its share of the
    samples, rounded up or down. number: pair that chooses the first emitter and a point on it.
    carried: fraction of the scattered light that reaches the camera.
    """
    k = mi.UInt32(0)  # Number of emitters sampled so far
    active = mi.Bool(active)  # Paths that need more samples
    while active:
        x = dr.minimum((number.x + mi.Float(k)) / mi.Float(count), BELOW_1)
        y = number.y + mi.Float(k) * GOLDEN_RATIO
        chosen, chance, rest = guide.choose(cell, x, active)
        emitter = dr.gather(mi.EmitterPtr, guide.emitters, chosen, active)
        point = mi.Point2f(rest, y - dr.floor(y))
        ds, radiance = wavelengths.each_direction(waves, emitter, si, point, active)
        lit = active & (ds.pdf != 0)
        expected = chance * mi.Float(count)
        bsdf_value, bsdf_pdf = wavelengths.each_bsdf_value(waves, bsdf, si, si.to_local(ds.d), lit)
        mis = dr.select(ds.delta, 1, _mis(ds.pdf * expected, bsdf_pdf))
        contribution = wavelengths.products(carried, bsdf_value, radiance, mis)
        # No shadow ray is needed outside the cone of a spot, or below the surface.
        lit &= wavelengths.is_any(contribution)
        lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), lit)
        guide.learn(cell, chosen, waves.gray(contribution), is_sampled=active, lit=lit)
        arriving = waves.light(wavelengths.products(contribution, dr.rcp(expected)))
        planes.add(place, emitter, arriving, ds.d, ds.uv, depth + 1, lit)
        k += 1
        active &= k < count


def _numbers_of_surface(sampler, numbers, term, depth):
    """Return the numbers that choose a lobe of the BSDF, a direction, and whether the path
    survives.
    """
    if numbers is None:
        return sampler.next_1d(), sampler.next_2d(), sampler.next_1d()
    lobe_and_fate = numbers.at_vertex(term, depth, 1)
    return lobe_and_fate.x, numbers.at_vertex(term, depth, 2), lobe_and_fate.y


def _roulette(throughput, eta, roulette, fate, active):
    """Return the paths that continue after Russian roulette; `throughput` of survivors is
    increased.

    The probability depends on surfaces alone, never on emission. So the paths, and hence all
    planes, do not depend on what the lights emit.
    """
    strongest = dr.max(throughput[0])
    for packet in throughput[1:]:
        strongest = dr.maximum(strongest, dr.max(packet))
    survival = dr.minimum(strongest * dr.square(eta), 0.95)
    for packet in throughput:
        packet[roulette] *= dr.rcp(survival)
    return active & (~roulette | (fate < survival)) & (strongest != 0)


def _unit_light(waves):
    return [mi.Spectrum(1) for _ in range(waves.packets)]


def _mis(pdf_a, pdf_b):
    """Return the weight of the power heuristic."""
    a, b = dr.square(pdf_a), dr.square(pdf_b)
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)


def has_clear_surfaces(loaded: Any) -> bool:
    """Return whether a loaded scene has clear glass or other surfaces that let rays pass straight
    through.
    """
    surfaces = [shape.bsdf().flags() for shape in loaded.shapes() if shape.bsdf() is not None]
    clear = mi.BSDFFlags.DeltaTransmission, mi.BSDFFlags.Null
    return any(mi.has_flag(flags, kind) for flags in surfaces for kind in clear)


def emitters_seen_through(view: View, max_depth: int, *, samples: int) -> Bools:
    """Return the pixels of a view, (h, w), in which some sample sees an emitter."""
    count = view.width * view.height
    seen = np.zeros(count, bool)
    sampler = mi.load_dict({"type": "independent"})
    for k in range(samples):
        sampler.seed(k, count)
        pixel = dr.arange(mi.UInt32, count)
        seen |= np.array(_sees_emitter(view, sampler, pixel, mi.UInt32(max_depth)))
    return seen.reshape(view.height, view.width)


@dr.syntax
def _sees_emitter(view, sampler, pixel, max_depth):
    """Trace a ray of each pixel through clear surfaces, and return whether it reaches an
    emitter.
    """
    scene = view.scene
    ray, _ = _camera_rays(view, sampler, None, pixel, None)
    # fmt: off
    depth = mi.UInt32(0)      # Number of surfaces passed
    seen = mi.Bool(False)     # Rays that reached an emitter
    active = max_depth > 0    # Rays that continue
    # fmt: on
    while active:
        si = scene.ray_intersect(ray, active)
        seen |= active & (si.emitter(scene) != None)  # noqa: E711 (compares arrays)
        active &= ~seen & si.is_valid() & (depth + 1 < max_depth)
        lobe, direction = sampler.next_1d(), sampler.next_2d()
        sample, _ = si.bsdf(ray).sample(mi.BSDFContext(), si, lobe, direction, active)
        active &= _passes_clearly(sample)
        ray = si.spawn_ray(si.to_world(sample.wo))
        depth += 1
    return seen
