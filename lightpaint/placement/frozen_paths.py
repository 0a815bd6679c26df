"""The camera's paths, frozen once, and the image of any light at any place as a sum over them.

A path tracer adds at each vertex of a camera's path the light that arrives from a light and is
reflected back along the path. The paths do not depend on lights that no ray meets by chance
(points, spots, suns), so they are traced once and kept. The image of such a light, wherever it
hangs, is then one shadow ray from each vertex: no scene is loaded anew and no kernel compiled.
Every place is seen along the same paths, so what differs between two places is the light alone.

First hits are many and well spread, for direct light has edges. A few of them go on; what these
bring, light by way of other surfaces, is smooth and is averaged along surfaces (images/
surface_filter.py).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.errors import SceneError
from lightpaint.images.denoiser import Features
from lightpaint.images.surface_filter import SurfaceFilter
from lightpaint.scene.properties.pose import DEFAULT_CUTOFF, Site
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed

#: Shadow rays of one launch; more hold no more cores and more memory.
LANES = 2**20

#: Longest paths, in vertices, of integrators without a limit of their own; their light is frozen
#: without Russian roulette, and what is beyond is a thousandth of a bright room's.
MOST_VERTICES = 16

#: A light ends this much before it would meet what it hangs on, relative to its distance.
SHADOW_EPSILON = 1e-3

#: Values of a light that a launch reads: position, direction, cutoff and beam in radians, kind.
_ROW = 9
_POINT, _SPOT, _SUN = 0.0, 1.0, 2.0


@dataclass(frozen=True)
class Vertices:
    """Vertices of paths: interactions and throughputs as Dr.Jit arrays of one width.

    pixels: (v,), the index of each one's pixel, ascending.
    """

    interaction: Any
    throughput: Any
    pixels: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.pixels)

    @cached_property
    def first_of_pixel(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.intp]]:
        """Pixels that have vertices, and the index of the first vertex of each."""
        return np.unique(self.pixels, return_index=True)


class FrozenPaths:
    """Paths of the camera of a scene, on its film. They live no longer than the loaded scene.

    Args:
        scene: The scene, on a small film: columns are made for each of its pixels.
        loaded: That scene, loaded; see `Scene.while_loaded`.
        first_hits: First hits of a pixel, a square number.
        bounces: Paths of a pixel that go on from other first hits; 0 for direct light alone.
        seed: Of the paths.

    Raises:
        SceneError: For scenes with fog or the like, whose light is also scattered in between.
    """

    def __init__(
        self, scene: Scene, loaded: Any, *, first_hits: int = 16, bounces: int = 4, seed: int = 0
    ) -> None:
        if scene.has_media:
            raise SceneError(f"{scene.path} has fog or the like: lights cannot be moved in it")
        self.size, self._scene = scene.size, loaded
        side = math.isqrt(first_hits)
        if side**2 != first_hits:
            raise SceneError(f"first_hits is {first_hits}: expected a square number, like 16")
        camera, longest = scene.camera(loaded), _longest(scene)
        rng = np.random.default_rng(pass_seed(seed, Stream.FROZEN_PATHS, 0))
        with tracing():
            self.direct = _first_hits(loaded, camera, self.size, side, rng)
            self.indirect = (
                _later_vertices(loaded, camera, self.size, bounces, longest, rng)
                if bounces and longest > 1
                else None
            )
        self._filter: SurfaceFilter | None = None

    def filtered_along(self, features: Features) -> "FrozenPaths":
        """Make `columns` average indirect light along surfaces. features: of the film's pixels."""
        self._filter = SurfaceFilter(features)
        return self

    def columns(self, sites: Sequence[Site]) -> Floats:
        """Return the images of lights at unit intensity, (k, h, w, 3) float32 linear Rec.709.

        sites: of points and spots at intensity 1 W/sr and, without a position, of suns at 1 W/m².
        """
        height, width = self.size
        made = self._sums(self.direct, sites).reshape(-1, height, width, 3)
        if self.indirect is not None:
            made += self.indirect_images(sites)
        return made

    def contributions(self, vertices: Vertices, site: Site) -> Floats:
        """Return what `site` adds at each vertex, (v, 3); of a spot, as if it shone all around."""
        row = _row(Site(site.position, None if site.position else site.direction))
        with tracing():
            return np.asarray(self._launch(vertices, row[None])[0], np.float32)

    def image_of(self, vertices: Vertices, contributions: Floats) -> Floats:
        """Return sums of contributions (…, v, c) over pixels, (…, h · w, c) float32."""
        made = np.zeros(
            (*contributions.shape[:-2], self.size[0] * self.size[1], contributions.shape[-1]),
            np.float32,
        )
        pixels, starts = vertices.first_of_pixel
        if len(pixels):
            made[..., pixels, :] = np.add.reduceat(contributions, starts, axis=-2)
        return made

    def direct_images(self, sites: Sequence[Site]) -> Floats:
        """Return the images of direct light alone, (k, h · w, 3) float32; see `columns`."""
        return self._sums(self.direct, sites)

    def indirect_images(self, sites: Sequence[Site]) -> Floats:
        """Return the images of indirect light alone, (k, h, w, 3) float32; see `columns`."""
        made = np.zeros((len(sites), *self.size, 3), np.float32)
        if self.indirect is None:
            return made
        for image, its in zip(made, self._sums(self.indirect, sites), strict=True):
            raw = its.reshape(image.shape)
            image[...] = raw if self._filter is None else self._filter(raw)
        return made

    def points(self, vertices: Vertices) -> Floats:
        """Return the places of vertices, (v, 3)."""
        return np.array(vertices.interaction.p, dtype=np.float32).reshape(3, -1).T

    def _sums(self, vertices: Vertices, sites: Sequence[Site]) -> Floats:
        made = np.empty((len(sites), self.size[0] * self.size[1], 3), np.float32)
        rows = np.array([_row(site) for site in sites], np.float32).reshape(-1, _ROW)
        at_once = max(1, min(LANES // max(len(vertices), 1), len(rows)))
        with tracing() as let_others_through:
            for start in range(0, len(rows), at_once):
                here = rows[start : start + at_once]
                padded = np.concatenate([here, np.repeat(here[-1:], at_once - len(here), axis=0)])
                its = self._launch(vertices, padded)[: len(here)]
                made[start : start + len(here)] = self.image_of(vertices, its)
                let_others_through()
        return made

    def _launch(self, vertices: Vertices, rows: Floats) -> Floats:
        """Return the contributions of lights to vertices, (k, v, 3). rows: (k, 9)."""
        import drjit as dr
        import mitsuba as mi

        count, lights = len(vertices), len(rows)
        if not count:
            return np.zeros((lights, 0, 3), np.float32)
        lane = dr.arange(mi.UInt32, count * lights)
        width = dr.opaque(mi.UInt32, count)
        light = lane // width
        vertex = lane - light * width
        table = mi.Float(np.ascontiguousarray(rows, np.float32).ravel())
        row = [dr.gather(mi.Float, table, light * _ROW + k) for k in range(_ROW)]
        si = dr.gather(mi.SurfaceInteraction3f, vertices.interaction, vertex)
        throughput = dr.gather(mi.Color3f, vertices.throughput, vertex)
        added = _added(self._scene, si, throughput, row)
        values: Floats = np.array(added, dtype=np.float32).reshape(3, lights, count)
        return values.transpose(1, 2, 0)


def falloff(points: Floats, site: Site, directions: Floats, cones: Floats) -> Floats:
    """Return the share of its light that a spot at `site` sends to points, (d, c, v) float32.

    points: (v, 3). directions: (d, 3) unit vectors; cones: (c, 2), cutoff and beam in degrees. As
    Mitsuba's spot has it: 1 within the beam, linear in the angle to 0 at the cutoff.
    """
    away = points - np.asarray(site.position, np.float32)
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-30)
    cosine = np.clip(np.asarray(directions, np.float32) @ away.T, -1, 1)
    angle = np.degrees(np.arccos(cosine))[:, None]
    cutoff, beam = (np.asarray(cones, np.float32)[None, :, k, None] for k in range(2))
    return np.asarray(np.clip((cutoff - angle) / np.maximum(cutoff - beam, 1e-6), 0, 1))


def _row(site: Site) -> Floats:
    """Return the values of a light that a launch reads."""
    direction = site.direction or (0.0, 0.0, 1.0)
    if site.position is None:
        return np.array([0, 0, 0, *direction, 0, 0, _SUN], np.float32)
    kind = _POINT if site.cutoff is None else _SPOT
    cutoff = DEFAULT_CUTOFF if site.cutoff is None else site.cutoff
    beam = cutoff if site.beam is None else site.beam
    cone = (math.radians(cutoff), math.radians(min(beam, cutoff)))
    return np.array([*site.position, *direction, *cone, kind], np.float32)


def _added(loaded: Any, si: Any, throughput: Any, values: Sequence[Any]) -> Any:
    """Return what lights add at interactions, as a color of Mitsuba. values: a row of each."""
    import drjit as dr
    import mitsuba as mi

    place, axis = mi.Point3f(*values[:3]), mi.Vector3f(*values[3:6])
    cutoff, beam, kind = values[6:]
    is_sun = kind > (_SPOT + _SUN) / 2
    between = place - si.p
    squared = dr.squared_norm(between)
    towards = dr.select(is_sun, -axis, between * dr.rsqrt(squared))
    angle = dr.safe_acos(dr.dot(-towards, axis))
    share = dr.clip((cutoff - angle) / dr.maximum(cutoff - beam, 1e-6), 0, 1)
    share = dr.select(kind > (_POINT + _SPOT) / 2, share, 1.0)
    power = dr.select(is_sun, 1.0, share / squared)
    reflected = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(towards))
    is_lit = (power > 0) & (dr.max(reflected) > 0)
    ray = si.spawn_ray(towards)
    ray.maxt = dr.select(is_sun, dr.inf, dr.sqrt(squared) * (1 - SHADOW_EPSILON))
    is_lit &= ~loaded.ray_test(ray, is_lit)
    return dr.select(is_lit, throughput * reflected * power, 0.0)


def _longest(scene: Scene) -> int:
    """Return the most vertices of a path that lights are asked at."""
    depth = scene.integrator.max_depth
    return MOST_VERTICES if depth < 0 else min(max(depth - 1, 0), MOST_VERTICES)


def _first_hits(
    loaded: Any, camera: Any, size: tuple[int, int], side: int, rng: np.random.Generator
) -> Vertices:
    """Return first hits in a grid of side x side cells in each pixel, one in each cell."""
    rays, weight, pixels = _camera_rays(camera, size, side, rng)
    return _compressed(loaded.ray_intersect(rays), weight, pixels)


def _later_vertices(
    loaded: Any,
    camera: Any,
    size: tuple[int, int],
    paths: int,
    longest: int,
    rng: np.random.Generator,
) -> Vertices | None:
    """Return the vertices behind the first of paths, ordered by pixel."""
    import drjit as dr
    import mitsuba as mi

    side = max(1, math.isqrt(paths))
    kept = []
    for _ in range(max(1, round(paths / side**2))):
        rays, weight, pixels = _camera_rays(camera, size, side, rng)
        weight *= side**2 / paths
        for depth in range(longest):
            its = _compressed(loaded.ray_intersect(rays), weight, pixels)
            if not len(its):
                break
            if depth:
                kept.append(its)
            numbers = rng.random((3, len(its)), dtype=np.float32)
            bsdf_sample, bsdf_weight = its.interaction.bsdf().sample(
                mi.BSDFContext(),
                its.interaction,
                mi.Float(numbers[0]),
                mi.Point2f(mi.Float(numbers[1]), mi.Float(numbers[2])),
            )
            si = its.interaction
            rays, weight = si.spawn_ray(si.to_world(bsdf_sample.wo)), its.throughput * bsdf_weight
            pixels = its.pixels
            dr.eval(rays, weight)
    return _joined(kept)


def _camera_rays(
    camera: Any, size: tuple[int, int], side: int, rng: np.random.Generator
) -> tuple[Any, Any, npt.NDArray[np.int64]]:
    """Return rays, their weights for a pixel's mean, and their pixels, ascending."""
    import mitsuba as mi

    height, width = size
    pixels = np.repeat(np.arange(height * width), side**2)
    cell = np.tile(np.arange(side**2), height * width)
    jitter = rng.random((2, len(pixels)))
    x = (pixels % width + (cell % side + jitter[0]) / side) / width
    y = (pixels // width + (cell // side + jitter[1]) / side) / height
    position = mi.Point2f(mi.Float(x.astype(np.float32)), mi.Float(y.astype(np.float32)))
    aperture = rng.random((2, len(pixels)), dtype=np.float32)
    lens = mi.Point2f(mi.Float(aperture[0]), mi.Float(aperture[1]))
    rays, weight = camera.sample_ray(camera.shutter_open(), 0.5, position, lens)
    return mi.Ray3f(rays), mi.Color3f(weight) / side**2, pixels


def _compressed(si: Any, weight: Any, pixels: npt.NDArray[np.int64]) -> Vertices:
    """Return the interactions that are some, in their order."""
    import drjit as dr
    import mitsuba as mi

    kept = dr.compress(si.is_valid() & (dr.max(weight) > 0))
    if not dr.width(kept):
        return Vertices(si, weight, pixels[:0])
    si = dr.gather(mi.SurfaceInteraction3f, si, kept)
    weight = dr.gather(mi.Color3f, weight, kept)
    dr.eval(si, weight)
    return Vertices(si, weight, pixels[np.array(kept, dtype=np.int64)])


def _joined(parts: Sequence[Vertices]) -> Vertices | None:
    """Return all vertices of several, ordered by pixel; None if there are none."""
    import drjit as dr
    import mitsuba as mi

    if not parts:
        return None
    pixels = np.concatenate([part.pixels for part in parts])
    order = np.argsort(pixels, kind="stable")
    place = np.empty(len(order), np.uint32)
    place[order] = np.arange(len(order))
    si = dr.zeros(mi.SurfaceInteraction3f, len(order))
    throughput = dr.zeros(mi.Color3f, len(order))
    start = 0
    for part in parts:
        here = mi.UInt32(place[start : start + len(part)])
        dr.scatter(si, part.interaction, here)
        dr.scatter(throughput, part.throughput, here)
        dr.eval(si, throughput)
        start += len(part)
    return Vertices(si, throughput, pixels[order])
