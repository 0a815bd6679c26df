"""The answer under the moving brush, solved between two frames of a display.

In linear light the equations follow the brush tile by tile (Eq 7-9), and the answer is the answer
of `solve` without the noise correction. Painted pixels and the rest have separate sums: a hold
weighs the rest by the amount of paint, so that a stroke changes the weight of every other pixel,
but none of their sums.

In display space, and where paint means "at least this bright", every answer changes the weight of
every pixel. There the picture is averaged to a few thousand pixels, and one round from the last
answer follows the brush; the answer of all pixels comes when the brush is lifted. Of more than
`MANY_LIGHTS` a round moves some at a time (many_lights.py), in linear light, too.

Only painted views count. Each has its own sums, so that a stroke costs no more than with a single
view.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import add
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles
from lightpaint.basis import Basis, texel_lights
from lightpaint.colour import Lamp, ViewTransform
from lightpaint.display_text import short_repr
from lightpaint.lighting import linear_problem
from lightpaint.lighting.analysis.appearance.held_answer import closest_to_paint, holding_pull
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.light_constraints import (
    WhiteLimits,
    start_weights,
)
from lightpaint.lighting.fit import Fit, Space
from lightpaint.lighting.linear_solve import at_slots, nearest_allowed, solve_linear
from lightpaint.lighting.live.live_sums import MAX_FILM_PIXELS, Films, SmallFilm
from lightpaint.lighting.live.live_view import LiveDifference, LiveView
from lightpaint.lighting.live.many_lights import MANY_LIGHTS, MAX_FILM_VALUES, ManyLights
from lightpaint.lighting.loss.expected_lights import ExpectedLights, Wash
from lightpaint.lighting.loss.lit_pixels import block_side
from lightpaint.lighting.loss.painting import unpainted_weight
from lightpaint.lighting.loss.weight_penalty import (
    PaintTerms,
    is_spoilt_by_contrast,
)
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns import white_mixes
from lightpaint.lighting.unknowns.gamuts import PaintedLight
from lightpaint.lighting.unknowns.lamps_in_view import GlowPaint, light_of_emitters_seen
from lightpaint.lighting.unknowns.reduced_problem import nearest_weights
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.threads import one_thread

#: Answers under a moving brush for each time that wishes and gamuts are found anew: from one move
#: to the next they hardly change.
ANSWERS_PER_READING = 8

#: Largest miss of a requirement under the brush, relative to its size: none that shows.
MET_UNDER_BRUSH = 1e-5

#: Steps of lights to other whites, or sides of their gamuts, for one answer; the next continues.
BRUSH_STEPS = 3

#: Largest relative difference of weights that comes from round-off.
ROUND_OFF = 1e-12

#: Painted blocks that determine the colours lights may take, about, and at least of each wish.
GAMUT_BLOCKS, GAMUT_WISH_BLOCKS = 2**8, 2**5


@dataclass(frozen=True, kw_only=True)
class LiveProblem(linear_problem.SummedProblem):
    """The linear problem of live views, whose squares follow the brush.

    painted_share: see `LinearProblem`. full: what constraints leave; reduction: that with the
    gamuts that the painting asks for, and the whites, sides and slots of the last answer.
    """

    painted_share: float = 0.0

    __repr__ = short_repr

    @property
    def keeps_color(self) -> Bools:
        """(n,), the lights with a pull to their colour, as far as the pictures of all show."""
        return self.full.is_free & self.power.any(axis=1) & ~texel_lights(self.lights)

    def with_squares(self, equations: NormalEquations) -> "LiveProblem":
        """Return this problem with other squares."""
        return self._with_same_pull(equations=equations)

    def with_reduction(self, reduction: Reduction) -> "LiveProblem":
        """Return this problem with another reduction of the same `full`."""
        return self._with_same_pull(reduction=reduction)

    with_whites = with_reduction

    def with_slots(self, weights: Doubles) -> "LiveProblem":
        """Return this problem with colour wheels at the slots closest to weights (n, 3)."""
        return self.with_reduction(self.reduction.with_slots(weights))

    def _with_same_pull(self, **changes: Any) -> "LiveProblem":
        """Return this problem with other fields, on which the pull does not depend."""
        changed = replace(self, **changes)
        vars(changed)["pull"] = self.pull  # as `cached_property` keeps it
        return changed


@dataclass(frozen=True)
class _Improved:
    """Weights (n, 3), as close to the squares of views as some steps come, and their problem."""

    problem: LiveProblem
    weights: Doubles


class LiveReading(linear_problem.PaintReading):
    """The demands of live views on their lights, read anew as they are painted.

    films: of the views, together. problem: has lights, reference, constraints and fit.
    """

    def __init__(
        self, views: tuple[LiveView, ...], films: Films, problem: LiveProblem, *, is_sketch: bool
    ) -> None:
        bases = [view.basis for view in views]
        own, fit = problem.reference, problem.fit
        super().__init__(
            bases,
            _power(views),
            own,
            fit,
            constraints=problem.constraints,
            is_sketch=is_sketch,
        )
        self.views, self._films, self._unpainted = views, films, 0.0
        self._washed: Wash | None = None
        self._expected: ExpectedLights | None = None

    def read(self, unpainted: float) -> PaintTerms:
        """Read the present paintings. unpainted: the weight of each unpainted pixel."""
        self._washed, self._unpainted = None, unpainted
        terms = self.terms()
        self._expected = terms.expected
        return terms

    @property
    def importance(self) -> float:
        """The total importance of the paint of all views."""
        return sum(float(view.counts[0]) for view in self.views)

    def amounts(self) -> tuple[float, float]:
        """Return the importance of all pixels together, and the weight of each unpainted one."""
        return self.importance, self._unpainted

    def wash(self) -> Wash:
        """Return the paintings and their lights, averaged over the films; once for a reading."""
        if self._washed is None:
            layers = [view.layers for view in self.views]
            self._washed = self._films.wash(layers, is_sketch=self.is_sketch)
        return self._washed

    def samples(self) -> PaintedLight:
        """Return a sample of the painted blocks, small wishes as well as what is around them, but
        for those that mean "at least": their colour is where a range ended.
        """
        wash, films = self.wash(), self._films
        counted = replace(wash, importance=np.where(films.has_mark, 0, wash.importance))
        blocks, weight = counted.sample(GAMUT_BLOCKS, GAMUT_WISH_BLOCKS)
        return PaintedLight(
            wash.rows[:, :, blocks].transpose(1, 2, 0),
            wash.painted[:, blocks].T,
            weight,
            films.albedo[:, blocks].T,
        )

    def paintings(self) -> Sequence[GlowPaint]:
        """Return the painting of each view."""
        return [view.paint for view in self.views]

    def around(self, expected: ExpectedLights | None) -> Callable[[], Doubles] | None:
        """Return what gives the light of each lamp with the change that is painted now; None if
        nothing is expected.
        """
        if expected is None:
            return None
        return lambda: self.own if self._expected is None else self._expected.painted


class LiveSolver:
    """The lighting for paintings that change under a brush, updated in place.

    views: of one lighting; report strokes to each by `update`. fit: with nothing left open, as
    `resolve_for_targets` returns it. constraints: all constraints on the lights. is_sketch: as for
    `Fit.reads_wishes`. display: the view transform that answers are judged by where the fit has
    none.
    """

    def __init__(
        self,
        views: Sequence[LiveView],
        *,
        fit: Fit,
        constraints: Constraints,
        is_sketch: bool = False,
        display: ViewTransform | None = None,
    ) -> None:
        self._is_sketch, self._display = is_sketch, display
        self._views = tuple(views)
        self._basis = views[0].basis
        self._films: tuple[tuple[LiveView, ...], Films] | None = None
        self._start: Mapping[str, RGB] = {}
        self._last_read, self._answers_left = tuple[LiveView, ...](), 0
        self.constrain(fit, constraints)

    def constrain(self, fit: Fit, constraints: Constraints) -> None:
        """Change fit and constraints. Raises ConstraintError for impossible ones."""
        lights = self._basis.lights
        reduction = linear_problem.reduce_lights(constraints, lights, fit)
        self._problem = LiveProblem(
            name="",
            lights=lights,
            power=self._basis.power,
            equations=_no_squares(len(lights)),
            constraints=constraints,
            reduction=reduction,
            full=reduction,
            fit=fit,
            start=start_weights(constraints.start, lights),
        )
        self._whites: WhiteLimits | None = None
        self._untouched: Doubles | None = None
        self._mixed_emissions: Mapping[int, RGB] = {}
        self._reading: LiveReading | None = None
        self._answers_left = 0
        self._near = white_mixes.Multipliers(MET_UNDER_BRUSH)
        self._is_kept_to = False  # whether the last answer kept to the constraints
        self._given_up: NormalEquations | None = None  # contrasts that lights cannot bring
        self._last_free: Doubles | None = None  # the last answer without a hold, while one holds
        self._many = ManyLights(len(self._basis.lights))
        self._films = None if self._start != constraints.start else self._films
        self._start = constraints.start
        for view in self._views:
            view.set_start(constraints.start)
            view.set_transform(fit.transform)

    def follow_planes(self) -> Basis:
        """Follow the views, in which planes of some lights were replaced.

        Returns the first view's basis.
        """
        self._basis = self._views[0].basis
        self._untouched, self._reading, self._answers_left = None, None, 0
        self._many = ManyLights(len(self._basis.lights))
        if self._start:  # whose look has these planes, too
            self._films = None
        if self._films is not None:
            self._films[1].join()
        return self._basis

    def prepare(self) -> None:
        """Compute now all sums that the first answer needs."""
        for view in self._views:
            if self._has_tiles:
                view.tiles()
            reads_wash = self._problem.fit.reads_wishes(is_sketch=self._is_sketch)
            if not self._has_tiles or reads_wash or self._problem.fit.colors == "white":
                self._film(view)
            if self._problem.fit.keeps_to_hues(is_sketch=self._is_sketch):
                light_of_emitters_seen(view.basis)

    @property
    def lamps(self) -> Mapping[int, Lamp]:
        """The lamps that mix lights from emitters, by the light's index."""
        return {k: lamp.while_painting for k, lamp in self._problem.full.lamps.items()}

    @property
    def mixed_emissions(self) -> Mapping[int, RGB]:
        """The emissions that lamps with colour wheels had in the last answer before these came to
        their slots, by the light's index.
        """
        return self._mixed_emissions

    @property
    def mode(self) -> Space:
        """The space of the answers."""
        return self._problem.fit.space or "linear"

    @property
    def _are_many(self) -> bool:
        """True if a round moves only some of the lights."""
        return len(self._basis.lights) > MANY_LIGHTS

    @property
    def _has_tiles(self) -> bool:
        """True if sums over tiles follow the brush: of many lights they would be too large, and
        where brighter than the painting is as good, none suffice.
        """
        has_marks = any(view.has_marks for view in self._views)
        return self.mode == "linear" and not self._are_many and not has_marks

    @one_thread()
    def answer(
        self, start: Doubles, *, while_moving: bool = False, while_painting: bool = False
    ) -> Doubles:
        """Return the best weights (n, 3), from the last ones.

        Before anything is painted, lights keep their current weights, within the constraints.

        while_moving: whether a light is being moved. Sums over tiles would have to be recomputed
        for each of its places, so linear light, too, is averaged to a few thousand pixels.
        while_painting: whether a stroke goes on: then wishes and gamuts may be a few answers old.
        """
        views = tuple(view for view in self._views if view.is_painted)
        if not views:
            self._mixed_emissions = {}
            return self._unpainted_answer()
        if not self._is_kept_to:
            # Weights that the constraints forbid may well be closer to the painting.
            start = _nearest(start, views, self._problem.full)
            self._is_kept_to = True
        painted, rest = reduce(add, (view.counts for view in views))
        unpainted = unpainted_weight(float(painted), float(rest), self._problem.fit)
        is_read = not (while_painting and self._answers_left and self._last_read == views)
        if is_read:
            self._read_paint(views, unpainted)
        self._answers_left -= 1
        paint: dict[str, Any] = {"views": views, "unpainted": unpainted, "is_moving": while_moving}

        def improve(problem: LiveProblem, start: Doubles) -> _Improved:
            return self._improve_mixed(problem, start, **paint)

        mixed = self._held(start, views, improve) if is_read else improve(self._problem, start)
        self._problem = mixed.problem
        answer = at_slots(
            mixed, lambda x, w: self._improve(x, (nearest_weights(x.reduction, w),), **paint)
        )
        answer = answer or mixed
        self._mixed_emissions = answer.problem.reduction.mixed_emissions
        return answer.weights

    def _held(
        self,
        start: Doubles,
        views: tuple[LiveView, ...],
        improve: Callable[[LiveProblem, Doubles], _Improved],
    ) -> _Improved:
        """Return the answer, held to the current lights as exact answers are.

        start: the last weights. improve: as `_improve_mixed`.
        """
        last_free, self._last_free = self._last_free, None
        free = improve(
            replace(self._problem, holding=None), start if last_free is None else last_free
        )
        problem = free.problem
        if not problem.fit.reads_wishes(is_sketch=self._is_sketch):
            return free
        films, transform = self._joint_films(views), problem.fit.transform
        layers, display = [view.layers for view in views], transform or self._display
        paint = LiveDifference(films.parts, layers, display or ViewTransform(), transform)
        held, strength = closest_to_paint(
            free,
            lambda x: improve(replace(problem, holding=holding_pull(problem, x)), start),
            difference=lambda x: paint.of(films.picture(x.weights)),
            difference_now=paint.now,
            have_come=lambda x: paint.have_wishes_come(films.picture(x.weights)),
        )
        self._last_free = free.weights if strength > 0 else None
        return held

    def _improve_mixed(
        self,
        problem: LiveProblem,
        start: Doubles,
        *,
        views: tuple[LiveView, ...],
        unpainted: float,
        is_moving: bool,
    ) -> _Improved:
        """Improve weights (n, 3), with mixed slots of colour wheels, and without contrasts that
        lights cannot bring. For the other arguments see `_improve`.
        """
        improve = partial(self._improve, views=views, unpainted=unpainted, is_moving=is_moving)
        # After a change of the painting the last answer may be worse than the current lighting.
        mixed = improve(problem, (start, self._unpainted_answer()))
        if not self._is_spoilt_by_contrast(mixed, views, unpainted):
            return mixed
        self._given_up = mixed.problem.contrast
        without = replace(mixed.problem, contrast=None)
        return improve(without, (mixed.weights, self._unpainted_answer()))

    def _is_spoilt_by_contrast(
        self, answer: _Improved, views: tuple[LiveView, ...], unpainted: float
    ) -> bool:
        """Return whether contrasts are to be given up, as exact answers do."""
        problem = answer.problem
        if problem.contrast is None:
            return False
        films = self._joint_films(views)
        pixels = films.pixels(unpainted, problem.fit.transform)
        return is_spoilt_by_contrast(
            problem.contrast,
            answer.weights,
            problem.reference,
            lambda w: films.objective(pixels, w),
        )

    def _improve(
        self,
        problem: LiveProblem,
        starts: tuple[Doubles, ...],
        *,
        views: tuple[LiveView, ...],
        unpainted: float,
        is_moving: bool,
    ) -> _Improved:
        """Improve the best of some weights (n, 3), the first of which are the last ones.

        unpainted: the weight of each unpainted pixel. is_moving: whether a light is being moved.
        """
        if self._has_tiles and not is_moving:
            squares = reduce(add, (x.tiles().equations(unpainted) for x in views))
            return self._solve(problem, squares, starts[0])
        films, reduction = self._joint_films(views), problem.reduction
        pixels = films.pixels(unpainted, problem.fit.transform)
        allowed = partial(_allowed, reduction)
        starts = allowed(starts[0]), *starts[1:]
        if self._are_many:
            reduction, weights = self._many.improve(
                films.rows, pixels, starts, reduction, self._solve_some, problem.pull, _allowed
            )
            return _Improved(problem.with_reduction(reduction), weights)
        solved = problem

        def best(squares: NormalEquations, begin: Doubles) -> Doubles:
            nonlocal solved
            found = self._solve(problem, squares, begin)
            solved = found.problem
            return found.weights

        weights = films.improve(pixels, starts, best, problem.pull, allowed)
        return _Improved(solved, weights)

    def _solve(self, problem: LiveProblem, squares: NormalEquations, start: Doubles) -> _Improved:
        """Solve some squares from weights (n, 3), with wheels that mix their slots."""
        squares_of_now = problem.with_squares(squares)
        answer = solve_linear(squares_of_now, start, steps=BRUSH_STEPS, near=self._near)
        return _Improved(answer.problem, answer.weights)

    def _unpainted_answer(self) -> Doubles:
        """Return the answer without paint, (n, 3)."""
        if self._untouched is None:
            reference = self._problem.reference
            reduction = self._problem.full.with_slots(reference)
            self._untouched = _nearest(reference, self._views, reduction)
        return self._untouched

    def _read_paint(self, views: tuple[LiveView, ...], unpainted: float) -> None:
        """Find what the painting asks of the lights: whites, gamuts and the pull on them.

        unpainted: the weight of each unpainted pixel.
        """
        reading, is_new = self._reading, False
        if reading is None or reading.views != views:
            films, is_new = self._joint_films(views), True
            reading = LiveReading(views, films, self._problem, is_sketch=self._is_sketch)
            self._reading = reading
        terms = reading.read(unpainted)
        # Contrasts that were given up are not tried again while the paint asks for the same ones.
        if _are_equal(terms.contrast, self._given_up):
            terms = replace(terms, contrast=None)
        self._problem = replace(
            self._problem,
            power=reading.power,
            painted_share=reading.importance / sum(view.pixels for view in views),
            **vars(terms),
        )
        self._follow_whites(linear_problem.whites_for(terms.expected, self._problem.fit))
        # Lights that the last answer confined to their gamuts are confined from the start.
        if (known := self._problem.reduction.gamuts) is not None and not is_new:
            known.refresh()
        elif (gamuts := reading.gamuts(reading.around(terms.expected))) is not None:
            self._problem = self._problem.with_reduction(self._problem.full.with_gamuts(gamuts))
        self._last_read, self._answers_left = views, ANSWERS_PER_READING

    def _follow_whites(self, whites: WhiteLimits | None) -> None:
        """Widen the ranges of lights that are to be white as far as whites are painted."""
        if whites in (None, self._whites):
            return
        problem = self._problem
        reduction = linear_problem.reduce_lights(
            problem.constraints, problem.lights, problem.fit, whites=whites
        )
        self._whites = whites
        self._problem = replace(problem, reduction=reduction, full=reduction)

    def _solve_some(
        self, equations: NormalEquations, reduction: Reduction, start: Doubles
    ) -> tuple[Reduction, Doubles]:
        """Solve for some of many lights, whose misses of requirements would add up over rounds."""
        method = self._problem.fit.method
        reduction, optimum = white_mixes.solve_on_locus(
            equations, reduction, start, steps=BRUSH_STEPS, method=method
        )
        return reduction, optimum.weights

    def _joint_films(self, views: tuple[LiveView, ...]) -> Films:
        if self._films is None or self._films[0] != views:
            self._films = views, Films([self._film(view) for view in views])
        return self._films[1]

    def _film(self, view: LiveView) -> SmallFilm:
        """Return the film of a view; all films together have the pixels of one, or fewer with less
        noise or for many lights.
        """
        transform = self._problem.fit.transform
        if view.has_film:  # the noise of a picture takes a walk over all planes
            return view.film(transform)
        side = block_side([view_of_all.basis for view_of_all in self._views], transform)
        most = min(MAX_FILM_PIXELS, MAX_FILM_VALUES // len(self._basis.lights))
        most = min(most // len(self._views), view.pixels // side**2)
        return view.film(transform, max(1, most))


def _allowed(reduction: Reduction, weights: Doubles) -> Doubles:
    """Return weights (n, 3) between allowed ones, with the colours that lights may have."""
    return white_mixes.clip_to_gamuts(reduction, white_mixes.snap_to_whites(reduction, weights))


def _no_squares(count: int) -> NormalEquations:
    """Return the sums over no pixel, for some lights."""
    M = np.broadcast_to(0.0, (3, count, count))
    return NormalEquations(M, np.zeros((3, count)), np.zeros(3))


def _are_equal(first: NormalEquations | None, second: NormalEquations | None) -> bool:
    """Return whether both are there, and the same to the last bit."""
    if first is None or second is None:
        return False
    return np.array_equal(first.M, second.M) and np.array_equal(first.b, second.b)


def _power(views: Sequence[LiveView]) -> Doubles:
    """Return ‖Φᵢ‖² of all views together, (n, 3)."""
    return reduce(add, (view.basis.power for view in views))


def _nearest(weights: Doubles, views: Sequence[LiveView], reduction: Reduction) -> Doubles:
    """Return the nearest allowed weights (n, 3), relative to the brightness of lights.

    Lights with a range of white get its nearest white, at the same brightness.
    """
    weights = white_mixes.snap_to_whites(reduction, weights)
    reduction = white_mixes.center_windows(reduction, weights)
    allowed = nearest_weights(reduction, weights)
    if reduction.requirements is None and np.allclose(allowed, weights, rtol=ROUND_OFF, atol=0):
        return allowed  # without a solve, which takes a second for a thousand lights
    return nearest_allowed(_power(views), reduction, weights)
