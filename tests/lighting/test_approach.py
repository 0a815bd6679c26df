"""Near the optimum by few pixels, exact on all of them: as rounds over all pixels would end."""

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from scipy.optimize import minimize

from lightpaint.basis.light_basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import lit_pixels, pixel_loss, reweighting
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.reweighting import sample_pixels
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.target.painted_target import Target

SIZE = (48, 60)
VIEWS = [ViewTransform("srgb"), ViewTransform("agx", 1.0), ViewTransform("filmic", -1.0)]


@pytest.fixture
def few_samples(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Samples of 400 pixels, and strips of 500."""
    monkeypatch.setattr(reweighting, "MIN_SAMPLE", 400)
    monkeypatch.setattr(reweighting, "PIXELS_PER_LIGHT", 1)
    monkeypatch.setattr(pixel_loss, "STRIP_PIXELS", 500)
    return monkeypatch


def _random_problem(make_basis: Any, seed: int, *, n: int = 4) -> tuple[Basis, Target]:
    """Pools of light with noise in them, and a picture that no mix of them is."""
    rng = np.random.default_rng(seed)
    y, x = (axis / SIZE[0] for axis in np.mgrid[: SIZE[0], : SIZE[1]])
    places = rng.random((n, 2))
    pools = np.stack([np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.08) for a, b in places])
    images = pools[..., None] * (0.3 + 0.7 * rng.random((n, *SIZE, 3)))
    basis = make_basis(images=images, emission=rng.random((n, 3)))
    image = basis.mix(rng.random((n, 3))) * np.exp2(rng.normal(0, 0.6, (*SIZE, 3)))
    importance = np.clip(rng.normal(0.6, 0.4, SIZE), 0, 1).astype(np.float32)
    return basis, Target("t", image.astype(np.float32), importance, everything=False)


def _solve_by_rounds(few: pytest.MonkeyPatch, *args: Any, **options: Any) -> Solution:
    """By rounds over all pixels alone."""
    with few.context() as patch:
        patch.setattr(reweighting, "MIN_SAMPLE", 10**9)
        return solve(*args, **options)


def _value(solution: Solution, w: Any) -> float:
    """The loss of weights and what pulls at them."""
    pull = solution.problem.pull
    pull_value = 0.0 if pull is None else float(pull.objective(w).sum())
    return float(solution.problem.objective(w).sum()) + pull_value


@pytest.mark.parametrize(
    ("seed", "hold", "transform"),
    [
        (0, 0.0, VIEWS[0]),
        nightly(1, 0.3, VIEWS[0]),
        (0, 0.3, VIEWS[1]),
        nightly(1, 0.0, VIEWS[2]),
    ],
)
def test_the_optimum_is_that_of_all_pixels(
    make_basis: Any, few_samples: Any, seed: int, hold: float, transform: ViewTransform
):
    """By another's descent over all of them, from the answer and from all lights at 1."""
    basis, target = _random_problem(make_basis, seed)
    solution = solve(basis, target, transform=transform, hold=hold)
    w = solution.weights
    # Bounds by a scale of 1, and derivatives by differences.
    options = {"maxiter": 500, "maxfun": 10**5, "ftol": 1e-15, "gtol": 1e-10}
    best = min(
        float(
            minimize(
                lambda v: _value(solution, v.reshape(w.shape)),
                begin.ravel(),
                method="L-BFGS-B",
                bounds=[(0, None)] * w.size,
                options=options,
            ).fun
        )
        for begin in (w, np.ones_like(w))
    )
    assert _value(solution, w) <= best * (1 + 1e-8)
    assert solution.certificate.converged
    assert max(solution.certificate.kkt_residual) <= 1e-12


@pytest.mark.nightly
@pytest.mark.parametrize("transform", VIEWS, ids=lambda v: v.spoken)
@pytest.mark.parametrize(
    "constraint_words",
    [
        {},
        {"lights": {"light 0": {"lock": True}, "light 1": {"limits": {"max": 0.3}}}},
        {"lights": {"light 2": {"color": "3200K"}, "light 3": {"kelvin": [2200, 9000]}}},
        {"lights": {}, "tie": [["light 0", "light 1"]], "prefer_current": 0.1},
        {"sparse": 2},
    ],
    ids=lambda a: "+".join(a) or "free",
)
def test_it_ends_where_rounds_over_all_pixels_do(
    make_basis: Any, few_samples: Any, constraint_words: dict[str, Any], transform: ViewTransform
):
    basis, target = _random_problem(make_basis, 3)
    target = replace(target, at_least=target.image > 0.8)
    constraint_words = dict(constraint_words)
    constraints = Constraints.of(constraint_words.pop("lights", {}), **constraint_words)
    options: dict[str, Any] = {"transform": transform, "constraints": constraints, "hold": 0.3}
    expected = _solve_by_rounds(few_samples, basis, target, **options)
    solution = solve(basis, target, **options)
    assert solution.certificate.rounds < expected.certificate.rounds
    value = _value(solution, expected.weights)
    assert _value(solution, solution.weights) <= value * (1 + 1e-9)
    # Both are within what a round may change and be the last.
    np.testing.assert_allclose(solution.weights, expected.weights, atol=2e-4)
    np.testing.assert_allclose(solution.equations.M, expected.equations.M, rtol=2e-2)


def test_several_views_are_one(make_basis: Any, few_samples: Any):
    parts = [_random_problem(make_basis, seed) for seed in (4, 5)]
    bases = [replace(basis, lights=parts[0][0].lights) for basis, _ in parts]
    targets = [target for _, target in parts]
    options = {"transform": VIEWS[0], "hold": 0.3}
    expected, solution = (
        _solve_by_rounds(few_samples, bases, targets, **options),
        solve(bases, targets, **options),
    )
    assert solution.certificate.rounds < expected.certificate.rounds
    np.testing.assert_allclose(solution.weights, expected.weights, atol=2e-5)


@pytest.mark.parametrize("transform", VIEWS, ids=lambda v: v.spoken)
def test_answers_have_the_same_bits_on_any_number_of_processors(
    make_basis: Any, few_samples: Any, transform: ViewTransform
):
    basis, target = _random_problem(make_basis, 6)
    solutions = []
    for count in (1, 2, 7):
        few_samples.setattr(os, "cpu_count", lambda count=count: count)
        solutions.append(solve(basis, target, transform=transform, hold=0.3).weights)
    np.testing.assert_array_equal(solutions[0], solutions[1])
    np.testing.assert_array_equal(solutions[0], solutions[2])


def _lit_problem(
    basis: Basis, target: Target, transform: ViewTransform
) -> tuple[Problem, LitPixels]:
    problem = Problem.of(basis, target, fit=Fit(transform=transform, hold=0.3))
    return problem, LitPixels.of(basis, problem.loss)  # type: ignore[arg-type]


@pytest.mark.parametrize("transform", VIEWS, ids=lambda v: v.spoken)
def test_the_gradient_is_that_of_the_objective(make_basis: Any, few_samples: Any, transform: Any):
    basis, target = _random_problem(make_basis, 7)
    problem, pixels_of_problem = _lit_problem(
        basis, replace(target, at_least=target.image > 0.5), transform
    )
    w = 0.5 + np.random.default_rng(0).random((4, 3))
    value, gradient = pixels_of_problem.objective_and_gradient(w)
    assert value == pytest.approx(problem.objective(w).sum(), rel=1e-12)
    for k, c in ((0, 0), (1, 2), (3, 1)):
        step = np.zeros_like(w)
        step[k, c] = 1e-6
        rise = problem.objective(w + step).sum() - problem.objective(w - step).sum()
        # Of 3000 pixels one may cross an edge of its curve within the step.
        assert rise / 2e-6 == pytest.approx(2 * gradient[k, c], rel=1e-3, abs=1e-3)


def test_a_sample_stands_for_all_and_has_every_light(make_basis: Any, few_samples: Any):
    """Also a light that reaches five pixels of nearly three thousand."""
    rng = np.random.default_rng(0)
    images = rng.random((4, *SIZE, 3)) ** 3
    images[3] = 0
    images[3, 10, 20:25] = 1e-3
    basis = make_basis(images=images)
    target = Target("t", rng.random((*SIZE, 3)).astype(np.float32), np.ones(SIZE, np.float32), True)
    problem, pixels_of_problem = _lit_problem(basis, target, VIEWS[0])
    part = sample_pixels(pixels_of_problem, np.einsum("cii->ic", problem.equations.M), 400)
    assert 350 <= len(part.pixels) <= 450
    assert (part.planes.pixels(slice(None))[3] > 0).any(axis=-1).sum() == 5
    # One drawn of each 400th part: the mean of all, to some 1/400 and the scatter of weights.
    assert part.pixels.importance.sum() == pytest.approx(
        pixels_of_problem.pixels.importance.sum(), rel=0.05
    )

    # Products of two pictures of random numbers: 400 of them tell their mean to some 6 %.
    def products(pixels: LitPixels) -> Any:
        D = np.broadcast_to(pixels.pixels.importance, (3, len(pixels.pixels)))
        return pixels.equations(np.zeros_like(D), D).M

    np.testing.assert_allclose(
        products(part)[:, :3, :3], products(pixels_of_problem)[:, :3, :3], rtol=0.25
    )
    np.testing.assert_allclose(
        products(part)[:, 3, 3], products(pixels_of_problem)[:, 3, 3], rtol=1e-6
    )


def test_few_pixels_need_no_sample(make_basis: Any, few_samples: Any):
    basis, target = _random_problem(make_basis, 8)
    is_counted = np.zeros(SIZE, np.float32)
    is_counted[:10] = 1
    calls: list[int] = []
    few_samples.setattr(reweighting, "sample_pixels", lambda *args: calls.append(1))
    solution = solve(basis, replace(target, importance=is_counted), transform=VIEWS[0])
    assert not calls
    assert solution.certificate.converged


def test_pixels_that_do_not_count_are_not_looked_at(make_basis: Any, monkeypatch: Any):
    """What they hold changes nothing, and in the rounds nothing is asked of them."""
    basis, target = _random_problem(make_basis, 9)
    some = target.importance * (np.random.default_rng(1).random(SIZE) < 0.3)
    target = replace(target, importance=some.astype(np.float32))
    solution = solve(basis, target, transform=VIEWS[1], hold=0.0, colors="free")
    other = target.image.copy()
    other[some == 0] = 1e9
    changed_solution = solve(
        basis, replace(target, image=other), transform=VIEWS[1], hold=0.0, colors="free"
    )
    np.testing.assert_array_equal(changed_solution.weights, solution.weights)
    monkeypatch.setattr(lit_pixels, "MIN_SKIPPED_SHARE", 1.0)
    full_solution = solve(basis, target, transform=VIEWS[1], hold=0.0, colors="free")
    np.testing.assert_allclose(full_solution.weights, solution.weights, rtol=1e-6, atol=1e-9)
