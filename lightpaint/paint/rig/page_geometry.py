"""The geometry that pages draw lamps with: rays of cameras, and outlines of objects from above."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.paint.protocol import Camera, Place, PlanObject, SkyAxes
from lightpaint.scene import Scene, names_by_shape
from lightpaint.scene.lights.texels import Sky
from lightpaint.scene.runtime.render_lock import tracing

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
    corners = np.array([(0, 0), (1, 0), (0, 1), (1, 1), (0.7, 0.6)])
    origin, direction = _rays(scene, loaded, corners)
    if np.allclose(direction, direction[0], atol=1e-5):
        x_axis, y_axis, forward = origin[1] - origin[0], origin[2] - origin[0], direction[0]
        expected = origin[0] + 0.7 * x_axis + 0.6 * y_axis
        if np.linalg.norm(expected - origin[4]) > STRAIGHT * np.linalg.norm(x_axis):
            return None
        return _camera(scene, origin[0], x_axis, y_axis, forward, is_parallel=True)
    eye = _crossing(origin, direction)
    off = np.linalg.norm(np.cross(origin - eye, direction), axis=1)
    if (off > STRAIGHT * max(float(np.linalg.norm(origin - eye, axis=1).max()), STRAIGHT)).any():
        return None
    # The rays to the corners end at the corners of a parallelogram, which need not face the middle
    # ray: the picture may be a part of the film, or the lens shifted.
    others = np.stack([direction[1], direction[2], -direction[3]], axis=1)
    if abs(np.linalg.det(others)) < STRAIGHT**3:
        return None
    lengths = np.linalg.solve(others, direction[0])
    x_axis, y_axis = (
        lengths[0] * direction[1] - direction[0],
        lengths[1] * direction[2] - direction[0],
    )
    expected = direction[0] + 0.7 * x_axis + 0.6 * y_axis
    off_ray = np.linalg.norm(np.cross(expected, direction[4])) / np.linalg.norm(expected)
    if lengths.min() <= 0 or off_ray > STRAIGHT:
        return None
    return _camera(scene, eye, x_axis, y_axis, direction[0], is_parallel=False)


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
) -> Camera:
    height, width = scene.size
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


#: Most outlines of a plan, the largest, and most corners of each.
MAX_OUTLINES, MAX_CORNERS = 200, 32

#: Part of the plan from which an object encloses the room: its outline is the outline of the room.
ENCLOSING_SHARE = 0.6

#: Parts of the room's height: what hangs above the first is left out, such as a ceiling; so is what
#: is thinner than the second and larger than a part of the plan, such as another room's floor.
MAX_LOWEST, MIN_THICKNESS, MAX_THIN_SHARE = 0.6, 0.03, 0.05

#: Most parts of one mesh that have an outline each; more have one together, and so have the parts
#: of a mesh of more faces than these.
MAX_PARTS, MAX_SPLIT_FACES = 24, 200_000

#: Points along each side of a grid over a surface that has no vertices.
SURFACE_SAMPLES = 24


def plan_objects(
    scene: Scene, loaded: Any, up: int, low: Doubles, high: Doubles
) -> tuple[PlanObject, ...]:
    """Return the outlines of a loaded scene's shapes from above, the largest first.

    up: the upward axis. low, high: corners of the box that the plan shows. Parts of meshes have
    outlines of their own. Those that lie outside the box, enclose it, hang high in it or are a
    floor are left out, and so is what emits light.
    """
    across = [axis for axis in range(3) if axis != up]
    plan_area, height = float(np.prod((high - low)[across])), float((high - low)[up])
    found = []
    for shape, name in zip(loaded.shapes(), names_by_shape(loaded, scene.shape_names), strict=True):
        if shape.is_emitter() or not name:
            continue
        for part in _parts(shape):
            corners = outline(part[:, across])
            middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
            is_inside = bool(((middle >= low[across]) & (middle <= high[across])).all())
            lowest, thickness = float(part[:, up].min()), float(np.ptp(part[:, up]))
            size = polygon_area(corners)
            is_thin = thickness < MIN_THICKNESS * height
            most = plan_area * (MAX_THIN_SHARE if is_thin else ENCLOSING_SHARE)
            if is_inside and lowest - low[up] < MAX_LOWEST * height and size < most:
                found.append((size, name, corners))
    found.sort(key=lambda entry: -entry[0])
    return tuple(PlanObject(name, _rounded(corners)) for _, name, corners in found[:MAX_OUTLINES])


def outline(points: Doubles) -> Doubles:
    """Return the corners of the convex hull of points (n, 2), counterclockwise, (k, 2).

    They are the points that lie furthest in each of MAX_CORNERS directions: all corners of a hull
    whose angles are not almost straight. Points at one place up to rounding are one corner.
    """
    step = 1e-5 * max(float(np.ptp(points, axis=0).max()), 1e-30)
    points = np.round(points / step) * step
    angles = 2 * np.pi * np.arange(MAX_CORNERS) / MAX_CORNERS + 1e-3
    furthest = np.argmax(points @ np.stack([np.cos(angles), np.sin(angles)]), axis=0)
    return np.array(list(dict.fromkeys(map(tuple, points[furthest].tolist()))))


def polygon_area(corners: Doubles) -> float:
    """Return the area of a polygon of corners (k, 2), counterclockwise."""
    x, y = corners.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _parts(shape: Any) -> list[Doubles]:
    """Return the points of each part of a shape in world space, (n, 3) each."""
    if not shape.is_mesh():
        return [_surface_points(shape)]
    vertices = np.array(shape.vertex_positions_buffer(), float).reshape(-1, 3)
    faces = np.array(shape.faces_buffer(), int).reshape(-1, 3)
    if len(faces) > MAX_SPLIT_FACES:
        return [vertices]
    part_of = mesh_parts(vertices, faces)
    numbers = np.unique(part_of)
    if len(numbers) > MAX_PARTS:
        return [vertices]
    return [vertices[part_of == number] for number in numbers]


def mesh_parts(vertices: Doubles, faces: npt.NDArray[np.int_]) -> npt.NDArray[np.int_]:
    """Return a number for each vertex, equal for vertices that faces connect, (n,).

    vertices: (n, 3); those at one place count as one. faces: (m, 3), indices of their corners.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    places, place = np.unique(vertices, axis=0, return_inverse=True)
    place, count = place.reshape(-1), len(places)
    first, second, third = place[faces].T
    edges = np.concatenate([first, first]), np.concatenate([second, third])
    graph = coo_array((np.ones(len(edges[0]), bool), edges), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1][place])


def _surface_points(shape: Any) -> Doubles:
    """Return points on a shape without vertices, (n, 3), among them those furthest out."""
    import drjit as dr
    import mitsuba as mi

    side = np.linspace(0, 1, SURFACE_SAMPLES, dtype=np.float32)
    grid = np.stack(np.meshgrid(side, side)).reshape(2, -1)
    samples = [mi.Point2f(grid)] if dr.is_jit_v(mi.Float) else [mi.Point2f(x) for x in grid.T]
    try:
        points = [np.array(shape.sample_position(0.0, sample).p, float) for sample in samples]
        return np.concatenate([x.reshape(3, -1) for x in points], axis=1).T
    except (RuntimeError, NotImplementedError):
        box = shape.bbox()  # all that an instance of a group has
    low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
    choices = np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1).T
    return np.where(choices, high, low)


def _rounded(corners: Doubles) -> tuple[tuple[float, float], ...]:
    return tuple((float(f"{x:.5g}"), float(f"{y:.5g}")) for x, y in corners)


def sky_axes(scene: Scene) -> tuple[SkyAxes, ...]:
    """Return the axes of the skies among the images of a scene's lights. The scene is loaded."""
    axes: dict[str, SkyAxes] = {}
    for emitter in scene.emitters:
        texel = emitter.texel
        if texel is None or not isinstance(texel.domain, Sky) or texel.image in axes:
            continue
        props, to_world = scene.parsed.state.nodes[emitter.node].props, np.eye(3)
        if "to_world" in props:
            to_world = np.array(props["to_world"].matrix, float).reshape(4, 4)[:3, :3]
        axes[texel.image] = SkyAxes(texel.image, tuple(map(_listed, np.linalg.inv(to_world))))
    return tuple(axes.values())
