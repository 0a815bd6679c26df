"""The unknowns sorted for the arithmetic: by the channels they couple, by size, by their limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
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

    @cached_property
    def are_ones(self) -> bool:
        """True if all values are 1."""
        return bool((self.values == 1).all())

    def place(self, other: "Entries") -> Any:
        """Return the index of the rows of these columns and the columns of `other` in a matrix of
        all unknowns.
        """
        rows, columns = _as_range(self.columns), _as_range(other.columns)
        if isinstance(rows, slice) and isinstance(columns, slice):
            return rows, columns
        return np.ix_(self.columns, other.columns)

    def between(self, M: Doubles, other: "Entries") -> Doubles:
        """Return C_cᵀ M C_d, (j, j'), of a matrix (n, n) between this channel and the channel of
        `other`.
        """
        rows, columns = _as_range(self.lights), _as_range(other.lights)
        are_ranges = isinstance(rows, slice) and isinstance(columns, slice)
        part = M[rows, columns] if are_ranges else M[np.ix_(self.lights, other.lights)]
        if not self.are_ones:
            part = part * self.values[:, None]
        if not other.are_ones:
            part = part * other.values
        # Most columns are of one light: the sum over the columns of several is a short one.
        if self.lights.size > self.columns.size:
            part = np.add.reduceat(part, self.first, 0)
        if other.lights.size > other.columns.size:
            part = np.add.reduceat(part, other.first, 1)
        return part


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
        return not more and first.are_ones and first.lights.size == self.unknowns.size

    def right_side(self, b: Doubles) -> Doubles:
        """Return Cᵀ b, (k,), of b (3, n)."""
        if self.is_plain:
            [c], lights = self.channels, self.entries[0].lights
            is_whole = self.is_in_order and lights.size == b.shape[1]
            return np.asarray(b[c] if is_whole else b[c, lights])
        made = np.zeros(self.unknowns.size)
        for c, e in zip(self.channels, self.entries, strict=True):
            right = b[c, e.lights] * e.values
            if e.lights.size > e.columns.size:
                right = np.add.reduceat(right, e.first)
            made[e.columns] += right
        return made

    def matrix(self, M: Doubles, coupling: Doubles | None = None) -> Doubles:
        """Return Cᵀ M C, (k, k), of M (3, n, n) and the coupling of channels, as in
        `NormalEquations`.
        """
        if self.is_plain:
            [c], e = self.channels, self.entries[0]
            return e.between(M[c], e)
        made = np.zeros((self.unknowns.size, self.unknowns.size))
        for c, e in zip(self.channels, self.entries, strict=True):
            made[e.place(e)] += e.between(M[c], e)
        if coupling is not None:
            p = self.pairs
            values = p.value * coupling[p.light, p.channel, p.other_channel]
            np.add.at(made, (p.column, p.other_column), values)
        return made

    def covariance(self, C: Doubles) -> Doubles:
        """Return Cᵀ Q C, (k, k), of a covariance Q of all channels, (3, n, 3, n)."""
        made = np.zeros((self.unknowns.size, self.unknowns.size))
        for c, e in zip(self.channels, self.entries, strict=True):
            for d, f in zip(self.channels, self.entries, strict=True):
                made[e.place(f)] += e.between(C[c, :, d], f)
        return made

    def variances(self, covariance: Doubles, n: int) -> Doubles:
        """Return the variance of each weight, (n, 3), by a covariance of the unknowns, (k, k)."""
        variances = np.zeros((n, 3))
        for c, e in zip(self.channels, self.entries, strict=True):
            order = np.argsort(e.lights, kind="stable")
            columns = np.repeat(e.columns, e.counts)[order]
            lights, values = e.lights[order], e.values[order]
            # Entries of the same light follow each other.
            for apart in range(lights.size):
                first = np.flatnonzero(lights[: lights.size - apart] == lights[apart:])
                if not first.size:
                    break
                second, times = first + apart, 2 if apart else 1
                terms = covariance[columns[first], columns[second]] * values[first] * values[second]
                variances[:, c] += times * np.bincount(lights[first], terms, n)
        return variances

    def effects(self, x: Doubles, n: int) -> Doubles:
        """Return the effect C x of unknowns, (k, m), on the weights, (3, n, m)."""
        weights = np.zeros((3, n, x.shape[1]))
        for c, e in zip(self.channels, self.entries, strict=True):
            rows = e.values[:, None] * x[np.repeat(e.columns, e.counts)]
            np.add.at(weights[c], e.lights, rows)
        return weights

    def masked(self, lit: Bools) -> "Block":
        """Return the block without effect on channels where a light reaches nothing. lit: (n,
        3).
        """
        if lit.all():
            return self
        entries = (
            replace(e, values=e.values * lit[e.lights, c])
            for c, e in zip(self.channels, self.entries, strict=True)
        )
        return replace(self, entries=tuple(entries))

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
        by_light = np.argsort(light, kind="stable")
        _, first, counts = np.unique(light[by_light], return_index=True, return_counts=True)
        # Each entry of a light meets all of them, in their order.
        met = np.repeat(counts, counts)
        begins = np.cumsum(met) - met
        others = np.repeat(np.repeat(first, counts) - begins, met) + np.arange(met.sum())
        a, b = np.repeat(by_light, met), by_light[others]
        differ = channel[a] != channel[b]
        a, b = a[differ], b[differ]
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


def _as_range(places: Indices) -> slice | Indices:
    """Return places at equal distances as a slice, which needs no copy, and others unchanged."""
    step = int(places[1] - places[0]) if places.size > 1 else 1
    if step < 1 or not places.size or (np.diff(places) != step).any():
        return places
    return slice(int(places[0]), int(places[-1]) + 1, step)
