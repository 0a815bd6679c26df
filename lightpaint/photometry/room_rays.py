"""Rays in a loaded scene: which shapes they hit, whether points lie inside of solids; and places of
those who see glare: where a planes file has them, or at the camera.
"""

# mypy: disable-error-code="no-untyped-call"

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices, Position
from lightpaint.errors import SceneError
from lightpaint.photometry.glare import GlareObserver
from lightpaint.scene import Scene, names_by_shape

#: Directions in which a point looks around, and share of back sides among all from which on it is
#: inside of a solid.
DIRECTIONS, SOLID_SHARE = 64, 0.9
#: Surfaces that a ray passes at most on its way to a shape.
MAX_PASSED = 64
#: Length by which a ray continues behind a surface, as a share of the scene's size.
STEP_SHARE = 1e-6

#: Place of an observer who is where the camera is, and their name in files without any.
CAMERA = "camera"
#: Sensors that see as an eye does.
EYES = ("perspective", "thinlens")

#: Sine of the angle to the vertical below which a line of sight has no upper side.
UPRIGHT = 1e-3


@dataclass(frozen=True)
class RayHits:
    """The first hits of k rays.

    distance: (k,), infinite without a hit. shape: (k,), index of the shape, −1 without a hit.
    normal: (k, 3), geometric normal.
    """

    distance: Doubles
    shape: Indices
    normal: Doubles


class RoomRays:
    """A loaded scene in which rays are cast. up: its up axis. eye: the place of its camera."""

    def __init__(self, scene: Scene, loaded: Any) -> None:
        import drjit as dr
        import mitsuba as mi

        self._loaded = loaded
        shapes = loaded.shapes()
        self.names = names_by_shape(loaded, scene.shape_names)
        instances = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(x))[0]) for x in shapes]
        self._index_of = np.full(max(instances, default=0) + 1, -1)
        self._index_of[instances] = np.arange(len(instances))
        self.boxes = [np.array([x.bbox().min, x.bbox().max], float).reshape(2, 3) for x in shapes]
        every = np.array(self.boxes).reshape(-1, 2, 3)
        #: Lowest and highest corner of all shapes, (2, 3).
        self.bounds = (
            np.array([every[:, 0].min(axis=0), every[:, 1].max(axis=0)])
            if len(every)
            else np.zeros((2, 3))
        )
        self.size = float(np.linalg.norm(self.bounds[1] - self.bounds[0])) or 1.0
        self.up = np.array(scene.up)
        self.eye = np.array(scene.eye(loaded), float).ravel()
        # The shapes of which the eye sees the back sides.
        around = _directions(16 * DIRECTIONS)
        hits = self.first_hits(np.tile(self.eye, (len(around), 1)), around)
        is_behind = (hits.shape >= 0) & ((hits.normal * around).sum(axis=1) > 0)
        self._enclosing = np.unique(hits.shape[is_behind])

    def indices(self, name: str) -> list[int]:
        """Return the indices of the shapes with a name."""
        return [k for k, shape_name in enumerate(self.names) if shape_name == name]

    def box(self, shapes: Collection[int]) -> Doubles:
        """Return the lowest and the highest corner of shapes, (2, 3)."""
        boxes = np.array([self.boxes[k] for k in shapes])
        return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def first_hits(self, origins: Doubles, directions: Doubles) -> RayHits:
        """Return the first hits of rays. origins, directions: (k, 3)."""
        import drjit as dr
        import mitsuba as mi

        ray = mi.Ray3f(mi.Point3f(origins.T), mi.Vector3f(directions.T))
        si = self._loaded.ray_intersect(ray)
        pointer = dr.select(si.instance != None, si.instance, si.shape)  # noqa: E711 (arrays)
        number = np.array(dr.reinterpret_array(mi.UInt32, pointer)).ravel()
        is_hit = np.array(si.is_valid()).ravel()
        shape = np.where(is_hit, self._index_of[np.minimum(number, len(self._index_of) - 1)], -1)
        distance = np.where(is_hit, np.array(si.t, float).ravel(), np.inf)
        return RayHits(distance, shape, np.array(si.n, float).T.reshape(-1, 3))

    def hits_of(
        self, shapes: Collection[int], origins: Doubles, direction: Doubles
    ) -> tuple[Bools, Doubles, Doubles]:
        """Return which rays meet one of `shapes` face on, (k,), where, and its normals, (k, 3).

        Rays pass all other surfaces, and parts of `shapes` that are more than 60° from face on.
        origins: (k, 3). direction: (3,), a unit vector.
        """
        places, normals = origins.astype(float), np.zeros(origins.shape)
        is_hit, is_open = np.zeros(len(places), bool), np.ones(len(places), bool)
        for _ in range(MAX_PASSED):
            if not is_open.any():
                break
            rays = np.flatnonzero(is_open)
            hits = self.first_hits(places[rays], np.tile(direction, (rays.size, 1)))
            lands, normals[rays] = hits.shape >= 0, hits.normal
            is_wanted = np.isin(hits.shape, [*shapes]) & (np.abs(hits.normal @ direction) > 0.5)
            places[rays] += np.outer(np.where(lands, hits.distance, 0.0), direction)
            is_hit[rays], is_open[rays] = is_wanted, lands & ~is_wanted
            places[is_open] += STEP_SHARE * self.size * direction
        return is_hit, places, normals

    def are_inside_solids(self, points: Doubles, normals: Doubles) -> Bools:
        """Return the points, (k,), that see almost nothing but the back sides of surfaces.

        They look to the side of their normals, (k, 3). Surfaces that the camera, too, sees from
        behind are the surfaces of a room modelled as a box.
        """
        around = np.tile(_directions(DIRECTIONS), (len(points), 1))
        facing = np.repeat(normals, DIRECTIONS, axis=0)
        around *= np.where((around * facing).sum(axis=1) < 0, -1, 1)[:, None]
        hits = self.first_hits(np.repeat(points, DIRECTIONS, axis=0), around)
        is_behind = (hits.shape >= 0) & ((hits.normal * around).sum(axis=1) > 0)
        is_behind &= ~np.isin(hits.shape, self._enclosing)
        return np.asarray(is_behind.reshape(-1, DIRECTIONS).mean(axis=1) >= SOLID_SHARE)


def _directions(count: int) -> Doubles:
    """Return evenly spread unit vectors, (count, 3): a spiral of golden angles."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


@dataclass(frozen=True)
class ObserverRequest:
    """An observer as a planes file describes them.

    where: the key in the file, for errors. at, towards: (3,), the place of the eyes and a point
    that they look at; None for the points of the camera.
    """

    name: str
    where: str
    at: Doubles | None = None
    towards: Doubles | None = None


def place_observers(
    requests: Sequence[ObserverRequest], scene: Scene, loaded: Any, room: RoomRays
) -> tuple[GlareObserver, ...]:
    """Return the observers in a loaded scene; the camera, if it sees as an eye does, for none.

    room: rays in that scene. Raises SceneError for one who looks straight up or down or is inside
    of a solid, and for a camera that sees otherwise.
    """
    node = scene.parsed.state.nodes[scene.parsed.sensor_nodes[scene.sensor]]
    is_eye = node.props.plugin_name() in EYES
    if not requests:
        return (_camera(CAMERA, scene, loaded),) if is_eye else ()
    observers = []
    for request in requests:
        if request.at is not None and request.towards is not None:
            observer = _looking(request, request.at, request.towards, scene.up)
            place, ahead = np.array([observer.place]), np.array([observer.ahead])
            if room.are_inside_solids(place, ahead).all():
                raise SceneError(
                    f"{request.where} is inside of a solid: the eyes at "
                    f"{[round(x, 3) for x in observer.place]} see only the back sides of surfaces"
                )
            observers.append(observer)
        elif is_eye:
            observers.append(_camera(request.name, scene, loaded))
        else:
            raise SceneError(
                f"{request.where}: the camera is a sensor {node.props.plugin_name()!r}, not an "
                "eye: give at and towards"
            )
    return tuple(observers)


def _looking(
    request: ObserverRequest, at: Doubles, towards: Doubles, vertical: Position
) -> GlareObserver:
    """Return an observer whose eyes are level."""
    ahead = (towards - at) / np.linalg.norm(towards - at)
    up = np.array(vertical) - ahead * (ahead @ vertical)
    if (length := float(np.linalg.norm(up))) < UPRIGHT:
        raise SceneError(
            f"{request.where} looks straight up or down: expected a line of sight beside the "
            "vertical"
        )
    return GlareObserver(request.name, _three(at), _three(ahead), _three(up / length))


def _camera(name: str, scene: Scene, loaded: Any) -> GlareObserver:
    """Return an observer who sees what the camera sees."""
    matrix = np.array(scene.camera(loaded).world_transform().matrix, float).reshape(4, 4)
    _, up, ahead = matrix[:3, :3].T / np.linalg.norm(matrix[:3, :3], axis=0)[:, None]
    return GlareObserver(name, _three(matrix[:3, 3]), _three(ahead), _three(up))


def _three(vector: Doubles) -> Position:
    x, y, z = map(float, vector)
    return x, y, z
