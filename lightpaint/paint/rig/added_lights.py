"""Lights that a session adds to its scene: their values, and their place by a click."""

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Position
from lightpaint.basis import BasisLight
from lightpaint.errors import PaintError, SceneError
from lightpaint.paint.rig.page_geometry import FirstHit, FreeLength
from lightpaint.placement import PanelSite
from lightpaint.scene import PLUGIN_OF, PLUGINS, NewEmitter, Pose
from lightpaint.scene.properties.site import Site

#: Keys of a pose, and further keys of added lights.
POSE_KEYS, LIGHT_KEYS = ("position", "target", "cutoff", "beam"), ("kind", "size", "emission")

#: Distance of a light from its mounting surface, and side of a panel, relative to the diagonal of
#: the visible scene; and the largest part of the way to the next surface.
CLEARANCE, PANEL_SIDE, BEFORE_NEXT = 0.02, 0.08, 0.5

#: Cone of a spot that is hung by hand, in degrees.
CUTOFF, BEAM = 30.0, 20.0

#: Luminance of a new light in the picture, relative to the current look.
FIRST_SHARE = 0.25


def new_emitter(name: str, values: Mapping[str, Any]) -> NewEmitter:
    """Return an added light at its place. Raises PaintError for invalid values."""
    if unknown := [key for key in values if key not in (*POSE_KEYS, *LIGHT_KEYS)]:
        raise PaintError(f"{name}: a new light has no {unknown[0]!r}")
    pose = {key: values[key] for key in POSE_KEYS if key in values}
    kind, size = values.get("kind"), values.get("size")
    if kind != "spot" and ("cutoff" in pose or "beam" in pose):
        raise PaintError(f"{name} is a {kind}: it has no cone")
    if kind == "point" and "target" in pose:
        raise PaintError(f"{name} shines all around: it points nowhere")
    try:
        return NewEmitter(
            name,
            kind,  # type: ignore[arg-type]
            Pose(**pose),
            None if size is None else tuple(size),
            values.get("emission", (1.0, 1.0, 1.0)),
        )
    except (SceneError, TypeError) as error:
        raise PaintError(f"{name}: ", error) from None


def values_of(emitter: NewEmitter) -> dict[str, Any]:
    """Return a new light in the form of a session's requests."""
    site = emitter.site
    values: dict[str, Any] = {"kind": emitter.kind, "position": listed(emitter.pose.position)}
    if emitter.pose.target is not None:
        values["target"] = listed(emitter.pose.target)
    if site.cutoff is not None:
        values |= {"cutoff": site.cutoff, "beam": site.beam}
    if emitter.size is not None:
        values["size"] = list(emitter.size)
    return {**values, "emission": [float(x) for x in emitter.emission]}


def site_of_new(emitter: NewEmitter) -> Site:
    """Return the site of a new light, with its shape for frozen paths."""
    site = emitter.site
    if emitter.size is None:
        return site
    side = math.sqrt(emitter.size[0] * emitter.size[1])
    return PanelSite(site.position, site.direction, side=side)


def light_of_new(emitter: NewEmitter) -> BasisLight:
    """Return a new light in the form of a basis."""
    parameter, unit = PLUGINS[PLUGIN_OF[emitter.kind]]
    x, y, z = emitter.pose.position or (0.0, 0.0, 0.0)
    form = f"at ({x:.2f}, {y:.2f}, {z:.2f})"
    return BasisLight(emitter.name, emitter.plugin, parameter, unit, emitter.emission, form)


def free_name(kind: str, taken: Collection[str]) -> str:
    """Return an unused name for a new light of a kind, like `spot_1`."""
    return next(x for k in range(1, len(taken) + 2) if (x := f"{kind}_{k}") not in taken)


def hung_before(
    name: str, kind: str, hit: FirstHit, extent: float, free_length: FreeLength
) -> NewEmitter:
    """Return a new light that hangs a little before a surface and points away from it.

    extent: diagonal of the visible scene.
    """
    nudge = 1e-4 * extent
    room = nudge + free_length(hit.point + nudge * hit.normal, hit.normal)
    clearance = min(CLEARANCE * extent, BEFORE_NEXT * room)
    return hung_at(name, kind, hit.point + clearance * hit.normal, hit.normal, extent)


def hung_at(name: str, kind: str, place: Doubles, direction: Doubles, extent: float) -> NewEmitter:
    """Return a new light at a place, which points in a direction."""
    values: dict[str, Any] = {"kind": kind, "position": listed(place)}
    if kind != "point":
        values["target"] = listed(place + 0.25 * extent * direction)
    if kind == "spot":
        values |= {"cutoff": CUTOFF, "beam": BEAM}
    if kind == "panel":
        values["size"] = [float(f"{PANEL_SIDE * extent:.3g}")] * 2
    return new_emitter(name, values)


def with_level(emitter: NewEmitter, alone: float, current: float) -> NewEmitter:
    """Return a new light bright enough to be visible beside the others.

    alone: mean luminance of the picture with it alone at unit emission. current: the same of the
    current look.
    """
    level = FIRST_SHARE * current / alone if alone > 0 and current > 0 else 1.0
    level = float(f"{level:.2g}")
    emission: RGB = (level, level, level)
    return replace(emitter, emission=emission)


def listed(point: Doubles | Position | None) -> list[float]:
    """Return a point as JSON has it, without the noise of single precision."""
    return [float(f"{x:.6g}") for x in np.asarray(point, dtype=float)]
