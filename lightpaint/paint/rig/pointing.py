"""Places of lights that a client marks in a picture: the pose or the new light that they imply.

Closed forms give the pose of a light whose beam, highlight or shadow should fall on a point.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import PaintError, SceneError
from lightpaint.paint.protocol import AddLight, PointLight
from lightpaint.paint.rig.added_lights import hung_at, hung_before
from lightpaint.paint.rig.lamp_rig import LampRig, RigView
from lightpaint.paint.rig.page_geometry import (
    FirstHit,
    FreeLength,
    camera_of,
    first_hit,
    free_length,
    in_this_thread,
    up_axis,
)
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.properties.pose import Pose, Site

#: Largest distance of a light, as a part of the way to the next surface; and least distance of that
#: surface, relative to the light's distance from its target, for a light to fit.
BEFORE_WALL, LEAST_ROOM = 0.9, 0.05

#: Least distance of a light beyond the edge that casts its shadow, relative to its distance from
#: the shadow.
BEYOND_EDGE = 0.3

PoseChange = dict[str, Any]


def _aimed(name: str, site: Site, hit: FirstHit) -> PoseChange:
    """Return the change that points a light at a visible point. Raises PaintError if none does."""
    if site.direction is None:
        raise PaintError(f"{name} shines all around: it cannot be aimed")
    if site.position is None:
        raise PaintError(f"{name} is infinitely far away: choose where its shadow ends instead")
    return {"target": _listed(hit.point)}


def _with_highlight(name: str, site: Site, hit: FirstHit, free_length: FreeLength) -> PoseChange:
    """Return the change that puts a light's reflection at `hit`, on the mirrored ray of the eye.

    The light keeps its distance from there, if there is room.
    """
    ahead = _unit(hit.point - hit.eye)
    mirrored = _unit(ahead - 2 * (ahead @ hit.normal) * hit.normal)
    if mirrored @ hit.normal <= 0:
        raise PaintError("the surface is seen from behind there: choose another place")
    return _hung(name, site, hit.point, hit.point, mirrored, free_length)


def _with_shadow(
    name: str, site: Site, edge: FirstHit, hit: FirstHit, free_length: FreeLength
) -> PoseChange:
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
) -> PoseChange:
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
    pose: PoseChange = {"position": _listed(place)}
    if site.direction is not None:
        pose["target"] = _listed(lit)
    return pose


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-30))


def _listed(point: Doubles) -> list[float]:
    """Return a point as JSON has it, without the noise of single precision."""
    return [float(f"{x:.6g}") for x in point]


def pose_change(
    rig: LampRig, request: PointLight, name: str, values: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the change of a light's pose that a pointing request implies. The rig is open.

    values: the light's current pose or, for an added light, all its properties. Raises
    LightpaintError for a light that cannot move, or for a place that it cannot reach.
    """
    with in_this_thread():
        site, view = rig.site(name, values), rig.view(request.view)
        hit, length = _visible_surface(view, request.pixel), partial(free_length, view.loaded)
        if request.mode == "aim":
            return _aimed(name, site, hit)
        if request.mode == "highlight":
            return _with_highlight(name, site, hit, length)
        if request.edge is None:
            raise PaintError("a shadow needs two places: the edge that casts it, and where it ends")
        return _with_shadow(name, site, _visible_surface(view, request.edge), hit, length)


def emitter_at_place(rig: LampRig, request: AddLight, name: str) -> NewEmitter:
    """Return a new light at the place that a request marks. The rig is open.

    Its emission is set later. Raises PaintError if no light can hang there.
    """
    if rig.scene.has_media:
        raise PaintError("no light can be added to a scene with fog or the like")
    view = rig.view(request.view)
    if request.position is not None:
        return _emitter_at_position(view, request, name, rig.extent)
    if request.pixel is None:
        raise PaintError("a new light needs a place: click on a surface, or in the plan")
    with in_this_thread():
        hit, length = _visible_surface(view, request.pixel), partial(free_length, view.loaded)
        return hung_before(name, request.type, hit, rig.extent, length)


def _emitter_at_position(view: RigView, request: AddLight, name: str, extent: float) -> NewEmitter:
    """Return a new light at a point of space, such as a point of the plan; it points down."""
    down = np.zeros(3)
    down[up_axis([camera_of(view.scene, view.loaded)])] = -1.0
    try:
        place = Pose(position=request.position).position  # type: ignore[arg-type]
    except SceneError as error:
        raise PaintError(f"{name}: ", error) from None
    return hung_at(name, request.type, np.array(place), down, extent)


def _visible_surface(view: RigView, pixel: tuple[float, float]) -> FirstHit:
    """Return the surface that a pixel (column, row) sees. Raises PaintError if it sees none."""
    height, width = view.scene.size
    if not (0 <= pixel[0] < width and 0 <= pixel[1] < height):
        column, row = (f"{x:.0f}" for x in pixel)
        raise PaintError(
            f"({column}, {row}) is outside the picture, {width}x{height} pixels: click inside it"
        )
    hit = first_hit(view.scene, view.loaded, pixel)
    if hit is None:
        raise PaintError("nothing is seen there: click on a surface")
    return hit
