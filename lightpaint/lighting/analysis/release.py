"""What letting go of one thing alone would bring, of all that holds the lights back.

The gains are exact: the problem is solved again without that one thing. For which of them that
is worth while is decided by what moving these lights alone would bring, a lower limit of it.
"""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.analysis.held import Answer, Held, all_held
from lightpaint.lighting.bound import Bound
from lightpaint.lighting.constraints.constrained import constrained_optimum, preferring
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduction import Reduction, Unknown, channel_groups, reduce_to
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solve import Solution, chosen_reduction

#: Bounds for which the problem is solved again, those that seem to matter most: so many, and of
#: large problems about as many as WORK has unknowns, at least so many.
RELEASED, WORK, FEWEST = 32, 2048, 4

#: Share of ‖Ψ‖² below which a gain is round-off.
SMALLEST = 1e-12


def bounds_of(basis: Basis, solution: Solution) -> tuple[tuple[Bound, ...], int]:
    """What holds the lights of `solution`, the largest gain first, and how many more there are.

    For these, which seem to matter less, the problem was not solved again.
    """
    equations, constraints = solution.solved, solution.constraints or Constraints()
    if constraints.prefer_current:
        present = basis.present_weights
        equations = preferring(equations, basis, present, constraints.prefer_current)
    answer = _answer(basis, solution, equations)
    least = SMALLEST * float(solution.equations.target_norm2.sum())
    held = [h for h in all_held(answer) if h.estimate > least]
    held.sort(key=lambda h: -h.estimate)
    before, bounds = _value(solution.solved, answer.w), []
    size = len(answer.reduction.unknowns) // len(channel_groups(answer.reduction))
    for h in held[: min(max(WORK // max(size, 1), FEWEST), RELEASED)]:
        reduction, x = _without(answer, h)
        freed = constrained_optimum(equations, reduction, answer.w, x=x)
        gain = before - _value(solution.solved, freed.result.weights)
        if not constraints.prefer_current:
            gain = max(gain, 0.0)  # but for round-off it is
        names = tuple(basis.names[k] for k in h.lights)
        label = answer.full.labels[h.lights[0]]
        held_by = h.kind if h.kind in ("zero", "kept", "left out") else label
        bounds.append(Bound(names, h.kind, held_by, gain, h.multiplier, h.per))
    return tuple(sorted(bounds, key=lambda bound: -bound.gain)), len(held) - len(bounds)


def _answer(basis: Basis, solution: Solution, equations: NormalEquations) -> Answer:
    full = reduce_to(solution.constraints or Constraints(), basis.lights)
    reduction = chosen_reduction(basis, solution) if solution.constraints else full
    found = constrained_optimum(equations, reduction, solution.lighting.weights_for(basis))
    lit = equations.reached
    gradient = np.einsum("cij,jc->ic", equations.M, found.result.weights) - equations.b.T
    return Answer(
        basis,
        reduction,
        full,
        found,
        np.where(lit, gradient, 0),
        np.where(lit, np.einsum("cii->ic", equations.M), 0),
        tuple(light.is_active for light in solution.lighting.lights),
    )


def _value(equations: NormalEquations, w: Doubles) -> float:
    """The objective less ‖Ψ‖², without its round-off."""
    quadratic = np.einsum("ic,cij,jc->", w, equations.M, w, optimize=True)
    return float(quadratic - 2 * np.einsum("ci,ic->", equations.b, w))


def _without(o: Answer, held: Held) -> tuple[Reduction, Doubles]:
    """The reduction with that alone let go, and the answer in its unknowns."""
    unknowns, x = [*o.reduction.unknowns], o.found.x
    if held.kind in ("left out", "zero"):
        its = o.reduction.knobs[held.knob][1]
        for i in its:
            if held.kind == "left out":
                unknowns[i] = o.full.unknowns[i]
            elif x[i] == 0:
                unknowns[i] = replace(unknowns[i], lower=-np.inf, upper=0.0)
        return replace(o.reduction, unknowns=unknowns), x
    caps = {cap.unknowns[0]: cap for cap in o.reduction.caps}
    made, values = Reduction(o.reduction.held.copy(), [*o.reduction.labels]), list[float]()
    for lights, its in o.reduction.knobs:
        if not set(lights) & set(held.lights):
            cap = caps.get(its[0])
            limits = None
            if cap is not None:
                limits = (np.array(cap.coefficients), cap.lower, cap.upper)
            made.add([unknowns[i] for i in its], limits)
            values += [float(x[i]) for i in its]
    for k in held.lights:
        made.held[k] = 0
        colours = np.ones((1, 3)) if o.basis.lights[k].is_scalar else np.eye(3)
        made.add([Unknown(((k, colour),)) for colour in colours], None)
        values += o.w[k, : len(colours)].tolist()
    return made, np.array(values)
