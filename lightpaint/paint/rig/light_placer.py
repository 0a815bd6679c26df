"""A background search for better places of lights, or for new lights; its result is one step."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import BackgroundThreads, StoppedError
from lightpaint.paint.protocol import (
    Message,
    PlaceLights,
    PlacingResult,
    TaskStarted,
    TrialPlaces,
)
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.rig.added_lights import free_name, values_of
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.moved_subjects import of_moved_scenes
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.store.session_requests import HOLD_KEYS
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.new_lights import NewLights
from lightpaint.placement.place import place
from lightpaint.placement.placement import Move, Placement
from lightpaint.placement.rigging.rigged_lights import freedom_on
from lightpaint.progress import cancellable
from lightpaint.scene.properties.pose import Pose, Site
from lightpaint.scene.runtime.render_lock import MITSUBA

#: Freedom of lights without one in the lights file: largest distance, relative to the size of the
#: room, and largest turn in degrees.
SLIDE, TURN = 0.15, 60.0

#: Maximum number of lights that one search adds.
MAX_NEW = 4

#: Seconds between updates of the trial places that pages show during a search.
WATCH_S = 0.15


class _OutdatedError(Exception):
    """Signal that lights have been moved since the search began, so its result is of no use."""


class LightPlacer:
    """Places the lights of a session by its painting, and adds others.

    hang_lights: moves lights and adds others in one step, given its label, their places by name,
    and the places of before; returns False, and changes nothing, if these have changed since.
    """

    def __init__(
        self,
        access: SessionAccess,
        publisher: Publisher,
        rig: LampRig,
        threads: BackgroundThreads,
        hang_lights: Callable[[str, Placed, Placed], bool],
    ) -> None:
        self._access, self._publisher, self._rig, self._threads = access, publisher, rig, threads
        self._hang_lights = hang_lights
        self._request: PlaceLights | None = None

    def handle(self, request: PlaceLights) -> list[Message]:
        """Start the search, or stop it. Raises LightpaintError if there is nothing to search for.

        A new search replaces a running one.
        """
        if not request.run:
            self._request = None
            return [TaskStarted(task="stop")]
        snapshot = self._access.snapshot()
        if not snapshot.painted_views:
            raise PaintError("nothing is painted yet: paint first, so that the search has a goal")
        if request.new_type is not None:
            self._new_lights(request, snapshot)
        elif not self._freedoms(snapshot):
            raise PaintError("no light is free to move: unlock a point, a spot or a sun")
        self._request = request
        self._threads.start_low_priority(lambda: self._run(request), "place")
        return [TaskStarted(task="place")]

    def _freedoms(self, snapshot: SessionSnapshot) -> dict[str, Freedom]:
        """Return the freedom of each movable light: from the lights file, or near its place.

        Panels, such as windows and ceilings that shine, move only if the file says so.
        """
        freedoms, placed = {}, snapshot.requests.placed
        for light in snapshot.bases[0].lights:
            is_held = any(key in snapshot.requests.lights.get(light.name, {}) for key in HOLD_KEYS)
            values = placed.get(light.name, {})
            is_panel_at_rest = light.plugin == "area" and light.name not in self._rig.freedoms
            if is_held or is_panel_at_rest or self._rig.why_not(light.name, values):
                continue
            site = self._rig.site(light.name, values)
            freedoms[light.name] = self._rig.freedoms.get(light.name) or Freedom(
                within=None if site.position is None else SLIDE * self._rig.extent,
                aim=site.direction is not None and TURN,
            )
        return freedoms

    def _new_lights(self, request: PlaceLights, snapshot: SessionSnapshot) -> NewLights:
        """Return the lights that a request may add. Raises LightpaintError for impossible ones."""
        assert request.new_type is not None
        scene, kind = self._rig.scene, request.new_type
        surfaces, rigging = request.surfaces, self._rig.rigging
        freedom = freedom_on(surfaces, scene, rigging) if surfaces else Freedom()
        if not 1 <= request.max_count <= MAX_NEW:
            raise PaintError(
                f"max_count is {request.max_count}: expected 1 to {MAX_NEW} new lights"
            )
        taken = {*snapshot.bases[0].names, *(x.name for x in scene.emitters)}
        # A free name is kept if one light is added; otherwise names are numbered.
        name = free_name(kind, taken) if request.max_count == 1 else kind
        return NewLights(kind, count=request.max_count, freedom=freedom, name=name)

    def _run(self, request: PlaceLights) -> None:
        snapshot = self._access.snapshot()

        def check() -> None:
            if self._request is not request:
                raise StoppedError
            if self._access.session.requests.placed != snapshot.requests.placed:
                raise _OutdatedError
            MITSUBA.let_others()  # a user who drags a light meanwhile gets answers at once

        try:
            with cancellable(check), MITSUBA.low_priority():
                solution, placement = self._searched(request, snapshot, check)
                placed = {
                    move.name: pose_values(move, snapshot.requests.poses.get(move.name, {}))
                    for move in placement.moves
                }
                placed |= {light.name: values_of(light.emitter) for light in placement.additions}
                current_delta_e, placed_delta_e = self._differences(snapshot, solution, placed)
                check()
        except StoppedError:
            if self._request is None:  # otherwise a page would wait for the next one
                self._publish("Stopped: every light stays where it was.")
            return
        except _OutdatedError:
            self._publish(_outdated(request))
            return
        except LightpaintError as error:
            self._publish(f"No light was {_done(request)}: {error}")
            return
        if not placed:
            reason = "none reliably removes a hundredth of the error"
            self._publish(f"No light was {_done(request)}: {reason}.")
            return
        if placed_delta_e >= current_delta_e:
            # The search measures light, which may differ from the visible error, for example in the
            # dark.
            reason = (
                f"what was found is no closer to the eye (ΔE {placed_delta_e:.1f} "
                f"instead of {current_delta_e:.1f})"
            )
            self._publish(f"No light was {_done(request)}: {reason}.")
            return
        label = f"{'move' if request.new_type is None else 'add'} {', '.join(placed)}"
        if not self._hang_lights(label, placed, snapshot.requests.placed):
            self._publish(_outdated(request))
            return
        summary = "; ".join(map(str, (*placement.moves, *placement.additions)))
        self._publish(f"{summary}.", tuple(placed))

    def _differences(
        self, snapshot: SessionSnapshot, solution: Solution, placed: Placed
    ) -> tuple[float, float]:
        """Return the ΔE of the exact answer, and of that with these lights moved and added."""
        if not placed:
            return 0.0, 0.0
        added = snapshot.requests.added
        moves = {name: x for name, x in placed.items() if "kind" not in x or name in added}
        new = {name: x for name, x in placed.items() if name not in moves}
        requests = snapshot.requests.with_poses(moves).with_added(new)
        bases = self._rig.bases(self._access.session.bases, requests.placed)
        state = replace(snapshot, bases=tuple(bases))
        placed_solution = state.solution()
        assert placed_solution is not None
        return snapshot.delta_e(solution), state.delta_e(placed_solution)

    def _publish(self, text: str, names: tuple[str, ...] = ()) -> None:
        self._publisher.publish(PlacingResult(text=text, names=names))

    def _searched(
        self, request: PlaceLights, snapshot: SessionSnapshot, check: Callable[[], None]
    ) -> tuple[Solution, Placement]:
        """Return the exact answer of the paintings, and the result of the search."""

        def report(label: str, done: int, total: int, unit: str = "passes") -> None:
            del label, unit
            check()
            self._publisher.report_progress("place", done, total, "steps")

        last_s = 0.0

        def watch(sites: Mapping[str, Site]) -> None:
            nonlocal last_s
            check()
            if (now_s := time.monotonic()) > last_s + WATCH_S:
                last_s = now_s
                self._publisher.publish(_trial(sites))

        self._rig.open(snapshot.bases)
        if request.new_type is None:
            freedoms, new = self._freedoms(snapshot), []
        else:
            freedoms, new = {}, [self._new_lights(request, snapshot)]
        subjects, moved = of_moved_scenes(snapshot, self._rig)
        views = moved.painted_views
        moved = replace(
            moved,
            bases=tuple(moved.bases[k] for k in views),
            targets=tuple(moved.targets[k] for k in views),
        )
        solution = moved.solution()
        assert solution is not None
        check()
        scenes = [subjects[k].loaded_scene for k in views]
        placement = place(
            scenes, moved.bases, solution, freedoms, new=new, progress=report, watch=watch
        )
        return solution, placement


def _trial(sites: Mapping[str, Site]) -> TrialPlaces:
    """Return the trial places, for pages to mark."""
    return TrialPlaces(
        positions={name: x.position for name, x in sites.items() if x.position is not None},
        directions={name: x.direction for name, x in sites.items() if x.direction is not None},
    )


def _done(request: PlaceLights) -> str:
    return "moved" if request.new_type is None else "added"


def _outdated(request: PlaceLights) -> str:
    return f"No light was {_done(request)}: lights were moved by hand meanwhile."


def pose_values(move: Move, before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the pose of a light after a move, for JSON. before: its earlier pose."""
    pose: Pose = move.pose
    values = dict(before)
    for key in ("position", "target", "cutoff", "beam"):
        value = getattr(pose, key)
        if value is not None:
            values[key] = [float(f"{x:.6g}") for x in value] if isinstance(value, tuple) else value
    return values
