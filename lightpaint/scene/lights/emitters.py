"""The emitters of a scene as Mitsuba loaded them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour import lambertian_flux, luminance, point_flux, spot_flux
from lightpaint.errors import SceneError
from lightpaint.luminaires import AREA_PLUGIN, LUMINAIRE_PLUGINS
from lightpaint.scene.lights.texels.texel import Texel
from lightpaint.scene.plane_identity import EmitterDigest, SceneHasher
from lightpaint.scene.properties.emission import (
    ENVIRONMENTS,
    EmissionKind,
    Scaling,
    emission_kind,
    is_never_found,
    read_emission,
    why_not_adjusted,
)
from lightpaint.scene.properties.pose import FLAT_SHAPES, Site, site_of
from lightpaint.scene.properties.site import unit
from lightpaint.scene.scene_tree import GENERATED_ID, ParsedScene
from lightpaint.validation import MAX_NAME

#: Emitters that no RGB variant of Mitsuba renders correctly, each with advice.
NOT_RENDERED = {"timed_sunsky": "use sunsky with the hour you want"}

#: Emitters of irradiance that shine along an axis, and what float32 changes its length by.
SCALED_BY_LENGTH = ("directional", "projector")
LENGTH_TOLERANCE = 1e-5


@dataclass(frozen=True)
class Emitter:
    """An emitter of a scene.

    kind: how it is scaled; None if lightpaint cannot scale it. emission: current linear RGB
    emission in the unit of `kind`; 1 if that is a multiple. file, offset: position of its element:
    index into Scene.files, byte offset of its `<`. obstacle: why it cannot be adjusted, phrased to
    follow its name; "" if it can. unit_flux: watts per channel at an emission of 1; None if that is
    undefined. has_name: whether its author named it; otherwise the name is generated. belongs_to:
    name of the material, file or parent of an unnamed emitter, or "". digest: hashes of what its
    light depends on besides the scene; None if it is not in a file. site: its position, direction
    and cone. texel: its place in the image of the element, if that is split into texels. is_dark:
    whether it is never sampled, and hence dark in Mitsuba whatever it emits; a colour is then 0.
    gain: the factor by which Mitsuba multiplies its emission (`gain_of`).
    """

    name: str
    plugin: str
    kind: EmissionKind | None
    emission: RGB
    form: str
    sampling_weight: float
    node: int
    file: int
    offset: int
    obstacle: str = ""
    unit_flux: float | None = None
    has_name: bool = True
    belongs_to: str = ""
    digest: EmitterDigest | None = None
    site: Site = field(default_factory=Site)
    texel: Texel | None = None
    is_dark: bool = False
    gain: float = 1.0

    def __repr__(self) -> str:
        return f"Emitter({self.name!r}, {self.plugin} {self.form})"

    @property
    def is_outside_gamut(self) -> bool:
        """True if its colour is outside Rec.709, as the colours of LEDs are: some channel is
        negative."""
        return min(self.emission) < 0 < float(luminance(np.array(self.emission)))

    @property
    def hit_by_chance(self) -> bool:
        """True if it is only found by rays that happen to hit it, and never sampled.

        This concerns meshes with an emission attribute: Mitsuba states a wrong probability for
        sampling them, so a render would depend on the sampling weights, and hence on which other
        lights are on.
        """
        return self.plugin == "area" and self.kind is not None and self.kind.is_scalar


def find_emitters(parsed: ParsedScene, loaded: Any, hasher: SceneHasher) -> tuple[Emitter, ...]:
    """Return the emitters used by the scene, in document order.

    hasher: a SceneHasher of that scene.
    """
    node_of = {name: node for node, name in parsed.names.items()}
    # Reading it walks over everything in the scene.
    integrator = parsed.integrator().plugin
    emitters = []
    for emitter in loaded.emitters():
        name = emitter.id()
        if name not in node_of:
            raise SceneError(
                f"emitter {name!r} is not a separate element in {parsed.path}: make it one"
            )
        node = parsed.state.nodes[node_of[name]]
        plugin = node.props.plugin_name()
        check_flat(plugin, parsed.shape_plugin(node_of[name]), name)
        kind = emission_kind(emitter, plugin)
        if kind is None:
            check_rendered(emitter, plugin, name, integrator)
        emission = read_emission(emitter, kind, name)
        sampling_weight = float(emitter.sampling_weight())
        is_colour = kind is not None and kind.scaling is Scaling.COLOUR
        is_dark = is_never_found(plugin, sampling_weight, integrator)
        site = site_of(emitter, plugin, parsed.shape_plugin(node_of[name]))
        check_site(site, plugin, name)
        emitters.append(
            Emitter(
                name=name,
                plugin=plugin,
                kind=kind,
                emission=(0.0, 0.0, 0.0) if is_dark and is_colour else emission,
                form=describe_form(emitter, plugin),
                sampling_weight=sampling_weight,
                node=node_of[name],
                file=node.file_index,
                offset=node.offset - 1,
                obstacle=why_not_adjusted(plugin, kind, emission),
                unit_flux=flux_of_unit(emitter, plugin, kind),
                has_name=has_name(parsed, node_of[name]),
                belongs_to=belongs_to(parsed, node_of[name]),
                digest=hasher.emitter(node_of[name], kind),
                site=site,
                is_dark=is_dark,
                gain=gain_of(emitter, plugin),
            )
        )
    return tuple(sorted(emitters, key=lambda emitter: emitter.node))


def check_emitters(path: Path, emitters: Sequence[Emitter]) -> None:
    """Raise SceneError for a scene without lights, or with an excessively long name."""
    if not emitters:
        raise SceneError(f"{path} has no lights: add at least one emitter")
    if max(len(emitter.name) for emitter in emitters) > MAX_NAME:
        raise SceneError(f"{path} has an emitter whose name has more than {MAX_NAME} characters")


def check_flat(plugin: str, shape: str, name: str) -> None:
    """Raise SceneError for a panel with a photometric web on a shape that is not flat."""
    if plugin == AREA_PLUGIN and shape not in FLAT_SHAPES:
        raise SceneError(
            f"light {name!r} is an {plugin} on {shape or 'no shape'}: expected a "
            f"{' or a '.join(FLAT_SHAPES)}"
        )


def check_site(site: Site, plugin: str, name: str) -> None:
    """Raise SceneError if an emitter is nowhere, or shines nowhere: its images would not be
    numbers.
    """
    for what, values in (("position", site.position), ("direction", site.direction)):
        if values is not None and not np.isfinite(values).all():
            raise SceneError(
                f"light {name!r} ({plugin}) has a {what} that is not a number: expected a "
                "direction of a length above 0, two different points of a lookat, and no scale of 0"
            )


def check_rendered(emitter: Any, plugin: str, name: str, integrator: str) -> None:
    """Raise SceneError if `integrator` cannot render a loaded emitter."""
    import drjit as dr
    import mitsuba as mi

    if plugin in NOT_RENDERED:
        raise SceneError(
            f"light {name!r} is a {plugin} emitter, which Mitsuba cannot render here: "
            f"{NOT_RENDERED[plugin]}"
        )
    # Unimplemented methods fail on first use. During a render, that would make the process
    # unusable.
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
    """Return the watts that a loaded emitter of one colour radiates at an emission of 1.

    In W if the scene's unit is a metre. None for emitters without a flux (sky, sun), and for those
    whose colour depends on direction.
    """
    import mitsuba as mi

    if kind is None or kind.scaling is not Scaling.COLOUR:
        return None
    if plugin in LUMINAIRE_PLUGINS:
        return float(emitter.flux)
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
    # A sheared or stretched cone, or one with a texture, has no closed form. The tolerances are
    # the tolerances of Mitsuba's float32.
    is_cone = np.allclose(squares, squares[0, 0] * np.eye(3), atol=1e-4 * squares[0, 0])
    if texture is None or not is_cone or np.ptp(texture) > 1e-6:
        return None
    angles = (np.array(parameters[key]).ravel()[0] for key in ("cutoff_angle", "beam_width"))
    cutoff, beam_width = (math.radians(float(angle)) for angle in angles)
    return float(texture.mean()) * spot_flux(cutoff, beam_width)


def gain_of(emitter: Any, plugin: str) -> float:
    """Return the factor by which Mitsuba multiplies the irradiance of a loaded emitter: the length
    of the axis along which it shines, which the scale of its `to_world` changes (seen in 3.9.1).

    1 for all other emitters, and within the precision of float32.
    """
    import mitsuba as mi

    if plugin not in SCALED_BY_LENGTH:
        return 1.0
    matrix = np.array(mi.traverse(emitter)["to_world"].matrix, dtype=float).reshape(4, 4)
    length = float(np.linalg.norm(matrix[:3, 2]))
    return 1.0 if abs(length - 1) < LENGTH_TOLERANCE else length


def describe_form(emitter: Any, plugin: str) -> str:
    """Return position and size of a loaded emitter as text, in scene units."""
    import mitsuba as mi

    def at(point: Any) -> str:
        # Adding 0 turns a rounded -0 into 0.
        x, y, z = np.round(np.array(point, dtype=float).ravel()[:3], 2) + 0.0
        return f"({x:.2f}, {y:.2f}, {z:.2f})"

    shape = emitter.get_shape()
    if shape is not None:
        box = shape.bbox()
        area = float(np.array(shape.surface_area()).ravel()[0])
        return f"area {area:.3g} at {at(box.center())}"
    if plugin in ENVIRONMENTS:
        return "all around"
    parameters = mi.traverse(emitter)
    if "position" in parameters:
        return f"at {at(parameters['position'])}"
    if "to_world" not in parameters:
        return ""
    matrix = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
    way = f"towards {at(unit(matrix[:3, 2]))}"
    if (gain := gain_of(emitter, plugin)) != 1:
        way = f"{way}, × {gain:.3g} by its scale"
    return way if plugin == "directional" else f"at {at(matrix[:3, 3])} {way}"


def has_name(parsed: ParsedScene, emitter: int) -> bool:
    """Return True if the emitter, or its shape, has an id or a name chosen by the author."""
    nodes = (emitter, parsed.shape_of.get(emitter))
    return any(
        node is not None and (_id(parsed, node) or node in parsed.given_names) for node in nodes
    )


def belongs_to(parsed: ParsedScene, emitter: int) -> str:
    """Return the name of what an unnamed emitter belongs to; "" if nothing there has a name.

    Candidates are the parent of its shape, the shape's material, and its file.
    """
    import mitsuba as mi

    shape = parsed.shape_of.get(emitter)
    if shape is None:
        return ""
    parents = [parsed.parent_of[shape]] if shape in parsed.parent_of else []
    materials = parsed.children_of(shape, mi.ObjectType.BSDF)
    # Include materials inside `twosided` or `mask`.
    materials += [k for m in materials for k in parsed.children_of(m, mi.ObjectType.BSDF)]
    names = (_id(parsed, node) for node in (*parents, *materials))
    props = parsed.state.nodes[shape].props
    file = Path(str(props["filename"])).stem if "filename" in props else ""
    return next(filter(None, names), file)


def _id(parsed: ParsedScene, node: int) -> str:
    own_id = str(parsed.state.nodes[node].props.id())
    return "" if GENERATED_ID.fullmatch(own_id) else own_id
