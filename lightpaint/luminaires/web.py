"""The photometric web of a luminaire: its luminous intensity in every direction.

Angles are as in CIE's type C. Gamma is the angle from the nadir: 0 is straight down, 180
straight up. A C-plane is a half-plane that ends at the vertical axis. In the frame of a web the
nadir is −z, C0 is +x and C90 is +y, as in the output of Radiance's ies2rad.

A spot is bright up to its beam width and falls linearly with the angle to its cutoff. So an axial
web, which is linear between its angles γₖ, is Σₖ (Iₖ − Iₖ₊₁) spot(γₖ, γₖ₊₁).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles, Indices, Position, read_only
from lightpaint.errors import SceneError

#: How a file repeats the planes that it lists: about the axis, in quadrants, on both sides of the
#: plane C0–C180 or C90–C270, or not at all.
Symmetry = Literal["axial", "quadrants", "C0-C180", "C90-C270", "none"]

#: Difference in degrees below which two angles are the same.
SAME_ANGLE = 1e-4
#: The steps of an even grid are multiples of this, in degrees.
GRID_UNIT = 1e-3
#: Intervals of an even grid at most: of gammas, and of C-planes.
MAX_STEPS, MAX_PLANES = 1800, 720

#: From the frame of a web (nadir −z, C0 +x, C90 +y) into the frame of an emitter that shines along
#: z: seen along z with y upwards, +x is to the left, so that C0 is to the right and C90 up.
EMITTER_FROM_WEB = np.diag([-1.0, 1.0, -1.0])

#: Error of a sum at most, relative to the web's largest intensity.
SPOT_TOLERANCE = 1e-3

#: The largest cutoff of a spot in degrees.
WIDEST = 90.0


@dataclass(frozen=True)
class Opening:
    """The luminous opening of a luminaire in metres, 0 if it is a point.

    along_c0, along_c90: its sizes parallel to the planes C0 and C90. height: of the luminous sides.
    is_round: whether it is an ellipse rather than a rectangle.
    """

    along_c0: float = 0.0
    along_c90: float = 0.0
    height: float = 0.0
    is_round: bool = False

    @property
    def largest(self) -> float:
        """Its largest size in metres."""
        return max(self.along_c0, self.along_c90, self.height)

    def projected_area(self, directions: Doubles) -> Doubles:
        """Return its area (...) in m² as seen from directions (..., 3), unit vectors of the web.

        Lower and upper side are as large as each other, and its sides are upright.
        """
        x, y, z = np.abs(np.moveaxis(np.asarray(directions, np.float64), -1, 0))
        across, along = self.along_c90 * x, self.along_c0 * y
        width = np.hypot(across, along) if self.is_round else across + along
        corners = math.pi / 4 if self.is_round else 1.0
        flat = corners * self.along_c0 * self.along_c90 * z
        return np.asarray(flat + self.height * width)


@dataclass(frozen=True)
class PhotometricWeb:
    """The luminous intensity of a luminaire at full, in every direction.

    gammas: (g,) rising degrees, between which the web is linear; beyond them it is dark.
    planes: (c,) rising degrees, [0] for a web that is the same in all of them, else from 0 to 360.
    table: (c, g) candela, after all factors of the file.
    stated_lumens: the flux that the file states: of the luminaire if it is absolute or tells the
    efficiency, else of the lamps in it; None if unknown. of_lamps: whether it is the efficiency of
    the lamps. watts: input power; None if unknown. tilt_factors: (2, k), angles by which the
    luminaire is tilted, in degrees from hanging as it was measured, and factors of its light; None
    without. unread: number of texts in the file after what it describes.
    """

    name: str
    gammas: Doubles
    planes: Doubles
    table: Doubles
    symmetry: Symmetry
    opening: Opening = Opening()
    stated_lumens: float | None = None
    of_lamps: bool = False
    watts: float | None = None
    tilt_factors: Doubles | None = None
    unread: int = 0

    def __post_init__(self) -> None:
        for key in ("gammas", "planes", "table"):
            object.__setattr__(self, key, read_only(np.array(getattr(self, key), np.float64)))

    @property
    def is_axial(self) -> bool:
        """True if it is the same in all C-planes."""
        return len(self.planes) == 1

    @cached_property
    def peak(self) -> float:
        """Its largest intensity in candela."""
        return float(self.table.max())

    @cached_property
    def flux(self) -> float:
        """Its luminous flux in lumens, the exact integral of the intensities between its angles."""
        gamma = np.radians(self.gammas)
        if len(gamma) < 2:
            return 0.0
        first, last = gamma[:-1], gamma[1:]
        # ∫ I sin γ dγ of an I that is linear between two angles: with s the mean of −cos γ over
        # the interval, the lower end counts cos γ₀ + s and the upper one −cos γ₁ − s.
        mean = (np.sin(last) - np.sin(first)) / (last - first)
        of_first, of_last = np.cos(first) - mean, mean - np.cos(last)
        per_plane = self.table[:, :-1] @ of_first + self.table[:, 1:] @ of_last
        if self.is_axial:
            return float(2 * math.pi * per_plane[0])
        return float(np.diff(np.radians(self.planes)) @ (per_plane[1:] + per_plane[:-1]) / 2)

    def candela(self, directions: Doubles) -> Doubles:
        """Return the intensities (...) in directions (..., 3), unit vectors in its own frame."""
        x, y, z = np.moveaxis(np.asarray(directions, np.float64), -1, 0)
        gamma = np.degrees(np.arccos(np.clip(-z, -1, 1)))
        plane = np.degrees(np.arctan2(y, x)) % 360
        first, share = _interval(self.gammas, gamma)
        lower, c_share = _interval(self.planes, plane)
        after, upper = min(1, len(self.gammas) - 1), min(1, len(self.planes) - 1)
        on_plane = [
            (1 - share) * self.table[lower + k, first]
            + share * self.table[lower + k, first + after]
            for k in (0, upper)
        ]
        value = (1 - c_share) * on_plane[0] + c_share * on_plane[1]
        inside = (gamma >= self.gammas[0] - SAME_ANGLE) & (gamma <= self.gammas[-1] + SAME_ANGLE)
        return np.asarray(np.where(inside, value, 0.0))

    def factor_at(self, tilt: float) -> float:
        """Return the factor of its light if its nadir is by `tilt` degrees away from downwards.

        It is linear between the angles of the file, and constant beyond them.
        """
        if self.tilt_factors is None:
            return 1.0
        return float(np.interp(tilt, *self.tilt_factors))

    def profile(self) -> Doubles:
        """Return the intensities (g,) of a web that is the same in all planes."""
        assert self.is_axial
        return np.asarray(self.table[0])

    def even_grid(self) -> Doubles:
        """Return its intensities on an even grid, with the first and last angle as they are.

        (c, g), c from C0 to C360, or one row for an axial web; g from its first gamma to its last.
        A grid that has all angles of the file, unless these are uncommonly odd, is the same web.
        """
        gammas = _even(self.gammas, MAX_STEPS)
        rows = np.array([np.interp(gammas, self.gammas, row) for row in self.table])
        if self.is_axial:
            return rows
        planes = _even(self.planes, MAX_PLANES)
        return np.array([np.interp(planes, self.planes, column) for column in rows.T]).T


def unfolded(planes: Doubles, rows: Doubles, symmetry: Symmetry) -> tuple[Doubles, Doubles]:
    """Return all planes from 0 to 360 degrees, and their rows, of those that a file lists.

    planes: (c,) degrees, of which some may be above 360. rows: (c, g). An axial web keeps one row.
    """
    if symmetry == "axial":
        return np.zeros(1), rows[:1]
    images: Sequence[Callable[[float], float]] = {
        "quadrants": (lambda c: c, lambda c: 180 - c, lambda c: 180 + c, lambda c: 360 - c),
        "C0-C180": (lambda c: c, lambda c: 360 - c),
        "C90-C270": (lambda c: c, lambda c: 180 - c),
        "none": (lambda c: c,),
    }[symmetry]
    by_angle: dict[float, Doubles] = {}
    for image in images:
        for plane, row in zip(planes, rows, strict=True):
            by_angle.setdefault(round(float(image(plane)) % 360, 4) % 360, row)
    angles = sorted(by_angle)
    if angles[0] > 0:
        # No plane is at 0: it is between the last and the first.
        gap = angles[0] + 360 - angles[-1]
        share = angles[0] / gap
        by_angle[0.0] = (1 - share) * by_angle[angles[0]] + share * by_angle[angles[-1]]
        angles.insert(0, 0.0)
    return np.array([*angles, 360.0]), np.array([*(by_angle[x] for x in angles), by_angle[0.0]])


def turned(directions: Doubles, *, turn: float, tilt: float) -> Doubles:
    """Return directions (..., 3) of a web in the frame in which it hangs.

    tilt: degrees by which the nadir swings from −z towards +y, C90. turn: degrees by which it is
    then turned about z, from C0 towards C90.
    """
    return np.asarray(directions @ turning(turn=turn, tilt=tilt).T)


def turning(*, turn: float, tilt: float) -> Doubles:
    """Return the matrix (3, 3) of `turned`."""
    (c, s), (c_tilt, s_tilt) = (
        (math.cos(math.radians(x)), math.sin(math.radians(x))) for x in (turn, tilt)
    )
    about_axis = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_c0 = np.array([[1, 0, 0], [0, c_tilt, -s_tilt], [0, s_tilt, c_tilt]])
    return np.asarray(about_axis @ about_c0)


def _interval(angles: Doubles, angle: Doubles) -> tuple[Indices, Doubles]:
    """Return the index of the interval of `angles` that each angle is in, and its share of it."""
    if len(angles) == 1:
        return np.zeros(np.shape(angle), int), np.zeros(np.shape(angle))
    index = np.clip(np.searchsorted(angles, angle, side="right") - 1, 0, len(angles) - 2)
    share = (angle - angles[index]) / (angles[index + 1] - angles[index])
    return index, np.clip(share, 0, 1)


def _even(angles: Doubles, most: int) -> Doubles:
    """Return evenly spaced angles with the first and the last of `angles`, and if possible all."""
    if len(angles) < 2:
        return angles
    span = angles[-1] - angles[0]
    units = np.rint((angles - angles[0]) / GRID_UNIT).astype(int).tolist()
    steps = units[-1] // max(1, math.gcd(*units))
    return np.linspace(angles[0], angles[-1], min(steps, most) + 1) if span > 0 else angles


def world_from_web(to_world: Doubles, *, turn: float = 0.0, tilt: float = 0.0) -> Doubles:
    """Return the matrix (3, 3) from the frame of a web into the world.

    to_world: (3, 3), of the emitter, which may be scaled. turn, tilt: as in `turned`.
    Raises SceneError for a frame without three axes.
    """
    left, up, ahead = np.asarray(to_world, np.float64).T
    axes = [_unit(ahead)]
    axes.append(_unit(left - axes[0] * (left @ axes[0])))
    axes.append(_unit(up - sum(axis * (up @ axis) for axis in axes)))
    frame = np.array([axes[1], axes[2], axes[0]]).T
    return np.asarray(frame @ EMITTER_FROM_WEB @ turning(turn=turn, tilt=tilt))


def hanging_frame(up: Position) -> Doubles:
    """Return the matrix (3, 3) into the world of an emitter that shines straight down.

    With z up its C0 is +x and its C90 +y; with y up C0 is +x and C90 −z.
    """
    axis = _unit(np.array(up))
    k = int(np.argmax(np.abs(axis)))
    c0 = np.array([0.0, 1.0, 0.0]) if k == 0 else np.array([1.0, 0.0, 0.0])
    c0 = _unit(c0 - axis * (c0 @ axis))
    return np.array([-c0, np.cross(axis, c0), -axis]).T


def _unit(vector: Doubles) -> Doubles:
    length = float(np.linalg.norm(vector))
    if not length > 1e-12:
        raise SceneError("the luminaire has a transform without three axes")
    return np.asarray(vector / length)


@dataclass(frozen=True)
class SpotPart:
    """A spot of a sum: its candela on the axis, and beam width and cutoff in degrees."""

    candela: float
    beam: float
    cutoff: float


def spots_of(web: PhotometricWeb) -> tuple[SpotPart, ...]:
    """Return the spots that add up to a web; none if it is not axial, or not dark above 90 degrees.

    The error is at most SPOT_TOLERANCE of the largest intensity.
    """
    if not web.is_axial:
        return ()
    gammas, candela = web.gammas, web.profile()
    slack = SPOT_TOLERANCE * web.peak
    if np.any(candela[gammas > WIDEST] > slack):
        return ()
    below = gammas <= WIDEST
    above = candela[gammas > WIDEST]
    gammas, candela = gammas[below], candela[below]
    if len(above) and candela[-1] > slack and gammas[-1] < WIDEST:
        # It falls to the dark beyond 90 degrees, from before.
        return ()
    kept = _corners(gammas, candela, slack)
    gammas, candela = gammas[kept], candela[kept]
    parts = [
        SpotPart(float(first - last), float(beam), float(cutoff))
        for first, last, beam, cutoff in zip(
            candela[:-1], candela[1:], gammas[:-1], gammas[1:], strict=True
        )
    ]
    if gammas[0] > 0:
        parts.insert(0, SpotPart(float(-candela[0]), float(gammas[0]), float(gammas[0])))
    parts.append(SpotPart(float(candela[-1]), float(gammas[-1]), float(gammas[-1])))
    return tuple(x for x in parts if x.candela != 0)


def _corners(x: Doubles, y: Doubles, slack: float) -> Indices:
    """Return the points of a polyline that suffice for an error of y of at most `slack`.

    The method of Douglas and Peucker (1973), whose first and last points are kept.
    """
    kept, open_ranges = {0, len(x) - 1}, [(0, len(x) - 1)]
    while open_ranges:
        first, last = open_ranges.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        error = np.abs(y[inner] - np.interp(x[inner], x[[first, last]], y[[first, last]]))
        if error.max() > slack:
            middle = first + 1 + int(error.argmax())
            kept.add(middle)
            open_ranges += [(first, middle), (middle, last)]
    return np.array(sorted(kept))
