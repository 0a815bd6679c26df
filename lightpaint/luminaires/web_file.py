"""Reads the photometric web of a luminaire from a file of its maker: LM-63 or EULUMDAT.

Files of ANSI/IES LM-63 (`.ies`) may be of 1986 to 2019, with photometry of type C; files of
EULUMDAT end in `.ldt`.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import SceneError
from lightpaint.files import one_line, read_bytes
from lightpaint.luminaires.web import Opening, PhotometricWeb, Symmetry, unfolded
from lightpaint.validation import BRIGHTEST, parse_number

#: Angles of a file at most, of gamma or of C-planes.
MAX_ANGLES = 2000
#: Numbers that are read at once at most: ten times the numbers of the finest files.
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
_DECIMAL_COMMA = re.compile(r"\b\d{1,20},\d{1,20}\b")
_KEYWORD = re.compile(r"\s*\[(\w+)\]\s*(.*?)\s*$")

#: Longest file in bytes.
MAX_BYTES = 2**24

#: Difference between the integral of a web and the lumens that its file states, relative to these,
#: from which on it is worth a remark.
FLUX_TOLERANCE = 0.05

#: Symmetry by the number in the file (ISYM).
SYMMETRIES: tuple[Symmetry, ...] = ("none", "axial", "C0-C180", "C90-C270", "quadrants")

#: Sets of lamps at most, and lines of each.
MAX_SETS, SET_LINES = 20, 6
#: Lines before the first set of lamps, and of direct ratios after the last.
HEAD_LINES, RATIO_LINES = 26, 10


class Numbers:
    """A sequence of texts that are numbers, read from its start."""

    def __init__(self, texts: Sequence[str]) -> None:
        self._texts, self._next = texts, 0

    @property
    def left(self) -> int:
        """Number of texts that were not read yet."""
        return len(self._texts) - self._next

    def one(self, what: str) -> float:
        """Return the next number. what: its name in errors."""
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
    """Return the number that a text is. what: its name in errors."""
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
            is_of_2019 = edition.endswith("LM-63-2019")
            _check_commas(text, tilt[1])
            return _parse_body(text.replace(",", " "), tilt[1], name, is_of_2019=is_of_2019)
        keyword = _KEYWORD.match(line)
        if keyword and keyword[1].upper() in ("LUMINAIRE", "LUMCAT") and keyword[2]:
            name = name if keyword[1].upper() == "LUMCAT" and name else one_line(keyword[2])
    raise SceneError("it has no line TILT=: it is not an IES file (LM-63)")


def _parse_body(text: str, tilt: str, name: str, *, is_of_2019: bool) -> PhotometricWeb:
    """Return the web in what follows the tilt, numbers with blanks between them."""
    numbers = Numbers(text.split())
    tilt_factors = _tilt_factors(tilt, numbers)
    web = _parse_numbers(numbers, name, is_of_2019=is_of_2019)
    return replace(web, tilt_factors=tilt_factors, unread=numbers.left)


def _check_commas(text: str, tilt: str) -> None:
    """Raise SceneError for a file whose numbers are as many as it announces only if its commas are
    decimal ones: in LM-63 they stand between numbers.
    """
    if (decimal := _DECIMAL_COMMA.search(text)) is None:
        return
    try:
        web = _parse_body(text.replace(",", "."), tilt, "", is_of_2019=False)
    except SceneError:
        return
    if not web.unread:
        raise SceneError(
            f"its numbers have decimal commas, as {decimal[0]}, which part two numbers in an IES "
            f"file: write {decimal[0].replace(',', '.')}"
        )


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


def parse_eulumdat(text: str) -> PhotometricWeb:
    """Return the web in the text of a file. Raises SceneError, without the name of the file."""
    lines = [line.strip() for line in text.splitlines()]
    if len(lines) <= HEAD_LINES + SET_LINES + RATIO_LINES:
        raise SceneError(f"it has {len(lines)} lines: it is cut off, or not EULUMDAT")

    def at(line: int, what: str) -> float:
        return number(lines[line - 1].replace(",", ".") or "0", what)

    code = at(3, "the symmetry, line 3")
    if code not in range(len(SYMMETRIES)):
        raise SceneError(f"its symmetry, line 3, is {code:g}: expected 0, 1, 2, 3 or 4")
    symmetry = SYMMETRIES[int(code)]
    plane_count = _count(at(4, "the number of C-planes, line 4"), "C-planes, line 4")
    gamma_count = _count(at(6, "the number of intensities, line 6"), "intensities, line 6")
    sets = _count(
        at(26, "the number of sets of lamps, line 26"), "sets of lamps, line 26", MAX_SETS
    )
    flux = at(HEAD_LINES + 3, "the flux of the lamps, line 29")
    watts = at(HEAD_LINES + 6, "the power, line 32")
    if flux <= 0:
        raise SceneError(f"the flux of its lamps, line 29, is {flux:g}: expected lumens above 0")
    factor = at(24, "the conversion factor, line 24") or 1.0
    if factor < 0:
        raise SceneError(f"its conversion factor, line 24, is {factor:g}: expected more than 0")
    body = lines[HEAD_LINES + SET_LINES * sets + RATIO_LINES :]
    numbers = Numbers([line.replace(",", ".") for line in body if line])
    angles = numbers.several(plane_count, "angles of C-planes")
    gammas = numbers.several(gamma_count, "angles of intensities")
    check_rising(angles, "C-planes", 0, 360)
    check_rising(gammas, "angles", 0, 180)
    planes = _listed_planes(angles, symmetry)
    values = numbers.several(len(planes) * gamma_count, "intensities")
    if values.min() < 0:
        raise SceneError("it has a negative intensity")
    planes, table = unfolded(planes, values.reshape(len(planes), gamma_count), symmetry)
    efficiency = at(23, "the light output ratio, line 23")
    return PhotometricWeb(
        one_line(lines[8]),
        gammas,
        planes,
        flux / 1000 * factor * table,
        symmetry,
        _ldt_opening(at(16, "a length, line 16"), at(17, "a width, line 17"), at(18, "line 18")),
        flux * efficiency / 100 if efficiency > 0 else flux,
        of_lamps=efficiency <= 0,
        watts=watts if watts > 0 else None,
        unread=numbers.left,
    )


def _count(value: float, what: str, most: int = MAX_ANGLES) -> int:
    if value != int(value) or not 1 <= value <= most:
        raise SceneError(f"it has {value:g} {what}: expected 1 to {most}")
    return int(value)


def _listed_planes(angles: Doubles, symmetry: Symmetry) -> Doubles:
    """Return the planes whose intensities a file lists, of all C-planes that it names."""
    last_plane = {"axial": 0.0, "quadrants": 90.0, "C0-C180": 180.0}
    if symmetry == "none":
        return angles
    if symmetry == "C90-C270":
        # From C270 through C0 to C90.
        listed = [*(x for x in angles if x >= 270), *(x + 360 for x in angles if x <= 90)]
        ends = (270.0, 450.0)
    else:
        listed = [x for x in angles if x <= last_plane[symmetry]]
        ends = (0.0, last_plane[symmetry])
    if not listed or (listed[0], listed[-1]) != ends:
        first, last = (f"{end % 360:g}" for end in ends)
        raise SceneError(
            f"its symmetry, line 3, is {SYMMETRIES.index(symmetry)}, but it has no C-plane at "
            f"{first} or at {last} degrees"
        )
    return np.array(listed)


def _ldt_opening(length: float, width: float, height: float) -> Opening:
    """Return the opening of sizes in millimetres; without a width it is round.

    Its length is parallel to the plane C90, its width to C0.
    """
    length, width, height = (abs(x) / 1000 for x in (length, width, height))
    return Opening(width or length, length, height, is_round=width == 0 and length > 0)


def read_web(path: Path) -> PhotometricWeb:
    """Read a photometric web from an IES (LM-63, type C) or EULUMDAT file.

    Raises SceneError, in one line that names the file, if it is damaged or of another kind.
    """
    data = read_bytes(path, "photometric file", SceneError, limit=MAX_BYTES)
    return _parsed(path, data)


#: Readers by the ending of a file.
READERS = {".ies": parse_lm63, ".ldt": parse_eulumdat}


@lru_cache(64)
def _parsed(path: Path, data: bytes) -> PhotometricWeb:
    parse = READERS.get(path.suffix.lower())
    if parse is None:
        raise SceneError(path, " is neither .ies nor .ldt: expected the file of a luminaire")
    try:
        # EULUMDAT is in ISO 8859-1; LM-63 is in ASCII, and names in it often are not.
        web = parse(data.decode("latin-1"))
        if not web.peak <= BRIGHTEST:
            raise SceneError(f"its intensities are up to {web.peak:.3g} cd: that is no light")
        if not web.flux > 0:
            raise SceneError("it is dark: all its intensities are 0")
    except SceneError as error:
        raise SceneError(path, ": ", error) from None
    return web


def unread_remark(web: PhotometricWeb, where: str) -> str | None:
    """Return a remark if a file goes on after its end; None if not. where: name of the file."""
    if not web.unread:
        return None
    count = "1 number" if web.unread == 1 else f"{web.unread} numbers"
    return (
        f"{where}: {count} after the last intensity that it announces, which count for nothing: "
        "check its numbers of angles"
    )


def flux_remark(web: PhotometricWeb, where: str) -> str | None:
    """Return a remark if the flux of a web is not what its file states; None if it is, or if the
    file states none.

    where: name of the file.
    """
    stated = web.stated_lumens
    if stated is None or abs(web.flux / stated - 1) <= FLUX_TOLERANCE:
        return None
    whose = "for its lamps" if web.of_lamps else "for the luminaire"
    return (
        f"{where}: its intensities add up to {web.flux:,.0f} lm, {web.flux / stated:.0%} of the "
        f"{stated:,.0f} lm that it states {whose}"
    )
