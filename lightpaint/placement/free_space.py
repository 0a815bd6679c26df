"""Places where a light could stand and shine on surfaces that the camera sees.

Light that reaches a visible point in a straight line comes from between that point and the next
surface. So rays go from the camera to surfaces, and from there into the half space before them, and
places are chosen along these: inside a room, out through its windows, behind the camera. Of many
such places, a few distant ones are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.scene import Scene, Stream, pass_seed

#: Points of the picture from which the search starts, and rays from each.
POINTS, RAYS = 600, 24

#: Length of a ray that hits nothing, and the distance at which points are too far to count,
#: relative to the spread of visible points.
REACH, FAR = 2.0, 12.0

#: Distance from all surfaces, relative to the spread of visible points, and tested directions.
CLEARANCE, AROUND = 0.03, 26

#: Visible points that each place is tested with, and the share of them that it has to see.
ASKED, LEAST_SEEN = 64, 0.05


@dataclass(frozen=True)
class FreeSpace:
    """Places with a free view of visible points.

    places: (k, 3), units of the scene. spread: median distance of visible points from their centre,
    the unit of distances. points, normals: (m, 3), some visible ones, with the normals of their
    visible sides.
    """

    places: Floats
    spread: float
    points: Floats
    normals: Floats

    @classmethod
    def none(cls) -> "FreeSpace":
        """Return the free space of a camera that sees nothing."""
        nothing = np.zeros((0, 3))
        return cls(nothing, 0.0, nothing, nothing)

    @classmethod
    def of_views(cls, spaces: Sequence["FreeSpace"]) -> "FreeSpace":
        """Join the free space of several views."""
        seen = [space for space in spaces if len(space.points)] or list(spaces)
        return cls(
            np.concatenate([space.places for space in seen]),
            float(np.mean([space.spread for space in seen])),
            np.concatenate([space.points for space in seen]),
            np.concatenate([space.normals for space in seen]),
        )

    def usable(self, loaded: Any, places: Floats, clear: float | None = None) -> Bools:
        """Return which places, (k,), are clear of surfaces and see something of the picture.

        clear: the distance from surfaces; None for CLEARANCE.
        """
        distance = CLEARANCE * self.spread if clear is None else clear
        if not len(places) or not len(self.points):
            return np.zeros(len(places), dtype=bool)
        clears = is_clear(loaded, places, distance)
        share = _seen_share(loaded, places, self.points, self.normals)
        return np.asarray(clears & (share >= LEAST_SEEN))


def free_space(scene: Scene, loaded: Any, *, seed: int = 0) -> FreeSpace:
    """Search for places in `loaded`, the loaded `scene`. There are none if rays hit nothing."""
    rng = np.random.default_rng(pass_seed(seed, Stream.CANDIDATES, 0))
    points, normals = _visible(scene, loaded, rng)
    if not len(points):
        return FreeSpace.none()
    middle = np.median(points, axis=0)
    away = np.linalg.norm(points - middle, axis=1)
    spread = float(np.median(away))
    if not spread > 0:
        return FreeSpace.none()
    near = away <= FAR * spread
    # The normal first: straight up from a floor, straight out of a wall.
    origin = np.repeat(points[near], RAYS, axis=0)
    normal = np.repeat(normals[near], RAYS, axis=0)
    direction = _unit(rng.normal(size=origin.shape))
    direction *= np.where((direction * normal).sum(axis=1, keepdims=True) < 0, -1, 1)
    direction[::RAYS] = normal[::RAYS]
    length = np.minimum(_distance(loaded, origin, direction, normal), REACH * spread)
    places = origin + (rng.uniform(0.05, 0.95, len(origin)) * length)[:, None] * direction
    places = rng.permutation(places)
    places = places[is_clear(loaded, places, CLEARANCE * spread)]
    chosen = rng.permutation(np.flatnonzero(near))[:ASKED]
    origins, fronts = points[chosen], normals[chosen]
    is_seen = _seen_share(loaded, places, origins, fronts) >= LEAST_SEEN
    return FreeSpace(places[is_seen], spread, origins, fronts)


def far_apart(places: Floats, count: int, *, start: Floats | None = None) -> Floats:
    """Choose at most `count` of `places` (k, 3), each as far as possible from those before it.

    start: (m, 3), places chosen before.
    """
    if not len(places):
        return places
    chosen: list[int] = []
    if start is None or not len(start):
        # Start with the one nearest to the centre.
        start = np.median(places, axis=0, keepdims=True)
        chosen = [int(np.argmin(np.linalg.norm(places - start, axis=1)))]
        start = places[chosen]
    distance = np.linalg.norm(places[:, None] - start[None], axis=2).min(axis=1)
    while len(chosen) < min(count, len(places)):
        k = int(np.argmax(distance))
        if distance[k] <= 0:
            break
        chosen.append(k)
        distance = np.minimum(distance, np.linalg.norm(places - places[k], axis=1))
    return places[chosen]


def pixels_of(scene: Scene, loaded: Any, places: Floats) -> list[tuple[float, float] | None]:
    """Return the place of each of `places` in the picture, from (0, 0) top left to (1, 1); None
    outside.

    Also None for cameras that cannot tell, like orthographic ones.
    """
    import drjit as dr
    import mitsuba as mi

    camera = scene.camera(loaded)
    at = dr.zeros(mi.Interaction3f, len(places))
    at.p = mi.Point3f(places.T.astype(np.float32))
    try:
        seen, _ = camera.sample_direction(at, mi.Point2f(0.5))
    except RuntimeError:
        return [None] * len(places)
    inside = np.broadcast_to(np.array(seen.pdf) > 0, len(places))
    uv = np.array(seen.uv).reshape(2, -1).T / np.array(camera.film().crop_size())
    return [
        (float(x), float(y)) if ok and 0 <= x <= 1 and 0 <= y <= 1 else None
        for (x, y), ok in zip(uv, inside, strict=True)
    ]


def seen_by_camera(scene: Scene, loaded: Any, places: Floats) -> Bools:
    """Return which places, (k,), the camera sees: in its picture, and unoccluded."""
    import mitsuba as mi

    at = [k is not None for k in pixels_of(scene, loaded, places)]
    eye = np.array(scene.eye(loaded), dtype=float).ravel()
    way = 0.999 * (places - eye)
    start = mi.Point3f(np.repeat(eye[None], len(places), axis=0).T.astype(np.float32))
    ray = mi.Ray3f(start, mi.Vector3f(way.T.astype(np.float32)))
    ray.maxt = 1.0
    return np.asarray(np.array(at) & ~np.array(loaded.ray_test(ray)))


def _visible(scene: Scene, loaded: Any, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return points that the camera sees, (k, 3), and their normals towards it, (k, 3)."""
    import drjit as dr
    import mitsuba as mi

    height, width = scene.size
    rows = max(1, round(np.sqrt(POINTS * height / width)))
    columns = max(1, POINTS // rows)
    y, x = np.mgrid[:rows, :columns]
    cells = np.stack([x.ravel(), y.ravel()]) + rng.random((2, rows * columns))
    position = mi.Point2f((cells / [[columns], [rows]]).astype(np.float32))
    camera = scene.camera(loaded)
    ray, _ = camera.sample_ray(camera.shutter_open(), 0.5, position, mi.Point2f(0.5))
    si = loaded.ray_intersect(ray)
    normal = np.array(si.n * -dr.sign(dr.dot(si.n, ray.d))).T
    valid = np.array(si.is_valid())
    return np.array(si.p).T[valid].astype(np.float64), normal[valid].astype(np.float64)


def _distance(loaded: Any, origin: Floats, direction: Floats, normal: Floats) -> Floats:
    """Return the distance from surface points to the next surface; inf for none. All (k, 3)."""
    import drjit as dr
    import mitsuba as mi

    start = dr.zeros(mi.SurfaceInteraction3f, len(origin))
    start.p = mi.Point3f(origin.T.astype(np.float32))
    start.n = mi.Normal3f(normal.T.astype(np.float32))
    ray = start.spawn_ray(mi.Vector3f(direction.T.astype(np.float32)))
    return np.array(loaded.ray_intersect_preliminary(ray).t, dtype=np.float64)


def is_clear(loaded: Any, places: Floats, distance: float) -> Bools:
    """Return whether places have no surface within `distance`, in some directions, (k,)."""
    import mitsuba as mi

    # Points of a spiral on the sphere, which cover it evenly.
    k = np.arange(AROUND) + 0.5
    z, angle = 1 - 2 * k / AROUND, np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    ring_directions = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    start = np.repeat(places, AROUND, axis=0)
    towards = np.tile(ring_directions, (len(places), 1))
    ray = mi.Ray3f(
        mi.Point3f(start.T.astype(np.float32)), mi.Vector3f(towards.T.astype(np.float32))
    )
    ray.maxt = distance
    hits = np.array(loaded.ray_test(ray)).reshape(len(places), AROUND)
    return np.asarray(~hits.any(axis=1))


def _seen_share(loaded: Any, places: Floats, points: Floats, normals: Floats) -> Floats:
    """Return the share of `points` (m, 3) whose front each place sees, (k,)."""
    import mitsuba as mi

    start = np.repeat(places, len(points), axis=0)
    # Stop short of the surface, so that it does not occlude itself.
    way = 0.999 * (np.tile(points, (len(places), 1)) - start)
    ray = mi.Ray3f(mi.Point3f(start.T.astype(np.float32)), mi.Vector3f(way.T.astype(np.float32)))
    ray.maxt = 1.0
    hidden = np.array(loaded.ray_test(ray)).reshape(len(places), len(points))
    hidden |= (way * np.tile(normals, (len(places), 1))).sum(axis=1).reshape(hidden.shape) >= 0
    return np.asarray(1 - hidden.mean(axis=1))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
