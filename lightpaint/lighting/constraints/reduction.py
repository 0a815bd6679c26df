"""The unknowns that constraints leave: w = C x + w₀ with bounds on x.

A light that may have any colour has three unknowns; one of fixed colour, or several on one
dimmer, a single one; one that mixes primaries, an unknown for each. What is locked is in w₀
and moves to the right-hand side. Limits are bounds on x, or on its luminance. So whatever is
asked for, the problem stays one convex quadratic.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.basis.basis import BasisLight
from lightpaint.colour.color import luminance
from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.constraints.addressing import of_each_light, tied_lights
from lightpaint.lighting.constraints.constraints import Constraints, LightConstraint, Lock, Tie
from lightpaint.lighting.constraints.limits import (
    ROUND_OFF,
    check_grey,
    check_room,
    dimmer_limits,
    mix_limits,
)


@dataclass(frozen=True)
class Unknown:
    """One x. columns: (light, (3,) emission of it at x = 1) for each light that it moves."""

    columns: tuple[tuple[int, Doubles], ...]
    lower: float = 0.0
    upper: float = np.inf


@dataclass(frozen=True)
class Knob:
    """What turns by itself: a light, or several on one dimmer.

    limit: coefficients, least and most of a sum over its unknowns, if one is limited.
    """

    lights: tuple[int, ...]
    unknowns: tuple[Unknown, ...]
    limit: tuple[tuple[float, ...], float, float] | None = None

    @cached_property
    def is_free(self) -> bool:
        """Whether it is a light of three channels, each by itself."""
        return len(self.unknowns) == 3 and all(
            len(u.columns) == 1 and (u.columns[0][1] == axis).all()
            for u, axis in zip(self.unknowns, np.eye(3), strict=True)
        )

    def off(self) -> "Knob":
        """It at 0."""
        return replace(
            self, unknowns=tuple(replace(u, lower=0.0, upper=0.0) for u in self.unknowns)
        )

    @classmethod
    def of_any_colour(cls, light: int, *, is_scalar: bool = False) -> "Knob":
        """A light of which nothing is asked."""
        colours = np.ones((1, 3)) if is_scalar else np.eye(3)
        return cls((light,), tuple(Unknown(((light, rgb),)) for rgb in colours))


@dataclass(frozen=True)
class Entries:
    """What is not 0 in C_c, the part of C in one channel, column by column.

    here: (j,), the columns that there are. lights, values: (e,), of each entry. first: (j,), where
    among these each column begins.
    """

    here: Indices
    lights: Indices
    values: Doubles
    first: Indices


@dataclass(frozen=True)
class Block:
    """Channels that unknowns couple, which x these are, their entries by channel, and their caps.

    The unknowns of the caps are numbered within the block; cap_its are their own numbers.
    """

    channels: list[int]
    its: Indices
    entries: tuple[Entries, ...]
    caps: tuple[Cap, ...]
    cap_its: list[int]

    @cached_property
    def is_plain(self) -> bool:
        """Whether its unknowns are weights of lights in one channel, as they are."""
        [first, *more] = self.entries
        return not more and bool((first.values == 1).all()) and first.lights.size == self.its.size

    @cached_property
    def is_in_order(self) -> bool:
        """Whether these are the first lights, one after the other."""
        lights = self.entries[0].lights
        return bool((lights == np.arange(lights.size)).all())


@dataclass(frozen=True)
class Alike:
    """Three blocks of weights of the same lights: by one call what would take three.

    lights: (k,), None for all of them in order. its, lower, upper: (3, k).
    """

    lights: Indices | None
    its: Indices
    lower: Doubles
    upper: Doubles


@dataclass(frozen=True)
class Kind:
    """K knobs of as many unknowns, u, and lights, l, each.

    places: (k, u), which x they are. lights: (k, l). columns: (k, u, 3 l), their emissions.
    """

    places: Indices
    lights: Indices
    columns: Doubles

    @cached_property
    def is_free(self) -> bool:
        """Whether these are lights of any colour: an unknown is the emission in a channel."""
        return self.columns.shape[1:] == (3, 3) and bool((self.columns == np.eye(3)).all())

    @cached_property
    def is_orthogonal(self) -> bool:
        """Whether the unknowns of a knob do not share channels: each is nearest by itself."""
        return bool((((self.columns != 0).sum(axis=1)) <= 1).all())

    @classmethod
    def of(cls, reduction: "Reduction", knobs: Sequence[int]) -> "Kind":
        """Of these, by number."""
        some = [reduction.knobs[k] for k in knobs]
        columns = np.zeros((len(some), len(some[0].unknowns), len(some[0].lights), 3))
        for k, knob in enumerate(some):
            for j, unknown in enumerate(knob.unknowns):
                for light, rgb in unknown.columns:
                    columns[k, j, knob.lights.index(light)] = rgb
        return cls(
            np.array([reduction.places[k] for k in knobs], dtype=np.intp),
            np.array([knob.lights for knob in some], dtype=np.intp),
            columns.reshape(*columns.shape[:2], -1),
        )


@dataclass(frozen=True)
class Stack:
    """K knobs of as many unknowns, u, each with a sum that is limited.

    knobs, lower, upper: (k,). its, coefficients: (k, u).
    """

    knobs: Indices
    its: Indices
    coefficients: Doubles
    lower: Doubles
    upper: Doubles

    @classmethod
    def of(cls, reduction: "Reduction", size: int) -> "Stack":
        """Those of this size."""
        some = [
            (k, knob.limit)
            for k, knob in enumerate(reduction.knobs)
            if knob.limit is not None and len(knob.unknowns) == size
        ]
        return cls(
            np.array([k for k, _ in some], dtype=np.intp),
            np.array([reduction.places[k] for k, _ in some], dtype=np.intp),
            np.array([limit[0] for _, limit in some]),
            np.array([limit[1] for _, limit in some]),
            np.array([limit[2] for _, limit in some]),
        )


@dataclass(frozen=True)
class Reduction:
    """What is left to solve for.

    held: (n, 3), w₀: the emission of lights without a knob; 0 for the others.
    labels: for each light what is asked of it in few words; "" for nothing.
    knobs: their unknowns one after the other are the x.
    """

    held: Doubles
    labels: tuple[str, ...]
    knobs: tuple[Knob, ...]

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All x in their order."""
        return tuple(x for knob in self.knobs for x in knob.unknowns)

    @cached_property
    def places(self) -> tuple[tuple[int, ...], ...]:
        """Which of the x are a knob's, for each."""
        ends = np.cumsum([0, *(len(knob.unknowns) for knob in self.knobs)]).tolist()
        return tuple(tuple(range(first, last)) for first, last in pairwise(ends))

    @cached_property
    def caps(self) -> tuple[Cap, ...]:
        """Limits on sums of x."""
        return tuple(
            Cap(its, *knob.limit)
            for its, knob in zip(self.places, self.knobs, strict=True)
            if knob.limit is not None
        )

    @cached_property
    def lower(self) -> Doubles:
        """(k,), the least that each x may be."""
        return np.array([x.lower for x in self.unknowns])

    @cached_property
    def upper(self) -> Doubles:
        """(k,), the most."""
        return np.array([x.upper for x in self.unknowns])

    @cached_property
    def columns(self) -> tuple[Indices, Indices, Doubles]:
        """C by what is in it: unknown, light and (3,) emission of each entry, unknowns in order."""
        entries = [(k, i, rgb) for k, x in enumerate(self.unknowns) for i, rgb in x.columns]
        return (
            np.array([k for k, _, _ in entries], dtype=np.intp),
            np.array([i for _, i, _ in entries], dtype=np.intp),
            np.array([rgb for _, _, rgb in entries], dtype=np.float64).reshape(-1, 3),
        )

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        """The limited knobs by how many unknowns they have."""
        sizes = {len(knob.unknowns) for knob in self.knobs if knob.limit is not None}
        return tuple(Stack.of(self, size) for size in sorted(sizes))

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """The knobs by how many unknowns and lights they have."""
        found: dict[tuple[int, int], list[int]] = {}
        for k, knob in enumerate(self.knobs):
            found.setdefault((len(knob.unknowns), len(knob.lights)), []).append(k)
        return tuple(Kind.of(self, its) for its in found.values())

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """A block for every set of channels that the unknowns couple."""
        unknown, light, rgb = self.columns
        made = []
        for channels in self.channel_groups:
            its = np.unique(unknown[(rgb[:, channels] != 0).any(axis=1)])
            place = np.zeros(len(self.unknowns), dtype=np.intp)
            place[its] = np.arange(its.size)
            entries = []
            for c in channels:
                there = rgb[:, c] != 0
                here, first = np.unique(place[unknown[there]], return_index=True)
                entries.append(Entries(here, light[there], rgb[there, c], first))
            within = set(its.tolist())
            cap_its = [k for k, cap in enumerate(self.caps) if cap.unknowns[0] in within]
            caps = tuple(
                replace(cap, unknowns=tuple(int(place[i]) for i in cap.unknowns))
                for cap in (self.caps[k] for k in cap_its)
            )
            made.append(Block(channels, its, tuple(entries), caps, cap_its))
        return tuple(made)

    @cached_property
    def alike(self) -> Alike | None:
        """The three blocks together, where they are of the same lights and nothing joins them."""
        if len(self.blocks) < 3 or self.caps or not all(block.is_plain for block in self.blocks):
            return None
        first, *others = (block.entries[0].lights for block in self.blocks)
        if not all(np.array_equal(first, lights) for lights in others):
            return None
        its = np.stack([block.its for block in self.blocks])
        every = np.array_equal(first, np.arange(len(self.held)))
        return Alike(None if every else first, its, self.lower[its], self.upper[its])

    @cached_property
    def holds_any(self) -> bool:
        """Whether some light shines that has no knob."""
        return bool(self.held.any())

    def weights(self, x: Doubles) -> Doubles:
        """w = C x + w₀, (n, 3)."""
        unknown, light, rgb = self.columns
        w = self.held.copy()
        np.add.at(w, light, x[unknown, None] * rgb)
        return w

    @cached_property
    def channel_groups(self) -> list[list[int]]:
        """Channels that one problem couples; apart where no unknown and no limit joins them."""
        unknown, _, rgb = self.columns
        touched: Bools = np.zeros((len(self.unknowns) + len(self.caps), 3), dtype=bool)
        np.logical_or.at(touched, unknown, rgb != 0)
        for k, cap in enumerate(self.caps):
            touched[len(self.unknowns) + k] = touched[list(cap.unknowns)].any(axis=0)
        groups = [{0}, {1}, {2}]
        for row in np.unique(touched, axis=0):
            channels = set(np.flatnonzero(row).tolist())
            meeting = [group for group in groups if group & channels]
            groups = [group for group in groups if not group & channels]
            groups.append(set().union(*meeting))
        return sorted(sorted(group) for group in groups if group)


def reduce_to(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """What `constraints` leave to solve for among `lights`.

    Raises ConstraintError for a light that is not there, and for what cannot be had: a
    colour of a light that has only a dimmer, a light on two dimmers, limits without room.
    """
    asked = of_each_light(constraints, lights)
    labels = ["" if one is None else one.label for one in asked]
    tied, held, knobs = tied_lights(constraints, lights), np.zeros((len(lights), 3)), []
    for k, (light, one) in enumerate(zip(lights, asked, strict=True)):
        if light.is_fixed:
            held[k] = 1
        elif k in tied:
            tie, members = tied[k]
            names = ", ".join(lights[i].name for i in members)
            labels[k] = ", ".join(filter(None, [f"tied ({names})", labels[k]]))
            if k == members[0]:
                knobs.append(_tie(tie, members, names, lights, asked))
        elif one is not None and (one.off or one.lock is not None):
            held[k] = 0 if one.lock is None else _locked(light, one.lock, one.where)
        elif one is None:
            knobs.append(Knob.of_any_colour(k, is_scalar=light.is_scalar))
        elif light.is_scalar or (one.primaries is not None and len(one.primaries) == 1):
            knobs.append(Knob((k,), (_dimmer(k, light, one),)))
        else:
            knobs.append(_mix(k, light, one))
    return Reduction(held, tuple(labels), tuple(knobs))


def only(reduction: Reduction, chosen: Collection[int]) -> Reduction:
    """`reduction` with the knobs that are not chosen at 0."""
    labels, knobs = [*reduction.labels], [*reduction.knobs]
    for k, knob in enumerate(knobs):
        if k not in chosen:
            knobs[k] = knob.off()
            for light in knob.lights:
                labels[light] = ", ".join(filter(None, [labels[light], "left out"]))
    return replace(reduction, labels=tuple(labels), knobs=tuple(knobs))


def _mix(k: int, light: BasisLight, one: LightConstraint) -> Knob:
    """A light of several primaries, of which each is dimmed by itself."""
    colours = np.eye(3) if one.primaries is None else np.array(one.primaries)
    lower, upper, least, most = mix_limits(one, light, len(colours))
    unknowns = [
        Unknown(((k, rgb),), float(low), float(high))
        for rgb, low, high in zip(colours, lower, upper, strict=True)
    ]
    coefficients = np.asarray(luminance(colours), np.float64)
    darkest, brightest = float(coefficients @ lower), float(coefficients @ upper)
    check_room(one, light, max(least, darkest), most)
    check_room(one, light, least, min(most, brightest))
    if least == 0 and np.isinf(most):
        return Knob((k,), tuple(unknowns))
    # Round-off may have parted ends that are the same.
    most = max(most, darkest)
    least = min(least, most, brightest)
    return Knob((k,), tuple(unknowns), (tuple(map(float, coefficients)), least, most))


def _dimmer(k: int, light: BasisLight, one: LightConstraint) -> Unknown:
    """The unknown of a light of one colour."""
    if light.is_scalar and one.primaries is not None:
        raise ConstraintError(
            f"{one.where} asks for a colour, and {light.name!r} can only be dimmed as a whole: "
            "use lock, limits, tie or off"
        )
    direction = np.ones(3) if one.primaries is None else np.array(one.primaries[0])
    check_grey(one, light)
    lower, upper = dimmer_limits(one, direction, light)
    check_room(one, light, lower, upper)
    # Round-off may have parted ends that are the same.
    return Unknown(((k, direction),), min(lower, upper), upper)


def _tie(
    tie: Tie,
    members: Sequence[int],
    names: str,
    lights: Sequence[BasisLight],
    asked: Sequence[LightConstraint | None],
) -> Knob:
    """One unknown for all members; at 1 they have their present luminances."""
    columns, lower, upper = [], 0.0, np.inf
    for k in members:
        light, one = lights[k], asked[k] or LightConstraint()
        if one.off or one.lock is not None or (one.primaries and len(one.primaries) > 1):
            raise ConstraintError(
                f"{one.where} asks for {one.label}, and {light.name!r} is on the dimmer of {names}"
                ": a tied light can only have limits and a color; leave it out of the tie"
            )
        present = np.array(light.emission)
        if not present.any():
            raise ConstraintError(
                f"{tie.where}: {light.name!r} is off at present, so nothing says how bright it is "
                f"beside the others of {names}: give it an emission, or leave it out"
            )
        color = tie.color or (one.primaries[0] if one.primaries else None)
        if color is not None and light.is_scalar:
            raise ConstraintError(
                f"{one.where or tie.where} asks for a colour, and {light.name!r} can only be "
                "dimmed as a whole"
            )
        direction = present if color is None else np.array(color) * float(luminance(present))
        check_grey(one, light)
        least, most = dimmer_limits(one, direction, light)
        lower, upper = max(lower, least), min(upper, most)
        columns.append((k, direction))
    if lower > upper * (1 + ROUND_OFF):
        raise ConstraintError(
            f"{tie.where}: the limits of {names} contradict each other on one dimmer: one light "
            f"asks for at least {lower:.4g} times the present, another for at most {upper:.4g}"
        )
    return Knob(tuple(members), (Unknown(tuple(columns), min(lower, upper), upper),))


def _locked(light: BasisLight, lock: Lock, where: str) -> Doubles:
    """The emission that `lock` asks for."""
    present = np.array(light.emission)
    level = lock.level
    if light.is_scalar and lock.color is not None:
        raise ConstraintError(
            f"{where}.lock asks for a colour, and {light.name!r} can only be dimmed as a whole"
        )
    if level is not None and isinstance(level.amount, tuple):
        if light.is_scalar and len(set(level.amount)) > 1:
            raise ConstraintError(
                f"{where}.lock is {level}, and {light.name!r} can only be dimmed as a whole: "
                "give one number"
            )
        return np.array(level.amount)
    now = float(luminance(present))
    color = present / now if lock.color is None and now > 0 else np.array(lock.color or (1, 1, 1))
    if level is None and lock.color is None:
        return present
    amount = now
    if level is not None:
        assert not isinstance(level.amount, tuple)
        amount = level.amount * (now if level.is_share else 1.0)
    return np.asarray(color * amount)
