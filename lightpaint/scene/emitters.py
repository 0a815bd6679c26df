"""What "one unit" of each kind of light means, and how its present emission is read."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour.photometry import lambertian_flux, point_flux, spot_flux
from lightpaint.errors import SceneError

#: A light as the scene has it, where its emission is a multiple of that.
AS_AUTHORED: RGB = (1.0, 1.0, 1.0)


class Scaling(Enum):
    """What in the scene file carries the emission of a light.

    COLOUR: one RGB colour; its unit is white, whatever the scene says.
    IMAGE: a bitmap, scaled per channel; its unit is the image as authored.
    FACTORS: numbers that scale the light as a whole, not per channel; unit as authored.
    """

    COLOUR = "colour"
    IMAGE = "image"
    FACTORS = "factors"


@dataclass(frozen=True)
class EmissionKind:
    """How a light is scaled, by which parameter of its plugin, and the unit of its emission.

    factors: names of the numbers that scale it, for FACTORS.
    """

    scaling: Scaling
    parameter: str
    unit: str
    factors: tuple[str, ...] = ()

    @property
    def is_scalar(self) -> bool:
        """Whether the light has one weight for all channels instead of three."""
        return self.scaling is Scaling.FACTORS


#: Unit of emission of lights that are multiples of what the scene has.
MULTIPLE = "× as authored"

#: (parameter, unit) of the emitters that are supported; the first is what carries emission.
PLUGINS = {
    "area": ("radiance", "W/(m² sr)"),
    "constant": ("radiance", "W/(m² sr)"),
    "directional": ("irradiance", "W/m²"),
    "envmap": ("radiance", "W/(m² sr)"),
    "point": ("intensity", "W/sr"),
    "projector": ("irradiance", "W/m²"),
    "spot": ("intensity", "W/sr"),
    "sunsky": ("radiance", "W/(m² sr)"),
}


#: Emitters that no RGB variant of Mitsuba renders as they are meant, and what to do about them.
NOT_RENDERED = {"timed_sunsky": "use sunsky with the hour you want"}


def emission_kind(emitter: Any, plugin: str) -> EmissionKind | None:
    """How a loaded emitter is scaled; None where lightpaint cannot scale it."""
    import mitsuba as mi

    if plugin not in PLUGINS:
        return None
    parameter, unit = PLUGINS[plugin]
    keys = set(mi.traverse(emitter).keys())
    if plugin == "sunsky":
        return EmissionKind(Scaling.FACTORS, parameter, MULTIPLE, ("sun_scale", "sky_scale"))
    if plugin == "envmap" or f"{parameter}.data" in keys:
        return EmissionKind(Scaling.IMAGE, parameter, MULTIPLE)
    if f"{parameter}.value" in keys:
        return EmissionKind(Scaling.COLOUR, parameter, unit)
    if f"{parameter}.scale" in keys:
        return EmissionKind(Scaling.FACTORS, parameter, MULTIPLE, ("scale",))
    return None


def read_emission(emitter: Any, kind: EmissionKind | None, name: str) -> RGB:
    """The emission of a loaded Mitsuba emitter, as linear RGB in the unit of `kind`.

    Read from the loaded object and not from the XML text, where a spectrum, a preset or
    nothing at all may stand. Raises SceneError for values that are no RGB colour.
    """
    import mitsuba as mi

    if kind is None or kind.scaling is not Scaling.COLOUR:
        return AS_AUTHORED
    value = np.array(mi.traverse(emitter)[f"{kind.parameter}.value"], dtype=float).ravel()
    if value.size not in (1, 3):
        raise SceneError(f"light {name!r} has a {kind.parameter} of {value.size} values, not RGB")
    r, g, b = np.broadcast_to(value, 3).tolist()
    if not np.isfinite(value).all():
        raise SceneError(f"light {name!r} has the {kind.parameter} {[r, g, b]}: not finite")
    return r, g, b


def why_not_adjusted(plugin: str, kind: EmissionKind | None, emission: RGB) -> str:
    """What keeps a light from being solved for, in words behind its name; "" if nothing."""
    if plugin not in PLUGINS:
        return f"is a {plugin} emitter, which lightpaint cannot scale"
    if kind is None:
        parameter = PLUGINS[plugin][0]
        return f"has a textured {parameter} that is neither a bitmap nor one colour"
    if min(emission) < 0:
        return f"has a negative {kind.parameter}, {' '.join(f'{v:g}' for v in emission)}"
    return ""


def check_rendered(emitter: Any, plugin: str, name: str, integrator: str) -> None:
    """Raise SceneError if `integrator` cannot render the emitter, though Mitsuba has loaded it."""
    import drjit as dr
    import mitsuba as mi

    if plugin in NOT_RENDERED:
        raise SceneError(
            f"light {name!r} is a {plugin} emitter, which Mitsuba cannot render here: "
            f"{NOT_RENDERED[plugin]}"
        )
    # What is not implemented fails when it is first asked for; after a render that failed, the
    # process would be good for nothing.
    middle = mi.Point2f(0.5)
    try:
        emitter.sample_direction(dr.zeros(mi.SurfaceInteraction3f), middle)
        if integrator == "ptracer":
            emitter.sample_ray(0.0, 0.5, middle, middle)
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise SceneError(
            f"light {name!r} cannot be rendered by {integrator} in {mi.variant()}: Mitsuba says "
            f"{reason!r}; give it a colour, <rgb .../>"
        ) from None


def flux_of_unit(emitter: Any, plugin: str, kind: EmissionKind | None) -> float | None:
    """Watts that a loaded emitter of one colour radiates at an emission of 1, by its form.

    In W where a unit of the scene is a metre. None for what has no flux of its own (a sky, a
    sun) and for what is not of one colour in all directions.
    """
    import mitsuba as mi

    if kind is None or kind.scaling is not Scaling.COLOUR:
        return None
    if plugin == "area":
        return lambertian_flux(float(np.array(emitter.get_shape().surface_area()).ravel()[0]))
    if plugin == "point":
        return point_flux()
    if plugin != "spot":
        return None
    parameters = mi.traverse(emitter)
    axes = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)[:3, :3]
    squares = axes.T @ axes
    texture = np.array(parameters["texture.value"]) if "texture.value" in parameters else None
    # A cone that is sheared or stretched is no cone, and a picture has no closed form. Both
    # thresholds are Mitsuba's float32.
    is_cone = np.allclose(squares, squares[0, 0] * np.eye(3), atol=1e-4 * squares[0, 0])
    if texture is None or not is_cone or np.ptp(texture) > 1e-6:
        return None
    angles = (np.array(parameters[key]).ravel()[0] for key in ("cutoff_angle", "beam_width"))
    cutoff, beam_width = (math.radians(float(angle)) for angle in angles)
    return float(texture.mean()) * spot_flux(cutoff, beam_width)


def describe_form(emitter: Any, plugin: str) -> str:
    """Where a loaded emitter is and how large, in scene units, for people to read."""
    import mitsuba as mi

    def at(point: Any) -> str:
        x, y, z = np.array(point, dtype=float).ravel()[:3]
        return f"({x:.2f}, {y:.2f}, {z:.2f})"

    shape = emitter.get_shape()
    if shape is not None:
        box = shape.bbox()
        area = float(np.array(shape.surface_area()).ravel()[0])
        return f"area {area:.3g} at {at(box.center())}"
    if plugin in ("constant", "envmap", "sunsky"):
        return "all around"
    parameters = mi.traverse(emitter)
    if "position" in parameters:
        return f"at {at(parameters['position'])}"
    if "to_world" not in parameters:
        return ""
    matrix = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
    if plugin == "directional":
        return f"towards {at(matrix[:3, 2])}"
    return f"at {at(matrix[:3, 3])} towards {at(matrix[:3, 2])}"
