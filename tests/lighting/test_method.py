"""The paper's iteration alone: the same answer where it comes to it, and honest where not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nightly import seeds

from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.target.painted_target import Target

SIZE = (12, 10)

#: What may be asked for, so that each path of the solver is gone.
ASKED: list[dict[str, Any]] = [
    {},
    {"light": {"light 0": {"color": "3200K"}, "light 1": {"limits": {"max": [0.1, 0.2, 0.3]}}}},
    {"light": {"light 0": {"limits": {"max": 0.1}}, "light 1": {"primaries": ["2700K", "6500K"]}}},
    {"light": {"light 2": {"off": True}}, "tie": ["light 0", "light 1"]},
    {"sparse": 2},
    {"prefer_current": 0.02},
]


def _target(image: Any) -> Target:
    return Target("t", image.astype(np.float32), np.ones(SIZE, np.float32), everything=False)


@pytest.mark.parametrize("words", ASKED)
@pytest.mark.parametrize("seed", seeds(4, 10))
def test_both_methods_come_to_one_answer(make_basis: Any, seed: int, words: Any) -> None:
    basis = make_basis(4, SIZE, seed=seed)
    if seed % 2:
        lights = (*basis.lights[:3], replace(basis.lights[3], is_scalar=True))
        basis = replace(basis, lights=lights)
    target = _target(np.random.default_rng(seed).random((*SIZE, 3)))
    constraints = Constraints.of(**words)
    polished, swept = (
        solve(basis, target, constraints=constraints, method=method)
        for method in ("polished", "gauss-seidel")
    )
    assert swept.problem.fit.method == "gauss-seidel"
    assert polished.certificate.converged
    assert swept.certificate.converged
    assert min(swept.certificate.sweeps) > 0
    # Both residuals are 1e-12 of b at most; M⁻¹ makes errors of weights of that.
    M, b = swept.equations.M, swept.equations.b
    slack = max(np.linalg.norm(np.linalg.inv(M[c]), 2) for c in range(3))
    atol = 2e-12 * slack * np.abs(b).max() * 2 * np.sqrt(3 * 4)
    a, b = (x.lighting.weights_for(basis) for x in (polished, swept))
    np.testing.assert_allclose(a, b, rtol=0, atol=atol)


def _similar_lights(make_basis: Any) -> Any:
    """Two lights that do nearly the same: sweeps go along a long narrow valley."""
    rng = np.random.default_rng(0)
    images = rng.random((3, *SIZE, 3))
    images[1] = images[0] + 1e-4 * rng.random((*SIZE, 3))
    noise = rng.normal(0, 1e-6, images.shape)
    basis = make_basis(images=images, half_differences=noise)
    truth = np.einsum("nhwc,nc->hwc", images, [[0.2] * 3, [0.9] * 3, [0.5] * 3])
    return basis, _target(truth)


@pytest.mark.nightly
def test_running_out_of_sweeps_is_said(make_basis: Any) -> None:
    basis, target = _similar_lights(make_basis)
    assert solve(basis, target).certificate.converged
    for constraints in (None, Constraints.of({"light 2": {"limits": {"max": [9, 9, 9]}}})):
        swept = solve(basis, target, constraints=constraints, method="gauss-seidel")
        assert not swept.certificate.converged
        assert max(swept.certificate.sweeps) == 20_000
        assert max(swept.certificate.kkt_residual) > 1e-12


def test_the_method_stays_where_the_answer_is_improved(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It may run out of sweeps sooner: that it takes them all is shown above.
    monkeypatch.setitem(solve_reduced.__kwdefaults__, "max_sweeps", 500)
    basis, target = _similar_lights(make_basis)
    better = correct_noise(solve(basis, target, method="gauss-seidel"))
    assert better.problem.fit.method == "gauss-seidel"
    assert max(better.certificate.sweeps) > 0
    views = solve([basis, basis], [target, target], method="gauss-seidel").views
    assert [view.problem.fit.method for view in views] == ["gauss-seidel"] * 2
    assert not views[0].certificate.converged
