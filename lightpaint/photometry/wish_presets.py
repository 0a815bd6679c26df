"""Presets of wishes: rows of a standard, with where the figures come from.

The figures are those that makers of luminaires print in their tables of the standard. They are
not advice, and a design that must meet the standard needs the standard itself.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class WishPreset:
    """Least mean illuminance in lx and least uniformity, as a standard has them.

    activity: the standard's words for the task or the surface. standard: name and year. source:
    where the figures were read.
    """

    activity: str
    mean: float
    uniformity: float
    standard: str
    source: str

    def __str__(self) -> str:
        return (
            f"{self.activity}, {self.standard}: {self.mean:g} lx at a uniformity of "
            f"{self.uniformity:g} (figures of {self.source}: check them)"
        )


_TABLES = "tables printed by makers of luminaires"

#: Presets by the name that a planes file uses.
PRESETS = {
    "office": WishPreset(
        "writing, typing, reading, data processing", 500, 0.6, "EN 12464-1:2021", _TABLES
    ),
    "corridor": WishPreset("circulation areas", 100, 0.4, "EN 12464-1:2021", _TABLES),
    "walls": WishPreset("walls of a room", 75, 0.1, "EN 12464-1:2011", _TABLES),
    "ceiling": WishPreset("ceiling of a room", 50, 0.1, "EN 12464-1:2011", _TABLES),
}
