"""A background search for better places of lights, or for new lights; its result is one step."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting import Solution
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import StoppedError
from lightpaint.paint.rig.added_lights import free_name, listed, values_of
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.moved_looks import of_moved_scenes
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.session_file import Store, StoredRecords
from lightpaint.paint.store.session_requests import HOLD_KEYS
from lightpaint.placement import (
    Freedom,
    Move,
    NewLights,
    Placement,
    SearchSize,
    freedom_on,
    place,
    usual_pace,
)
from lightpaint.progress import cancellable
from lightpaint.scene import Pose
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.sentences import Hint, Sentence

#: Freedom of lights without one in the lights file: largest distance, relative to the size of the
#: room, and largest turn in degrees.
SLIDE, TURN = 0.15, 60.0

#: Maximum number of lights that one search adds.
MAX_NEW = 4

#: What a search says that has tried everything in vain.
NOTHING_BETTER = (
    "Nothing better within these freedoms: no change reliably removes a hundredth of the error."
)

#: Number of notes on searches that a session keeps.
MAX_NOTES = 200

#: Seconds between updates of the trial places that pages show during a search.
WATCH_S = 0.15


class SearchNotes:
    """Notes on the searches of a session: what was tried, and the results. store: keeps them.

    They stand in the history beside its steps. A search that finds nothing changes nothing, so it
    is not a step; without a note, nobody would know later that it was tried.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._records = StoredRecords(store, "searches", protocol.SearchInfo)
        self._notes = self._records.read()

    def add(
        self, title: str, text: str, tried: Sequence[str], seconds: float
    ) -> protocol.SearchInfo:
        """Keep a note on a search that has just ended, after the step that is the last one now.

        title: what was searched for. text: the result. tried: sentences on what was tried.
        """
        number = max((note.id for note in self._notes), default=0) + 1
        stamp, after = time.time(), self._store.last_id
        note = protocol.SearchInfo(
            number, after, title, text, tuple(tried), stamp, round(seconds, 1)
        )
        self._notes = [*self._notes, note][-MAX_NOTES:]
        self._records.write(self._notes)
        return note

    def listed(self) -> tuple[protocol.SearchInfo, ...]:
        """Return the notes whose step still exists, the oldest first."""
        ids = {0, *self._store.step_ids}
        return tuple(note for note in self._notes if note.after in ids)


class _OutdatedError(Exception):
    """Signal that lights have been moved since the search began, so its result is of no use."""


class LightPlacer:
    """Places the lights of a session by its painting, and adds others.

    hang_lights: moves lights and adds others in one step, given its label, their places by name,
    and the places of before; returns False, and changes nothing, if these have changed since.
    """

    def __init__(
        self,
        links: StudioLinks,
        rig: LampRig,
        hang_lights: Callable[[str, Placed, Placed], bool],
    ) -> None:
        self._access, self._publisher, self._threads = links
        self._rig, self._hang_lights = rig, hang_lights
        self._request: protocol.PlaceLights | None = None
        self._ended_request: protocol.PlaceLights | None = None  # it ends with the best so far
        self._pace: float | None = None  # of the last search that was not ended early
        self._notes: SearchNotes | None = None

    @property
    def notes(self) -> SearchNotes:
        """Notes on the searches of the session. Raises PaintError before there is a basis."""
        if self._notes is None:
            self._notes = SearchNotes(self._access.session.store)
        return self._notes

    def handle(self, request: protocol.PlaceLights) -> list[protocol.Message]:
        """Start the search, or stop it. Raises LightpaintError if there is nothing to search for.

        A new search replaces a running one.
        """
        if not request.run:
            if request.keeps_best:
                self._ended_request = self._request
            else:
                self._request = None
            return [protocol.TaskStarted(task="stop")]
        self._checked_snapshot(request)
        # Created here, in the thread of requests, since a search ends in its own.
        _ = self.notes
        self._request = request
        self._threads.start_low_priority(lambda: self._run(request), "place")
        return [protocol.TaskStarted(task="place")]

    def estimate(self, request: protocol.EstimatePlaces) -> list[protocol.Message]:
        """Return what a search would do and how long it takes. Raises as `handle` does."""
        search = protocol.PlaceLights(True, request.new_type, request.max_count, request.surfaces)
        snapshot = self._checked_snapshot(search)
        low, high = self._size(search, snapshot).seconds(self._pace or usual_pace())
        text = " ".join(self._attempts(search, snapshot))
        is_measured = self._pace is not None
        return [protocol.PlacingEstimate(text=text, seconds=(low, high), is_measured=is_measured)]

    def _checked_snapshot(self, request: protocol.PlaceLights) -> SessionSnapshot:
        """Return the snapshot. Raises LightpaintError if there is nothing to search for."""
        snapshot = self._access.snapshot()
        if not snapshot.painted_views:
            raise PaintError("nothing is painted yet: paint first, so that the search has a goal")
        if self._rig.scene.is_spectral:
            raise PaintError(
                "with spectra all lights stay where they are: open the scene without ",
                Hint("spectral", True),
                " to search for places",
            )
        if request.new_type is not None:
            self._new_lights(request, snapshot)
        elif not self._freedoms(snapshot):
            raise PaintError("no light is free to move: unlock a point, a spot or a sun")
        return snapshot

    def _size(self, request: protocol.PlaceLights, snapshot: SessionSnapshot) -> SearchSize:
        """Return what a search has to do."""
        is_move = request.new_type is None
        lights, new = (len(self._freedoms(snapshot)), 0) if is_move else (0, request.max_count)
        sizes = [snapshot.bases[k].size for k in snapshot.painted_views]
        return SearchSize.of(lights, new, sum(height * width for height, width in sizes))

    def _attempts(self, request: protocol.PlaceLights, snapshot: SessionSnapshot) -> list[str]:
        """Return sentences on what a search tries: which lights, and what they may do."""
        if request.new_type is not None:
            count, surfaces = request.max_count, request.surfaces
            where = f"on {some_names(surfaces)}" if surfaces else "anywhere free"
            plural = "s" * (count > 1)
            return [f"At most {count} new {request.new_type}{plural}, {where}."]
        by_freedom: dict[str, list[str]] = {}
        for name, freedom in self._freedoms(snapshot).items():
            by_freedom.setdefault(_freedom_text(freedom), []).append(name)
        return [f"{some_names(names)}: {text}." for text, names in by_freedom.items()]

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

    def _new_lights(self, request: protocol.PlaceLights, snapshot: SessionSnapshot) -> NewLights:
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

    def _run(self, request: protocol.PlaceLights) -> None:
        """Search, publish the result and note it."""
        snapshot, began_s = self._access.snapshot(), time.monotonic()
        attempts, size = self._attempts(request, snapshot), self._size(request, snapshot)
        text, names = self._result(request, snapshot)
        seconds = time.monotonic() - began_s
        has_ended_early = self._request is not request or self._ended_request is request
        if not has_ended_early:
            self._pace = size.pace_of(seconds)
        is_move = request.new_type is None
        title = "let lights move" if is_move else f"find places for a new {request.new_type}"
        self.notes.add(title, text, attempts, seconds)
        self._publisher.publish(protocol.PlacingResult(text=text, names=names))

    def _result(
        self, request: protocol.PlaceLights, snapshot: SessionSnapshot
    ) -> tuple[str, tuple[str, ...]]:
        """Search and hang the lights; return what came of it, and the names of these lights."""

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
            if self._request is not None:  # a page waits for the next one
                raise
            return "Stopped: every light stays where it was.", ()
        except _OutdatedError:
            return _outdated(request), ()
        except LightpaintError as error:
            return Sentence(f"No light was {_done(request)}: ", error), ()
        is_early = self._ended_request is request
        if not placed:
            early_text = "Stopped: nothing better was found until then."
            return early_text if is_early else NOTHING_BETTER, ()
        if placed_delta_e >= current_delta_e:
            # The search measures light, which may differ from the visible error, for example in the
            # dark.
            reason = (
                f"what was found is no closer to the eye (ΔE {placed_delta_e:.1f} "
                f"instead of {current_delta_e:.1f})"
            )
            return f"No light was {_done(request)}: {reason}.", ()
        label = f"{'move' if request.new_type is None else 'add'} {', '.join(placed)}"
        if not self._hang_lights(label, placed, snapshot.requests.placed):
            return _outdated(request), ()
        summary = "; ".join(map(str, (*placement.moves, *placement.additions)))
        gain = f"ΔE {current_delta_e:.1f} → {placed_delta_e:.1f}"
        return f"{'Stopped with the best so far: ' * is_early}{summary}. {gain}.", tuple(placed)

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

    def _searched(
        self, request: protocol.PlaceLights, snapshot: SessionSnapshot, check: Callable[[], None]
    ) -> tuple[Solution, Placement]:
        """Return the exact answer of the paintings, and the result of the search."""
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
            scenes,
            moved.bases,
            solution,
            freedoms,
            new=new,
            progress=self._publisher.reporter(check, "place", "steps"),
            watch=watch,
            is_enough=lambda: self._ended_request is request,
        )
        return solution, placement


def _trial(sites: Mapping[str, Site]) -> protocol.TrialPlaces:
    """Return the trial places, for pages to mark."""
    return protocol.TrialPlaces(
        positions={name: x.position for name, x in sites.items() if x.position is not None},
        directions={name: x.direction for name, x in sites.items() if x.direction is not None},
    )


def _freedom_text(freedom: Freedom) -> str:
    """Return what a light may do: `slide by up to 0.6, turn by up to 60°`."""
    parts = []
    if freedom.slides:
        distance = freedom.within
        parts.append("slide" if distance is None else f"slide by up to {distance:.2g}")
    if freedom.turn:
        parts.append(f"turn by up to {freedom.turn:.0f}°")
    if freedom.cone is not None:
        parts.append("open or close its cone")
    return ", ".join(parts) or "stay"


def _done(request: protocol.PlaceLights) -> str:
    return "moved" if request.new_type is None else "added"


def _outdated(request: protocol.PlaceLights) -> str:
    return f"No light was {_done(request)}: lights were moved by hand meanwhile."


def pose_values(move: Move, before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the pose of a light after a move, for JSON. before: its earlier pose."""
    pose: Pose = move.pose
    values = dict(before)
    for key in ("position", "target", "cutoff", "beam"):
        value = getattr(pose, key)
        if value is not None:
            values[key] = listed(value) if isinstance(value, tuple) else value
    return values
