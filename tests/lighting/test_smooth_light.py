"""Many lights are solved on indirect light that is averaged along surfaces."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.planes import IndirectLight, as_planes
from lightpaint.images.denoiser import Features
from lightpaint.lighting.analysis.noise import noise_correction
from lightpaint.lighting.analysis.noise.noise_correction import (
    can_smooth,
    correct_noise,
    on_smooth_light,
)
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE, LIGHTS = (32, 48), 64


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def true_planes() -> Any:
    """Direct light in a small pool each, and a wide glow around it, (n, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    direct, glow = np.zeros((2, LIGHTS, *SIZE, 3))
    for k in range(LIGHTS):
        distance = np.hypot(y - 4 * (k // 8) - 2, x - 6 * (k % 8) - 3)
        direct[k] = (distance < 1.5)[..., None]
        glow[k] = 0.2 * np.exp(-((distance / 9) ** 2))[..., None]
    return direct, glow


def noisy_basis(rng: np.random.Generator, *, noise: float = 1.0) -> Basis:
    """A basis of these planes on a flat wall, whose glow is as of few samples."""
    direct, glow = true_planes()
    a, b = (glow * (1 - noise + noise * rng.exponential(size=(LIGHTS, *SIZE, 1))) for _ in range(2))
    mean, half = ((picture / 2).astype(np.float32) for picture in (a + b, a - b))
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    flat = np.ones((*SIZE, 3), np.float32)
    wall = Features(flat / 2, flat * np.float32([0, 0, 1]), np.stack([x, y, 0 * x], axis=-1))
    return Basis(
        [BasisLight(f"light {k}", "point", "intensity", "", (1, 1, 1)) for k in range(LIGHTS)],
        direct.astype(np.float32) + mean,
        half,
        np.zeros(SIZE, bool),
        Origin("made", "", "", 0, "", (4, 4), (1, 1)),
        features=wall,
        indirect=IndirectLight(as_planes(mean), as_planes(half)),
    )


def painting(rng: np.random.Generator) -> tuple[Target, Any]:
    """A mix of the lights with a shade that none makes, and the weights that come closest."""
    direct, glow = true_planes()
    truth = (direct + glow).astype(np.float32)
    mix = np.einsum("nhwc,n->hwc", truth, rng.uniform(0.2, 3, LIGHTS))
    shaded = (mix * np.linspace(0.7, 1.3, SIZE[1])[:, None]).astype(np.float32)
    target = Target.of(shaded)
    exact = replace(noisy_basis(rng), planes=as_planes(truth), noise=as_planes(0 * truth))
    return target, solve(exact, target).weights


def error(weights: Any, expected: Any) -> float:
    return float(np.sqrt(np.square(weights - expected).mean()))


def test_weights_are_nearer_to_the_true_ones(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    target, expected = painting(rng)
    solutions = [solve(noisy_basis(rng), target) for _ in range(3)]
    smooth = np.mean([error(correct_noise(x).weights, expected) for x in solutions])
    monkeypatch.setattr(noise_correction, "MIN_LIGHTS", LIGHTS + 1)
    as_rendered = np.mean([error(correct_noise(x).weights, expected) for x in solutions])
    assert smooth < 0.7 * as_rendered


def test_direct_light_and_clean_light_stay(rng: np.random.Generator):
    """Without noise nothing asks for an average."""
    target, _ = painting(rng)
    solution = solve(noisy_basis(rng, noise=0), target)
    smooth = on_smooth_light(solution)
    np.testing.assert_array_equal(smooth.basis.images, solution.basis.images)
    np.testing.assert_array_equal(smooth.equations.M, solution.equations.M)
    np.testing.assert_array_equal(smooth.equations.b, solution.equations.b)


def test_the_noise_that_is_left_is_that_of_averaged_planes(rng: np.random.Generator):
    """Two bases of the same planes: half their difference has the power of the half differences."""
    target, _ = painting(rng)
    pair = [on_smooth_light(solve(noisy_basis(rng), target)).basis for _ in range(2)]
    variance = np.square((pair[0].images - pair[1].images) / np.sqrt(2), dtype=np.float64).sum()
    stated_variance = np.mean(
        [
            np.square(basis_of_pair.half_differences, dtype=np.float64).sum()
            for basis_of_pair in pair
        ]
    )
    # Of 64 planes of 1536 pixels, some twelve of which are alike: 1/90 is a standard error.
    assert variance == pytest.approx(stated_variance, rel=0.05)
    assert (
        stated_variance < 0.3 * np.square(noisy_basis(rng).half_differences, dtype=np.float64).sum()
    )


def test_a_sum_of_the_basis_itself_is_met_as_before(rng: np.random.Generator):
    """Its noise is that of the planes as they were rendered."""
    basis = noisy_basis(rng)
    weights_of_mix = rng.uniform(0.2, 3, (LIGHTS, 3))
    corrected = correct_noise(solve(basis, Target.of(basis.mix(weights_of_mix))))
    np.testing.assert_allclose(corrected.weights, weights_of_mix, rtol=1e-3)
    assert corrected.problem.noise_removed == 0


def test_what_follows_the_current_look_follows_its_average(rng: np.random.Generator):
    """Held at the current look everywhere, the averaged planes ask for no change either."""
    basis = noisy_basis(rng)
    weight = np.zeros(SIZE)
    weight[0, 0] = 1e-9
    target = Target.of(basis.current_look.astype(np.float32), weight)
    solution = solve(basis, target, unpainted=1.0)
    smooth = on_smooth_light(solution)
    gradient = smooth.equations.gradient(smooth.basis.current_weights)
    assert np.abs(gradient).max() < 1e-5 * np.abs(smooth.equations.b).max()


def test_several_views_are_averaged_each_by_itself(rng: np.random.Generator):
    """Twice the same view asks for what it asks for once, and one with less noise for its own."""
    target, expected = painting(rng)
    basis, cleaner = noisy_basis(rng), noisy_basis(rng, noise=0.5)
    # Solves stop at 1e-6 or so of a weight.
    single, double = (
        correct_noise(solve([basis] * k, [target] * k), share=1.0).weights for k in (1, 2)
    )
    np.testing.assert_allclose(double, single, rtol=0, atol=1e-4)
    joint_solution = solve([basis, cleaner], [target] * 2)
    separate = [on_smooth_light(solve(x, target)).equations for x in (basis, cleaner)]
    joint = on_smooth_light(joint_solution).equations
    for name in ("M", "b"):
        summed = sum(getattr(x, name) for x in separate)
        np.testing.assert_allclose(getattr(joint, name), summed, rtol=1e-9)
    assert error(correct_noise(joint_solution).weights, expected) < error(
        joint_solution.weights, expected
    )


def test_few_lights_and_unknown_surfaces_are_solved_as_they_were_rendered(
    rng: np.random.Generator,
):
    basis = noisy_basis(rng)
    assert basis.features is not None
    assert can_smooth([basis])
    assert not can_smooth([replace(basis, indirect=None)])
    assert not can_smooth([basis, replace(basis, indirect=None)])
    assert not can_smooth([replace(basis, features=replace(basis.features, position=None))])
    few = slice(None, noise_correction.MIN_LIGHTS - 1)
    parts = basis.indirect
    assert parts is not None
    fewer = replace(
        basis,
        lights=list(basis.lights)[few],
        planes=basis.images[few],
        noise=basis.half_differences[few],
        indirect=IndirectLight(
            as_planes(parts.planes.array()[few]), as_planes(parts.noise.array()[few])
        ),
    )
    assert not can_smooth([fewer])
