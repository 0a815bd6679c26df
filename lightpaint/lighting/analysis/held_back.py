"""What is asked beside the painting, and whether it keeps the lights from what was painted."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.looking import Looking
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.target.target import Target

#: What may hold the lights back: unpainted pixels, their colours, what is asked of single ones.
Held = Literal["hold", "colors", "constraints"]

#: Painted pixels, and others, that are enough to tell.
ENOUGH = 2**12

#: By how much closer the painting must be without it, in ΔE and of what is missed.
CLOSER, CLOSER_SHARE = 1.0, 0.2


def held_back_by(solution: Solution) -> tuple[Held, ...]:
    """What keeps the lights notably farther from the painting than they could come.

    Of one view. Each that lets go of half of it alone; all where it takes all.
    """
    asked = _asked(solution.problem)
    if not asked or solution.whole is not None:
        return ()
    few = _few(solution.problem)
    look = Looking.at(few)

    def missed(weights: Doubles) -> float:
        return look.mean(look.missed(look.of(few.basis.mix(weights))))

    def without(*those: Held) -> float:
        return now - missed(solution_of(_let_go(few, those)).weights)

    now = missed(solution.weights)
    gained = without(*asked)
    if gained < max(CLOSER, CLOSER_SHARE * now):
        return ()
    if len(asked) == 1:
        return asked
    return tuple(one for one in asked if without(one) > gained / 2) or asked


def _asked(problem: Problem) -> tuple[Held, ...]:
    """What is asked at all."""
    fit, asked = problem.fit, problem.constraints
    on: dict[Held, bool] = {
        "hold": bool(fit.hold or fit.unpainted),
        "colors": fit.colors != "free",
        "constraints": bool(asked),
    }
    return tuple(name for name, is_on in on.items() if is_on)


def _let_go(problem: Problem, those: tuple[Held, ...]) -> Problem:
    """The problem without some of what is asked."""
    change: dict[str, Any] = {}
    if "hold" in those:
        change |= {"hold": 0.0, "unpainted": 0.0}
    if "colors" in those:
        change["colors"] = "free"
    constraints = Constraints() if "constraints" in those else problem.constraints
    return _problem(problem, problem.views.targets[0], constraints, replace(problem.fit, **change))


def _problem(of: Problem, target: Target, constraints: Constraints, fit: Fit) -> Problem:
    made = Problem.of(of.basis, target, constraints=constraints, fit=fit)
    return replace(made, start=of.start)


def _few(problem: Problem) -> Problem:
    """The same of some of its pixels, in one row: as many painted ones and others."""
    [target], basis = problem.views.targets, problem.basis
    painted = (target.importance > 0).ravel()
    chosen = np.sort(np.concatenate([_some(painted), _some(~painted)]))

    def cut(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return image.reshape(1, -1, *image.shape[2:])[:, chosen]

    def planes(images: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return images.reshape(len(images), 1, -1, 3)[:, :, chosen]

    row = replace(
        basis.asking(type(basis.asked)()),
        images=planes(basis.images),
        half_differences=planes(basis.half_differences),
        emitters_seen=cut(basis.emitters_seen),
        learned=None,
        features=None,
    )
    its = replace(
        target,
        image=cut(target.image),
        importance=cut(target.importance),
        at_least=None if target.at_least is None else cut(target.at_least),
    )
    return _problem(replace(problem, basis=row), its, problem.constraints, problem.fit)


def _some(where: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    found = np.flatnonzero(where)
    return found[:: max(len(found) // ENOUGH, 1)]
