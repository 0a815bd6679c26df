"""Pan and tilt with which the heads of a rig point where lights of an answer do."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.dmx.console_rig import ConsoleRig, RigAxis, RigFixture, RigHead
from lightpaint.lighting import Lighting
from lightpaint.scene.properties.site import unit

#: Degrees by which a beam may miss unnoticed: several levels of 16 bits, and less than is seen.
UNNOTICED = 0.1

#: Degrees by which an angle may lie beyond its range, for the rounding of its computation.
ROUNDING = 1e-9

#: Degrees between two directions of which neither is closer.
EQUALLY_CLOSE = 1e-4


def directions_of(lighting: Lighting) -> dict[str, Position]:
    """Return where lights of a lighting point, by name; only of those that point somewhere."""
    return {x.name: x.direction for x in lighting.places if x.direction is not None}


def aimed_rig(
    rig: ConsoleRig, directions: Mapping[str, Position]
) -> tuple[ConsoleRig, tuple[str, ...]]:
    """Return the rig with pan and tilt at rest where its lights point, and a remark for each
    fixture that cannot.

    Of all angles for a direction those are taken that are least away from where the axes rested.

    directions: by name of light, in the scene; lights without one point as in the show.
    """
    fixtures, remarks = [], []
    for fixture in rig.fixtures:
        wanted = {x.name: directions.get(x.name, x.direction) for x in fixture.lights}
        aimed, remark = _aimed(fixture, wanted)
        fixtures.append(aimed)
        remarks += [remark] * bool(remark)
    return ConsoleRig(rig.name, tuple(fixtures)), tuple(remarks)


def _aimed(fixture: RigFixture, wanted: Mapping[str, Position]) -> tuple[RigFixture, str]:
    """Return a fixture whose heads rest in directions, by light, and a remark or ""."""
    channels, known = list(fixture.channels), dict[int, float]()
    missed: list[tuple[float, str]] = []
    for head in fixture.heads:
        rest = [axis.degrees_at(channels[axis.channel].default) for axis in head.axes]
        direction = np.sum([unit(wanted[name]) for name in head.lights], axis=0)
        if not np.linalg.norm(direction) > 0:
            continue
        axes = [
            replace(x, degrees=(known[x.channel],) * 2) if x.channel in known else x
            for x in head.axes
        ]
        angles = angles_for(replace(head, axes=tuple(axes)), direction, rest)
        for axis, degrees in zip(head.axes, angles, strict=True):
            if axis.channel not in known:
                level = axis.level_of(degrees)
                channels[axis.channel] = replace(channels[axis.channel], default=level)
                known[axis.channel] = degrees
        off = _degrees_between(turned(head, angles), direction)
        ranges = " and ".join(
            f"{x.name} goes from {min(x.degrees):g}° to {max(x.degrees):g}°" for x in head.axes
        )
        missed += [(off, f"{head.lights[0]!r} cannot point where its light does: its {ranges}")]
    aimed = replace(fixture, channels=tuple(channels), is_aimed=bool(fixture.heads))
    off, reason = max(missed, default=(0.0, ""))
    if off > UNNOTICED:
        return aimed, f"{reason}, so it misses by {off:.3g}°"
    on_heads = {name for head in fixture.heads for name in head.lights}
    fixed = [x for x in fixture.lights if x.name not in on_heads and fixture.channels]
    off = max((_degrees_between(np.array(x.direction), wanted[x.name]) for x in fixed), default=0.0)
    if off > UNNOTICED:
        return aimed, f"{fixed[0].name!r} has no pan and tilt: turn it by {off:.3g}° by hand"
    return aimed, ""


def turned(head: RigHead, angles: Sequence[float]) -> Doubles:
    """Return the direction of a head's beams, (3,), at angles of its axes in degrees."""
    direction = np.array(head.direction)
    # The outer axis turns what the inner one has turned.
    for axis, degrees in reversed([*zip(head.axes, angles, strict=True)]):
        direction = _rotated(direction, np.array(axis.axis), degrees)
    return direction


def angles_for(
    head: RigHead, direction: Sequence[float] | Doubles, rest: Sequence[float]
) -> tuple[float, ...]:
    """Return angles in degrees, within their ranges, that turn a head closest to a direction.

    Of all that come equally close, the ones that are least away from the angles at rest.
    """
    wanted = np.array(unit(direction))
    found = {
        angles: _degrees_between(turned(head, angles), wanted)
        for angles in _candidates(head, wanted, rest)
    }
    closest = min(found.values())
    near = [x for x, off in found.items() if off <= closest + EQUALLY_CLOSE]
    return min(near, key=lambda x: sum(abs(a - b) for a, b in zip(x, rest, strict=True)))


def _candidates(
    head: RigHead, wanted: Doubles, rest: Sequence[float]
) -> Iterator[tuple[float, ...]]:
    """Yield angles among which are the best ones."""
    beam = np.array(head.direction)
    if len(head.axes) == 1:
        [axis], [own_rest] = head.axes, rest
        for degrees in _within(axis, _angle_towards(beam, wanted, axis, own_rest), own_rest):
            yield (degrees,)
        return
    outer, inner = head.axes
    inner_angles = {x for b in _inner_angles(head, wanted) for x in _within(inner, b, rest[1])}
    # What the outer axis cannot reach may be closest with the inner one elsewhere, and conversely.
    for degrees in inner_angles.union(inner.degrees, [rest[1]]):
        leant = _rotated(beam, np.array(inner.axis), degrees)
        towards = _angle_towards(leant, wanted, outer, rest[0])
        yield from product(_within(outer, towards, rest[0]), [degrees])
    for degrees in outer.degrees:
        seen = _rotated(wanted, np.array(outer.axis), -degrees)
        towards = _angle_towards(beam, seen, inner, rest[1])
        yield from product([degrees], _within(inner, towards, rest[1]))


def _inner_angles(head: RigHead, wanted: Doubles) -> list[float]:
    """Return the two angles of the inner axis v at which a turn about the outer one, u, can bring
    the beam e to the direction d.

    Only the turn about v changes how far a beam is along u, so that β solves

      u · R_v(β) e = u · d,  which is  A cos β + B sin β = C
    """
    u, v = (np.array(x.axis) for x in head.axes)
    beam = np.array(head.direction)
    along = (v @ beam) * v
    a, b = u @ (beam - along), u @ np.cross(v, beam)
    c = u @ (wanted - along)
    size = math.hypot(a, b)
    if size < 1e-9:
        return []
    middle, half = math.atan2(b, a), math.acos(min(max(c / size, -1.0), 1.0))
    return [math.degrees(middle - half), math.degrees(middle + half)]


def _angle_towards(beam: Doubles, wanted: Doubles, axis: RigAxis, rest: float) -> float:
    """Return the angle in degrees by which a beam turns about an axis closest to a direction; that
    at rest if all are equally close.
    """
    u = np.array(axis.axis)
    own, other = beam - (u @ beam) * u, wanted - (u @ wanted) * u
    if min(np.linalg.norm(own), np.linalg.norm(other)) < 1e-9:
        return rest
    return math.degrees(math.atan2(u @ np.cross(own, other), own @ other))


def _within(axis: RigAxis, degrees: float, rest: float) -> list[float]:
    """Return the equal angle in an axis's range that is nearest to that at rest, or the ends of the
    range.
    """
    low, high = sorted(axis.degrees)
    first = low + (degrees - low + ROUNDING) % 360 - ROUNDING
    turns = np.arange(first, high + ROUNDING, 360).tolist()
    return [min(turns, key=lambda x: abs(x - rest))] if turns else [low, high]


def _rotated(vector: Doubles, axis: Doubles, degrees: float) -> Doubles:
    """Return a vector turned about an axis, right-handed (Rodrigues)."""
    angle = math.radians(degrees)
    along = (axis @ vector) * axis
    across = math.cos(angle) * (vector - along) + math.sin(angle) * np.cross(axis, vector)
    return np.asarray(along + across)


def _degrees_between(a: Doubles, b: Sequence[float] | Doubles) -> float:
    u, v = np.array(unit(a)), np.array(unit(b))
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(u, v))), float(u @ v)))
