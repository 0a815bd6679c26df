"""Emitters of Mitsuba with a photometric web: `ies`, a point, and `iesarea`, a flat shape.

Both have the parameters of `web_of`, and an `intensity`, a colour by which the candela of the file
are multiplied: (1, 1, 1), the default, is the luminaire at full. Their frame is the frame of a
`spot`, which shines along z. Seen from the lamp along z, with y upwards, as in a picture of a
camera there, C0 is to the right and C90 up.

Import this module after setting a Dr.Jit variant, since its base class does not exist before.
"""

# Dr.Jit traces these methods with arrays of any width, which a static checker cannot follow.
# mypy: disable-error-code="no-untyped-def, no-untyped-call, misc"

import math
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.luminaires import AREA_PLUGIN, POINT_PLUGIN
from lightpaint.luminaires.web import PhotometricWeb, world_from_web
from lightpaint.luminaires.web_file import read_web

#: Solid angle of all directions.
SPHERE = 4 * math.pi


def web_of(props: Any) -> tuple[PhotometricWeb, float]:
    """Return the web of an emitter with these properties, and the factor of its candela.

    It has the `filename` of an IES or EULUMDAT file. It may have `lumens`, its flux at full instead
    of the file's; a `factor` for maintenance and whatever else dims it; and `cd_per_unit`, candelas
    of an intensity of 1 in the scene.
    """
    web = read_web(Path(str(mi.file_resolver().resolve(props["filename"]))))
    scale = float(props.get("factor", 1.0)) / float(props.get("cd_per_unit", 1.0))
    if "lumens" in props:
        scale *= float(props["lumens"]) / web.flux
    return web, scale


class WebTable:
    """A web on the device, in directions of another frame.

    web: the web, whose candela are multiplied by `scale`. axes: (3, 3), the matrix from its frame
    into the frame of the directions. What differs between luminaires is data, so that equal ones
    share a kernel.
    """

    def __init__(self, web: PhotometricWeb, scale: float, axes: Doubles) -> None:
        grid = scale * web.even_grid()
        self._rows, self._columns = grid.shape
        self._table = mi.Float(grid.astype(np.float32).ravel())
        self._axes = mi.Matrix3f(axes.T.tolist())
        first, last = np.radians(web.gammas[[0, -1]]).tolist()
        self._first, self._last = mi.Float(first), mi.Float(last)
        self._per_radian = mi.Float((self._columns - 1) / max(last - first, 1e-9))
        dr.make_opaque(self._table, self._axes, self._first, self._last, self._per_radian)

    def candela(self, direction, active):
        """Return the intensity in a direction, a unit vector away from the lamp."""
        d = self._axes @ direction
        gamma = dr.acos(dr.clip(-d.z, -1, 1))
        inside = active & (gamma >= self._first - 1e-5) & (gamma <= self._last + 1e-5)
        x = (gamma - self._first) * self._per_radian
        column, share = _interval(x, self._columns)
        if self._rows == 1:
            return dr.select(inside, self._along(column, share, inside), 0)
        plane = dr.atan2(d.y, d.x)
        plane = dr.select(plane < 0, plane + 2 * dr.pi, plane)
        row, c_share = _interval(plane * ((self._rows - 1) / (2 * math.pi)), self._rows)
        below = self._along(row * self._columns + column, share, inside)
        above = self._along((row + 1) * self._columns + column, share, inside)
        return dr.select(inside, dr.lerp(below, above, c_share), 0)

    def _along(self, place, share, active):
        """Return the interpolation between two neighbours of a row."""
        if self._columns == 1:
            return dr.gather(mi.Float, self._table, place, active)
        first, second = (dr.gather(mi.Float, self._table, place + k, active) for k in (0, 1))
        return dr.lerp(first, second, share)


def _interval(x, count):
    """Return the interval between `count` even places that `x` is in, and its share of it."""
    index = mi.UInt32(dr.clip(dr.floor(x), 0, max(count - 2, 0)))
    return index, dr.clip(x - mi.Float(index), 0, 1)


class _Luminaire(mi.Emitter):
    """Base of both emitters: parameters and the web."""

    def __init__(self, props: Any) -> None:
        super().__init__(props)
        self.web, self.scale = web_of(props)
        turn, tilt = (float(props.get(key, 0.0)) for key in ("turn", "tilt"))
        self._turn, self._tilt = turn, tilt
        self._intensity = props.get_emissive_texture("intensity", 1.0)

    @property
    def flux(self) -> float:
        """Its flux at full, in lumens relative to `cd_per_unit`."""
        return self.web.flux * self.scale

    def traverse(self, callback: Any) -> None:
        """List its parameters, of which the intensity may be changed."""
        super().traverse(callback)
        callback.put("intensity", self._intensity, mi.ParamFlags.Differentiable)

    def _color(self, si, active):
        return self._intensity.eval(si, active)

    def sample_wavelengths(self, si, sample, active=True):
        """Return wavelengths, none in RGB, and the colour there divided by their density."""
        if not mi.is_spectral:
            return mi.Color0f(), self._color(si, active)
        return self._intensity.sample_spectrum(si, mi.sample_shifted(sample), active)

    def is_environment(self) -> bool:
        """Return False."""
        return False


class LuminairePoint(_Luminaire):
    """A point with a photometric web, the plugin `ies`."""

    def __init__(self, props: Any) -> None:
        super().__init__(props)
        self.m_flags = +mi.EmitterFlags.DeltaPosition
        matrix = np.eye(4)
        if "to_world" in props:
            matrix = np.array(props["to_world"].matrix, np.float64).reshape(4, 4)
        self.to_world = mi.AffineTransform4f(matrix.astype(np.float32))
        self._position = mi.Point3f(*matrix[:3, 3].tolist())
        dr.make_opaque(self._position)
        self._corner = mi.ScalarPoint3f(*matrix[:3, 3].tolist())
        self._place = matrix[:3, 3]
        self._axes = world_from_web(matrix[:3, :3], turn=self._turn, tilt=self._tilt)
        self._table = WebTable(self.web, self.scale, self._axes)

    def traverse(self, callback: Any) -> None:
        """List its parameters."""
        super().traverse(callback)
        callback.put("to_world", self.to_world, mi.ParamFlags.NonDifferentiable)

    def opening_from(self, places: Doubles) -> Doubles:
        """Return the solid angle of its luminous opening (p,) from places (p, 3)."""
        away = places - self._place
        distance = np.linalg.norm(away, axis=-1)
        local = away @ self._axes / distance[:, None]
        return np.asarray(self.web.opening.projected_area(local) / distance**2)

    def sample_direction(self, it, sample, active=True):
        """Return the direction to the point, and `eval_direction`."""
        ds = mi.DirectionSample3f()
        ds.p = self._position
        ds.n = mi.Normal3f(0)
        ds.uv = mi.Point2f(0)
        ds.time = it.time
        ds.pdf = mi.Float(1)
        ds.delta = mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        ds.d = ds.p - it.p
        ds.dist = dr.norm(ds.d)
        ds.d /= ds.dist
        return ds, self.eval_direction(it, ds, active)

    def eval_direction(self, it, ds, active=True):
        """Return its light divided by the square of the distance."""
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wavelengths = it.wavelengths
        candela = self._table.candela(-ds.d, active)
        return self._color(si, active) * (candela / dr.square(ds.dist))

    def pdf_direction(self, it, ds, active=True):
        """Return 0: only sampling finds a point."""
        return mi.Float(0)

    def sample_ray(self, time, sample1, sample2, sample3, active=True):
        """Return a ray in a direction of equal density, and its light divided by that."""
        direction = mi.warp.square_to_uniform_sphere(sample3)
        si = dr.zeros(mi.SurfaceInteraction3f)
        waves, color = self.sample_wavelengths(si, sample1, active)
        candela = self._table.candela(direction, active)
        ray = mi.Ray3f(self._position, direction, time, waves)
        return ray, color * (SPHERE * candela)

    def sample_position(self, time, sample, active=True):
        """Return its place."""
        ps = dr.zeros(mi.PositionSample3f)
        ps.p, ps.time, ps.pdf, ps.delta = self._position, time, mi.Float(1), mi.Bool(True)
        return ps, mi.Float(1)

    def eval(self, si, active=True):
        """Return 0: no ray hits a point."""
        return mi.Spectrum(0)

    def bbox(self) -> Any:
        """Return its place, as a box without a size."""
        return mi.ScalarBoundingBox3f(self._corner)

    def to_string(self) -> str:
        """Return its name and its web's, for people."""
        return f"LuminairePoint[{self.web.name!r}, {self.flux:.4g} lm]"


class LuminaireArea(_Luminaire):
    """A flat shape with a photometric web, the plugin `iesarea`.

    Its radiance is I/(A cos θ), so that from afar its intensity is the web's, on both of its sides.
    """

    def __init__(self, props: Any) -> None:
        super().__init__(props)
        self.m_flags = +mi.EmitterFlags.Surface
        axes = world_from_web(np.eye(3), turn=self._turn, tilt=self._tilt)
        self._table = WebTable(self.web, self.scale, axes)

    def _candela(self, direction, active):
        """Return the intensity of the whole shape in a direction of the world."""
        # The shape is not known before the scene is whole; its axes may have scales.
        matrix = mi.traverse(self.get_shape())["to_world"].matrix
        left, up, ahead = (mi.Vector3f(*(matrix[row, k] for row in range(3))) for k in range(3))
        ahead = dr.normalize(ahead)
        left = dr.normalize(left - ahead * dr.dot(left, ahead))
        up = dr.normalize(up - ahead * dr.dot(up, ahead) - left * dr.dot(up, left))
        local = mi.Vector3f(*(dr.dot(direction, axis) for axis in (left, up, ahead)))
        return self._table.candela(local, active)

    def _radiance(self, si, direction, cosine, active):
        """Return the radiance in a direction of the world, at an angle to the normal."""
        size = dr.abs(cosine)
        active = active & (size > 1e-6)
        area = size * self.get_shape().surface_area()
        value = self._candela(direction, active) / area
        return dr.select(active, self._color(si, active) * value, 0)

    def eval(self, si, active=True):
        """Return the radiance towards `si.wi`."""
        return self._radiance(si, si.to_world(si.wi), si.wi.z, active)

    def sample_direction(self, it, sample, active=True):
        """Return the direction to a place on the shape, and its radiance divided by the density."""
        ds = self.get_shape().sample_direction(it, sample, active)
        active = active & (ds.pdf > 0)
        ds.emitter = mi.EmitterPtr(self)
        value = self.eval_direction(it, ds, active)
        return ds, dr.select(active, value / ds.pdf, 0)

    def eval_direction(self, it, ds, active=True):
        """Return the radiance from the place of a direction sample."""
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wavelengths = it.wavelengths
        return self._radiance(si, -ds.d, dr.dot(ds.d, ds.n), active)

    def pdf_direction(self, it, ds, active=True):
        """Return the density per solid angle with which `sample_direction` finds a direction."""
        return self.get_shape().pdf_direction(it, ds, active)

    def sample_ray(self, time, sample1, sample2, sample3, active=True):
        """Return a ray in a direction of equal density, and its light divided by that."""
        ps = self.get_shape().sample_position(time, sample2, active)
        direction = mi.warp.square_to_uniform_sphere(sample3)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p, si.n = ps.p, ps.n
        si.wavelengths, color = self.sample_wavelengths(si, sample1, active)
        candela = self._candela(direction, active)
        ray = si.spawn_ray(direction)
        ray.time = mi.Float(time)
        return ray, color * (SPHERE * candela)

    def sample_position(self, time, sample, active=True):
        """Return a place on the shape."""
        ps = self.get_shape().sample_position(time, sample, active)
        return ps, dr.select(ps.pdf > 0, dr.rcp(ps.pdf), 0)

    def bbox(self) -> Any:
        """Return the box of the shape."""
        return self.get_shape().bbox()

    def to_string(self) -> str:
        """Return its name and its web's, for people."""
        return f"LuminaireArea[{self.web.name!r}, {self.flux:.4g} lm]"


mi.register_emitter(POINT_PLUGIN, LuminairePoint)
mi.register_emitter(AREA_PLUGIN, LuminaireArea)
