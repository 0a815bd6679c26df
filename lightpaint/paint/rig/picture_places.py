"""Places of lights that a client marks in a picture: the pose or the new light that they imply."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from lightpaint.errors import PaintError, SceneError
from lightpaint.paint.protocol import AddLight, PointLight
from lightpaint.paint.rig.added_lights import hung_at, hung_before
from lightpaint.paint.rig.cameras import (
    FirstHit,
    camera_of,
    first_hit,
    free_length,
    in_this_thread,
    up_axis,
)
from lightpaint.paint.rig.lamp_rig import LampRig, RigView
from lightpaint.paint.rig.pointing import aimed, with_highlight, with_shadow
from lightpaint.scene.lights.new_emitter import NewEmitter
from lightpaint.scene.properties.pose import Pose


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
            return aimed(name, site, hit)
        if request.mode == "highlight":
            return with_highlight(name, site, hit, length)
        if request.edge is None:
            raise PaintError("a shadow needs two places: the edge that casts it, and where it ends")
        return with_shadow(name, site, _visible_surface(view, request.edge), hit, length)


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
        raise PaintError(f"{name}: {error}") from None
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
