"""The paths of the one-pass basis: a path tracer that adds each emitter's light to its own plane.

It follows Mitsuba's path.cpp step for step. Two things may be put in the place of chance:
`numbers`, evenly spread ones instead of the sampler's, and `guide`, which chooses emitters by
what earlier passes have learned. Either both are given or none.

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

# Dr.Jit rewrites `trace` from its source and traces it with arrays of any width, which a static
# checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from lightpaint.basis.render.sobol import APERTURE, FILM, TIME


def camera_rays(sensor, sampler, numbers, pixel, width, height):
    """Return one ray per sample, with the random numbers of Mitsuba's SamplingIntegrator.

    width, height: pixels into which the film's crop window is divided, its own or larger ones.
    """
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
    """Return what the camera sees along `ray`, through area lights if these are hidden."""
    pi = scene.ray_intersect_preliminary(ray, True)
    if not hide_emitters:
        return pi
    si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal)
    behind = pi.is_valid() & (si.shape.emitter() != None)  # noqa: E711 (compares arrays)
    skipping = mi.load_dict({"type": "path", "hide_emitters": True})
    beyond = skipping.skip_area_emitters(scene, si.spawn_ray(ray.d), True, behind)
    return dr.select(behind, beyond, pi)


class Planes:
    """The planes to which paths add their light.

    An object, and not arrays of the loop that traces: Dr.Jit refuses such an array once it
    finds that nothing can ever be added to it, as to `seen` where all lights are points.
    """

    def __init__(self, planes, seen, light_of, pixel, pixels):
        self._planes, self._seen, self._light_of = planes, seen, light_of
        self._pixel, self._pixels = pixel, pixels

    def add(self, emitter, value, active):
        """Add RGB values to the plane of the light that `emitter` belongs to.

        What is no number, as one path in a hundred million carries, is left out: a pixel of it
        would make all sums over the picture none.
        """
        active = active & dr.all(dr.isfinite(value))
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        light = dr.gather(mi.UInt32, self._light_of, instance, active)
        row = dr.fma(light, self._pixels, self._pixel)
        for channel in range(3):
            dr.scatter_add(self._planes, value[channel], dr.fma(row, 3, channel), active)

    def note_seen(self, active):
        """Count camera rays that see an emitter."""
        dr.scatter_add(self._seen, mi.Float(1), self._pixel, active)


@dr.syntax
def trace(
    scene,
    sampler,
    numbers,
    guide,
    ray,
    weight,
    planes,
    hide_emitters,
    must_bounce,
    max_depth,
    rr_depth,
):
    """Follow paths from the camera on, and leave what they carry in `planes`.

    ray, weight: of the camera. must_bounce: whether paths that only pass surfaces carry nothing.
    max_depth, rr_depth: vertices behind the camera of the longest path, and after how many
    Russian roulette begins.
    """
    # fmt: off
    ray = mi.Ray3f(ray)                         # Ray that is followed
    throughput = mi.Spectrum(1)                 # Share of the light at its end that comes back
    eta = mi.Float(1)                           # Product of the indices of refraction passed
    depth = mi.UInt32(0)                        # Vertices behind the camera so far
    active = max_depth > 0                      # Paths that go on
    pi = _first_hit(scene, ray, hide_emitters)  # What the ray meets
    previous = dr.zeros(mi.Interaction3f)       # Vertex that the ray comes from
    previous_pdf = mi.Float(1)                  # Density with which its surface chose the ray
    previous_delta = mi.Bool(True)              # Whether nothing but the surface could choose it
    previous_cell = mi.UInt32(0)                # Cell of the guide that the vertex lies in
    # fmt: on

    if dr.hint(must_bounce, mode="scalar"):
        active = _will_bounce(scene, sampler, numbers, ray, pi, active, max_depth, rr_depth)

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)

        # The ray hit an emitter: its light, found by chance.
        emitter = si.emitter(scene)
        hit = active & (emitter != None)  # noqa: E711 (compares arrays)
        if dr.hint(hide_emitters, mode="scalar"):
            hit &= depth > 0
        by_choice = hit & ~previous_delta
        pdf = _pdf_of_choice(scene, guide, si, emitter, previous, previous_cell, by_choice)
        emission = emitter.eval(si, hit & (previous_pdf > 0))
        planes.add(emitter, weight * throughput * emission * _mis(previous_pdf, pdf), hit)
        planes.note_seen(hit & (depth == 0))

        # Next-event estimation: an emitter is asked for its light.
        active_next = active & (depth + 1 < max_depth) & si.is_valid()
        bsdf = si.bsdf(ray)
        smooth = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        asked = _ask_emitter(scene, sampler, numbers, guide, si, depth, smooth)
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, depth)
        bsdf_value, bsdf_pdf, sample, bsdf_weight = bsdf.eval_pdf_sample(
            mi.BSDFContext(), si, si.to_local(asked.ds.d), lobe, direction, active_next
        )
        mis = dr.select(asked.ds.delta, 1, _mis(asked.ds.pdf, bsdf_pdf))
        contribution = weight * throughput * bsdf_value * asked.radiance * mis
        if dr.hint(guide is not None, mode="scalar"):
            guide.learn(asked.cell, asked.chosen, contribution, asked=smooth, lit=asked.lit)
        planes.add(asked.ds.emitter, contribution * dr.rcp(asked.chance), asked.lit)

        # The path goes on in a direction that the surface chooses.
        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= bsdf_weight
        eta *= sample.eta
        previous = mi.Interaction3f(si)
        previous_pdf = sample.pdf
        previous_delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        previous_cell = mi.UInt32(asked.cell)
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rr_depth, fate, active_next)
        pi = scene.ray_intersect_preliminary(ray, False, active)


@dr.syntax
def _will_bounce(scene, sampler, numbers, ray, pi, active, max_depth, rr_depth):
    """Return the paths to follow that meet more than surfaces which let them pass.

    Whether a path counts is known only after it has gathered light, from lights of any number, so
    it is looked ahead with the same numbers, as far as the first surface that does not let it pass.
    """
    # fmt: off
    sampler = None if sampler is None else sampler.clone()
    ray = mi.Ray3f(ray)              # Ray that is followed
    throughput = mi.Spectrum(1)      # Share of the light at its end that comes back
    eta = mi.Float(1)                # Product of the indices of refraction passed
    depth = mi.UInt32(0)             # Vertices behind the camera so far
    active = mi.Bool(active)         # Paths that have only passed surfaces so far
    bounces = mi.Bool(False)         # Paths that have met another
    # fmt: on

    while active:
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
        bsdf = si.bsdf(ray)
        if dr.hint(sampler is not None, mode="scalar"):
            sampler.next_2d()  # what chooses an emitter
        lobe, direction, fate = _numbers_of_surface(sampler, numbers, depth)
        sample, weight = bsdf.sample(mi.BSDFContext(), si, lobe, direction, active)
        passes = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        bounces |= active & si.is_valid() & ~passes

        ray = si.spawn_ray(si.to_world(sample.wo))
        throughput *= weight
        eta *= sample.eta
        goes_on = active & (depth + 1 < max_depth) & si.is_valid() & passes
        depth[si.is_valid()] += 1
        active = _roulette(throughput, eta, depth >= rr_depth, fate, goes_on)
        pi = scene.ray_intersect_preliminary(ray, False, active)
    return bounces


def _pdf_of_choice(scene, guide, si, emitter, previous, previous_cell, active):
    """Return the density of next-event estimation at the previous vertex for this emitter."""
    ds = mi.DirectionSample3f(scene, si, previous)
    if guide is None:
        return scene.pdf_emitter_direction(previous, ds, active)
    pdf = emitter.pdf_direction(previous, ds, active)
    return pdf * guide.probability(previous_cell, emitter, active)


class _Asked(NamedTuple):
    """The answer to an emitter query. All are arrays, of a number for each path.

    ds: the place on it, `ds.pdf` with the chance of the emitter in it. radiance: over that pdf,
    but for `chance`, the probability of the emitter where the guide has chosen it. lit: whether
    it is in sight. cell, chosen: of the guide, and index of the emitter; 0 without one.
    """

    ds: Any
    radiance: Any
    lit: Any
    chance: Any
    cell: Any
    chosen: Any


def _ask_emitter(scene, sampler, numbers, guide, si, depth, active):
    """Choose an emitter, a place on it, and see whether anything stands between."""
    if guide is None:
        ds, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, active)
        nothing = mi.UInt32(0)
        return _Asked(ds, radiance, active & (ds.pdf != 0), mi.Float(1), nothing, nothing)
    cell = guide.cell(si)
    number = numbers.at_vertex(depth, 0)
    chosen, chance, number.x = guide.choose(cell, number.x, active)
    emitter = dr.gather(mi.EmitterPtr, guide.emitters, chosen, active)
    ds, radiance = emitter.sample_direction(si, number, active)
    ds.pdf *= chance
    # Where a spot does not point no shadow ray is needed.
    lit = active & (ds.pdf != 0) & dr.any(radiance != 0)
    lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), lit)
    return _Asked(ds, radiance, lit, chance, cell, chosen)


def _numbers_of_surface(sampler, numbers, depth):
    """Return the numbers that choose lobe, direction and survival at a surface."""
    if numbers is None:
        return sampler.next_1d(), sampler.next_2d(), sampler.next_1d()
    lobe_and_fate = numbers.at_vertex(depth, 1)
    return lobe_and_fate.x, numbers.at_vertex(depth, 2), lobe_and_fate.y


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
