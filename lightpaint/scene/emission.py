"""The emission of each kind of emitter: what "one unit" of it means, how it is read and set."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
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

#: Of these, those that surround the scene.
ENVIRONMENTS = ("constant", "envmap", "sunsky")


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


@dataclass(frozen=True)
class EmitterSetting:
    """What an emitter is set to: emission in the unit of `kind`, and how often it is sampled.

    kind: None for an emitter that cannot be scaled, only taken out: its emission is black.
    """

    kind: EmissionKind | None
    emission: RGB
    sampling_weight: float


def set_emission(state: Any, node: int, setting: EmitterSetting, *, on_shape: bool) -> None:
    """Set the emitter `node` of a parser's state, before a scene is made of it."""
    import mitsuba as mi

    kind, rgb = setting.kind, setting.emission
    props = state.nodes[node].props
    if kind is None:
        _darken(props, on_shape=on_shape)
    props["sampling_weight"] = setting.sampling_weight
    if kind is None:
        return
    if kind.scaling is Scaling.COLOUR:
        props[kind.parameter] = mi.ScalarColor3f(*rgb)
    elif kind.scaling is Scaling.FACTORS:
        # The numbers stand in the emitter itself or in its texture.
        texture = child_named(state, node, kind.parameter)
        holder = props if texture is None else state.nodes[texture].props
        for factor in kind.factors:
            holder[factor] = float(holder.get(factor, 1.0)) * rgb[0]
    elif not any(rgb):
        # Where a bitmap is chosen, a scale stands beside it, but for area lights.
        if props.plugin_name() == "area":
            props[kind.parameter] = mi.ScalarColor3f(0)
        else:
            props["scale"] = 0.0
    elif rgb != AS_AUTHORED:
        raise SceneError(f"an image of light can be loaded black or as it is, not times {rgb}")


def _darken(props: Any, *, on_shape: bool) -> None:
    """Put a black emitter in the place of one that has no numbers to turn."""
    import mitsuba as mi

    for key in list(props):
        del props[key]
    # An emitter stays: without one, the shape would get another surface.
    props.set_plugin_name("area" if on_shape else "point")
    props["radiance" if on_shape else "intensity"] = mi.ScalarColor3f(0)


def child_named(state: Any, node: int, name: str) -> int | None:
    """The node that is referenced by `node` under `name`."""
    import mitsuba as mi

    props = state.nodes[node].props
    if name not in props or props.type(name) != mi.Properties.Type.ResolvedReference:
        return None
    return int(props[name].index())
