"""The unknowns that constraints leave: w = C x + w₀ with bounds on x.

A light that may have any colour has three unknowns; one of fixed colour, or several on one
dimmer, a single one; one that mixes primaries, an unknown for each. What is locked is in w₀
and moves to the right-hand side. Limits are bounds on x, or on its luminance. So whatever is
asked for, the problem stays one convex quadratic; with ranges of white it is one for each choice
of neighbouring whites (white_neighbours.py).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.gamuts import Gamuts
from lightpaint.lighting.constraints.knobs import (
    Knob,
    Unknown,
    dimmer_of,
    locked_at,
    mix_of,
    tie_of,
)
from lightpaint.lighting.constraints.light_patterns import of_each_light, tied_lights
from lightpaint.lighting.constraints.unknown_blocks import Alike, Block, Entries, Kind, Stack


@dataclass(frozen=True)
class Reduction:
    """What is left to solve for.

    held: (n, 3), w₀: the emission of lights without a knob; 0 for the others.
    labels: for each light what is asked of it in few words; "" for nothing.
    knobs: their unknowns one after the other are the x.
    is_joined: whether something beside these couples the channels, a pull to colours.
    gamuts: colours that lights keep to of which nothing else is asked.
    """

    held: Doubles
    labels: tuple[str, ...]
    knobs: tuple[Knob, ...]
    is_joined: bool = False
    gamuts: Gamuts | None = None

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
    def white_knobs(self) -> tuple[int, ...]:
        """Places of the knobs of lights that keep to a range of white, and may be on."""
        return tuple(
            k
            for k, knob in enumerate(self.knobs)
            if knob.whites is not None and any(x.upper > 0 for x in knob.unknowns)
        )

    @cached_property
    def kept_knobs(self) -> tuple[int, ...]:
        """Places of the knobs that are kept within their gamuts."""
        return tuple(k for k, knob in enumerate(self.knobs) if knob.gamut is not None)

    @cached_property
    def gamut_knobs(self) -> tuple[int, ...]:
        """Places of the knobs that keep to a gamut, and as yet have any colour."""
        if self.gamuts is None:
            return ()
        return tuple(k for k, knob in enumerate(self.knobs) if _has_any_colour(knob))

    def with_gamuts(self, gamuts: Gamuts) -> "Reduction":
        """Return the same with lights of any colour keeping to `gamuts`."""
        return replace(self, gamuts=gamuts)

    def kept_within(self, places: Collection[int]) -> "Reduction":
        """Return the same with these knobs, by their places, within their gamuts."""
        return self.kept_near(dict.fromkeys(places))

    def kept_near(self, sides: Mapping[int, int | None]) -> "Reduction":
        """Return the same with knobs, by their places, within their gamuts towards some side."""
        if not sides:
            return self
        knobs = [*self.knobs]
        for k, side in sides.items():
            assert self.gamuts is not None
            knobs[k] = knobs[k].within_gamut(self.gamuts[knobs[k].lights[0]], side)
        return replace(self, knobs=tuple(knobs))

    def with_windows(self, windows: Mapping[int, tuple[int, int]]) -> "Reduction":
        """Return the same with knobs, by their places, between other whites of their ranges."""
        knobs = [*self.knobs]
        for k, window in windows.items():
            if knobs[k].window != window:
                knobs[k] = knobs[k].within(window)
        return replace(self, knobs=tuple(knobs))

    @cached_property
    def is_free(self) -> Bools:
        """(n,), which lights may have any colour, or any of a gamut."""
        its = (knob for knob in self.knobs if knob.is_free or knob.gamut is not None)
        free = {light for knob in its for light in knob.lights}
        return np.array([k in free for k in range(len(self.labels))], dtype=bool)

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
        return tuple(Stack.of(self.knobs, self.places, size) for size in sorted(sizes))

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """The knobs by how many unknowns and lights they have."""
        found: dict[tuple[int, int], list[int]] = {}
        for k, knob in enumerate(self.knobs):
            found.setdefault((len(knob.unknowns), len(knob.lights)), []).append(k)
        return tuple(
            Kind.of([self.knobs[k] for k in its], [self.places[k] for k in its])
            for its in found.values()
        )

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

    def reached(self, lit: Bools) -> Bools:
        """(n, 3), whether what moves a light in a channel reaches something that counts.

        lit: (n, 3), whether the light itself does. A dimmer that does so in one channel or with
        one of its lights tells all of them; what is held is told already.
        """
        unknown, light, rgb = self.columns
        moves, felt = rgb != 0, np.zeros(len(self.unknowns), dtype=bool)
        np.logical_or.at(felt, unknown, (moves & lit[light]).any(axis=1))
        moved, told = np.zeros_like(lit), np.zeros_like(lit)
        np.logical_or.at(moved, light, moves)
        np.logical_or.at(told, light, moves & felt[unknown, None])
        # A colour without blue says how much blue there is, if it is known how bright it is.
        either = told.any(axis=1, keepdims=True) | ~moved.any(axis=1, keepdims=True)
        return np.asarray(told | (~moved & either))

    @cached_property
    def ends(self) -> tuple[Doubles, Doubles]:
        """The least and the most that bounds leave of each weight, (n, 3) each."""
        unknown, light, rgb = self.columns
        low, high = self.held.copy(), self.held.copy()
        for end, bounds in ((low, self.lower), (high, self.upper)):
            most = np.broadcast_to(bounds[unknown, None], rgb.shape)
            its = np.multiply(most, rgb, out=np.zeros(rgb.shape), where=rgb != 0)
            np.add.at(end, light, its)
        return low, high

    @cached_property
    def channel_groups(self) -> list[list[int]]:
        """Channels that one problem couples; apart where no unknown and no limit joins them."""
        if self.is_joined:
            return [[0, 1, 2]]
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
                knob = tie_of(tie, members, names, lights, asked)
                if any(its.is_held for its in (asked[i] for i in members) if its is not None):
                    [level] = knob.unknowns
                    for i, rgb in level.columns:
                        held[i] = level.lower * rgb
                else:
                    knobs.append(knob)
        elif one is not None and one.is_held:
            held[k] = 0 if one.lock is None else locked_at(light, one.lock, one.where)
        elif one is None:
            knobs.append(Knob.of_any_colour(k, is_scalar=light.is_scalar))
        elif light.is_scalar or (one.primaries is not None and len(one.primaries) == 1):
            knobs.append(dimmer_of(k, light, one))
        else:
            knobs.append(mix_of(k, light, one))
    return Reduction(held, tuple(labels), tuple(knobs))


def _has_any_colour(knob: Knob) -> bool:
    """Return whether nothing is asked of the channels of a light."""
    return knob.is_free and all(x.lower == 0 and np.isinf(x.upper) for x in knob.unknowns)


def only(reduction: Reduction, chosen: Collection[int]) -> Reduction:
    """`reduction` with the knobs that are not chosen at 0."""
    labels, knobs = [*reduction.labels], [*reduction.knobs]
    for k, knob in enumerate(knobs):
        if k not in chosen:
            knobs[k] = knob.off()
            for light in knob.lights:
                labels[light] = ", ".join(filter(None, [labels[light], "left out"]))
    return replace(reduction, labels=tuple(labels), knobs=tuple(knobs))
