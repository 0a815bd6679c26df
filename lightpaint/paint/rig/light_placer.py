"""A search for better places of the lights, in the background: one step of undo if it finds any."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, Protocol

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint.background_threads import BackgroundThreads, StoppedError
from lightpaint.paint.protocol import Message, MoveLights, PlaceLights, PlacingResult, TaskStarted
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.moved_subjects import of_moved_scenes
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_requests import HOLD_KEYS
from lightpaint.paint.subject import Subject
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.place import place
from lightpaint.placement.placement import Move, Placement
from lightpaint.progress import cancellable
from lightpaint.scene.properties.pose import Pose

#: Freedom of lights for which the lights file asks for none: how far they slide, relative to the
#: size of the room, and by how many degrees they turn.
SLIDE, TURN = 0.15, 60.0


class PlacerHost(Protocol):
    """The studio, as a search for places sees it."""

    subjects: tuple[Subject, ...]

    def snapshot(self) -> SessionSnapshot:
        """Return the present paintings and requests."""

    def changing(self) -> AbstractContextManager[Session]:
        """Return a block in which nobody else changes the session."""

    def handle(self, message: MoveLights, arrays: Mapping[str, Any]) -> list[Message]:
        """Return the immediate answers to a request."""

    def publish(self, message: Message | None) -> None:
        """Send a message to pages."""

    def report_progress(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report how far a task is. Raises StoppedError once nobody wants the result any more."""


class LightPlacer:
    """Lets the painting place the lights of a session."""

    def __init__(self, host: PlacerHost, rig: LampRig, threads: BackgroundThreads) -> None:
        self._host, self._rig, self._threads = host, rig, threads
        self._request: PlaceLights | None = None

    def handle(self, request: PlaceLights) -> list[Message]:
        """Start the search, or stop it. Raises PaintError where there is nothing to search for."""
        if not request.run:
            self._request = None
            return [TaskStarted(what="stop")]
        snapshot = self._host.snapshot()
        if not snapshot.painted_views:
            raise PaintError("nothing is painted yet: paint first, then let lights move")
        if not self._freedoms(snapshot):
            raise PaintError("no light is free to move: unlock a point, a spot or a sun")
        self._request = request
        self._threads.start_low_priority(lambda: self._run(request), "place")
        return [TaskStarted(what="place")]

    def _freedoms(self, snapshot: SessionSnapshot) -> dict[str, Freedom]:
        """Return the freedom of each light that may move: as the lights file has it, or near its
        place.
        """
        freedoms = {}
        for light in snapshot.bases[0].lights:
            is_held = any(key in snapshot.requests.lights.get(light.name, {}) for key in HOLD_KEYS)
            if is_held or self._rig.why_not(light.name):
                continue
            site = self._rig.site(light.name, snapshot.requests.poses.get(light.name, {}))
            freedoms[light.name] = self._rig.freedoms.get(light.name) or Freedom(
                within=None if site.position is None else SLIDE * self._rig.extent,
                aim=site.direction is not None and TURN,
            )
        return freedoms

    def _run(self, request: PlaceLights) -> None:
        def check() -> None:
            if self._request is not request:
                raise StoppedError

        try:
            with cancellable(check):
                snapshot, placement = self._searched(check)
        except StoppedError:
            self._host.publish(PlacingResult(text="Stopped. No light was moved.", names=()))
            return
        except LightpaintError as error:
            self._host.publish(PlacingResult(text=f"No light was moved: {error}", names=()))
            return
        if not placement.moves:
            text = "No light was moved: no move is surely worth a hundredth of what is missing."
            self._host.publish(PlacingResult(text=text, names=()))
            return
        poses = {
            move.name: pose_values(move, snapshot.requests.poses.get(move.name, {}))
            for move in placement.moves
        }
        with self._host.changing() as session:
            if session.requests.poses != snapshot.requests.poses:
                text = "No light was moved: somebody moved lights meanwhile."
                self._host.publish(PlacingResult(text=text, names=()))
                return
            for message in self._host.handle(MoveLights(poses), {}):
                self._host.publish(message)
        summary = "; ".join(str(move) for move in placement.moves)
        self._host.publish(
            PlacingResult(text=summary[0].upper() + summary[1:] + ".", names=tuple(poses))
        )

    def _searched(self, check: Callable[[], None]) -> tuple[SessionSnapshot, Placement]:
        """Return the paintings that the search is for, and what it found."""

        def report(label: str, done: int, total: int, unit: str = "passes") -> None:
            del label, unit
            check()
            self._host.report_progress("place", done, total, "steps")

        snapshot = self._host.snapshot()
        self._rig.open(snapshot.bases)
        freedoms = self._freedoms(snapshot)
        subjects, moved = of_moved_scenes(self._host.subjects, snapshot, self._rig)
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
        return snapshot, place(scenes, moved.bases, solution, freedoms, progress=report)


def pose_values(move: Move, before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the pose of a light after a move, as JSON has it. before: its pose until then."""
    pose: Pose = move.pose
    values = dict(before)
    for key in ("position", "target", "cutoff", "beam"):
        value = getattr(pose, key)
        if value is not None:
            values[key] = [float(f"{x:.6g}") for x in value] if isinstance(value, tuple) else value
    return values
