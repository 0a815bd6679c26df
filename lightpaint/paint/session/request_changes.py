"""Changes of the requests in effect by messages of a page, checked against the lights."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Lights
from lightpaint.colour import luminance
from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.store.session_requests import TITLES, SessionRequests

#: Part of its level in the scene at which a light counts as off.
OFF = 1e-4

#: Messages that change the requests in effect.
RequestChange = (
    protocol.ConstrainLight
    | protocol.ConstrainLights
    | protocol.MoveLights
    | protocol.RemoveLight
    | protocol.TieLights
    | protocol.SetMaster
    | protocol.StartFromLamps
    | protocol.ChangeSettings
)


def changed_requests(
    requests: SessionRequests, lights: Lights, message: RequestChange, weights: Doubles
) -> tuple[str, SessionRequests]:
    """Return the label of a change for undo, and the requests after it.

    weights: (n, 3), the answer before. Raises LightpaintError if it is impossible.
    """
    match message:
        case protocol.ConstrainLight():
            return constrain_light(requests, lights, message)
        case protocol.ConstrainLights():
            changed = constrain_lights(requests, lights, message.constraints)
            _check_names(message.earlier, lights)
            changed = changed.with_earlier(message.earlier)
            return message.label or ", ".join(message.constraints), changed
        case protocol.MoveLights():
            changed = move_lights(requests, lights, message.poses)
            changed = keep_moved_lights(changed, lights, message.poses, weights)
            return _label_of_moves(message.poses), changed
        case protocol.RemoveLight():
            return f"remove {message.name}", remove_light(requests, lights, message.name)
        case protocol.TieLights():
            return "tie", tie_lights(requests, lights, message.ties)
        case protocol.SetMaster():
            changed = requests.with_master(message.level)
            return f"master {100 * message.level:.0f} %", changed
        case protocol.StartFromLamps():
            if not message.is_on:
                return "start from the scene", requests.with_start({})
            if any(light.lamp for light in lights):
                raise PaintError(
                    "a solve with spectra starts from the scene as it is: lock lights instead"
                )
            pairs = zip(lights, weights, strict=True)
            start = {light.name: emission for light, emission in pairs if not light.is_fixed}
            start = {name: emission.tolist() for name, emission in start.items()}
            return "start from my lamps", requests.with_start(start)
        case protocol.ChangeSettings():
            changed = requests.with_values(message.settings)
            return ", ".join(TITLES[key] for key in message.settings), changed


def previewed_requests(
    requests: SessionRequests, lights: Lights, change: protocol.Preview
) -> SessionRequests:
    """Return the requests after a change that is to be previewed."""
    requests = requests.with_values(change.settings)
    requests = constrain_lights(requests, lights, change.constraints)
    return requests if change.ties is None else tie_lights(requests, lights, change.ties)


def constrain_light(
    requests: SessionRequests, lights: Lights, message: protocol.ConstrainLight
) -> tuple[str, SessionRequests]:
    """Return the name of a light by its place, and the requests with those on it replaced."""
    if message.light >= len(lights):
        raise PaintError(f"no light {message.light}: there are {len(lights)}")
    name = lights.names[message.light]
    return name, constrain_lights(requests, lights, {name: message.constraints})


def constrain_lights(
    requests: SessionRequests, lights: Lights, requested: Mapping[str, Mapping[str, Any]]
) -> SessionRequests:
    """Return the requests with those on some lights replaced, by their names."""
    _check_names(requested, lights)
    for name, constraints in requested.items():
        if lights[lights.names.index(name)].is_fixed:
            raise PaintError(f"{name} is fixed, so it takes no constraint")
        requests = requests.with_light(name, constraints)
    return requests


def _label_of_moves(poses: Mapping[str, Mapping[str, Any]]) -> str:
    """Return what changes about lights: their aim, their cone, or their place."""
    keys, names = {key for pose in poses.values() for key in pose}, ", ".join(poses)
    if keys == {"target"}:
        return f"aim {names}"
    return f"cone of {names}" if keys and keys <= {"cutoff", "beam"} else f"move {names}"


def move_lights(
    requests: SessionRequests, lights: Lights, poses: Mapping[str, Mapping[str, Any]]
) -> SessionRequests:
    """Return the requests with the poses of some lights replaced, by their names."""
    _check_names(poses, lights)
    return requests.with_poses(poses)


def keep_moved_lights(
    requests: SessionRequests,
    lights: Lights,
    poses: Mapping[str, Mapping[str, Any]],
    weights: Doubles,
) -> SessionRequests:
    """Return requests in which lights that a person has moved keep their level, until released.

    Those put back in their place are released. A light that the answer had switched off gets its
    level in the scene: somebody who aims it wants to see it. poses: the changes, by name. weights:
    (n, 3), of the answer before.
    """
    for name, change in poses.items():
        light = lights[lights.names.index(name)]
        if not change:
            requests = requests.without_kept(name) if name in requests.kept else requests
        elif not (light.is_fixed or requests.holds(name)):
            emission = weights[lights.names.index(name)]
            if luminance(emission) <= OFF * luminance(np.array(light.emission)):
                emission = np.array(light.emission)
            if emission.any():
                level = float(emission[0]) if light.is_scalar else emission.tolist()
                requests = requests.with_kept(name, level)
    return requests


def remove_light(requests: SessionRequests, lights: Lights, name: str) -> SessionRequests:
    """Return the requests without a light that was added."""
    _check_names([name], lights)
    if name not in requests.added:
        raise PaintError(f"{name} is a light of the scene: turn it off instead")
    return requests.without_added(name)


def tie_lights(
    requests: SessionRequests, lights: Lights, ties: Sequence[Sequence[str]]
) -> SessionRequests:
    """Return the requests with other dimmers, each with the names of its lights."""
    _check_names((name for names in ties for name in names), lights)
    return requests.with_ties(ties)


def _check_names(names: Iterable[str], lights: Lights) -> None:
    if unknown := [name for name in names if name not in lights.names]:
        raise PaintError(f"no light is called {unknown[0]!r}")
