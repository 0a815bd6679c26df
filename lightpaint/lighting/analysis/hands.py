"""What a person has asked of the lights, thing by thing, and constraints without some of it."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from lightpaint.basis.basis import BasisLight
from lightpaint.lighting.constraints.addressing import asked_of_each, tied_lights
from lightpaint.lighting.constraints.constraints import COLOURS, Constraints

#: What is asked of single lights, of those on one dimmer, and of all together.
Hand = Literal["off", "lock", "limits", "colour", "tie", "sparse", "prefer_current"]

#: Those of single lights.
OF_ONE: tuple[Hand, ...] = ("off", "lock", "limits", "colour")

#: The keys of a light that each of them stands for.
KEYS: Mapping[str, tuple[str, ...]] = {
    "off": ("off",),
    "lock": ("lock",),
    "limits": ("limits",),
    "colour": (*COLOURS, "duv"),
}


@dataclass(frozen=True)
class Hands:
    """Everything asked of the lights, by light instead of by pattern.

    asked: of each light, keys and values. constraints: that say all of it.
    """

    lights: Sequence[BasisLight]
    asked: Sequence[dict[str, Any]]
    constraints: Constraints

    @staticmethod
    def of(constraints: Constraints, lights: Sequence[BasisLight]) -> "Hands":
        """Those of constraints."""
        asked = [
            {key: value for key, value in its.items() if value is not False}
            for its, _ in asked_of_each(constraints, lights)
        ]
        return Hands(lights, asked, constraints)

    def kinds(self) -> dict[Hand, tuple[int, ...]]:
        """What is asked, and the lights that each is asked of."""
        tied = tied_lights(self.constraints, self.lights)
        found: dict[Hand, tuple[int, ...]] = {
            kind: tuple(k for k, its in enumerate(self.asked) if set(KEYS[kind]) & set(its))
            for kind in OF_ONE
        }
        found["tie"] = tuple(sorted(tied))
        every = tuple(k for k, light in enumerate(self.lights) if not light.is_fixed)
        found["sparse"] = every if self.constraints.sparse is not None else ()
        found["prefer_current"] = every if self.constraints.prefer_current else ()
        return {kind: its for kind, its in found.items() if its}

    def without(self, kind: Hand, lights: Collection[int]) -> Constraints:
        """The constraints without that, of these lights."""
        if kind == "sparse":
            return replace(self.constraints, sparse=None)
        if kind == "prefer_current":
            return replace(self.constraints, prefer_current=0.0)
        if kind == "tie":
            tied = tied_lights(self.constraints, self.lights)
            gone = {id(tied[k][0]) for k in lights}
            kept = tuple(tie for tie in self.constraints.ties if id(tie) not in gone)
            return replace(self.constraints, ties=kept)
        left = [
            {key: value for key, value in its.items() if k not in lights or key not in KEYS[kind]}
            for k, its in enumerate(self.asked)
        ]
        each = tuple(
            (light.name, its, f"light.{light.name}")
            for light, its in zip(self.lights, left, strict=True)
            if its
        )
        return replace(self.constraints, lights=each)
