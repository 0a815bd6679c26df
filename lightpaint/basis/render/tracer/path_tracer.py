"""The paths of the one-pass basis: a path tracer that adds each emitter's light to its own plane.

It follows Mitsuba's path.cpp step for step. Two things can replace random choices: `numbers`, a
low-discrepancy sequence instead of the sampler's, and `guide`, which chooses emitters by its
training. Either both are given or none. With them one thread of the loop follows all paths of a
pixel, one after the other, so that their light is added in the order of the samples.

Import this module only after a JIT variant is set: its array types do not exist before.
"""

# Dr.Jit rewrites `trace` from its source and traces it with arrays of any width, which a static
# checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from lightpaint.basis.render.tracer.emitter_guide import BELOW_1
from lightpaint.basis.render.tracer.sobol import APERTURE, FILM, TIME

#: Steps of this, taken modulo 1, are spread evenly in whatever number.
GOLDEN_RATIO = 0.6180339887


class Rules(NamedTuple):
    """Limits of the paths that are followed.

    max_depth, rr_depth: vertices behind the camera of the longest path, and after how many
    Russian roulette begins. must_bounce: whether paths that only pass surfaces carry nothing.
    """

    hide_emitters: bool
    must_bounce: bool
    max_depth: Any
    rr_depth: Any

    first_emitter_samples: Any = 1
    later_emitter_samples: Any = 1

    def emitter_samples_at(self, depth):
        """Return the number of emitters sampled at a vertex.

        depth: UInt32, number of surfaces before it; the camera (−1) counts like the first surface.
        """
        return dr.select(
            mi.Int32(depth) <= 0,
            mi.UInt32(self.first_emitter_samples),
            mi.UInt32(self.later_emitter_samples),
        )


class View(NamedTuple):
    """Pixels that a camera of the scene sees.

    width, height: pixels into which the film's crop window is divided, its own or larger ones.
    """

    scene: Any
    camera: Any
    width: int
    height: int


def camera_rays(view, sampler, numbers, pixel, term):
    """Return one ray per sample, drawing random numbers as Mitsuba's SamplingIntegrator does."""
    _, sensor, width, height = view
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


def _first_hit(scene, ray, rules):
    """Return the first intersection of a camera ray, which passes through hidden area lights."""
    pi = scene.ray_intersect_preliminary(ray, True)
    if not rules.hide_emitters:
        return pi
    si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal)
    behind = pi.is_valid() & (si.shape.emitter() != None)  # noqa: E711 (compares arrays)
    skipping = mi.load_dict({"type": "path", "hide_emitters": True})
    beyond = skipping.skip_area_emitters(scene, si.spawn_ray(ray.d), True, behind)
    return dr.select(behind, beyond, pi)


@dr.syntax
def trace_samples(view, numbers, guide, planes, rules, pixel, place, term, end):
    """Follow the paths of some samples of each pixel, one after the other.

    pixel: of the picture. place: its index in `planes`. term, end: samples, the last one not among
    them.
    """
    term = mi.UInt32(term)
    while term < end:
        trace_paths(view, None, numbers, guide, planes, rules, pixel, place, term)
        term += 1


@dr.syntax
def trace_paths(view, sampler, numbers, guide, planes, rules, pixel, place, term):
    """Follow one path per pixel from the camera, and add its light to `planes`.

    term: number of its sample. Other parameters are those of `trace_samples`.
    """
    scene = view.scene
    ray, weight = camera_rays(view, sampler, numbers, pixel, term)
    # fmt: off
    throughput = mi.Spectrum(1)                 # Share of the light at its end that comes back
    eta = mi.Float(1)                           # Product of the indices of refraction passed
    depth = mi.UInt32(0)                        # Vertices behind the camera so far
    active = rules.max_depth > 0                # Paths that go on
    pi = _first_hit(scene, ray, rules)          # What the ray meets
    previous = dr.zeros(mi.Interaction3f)       # Vertex that the ray comes from
    previous_pdf = mi.Float(1)                  # Density with which its surface chose the ray
    previous_delta = mi.Bool(True)              # Whether nothing but the surface could choose it
    previous_cell = mi.UInt32(0)                # Cell of the guide that the vertex lies in
    cell = mi.UInt32(0)                         # Cell of the guide that the path is in
    looks_through = mi.Bool(True)               # Whether nothing but clear surfaces was passed
    # fmt: on

    if dr.hint(rules.must_bounce, mode="scalar"):
        active = _will_bounce(scene, sampler, numbers, term, ray, pi, active, rules)

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)

        # The ray hit an emitter: its light, found by chance.
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
        emission = emitter.eval(si, hit & (previous_pdf > 0))
        carried = weight * throughput
        emitted = carried * emission * _mis(previous_pdf, pdf)
        planes.add(place, emitter, emitted, depth, hit)
        planes.note_seen(place, hit & looks_through)

        # Next-event estimation: emitters are sampled.
        active_next = active & (depth + 1 < rules.max_depth) & si.is_valid()
        bsdf = si.bsdf(ray)
        smooth = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        if dr.hint(guide is None, mode="scalar"):
            ds, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, smooth)
            lit = smooth & (ds.pdf != 0)
            wo = si.to_local(ds.d)
            bsdf_value, bsdf_pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo, lit)
            mis = dr.select(ds.delta, 1, _mis(ds.pdf, bsdf_pdf))
            planes.add(place, ds.emitter, carried * bsdf_value * radiance * mis, depth + 1, lit)
        else:
            cell = guide.cell(si)
            number = numbers.at_vertex(term, depth, 0)
            count = rules.emitter_samples_at(depth)
            _sample_emitters(
                scene, guide, planes, place, si, bsdf, carried, cell, number, count, depth, smooth
            )

        # The path goes on in a direction that the surface chooses.
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, term, depth)
        sample, bsdf_weight = bsdf.sample(mi.BSDFContext(), si, lobe, direction, active_next)
        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= bsdf_weight
        eta *= sample.eta
        previous = mi.Interaction3f(si)
        previous_pdf = sample.pdf
        previous_delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        previous_cell = mi.UInt32(cell)
        looks_through &= passes_clearly(sample)
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rules.rr_depth, fate, active_next)
        pi = scene.ray_intersect_preliminary(ray, False, active)


def passes_clearly(sample):
    """Return whether a surface, by its sample, lets the ray through as clear glass or a hole."""
    flags = mi.BSDFFlags
    return mi.has_flag(sample.sampled_type, flags.DeltaTransmission) | mi.has_flag(
        sample.sampled_type, flags.Null
    )


@dr.syntax
def _will_bounce(scene, sampler, numbers, term, ray, pi, active, rules):
    """Return which paths will meet a surface that does not let them pass.

    A path gathers light, from any number of lights, before it is known to count. So this follows it
    ahead with the same numbers, up to the first surface that does not let it pass.
    """
    # fmt: off
    sampler = None if sampler is None else sampler.clone()
    pi = mi.PreliminaryIntersection3f(pi)  # What the ray meets
    ray = mi.Ray3f(ray)                    # Ray that is followed
    throughput = mi.Spectrum(1)            # Share of the light at its end that comes back
    eta = mi.Float(1)                      # Product of the indices of refraction passed
    depth = mi.UInt32(0)                   # Vertices behind the camera so far
    active = mi.Bool(active)               # Paths that have only passed surfaces so far
    bounces = mi.Bool(False)               # Paths that have met another
    # fmt: on

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
        bsdf = si.bsdf(ray)
        if dr.hint(sampler is not None, mode="scalar"):
            sampler.next_2d()  # chooses an emitter
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, term, depth)
        sample, weight = bsdf.sample(mi.BSDFContext(), si, lobe, direction, active)
        passes = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        bounces |= active & si.is_valid() & ~passes

        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= weight
        eta *= sample.eta
        goes_on = active & (depth + 1 < rules.max_depth) & si.is_valid() & passes
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rules.rr_depth, fate, goes_on)
        pi = scene.ray_intersect_preliminary(ray, False, active)
    return bounces


@dr.syntax
def _sample_emitters(
    scene, guide, planes, place, si, bsdf, carried, cell, number, count, depth, active
):
    """Sample `count` emitters, and add the light that is not in shadow to `planes`.

    One number, split systematically, chooses all of them: each share of the guide gets as many
    samples as it is worth, but for one. number: for choice and place of the first. carried: what
    the camera sees of the light that the surface scatters.
    """
    context = mi.BSDFContext()
    k = mi.UInt32(0)  # Emitters sampled so far
    active = mi.Bool(active)  # Paths that have not sampled all
    while active:
        x = dr.minimum((number.x + mi.Float(k)) / mi.Float(count), BELOW_1)
        y = number.y + mi.Float(k) * GOLDEN_RATIO
        chosen, chance, rest = guide.choose(cell, x, active)
        emitter = dr.gather(mi.EmitterPtr, guide.emitters, chosen, active)
        ds, radiance = emitter.sample_direction(si, mi.Point2f(rest, y - dr.floor(y)), active)
        lit = active & (ds.pdf != 0)
        expected = chance * mi.Float(count)
        bsdf_value, bsdf_pdf = bsdf.eval_pdf(context, si, si.to_local(ds.d), lit)
        mis = dr.select(ds.delta, 1, _mis(ds.pdf * expected, bsdf_pdf))
        contribution = carried * bsdf_value * radiance * mis
        # No shadow ray is needed outside a spot's cone or below the surface.
        lit &= dr.any(contribution != 0)
        lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), lit)
        guide.learn(cell, chosen, contribution, is_sampled=active, lit=lit)
        planes.add(place, emitter, contribution * dr.rcp(expected), depth + 1, lit)
        k += 1
        active &= k < count


def _numbers_of_surface(sampler, numbers, term, depth):
    """Return the numbers that choose a lobe, a direction and the survival of the path."""
    if numbers is None:
        return sampler.next_1d(), sampler.next_2d(), sampler.next_1d()
    lobe_and_fate = numbers.at_vertex(term, depth, 1)
    return lobe_and_fate.x, numbers.at_vertex(term, depth, 2), lobe_and_fate.y


def _roulette(throughput, eta, roulette, fate, active):
    """Return the paths that go on; survivors of Russian roulette gain `throughput`.

    It looks at the surfaces alone, never at emission: the paths, and with them every plane, stay
    the same whatever the lights do.
    """
    strongest = dr.max(throughput)
    survival = dr.minimum(strongest * dr.square(eta), 0.95)
    throughput[roulette] *= dr.rcp(survival)
    return active & (~roulette | (fate < survival)) & (strongest != 0)


def _mis(pdf_a, pdf_b):
    """Return the weight of the power heuristic."""
    a, b = dr.square(pdf_a), dr.square(pdf_b)
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)
