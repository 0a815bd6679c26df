"""A snapshot of a session's paintings and requests, for work that takes longer than a stroke."""

from dataclasses import dataclass, replace
from statistics import mean
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint import lighting
from lightpaint.arrays import Doubles
from lightpaint.basis import Basis, DenoisedPlanes
from lightpaint.colour import ViewTransform
from lightpaint.paint.session.picture_table import Picture, display_thumbnail
from lightpaint.paint.session.session_messages import preview_text, why_not_closer
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target import Target


@dataclass(frozen=True)
class SessionSnapshot:
    """The state of a session at one time.

    version: of the session then. bases, targets: of each view; None where nothing was painted.
    transform: the view transform of the painting.
    """

    version: int
    bases: tuple[Basis, ...]
    targets: tuple[Target | None, ...]
    requests: SessionRequests
    settings: Settings
    constraints: lighting.Constraints
    transform: ViewTransform

    @property
    def painted_views(self) -> tuple[int, ...]:
        """Indices of the painted views; only these count."""
        return tuple(k for k, target in enumerate(self.targets) if target is not None)

    @property
    def painted_targets(self) -> tuple[Target, ...]:
        """Paintings of these views."""
        return tuple(target for target in self.targets if target is not None)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Distinct names for the pictures of all views; "" for the only view."""
        if len(self.bases) == 1:
            return ("",)
        return tuple(basis.origin.sensor for basis in self.bases)

    @property
    def painted_sensors(self) -> tuple[str, ...]:
        """The same names of the painted views."""
        return tuple(self.sensors[k] for k in self.painted_views)

    def lighting_of(self, weights: Doubles) -> lighting.Lighting:
        """Return the lighting of weights (n, 3), with what mixes each light."""
        basis = self.bases[0]
        every = lighting.constraints_of(basis.requests).and_then(self.constraints)
        lamps = lighting.reduce_lights(every, basis.lights, self.settings).lamps
        return lighting.Lighting.of_weights(basis, weights, lamps=lamps)

    def solution(self) -> lighting.Solution | None:
        """Return the exact answer; None if nothing is painted. Raises LightpaintError."""
        return self._exact_solution(self.settings) if self.painted_views else None

    def solution_with(self, colors: lighting.Colors) -> lighting.Solution:
        """Return the exact answer with another choice of light colours, of a painted session.

        Raises ConstraintError if a constraint excludes it.
        """
        return self._exact_solution(replace(self.settings, colors=colors))

    def _exact_solution(self, settings: Settings) -> lighting.Solution:
        problem = self._problem(constraints=self.constraints, fit=settings)
        if settings.corrects_noise(is_known=self.bases[0].knows_noise):
            return lighting.choose_mixes(lighting.default_answer(problem, lighting.correct_noise))
        return lighting.choose_mixes(lighting.default_answer(problem))

    def _problem(self, **options: Any) -> lighting.Problem:
        return lighting.Problem.of(
            [self.bases[k] for k in self.painted_views], self.painted_targets, **options
        )

    def delta_e(self, solution: lighting.Solution) -> float:
        """Return the mean ΔE between the paint and an answer to it, over the painted views."""
        differences = []
        for k, answer in zip(self.painted_views, solution.views, strict=True):
            look = lighting.PaintComparison.of_problem(answer.problem)
            picture = look.pixels(self.bases[k].mix(solution.weights))
            differences.append(float(look.mean(look.difference(picture))))
        return mean(differences)

    def explain(self, view: int = 0) -> tuple[list[str], npt.NDArray[np.uint8]]:
        """Return why the answer differs from a view's painting: sentences, and a picture (h, w).

        The picture shows the error of the best answer without any request: nothing held, any
        colour, no constraints. 255 stands for the whole range of a display.
        """
        target = self.targets[view]
        if target is None:
            blank = np.zeros(self.bases[view].size, np.uint8)
            return ["Nothing is painted here yet."], blank
        solution = self.solution()
        assert solution is not None
        analysis = lighting.analyse(solution)[self.painted_views.index(view)]
        best = lighting.solution_of(
            self._problem(fit=replace(self.settings, hold=0.0, colors="free"))
        )
        transform = best.problem.fit.transform or ViewTransform()
        predicted = transform.encode(self.bases[view].mix(best.weights))
        missed = np.abs(predicted - transform.encode(target.image)).max(axis=-1)
        missed = np.where(target.importance > 0, np.clip(missed, 0, 1), 0)
        return why_not_closer(analysis), np.round(255 * missed).astype(np.uint8)

    def preview(
        self, weights: Doubles, view: int = 0, *, clean: DenoisedPlanes | None = None
    ) -> "ChangePreview":
        """Return a preview in a view: the answer to these requests beside current weights, (n, 3).

        If the view is not painted, the text is about another one. clean: denoised planes of the
        view, for its pictures.
        """
        solution = self.solution()
        answer_weights = weights if solution is None else solution.weights
        planes, transform = clean or self.bases[view], self.transform
        before, afterwards = (
            display_thumbnail(planes.mix(x), transform) for x in (weights, answer_weights)
        )
        if solution is None:
            return ChangePreview(before, afterwards, *preview_text((0, 0), None, is_at_cost=False))
        judged_view = view if view in self.painted_views else self.painted_views[0]
        view_solution = solution.views[self.painted_views.index(judged_view)]
        basis, [target] = self.bases[judged_view], view_solution.problem.views.targets
        look = lighting.PaintComparison.of_problem(view_solution.problem)
        pictures = [basis.mix(x) for x in (weights, answer_weights)]
        now, then = (look.mean(look.difference(look.pixels(picture))) for picture in pictures)
        # As the sentence after the change will have it: from the current scene.
        rest = lighting.change_from_scene(view_solution, look, answer_weights, pictures[1])
        caused = lighting.unpainted_change(look, basis, target.importance > 0, *pictures)
        is_at_cost = (
            caused is not None and caused.worst > lighting.NOTICED and caused.delta_e > now - then
        )
        text = preview_text((now, then), rest, is_at_cost=is_at_cost)
        return ChangePreview(before, afterwards, *text)


@dataclass(frozen=True)
class ChangePreview:
    """The effect of a change, before it is made.

    before, after: (h, w, 3) uint8, small pictures of the answer in display values. text: the
    effect. is_at_cost: whether it changes the unpainted part by more than it gains.
    """

    before: Picture
    after: Picture
    text: str
    is_at_cost: bool
