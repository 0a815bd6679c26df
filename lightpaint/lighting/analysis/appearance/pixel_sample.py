"""A sample of the pixels of all views, on which an answer is solved again without some reasons."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, block_means, read_look
from lightpaint.images import Estimate, block_mean, block_sums, whole_factor
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.analysis.appearance.held_answer import answer_released
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.light_constraints import (
    ALL_LIGHTS_KINDS,
    ConstraintKind,
    ConstraintsByLight,
)
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.joined_views import Views
from lightpaint.lighting.loss.painting import importance_sums, unpainted_weight
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.target import Target, find_wishes

#: Lights beyond which their colours are not tried as a reason.
MAX_COLORED_LIGHTS = 300

#: Groups of reasons: the hold of unpainted pixels, colours of lights, constraints, and the
#: paintings of other views.
LimitGroup = Literal["hold", "colors", "constraints", "views"]

#: Painted pixels, and unpainted ones, of a sufficient sample, in all views together.
SAMPLE_PIXELS = 2**11


def limit_groups(problem: Problem) -> tuple[LimitGroup, ...]:
    """Return the groups of reasons besides the painting that are in force, in all views.

    Of many lights the choice of colours is left out: a solve with each in any colour would take as
    long as the answer.
    """
    fit = problem.fit
    on: dict[LimitGroup, bool] = {
        "hold": bool(fit.hold or fit.unpainted),
        "colors": fit.colors != "free" and len(problem.lights) <= MAX_COLORED_LIGHTS,
        "constraints": bool(problem.constraints),
        "views": len(problem.views) > 1,
    }
    return tuple(name for name, is_on in on.items() if is_on)


@dataclass(frozen=True)
class PixelSample:
    """A sample of the pixels of all views, each view in one row.

    problem: of all pixels of all views. view_index: of the analysed view. names: of the views.
    weights: (n, 3), the answer. limited: indices of the lights whose own constraints limit it.
    """

    problem: Problem
    bases: Sequence[Basis]
    targets: Sequence[Target]
    view_index: int
    names: tuple[str, ...]
    look: PaintComparison
    weights: Doubles
    limited: frozenset[int]
    _shares: dict[tuple[frozenset[LimitGroup], tuple[int, ...]], float] = field(
        default_factory=dict
    )

    @staticmethod
    def of(solution: Solution, area: Floats | None = None) -> "PixelSample":
        """Return a sample of the pixels that `solution`, or the solution it is a part of, met.

        area: (h, w), the part of the view's paint of which errors count; None for all of it.
        """
        problem = (solution.whole or solution).problem
        view_index = next(
            k for k, basis in enumerate(problem.views.bases) if basis is solution.basis
        )
        views = _average_blocks(problem.views, problem.block_side)
        painted = [(target.importance > 0).ravel() for target in views.targets]
        # One step for all views, so that each keeps its weight.
        total, rest = (sum(int((x == is_it).sum()) for x in painted) for is_it in (True, False))
        steps = max(total // SAMPLE_PIXELS, 1), max(rest // SAMPLE_PIXELS, 1)
        bases, targets, places = [], [], []
        for basis, target, is_painted in zip(views.bases, views.targets, painted, strict=True):
            chosen = [
                np.flatnonzero(x)[::step]
                for x, step in zip((is_painted, ~is_painted), steps, strict=True)
            ]
            places.append(np.sort(np.concatenate(chosen)))
            sampled = _pixel_row(basis, _with_wishes(target, basis), places[-1])
            bases.append(sampled[0])
            targets.append(sampled[1])
        sensors = tuple(basis.origin.sensor for basis in views.bases)
        names = tuple(target.name for target in views.targets)
        look = PaintComparison.of_problem(
            Problem.of(bases[view_index], targets[view_index], fit=problem.fit)
        )
        if area is not None:
            factor = whole_factor(area.shape, views.bases[view_index].size) or 1
            look = look.within(block_mean(area, factor).ravel()[None, places[view_index]])
        return PixelSample(
            problem,
            bases,
            targets,
            view_index,
            sensors if len(set(sensors)) == len(sensors) else names,
            look,
            solution.weights,
            frozenset(k for k, x in enumerate(solution.lighting.lights) if x.is_active),
        )

    @property
    def other_views(self) -> Sequence[int]:
        """The indices of the other views."""
        return [k for k in range(len(self.bases)) if k != self.view_index]

    @property
    def groups(self) -> tuple[LimitGroup, ...]:
        """The groups of reasons besides the painting that are in force."""
        return limit_groups(self.problem)

    @cached_property
    def by_light(self) -> ConstraintsByLight:
        """The constraints on each light."""
        return ConstraintsByLight.of(self.problem.constraints, self.problem.basis.lights)

    @cached_property
    def pull(self) -> Doubles:
        """(n,), the initial effect of each light on the error if it moved alone.

        It is relative to the light's power in the picture, so that lights compare.
        """
        problem = self.problem
        gradient = np.abs(problem.equations.gradient(self.weights)).sum(axis=1)
        power = np.sqrt(np.einsum("cii->ic", problem.equations.M).sum(axis=1))
        return np.asarray(gradient / np.where(power > 0, power, 1))

    @cached_property
    def current_error(self) -> float:
        """Loss of the answer over the painted pixels."""
        return self.cost(self.weights)

    def cost(self, weights: Doubles) -> float:
        """Return the error of weights (n, 3) over the paint of the view, in the fit."""
        look = self.look
        return look.mean(look.fit_errors(look.pixels(self.bases[self.view_index].mix(weights))))

    def share_of(self, weights: Doubles) -> float:
        """Return the share of the error that these weights (n, 3) avoid."""
        return 1 - self.cost(weights) / self.current_error

    def share(self, without: Collection[LimitGroup], views: Sequence[int] | None = None) -> float:
        """Return that share for the best weights without some groups of reasons.

        views: those to release with the group `views`; all others by default. Results are cached.
        """
        views = self.other_views if views is None else views
        key = frozenset(without), tuple(views)
        if key not in self._shares:
            self._shares[key] = self.share_of(self.solve(without, views))
        return self._shares[key]

    def share_without(self, kind: ConstraintKind, lights: Collection[int]) -> float:
        """Return that share without one kind of constraint on some lights, by their places."""
        constraints = self.by_light.without(kind, lights)
        return self.share_of(self.solve((), self.other_views, constraints=constraints))

    def light_names(self, kind: ConstraintKind, lights: Collection[int]) -> tuple[str, ...]:
        """Return names of lights under one kind of constraint; none for kinds that apply to all."""
        if kind in ALL_LIGHTS_KINDS:
            return ()
        return tuple(self.by_light.lights[k].name for k in lights)

    def limiting_views(self, kind: LimitGroup) -> tuple[str, ...]:
        """Return names of the views that hold the lights, for the group `views`."""
        if kind != "views":
            return ()
        views = self.other_views
        if len(views) > 1:
            part = self.share(["views"]) / 2
            views = [k for k in views if self.share(["views"], views=[k]) > part] or views
        return tuple(self.names[k] for k in views)

    def solve(
        self,
        without: Collection[LimitGroup],
        views: Sequence[int],
        *,
        constraints: Constraints | None = None,
        hold: float | None = None,
    ) -> Doubles:
        """Solve for the best weights, (n, 3), without some groups of reasons.

        views: those to release with the group `views`. constraints, hold: instead of the current
        ones.
        """
        released = set(views) if "views" in without else set()
        remaining = [k for k in range(len(self.bases)) if k not in released]
        fit = self.problem.fit if hold is None else replace(self.problem.fit, hold=hold)
        change: dict[str, Any] = {"hold": 0.0, "unpainted": 0.0}
        if "hold" not in without:
            change["unpainted"] = self._unpainted_weight(fit, remaining)
        if "colors" in without:
            change["colors"] = "free"
        in_force = self.problem.constraints if constraints is None else constraints
        problem = Problem.of(
            [self.bases[k] for k in remaining],
            [self.targets[k] for k in remaining],
            constraints=Constraints() if "constraints" in without else in_force,
            fit=replace(fit, **change),
        )
        begin = replace(
            problem, start=self.problem.start, tether=self._scaled(self.problem.tether, problem)
        )
        return answer_released(begin, self._scaled(self.problem.holding, problem)).weights

    def _scaled(self, pull: NormalEquations | None, sampled: Problem) -> NormalEquations | None:
        """Return a pull to other lights in the scale of the sample: it is no reason that could be
        released.
        """
        if pull is None:
            return None
        return pull.scaled(float(sampled.power.sum() / max(self.problem.power.sum(), 1e-300)))

    def _unpainted_weight(self, fit: Fit, remaining: Sequence[int]) -> float:
        """Return the weight of each of the sampled unpainted pixels of some views.

        Relative to the painted ones, they weigh as much as all unpainted pixels do.
        """
        (painted, rest), (few_painted, few_rest) = (
            importance_sums(
                Views(
                    tuple(views.bases[k] for k in remaining),
                    tuple(views.targets[k] for k in remaining),
                )
            )
            for views in (self.problem.views, Views(tuple(self.bases), tuple(self.targets)))
        )
        if few_rest <= 0 or painted <= 0:
            return 0.0
        return unpainted_weight(painted, rest, fit) * (rest / few_rest) * (few_painted / painted)


def _average_blocks(views: Views, side: int) -> Views:
    """Average the pixels of views in blocks, if single ones are mostly noise.

    Incomplete blocks at the right and at the bottom are left out.
    """
    sizes = [[side * (n // side) for n in basis.size] for basis in views.bases]
    parts = zip(views.targets, sizes, strict=True)
    if side == 1 or not all(target.importance[:h, :w].any() for target, (h, w) in parts):
        return views
    bases, targets = [], []
    for basis, target, (height, width) in zip(views.bases, views.targets, sizes, strict=True):
        averaged = target.cropped(height, width).reduced(side)
        unseen = ~basis.emitters_seen[:height, :width]
        counts = unseen.astype(np.float64)
        images, halves = (block_means(x, counts, side) for x in (basis.planes, basis.noise))
        former = basis.former
        if former is not None:
            pictures = (former.image, former.half_difference)
            safe = np.maximum(block_sums(counts, side), 1)[..., None]
            former = Estimate(*(block_sums(_cropped(x, counts), side) / safe for x in pictures))
        bases.append(basis.on_pixels(images, halves, block_sums(counts, side) == 0, former))
        targets.append(averaged)
    return Views(tuple(bases), tuple(targets))


def _cropped(image: Floats, counts: Doubles) -> Floats:
    """Return the pixels of whole blocks, those that do not count as 0."""
    return image[: counts.shape[0], : counts.shape[1]] * counts[..., None]


def _with_wishes(target: Target, basis: Basis) -> Target:
    """Return the target with its wishes separated, which takes pixels at their places."""
    found = find_wishes(target, read_look(basis))
    return replace(target, wishes=tuple(replace(wish, has_strokes=False) for wish in found))


def _pixel_row(basis: Basis, target: Target, chosen: npt.NDArray[np.intp]) -> tuple[Basis, Target]:
    """Return some of the pixels of a view as one row. chosen: (p,), places of the pixels."""

    def cut(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return image.reshape(1, -1, *image.shape[2:])[:, chosen]

    former = basis.former
    if former is not None:
        former = Estimate(cut(former.image), cut(former.half_difference))
    picked = basis.planes.picked(chosen), basis.noise.picked(chosen)
    row = basis.with_requests(type(basis.requests)()).on_pixels(
        *picked, cut(basis.emitters_seen), former
    )
    target_row = replace(
        target,
        image=cut(target.image),
        importance=cut(target.importance),
        at_least=None if target.at_least is None else cut(target.at_least),
        wishes=tuple(replace(wish, area=cut(wish.area)) for wish in target.wishes),
    )
    return row, target_row
