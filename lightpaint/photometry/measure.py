"""Measures the illuminance at points of planes, and what glare depends on, from every light, in one
pass.

The points take the place of the film's pixels (`Scene.at_points`), so a measurement is a basis: it
is rendered by the same path tracer and cached in the same files as pictures are.

Directions, sizes and luminances of the sources of glare are found by rays from the eye to an even
grid of places on each, without noise. What else reaches the eye is measured as illuminance on
planes is, with direct light kept apart.
"""

# mypy: disable-error-code="no-untyped-call"
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Floats
from lightpaint.basis import Basis, Lights
from lightpaint.basis.cache import obtain_basis
from lightpaint.colour import LUMINANCE
from lightpaint.display_text import brief, some_names
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.luminaires import POINT_PLUGIN
from lightpaint.photometry.glare import Glare, GlareObserver, GlareSources, position_index
from lightpaint.photometry.illuminance import Illuminance, MeasuringPlane, floored
from lightpaint.progress import Progress, listener, silent
from lightpaint.scene import ENVIRONMENTS, Emitter, MeasuringPoints, Scene
from lightpaint.validation import Check, between, number

#: Relative error of a measurement without another; see `measure_illuminance`.
DEFAULT_ERROR = 0.02
#: Least error that may be asked for: a smaller one is a typing error.
LEAST_ERROR = 1e-6

#: Samples per point of the first round, and beyond which none are added.
FIRST_SPP, MOST_SPP = 64, 2**16
#: Factors by which a round increases the number of samples, and share of the squared error that
#: was asked for at which it aims.
LEAST_GROWTH, MOST_GROWTH, AIM = 2, 16, 0.8

#: Share of the brightest plane's mean below which a plane's errors count as of one that bright.
DIM_SHARE = 1e-3

#: Places on a source along each side of the grid to which rays go.
GRID = 16
#: Independent measurements at each eye, whose differences tell the noise.
REPEATS = 16

WHITE: RGB = (1.0, 1.0, 1.0)


@keywords()
def measure_illuminance(
    scene: Scene,
    planes: Sequence[MeasuringPlane],
    *,
    spp: int | None = None,
    error: float = DEFAULT_ERROR,
    cd_per_unit: float = 1.0,
    weights: Doubles | None = None,
    seed: int = 0,
    use_cache: bool = True,
    exact_spp: bool = False,
    progress: Progress = silent,
) -> Illuminance:
    """Measure the illuminance at the points of planes, from every light of `scene` alone.

    Args:
        scene: From `load_scene`.
        planes: From `read_planes`.
        spp: Samples per point; by default as many as `error` needs, at most 65,536.
        error: Largest half width of the 95 % interval of a plane's mean, and standard error of its
            points, both relative and with the lights of `weights`. A point with less than 0.3 of
            the mean, or a plane with less than a thousandth of the light of the brightest, counts
            as one with that much.
        cd_per_unit: cd/m² of a radiance of 1 in the scene.
        weights: Weights of the lights, (n, 3), with which errors are judged; by default the weights
            of the scene as it is now.
        seed: Any number >= 0; different seeds give independent measurements.
        use_cache: Whether measurements are cached as bases are.
        exact_spp: Whether a cached measurement with more samples than are needed is left alone, so
            that the result does not depend on earlier runs.
        progress: Called with the progress of the work.

    Raises:
        SceneError: If the scene cannot be rendered in one pass, or an argument is invalid.
        Interrupted: On Ctrl-C, which keeps the samples so far.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> planes = lp.read_planes("room.planes.toml", scene).planes
        >>> found = lp.measure_illuminance(scene, planes, cd_per_unit=1000)
        >>> round(found.reading("desk", found.lights.current_weights).mean, -3)
        1000.0
    """
    _check("error", error, between(LEAST_ERROR, 1, "a relative error"))
    _check("cd_per_unit", cd_per_unit, number("cd/m²"))

    def excess_of(measured: Illuminance) -> float:
        judged = weights_on(measured.lights) if weights is None else weights
        return error_excess(measured, judged, error)

    return measured_until(
        scene.at_points(points_of(planes)),
        lambda basis: illuminance_of(basis, planes, cd_per_unit),
        excess_of,
        label="illuminance",
        spp=spp,
        seed=seed,
        use_cache=use_cache,
        exact_spp=exact_spp,
        progress=progress,
    )


def measured_until(
    at_points: Scene,
    measured_of: Callable[[Basis], Illuminance],
    excess_of: Callable[[Illuminance], float],
    *,
    label: str,
    spp: int | None = None,
    seed: int,
    use_cache: bool,
    exact_spp: bool,
    progress: Progress,
) -> Illuminance:
    """Return what is measured at the points of a scene, with as many samples as it needs.

    measured_of: makes it of a basis. excess_of: ratio of its error to the one asked for. spp:
    samples per point, instead of that. label: name of the work.
    """
    listen, work_label = listener(progress), label
    goal = FIRST_SPP if spp is None else spp

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        listen(work_label if label == "basis" else label, done, total, unit)

    while True:
        basis = obtain_basis(
            at_points,
            spp=goal,
            seed=seed,
            use_cache=use_cache,
            exact_spp=exact_spp,
            progress=report,
        )
        measured = measured_of(basis)
        if spp is not None:
            return measured
        excess = excess_of(measured)
        if excess <= 1:
            return measured
        if basis.origin.spp >= MOST_SPP:
            listen.say(
                f"{label}: {MOST_SPP} samples per point are the most that are taken, and the "
                f"errors are {excess:.1f} times as large as asked for"
            )
            return measured
        growth = np.clip(excess**2 / AIM, LEAST_GROWTH, MOST_GROWTH)
        goal = min(int(growth * basis.origin.spp), MOST_SPP)


def _check(name: str, value: float, check: Check) -> None:
    """Raise SceneError for an argument that `check` refuses."""
    if not check.is_valid(value):
        raise SceneError(f"{name} is {brief(value)}: expected {check.expectation}")


def points_of(planes: Sequence[MeasuringPlane]) -> MeasuringPoints:
    """Return the points of all planes. Raises SceneError without a plane, or for equal names."""
    names = [plane.name for plane in planes]
    if not planes or len(set(names)) < len(names):
        given = some_names(names) or "none"
        raise SceneError(f"planes are {given}: expected at least one, each with a name of its own")
    return MeasuringPoints(
        np.concatenate([plane.points for plane in planes]),
        np.concatenate([plane.normals for plane in planes]),
        np.concatenate([np.full(len(plane), plane.is_cylindrical) for plane in planes]),
    )


def illuminance_of(
    basis: Basis, planes: Sequence[MeasuringPlane], cd_per_unit: float
) -> Illuminance:
    """Return the illuminance on `planes`, from the basis of their points."""

    def in_lux(irradiance: Floats) -> Doubles:
        return np.asarray(cd_per_unit * irradiance[:, 0].swapaxes(0, 1) * LUMINANCE, np.float64)

    return Illuminance(
        tuple(planes),
        basis.lights,
        in_lux(basis.planes.array()),
        in_lux(basis.noise.array()),
        float(cd_per_unit),
    )


def weights_on(lights: Lights) -> Doubles:
    """Return the weights of all lights as they are now, (n, 3); 1 each if all are dark."""
    current = lights.current_weights
    return current if current[~lights.is_fixed].any() else np.ones_like(current)


def error_excess(measured: Illuminance, weights: Doubles, error: float) -> float:
    """Return the largest ratio of an error of a plane to the one asked for.

    error: relative. Of a plane's mean this is half of its 95 % interval, of its points the root
    mean square of their standard errors in relation to their light.
    """
    values, errors = measured.of(weights), measured.standard_errors(weights)
    readings = measured.readings(weights)
    dimmest = DIM_SHARE * max(reading.mean for reading in readings.values())
    excess = 0.0
    for name, reading in readings.items():
        if (scale := max(reading.mean, dimmest)) > 0:
            part = measured.points_of(name)
            relative = errors[part] / np.maximum(floored(values[part]), dimmest)
            of_points = float(np.sqrt(np.mean(relative**2)))
            excess = max(excess, reading.mean_interval / scale / error, of_points / error)
    return excess


@keywords()
def measure_glare(
    scene: Scene,
    observers: Sequence[GlareObserver],
    *,
    error: float = DEFAULT_ERROR,
    cd_per_unit: float = 1.0,
    weights: Doubles | None = None,
    seed: int = 0,
    use_cache: bool = True,
    exact_spp: bool = False,
    progress: Progress = silent,
) -> Glare:
    """Measure what the glare of all lights of `scene` depends on, for some observers.

    Args:
        scene: From `load_scene`.
        observers: From `read_planes`.
        error: Largest half width of the 95 % interval of each background luminance, relative, with
            the lights of `weights`.
        cd_per_unit: cd/m² of a radiance of 1 in the scene.
        weights: Weights of the lights, (n, 3), with which errors are judged; by default the weights
            of the scene as it is now.
        seed: Any number >= 0.
        use_cache: Whether measurements are cached as bases are.
        exact_spp: Whether a cached measurement with more samples than are needed is left alone, so
            that the result does not depend on earlier runs.
        progress: Called with the progress of the work.

    Raises:
        SceneError: If the scene cannot be rendered in one pass.
        Interrupted: On Ctrl-C, which keeps the samples so far.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> file = lp.read_planes("room.planes.toml", scene)
        >>> glare = lp.measure_glare(scene, file.observers, cd_per_unit=1000)
        >>> [*glare.readings(glare.background.lights.current_weights)]
        ['camera']
    """
    seen = _seen_light(scene, observers)
    sources = seen.sources(scene, cd_per_unit)
    planes = [_eye(x) for x in observers]
    at_eyes = scene.at_points(
        MeasuringPoints(
            np.concatenate([plane.points for plane in planes]),
            np.concatenate([plane.normals for plane in planes]),
            np.zeros(len(planes) * REPEATS, bool),
            is_split=True,
        )
    )

    def background_of(basis: Basis) -> Illuminance:
        return _background(scene, basis, planes, seen, cd_per_unit)

    def excess_of(background: Illuminance) -> float:
        judged = weights_on(background.lights) if weights is None else weights
        readings = background.readings(judged).values()
        return max(x.relative_interval for x in readings) / error

    background = measured_until(
        at_eyes,
        background_of,
        excess_of,
        label="glare",
        seed=seed,
        use_cache=use_cache,
        exact_spp=exact_spp,
        progress=progress,
    )
    return Glare(tuple(observers), sources, background)


def _eye(observer: GlareObserver) -> MeasuringPlane:
    """Return an eye as a plane of equal points."""
    places, ahead = (np.tile(x, (REPEATS, 1)) for x in (observer.place, observer.ahead))
    cells = np.stack([np.zeros(REPEATS, np.intp), np.arange(REPEATS)], axis=1)
    return MeasuringPlane(observer.name, places, ahead, 0.0, 0.0, None, cells)


@dataclass(frozen=True)
class _SeenLight:
    """Light of e loaded emitters as o observers see it, of each at an emission of 1.

    emitters: emitters of the scene that each is; several for one that is split. radiance: (o, e,
    3), the mean over what is seen. irradiance: (o, e, 3), at the eye. solid_angle, spread,
    is_sizeless: as in `GlareSources`.
    """

    emitters: tuple[tuple[Emitter, ...], ...]
    radiance: Doubles
    irradiance: Doubles
    solid_angle: Doubles
    spread: Doubles
    is_sizeless: Bools

    def sources(self, scene: Scene, cd_per_unit: float) -> GlareSources:
        """Return all but environments as sources."""
        chosen = [k for k, x in enumerate(self.emitters) if x[0].plugin not in ENVIRONMENTS]
        source_of = {x.name: s for s, k in enumerate(chosen) for x in self.emitters[k]}
        parts = [
            (source_of[member.name], n, light.emission_of(member, WHITE))
            for n, light in enumerate(scene.lights)
            for member in light.members
            if member.name in source_of
        ]
        return GlareSources(
            tuple(_name_of(self.emitters[k]) for k in chosen),
            cd_per_unit * LUMINANCE * self.radiance[:, chosen],
            self.solid_angle[:, chosen],
            self.spread[:, chosen],
            self.is_sizeless[:, chosen],
            np.array([source for source, _, _ in parts], np.intp),
            np.array([light for _, light, _ in parts], np.intp),
            np.array([factor for _, _, factor in parts], float).reshape(-1, 3),
        )


def _name_of(emitters: Sequence[Emitter]) -> str:
    texel = emitters[0].texel
    return emitters[0].name if texel is None else texel.image


def _background(
    scene: Scene,
    basis: Basis,
    planes: Sequence[MeasuringPlane],
    seen: _SeenLight,
    cd_per_unit: float,
) -> Illuminance:
    """Return the illuminance at the eyes without the direct light of sources."""
    total, total_noise = basis.planes.array()[:, 0], basis.noise.array()[:, 0]
    indirect, indirect_noise = np.zeros_like(total), np.zeros_like(total)
    if basis.indirect is not None:
        indirect = basis.indirect.planes.array()[:, 0]
        indirect_noise = basis.indirect.noise.array()[:, 0]
    values, noise = [], []
    direct_of = {x.name: k for k, members in enumerate(seen.emitters) for x in members}
    for n, light in enumerate(scene.lights):
        is_around = [member.plugin in ENVIRONMENTS for member in light.members]
        if not any(is_around):
            values.append(indirect[n])
            noise.append(indirect_noise[n])
            continue
        direct = np.zeros((len(planes), 3))
        for member, around in zip(light.members, is_around, strict=True):
            if not around:
                emission = np.array(light.emission_of(member, WHITE))
                direct += emission * seen.irradiance[:, direct_of[member.name]]
        values.append(total[n] - np.repeat(direct, REPEATS, axis=0))
        noise.append(total_noise[n])
    matrix, halves = (
        cd_per_unit * np.stack(part, axis=1).astype(float) * LUMINANCE for part in (values, noise)
    )
    return Illuminance(tuple(planes), basis.lights, matrix, halves, cd_per_unit)


def _seen_light(scene: Scene, observers: Sequence[GlareObserver]) -> _SeenLight:
    """Return what observers see of the emitters of a scene."""
    plain = scene.in_rgb
    fixed = [x.name for x in plain.emitters if x.obstacle]
    alone = plain.with_lights({x.name: [x.name] for x in plain.emitters}, fixed)
    lit = {x.name: WHITE for x in plain.emitters if x.texel is None and not x.obstacle}
    by_id: dict[str, list[Emitter]] = {}
    for emitter in plain.emitters:
        by_id.setdefault(plain.parsed.names[emitter.node], []).append(emitter)

    def work(loaded: Any) -> _SeenLight:
        emitters = tuple(tuple(by_id[x.id()]) for x in loaded.emitters())
        rays = _rays_to(loaded, observers)
        openings = [
            x.opening_from(np.array([y.place for y in observers]))
            if members[0].plugin == POINT_PLUGIN
            else np.zeros(len(observers))
            for x, members in zip(loaded.emitters(), emitters, strict=True)
        ]
        return _seen(emitters, observers, rays, np.array(openings).T)

    return alone.while_loaded(work, lit)


class _Rays(NamedTuple):
    """Rays from o observers to k places on each of e emitters.

    directions: (o, e, k, 3), unit vectors. density: (o, e, k), per sr; 0 for lights without a size.
    light: (o, e, k, 3), radiance over density; 0 where something is in front.
    """

    directions: Doubles
    density: Doubles
    light: Doubles


def _rays_to(loaded: Any, observers: Sequence[GlareObserver]) -> _Rays:
    """Send rays from each observer to an even grid of places on each emitter."""
    import drjit as dr
    import mitsuba as mi

    shape = (len(observers), len(loaded.emitters()), GRID**2)
    who, which, number = (x.ravel() for x in np.indices(shape))
    places = np.array([x.place for x in observers], np.float32)[who]
    grid = (np.stack([number % GRID, number // GRID]) + 0.5) / GRID
    emitter = dr.gather(mi.EmitterPtr, loaded.emitters_dr(), mi.UInt32(which.astype(np.uint32)))
    eye = dr.zeros(mi.SurfaceInteraction3f, len(who))
    eye.p = mi.Point3f(np.ascontiguousarray(places.T))
    ds, light = emitter.sample_direction(eye, mi.Point2f(grid.astype(np.float32)), mi.Bool(True))
    light = dr.select(loaded.ray_test(eye.spawn_ray_to(ds.p)), 0, light)
    density = dr.select(ds.delta, 0, ds.pdf)
    return _Rays(
        np.array(ds.d, float).T.reshape(*shape, 3),
        np.array(density, float).reshape(shape),
        np.array(light, float).T.reshape(*shape, 3),
    )


def _seen(
    emitters: tuple[tuple[Emitter, ...], ...],
    observers: Sequence[GlareObserver],
    rays: _Rays,
    openings: Doubles,
) -> _SeenLight:
    """Return what observers see by rays. openings: (o, e), solid angles of points with a known
    size; 0 for all others.
    """
    ahead = np.array([x.ahead for x in observers])
    cosine = np.einsum("oekc,oc->oek", rays.directions, ahead)
    light = np.where((cosine > 0)[..., None], rays.light, 0.0)
    index = np.stack(
        [position_index(d, x.ahead, x.up) for d, x in zip(rays.directions, observers, strict=True)]
    )
    is_seen, has_area = np.asarray(light.any(axis=-1)), rays.density > 0
    # The solid angle that each place stands for; a point with an opening has the solid angle of all
    # of it.
    angle = np.divide(1.0, rays.density, out=np.zeros_like(index), where=has_area & is_seen)
    angle += np.where(has_area | ~is_seen, 0.0, openings[..., None])
    solid_angle, mean = angle.mean(axis=2), light.mean(axis=2)
    is_sizeless = ~(solid_angle > 0) & is_seen.any(axis=2)
    # A picture in texels has another radiance at each place.
    is_sizeless |= np.array([x[0].texel is not None for x in emitters])
    return _SeenLight(
        emitters,
        mean / np.where(is_sizeless | ~(solid_angle > 0), 1.0, solid_angle)[..., None],
        (light * cosine[..., None]).mean(axis=2),
        solid_angle,
        (angle / index**2).mean(axis=2),
        is_sizeless,
    )
