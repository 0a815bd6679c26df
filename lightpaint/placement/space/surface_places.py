"""Free places on surfaces of a loaded scene, such as a ceiling, a wall or a shelf."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.display_text import some_names
from lightpaint.errors import NoPlaceError, SceneError
from lightpaint.placement.space.free_space import CLEARANCE, FreeSpace
from lightpaint.placement.space.permitted_places import Triangles
from lightpaint.scene.scene import Scene

#: Number of random places that determine the free side of triangles.
TESTED = 2000


def places_on(
    scene: Scene,
    loaded: Any,
    surfaces: Sequence[str],
    space: FreeSpace,
    *,
    clear: float | None,
    seed: int,
) -> Triangles:
    """Return places at a distance in front of shapes, on the side that sees the picture.

    surfaces: their ids. clear: the distance; None for a small part of the room.

    Raises SceneError for shapes that do not exist or are not flat, and for those without free
    places.
    """
    corners = np.concatenate([_triangles(scene, loaded, name) for name in surfaces])
    distance = CLEARANCE * space.spread if clear is None else clear
    length = np.linalg.norm(Triangles(corners).normals, axis=1, keepdims=True)
    corners, length = corners[length[:, 0] > 0], length[length[:, 0] > 0]
    unit = Triangles(corners).normals / length
    rng = np.random.default_rng(seed)
    triangle, places = Triangles(corners).scattered(TESTED, rng)
    votes = np.zeros((2, len(corners)))
    for k, side in enumerate((1, -1)):
        off = places + side * distance * unit[triangle]
        np.add.at(votes[k], triangle, space.usable(loaded, off, 0.9 * distance))
    is_free = votes.max(axis=0) > 0
    if not is_free.any():
        listed = some_names(surfaces)
        raise NoPlaceError(
            f"no place {distance:.3g} from {listed} is free and sees anything of the picture"
        )
    front = np.where(votes[0] >= votes[1], 1, -1)[:, None]
    return Triangles((corners + (front * distance * unit)[:, None])[is_free])


def _triangles(scene: Scene, loaded: Any, name: str) -> Doubles:
    """Return the triangles of a shape, (t, 3, 3)."""
    import mitsuba as mi

    names = scene.shape_names
    if name not in names:
        raise SceneError(
            f"{scene.path} has no shape {name!r} to hang lights on: it has {some_names(names)}"
        )
    corners = []
    for shape_name, shape in zip(names, loaded.shapes(), strict=True):
        if shape_name != name:
            continue
        parameters = mi.traverse(shape)
        if "faces" in parameters:
            points = np.array(parameters["vertex_positions"], dtype=float).reshape(-1, 3)
            faces = np.array(parameters["faces"]).reshape(-1, 3)
            corners.append(points[faces])
        elif str(shape).startswith("Rectangle"):
            matrix = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
            square = np.array([[-1, -1, 0, 1], [1, -1, 0, 1], [1, 1, 0, 1], [-1, 1, 0, 1]])
            points = (square @ matrix.T)[:, :3]
            corners.append(points[[[0, 1, 2], [0, 2, 3]]])
        else:
            raise SceneError(
                f"lights can hang on rectangles and meshes, and shape {name!r} is neither"
            )
    return np.concatenate(corners)
