"""Panels of a drawing of lights: a plan and an elevation on one scale, and their arrangement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from lightpaint.arrays import Doubles, Position
from lightpaint.report.rig.hung_lights import HungLight
from lightpaint.report.rig.view_geometry import ViewGeometry

#: The ground.
GROUND = (24, 24, 26)

#: Supersampling of the drawing, which makes lines smooth.
FINER = 2

#: Margin around the visible points, and the distance up to which lights are drawn, as shares.
MARGIN, MAX_DISTANCE = 0.08, 1.5

#: Maximum height of both drawings, relative to their width.
TALLEST = 1.3


@dataclass(frozen=True)
class Panel:
    """A drawing along one axis. right, up: unit vectors; low, scale: from metres to pixels."""

    title: str
    right: Doubles
    up: Doubles
    low: Doubles
    scale: float
    size: tuple[int, int]

    def at(self, points: Doubles | Position) -> Doubles:
        """Return x and y in pixels, (..., 2)."""
        places = np.asarray(points, dtype=float)
        flat = np.stack([places @ self.right, places @ self.up], axis=-1)
        x, y = np.moveaxis((flat - self.low) * self.scale, -1, 0)
        return np.stack([x, self.size[1] - y], axis=-1)


def in_column(pictures: Sequence[Image.Image], width: int) -> Image.Image:
    """Return pictures one below the other, in the middle of a sheet of that width."""
    sheet = Image.new("RGB", (FINER * width, sum(x.height for x in pictures)), GROUND)
    y = 0
    for picture in pictures:
        sheet.paste(picture, ((sheet.width - picture.width) // 2, y))
        y += picture.height
    return sheet


def in_row(pictures: Sequence[Image.Image], width: int) -> Image.Image:
    """Return pictures beside each other, on one line at the bottom."""
    tallest = max(x.height for x in pictures)
    sheet = Image.new("RGB", (FINER * width, tallest), GROUND)
    gap = (sheet.width - sum(x.width for x in pictures)) // (len(pictures) + 1)
    x = gap
    for picture in pictures:
        sheet.paste(picture, (x, tallest - picture.height))
        x += picture.width + gap
    return sheet


def plan_and_elevation(
    geometry: ViewGeometry, lights: Sequence[HungLight], up: Doubles, width: int, row: int | None
) -> list[Panel]:
    """Return plan and elevation on one scale, `width` pixels wide or less.

    row: the most height of each beside the other; None for one below the other.
    """
    forward = _forward_direction(geometry, up)
    left = np.cross(up, forward)
    places = _places_near(geometry, lights)
    low, high = np.percentile(geometry.points, [0.5, 99.5], axis=0)
    points = np.concatenate([places, [low, high]])
    views = [
        ("plan: the camera looks to the right", left),
        ("elevation", up),
    ]
    flat = np.stack([points @ forward, points @ left, points @ up], axis=1)
    lowest, highest = flat.min(axis=0), flat.max(axis=0)
    room = MARGIN * float((highest - lowest).max())
    lowest, extent = lowest - room, highest - lowest + 2 * room
    if row is None:
        scale = min(width / extent[0], TALLEST * width / (extent[1] + extent[2]))
    else:
        scale = min(0.96 * width / (2 * extent[0]), row / max(extent[1], extent[2]))
    return [
        Panel(
            title,
            forward,
            along,
            lowest[[0, k]],
            scale,
            (int(extent[0] * scale), int(extent[k] * scale)),
        )
        for k, (title, along) in enumerate(views, 1)
    ]


def _forward_direction(geometry: ViewGeometry, up: Doubles) -> Doubles:
    """Return the axis of the scene across `up` that leads away from the camera."""
    camera = geometry.camera
    way = np.ptp(geometry.points, axis=0)
    if camera is not None:
        way = np.median(geometry.points, axis=0) - np.array(camera)
    way = np.where(np.abs(up) > 0.5, 0, way)
    axis = np.zeros(3)
    k = int(np.argmax(np.abs(way)))
    axis[k] = 1.0 if way[k] >= 0 else -1.0
    return axis


def _places_near(geometry: ViewGeometry, lights: Sequence[HungLight]) -> Doubles:
    """Return the places of lights, old and new, near the visible points."""
    sites = [light.place.site for light in lights]
    sites += [light.place.moved_from for light in lights if light.place.moved_from is not None]
    places = [site.position for site in sites if site.position is not None]
    low, high = np.percentile(geometry.points, [0.5, 99.5], axis=0)
    margin = MAX_DISTANCE * float((high - low).max())
    positions = np.array(places, dtype=float).reshape(-1, 3)
    is_near = ((positions > low - margin) & (positions < high + margin)).all(axis=1)
    return np.asarray(positions[is_near])
