"""Hangs luminaires into a scene: an emitter of it becomes a point, or a panel, with their light.

The emitter gives place and axis. A point with a photometric web is exact from afar. Where something
lit is nearer than five times the luminous opening, the luminaire is a panel of that size instead.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint import luminaires
from lightpaint.arrays import Doubles, Position
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.luminaires.registration import check_can_have_luminaires
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.properties.emission import child_named
from lightpaint.scene.properties.pose import FLAT_SHAPES
from lightpaint.scene.runtime.kernel_threads import kernels
from lightpaint.scene.scene_tree import ParsedScene, with_elements, without_emitters

#: Distance to what a luminaire lights, relative to its largest size, from which on it is a point.
FAR = 5.0
#: Directions in which the nearest surface is looked for, and the intensity, relative to the
#: largest, from which on a direction counts.
DIRECTIONS, LEAST_INTENSITY = 1024, 0.01
#: Least size of a panel in scene units.
THIN = 1e-3

#: Emitters without a shape whose place a luminaire can take.
_POINTS = ("point", "spot", luminaires.POINT_PLUGIN)

#: What follows the name of a luminaire in the names of further spots that form its light.
SPOT_MARK = ".spot"


@dataclass(frozen=True)
class HungLuminaire:
    """A luminaire in a scene.

    name: of its emitter. file, offset: of the element whose place it takes. scale: factor of the
    candela of its file. distance: to the nearest surface that it lights, if that was looked for.
    tilt: degrees by which its nadir is away from downwards. is_panel: whether its size counts.
    further: file and offset of spots that were part of its light in a relit scene, and that it
    replaces. has_own_level: whether the scene says how bright it is; else it is at full.
    """

    name: str
    request: luminaires.LuminaireRequest
    file: int
    offset: int
    scale: float
    distance: float | None = None
    tilt: float = 0.0
    is_panel: bool = False
    further: tuple[tuple[int, int], ...] = ()
    has_own_level: bool = False

    def remarks(self) -> list[str]:
        """Return what its user should know of it."""
        web, file = self.request.web, self.request.path.name
        opening, remarks = web.opening, [luminaires.unread_remark(web, file)]
        if self.request.lumens is None:
            remarks.append(luminaires.flux_remark(web, file))
        elif self.request.has_absolute_emitters:
            remarks.append(
                f"{file}: lumens changes nothing beside emitters in lm or cd, which say how bright "
                "they are: leave it out"
            )
        if not self.request.has_absolute_emitters and (factor := web.factor_at(self.tilt)) != 1:
            remarks.append(
                f"{file}: tilted by {self.tilt:.3g} degrees it gives {factor:.3g} of its light, by "
                "the factors in it (TILT=INCLUDE)"
            )
        if self.is_panel and self.distance is not None:
            remarks.append(
                f"{self.name}: its luminous opening is {opening.largest:.3g} m, and "
                f"{self.distance:.3g} m away is a surface that it lights, so it is a panel of "
                f"{opening.along_c0:.3g} x {opening.along_c90:.3g} m"
            )
        return [text for text in remarks if text]


def hang_luminaires(
    parsed: ParsedScene,
    requests: Mapping[str, luminaires.LuminaireRequest],
    groups: Mapping[str, Iterable[str]],
    up: Position,
    cd_per_unit: float,
) -> ParsedScene:
    """Return a copy of a scene in which emitters have become luminaires.

    requests: by name or pattern of emitters and groups. groups: names or patterns of their
    emitters. up: of the scene, for points, which have no axis. cd_per_unit: candelas of an
    intensity of 1.
    Raises SceneError for a name that no emitter has, and for one whose place cannot be taken.
    """
    import mitsuba as mi

    check_can_have_luminaires(mi.variant())
    chosen = _chosen(parsed, requests, groups)
    whole = {parsed.names[node] for node in chosen}
    further = {k: luminaire_of_spot(parsed.names[k]) for k in parsed.emitter_nodes}
    further = {k: name for k, name in further.items() if name in whole}
    parsed = without_emitters(parsed, further.keys()) if further else parsed.copied()
    distances = _distances(parsed, chosen, up)
    for node, hanging in chosen.items():
        name, tilt = parsed.names[node], _tilt(parsed, node, hanging, up)
        request = hanging.tilted(tilt)
        distance = distances.get(node)
        is_panel = distance is not None and distance < FAR * request.web.opening.largest
        hung = HungLuminaire(
            name,
            request,
            *_element(parsed, node),
            request.scale(cd_per_unit),
            distance,
            tilt,
            is_panel,
            tuple(_element(parsed, k) for k, whole in further.items() if whole == name),
            _has_own_level(parsed, node) or name in further.values(),
        )
        if name in further.values():
            _rejoin(parsed.state.nodes[node].props, hung)
        file = os.path.relpath(request.path.resolve(), parsed.path.resolve().parent)
        numbers = request.parameters(cd_per_unit)
        if is_panel:
            parsed = _with_panel(parsed, node, hung, Path(file).as_posix(), numbers, up)
        else:
            _become_luminaire(parsed, node, Path(file).as_posix(), numbers, up)
            parsed.luminaires[node] = hung
    return parsed


def _element(parsed: ParsedScene, node: int) -> tuple[int, int]:
    """Return the file of an element, and the offset of its `<`."""
    return parsed.state.nodes[node].file_index, int(parsed.state.nodes[node].offset) - 1


def _chosen(
    parsed: ParsedScene,
    requests: Mapping[str, luminaires.LuminaireRequest],
    groups: Mapping[str, Iterable[str]],
) -> dict[int, luminaires.LuminaireRequest]:
    """Return the luminaire of each node, which the last request for it describes."""
    chosen: dict[int, luminaires.LuminaireRequest] = {}
    names = {name: node for node, name in parsed.names.items() if node in parsed.emitter_nodes}
    for pattern, request in sorted(requests.items(), key=lambda x: x[0] in names):
        wanted = [pattern] if pattern in names else [*groups.get(pattern, ()), pattern]
        found = [x for x in names if any(x == y or fnmatchcase(x, y) for y in wanted)]
        found = [x for x in found if luminaire_of_spot(x) not in found]
        if not found:
            raise SceneError(
                f"{parsed.path} has no light {pattern!r} that could be a luminaire: it has "
                f"{some_names(names)}"
            )
        chosen |= dict.fromkeys((names[x] for x in found), request)
    for node in chosen:
        _check_place(parsed, node)
    return chosen


def luminaire_of_spot(name: str) -> str:
    """Return the luminaire of which a spot of this name is a part; "" if of none."""
    stem, mark, number = name.rpartition(SPOT_MARK)
    return stem if mark and number.isdecimal() else ""


def _rejoin(props: Any, hung: HungLuminaire) -> None:
    """Make the first of a luminaire's spots a luminaire at their level, which the others leave."""
    import mitsuba as mi

    spots = luminaires.spots_of(hung.request.web)
    first = hung.scale * spots[0].candela if spots else 1.0
    level = np.array(props.get("intensity", 0.0), float).ravel() / first
    props.set_plugin_name(luminaires.POINT_PLUGIN)
    props["intensity"] = mi.ScalarColor3f(*np.broadcast_to(level, 3).tolist())


def _check_place(parsed: ParsedScene, node: int) -> None:
    """Raise SceneError unless a luminaire can take the place of an emitter."""
    props = parsed.state.nodes[node].props
    plugin, shape = str(props.plugin_name()), parsed.shape_plugin(node)
    is_flat = plugin in ("area", luminaires.AREA_PLUGIN) and shape in FLAT_SHAPES
    pictures = ("texture", "radiance")
    is_picture = any(child_named(parsed.state, node, x) is not None for x in pictures)
    if (is_flat or plugin in _POINTS) and not is_picture:
        return
    what = "shows a picture" if is_picture else f"is {_article(plugin)} {plugin}"
    where = f" on {_article(shape)} {shape}" if shape and not is_picture else ""
    raise SceneError(
        f"light {parsed.names[node]!r} {what}{where}: a luminaire can take the place of a point, a "
        "spot, or an area light on a rectangle or a disk, without a picture"
    )


def _article(noun: str) -> str:
    return "an" if noun[:1] in "aeio" else "a"


def _frame(parsed: ParsedScene, node: int, up: Position) -> tuple[Doubles, Doubles]:
    """Return the axes (3, 3) and the place (3,) of an emitter that is not on a shape."""
    props = parsed.state.nodes[node].props
    if props.plugin_name() == "point":
        if "position" in props:
            return luminaires.hanging_frame(up), np.array(props["position"], np.float64).ravel()
        place = _matrix(props)[:3, 3] if "to_world" in props else np.zeros(3)
        return luminaires.hanging_frame(up), place
    matrix = _matrix(props) if "to_world" in props else np.eye(4)
    return matrix[:3, :3], matrix[:3, 3]


def _matrix(props: Any) -> Doubles:
    return np.array(props["to_world"].matrix, np.float64).reshape(4, 4)


def _become_luminaire(
    parsed: ParsedScene, node: int, file: str, numbers: Mapping[str, float], up: Position
) -> None:
    """Change the node of an emitter into a luminaire's."""
    import mitsuba as mi

    props = parsed.state.nodes[node].props
    was_luminaire = props.plugin_name() in luminaires.LUMINAIRE_PLUGINS
    intensity = _level(parsed, node)
    own = {key: float(props[key]) for key in ("turn", "tilt") if was_luminaire and key in props}
    if was_luminaire:
        numbers = {**{k: x for k, x in numbers.items() if k not in ("turn", "tilt")}, **own}
    matrix = np.eye(4)
    if node not in parsed.shape_of:
        matrix[:3, :3], matrix[:3, 3] = _frame(parsed, node, up)
    for key in list(props):
        if key != "sampling_weight":
            del props[key]
    props.set_plugin_name(
        luminaires.AREA_PLUGIN if node in parsed.shape_of else luminaires.POINT_PLUGIN
    )
    props["filename"] = file
    if node not in parsed.shape_of:
        props["to_world"] = mi.ScalarAffineTransform4d(matrix)
    for key, value in numbers.items():
        props[key] = value
    props["intensity"] = mi.ScalarColor3f(*intensity)


def _has_own_level(parsed: ParsedScene, node: int) -> bool:
    """Return whether the scene says how bright a luminaire is, or that it is off."""
    is_luminaire = parsed.state.nodes[node].props.plugin_name() in luminaires.LUMINAIRE_PLUGINS
    return is_luminaire or not any(_level(parsed, node))


def _level(parsed: ParsedScene, node: int) -> tuple[float, ...]:
    """Return the level at which a luminaire is in the scene: the level of one, else full, or
    off."""
    import mitsuba as mi

    props = parsed.state.nodes[node].props
    plain = (mi.Properties.Type.Color, mi.Properties.Type.Float)
    keys = [k for k in ("intensity", "radiance") if k in props and props.type(k) in plain]
    colors = [np.array(props[k], float).ravel() for k in keys]
    if props.plugin_name() in luminaires.LUMINAIRE_PLUGINS and colors:
        return tuple(np.broadcast_to(colors[0], 3).tolist())
    return (0.0,) * 3 if colors and not colors[0].any() else (1.0,) * 3


def _distances(
    parsed: ParsedScene, chosen: Mapping[int, luminaires.LuminaireRequest], up: Position
) -> dict[int, float]:
    """Return the distance to the nearest surface that each luminaire of some size lights.

    Those on shapes, whose size is theirs, and those without a size are left out.
    """
    import mitsuba as mi

    sized = {
        node: request
        for node, request in chosen.items()
        if node not in parsed.shape_of and request.web.opening.largest > 0
    }
    if not sized:
        return {}
    loaded, found = parsed.instantiate({}), {}
    with kernels():
        for node, request in sized.items():
            axes, place = _frame(parsed, node, up)
            web_axes = luminaires.world_from_web(axes, turn=request.turn, tilt=request.tilt)
            away = _lit_directions(request.web) @ web_axes.T
            rays = mi.Ray3f(
                mi.Point3f(*place.tolist()), mi.Vector3f(away.T.astype(np.float32).copy())
            )
            hits = np.array(loaded.ray_intersect_preliminary(rays).t, np.float64).ravel()
            found[node] = float(hits.min(initial=np.inf))
    return found


def _tilt(
    parsed: ParsedScene, node: int, request: luminaires.LuminaireRequest, up: Position
) -> float:
    """Return the degrees by which the nadir of a luminaire is away from downwards."""
    props = parsed.state.nodes[node].props
    turn, tilt = (
        float(props[key])
        if props.plugin_name() in luminaires.LUMINAIRE_PLUGINS and key in props
        else own
        for key, own in (("turn", request.turn), ("tilt", request.tilt))
    )
    axes = _shape_axes(parsed, node) if node in parsed.shape_of else _frame(parsed, node, up)[0]
    nadir = -luminaires.world_from_web(axes, turn=turn, tilt=tilt)[:, 2]
    cosine = float(nadir @ up) / float(np.linalg.norm(up))
    return float(np.degrees(np.arccos(np.clip(-cosine, -1, 1))))


def _shape_axes(parsed: ParsedScene, node: int) -> Doubles:
    """Return the axes (3, 3) of the shape of an emitter."""
    props = parsed.state.nodes[parsed.shape_of[node]].props
    return _matrix(props)[:3, :3] if "to_world" in props else np.eye(3)


def _lit_directions(web: luminaires.PhotometricWeb) -> Doubles:
    """Return directions (n, 3), evenly spread over those in which a web shines."""
    k = np.arange(DIRECTIONS) + 0.5
    z, angle = 1 - 2 * k / DIRECTIONS, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z**2)
    directions = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=-1)
    return directions[web.candela(directions) >= LEAST_INTENSITY * web.peak]


def _with_panel(
    parsed: ParsedScene,
    node: int,
    hung: HungLuminaire,
    file: str,
    numbers: Mapping[str, float],
    up: Position,
) -> ParsedScene:
    """Return a scene with a panel in the place of a point or spot."""
    request, props = hung.request, parsed.state.nodes[node].props
    axes, place = _frame(parsed, node, up)
    matrix = np.eye(4)
    # Its shape hangs as it is turned, so its light needs no turn.
    in_world = luminaires.world_from_web(axes, turn=request.turn, tilt=request.tilt)
    opening = request.web.opening
    sides = np.maximum([opening.along_c0, opening.along_c90, 2 * THIN], THIN) / 2
    matrix[:3, :3] = in_world @ luminaires.EMITTER_FROM_WEB.T * [sides[0], sides[1], 1.0]
    matrix[:3, 3] = place
    is_disk = opening.is_round and abs(sides[0] - sides[1]) < THIN
    turned = {key: x for key, x in numbers.items() if key not in ("turn", "tilt")}
    lines = luminaire_lines(
        luminaires.AREA_PLUGIN,
        "",
        file,
        turned,
        tag("rgb", name="intensity", value=rgb_text(_level(parsed, node))),
        None,
        sampling_weight=float(props.get("sampling_weight", 1.0)),
    )
    text = "\n".join(panel_lines(hung.name, "disk" if is_disk else "rectangle", matrix, lines))
    others = without_emitters(parsed, [node])
    others.names = {k: name for k, name in parsed.names.items() if k != node}
    other = with_elements(others, {hung.name: text})
    new = other.emitter_nodes[-1]
    for k in (new, other.shape_of[new]):
        # In the file they are where the emitter is whose place they take.
        other.state.nodes[k].file_index = hung.file
        other.state.nodes[k].offset = hung.offset + 1
    other.luminaires = {**parsed.luminaires, new: hung}
    return other


def luminaire_lines(
    plugin: str,
    name: str,
    file: str,
    numbers: Mapping[str, float],
    intensity: str,
    matrix: Doubles | None,
    *,
    sampling_weight: float = 1.0,
) -> list[str]:
    """Return the XML of a luminaire's emitter, line by line.

    name: its id; "" for none. intensity: its XML. matrix: (4, 4); None on a shape.
    """
    inner = [tag("string", name="filename", value=file)]
    inner += [tag("float", name=key, value=f"{x:.9g}") for key, x in numbers.items()]
    inner += [] if matrix is None else [matrix_text(matrix)]
    inner.append(intensity)
    if sampling_weight != 1:
        inner.append(tag("float", name="sampling_weight", value=f"{sampling_weight:g}"))
    head = {"id": name} if name else {}
    start = tag("emitter", type=plugin, **head).replace("/>", ">")
    return [start, *(f"    {line}" for line in inner), "</emitter>"]


def rgb_text(rgb: Sequence[float]) -> str:
    """Return a colour as XML has it."""
    return " ".join(f"{np.float32(x):.9g}" for x in rgb)


def panel_lines(name: str, shape: str, matrix: Doubles, emitter: Sequence[str]) -> list[str]:
    """Return the XML of a black shape with an emitter, line by line. matrix: (4, 4)."""
    black = tag("rgb", name="reflectance", value="0")
    start = tag("shape", type=shape, id=name).replace("/>", ">")
    inner = [matrix_text(matrix), f'<bsdf type="diffuse">{black}</bsdf>', *emitter]
    return [start, *(f"    {line}" for line in inner), "</shape>"]


def matrix_text(matrix: Doubles) -> str:
    """Return the XML of a transform (4, 4)."""
    numbers = " ".join(f"{x + 0.0:.9g}" for x in np.round(matrix, 12).ravel())
    return f'<transform name="to_world">{tag("matrix", value=numbers)}</transform>'
