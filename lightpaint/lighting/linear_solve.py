"""The solve of a linear problem: weights, what shows that they are best, and the lighting."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from lightpaint.arrays import Bools, Doubles, as_rgb
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.software_versions import Software
from lightpaint.lighting.constraints.reduced_problem import ReducedOptimum, reduced_problems
from lightpaint.lighting.constraints.reduction import only_knobs
from lightpaint.lighting.constraints.sparse_lights import choose_knobs
from lightpaint.lighting.constraints.white_neighbours import solve_on_locus
from lightpaint.lighting.linear_problem import LinearProblem
from lightpaint.lighting.normal_equations import NormalEquations

#: Gradient, of a problem with unit diagonal and relative to b, that counts as a pull.
PULL = 1e-7

_Problem = TypeVar("_Problem", bound=LinearProblem)


@dataclass(frozen=True)
class Answer(Generic[_Problem]):
    """The lighting that solves the squares of a problem.

    problem: with the lights that `sparse` has chosen. weights: (n, 3). tried: as of `Solution`.
    """

    problem: _Problem
    lighting: Lighting
    weights: Doubles
    tried: tuple[tuple[int, Doubles], ...] = ()


def solve_linear(problem: _Problem, start: Doubles) -> Answer[_Problem]:
    """Solve the squares, from weights (n, 3). With `sparse`, of the best lights in it."""
    count = problem.constraints.sparse
    if count is None or not problem.full.knobs:
        return solve_reduction(problem, start)
    equations, curve = problem.pulled(problem.solved), []
    path = choose_knobs(reduced_problems(equations, problem.full), problem.full, count)
    for chosen in path:
        _, found = solve_on_locus(equations, only_knobs(problem.full, chosen), start)
        curve.append((len(chosen), found.weights))
    best = max((chosen for chosen in path if len(chosen) <= count), key=len)
    answer = solve_reduction(problem.with_reduction(only_knobs(problem.full, best)), start)
    # What was chosen and has come out dark is left out as well.
    on = [k for k, x in enumerate(problem.full.knobs) if answer.weights[list(x.lights)].any()]
    left = answer.problem.with_reduction(only_knobs(answer.problem.full, on))
    norm = np.where(problem.norm2 > 0, problem.norm2, 1).sum()
    told = [(n, float(np.sqrt(problem.objective(w).sum() / norm))) for n, w in curve]
    certificate = answer.lighting.certificate
    assert certificate is not None
    lighting = answer.lighting.with_certificate(replace(certificate, curve=tuple(told)))
    return replace(answer, problem=left, lighting=lighting, tried=tuple(curve))


def solve_reduction(
    problem: _Problem, start: Doubles, reached: Bools | None = None
) -> Answer[_Problem]:
    """Solve the squares as the reduction has the lights. reached: as of `answer_of`."""
    equations, method = problem.pulled(problem.solved), problem.fit.method
    reduction, optimum = solve_on_locus(equations, problem.reduction, start, method=method)
    return answer_of(problem.reduced(reduction), optimum, optimum.weights, equations, reached)


def answer_of(
    problem: _Problem,
    optimum: ReducedOptimum,
    weights: Doubles,
    equations: NormalEquations,
    reached: Bools | None = None,
) -> Answer[_Problem]:
    """Return weights (n, 3) as an answer. optimum: of `equations`, the problem with its pull.

    reached: (n, 3), what lights reach where that is known from before: in the last linear problem
    of a loss it may be less.
    """
    reached = optimum.reached if reached is None else reached
    transform, names = problem.transform, problem.lights.names
    labels = problem.reduction.labels
    weights = problem.without_traces(weights, np.array([bool(x) for x in labels], dtype=bool))
    certificate = Certificate(
        kkt_residual=as_rgb(optimum.kkt_residual),
        objective=(0, 0, 0),
        relative_objective=(0, 0, 0),
        sweeps=optimum.sweeps,
        converged=optimum.converged,
        unreached=tuple(n for n, ok in zip(names, reached, strict=True) if not ok.any()),
        display="" if transform is None else transform.spoken,
        hold=problem.fit.hold or 0.0,
        colors=problem.fit.colors or "free",
        noise_removed=problem.noise_removed,
        software=Software.here(),
        basis_spp=problem.spp,
    ).of(problem.objective(weights), problem.norm2)
    asked = _labels_held_back(problem, equations, optimum.weights)
    about: dict[str, Any] = {"target": problem.name, "certificate": certificate}
    about["scene_identity"] = problem.scene_identity
    lighting = Lighting.of_weights(problem.lights, weights, asked=asked, reached=reached, **about)
    return Answer(problem, lighting, weights)


def _labels_held_back(
    problem: LinearProblem, equations: NormalEquations, weights: Doubles
) -> Sequence[tuple[str, bool]]:
    """Return of each light what is asked of it, and whether it would change if it were let go."""
    labels = problem.reduction.labels
    if not any(labels):
        return [(label, False) for label in labels]
    held = _held_back(equations, problem.lights.is_scalar, weights)
    return [(label, bool(label) and bool(h)) for label, h in zip(labels, held, strict=True)]


def _held_back(equations: NormalEquations, scalar: Bools, weights: Doubles) -> Bools:
    """(n,), whether a light would change if it alone were let go.

    scalar: (n,), of which there is one weight for all channels. The gradient g = M w − b must
    vanish for a free light that is on, and may not be negative for one that is off; where it does
    not do so, something holds the light.
    """
    lit = equations.reached
    power = np.where(lit, np.einsum("cii->ic", equations.M), 0)
    g = np.where(lit, equations.gradient(weights), 0)
    size = np.abs(equations.b.T[lit] / np.sqrt(power[lit])).max(initial=0) or 1.0
    # Of what has one weight for all channels they pull together.
    g[scalar], power[scalar] = (x[scalar].sum(axis=1, keepdims=True) for x in (g, power))
    root = np.sqrt(np.where(power > 0, power, 1))
    violation = np.abs(np.minimum(weights * root, g / root))
    return np.asarray((violation > PULL * size).any(axis=1))
