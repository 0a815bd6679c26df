"""The answer while the brush moves: what is solved between two frames of a display.

In linear light the equations follow the brush tile by tile (Eq 7-9), and the answer is that of
`solve` but for the noise correction. What is painted and the rest have sums of their own: a hold
weighs the rest by how much is painted, so that a stroke changes the weight of every other pixel,
but no sum of theirs.

In display space every answer changes the weight of every pixel. There the picture is averaged to
a few thousand pixels, and a round from the answer before is enough to follow the brush;
the answer of all pixels comes when it is lifted.
"""

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.fit import Fit, Space
from lightpaint.lighting.live_sums import PaintedTiles, Region, SmallFilm
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import reduced_by
from lightpaint.lighting.pull import pull_of, to_present

#: Pixels along the parts of rows that importance is summed over.
WIDE = 64


class Live:
    """A painting that changes under a brush, and the lighting for it. Updated in place.

    basis: of one view. image: (h, w, 3) linear; importance: (h, w): the painting, which whoever
    paints writes to and then says `painted`. fit: with nothing left open, as `meant_by` makes it.
    constraints: all that is asked of the lights.
    """

    def __init__(
        self,
        basis: Basis,
        image: Floats,
        importance: Floats,
        *,
        fit: Fit,
        constraints: Constraints,
    ) -> None:
        self._basis, self._image, self._importance = basis, image, importance
        self._sums = np.zeros((len(importance), -(-importance.shape[1] // WIDE), 2))
        self._count((slice(0, len(importance)), slice(0, importance.shape[1])))
        self._light: PaintedTiles | None = None
        self._display: SmallFilm | None = None
        self.asks(fit, constraints)

    def asks(self, fit: Fit, constraints: Constraints) -> None:
        """Go on with these. Raises ConstraintError for what is impossible."""
        reduction = reduced_by(constraints, self._basis, fit)
        self._fit, self._constraints, self._reduction = fit, constraints, reduction
        self._pulls: tuple[NormalEquations | None, NormalEquations | None] | None = None
        if self._display is not None:
            self._display.see_through(fit.transform)

    def prepare(self) -> None:
        """Do now what the first answer would wait for."""
        if self.mode == "linear":
            self._tiles()
        else:
            self._film()

    @property
    def mode(self) -> Space:
        """In which space answers are found."""
        return self._fit.space or "linear"

    @property
    def is_painted(self) -> bool:
        """Whether anything is."""
        return bool(self._sums[..., 0].any())

    def painted(self, region: Region, *, with_importance: bool = True) -> None:
        """A rectangle of the painting is another now. with_importance: also what counts there."""
        if with_importance:
            self._count(region)
        if self._light is not None:
            self._light.painted(region, with_importance=with_importance)
        if self._display is not None:
            self._display.painted(region)

    def answer(self, start: Doubles) -> Doubles:
        """The weights (n, 3) that are best now, from those before.

        Before anything is painted, lights stay as they are but for what is asked of them.
        """
        if not self.is_painted:
            return untouched(self._basis, self._reduction)
        pull = self._pull()

        def best(equations: NormalEquations, begin: Doubles) -> Doubles:
            asked = equations if pull is None else equations + pull
            return solve_reduced(asked, self._reduction, begin, method=self._fit.method).weights

        if self.mode == "linear":
            return best(self._tiles().equations(self._rest_weight), start)
        pixels = self._film().pixels(self._rest_weight, self._fit.transform)
        return self._film().nearer(pixels, start, best, pull)

    def _pull(self) -> NormalEquations | None:
        """What pulls at the weights, as of `Problem.pull`: the colours' part is found once."""
        if self._pulls is None:
            keeps_color = self._reduction.is_free & self._basis.power.any(axis=1)
            prefer = self._constraints.prefer_current
            whole = (self._basis, self._fit)
            self._pulls = (
                pull_of(*whole, prefer, 0.0, keeps_color),
                pull_of(*whole, 0.0, 1.0, keeps_color),
            )
        present, colors = self._pulls
        if colors is None:
            return present
        colors = colors.times(self._painted_share)
        return colors if present is None else present + colors

    @property
    def _painted_share(self) -> float:
        """Importance of all that is painted, beside the number of pixels."""
        return float(self._sums[..., 0].sum()) / self._importance.size

    @property
    def _rest_weight(self) -> float:
        """What a pixel counts that is not painted."""
        fit = self._fit
        painted, rest = self._sums.sum(axis=(0, 1))
        if fit.unpainted or not fit.hold:
            return fit.unpainted
        return min(fit.hold * painted / rest, 1.0) if rest > 0 else 0.0

    def _count(self, region: Region) -> None:
        """Sum importance anew, of parts of rows: a sum of sums has the same bits whatever the way
        it came about.
        """
        rows, columns = region
        first, last = columns.start // WIDE, -(-columns.stop // WIDE)
        where = rows, slice(first * WIDE, last * WIDE)
        a = self._importance[where].astype(np.float64)
        left = np.where(self._basis.emitters_seen[where], 0, np.maximum(1 - a, 0))
        starts = np.arange(0, a.shape[1], WIDE)
        for k, values in enumerate((a, left)):
            if a.size:
                self._sums[rows, first:last, k] = np.add.reduceat(values, starts, axis=1)

    def _tiles(self) -> "PaintedTiles":
        if self._light is None:
            self._light = PaintedTiles(self._basis, self._image, self._importance)
        return self._light

    def _film(self) -> "SmallFilm":
        if self._display is None:
            self._display = SmallFilm(self._basis, self._image, self._importance)
            self._display.see_through(self._fit.transform)
        return self._display


def untouched(basis: Basis, reduction: Reduction) -> Doubles:
    """The weights (n, 3) nearest to the present ones, of what constraints leave."""
    present = to_present(basis, 1.0)
    return solve_reduced(present, reduction, basis.present_weights).weights
