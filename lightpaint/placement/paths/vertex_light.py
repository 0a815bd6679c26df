"""The light that a lamp, a sun or a panel adds at vertices of paths: its origin, what arrives from
there, and the part of that in the cone of a spot.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Floats, Indices
from lightpaint.placement.paths.camera_paths import Vertices
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.scene.properties.site import Site

#: Shadow rays stop short of a light by this, relative to its distance, to miss its mounting
#: surface.
SHADOW_EPSILON = 1e-3

#: Steps of the sequence that spreads points over a panel: the reciprocals of the plastic number.
SPREAD = 0.7548776662466927, 0.5698402909980532

#: Distance from a panel, relative to its radius, within which a vertex samples several of its
#: points, and the largest number of these: a wall close to a panel is bright, and one point noise.
NEAR, POINTS = 2.0, 32

#: Degrees by which the cone around several directions of a spot exceeds these, so that small turns
#: need no further shadow rays, and from which on a cone is all directions.
MARGIN, WIDEST = 12.0, 120.0

#: Values of an origin that a launch reads: position, axis, two half sides of a panel, kind, and the
#: cosine of the cone.
ORIGIN_VALUES = 14
_POINT, _SUN, _PANEL = 0.0, 1.0, 2.0


@dataclass(frozen=True)
class LightOrigin:
    """The parameters of a shadow ray: the origin of light, without the falloff of a spot.

    half_sides: of a panel, six numbers. reach: degrees around the axis in which it shines at all,
    for spots.
    """

    position: tuple[float, ...]
    axis: tuple[float, ...]
    kind: float
    half_sides: tuple[float, ...] = (0.0,) * 6
    reach: float = 180.0

    @classmethod
    def of(cls, site: Site) -> "LightOrigin":
        """Return the origin of a site; the origin of a spot shines in all directions."""
        if site.position is None:
            return cls((0, 0, 0), site.direction or (0, 0, 1), _SUN)
        if isinstance(site, PanelSite):
            half_sides = tuple(site.half_sides.ravel().tolist())
            return cls(site.position, site.direction or (0, 0, 1), _PANEL, half_sides)
        return cls(site.position, (0, 0, 1), _POINT)

    def in_cone(self, spots: Sequence[Site]) -> "LightOrigin":
        """Return the origin of some spots here, which shines in a cone around all of theirs."""
        if self.kind != _POINT or any(
            spot.direction is None or spot.cutoff is None for spot in spots
        ):
            return self
        directions = np.array([spot.direction for spot in spots])
        axis = directions.mean(axis=0)
        axis /= max(float(np.linalg.norm(axis)), 1e-9)
        angles = np.degrees(np.arccos(np.clip(directions @ axis, -1, 1)))
        reach = float(np.max(angles + np.array([spot.cutoff or 0.0 for spot in spots])))
        return self if reach > WIDEST else replace(self, axis=tuple(axis.tolist()), reach=reach)

    def with_margin(self) -> "LightOrigin":
        """Return the origin with a slightly wider cone."""
        reach = self.reach + MARGIN
        return replace(self, reach=reach if reach <= WIDEST else 180.0)

    def covers(self, other: "LightOrigin") -> bool:
        """Return whether the other is here and shines nowhere that this one does not."""
        if self == other or self.kind != _POINT:
            return self == other
        if self.position != other.position or self.reach >= 180:
            return self.position == other.position and other.kind == _POINT
        cosine = float(np.clip(np.dot(self.axis, other.axis), -1, 1))
        return math.degrees(math.acos(cosine)) + other.reach <= self.reach

    @property
    def row(self) -> Floats:
        """Its values for a launch."""
        cosine = -2.0 if self.reach >= 180 else math.cos(math.radians(self.reach))
        return np.array(
            [*self.position, *self.axis, *self.half_sides, self.kind, cosine], np.float32
        )


def added_light(
    loaded: Any,
    vertices: Vertices,
    row: Sequence[Any],
    at: tuple[Any, Any],
    share_towards: Callable[[Any], Any] | None = None,
) -> Any:
    """Return contributions of origins at vertices, as a color of Mitsuba. row: the values of one.

    Each vertex samples its own point of a panel, and several of one that is near. at: that point,
    two coordinates from -1 to 1. share_towards: returns the share of its light that a spot sends in
    directions; where there is none, no ray is traced.
    """
    import drjit as dr
    import mitsuba as mi

    si, kind = vertices.interaction, row[12]
    is_sun, is_panel = (kind > _POINT) & (kind < _PANEL), kind > _SUN
    axis, centre = mi.Vector3f(*row[3:6]), mi.Point3f(*row[:3])
    sides = mi.Vector3f(*row[6:9]), mi.Vector3f(*row[9:12])
    area = 4 * dr.norm(sides[0]) * dr.norm(sides[1])

    def light_from(u: Any, v: Any) -> Any:
        between = centre + u * sides[0] + v * sides[1] - si.p
        squared = dr.squared_norm(between)
        towards = dr.select(is_sun, -axis, between * dr.rsqrt(squared))
        power = dr.select(is_panel, area * dr.maximum(dr.dot(-towards, axis), 0), 1) / squared
        power = dr.select(is_sun, 1.0, power)
        power = dr.select(dr.dot(-towards, axis) >= row[13], power, 0)
        if share_towards is not None:
            power *= share_towards(-towards)
        is_lit = power > 0
        reflected = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(towards), is_lit)
        is_lit &= dr.max(reflected) > 0
        ray = si.spawn_ray(towards)
        ray.maxt = dr.select(is_sun, dr.inf, dr.sqrt(squared) * (1 - SHADOW_EPSILON))
        is_lit &= ~loaded.ray_test(ray, is_lit)
        return dr.select(is_lit, reflected * power, 0.0)

    def add(k: Any, u: Any, v: Any, light: Any) -> tuple[Any, ...]:
        return (
            k + 1,
            _wrapped(u + 2 * SPREAD[0]),
            _wrapped(v + 2 * SPREAD[1]),
            light + light_from(u, v),
        )

    # The variance of one point grows with the square of the panel's size at that distance.
    nearest = si.p - centre
    for side in sides:
        share = dr.clip(dr.dot(si.p - centre, side) / dr.squared_norm(side), -1, 1)
        nearest -= dr.select(is_panel, share, 0) * side
    radius2 = dr.squared_norm(sides[0]) + dr.squared_norm(sides[1])
    points = NEAR**2 * radius2 / dr.squared_norm(nearest)
    count = dr.select(is_panel, dr.clip(mi.UInt32(dr.minimum(points, POINTS)), 1, POINTS), 1)
    start = mi.UInt32(0), mi.Float(at[0]), mi.Float(at[1]), mi.Color3f(0.0)
    *_, light = dr.while_loop(start, lambda k, *_: k < count, add)
    return vertices.throughput * light / mi.Float(count)


def _wrapped(coordinate: Any) -> Any:
    """Return a coordinate from -1 to 3 at the same place from -1 to 1."""
    import drjit as dr

    return dr.select(coordinate > 1, coordinate - 2, coordinate)


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
            share = _share_in_cone(self._away @ direction, site.cutoff, min(beam, site.cutoff))
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


def away_from(place: Sequence[float], points: Floats) -> Floats:
    """Return the directions from a place to points, (v, 3) float32 unit vectors."""
    away = points - np.asarray(place, np.float32)
    away /= np.maximum(np.sqrt(np.einsum("vk,vk->v", away, away))[:, None], 1e-30)
    return np.asarray(away)


def _share_in_cone(cosine: Floats, cutoff: float, beam: float) -> Floats:
    """Return the share of its light that a spot sends at cosines to its axis. Angles: degrees.

    As Mitsuba's spot has it: 1 within the beam, linear in the angle to 0 at the cutoff.
    """
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    share = (np.float32(cutoff) - angle) / np.float32(max(cutoff - beam, 1e-6))
    return np.asarray(np.clip(share, 0, 1))
