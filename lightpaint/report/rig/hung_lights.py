"""Lights with their places and the changes made to them, for pictures and pages."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lightpaint.arrays import RGB, Position
from lightpaint.display_text import some_names
from lightpaint.lighting import Lighting
from lightpaint.report.phrases import spoken_percent
from lightpaint.scene.properties.site import EmitterPlace

#: Shares that have a word of their own, and the farthest that one may be from it.
FRACTIONS = {
    1 / 10: "a tenth",
    1 / 5: "a fifth",
    1 / 4: "a quarter",
    1 / 3: "a third",
    1 / 2: "half",
    2 / 3: "two thirds",
    3 / 4: "three quarters",
}
FRACTION_TOLERANCE = 0.02


@dataclass(frozen=True)
class HungLight:
    """A light to draw. color: linear RGB of its light; black if it is off."""

    place: EmitterPlace
    color: RGB

    @property
    def is_changed(self) -> bool:
        """True if it moved or is new."""
        return self.place.moved_from is not None or bool(self.place.new)


@dataclass(frozen=True)
class LightChange:
    """A light that moved or is new. text: its change and gain. numbers: the same, for files."""

    name: str
    text: str
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class HungLights:
    """All lights with a place, and the changes, those that gained most first.

    up: the axis of the scene that is up. missed_before, missed_after: shares of the painting that
    are missed without the changes, and with them, by the search. looks: names of those that share
    the places.
    """

    lights: tuple[HungLight, ...]
    changes: tuple[LightChange, ...]
    up: Position
    missed_before: float
    missed_after: float
    looks: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The sentence on the total gain of the changes, and their looks."""
        if self.looks:
            return f"{self.shared_sentence} Each look has levels of its own."
        if not self.changes:
            return "No light is moved: no move would surely bring a hundredth of what is missed."
        return (
            f"{self._subject} {self._share} of what was missed (in energy, by the search; the "
            "picture above is solved and rendered anew)."
        )

    @property
    def shared_sentence(self) -> str:
        """The sentence on the gain for all looks that share the changes."""
        *others, last = self.looks
        names = f"{some_names(others)} and {some_names([last])}"
        if not self.changes:
            return (
                f"{names} share places. No light is moved: no move would surely bring a hundredth "
                "of what they miss together."
            )
        return (
            f"{names} share places. {self._subject} {self._share} of what they missed together (in "
            "energy, by the search)."
        )

    @property
    def _subject(self) -> str:
        return "This change brings" if len(self.changes) == 1 else "These changes bring"

    @property
    def _share(self) -> str:
        return spoken_fraction(1 - self.missed_after / max(self.missed_before, 1e-300))


def hung_lights(lighting: Lighting) -> tuple[HungLight, ...]:
    """Return the lights of an answer whose places are known."""
    colors = {
        member: light.emission for light in lighting.of_lamps().lights for member in light.members
    }
    black = (0.0, 0.0, 0.0)
    return tuple(HungLight(place, colors.get(place.name, black)) for place in lighting.places)


def spoken_fraction(share: float) -> str:
    """Return a share in words: `a fifth`, or `8 %` where none is near."""
    near = min(FRACTIONS, key=lambda fraction: abs(fraction - share))
    if abs(near - share) <= FRACTION_TOLERANCE * max(near, 0.25) / 0.25:
        return FRACTIONS[near]
    return spoken_percent(share)


def placement_numbers(hung: HungLights) -> dict[str, Any]:
    """Return what a search of places came to, for report.json."""
    return {
        "missed_before": hung.missed_before,
        "missed_after": hung.missed_after,
        "looks": list(hung.looks),
        "changes": [
            {"name": change.name, "text": change.text, **change.numbers} for change in hung.changes
        ],
    }
