"""Constraints by kind and by light, and constraints without some of them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import COLOR_KEYS, Constraints
from lightpaint.lighting.constraints.light_patterns import tables_by_light, tied_lights

#: Kinds of constraints: of single lights, of those on one dimmer, and of all together.
ConstraintKind = Literal["off", "lock", "limits", "colour", "tie", "sparse", "prefer_current"]

#: Kinds of constraints on single lights.
SINGLE_LIGHT_KINDS: tuple[ConstraintKind, ...] = ("off", "lock", "limits", "colour")

#: The keys of a lights file for each of them.
KEYS_BY_KIND: Mapping[str, tuple[str, ...]] = {
    "off": ("off",),
    "lock": ("lock",),
    "limits": ("limits",),
    "colour": (*COLOR_KEYS, "duv"),
}


@dataclass(frozen=True)
class ConstraintsByLight:
    """Constraints on each light by itself, patterns resolved.

    tables: (n,), keys and values of each light. constraints: those given.
    """

    lights: Sequence[BasisLight]
    tables: Sequence[dict[str, Any]]
    constraints: Constraints

    @staticmethod
    def of(constraints: Constraints, lights: Sequence[BasisLight]) -> "ConstraintsByLight":
        """Resolve `constraints` on these lights."""
        tables = [
            {key: value for key, value in its.items() if value is not False}
            for its, _ in tables_by_light(constraints, lights)
        ]
        return ConstraintsByLight(lights, tables, constraints)

    def kinds(self) -> dict[ConstraintKind, tuple[int, ...]]:
        """Return the kinds of constraints that there are, and places of the lights under each."""
        tied = tied_lights(self.constraints, self.lights)
        found: dict[ConstraintKind, tuple[int, ...]] = {
            kind: tuple(
                k for k, its in enumerate(self.tables) if set(KEYS_BY_KIND[kind]) & set(its)
            )
            for kind in SINGLE_LIGHT_KINDS
        }
        found["tie"] = tuple(sorted(tied))
        every = tuple(k for k, light in enumerate(self.lights) if not light.is_fixed)
        found["sparse"] = every if self.constraints.sparse is not None else ()
        found["prefer_current"] = every if self.constraints.prefer_current else ()
        return {kind: its for kind, its in found.items() if its}

    def without(self, kind: ConstraintKind, lights: Collection[int]) -> Constraints:
        """Return the constraints without one kind, for lights at these places."""
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
            {
                key: value
                for key, value in its.items()
                if k not in lights or key not in KEYS_BY_KIND[kind]
            }
            for k, its in enumerate(self.tables)
        ]
        each = tuple(
            (light.name, its, f"light.{light.name}")
            for light, its in zip(self.lights, left, strict=True)
            if its
        )
        return replace(self.constraints, lights=each)
