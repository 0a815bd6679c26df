"""Lights with their places and the changes made to them, for pictures and pages; and the geometry
of a picture: the position of its camera, and the projection of points into it.

A basis has the surface position of each pixel, but no camera. The projection follows from these
pairs of pixels and points (direct linear transform, Hartley & Zisserman 2004, §7.1).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats, Position
from lightpaint.display_text import some_names
from lightpaint.images import Features
from lightpaint.lighting import Lighting
from lightpaint.report.phrases import spoken_percent
from lightpaint.scene.properties.site import EmitterPlace, Site

#: Shares that have a word of their own, and the farthest that one may be from it.
FRACTIONS = {
    1 / 10: "a tenth",
    1 / 5: "a fifth",
    1 / 4: "a quarter",
    1 / 3: "a third",
    1 / 2: "half",
    2 / 3: "two thirds",
    3 / 4: "three quarters",
}
FRACTION_TOLERANCE = 0.02

#: Pixels that a projection is fitted to, and the least that it takes.
MAX_POINTS, MIN_POINTS = 4000, 12

#: Least length of a pixel's mean normal: at edges it is shorter, and the position between two.
MIN_NORMAL_LENGTH = 0.999

#: Passes of the fit, each without the pixels that the last one misses by most.
PASSES, KEPT_SHARE = 3, 0.9

#: Median error in pixels beyond which a camera has no such projection.
MOST_ERROR = 1.5

#: Depth of points that are not in a plane, as a share of their extent: more than the rounding of
#: float32.
MIN_DEPTH = 1e-5

#: Degrees from a light's axis within which a visible point counts as its target.
NEAR_AXIS = 2.5


@dataclass(frozen=True)
class HungLight:
    """A light to draw. color: linear RGB of its light; black if it is off."""

    place: EmitterPlace
    color: RGB

    @property
    def is_changed(self) -> bool:
        """True if it moved or is new."""
        return self.place.moved_from is not None or bool(self.place.new)


@dataclass(frozen=True)
class LightChange:
    """A light that moved or is new. text: its change and gain. numbers: the same, for files."""

    name: str
    text: str
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class HungLights:
    """All lights with a place, and the changes, those that gained most first.

    up: the axis of the scene that is up. missed_before, missed_after: shares of the painting that
    are missed without the changes, and with them, by the search. looks: names of those that share
    the places.
    """

    lights: tuple[HungLight, ...]
    changes: tuple[LightChange, ...]
    up: Position
    missed_before: float
    missed_after: float
    looks: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The sentence on the total gain of the changes, and their looks."""
        if self.looks:
            return f"{self.shared_sentence} Each look has levels of its own."
        if not self.changes:
            return "No light is moved: no move would surely bring a hundredth of what is missed."
        return (
            f"{self._subject} {self._share} of what was missed (in energy, by the search; the "
            "picture above is solved and rendered anew)."
        )

    @property
    def shared_sentence(self) -> str:
        """The sentence on the gain for all looks that share the changes."""
        *others, last = self.looks
        names = f"{some_names(others)} and {some_names([last])}"
        if not self.changes:
            return (
                f"{names} share places. No light is moved: no move would surely bring a hundredth "
                "of what they miss together."
            )
        return (
            f"{names} share places. {self._subject} {self._share} of what they missed together (in "
            "energy, by the search)."
        )

    @property
    def _subject(self) -> str:
        return "This change brings" if len(self.changes) == 1 else "These changes bring"

    @property
    def _share(self) -> str:
        return spoken_fraction(1 - self.missed_after / max(self.missed_before, 1e-300))


def hung_lights(lighting: Lighting) -> tuple[HungLight, ...]:
    """Return the lights of an answer whose places are known."""
    colors = {
        member: light.emission for light in lighting.of_lamps().lights for member in light.members
    }
    black = (0.0, 0.0, 0.0)
    return tuple(HungLight(place, colors.get(place.name, black)) for place in lighting.places)


def spoken_fraction(share: float) -> str:
    """Return a share in words: `a fifth`, or `8 %` where none is near."""
    near = min(FRACTIONS, key=lambda fraction: abs(fraction - share))
    if abs(near - share) <= FRACTION_TOLERANCE * max(near, 0.25) / 0.25:
        return FRACTIONS[near]
    return spoken_percent(share)


def placement_numbers(hung: HungLights) -> dict[str, Any]:
    """Return what a search of places came to, for report.json."""
    return {
        "missed_before": hung.missed_before,
        "missed_after": hung.missed_after,
        "looks": list(hung.looks),
        "changes": [
            {"name": change.name, "text": change.text, **change.numbers} for change in hung.changes
        ],
    }


@dataclass(frozen=True)
class ViewGeometry:
    """The surfaces that a picture shows, in space.

    points, normals: (p, 3), of pixels that show a surface. pixels: (p, 2), their x and y. size:
    (height, width). projection: (3, 4), from points to pixels; None if there is none.
    """

    points: Doubles
    normals: Doubles
    pixels: Doubles
    size: tuple[int, int]
    projection: Doubles | None

    @classmethod
    def of(cls, features: Features | None) -> "ViewGeometry | None":
        """Return the geometry of a picture with these features; None if they have no positions."""
        if features is None or features.position is None:
            return None
        height, width = features.size
        y, x = np.mgrid[:height, :width] + 0.5
        whole = np.linalg.norm(features.normal, axis=-1) > MIN_NORMAL_LENGTH
        whole &= np.isfinite(features.position).all(axis=-1)
        if int(whole.sum()) < MIN_POINTS:
            return None
        points = features.position[whole].astype(np.float64)
        pixels = np.stack([x[whole], y[whole]], axis=1)
        normals = features.normal[whole].astype(np.float64)
        return cls(points, normals, pixels, (height, width), _projection(points, pixels))

    @property
    def camera(self) -> Position | None:
        """The place of the camera; None if that is unknown, or infinitely far away."""
        if self.projection is None:
            return None
        centre = np.linalg.svd(self.projection)[2][-1]
        if abs(centre[3]) < 1e-9:
            return None
        x, y, z = (float(v) for v in centre[:3] / centre[3])
        return x, y, z

    @property
    def spacing(self) -> Doubles:
        """About the distance between points of neighbouring pixels, (p,), seen from the front."""
        if self.projection is None or (camera := self.camera) is None:
            extent = float(np.ptp(self.points, axis=0).max())
            return np.full(len(self.points), extent / max(self.size))
        # The third row is of unit length in front of the camera, the first has the focal length.
        rows = self.projection[:, :3] / np.linalg.norm(self.projection[2, :3])
        middle = float(rows[0] @ rows[2])
        focal = math.sqrt(max(float(rows[0] @ rows[0]) - middle**2, 1e-12))
        offsets = self.points - np.array(camera)
        distance = np.linalg.norm(offsets, axis=1)
        cosine = np.abs((offsets * self.normals).sum(axis=1)) / np.maximum(distance, 1e-12)
        return np.asarray(1.3 * distance / focal / np.maximum(cosine, 0.06))

    def pixel(self, point: Position) -> tuple[float, float] | None:
        """Return x and y of a point in the picture, in pixels; None if it is not in it."""
        if self.projection is None:
            return None
        seen = self.projection @ np.array([*point, 1.0])
        if seen[2] <= 0:
            return None
        x, y = (float(v) for v in seen[:2] / seen[2])
        return (x, y) if 0 <= x <= self.size[1] and 0 <= y <= self.size[0] else None

    def aim_of(self, site: Site) -> Position | None:
        """Return the visible point that a light at `site` points at; None if there is none."""
        if site.position is None or site.direction is None:
            return None
        offsets = self.points - np.array(site.position)
        length = np.linalg.norm(offsets, axis=1)
        cosine = offsets @ np.array(site.direction) / np.maximum(length, 1e-12)
        nearest_indices = np.flatnonzero(cosine > np.cos(np.radians(NEAR_AXIS)))
        # The beam lights the first surface on its way.
        nearest_indices = (
            nearest_indices[length[nearest_indices] < 1.1 * length[nearest_indices].min()]
            if len(nearest_indices)
            else nearest_indices
        )
        if not len(nearest_indices):
            return None
        x, y, z = (
            float(v) for v in self.points[nearest_indices[np.argmax(cosine[nearest_indices])]]
        )
        return x, y, z


def _projection(points: Doubles, pixels: Doubles) -> Doubles | None:
    """Return the projection that maps points to pixels, positive in front of the camera; None if
    they do not decide it, as the points of a single wall.
    """
    step = max(1, len(points) // MAX_POINTS)
    points, pixels = points[::step], pixels[::step]
    # Numbers of equal size keep the equations well conditioned.
    to_unit, from_unit = _to_unit(points), np.linalg.inv(_to_unit(pixels))
    scaled_points, scaled_pixels = (_moved(_to_unit(x), x) for x in (points, pixels))
    inliers = np.arange(len(points))
    matrix = np.zeros((3, 4))
    for _ in range(PASSES):
        if _are_in_a_plane(scaled_points[inliers]):
            return None
        matrix = _linear_fit(scaled_points[inliers], scaled_pixels[inliers])
        seen = np.c_[scaled_points, np.ones(len(scaled_points))] @ matrix.T
        if np.median(seen[:, 2]) < 0:
            matrix, seen = -matrix, -seen
        error = np.linalg.norm(seen[:, :2] / seen[:, 2:] - scaled_pixels, axis=1)
        inliers = np.argsort(error)[: max(MIN_POINTS, int(KEPT_SHARE * len(error)))]
    whole = from_unit @ matrix @ to_unit
    seen = np.c_[points, np.ones(len(points))] @ whole.T
    errors = np.linalg.norm(seen[:, :2] / seen[:, 2:] - pixels, axis=1)
    return whole if np.median(errors) < MOST_ERROR else None


def _are_in_a_plane(points: Doubles) -> bool:
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extents[-1] <= MIN_DEPTH * extents[0])


def _linear_fit(points: Doubles, pixels: Doubles) -> Doubles:
    rows = np.c_[points, np.ones(len(points))]
    zero = np.zeros_like(rows)
    x, y = pixels.T[..., None]
    equations = np.vstack([np.c_[rows, zero, -x * rows], np.c_[zero, rows, -y * rows]])
    return np.asarray(np.linalg.svd(equations, full_matrices=False)[2][-1].reshape(3, 4))


def _to_unit(values: Doubles) -> Doubles:
    """Return the matrix that brings points to a mean of 0 and a spread of about 1."""
    middle, spread = values.mean(axis=0), values.std() or 1.0
    n = values.shape[1]
    matrix = np.eye(n + 1) / spread
    matrix[:n, n], matrix[n, n] = -middle / spread, 1.0
    return matrix


def _moved(matrix: Doubles, values: Floats) -> Doubles:
    return np.asarray((np.c_[values, np.ones(len(values))] @ matrix.T)[:, :-1])
