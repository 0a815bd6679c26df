"""The camera's paths, frozen once, and the image of any light at any place as a sum over them.

A path tracer adds, at each vertex of a camera path, the light that arrives from a light and is
reflected back along the path. The paths do not depend on lights that no ray meets by chance
(points, spots, suns), so they are traced once and kept. The image of such a light at any place then
takes one shadow ray from each vertex: no scene is loaded and no kernel compiled. All places use the
same paths, so the noise of a comparison cancels.

First hits are many and well spread, since direct light has edges. Only a few of them are continued:
indirect light is smooth, and is averaged along surfaces (images/surface_filter.py).

Light from a lamp near a surface is bright on a small spot there, which few paths of a pixel meet by
chance: its indirect image would be noise. Many paths cost little to trace, but a shadow ray from
each of their vertices does, for every place of a light. Since irradiance changes little within a
cell of the scene's surfaces, the vertices of all paths in a cell take the light of one of them, and
only the throughput is each one's own.

`FrozenPaths.columns` caches the light at each vertex for many directions of a spot. `PathSums` is
for a light that is at a new place each time, so nothing is cached: its kernel adds to the pixels
itself, and traces no rays outside the cone of a spot.
"""

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices, aligned
from lightpaint.errors import SceneError
from lightpaint.images import Features, SurfaceFilter
from lightpaint.placement.paths.camera_paths import (
    Vertices,
    first_hits_of,
    joined,
    later_vertices_of,
    longest_path,
)
from lightpaint.placement.paths.panel_lights import PanelSite, SightLines
from lightpaint.placement.paths.vertex_light import (
    ORIGIN_VALUES,
    SPREAD,
    LightOrigin,
    VertexLight,
    added_light,
)
from lightpaint.scene import Scene, Stream, pass_seed
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing

#: Shadow rays of one launch; more would only take more memory.
LANES = 2**20

#: Number of cached values at vertices, which limits the number of cached origins.
KEPT_VALUES = 2**24

#: Number of panels of which it is kept what they cover.
KEPT_PANELS = 64

#: Share of vertices on either side whose distance does not count for the size of cells, and the
#: number of faces of the box of the others.
FAR_SHARE, FACES = 0.02, 6

#: Growth of cells, at least, while there are too many of them.
GROWTH = 1.05

#: Odd factors that spread cells over 64 bits.
_MIXERS = np.array(
    [0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x27D4EB2F165667C5], np.uint64
)


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
        self._rng = rng = np.random.default_rng(pass_seed(seed, Stream.FROZEN_PATHS, 0))
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
        self._filter: SurfaceFilter | None = None
        self._forget()

    def filtered_along(self, features: Features) -> "FrozenPaths":
        """Make `columns` average indirect light along surfaces. features: of the film's pixels."""
        self._filter = SurfaceFilter(features)
        return self

    def with_more_hits(self, pixels: Indices, side: int) -> "FrozenPaths":
        """Return the paths with other first hits in some pixels, side x side of each."""
        paths, is_kept = copy(self), ~np.isin(self.direct.pixels, pixels)
        with tracing():
            more = first_hits_of(self.loaded, self._camera, self.size, side, self._rng, pixels)
            kept = self.direct.at(np.flatnonzero(is_kept), self.direct.pixels[is_kept])
            paths.direct, _ = joined([kept, more])
        paths._forget()
        return paths

    def _forget(self) -> None:
        """Begin without what earlier columns keep for later ones."""
        self._panel_points: dict[int, tuple[Any, Any]] = {}
        self._kept: OrderedDict[tuple[int, LightOrigin], VertexLight] = OrderedDict()
        # Columns ask for it twice.
        self._covered = lru_cache(maxsize=KEPT_PANELS)(self._covered_by)

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

    def _covered_by(self, site: PanelSite) -> Floats:
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
        return np.stack([each.everywhere.T for each in shone])

    def points(self, vertices: Vertices) -> Floats:
        """Return the places of vertices, (v, 3)."""
        return vertices.points

    def _sums(self, vertices: Vertices, sites: Sequence[Site]) -> Floats:
        """Return the images of lights from their contributions at vertices, (k, h · w, 3)."""
        count = self.size[0] * self.size[1]
        sums = np.empty((len(sites), count, 3), np.float32)
        # Sites of one origin, like the directions of a spot, share its shadow rays.
        by_place: dict[LightOrigin, list[int]] = {}
        for k, site in enumerate(sites):
            by_place.setdefault(LightOrigin.of(site), []).append(k)
        by_origin = {
            self._origin(vertices, place, [sites[k] for k in its]): its
            for place, its in by_place.items()
        }
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

    def _origin(self, vertices: Vertices, place: LightOrigin, sites: Sequence[Site]) -> LightOrigin:
        """Return the origin of lights at a place: a kept one that shines where they do, or a new
        one with a margin.
        """
        number, origin = self._number(vertices), place.in_cone(sites)
        kept = (its for at, its in reversed(self._kept) if at == number and its.covers(origin))
        return next(kept, origin.with_margin())

    def _number(self, vertices: Vertices) -> int:
        return 0 if vertices is self.direct else 1

    def _shone(self, vertices: Vertices, origins: Sequence[LightOrigin]) -> "list[VertexLight]":
        """Return contributions of origins at vertices; recent ones are cached."""
        number = self._number(vertices)
        cached = {x: self._kept[number, x] for x in origins if (number, x) in self._kept}
        missing = [x for x in dict.fromkeys(origins) if x not in cached]
        if missing:
            light = self._launch(vertices, np.stack([x.row for x in missing]))
            for origin, shone in zip(missing, light, strict=True):
                cached[origin] = VertexLight.of(shone, vertices, origin)
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
class SharedVertices(Vertices):
    """Vertices, one of each cell, whose light the vertices of all paths in the cell take.

    pixels: none of its own, 0 for each. paths: the vertices of all paths. cells: (p,), of each of
    these.
    """

    paths: Vertices
    cells: Indices

    @classmethod
    def of(cls, paths: Vertices, most: int, rng: np.random.Generator) -> "SharedVertices":
        """Return at most `most` of the vertices of paths, which stand for all of them."""
        import drjit as dr
        import mitsuba as mi

        throughput = np.array(paths.throughput, dtype=np.float32).reshape(3, -1)
        cells = _cells(paths, most, rng)
        chosen = _one_of_each(cells, throughput.max(axis=0), rng)
        index = mi.UInt32(aligned(chosen, np.uint32))
        interaction = dr.gather(mi.SurfaceInteraction3f, paths.interaction, index)
        ones = mi.Color3f(1.0) + dr.zeros(mi.Color3f, len(chosen))
        dr.make_opaque(interaction, ones)
        # Only the throughput of the others counts from here on.
        others = Vertices(None, throughput, paths.pixels, segments=paths.segments)
        return cls(interaction, ones, np.zeros(len(chosen), np.int64), others, cells)

    def pixel_sums(self, light: Floats, count: int, blocked: Indices | None = None) -> Floats:
        """Return the sums of the light of all paths of each pixel, (3, h · w).

        light: (3, v). blocked: indices of the vertices of paths that do not count.
        """
        of_paths = np.take(light, self.cells, axis=1)
        of_paths *= self.paths.throughput
        return self.paths.pixel_sums(of_paths, count, blocked)

    def blocked(self, site: PanelSite) -> Indices | None:
        """Return the indices of vertices of paths that a panel cuts off."""
        return self.paths.blocked(site)


def _cells(vertices: Vertices, most: int, rng: np.random.Generator) -> Indices:
    """Return the number of each vertex's cell, (v,), of at most `most`.

    Cells are of one side of surfaces that look in similar directions.
    """
    points = vertices.points.astype(float)
    normals = np.array(vertices.interaction.n, dtype=np.float32).reshape(3, -1).T
    is_front = np.array(vertices.interaction.wi.z, dtype=np.float32) > 0
    facing = (np.rint(2 * normals).astype(np.int64) + 2) @ np.array([50, 10, 2]) + is_front
    start = rng.random(3)
    side = _first_side(points, most)
    while True:
        place = np.floor(points / side + start).astype(np.int64)
        key = np.concatenate([place, facing[:, None]], axis=1).astype(np.uint64) * _MIXERS
        _, cells = np.unique(key.sum(axis=1, dtype=np.uint64), return_inverse=True)
        count = int(cells.max(initial=-1)) + 1
        if count <= most:
            return np.asarray(cells, dtype=np.int64)
        side *= max(GROWTH, math.sqrt(count / most))


def _first_side(points: Doubles, most: int) -> float:
    """Return the side of cells of which a box around most of the points has about `most`."""
    low, high = np.quantile(points, (FAR_SHARE, 1 - FAR_SHARE), axis=0)
    _, *longest = np.sort(high - low)
    return max(math.sqrt(FACES * float(np.prod(longest)) / most), 1e-6)


def _one_of_each(cells: Indices, odds: Floats, rng: np.random.Generator) -> Indices:
    """Return a random member of each cell, (cells,). odds: of each member, (v,)."""
    arrival = rng.exponential(size=len(odds)) / np.maximum(odds, 1e-30)
    last_first = np.argsort(-arrival, kind="stable")
    chosen = np.zeros(int(cells.max(initial=-1)) + 1, np.int64)
    chosen[cells[last_first]] = last_first
    return chosen


class PathSums:
    """Sums of the light of one site at a time over the vertices of each pixel.

    paths: have these vertices, and stay loaded. pixel_count: of the picture that the vertices'
    pixels are indices into; by default the pixels of the paths.
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
