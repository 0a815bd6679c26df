"""Lights that a session moves: whoever has the renderer makes their planes, at any place."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from lightpaint.basis.basis import Basis
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.session.live_answer import LiveAnswer

#: Poses of moved lights by name, as `SessionRequests.poses`.
Poses = Mapping[str, Mapping[str, Any]]


class PlaneSource(Protocol):
    """The planes of moved lights."""

    def check(self, poses: Poses) -> None:
        """Raise LightpaintError for poses that these lights cannot have."""

    def bases(self, bases: Sequence[Basis], poses: Poses) -> list[Basis]:
        """Return the bases of all views with the planes of moved lights, rendered or estimated."""


class NoPlaneSource:
    """The source of sessions without a scene, whose lights have no places."""

    def check(self, poses: Poses) -> None:
        """Raise PaintError for any pose."""
        if poses:
            raise PaintError("there is no scene to render: its lights cannot be moved")

    def bases(self, bases: Sequence[Basis], poses: Poses) -> list[Basis]:
        """Return the bases as they are. Raises PaintError for any pose."""
        self.check(poses)
        return list(bases)


class MovedLights:
    """The poses that the planes of a session's views are of. Updated in place.

    source: makes the planes. bases: of all views, with every light where the scene has it.
    """

    def __init__(self, source: PlaneSource, bases: Sequence[Basis]) -> None:
        self._source, self.bases = source, tuple(bases)
        self._poses: Poses = {}

    def check(self, poses: Poses) -> None:
        """Raise LightpaintError for poses that these lights cannot have."""
        self._source.check(poses)

    def follow(self, poses: Poses, views: Canvases, live_answer: LiveAnswer) -> None:
        """Give `views` the planes of `poses`, if they have others."""
        names = {*poses, *self._poses}
        changed = [name for name in names if poses.get(name) != self._poses.get(name)]
        self.renew(changed, poses, views, live_answer)

    def renew(
        self, names: Sequence[str], poses: Poses, views: Canvases, live_answer: LiveAnswer
    ) -> None:
        """Give `views` the planes of `poses`, of which those of these lights are others."""
        if not names:
            return
        bases = self._source.bases(self.bases, poses)
        numbers = [bases[0].names.index(name) for name in names]
        views.replace_planes(bases, numbers)
        live_answer.follow_planes()
        self._poses = dict(poses)

    def improve(self, bases: Sequence[Basis], poses: Poses) -> list[Basis]:
        """Continue with bases of more samples; return them with the planes of moved lights."""
        self.bases, self._poses = tuple(bases), dict(poses)
        return self._source.bases(bases, poses) if poses else list(bases)
