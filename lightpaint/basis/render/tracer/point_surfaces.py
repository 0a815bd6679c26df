"""The measuring points of a scene as surfaces for the path tracer: white and diffuse.

A diffuse white surface reflects the radiance E / π, so π times the radiance that leaves it is the
irradiance. At such a surface the path tracer samples lights as at any other, also lights without a
size, which Mitsuba's `irradiancemeter` does not see.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import aligned
from lightpaint.scene.properties.measuring_points import MeasuringPoints


class PointSurfaces:
    """Measuring points on the device. bsdf: the material of their surfaces."""

    def __init__(self, points: MeasuringPoints) -> None:
        self._positions, self._normals = (
            mi.Float(aligned(x.ravel(), np.float32)) for x in (points.positions, points.normals)
        )
        self._is_cylindrical = mi.UInt32(aligned(points.is_cylindrical, np.uint32))
        white = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
        self.bsdf = mi.load_dict({"type": "diffuse", "reflectance": white})

    def at(self, index, number):
        """Return the surface interaction at each point, seen along its normal.

        number: in [0, 1), chooses the direction in which cylindrical irradiance is measured.
        """
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p = dr.gather(mi.Point3f, self._positions, index)
        normal = dr.gather(mi.Normal3f, self._normals, index)
        sin, cos = dr.sincos(dr.two_pi * number)
        around = mi.Normal3f(mi.Frame3f(normal).to_world(mi.Vector3f(cos, sin, 0)))
        si.n = dr.select(dr.gather(mi.UInt32, self._is_cylindrical, index) != 0, around, normal)
        si.sh_frame = mi.Frame3f(si.n)
        si.wi = mi.Vector3f(0, 0, 1)
        return si
