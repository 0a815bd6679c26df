"""The freedom of a light to move: where it may hang, how far it may turn and open its cone."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Position
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.placement.space.free_space import as_position
from lightpaint.scene.properties.pose import FARTHEST
from lightpaint.validation import parse_number

#: Least width of a beam's soft edge, in degrees.
EDGE = 0.5

#: All angles between a spot's axis and the edge of its beam.
ANY_BEAM = (EDGE, 90.0)

#: Maximum number of rails, and of surfaces, in one freedom.
MAX_PARTS = 1000

Segment = tuple[Position, Position]


@keywords()
@dataclass(frozen=True)
class Freedom:
    """The poses that a light may take, from where it is now.

    Attributes:
        within: Distance that it may move, in units of the scene.
        box: Two opposite corners of a box, parallel to the axes, that it may hang in.
        line: Two ends of a rail that it may slide along.
        rails: Several such rails; it may hang on any of them.
        surfaces: Ids of shapes that it may hang on; with `rails`, on either.
        clear: Distance that it keeps from these surfaces, in units of the scene; None for a small
            part of the room.
        aim: Degrees by which it may turn; True to point anywhere.
        cone: Smallest and largest cutoff of a spot, in degrees.
        beam: Smallest and largest beam width of a spot, in degrees from its axis; True for any in
            its cone. Otherwise the beam keeps its share of the cone.

    Raises:
        SceneError: For invalid values, or more than one kind of place.

    Examples:
        >>> lp.Freedom(line=((-1.8, 3.5, 0.6), (-1.8, 3.5, 6.0)), aim=30).aim
        30.0
    """

    within: float | None = None
    box: Segment | None = None
    line: Segment | None = None
    rails: tuple[Segment, ...] | None = None
    surfaces: tuple[str, ...] | None = None
    clear: float | None = None
    aim: float | bool = False
    cone: tuple[float, float] | None = None
    beam: bool | tuple[float, float] = False

    def __post_init__(self) -> None:
        kinds = ("within", "box", "line", "rails", "surfaces")
        given_keys = [key for key in kinds if getattr(self, key) is not None]
        if len(given_keys) > 1 and given_keys != ["rails", "surfaces"]:
            raise SceneError(
                f"{' and '.join(given_keys)} are given: a light has one of them, or rails and "
                "surfaces"
            )
        if self.within is not None:
            object.__setattr__(self, "within", _number("within", self.within, FARTHEST))
        for key in ("box", "line"):
            if (ends := getattr(self, key)) is not None:
                object.__setattr__(self, key, _ends(key, ends))
        if self.rails is not None:
            object.__setattr__(self, "rails", _rails(self.rails))
        if self.surfaces is not None:
            object.__setattr__(self, "surfaces", _ids(self.surfaces))
        if self.clear is not None:
            if self.surfaces is None:
                raise SceneError("clear is given without surfaces, which it is the distance from")
            object.__setattr__(self, "clear", _number("clear", self.clear, FARTHEST))
        if not isinstance(self.aim, bool):
            object.__setattr__(self, "aim", _number("aim", self.aim, 180.0))
        if self.cone is not None:
            object.__setattr__(self, "cone", _angles("cone", self.cone, 2 * EDGE))
        if not isinstance(self.beam, bool):
            object.__setattr__(self, "beam", _angles("beam", self.beam, EDGE))

    @property
    def is_still(self) -> bool:
        """True if it permits nothing but the current pose."""
        return self == Freedom()

    @property
    def slides(self) -> bool:
        """True if the light may leave its place."""
        return any(
            x is not None for x in (self.within, self.box, self.line, self.rails, self.surfaces)
        )

    @property
    def all_rails(self) -> tuple[Segment, ...]:
        """All rails, `line` among them."""
        return (self.line,) if self.line is not None else self.rails or ()

    @property
    def beams(self) -> tuple[float, float] | None:
        """Smallest and largest beam width in degrees; None if it keeps its share of the cone."""
        if isinstance(self.beam, bool):
            return ANY_BEAM if self.beam else None
        return self.beam

    @property
    def turn(self) -> float:
        """Largest turn in degrees."""
        return (180.0 if self.aim else 0.0) if isinstance(self.aim, bool) else self.aim


def _number(name: str, value: Any, most: float) -> float:
    try:
        number = parse_number(value)
    except (TypeError, ValueError):
        number = math.nan
    if not 0 < number <= most:
        raise SceneError(f"{name} is {brief(value)}: expected a number above 0, at most {most:g}")
    return number


def _ends(name: str, value: Any) -> Segment:
    try:
        points = np.array(value, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape != (2, 3) or not np.abs(points).max() <= FARTHEST:
        raise SceneError(f"{name} is {brief(value)}: expected two points of three numbers each")
    if name != "box" and np.array_equal(points[0], points[1]):
        raise SceneError(f"{name} is {brief(value)}: expected two different points")
    return as_position(points[0]), as_position(points[1])


def _rails(value: Any) -> tuple[Segment, ...]:
    if isinstance(value, str) or not hasattr(value, "__len__") or not 0 < len(value) <= MAX_PARTS:
        raise SceneError(
            f"rails is {brief(value)}: expected a list of pairs of points, at least one"
        )
    return tuple(_ends("rail", ends) for ends in value)


def _ids(value: Any) -> tuple[str, ...]:
    ids = (value,) if isinstance(value, str) else value
    try:
        ids = tuple(ids)
    except TypeError:
        ids = ()
    if not 0 < len(ids) <= MAX_PARTS or not all(isinstance(x, str) and x for x in ids):
        raise SceneError(f"surfaces is {brief(value)}: expected ids of shapes, at least one")
    return ids


def _angles(name: str, value: Any, least: float) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low, high = math.nan, math.nan
    if not least < low <= high < 90:
        raise SceneError(
            f"{name} is {brief(value)}: expected two angles, from {least:g} to 90 degrees"
        )
    return low, high
