"""A soft brush for painting targets from a script.

A `Canvas` holds a picture in linear light and a record of where it was painted. *Marks* (`Stroke`,
`Area`, `Gradient`) say where; `paint` and `glaze` say what happens there:

    canvas = Canvas.read_template("template.exr")
    pool = Stroke([(0.42, 0.35), (0.45, 0.60)], size=0.12, hardness=0.2)
    canvas.glaze(pool, color=(1.0, 0.8, 0.5), stops=1.5)  # warm light, detail kept
    canvas.paint(Area.box(0.8, 0.1, 0.9, 0.6), color=(0.02, 0.03, 0.08))
    canvas.write_with_alpha("evening.exr")

Positions are fractions of the picture: x from 0 (left) to 1 (right), y from 0 (top) to 1 (bottom).
Lengths (`size`, `feather`) are fractions of the picture's *width*, in both directions, so that a
round brush stays round. Colours are linear Rec.709. Nothing here is random: the same strokes write
the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Protocol

import numpy as np
import OpenEXR
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float32]
Point = tuple[float, float]
Color = tuple[float, float, float]


class Mark(Protocol):
    """Anything that can say how much of each pixel it covers."""

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width), 0 = untouched, 1 = fully covered."""
        ...


@dataclass(frozen=True)
class Stroke:
    """A round brush drawn along a line.

    points: where the brush goes; one point is a dab. size: diameter, as a fraction of the width.
    hardness: the fraction of the radius that is fully covered before the edge begins to fall off.
    pressure: one factor on the size per point (a taper), or None for 1 everywhere.
    smooth: round the corners with a curve that still passes through every point (Catmull-Rom).
    A stroke that crosses itself does not build up: coverage is the greatest along the line.
    """

    points: Sequence[Point]
    size: float
    hardness: float = 0.0
    pressure: Sequence[float] | None = None
    smooth: bool = True

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width) in [0, 1]."""
        x, y = _pixel_centres(height, width)
        pressure = np.ones(len(self.points)) if self.pressure is None else self.pressure
        path = np.column_stack([np.asarray(self.points, float), pressure])
        path[:, 1] *= height / width
        if self.smooth and len(path) > 2:
            path = _through(path)
        if len(path) == 1:
            path = np.repeat(path, 2, axis=0)

        # The distance to each piece of the line, in brush radii. The nearest piece decides.
        nearest = np.full((height, width), np.inf)
        for (ax, ay, a_press), (bx, by, b_press) in pairwise(path):
            along = _along(x, y, ax, ay, bx, by)
            distance = np.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay))
            radius = 0.5 * self.size * (a_press + along * (b_press - a_press))
            nearest = np.minimum(nearest, distance / np.maximum(radius, 1e-6))
        return 1 - _smoothstep(min(self.hardness, 0.999), 1.0, nearest)


@dataclass(frozen=True)
class Area:
    """A filled polygon; its edge is `feather` wide (a fraction of the width), half on each side."""

    corners: Sequence[Point]
    feather: float = 0.01

    @staticmethod
    def box(left: float, top: float, right: float, bottom: float, feather: float = 0.01) -> Area:
        """An upright rectangle."""
        return Area([(left, top), (right, top), (right, bottom), (left, bottom)], feather)

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width) in [0, 1]."""
        x, y = _pixel_centres(height, width)
        path = np.asarray(self.corners, float) * (1.0, height / width)
        distance = np.full((height, width), np.inf)
        inside = np.zeros((height, width), bool)
        for (ax, ay), (bx, by) in zip(path, np.roll(path, -1, axis=0), strict=True):
            along = _along(x, y, ax, ay, bx, by)
            edge = np.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay))
            distance = np.minimum(distance, edge)
            # Even-odd rule: does a ray to the right cross this edge?
            if ay != by:
                crosses = (ay > y) != (by > y)
                inside ^= crosses & (x < ax + (y - ay) * (bx - ax) / (by - ay))
        signed = np.where(inside, distance, -distance)
        half = max(0.5 * self.feather, 1e-6)
        return _smoothstep(-half, half, signed)


@dataclass(frozen=True)
class Gradient:
    """A broad wash over the whole picture: full at `start`, fading to nothing at `end`."""

    start: Point
    end: Point

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width) in [0, 1]."""
        x, y = _pixel_centres(height, width)
        aspect = height / width
        (ax, ay), (bx, by) = self.start, self.end
        return 1 - _smoothstep(0.0, 1.0, _along(x, y, ax, ay * aspect, bx, by * aspect))


@dataclass(frozen=True)
class Everywhere:
    """The whole picture."""

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width) of ones."""
        return np.ones((height, width), np.float32)


@dataclass
class Canvas:
    """A picture being painted.

    image: (h, w, 3) float32, linear Rec.709 radiance; it starts as the template.
    weight: (h, w) float32 in [0, 1], what has been painted; it starts as 0; every mark raises it.

    `say`, in [0, 1], is how much weight a mark carries. 0 is an underpainting: it sets the mood for
    the eye and asks nothing of the solver.
    """

    image: Floats
    weight: Floats

    @classmethod
    def read_template(cls, path: str | Path) -> Canvas:
        """A fresh canvas over the channels R, G, B of an EXR."""
        channels = OpenEXR.File(str(path), separate_channels=True).channels()
        missing = [name for name in "RGB" if name not in channels]
        if missing:
            raise ValueError(f"{path} has channels {sorted(channels)}: expected R, G and B")
        image = np.stack([channels[name].pixels for name in "RGB"], axis=-1).astype(np.float32)
        return cls(image, np.zeros(image.shape[:2], np.float32))

    def paint(self, mark: Mark, color: Color, *, opacity: float = 1.0, say: float = 1.0) -> None:
        """Lay `color` over: image <- (1 - a) image + a color with a = opacity coverage."""
        amount = self._touch(mark, opacity, say)[..., None]
        self.image += amount * (np.asarray(color, np.float32) - self.image)

    def glaze(
        self,
        mark: Mark,
        color: Color = (1.0, 1.0, 1.0),
        *,
        stops: float = 0.0,
        opacity: float = 1.0,
        say: float = 1.0,
    ) -> None:
        """Multiply by a colour and an exposure; the detail below stays.

        image <- image (color 2^stops)^a with a = opacity coverage, so that a soft edge fades in
        stops, as exposure does. stops > 0 dodges, < 0 burns. Each channel of color must be > 0.
        """
        if min(color) <= 0:
            raise ValueError(f"glaze colour {color}: every channel must be > 0")
        amount = self._touch(mark, opacity, say)[..., None]
        factor = np.log2(np.asarray(color, np.float32)) + np.float32(stops)
        self.image *= np.exp2(amount * factor)

    def wash(self, mark: Mark, look: Floats, *, opacity: float = 1.0, say: float = 1.0) -> None:
        """Draw the picture towards another, (h, w, 3), in stops: what both have in common stays.

        image <- image^(1 - a) look^a with a = opacity coverage.
        """
        amount = self._touch(mark, opacity, say)[..., None]
        there = np.log2(np.maximum(self.image, 1e-6))
        self.image[:] = np.exp2(there + amount * (np.log2(np.maximum(look, 1e-6)) - there))

    def light(self, mark: Mark, color: Color, on: Floats, *, say: float = 1.0) -> None:
        """Add light of a colour that falls on a surface of albedo `on`, (h, w, 3)."""
        amount = self._touch(mark, 1.0, say)[..., None]
        self.image += amount * np.asarray(color, np.float32) * on

    def keep(self, mark: Mark, *, opacity: float = 1.0) -> None:
        """Ask for what is there already: raises the weight and changes no colour."""
        self._touch(mark, opacity, 1.0)

    def write(self, path: str | Path) -> None:
        """The picture alone: half R, G, B."""
        _write_exr(path, {"RGB": self.image})

    def write_with_alpha(self, path: str | Path) -> None:
        """The picture with the weight as alpha: half R, G, B, A, colour premultiplied by alpha."""
        alpha = self.weight[..., None]
        _write_exr(path, {"RGBA": np.concatenate([self.image * alpha, alpha], axis=-1)})

    def write_png(self, path: str | Path, *, stops: float = 0.0) -> None:
        """The picture alone, in 8 bits of sRGB; what is brighter than white is white.

        stops: exposure, as template.json has it for scenes in cd/m2.
        """
        linear = np.clip(self.image * 2.0**stops, 0, 1)
        shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        Image.fromarray(np.rint(255 * shown).astype(np.uint8)).save(path, optimize=True)

    def write_mask(self, path: str | Path) -> None:
        """The weight alone: one half channel, Y."""
        _write_exr(path, {"Y": self.weight})

    def _touch(self, mark: Mark, opacity: float, say: float) -> Floats:
        """The (h, w) amount a mark lays down; `say` times that builds up in the weight."""
        amount = np.float32(opacity) * mark.coverage(*self.weight.shape)
        self.weight = 1 - (1 - self.weight) * (1 - np.float32(say) * amount)
        return amount


def _write_exr(path: str | Path, channels: dict[str, Floats]) -> None:
    """Write channels as half floats, ZIP compressed.

    They are rounded to 8 significant bits, finer than an eye can tell, which makes small files.
    """
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    halves = {}
    for name, data in channels.items():
        mantissa, exponent = np.frexp(np.asarray(data, np.float32))
        halves[name] = np.ldexp(np.rint(mantissa * 256) / 256, exponent).astype(np.float16)
    OpenEXR.File(header, halves).write(str(path))


def _pixel_centres(height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x (1, w) and y (h, 1) of the pixel centres, both in picture widths."""
    x = (np.arange(width) + 0.5) / width
    y = (np.arange(height) + 0.5) / width
    return x[None, :], y[:, None]


def _along(
    x: NDArray[np.float64], y: NDArray[np.float64], ax: float, ay: float, bx: float, by: float
) -> NDArray[np.float64]:
    """Where each pixel falls on the segment a-b: 0 at a, 1 at b, clamped."""
    dx, dy = bx - ax, by - ay
    length_squared = max(dx * dx + dy * dy, 1e-12)
    return np.clip(((x - ax) * dx + (y - ay) * dy) / length_squared, 0.0, 1.0)


def _through(path: NDArray[np.float64], steps: int = 8) -> NDArray[np.float64]:
    """A Catmull-Rom curve through (n, 3) points, `steps` pieces between each two."""
    ends = np.concatenate([2 * path[:1] - path[1:2], path, 2 * path[-1:] - path[-2:-1]])
    t = (np.arange(steps) / steps)[:, None]
    pieces = [
        p1
        + 0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)))
        for p0, p1, p2, p3 in zip(ends[:-3], ends[1:-2], ends[2:-1], ends[3:], strict=True)
    ]
    return np.concatenate([*pieces, path[-1:]])


def _smoothstep(low: float, high: float, value: NDArray[np.float64]) -> Floats:
    """0 below low, 1 above high, and a cubic S between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return (t * t * (3 - 2 * t)).astype(np.float32)
