"""Additional lights: what they gain is what the full solve gains, and noise gains nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.errors import SizeError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.solve import solve
from lightpaint.placement.suggestions.additions import find_additions
from lightpaint.placement.suggestions.candidates import Candidates
from lightpaint.target.target import Target

SIZE = (12, 10)


def _target(image: Any, importance: Any = None) -> Target:
    importance = np.ones(image.shape[:2]) if importance is None else importance
    return Target("t", image.astype(np.float32), importance.astype(np.float32), everything=False)


def _problem(make_basis: Any, seed: int, n: int = 3, m: int = 4) -> tuple[Any, Any, Target]:
    """A basis, candidates, and a target that one of the candidates would help to meet."""
    rng = np.random.default_rng(seed)
    basis = make_basis(n, SIZE, seed=seed)
    added = make_basis(m, SIZE, seed=seed + 1, names=[f"new {k}" for k in range(m)])
    image = basis.mix(rng.random((n, 3))) + 2 * added.images[1] + 0.1 * rng.random((*SIZE, 3))
    return basis, added, _target(image, rng.random(SIZE) + 0.1)


def _missed(basis: Any, target: Target, constraints: Any = None) -> float:
    return sum(solve(basis, target, constraints=constraints).certificate.objective)


def _joined(basis: Any, added: Any, chosen: list[int]) -> Any:
    return replace(
        basis,
        lights=(*basis.lights, *(added.lights[k] for k in chosen)),
        planes=np.concatenate([basis.images, added.images[chosen]]),
        noise=np.concatenate([basis.half_differences, added.half_differences[chosen]]),
    )


@given(st.integers(0, 1000))
def test_the_gains_are_those_of_the_full_solve(make_basis: Any, seed: int):
    basis, added, target = _problem(make_basis, seed)
    found = find_additions(Candidates.of(basis, solve(basis, target), added), count=3)
    before = _missed(basis, target)
    # Without noise both halves are the same, so that the best is the best of all trials.
    trials = [before - _missed(_joined(basis, added, [k]), target) for k in range(4)]
    assert found[0].candidate == int(np.argmax(trials)) == 1
    chosen: list[int] = []
    for addition in found:
        chosen.append(addition.candidate)
        joined = _joined(basis, added, chosen)
        solution = solve(joined, target)
        left = sum(solution.certificate.objective)
        # Sums over float32 pixels.
        assert addition.gain == pytest.approx(before - left, rel=1e-4, abs=1e-6 * before)
        np.testing.assert_allclose(
            addition.weights, solution.lighting.weights_for(joined), atol=1e-5, rtol=1e-4
        )
        np.testing.assert_allclose(addition.with_it, joined.mix(addition.weights), rtol=1e-5)
        before = left
    assert len(set(chosen)) == len(chosen)


@pytest.mark.parametrize(
    "asked",
    [
        {"light 0": {"lock": True}},
        {"light 1": {"limits": {"max": 0.1}}, "light 2": {"off": True}},
        {"*": {"kelvin": [2700, 6500]}},
    ],
)
def test_constraints_hold_for_the_lights_there_are(make_basis: Any, asked: Any):
    basis, added, target = _problem(make_basis, 3)
    constraints = Constraints.of(asked)
    solution = solve(basis, target, constraints=constraints)
    [found] = find_additions(Candidates.of(basis, solution, added), count=1)
    joined = _joined(basis, added, [found.candidate])
    # Named, so that a pattern for all lights does not mean the new one.
    named = {n: asked.get(n, asked.get("*", {})) for n in basis.names}
    named = {n: wish for n, wish in named.items() if wish}
    full = solve(joined, target, constraints=Constraints.of(named))
    gain = sum(solution.certificate.objective) - sum(full.certificate.objective)
    assert found.gain == pytest.approx(gain, rel=1e-4)
    np.testing.assert_allclose(
        found.weights, full.lighting.weights_for(joined), atol=1e-5, rtol=1e-4
    )


def test_few_lights_and_kept_lights_stay_few_and_kept(make_basis: Any):
    basis, added, target = _problem(make_basis, 5)
    kept = replace(basis.lights[2], is_fixed=True, emission=(1, 1, 1))
    basis = replace(basis, lights=(*basis.lights[:2], kept))
    solution = solve(basis, target, constraints=Constraints.of(sparse=1))
    on = solution.lighting.weights_for(basis)[:2].any(axis=1)
    [found] = find_additions(Candidates.of(basis, solution, added), count=1)
    assert (found.weights[2] == 1).all()
    assert (found.weights[:2].any(axis=1) == on).all()
    assert on.sum() == 1


def test_preferring_the_current_look_draws_the_lights_there_are(make_basis: Any):
    basis, added, target = _problem(make_basis, 6)
    solution = solve(basis, target, constraints=Constraints.of(prefer_current=1e6))
    [found] = find_additions(Candidates.of(basis, solution, added), count=1)
    np.testing.assert_allclose(found.weights[:3], basis.current_weights, rtol=1e-3)
    assert found.weights[3].min() > 0.5


def test_a_smaller_film_asks_the_same(make_basis: Any):
    """Images that are constant in blocks lose nothing by being reduced."""
    basis, added, target = _problem(make_basis, 7)
    large = replace(
        basis,
        planes=basis.images.repeat(2, 1).repeat(2, 2),
        noise=basis.half_differences.repeat(2, 1).repeat(2, 2),
        emitters_seen=basis.emitters_seen.repeat(2, 0).repeat(2, 1),
    )
    painted = _target(
        target.image.repeat(2, 0).repeat(2, 1), target.importance.repeat(2, 0).repeat(2, 1)
    )
    [small] = find_additions(Candidates.of(basis, solve(basis, target), added), count=1)
    [whole] = find_additions(Candidates.of(large, solve(large, painted), added), count=1)
    assert whole.candidate == small.candidate
    assert whole.gain == pytest.approx(4 * small.gain, rel=1e-5)  # four pixels for one
    np.testing.assert_allclose(whole.weights, small.weights, rtol=1e-5, atol=1e-6)


def test_noise_alone_gains_nothing(make_basis: Any):
    """Candidates that are noise and a target that the lights meet: nothing is offered.

    Each is fitted with what noise it has; on the other half that does not come again.
    """
    offered = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        images = rng.random((2, *SIZE, 3))
        noise = rng.normal(0, 0.05, (2, *SIZE, 3))
        basis = make_basis(images=images + noise, half_differences=rng.normal(0, 0.05, noise.shape))
        halves = rng.exponential(1, (2, 20, *SIZE, 3)) ** 2  # long tails, as light has
        added = make_basis(
            images=halves.mean(axis=0),
            half_differences=(halves[0] - halves[1]) / 2,
            names=[f"new {k}" for k in range(20)],
        )
        target = _target(images.sum(axis=0))
        solution = solve(basis, target)
        candidates = Candidates.of(basis, solution, added)
        least = 0.01 * sum(solution.certificate.objective)
        offered += len(find_additions(candidates, count=1, least=least))
    # Of 40 tries with 20 candidates each; at 3 standard errors hardly any.
    assert offered <= 2


def test_too_near_is_left_out(make_basis: Any):
    basis, added, target = _problem(make_basis, 8)
    candidates = Candidates.of(basis, solve(basis, target), added)
    everything = np.ones((4, 4), dtype=bool)
    assert len(find_additions(candidates, count=4)) > 1
    assert len(find_additions(candidates, count=4, too_near=everything)) == 1


def test_a_gain_below_what_it_is_to_be_worth_is_none(make_basis: Any):
    basis, added, target = _problem(make_basis, 9)
    candidates = Candidates.of(basis, solve(basis, target), added)
    [first] = find_additions(candidates, count=1)
    assert find_additions(candidates, count=1, least=1.01 * first.gain) == []
    assert find_additions(candidates, count=1, least=0.99 * first.gain) != []


def test_other_sizes_are_refused(make_basis: Any):
    basis, _, target = _problem(make_basis, 1)
    with pytest.raises(SizeError, match="candidates of 7x5 for a basis of 10x12"):
        Candidates.of(basis, solve(basis, target), make_basis(2, (5, 7)))
