"""A loss is an interface: one that the package does not know is solved, analysed and reported."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import pixel_loss as loss_module
from lightpaint.lighting.loss.lit_pixels import DeferredSquares, LitPixels
from lightpaint.lighting.loss.pixel_loss import Cut, Loss, PixelLoss, planes_of
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.target.painted_target import Target

SIZE = 12, 17


@dataclass(frozen=True)
class RobustPixels(PixelLoss):
    """Σ 2 D c² (√(1 + (Ψ − x)²/c²) − 1): squares of what is missed up to c, its size beyond."""

    painted: Doubles
    importance: Doubles
    scale: float

    def subset(self, indices: Any) -> "RobustPixels":
        return RobustPixels(self.painted[:, indices], self.importance[indices], self.scale)

    def scaled(self, factors: Doubles) -> "RobustPixels":
        return replace(self, importance=self.importance * factors)

    def _root(self, x: Doubles) -> Doubles:
        return np.sqrt(1 + np.square((self.painted - x) / self.scale))

    def objective(self, x: Doubles) -> Doubles:
        return np.asarray(2 * self.scale**2 * (self._root(x) - 1) @ self.importance)

    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        return self.painted, self.importance / self._root(x)


@dataclass(frozen=True)
class RobustLoss(Loss):
    """The same of a picture: a painting in which a few pixels are slips."""

    painted: Floats
    importance: Floats
    scale: float

    transform = None

    @cached_property
    def pixels(self) -> RobustPixels:
        flat = np.asarray(self.importance, np.float64).ravel()
        return RobustPixels(planes_of(self.painted), flat, self.scale)

    def cut(self, part: Cut) -> "RobustLoss":
        return replace(self, painted=part(self.painted), importance=part(self.importance))


def _problem(make_basis: Any, seed: int, *, views: int = 1, slips: float = 0.1) -> Problem:
    rng = np.random.default_rng(seed)
    lights = rng.random((3, 3))
    bases, targets = [], []
    for _ in range(views):
        basis = make_basis(images=rng.random((3, *SIZE, 3)) ** 3, emission=rng.random((3, 3)))
        image = basis.mix(2 * lights).astype(np.float32)
        image[rng.random(SIZE) < slips] *= 5
        bases.append(replace(basis, lights=bases[0].lights) if bases else basis)
        importance = rng.random(SIZE).astype(np.float32)
        targets.append(Target("t", image, importance, everything=False))
    problem = Problem.of(bases, targets, fit=Fit(space="linear", colors="free", hold=0.0))
    problem_views = problem.views
    loss = RobustLoss(
        problem_views.join([target.image for target in problem_views.targets]),
        problem_views.join([target.importance for target in problem_views.targets]),
        scale=0.05,
    )
    return replace(problem, loss=loss)


@pytest.mark.parametrize("views", [1, 2])
def test_a_third_loss_is_brought_to_its_least(make_basis: Any, views: int) -> None:
    problem = _problem(make_basis, 1, views=views)
    solution = solution_of(problem)
    rows = problem.basis.images.reshape(3, -1, 3).astype(np.float64)

    def cost(flat: Doubles) -> tuple[float, Doubles]:
        x = np.einsum("npc,nc->cp", rows, flat.reshape(3, 3))
        value, half = problem.loss.pixels.objective_and_gradient(x)
        return value, 2 * np.einsum("npc,cp->nc", rows, half).ravel()

    start = np.ones(9)
    optimum = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=[(0, None)] * 9, tol=1e-14)
    # Rounds end at a change of 1e-6.
    np.testing.assert_allclose(solution.weights.ravel(), optimum.x, atol=1e-4)
    assert solution.certificate.converged
    # Slips do not count as they do where squares are the loss.
    plain = solution_of(replace(problem, loss=problem.squares))
    assert cost(solution.weights.ravel())[0] < 0.9 * cost(plain.weights.ravel())[0]


def test_a_third_loss_heeds_what_is_asked_of_lights(make_basis: Any) -> None:
    problem = _problem(make_basis, 1)
    free = solution_of(problem)
    locked = Constraints.of(light={"light 1": {"lock": True}})
    [basis], [target] = problem.views.bases, problem.views.targets
    constrained_problem = Problem.of(basis, target, constraints=locked, fit=problem.fit)
    solution = solution_of(replace(constrained_problem, loss=problem.loss))
    np.testing.assert_allclose(solution.weights[1], basis.current_weights[1])
    assert problem.objective(solution.weights).sum() > problem.objective(free.weights).sum()


def test_a_third_loss_is_analysed(make_basis: Any) -> None:
    solution = solution_of(_problem(make_basis, 2, views=2))
    for analysis in analyse(solution):
        assert np.isfinite(analysis.diagnosis.missed)
        assert np.isfinite(analysis.uncertainty.weights).all()


@given(st.integers(0, 1000))
def test_squares_are_a_loss_as_any_other(make_basis: Any, seed: int) -> None:
    """Without the short cut for what is a linear problem, the answer is the same."""
    problem = _problem(make_basis, seed)
    squares = problem.squares
    direct = solution_of(replace(problem, loss=squares))
    np.testing.assert_allclose(
        squares.pixels.objective(planes_of(problem.basis.mix(direct.weights))),
        squares.objective(problem.basis.mix(direct.weights)),
        rtol=1e-12,
    )
    generic = solution_of(replace(problem, loss=_Unknown(squares)))
    np.testing.assert_allclose(generic.weights, direct.weights, atol=1e-9)


class _Unknown(Loss):
    """Squares that do not say what they are."""

    transform = None

    def __init__(self, squares: Any) -> None:
        self.pixels, self.importance = squares.pixels, squares.importance

    def cut(self, part: Cut) -> "_Unknown":
        raise NotImplementedError


@pytest.mark.parametrize("name", [None, "srgb", "agx"])
@pytest.mark.parametrize("is_kept", [False, True])
def test_squares_that_are_made_on_request(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, name: str | None, is_kept: bool
) -> None:
    """The arrays and sums of all pixels at once are the plain twin."""
    size, rng = (96, 128), np.random.default_rng(5)  # more than a strip
    basis = make_basis(images=rng.random((4, *size, 3), np.float32))
    if not is_kept:
        monkeypatch.setattr(loss_module, "MAX_KEPT_PIXELS", size[0])
    target = Target.of(basis.current_look * np.float32(0.7), rng.random(size).round())
    top = np.broadcast_to((rng.random(size) < 0.2)[..., None], (*size, 3))
    target = replace(target, at_least=top)
    transform = None if name is None else ViewTransform(name)
    problem = Problem.of(basis, target, fit=Fit(transform=transform, unpainted=0.3, colors="free"))
    assert not problem.is_linear
    weights, lit_pixels = rng.random((4, 3)), LitPixels.whole(basis, problem.loss)
    x = lit_pixels.predicted(weights)
    image, weight = lit_pixels.pixels.squares(x, from_clipping=False)
    expected = [
        *(part.T.reshape(*size, 3) for part in (image, weight, lit_pixels.pixels.shares(x, weight)))
    ]
    squares = DeferredSquares(lit_pixels, weights)
    for _ in range(2):
        for cut_array, part in zip(
            (squares.image, squares.weight, squares.share), expected, strict=True
        ):
            np.testing.assert_array_equal(cut_array, part)
        assert squares.image is squares.image
        squares.release()
        assert "_arrays" not in vars(squares)
    sums, plain = (
        lit_pixels.equations_at(weights),
        NormalEquations.of(basis, expected[0], expected[1]),
    )
    for field in ("M", "b", "target_norm2"):
        np.testing.assert_allclose(getattr(sums, field), getattr(plain, field), rtol=1e-12)
    np.testing.assert_allclose(
        lit_pixels.objective(weights), lit_pixels.pixels.objective(x), rtol=1e-12
    )
    black = problem.loss.objective(np.zeros((*size, 3)))
    np.testing.assert_allclose(problem.loss.norm2, black, rtol=1e-12)
