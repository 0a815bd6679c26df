"""The image of one light as a sum over frozen paths, with the cone of a spot, in one kernel.

`FrozenPaths.columns` caches the light at each vertex for many directions of a spot. Here a light is
at a new place each time, so nothing is cached: the kernel adds to the pixels itself, and traces no
rays outside the cone of a spot.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats, aligned
from lightpaint.placement.paths.camera_paths import Vertices
from lightpaint.placement.paths.frozen_paths import FrozenPaths
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.vertex_light import ORIGIN_VALUES, LightOrigin, added_light
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing


class PathSums:
    """Sums of the light of one site at a time over the vertices of each pixel.

    paths: have these vertices, and stay loaded. pixel_count: of the picture that the vertices'
    pixels are indices into; by default that of the paths.
    """

    def __init__(
        self, paths: FrozenPaths, vertices: Vertices, pixel_count: int | None = None
    ) -> None:
        import drjit as dr
        import mitsuba as mi

        self._loaded, self._vertices = paths.loaded, vertices
        self._values = 3 * (pixel_count or paths.size[0] * paths.size[1])
        is_one_each = np.bincount(vertices.pixels).max(initial=0) <= 1
        mode = dr.ReduceMode.NoConflicts if is_one_each else dr.ReduceMode.Auto
        # Tracing the kernel anew for each light takes longer than running it.
        self._add = _adder(mode, vertices.pixels)
        with tracing():
            self._panel_points = paths.panel_points(len(vertices))
            self._first = mi.UInt32(aligned(3 * vertices.pixels, np.uint32))
            dr.make_opaque(self._panel_points, self._first)

    def __call__(self, site: Site) -> Any:
        """Return the sums as an array of Dr.Jit, three values for each pixel."""
        import drjit as dr
        import mitsuba as mi

        vertices = self._vertices
        with tracing():
            sums = dr.zeros(mi.Float, self._values)
            row = mi.Float(_row(site))
            dr.make_opaque(sums, row)
            if not len(vertices):
                return sums
            throughput = vertices.throughput
            blocked = vertices.blocked(site) if isinstance(site, PanelSite) else None
            if blocked is not None and len(blocked):
                shown = np.ones(len(vertices), np.float32)
                shown[blocked] = 0
                throughput = throughput * mi.Float(shown)
                dr.make_opaque(throughput)
            paths = vertices.interaction, throughput
            sums = self._add(self._loaded, *paths, self._panel_points, self._first, row, sums)
            dr.eval(sums)
        return sums


def _adder(mode: Any, pixels: npt.NDArray[np.int64]) -> Callable[..., Any]:
    """Return a function that adds the light of a site to sums, traced once.

    mode: how light is added. pixels: of the vertices.
    """
    import drjit as dr
    import mitsuba as mi

    def add(
        loaded: Any, interaction: Any, throughput: Any, points: Any, first: Any, row: Any, sums: Any
    ) -> Any:
        values = [dr.gather(mi.Float, row, k) for k in range(ORIGIN_VALUES + _CONE_VALUES)]
        origin, cone = values[:ORIGIN_VALUES], values[ORIGIN_VALUES:]

        def share_towards(direction: Any) -> Any:
            angle = dr.acos(dr.clip(dr.dot(direction, mi.Vector3f(*cone[:3])), -1, 1))
            return dr.clip((cone[3] - angle) * cone[4], 0, 1)

        vertices = Vertices(interaction, throughput, pixels)
        light = added_light(loaded, vertices, origin, points, share_towards)
        for channel in range(3):
            dr.scatter_add(sums, light[channel], first + channel, mode=mode)
        return sums

    traced_once: Callable[..., Any] = dr.freeze(add)
    return traced_once


#: Values of a cone that a kernel reads: axis, cutoff, and the reciprocal of its width outside the
#: beam.
_CONE_VALUES = 5

#: Cutoff of a light that shines in all directions, beyond any angle.
_NO_CUTOFF = 10.0


def _row(site: Site) -> Floats:
    """Return the origin of a site and its cone for a kernel, angles in radians."""
    axis, cutoff, beam = site.direction or (0.0, 0.0, 1.0), _NO_CUTOFF, _NO_CUTOFF - 1
    if site.position is not None and site.cutoff is not None:
        cutoff = math.radians(site.cutoff)
        beam = cutoff if site.beam is None else min(math.radians(site.beam), cutoff)
    slope = 1 / max(cutoff - beam, math.radians(1e-6))
    return np.array([*LightOrigin.of(site).row, *axis, cutoff, slope], np.float32)
