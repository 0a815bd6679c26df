"""The origin of the light of one lamp or sun, and what it adds at vertices of paths."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.placement.paths.camera_paths import Vertices
from lightpaint.placement.paths.panel_site import PanelSite
from lightpaint.scene.properties.site import Site

#: Shadow rays stop short of a light by this, relative to its distance, to miss its mounting
#: surface.
SHADOW_EPSILON = 1e-3

#: Values of an origin that a launch reads: position, axis, two half sides of a panel, kind.
ORIGIN_VALUES = 13
_POINT, _SUN, _PANEL = 0.0, 1.0, 2.0


@dataclass(frozen=True)
class LightOrigin:
    """The parameters of a shadow ray: the origin of light, without the cone of a spot.

    half_sides: of a panel, six numbers.
    """

    position: tuple[float, ...]
    axis: tuple[float, ...]
    kind: float
    half_sides: tuple[float, ...] = (0.0,) * 6

    @classmethod
    def of(cls, site: Site) -> "LightOrigin":
        if site.position is None:
            return cls((0, 0, 0), site.direction or (0, 0, 1), _SUN)
        if isinstance(site, PanelSite):
            half_sides = tuple(site.half_sides.ravel().tolist())
            return cls(site.position, site.direction or (0, 0, 1), _PANEL, half_sides)
        return cls(site.position, (0, 0, 1), _POINT)

    @property
    def row(self) -> Floats:
        """Its values for a launch."""
        return np.array([*self.position, *self.axis, *self.half_sides, self.kind], np.float32)


def added_light(
    loaded: Any,
    vertices: Vertices,
    row: Sequence[Any],
    at: tuple[Any, Any],
    share_towards: Callable[[Any], Any] | None = None,
) -> Any:
    """Return contributions of origins at vertices, as a color of Mitsuba. row: the values of one.

    Each vertex samples its own point of a panel. at: that point, two coordinates from -1 to 1.
    share_towards: returns the share of its light that a spot sends in directions; where there is
    none, no ray is traced.
    """
    import drjit as dr
    import mitsuba as mi

    si, kind = vertices.interaction, row[12]
    is_sun, is_panel = (kind > _POINT) & (kind < _PANEL), kind > _SUN
    axis = mi.Vector3f(*row[3:6])
    place = mi.Point3f(*row[:3])
    sides = mi.Vector3f(*row[6:9]), mi.Vector3f(*row[9:12])
    place += at[0] * sides[0] + at[1] * sides[1]
    between = place - si.p
    squared = dr.squared_norm(between)
    towards = dr.select(is_sun, -axis, between * dr.rsqrt(squared))
    area = 4 * dr.norm(sides[0]) * dr.norm(sides[1])
    power = dr.select(is_panel, area * dr.maximum(dr.dot(-towards, axis), 0), 1) / squared
    power = dr.select(is_sun, 1.0, power)
    if share_towards is not None:
        power *= share_towards(-towards)
    is_lit = power > 0
    reflected = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(towards), is_lit)
    is_lit &= dr.max(reflected) > 0
    ray = si.spawn_ray(towards)
    ray.maxt = dr.select(is_sun, dr.inf, dr.sqrt(squared) * (1 - SHADOW_EPSILON))
    is_lit &= ~loaded.ray_test(ray, is_lit)
    return dr.select(is_lit, vertices.throughput * reflected * power, 0.0)
