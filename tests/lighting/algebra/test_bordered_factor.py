"""A factor that serves changed unknowns and sums: as good as solving anew."""

import numpy as np
import pytest
from nightly import seeds

from lightpaint.lighting.algebra.bordered_factor import BorderedFactor

#: Float64 of matrices of condition 1e3 or less.
SAME = 1e-9


def _solved_anew(M, free, right, rows, least):
    f, w = int(free.sum()), len(rows)
    matrix = np.zeros((f + w, f + w))
    matrix[:f, :f], matrix[:f, f:] = M[np.ix_(free, free)], -rows[:, free].T
    matrix[f:, :f] = rows[:, free]
    solved = np.linalg.solve(matrix, np.concatenate([right[free], least]))
    z = np.zeros(len(M))
    z[free] = solved[:f]
    return z, solved[f:]


@pytest.mark.parametrize("has_parts", [False, True])
@pytest.mark.parametrize("seed", list(seeds(4, 30)))
def test_changes_are_as_good_as_a_new_solve(seed, has_parts):
    rng = np.random.default_rng(seed)
    k = 36
    F = rng.normal(size=(3 * k, k))
    M = F.T @ F / k
    parts = [np.arange(c, k, 3) for c in range(3)] if has_parts else [np.arange(k)]
    if has_parts:
        M *= np.arange(k)[:, None] % 3 == np.arange(k) % 3
    sums, factor = rng.normal(size=(12, k)), BorderedFactor(M, parts)
    free, which = np.ones(k, bool), np.zeros(0, np.intp)
    for _ in range(40):
        free ^= rng.random(k) < 0.08
        which = np.flatnonzero(rng.random(12) < 0.3)
        if free.sum() <= which.size:
            continue
        right, least = rng.normal(size=k), rng.normal(size=which.size)
        found = factor.solve(free, right, sums, which, least)
        assert found is not None
        expected = _solved_anew(M, free, right, sums[which], least)
        assert found[0] == pytest.approx(expected[0], abs=SAME)
        assert found[1] == pytest.approx(expected[1], abs=SAME)
        assert (found[0][~free] == 0).all()


def test_no_unknown_is_free():
    factor = BorderedFactor(np.eye(3), [np.arange(3)])
    found = factor.solve(
        np.zeros(3, bool), np.ones(3), np.zeros((0, 3)), np.zeros(0, np.intp), np.zeros(0)
    )
    assert found is not None
    assert found[0] == pytest.approx(0, abs=0)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    factor = BorderedFactor(np.diag([1.0, -1.0]), [np.arange(2)])
    none = np.zeros(0, np.intp)
    assert factor.solve(np.ones(2, bool), np.ones(2), np.zeros((0, 2)), none, np.zeros(0)) is None
