"""From basis and target to lighting: what is minimised, and known lightings coming back."""

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from lightpaint.errors import (
    ConstraintError,
    LightingError,
    LightpaintError,
    SizeError,
    TargetError,
)
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.loss.painting import target_squares
from lightpaint.target.painted_target import Target

SIZE = (12, 10)


def _target(image: Any, importance: Any = None) -> Target:
    is_everywhere = importance is None
    importance = np.ones(image.shape[:2]) if importance is None else importance
    return Target(
        "painted", image.astype(np.float32), importance.astype(np.float32), everything=is_everywhere
    )


def _random_target(seed: int = 1) -> Target:
    rng = np.random.default_rng(seed)
    # Importances of 0, between 0 and 1, 1 and more than 1.
    importance = np.clip(rng.normal(0.5, 0.8, SIZE), 0, None)
    return _target(rng.random((*SIZE, 3)), importance)


def _emitter_mask() -> Any:
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[:3, :4] = True
    return emitter_mask


def _weighted_target(basis: Any, target: Target, *, unpainted: float = 0.0) -> tuple[Any, Any]:
    """The image and importance that are solved for."""
    squares = target_squares(basis, target, unpainted=unpainted)
    return squares.image, squares.weight[..., 0]


def _squares(importance: Any, image: Any, basis: Any, w: Any) -> Any:
    residual = image - np.einsum("nhwc,nc->hwc", basis.images.astype(np.float64), w)
    return (importance[..., None] * residual**2).sum(axis=(0, 1))


@pytest.mark.parametrize("unpainted", [0.0, 0.01, 1.0, 30.0])
def test_one_residual_stands_for_two(make_basis: Any, unpainted: float):
    """Σ a‖Ψ−x‖² + unpainted (1−a)‖current−x‖² and the weighted residual differ by a constant."""
    basis = make_basis(4, SIZE, seen=_emitter_mask())
    target = _random_target()
    image, importance = _weighted_target(basis, target, unpainted=unpainted)
    current = basis.mix(basis.current_weights)
    a = target.importance.astype(np.float64)
    rest = unpainted * np.where(basis.emitters_seen, 0, np.maximum(1 - a, 0))

    rng = np.random.default_rng(0)
    constants = []
    for _ in range(3):
        w = rng.random((4, 3)) * 3
        two = _squares(a, target.image, basis, w) + _squares(rest, current, basis, w)
        constants.append(two - _squares(importance, image, basis, w))
    # float64 sums of some hundred terms of order 1 to 100 in magnitude.
    np.testing.assert_allclose(constants[1:], [constants[0]] * 2, rtol=0, atol=1e-9)


def test_seen_emitters_do_not_count_if_nobody_said_what_does(make_basis: Any):
    basis = make_basis(3, SIZE, seen=_emitter_mask())
    target = _target(np.ones((*SIZE, 3)))
    for unpainted in (0.0, 2.0):
        _, importance = _weighted_target(basis, target, unpainted=unpainted)
        np.testing.assert_array_equal(importance, np.where(_emitter_mask(), 0, 1))


def test_seen_emitters_count_where_somebody_painted_them(make_basis: Any):
    basis = make_basis(3, SIZE, seen=_emitter_mask())
    painted = np.zeros(SIZE)
    painted[0, 0] = painted[8, 8] = 0.5
    _, importance = _weighted_target(basis, _target(np.ones((*SIZE, 3)), painted))
    np.testing.assert_array_equal(importance, painted)
    # What is not painted pulls towards the current look, but not where an emitter is seen.
    _, importance = _weighted_target(basis, _target(np.ones((*SIZE, 3)), painted), unpainted=4)
    np.testing.assert_array_equal(
        importance, painted + np.where(_emitter_mask(), 0, 4 * (1 - painted))
    )


def test_nothing_but_emitters(make_basis: Any):
    basis = make_basis(3, SIZE, seen=np.ones(SIZE, bool))
    with pytest.raises(TargetError, match="emitter in every painted pixel"):
        solve(basis, _target(np.ones((*SIZE, 3))))


@pytest.mark.parametrize("unpainted", [-1.0, -1e-9, float("nan"), float("inf")])
def test_weights_of_the_unpainted_that_make_no_sense(make_basis: Any, unpainted: float):
    with pytest.raises(LightpaintError, match=r"unpainted is .*: expected a weight >= 0"):
        solve(make_basis(3, SIZE), _random_target(), unpainted=unpainted)


def test_a_painting_of_another_size(make_basis: Any):
    with pytest.raises(SizeError, match="10x12 but the basis is 10x13"):
        solve(make_basis(3, (13, 10)), _random_target())


@pytest.mark.parametrize("n", [1, 4, 12])
def test_a_known_lighting_comes_back(make_basis: Any, n: int):
    basis = make_basis(n, (20, 18), seed=n)
    rng = np.random.default_rng(n)
    truth = rng.random((n, 3)) * (rng.random((n, 3)) < 0.7)
    image = combine(basis, Lighting.of_weights(basis, truth)).image
    solution = solve(basis, _target(image))
    # The picture is float32: its round-off, 6e-8, times the condition of the basis.
    np.testing.assert_allclose(solution.lighting.weights_for(basis), truth, atol=1e-6)
    assert solution.certificate.converged
    assert max(solution.certificate.relative_objective) < 1e-12
    np.testing.assert_allclose(combine(basis, solution.lighting).image, image, atol=1e-5)


def test_a_known_lighting_comes_back_from_a_painted_part(make_basis: Any):
    basis = make_basis(4, SIZE)
    image = combine(basis, Lighting.of_weights(basis, np.full((4, 3), 0.5))).image
    painted = np.zeros(SIZE)
    painted[2:6, 3:8] = 0.25
    image[painted == 0] = 1e6
    solution = solve(basis, _target(image, painted))
    np.testing.assert_allclose(solution.lighting.weights_for(basis), 0.5, atol=1e-6)


def test_the_unpainted_keeps_the_current_look(make_basis: Any):
    """The more it weighs, the closer the answer comes to the current lighting."""
    basis = make_basis(4, SIZE)
    painted = np.zeros(SIZE)
    painted[:6] = 1
    target = _target(np.random.default_rng(5).random((*SIZE, 3)), painted)
    distances = []
    for unpainted in (0.0, 0.1, 1.0, 10.0, 1e6):
        w = solve(basis, target, unpainted=unpainted).lighting.weights_for(basis)
        distances.append(np.abs(w - basis.current_weights).max())
    assert distances == sorted(distances, reverse=True)
    # What is left of the painted part's pull, a share of about 1e-6.
    assert distances[-1] < 1e-5 < distances[0]


@pytest.mark.parametrize("start", [0.0, 0.3, 100.0])
def test_the_start_does_not_change_the_answer(make_basis: Any, start: float):
    basis, target = make_basis(5, SIZE), _random_target()
    plain = solve(basis, target).lighting.weights_for(basis)
    begin = Lighting.of_weights(basis, np.full((5, 3), start))
    other = solve(basis, target, start=begin).lighting.weights_for(basis)
    # A KKT residual of 1e-10 times the condition of the basis.
    np.testing.assert_allclose(other, plain, atol=1e-8)


@pytest.mark.parametrize(
    "constraints", [None, Constraints.of({"light 0": {"limits": {"max": 9.0}}})]
)
def test_what_reaches_nothing_keeps_the_start(make_basis: Any, constraints: Constraints | None):
    images = np.random.default_rng(0).random((3, *SIZE, 3))
    images[2] = 0
    basis = make_basis(images=images)
    for begin in (None, Lighting.of_weights(basis, np.full((3, 3), 7.0))):
        solution = solve(basis, _random_target(), start=begin, constraints=constraints)
        expected = basis.lights[2].emission if begin is None else (7.0, 7.0, 7.0)
        assert solution.lighting.emission["light 2"] == pytest.approx(expected)
        assert solution.certificate.unreached == ("light 2",)


def test_a_start_for_other_lights(make_basis: Any):
    other = Lighting.current(make_basis(3, SIZE, names=["a", "b", "c"]))
    with pytest.raises(LightingError, match="missing light 0"):
        solve(make_basis(3, SIZE), _random_target(), start=other)


def test_a_light_that_reaches_nothing_painted_is_named_and_kept(make_basis: Any):
    images = np.random.default_rng(0).random((3, *SIZE, 3))
    images[1, :6] = 0
    basis = make_basis(images=images, names=["key", "back", "fill"])
    painted = np.zeros(SIZE)
    painted[:6] = 1
    solution = solve(basis, _target(np.full((*SIZE, 3), 0.7), painted))
    assert solution.certificate.unreached == ("back",)
    assert solution.lighting.emission["back"] == basis.lights[1].emission
    assert solution.certificate.converged


def test_a_black_painting_turns_the_lights_off(make_basis: Any):
    solution = solve(make_basis(4, SIZE), _target(np.zeros((*SIZE, 3))))
    assert all(rgb == (0, 0, 0) for rgb in solution.lighting.emission.values())
    assert solution.certificate.objective == solution.certificate.relative_objective == (0, 0, 0)


def test_quality_tells_the_objective_of_the_answer(make_basis: Any):
    basis, target = make_basis(4, SIZE), _random_target()
    solution = solve(basis, target)
    w = solution.lighting.weights_for(basis)
    expected = _squares(target.importance, target.image, basis, w)
    norm2 = (target.importance[..., None] * np.square(target.image, dtype=float)).sum(axis=(0, 1))
    # float64 sums over some hundred pixels.
    np.testing.assert_allclose(solution.certificate.objective, expected, rtol=1e-10)
    np.testing.assert_allclose(solution.certificate.relative_objective, expected / norm2, rtol=1e-6)
    assert solution.lighting.target == "painted"
    assert solution.lighting.scene_identity == basis.origin.scene_identity


def test_mixing_copies_no_basis(make_basis: Any):
    """Neither a prediction nor the current look needs a basis twice in memory."""
    basis = make_basis(24, (60, 80))
    rng = np.random.default_rng(3)
    target = _target(rng.random((60, 80, 3)), rng.random((60, 80)))
    one = basis.images[0].nbytes
    expected = np.einsum("nhwc,nc->hwc", basis.images.astype(np.float64), basis.current_weights)
    tracemalloc.start()
    try:
        mixed = basis.mix(basis.current_weights)
        _, mixing = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        target_squares(basis, target, unpainted=1.0)
        _, weighting = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert mixed.dtype == np.float32
    # 24 products of numbers up to 1, summed in float32.
    np.testing.assert_allclose(mixed, expected, rtol=24 * np.finfo(np.float32).eps)
    assert mixing < 2 * one + 2**16
    # A handful of float64 images, each twice the size of one light's, not 24 more.
    assert weighting < 20 * one


def test_combine_mixes_images_and_noise_alike(make_basis: Any):
    rng = np.random.default_rng(0)
    halves = rng.normal(size=(3, *SIZE, 3))
    basis = make_basis(3, SIZE, half_differences=halves)
    w = rng.random((3, 3))
    estimate = combine(basis, Lighting.of_weights(basis, w))
    # Three products in float32.
    expected = np.einsum("nhwc,nc->hwc", basis.images, w)
    np.testing.assert_allclose(estimate.image, expected, rtol=1e-6)
    np.testing.assert_allclose(
        estimate.half_difference, np.einsum("nhwc,nc->hwc", halves, w), atol=1e-5
    )


def _fix_lights(basis: Any, fixed: list[int]) -> Any:
    lights = [
        replace(light, is_fixed=True, emission=(1.0, 1.0, 1.0)) if k in fixed else light
        for k, light in enumerate(basis.lights)
    ]
    return replace(basis, lights=tuple(lights))


@given(n=st.integers(2, 6), seed=st.integers(0, 50), data=st.data())
def test_what_is_kept_leaves_scipy_the_rest_of_the_target(
    make_basis: Any, n: int, seed: int, data: st.DataObject
) -> None:
    fixed = data.draw(st.lists(st.integers(0, n - 1), max_size=n - 1, unique=True))
    basis = _fix_lights(make_basis(n, SIZE, seed=seed), fixed)
    target = _target(n / 2 * _random_target(seed + 1).image, _random_target(seed + 2).importance)
    solution = solve(basis, target)
    weights = solution.lighting.weights_for(basis)
    assert (weights[fixed] == 1).all()
    assert solution.lighting.fixed == {basis.names[k] for k in fixed}
    assert solution.certificate.converged

    free = [k for k in range(n) if k not in fixed]
    root = np.sqrt(target.importance.astype(np.float64)).ravel()
    for c in range(3):
        columns = basis.images[..., c].reshape(n, -1).astype(np.float64) * root
        remainder = target.image[..., c].ravel() * root - columns[fixed].sum(axis=0)
        expected, norm = nnls(columns[free].T, remainder)
        # The solver stops at a KKT residual of 1e-10 of a problem that is well conditioned.
        np.testing.assert_allclose(weights[free, c], expected, atol=1e-7)
        assert solution.certificate.objective[c] == pytest.approx(norm**2, rel=1e-9)


@pytest.mark.parametrize("unpainted", [0.0, 0.3])
def test_keeping_a_light_is_painting_without_it(make_basis: Any, unpainted: float) -> None:
    basis = make_basis(4, SIZE, seed=5)
    basis_with_fixed = _fix_lights(basis, [1])
    others = replace(
        basis,
        lights=tuple(np.delete(np.array(basis.lights, object), 1)),
        planes=np.delete(basis.images, 1, axis=0),
        noise=np.delete(basis.half_differences, 1, axis=0),
    )
    target = _random_target()
    bare = replace(target, image=target.image - basis.images[1])
    emission = solve(basis_with_fixed, target, unpainted=unpainted).lighting.emission
    expected_emission = solve(others, bare, unpainted=unpainted).lighting.emission
    for name in others.names:
        np.testing.assert_allclose(
            emission[name], expected_emission[name], atol=1e-6
        )  # float32 pixels


def test_what_is_kept_stays_through_any_painting(make_basis: Any) -> None:
    basis = _fix_lights(make_basis(3, SIZE), [0, 2])
    black = solve(basis, _target(np.zeros((*SIZE, 3)))).lighting
    assert black.weights_for(basis).tolist() == [[1, 1, 1], [0, 0, 0], [1, 1, 1]]
    fixed_basis = _fix_lights(make_basis(2, SIZE), [0, 1])
    solution = solve(fixed_basis, _random_target())
    assert solution.certificate.converged
    assert (solution.lighting.weights_for(fixed_basis) == 1).all()
    with pytest.raises(LightingError, match="fixed, so its emission must be 1 1 1"):
        black.with_emission(basis.names[0], (2, 2, 2))


def test_what_is_no_target_or_constraint_is_named(make_basis: Any) -> None:
    basis = make_basis()
    target = Target("t", basis.images.sum(axis=0), np.ones(basis.size, np.float32), False)
    with pytest.raises(TargetError, match="the target is a str"):
        solve(basis, "painting.exr")  # type: ignore[arg-type]
    with pytest.raises(ConstraintError, match=r"are a dict: give Constraints\.of"):
        solve(basis, target, constraints={"sparse": 2})  # type: ignore[arg-type]
