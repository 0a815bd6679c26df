"""Numbers one after the other in the text of a web file, with errors that say what was due."""

import math
from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.validation import BRIGHTEST, parse_number

#: Angles of a file at most, of gamma or of C-planes.
MAX_ANGLES = 2000
#: Numbers that are read at once at most: ten times those of the finest files.
MAX_VALUES = 2**20


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
