"""Linear problems by their sums alone: M, b and norms, without images.

A literal fit in linear light needs nothing else of a basis. Sums of parts of a picture add, so that
each machine can sum its part of the basis and send no image.
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.errors import TargetError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.constraints.start_lighting import start_weights
from lightpaint.lighting.fit import Fit, resolve_fit, resolve_for_targets
from lightpaint.lighting.linear_problem import SummedProblem, reduce_lights
from lightpaint.lighting.loss.painting import ignored_paint
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.target.target import Target, titled


@dataclass(frozen=True)
class Sums:
    """Sums over a part of a picture. power: (n, 3), see `Basis`."""

    equations: NormalEquations
    power: Doubles

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(self.equations + other.equations, self.power + other.power)


def reason_against_sums(target: Target, fit: Fit) -> str:
    """Return the reason why sums do not suffice for a problem; "" if they do."""
    resolved = resolve_for_targets(fit, [target])
    if resolved.space != "linear":
        return "it is fitted as a display shows it"
    if resolved.hold or resolved.unpainted:
        return "what is not painted is held"
    if resolved.colors == "gentle":
        return "lights are held to their colours"
    if target.over_look and not fit.literal:
        return "what paint over emitters means depends on what is around them"
    if target.at_least is not None and target.at_least[target.importance > 0].any():
        return "brighter than some of the painting is as good"
    return ""


def sum_rows(basis: Basis, target: Target, rows: slice, fit: Fit) -> Sums:
    """Sum over some rows. basis: of these rows alone; target: of the whole picture."""
    importance = row_importance(target, basis.emitters_seen, rows, fit)
    equations = NormalEquations.of(basis, target.image[rows], importance)
    return Sums(equations, basis.power)


def row_importance(target: Target, seen: Bools, rows: slice, fit: Fit) -> Floats:
    """Return the weight of each pixel of some rows.

    seen: (rows, w), where an emitter is visible.
    """
    importance = target.importance[rows]
    if not importance.any():  # a target would refuse that
        return importance
    part = Target(
        target.name,
        target.image[rows],
        importance,
        everything=target.everything,
        files=target.files,
    )
    return np.where(ignored_paint(part, seen, fit.emitters), np.float32(0), importance)


def summed_problem(
    lights: Lights,
    name: str,
    sums: Sums,
    *,
    constraints: Constraints,
    fit: Fit,
    scene_identity: str = "",
    spp: int | None = None,
) -> SummedProblem:
    """Make the problem that has these sums.

    name: of the target. scene_identity, spp: see `LinearProblem`. Raises TargetError if no pixel
    counts.
    """
    if not sums.equations.target_norm2.any() and not sums.equations.M.any():
        raise TargetError(
            f"{titled(name)}: no light reaches a painted pixel that counts; paint others, too, or "
            'pass emitters="count"'
        )
    all_constraints, fit = constraints_of(lights.requests).and_then(constraints), resolve_fit(fit)
    reduction = reduce_lights(all_constraints, lights, fit)
    return SummedProblem(
        name=name,
        lights=lights,
        power=sums.power,
        equations=sums.equations,
        constraints=all_constraints,
        reduction=reduction,
        full=reduction,
        fit=fit,
        start=start_weights(all_constraints.start, lights),
        scene_identity=scene_identity,
        spp=spp,
    )
