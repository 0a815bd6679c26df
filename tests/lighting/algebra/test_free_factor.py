"""Steps of many unknowns by one factor: the same as by a factor of each set, and never uphill."""

from typing import Any

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController

from lightpaint.lighting.algebra import optimum as optimum_module
from lightpaint.lighting.algebra.bordered_factor import Border
from lightpaint.lighting.algebra.free_factor import FreeFactor, projected_newton
from lightpaint.lighting.algebra.optimum import QuadraticFamily, minimise
from lightpaint.lighting.algebra.quadratic import Quadratic, kkt_residual, scaled
from lightpaint.threads import one_thread

N = 60


def _problem(seed: int, *, n: int = N, pixels: int = 90) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    columns = rng.random((pixels, n)) ** 3
    columns /= np.linalg.norm(columns, axis=0)
    target_image = columns @ (rng.random(n) * (rng.random(n) < 0.5)) + 0.2 * rng.normal(size=pixels)
    return columns.T @ columns, columns.T @ target_image


def test_steps_from_set_to_set_are_those_of_each_set_alone() -> None:
    (M, b), rng = _problem(0), np.random.default_rng(1)
    factor, free = FreeFactor(M), rng.random(N) < 0.7
    for change in (0, 1, 3, 5, 40, 2, 0, 4):
        turned = rng.choice(N, change, replace=False)
        free[turned] = ~free[turned]
        gradient = M @ rng.random(N) - b
        step = factor.newton_step(free, gradient)
        expected = np.zeros(N)
        expected[free] = -np.linalg.solve(M[np.ix_(free, free)], gradient[free])
        np.testing.assert_allclose(step, expected, atol=1e-9 * np.abs(expected).max())  # precision
        assert not step[~free].any()
        assert factor.knows_regular(free)


def test_columns_beside_a_factor_are_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sets that wander by one unknown a step, half of which return."""
    (M, b), rng, solved = _problem(1, n=200, pixels=300), np.random.default_rng(2), []
    join = Border.join

    def counted(self: Any, unknowns: Any, columns: Any) -> None:
        solved.append(len(unknowns))
        join(self, unknowns, columns)

    monkeypatch.setattr(Border, "join", counted)
    factor, free = FreeFactor(M), rng.random(200) < 0.7
    changed: list[int] = []
    for step in range(120):
        if step:
            # One that changed before turns back in every other step.
            turned = rng.choice(changed) if step % 2 == 0 else rng.integers(200)
            free[turned] = ~free[turned]
            changed.append(int(turned))
        gradient = M @ rng.random(200) - b
        moved = factor.newton_step(free, gradient)
        expected = np.zeros(200)
        expected[free] = -np.linalg.solve(M[np.ix_(free, free)], gradient[free])
        np.testing.assert_allclose(moved, expected, atol=1e-9 * np.abs(expected).max())  # precision
    assert 0 < sum(solved) < 100  # at every step a dozen differ from those of the factor


def test_lights_that_are_alike_and_lights_that_show_nothing() -> None:
    M, b = _problem(2)
    M[:, 7], b[7] = M[:, 3], b[3]
    M[7, :] = M[3, :]
    M[7, 7] = M[3, 3]
    M[9, :], M[:, 9], b[9] = 0, 0, 0
    factor = FreeFactor(M)
    for free in (np.arange(N) != 7, np.ones(N, bool), np.arange(N) != 3):
        step = factor.newton_step(free, -b)
        power = np.abs(M[free] @ step - b[free]).max() / np.abs(b).max()
        assert power < 1e-6  # the firmer ridge of a singular matrix
        assert step[9] == 0
        assert not (factor.knows_regular(free) and free[3] and free[7])


@pytest.mark.parametrize("upper", [np.inf, 0.2])
@pytest.mark.parametrize("seed", range(5))
def test_projected_steps_come_to_the_optimum_from_anywhere(seed: int, upper: float) -> None:
    M, b = _problem(seed)
    rng = np.random.default_rng(seed)
    q = scaled(M, b, 0.0, upper, ())
    for start in (np.zeros(N), np.minimum(rng.random(N) * 10, upper), np.full(N, 0.1)):
        x, _ = projected_newton(q, start, FreeFactor(q.M), tolerance=1e-12)
        assert kkt_residual(q.gradient(x), x, q.size, q.lower, q.upper) <= 1e-12


def test_projected_steps_never_raise_the_objective(monkeypatch: pytest.MonkeyPatch) -> None:
    M, b = _problem(3, n=40, pixels=41)  # ill-conditioned: whole steps overshoot
    q, seen = scaled(M, b, 0.0, 1.0, ()), []
    gradient = Quadratic.gradient

    def noting(q: Quadratic, x: Any) -> Any:
        seen.append(q.objective(x))
        return gradient(q, x)

    monkeypatch.setattr(Quadratic, "gradient", noting)
    projected_newton(q, np.ones(40), FreeFactor(q.M), tolerance=1e-12)
    assert len(seen) > 2
    # Round-off; an unknown that is held where it all but is may cost a little.
    assert (np.diff(seen) <= 1e-9 * abs(seen[-1])).all()


def test_problems_of_one_matrix_share_its_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optimum_module, "MANY_UNKNOWNS", 8)
    M, b = _problem(4)
    family, factored = QuadraticFamily(M), []
    made = FreeFactor._factored
    monkeypatch.setattr(
        FreeFactor, "_factored", lambda *x: (factored.append(len(x[1])), made(*x))[1]
    )
    first = family.minimise(b)
    after_first = len(factored)
    for k in range(4):
        right = b * (1 + 1e-3 * np.sin(np.arange(N) + k))
        answer, alone = family.minimise(right, first.x), minimise(M, right, start=first.x)
        assert answer.converged
        np.testing.assert_allclose(answer.x, alone.x, atol=1e-10)  # precision
    alone_count = len(factored) - after_first
    assert alone_count <= 4 * 3  # `minimise` factors each time, the family hardly ever


def test_a_right_side_that_does_not_fit_is_refused() -> None:
    M, b = _problem(5)
    with pytest.raises(ValueError, match="expected"):
        QuadraticFamily(M).minimise(b[:-1])
    with pytest.raises(ValueError, match="finite"):
        QuadraticFamily(M).minimise(np.full(N, np.nan))


def test_the_library_of_factors_runs_on_one_thread() -> None:
    FreeFactor(np.eye(2))  # which loads SciPy's, that has a BLAS of its own
    with one_thread():
        libraries = [x for x in ThreadpoolController().info() if x["user_api"] == "blas"]
        assert [x["num_threads"] for x in libraries] == [1] * len(libraries)
