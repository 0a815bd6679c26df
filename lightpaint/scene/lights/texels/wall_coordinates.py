"""Shapes that can show an image: those of whose texture coordinates each has one place."""

from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices

#: Shapes that are meshes, whose texture coordinates are in their files.
MESHES = ("obj", "ply", "serialized", "cube")

#: Distance by which coordinates may leave the image, from rounding.
COORDINATE_TOLERANCE = 1e-4
#: Number of places at which a mesh is searched for a second triangle with the same coordinates, and
#: number of comparisons in all.
MAX_PLACES, MAX_COMPARISONS = 512, 2**23


def why_no_image(shape: str, mesh: Any) -> str:
    """Return why a shape cannot show an image, phrased to follow the name of its light; "" if it
    can.

    shape: its plugin. mesh: the loaded shape, for one of MESHES.
    """
    if shape == "rectangle":
        return ""
    if shape not in MESHES:
        return f"is a {shape}, whose texture coordinates no flat image follows"
    import mitsuba as mi

    if not mesh.has_vertex_texcoords():
        return "is a mesh without texture coordinates (uv)"
    parameters = mi.traverse(mesh)
    coordinates = np.array(parameters["vertex_texcoords"], float).reshape(-1, 2)
    return why_not_flat(coordinates, np.array(parameters["faces"], int).reshape(-1, 3))


def why_not_flat(coordinates: Doubles, faces: Indices) -> str:
    """Return why the triangles of a mesh do not lie beside each other in an image; "" if they do.

    coordinates: (vertices, 2). faces: (triangles, 3).
    """
    used = coordinates[faces]
    low, high = -COORDINATE_TOLERANCE, 1 + COORDINATE_TOLERANCE
    if not (used.min() >= low and used.max() <= high):
        return (
            f"is a mesh with texture coordinates from {used.min():.3g} to {used.max():.3g}: its "
            "image is from 0 to 1"
        )
    a, b, c = used[:, 0], used[:, 1], used[:, 2]
    areas = _cross(b - a, c - a)
    used = used[np.abs(areas) > 1e-12]
    if not len(used):
        return "is a mesh whose texture coordinates are all on a line"
    step = max(1, len(used) // max(1, min(MAX_PLACES, MAX_COMPARISONS // len(used))))
    middles = used[::step].mean(axis=1)
    if (_triangles_over(middles, used) > 1).any():
        return "is a mesh of which several places have the same texture coordinates"
    return ""


def _triangles_over(points: Doubles, triangles: Doubles) -> Indices:
    """Return the number of triangles, (t, 3, 2), that each point, (p, 2), lies in."""
    count = np.zeros(len(points), int)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    for k, point in enumerate(points):
        sides = [_cross(y - x, point - x) for x, y in ((a, b), (b, c), (c, a))]
        count[k] = (np.all(np.array(sides) > 0, axis=0) | np.all(np.array(sides) < 0, axis=0)).sum()
    return count


def _cross(a: Doubles, b: Doubles) -> Doubles:
    """Return the cross products of vectors in a plane, (n, 2) each."""
    return np.asarray(a[:, 0] * b[..., 1] - a[:, 1] * b[..., 0])
