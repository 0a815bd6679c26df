"""A light that is painted off is off, however coarse the numbers; one that is there stays on."""

from typing import Any

import numpy as np
import pytest
from light_groups import pictures

from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.problem import remove_traces
from lightpaint.target.painted_target import Target

SIZE = (24, 32)


def _basis(images: Any, *, spp: int = 0) -> Basis:
    lights = tuple(
        BasisLight(f"light {k}", "light group", "", "× as rendered", (1.0, 1.0, 1.0))
        for k in range(len(images))
    )
    origin = Origin("a", "", "", 0, "", (spp, spp), (1, 1))
    images = images.astype(np.float32)
    return Basis(lights, images, np.zeros_like(images), np.zeros(SIZE, dtype=bool), origin)


def _solve(images: Any, painted: Any, **options: Any) -> Any:
    image = painted.astype(np.float32)
    return solve(
        _basis(images), Target("t", image, np.ones(SIZE, np.float32), True), **options
    ).weights


@pytest.mark.parametrize("layers", [np.float32, np.float16])
@pytest.mark.parametrize("painting", [np.float32, np.float16])
@pytest.mark.parametrize("seed", range(5))
def test_what_is_painted_off_is_off(layers: Any, painting: Any, seed: int):
    images = pictures(5, seed=seed, size=SIZE)
    weights = np.random.default_rng(seed).uniform(0.2, 2, (5, 3))
    weights[1], weights[3, 1] = 0, 0
    painted = np.einsum("nhwc,nc->hwc", images, weights).astype(painting)
    solution = _solve(images.astype(layers), painted)
    assert (solution[1] == 0).all()
    assert solution[3, 1] == 0
    # Rounding of half floats, which other weights are found to within.
    np.testing.assert_allclose(solution, weights, atol=2e-3)


@pytest.mark.parametrize("dimmed", [1e-6, 1e-9])
@pytest.mark.parametrize("kind", [np.float32, np.float16])
def test_day_for_night(dimmed: float, kind: Any):
    """The sun as the moon: so small a share of what it was, and all the light there is."""
    images = pictures(2, size=SIZE)
    images[0] *= 1e5
    painted = (dimmed * images[0]).astype(np.float32)
    solution = _solve(images.astype(np.float32), painted)
    np.testing.assert_allclose(solution[0], dimmed, rtol=1e-4)


def test_a_dim_light_in_a_corner_stays_on():
    images = pictures(2, size=SIZE)
    images[1] = 0
    images[1, :2, :2] = 1
    images[0, :2, :2] = 0
    painted = images[0] + np.float32(1e-5) * images[1]
    np.testing.assert_allclose(_solve(images, painted)[1], 1e-5, rtol=1e-3)


def test_a_dim_light_beside_a_bright_one_stays_as_it_was():
    """In half floats no pixel shows a candle in the sun; nobody has painted it off."""
    images = pictures(2, size=SIZE) + 1
    images[0] *= 2e3
    cleaned = remove_traces(
        _basis(images.astype(np.float16)),
        np.ones((2, 3)),
        images[0],
        is_constrained=np.zeros(2, bool),
    )
    assert (cleaned == 1).all()


def test_what_is_asked_is_kept():
    images = pictures(3, size=SIZE)
    constraints = Constraints.of({"light 1": {"lock": [1e-9, 1e-9, 1e-9]}})
    solution = _solve(images, 2 * images[0], constraints=constraints)
    assert (solution[1] == 1e-9).all()
    assert (solution[2] == 0).all()


def test_of_a_basis_that_knows_its_noise_nothing_is_taken():
    images = pictures(2, size=SIZE)
    weights = np.array([[1.0] * 3, [1e-12] * 3])
    options: Any = {"image": images[0], "is_constrained": np.zeros(2, bool)}
    assert (remove_traces(_basis(images, spp=8), weights, **options) == weights).all()
    assert (remove_traces(_basis(images), weights, **options)[1] == 0).all()
