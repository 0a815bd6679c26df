"""Lamps of many emitters: by matrices of lights as by those of drives, and as by scipy."""

from typing import Any

import numpy as np
import pytest
from nightly import seeds
from scipy.optimize import lsq_linear

from lightpaint.lighting.loss.weight_penalty import pull_to_colors
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.emission_mixes import EmissionMixes
from lightpaint.lighting.unknowns.knobs import Knob, Unknown
from lightpaint.lighting.unknowns.reduced_problem import ReducedSolver
from lightpaint.lighting.unknowns.reduction import Reduction

#: Emissions of a red, green, blue, white, amber, lime, violet and another white emitter.
EMISSIONS = np.array(
    [
        *([6.05, -0.39, -0.07], [-0.84, 1.65, 0.01], [-0.93, 0.11, 15.5], [1.12, 0.98, 0.88]),
        *([2.85, 0.56, -0.1], [0.84, 1.16, -0.09], [0.5, 0.2, 9.0], [0.9, 0.95, 1.1]),
    ]
)

#: Of objectives in float64; of weights, that times the condition of the problems.
SAME, SAME_WEIGHTS = 1e-13, 1e-6

KINDS = ["generic", "parallel", "in a plane", "of two colours"]


def _emitters(rng: np.random.Generator, kind: str) -> Any:
    count = int(rng.integers(4, 8))
    columns = EMISSIONS[rng.permutation(8)[:count]] * rng.uniform(0.3, 1.5, (count, 1))
    if kind == "parallel":
        columns[-1] = columns[0] / 2
    if kind == "in a plane":
        columns[-1] = columns[0] + 0.3 * columns[1]
    if kind == "of two colours":
        columns = rng.random((count, 2)) @ EMISSIONS[[3, 4]]
    return columns


def _lamp(k: int, rng: np.random.Generator, kind: str) -> tuple[Knob, Any]:
    """A lamp, and an emission that some drives give it, often at bounds."""
    columns = _emitters(rng, kind)
    most = rng.choice([0, 0.5, 1], len(columns), p=[0.1, 0.2, 0.7])
    least = most * rng.choice([0, 0.3], len(columns), p=[0.9, 0.1])
    unknowns = (
        Unknown(((k, rgb),), float(low), float(high))
        for rgb, low, high in zip(columns, least, most, strict=True)
    )
    return Knob((k,), tuple(unknowns)), np.clip(
        rng.uniform(-1, 2, len(most)), least, most
    ) @ columns


def _problem(seed: int, kind: str, *, is_coupled: bool) -> tuple[NormalEquations, Reduction, Any]:
    """Lamps, and a free light, a dimmer of two, a fixed light and one that reaches nothing."""
    rng = np.random.default_rng(seed)
    lamps = [_lamp(k, rng, kind) for k in range(int(rng.integers(2, 30)))]
    n = len(lamps)
    knobs = [knob for knob, _ in lamps]
    knobs += [Knob.of_any_colour(n), Knob.of_any_colour(n + 4)]
    colors = rng.random((2, 3))
    knobs.append(Knob((n + 1, n + 2), (Unknown(((n + 1, colors[0]), (n + 2, colors[1]))),)))
    fixed = np.zeros((n + 5, 3))
    fixed[n + 3] = 1
    true = np.concatenate([[rgb for _, rgb in lamps], rng.normal(size=(1, 3)), np.ones((4, 3))])
    A = rng.random((3, 400, n + 5)) ** 3
    A[:, :, n + 4] = 0
    y = np.einsum("cpn,nc->cp", A, true)
    y += rng.choice([0, 0.02, 0.3]) * np.abs(y).mean() * rng.standard_normal(y.shape)
    M, b = np.einsum("cpi,cpj->cij", A, A), np.einsum("cpi,cp->ci", A, y)
    equations = NormalEquations(M, b, np.square(y).sum(axis=1))
    if is_coupled:
        is_free = np.arange(n + 5) == n
        power = 0.5 * np.einsum("cii->ic", M)
        equations = equations + pull_to_colors(power, rng.random((n + 5, 3)), is_free)
    return equations, Reduction(fixed, ("",) * (n + 5), tuple(knobs)), rng.random((n + 5, 3))


def _plain(reduction: Reduction) -> Reduction:
    """The same without what is to be tested."""
    same = Reduction(reduction.fixed_weights, reduction.labels, reduction.knobs)
    same.__dict__["mixed_lights"] = None
    return same


@pytest.mark.parametrize("is_coupled", [False, True])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", seeds(4, 60))
def test_the_optimum_is_that_in_drives(seed: int, kind: str, is_coupled: bool) -> None:
    equations, reduction, start = _problem(seed, kind, is_coupled=is_coupled)
    found = ReducedSolver(reduction).solve(equations, start)
    plain = ReducedSolver(_plain(reduction)).solve(equations, start)
    assert found.converged
    assert plain.converged
    value, least = (equations.objective(x.weights).sum() for x in (found, plain))
    assert value == pytest.approx(least, abs=SAME * equations.target_norm2.sum())
    assert found.weights == pytest.approx(plain.weights, abs=SAME_WEIGHTS)
    size = np.abs(equations.b).max()
    assert found.multipliers == pytest.approx(plain.multipliers, abs=SAME_WEIGHTS * size)
    assert ((found.x >= reduction.lower) & (found.x <= reduction.upper)).all()
    # What is held is at its bound to the last bit.
    held = np.abs(found.multipliers) > SAME_WEIGHTS * size
    assert ((found.x == reduction.lower) | (found.x == reduction.upper))[held].all()


@pytest.mark.parametrize("seed", seeds(3, 30))
def test_lights_are_solved_without_the_matrix_of_drives(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    equations, reduction, start = _problem(seed, "generic", is_coupled=False)
    monkeypatch.setattr(ReducedSolver, "_family", None)
    assert ReducedSolver(reduction).solve(equations, start).converged


def test_of_two_lamps_in_one_place_the_nearest_answer_is_that_in_drives() -> None:
    equations, reduction, start = _problem(1, "generic", is_coupled=False)
    M, b = equations.M.copy(), equations.b.copy()
    M[:, 1], b[:, 1] = M[:, 0], b[:, 0]
    M[:, :, 1] = M[:, :, 0]
    equal = NormalEquations(M, b, equations.target_norm2)
    first = reduction.knobs[0]
    second = Knob(
        (1,), tuple(Unknown(((1, x.columns[0][1]),), x.lower, x.upper) for x in first.unknowns)
    )
    reduction = Reduction(
        reduction.fixed_weights, reduction.labels, (first, second, *reduction.knobs[2:])
    )
    found = ReducedSolver(reduction).solve(equal, start)
    plain = ReducedSolver(_plain(reduction)).solve(equal, start)
    assert found.converged
    value, least = (equal.objective(x.weights).sum() for x in (found, plain))
    assert value == pytest.approx(least, abs=SAME * equal.target_norm2.sum())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", seeds(5, 60))
def test_mixes_are_the_bounded_least_squares_of_scipy(seed: int, kind: str) -> None:
    """Within what the lamp can mix, on its surface, and beyond."""
    rng = np.random.default_rng(seed)
    columns = _emitters(rng, kind)
    lower = rng.choice([0, 0.2], len(columns), p=[0.8, 0.2])
    upper = lower + rng.choice([0, 0.4, 0.8], len(columns), p=[0.1, 0.2, 0.7])
    drives = rng.uniform(lower, upper, (6, len(columns)))
    drives[2:4] = rng.choice([0, 1], drives[2:4].shape) * (upper - lower) + lower
    emissions, metric = drives @ columns, rng.uniform(0.1, 2, (6, 3))
    emissions[4:] += rng.normal(size=(2, 3)) * 3
    mixes = EmissionMixes.of(*(np.stack([x] * 6) for x in (columns, lower, upper)))
    found = mixes.nearest(np.arange(6), emissions, metric)
    assert ((found >= lower) & (found <= upper)).all()
    for x, emission, weight in zip(found, emissions, metric, strict=True):
        root, free = np.sqrt(weight), upper > lower
        y = root * (emission - np.where(free, 0, lower) @ columns)
        A = (root * columns[free]).T
        least = 2 * lsq_linear(A, y, (lower[free], upper[free]), "bvls", tol=1e-15).cost
        distance = np.square(root * (x @ columns - emission)).sum()
        assert distance == pytest.approx(least, rel=1e-9, abs=1e-17 * np.square(emissions).max())
