"""Several views of a scene as one long picture, so that what holds for one holds for all.

A pixel counts the same in whichever view it is, and neither the normal equations nor the noise
in them asks where a pixel lies. Put behind each other, the pixels of all views are one picture,
and the solve, its error bars and its refinement need not know of views at all.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.view import View
from lightpaint.errors import BasisError
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.lighting import Lighting
from lightpaint.lighting.loss import Loss
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solve import Solution, problem_of, solution_of, with_objective
from lightpaint.target.target import Target

#: Pixels in a row of the long picture. The last row is filled with pixels that count nothing.
ROW = 2**10


def solve_views(
    views: Sequence[tuple[Basis, Target]],
    *,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    start: Lighting | None = None,
    method: Method = "polished",
    view: View | None = None,
) -> list[Solution]:
    """Find the one lighting that comes closest to the targets of several views together.

    views: basis and target of each, the bases all of the same lights. The normal equations of
    the views add, so that a pixel counts the same in whichever view it is.
    Returns a solution for each view, all with the same lights. Other arguments and errors as
    of `solve`, and BasisError for other lights.
    """
    basis, bases = joint_basis([basis for basis, _ in views])
    problems = [
        problem_of(
            basis, target, constraints=constraints, unpainted=unpainted, method=method, view=view
        )
        for basis, (_, target) in zip(bases, views, strict=True)
    ]
    begin = basis.present_weights if start is None else start.weights_for(basis)
    joint = solution_of(basis, joint_problem(problems, bases), start=begin)
    return parted(joint, problems, bases)


def check_same_lights(a: Basis, b: Basis) -> None:
    """Raise BasisError unless two bases have the same lights, which do and emit the same."""
    if a.names != b.names:
        raise BasisError(
            f"the bases of {a.origin.sensor} and {b.origin.sensor} have other lights, "
            f"{', '.join(a.names)} and {', '.join(b.names)}: make both of one scene"
        )
    for one, other in zip(a.lights, b.lights, strict=True):
        for what in ("unit", "members", "is_fixed", "is_scalar", "emission"):
            if (its := getattr(one, what)) != (others := getattr(other, what)):
                raise BasisError(
                    f"light {one.name!r} has {_spoken(what, its)} in the basis of "
                    f"{a.origin.sensor} and {_spoken(what, others)} in that of {b.origin.sensor}: "
                    "make both of one scene as it is"
                )


def _spoken(what: str, value: Any) -> str:
    """A property of a light, as a noun."""
    if what == "is_fixed":
        return "no weight of its own" if value else "a weight of its own"
    if what == "is_scalar":
        return "one weight for all channels" if value else "a weight for each channel"
    if what == "emission":
        return "the emission " + " ".join(f"{v:g}" for v in value)
    return f"the {what} {value if isinstance(value, str) else ', '.join(value)}"


def joint_basis(bases: Sequence[Basis]) -> tuple[Basis, list[Basis]]:
    """The basis of all views together, n long pictures, and the bases again.

    Those returned look at the memory of the joint one, so that whoever lets go of those given
    holds every pixel once. Raises BasisError if their lights are not the same.
    """
    first = bases[0]
    if len(bases) == 1:
        return first, [first]
    for basis in bases[1:]:
        check_same_lights(first, basis)
    ends = np.cumsum([0, *(basis.emitters_seen.size for basis in bases)])
    rows = -(-int(ends[-1]) // ROW)
    planes = np.zeros((2, len(first.lights), rows * ROW, 3), np.float32)
    for basis, (start, end) in zip(bases, pairwise(ends), strict=True):
        for plane, images in zip(planes, (basis.images, basis.half_differences), strict=True):
            plane[:, start:end] = images.reshape(len(plane), -1, 3)
    images, half_differences = planes.reshape(2, -1, rows, ROW, 3)
    joint = replace(
        first,
        images=images,
        half_differences=half_differences,
        emitters_seen=_in_rows([basis.emitters_seen for basis in bases]),
        learned=None,
    )
    views = [
        replace(
            basis,
            images=planes[0, :, start:end].reshape(basis.images.shape),
            half_differences=planes[1, :, start:end].reshape(basis.images.shape),
        )
        for basis, (start, end) in zip(bases, pairwise(ends), strict=True)
    ]
    return joint, views


def joint_problem(problems: Sequence[Solution], bases: Sequence[Basis]) -> Solution:
    """The problem of all views together, for their joint basis; itself if there is one.

    bases: of the views, in the same order.
    """
    first = problems[0]
    if len(problems) == 1:
        return first
    names = [problem.lighting.target for problem in problems]
    equations = first.equations
    for problem in problems[1:]:
        equations += problem.equations
    return replace(
        first,
        lighting=replace(first.lighting, target=" + ".join(names)),
        image=_in_rows([problem.image for problem in problems]),
        importance=_in_rows([problem.importance for problem in problems]),
        current_share=_in_rows([problem.current_share for problem in problems]),
        equations=equations,
        solved=equations,
        constraints=next((p for p in problems if p.loss is not None), first).constraints,
        loss=_joint_loss(problems, bases),
    )


def _joint_loss(problems: Sequence[Solution], bases: Sequence[Basis]) -> Loss | None:
    """What a pixel of the long picture costs; None where that is one square for each channel."""
    view = next((p.loss.view for p in problems if p.loss is not None), None)
    if all(problem.loss is None for problem in problems):
        return None
    losses = [
        _loss_of_squares(problem, basis) if problem.loss is None else problem.loss
        for problem, basis in zip(problems, bases, strict=True)
    ]
    nowhere = [np.zeros(loss.painted.shape, bool) for loss in losses]
    at_least = [
        none if loss.at_least is None else loss.at_least
        for loss, none in zip(losses, nowhere, strict=True)
    ]
    return Loss(
        painted=_in_rows([loss.painted for loss in losses]),
        importance=_in_rows([loss.importance for loss in losses]),
        share=_in_rows([loss.share for loss in losses]),
        current=_in_rows([loss.current for loss in losses]),
        at_least=_in_rows(at_least),
        view=view,
    )


def _loss_of_squares(problem: Solution, basis: Basis) -> Loss:
    """The loss of a view that has one square for each channel, beside others that have not."""
    current, q = basis.mix(basis.present_weights), problem.current_share[..., None]
    painted = (problem.image - q * current) / np.where(q < 1, 1 - q, 1)
    return Loss(
        painted=np.where(q < 1, painted, 0),
        importance=problem.importance,
        share=problem.current_share,
        current=current,
    )


def joint_estimate(estimates: Sequence[Estimate]) -> Estimate:
    """Renders of all views, in the shape of their joint basis."""
    if len(estimates) == 1:
        return estimates[0]
    return Estimate(
        _in_rows([estimate.image for estimate in estimates]),
        _in_rows([estimate.half_difference for estimate in estimates]),
    )


def parted(joint: Solution, problems: Sequence[Solution], bases: Sequence[Basis]) -> list[Solution]:
    """Of each view its own problem, with the lighting that solves all of them.

    bases: of the views, in the same order.

    The quality says what that lighting misses of the view; its optimality is the joint one's.
    """
    if len(problems) == 1:
        return [joint]
    weights = np.array([light.weight for light in joint.lighting.lights])
    views, start = [], 0
    for problem, basis in zip(problems, bases, strict=True):
        if joint.loss is not None:
            problem = _reweighted_part(joint, problem, basis, start)
            start += problem.importance.size
        lighting = replace(
            joint.lighting,
            target=problem.lighting.target,
            # The error of the joint objective is not this view's.
            quality=replace(
                with_objective(basis, problem, joint.quality, weights), objective_error=None
            ),
        )
        views.append(replace(problem, lighting=lighting, tried=joint.tried, is_one_of_several=True))
    return views


def _reweighted_part(joint: Solution, problem: Solution, basis: Basis, start: int) -> Solution:
    """The part of the last linear problem that is of one view, which begins at pixel `start`."""
    assert joint.reweighting is not None
    size = problem.importance.shape

    def its(long: Floats) -> Floats:
        pixels = long.reshape(-1, 3)[start : start + size[0] * size[1]]
        return pixels.reshape(*size, 3)

    reweighting = replace(joint.reweighting, factor=its(joint.reweighting.factor))
    image, D = its(joint.image), problem.importance[..., None]
    equations = NormalEquations.of(basis, image, D * reweighting.factor)
    return replace(
        problem,
        image=image,
        current_share=its(joint.current_share),
        equations=equations,
        solved=equations,
        constraints=joint.constraints,
        loss=problem.loss or _loss_of_squares(problem, basis),
        reweighting=reweighting,
    )


def _in_rows(images: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """(rows, ROW, …) of images (h, w, …), zero where the last row is filled."""
    pixels = np.concatenate([x.reshape(-1, *x.shape[2:]) for x in images])
    fill = np.zeros((-len(pixels) % ROW, *pixels.shape[1:]), pixels.dtype)
    return np.concatenate([pixels, fill]).reshape(-1, ROW, *pixels.shape[1:])
