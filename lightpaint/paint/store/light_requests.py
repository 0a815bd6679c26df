"""What is asked in a session beside the paint: of single lights, of dimmers, of the answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from lightpaint.basis.lights import BasisLight
from lightpaint.errors import PaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import tables_by_light, tied_lights
from lightpaint.pipeline.settings import Settings

#: What may be asked of the answer: of its fit, and of all lights together.
OF_FIT, OF_ALL = ("hold", "space", "colors", "literal"), ("prefer_current", "sparse")

#: What holds a light at a level.
HOLDS = ("lock", "off")

#: What people know them by: the titles that the page's settings have.
TITLES = {
    "hold": "What you did not paint",
    "space": "What counts as close",
    "colors": "Which colours lamps may have",
    "literal": "How the paint is meant",
    "prefer_current": "Lights that hardly help",
    "sparse": "How many lights may be on",
}


@dataclass(frozen=True)
class Wishes:
    """Plain values all, as JSON has them.

    lights: by name of light, keys and values as of a lights file. ties: names that are on one
    dimmer. values: of OF_FIT and OF_ALL, what is not as it follows from the painting.
    """

    lights: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    ties: tuple[tuple[str, ...], ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Wishes":
        """From what `as_json` made."""
        ties = tuple(tuple(names) for names in data.get("ties", ()))
        return cls(dict(data.get("lights", {})), ties, dict(data.get("values", {})))

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        lights = {name: dict(asked) for name, asked in self.lights.items()}
        return {"lights": lights, "ties": [list(x) for x in self.ties], "values": dict(self.values)}

    def of_light(self, name: str, asked: Mapping[str, Any]) -> "Wishes":
        """With this asked of one light, and nothing else of it.

        Who holds a light holds all on its dimmer, and what was held of these before no more.
        """
        tied = next((names for names in self.ties if name in names), ())
        lights = {**self.lights, name: asked}
        return replace(self, lights=_one_level(lights, (name, *tied)))

    def of_ties(self, ties: Sequence[Sequence[str]]) -> "Wishes":
        """With these on one dimmer each; of those that are held the first one holds it."""
        lights = dict(self.lights)
        for names in ties:
            lights = _one_level(lights, names)
        return replace(self, lights=lights, ties=tuple(map(tuple, ties)))

    def of_answer(self, values: Mapping[str, Any]) -> "Wishes":
        """With these values, None for what follows from the painting. Raises PaintError."""
        if unknown := [key for key in values if key not in (*OF_FIT, *OF_ALL)]:
            raise PaintError(f"nothing is called {unknown[0]!r} in what can be set")
        # Not by `in`: 0 lets go of what is held, and equals False.
        both = {**self.values, **values}
        kept = {k: v for k, v in both.items() if v is not None and v is not False}
        return replace(self, values=kept)

    @classmethod
    def asking(
        cls, constraints: Constraints, lights: Sequence[BasisLight], values: Mapping[str, Any]
    ) -> "Wishes":
        """What constraints ask of these lights, patterns spelled out; of `values` what is OF_FIT.

        Raises ConstraintError for lights that there are none of, PaintError for what a session has
        no place for.
        """
        each = zip(lights, tables_by_light(constraints, lights), strict=True)
        asked = {light.name: its for light, (its, _) in each if its}
        ties = {id(tie): (tie, its) for tie, its in tied_lights(constraints, lights).values()}
        for tie, _ in ties.values():
            if tie.color is not None:
                raise PaintError(f"{tie.where}: ask for the colour of each light; ties have none")
        names = tuple(tuple(lights[k].name for k in its) for _, its in ties.values())
        kept = {key: value for key, value in values.items() if key in OF_FIT}
        together = {key: getattr(constraints, key) for key in OF_ALL}
        return cls(asked, names, kept).of_answer({k: v for k, v in together.items() if v})

    def constraints(self) -> Constraints:
        """What is asked of the lights. Raises ConstraintError for what means nothing."""
        together = {key: self.values[key] for key in OF_ALL if key in self.values}
        return Constraints.of(self.lights, tie=self.ties, **together)

    def settings(self, given: Settings) -> Settings:
        """`given`, of whose answer this is asked. Raises LightpaintError for what is no value."""
        asked = {key: self.values[key] for key in OF_FIT if key in self.values}
        if "hold" in asked and given.unpainted:
            asked["unpainted"] = 0.0
        return replace(given, **asked)


def _one_level(
    lights: Mapping[str, Mapping[str, Any]], names: Sequence[str]
) -> dict[str, Mapping[str, Any]]:
    """`lights`, of which of `names` only the first that is held still is."""
    made, is_held = dict(lights), False
    for name in dict.fromkeys(names):
        asked = dict(made.get(name, {}))
        if is_held:
            asked = {key: value for key, value in asked.items() if key not in HOLDS}
        # Not by `in`: 0 is a level, and equals False.
        values = (asked.get(key) for key in HOLDS)
        is_held = is_held or any(value is not None and value is not False for value in values)
        made[name] = asked
    return {name: asked for name, asked in made.items() if asked}
