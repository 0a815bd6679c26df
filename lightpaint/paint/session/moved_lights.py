"""Lights that a session moves or adds; their planes come from a source that has the renderer."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from lightpaint.basis import Basis, Lights
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.session.live_answer import LiveAnswer

#: Moved and added lights by name, as `SessionRequests.placed`.
Placed = Mapping[str, Mapping[str, Any]]


def added_names(placed: Placed) -> list[str]:
    """Return the names of the added lights, in order."""
    return [name for name, values in placed.items() if "kind" in values]


class PlaneSource(Protocol):
    """The planes of moved and added lights."""

    @property
    def outdated(self) -> Collection[str]:
        """Lights whose last planes were drafts, and can be better now."""

    def check(self, placed: Placed) -> None:
        """Raise LightpaintError for places that these lights cannot have."""

    def lights(self, lights: Lights, placed: Placed) -> Lights:
        """Return the lights of the scene, and behind them those that were added."""

    def bases(self, bases: Sequence[Basis], placed: Placed) -> list[Basis]:
        """Return the bases of all views with the planes of these lights, rendered or estimated."""


class NoPlaneSource:
    """The source of sessions without a scene, whose lights have no places."""

    outdated = ()

    def check(self, placed: Placed) -> None:
        """Raise PaintError for any place."""
        if placed:
            raise PaintError("there is no scene to render: its lights cannot be moved")

    def lights(self, lights: Lights, placed: Placed) -> Lights:
        """Return the lights unchanged. Raises PaintError for any place."""
        self.check(placed)
        return lights

    def bases(self, bases: Sequence[Basis], placed: Placed) -> list[Basis]:
        """Return the bases unchanged. Raises PaintError for any place."""
        self.check(placed)
        return list(bases)


class MovedLights:
    """The places at which lights have their planes in a session's views. Updated in place.

    source: makes the planes. bases: of all views, with every light at its place in the scene.
    """

    def __init__(self, source: PlaneSource, bases: Sequence[Basis]) -> None:
        self._source, self.bases = source, tuple(bases)
        self._placed: Placed = {}

    def check(self, placed: Placed) -> None:
        """Raise LightpaintError for places that these lights cannot have."""
        self._source.check(placed)

    def lights(self, placed: Placed) -> Lights:
        """Return all lights with these places."""
        lights = self.bases[0].lights
        return self._source.lights(lights, placed) if added_names(placed) else lights

    def bases_at(self, placed: Placed) -> list[Basis]:
        """Return the bases of all views with lights at these places, rendered or estimated."""
        return self._source.bases(self.bases, placed)

    def begin(self, placed: Placed, views: Canvases) -> None:
        """Give `views` the planes of `placed`, before there is an answer."""
        if placed:
            views.replace_lights(self._source.bases(self.bases, placed))
        self._placed = dict(placed)

    def follow(self, placed: Placed, views: Canvases, live_answer: LiveAnswer) -> None:
        """Give `views` the planes of `placed`, unless they have them."""
        if added_names(placed) != added_names(self._placed):
            views.replace_lights(self._source.bases(self.bases, placed))
            live_answer.set_views(views.live)
            self._placed = dict(placed)
            return
        names = {*placed, *self._placed}
        changed = [
            name
            for name in names
            if placed.get(name) != self._placed.get(name) or name in self._source.outdated
        ]
        self.renew(changed, placed, views, live_answer)

    def renew(
        self, names: Sequence[str], placed: Placed, views: Canvases, live_answer: LiveAnswer
    ) -> None:
        """Give `views` the planes of `placed`, of which the planes of the named lights were
        replaced."""
        if not names:
            return
        bases = self._source.bases(self.bases, placed)
        self._placed = dict(placed)
        mask_pairs = [
            (x.emitters_seen, view.basis.emitters_seen)
            for x, view in zip(bases, views, strict=True)
        ]
        if not all(np.array_equal(*masks) for masks in mask_pairs):  # a panel has become visible
            views.replace_lights(bases)
            live_answer.set_views(views.live)
            return
        views.replace_planes(bases, [bases[0].names.index(name) for name in names])
        live_answer.follow_planes()

    def improve(self, bases: Sequence[Basis], placed: Placed) -> list[Basis]:
        """Continue with bases of more samples; return them with the planes of placed lights."""
        self.bases, self._placed = tuple(bases), dict(placed)
        return self._source.bases(bases, placed) if placed else list(bases)
