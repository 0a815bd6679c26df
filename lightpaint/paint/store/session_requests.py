"""Requests beside the paint: constraints on lights, dimmers, settings of the answer."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis import BasisLight
from lightpaint.errors import PaintError
from lightpaint.lighting import Constraints, tables_by_light, tied_lights
from lightpaint.pipeline.job.settings import Settings
from lightpaint.validation import is_amount, is_number

#: Settings of the answer: the settings of its fit, and the settings of all lights together.
FIT_KEYS = ("hold", "space", "colors", "literal")
ALL_LIGHTS_KEYS = ("prefer_current", "near", "sparse")

#: Whether answers need not meet the wishes for measuring planes.
IGNORE_WISHES = "ignore_wishes"

#: Strength of the pull to lamps that somebody started from, if nobody has set another.
DEFAULT_NEAR = 0.1

#: Keys that hold a light at a level.
HOLD_KEYS = ("lock", "off")

#: Greatest factor of the master dimmer: a stop above the answer.
MAX_MASTER = 2.0

#: Titles of these settings on the page.
TITLES = {
    "hold": "Unpainted parts",
    "space": "Colour space of the match",
    "colors": "Light colours",
    "literal": "Read the paint as",
    "prefer_current": "Lights that make little difference",
    "near": "Near my lamps",
    "sparse": "Number of lights",
    IGNORE_WISHES: "Answers meet the wishes",
}


@dataclass(frozen=True)
class SessionRequests:
    """Requests of a session, as plain JSON values.

    lights: by name of light, keys and values as of a lights file. ties: names that share a dimmer.
    values: of FIT_KEYS, ALL_LIGHTS_KEYS and IGNORE_WISHES, those that differ from the painting's
    defaults.
    poses: of lights that were moved, by name: position, target, cutoff and beam, as in a `Pose`.
    added: lights that the scene does not have, by name, behind all others: kind, pose, size and
    emission, as in a `NewEmitter`.
    master: factor of all lights but fixed ones, applied to the answer.
    earlier: constraints of held lights, by name, which apply again once they are released.
    kept: names of the lights that are locked only since they were moved.
    start: emissions by name of light, set by hand, that the solve starts from; none for the
    emissions of the scene.
    spent: adjustments that are hidden since then, each with the id of its copy, or null.
    """

    lights: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    ties: tuple[tuple[str, ...], ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    poses: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    added: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    master: float = 1.0
    earlier: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    start: Mapping[str, Sequence[float]] = field(default_factory=dict)
    spent: tuple[tuple[int, int | None], ...] = ()

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "SessionRequests":
        """Return the requests that `as_json` wrote."""
        ties = tuple(tuple(names) for names in data.get("ties", ()))
        poses = {name: dict(pose) for name, pose in data.get("poses", {}).items()}
        added = {name: dict(light) for name, light in data.get("added", {}).items()}
        lights, values = dict(data.get("lights", {})), dict(data.get("values", {}))
        earlier = {name: dict(entry) for name, entry in data.get("earlier", {}).items()}
        kept = tuple(data.get("kept", ()))
        start = {name: tuple(emission) for name, emission in data.get("start", {}).items()}
        spent = tuple((number, copy) for number, copy in data.get("spent", ()))
        requests = cls(lights, ties, values, poses, added, earlier=earlier, kept=kept)
        requests = replace(requests, start=start, spent=spent)
        return requests.with_master(data.get("master", 1.0))

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        lights = {name: dict(constraints) for name, constraints in self.lights.items()}
        moved = {name: dict(pose) for name, pose in self.poses.items()}
        added = {name: dict(light) for name, light in self.added.items()}
        return {
            "lights": lights,
            "ties": [list(x) for x in self.ties],
            "values": dict(self.values),
            **({"poses": moved} if moved else {}),
            **({"added": added} if added else {}),
            **({"master": self.master} if self.master != 1 else {}),
            **({"earlier": {k: dict(v) for k, v in self.earlier.items()}} if self.earlier else {}),
            **({"kept": list(self.kept)} if self.kept else {}),
            **({"start": {k: list(v) for k, v in self.start.items()}} if self.start else {}),
            **({"spent": [list(x) for x in self.spent]} if self.spent else {}),
        }

    @property
    def placed(self) -> dict[str, Mapping[str, Any]]:
        """Lights that are elsewhere than in the scene, or not in it, by name.

        A pose of those that were moved; of added ones, which come last, `kind` and the like beside
        it.
        """
        moved = {name: pose for name, pose in self.poses.items() if name not in self.added}
        added = {name: {**light, **self.poses.get(name, {})} for name, light in self.added.items()}
        return moved | added

    @property
    def place_key(self) -> str:
        """A short text, equal for equal places of all lights; "" if they hang as in the scene."""
        if not (placed := self.placed):
            return ""
        return hashlib.sha256(json.dumps(placed, sort_keys=True).encode()).hexdigest()[:16]

    def with_light(self, name: str, requested: Mapping[str, Any]) -> "SessionRequests":
        """Return these requests with all those on one light replaced.

        Holding a light holds all on its dimmer; earlier holds of these are dropped.
        """
        tied = next((names for names in self.ties if name in names), ())
        lights = _hold_once({**self.lights, name: requested}, (name, *tied))
        before = {k: v for k, v in self.lights.get(name, {}).items() if k not in HOLD_KEYS}
        kept = tuple(other for other in self.kept if other != name)
        changed = replace(self, lights=lights, kept=kept)
        return changed._with_earlier({name: before, **self.earlier})

    def with_kept(self, name: str, emission: Any) -> "SessionRequests":
        """Return these requests with a light, which is not held, locked since it was moved.

        emission: three numbers, or one for a light that has only one.
        """
        locked = self.with_light(name, {"lock": emission})
        return replace(locked, kept=(*locked.kept, name))

    def without_kept(self, name: str) -> "SessionRequests":
        """Return these requests with such a light released."""
        return self.with_light(name, self.earlier.get(name, {}))

    def with_start(self, start: Mapping[str, Sequence[float]]) -> "SessionRequests":
        """Return these requests with a lighting to start from, emissions by name; locked lights are
        released. Without any, the solve starts from the scene again, and nothing is near.
        """
        locked = [name for name, entry in self.lights.items() if _holds(entry) and "lock" in entry]
        released = self
        for name in locked if start else ():
            released = released.with_light(name, self.earlier.get(name, {}))
        values = {key: value for key, value in self.values.items() if start or key != "near"}
        emissions = {name: tuple(emission) for name, emission in start.items()}
        return replace(released, start=emissions, values=values, spent=())

    def with_spent_as(self, ids: Mapping[int, int]) -> "SessionRequests":
        """Return these requests for other layers. ids: of these, by those that they had; hidden
        adjustments without one are gone.
        """
        spent = tuple(
            (ids[number], None if copy is None else ids.get(copy))
            for number, copy in self.spent
            if number in ids
        )
        return replace(self, spent=spent)

    def holds(self, name: str) -> bool:
        """Return whether a light is held at a level, by itself or with others on its dimmer."""
        tied = next((names for names in self.ties if name in names), ())
        return any(_holds(self.lights.get(x, {})) for x in (name, *tied))

    def with_earlier(self, earlier: Mapping[str, Mapping[str, Any]]) -> "SessionRequests":
        """Return these requests with other constraints that apply to held lights once they are
        released, by name. Constraints on other lights are left out.
        """
        return self._with_earlier({**self.earlier, **earlier})

    def _with_earlier(self, earlier: Mapping[str, Mapping[str, Any]]) -> "SessionRequests":
        is_held = {name for name, entry in self.lights.items() if _holds(entry)}
        remaining = {name: entry for name, entry in earlier.items() if entry and name in is_held}
        return replace(self, earlier=remaining, kept=tuple(x for x in self.kept if x in is_held))

    @property
    def ignores_wishes(self) -> bool:
        """True if answers need not meet the wishes for measuring planes."""
        return bool(self.values.get(IGNORE_WISHES))

    def with_poses(self, poses: Mapping[str, Mapping[str, Any]]) -> "SessionRequests":
        """Return these requests with changed poses of lights; an empty change puts one back."""
        merged = dict(self.poses)
        for name, change in poses.items():
            merged[name] = {**merged.get(name, {}), **change} if change else {}
        return replace(self, poses={name: pose for name, pose in merged.items() if pose})

    def with_added(self, added: Mapping[str, Mapping[str, Any]]) -> "SessionRequests":
        """Return these requests with more lights."""
        return replace(self, added={**self.added, **added})

    def without_added(self, name: str) -> "SessionRequests":
        """Return these requests without an added light, and without all that concerns it."""

        def others(entries: Mapping[str, Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
            return {key: value for key, value in entries.items() if key != name}

        ties = (tuple(x for x in names if x != name) for names in self.ties)
        return replace(
            self,
            lights=others(self.lights),
            ties=tuple(names for names in ties if len(names) > 1),
            poses=others(self.poses),
            added=others(self.added),
            earlier=others(self.earlier),
            kept=tuple(x for x in self.kept if x != name),
            start={key: value for key, value in self.start.items() if key != name},
        )

    def with_ties(self, ties: Sequence[Sequence[str]]) -> "SessionRequests":
        """Return these requests with these dimmers; the first held light of each holds it."""
        lights = dict(self.lights)
        for names in ties:
            lights = _hold_once(lights, names)
        changed = replace(self, lights=lights, ties=tuple(map(tuple, ties)))
        return changed._with_earlier(self.earlier)

    def with_master(self, level: float) -> "SessionRequests":
        """Return these requests with the master dimmer at a factor. Raises PaintError."""
        if not (is_number(level) and is_amount(level) and level <= MAX_MASTER):
            raise PaintError(
                f"the master dimmer is at {level}: expected a factor from 0 to {MAX_MASTER:g}"
            )
        return replace(self, master=float(level))

    def output(self, weights: Doubles, is_fixed: Bools) -> Doubles:
        """Return the weights that lights shine at, (n, 3), from the weights of the answer."""
        return np.where(is_fixed[:, None], weights, self.master * weights)

    def with_values(self, values: Mapping[str, Any]) -> "SessionRequests":
        """Return these requests with these values, None for defaults. Raises PaintError."""
        known = (*FIT_KEYS, *ALL_LIGHTS_KEYS, IGNORE_WISHES)
        if unknown := [key for key in values if key not in known]:
            raise PaintError(f"nothing is called {unknown[0]!r} in what can be set")
        if values.get(IGNORE_WISHES) not in (None, False, True):
            raise PaintError(
                f"{IGNORE_WISHES} is {values[IGNORE_WISHES]!r}: expected true or false"
            )
        # Not by `in`: a hold of 0 is valid, and equals False.
        merged = {**self.values, **values}
        set_values = {k: v for k, v in merged.items() if v is not None and v is not False}
        return replace(self, values=set_values)

    @classmethod
    def from_constraints(
        cls, constraints: Constraints, lights: Sequence[BasisLight], values: Mapping[str, Any]
    ) -> "SessionRequests":
        """Return requests equal to constraints on these lights, and the settings of `values` in
        FIT_KEYS.

        Raises ConstraintError for lights that do not exist, PaintError for constraints that a
        session cannot express.
        """
        pairs = zip(lights, tables_by_light(constraints, lights), strict=True)
        by_light = {light.name: entry for light, (entry, _) in pairs if entry}
        ties = {id(tie): (tie, entry) for tie, entry in tied_lights(constraints, lights).values()}
        for tie, _ in ties.values():
            if tie.color is not None:
                raise PaintError(tie.where, ": ask for the colour of each light; ties have none")
        names = tuple(tuple(lights[k].name for k in entry) for _, entry in ties.values())
        kept_keys = (*FIT_KEYS, IGNORE_WISHES)
        fit_values = {key: value for key, value in values.items() if key in kept_keys}
        joint = {key: getattr(constraints, key) for key in ALL_LIGHTS_KEYS}
        return cls(by_light, names, fit_values).with_values({k: v for k, v in joint.items() if v})

    def constraints(self) -> Constraints:
        """Return the constraints on the lights. Raises ConstraintError for invalid ones."""
        joint = {key: self.values[key] for key in ALL_LIGHTS_KEYS if key in self.values}
        if self.start:
            joint = {"near": DEFAULT_NEAR, **joint, "start": self.start}
        return Constraints.of(self.lights, tie=self.ties, **joint)

    def settings(self, base: Settings) -> Settings:
        """Return `base` with the requested settings. Raises LightpaintError for an invalid
        value.
        """
        fit_values = {key: self.values[key] for key in FIT_KEYS if key in self.values}
        if "hold" in fit_values and base.unpainted:
            fit_values["unpainted"] = 0.0
        ignores = base.ignore_wishes or self.ignores_wishes
        return replace(base, **fit_values, ignore_wishes=ignores)


def _hold_once(
    lights: Mapping[str, Mapping[str, Any]], names: Sequence[str]
) -> dict[str, Mapping[str, Any]]:
    """Return `lights` in which only the first held light of `names` is still held."""
    result, is_held = dict(lights), False
    for name in dict.fromkeys(names):
        constraints = dict(result.get(name, {}))
        if is_held:
            constraints = {key: value for key, value in constraints.items() if key not in HOLD_KEYS}
        is_held = is_held or _holds(constraints)
        result[name] = constraints
    return {name: constraints for name, constraints in result.items() if constraints}


def _holds(constraints: Mapping[str, Any]) -> bool:
    """Return whether constraints hold a light at a level."""
    # Not by `in`: 0 is a level, and equals False.
    values = (constraints.get(key) for key in HOLD_KEYS)
    return any(value is not None and value is not False for value in values)
