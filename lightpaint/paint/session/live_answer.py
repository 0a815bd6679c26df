"""The requests of a session, their changes by messages of a page, checked against the lights, and
the answer that follows them and the brush.

While a stroke is made, drives of lamps and readings of planes are renewed only as often as they
cost little of its time.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from lightpaint import lighting
from lightpaint.arrays import RGB, Doubles
from lightpaint.basis import Basis, Lights
from lightpaint.colour import Lamp, ViewTransform, luminance
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint import protocol
from lightpaint.paint.protocol import PlanesReading
from lightpaint.paint.session.session_planes import SessionPlanes, WishesInEffect
from lightpaint.paint.store.session_requests import TITLES, SessionRequests
from lightpaint.pipeline.job.settings import Settings

_Result = TypeVar("_Result")

#: Share of the time that readings of planes take at most: the power of many lamps takes longer than
#: an answer.
READING_SHARE = 0.1

#: Least seconds between two sets of drives, and the share of the time that they take at most.
DRIVES_S, DRIVES_SHARE = 0.1, 0.05

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


class LiveAnswer:
    """Requests, and the weights that come closest under them. Updated in place.

    settings, constraints: those before the session began. transform: the one to paint through.
    lights_of: returns the lights under given requests.

    Attributes:
        requests: In effect now, including requests of a slider that still moves.
        before_slider: Those before the slider moved; None while none moves.
        weights: (n, 3), the last answer.
        mixed_emissions: The emissions that lamps with colour wheels had in it before these came to
            their slots, by the light's index.
    """

    def __init__(
        self,
        views: Sequence[lighting.LiveView],
        requests: SessionRequests,
        *,
        settings: Settings,
        constraints: lighting.Constraints,
        transform: ViewTransform,
        lights_of: Callable[[SessionRequests], Lights],
    ) -> None:
        self.requests, self._lights_of = requests, lights_of
        self.before_slider: SessionRequests | None = None
        self._basis = views[0].basis
        self.weights = self._basis.current_weights
        self.mixed_emissions: Mapping[int, RGB] = {}
        self._settings, self._base_constraints, self._transform = settings, constraints, transform
        self._planes: SessionPlanes | None = None
        self._wishes: tuple[SessionRequests, tuple[str, ...], WishesInEffect | None] | None = None
        self.set_views(views)

    def set_views(self, views: Sequence[lighting.LiveView]) -> None:
        """Continue with these views; new lights start at their current emission."""
        former_basis, self._basis = self._basis, views[0].basis
        if former_basis.names != self._basis.names:
            self.weights = weights_by_name(self.weights, former_basis.names, self._basis.lights)
        constraints = self._constraints(self.requests)
        self._live = lighting.LiveSolver(
            views,
            fit=self.fit,
            constraints=constraints,
            is_sketch=True,
            display=self._transform,
        )
        self._live.prepare()

    def follow_planes(self) -> None:
        """Note that the planes of some lights have changed; the views have them already."""
        self._basis = self._live.follow_planes()

    @property
    def requests_at_rest(self) -> SessionRequests:
        """The requests without the requests of a slider that still moves."""
        return self.before_slider or self.requests

    @property
    def lamps(self) -> Mapping[int, Lamp]:
        """The lamps that mix lights from emitters, by the light's index."""
        return self._live.lamps

    def drives(self) -> tuple[tuple[float, ...] | None, ...]:
        """Return the drives of the emitters of each light in the answer, None without any."""
        lamps = self.lamps
        return tuple(
            tuple(lamps[k].drives_for(weight).tolist()) if k in lamps else None
            for k, weight in enumerate(self.weights)
        )

    def named_drives(self, weights: Doubles) -> dict[str, dict[str, float]]:
        """Return the drives of the lamps of emitters, by name of light and emitter.

        weights: (n, 3), in the order of the lights; of lights that were added last some may lack.
        """
        names = self._basis.names
        return {
            names[k]: dict(zip(lamp.names, lamp.drives_for(weights[k]).tolist(), strict=True))
            for k, lamp in self.lamps.items()
        }

    @property
    def mode(self) -> str:
        """Space in which answers are found."""
        return self._live.mode

    @property
    def fit(self) -> Settings:
        """Settings of the fit, with all defaults resolved."""
        return self._fit(self.requests)

    def settings(self, requests: SessionRequests | None = None) -> Settings:
        """Return the settings of `requests`, by default those in effect, with defaults
        unresolved.
        """
        return (requests or self.requests).settings(self._settings)

    def constraints(self, requests: SessionRequests | None = None) -> lighting.Constraints:
        """Return the constraints of requests, combined with the constraints of the scene."""
        requests = requests or self.requests
        constraints = self._base_constraints.and_then(requests.constraints())
        return replace(constraints, requirements=self._requirements(requests))

    def set_planes(self, planes: SessionPlanes) -> None:
        """Meet the wishes for planes from now on, unless requests say to ignore them.

        Raises LightpaintError, and changes nothing then, if no answer can.
        """
        before = self._planes
        self._planes, self._wishes = planes, None
        try:
            self._find_wishes(self.requests)
        except LightpaintError:
            self._planes = before
            raise
        self._live.constrain(self.fit, self._constraints(self.requests))

    @property
    def planes(self) -> SessionPlanes | None:
        """The measured planes; None without any."""
        return self._planes

    def planes_reading(self) -> PlanesReading | None:
        """Return what the answer gives on measuring planes; None without any."""
        wishes = self._wishes_under(self.requests)
        if wishes is None:
            return None
        shown = self.requests.output(self.weights, self._basis.is_fixed)
        return wishes.reading(shown, self.requests.place_key)

    @property
    def basis(self) -> Basis:
        """Basis of the first view; its lights are the lights of all views."""
        return self._basis

    def check(self, requests: SessionRequests) -> None:
        """Raise LightpaintError for impossible requests, before anything is changed."""
        lights, fit = self._lights_of(requests), self._fit(requests)
        lighting.reduce_lights(self._unrequired(requests, lights), lights, fit)
        if lights.names == self._basis.names:
            self._find_wishes(requests)

    def set_requests(self, requests: SessionRequests) -> None:
        """Set the requests; a moving slider has come to rest."""
        self._apply(requests)
        self.before_slider = None

    def _apply(self, requests: SessionRequests) -> None:
        self.requests = requests
        # If lights were added or removed, new views follow, with a new solver.
        if self._lights_of(requests).names == self._basis.names:
            self._live.constrain(self.fit, self._constraints(requests))

    def move_slider(self, requests: SessionRequests) -> None:
        """Set requests while a slider moves. Raises LightpaintError, and changes nothing then."""
        self.check(requests)
        self.before_slider = self.requests_at_rest
        self._apply(requests)

    def reset_slider(self) -> bool:
        """Restore the requests from before an abandoned slider; return whether there was one."""
        if self.before_slider is None:
            return False
        self.set_requests(self.before_slider)
        return True

    def solve(self, *, while_painting: bool = False) -> None:
        """Solve for the weights, with the current paint. while_painting: whether a stroke goes
        on.
        """
        is_moving = (
            self.before_slider is not None and self.before_slider.poses != self.requests.poses
        )
        self.weights = self._live.answer(
            self.weights, while_moving=is_moving, while_painting=while_painting
        )
        self.mixed_emissions = self._live.mixed_emissions

    def accept(self, weights: Doubles, mixed_emissions: Mapping[int, RGB] | None = None) -> None:
        """Show weights (n, 3) that were found elsewhere. mixed_emissions: as the attribute."""
        self.weights, self.mixed_emissions = weights, mixed_emissions or {}

    def _fit(self, requests: SessionRequests) -> Settings:
        settings = requests.settings(self._settings)
        return lighting.resolve_fit(
            settings, over_look=True, through_view=True, display=lambda: self._transform
        )

    def _constraints(self, requests: SessionRequests) -> lighting.Constraints:
        """Return all constraints, with what the wishes for planes require."""
        required = self._requirements(requests)
        return replace(self._unrequired(requests, self._basis.lights), requirements=required)

    def _requirements(self, requests: SessionRequests) -> lighting.Requirements | None:
        wishes = self._wishes_under(requests)
        return None if wishes is None else wishes.requirements

    def _unrequired(self, requests: SessionRequests, lights: Lights) -> lighting.Constraints:
        """Return all constraints but what wishes for planes require. lights: under the requests."""
        constraints = lighting.constraints_of(self._basis.requests).and_then(self._base_constraints)
        scaled = lighting.with_sure_scale if self._settings.planes is None else lighting.with_scale
        return scaled(constraints.and_then(requests.constraints()), lights)

    def _wishes_under(self, requests: SessionRequests) -> WishesInEffect | None:
        """Return the wishes for planes under requests; None without any, and where limits of lamps
        contradict them, as they may in requests from before there were any.
        """
        with suppress(LightpaintError):
            return self._find_wishes(requests)
        return None

    def _find_wishes(self, requests: SessionRequests) -> WishesInEffect | None:
        """Return the wishes for planes under requests, found once for each; None without any.

        Raises LightpaintError if limits of lamps contradict them.
        """
        lights = self._basis.lights
        if self._planes is None:
            return None
        if self._wishes is None or self._wishes[:2] != (requests, lights.names):
            constraints = self._unrequired(requests, lights)
            wishes = WishesInEffect.of(
                self._planes.for_lights(lights),
                lighting.reduce_lights(constraints, lights, self._fit(requests)),
                are_ignored=requests.ignores_wishes,
            )
            self._wishes = requests, lights.names, wishes
        return self._wishes[2]


def weights_by_name(weights: Doubles, names: Sequence[str], lights: Lights) -> Doubles:
    """Return weights (n, 3) of `lights` from the weights of lights with these names.

    Other lights start at their current emission.
    """
    new_weights = np.array(lights.current_weights)
    weight_by_name = dict(zip(names, weights, strict=True))
    for k, light in enumerate(lights):
        if light.name in weight_by_name:
            new_weights[k] = weight_by_name[light.name]
    return new_weights


class LivePace:
    """The pace of work during a stroke: it is done only as often as it costs little of the time.

    share: of the time that the work takes at most. least_s: least seconds between two results.
    clock_s: a clock in seconds.
    """

    def __init__(
        self, share: float, least_s: float = 0.0, clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._share, self._least_s, self._clock_s = share, least_s, clock_s
        self._next_s = float("-inf")

    def take(self, work: Callable[[], _Result]) -> _Result | None:
        """Return the result of the work; None, and do nothing, if it is too early for it."""
        begin_s = self._clock_s()
        if begin_s < self._next_s:
            return None
        result = work()
        end_s = self._clock_s()
        self._next_s = end_s + max(self._least_s, (end_s - begin_s) / self._share)
        return result


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
