"""The frame in which a luminaire hangs: that of the emitter whose place it takes."""

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.errors import SceneError
from lightpaint.luminaires.web import turning

#: From the frame of a web (nadir −z, C0 +x, C90 +y) into that of an emitter that shines along z:
#: seen along z with y upwards, +x is to the left, so that C0 is to the right and C90 up.
EMITTER_FROM_WEB = np.diag([-1.0, 1.0, -1.0])


def world_from_web(to_world: Doubles, *, turn: float = 0.0, tilt: float = 0.0) -> Doubles:
    """Return the matrix (3, 3) from the frame of a web into the world.

    to_world: (3, 3), of the emitter, which may be scaled. turn, tilt: as in `turned`.
    Raises SceneError for a frame without three axes.
    """
    left, up, ahead = np.asarray(to_world, np.float64).T
    axes = [_unit(ahead)]
    axes.append(_unit(left - axes[0] * (left @ axes[0])))
    axes.append(_unit(up - sum(axis * (up @ axis) for axis in axes)))
    frame = np.array([axes[1], axes[2], axes[0]]).T
    return np.asarray(frame @ EMITTER_FROM_WEB @ turning(turn=turn, tilt=tilt))


def hanging_frame(up: Position) -> Doubles:
    """Return the matrix (3, 3) into the world of an emitter that shines straight down.

    With z up its C0 is +x and its C90 +y; with y up C0 is +x and C90 −z.
    """
    axis = _unit(np.array(up))
    k = int(np.argmax(np.abs(axis)))
    c0 = np.array([0.0, 1.0, 0.0]) if k == 0 else np.array([1.0, 0.0, 0.0])
    c0 = _unit(c0 - axis * (c0 @ axis))
    return np.array([-c0, np.cross(axis, c0), -axis]).T


def _unit(vector: Doubles) -> Doubles:
    length = float(np.linalg.norm(vector))
    if not length > 1e-12:
        raise SceneError("the luminaire has a transform without three axes")
    return np.asarray(vector / length)
