"""Points of a scene at which light is measured, instead of the pixels of its film."""

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.errors import SceneError
from lightpaint.scene.limits import MAX_PIXELS


@dataclass(frozen=True, eq=False)
class MeasuringPoints:
    """Points, and the directions in which irradiance is measured there.

    positions: (p, 3) in scene units. normals: (p, 3), unit vectors. is_cylindrical: (p,), whether
    the irradiance is the mean over all directions perpendicular to the normal. is_split: whether
    light that comes straight from emitters is kept apart from all other.
    """

    positions: Doubles
    normals: Doubles
    is_cylindrical: Bools
    is_split: bool = False

    def __post_init__(self) -> None:
        count = len(self.positions)
        if not 0 < count <= MAX_PIXELS:
            raise SceneError(f"{count} measuring points: expected 1 to {MAX_PIXELS}")
        if not np.isfinite(self.positions).all():
            raise SceneError("a measuring point has a position that is not finite")
        if not np.allclose(np.linalg.norm(self.normals, axis=1), 1, atol=1e-5):
            raise SceneError("the normal of a measuring point is not of unit length")

    def __len__(self) -> int:
        return len(self.positions)

    def place_beside(self) -> Any:
        """Return a place from which all points are about equally far, as an `mi.Point3f`."""
        import mitsuba as mi

        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        return mi.Point3f(*map(float, high + np.linalg.norm(high - low) + 1))

    def identify(self, content: str) -> str:
        """Return the identity of `content`, a hash of a scene, seen at these points."""
        digest = hashlib.sha256(content.encode())
        for values in (self.positions, self.normals, self.is_cylindrical):
            digest.update(np.ascontiguousarray(values).tobytes())
        if self.is_split:
            digest.update(b"split")
        return digest.hexdigest()[:32]
