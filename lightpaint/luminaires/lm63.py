"""Reads ANSI/IES LM-63 files (`.ies`), of 1986 to 2019, with photometry of type C."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.luminaires.web import Opening, PhotometricWeb, Symmetry, unfolded
from lightpaint.validation import BRIGHTEST, parse_number

#: Angles of a file at most, of gamma or of C-planes.
MAX_ANGLES = 2000
#: Numbers that are read at once at most: ten times those of the finest files.
MAX_VALUES = 2**20

#: Names of photometric types.
TYPES = {1: "C", 2: "B", 3: "A"}

#: Metres of a unit of length: feet, metres.
LENGTHS = {1: 0.3048, 2: 1.0}

#: Lumens per lamp of a file whose candela are absolute.
ABSOLUTE = -1

#: What DOS wrote after the end of a file.
END_OF_FILE = "\x1a"

#: Lines before the tilt at most.
MAX_KEYWORDS = 1000

_TILT = re.compile(r"\s*TILT\s*=\s*(.*?)\s*$", re.IGNORECASE)
_KEYWORD = re.compile(r"\s*\[(\w+)\]\s*(.*?)\s*$")


class Numbers:
    """A sequence of texts that are numbers, read from its start."""

    def __init__(self, texts: Sequence[str]) -> None:
        self._texts, self._next = texts, 0

    @property
    def left(self) -> int:
        """Number of texts that were not read yet."""
        return len(self._texts) - self._next

    def one(self, what: str) -> float:
        """Return the next number, which is `what`."""
        return float(self.several(1, what)[0])

    def whole(self, what: str, most: int) -> int:
        """Return the next number, which must be a whole one from 1 to `most`."""
        value = self.one(what)
        if value != int(value) or not 1 <= value <= most:
            raise SceneError(f"{what} is {value:g}: expected a whole number from 1 to {most}")
        return int(value)

    def several(self, count: int, what: str) -> Doubles:
        """Return the next `count` numbers, which are `what`."""
        if count > MAX_VALUES:
            raise SceneError(f"it has {count} {what}: at most {MAX_VALUES} are read")
        if count > self.left:
            raise SceneError(f"it ends after {self.left} of {count} {what}: it is cut off")
        texts = self._texts[self._next : self._next + count]
        self._next += count
        return np.array([number(text, what) for text in texts], np.float64)


def number(text: str, what: str) -> float:
    """Return the number that a text is, which is `what`."""
    try:
        value = parse_number(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= BRIGHTEST:
        raise SceneError(f"{what}: {one_line(repr(text), limit=60)} is not a number")
    return value


def check_rising(angles: Doubles, what: str, least: float, most: float) -> None:
    """Raise SceneError unless angles rise, from `least` at least to `most` at most."""
    if not (
        least - 1e-3 <= angles[0] and angles[-1] <= most + 1e-3 and (np.diff(angles) > 0).all()
    ):
        raise SceneError(f"its {what} do not rise, from {least:g} or more to {most:g} or less")


def parse_lm63(text: str) -> PhotometricWeb:
    """Return the web in the text of a file. Raises SceneError, without the name of the file."""
    lines = text.splitlines()
    name, edition = "", lines[0].strip().upper() if lines else ""
    for k, line in enumerate(lines[: MAX_KEYWORDS + 1]):
        if tilt := _TILT.match(line):
            text = " ".join(lines[k + 1 :]).removesuffix(END_OF_FILE)
            numbers = Numbers(text.replace(",", " ").split())
            tilt_factors = _tilt_factors(tilt[1], numbers)
            web = _parse_numbers(numbers, name, is_of_2019=edition.endswith("LM-63-2019"))
            return replace(web, tilt_factors=tilt_factors, unread=numbers.left)
        keyword = _KEYWORD.match(line)
        if keyword and keyword[1].upper() in ("LUMINAIRE", "LUMCAT") and keyword[2]:
            name = name if keyword[1].upper() == "LUMCAT" and name else one_line(keyword[2])
    raise SceneError("it has no line TILT=: it is not an IES file (LM-63)")


def _tilt_factors(tilt: str, numbers: Numbers) -> Doubles | None:
    """Return the factors of a luminaire that is tilted, (2, k): angles and factors; None without.

    The geometry of the lamp, which comes before them, says why they differ and changes nothing.
    """
    if tilt.upper() == "NONE":
        return None
    if tilt.upper() != "INCLUDE":
        raise SceneError(
            f"its TILT is in another file, {one_line(repr(tilt), limit=60)}: put it into this one "
            "(TILT=INCLUDE), or write TILT=NONE"
        )
    numbers.one("the geometry of the lamp")
    count = numbers.whole("the number of tilt angles", MAX_ANGLES)
    angles = numbers.several(count, "tilt angles")
    check_rising(angles, "tilt angles", 0, 180)
    factors = numbers.several(count, "factors of tilt angles")
    if factors.min() < 0:
        raise SceneError("it has a negative factor of a tilt angle")
    return np.array([angles, factors])


def _parse_numbers(numbers: Numbers, name: str, *, is_of_2019: bool) -> PhotometricWeb:
    lamps = numbers.one("the number of lamps")
    lumens = numbers.one("the lumens per lamp")
    factor = numbers.one("the candela multiplier")
    gamma_count = numbers.whole("the number of vertical angles", MAX_ANGLES)
    plane_count = numbers.whole("the number of horizontal angles", MAX_ANGLES)
    kind, unit = numbers.one("the photometric type"), numbers.one("the unit of length")
    if kind != 1:
        known = TYPES.get(int(kind))
        title = f"type {known}" if known else f"an unknown type, {kind:g}"
        raise SceneError(f"its photometry is of {title}: expected type C, 1")
    if unit not in LENGTHS:
        raise SceneError(f"its unit of length is {unit:g}: expected 1, feet, or 2, metres")
    sizes = LENGTHS[int(unit)] * numbers.several(3, "sizes of the opening")
    factor *= numbers.one("the ballast factor")
    # It describes the origin of the file since 2019; it was reserved, and 1, from 1995 on.
    lamp_factor = numbers.one("the ballast-lamp photometric factor")
    factor *= 1.0 if is_of_2019 else lamp_factor
    watts = numbers.one("the input power")
    if factor <= 0:
        raise SceneError(f"its factors multiply to {factor:g}: expected more than 0")
    gammas = numbers.several(gamma_count, "vertical angles")
    check_rising(gammas, "vertical angles", 0, 180)
    planes = numbers.several(plane_count, "horizontal angles")
    symmetry = _symmetry(planes)
    candela = numbers.several(gamma_count * plane_count, "candela values")
    if candela.min() < 0:
        raise SceneError("it has a negative intensity")
    planes, table = unfolded(planes, candela.reshape(plane_count, gamma_count), symmetry)
    stated = None if lumens == ABSOLUTE else abs(lamps) * lumens
    return PhotometricWeb(
        name,
        gammas,
        planes,
        factor * table,
        symmetry,
        _opening(sizes),
        stated if stated and stated > 0 else None,
        of_lamps=stated is not None,
        watts=watts if watts > 0 else None,
    )


def _symmetry(planes: Doubles) -> Symmetry:
    """Return the symmetry that horizontal angles have."""
    first, last = (round(float(x), 3) for x in (planes[0], planes[-1]))
    if (first, last) == (90, 270) and len(planes) > 1:
        check_rising(planes, "horizontal angles", 90, 270)
        return "C90-C270"
    check_rising(planes, "horizontal angles", 0, 360)
    if len(planes) == 1:
        if first == 0:
            return "axial"
    elif first == 0 and last in (90, 180):
        return "quadrants" if last == 90 else "C0-C180"
    elif first == 0 and last > 180:
        return "none"
    raise SceneError(
        f"its horizontal angles go from {first:g} to {last:g}: expected 0; 0 to 90, 180 or 360; "
        "or 90 to 270"
    )


def _opening(sizes: Doubles) -> Opening:
    """Return the opening of width, length and height in metres, of which negative ones are round.

    Its length is parallel to the plane C0, its width to C90.
    """
    width, length, height = (float(x) for x in abs(sizes))
    is_round = bool(sizes[:2].min() < 0)
    if is_round:
        width, length = width or length, length or width
    return Opening(length, width, height, is_round)
