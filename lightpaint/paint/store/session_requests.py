"""Requests beside the paint: constraints on lights, dimmers, settings of the answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from lightpaint.basis.lights import BasisLight
from lightpaint.errors import PaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import tables_by_light, tied_lights
from lightpaint.pipeline.settings import Settings

#: Settings of the answer: those of its fit, and those of all lights together.
FIT_KEYS, ALL_LIGHTS_KEYS = ("hold", "space", "colors", "literal"), ("prefer_current", "sparse")

#: Keys that hold a light at a level.
HOLD_KEYS = ("lock", "off")

#: Titles of these settings on the page.
TITLES = {
    "hold": "Unpainted parts",
    "space": "Colour space of the match",
    "colors": "Light colours",
    "literal": "Read the paint as",
    "prefer_current": "Lights that make little difference",
    "sparse": "Number of lights",
}


@dataclass(frozen=True)
class SessionRequests:
    """Requests of a session, as plain JSON values.

    lights: by name of light, keys and values as of a lights file. ties: names that share a dimmer.
    values: of FIT_KEYS and ALL_LIGHTS_KEYS, those that differ from the painting's defaults.
    """

    lights: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    ties: tuple[tuple[str, ...], ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "SessionRequests":
        """Return the requests that `as_json` wrote."""
        ties = tuple(tuple(names) for names in data.get("ties", ()))
        return cls(dict(data.get("lights", {})), ties, dict(data.get("values", {})))

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        lights = {name: dict(asked) for name, asked in self.lights.items()}
        return {"lights": lights, "ties": [list(x) for x in self.ties], "values": dict(self.values)}

    def with_light(self, name: str, asked: Mapping[str, Any]) -> "SessionRequests":
        """Return these requests with all those on one light replaced.

        Holding a light holds all on its dimmer; earlier holds of these are dropped.
        """
        tied = next((names for names in self.ties if name in names), ())
        lights = {**self.lights, name: asked}
        return replace(self, lights=_hold_once(lights, (name, *tied)))

    def with_ties(self, ties: Sequence[Sequence[str]]) -> "SessionRequests":
        """Return these requests with these dimmers; the first held light of each holds it."""
        lights = dict(self.lights)
        for names in ties:
            lights = _hold_once(lights, names)
        return replace(self, lights=lights, ties=tuple(map(tuple, ties)))

    def with_values(self, values: Mapping[str, Any]) -> "SessionRequests":
        """Return these requests with these values, None for defaults. Raises PaintError."""
        if unknown := [key for key in values if key not in (*FIT_KEYS, *ALL_LIGHTS_KEYS)]:
            raise PaintError(f"nothing is called {unknown[0]!r} in what can be set")
        # Not by `in`: 0 lets go of what is held, and equals False.
        both = {**self.values, **values}
        kept = {k: v for k, v in both.items() if v is not None and v is not False}
        return replace(self, values=kept)

    @classmethod
    def from_constraints(
        cls, constraints: Constraints, lights: Sequence[BasisLight], values: Mapping[str, Any]
    ) -> "SessionRequests":
        """Return requests equal to constraints on these lights, and those of `values` in FIT_KEYS.

        Raises ConstraintError for lights that do not exist, PaintError for what a session cannot
        express.
        """
        each = zip(lights, tables_by_light(constraints, lights), strict=True)
        asked = {light.name: its for light, (its, _) in each if its}
        ties = {id(tie): (tie, its) for tie, its in tied_lights(constraints, lights).values()}
        for tie, _ in ties.values():
            if tie.color is not None:
                raise PaintError(f"{tie.where}: ask for the colour of each light; ties have none")
        names = tuple(tuple(lights[k].name for k in its) for _, its in ties.values())
        kept = {key: value for key, value in values.items() if key in FIT_KEYS}
        joint_progress = {key: getattr(constraints, key) for key in ALL_LIGHTS_KEYS}
        return cls(asked, names, kept).with_values({k: v for k, v in joint_progress.items() if v})

    def constraints(self) -> Constraints:
        """Return the constraints on the lights. Raises ConstraintError for invalid ones."""
        joint_progress = {key: self.values[key] for key in ALL_LIGHTS_KEYS if key in self.values}
        return Constraints.of(self.lights, tie=self.ties, **joint_progress)

    def settings(self, base: Settings) -> Settings:
        """Return `base` with the requested settings. Raises LightpaintError for an invalid
        value.
        """
        asked = {key: self.values[key] for key in FIT_KEYS if key in self.values}
        if "hold" in asked and base.unpainted:
            asked["unpainted"] = 0.0
        return replace(base, **asked)


def _hold_once(
    lights: Mapping[str, Mapping[str, Any]], names: Sequence[str]
) -> dict[str, Mapping[str, Any]]:
    """Return `lights` in which only the first held light of `names` is still held."""
    made, is_held = dict(lights), False
    for name in dict.fromkeys(names):
        asked = dict(made.get(name, {}))
        if is_held:
            asked = {key: value for key, value in asked.items() if key not in HOLD_KEYS}
        # Not by `in`: 0 is a level, and equals False.
        values = (asked.get(key) for key in HOLD_KEYS)
        is_held = is_held or any(value is not None and value is not False for value in values)
        made[name] = asked
    return {name: asked for name, asked in made.items() if asked}
