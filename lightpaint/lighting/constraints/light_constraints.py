"""Constraints of each light: resolved from names and patterns, by kind, restricted where a lamp's
colour is open, and the weights to start from.

The painting is answered by lights near to it: unpainted parts are held to its look, the colours of
its lamps count as theirs, and what the painting leaves open stays as it is.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any, Literal

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles
from lightpaint.basis import Basis, BasisLight, Lights, light_images
from lightpaint.colour import WHITE_DUV, cct_and_duv
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import ConstraintError
from lightpaint.images import Estimate
from lightpaint.lighting.constraints import constraint_table
from lightpaint.scene.lights.texels import coarse_name, image_of
from lightpaint.sentences import Hint, Lead, SourceKey

#: The range of usual lamps, in kelvin.
LAMP_KELVINS = (2200, 9000)

#: Whites that the range is widened to where warmer or bluer ones are painted, up to moonlight.
WARMER_KELVINS, BLUER_KELVINS = (2000.0,), (12_000.0, 16_000.0, 20_000.0, 25_000.0)

#: Ratio by which a range reaches beyond the mean white that is painted.
BEYOND_MEAN = 1.1

#: The range of white of each light, in kelvin.
WhiteLimits = tuple[tuple[float, float], ...]

#: That restriction in few words, for tables.
OWN_COLOR_LABEL = "own colour"

#: Kinds of constraints: of single lights, of those on one dimmer, and of all together.
ConstraintKind = Literal[
    "off",
    "lock",
    "limits",
    "colour",
    "emitters",
    "tie",
    "sparse",
    "prefer_current",
    "near",
    "planes",
]

#: The constraints on all lights together: the field of each in `Constraints`, and its value
#: without one.
ALL_LIGHTS_KINDS: Mapping[ConstraintKind, tuple[str, Any]] = {
    "sparse": ("sparse", None),
    "prefer_current": ("prefer_current", 0.0),
    "near": ("near", 0.0),
    "planes": ("requirements", None),
}

#: Kinds of constraints on single lights.
SINGLE_LIGHT_KINDS: tuple[ConstraintKind, ...] = ("off", "lock", "limits", "colour", "emitters")

#: The keys of a lights file for each of them.
KEYS_BY_KIND: Mapping[str, tuple[str, ...]] = {
    "off": ("off",),
    "lock": ("lock",),
    "limits": ("limits",),
    "colour": (*constraint_table.COLOR_KEYS, "duv"),
    "emitters": ("rf", *constraint_table.LAMP_KEYS),
}


def constraints_by_light(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> list[constraint_table.LightConstraint | None]:
    """Return the constraint on each light, None without one; names win over patterns."""
    made: dict[tuple[int, str], constraint_table.LightConstraint] = {}
    tables = tables_by_light(constraints, lights)
    for table, where in tables:
        if table and (id(table), where) not in made:
            made[id(table), where] = constraint_table.LightConstraint.of(table, where=where)
    return [made.get((id(table), where)) for table, where in tables]


def tables_by_light(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> list[tuple[dict[str, Any], str]]:
    """Return the merged keys and values for each light, and the source of the last of them.

    Lights of the same entries share their table.
    """
    tables: list[tuple[dict[str, Any], str]] = [({}, "")] * len(lights)
    for name, wish, origin in constraints.lights:
        merged: dict[int, dict[str, Any]] = {}
        for k in _match_lights(name, lights, origin, only_keeps=_only_keeps(wish)):
            below = tables[k][0]
            if id(below) not in merged:
                merged[id(below)] = constraint_table.merge_tables(below, wish)
            tables[k] = merged[id(below)], origin
    return tables


def _only_keeps(wish: Mapping[str, Any]) -> bool:
    """Return whether keys only say what a light is or that it stays, as a fixed light does."""
    return wish == {"lock": True} or wish.keys() <= {*constraint_table.LAMP_KEYS}


def constraints_on_parts(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> tuple[constraint_table.Constraints, constraint_table.Constraints]:
    """Return the constraints on single emitters of lamps, by their names, and all others."""
    names = {light.name for light in lights if light.lamp}
    is_part = [name in names for name, _, _ in constraints.lights]
    own = tuple(x for x, is_own in zip(constraints.lights, is_part, strict=True) if is_own)
    rest = tuple(x for x, is_own in zip(constraints.lights, is_part, strict=True) if not is_own)
    return constraint_table.Constraints(lights=own), replace(constraints, lights=rest)


def limited_lights(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> Bools:
    """Return which lights constraints of their own, a tie or the scene limit, (n,)."""
    tables = ConstraintsByLight.of(constraints, lights).tables
    limited = np.array([bool(x) or y.is_fixed for x, y in zip(tables, lights, strict=True)], bool)
    limited[list(tied_lights(constraints, lights))] = True
    return limited


def tied_lights(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> dict[int, tuple[constraint_table.Tie, list[int]]]:
    """Return the tie of each tied light, and the indices of its members in their order."""
    ties: dict[int, tuple[constraint_table.Tie, list[int]]] = {}
    for tie in constraints.ties:
        members = sorted({k for name in tie.lights for k in _match_lights(name, lights, tie.where)})
        listed = some_names(tie.lights)
        if len(members) < 2:
            raise ConstraintError(tie.where, f": {listed} is one light: a tie has at least two")
        for k in members:
            if k in ties:
                raise ConstraintError(
                    tie.where,
                    f": light {lights[k].name!r} is in two ties, "
                    f"{some_names(ties[k][0].lights)} and {listed}: it has one dimmer",
                )
            ties[k] = (tie, members)
    return ties


def lights_of_open_color(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> list[int]:
    """Return the indices of lights that may take any colour under `constraints`."""
    tied = tied_lights(constraints, lights)
    return [
        k
        for k, (light, constraint) in enumerate(
            zip(lights, constraints_by_light(constraints, lights), strict=True)
        )
        if not (light.is_fixed or light.is_scalar or k in tied)
        and (constraint is None or constraint.has_open_color)
    ]


def _match_lights(
    name: str, lights: Sequence[BasisLight], where: str, *, only_keeps: bool = False
) -> list[int]:
    """Return the index of the light of this name, else of all that match it as a pattern, or of
    the texels of the image of this name.
    """
    names = [light.name for light in lights]
    if parts := [k for k, light in enumerate(lights) if light.lamp and light.lamp == name]:
        return parts
    for k, light in enumerate(lights):
        if name == light.name and not light.is_fixed:
            return [k]
        if name != light.name and name not in light.members:
            continue
        if light.is_fixed:
            if only_keeps:
                return []  # which a fixed light does anyway
            raise ConstraintError(
                where,
                f": {name!r} is fixed, since it is not among the lights to adjust: choose it with ",
                Hint("lights"),
                ", or remove its constraint",
            )
        if name not in names:
            raise ConstraintError(
                where, f": {name!r} is part of the light {light.name!r}: constrain that light"
            )
    matches = [
        k for k, x in enumerate(lights) if not x.is_fixed and _is_meant(x.lamp or x.name, name)
    ]
    if not matches:
        adjustable = [x.lamp or x.name for x in lights if not x.is_fixed]
        adjustable = [*dict.fromkeys(adjustable)]
        hint = with_similar_name(f"there are {some_names(adjustable)}", name, adjustable)
        raise ConstraintError(Lead(SourceKey.of(where)), f"no light {name!r}; {hint}")
    return matches


def _is_meant(light: str, name: str) -> bool:
    """Return whether a name or pattern means a light: its image, or the coarse texel in whose place
    a finer one is, mean it too.
    """
    matching = fnmatchcase if constraint_table.is_pattern(name) else str.__eq__
    return name in (light, image_of(light)) or matching(coarse_name(light) or light, name)


def start_weights(start: Mapping[str, RGB], lights: Sequence[BasisLight]) -> Doubles:
    """Return the weights (n, 3) that a solve starts from: the weights of the scene for other
    lights.

    start: emissions by name. Raises ConstraintError for a light that is not there, or is fixed.
    """
    weights = np.array(Lights.of(lights).current_weights)
    names = [light.name for light in lights]
    for name, emission in start.items():
        if name not in names:
            hint = with_similar_name(f"there are {some_names(names)}", name, names)
            raise ConstraintError(f"start: no light {name!r}; {hint}")
        light = lights[names.index(name)]
        if light.is_fixed or (light.is_scalar and len(set(emission)) > 1):
            reason = "is fixed" if light.is_fixed else "can only be dimmed as a whole"
            raise ConstraintError(f"start.{name} is {list(emission)}, and {name!r} {reason}")
        weights[names.index(name)] = emission
    return weights


def held_at_start(basis: Basis, start: Mapping[str, RGB]) -> Basis:
    """Return a basis whose unpainted parts are held to the look of the lighting to start from."""
    if not start:
        return basis
    weights = start_weights(start, basis.lights)
    return replace(basis, former=Estimate(basis.mix(weights), basis.noise.mix(weights)))


def painted_whites(emission: Doubles) -> WhiteLimits:
    """Return the ranges of lights that are painted as emission (n, 3): the range of usual lamps,
    and as far as bluer or warmer whites are painted.
    """
    return tuple(_painted_white(color) for color in emission)


def _painted_white(color: Doubles) -> tuple[float, float]:
    white = cct_and_duv(color)
    low, high = map(float, LAMP_KELVINS)
    if white is None or abs(white[1]) > WHITE_DUV:
        return low, high
    kelvin, _ = white
    low = next((x for x in (low, *WARMER_KELVINS) if x <= kelvin), WARMER_KELVINS[-1])
    wanted = BEYOND_MEAN * kelvin
    return low, next((x for x in (high, *BLUER_KELVINS) if x >= wanted), BLUER_KELVINS[-1])


def whiten_open_lights(
    constraints: constraint_table.Constraints,
    lights: Sequence[BasisLight],
    whites: WhiteLimits | None = None,
) -> constraint_table.Constraints:
    """Return constraints in which every light of open colour also stays between two whites.

    whites: of each light, in kelvin; None for LAMP_KELVINS.
    """
    limits = whites or (LAMP_KELVINS,) * len(lights)
    return constraints.and_then(
        constraint_table.Constraints.of(
            {
                lights[k].name: {"kelvin": list(limits[k])}
                for k in lights_of_open_color(constraints, lights)
            }
        )
    )


def keep_own_colors(
    constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> constraint_table.Constraints:
    """Return constraints in which every light of open colour also keeps its current one.

    A light that is off has no colour, and is white.
    """
    own = start_weights(constraints.start, lights)
    own_colors = {
        lights[k].name: {"color": own[k].tolist() if own[k].any() else "#fff"}
        for k in lights_of_open_color(constraints, lights)
    }
    return constraints.and_then(constraint_table.Constraints.of(own_colors))


def own_color_labels(
    labels: Sequence[str], constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
) -> tuple[str, ...]:
    """Return the labels (n,) of lights under `constraints` together with that restriction."""
    open_lights = set(lights_of_open_color(constraints, lights))
    return tuple(
        ", ".join(filter(None, [label, OWN_COLOR_LABEL])) if k in open_lights else label
        for k, label in enumerate(labels)
    )


@dataclass(frozen=True)
class ConstraintsByLight:
    """Constraints on each light by itself, patterns resolved.

    tables: (n,), keys and values of each light. constraints: those given.
    """

    lights: Sequence[BasisLight]
    tables: Sequence[dict[str, Any]]
    constraints: constraint_table.Constraints

    @staticmethod
    def of(
        constraints: constraint_table.Constraints, lights: Sequence[BasisLight]
    ) -> "ConstraintsByLight":
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
        # In a basis of spectra, emitters have the pictures: without them there is no lamp.
        by_kind["emitters"] = tuple(k for k in by_kind["emitters"] if not self.lights[k].lamp)
        by_kind["tie"] = tuple(sorted(tied))
        all_lights = tuple(k for k, light in enumerate(self.lights) if not light.is_fixed)
        for kind, (name, nothing) in ALL_LIGHTS_KINDS.items():
            by_kind[kind] = all_lights if getattr(self.constraints, name) != nothing else ()
        return {kind: table for kind, table in by_kind.items() if table}

    def units(self, lights: Sequence[int]) -> list[list[int]]:
        """Return lights that are released together: all texels of an image, or a single light."""
        images = {k: i for i, image in enumerate(light_images(self.lights)) for k in image.lights}
        units: dict[tuple[int, int], list[int]] = {}
        for k in lights:
            units.setdefault((images.get(k, -1), -1 if k in images else k), []).append(k)
        return list(units.values())

    def without(
        self, kind: ConstraintKind, lights: Collection[int]
    ) -> constraint_table.Constraints:
        """Return the constraints without one kind, for lights at these places."""
        if kind in ALL_LIGHTS_KINDS:
            name, nothing = ALL_LIGHTS_KINDS[kind]
            return replace(self.constraints, **{name: nothing})
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
