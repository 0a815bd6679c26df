"""Nuke scripts: one that multiplies the layers of the rendered file and adds them up, and one with
the lights of an answer.

A `.nk` file is Tcl: each node takes its inputs from a stack, top one first, and pushes itself.
Foreign names are quoted for that parser. Nuke evaluates some knobs (fields of a node) once more: in
file names and labels it substitutes Tcl in brackets, and in file names also the frame number and
the view. How to quote these is not documented, so the script contains nothing that would be
substituted.

Lights are nodes of the classic 3-D system. Nuke's axes have y up, and its lights shine along their
-z. `rot_order ZXY` turns about z, then x, then y, so a rotation without z aims a light with its x
to the right. Nuke's diffuse shading lacks the 1/π of Mitsuba's, so intensities are divided by π: a
white card gets the radiance of a white wall.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint.arrays import RGB, Floats, Position
from lightpaint.basis import LightGroups, RenderLayer, free_name, multipliers_in
from lightpaint.colour import REC709, are_same, from_rec709, to_rec709
from lightpaint.files import one_line
from lightpaint.images.formats import ExrPart, rgb_channels
from lightpaint.lighting import Lighting
from lightpaint.relit.export.program_axes import axis_conversions, conversion_of
from lightpaint.scene.properties.site import Site

#: Characters that need a backslash in a quoted Tcl word within braces.
SPECIAL = re.compile(r'[\\"\[\]${}]')

#: Characters that Nuke evaluates in a file name, for Tcl, frame numbers and views, or that a script
#: cannot contain.
EVALUATED = re.compile(r"[\[\]$\\%#\x00-\x1f\x7f\ud800-\udfff]")

#: Copy of the layers beside the script, under names that Nuke can distinguish.
LAYERS = "relit_layers.exr"

#: Kinds of lights in a rig.
RigKind = Literal["point", "spot", "sun", "panel"]

#: Nuke's up axis.
UP = (0.0, 1.0, 0.0)

#: Nuke's type for each kind of light. A panel shines from its centre into the half space before it.
LIGHT_TYPES = {"point": "point", "spot": "spot", "sun": "directional", "panel": "spot"}

#: Widest cone of a spot in degrees, from edge to edge.
WIDEST_CONE = 180.0

#: Level component of a direction up to which it counts as straight up or down.
STRAIGHT = 1e-6

#: Names that Nuke's expressions reserve.
RESERVED = ("root", "this", "parent", "input", "preferences")


@dataclass(frozen=True)
class _Source:
    """The location of a picture for Nuke: the file, and Nuke's name of the layer."""

    file: Path
    layer: str


def nuke_script(groups: LightGroups, lighting: Lighting, folder: Path) -> str:
    """Return the text of relit.nk: Σ multiplier × layer, plus the unchanged rest.

    folder: its folder, which also has the copy from `copied_part` of layers that Nuke would
    confuse.
    """
    lights, beauty = _sources(groups, folder)
    sources = [*lights, *([beauty] if beauty is not None else [])]
    files = list(dict.fromkeys(x.file for x in sources))
    lines = ["version 12.0 v1"]
    for name in dict.fromkeys(x.layer for x in sources):
        if name != "rgba":
            lines.append(f"add_layer {{{name} {name}.red {name}.green {name}.blue {name}.alpha}}")
    lines += node("StickyNote", inputs="0", name="lightpaint_note", label=quoted(_note(groups)))
    for k, file in enumerate(files):
        knobs = _file_knobs(file, groups)
        lines += [*node("Read", inputs="0", **knobs, raw="true", name=f"Read_{k}")]
        lines.append(f"set R{k} [stack 0]")

    # Lights are multiplied in the primaries of their renderer, mostly the same as of the file.
    to_own, from_own = _conversions(groups)
    has_alpha = groups.beauty is not None and groups.beauty.alpha is not None
    if has_alpha:
        lines += _shuffle(beauty, files, "Alpha")
    has_rest = groups.has_rest and beauty is not None
    if has_rest:
        lines += _rest(lights, beauty, files) + _matrix(to_own, "Rest_multiplied")
    shuffled = [
        _shuffle(x, files, f"Layer_{k}") + _matrix(to_own, f"Layer_{k}_multiplied")
        for k, x in enumerate(lights)
    ]
    lines += _sum(groups, lighting, shuffled, has_rest=has_rest)
    lines += _matrix(from_own, "As_in_the_file")
    if has_alpha:
        lines += node(
            "Copy", inputs="2", from0="rgba.alpha", to0="rgba.alpha", name="Alpha_of_beauty"
        )
    return "\n".join(lines) + "\n"


def _conversions(groups: LightGroups) -> tuple[Floats | None, Floats | None]:
    """Return the matrices to the primaries in which lights are multiplied, from the layers that
    Nuke reads, and from there to the primaries of the file; None where these are the same.
    """
    of_file = groups.layers[0].primaries
    own = groups.basis.origin.primaries or None
    of_layers = None if needs_copy(groups) else of_file

    def matrix(source: tuple[float, ...] | None, to: tuple[float, ...] | None) -> Floats | None:
        if are_same(source, to):
            return None
        return from_rec709(to or REC709) @ to_rec709(source or REC709)

    return matrix(of_layers, own), matrix(own, of_file)


def spoken_unreadable(groups: LightGroups, folder: Path) -> list[str]:
    """Return a remark if relit.nk in `folder` cannot name a file that it reads."""
    if groups.sequence is not None and needs_copy(groups):
        return [
            f"Nuke cannot tell the layers of {one_line(str(groups.path))} apart, so there is no "
            "relit.nk of its shot"
        ]
    lights, beauty = _sources(groups, folder)
    files = dict.fromkeys(x.file for x in [*lights, *([beauty] if beauty is not None else [])])
    if not (bad := [file for file in files if _is_evaluated(file)]):
        return []
    # The path may be printed to a terminal.
    names_text = one_line(str(bad[0])) + (f" and {len(bad) - 1} more" if len(bad) > 1 else "")
    characters = "".join(sorted({c for file in bad for c in EVALUATED.findall(_path(file))}))
    return [
        f"Nuke would evaluate {one_line(characters)} in the path {names_text}: relit.nk leaves it "
        "out: choose it by hand in the Read nodes, or rename it"
    ]


def needs_copy(groups: LightGroups) -> bool:
    """Return whether Nuke would merge two layers of a file, or misread the channels of one, or
    needs the sum of two.
    """
    read = _read(groups)
    layers = [*dict.fromkeys((x.file, x.part, x.channels) for x in read)]
    sources = {(x.file, nuke_layer(x)) for x in read}
    is_misread = any(x.is_sum or x.channels[0].count(".") > 2 for x in read)
    return len(sources) < len(layers) or is_misread


def copied_part(groups: LightGroups) -> ExrPart:
    """Return the layers in linear Rec.709 float32, under names that Nuke can distinguish."""
    channels: dict[str, Floats] = {}
    *names, beauty = _copied_names(groups)
    for name, image in zip(names, groups.basis.planes, strict=False):
        channels |= rgb_channels(image, name)
    if groups.beauty is not None:
        light = np.where(groups.holes[..., None], np.float32(0), groups.beauty.image)
        channels |= rgb_channels(groups.beauty.in_rec709(light), beauty)
        if groups.beauty.alpha is not None:
            channels[f"{beauty}.A"] = groups.beauty.alpha.astype(np.float32)
    return ExrPart("layers", channels)


def nuke_layer(layer: RenderLayer) -> str:
    """Return Nuke's name for a layer of an EXR file; `rgba` for plain R, G, B in a file with one
    part.

    Nuke strips digits from the front of each component between dots, replaces every byte other than
    letters and digits by an underscore, and joins the components with underscores. Two names may
    become equal.
    """
    prefix, _, _ = layer.channels[0].rpartition(".")
    name = _in_nuke(prefix or layer.part)
    return "rgba" if name in ("", "Ci") else name


def _in_nuke(name: str) -> str:
    pieces = [piece.lstrip("0123456789") for piece in name.split(".")]
    name_text = "_".join(piece for piece in pieces if piece).encode("utf-8", "surrogateescape")
    return re.sub(rb"[^A-Za-z0-9]", b"_", name_text).decode("ascii")


def _copied_names(groups: LightGroups) -> list[str]:
    """Return unique names for the lights and the beauty in the copy."""
    names: list[str] = []
    for light in (*(light.name for light in groups.basis.lights[: len(groups.layers)]), "beauty"):
        names.append(free_name(_in_nuke(light) or "light", names))
    return names


def _sources(groups: LightGroups, folder: Path) -> tuple[list[_Source], _Source | None]:
    """Return the sources of each light and of the beauty."""
    if needs_copy(groups):
        file = Path(folder) / LAYERS
        *lights, beauty = (_Source(file, name) for name in _copied_names(groups))
        return lights, beauty if groups.beauty is not None else None
    sources = [_Source(x.file, nuke_layer(x)) for x in groups.layers]
    layer = groups.beauty
    return sources, None if layer is None else _Source(layer.file, nuke_layer(layer))


def _file_knobs(file: Path, groups: LightGroups) -> dict[str, str]:
    """Return the knobs for a file, or a request to choose it if Nuke would change its name.

    Of a shot they name all frames.
    """
    if _is_evaluated(file):
        return {"file": '""', "label": quoted(f"choose by hand: {plain(file.name)}")}
    if (sequence := groups.sequence) is None:
        return {"file": quoted(_path(file))}
    name = _path(sequence.with_hashes(file, sequence.frame_of(groups.path)))
    first, last = sequence.frames[0], sequence.frames[-1]
    return {"file": quoted(name), "first": str(first), "last": str(last)}


def _is_evaluated(file: Path) -> bool:
    return bool(EVALUATED.search(_path(file)))


def _path(file: Path) -> str:
    return file.absolute().as_posix()


def quoted(text: str) -> str:
    """Return any text as one Tcl word."""
    escaped = SPECIAL.sub(lambda match: f"\\{match[0]}", text)
    return '"' + escaped.replace("\r", "").replace("\n", "\\n") + '"'


def _read(groups: LightGroups) -> list[RenderLayer]:
    return [*groups.layers, *([groups.beauty] if groups.beauty is not None else [])]


def _sum(
    groups: LightGroups, lighting: Lighting, shuffled: Sequence[list[str]], *, has_rest: bool
) -> list[str]:
    """Return nodes that multiply each light and add it to the others, and to the rest if there is
    one. shuffled: nodes that output each light.
    """
    lines: list[str] = []
    labels: list[str] = []
    for k, (light, nodes) in enumerate(zip(groups.basis.lights, shuffled, strict=False)):
        labels.append(free_name(plain(light.name), labels))
        lines += nodes + node(
            "Multiply",
            channels="rgb",
            value=_multipliers(groups, lighting, light.name),
            name=f"Light_{k}",
            label=quoted(labels[-1]),
        )
        if k or has_rest:
            lines += node("Merge2", inputs="2", operation="plus", name=f"Sum_{k}")
    return lines


def _multipliers(groups: LightGroups, lighting: Lighting, name: str) -> str:
    """Return the multipliers of a light, of lights that change as curves with a key at each frame.

    One more key at each end keeps a curve level there.
    """
    primaries = groups.basis.origin.primaries
    if not lighting.animation:
        own = multipliers_in(primaries, np.array(lighting[name].weight))
        return "{" + " ".join(f"{v:.9g}" for v in (*own, 1)) + "}"
    span = lighting.by_frame
    frames = [min(span) - 1, *span, max(span) + 1]
    weights = [
        multipliers_in(primaries, np.array(lighting.at_frame(frame)[name].weight))
        for frame in frames
    ]
    curves = []
    for c in range(3):
        keys = [f"x{x} {rgb[c]:.9g}" for x, rgb in zip(frames, weights, strict=True)]
        curves.append(f"{{curve {' '.join(keys)}}}")
    return "{" + " ".join(curves) + " 1}"


def _rest(lights: Sequence[_Source], beauty: _Source | None, files: Sequence[Path]) -> list[str]:
    """Return nodes that subtract all groups from the beauty."""
    lines = _shuffle(beauty, files, "Beauty")
    for k, light in enumerate(lights):
        lines += _shuffle(light, files, f"Without_{k}")
        lines += node("Merge2", inputs="2", operation="minus", name=f"Rest_{k}")
    return lines


def _matrix(matrix: Floats | None, name: str) -> list[str]:
    if matrix is None:
        return []
    rows = " ".join("{" + " ".join(f"{v:.9g}" for v in row) + "}" for row in matrix)
    return node("ColorMatrix", matrix=f"{{{rows}}}", name=name)


def _shuffle(source: _Source | None, files: Sequence[Path], name: str) -> list[str]:
    assert source is not None
    read = f"push $R{files.index(source.file)}"
    return [read, *node("Shuffle", **{"in": source.layer}, name=name)]


def node(kind: str, **knobs: str) -> list[str]:
    """Return the lines of a node. knobs: values by name, as Tcl words."""
    return [f"{kind} {{", *(f" {knob} {value}" for knob, value in knobs.items()), "}"]


def _note(groups: LightGroups) -> str:
    return (
        f"lightpaint: light groups of {plain(groups.name)}, multiplied as solved. "
        "Should a Shuffle show black, choose its layer by hand: its Multiply bears the name."
    )


def plain(text: str) -> str:
    """Return a text without characters that Nuke would evaluate in a label."""
    return re.sub(r"[^\w .,+()-]", "_", text)


@dataclass(frozen=True)
class NukeLight:
    """A light that shines from a point or in one direction.

    emission: its intensity along its axis in W/sr, or irradiance of a sun in W/m². kelvin: None if
    its colour is unknown or has none.
    """

    name: str
    kind: RigKind
    emission: RGB
    site: Site
    kelvin: float | None = None
    is_moved: bool = False
    is_new: bool = False


def nuke_lights(
    lights: Sequence[NukeLight], *, up: Position, about: str, left: Sequence[str] = ()
) -> str:
    """Return a script with a Light2 node for each light, and a Scene that gathers them.

    up: the axis of the scene that is up. about: for its note. left: names of lights
    that the script lacks, for the note.
    """
    names = [*RESERVED, "lightpaint_note", "lightpaint_rig"]
    conversion = conversion_of((), axis_conversions(up, UP)[:1], {})
    lines = ["version 12.0 v1"]
    note = [
        f"lightpaint: {plain(about)}. Intensities are divided by pi, as a white card shows them."
    ]
    if left:
        note.append(f"Set by hand: {', '.join(map(plain, left))}")
    label = quoted("\n".join(note))
    lines += node("StickyNote", inputs="0", name="lightpaint_note", label=label)
    for light in lights:
        names.append(free_name(_node_name(light.name), names))
        place = {}
        if light.site.position is not None:
            place["translate"] = _vector(conversion.point(light.site.position).tolist())
        if light.site.direction is not None:
            way = (conversion.rotation @ light.site.direction).tolist()
            place |= {"rot_order": "ZXY", "rotate": _vector(rotate_of(way))}
        lines += node(
            "Light2",
            inputs="0",
            light_type=LIGHT_TYPES[light.kind],
            **_brightness(light),
            **place,
            **_cone(light),
            name=names[-1],
            label=quoted(_label(light, names[-1])),
        )
    # The scene takes all lights from the stack.
    lines += node("Scene", inputs=str(len(lights)), name="lightpaint_rig")
    return "\n".join(lines) + "\n"


def rotate_of(direction: Position) -> Position:
    """Return the rotation in degrees about x, y and z, in the order ZXY, that turns -z to a
    direction.
    """
    x, y, z = direction
    level = math.hypot(x, z)
    # A light that shines straight up or down has no heading, only rounding errors.
    heading = math.degrees(math.atan2(-x, -z)) if level > STRAIGHT else 0.0
    return math.degrees(math.atan2(y, level)), heading, 0.0


def _brightness(light: NukeLight) -> dict[str, str]:
    """Return colour, with its brightest channel at 1, intensity and falloff of a light."""
    brightest = max(*light.emission, 0.0)
    color = [v / brightest for v in light.emission] if brightest > 0 else [1.0] * 3
    falloff = {} if light.kind == "sun" else {"falloff_type": "Quadratic"}
    return {"color": _vector(color), "intensity": f"{brightest / math.pi:.9g}", **falloff}


def _cone(light: NukeLight) -> dict[str, str]:
    """Return the cone of a spot, whose light fades inward from its edge, or of a panel.

    Angles are of the whole cone; a negative penumbra lies inside it. The light of a panel falls off
    as the cosine.
    """
    if light.kind == "panel":
        return {"cone_angle": f"{WIDEST_CONE:g}", "cone_falloff": "1"}
    if light.site.cutoff is None:
        return {}
    cutoff = min(2 * light.site.cutoff, WIDEST_CONE)
    beam = min(2 * (light.site.beam or 0.0), cutoff)
    return {"cone_angle": f"{cutoff:.9g}", "cone_penumbra_angle": f"{beam - cutoff + 0.0:.9g}"}


def _label(light: NukeLight, node_name: str) -> str:
    """Return the label of a node: the light's name if Nuke cannot have it, and what changed."""
    rows = [plain(light.name)] if light.name != node_name else []
    if light.is_new:
        rows.append(f"new {light.kind}, added by lightpaint")
    elif light.is_moved:
        rows.append("moved by lightpaint")
    if light.kelvin is not None:
        rows.append(f"{light.kelvin:.0f} K")
    return "\n".join(rows)


def _node_name(name: str) -> str:
    """Return a name with the characters that Nuke allows, which does not begin with a digit."""
    allowed = re.sub(r"[^A-Za-z0-9_]", "_", name)
    if not re.search(r"[A-Za-z]", allowed):
        allowed = f"light{allowed}"
    return f"_{allowed}" if allowed[0].isdigit() else allowed


def _vector(values: Sequence[float]) -> str:
    """Return numbers as a value of Nuke, without negative zeros."""
    return "{" + " ".join(f"{v + 0.0:.9g}" for v in values) + "}"
