"""Directions and the rotations between them."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position


def rotation_between(old: Sequence[float], new: Sequence[float] | Doubles) -> Doubles:
    """Return the smallest rotation, (3, 3), from direction `old` to direction `new`."""
    a, b = np.array(unit(old)), np.array(unit(new))
    cosine = float(a @ b)
    if cosine < -1 + 1e-12:
        # Half a turn about any perpendicular axis.
        axis = across(a)[0]
        return np.asarray(2 * np.outer(axis, axis) - np.eye(3))
    v = np.cross(a, b)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + cosine))


def across(direction: Sequence[float] | Doubles) -> Doubles:
    """Return two unit vectors perpendicular to a direction and to each other, (2, 3)."""
    axis = np.array(unit(direction))
    normal = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    normal /= np.linalg.norm(normal)
    return np.stack([normal, np.cross(axis, normal)])


def unit(vector: Sequence[float] | Floats) -> Position:
    """Return `vector` normalised to length 1."""
    values = np.asarray(vector, dtype=float)
    x, y, z = (values / np.linalg.norm(values)).tolist()
    return x, y, z
