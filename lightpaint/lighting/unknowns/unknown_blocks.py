"""The unknowns sorted for the arithmetic: by the channels they couple, by size, by their limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.unknowns.knobs import Knob


@dataclass(frozen=True)
class Entries:
    """The entries of C_c, the part of C in one channel, that are not 0, column by column.

    columns: (j,), those with entries. lights, values: (e,), of each entry. first: (j,), the
    index among these at which each column begins.
    """

    columns: Indices
    lights: Indices
    values: Doubles
    first: Indices

    @property
    def counts(self) -> Indices:
        """(j,), the number of entries of each column."""
        return np.diff(self.first, append=self.lights.size)


@dataclass(frozen=True)
class Pairs:
    """Pairs of entries in two channels that belong to one light: the places where a coupling goes.

    column, other_column: of the two entries. value: their product. light, channel, other_channel:
    of the coupling.
    """

    column: Indices
    other_column: Indices
    value: Doubles
    light: Indices
    channel: Indices
    other_channel: Indices


@dataclass(frozen=True)
class Block:
    """Channels that unknowns couple, with these unknowns, their entries by channel, and their caps.

    The caps number their unknowns within the block; cap_indices are the numbers of the caps
    themselves.
    """

    channels: list[int]
    unknowns: Indices
    entries: tuple[Entries, ...]
    caps: tuple[Cap, ...]
    cap_indices: list[int]

    @cached_property
    def is_plain(self) -> bool:
        """True if its unknowns are the weights of lights in one channel."""
        [first, *more] = self.entries
        return (
            not more and bool((first.values == 1).all()) and first.lights.size == self.unknowns.size
        )

    @cached_property
    def pairs(self) -> Pairs:
        """All pairs, in either order."""
        column, light, value, channel = (
            np.concatenate(parts)
            for parts in zip(
                *(
                    (np.repeat(e.columns, e.counts), e.lights, e.values, np.full(e.lights.size, c))
                    for c, e in zip(self.channels, self.entries, strict=True)
                ),
                strict=True,
            )
        )
        pairs = []
        by_light = np.argsort(light, kind="stable")
        for members in np.split(by_light, np.flatnonzero(np.diff(light[by_light])) + 1):
            a, b = (x.ravel() for x in np.meshgrid(members, members, indexing="ij"))
            differ = channel[a] != channel[b]
            pairs.append(np.stack([a[differ], b[differ]]))
        a, b = np.concatenate(pairs, axis=1)
        return Pairs(column[a], column[b], value[a] * value[b], light[a], channel[a], channel[b])

    @cached_property
    def is_in_order(self) -> bool:
        """True if its lights are the first ones, in their order."""
        lights = self.entries[0].lights
        return bool((lights == np.arange(lights.size)).all())


@dataclass(frozen=True)
class AlikeBlocks:
    """Three blocks of weights of the same lights, solved together by one call.

    lights: (k,), None for all of them in order. unknowns, lower, upper: (3, k).
    """

    lights: Indices | None
    unknowns: Indices
    lower: Doubles
    upper: Doubles


@dataclass(frozen=True)
class KnobGroup:
    """K knobs, each of u unknowns and l lights.

    places: (k, u), their indices among the x. lights: (k, l). columns: (k, u, 3 l), their
    emissions.
    """

    places: Indices
    lights: Indices
    columns: Doubles

    @cached_property
    def is_free(self) -> bool:
        """True if these are lights of any colour: each unknown is the emission in a channel."""
        return self.columns.shape[1:] == (3, 3) and bool((self.columns == np.eye(3)).all())

    @cached_property
    def is_orthogonal(self) -> bool:
        """True if the unknowns of a knob share no channel, so that each projects separately."""
        return bool((((self.columns != 0).sum(axis=1)) <= 1).all())

    @classmethod
    def of(cls, knobs: Sequence[Knob], places: Sequence[tuple[int, ...]]) -> "KnobGroup":
        """Make a group of knobs and their indices among the x."""
        columns = np.zeros((len(knobs), len(knobs[0].unknowns), len(knobs[0].lights), 3))
        for k, knob in enumerate(knobs):
            for j, unknown in enumerate(knob.unknowns):
                for light, rgb in unknown.columns:
                    columns[k, j, knob.lights.index(light)] = rgb
        return cls(
            np.array(places, dtype=np.intp),
            np.array([knob.lights for knob in knobs], dtype=np.intp),
            columns.reshape(*columns.shape[:2], -1),
        )


@dataclass(frozen=True)
class LimitedKnobs:
    """K knobs of u unknowns each, with a limited sum.

    knobs, lower, upper: (k,). unknowns, coefficients: (k, u).
    """

    knobs: Indices
    unknowns: Indices
    coefficients: Doubles
    lower: Doubles
    upper: Doubles

    @classmethod
    def of(
        cls, knobs: Sequence[Knob], places: Sequence[tuple[int, ...]], size: int
    ) -> "LimitedKnobs":
        """Group the limited knobs of this size. places: the indices of each knob's x."""
        limited = [
            (k, knob.limit)
            for k, knob in enumerate(knobs)
            if knob.limit is not None and len(knob.unknowns) == size
        ]
        return cls(
            np.array([k for k, _ in limited], dtype=np.intp),
            np.array([places[k] for k, _ in limited], dtype=np.intp),
            np.array([limit[0] for _, limit in limited]),
            np.array([limit[1] for _, limit in limited]),
            np.array([limit[2] for _, limit in limited]),
        )
