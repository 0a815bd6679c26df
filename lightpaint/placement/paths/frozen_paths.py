"""The camera's paths, frozen once, and the image of any light at any place as a sum over them.

A path tracer adds, at each vertex of a camera path, the light that arrives from a light and is
reflected back along the path. The paths do not depend on lights that no ray meets by chance
(points, spots, suns), so they are traced once and kept. The image of such a light at any place then
takes one shadow ray from each vertex: no scene is loaded and no kernel compiled. All places use the
same paths, so the noise of a comparison cancels.

First hits are many and well spread, since direct light has edges. Only a few of them are continued:
indirect light is smooth, and is averaged along surfaces (images/surface_filter.py).
"""

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Floats, aligned
from lightpaint.errors import SceneError
from lightpaint.images.denoiser import Features
from lightpaint.images.surface_filter import SurfaceFilter
from lightpaint.placement.paths.camera_paths import (
    Vertices,
    first_hits_of,
    later_vertices_of,
    longest_path,
)
from lightpaint.placement.paths.light_origin import (
    ORIGIN_VALUES,
    SPREAD,
    LightOrigin,
    added_light,
)
from lightpaint.placement.paths.panel_site import PanelSite
from lightpaint.placement.paths.panels_in_view import SightLines
from lightpaint.placement.paths.shared_vertices import SharedVertices
from lightpaint.placement.paths.spot_cones import away_from, share_in_cone
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed

#: Shadow rays of one launch; more would only take more memory.
LANES = 2**20

#: Number of cached values at vertices, which limits the number of cached origins.
KEPT_VALUES = 2**24


class FrozenPaths:
    """Paths of the camera of a scene, on its film. They are valid only while the scene is loaded.

    Args:
        scene: The scene, on a small film: columns are made for each of its pixels.
        loaded: That scene, loaded; see `Scene.while_loaded`.
        first_hits: First hits of a pixel, a square number.
        bounces: Paths per pixel that continue from further first hits; 0 for direct light only.
        shared: Largest number of vertices after first hits that take the light of a place, for all
            others near them; None for all.
        seed: Of the paths.

    Raises:
        SceneError: For scenes with fog or other media that scatter light.
    """

    def __init__(
        self,
        scene: Scene,
        loaded: Any,
        *,
        first_hits: int = 16,
        bounces: int = 4,
        shared: int | None = None,
        seed: int = 0,
    ) -> None:
        if scene.has_media:
            raise SceneError(f"{scene.path} has fog or the like: lights cannot be moved in it")
        self.size, self.loaded = scene.size, loaded
        self.hides_panels = scene.integrator.hide_emitters
        self._side = side = math.isqrt(first_hits)
        if side**2 != first_hits:
            raise SceneError(f"first_hits is {first_hits}: expected a square number, like 16")
        self._camera, longest = scene.camera(loaded), longest_path(scene)
        rng = np.random.default_rng(pass_seed(seed, Stream.FROZEN_PATHS, 0))
        with tracing():
            self.direct = first_hits_of(loaded, self._camera, self.size, side, rng)
            self.indirect = (
                later_vertices_of(loaded, self._camera, self.size, bounces, longest, rng)
                if bounces and longest > 1
                else None
            )
            if shared is not None and self.indirect is not None:
                self.indirect = SharedVertices.of(self.indirect, shared, rng)
        self._shift = rng.random(2)
        self._panel_points: dict[int, tuple[Any, Any]] = {}
        self._filter: SurfaceFilter | None = None
        self._kept: OrderedDict[tuple[int, LightOrigin], _Shone] = OrderedDict()

    def filtered_along(self, features: Features) -> "FrozenPaths":
        """Make `columns` average indirect light along surfaces. features: of the film's pixels."""
        self._filter = SurfaceFilter(features)
        return self

    def columns(self, sites: Sequence[Site]) -> Floats:
        """Return the images of lights at unit intensity, (k, h, w, 3) float32 linear Rec.709.

        sites: of points and spots at intensity 1 W/sr, of panels at radiance 1 W/(m² sr) and,
        without a position, of suns at 1 W/m².
        """
        images = self._sums(self.direct, sites).reshape(-1, *self.size, 3)
        if self.indirect is not None:
            images += self.indirect_images(sites)
        for image, site in zip(images, sites, strict=True):
            self.add_panel(image.reshape(-1, 3), site)
        return images

    def add_panel(self, image: Floats, site: Site) -> None:
        """Add a panel itself, at unit radiance, to the image (h · w, 3) of what it lights.

        Its front shines; its back hides what is behind it, too.
        """
        if isinstance(site, PanelSite) and site.position and not self.hides_panels:
            front, back = self._covered(site)
            image *= 1 - (front + back)[:, None]
            image += front[:, None]

    def hidden(self, site: Site) -> Floats:
        """Return the share of each pixel that a panel hides, with either side, (h · w,) float32."""
        if isinstance(site, PanelSite) and site.position and not self.hides_panels:
            return np.asarray(self._covered(site).sum(axis=0))
        return np.zeros(self.size[0] * self.size[1], np.float32)

    def _covered(self, site: PanelSite) -> Floats:
        """Return the shares of pixels that the front and the back of a panel fill, (2, h · w)."""
        shares = np.zeros((2, self.size[0] * self.size[1]), np.float32)
        assert site.position is not None
        lines = self.sight_lines.near(site.position, site.radius)
        axis = np.array(site.direction or (0.0, 0.0, 1.0))
        both_sides = np.stack([site.half_sides] * 2)
        covered = lines.covered(site.position, np.stack([axis, -axis]), both_sides)
        for row, filled in zip(shares, covered, strict=True):
            np.add.at(row, lines.pixels, filled)
        return shares

    @cached_property
    def sight_lines(self) -> SightLines:
        """The lines of sight along which the camera sees panels."""
        return SightLines.of(self.loaded, self._camera, self.size, self._side)

    def indirect_images(self, sites: Sequence[Site]) -> Floats:
        """Return the images of indirect light alone, (k, h, w, 3) float32; see `columns`."""
        images = np.zeros((len(sites), *self.size, 3), np.float32)
        if self.indirect is None:
            return images
        for image, sums in zip(images, self._sums(self.indirect, sites), strict=True):
            raw = sums.reshape(image.shape)
            image[...] = raw if self._filter is None else self._filter(raw)
        return images

    def contributions(self, vertices: Vertices, sites: Sequence[Site]) -> Floats:
        """Return contributions of sites at the vertices, (k, v, 3); of spots without their cone."""
        shone = self._shone(vertices, [LightOrigin.of(site) for site in sites])
        return np.stack([each.light.T for each in shone])

    def points(self, vertices: Vertices) -> Floats:
        """Return the places of vertices, (v, 3)."""
        return vertices.points

    def _sums(self, vertices: Vertices, sites: Sequence[Site]) -> Floats:
        """Return the images of lights from their contributions at vertices, (k, h · w, 3)."""
        count = self.size[0] * self.size[1]
        sums = np.empty((len(sites), count, 3), np.float32)
        origins = [LightOrigin.of(site) for site in sites]
        # Sites of one origin, like the directions of a spot, share its shadow rays.
        by_origin: dict[LightOrigin, list[int]] = {}
        for k, origin in enumerate(origins):
            by_origin.setdefault(origin, []).append(k)
        distinct = [*by_origin]
        at_once = max(1, LANES // max(len(vertices), 1))
        for start in range(0, len(distinct), at_once):
            batch = distinct[start : start + at_once]
            for origin, shone in zip(batch, self._shone(vertices, batch), strict=True):
                for k in by_origin[origin]:
                    light, site = shone.towards(sites[k]), sites[k]
                    blocked = vertices.blocked(site) if isinstance(site, PanelSite) else None
                    sums[k] = vertices.pixel_sums(light, count, blocked).T
        return sums

    def _shone(self, vertices: Vertices, origins: Sequence[LightOrigin]) -> "list[_Shone]":
        """Return contributions of origins at vertices; recent ones are cached."""
        number = 0 if vertices is self.direct else 1
        cached = {x: self._kept[number, x] for x in origins if (number, x) in self._kept}
        missing = [x for x in dict.fromkeys(origins) if x not in cached]
        if missing:
            light = self._launch(vertices, np.stack([x.row for x in missing]))
            for origin, shone in zip(missing, light, strict=True):
                cached[origin] = _Shone(shone, vertices, origin)
        most = max(2, KEPT_VALUES // (6 * max(len(vertices), 1)))
        for origin in [*cached][-most:]:
            self._kept[number, origin] = cached[origin]
            self._kept.move_to_end((number, origin))
        while len(self._kept) > 2 * most:
            self._kept.popitem(last=False)
        return [cached[origin] for origin in origins]

    def panel_points(self, count: int) -> tuple[Any, Any]:
        """Return the points of a panel that vertices sample, two coordinates from -1 to 1."""
        import mitsuba as mi

        if count not in self._panel_points:
            start = np.arange(count)[:, None] * np.array(SPREAD) + self._shift
            u, v = (mi.Float(aligned(x, np.float32)) for x in (2 * (start % 1) - 1).T)
            self._panel_points[count] = u, v
        return self._panel_points[count]

    def _launch(self, vertices: Vertices, rows: Floats) -> Floats:
        """Return the light of origins at vertices, (k, 3, v). rows: (k, ORIGIN_VALUES)."""
        import drjit as dr
        import mitsuba as mi

        count, lights = len(vertices), len(rows)
        if not count:
            return np.zeros((lights, 3, 0), np.float32)
        with tracing():
            u, v = self.panel_points(count)
            table = mi.Float(np.ascontiguousarray(rows, np.float32).ravel())
            sums = dr.zeros(mi.Float, 3 * count * lights)
            dr.make_opaque(sums, table, u, v)
            lane, width = dr.arange(mi.UInt32, count), dr.opaque(mi.UInt32, count)
            last = dr.opaque(mi.UInt32, lights)

            def add(light: Any) -> tuple[Any]:
                row = [
                    dr.gather(mi.Float, table, light * ORIGIN_VALUES + k)
                    for k in range(ORIGIN_VALUES)
                ]
                added = added_light(self.loaded, vertices, row, (u, v))
                for channel in range(3):
                    dr.scatter(sums, added[channel], (light * 3 + channel) * width + lane)
                return (light + 1,)

            dr.while_loop((mi.UInt32(0),), lambda light: light < last, add)
            values: Floats = np.array(sums, dtype=np.float32).reshape(lights, 3, count)
        return values


@dataclass(frozen=True)
class _Shone:
    """The light of an origin at vertices. light: (3, v)."""

    light: Floats
    vertices: Vertices
    origin: LightOrigin

    def towards(self, site: Site) -> Floats:
        """Return the part of it within the cone of a spot, (3, v); all of it for other lights."""
        if site.position is None or site.cutoff is None:
            return self.light
        beam = site.cutoff if site.beam is None else site.beam
        direction = np.asarray(site.direction or (0.0, 0.0, 1.0), np.float32)
        share = share_in_cone(self._away @ direction, site.cutoff, min(beam, site.cutoff))
        return np.asarray(self.light * share)

    @cached_property
    def _away(self) -> Floats:
        return away_from(self.origin.position, self.vertices.points)
