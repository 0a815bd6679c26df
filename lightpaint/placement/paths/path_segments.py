"""The segments of paths between vertices, which a panel in the room blocks.

Paths are traced without the panels that a search tries. But a panel is a thing in the room: light
that its own front sends to a wall close by would not reach the rest of the room through the panel.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Floats, Indices
from lightpaint.placement.paths.panel_site import PanelSite


@dataclass(frozen=True)
class PathSegments:
    """The segments of paths after the first hits.

    points: (q, 3), all hits, in the order of `blocks`. starts: (q,), the index of the hit before
    each; a first hit's own. blocks: hits that depend on earlier blocks alone. vertices: (v,), the
    index of the hit that is each vertex.
    """

    points: Floats
    starts: Indices
    blocks: Sequence[slice]
    vertices: Indices

    def blocked(self, site: PanelSite) -> Bools | None:
        """Return the vertices that a panel cuts off from the camera, (v,); None if there are none.

        Only segments count: what the panel hides of the first hits is in the share of each pixel
        that it covers.
        """
        place, axis = (
            np.array(its or (0.0, 0.0, 1.0), np.float32) for its in (site.position, site.direction)
        )
        height = self.points @ axis - place @ axis
        before = height[self.starts]
        ends = np.flatnonzero(height * before < 0)
        starts = self.starts[ends]
        share = before[ends] / (before[ends] - height[ends])
        across = self.points[starts] - place
        across += share[:, None] * (self.points[ends] - self.points[starts])
        half_sides = site.half_sides
        lengths = np.square(half_sides).sum(axis=1)
        ends = ends[(np.abs(across @ half_sides.T) <= lengths).all(axis=1)]
        if not len(ends):
            return None
        blocked = np.zeros(len(self.points), bool)
        blocked[ends] = True
        for block in self.blocks:
            blocked[block] |= blocked[self.starts[block]]
        return np.asarray(blocked[self.vertices])
