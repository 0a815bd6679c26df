"""What was painted and asked at one time, for a solve that takes longer than a stroke."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.analysis import analyse
from lightpaint.lighting.analysis.appearance.appearance import NOTICED
from lightpaint.lighting.analysis.appearance.display_difference import Looking
from lightpaint.lighting.analysis.appearance.unpainted_change import what_changes
from lightpaint.lighting.analysis.noise.uncertainty import correct_noise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.paint.session.answer_messages import foreseen, why_not_closer
from lightpaint.paint.session.picture_table import Picture, small_picture
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.pipeline.settings import Settings
from lightpaint.target.target import Target


@dataclass(frozen=True)
class Moment:
    """A session as it was.

    version: of the session then. bases, targets: of each view; None where nothing was painted.
    transform: what was painted through.
    """

    version: int
    bases: tuple[Basis, ...]
    targets: tuple[Target | None, ...]
    wishes: Wishes
    settings: Settings
    constraints: Constraints
    transform: ViewTransform

    @property
    def painted(self) -> tuple[int, ...]:
        """The views in which something was: those that count."""
        return tuple(k for k, target in enumerate(self.targets) if target is not None)

    @property
    def painted_targets(self) -> tuple[Target, ...]:
        """What was painted in these."""
        return tuple(target for target in self.targets if target is not None)

    @property
    def sensors(self) -> tuple[str, ...]:
        """By which pictures of all views are told apart; "" of the only one there is."""
        if len(self.bases) == 1:
            return ("",)
        return tuple(basis.origin.sensor for basis in self.bases)

    @property
    def painted_sensors(self) -> tuple[str, ...]:
        """Of these views, by which their paintings are told apart; "" of the only one there is."""
        if len(self.bases) == 1:
            return ("",)
        return tuple(self.bases[k].origin.sensor for k in self.painted)

    def solution(self) -> Solution | None:
        """The exact answer; None where nothing is painted. Raises LightpaintError."""
        if not self.painted:
            return None
        solution = solution_of(self._problem(constraints=self.constraints, fit=self.settings))
        if self.settings.corrects_noise(is_known=self.bases[0].knows_noise):
            solution = correct_noise(solution)
        return solution

    def _problem(self, **how: Any) -> Problem:
        return Problem.of([self.bases[k] for k in self.painted], self.painted_targets, **how)

    def beyond(self, view: int = 0) -> tuple[list[str], npt.NDArray[np.uint8]]:
        """What no light can make of the painting of a view: sentences, and a picture (h, w) of
        where.

        The best with nothing else asked: nothing held, any colour, no constraints. 255 stands for
        what is missed by all that a display has.
        """
        target = self.targets[view]
        if target is None:
            nothing = np.zeros(self.bases[view].size, np.uint8)
            return ["Nothing is painted here yet."], nothing
        solution = self.solution()
        assert solution is not None
        analysis = analyse(solution)[self.painted.index(view)]
        best = solution_of(self._problem(fit=replace(self.settings, hold=0.0, colors="free")))
        transform = best.problem.fit.transform or ViewTransform()
        shown = transform.encode(self.bases[view].mix(best.weights))
        missed = np.abs(shown - transform.encode(target.image)).max(axis=-1)
        missed = np.where(target.importance > 0, np.clip(missed, 0, 1), 0)
        return why_not_closer(analysis), np.round(255 * missed).astype(np.uint8)

    def foresight(
        self, weights: Doubles, view: int = 0, *, clean: CleanPlanes | None = None
    ) -> "Foresight":
        """Find what the answer to this would change of the one there is, (n, 3), in a view.

        Where the view is not painted, how much closer another one comes is told. clean: planes of
        the view without their grain, to be shown.
        """
        solution = self.solution()
        after = weights if solution is None else solution.weights
        planes, transform = clean or self.bases[view], self.transform
        before, then = (small_picture(planes.mix(x), transform) for x in (weights, after))
        if solution is None:
            return Foresight(before, then, *foreseen(0.0, None, delta_e=(0, 0), is_at_cost=False))
        judged = view if view in self.painted else self.painted[0]
        its = solution.views[self.painted.index(judged)]
        look, target = Looking.at(its.problem), its.problem.views.targets[0]
        pictures = [self.bases[judged].mix(x) for x in (weights, after)]
        lights = [look.of(picture) for picture in pictures]
        cost_now, cost_then = (look.mean(look.costs(light)) for light in lights)
        closes = 1 - cost_then / cost_now if cost_now > 0 else 0.0
        rest = what_changes(look, self.bases[judged], target.importance > 0, *pictures)
        seen = look.mean(look.missed(lights[0])), look.mean(look.missed(lights[1]))
        gained = seen[0] - seen[1]
        is_at_cost = rest is not None and rest.worst > NOTICED and rest.delta_e > gained
        return Foresight(before, then, *foreseen(closes, rest, delta_e=seen, is_at_cost=is_at_cost))


@dataclass(frozen=True)
class Foresight:
    """What a change would do, before it is made.

    before, after: (h, w, 3) uint8, small pictures of the answer as a display shows it. text: what
    it would do. is_at_cost: whether it changes more than it brings.
    """

    before: Picture
    after: Picture
    text: str
    is_at_cost: bool
