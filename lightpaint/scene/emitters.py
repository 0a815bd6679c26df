"""What "one unit" of each kind of light means, and how its present emission is read."""

from dataclasses import dataclass
from typing import Any

from lightpaint.errors import SceneError

RGB = tuple[float, float, float]


@dataclass(frozen=True)
class EmissionKind:
    """The parameter of an emitter plugin that scales its light, and the parameter's unit."""

    parameter: str
    unit: str


#: Emitters whose light is one RGB colour. Their unit is white, (1, 1, 1), in `unit`.
ONE_COLOUR = {
    "area": EmissionKind("radiance", "W/(m² sr)"),
    "constant": EmissionKind("radiance", "W/(m² sr)"),
    "directional": EmissionKind("irradiance", "W/m²"),
    "point": EmissionKind("intensity", "W/sr"),
    "spot": EmissionKind("intensity", "W/sr"),
}


def emission_kind(plugin: str, name: str) -> EmissionKind:
    """How the light `name` is scaled. Raises SceneError for a plugin that is not supported."""
    try:
        return ONE_COLOUR[plugin]
    except KeyError:
        raise SceneError(
            f"light {name!r} is an emitter of kind {plugin!r}, which lightpaint cannot solve for: "
            f"it takes {', '.join(ONE_COLOUR)}; remove that light or replace it"
        ) from None


def read_emission(emitter: Any, kind: EmissionKind, name: str) -> RGB:
    """The emission of a loaded Mitsuba emitter, as linear RGB in the unit of `kind`.

    Read from the loaded object and not from the XML text, where a spectrum, a preset or
    nothing at all may stand. Raises SceneError if it varies over the light.
    """
    import mitsuba as mi
    import numpy as np

    parameters = mi.traverse(emitter)
    key = f"{kind.parameter}.value"
    if key not in parameters:
        raise SceneError(
            f"light {name!r} has a textured {kind.parameter}, which lightpaint cannot solve for: "
            f"give it one colour, <rgb name={kind.parameter!r} .../>"
        )
    value = np.array(parameters[key], dtype=float).ravel()
    if value.size not in (1, 3):
        raise SceneError(f"light {name!r} has a {kind.parameter} of {value.size} values, not RGB")
    r, g, b = np.broadcast_to(value, 3).tolist()
    return r, g, b


def describe_form(emitter: Any, plugin: str) -> str:
    """Where a loaded emitter is and how large, in scene units, for people to read."""
    import mitsuba as mi
    import numpy as np

    def at(point: Any) -> str:
        x, y, z = np.array(point, dtype=float).ravel()[:3]
        return f"({x:.2f}, {y:.2f}, {z:.2f})"

    if plugin == "area":
        shape = emitter.get_shape()
        box = shape.bbox()
        area = float(np.array(shape.surface_area()).ravel()[0])
        return f"area {area:.3g} at {at(box.center())}"
    if plugin == "constant":
        return "all around"
    parameters = mi.traverse(emitter)
    if "position" in parameters:
        return f"at {at(parameters['position'])}"
    matrix = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
    if plugin == "directional":
        return f"towards {at(matrix[:3, 2])}"
    return f"at {at(matrix[:3, 3])} towards {at(matrix[:3, 2])}"
