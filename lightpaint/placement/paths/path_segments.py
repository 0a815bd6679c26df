"""The segments of paths between vertices, which a panel in the room blocks.

Paths are traced without the panels that a search tries. But a panel is a thing in the room: light
that its own front sends to a wall close by would not reach the rest of the room through the panel.

Steps of a search are short. So the segments that pass near a panel are kept, and only these are
tested at the next place, with the vertices that follow them.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.placement.paths.panel_site import PanelSite

#: Radius of a region, relative to that of the panel in its middle, and number of kept regions.
REACH, KEPT = 2.0, 4

#: Segments that are tested at once, so that they stay in a processor's cache.
AT_ONCE = 2**14


@dataclass(frozen=True)
class PathSegments:
    """The segments of paths after the first hits.

    points: (q, 3), all hits, in the order of `blocks`. starts: (q,), the index of the hit before
    each; a first hit's own. blocks: hits that depend on earlier blocks alone. vertices: (q,), the
    index of the vertex that each hit is; −1 for first hits.
    """

    points: Floats
    starts: Indices
    blocks: Sequence[slice]
    vertices: Indices
    _regions: deque["_Region"] = field(default_factory=lambda: deque(maxlen=KEPT), repr=False)

    def blocked(self, site: PanelSite) -> Indices:
        """Return the indices of the vertices that a panel cuts off from the camera.

        Only segments count: what the panel hides of the first hits is in the share of each pixel
        that it covers.
        """
        place, radius = np.array(site.position, dtype=float), site.radius
        region = next((its for its in self._regions if its.contains(place, radius)), None)
        if region is None:
            region = self._around(place, REACH * radius)
            self._regions.appendleft(region)
        return region.blocked(site)

    def _around(self, place: Doubles, radius: float) -> "_Region":
        """Return the segments within `radius` of a place, and all that follow them."""
        is_kept = np.zeros(len(self.points), bool)
        for block in self.blocks:
            for start in range(block.start, block.stop, AT_ONCE):
                some = slice(start, min(start + AT_ONCE, block.stop))
                before = self.starts[some]
                is_kept[some] = is_kept[before] | _pass_near(
                    self.points[before], self.points[some], place, radius
                )
        hits = np.flatnonzero(is_kept)
        local = np.full(len(self.points), -1)
        local[hits] = np.arange(len(hits))
        edges = np.searchsorted(hits, [block.start for block in self.blocks] + [len(is_kept)])
        return _Region(
            place,
            radius,
            self.points[self.starts[hits]],
            self.points[hits],
            local[self.starts[hits]],
            [slice(*edges[k : k + 2]) for k in range(len(self.blocks))],
            self.vertices[hits],
        )


@dataclass(frozen=True)
class _Region:
    """The segments near a place, and all that follow them on their paths.

    firsts, ends: (s, 3), of the segments. before: (s,), the index of the segment before each; −1 if
    that is not among them. blocks: segments that depend on earlier blocks alone. vertices: (s,),
    those at the ends.
    """

    place: Doubles
    radius: float
    firsts: Floats
    ends: Floats
    before: Indices
    blocks: Sequence[slice]
    vertices: Indices

    def contains(self, place: Doubles, radius: float) -> bool:
        """Return whether all segments that meet a sphere are in it."""
        return float(np.linalg.norm(place - self.place)) + radius <= self.radius

    def blocked(self, site: PanelSite) -> Indices:
        """Return the vertices that a panel in the region cuts off."""
        place, axis = (
            np.array(its or (0.0, 0.0, 1.0), np.float32) for its in (site.position, site.direction)
        )
        start, end = ((points - place) @ axis for points in (self.firsts, self.ends))
        hits = np.flatnonzero(start * end < 0)
        share = (start[hits] / (start[hits] - end[hits]))[:, None]
        across = (1 - share) * self.firsts[hits] + share * self.ends[hits] - place
        half_sides = site.half_sides
        is_inside = np.abs(across @ half_sides.T) <= np.square(half_sides).sum(axis=1)
        # One more, at −1, for segments before which none is near.
        blocked = np.zeros(len(self.before) + 1, bool)
        blocked[hits[is_inside.all(axis=1)]] = True
        for block in self.blocks:
            blocked[:-1][block] |= blocked[self.before[block]]
        return np.asarray(self.vertices[blocked[:-1]])


def _pass_near(firsts: Floats, ends: Floats, place: Doubles, radius: float) -> Bools:
    """Return which segments pass within `radius` of a place."""
    ways, towards = ends - firsts, place.astype(np.float32) - firsts
    lengths = np.maximum(np.einsum("sk,sk->s", ways, ways), np.float32(1e-20))
    share = np.clip(np.einsum("sk,sk->s", ways, towards) / lengths, 0, 1)
    towards -= share[:, None] * ways
    return np.asarray(np.einsum("sk,sk->s", towards, towards) < radius**2)
