"""Panels: area lights that are rectangles or disks of their own, and can be moved.

Paths meet a panel on their way from the camera, too. Its outline is a sharp edge, often brighter
than all else, so the share of each pixel that its front fills is computed, and not sampled:
otherwise the noise of edges would outweigh all that the panel lights.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices, Position, aligned, as_position
from lightpaint.scene import MULTIPLE, Light, Scene, without_emitters
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing

#: Cosine of the angle to the opposite direction from which a rotation is half a turn.
OPPOSITE = -1 + 1e-6

#: Cosine of the angle between the sides of a rectangle, up to which it counts as one.
SHEAR = 1e-4

#: Half of a cell, in cells: sight lines go through its middle and the middle of two of its edges.
_HALF = 0.5


@dataclass(frozen=True)
class Outline:
    """Half sides of a panel that points in `direction`. It turns by the smallest rotation."""

    direction: Position
    half_sides: tuple[Position, Position]

    def turned(self, directions: Floats | Doubles) -> Floats:
        """Return its half sides towards other directions, (k, 2, 3). directions: (k, 3) unit."""
        start, ways = np.array(self.direction), np.asarray(directions, float)
        axes, cosines = np.cross(start, ways), ways @ start
        sides = np.array(self.half_sides)[None]
        once = np.cross(axes[:, None], sides)
        shares = 1 / (1 + np.maximum(cosines, OPPOSITE))
        turned = sides + once + np.cross(axes[:, None], once) * shares[:, None, None]
        half_turn = across_all(start[None])[0, 0]
        opposite = 2 * (sides @ half_turn)[..., None] * half_turn - sides
        is_opposite = (cosines <= OPPOSITE)[:, None, None]
        return np.asarray(np.where(is_opposite, opposite, turned), np.float32)


@dataclass(frozen=True)
class PanelSite(Site):
    """The place of a panel, which shines to its front.

    side: of a square, or the square root of its area. outline: None for a square.
    """

    side: float = 0.0
    outline: Outline | None = None

    @property
    def half_sides(self) -> Floats:
        """Vectors from its centre to the middles of two of its sides, (2, 3)."""
        [half_sides] = self.half_sides_towards(np.array([self.direction or (0.0, 0.0, 1.0)]))
        return np.asarray(half_sides)

    def half_sides_towards(self, directions: Floats | Doubles) -> Floats:
        """Return its half sides if it pointed in each direction, (k, 2, 3)."""
        if self.outline is not None:
            return self.outline.turned(directions)
        return np.asarray(
            across_all(np.asarray(directions, np.float32)) * np.float32(self.side / 2)
        )

    @property
    def radius(self) -> float:
        """Distance from its centre to a corner."""
        return float(np.sqrt(np.square(self.half_sides).sum()))


def across_all(directions: Sequence[Sequence[float]] | Floats | Doubles) -> Floats:
    """Return unit vectors across directions, (k, 2, 3), as `across` does for one."""
    axes = np.asarray(directions)
    axes = axes / np.sqrt(np.square(axes).sum(axis=1, keepdims=True))
    normals = _cross(axes, np.eye(3, dtype=axes.dtype)[np.argmin(np.abs(axes), axis=1)])
    normals /= np.sqrt(np.square(normals).sum(axis=1, keepdims=True))
    return np.stack([normals, _cross(axes, normals)], axis=1)


def _cross(first: Floats, second: Floats) -> Floats:
    """Return cross products of rows, (k, 3), as `np.cross`, in a fraction of its time for few."""
    next_axis, last_axis = [1, 2, 0], [2, 0, 1]
    ahead = first[:, next_axis] * second[:, last_axis]
    return np.asarray(ahead - first[:, last_axis] * second[:, next_axis])


def is_panel(light: Light) -> bool:
    """Return whether a light of the scene is a rectangle or disk of its own, in one colour."""
    if light.plugin != "area" or light.is_fixed or len(light.members) > 1:
        return False
    [panel] = light.members
    return light.unit != MULTIPLE and panel.site.direction is not None and bool(panel.unit_flux)


def panel_site(scene: Scene, panel: Light, site: Site) -> PanelSite:
    """Return the place of a panel of the scene for frozen paths; of a disk a square of its area.

    site: where it is now.
    """
    [emitter] = panel.members
    assert emitter.unit_flux is not None
    assert emitter.site.direction is not None
    side = math.sqrt(emitter.unit_flux / math.pi)
    half_sides = _half_sides(scene, emitter.node)
    outline = None if half_sides is None else Outline(emitter.site.direction, half_sides)
    return PanelSite(site.position, site.direction, side=side, outline=outline)


def _half_sides(scene: Scene, emitter: int) -> tuple[Position, Position] | None:
    """Return the half sides of a rectangle; None for other shapes, and for a sheared one."""
    props = scene.parsed.state.nodes[scene.parsed.shape_of[emitter]].props
    if props.plugin_name() != "rectangle":
        return None
    matrix = np.eye(4) if "to_world" not in props else np.array(props["to_world"].matrix)
    one, other = matrix.reshape(4, 4)[:3, :2].T
    is_sheared = abs(one @ other) > SHEAR * np.linalg.norm(one) * np.linalg.norm(other)
    return None if is_sheared else (as_position(one), as_position(other))


def without_panels(scene: Scene, names: Collection[str]) -> Scene:
    """Return the scene without the ones among the lights `names` that are panels, and their shapes.

    Paths along which a panel is tried elsewhere must not meet it where it hangs now.
    """
    panels = [light for light in scene.lights if light.name in names and is_panel(light)]
    if not panels:
        return scene
    nodes = {light.members[0].node for light in panels}
    return replace(
        scene,
        parsed=without_emitters(scene.parsed, nodes),
        emitters=tuple(x for x in scene.emitters if x.node not in nodes),
        lights=tuple(x for x in scene.lights if x not in panels),
    )


@dataclass(frozen=True)
class SightLines:
    """Lines of sight through cells of a picture, up to what the camera sees there.

    origins, directions: (3, r, 3), through the middle of each cell, and of its edges to the right
    and below. lengths: (r,), up to the next surface. pixels: (r,). cells: of each pixel.
    """

    origins: Floats
    directions: Floats
    lengths: Floats
    pixels: Indices
    cells: int

    @classmethod
    def of(cls, loaded: Any, camera: Any, size: tuple[int, int], side: int) -> "SightLines":
        """Return the lines through side x side cells of each pixel."""
        import mitsuba as mi

        height, width = size
        pixels = np.repeat(np.arange(height * width), side**2)
        cell = np.tile(np.arange(side**2), height * width)
        x = (pixels % width + (cell % side + 0.5) / side) / width
        y = (pixels // width + (cell // side + 0.5) / side) / height
        origins, directions = list[Floats](), list[Floats]()
        lengths = np.zeros(0, np.float32)
        with tracing():
            for right, below in ((0, 0), (_HALF, 0), (0, _HALF)):
                shifted = x + right / (side * width), y + below / (side * height)
                position = mi.Point2f(*(mi.Float(aligned(its, np.float32)) for its in shifted))
                rays, _ = camera.sample_ray(
                    camera.shutter_open(), 0.5, position, mi.Point2f(0.5, 0.5)
                )
                if not origins:
                    hits = loaded.ray_intersect_preliminary(mi.Ray3f(rays))
                    lengths = np.broadcast_to(np.array(hits.t, np.float32), x.shape)
                for listed, its in ((origins, rays.o), (directions, rays.d)):
                    rows = np.array(its, np.float32).reshape(3, -1).T
                    listed.append(np.broadcast_to(rows, (len(x), 3)))
        return cls(np.stack(origins), np.stack(directions), lengths, pixels, side**2)

    def near(self, place: Sequence[float], radius: float) -> "SightLines":
        """Return the lines that pass within `radius` of a place, before any surface."""
        between = np.asarray(place, np.float32) - self.origins[0]
        along = np.einsum("rk,rk->r", between, self.directions[0])
        off = np.einsum("rk,rk->r", between, between) - along**2
        wide = radius + along * self._widths
        is_near = (along > -radius) & (off < wide**2) & (along - radius < self.lengths)
        return self._at(np.flatnonzero(is_near))

    def some(self, count: int) -> "SightLines":
        """Return at most `count` of the lines, evenly."""
        step = math.ceil(len(self.pixels) / count)
        return self if step < 2 else self._at(np.arange(step // 2, len(self.pixels), step))

    def _at(self, indices: Indices) -> "SightLines":
        return SightLines(
            self.origins[:, indices],
            self.directions[:, indices],
            self.lengths[indices],
            self.pixels[indices],
            self.cells,
        )

    @cached_property
    def _widths(self) -> Floats:
        """Widths of cells at a distance of 1, (r,)."""
        half = np.linalg.norm(self.directions[1] - self.directions[0], axis=1)
        return np.asarray(2 * half)

    def covered(
        self, place: Sequence[float], directions: Floats | Doubles, half_sides: Floats
    ) -> Floats:
        """Return the share of its pixel that a panel fills in each cell, (k, r), for directions.

        half_sides: of the panel in each direction, (k, 2, 3).
        """
        axes = np.asarray(directions, np.float32)
        if not len(self.pixels) or not len(axes):
            return np.zeros((len(axes), len(self.pixels)), np.float32)
        between = np.asarray(place, np.float32) - self.origins
        facing = np.moveaxis(self.directions @ axes.T, -1, 1)
        is_seen = (facing < -1e-6).all(axis=0)
        facing[facing > -1e-6] = -1
        length = np.moveaxis(between @ axes.T, -1, 1) / facing
        is_seen &= (length > 0).all(axis=0) & (length[0] < self.lengths)
        filled = is_seen / np.float32(self.cells)
        rulers = half_sides / np.square(half_sides).sum(axis=2, keepdims=True)
        for sideways in np.moveaxis(rulers, 1, 0):
            # A coordinate on the panel, which goes from -1 to 1, and how wide a cell is there.
            at = length * np.moveaxis(self.directions @ sideways.T, -1, 1)
            at -= np.moveaxis(between @ sideways.T, -1, 1)
            half = np.abs(at[1] - at[0]) + np.abs(at[2] - at[0]) + np.float32(1e-9)
            inside = np.minimum(at[0] + half, 1) - np.maximum(at[0] - half, -1)
            filled *= np.clip(inside / (2 * half), 0, 1)
        return np.asarray(filled)
