"""The emission of each kind of emitter: its unit, reading and setting."""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Floats
from lightpaint.errors import SceneError
from lightpaint.luminaires import FULL, LUMINAIRE_PLUGINS, POINT_PLUGIN

#: The emission of an unchanged light if the unit is a multiple of that in the scene.
AS_AUTHORED: RGB = (1.0, 1.0, 1.0)


class Scaling(Enum):
    """The part of the scene file that defines the emission of a light.

    COLOUR: one RGB colour; the unit is white, whatever the colour in the scene.
    IMAGE: a bitmap, scaled per channel; the unit is the image as authored.
    FACTORS: numbers that scale the whole light, not per channel; the unit is the light as authored.
    """

    COLOUR = "colour"
    IMAGE = "image"
    FACTORS = "factors"


@dataclass(frozen=True)
class EmissionKind:
    """A way of scaling a light: its plugin parameter, and the unit of its emission.

    factors: names of the numbers that scale it, for FACTORS.
    """

    scaling: Scaling
    parameter: str
    unit: str
    factors: tuple[str, ...] = ()

    @property
    def is_scalar(self) -> bool:
        """True if the light has one weight for all channels instead of three."""
        return self.scaling is Scaling.FACTORS


#: Unit of lights whose emission is a multiple of that in the scene.
MULTIPLE = "× as authored"

#: Emission parameter and its unit, for the supported emitters.
PLUGINS = {
    "area": ("radiance", "W/(m² sr)"),
    "constant": ("radiance", "W/(m² sr)"),
    "directional": ("irradiance", "W/m²"),
    "envmap": ("radiance", "W/(m² sr)"),
    **dict.fromkeys(sorted(LUMINAIRE_PLUGINS), ("intensity", FULL)),
    "point": ("intensity", "W/sr"),
    "projector": ("irradiance", "W/m²"),
    "spot": ("intensity", "W/sr"),
    "sunsky": ("radiance", "W/(m² sr)"),
}

#: Emitters that have no surface which a ray could hit, so that only sampling finds them.
ONLY_SAMPLED = ("directional", "point", "projector", "spot", POINT_PLUGIN)

#: Integrators that begin at the emitters, so that only sampling finds any.
FROM_EMITTERS = ("ptracer",)

#: Emitters that surround the scene.
ENVIRONMENTS = ("constant", "envmap", "sunsky")


def emission_kind(emitter: Any, plugin: str) -> EmissionKind | None:
    """Return how a loaded emitter is scaled; None if lightpaint cannot scale it."""
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
    """Return the emission of a loaded Mitsuba emitter as linear RGB in the unit of `kind`.

    It is read from the loaded object, since the XML may contain a spectrum, a preset or nothing at
    all. Raises SceneError for values that are not an RGB colour.
    """
    import mitsuba as mi

    if kind is None or kind.scaling is not Scaling.COLOUR:
        return AS_AUTHORED
    value = np.array(mi.traverse(emitter)[f"{kind.parameter}.value"], dtype=float).ravel()
    if value.size not in (1, 3):
        raise SceneError(
            f"light {name!r} has a {kind.parameter} of {value.size} values: expected RGB"
        )
    r, g, b = np.broadcast_to(value, 3).tolist()
    if not np.isfinite(value).all():
        raise SceneError(f"light {name!r} has the {kind.parameter} {[r, g, b]}: not finite")
    return r, g, b


def is_never_found(plugin: str, sampling_weight: float, integrator: str) -> bool:
    """Return True if an emitter is dark in Mitsuba whatever it emits, for it is never sampled."""
    return sampling_weight == 0 and (plugin in ONLY_SAMPLED or integrator in FROM_EMITTERS)


def why_not_adjusted(plugin: str, kind: EmissionKind | None, emission: RGB) -> str:
    """Return why a light cannot be adjusted, phrased to follow its name; "" if it can."""
    if plugin not in PLUGINS:
        return f"is a {plugin} emitter, which lightpaint cannot scale"
    if kind is None:
        parameter = PLUGINS[plugin][0]
        return f"has a textured {parameter} that is neither a bitmap nor a single colour"
    if min(emission) < 0:
        numbers = " ".join(f"{v:g}" for v in emission)
        return f"has a negative {kind.parameter}, {numbers}, and no lights file lists its emitters"
    return ""


@dataclass(frozen=True)
class EmittedImage:
    """An image that an emitter shows.

    pixels: (rows, columns, 3), as in Mitsuba's files. parameter: of the emitter, for a texture or a
    colour. has_texture, has_proportions: see `ImageDomain`.
    """

    pixels: Floats
    parameter: str
    has_texture: bool
    has_proportions: bool


@dataclass(frozen=True)
class EmitterSetting:
    """Settings of an emitter: emission in the unit of `kind`, and sampling weight.

    kind: None for an emitter that cannot be scaled but only be made black. image: an image in the
    place of its own emission; None to keep that.
    """

    kind: EmissionKind | None
    emission: RGB
    sampling_weight: float
    image: EmittedImage | None = None


def set_emission(state: Any, node: int, setting: EmitterSetting, *, on_shape: bool) -> None:
    """Apply a setting to the emitter `node` of a parser state, before a scene is built from it."""
    import mitsuba as mi

    kind, rgb = setting.kind, setting.emission
    props = state.nodes[node].props
    if kind is None:
        _darken(props, on_shape=on_shape)
    props["sampling_weight"] = setting.sampling_weight
    if kind is None:
        return
    if setting.image is not None:
        _set_image(props, setting.image)
    elif kind.scaling is Scaling.COLOUR:
        props[kind.parameter] = mi.ScalarColor3f(*rgb)
    elif kind.scaling is Scaling.FACTORS:
        # The factors belong to the emitter or to its texture.
        texture = child_named(state, node, kind.parameter)
        owner = props if texture is None else state.nodes[texture].props
        for factor in kind.factors:
            owner[factor] = float(owner.get(factor, 1.0)) * rgb[0]
    elif not any(rgb):
        # Emitters with a bitmap also have a scale, except area lights.
        if props.plugin_name() == "area":
            props[kind.parameter] = mi.ScalarColor3f(0)
        else:
            props["scale"] = 0.0
    elif rgb != AS_AUTHORED:
        raise SceneError(
            f"an image light can be loaded black or unchanged, not multiplied by {rgb}"
        )


def _set_image(props: Any, image: EmittedImage) -> None:
    """Give an emitter another image. An even one becomes a colour, where that is the same light:
    its samples are even over what it covers.
    """
    import mitsuba as mi

    pixels = np.ascontiguousarray(image.pixels, np.float32)
    is_even = bool((pixels == pixels[0, 0]).all()) and not image.has_proportions
    color, bitmap = mi.ScalarColor3f(*pixels[0, 0].tolist()), mi.Bitmap(pixels)
    if image.has_texture:
        settings = {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}
        props[image.parameter] = color if is_even else mi.load_dict(settings)
        if "scale" in props:
            props["scale"] = 1.0
        return
    for key in list(props):
        if key not in ("to_world", "sampling_weight"):
            del props[key]
    props.set_plugin_name("constant" if is_even else "envmap")
    if is_even and "to_world" in props:
        del props["to_world"]
    if is_even:
        props[image.parameter] = color
    else:
        props["bitmap"] = bitmap


def _darken(props: Any, *, on_shape: bool) -> None:
    """Turn an emitter that cannot be scaled into a black one."""
    import mitsuba as mi

    for key in list(props):
        del props[key]
    # The shape must keep an emitter, or its surface would change.
    props.set_plugin_name("area" if on_shape else "point")
    props["radiance" if on_shape else "intensity"] = mi.ScalarColor3f(0)


def child_named(state: Any, node: int, name: str) -> int | None:
    """Return the node that `node` references under `name`; None if there is none."""
    import mitsuba as mi

    props = state.nodes[node].props
    if name not in props or props.type(name) != mi.Properties.Type.ResolvedReference:
        return None
    return int(props[name].index())


def read_emitted_image(path: Path, is_linear: bool) -> Floats:
    """Return the image in a file, (h, w, 3) linear Rec.709. is_linear: of its stored values."""
    import mitsuba as mi

    bitmap = mi.Bitmap(str(path))
    if is_linear:
        bitmap.set_srgb_gamma(False)
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
