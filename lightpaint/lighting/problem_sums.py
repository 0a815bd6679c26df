"""A linear problem by its sums alone: M, b and norms, without the images that they are sums of.

Where a painting is taken at its word in linear light, nothing else is asked of a basis. Sums of
parts of a picture add, so that whoever has a part of the basis need not show it.
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.errors import TargetError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.fit import Fit, meant_by, resolve_fit
from lightpaint.lighting.linear_problem import SummedProblem, reduced_by
from lightpaint.lighting.loss.painting import left_out
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.target.target import Target


@dataclass(frozen=True)
class Sums:
    """Of a part of a picture. power: (n, 3), as of `Basis`."""

    equations: NormalEquations
    power: Doubles

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(self.equations + other.equations, self.power + other.power)


def why_not_by_sums(target: Target, fit: Fit) -> str:
    """What of a problem its sums do not say; "" if they say it all."""
    meant = meant_by(fit, [target])
    if meant.space != "linear":
        return "it is fitted as a display shows it"
    if meant.hold or meant.unpainted:
        return "what is not painted is held"
    if meant.colors == "gentle":
        return "lights are held to their colours"
    if target.over_look and not fit.literal:
        return "what paint over emitters means depends on what is around them"
    if target.at_least is not None and target.at_least[target.importance > 0].any():
        return "brighter than some of the painting is as good"
    return ""


def sums_of(basis: Basis, target: Target, rows: slice, fit: Fit) -> Sums:
    """Those of some rows. basis: of these alone; target: of the whole picture."""
    importance = importance_of(target, basis.emitters_seen, rows, fit)
    equations = NormalEquations.of(basis, target.image[rows], importance)
    return Sums(equations, basis.power)


def importance_of(target: Target, seen: Bools, rows: slice, fit: Fit) -> Floats:
    """How much each pixel of some rows counts. seen: (rows, w), where an emitter is seen."""
    its = target.importance[rows]
    if not its.any():  # of which no target can be made
        return its
    part = Target(
        target.name, target.image[rows], its, everything=target.everything, files=target.files
    )
    return np.where(left_out(part, seen, fit.emitters), np.float32(0), its)


def problem_of_sums(
    lights: Lights,
    name: str,
    sums: Sums,
    *,
    constraints: Constraints,
    fit: Fit,
    scene_identity: str = "",
    spp: int | None = None,
) -> SummedProblem:
    """Return the problem whose sums these are.

    name: of the target. scene_identity, spp: as of `LinearProblem`. Raises TargetError if nothing
    counts.
    """
    if not sums.equations.target_norm2.any() and not sums.equations.M.any():
        raise TargetError(
            f"target {name}: no light reaches a painted pixel that counts; paint others, too, or "
            'pass emitters="count"'
        )
    asked, fit = constraints_of(lights.requests).and_then(constraints), resolve_fit(fit)
    reduction = reduced_by(asked, lights, fit)
    return SummedProblem(
        name=name,
        lights=lights,
        power=sums.power,
        equations=sums.equations,
        constraints=asked,
        reduction=reduction,
        full=reduction,
        fit=fit,
        start=lights.present_weights,
        scene_identity=scene_identity,
        spp=spp,
    )
