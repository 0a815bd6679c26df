"""Constraints by kind and by light, and constraints without some of them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from lightpaint.basis import BasisLight, light_images
from lightpaint.lighting.constraints.constraints import COLOR_KEYS, Constraints
from lightpaint.lighting.constraints.light_constraints import tables_by_light, tied_lights
from lightpaint.sentences import SourceKey

#: Kinds of constraints: of single lights, of those on one dimmer, and of all together.
ConstraintKind = Literal[
    "off", "lock", "limits", "colour", "tie", "sparse", "prefer_current", "near", "planes"
]

#: The constraints on all lights together.
ALL_LIGHTS_KINDS: tuple[ConstraintKind, ...] = ("sparse", "prefer_current", "near", "planes")

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
            {key: value for key, value in table.items() if value is not False}
            for table, _ in tables_by_light(constraints, lights)
        ]
        return ConstraintsByLight(lights, tables, constraints)

    def kinds(self) -> dict[ConstraintKind, tuple[int, ...]]:
        """Return the kinds of constraints in use, and the indices of the lights under each."""
        tied = tied_lights(self.constraints, self.lights)
        by_kind: dict[ConstraintKind, tuple[int, ...]] = {
            kind: tuple(
                k for k, table in enumerate(self.tables) if set(KEYS_BY_KIND[kind]) & set(table)
            )
            for kind in SINGLE_LIGHT_KINDS
        }
        by_kind["tie"] = tuple(sorted(tied))
        all_lights = tuple(k for k, light in enumerate(self.lights) if not light.is_fixed)
        by_kind["sparse"] = all_lights if self.constraints.sparse is not None else ()
        by_kind["prefer_current"] = all_lights if self.constraints.prefer_current else ()
        by_kind["near"] = all_lights if self.constraints.near else ()
        by_kind["planes"] = all_lights if self.constraints.requirements else ()
        return {kind: table for kind, table in by_kind.items() if table}

    def units(self, lights: Sequence[int]) -> list[list[int]]:
        """Return lights that are released together: all texels of an image, or a single light."""
        images = {k: i for i, image in enumerate(light_images(self.lights)) for k in image.lights}
        units: dict[tuple[int, int], list[int]] = {}
        for k in lights:
            units.setdefault((images.get(k, -1), -1 if k in images else k), []).append(k)
        return list(units.values())

    def without(self, kind: ConstraintKind, lights: Collection[int]) -> Constraints:
        """Return the constraints without one kind, for lights at these places."""
        if kind == "sparse":
            return replace(self.constraints, sparse=None)
        if kind == "prefer_current":
            return replace(self.constraints, prefer_current=0.0)
        if kind == "near":
            return replace(self.constraints, near=0.0)
        if kind == "planes":
            return replace(self.constraints, requirements=None)
        if kind == "tie":
            tied = tied_lights(self.constraints, self.lights)
            removed = {id(tied[k][0]) for k in lights}
            ties = tuple(tie for tie in self.constraints.ties if id(tie) not in removed)
            return replace(self.constraints, ties=ties)
        tables = [
            {
                key: value
                for key, value in table.items()
                if k not in lights or key not in KEYS_BY_KIND[kind]
            }
            for k, table in enumerate(self.tables)
        ]
        # The emitters of a lamp are constrained as one.
        remaining = {
            (name := light.lamp or light.name): (name, table, SourceKey("", "light", name))
            for light, table in zip(self.lights, tables, strict=True)
            if table
        }
        return replace(self.constraints, lights=tuple(remaining.values()))
