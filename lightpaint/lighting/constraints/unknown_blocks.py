"""The unknowns sorted for the arithmetic: by the channels they couple, by size, by their limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.constraints.knobs import Knob


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

    @property
    def counts(self) -> Indices:
        """(j,), how many entries each column has."""
        return np.diff(self.first, append=self.lights.size)


@dataclass(frozen=True)
class Pairs:
    """Entries of two channels that are of one light: where what joins its channels goes.

    one, other: which columns. value: the product of both entries. light, channel, next: of what
    joins them.
    """

    one: Indices
    other: Indices
    value: Doubles
    light: Indices
    channel: Indices
    next: Indices


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
    def pairs(self) -> Pairs:
        """All of them, in either order."""
        column, light, value, channel = (
            np.concatenate(parts)
            for parts in zip(
                *(
                    (np.repeat(e.here, e.counts), e.lights, e.values, np.full(e.lights.size, c))
                    for c, e in zip(self.channels, self.entries, strict=True)
                ),
                strict=True,
            )
        )
        found = []
        by_light = np.argsort(light, kind="stable")
        for its in np.split(by_light, np.flatnonzero(np.diff(light[by_light])) + 1):
            a, b = (x.ravel() for x in np.meshgrid(its, its, indexing="ij"))
            apart = channel[a] != channel[b]
            found.append(np.stack([a[apart], b[apart]]))
        a, b = np.concatenate(found, axis=1)
        return Pairs(column[a], column[b], value[a] * value[b], light[a], channel[a], channel[b])

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
    def of(cls, some: Sequence[Knob], places: Sequence[tuple[int, ...]]) -> "Kind":
        """Of some knobs, and which x are theirs."""
        columns = np.zeros((len(some), len(some[0].unknowns), len(some[0].lights), 3))
        for k, knob in enumerate(some):
            for j, unknown in enumerate(knob.unknowns):
                for light, rgb in unknown.columns:
                    columns[k, j, knob.lights.index(light)] = rgb
        return cls(
            np.array(places, dtype=np.intp),
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
    def of(cls, knobs: Sequence[Knob], places: Sequence[tuple[int, ...]], size: int) -> "Stack":
        """Of the knobs those of this size. places: which x are theirs, for each."""
        some = [
            (k, knob.limit)
            for k, knob in enumerate(knobs)
            if knob.limit is not None and len(knob.unknowns) == size
        ]
        return cls(
            np.array([k for k, _ in some], dtype=np.intp),
            np.array([places[k] for k, _ in some], dtype=np.intp),
            np.array([limit[0] for _, limit in some]),
            np.array([limit[1] for _, limit in some]),
            np.array([limit[2] for _, limit in some]),
        )
