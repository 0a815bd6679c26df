"""The problem in the unknowns alone: a convex quadratic over a box, with limits on groups.

    minimise ½ xᵀM x − bᵀx    with    lower ≤ x ≤ upper    and    l_k ≤ a_k · x ≤ u_k

The limits a_k, "caps", have positive coefficients and share no unknown.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Indices

EPSILON = float(np.finfo(np.float64).eps)

#: An unknown whose M_ii is below this share of the greatest changes nothing that counts.
UNREACHED = 1e-24


@dataclass(frozen=True)
class Cap:
    """Σ coefficients·x[unknowns] stays between lower and upper. Coefficients are > 0."""

    unknowns: tuple[int, ...]
    coefficients: tuple[float, ...]
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class Quadratic:
    """A problem scaled to a unit diagonal of M and to unit length of the caps' coefficients.

    M: (n, n) with rows of 0 where an unknown changes nothing; b, lower, upper, scale: (n,).
    A: (k, n), a row for each cap; cap_lower, cap_upper, cap_scale: (k,).
    groups: the unknowns of each cap. An unknown itself is scale times the scaled one.
    size: what the KKT residual is relative to.
    """

    M: Doubles
    b: Doubles
    lower: Doubles
    upper: Doubles
    scale: Doubles
    A: Doubles
    cap_lower: Doubles
    cap_upper: Doubles
    cap_scale: Doubles
    groups: tuple[Indices, ...]
    size: float

    @property
    def n(self) -> int:
        """The number of unknowns."""
        return self.b.size

    def gradient(self, x: Doubles) -> Doubles:
        """M x − b."""
        return self.M @ x - self.b

    def feasible(self, x: Doubles) -> Doubles:
        """The nearest point to x that keeps to all bounds and caps."""
        x = np.clip(x, self.lower, self.upper)
        for k, group in enumerate(self.groups):
            a, low, high = self.A[k, group], self.lower[group], self.upper[group]
            wanted = min(max(float(a @ x[group]), self.cap_lower[k]), self.cap_upper[k])
            if wanted != float(a @ x[group]):
                x[group] = _moved_along(a, x[group], low, high, wanted)
        return x

    def caps_met(self, x: Doubles) -> tuple[Bools, Bools]:
        """Which caps hold x at their lower, and which at their upper limit; both (k,)."""
        value = self.A @ x
        # The sum over a group is not exact to the last bit, wherever x comes from.
        room = 64 * EPSILON * (np.abs(self.A) @ np.abs(x))
        return value <= self.cap_lower + room, value >= self.cap_upper - room

    def cap_multipliers(self, x: Doubles, gradient: Doubles) -> Doubles:
        """λ (k,) for which gradient − λ A leaves the least to wish for; 0 where there is slack.

        λ <= 0 at an upper limit, >= 0 at a lower one, as the gradient itself is at bounds.
        """
        multipliers = np.zeros(len(self.groups))
        if not self.groups:
            return multipliers
        at_lower, at_upper = self.caps_met(x)
        for k in np.flatnonzero(at_lower | at_upper):
            group = self.groups[k]
            a, values = self.A[k, group], gradient[group] / self.A[k, group]
            low, high = x[group] <= self.lower[group], x[group] >= self.upper[group]
            between = ~low & ~high
            if between.any():
                value = float(np.sum((a * a * values)[between]) / np.sum((a * a)[between]))
            else:
                # Any λ between these serves; the smallest is taken.
                least = float(values[high & ~low].max(initial=-np.inf))
                most = float(values[low & ~high].min(initial=np.inf))
                value = min(max(0.0, least), most) if least <= most else (least + most) / 2
            if not at_lower[k]:
                value = min(value, 0.0)
            if not at_upper[k]:
                value = max(value, 0.0)
            multipliers[k] = value
        return multipliers

    def violations(self, x: Doubles) -> tuple[Doubles, Doubles, float]:
        """(gradient after what caps take, λ, KKT residual) at x.

        The residual is ‖x − P(x − gradient)‖∞ over `size`, P the projection onto the box, or by
        how much a cap is exceeded, if that is more.
        """
        gradient = self.gradient(x)
        multipliers = self.cap_multipliers(x, gradient)
        if self.groups:
            gradient = gradient - multipliers @ self.A
        residual = kkt_residual(gradient, x, self.size, self.lower, self.upper)
        if self.groups:
            value = self.A @ x
            over = np.maximum(value - self.cap_upper, self.cap_lower - value).max()
            residual = max(residual, float(over) / self.size)
        return gradient, multipliers, residual

    def round_off(self, x: Doubles) -> float:
        """What the KKT residual at x is uncertain by: no solver gets safely below."""
        terms = np.abs(self.M) @ np.abs(x) + np.abs(self.b)
        return 4 * EPSILON * float(terms.max(initial=0)) / self.size


def kkt_residual(
    gradient: Doubles, x: Doubles, size: float, lower: Doubles | float, upper: Doubles | float
) -> float:
    """How far x is from optimal: ‖x − P(x − gradient)‖∞ / size, P onto lower..upper.

    It is 0 exactly if the gradient vanishes for every unknown between its bounds, is not
    negative at lower and not positive at upper ones. All scaled to a unit diagonal of M.
    """
    return float(np.abs(kkt_step(gradient, x, lower, upper)).max(initial=0) / size)


def kkt_step(
    gradient: Doubles, x: Doubles, lower: Doubles | float, upper: Doubles | float
) -> Doubles:
    """x − P(x − gradient), up to its sign; of the shape of x."""
    target = x - gradient
    inside = (target > lower) & (target < upper)
    # x − (x − gradient) would lose what is small beside x.
    return np.where(inside, gradient, np.minimum(np.maximum(target, lower), upper) - x)


def scaled(
    M: Doubles,
    b: Doubles,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    caps: tuple[Cap, ...],
) -> Quadratic:
    """Scale the problem. Raises ValueError if its parts do not fit, or nothing satisfies it."""
    n = b.size
    if M.shape != (n, n):
        raise ValueError(f"M is {M.shape} and b {b.shape}: expected ({n}, {n})")
    if not (np.isfinite(M).all() and np.isfinite(b).all()):
        raise ValueError("M and b are to be finite: some picture has a pixel that is not")
    low = np.broadcast_to(np.asarray(lower, np.float64), n)
    high = np.broadcast_to(np.asarray(upper, np.float64), n)
    if not (low <= high).all():
        i = int(np.flatnonzero(~(low <= high))[0])
        raise ValueError(f"unknown {i}: lower bound {low[i]:g} is above upper bound {high[i]:g}")
    power = np.diag(M)
    counts = power > UNREACHED * power.max(initial=0)
    scale = np.where(counts, 1 / np.sqrt(np.where(counts, power, 1)), 1.0)
    inward = np.where(counts, scale, 0.0)
    # No product of two scales: it could overflow where what it multiplies is small.
    M = (M * inward[:, None]) * inward
    b = b * inward
    low, high = low / scale, high / scale
    A, cap_lower, cap_upper, cap_scale, groups = _scaled_caps(caps, scale, low, high)
    nearest = np.clip(0.0, low, high)
    pull = M @ nearest if nearest.any() else nearest
    size = max(float(np.abs(b).max(initial=0)), float(np.abs(pull).max(initial=0))) or 1.0
    return Quadratic(
        M, b, low, high, scale, A, cap_lower, cap_upper, cap_scale, tuple(groups), size
    )


def _scaled_caps(
    caps: tuple[Cap, ...], scale: Doubles, low: Doubles, high: Doubles
) -> tuple[Doubles, Doubles, Doubles, Doubles, list[Indices]]:
    A = np.zeros((len(caps), scale.size))
    cap_lower, cap_upper, cap_scale = np.zeros((3, len(caps)))
    groups: list[Indices] = []
    for k, cap in enumerate(caps):
        group = np.array(cap.unknowns, dtype=np.intp)
        coefficients = np.array(cap.coefficients, dtype=np.float64)
        if not (group.size and group.shape == coefficients.shape and (coefficients > 0).all()):
            raise ValueError(f"cap {k} needs one coefficient > 0 for each of its unknowns: {cap}")
        if len({*group.tolist()}) < group.size or A[:, group].any():
            raise ValueError(f"cap {k} shares an unknown with itself or another: {cap}")
        coefficients = coefficients * scale[group]
        length = float(np.linalg.norm(coefficients))
        A[k, group] = coefficients / length
        cap_lower[k], cap_upper[k], cap_scale[k] = cap.lower / length, cap.upper / length, length
        least, most = float(A[k, group] @ low[group]), float(A[k, group] @ high[group])
        limits = np.array([least, most, cap_lower[k], cap_upper[k]])
        room = 16 * EPSILON * float(np.abs(limits[np.isfinite(limits)]).max(initial=0))
        if cap.lower > cap.upper or least > cap_upper[k] + room or most < cap_lower[k] - room:
            raise ValueError(
                f"cap {k} asks for {cap.lower:g} to {cap.upper:g}, and the bounds of its unknowns "
                f"allow {least * length:g} to {most * length:g}: nothing satisfies both"
            )
        groups.append(group)
    return A, cap_lower, cap_upper, cap_scale, groups


def _moved_along(a: Doubles, x: Doubles, low: Doubles, high: Doubles, wanted: float) -> Doubles:
    """clip(x + t a) with the t for which a · clip(x + t a) is `wanted`, by its breakpoints."""
    ends = np.concatenate([(low - x) / a, (high - x) / a])
    ends = np.sort(ends[np.isfinite(ends)])
    values = np.array([float(a @ np.clip(x + t * a, low, high)) for t in ends])
    after = int(np.searchsorted(values, wanted))
    # Between two breakpoints the value is linear in t; the slope is of those still free to move.
    if ends.size == 0:
        t = (wanted - float(a @ x)) / float(a @ a)
    elif 0 < after < ends.size:
        t0, t1, v0, v1 = ends[after - 1], ends[after], values[after - 1], values[after]
        t = t1 if v1 == v0 else t0 + (t1 - t0) * (wanted - v0) / (v1 - v0)
    else:
        end = 0 if after == 0 else -1
        beyond = ends[end] + (-1.0 if after == 0 else 1.0)
        slope = abs(float(a @ np.clip(x + beyond * a, low, high)) - values[end])
        t = ends[end] + (0 if slope == 0 else (wanted - values[end]) / slope)
    return np.asarray(np.clip(x + t * a, low, high))
