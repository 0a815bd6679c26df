"""Requests about lights: their constraints, ties and places."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from lightpaint.paint.protocol.base import Request
from lightpaint.paint.protocol.message_parts import Place


@dataclass(frozen=True)
class ConstrainLight(Request, kind="constrain_light"):
    """New constraints on one light; an empty object frees it. Answered by `answer`.

    constraints: keys and values as in a lights file: lock, off, limits, color, kelvin, duv,
    primaries. is_final: whether it becomes a step; false while a slider moves. light: its index.
    """

    light: int
    constraints: Mapping[str, Any]
    is_final: bool = True


@dataclass(frozen=True)
class ConstrainLights(Request, kind="constrain_lights"):
    """New constraints on several lights, by name, as in `constrain_light`: one step and one solve.
    Answered by `answer`.

    is_final: as in `constrain_light`. label: its name for undo; "" for the names of the lights.
    earlier: constraints of lights that are locked or off, by name, which apply once these are
    released, in place of those from before they were locked. constraints: by name of light, keys
    and values.
    """

    constraints: Mapping[str, Mapping[str, Any]]
    is_final: bool = True
    label: str = ""
    earlier: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class SetMaster(Request, kind="set_master"):
    """The master dimmer: one step. Answered by `answer`.

    level: factor of all lights but fixed ones, 0 to 2, applied to the answer. It changes neither
    the painting nor the solve.
    """

    level: float


@dataclass(frozen=True)
class StartFromLamps(Request, kind="start_from_lamps"):
    """The lights as they are now become the lighting that the solve starts from and stays near, and
    locked ones are released; or this ends. Adjustments that they answer are hidden meanwhile. One
    step. Answered by the whole `state`, with another look under the painting. The setting `near`
    says how near.

    is_on: false to end it.
    """

    is_on: bool = True


#: Largest step between the pixels of a dragged light's picture.
MAX_STEP = 8


def _check_step(step: int) -> None:
    if not 1 <= step <= MAX_STEP:
        raise ValueError(f"step is 1 to {MAX_STEP}")


@dataclass(frozen=True)
class MoveLights(Request, kind="move"):
    """New places, targets and cones of lights, by name. Answered by `answer`; `rig` follows.

    A light that is moved keeps its level from then on, as if it were locked, until it is released
    or put back.

    poses: changed fields of `lightpaint.Pose`: position, target, cutoff and beam; an empty object
    restores a light's place from the scene; without any pose, a drag ends and its light goes back.
    is_final: whether it becomes a step; false while a light is dragged. view: index of the view
    whose pictures of dragged lights are sent at once, as `dragged`. step: while a light is dragged,
    its picture is computed at every step-th pixel of every step-th row, 1 to 8: what the page draws
    in time.
    """

    poses: Mapping[str, Mapping[str, Any]]
    is_final: bool = True
    view: int = 0
    step: int = 1

    def __post_init__(self) -> None:
        _check_step(self.step)


@dataclass(frozen=True)
class PointLight(Request, kind="point"):
    """A move of a light by a place in the picture. Answered by `answer`; `rig` follows.

    mode: `aim` points it there; `highlight` hangs it so that its reflection appears there; `shadow`
    hangs it so that the shadow of the surface at `edge` ends there. pixel, edge: column and row in
    pixels. view: index of the view. is_final, step: as in `move`. light: its index.
    """

    light: int
    mode: Literal["aim", "highlight", "shadow"]
    pixel: tuple[float, float]
    edge: tuple[float, float] | None = None
    view: int = 0
    is_final: bool = True
    step: int = 1

    def __post_init__(self) -> None:
        _check_step(self.step)


@dataclass(frozen=True)
class AddLight(Request, kind="add_light"):
    """A new light, with a generated name: one step. Answered by `state`; `rig` follows.

    type: of the light. pixel: column and row in a picture; the light hangs a little before the
    surface there, and points away from it. position: its place, instead; it points down. view:
    index of the view.
    """

    type: Literal["spot", "point", "panel"]
    pixel: tuple[float, float] | None = None
    position: Place | None = None
    view: int = 0


@dataclass(frozen=True)
class RemoveLight(Request, kind="remove_light"):
    """A request to remove an added light, by name: one step. Answered by `state`; `rig` follows.

    name: of the light.
    """

    name: str


@dataclass(frozen=True)
class ShowRig(Request, kind="show_rig"):
    """A request for the places of all lights, and for `rig` after every later move. Answered by
    `started`, later by `rig`.
    """


@dataclass(frozen=True)
class PlaceLights(Request, kind="place"):
    """A request to find places, directions and cones of lights that come closest to the paintings,
    or to stop that. Answered by `started`, then by `trial` and later by `placed`; the result is one
    step.

    new_type: type of lights to add, instead of moving existing ones; null for none. max_count:
    maximum number of them. surfaces: names of rails, surfaces and shapes that they may hang on;
    none for anywhere free. keeps_best: for a stop: whether the best that was found by then becomes
    a step, once it is judged; otherwise every light stays where it is. run: false to stop.
    """

    run: bool = True
    new_type: Literal["spot", "point", "panel"] | None = None
    max_count: int = 1
    surfaces: tuple[str, ...] = ()
    keeps_best: bool = False


@dataclass(frozen=True)
class EstimatePlaces(Request, kind="estimate_place"):
    """A request to say what a search for places would do, and about how long it would take.
    Answered by `place_estimate`.

    new_type, max_count, surfaces: as in `place`.
    """

    new_type: Literal["spot", "point", "panel"] | None = None
    max_count: int = 1
    surfaces: tuple[str, ...] = ()


@dataclass(frozen=True)
class TieLights(Request, kind="tie"):
    """Say which lights share a dimmer; ties that are left out end. Answered by `answer`.

    ties: all groups of such lights, by their names.
    """

    ties: tuple[tuple[str, ...], ...]
