"""Losses that are not one square per channel: "at least this bright", and what a display shows."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from least_squares import inner_products
from nightly import nightly, seeds
from scipy.optimize import minimize, nnls

from lightpaint.basis.light_basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.estimate import Estimate
from lightpaint.lighting import solver as solve_module
from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise, refine
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import lit_pixels, painting_loss, reweighting
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.lighting.loss.pixel_loss import image_of, planes_of
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solve_again
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.target.painted_target import Target

SIZE = (8, 9)
SRGB = ViewTransform("srgb")


def _target(image: Any, importance: Any = None, *, top: float | None = None) -> Target:
    """top: where the file ends: brighter paint is that, and stands for anything above."""
    image = np.asarray(image, np.float32)
    importance = np.ones(image.shape[:2]) if importance is None else importance
    at_least = None if top is None else image >= top
    image = image if top is None else np.minimum(image, np.float32(top))
    return Target("t", image, importance.astype(np.float32), everything=False, at_least=at_least)


def _random_problem(make_basis: Any, seed: int, *, n: int = 4) -> tuple[Basis, Any, Any]:
    """A basis with contrast, a picture that no mix of it is, and importances, some of them 0."""
    rng = np.random.default_rng(seed)
    basis = make_basis(images=rng.random((n, *SIZE, 3)) ** 3, emission=rng.random((n, 3)))
    image = rng.random((*SIZE, 3)) ** 2 * rng.choice([0.5, 1, 2])
    return basis, image, np.clip(rng.normal(0.5, 0.5, SIZE), 0, 1)


def _pictures(basis: Basis, w: Any) -> Any:
    return np.einsum("nhwc,nc->hwc", basis.images.astype(np.float64), w.reshape(-1, 3))


def _hinge_objective(basis: Basis, target: Target, unpainted: float) -> Any:
    """The objective by hand: squares, of which those of saturated paint only pull upwards."""
    a = target.importance[..., None].astype(np.float64)
    current = basis.mix(basis.current_weights)

    def value(w: Any) -> float:
        x = _pictures(basis, w)
        residual = target.image - x
        residual = np.where(target.at_least, np.maximum(residual, 0), residual)
        return float((a * residual**2 + unpainted * (1 - a) * (current - x) ** 2).sum())

    return value


def _displayed_objective(
    basis: Basis, target: Target, transform: ViewTransform, unpainted: float
) -> Any:
    a = target.importance[..., None].astype(np.float64)
    painted = transform.encode(target.image.astype(np.float64))
    current = transform.encode(basis.mix(basis.current_weights).astype(np.float64))

    def value(w: Any) -> float:
        x = transform.encode(_pictures(basis, w))
        return float((a * (painted - x) ** 2 + unpainted * (1 - a) * (current - x) ** 2).sum())

    return value


def _least_value(value: Any, starts: list[Any]) -> float:
    """The least that scipy's quasi-Newton method finds from these weights."""
    options = {"maxiter": 2000, "maxfun": 10**6, "ftol": 1e-16, "gtol": 1e-11}
    optima = [
        minimize(value, w.ravel(), method="L-BFGS-B", bounds=[(0, None)] * w.size, options=options)
        for w in starts
    ]
    return min(float(each.fun) for each in optima)


def _projected_gradient(value: Any, w: Any) -> Any:
    """By central differences; of a weight at zero, only what would have it rise."""
    gradient = np.empty(w.size)
    for k in range(w.size):
        step = np.zeros(w.size)
        step[k] = 1e-6
        gradient[k] = (value(w.ravel() + step) - value(w.ravel() - step)) / 2e-6
    return np.where(w.ravel() > 0, gradient, np.minimum(gradient, 0))


@pytest.mark.parametrize("unpainted", [0.0, 0.3])
@pytest.mark.parametrize("seed", seeds(3, 10))
def test_at_least_is_the_optimum_of_the_hinge(make_basis: Any, seed: int, unpainted: float):
    basis, image, importance = _random_problem(make_basis, seed)
    target = _target(image, importance, top=0.3)
    solution = solve(basis, target, unpainted=unpainted)
    w = solution.lighting.weights_for(basis)
    value = _hinge_objective(basis, target, unpainted)
    # It is convex, and the quasi-Newton method's finite differences are good to some 1e-8.
    best = _least_value(value, [np.ones_like(w), w])
    assert value(w) <= best * (1 + 1e-9)
    assert solution.certificate.converged
    # Certified as any linear solve is: the last problem is exact around its own optimum.
    assert max(solution.certificate.kkt_residual) <= 1e-12
    assert np.abs(_projected_gradient(value, w)).max() < 1e-5 * value(0 * w)
    # What is said of it is the hinge, without what the painting and the look cost each other.
    if not unpainted:
        assert sum(solution.certificate.objective) == pytest.approx(value(w), rel=1e-9)
        assert solution.norm2.sum() == pytest.approx(value(0 * w), rel=1e-9)
    assert sum(solution.certificate.objective) <= value(w) * (1 + 1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "transform", [None, SRGB, ViewTransform("agx", 1.0), ViewTransform("filmic", -1.0)]
)
@pytest.mark.parametrize("seed", seeds(2, 6))
def test_the_objective_never_rises(
    make_basis: Any, seed: int, transform: ViewTransform | None, monkeypatch: pytest.MonkeyPatch
):
    basis, image, importance = _random_problem(make_basis, seed)
    target = _target(image, importance, top=0.3 if transform is None else None)
    problem = solve(basis, target, transform=transform).problem
    plain = solve(basis, replace(target, at_least=None))
    values = [problem.objective(plain.weights).sum()]
    for rounds in range(1, 12):
        monkeypatch.setattr(reweighting, "MAX_ROUNDS", rounds)
        solution = solve(basis, target, transform=transform)
        values.append(sum(solution.certificate.objective))
        assert solution.certificate.converged or transform is not None or rounds < 6
    assert (np.diff(values) <= 1e-12 * values[0]).all()


def test_equations_of_few_changed_pixels_are_updated(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Schoeneman et al. 1993, Eq 7-9.
    basis, image, importance = _random_problem(make_basis, 5)
    problem = Problem.of(basis, _target(image / image.max(), importance, top=0.6))
    lit = LitPixels.of(basis, problem.loss)
    known = lit.summed(problem.squares, problem.equations)
    dim, bright = (lit.predicted(np.full((4, 3), level)) for level in (0.05, 2.0))
    counts = []
    for x in (dim, bright):
        squares = lit.pixels.squares(x, from_clipping=False)
        anew = lit.equations(*squares)
        monkeypatch.setattr(lit_pixels, "MAX_UPDATED_SHARE", 1)
        updated = lit.equations(*squares, known)
        for name in ("M", "b", "target_norm2"):
            np.testing.assert_allclose(getattr(updated, name), getattr(anew, name), rtol=1e-12)
        pairs = zip(squares, (known.image, known.weight), strict=True)
        counts.append(np.count_nonzero(np.any([a != b for a, b in pairs], axis=(0, 1))))
    # Nothing exceeds the paint in the dark; where it does, its pixels ask for nothing.
    assert counts[0] == 0 < counts[1] < len(lit.pixels)


@pytest.mark.parametrize("seed", [2, 9, 11])
def test_running_out_of_rounds_keeps_what_was_won(
    make_basis: Any, seed: int, monkeypatch: pytest.MonkeyPatch
):
    """Whole steps would be for the worse here, parts of them are not; labels stay as well."""
    basis, image, importance = _random_problem(make_basis, seed)
    target, transform = _target(image, importance), ViewTransform("srgb", 2.0)
    constraints = Constraints.of({"light 0": {"limits": {"max": 0.2}}, "light 1": {"lock": True}})
    problem = solve(basis, target, constraints=constraints)
    monkeypatch.setattr(reweighting, "MAX_ROUNDS", 1)
    solution = solve(basis, target, constraints=constraints, transform=transform)
    assert not solution.certificate.converged
    begin = solution.problem.objective(problem.lighting.weights_for(basis)).sum()
    assert sum(solution.certificate.objective) < (1 - 1e-4) * begin
    labels = [light.constraint for light in solution.lighting.lights]
    assert labels == [light.constraint for light in problem.lighting.lights]
    assert solution.lighting.emission["light 1"] == basis.lights[1].emission
    assert solution.lighting.lights[1].is_active


def test_saturated_paint_does_not_dim_the_lights(make_basis: Any):
    """An 8-bit painting that ends at white; the light that made it was twice as bright."""
    rng = np.random.default_rng(5)
    basis = make_basis(images=rng.random((3, 20, 20, 3)) ** 2)
    truth = np.array([[2.0, 1.5, 1.0], [0.5, 0.7, 1.6], [0.1, 0, 0.3]])
    codes = np.round(255 * SRGB.encode(combine(basis, Lighting.of_weights(basis, truth)).image))
    painted = SRGB.decode(codes / 255)
    target = Target("t", painted.astype(np.float32), np.ones((20, 20), np.float32), False)
    assert 0.1 < (codes == 255).mean() < 0.6
    linear = solve(basis, target).lighting.weights_for(basis)
    assert (linear.sum(axis=0) < 0.85 * truth.sum(axis=0)).all()
    # Half of the last code is light that is read as white too.
    weights = solve(basis, replace(target, at_least=codes == 255)).lighting.weights_for(basis)
    # Rounding to codes: uniform errors of up to half of one, over 400 pixels, of slope 1/2.3.
    half = 0.5 / 255 * 2.3
    np.testing.assert_allclose(weights, truth, atol=3 * half / np.sqrt(3 * 400) / 0.2)


@pytest.mark.parametrize("seed", [4, 5])
def test_white_paint_everywhere_ends(make_basis: Any, seed: int):
    """No light is too much for it, so each step to more promises a little, however long."""
    images = np.random.default_rng(seed).random((10, 12, 16, 3)) ** 8
    basis = make_basis(images=images, emission=np.ones((10, 3)))
    target = Target(
        "t", np.full((12, 16, 3), 30.0, np.float32), np.ones((12, 16), np.float32), True
    )
    solution = solve(basis, target, space="display", transform=SRGB, colors="gentle")
    assert solution.certificate.converged
    shown = SRGB.encode(combine(basis, solution.lighting).image)
    assert np.round(255 * shown).min() == 255


def test_only_a_lower_end_is_black(make_basis: Any):
    """All paint at the top: anything above will do, and the answer meets it."""
    basis = make_basis(3, SIZE)
    target = _target(np.full((*SIZE, 3), 5.0), top=0.4)
    solution = solve(basis, target)
    # Round-off of float64, squared.
    assert sum(solution.certificate.objective) < 1e-28
    assert (combine(basis, solution.lighting).image >= 0.4 * (1 - 1e-6)).all()
    assert solution.certificate.converged


VIEWS = [
    SRGB,
    ViewTransform("srgb", 2.0),
    ViewTransform("filmic"),
    ViewTransform("linear", 0.5),
    ViewTransform("agx", 1.0),
]


@pytest.mark.parametrize("transform", VIEWS, ids=lambda v: v.spoken)
@pytest.mark.parametrize("unpainted", [0.0, 0.3])
@pytest.mark.parametrize("seed", seeds(2, 4))
def test_a_display_fit_is_stationary_and_no_worse(
    make_basis: Any, seed: int, transform: ViewTransform, unpainted: float
):
    basis, image, importance = _random_problem(make_basis, seed)
    target = _target(image, importance)
    value = _displayed_objective(basis, target, transform, unpainted)
    linear = solve(basis, target, unpainted=unpainted).lighting.weights_for(basis)
    solution = solve(basis, target, unpainted=unpainted, transform=transform)
    w = solution.lighting.weights_for(basis)
    assert value(w) <= value(linear) * (1 + 1e-12)
    if not unpainted:
        assert sum(solution.certificate.objective) == pytest.approx(value(w), rel=1e-9)
    # The last linear problem is solved as any is.
    assert max(solution.certificate.kkt_residual) <= 1e-12
    # A round changes no light by more than 1e-6 beside the brightest.
    assert solution.certificate.converged
    assert np.abs(_projected_gradient(value, w)).max() < 1e-6 * value(0 * w)


@pytest.mark.nightly
def test_most_display_fits_are_the_best_there_are(make_basis: Any):
    """The loss is not convex. Random starts seldom find better, or much better."""
    worse = []
    for seed in range(12):
        basis, image, importance = _random_problem(make_basis, seed)
        target = _target(image, importance)
        value = _displayed_objective(basis, target, SRGB, 0.0)
        w = solve(basis, target, transform=SRGB).lighting.weights_for(basis)
        rng = np.random.default_rng(seed)
        best = _least_value(value, [3 * rng.random(w.shape) for _ in range(4)] + [w])
        worse.append(value(w) / best - 1)
    assert np.median(worse) < 1e-6
    assert np.max(worse) < 0.1


def test_what_is_clipped_comes_back(make_basis: Any):
    """From lights so bright that all is white, where no slope says which way to go."""
    rng = np.random.default_rng(0)
    basis = make_basis(images=0.2 + rng.random((2, *SIZE, 3)))
    truth = np.array([[0.2, 0.1, 0.3], [0.1, 0.2, 0.1]])
    problem = Problem.of(basis, _target(_pictures(basis, truth)), fit=Fit(transform=SRGB))

    def linear(equations: Any, begin: Any) -> Any:
        return solve_reduced(equations, problem.reduction, begin).weights

    solution = reweighting.descend(basis, problem.loss, np.full((2, 3), 50.0), linear)
    np.testing.assert_allclose(solution.weights, truth, rtol=1e-5)


@pytest.mark.parametrize("transform", [None, *VIEWS], ids=str)
def test_squares_have_the_gradient_of_the_loss(make_basis: Any, transform: ViewTransform | None):
    """At pictures where nothing clips, by differences of each pixel's own loss."""
    rng = np.random.default_rng(2)
    top = 0.5 / 2.0 ** (transform.stops if transform else 0)
    painted, current, x = rng.uniform(0.1, 1, (3, *SIZE, 3)) * top
    loss = PaintingLoss(
        painted, rng.random(SIZE), rng.random(SIZE), current, painted > 0.6 * top, transform
    )
    image, weight = (
        image_of(planes, SIZE) for planes in loss.pixels.squares(planes_of(x), from_clipping=False)
    )
    gradient = -2 * weight * (image - x)
    step = 1e-6 * top
    for y, k, c in [(0, 0, 0), (3, 4, 1), (7, 8, 2), (5, 1, 0), (2, 2, 1), (6, 3, 2)]:
        aside = np.zeros_like(x)
        aside[y, k, c] = step
        rise = loss.objective(x + aside).sum() - loss.objective(x - aside).sum()
        assert rise / (2 * step) == pytest.approx(gradient[y, k, c], rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("transform", VIEWS, ids=str)
def test_curved_squares_have_the_curvature_of_the_loss(transform: ViewTransform):
    """And the gradient of all squares. Where V mixes channels, they are those squares."""
    rng = np.random.default_rng(2)
    top = 0.5 / 2.0**transform.stops
    painted, current, x = rng.uniform(0.1, 1, (3, *SIZE, 3)) * top
    arrays = rng.random(SIZE), rng.random(SIZE), current, painted > 0.6 * top
    pixels = PaintingLoss(painted, *arrays, transform).pixels
    planes = planes_of(x)
    image, weight = pixels.squares(planes, from_clipping=False)
    curved_image, curved = pixels.curved_squares(planes, from_clipping=False)
    np.testing.assert_allclose(curved * (curved_image - planes), weight * (image - planes))
    if not transform.is_per_channel:
        np.testing.assert_array_equal(curved, weight)
        return
    step = 1e-4 * planes
    sides = [pixels.gradient(planes + sign * step)[0] * pixels.importance for sign in (1, -1)]
    second = (sides[1] - sides[0]) / (2 * step)
    least = painting_loss.LEAST_CURVATURE * weight
    # V″ is a difference over a thousandth of the light; where the goal moves along with x, its
    # loss has no curvature, and squares keep that of the slope.
    is_plain = pixels.exceeds(planes) == np.False_
    np.testing.assert_allclose(
        curved[is_plain], np.maximum(second, least)[is_plain], rtol=5e-3, atol=1e-3 * weight.max()
    )
    if transform.name != "linear":  # which V′² alone would miss
        assert np.median(np.abs(second / weight - 1)[is_plain]) > 0.1


def test_curved_rounds_lead_to_the_same_end_in_fewer_rounds(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
):
    """Of paintings far from any answer, whose squares are far from their loss."""

    def ends() -> tuple[list[Any], int]:
        answers, rounds = [], 0
        for seed in range(4):
            basis, image, importance = _random_problem(make_basis, seed)
            solution = solve(basis, _target(image, importance), transform=SRGB)
            assert solution.certificate.converged
            answers.append(solution.weights)
            rounds += solution.certificate.rounds
        return answers, rounds

    answers, rounds = ends()
    monkeypatch.setattr(painting_loss.PaintedPixels, "has_curvature", False)
    expected, plain_rounds = ends()
    for answer, plain in zip(answers, expected, strict=True):
        # Rounds end at changes of a millionth of the brightest light's picture, which in rounds of
        # plain squares may add up.
        np.testing.assert_allclose(answer, plain, atol=2e-5 * plain.max())
    assert rounds <= 0.6 * plain_rounds, (rounds, plain_rounds)


def test_importance_per_channel(make_basis: Any):
    basis, image, _ = _random_problem(make_basis, 3)
    weight = np.clip(np.random.default_rng(0).normal(0.3, 0.5, (*SIZE, 3)), 0, None)
    M, b, norm2 = inner_products(basis.images, image, weight)
    for c in range(3):
        rows = basis.images[..., c].reshape(4, -1).astype(np.float64)
        D, painted = weight[..., c].ravel(), image[..., c].ravel()
        np.testing.assert_allclose(M[c], (rows * D) @ rows.T, rtol=1e-12)
        np.testing.assert_allclose(b[c], (rows * D) @ painted, rtol=1e-12)
        np.testing.assert_allclose(norm2[c], (D * painted) @ painted, rtol=1e-12)


ASKED: list[dict[str, Any]] = [
    {"lights": {"light 0": {"lock": True}, "light 1": {"limits": {"max": 0.3}}}},
    {"lights": {"light 2": {"color": "3200K"}}, "tie": [["light 0", "light 1"]]},
    {"prefer_current": 0.1},
    {"sparse": 2},
]


@pytest.mark.parametrize("transform", [None, SRGB])
@pytest.mark.parametrize("words", ASKED, ids=lambda a: next(iter(a)))
def test_constraints_hold_and_nothing_near_is_better(
    make_basis: Any, words: dict[str, Any], transform: ViewTransform | None
):
    basis, image, importance = _random_problem(make_basis, 7)
    target = _target(image, importance, top=0.3)
    words = dict(words)
    constraints = Constraints.of(words.pop("lights", {}), **words)
    solution = solve(basis, target, constraints=constraints, transform=transform)
    assert solution.certificate.converged
    w = solution.lighting.weights_for(basis)
    plain = solve(basis, target, constraints=constraints).lighting.weights_for(basis)
    pull = constraints.prefer_current * np.square(basis.images, dtype=np.float64).sum((1, 2))

    def value(w: Any) -> float:
        objective = float(solution.problem.loss.objective(_pictures(basis, w)).sum())
        return objective + float((pull * np.square(w - basis.current_weights)).sum())

    assert value(w) <= value(plain) * (1 + 1e-9)
    if constraints.sparse:
        assert (w.any(axis=1)).sum() <= 2
        assert solution.certificate.curve
        assert dict(solution.certificate.curve)[2] == pytest.approx(
            np.sqrt(value(w) / solution.norm2.sum()), rel=0.05
        )
    # Any mix of two lightings that constraints allow is allowed, too.
    if not constraints.sparse:
        for seed in range(5):
            other = _random_problem(make_basis, seed + 20)[1]
            free = solve(basis, _target(other, importance), constraints=constraints)
            free_weights = free.lighting.weights_for(basis)
            assert value(w + 1e-3 * (free_weights - w)) >= value(w) * (1 - 1e-9)


@pytest.mark.parametrize("transform", [None, SRGB])
def test_views_together_are_one_picture(make_basis: Any, transform: ViewTransform | None):
    """Two views, of which one alone has saturated paint, against one view of both pictures."""
    basis, image, importance = _random_problem(make_basis, 1)
    current = [light.emission for light in basis.lights]
    first, second = (
        make_basis(images=basis.images[:, rows], emission=current)
        for rows in (slice(0, 5), slice(5, None))
    )
    at_least = image > 0.4
    at_least[5:] = False
    whole_target = replace(_target(image, importance), at_least=at_least)
    parts = [
        (first, replace(_target(image[:5], importance[:5]), at_least=at_least[:5])),
        (second, _target(image[5:], importance[5:])),
    ]
    expected = solve(basis, whole_target, unpainted=0.2, transform=transform)
    views = solve(*zip(*parts, strict=True), unpainted=0.2, transform=transform).views
    w = expected.lighting.weights_for(basis)
    # As exactly as rounds end.
    np.testing.assert_allclose(views[0].lighting.weights_for(first), w, atol=1e-5)
    together = sum(sum(s.certificate.objective) for s in views)
    assert together == pytest.approx(sum(expected.certificate.objective), rel=1e-9)
    M = views[0].equations.M + views[1].equations.M
    np.testing.assert_allclose(M, expected.equations.M, rtol=1e-4)


def _least_of_last_problem(solution: Solution, basis: Basis, solve_channel: Any) -> float:
    """The least of the last linear problem, by another solver, of dense rows."""
    total = 0.0
    for c in range(3):
        root = np.sqrt(
            solution.weight[..., c % solution.weight.shape[2]].ravel().astype(np.float64)
        )
        rows = basis.images[..., c].reshape(len(basis.images), -1).astype(np.float64)
        A, y = (rows * root).T, solution.image[..., c].ravel() * root
        total += float(np.square(A @ solve_channel(A, y) - y).sum())
    return total


def _solve_unbounded(A: Any, y: Any) -> Any:
    return np.linalg.lstsq(A, y, rcond=None)[0]


@pytest.mark.parametrize("transform", [None, SRGB, ViewTransform("agx", 1.0)], ids=str)
@pytest.mark.parametrize("seed", seeds(2, 4))
def test_what_each_of_several_views_misses_is_split_on_one_scale(
    make_basis: Any, seed: int, transform: ViewTransform | None
):
    """Each part from its own optimum, of the view's own squares: nnls, and lstsq for any sign."""
    bases, targets = [], []
    for k in range(2):
        basis, image, importance = _random_problem(make_basis, seed + 50 * k)
        bases.append(replace(basis, lights=bases[0].lights if bases else basis.lights))
        targets.append(_target(image, importance + 0.01, top=None if transform else 0.6))
    joint = solve(bases, targets, transform=transform)
    diagnoses, energies = [], []
    for b, view_solution in zip(bases, joint.views, strict=True):
        diagnosis = diagnose(view_solution)
        free, least_alone = (
            _least_of_last_problem(view_solution, b, f)
            for f in (_solve_unbounded, lambda A, y: nnls(A, y)[0])
        )
        energy = _least_of_last_problem(
            view_solution, b, partial(_replace_channels, joint, iter(range(3)))
        )
        # Pixels in float32, sums of 72 of them.
        approx = partial(pytest.approx, abs=1e-5 * energy)
        assert diagnosis.total == approx(energy)
        # Random pixels are what a painting has of noise.
        assert diagnosis.unreachable + diagnosis.painting_noise == approx(free)
        assert diagnosis.forbidden == approx(least_alone - free)
        assert diagnosis.compromise == approx(energy - least_alone)
        assert diagnosis.missed == pytest.approx(
            np.sqrt(sum(view_solution.certificate.objective) / view_solution.norm2.sum()), rel=1e-5
        )
        diagnoses.append(diagnosis)
        energies.append(energy)
    assert min(max(x.forbidden, x.compromise) for x in diagnoses) > 0.01 * min(energies)
    # What holds a light does so in all views, and its gain is beside what all of them miss.
    for diagnosis in diagnoses:
        assert diagnosis.lighting_total == pytest.approx(sum(energies), rel=1e-5)


def _replace_channels(joint: Solution, channels: Any, A: Any, y: Any) -> Any:
    c = next(channels)
    return np.array([light.weight[c] for light in joint.lighting.lights])


@pytest.mark.parametrize("transform", [SRGB, ViewTransform("agx", 1.0)], ids=str)
def test_gains_are_beside_what_the_same_squares_miss(make_basis: Any, transform: ViewTransform):
    basis, image, importance = _random_problem(make_basis, 2)
    target = _target(image, importance)
    solution = solve(basis, target, transform=transform)
    diagnosis = diagnose(solution)
    # As pixels have it in float32, and normal equations in float64.
    assert solution.energy == pytest.approx(diagnosis.total, rel=1e-5)
    assert diagnosis.lighting_total == pytest.approx(diagnosis.total, rel=1e-5)


def test_nothing_changes_where_nothing_is_saturated_that_counts(make_basis: Any):
    basis, image, importance = _random_problem(make_basis, 4)
    target = _target(image, importance)
    unsaturated = replace(target, at_least=np.repeat((importance == 0)[..., None], 3, axis=-1))
    assert unsaturated.at_least.any()
    a, b = solve(basis, target), solve(basis, unsaturated)
    assert b.problem.is_linear
    assert a.lighting == b.lighting


@pytest.mark.parametrize("transform", [nightly(None), SRGB])
def test_error_bars_hold_the_answer_without_noise(make_basis: Any, transform: ViewTransform | None):
    """95 % intervals over seeds, taken from the last linear problem; and less bias, corrected."""
    size, sigma = (24, 24), 0.15
    y, x = np.mgrid[: size[0], : size[1]] / size[0]
    places = np.random.default_rng(0).random((4, 2))
    clean = np.stack([np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.15) for a, b in places])
    clean = clean[..., None] * np.ones(3)
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0.1, 0.3], clean) * [1, 0.7, 0.3] + 0.1 * y[..., None]
    target = _target(image, top=0.8)
    quiet = make_basis(images=clean)
    truth = solve(quiet, target, transform=transform).lighting.weights_for(quiet)
    coverages, errors, corrected_off = [], [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        a, b = (
            clean * (1 + sigma * np.sqrt(2) * (rng.exponential(1, (*clean.shape[:-1], 1)) - 1))
            for _ in range(2)
        )
        basis = make_basis(images=(a + b) / 2, half_differences=(a - b) / 2)
        solution = solve(basis, target, transform=transform)
        low, high = error_bars(solution).interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
        errors.append(solution.lighting.weights_for(basis) - truth)
        corrected = correct_noise(solution)
        corrected_off.append(corrected.lighting.weights_for(basis) - truth)
    assert 0.8 <= np.mean(coverages) <= 1
    assert np.square(corrected_off).mean() < np.square(errors).mean()


@pytest.mark.parametrize("transform", [None, SRGB])
@pytest.mark.parametrize("seed", seeds(3, 12))
def test_lights_once_chosen_stay_chosen(
    make_basis: Any, seed: int, transform: ViewTransform | None
):
    """With `sparse` the choice is taken as given by all that improves an answer.

    The squares of the last linear problem hold near the answer only: other lights would be
    chosen on them, which the loss does not want.
    """
    rng = np.random.default_rng(seed)
    images = rng.random((6, *SIZE, 3)) ** 3
    halves = 1e-4 * rng.normal(size=images.shape)
    basis = make_basis(images=images, half_differences=halves, emission=rng.random((6, 3)))
    image = rng.random((*SIZE, 3)) ** 2 * rng.choice([0.5, 1, 2])
    target = _target(image, top=None if transform else 0.3)
    constraints = Constraints.of({}, sparse=2)
    solution = solve(basis, target, constraints=constraints, transform=transform)
    w = solution.lighting.weights_for(basis)
    mix = combine(basis, solution.lighting)
    refined = refine(solution, Estimate(mix.image, 0.5 * mix.half_difference))
    for solution_again in (
        solve_again(solution, solution.problem),
        correct_noise(solution),
        refined,
    ):
        v = solution_again.lighting.weights_for(basis)
        assert v.any(axis=1).tolist() == w.any(axis=1).tolist()
        # Noise of 1e-4 moves nothing further, squares that end where the loss does neither.
        np.testing.assert_allclose(v, w, atol=2e-3)
        assert sum(solution_again.certificate.objective) == pytest.approx(
            sum(solution.certificate.objective), rel=1e-4
        )
        assert [count for count, _ in solution_again.tried] == [1, 2, 3, 4]
        assert solution_again.certificate.curve == solution.certificate.curve
        assert [x.constraint for x in solution_again.lighting.lights] == [
            x.constraint for x in solution.lighting.lights
        ]


def _some_lights(make_basis: Any) -> tuple[Basis, Target]:
    """A look of twelve lights, and a painting over it that makes half of it warm and bright."""
    basis, _, _ = _random_problem(make_basis, 5, n=12)
    image = basis.current_look.copy()
    image[:, :4] *= [2.5, 1.6, 0.4]
    image[:, 4:] *= [0.3, 0.4, 0.6]
    return basis, Target(
        "t", image, np.ones(SIZE, np.float32), False, through_view=True, over_look=True
    )


@pytest.mark.parametrize("colors", ["free", "gentle", "white"])
def test_rounds_of_many_lights_keep_matrices_and_come_to_the_same_answer(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, colors: Any
) -> None:
    basis, target = _some_lights(make_basis)
    expected = solve(basis, target, colors=colors)
    sums: list[int] = []
    equations = LitPixels.equations
    monkeypatch.setattr(LitPixels, "equations", lambda *x: (sums.append(1), equations(*x))[1])
    solve(basis, target, colors=colors)
    of_all = len(sums)
    for module in (reweighting, solve_module):
        monkeypatch.setattr(module, "MANY_LIGHTS", 12)
    solution = solve(basis, target, colors=colors)
    assert len(sums) - of_all < of_all
    assert solution.certificate.converged
    missed, least = (sum(x.certificate.objective) for x in (solution, expected))
    assert missed == pytest.approx(least, rel=1e-6)  # the step at which rounds end
    np.testing.assert_allclose(solution.weights, expected.weights, atol=2e-4)
