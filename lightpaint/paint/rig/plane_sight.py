"""Measuring planes as pictures show them: the camera of a view, and the points that it sees."""

from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.paint.protocol import Camera
from lightpaint.paint.rig.page_geometry import camera_of
from lightpaint.paint.session.session_planes import PlaneSight
from lightpaint.scene.scene import Scene

#: Clear surfaces that a ray passes at most, such as panes of glass.
MAX_PASSED = 16
#: Part of the distance to a point within which a surface counts as the one that it lies on.
TOUCHING_SHARE = 1e-3


def plane_sight(scene: Scene, points: Doubles) -> PlaneSight:
    """Return how the picture of a scene shows points (p, 3). The scene is loaded for that."""

    def look(loaded: Any) -> PlaneSight:
        camera = camera_of(scene, loaded)
        if camera is None:
            return PlaneSight(None, np.zeros(len(points), bool))
        return PlaneSight(camera, seen_points(loaded, camera, points))

    return scene.while_loaded(look)


def seen_points(loaded: Any, camera: Camera, points: Doubles) -> Bools:
    """Return which points (p, 3) nothing covers in the picture of a camera, (p,).

    They may lie beyond its edges. Clear surfaces, such as glass, cover nothing.
    """
    import mitsuba as mi

    ways = _ways_to(camera, points)
    starts, lengths = points - ways, np.linalg.norm(ways, axis=1)
    directions = ways / np.maximum(lengths, 1e-30)[:, None]
    left = lengths * (1 - TOUCHING_SHARE)
    is_seen, is_open = np.ones(len(points), bool), lengths > 0
    for _ in range(MAX_PASSED):
        rays = np.flatnonzero(is_open)
        if not rays.size:
            break
        ray = mi.Ray3f(mi.Point3f(starts[rays].T), mi.Vector3f(directions[rays].T))
        si = loaded.ray_intersect(mi.Ray3f(ray, mi.Float(left[rays])))
        is_hit = np.array(si.is_valid()).ravel()
        flags, kinds = si.bsdf().flags(), (mi.BSDFFlags.Null, mi.BSDFFlags.DeltaTransmission)
        is_clear = np.any([np.array(mi.has_flag(flags, kind)).ravel() for kind in kinds], axis=0)
        is_seen[rays], is_open[rays] = ~is_hit | is_clear, is_hit & is_clear
        # Behind a clear surface the ray goes on.
        passed = np.where(is_hit, np.array(si.t, float).ravel(), 0) + TOUCHING_SHARE * lengths[rays]
        starts[rays] += passed[:, None] * directions[rays]
        left[rays] -= passed
        is_open &= left > 0
    return is_seen


def _ways_to(camera: Camera, points: Doubles) -> Doubles:
    """Return the vectors from where rays begin to the points that they reach, (p, 3)."""
    offsets: Doubles = points - np.array(camera.origin)
    if not camera.is_parallel:
        return offsets
    forward = np.array(camera.forward) / np.linalg.norm(camera.forward)
    return np.asarray(np.outer(offsets @ forward, forward))
