"""The mix of a lamp's emitters that renders colours best, among those of the same colour, and the
one of least cost that renders them well enough.

All mixes of a colour are the means of some of them, its corners. Rf is neither convex nor concave
there, so several searches begin at different mixes. None of them is a proof.
"""

from collections.abc import Callable
from itertools import combinations

import numpy as np

from lightpaint.arrays import Doubles

#: Rf (n,) of drives (n, e).
Fidelity = Callable[[Doubles], Doubles]

#: Places on the way between two corners at which a search may begin, and how many begin.
PLACES, STARTS = np.linspace(0, 1, 17)[1:-1], 3

#: Most corners between which all ways are tried; of more, those to the mean of all.
MANY_CORNERS = 16

#: Steps of a search, the shares by which it finds slopes, and steps towards a mix that is enough.
STEPS, SHARE, HALVINGS = 60, 1e-5, 30


def best_mix(corners: Doubles, rf: Fidelity) -> Doubles:
    """Return the drives (e,) of the highest Rf that is found between corners (k, e)."""
    if len(corners) < 2:
        return np.asarray(corners[0])
    shares = _tried_shares(len(corners))
    values = rf(shares @ corners)
    begin = shares[np.argsort(-values, kind="stable")[:STARTS]]

    def missed(x: Doubles) -> Doubles:
        return -rf(x @ corners)

    tried = np.array([*begin, *(_least(missed, x) for x in begin)]) @ corners
    return np.asarray(tried[int(np.argmax(rf(tried)))])


def cheapest_mix(corners: Doubles, costs: Doubles, rf: Fidelity, least: float) -> Doubles:
    """Return the drives (e,) of the least cost that is found between corners (k, e), with an Rf of
    at least `least`; if none reach it, those of the best Rf.

    costs: (e,), of each emitter at full.
    """
    cheapest = corners[int(np.argmin(corners @ costs))]
    if rf(cheapest[None])[0] >= least:
        return np.asarray(cheapest)
    best = best_mix(corners, rf)
    if rf(best[None])[0] <= least:
        return best
    shares = _tried_shares(len(corners))
    enough = shares[rf(shares @ corners) >= least]
    begin = enough[np.argsort(enough @ corners @ costs, kind="stable")[:STARTS]]
    size = max(float(np.ptp(corners @ costs)), 1e-300)

    def spent(x: Doubles) -> Doubles:
        return np.asarray(x @ corners @ costs / size)

    def spare(x: Doubles) -> Doubles:
        return rf(x @ corners) - least

    # The straight way from the cheapest mix to the best is one more.
    ends = [cheapest, *(_least(spent, x, spare) @ corners for x in begin)]
    tried = np.array([best, *begin @ corners, *(_raised(x, best, rf, least) for x in ends)])
    return np.asarray(tried[int(np.argmin(tried @ costs))])


def _tried_shares(count: int) -> Doubles:
    """Return shares (n, count) of corners: each, their mean, and places between."""
    corners = np.eye(count)
    mean = corners.mean(axis=0)
    ways = [(mean, x) for x in corners]
    if count <= MANY_CORNERS:
        ways += list(combinations(corners, 2))
    between = [(1 - t) * a + t * b for a, b in ways for t in PLACES]
    return np.array([*corners, mean, *between])


def _least(value: Fidelity, start: Doubles, at_least_0: Fidelity | None = None) -> Doubles:
    """Return shares (k,) of corners where a function of shares (n, k) is least, near `start`, and
    another is not negative.
    """
    from scipy.optimize import minimize

    def one(function: Fidelity) -> Callable[[Doubles], float]:
        return lambda x: float(function(x[None])[0])

    def slope(function: Fidelity) -> Callable[[Doubles], Doubles]:
        def slopes(x: Doubles) -> Doubles:
            steps = SHARE * np.eye(len(x))
            values = function(np.concatenate([x + steps, x - steps]))
            return np.asarray((values[: len(x)] - values[len(x) :]) / (2 * SHARE))

        return slopes

    limits = [{"type": "eq", "fun": lambda x: x.sum() - 1, "jac": np.ones_like}]
    if at_least_0 is not None:
        limits += [{"type": "ineq", "fun": one(at_least_0), "jac": slope(at_least_0)}]
    found = minimize(
        one(value),
        start,
        jac=slope(value),
        bounds=[(0, 1)] * len(start),
        constraints=limits,
        method="SLSQP",
        options={"maxiter": STEPS, "ftol": 1e-7},
    )
    shares = np.clip(found.x, 0, 1)
    return np.asarray(shares / shares.sum()) if np.isfinite(shares).all() else start


def _raised(drives: Doubles, best: Doubles, rf: Fidelity, least: float) -> Doubles:
    """Return drives (e,), brought on the straight way to the best ones until they are enough."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS if rf(drives[None])[0] < least else 0):
        middle = (low + high) / 2
        is_enough = rf((drives + middle * (best - drives))[None])[0] >= least
        low, high = (low, middle) if is_enough else (middle, high)
    return np.asarray(drives + high * (best - drives)) if low > 0 else drives
