"""The unknowns whose weights come nearest to given ones, from which a solve starts."""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.optimum import minimise, minimise_each
from lightpaint.lighting.algebra.quadratic import Cap, clip_to_sums
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.unknown_blocks import KnobGroup, LimitedKnobs

#: Determinant of the colours that a light mixes, relative to their size, below which they are too
#: alike.
SINGULAR_DETERMINANT = 1e-6

#: Distance from a bound, relative to the light's other values, that is round-off of a start.
BOUND_ROUND_OFF = 1e-12


def nearest_unknowns(reduction: Reduction, start: Doubles, reached: Bools) -> Doubles:
    """Return the x (k,) whose emissions are nearest to `start`, (n, 3), within the limits of each
    knob.

    reached: (n,). For a light that reaches something, a luminance at its limit is good enough.
    """
    x = np.zeros(len(reduction.unknowns))
    for group in reduction.knob_groups:
        bounds = reduction.lower[group.places], reduction.upper[group.places]
        x[group.places] = _nearest_in_group(group, start, *bounds)
    for stack in reduction.limited_knobs:
        for k in _clip_to_limits(x, reduction, stack):
            knob = reduction.knobs[k]
            if not (knob.is_free or reached[knob.lights[0]]):
                x[list(reduction.places[k])] = _nearest_limited(knob, start)
    return x


def _nearest_in_group(group: KnobGroup, start: Doubles, low: Doubles, high: Doubles) -> Doubles:
    """Return the x of knobs, (k, u), between bounds (k, u), whose emissions are nearest to
    `start`.
    """
    current = start[group.lights].reshape(len(low), -1)
    if group.is_free:
        return np.asarray(np.minimum(np.maximum(current, low), high))
    right_side = np.einsum("kue,ke->ku", group.columns, current)
    if group.is_orthogonal:
        values = right_side / np.square(group.columns).sum(axis=2)
        return _snap_to_bounds(values, low, high)
    squares = np.matmul(group.columns, group.columns.swapaxes(1, 2))
    values = _solve_mixes(group.columns, current)
    violated = np.flatnonzero(~((values >= low) & (values <= high)).all(axis=1))
    if violated.size:
        low_out, high_out = low[violated], high[violated]
        optima = minimise_each(
            squares[violated],
            right_side[violated],
            lower=low_out,
            upper=high_out,
            start=np.clip(0, low_out, high_out),
        )
        values[violated] = np.stack([optimum.x for optimum in optima])
    return _snap_to_bounds(values, low, high)


def _clip_to_limits(x: Doubles, reduction: Reduction, stack: LimitedKnobs) -> Indices:
    """Move the x of knobs into their limits, in place; return the knobs that were beyond them."""
    a, places = stack.coefficients, stack.unknowns
    now = (a * x[places]).sum(axis=1)
    nearest = np.minimum(np.maximum(now, stack.lower), stack.upper)
    violated = now != nearest
    out = places[violated]
    low, high = reduction.lower[out], reduction.upper[out]
    x[out] = clip_to_sums(a[violated], x[out], low, high, nearest[violated])
    return np.asarray(stack.knobs[violated])


def _solve_mixes(columns: Doubles, emission: Doubles) -> Doubles:
    """Return the x (k, u) with C x = emission, (k, e); nan where C is not square or singular.

    columns: (k, u, e), C transposed.
    """
    x = np.full(columns.shape[:2], np.nan)
    if columns.shape[1] == columns.shape[2]:
        size = np.abs(columns).max(axis=(1, 2)) ** columns.shape[1]
        regular = np.abs(np.linalg.det(columns)) > SINGULAR_DETERMINANT * size
        C = columns[regular].swapaxes(1, 2)
        x[regular] = np.linalg.solve(C, emission[regular, :, None])[..., 0]
    return x


def _nearest_limited(knob: Knob, start: Doubles) -> Doubles:
    """Return the x of a light with limited luminance whose emission is nearest to `start`."""
    assert knob.limit is not None
    C = np.array([unknown.columns[0][1] for unknown in knob.unknowns])
    lower = np.array([unknown.lower for unknown in knob.unknowns])
    upper = np.array([unknown.upper for unknown in knob.unknowns])
    cap = Cap(tuple(range(len(C))), *knob.limit)
    right = C @ start[knob.lights[0]]
    return _snap_to_bounds(
        minimise(C @ C.T, right, lower=lower, upper=upper, caps=(cap,)).x, lower, upper
    )


def _snap_to_bounds(x: Doubles, lower: Doubles, upper: Doubles) -> Doubles:
    """Return x, (k,) or one knob a row, moved into its bounds, and onto those within round-off.

    Only unknowns exactly at a bound have multipliers.
    """
    tolerance = BOUND_ROUND_OFF * np.abs(x).max(axis=-1, keepdims=True, initial=0)
    x = np.where(np.abs(x - lower) <= tolerance, lower, np.maximum(x, lower))
    return np.asarray(np.where(np.abs(x - upper) <= tolerance, upper, np.minimum(x, upper)))
