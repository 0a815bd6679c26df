"""A Nuke script with the lights of an answer, as nodes of the classic 3-D system.

Nuke's axes have y up, and its lights shine along their -z. `rot_order ZXY` turns about z, then x,
then y, so a rotation without z aims a light with its x to the right. Nuke's diffuse shading lacks
the 1/π of Mitsuba's, so intensities are divided by π: a white card gets the radiance of a white
wall.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from lightpaint.arrays import RGB, Position
from lightpaint.basis.lights import free_name
from lightpaint.relit.export.export_places import axis_conversions, conversion_of
from lightpaint.relit.export.nuke import node, plain, quoted
from lightpaint.scene.properties.site import Site

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
class RigLight:
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
    lights: Sequence[RigLight], *, up: Position, about: str, left: Sequence[str] = ()
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


def _brightness(light: RigLight) -> dict[str, str]:
    """Return colour, with its brightest channel at 1, intensity and falloff of a light."""
    brightest = max(*light.emission, 0.0)
    color = [v / brightest for v in light.emission] if brightest > 0 else [1.0] * 3
    falloff = {} if light.kind == "sun" else {"falloff_type": "Quadratic"}
    return {"color": _vector(color), "intensity": f"{brightest / math.pi:.9g}", **falloff}


def _cone(light: RigLight) -> dict[str, str]:
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


def _label(light: RigLight, node_name: str) -> str:
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
