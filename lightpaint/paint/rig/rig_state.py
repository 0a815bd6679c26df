"""The message with the places of all lights and the cameras of the views."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.paint.protocol import LightPlace, Place, Rig
from lightpaint.paint.rig.cameras import free_length, in_this_thread, up_axis
from lightpaint.paint.rig.lamp_rig import LampRig, pose_key
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.scene.properties.pose import Site

#: Number of places that are kept, which grows with each step of a drag.
MAX_KNOWN = 1024


def rig_state(rig: LampRig, placed: Placed) -> Rig:
    """Return the places of all lights, for pages. The rig is open."""
    names = (*(light.name for light in rig.scene.lights), *added_names(placed))
    places = tuple(_known_place(rig, name, placed.get(name, {})) for name in names)
    cameras = rig.cameras
    hung = [np.array(place.position) for place in places if place.position is not None]
    low, high = rig.bounds or (np.zeros(3), np.ones(3))
    low, high = np.min([low, *hung], axis=0), np.max([high, *hung], axis=0)
    return Rig(
        lights=places,
        cameras=cameras,
        up=up_axis(cameras),
        low=tuple(map(float, low)),
        high=tuple(map(float, high)),
        surfaces=rig.surfaces,
        objects=rig.plan_objects,
        skies=rig.skies,
    )


def _known_place(rig: LampRig, name: str, values: Mapping[str, Any]) -> LightPlace:
    """Return the place of a light, which is found once for each pose: its target takes a ray."""
    key = pose_key(name, values)
    if key not in rig.known_places:
        if len(rig.known_places) >= MAX_KNOWN:
            rig.known_places.clear()
        with in_this_thread():
            rig.known_places[key] = _place(rig, name, values)
    return rig.known_places[key]


def _place(rig: LampRig, name: str, values: Mapping[str, Any]) -> LightPlace:
    reason = rig.why_not(name, values)
    if not reason:
        site = rig.site(name, values)
    else:
        members = rig.scene.light(name).members
        site = members[0].site if len(members) == 1 else Site()
    target = values.get("target") or _target(rig, site)
    return LightPlace(
        position=site.position,
        direction=site.direction,
        target=None if target is None else tuple(map(float, target)),
        cutoff=site.cutoff,
        beam=site.beam,
        rail=_rail(rig, name, site),
        immovable_reason=reason,
    )


def _rail(rig: LampRig, name: str, site: Site) -> tuple[Place, Place] | None:
    """Return the ends of the rail that a light hangs on, of those in the lights file."""
    freedom = rig.freedoms.get(name)
    if freedom is None or not freedom.all_rails or site.position is None:
        return None
    position = np.array(site.position)
    return min(freedom.all_rails, key=lambda rail: _distance_to(position, rail))


def _target(rig: LampRig, site: Site) -> Doubles | None:
    """Return the point of the first surface along a light's axis."""
    if site.position is None or site.direction is None:
        return None
    place, way = np.array(site.position), np.array(site.direction)
    length = free_length(rig.view(0).loaded, place + 1e-3 * way, way)
    low, high = rig.bounds or (np.zeros(3), np.ones(3))
    return np.asarray(place + min(length, float(np.linalg.norm(high - low))) * way)


def _distance_to(point: Doubles, rail: tuple[Place, Place]) -> float:
    """Return the distance of a point from a rail."""
    start, end = (np.array(x) for x in rail)
    share = (point - start) @ (end - start) / ((end - start) @ (end - start))
    return float(np.linalg.norm(point - start - np.clip(share, 0, 1) * (end - start)))
