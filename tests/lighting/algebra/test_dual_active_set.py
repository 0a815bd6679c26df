"""Required sums and caps by a dual active set: against quadprog and Clarabel."""

import numpy as np
import pytest
from nightly import seeds
from qp import least, least_by_interior_points

from lightpaint.lighting.algebra.dual_active_set import DualActiveSet, NearAnswer
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.algebra.required_sums import RequiredSums

#: Float64 of these conditions; and of Clarabel, which ends at 1e-8 of its objective.
SAME, SAME_AS_CLARABEL = 1e-8, 1e-5

LUMINANCE = (0.21, 0.72, 0.07)


def _lamps(rng, n, points):
    """The matrix of n lamps of three channels, a painting of dim levels, and rows for the light of
    a floor of many points, which bright levels, (3 n,), reach.
    """
    F = rng.random((12 * n, 3 * n)) ** 4
    M, bright = F.T @ F, rng.uniform(0.3, 2, 3 * n)
    lamps, floor = rng.random((n, 2)) * n, rng.random((points, 2)) * n
    squares = ((floor[:, None] - lamps) ** 2).sum(-1) + 2.1**2
    light = np.repeat(900 * 2.1**2 / squares**2, 3, axis=1) * np.tile(LUMINANCE, n)
    now, mean = light @ bright, light.mean(axis=0)
    rows = np.vstack([mean, light - 0.95 * now.min() / now.mean() * mean])
    painted = bright * rng.uniform(0, 1, 3 * n)
    return M, M @ painted, rows, np.append(0.98 * now.mean(), np.zeros(points)), bright


def _luminance_caps(rng, bright):
    own = bright.reshape(-1, 3) @ LUMINANCE * rng.uniform(1.01, 1.2, bright.size // 3)
    return tuple(
        Cap((3 * k, 3 * k + 1, 3 * k + 2), LUMINANCE, 0.0, most)
        for k, most in enumerate(own.tolist())
    )


@pytest.mark.parametrize("seed", list(seeds(8, 60)))
@pytest.mark.parametrize("has_caps", [False, True])
def test_the_optimum_is_that_of_quadprog(seed, has_caps):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    M, b, rows, required, bright = _lamps(rng, n, 60)
    caps = _luminance_caps(rng, bright) if has_caps else ()
    lower, upper = np.zeros(3 * n), np.full(3 * n, 2.5)
    sums = RequiredSums(M, rows, required, lower=lower, upper=upper, caps=caps)
    found = sums.minimise(b, np.zeros(3 * n))
    assert found.converged
    x = found.optimum.x
    cap_rows = np.zeros((len(caps), 3 * n))
    for row, cap in zip(cap_rows, caps, strict=True):
        row[list(cap.unknowns)] = cap.coefficients
    limits = [(value, np.inf) for value in required] + [(0.0, cap.upper) for cap in caps]
    all_rows = np.vstack([rows, cap_rows])
    expected = least(M, b, lower=0.0, upper=2.5, rows=all_rows, limits=limits)
    assert x == pytest.approx(expected, abs=SAME)
    # The multipliers balance the gradient, and prove the optimum with it.
    balanced = found.multipliers @ rows + found.optimum.cap_multipliers @ cap_rows
    gradient = M @ x - b - balanced
    assert found.optimum.multipliers == pytest.approx(gradient, abs=1e-7)
    size = np.abs(b).max()
    assert (gradient[x < 2.5] >= -1e-8 * size).all()
    assert (gradient[x > 0] <= 1e-8 * size).all()
    assert (found.multipliers >= 0).all()
    room = rows @ x - required
    assert room[found.multipliers > 0] == pytest.approx(0, abs=1e-7)
    assert (found.optimum.cap_multipliers <= 0).all()


@pytest.mark.parametrize("seed", list(seeds(3, 20)))
def test_the_optimum_is_that_of_clarabel(seed):
    rng = np.random.default_rng(100 + seed)
    M, b, rows, required, _ = _lamps(rng, 12, 400)
    lower, upper = np.zeros(36), np.full(36, 2.5)
    found = RequiredSums(M, rows, required, lower=lower, upper=upper).minimise(b, np.zeros(36))
    assert found.converged
    expected, multipliers = least_by_interior_points(M, b, lower, upper, rows, required)
    assert found.optimum.x == pytest.approx(expected, abs=SAME_AS_CLARABEL)
    size = multipliers.max()
    assert found.multipliers == pytest.approx(multipliers, abs=SAME_AS_CLARABEL * size)


@pytest.mark.parametrize("seed", list(seeds(4, 30)))
def test_mixes_that_are_equal_do_not_matter(seed):
    """Five colours of a lamp in three channels: M is singular, the light is not."""
    rng = np.random.default_rng(seed)
    M, b, rows, required, _ = _lamps(rng, 4, 40)
    mixes = np.kron(np.eye(4), rng.random((3, 5)))
    upper = np.full(20, 2.5)
    sums = RequiredSums(
        mixes.T @ M @ mixes, rows @ mixes, required, lower=np.zeros(20), upper=upper
    )
    found = sums.minimise(mixes.T @ b, np.zeros(20))
    assert found.converged
    value = found.optimum.x
    ridged = mixes.T @ M @ mixes + 1e-9 * np.eye(20)
    limits = [(value, np.inf) for value in required]
    expected = least(ridged, mixes.T @ b, upper=2.5, rows=rows @ mixes, limits=limits)
    assert mixes @ value == pytest.approx(mixes @ expected, abs=1e-5)


@pytest.mark.parametrize("has_multipliers", [True, False])
@pytest.mark.parametrize("seed", list(seeds(3, 20)))
def test_from_its_own_answer_it_takes_a_few_steps(seed, has_multipliers):
    """Also where multipliers are not known: the sums that x just meets are those that hold."""
    rng = np.random.default_rng(200 + seed)
    M, b, rows, required, bright = _lamps(rng, 6, 60)
    caps = _luminance_caps(rng, bright)
    limits = {"lower": np.zeros(18), "upper": np.full(18, 2.5), "caps": caps}
    begin = NearAnswer(np.zeros(18), np.zeros(61), np.zeros(6))

    def active_set():
        return DualActiveSet(M, rows, required, least_diagonal=1e-6, **limits)

    found = active_set().minimise(b, begin, tolerance=1e-12)
    assert found is not None
    optimum, multipliers = found
    near = NearAnswer(optimum.x, np.zeros(61), np.zeros(6))
    if has_multipliers:
        near = NearAnswer(optimum.x, multipliers, optimum.cap_multipliers)
    again = active_set().minimise(b, near, tolerance=1e-12)
    assert again is not None
    assert again[0].steps <= 2
    assert again[0].x == pytest.approx(optimum.x, abs=SAME)


def test_it_does_not_claim_what_nothing_reaches():
    limits = {"lower": np.zeros(2), "upper": np.ones(2), "caps": (), "least_diagonal": 1e-6}
    sums = DualActiveSet(np.eye(2), np.ones((1, 2)), np.array([5.0]), **limits)
    near = NearAnswer(np.zeros(2), np.zeros(1), np.zeros(0))
    assert sums.minimise(np.zeros(2), near, tolerance=1e-12) is None


def test_sums_that_hold_where_no_unknown_is_free_leave_quietly(capfd):
    """LAPACK complains about matrices without rows."""
    limits = {"lower": np.zeros(2), "upper": np.ones(2), "caps": (), "least_diagonal": 1e-6}
    sums = DualActiveSet(np.eye(2), np.ones((1, 2)), np.array([2.5]), **limits)
    near = NearAnswer(np.ones(2), np.ones(1), np.zeros(0))
    assert sums.minimise(np.zeros(2), near, tolerance=1e-12) is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("seed", list(seeds(6, 40)))
def test_wrong_limits_to_begin_with_do_not_matter(seed):
    """Multipliers of sums that depend on each other, and unknowns at wrong bounds."""
    rng = np.random.default_rng(300 + seed)
    M, b, rows, required, _ = _lamps(rng, 5, 40)
    rows, required = np.vstack([rows, rows[:9]]), np.append(required, required[:9])
    limits = {"lower": np.zeros(15), "upper": np.full(15, 2.5)}
    expected = RequiredSums(M, rows, required, **limits).minimise(b, np.zeros(15))
    assert expected.converged
    wrong = NearAnswer(
        rng.choice([0.0, 1.0, 2.5], 15), rng.random(50) * (rng.random(50) < 0.5), np.zeros(0)
    )
    found = DualActiveSet(M, rows, required, caps=(), least_diagonal=1e-6, **limits).minimise(
        b, wrong, tolerance=1e-12
    )
    assert found is not None
    assert found[0].x == pytest.approx(expected.optimum.x, abs=SAME)
    assert (found[1] >= 0).all()


def test_a_corner_where_more_limits_meet_than_there_are_unknowns():
    """Two sums and two bounds hold at one point of a plane: any two of them say where it is."""
    rows, least = np.array([[1.0, 1.0], [1.0, 2.0]]), np.array([2.0, 3.0])
    limits = {"lower": np.zeros(2), "upper": np.ones(2), "caps": (), "least_diagonal": 1e-6}
    sums = DualActiveSet(np.eye(2), rows, least, **limits)
    near = NearAnswer(np.ones(2), np.array([0.5, 0.5]), np.zeros(0))
    found = sums.minimise(np.array([-3.0, 0.2]), near, tolerance=1e-12)
    assert found is not None
    assert found[0].x == pytest.approx([1, 1], abs=SAME)


def test_channels_that_nothing_joins_are_solved_apart():
    rng = np.random.default_rng(4)
    M, b, rows, required, _ = _lamps(rng, 6, 60)
    parts = [np.arange(c, 18, 3) for c in range(3)]
    apart = np.zeros_like(M)
    for places in parts:
        apart[np.ix_(places, places)] = M[np.ix_(places, places)]
    limits = {"lower": np.zeros(18), "upper": np.full(18, 2.5)}
    together = RequiredSums(apart, rows, required, **limits).minimise(b, np.zeros(18))
    split = RequiredSums(apart, rows, required, **limits, parts=parts).minimise(b, np.zeros(18))
    assert split.converged
    assert split.optimum.x == pytest.approx(together.optimum.x, abs=SAME)
