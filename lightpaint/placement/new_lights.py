"""Lights that a search may add, and pairs that it moves as mirror images."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from lightpaint.arrays import Doubles, Position, as_position
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.lighting import Constraints
from lightpaint.placement.freedom import Freedom
from lightpaint.scene import FARTHEST
from lightpaint.scene.properties.site import NewKind, Site
from lightpaint.validation import MAX_NAME, parse_number

#: Maximum number of lights that one search adds.
MAX_COUNT = 32

#: Cones of new spots without a freedom of their own, in degrees.
NEW_CONE = (8.0, 50.0)

#: Syntax of a mirror, like "x = 0".
_MIRROR = re.compile(r"\s*([xyz])\s*=\s*([-+.0-9eE]+)\s*")


@keywords()
@dataclass(frozen=True)
class NewLights:
    """Lights that a search may add, if they are worth it.

    Attributes:
        kind: `point`, `spot` or `panel`, a square that emits from its front.
        like: A light of the scene whose kind and cone or size they copy, instead of `kind`.
        count: Their maximum number.
        freedom: Where they may hang; without a place, in all free space. Spots and panels point
            anywhere unless `aim` says otherwise, as degrees from straight ahead of `like`.
        apart: Least distance from each other, in units of the scene.
        in_view: False for places that the camera does not see, True for any. None: any for points
            and spots, which are not seen themselves, and unseen ones for panels, which are.
        name: Their name, numbered if there are several, as in new_1.
        size: Smallest and largest side of panels; None for sides that suit the room.

    Raises:
        SceneError: For invalid values.

    Examples:
        >>> lp.NewLights("spot", count=2, freedom=lp.Freedom(surfaces=("ceiling",))).count
        2
    """

    kind: NewKind = "point"
    like: str | None = None
    count: int = 3
    freedom: Freedom = field(default_factory=Freedom)
    apart: float = 0.0
    in_view: bool | None = None
    name: str = "new"
    size: tuple[float, float] | None = None

    def is_kept_out_of_view(self, *, is_panel: bool) -> bool:
        """Return whether they may hang only where the camera does not see them. is_panel: whether
        they are panels, which `like` may decide.
        """
        return is_panel if self.in_view is None else not self.in_view

    def __post_init__(self) -> None:
        if self.kind not in get_args(NewKind):
            raise SceneError(
                f"new lights are of the kind {brief(self.kind)}: expected point, spot or panel"
            )
        if isinstance(self.count, bool) or not isinstance(self.count, int):
            raise SceneError(f"count is {brief(self.count)}: expected a whole number of lights")
        if not 1 <= self.count <= MAX_COUNT:
            raise SceneError(f"count is {self.count}: expected 1 to {MAX_COUNT} new lights")
        if not isinstance(self.name, str) or not 0 < len(self.name) <= MAX_NAME - 4:
            raise SceneError(f"name is {brief(self.name)}: expected 1 to {MAX_NAME - 4} characters")
        if not (isinstance(self.apart, int | float) and 0 <= self.apart <= FARTHEST):
            raise SceneError(f"apart is {brief(self.apart)}: expected a distance, 0 or more")
        if self.freedom.within is not None:
            raise SceneError("new lights have no place yet that they could be within a distance of")
        if self.size is not None:
            object.__setattr__(self, "size", _sides(self.size))
        if self.like is None:
            self.check_kind(self.kind)
            if not isinstance(self.freedom.aim, bool):
                raise SceneError("aim of new lights is True or left out, unless they are like one")

    def check_kind(self, kind: NewKind) -> None:
        """Raise SceneError for a freedom that this kind of light cannot have."""
        for is_asked, name in (
            (self.freedom.cone is not None, "cone"),
            (self.freedom.beams is not None, "beam"),
        ):
            if is_asked and kind != "spot":
                raise SceneError(f"a new {kind} has no {name}: leave that freedom out")
        if self.freedom.aim and kind == "point":
            raise SceneError("a new point has no direction: leave aim out")
        if self.size is not None and kind != "panel":
            raise SceneError(f"a new {kind} has no size: leave it out")


@dataclass(frozen=True)
class Mirror:
    """A plane across an axis. axis: 0, 1 or 2; at: its coordinate there."""

    axis: int
    at: float

    @classmethod
    def of(cls, text: Any) -> "Mirror":
        """Read a plane like "x = 0". Raises SceneError for others."""
        match = _MIRROR.fullmatch(text) if isinstance(text, str) else None
        try:
            at = math.nan if match is None else parse_number(match[2])
        except ValueError:
            at = math.nan
        if match is None or not abs(at) <= FARTHEST:
            raise SceneError(f'mirror is {text!r}: expected a plane like "x = 0"')
        return cls("xyz".index(match[1]), at)

    def __str__(self) -> str:
        return f"{'xyz'[self.axis]} = {self.at:g}"

    def place(self, place: Position | Doubles) -> Doubles:
        """Return the mirror image of a place, (3,)."""
        mirrored = np.array(place, dtype=float)
        mirrored[self.axis] = 2 * self.at - mirrored[self.axis]
        return mirrored

    def direction(self, direction: Position | Doubles) -> Doubles:
        """Return the mirror image of a direction, (3,)."""
        mirrored = np.array(direction, dtype=float)
        mirrored[self.axis] *= -1
        return mirrored

    def site(self, site: Site) -> Site:
        """Return the mirror image of a light's place and direction, with its cone."""
        return replace(
            site,
            position=None if site.position is None else as_position(self.place(site.position)),
            direction=(
                None if site.direction is None else as_position(self.direction(site.direction))
            ),
        )


@keywords()
@dataclass(frozen=True)
class MirroredPair:
    """Two lights that hang and point as mirror images of each other.

    Attributes:
        lights: Their names. The first has the freedom, the second follows.
        mirror: The plane, like "x = 0".

    Raises:
        SceneError: For invalid values.

    Examples:
        >>> lp.MirroredPair(("left", "right"), "x = 0").mirror
        'x = 0'
    """

    lights: tuple[str, str]
    mirror: str = "x = 0"

    def __post_init__(self) -> None:
        names = self.lights
        if isinstance(names, str) or len(tuple(names)) != 2 or len({*names}) != 2:
            raise SceneError(f"a pair is of {brief(names)}: expected the names of two lights")
        object.__setattr__(self, "lights", tuple(names))
        Mirror.of(self.mirror)

    @property
    def plane(self) -> Mirror:
        """The mirror as a plane."""
        return Mirror.of(self.mirror)


def _sides(value: Any) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low = high = math.nan
    if not 0 < low <= high <= FARTHEST:
        raise SceneError(
            f"size is {brief(value)}: expected the smallest and the largest side of panels"
        )
    return low, high


@dataclass(frozen=True)
class RiggedLights:
    """The lights of a scene that may move, and those that may be added to it.

    freedoms: by name. constraints: on new lights, by their generated names.
    """

    freedoms: Mapping[str, Freedom]
    new: tuple[NewLights, ...]
    pairs: tuple[MirroredPair, ...]
    constraints: Constraints

    @property
    def moving(self) -> set[str]:
        """Names of the lights that may move."""
        return {*self.freedoms, *(name for pair in self.pairs for name in pair.lights)}
