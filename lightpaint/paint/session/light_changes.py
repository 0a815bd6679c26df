"""Changes of the requests for lights by messages of a page, checked against the lights."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lightpaint.basis.lights import Lights
from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.store.session_requests import SessionRequests


def constrain_light(
    requests: SessionRequests, lights: Lights, message: protocol.ConstrainLight
) -> tuple[str, SessionRequests]:
    """Return the name of a light by its place, and the requests with those on it replaced."""
    if message.light >= len(lights):
        raise PaintError(f"no light {message.light}: there are {len(lights)}")
    name = lights.names[message.light]
    return name, constrain_lights(requests, lights, {name: message.constraints})


def constrain_lights(
    requests: SessionRequests, lights: Lights, asked: Mapping[str, Mapping[str, Any]]
) -> SessionRequests:
    """Return the requests with those on some lights replaced, by their names."""
    _check_names(asked, lights)
    for name, constraints in asked.items():
        if lights[lights.names.index(name)].is_fixed:
            raise PaintError(f"{name} is kept as it is, and cannot be asked for anything")
        requests = requests.with_light(name, constraints)
    return requests


def move_lights(
    requests: SessionRequests, lights: Lights, poses: Mapping[str, Mapping[str, Any]]
) -> SessionRequests:
    """Return the requests with the poses of some lights replaced, by their names."""
    _check_names(poses, lights)
    return requests.with_poses(poses)


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
