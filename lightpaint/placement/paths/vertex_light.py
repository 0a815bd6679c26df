"""The light of one origin at the vertices of paths, and the part of it in the cone of a spot."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Floats, Indices
from lightpaint.placement.paths.camera_paths import Vertices
from lightpaint.placement.paths.light_origin import LightOrigin
from lightpaint.placement.paths.spot_cones import away_from, share_in_cone
from lightpaint.scene.properties.site import Site


@dataclass(frozen=True)
class VertexLight:
    """The light of an origin at vertices. lit: (l,), indices of those that have any; light: (3, l),
    of these.
    """

    lit: Indices
    light: Floats
    vertices: Vertices
    origin: LightOrigin

    @classmethod
    def of(cls, light: Floats, vertices: Vertices, origin: LightOrigin) -> "VertexLight":
        """Return the light of an origin at all vertices, (3, v)."""
        lit = np.flatnonzero(light.any(axis=0))
        return cls(lit, light[:, lit], vertices, origin)

    def towards(self, site: Site) -> Floats:
        """Return the part of it within the cone of a spot, (3, v); all of it for other lights."""
        light = self.light
        if site.position is not None and site.cutoff is not None:
            beam = site.cutoff if site.beam is None else site.beam
            direction = np.asarray(site.direction or (0.0, 0.0, 1.0), np.float32)
            share = share_in_cone(self._away @ direction, site.cutoff, min(beam, site.cutoff))
            light = light * share
        return self._at_all(light)

    @property
    def everywhere(self) -> Floats:
        """All of it, (3, v)."""
        return self._at_all(self.light)

    def _at_all(self, light: Floats) -> Floats:
        at_all = np.zeros((3, len(self.vertices)), np.float32)
        at_all[:, self.lit] = light
        return at_all

    @cached_property
    def _away(self) -> Floats:
        return away_from(self.origin.position, self.vertices.points[self.lit])
