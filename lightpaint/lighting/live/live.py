"""The answer while the brush moves: what is solved between two frames of a display.

In linear light the equations follow the brush tile by tile (Eq 7-9), and the answer is that of
`solve` but for the noise correction. What is painted and the rest have sums of their own: a hold
weighs the rest by how much is painted, so that a stroke changes the weight of every other pixel,
but no sum of theirs.

In display space every answer changes the weight of every pixel. There the picture is averaged to
a few thousand pixels, and a round from the answer before is enough to follow the brush;
the answer of all pixels comes when it is lifted.

Of several views those count in which something is painted. Each has sums of its own, so that a
stroke in one costs no more than where there is no other.
"""

from collections.abc import Sequence
from functools import partial, reduce
from operator import add
from typing import Any

from lightpaint.arrays import Doubles
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.gamut_bounds import solve_near_sides
from lightpaint.lighting.constraints.gamuts import Gamuts, PaintedLight
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.constraints.white_neighbours import (
    center_windows,
    clip_to_gamuts,
    next_whites,
    snap_to_whites,
)
from lightpaint.lighting.fit import Fit, Space
from lightpaint.lighting.linear_problem import reduced_by
from lightpaint.lighting.live.live_sums import FILM, Films, SmallFilm
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.loss.painting import rest_weight
from lightpaint.lighting.loss.pixel_bins import block_side
from lightpaint.lighting.loss.weight_penalty import dimming_of, drawn_more, pull_of, to_present
from lightpaint.lighting.normal_equations import NormalEquations

#: Steps between whites for one answer, at most: the next answer goes on.
WHITE_STEPS = 2

#: Pieces of a range of white within which a light first looks for its white, under the hand.
WHITE_WIDTH = 8

#: Painted pixels that say which colours lights may take, about.
GAMUT_PIXELS = 2**8

#: Of which views, and what pulls to the present and to its colours.
_Pulls = tuple[tuple[LiveView, ...], NormalEquations | None, NormalEquations | None]


class Live:
    """Paintings that change under a brush, and the lighting for them. Updated in place.

    views: of one lighting, each of which is told where it is painted. fit: with nothing left open,
    as `meant_by` makes it. constraints: all that is asked of the lights.
    """

    def __init__(self, views: Sequence[LiveView], *, fit: Fit, constraints: Constraints) -> None:
        self._views = tuple(views)
        self._basis = views[0].basis
        self._films: tuple[tuple[LiveView, ...], Films] | None = None
        self.asks(fit, constraints)

    def asks(self, fit: Fit, constraints: Constraints) -> None:
        """Go on with these. Raises ConstraintError for what is impossible."""
        reduction = reduced_by(constraints, self._basis.lights, fit)
        self._fit, self._constraints, self._reduction = fit, constraints, reduction
        self._pulls: _Pulls | None = None
        self._untouched: Doubles | None = None
        self._within, self._gamuts_of = reduction, tuple[LiveView, ...]()
        self._is_kept_to = False  # by the answer before
        for view in self._views:
            view.see_through(fit.transform)

    def prepare(self) -> None:
        """Do now what the first answer would wait for."""
        for view in self._views:
            if self.mode == "linear":
                view.tiles()
            else:
                self._film_of(view)

    @property
    def mode(self) -> Space:
        """In which space answers are found."""
        return self._fit.space or "linear"

    def answer(self, start: Doubles) -> Doubles:
        """The weights (n, 3) that are best now, from those before.

        Before anything is painted, lights stay as they are but for what is asked of them.
        """
        views = tuple(view for view in self._views if view.is_painted)
        if not views:
            return self._at_rest()
        if not self._is_kept_to:
            # What is not allowed may well be nearer to the painting.
            start = _nearest(start, views, self._reduction)
            self._is_kept_to = True
        painted, rest = reduce(add, (view.counts for view in views))
        unpainted = rest_weight(float(painted), float(rest), self._fit)
        reduction = self._with_gamuts(views)

        def best(equations: NormalEquations, begin: Doubles) -> Doubles:
            return self._best(equations if pull is None else equations + pull, begin)

        def allowed(weights: Doubles) -> Doubles:
            return clip_to_gamuts(reduction, snap_to_whites(reduction, weights))

        if self.mode == "linear":
            equations = reduce(add, (x.tiles().equations(unpainted) for x in views))
            pull = self._pull(views, self._basis.present_weights)
            found = best(equations, start)
            if self._fit.colors != "gentle":
                return found
            # As a solve does: once more, with what came out dim drawn to its colour the more.
            pull = self._pull(views, found)
            return best(equations, found)
        pull = self._pull(views, start)
        films = self._films_of(views)
        pixels = films.pixels(unpainted, self._fit.transform)
        # A painting that another hand has changed may leave the answer before worse than none.
        starts = allowed(start), self._at_rest()
        return films.nearer(pixels, starts, best, pull, allowed)

    def _at_rest(self) -> Doubles:
        """Return the answer to no paint, (n, 3)."""
        if self._untouched is None:
            self._untouched = untouched(self._views, self._reduction)
        return self._untouched

    def _with_gamuts(self, views: tuple[LiveView, ...]) -> Reduction:
        """Return the unknowns, with the colours that lights may take as the views are painted.

        Lights that the answer before had to keep within theirs are so from the beginning.
        """
        if self._fit.colors != "gentle":
            return self._reduction
        within = self._within
        if within.gamuts is None or self._gamuts_of != views:
            painted = partial(PaintedLight.of, [x.painting for x in views], max_pixels=GAMUT_PIXELS)
            gamuts = Gamuts(painted, _power(views), self._basis.present_weights)
            within, self._gamuts_of = self._reduction.with_gamuts(gamuts), views
        else:
            within.gamuts.refresh()
        self._within = within
        return within

    def _best(self, equations: NormalEquations, start: Doubles) -> Doubles:
        """Return the best weights (n, 3) of what constraints leave, near those to begin with."""
        method, reduction = self._fit.method, self._within
        if not reduction.white_knobs:
            self._within, found = solve_near_sides(equations, reduction, start, method=method)
            return found
        start = snap_to_whites(reduction, start)
        wide = center_windows(reduction, start, WHITE_WIDTH)
        start = solve_reduced(equations, wide, start, method=method).weights
        reduction = center_windows(reduction, start)
        how: dict[str, Any] = {"steps": WHITE_STEPS, "method": method}
        return next_whites(equations, reduction, start, **how)[1].weights

    def _pull(self, views: tuple[LiveView, ...], before: Doubles) -> NormalEquations | None:
        """Return the pull on the weights, as `Problem.pull`; the part of the colours is found once.

        before: (n, 3), an answer that says which lights are dim.
        """
        if self._pulls is None or self._pulls[0] != views:
            power = _power(views)
            keeps_color = self._reduction.is_free & power.any(axis=1)
            present, prefer = self._basis.present_weights, self._constraints.prefer_current

            def of(prefer: float, share: float) -> NormalEquations | None:
                return pull_of(
                    power,
                    present,
                    self._fit,
                    prefer_current=prefer,
                    painted_share=share,
                    keeps_color=keeps_color,
                )

            self._pulls = views, of(prefer, 0.0), of(0.0, 1.0)
        _, to_present, to_colors = self._pulls
        if to_colors is None:
            return to_present
        # Importance of all that is painted, beside the number of pixels.
        pixels = sum(view.pixels for view in views)
        to_colors = to_colors.times(sum(float(view.counts[0]) for view in views) / pixels)
        to_colors = drawn_more(to_colors, dimming_of(self._basis.present_weights, before))
        return to_colors if to_present is None else to_present + to_colors

    def _films_of(self, views: tuple[LiveView, ...]) -> Films:
        if self._films is None or self._films[0] != views:
            self._films = views, Films([self._film_of(view) for view in views])
        return self._films[1]

    def _film_of(self, view: LiveView) -> SmallFilm:
        """All films together have as many pixels as that of one view, or fewer of less noise."""
        side = block_side([one.basis for one in self._views], self._fit.transform)
        most = min(FILM // len(self._views), view.pixels // side**2)
        return view.film(self._fit.transform, max(1, most))


def _power(views: Sequence[LiveView]) -> Doubles:
    """‖Φᵢ‖² of all views together, (n, 3)."""
    return reduce(add, (view.basis.power for view in views))


def untouched(views: Sequence[LiveView], reduction: Reduction) -> Doubles:
    """The weights (n, 3) nearest to the present ones, of what constraints leave."""
    return _nearest(views[0].basis.present_weights, views, reduction)


def _nearest(weights: Doubles, views: Sequence[LiveView], reduction: Reduction) -> Doubles:
    """Of what constraints leave, (n, 3), by how bright the lights are.

    Lights that keep to a range of white get its nearest one, as bright as they are.
    """
    weights = snap_to_whites(reduction, weights)
    reduction = center_windows(reduction, weights)
    return solve_reduced(to_present(_power(views), weights), reduction, weights).weights
