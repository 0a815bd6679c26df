"""Closed forms for the pose of a light whose beam, highlight or shadow should fall on a point."""

from collections.abc import Callable
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import PaintError
from lightpaint.paint.rig.cameras import FirstHit
from lightpaint.scene.properties.pose import Site

#: Largest distance of a light, as a part of the way to the next surface; and least distance of that
#: surface, relative to the light's distance from its target, for a light to fit.
BEFORE_WALL, LEAST_ROOM = 0.9, 0.05

#: Least distance of a light beyond the edge that casts its shadow, relative to its distance from
#: the shadow.
BEYOND_EDGE = 0.3

#: Returns the distance from a point to the first surface in a direction.
FreeLength = Callable[[Doubles, Doubles], float]

Pose = dict[str, Any]


def aimed(name: str, site: Site, hit: FirstHit) -> Pose:
    """Return the change that points a light at a visible point. Raises PaintError if none does."""
    if site.direction is None:
        raise PaintError(f"{name} shines all around: it cannot be aimed")
    if site.position is None:
        raise PaintError(f"{name} is infinitely far away: choose where its shadow ends instead")
    return {"target": _listed(hit.point)}


def with_highlight(name: str, site: Site, hit: FirstHit, free_length: FreeLength) -> Pose:
    """Return the change that puts a light's reflection at `hit`, on the mirrored ray of the eye.

    The light keeps its distance from there, if there is room.
    """
    ahead = _unit(hit.point - hit.eye)
    mirrored = _unit(ahead - 2 * (ahead @ hit.normal) * hit.normal)
    if mirrored @ hit.normal <= 0:
        raise PaintError("the surface is seen from behind there: choose another place")
    return _hung(name, site, hit.point, hit.point, mirrored, free_length)


def with_shadow(
    name: str, site: Site, edge: FirstHit, hit: FirstHit, free_length: FreeLength
) -> Pose:
    """Return the change that puts the shadow of `edge` at `hit`, on the line through both."""
    between = edge.point - hit.point
    if not np.linalg.norm(between) > 0:
        raise PaintError("the shadow and what casts it are one place: choose two places")
    if between @ hit.normal <= 0:
        raise PaintError(
            "what casts the shadow is behind the surface: choose another edge or place"
        )
    return _hung(name, site, hit.point, edge.point, _unit(between), free_length)


def _hung(
    name: str,
    site: Site,
    lit: Doubles,
    start: Doubles,
    way: Doubles,
    free_length: FreeLength,
) -> Pose:
    """Return the change that hangs a light on the line from `start`, and aims it at `lit`."""
    if site.position is None:
        if site.direction is None:
            raise PaintError(f"{name} has no place and no direction: it cannot be moved")
        return {"target": _listed(-way)}
    distance = float(np.linalg.norm(np.array(site.position) - lit))
    current_distance = float(np.linalg.norm(start - lit))
    distance_needed = max(distance - current_distance, BEYOND_EDGE * distance)
    nudge = 1e-3 * max(distance, current_distance)
    room = BEFORE_WALL * free_length(start + nudge * way, way)
    if room < LEAST_ROOM * distance:
        raise PaintError(f"there is no room for {name} on that line: choose another place")
    place = start + min(distance_needed, room) * way
    pose: Pose = {"position": _listed(place)}
    if site.direction is not None:
        pose["target"] = _listed(lit)
    return pose


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-30))


def _listed(point: Doubles) -> list[float]:
    """Return a point as JSON has it, without the noise of single precision."""
    return [float(f"{x:.6g}") for x in point]
