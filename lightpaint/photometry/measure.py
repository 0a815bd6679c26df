"""Measures the illuminance at points of planes, from every light, in one pass.

The points take the place of the film's pixels (`Scene.at_points`), so a measurement is a basis: it
is rendered by the same path tracer and cached in the same files as pictures are.
"""

from collections.abc import Callable, Sequence

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, Lights
from lightpaint.basis.cache import obtain_basis
from lightpaint.colour import LUMINANCE
from lightpaint.display_text import brief, some_names
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.photometry.illuminance import Illuminance, floored
from lightpaint.photometry.measuring_plane import MeasuringPlane
from lightpaint.progress import Progress, listener, silent
from lightpaint.scene import MeasuringPoints, Scene
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
