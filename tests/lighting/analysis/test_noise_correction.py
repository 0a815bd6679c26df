"""The noise correction of answers in display space, where the loss is bent."""

from typing import Any

import numpy as np
import pytest

from lightpaint.colour import ViewTransform
from lightpaint.lighting.analysis.noise.noise_correction import NoiselessLoss
from lightpaint.lighting.default_solve import solve
from lightpaint.target import Target

SIZE = 24, 40


def _pools() -> np.ndarray:
    """Light of three lamps, (3, h, w, 3): a wash, a pool, and a lamp that is mostly shadow."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[1]
    wash, pool = np.full(SIZE, 0.5), np.exp(-((x - 0.3) ** 2 + (y - 0.3) ** 2) / 0.02)
    lamp = 0.02 + np.exp(-((x - 0.8) ** 2 + (y - 0.3) ** 2) / 0.002)
    return np.stack([wash, pool, lamp])[..., None] * np.ones(3)


def _noisy(make_basis: Any, seed: int, sigma: float) -> Any:
    """A basis of two halves, whose light has the relative deviation `sigma` of either."""
    rng, clean = np.random.default_rng(seed), _pools()
    a, b = clean * rng.gamma(sigma**-2, sigma**2, (2, *clean.shape[:-1], 1))
    return make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, emission=[(1.0,) * 3] * 3)


def _dim(image: np.ndarray) -> Target:
    return Target(
        "dim", image.astype(np.float32), np.ones(SIZE, np.float32), False, through_view=True
    )


@pytest.mark.parametrize("transform", [ViewTransform("srgb", 0.0), ViewTransform("agx", 0.0)])
def test_the_loss_without_noise_is_the_loss_of_clean_light(make_basis: Any, transform: Any) -> None:
    """In the mean over seeds, which the noisy loss exceeds."""
    weights = np.array([[0.3, 0.2, 0.1], [0.5, 0.6, 0.2], [0.8, 0.4, 0.1]])
    target = _dim(0.15 + 0.3 * np.einsum("nhwc,nc->hwc", _pools(), weights))
    options = {"literal": True, "space": "display", "transform": transform}
    clean = solve(make_basis(images=_pools(), emission=[(1.0,) * 3] * 3), target, **options)
    expected = float(clean.problem.objective(weights).sum())
    found, noisy = [], []
    for seed in range(30):
        solution = solve(_noisy(make_basis, seed, 0.2), target, **options)
        found.append(NoiselessLoss.of(solution).at(weights))
        noisy.append(float(solution.problem.objective(weights).sum()))
    # Four standard errors, and 2 % for noise to the fourth power.
    error = 4 * np.std(found) / np.sqrt(len(found)) + 0.02 * expected
    assert abs(np.mean(found) - expected) < error < np.mean(noisy) - expected
