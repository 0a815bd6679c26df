"""The illuminance of each light on measuring planes, measured while the brush moves, and the planes
as pictures show them: the camera of a view, and the points that it sees.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.errors import LightpaintError
from lightpaint.paint.background_threads import LatestWork, StoppedError
from lightpaint.paint.protocol import Camera, Message, Notice, ProgressReport
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.page_geometry import camera_of
from lightpaint.paint.session.session_planes import PlaneSight, SessionPlanes
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject import Subject
from lightpaint.progress import Progress, listener
from lightpaint.scene import Scene
from lightpaint.scene.runtime.render_lock import MITSUBA

#: The name of the task in reports of progress.
TASK = "planes"

#: Clear surfaces that a ray passes at most, such as panes of glass.
MAX_PASSED = 16
#: Part of the distance to a point within which a surface counts as the one that it lies on.
TOUCHING_SHARE = 1e-3


class PlaneMeasurements:
    """A thread's loop that measures the planes of one studio, again after lights have moved.

    rig: has the lights at their places. show: returns the state for pages.
    """

    def __init__(
        self,
        links: StudioLinks,
        subjects: Sequence[Subject],
        rig: LampRig,
        *,
        show: Callable[[], Message],
        on_measured: Callable[[], None],
    ) -> None:
        self._access, self._publisher, self._threads = links
        self._subjects, self._rig = tuple(subjects), rig
        self._show, self._on_measured = show, on_measured
        self._work = LatestWork(self._measure, self._publisher.publish)
        self._place_key: str | None = None  # of the last measurement that was begun or is due
        self.stop = self._work.stop

    @property
    def is_wanted(self) -> bool:
        """True if the session has measuring planes, or a limit of power."""
        settings = self._subjects[0].settings
        return (settings.planes, settings.watts) != (None, None)

    def follow(self) -> None:
        """Measure the planes, unless that was done with the lights where they are now.

        While lights are dragged, nothing is measured.
        """
        if not self.is_wanted:
            return
        with self._access.lock:
            if not self._access.is_ready or self._access.session.is_open:
                return
            session = self._access.session
            requests = session.requests
            if requests.place_key == self._place_key:
                return
            is_first, self._place_key = self._place_key is None, requests.place_key
        if is_first:
            self._threads.start_low_priority(self._work.run, TASK)
        self._work.give(requests)

    def _measure(self, requests: SessionRequests) -> None:
        """Measure the planes with the lights of these requests, and publish the state with them."""
        report = self._publisher.reporter(lambda: self._check(requests), TASK)
        try:
            with MITSUBA.low_priority():
                planes = self._measured(requests, report)
            self._publisher.publish_made(partial(self._accept, planes))
            self._on_measured()
        except StoppedError:
            if not self._publisher.is_open:
                raise
        except LightpaintError as error:  # after the next move they are measured again
            self._publisher.publish(Notice(text=str(error), tone="warn"))
        finally:
            self._publisher.publish(ProgressReport(task=TASK, done=1, total=1, unit=""))

    def _measured(self, requests: SessionRequests, progress: Progress) -> SessionPlanes:
        """Return the planes with the lights of these requests; without a planes file, no planes and
        a limit of power.
        """
        # Imported here: a session without planes needs no renderer.
        from lightpaint.pipeline import constraints_and_scale, limited_power, measure_planes

        settings, sights = self._subjects[0].settings, tuple[PlaneSight, ...]()
        if settings.planes is None:
            assert settings.watts is not None
            measured = limited_power(settings.watts, self._access.session.basis.lights)
        else:
            views = [self._rig.moved_scene(requests.placed, k) for k in range(len(self._subjects))]
            given, listen = self._subjects[0].constraints, listener(progress)
            _, scale = constraints_and_scale(views[0], given, settings)
            measured = measure_planes(views[0], settings.planes, settings, scale, listen)
            points = np.concatenate([plane.points for plane in measured.file.planes])
            sights = tuple(plane_sight(view, points) for view in views)
        return SessionPlanes(
            measured.illuminance,
            measured.file.power,
            measured.floor_m2,
            requests.place_key,
            measured.file.cases,
            sights,
        )

    def _check(self, requests: SessionRequests) -> None:
        """Raise StoppedError if lights have moved since."""
        if self._place_key != requests.place_key:
            raise StoppedError

    def _accept(self, planes: SessionPlanes) -> Message:
        """Give the session the measured planes, and return the state with them."""
        self._access.session.set_measured_planes(planes)
        return self._show()


def plane_sight(scene: Scene, points: Doubles) -> PlaneSight:
    """Return how the picture of a scene shows points (p, 3). The scene is loaded for that."""

    def look(loaded: Any) -> PlaneSight:
        camera = camera_of(scene, loaded)
        if camera is None:
            return PlaneSight(None, np.zeros(len(points), bool))
        return PlaneSight(camera, seen_points(loaded, camera, points))

    return scene.while_loaded(look)


def seen_points(loaded: Any, camera: Camera, points: Doubles) -> Bools:
    """Return which points (p, 3) nothing covers in the picture of a camera, (p,).

    They may lie beyond its edges. Clear surfaces, such as glass, cover nothing.
    """
    import mitsuba as mi

    ways = _ways_to(camera, points)
    starts, lengths = points - ways, np.linalg.norm(ways, axis=1)
    directions = ways / np.maximum(lengths, 1e-30)[:, None]
    left = lengths * (1 - TOUCHING_SHARE)
    is_seen, is_open = np.ones(len(points), bool), lengths > 0
    for _ in range(MAX_PASSED):
        rays = np.flatnonzero(is_open)
        if not rays.size:
            break
        ray = mi.Ray3f(mi.Point3f(starts[rays].T), mi.Vector3f(directions[rays].T))
        si = loaded.ray_intersect(mi.Ray3f(ray, mi.Float(left[rays])))
        is_hit = np.array(si.is_valid()).ravel()
        flags, kinds = si.bsdf().flags(), (mi.BSDFFlags.Null, mi.BSDFFlags.DeltaTransmission)
        is_clear = np.any([np.array(mi.has_flag(flags, kind)).ravel() for kind in kinds], axis=0)
        is_seen[rays], is_open[rays] = ~is_hit | is_clear, is_hit & is_clear
        # Behind a clear surface the ray goes on.
        passed = np.where(is_hit, np.array(si.t, float).ravel(), 0) + TOUCHING_SHARE * lengths[rays]
        starts[rays] += passed[:, None] * directions[rays]
        left[rays] -= passed
        is_open &= left > 0
    return is_seen


def _ways_to(camera: Camera, points: Doubles) -> Doubles:
    """Return the vectors from where rays begin to the points that they reach, (p, 3)."""
    offsets: Doubles = points - np.array(camera.origin)
    if not camera.is_parallel:
        return offsets
    forward = np.array(camera.forward) / np.linalg.norm(camera.forward)
    return np.asarray(np.outer(offsets @ forward, forward))
