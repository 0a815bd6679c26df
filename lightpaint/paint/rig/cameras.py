"""The rays of a camera, with which a page draws lamps, and their first hits."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.paint.protocol import Camera, Place
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene

#: Largest deviation from the rays of a pinhole, as through a fisheye lens, relative to a ray's
#: length.
STRAIGHT = 1e-3

#: Returns the distance from a point to the first surface in a direction.
FreeLength = Callable[[Doubles, Doubles], float]


@dataclass(frozen=True)
class FirstHit:
    """The surface that a pixel sees first.

    eye: where its ray begins. point, normal: of the surface, towards the eye.
    """

    eye: Doubles
    point: Doubles
    normal: Doubles


@contextmanager
def in_this_thread() -> Iterator[None]:
    """Hold Mitsuba, and let this thread use scenes and kernels of another thread."""
    import drjit as dr
    import mitsuba as mi

    with tracing():
        dr.detail.new_scope(dr.backend_v(mi.Float))
        yield


def camera_of(scene: Scene, loaded: Any) -> Camera | None:
    """Return the camera of `scene`; None for one whose rays do not go through a pinhole."""
    corners = np.array([(0, 0), (1, 0), (0, 1), (0.7, 0.6)])
    origin, direction = _rays(scene, loaded, corners)
    if np.allclose(direction, direction[0], atol=1e-5):
        x_axis, y_axis, forward = origin[1] - origin[0], origin[2] - origin[0], direction[0]
        expected = origin[0] + 0.7 * x_axis + 0.6 * y_axis
        is_straight = np.linalg.norm(expected - origin[3]) <= STRAIGHT * np.linalg.norm(x_axis)
        return _camera(scene, origin[0], x_axis, y_axis, forward, is_parallel=True, ok=is_straight)
    eye = _crossing(origin, direction)
    off = np.linalg.norm(np.cross(origin - eye, direction), axis=1)
    if (off > STRAIGHT * max(float(np.linalg.norm(origin - eye, axis=1).max()), STRAIGHT)).any():
        return None
    # All rays end in one plane before the eye, which the first ray meets after a length of 1.
    middle = _rays(scene, loaded, np.array([(0.5, 0.5)]))[1][0]
    ends = direction / (direction @ middle)[:, None]
    x_axis, y_axis = ends[1] - ends[0], ends[2] - ends[0]
    expected = ends[0] + 0.7 * x_axis + 0.6 * y_axis
    is_straight = np.linalg.norm(expected - ends[3]) <= STRAIGHT
    return _camera(scene, eye, x_axis, y_axis, ends[0], is_parallel=False, ok=bool(is_straight))


def _crossing(origin: Doubles, direction: Doubles) -> Doubles:
    """Return the point nearest to all rays, which begin at a plane before the eye."""
    across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    crossing: Doubles = np.linalg.solve(
        across.sum(axis=0), (across @ origin[..., None]).sum(axis=0)
    )
    return crossing[:, 0]


def _camera(
    scene: Scene,
    origin: Doubles,
    x_axis: Doubles,
    y_axis: Doubles,
    forward: Doubles,
    *,
    is_parallel: bool,
    ok: bool,
) -> Camera | None:
    height, width = scene.size
    if not ok:
        return None
    return Camera(
        origin=_listed(origin),
        x_axis=_listed(x_axis / width),
        y_axis=_listed(y_axis / height),
        forward=_listed(forward),
        is_parallel=is_parallel,
    )


def _listed(vector: Doubles) -> Place:
    return tuple(map(float, vector))


def up_axis(cameras: Sequence[Camera | None]) -> int:
    """Return the axis nearest to upwards in these views; y without a camera."""
    ups = [-np.array(camera.y_axis) for camera in cameras if camera is not None]
    total = (
        np.sum([up / max(np.linalg.norm(up), 1e-30) for up in ups], axis=0) if ups else [0, 1, 0]
    )
    return int(np.argmax(np.abs(total)))


def first_hit(scene: Scene, loaded: Any, pixel: tuple[float, float]) -> FirstHit | None:
    """Return the first hit of the pixel (column, row) of `scene`; None if it sees nothing."""
    import mitsuba as mi

    height, width = scene.size
    with tracing():
        rays = _mitsuba_rays(scene, loaded, np.array([(pixel[0] / width, pixel[1] / height)]))
        si = loaded.ray_intersect(rays)
        if not bool(np.array(si.is_valid()).all()):
            return None
        point, normal = _rows(si.p)[0], _rows(mi.Vector3f(si.sh_frame.n))[0]
        eye, way = _rows(rays.o)[0], _rows(rays.d)[0]
    return FirstHit(eye, point, normal if normal @ way < 0 else -normal)


def free_length(loaded: Any, start: Doubles, direction: Doubles) -> float:
    """Return the distance from a ray's origin to the first surface; inf without one."""
    import mitsuba as mi

    with tracing():
        ray = mi.Ray3f(mi.Point3f(*map(float, start)), mi.Vector3f(*map(float, direction)))
        si = loaded.ray_intersect(ray)
        if not bool(np.array(si.is_valid()).all()):
            return np.inf
        return float(np.array(si.t).ravel()[0])


def _rays(scene: Scene, loaded: Any, at: Doubles) -> tuple[Doubles, Doubles]:
    """Return origins and directions of rays, (k, 3) each. at: (k, 2), parts of the picture."""
    with tracing():
        rays = _mitsuba_rays(scene, loaded, at)
        return _rows(rays.o), _rows(rays.d)


def _mitsuba_rays(scene: Scene, loaded: Any, at: Doubles) -> Any:
    import mitsuba as mi

    camera = scene.camera(loaded)
    position = mi.Point2f(np.asarray(at, np.float32).T)
    middle = mi.Point2f(0.5, 0.5)  # of the lens
    rays, _ = camera.sample_ray(camera.shutter_open(), 0.5, position, middle)
    return mi.Ray3f(rays)


def _rows(vectors: Any) -> Doubles:
    return np.array(vectors, dtype=float).reshape(3, -1).T
