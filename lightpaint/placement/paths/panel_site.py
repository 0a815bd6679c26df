"""The place of a panel, with its outline."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.scene.properties.site import Site

#: Cosine of the angle to the opposite direction from which a rotation is half a turn.
OPPOSITE = -1 + 1e-6


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
