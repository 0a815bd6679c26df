"""What is asked beside the painting, and whether it keeps the lights from what was painted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.analysis.looking import Looking
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.target.target import Target

#: What may hold the lights back: unpainted pixels, their colours, what is asked of single ones, and
#: the paintings of other views.
Held = Literal["hold", "colors", "constraints", "views"]

#: Painted pixels, and others, that are enough to tell, of all views together.
ENOUGH = 2**11

#: By how much closer the painting must be without it, in ΔE and of what is missed.
CLOSER, CLOSER_SHARE = 1.0, 0.2


def held_back_by(solution: Solution) -> tuple[tuple[Held, ...], tuple[str, ...]]:
    """What keeps the lights notably farther from the painting than they could come.

    Of one view. Each that lets go of half of it alone; all where it takes several, first the one
    beside which the others bring least. And where other views do, which of them, in the same way.
    """
    few = _Few.of(solution)
    if not few.asked:
        return (), ()
    now = few.missed(solution.weights)

    def without(*those: Held, views: Sequence[int] = few.others) -> float:
        return now - few.missed(few.solved(those, views))

    gained = without(*few.asked)
    if gained < max(CLOSER, CLOSER_SHARE * now):
        return (), ()
    held = few.asked
    if len(held) > 1:
        alone = tuple(one for one in held if without(one) > gained / 2)
        held = alone or tuple(sorted(held, key=lambda kept: without(*set(held) - {kept})))
    if "views" not in held:
        return held, ()
    its = few.others
    if len(its) > 1:
        part = without("views") / 2
        its = [k for k in its if without("views", views=[k]) > part] or its
    return held, tuple(few.names[k] for k in its)


@dataclass(frozen=True)
class _Few:
    """Some of the pixels of all views, each view in one row.

    problem: of all pixels of all views. mine: which of the views it is about. names: of the views.
    """

    problem: Problem
    bases: Sequence[Basis]
    targets: Sequence[Target]
    mine: int
    names: tuple[str, ...]
    look: Looking

    @staticmethod
    def of(solution: Solution) -> "_Few":
        problem = (solution.whole or solution).problem
        views = problem.views
        mine = next(k for k, basis in enumerate(views.bases) if basis is solution.basis)
        painted = [(target.importance > 0).ravel() for target in views.targets]
        # One step for all views, so that each counts as much as it does.
        total, rest = (sum(int((x == is_it).sum()) for x in painted) for is_it in (True, False))
        steps = max(total // ENOUGH, 1), max(rest // ENOUGH, 1)
        bases, targets = [], []
        for basis, target, where in zip(views.bases, views.targets, painted, strict=True):
            its = [
                np.flatnonzero(x)[::step] for x, step in zip((where, ~where), steps, strict=True)
            ]
            made = _in_a_row(basis, target, np.sort(np.concatenate(its)))
            bases.append(made[0])
            targets.append(made[1])
        sensors = tuple(basis.origin.sensor for basis in views.bases)
        names = tuple(target.name for target in views.targets)
        alone = Problem.of(bases[mine], targets[mine], fit=problem.fit)
        return _Few(
            problem,
            bases,
            targets,
            mine,
            sensors if len(set(sensors)) == len(sensors) else names,
            Looking.at(alone),
        )

    @property
    def others(self) -> Sequence[int]:
        """The other views."""
        return [k for k in range(len(self.bases)) if k != self.mine]

    @property
    def asked(self) -> tuple[Held, ...]:
        """What is asked at all."""
        fit = self.problem.fit
        on: dict[Held, bool] = {
            "hold": bool(fit.hold or fit.unpainted),
            "colors": fit.colors != "free",
            "constraints": bool(self.problem.constraints),
            "views": bool(self.others),
        }
        return tuple(name for name, is_on in on.items() if is_on)

    def missed(self, weights: Doubles) -> float:
        """Mean ΔE of the view."""
        look = self.look
        return look.mean(look.missed(look.of(self.bases[self.mine].mix(weights))))

    def solved(self, without: Sequence[Held], views: Sequence[int]) -> Doubles:
        """The best weights, (n, 3), without some of what is asked. views: those that are let go."""
        change: dict[str, Any] = {}
        if "hold" in without:
            change |= {"hold": 0.0, "unpainted": 0.0}
        if "colors" in without:
            change["colors"] = "free"
        gone = set(views) if "views" in without else set()
        left = [k for k in range(len(self.bases)) if k not in gone]
        problem = Problem.of(
            [self.bases[k] for k in left],
            [self.targets[k] for k in left],
            constraints=Constraints() if "constraints" in without else self.problem.constraints,
            fit=replace(self.problem.fit, **change),
        )
        return solution_of(replace(problem, start=self.problem.start)).weights


def _in_a_row(basis: Basis, target: Target, chosen: npt.NDArray[np.intp]) -> tuple[Basis, Target]:
    """Some of the pixels of a view. chosen: (p,), which."""

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
        objects=None,
    )
    its = replace(
        target,
        image=cut(target.image),
        importance=cut(target.importance),
        at_least=None if target.at_least is None else cut(target.at_least),
    )
    return row, its
