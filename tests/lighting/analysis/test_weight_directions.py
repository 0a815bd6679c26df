"""Free directions and effects of unknowns, with few entries, against whole matrices."""

from typing import Any

import numpy as np
import pytest

from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.lighting.algebra import symmetric_matrices
from lightpaint.lighting.algebra.symmetric_matrices import excess_above
from lightpaint.lighting.analysis.appearance import limiting_reasons
from lightpaint.lighting.analysis.noise import basis_noise as noise
from lightpaint.lighting.analysis.noise.basis_noise import denoised_matrix, pseudo_inverse
from lightpaint.lighting.analysis.noise.weight_directions import Directions
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.target.painted_target import Target

#: Float64 sums of a few terms of size one.
EXACT = {"rtol": 1e-12, "atol": 1e-12}


def _directions(rng: np.random.Generator) -> tuple[Directions, np.ndarray]:
    """Two directions along single unknowns of six, and two others; and the same as a matrix."""
    others = rng.random((6, 2))
    whole = np.zeros((6, 4))
    whole[4, 0], whole[1, 1], whole[:, 2:] = 1, -1, others
    return Directions(np.array([4, 1]), np.array([1.0, -1.0]), others), whole


def test_directions_multiply_as_their_matrix() -> None:
    rng = np.random.default_rng(1)
    D, whole = _directions(rng)
    M, x, steps = rng.random((6, 6)), rng.random((6, 3)), rng.random((4, 3))
    M = M + M.T
    np.testing.assert_allclose(D.times(M), M @ whole, **EXACT)
    np.testing.assert_allclose(D.dot(x), whole.T @ x, **EXACT)
    np.testing.assert_allclose(D.dot(x[:, 0]), whole.T @ x[:, 0], **EXACT)
    np.testing.assert_allclose(D.within(M), whole.T @ M @ whole, **EXACT)
    np.testing.assert_allclose(D.effect(steps), whole @ steps, **EXACT)
    which = np.array([True, False, False, True])
    chosen = D.chosen(which)
    np.testing.assert_allclose(chosen.times(M), M @ whole[:, which], **EXACT)
    np.testing.assert_allclose(chosen.between(M, D), whole[:, which].T @ M @ whole, **EXACT)
    single = Directions(D.unknowns, D.signs, np.zeros((6, 0)))
    np.testing.assert_allclose(single.within(M), whole[:, :2].T @ M @ whole[:, :2], **EXACT)
    for first, first_whole in ((D, whole), (single, whole[:, :2])):
        joint, order = first.joined(chosen)
        columns = np.hstack([first_whole, whole[:, which]])
        columns = columns if order is None else columns[:, order]
        np.testing.assert_allclose(joint.times(M), M @ columns, **EXACT)


@pytest.mark.parametrize(
    "constraints",
    [
        Constraints(),
        Constraints.of({"a": {"color": [1, 0.5, 0.2]}, "c": {"limits": {"max": 3.0}}}),
        Constraints.of({"b": {"lock": True}, "d": {"color": [0, 1, 0]}}),
        Constraints.of({}, tie=[["a", "c"]]),
    ],
)
def test_a_block_has_the_sums_of_its_whole_matrix(constraints: Constraints) -> None:
    rng, n = np.random.default_rng(2), 4
    lights = Lights(
        [BasisLight(x, "area", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0)) for x in "abcd"]
    )
    reduction = reduce_to(constraints, lights)
    lit = rng.random((n, 3)) < 0.8
    unknown, light, rgb = reduction.columns
    for is_masked in (False, True):
        for block in reduction.blocks:
            C = np.zeros((3, n, len(reduction.unknowns)))
            for c in block.channels:
                np.add.at(C[c], (light, unknown), rgb[:, c])
            if is_masked:
                C *= lit.T[..., None]
                block = block.masked(lit)
            C = C.reshape(3 * n, -1)[:, block.unknowns]
            M, Q, b = rng.random((3, n, n)), rng.random((3 * n, 3 * n)), rng.random((3, n))
            Q, x = Q @ Q.T, rng.random((C.shape[1], 2))
            np.testing.assert_allclose(block.matrix(M), C.T @ block_diagonal(M) @ C, **EXACT)
            found = block.covariance(Q.reshape(3, n, 3, n))
            np.testing.assert_allclose(found, C.T @ Q @ C, **EXACT)
            np.testing.assert_allclose(block.right_side(b), C.T @ b.ravel(), **EXACT)
            np.testing.assert_allclose(block.effects(x, n).reshape(3 * n, 2), C @ x, **EXACT)
            variances = block.variances(found, n)
            expected = np.diag(C @ found @ C.T).reshape(3, n).T
            np.testing.assert_allclose(variances, expected, **EXACT)


def test_large_matrices_are_worked_on_as_small_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, n = np.random.default_rng(3), 12
    A = rng.random((3, n, 3 * n))
    M = A @ A.swapaxes(1, 2)
    equations, power = NormalEquations(M, np.zeros((3, n)), np.ones(3)), M * 0.3
    power[:, 0, 0] = 0.9 * M[:, 0, 0]
    spread = M[0] / np.trace(M[0]) * n

    def results() -> list[Any]:
        return [
            *(pseudo_inverse(x) for x in M),
            denoised_matrix(equations, power),
            excess_above(spread, 1.0),
        ]

    small = results()
    for module in (noise, symmetric_matrices):
        monkeypatch.setattr(module, "SMALL_MATRIX", 0)
    for one, other in zip(small, results(), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9)  # condition 10⁴
    values, vectors = np.linalg.eigh(spread)
    limited = (vectors * np.minimum(values, 1)) @ vectors.T
    np.testing.assert_allclose(spread - small[-1], limited, **EXACT)
    assert excess_above(spread, values[-1] + 1) is None


def test_nothing_is_sampled_where_only_the_painting_limits_the_lights(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    images = np.random.default_rng(4).random((2, 6, 7, 3))
    basis = make_basis(images=images)
    target = Target.of(np.float32(images[0] + 1), np.ones((6, 7), np.float32), name="painting")
    solution = solve(basis, target, literal=True)
    monkeypatch.setattr(limiting_reasons, "PixelSample", None)
    assert limiting_reasons.reasons_of(solution) == ()
