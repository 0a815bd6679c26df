"""Places of emitters as plain values: where one hangs, where it points, how wide its cone is."""

import math
from dataclasses import dataclass
from typing import Literal

from lightpaint.arrays import Position

#: Kinds of lights that can be added to a scene.
NewKind = Literal["point", "spot", "panel"]


@dataclass(frozen=True)
class Site:
    """The place of an emitter in a loaded scene.

    position: None for what is infinitely far away. direction: unit vector that it points along;
    None for what has none. cutoff, beam: degrees from its axis; None for all but spots.
    """

    position: Position | None = None
    direction: Position | None = None
    cutoff: float | None = None
    beam: float | None = None

    @property
    def target(self) -> Position | None:
        """A point on its axis, one unit away; for a light at infinity, from the origin."""
        if self.direction is None:
            return None
        (x, y, z), (i, j, k) = self.position or (0.0, 0.0, 0.0), self.direction
        return x + i, y + j, z + k

    def is_near(self, other: "Site") -> bool:
        """Return whether the two differ only by the rounding of a file."""
        pairs = zip(self._numbers, other._numbers, strict=False)
        same = len(self._numbers) == len(other._numbers)
        return same and all(math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-5) for a, b in pairs)

    @property
    def _numbers(self) -> tuple[float, ...]:
        cone = (x for x in (self.cutoff, self.beam) if x is not None)
        return (*(self.position or ()), *(self.direction or ()), *cone)


@dataclass(frozen=True)
class EmitterPlace:
    """The place of an emitter in an answer.

    position, direction, cutoff, beam: as in `Site`. moved_from: where it is in the file of the
    scene, if that is elsewhere. new: the kind of one that is in no file of the scene; "" for all
    others. size: width and height of a new panel.
    """

    name: str
    position: Position | None = None
    direction: Position | None = None
    cutoff: float | None = None
    beam: float | None = None
    moved_from: Site | None = None
    new: NewKind | Literal[""] = ""
    size: tuple[float, float] | None = None

    @property
    def site(self) -> Site:
        """Its place alone."""
        return Site(self.position, self.direction, self.cutoff, self.beam)

    @classmethod
    def of(cls, name: str, site: Site, moved_from: Site | None = None) -> "EmitterPlace":
        """Return the place of an emitter that is in the file, there or elsewhere."""
        numbers = (site.position, site.direction, site.cutoff, site.beam)
        return cls(name, *numbers, None if moved_from == site else moved_from)
