"""The problem in the unknowns alone: a convex quadratic over a box, with limits on groups.

    minimise ½ xᵀM x − bᵀx    with    lower ≤ x ≤ upper    and    l_k ≤ a_k · x ≤ u_k

The limits a_k, "caps", have positive coefficients and share no unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Indices

EPSILON = float(np.finfo(np.float64).eps)

#: An unknown whose M_ii is below this share of the greatest changes nothing that counts.
UNREACHED_POWER = 1e-24

NOT_FINITE = "M and b must be finite: some picture has a pixel that is not"


@dataclass(frozen=True)
class Cap:
    """Σ coefficients·x[unknowns] stays between lower and upper. Coefficients are > 0."""

    unknowns: tuple[int, ...]
    coefficients: tuple[float, ...]
    lower: float = -np.inf
    upper: float = np.inf


def cap_rows(caps: Sequence[Cap], count: int) -> tuple[Doubles, Doubles]:
    """Return caps on `count` unknowns as sums that are at least as large as given values: their
    lower limits, then their upper ones, (2 c, count) and (2 c,).
    """
    rows = np.zeros((len(caps), count))
    for row, cap in zip(rows, caps, strict=True):
        row[list(cap.unknowns)] = cap.coefficients
    lower, upper = (np.array([getattr(cap, x) for cap in caps]) for x in ("lower", "upper"))
    return np.concatenate([rows, -rows]), np.concatenate([lower, -upper])


@dataclass(frozen=True)
class Quadratic:
    """A problem scaled to a unit diagonal of M and to unit length of the caps' coefficients.

    M: (n, n) with rows of 0 where an unknown changes nothing; b, lower, upper, scale: (n,).
    A: (k, n), a row for each cap; cap_lower, cap_upper, cap_scale: (k,).
    groups: the unknowns of each cap. An unknown itself is scale times the scaled one.
    size: scale of the KKT residual.
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

    def with_right_side(self, b: Doubles) -> "Quadratic":
        """Return the same problem with another b, (n,), not scaled.

        Raises ValueError if it does not fit.
        """
        if b.shape != (self.n,):
            raise ValueError(f"M is {self.M.shape} and b {b.shape}: expected ({self.n},)")
        if not np.isfinite(b).all():
            raise ValueError(NOT_FINITE)
        b = np.where(self.M.diagonal() > 0, b * self.scale, 0.0)
        return replace(self, b=b, size=_gradient_size(self.M, b, self.lower, self.upper))

    def objective(self, x: Doubles) -> float:
        """Return ½ xᵀM x − bᵀx."""
        return float(x @ (0.5 * (self.M @ x) - self.b))

    def gradient(self, x: Doubles) -> Doubles:
        """Return M x − b."""
        return self.M @ x - self.b

    def feasible(self, x: Doubles) -> Doubles:
        """Return the nearest point to x that keeps to all bounds and caps."""
        x = np.clip(x, self.lower, self.upper)
        value = self.A @ x
        goal = np.minimum(np.maximum(value, self.cap_lower), self.cap_upper)
        violated = np.flatnonzero(value != goal)
        for size in {self.groups[k].size for k in violated}:
            caps = np.array([k for k in violated if self.groups[k].size == size])
            members = np.stack([self.groups[k] for k in caps])
            low, high = self.lower[members], self.upper[members]
            x[members] = clip_to_sums(
                self.A[caps[:, None], members], x[members], low, high, goal[caps]
            )
        return x

    def active_caps(self, x: Doubles) -> tuple[Bools, Bools]:
        """Return which caps x meets at their lower limits, and which at their upper ones; both
        (k,).
        """
        value = self.A @ x
        # The sum over a group has round-off.
        room = 64 * EPSILON * (np.abs(self.A) @ np.abs(x))
        return value <= self.cap_lower + room, value >= self.cap_upper - room

    def cap_multipliers(self, x: Doubles, gradient: Doubles) -> Doubles:
        """Return λ (k,) that minimises gradient − λ A; 0 for caps with slack.

        λ <= 0 at an upper limit, >= 0 at a lower one, as the gradient itself is at bounds.
        """
        multipliers = np.zeros(len(self.groups))
        if not self.groups:
            return multipliers
        at_lower, at_upper = self.active_caps(x)
        low, high = x <= self.lower, x >= self.upper
        between = self.A * (~low & ~high)
        weight = np.einsum("kn,kn->k", between, between)
        met = at_lower | at_upper
        free = met & (weight > 0)
        multipliers[free] = (between[free] @ gradient) / weight[free]
        for k in np.flatnonzero(met & ~free):
            # Any λ between these serves; the smallest is taken.
            group = self.groups[k]
            values = gradient[group] / self.A[k, group]
            least = float(values[high[group] & ~low[group]].max(initial=-np.inf))
            most = float(values[low[group] & ~high[group]].min(initial=np.inf))
            multipliers[k] = min(max(0.0, least), most) if least <= most else (least + most) / 2
        multipliers = np.where(at_lower, multipliers, np.minimum(multipliers, 0.0))
        multipliers = np.where(at_upper, multipliers, np.maximum(multipliers, 0.0))
        return multipliers

    def violations(self, x: Doubles) -> tuple[Doubles, Doubles, float]:
        """Return (gradient less the multipliers of caps, λ, KKT residual) at x.

        The residual is ‖x − P(x − gradient)‖∞ over `size`, P the projection onto the box, or the
        largest violation of a cap, if that is more.
        """
        gradient = self.gradient(x)
        multipliers = self.cap_multipliers(x, gradient)
        if self.groups:
            gradient = gradient - multipliers @ self.A
        residual = kkt_residual(gradient, x, self.size, self.lower, self.upper)
        if self.groups:
            value = self.A @ x
            excess = np.maximum(value - self.cap_upper, self.cap_lower - value).max()
            residual = max(residual, float(excess) / self.size)
        return gradient, multipliers, residual

    def round_off(self, x: Doubles) -> float:
        """Return the round-off of the KKT residual at x: no solver gets safely below."""
        terms = np.abs(self.M) @ np.abs(x) + np.abs(self.b)
        return 4 * EPSILON * float(terms.max(initial=0)) / self.size


def kkt_residual(
    gradient: Doubles, x: Doubles, size: float, lower: Doubles | float, upper: Doubles | float
) -> float:
    """Return the distance of x from optimal: ‖x − P(x − gradient)‖∞ / size, P onto lower..upper.

    It is 0 exactly if the gradient vanishes for every unknown between its bounds, is not
    negative at lower and not positive at upper ones. All scaled to a unit diagonal of M.
    """
    return float(np.abs(kkt_step(gradient, x, lower, upper)).max(initial=0) / size)


def kkt_step(
    gradient: Doubles, x: Doubles, lower: Doubles | float, upper: Doubles | float
) -> Doubles:
    """Return x − P(x − gradient), up to its sign, in the shape of x."""
    target = x - gradient
    inside = (target > lower) & (target < upper)
    # x − (x − gradient) would lose a gradient that is small beside x.
    return np.where(inside, gradient, np.minimum(np.maximum(target, lower), upper) - x)


def scaled(
    M: Doubles,
    b: Doubles,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    caps: tuple[Cap, ...],
) -> Quadratic:
    """Scale the problem to a unit diagonal of M. Raises ValueError if its parts do not fit, or
    nothing satisfies it.
    """
    n = b.size
    if M.shape != (n, n):
        raise ValueError(f"M is {M.shape} and b {b.shape}: expected ({n}, {n})")
    if not (np.isfinite(M).all() and np.isfinite(b).all()):
        raise ValueError(NOT_FINITE)
    low = np.broadcast_to(np.asarray(lower, np.float64), n)
    high = np.broadcast_to(np.asarray(upper, np.float64), n)
    if not (low <= high).all():
        i = int(np.flatnonzero(~(low <= high))[0])
        raise ValueError(f"unknown {i}: lower bound {low[i]:g} is above upper bound {high[i]:g}")
    power = np.diag(M)
    counts = power > UNREACHED_POWER * power.max(initial=0)
    scale = np.where(counts, 1 / np.sqrt(np.where(counts, power, 1)), 1.0)
    inward = np.where(counts, scale, 0.0)
    # Not multiplied by the product of two scales, which could overflow.
    M = M * inward[:, None]
    M *= inward
    b = b * inward
    low, high = low / scale, high / scale
    A, cap_lower, cap_upper, cap_scale, groups = _scaled_caps(caps, scale, low, high)
    size = _gradient_size(M, b, low, high)
    return Quadratic(
        M, b, low, high, scale, A, cap_lower, cap_upper, cap_scale, tuple(groups), size
    )


def _gradient_size(M: Doubles, b: Doubles, low: Doubles, high: Doubles) -> float:
    """Return the largest entry of b and of M x at the bounds nearest to 0."""
    nearest = np.clip(0.0, low, high)
    pull = M @ nearest if nearest.any() else nearest
    return max(float(np.abs(b).max(initial=0)), float(np.abs(pull).max(initial=0))) or 1.0


def _scaled_caps(
    caps: tuple[Cap, ...], scale: Doubles, low: Doubles, high: Doubles
) -> tuple[Doubles, Doubles, Doubles, Doubles, list[Indices]]:
    A = np.zeros((len(caps), scale.size))
    groups = [np.array(cap.unknowns, dtype=np.intp) for cap in caps]
    for k, (cap, group) in enumerate(zip(caps, groups, strict=True)):
        count = len(cap.coefficients)
        if not (group.size == count > 0 and min(cap.coefficients) > 0):
            raise ValueError(f"cap {k} needs one coefficient > 0 for each of its unknowns: {cap}")
        if len({*cap.unknowns}) < count or A[:, group].any():
            raise ValueError(f"cap {k} shares an unknown with itself or another: {cap}")
        A[k, group] = cap.coefficients
    A *= scale
    length = np.sqrt(np.einsum("kn,kn->k", A, A))
    A /= length[:, None]
    cap_lower, cap_upper = (
        np.array([getattr(cap, end) for cap in caps], np.float64) / length
        for end in ("lower", "upper")
    )
    # Bounds of unknowns outside a cap do not count, not even infinite ones.
    least, most = (np.where(A > 0, A * np.where(A > 0, x, 0), 0).sum(axis=1) for x in (low, high))
    limits = np.stack([least, most, cap_lower, cap_upper])
    room = 16 * EPSILON * np.abs(np.where(np.isfinite(limits), limits, 0)).max(axis=0, initial=0)
    cannot = (cap_lower > cap_upper) | (least > cap_upper + room) | (most < cap_lower - room)
    for k in np.flatnonzero(cannot).tolist():
        raise ValueError(
            f"cap {k} asks for {caps[k].lower:g} to {caps[k].upper:g}, and the bounds of its "
            f"unknowns allow {least[k] * length[k]:g} to {most[k] * length[k]:g}: nothing "
            "satisfies both"
        )
    return A, cap_lower, cap_upper, length, groups


def clip_to_sums(a: Doubles, x: Doubles, low: Doubles, high: Doubles, goal: Doubles) -> Doubles:
    """Return clip(x + t a) with the t for which a · clip(x + t a) equals `goal`, for each of k
    rows.

    a, x, low, high: (k, m), a > 0; goal: (k,). The sum rises with t, in a straight line between
    the t at which an unknown comes to a bound.
    """
    ends = np.sort(np.concatenate([(low - x) / a, (high - x) / a], axis=1), axis=1)
    at_ends = x[:, None] + ends[..., None] * a[:, None]
    sums = np.einsum("km,kem->ke", a, np.clip(at_ends, low[:, None], high[:, None]))
    segments = (sums < goal[:, None]).sum(axis=1)
    walls = np.empty((len(a), ends.shape[1] + 2))
    walls[:, 0], walls[:, 1:-1], walls[:, -1] = -np.inf, ends, np.inf
    rows = np.arange(len(a))
    first, last = walls[rows, segments], walls[rows, segments + 1]
    # A t between the two that enclose the answer.
    least, most = (np.where(np.isfinite(end), end, 0) for end in (first, last))
    middle = (least + most) / 2
    middle = np.where(np.isfinite(last), middle, least + 1)
    middle = np.where(np.isfinite(first), middle, np.where(np.isfinite(last), most - 1, 0))
    moved = x + middle[:, None] * a
    slope = (np.square(a) * ((moved > low) & (moved < high))).sum(axis=1)
    short = goal - (a * np.clip(moved, low, high)).sum(axis=1)
    t = np.clip(middle + short / np.where(slope > 0, slope, np.inf), first, last)
    return np.asarray(np.clip(x + t[:, None] * a, low, high))
