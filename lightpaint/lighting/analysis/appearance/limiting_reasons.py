"""Reasons that keep the lights from what was painted, and what each of them costs.

All shares are of what the answer misses of the paint, Σ D ‖V(ψ) − V(x)‖², which is what the fit
minimises there; for each the problem is solved again, of enough of the pixels.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import as_planes
from lightpaint.images.pixel_blocks import block_sums
from lightpaint.lighting.analysis.appearance.constraint_kinds import (
    ConstraintKind,
    ConstraintsByLight,
)
from lightpaint.lighting.analysis.appearance.display_difference import Looking
from lightpaint.lighting.analysis.appearance.unpainted_change import Elsewhere, what_changes
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.painting import painted_and_rest, rest_weight
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.lighting.views import Views
from lightpaint.target.target import Target

#: What may hold the lights back: unpainted pixels, their colours, what is asked of single ones, and
#: the paintings of other views.
Held = Literal["hold", "colors", "constraints", "views"]

#: Painted pixels, and others, that are enough to tell, of all views together.
ENOUGH = 2**11

#: Share of what is missed from which on a reason is known, and from which on a headline names it.
KNOWN, NAMED = 0.05, 1 / 3

#: Reasons tie that bring this part of what the best one does.
TIED = 0.9

#: Part of what letting go of all that is asked brings that one thing alone must bring; else it
#: takes several.
ALONE = 0.5

#: Part of what all lights of whom the same is asked would bring that some of them must, to be
#: named alone, and how many these are at most.
NEARLY, FEW_LIGHTS = 0.75, 3

#: Part of what no hold would bring that a weaker one must. Measured (docs/benchmarks.md): in the
#: mean of two scenes a half brings the answer nearer to what was meant than any other part tried.
GRADUALLY = 0.5

#: Steps in which the hold is sought, between itself and the part of it that is as good as none.
STEPS, AS_GOOD_AS_NONE = 6, 1e-3


@dataclass(frozen=True)
class Loosening:
    """The strongest hold that still brings about half of what none would.

    Attributes:
        hold: Its strength; 0 where no weaker one does.
        share: Of what is missed of the paint, what it takes away.
        elsewhere: What it changes in the picture that is shown now, where nobody painted.
    """

    hold: float
    share: float
    elsewhere: Elsewhere | None


@dataclass(frozen=True)
class Reason:
    """One thing that keeps the lights from the paint.

    Attributes:
        kind: `hold`, `colors` or `views`; or what was asked of lights.
        names: Of the lights of which it was asked; of the views; none of the rest.
        share: Of what is missed of the paint, what would be met without this alone; of one of
            several that only help together, without all of them.
        is_joint: Whether it is one of several that only help together.
        loosening: Of a hold, what to do about it.
    """

    kind: Literal["hold", "colors", "views"] | ConstraintKind
    names: tuple[str, ...] = ()
    share: float = 1.0
    is_joint: bool = False
    loosening: Loosening | None = None

    @property
    def is_by_hand(self) -> bool:
        """Whether a person asked it of lights."""
        return self.kind not in ("hold", "colors", "views")

    @property
    def held(self) -> Held:
        """Which of the four that hold lights back it is."""
        if self.kind == "hold" or self.kind == "colors" or self.kind == "views":
            return self.kind
        return "constraints"


def reasons_of(solution: Solution) -> tuple[Reason, ...]:
    """Find what keeps the lights from the painting of one view, what would bring most first.

    What a person asked of lights goes before what ties with it. Where no single thing brings half
    of what all together do, it takes several: first the one beside which the others bring least.
    """
    sample = _PixelSample.of(solution)
    if not sample.asked or sample.now <= 0:
        return ()
    everything = sample.share(sample.asked)
    if everything < KNOWN:
        return ()
    found: list[Reason] = []
    for kind in sample.asked:
        if kind == "constraints":
            found += _by_hand(sample)
        else:
            found.append(Reason(kind, sample.others_that_matter(kind), sample.share([kind])))
    found = _ordered([reason for reason in found if reason.share >= KNOWN])
    if (not found or found[0].share < ALONE * everything) and len(sample.asked) > 1:
        return _joint(sample, everything)
    return tuple(
        replace(reason, loosening=_loosened(solution, sample, reason.share))
        if reason.kind == "hold"
        else reason
        for reason in found
    )


def _ordered(reasons: Sequence[Reason]) -> list[Reason]:
    """Sort by what brings most; of what ties with that, what a person asked of lights is first."""
    tied = TIED * max((reason.share for reason in reasons), default=0.0)

    def rank(reason: Reason) -> tuple[bool, float]:
        comes_first = reason.share >= tied and reason.is_by_hand
        return not comes_first, -reason.share

    return sorted(reasons, key=rank)


def _by_hand(sample: "_PixelSample") -> list[Reason]:
    """Return what was asked of lights, by kind, with the fewest lights that bring nearly all."""
    by_light, found = sample.by_light, []
    for kind, lights in by_light.kinds().items():
        whole = sample.share_without(kind, lights)
        if whole < KNOWN:
            continue
        if kind in ("sparse", "prefer_current"):
            found.append(Reason(kind, (), whole))
            continue
        chosen, gained = lights, whole
        likely = sorted(lights, key=lambda k: -sample.pull[k])
        # One by one, of those that would move the picture most.
        alone = [(sample.share_without(kind, [k]), k) for k in likely[: 2 * FEW_LIGHTS]]
        best = [k for _, k in sorted(alone, key=lambda its: -its[0])]
        for count in range(1, min(FEW_LIGHTS, len(lights) - 1) + 1):
            some = sorted(best[:count])
            part = max(alone)[0] if count == 1 else sample.share_without(kind, some)
            if part >= NEARLY * whole:
                chosen, gained = tuple(some), part
                break
        found.append(Reason(kind, tuple(by_light.lights[k].name for k in chosen), gained))
    return found


def _joint(sample: "_PixelSample", everything: float) -> tuple[Reason, ...]:
    """Return all that is asked, where it takes several to bring something."""
    order = sorted(
        sample.asked, key=lambda kind: sample.share([x for x in sample.asked if x != kind])
    )
    found: list[Reason] = []
    for kind in order:
        if kind == "constraints":
            found += [
                Reason(constraint, sample.named(constraint, lights), everything, is_joint=True)
                for constraint, lights in sample.by_light.kinds().items()
            ]
        else:
            names = sample.others_that_matter(kind)
            found.append(Reason(kind, names, everything, is_joint=True))
    return tuple(found)


def _loosened(solution: Solution, sample: "_PixelSample", most: float) -> Loosening | None:
    """Find the strongest hold that brings `GRADUALLY` of `most`, what no hold would bring.

    Return None where what is not painted counts by the pixel.
    """
    fit = sample.problem.fit
    if fit.unpainted or not fit.hold:
        return None

    def brought(hold: float) -> tuple[float, Doubles]:
        weights = sample.solved((), sample.others, hold=hold)
        return sample.share_of(weights), weights

    # Between a hold that brings too little and one that brings enough, whose logarithms are halved.
    little, enough = float(fit.hold), float(fit.hold) * AS_GOOD_AS_NONE
    share, weights = brought(enough)
    if share < GRADUALLY * most:
        enough = 0.0
        share, weights = brought(enough)
    for _ in range(STEPS if enough else 0):
        between = round_down(float(np.sqrt(little * enough)))
        if not enough < between < little:
            break
        its, found = brought(between)
        if its >= GRADUALLY * most:
            enough, share, weights = between, its, found
        else:
            little = between
    [target] = solution.problem.views.targets
    basis = solution.basis
    before, after = (basis.mix(x) for x in (solution.weights, weights))
    look = Looking.at(solution.problem)
    changed = what_changes(look, basis, target.importance > 0, before, after)
    return Loosening(enough, share, changed)


def round_down(value: float) -> float:
    """Return the nearest number of two digits that is not larger; `value` > 0."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(f"{np.floor(value / unit * (1 + 1e-12)) * unit:.2g}")


@dataclass(frozen=True)
class _PixelSample:
    """Some of the pixels of all views, each view in one row.

    problem: of all pixels of all views. mine: which of the views it is about. names: of the views.
    weights: (n, 3), the answer.
    """

    problem: Problem
    bases: Sequence[Basis]
    targets: Sequence[Target]
    mine: int
    names: tuple[str, ...]
    look: Looking
    weights: Doubles
    _shares: dict[tuple[frozenset[Held], tuple[int, ...]], float] = field(default_factory=dict)

    @staticmethod
    def of(solution: Solution) -> "_PixelSample":
        problem = (solution.whole or solution).problem
        views = _in_blocks(problem.views, problem.block_side)
        mine = next(k for k, basis in enumerate(problem.views.bases) if basis is solution.basis)
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
        return _PixelSample(
            problem,
            bases,
            targets,
            mine,
            sensors if len(set(sensors)) == len(sensors) else names,
            Looking.at(alone),
            solution.weights,
        )

    @property
    def others(self) -> Sequence[int]:
        """The other views."""
        return [k for k in range(len(self.bases)) if k != self.mine]

    @property
    def asked(self) -> tuple[Held, ...]:
        """Names of what holds the lights beside the painting, those that are in force."""
        fit = self.problem.fit
        on: dict[Held, bool] = {
            "hold": bool(fit.hold or fit.unpainted),
            "colors": fit.colors != "free",
            "constraints": bool(self.problem.constraints),
            "views": bool(self.others),
        }
        return tuple(name for name, is_on in on.items() if is_on)

    @cached_property
    def by_light(self) -> ConstraintsByLight:
        """Constraints of each light."""
        return ConstraintsByLight.of(self.problem.constraints, self.problem.basis.lights)

    @cached_property
    def pull(self) -> Doubles:
        """(n,), how much each light would change what is missed if it were moved alone, at first.

        Relative to its power in the picture: by that it may be compared with others.
        """
        problem = self.problem
        gradient = np.abs(problem.equations.gradient(self.weights)).sum(axis=1)
        power = np.sqrt(np.einsum("cii->ic", problem.equations.M).sum(axis=1))
        return np.asarray(gradient / np.where(power > 0, power, 1))

    @cached_property
    def now(self) -> float:
        """Loss of the answer over the painted pixels."""
        return self.cost(self.weights)

    def cost(self, weights: Doubles) -> float:
        """Return what weights (n, 3) miss of the paint of the view, as the fit counts it."""
        look = self.look
        return look.mean(look.costs(look.of(self.bases[self.mine].mix(weights))))

    def share_of(self, weights: Doubles) -> float:
        """Return the share of what is missed that these weights (n, 3) would not miss."""
        return 1 - self.cost(weights) / self.now

    def share(self, without: Collection[Held], views: Sequence[int] | None = None) -> float:
        """Return that share for the best weights without some of what is asked.

        views: those let go where views are; all others by default. Each is solved for once.
        """
        views = self.others if views is None else views
        key = frozenset(without), tuple(views)
        if key not in self._shares:
            self._shares[key] = self.share_of(self.solved(without, views))
        return self._shares[key]

    def share_without(self, kind: ConstraintKind, lights: Collection[int]) -> float:
        """Return that share without one kind of constraint on some lights, by their places."""
        asked = self.by_light.without(kind, lights)
        return self.share_of(self.solved((), self.others, constraints=asked))

    def named(self, kind: ConstraintKind, lights: Collection[int]) -> tuple[str, ...]:
        """Return names of lights under one kind of constraint; none of what is asked of all."""
        if kind in ("sparse", "prefer_current"):
            return ()
        return tuple(self.by_light.lights[k].name for k in lights)

    def others_that_matter(self, kind: Held) -> tuple[str, ...]:
        """Return names of the views that hold, where that is what holds."""
        if kind != "views":
            return ()
        its = self.others
        if len(its) > 1:
            part = self.share(["views"]) / 2
            its = [k for k in its if self.share(["views"], views=[k]) > part] or its
        return tuple(self.names[k] for k in its)

    def solved(
        self,
        without: Collection[Held],
        views: Sequence[int],
        *,
        constraints: Constraints | None = None,
        hold: float | None = None,
    ) -> Doubles:
        """Solve for the best weights, (n, 3), without some of what is asked.

        views: those that are let go where views are. constraints, hold: instead of those there are.
        """
        gone = set(views) if "views" in without else set()
        left = [k for k in range(len(self.bases)) if k not in gone]
        fit = self.problem.fit if hold is None else replace(self.problem.fit, hold=hold)
        change: dict[str, Any] = {"hold": 0.0, "unpainted": 0.0}
        if "hold" not in without:
            change["unpainted"] = self._weight_of_rest(fit, left)
        if "colors" in without:
            change["colors"] = "free"
        asked = self.problem.constraints if constraints is None else constraints
        problem = Problem.of(
            [self.bases[k] for k in left],
            [self.targets[k] for k in left],
            constraints=Constraints() if "constraints" in without else asked,
            fit=replace(fit, **change),
        )
        begin = replace(problem, start=self.problem.start)
        return solution_of(begin).weights

    def _weight_of_rest(self, fit: Fit, left: Sequence[int]) -> float:
        """Return the weight of each of the few unpainted pixels of some views.

        Together they count beside the painted ones what all there are do.
        """
        (painted, rest), (few_painted, few_rest) = (
            painted_and_rest(
                Views(tuple(views.bases[k] for k in left), tuple(views.targets[k] for k in left))
            )
            for views in (self.problem.views, Views(tuple(self.bases), tuple(self.targets)))
        )
        if few_rest <= 0 or painted <= 0:
            return 0.0
        return rest_weight(painted, rest, fit) * (rest / few_rest) * (few_painted / painted)


def _in_blocks(views: Views, side: int) -> Views:
    """Average the pixels of views in blocks, where single ones are mostly noise.

    What makes no whole block at the right and at the bottom is left out.
    """
    sizes = [[side * (n // side) for n in basis.size] for basis in views.bases]
    parts = zip(views.targets, sizes, strict=True)
    if side == 1 or not all(target.importance[:h, :w].any() for target, (h, w) in parts):
        return views
    bases, targets = [], []
    for basis, target, (height, width) in zip(views.bases, views.targets, sizes, strict=True):
        its = target.cropped(height, width).reduced(side)
        unseen = ~basis.emitters_seen[:height, :width]
        total = block_sums(unseen.astype(np.float64), side)
        counts, safe = unseen[..., None], np.where(total > 0, total, 1)[..., None]
        images, halves = (
            np.stack([block_sums(x[:height, :width] * counts, side) / safe for x in planes])
            for planes in (basis.planes, basis.noise)
        )
        made = replace(
            basis,
            planes=as_planes(images.astype(np.float32)),
            noise=as_planes(halves.astype(np.float32)),
            emitters_seen=total == 0,
            learned=None,
            features=None,
            objects=None,
        )
        bases.append(made)
        targets.append(its)
    return Views(tuple(bases), tuple(targets))


def _in_a_row(basis: Basis, target: Target, chosen: npt.NDArray[np.intp]) -> tuple[Basis, Target]:
    """Return some of the pixels of a view as one row. chosen: (p,), places of the pixels."""

    def cut(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return image.reshape(1, -1, *image.shape[2:])[:, chosen]

    row = replace(
        basis.with_requests(type(basis.requests)()),
        planes=basis.planes.picked(chosen),
        noise=basis.noise.picked(chosen),
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
