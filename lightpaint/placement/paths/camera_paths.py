"""Paths of a camera, traced once: the points on surfaces where a light may add to the picture, and
the segments between them, which a panel in the room blocks.

Paths are traced without the panels that a search tries. But a panel is a thing in the room: light
that its own front sends to a wall close by would not reach the rest of the room through the panel.

Steps of a search are short. So the segments that pass near a panel are kept, and only these are
tested at the next place, with the vertices that follow them.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, aligned
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.scene import Scene

#: Longest paths, in vertices, of integrators without a limit of their own; their light is frozen
#: without Russian roulette, and the light beyond is a thousandth even in a bright room.
MOST_VERTICES = 16

#: Radius of a region, relative to the radius of the panel in its middle, and number of kept
#: regions.
REACH, KEPT = 2.0, 4

#: Segments that are tested at once, so that they stay in a processor's cache.
AT_ONCE = 2**14


@dataclass(frozen=True)
class Vertices:
    """Vertices of paths: interactions and throughputs as Dr.Jit arrays of one width.

    pixels: (v,), the index of each one's pixel, ascending. segments: that lead to them; None for
    first hits.
    """

    interaction: Any
    throughput: Any
    pixels: npt.NDArray[np.int64]
    segments: "PathSegments | None" = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return len(self.pixels)

    @cached_property
    def first_of_pixel(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.intp]]:
        """Pixels that have vertices, and the index of the first vertex of each."""
        return np.unique(self.pixels, return_index=True)

    def at(self, indices: npt.NDArray[np.intp], pixels: npt.NDArray[np.int64]) -> "Vertices":
        """Return those with these indices, with other numbers for their pixels."""
        import drjit as dr
        import mitsuba as mi

        if not len(indices):
            return Vertices(self.interaction, self.throughput, pixels)
        where = mi.UInt32(aligned(indices, np.uint32))
        interaction = dr.gather(type(self.interaction), self.interaction, where)
        throughput = dr.gather(type(self.throughput), self.throughput, where)
        dr.make_opaque(interaction, throughput)
        return Vertices(interaction, throughput, pixels)

    @cached_property
    def points(self) -> Floats:
        """Their places, (v, 3) float32."""
        return np.array(self.interaction.p, dtype=np.float32).reshape(3, -1).T.copy()

    def pixel_sums(self, light: Floats, count: int, blocked: Indices | None = None) -> Floats:
        """Return sums over the vertices of each of `count` pixels, (…, h · w).

        light: (…, v). blocked: indices of vertices that do not count.
        """
        if blocked is not None and len(blocked):
            light = light.copy()
            light[..., blocked] = 0
        pixels, starts = self.first_of_pixel
        sums = np.zeros((*light.shape[:-1], count), np.float32)
        if len(pixels):
            sums[..., pixels] = np.add.reduceat(light, starts, axis=-1)
        return sums

    def blocked(self, site: PanelSite) -> Indices | None:
        """Return the indices of vertices that a panel cuts off; None for first hits."""
        return None if self.segments is None else self.segments.blocked(site)


def longest_path(scene: Scene) -> int:
    """Return the largest number of vertices of a path at which lights contribute."""
    depth = scene.integrator.max_depth
    return MOST_VERTICES if depth < 0 else min(max(depth - 1, 0), MOST_VERTICES)


def first_hits_of(
    loaded: Any,
    camera: Any,
    size: tuple[int, int],
    side: int,
    rng: np.random.Generator,
    chosen: Indices | None = None,
) -> Vertices:
    """Return first hits in a grid of side x side cells in each pixel, one in each cell.

    chosen: pixels, ascending; by default all.
    """
    rays, weight, pixels = _camera_rays(camera, size, side, rng, chosen)
    return _compressed(loaded.ray_intersect(rays), weight, pixels)[0]


def later_vertices_of(
    loaded: Any,
    camera: Any,
    size: tuple[int, int],
    paths: int,
    longest: int,
    rng: np.random.Generator,
) -> Vertices | None:
    """Return the vertices of paths after the first ones, ordered by pixel.

    paths: of each pixel, about: they fill grids of cells in a pixel.
    """
    import drjit as dr
    import mitsuba as mi

    side = max(1, math.isqrt(paths))
    found, rounds = _Hits(), max(1, round(paths / side**2))
    for _ in range(rounds):
        rays, weight, pixels = _camera_rays(camera, size, side, rng)
        weight /= rounds
        hits: Vertices | None = None
        for _ in range(longest):
            last, (hits, which) = hits, _compressed(loaded.ray_intersect(rays), weight, pixels)
            if not len(hits):
                break
            found.add(hits, which if last is not None else None)
            lobe, *direction = _floats(rng.random((3, len(hits)), dtype=np.float32))
            bsdf_sample, bsdf_weight = hits.interaction.bsdf().sample(
                mi.BSDFContext(),
                hits.interaction,
                lobe,
                mi.Point2f(*direction),
            )
            si = hits.interaction
            rays, weight = si.spawn_ray(si.to_world(bsdf_sample.wo)), hits.throughput * bsdf_weight
            pixels = hits.pixels
            dr.make_opaque(rays, weight)
    return found.vertices()


def joined(parts: Sequence[Vertices]) -> tuple[Vertices, Indices]:
    """Return the vertices of all parts, ordered by pixel, and the index of each in this order."""
    import drjit as dr
    import mitsuba as mi

    pixels = np.concatenate([part.pixels for part in parts])
    order = np.argsort(pixels, kind="stable")
    place = np.empty(len(order), np.uint32)
    place[order] = np.arange(len(order))
    si = dr.zeros(mi.SurfaceInteraction3f, len(order))
    throughput = dr.zeros(mi.Color3f, len(order))
    start = 0
    for part in filter(len, parts):  # Dr.Jit cannot scatter nothing
        part_places = mi.UInt32(aligned(place[start : start + len(part)], np.uint32))
        dr.scatter(si, part.interaction, part_places)
        dr.scatter(throughput, part.throughput, part_places)
        dr.eval(si, throughput)
        start += len(part)
    return Vertices(si, throughput, pixels[order]), place.astype(np.int64)


def _camera_rays(
    camera: Any,
    size: tuple[int, int],
    side: int,
    rng: np.random.Generator,
    chosen: Indices | None = None,
) -> tuple[Any, Any, npt.NDArray[np.int64]]:
    """Return rays, their weights for a pixel's mean, and their pixels, ascending."""
    import drjit as dr
    import mitsuba as mi

    height, width = size
    every = np.arange(height * width) if chosen is None else chosen
    pixels = np.repeat(every, side**2)
    cell = np.tile(np.arange(side**2), len(every))
    jitter = rng.random((2, len(pixels)))
    x = (pixels % width + (cell % side + jitter[0]) / side) / width
    y = (pixels // width + (cell // side + jitter[1]) / side) / height
    position = mi.Point2f(*_floats((x, y)))
    lens = mi.Point2f(*_floats(rng.random((2, len(pixels)), dtype=np.float32)))
    rays, weight = camera.sample_ray(camera.shutter_open(), 0.5, position, lens)
    rays, weight = mi.Ray3f(rays), mi.Color3f(weight) / side**2
    # Arrays, as they are of rays that surfaces scatter: the same kernels trace both.
    weight += dr.zeros(mi.Color3f, len(pixels))
    rays.time += dr.zeros(mi.Float, len(pixels))
    dr.make_opaque(rays, weight)
    return rays, weight, pixels


def _floats(rows: Iterable[Floats]) -> list[Any]:
    """Return each row, (n,), as an `mi.Float` that kernels read like the numbers of Dr.Jit's
    own."""
    import mitsuba as mi

    return [mi.Float(aligned(row, np.float32)) for row in rows]


def _compressed(
    si: Any, weight: Any, pixels: npt.NDArray[np.int64]
) -> tuple[Vertices, npt.NDArray[np.int64]]:
    """Return the interactions that light may add to, in order, and which of `si` these are."""
    import drjit as dr
    import mitsuba as mi

    # All at once: else each field is computed by a kernel of its own, with all that it depends on.
    # What is constant is an array as well, so that the kernels for all vertices are the same.
    dr.make_opaque(si, weight)
    is_lit = dr.compress(si.is_valid() & (dr.max(weight) > 0))
    if not dr.width(is_lit):
        return Vertices(si, weight, pixels[:0]), np.zeros(0, np.int64)
    si = dr.gather(mi.SurfaceInteraction3f, si, is_lit)
    weight = dr.gather(mi.Color3f, weight, is_lit)
    dr.make_opaque(si, weight)
    which = np.array(is_lit, dtype=np.int64)
    return Vertices(si, weight, pixels[which]), which


class _Hits:
    """The hits of paths, from the camera on."""

    def __init__(self) -> None:
        self._parts = list[Vertices]()
        self._points, self._starts, self._blocks = list[Floats](), list[Indices](), list[slice]()
        self._count = 0

    def add(self, hits: Vertices, before: Indices | None) -> None:
        """Add the next hits of the paths of the last ones. before: which of those each follows,
        (v,); None for first hits.
        """
        block = slice(self._count, self._count + len(hits))
        if before is None:
            self._starts.append(np.arange(block.start, block.stop))
        else:
            self._parts.append(hits)
            self._starts.append(self._blocks[-1].start + before)
        self._blocks.append(block)
        self._points.append(hits.points)
        self._count = block.stop

    def vertices(self) -> Vertices | None:
        """Return the hits after the first ones, ordered by pixel; None if there are none."""
        if not self._parts:
            return None
        vertices, place = joined(self._parts)
        starts = np.concatenate(self._starts)
        is_later = starts < np.arange(len(starts))
        indices = np.full(len(starts), -1)
        indices[is_later] = place
        later_blocks = [block for block in self._blocks if is_later[block.start]]
        segments = PathSegments(np.concatenate(self._points), starts, later_blocks, indices)
        return replace(vertices, segments=segments)


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
