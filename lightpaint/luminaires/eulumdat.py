"""Reads EULUMDAT files (`.ldt`)."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.luminaires.lm63 import MAX_ANGLES, Numbers, check_rising, number
from lightpaint.luminaires.web import Opening, PhotometricWeb, Symmetry, unfolded

#: Symmetry by the number in the file (ISYM).
SYMMETRIES: tuple[Symmetry, ...] = ("none", "axial", "C0-C180", "C90-C270", "quadrants")

#: Sets of lamps at most, and lines of each.
MAX_SETS, SET_LINES = 20, 6
#: Lines before the first set of lamps, and of direct ratios after the last.
HEAD_LINES, RATIO_LINES = 26, 10


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
        _opening(at(16, "a length, line 16"), at(17, "a width, line 17"), at(18, "line 18")),
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


def _opening(length: float, width: float, height: float) -> Opening:
    """Return the opening of sizes in millimetres; without a width it is round.

    Its length is parallel to the plane C90, its width to C0.
    """
    length, width, height = (abs(x) / 1000 for x in (length, width, height))
    return Opening(width or length, length, height, is_round=width == 0 and length > 0)
