"""Places those who see glare in a scene: where a planes file has them, or at the camera."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.errors import SceneError
from lightpaint.photometry.glare import GlareObserver
from lightpaint.photometry.room_rays import RoomRays
from lightpaint.scene import Scene

#: Place of an observer who is where the camera is, and their name in files without any.
CAMERA = "camera"
#: Sensors that see as an eye does.
EYES = ("perspective", "thinlens")

#: Sine of the angle to the vertical below which a line of sight has no upper side.
UPRIGHT = 1e-3


@dataclass(frozen=True)
class ObserverRequest:
    """An observer as a planes file describes them.

    where: the key in the file, for errors. at, towards: (3,), the place of the eyes and a point
    that they look at; None for the places of the camera.
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
