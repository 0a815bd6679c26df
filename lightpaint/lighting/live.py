"""The answer while the brush moves: what is solved between two frames of a display.

In linear light the equations follow the brush tile by tile (Eq 7-9), and the answer is that of
`solve` but for the noise correction. What is painted and the rest have sums of their own: a hold
weighs the rest by how much is painted, so that a stroke changes the weight of every other pixel,
but no sum of theirs.

In display space every answer changes the weight of every pixel. There the picture is averaged to
a few thousand pixels, and a round from the answer before is enough to follow the brush;
the answer of all pixels comes when it is lifted.
"""

from collections.abc import Callable
from contextlib import nullcontext
from math import ceil

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.transform import ViewTransform
from lightpaint.images.blocks import block_mean
from lightpaint.lighting.algebra.threads import one_thread
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.fit import Fit, Space
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.pixels import STRIP, Pixels
from lightpaint.lighting.problem import reduced_by
from lightpaint.lighting.pull import pull_of, to_present
from lightpaint.lighting.reweighted import between
from lightpaint.lighting.tiles import FEW_LIGHTS, TiledEquations

Region = tuple[slice, slice]

#: Pixels that a picture is averaged to in display space, at most: what goes into one strip.
FILM = STRIP

#: Parts of a step in display space that are tried. An answer is one step from the one before.
PARTS = (1.0, 0.5, 0.25)


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
        self._sums = np.zeros((len(importance), 2))
        self._count_rows(slice(0, len(importance)))
        self._light: _Tiles | None = None
        self._display: _Film | None = None
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
        return bool(self._sums[:, 0].any())

    def painted(self, region: Region, *, with_importance: bool = True) -> None:
        """A rectangle of the painting is another now. with_importance: also what counts there."""
        if with_importance:
            self._count_rows(region[0])
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
        return float(self._sums[:, 0].sum()) / self._importance.size

    @property
    def _rest_weight(self) -> float:
        """What a pixel counts that is not painted."""
        fit = self._fit
        painted, rest = self._sums.sum(axis=0)
        if fit.unpainted or not fit.hold:
            return fit.unpainted
        return min(fit.hold * painted / rest, 1.0) if rest > 0 else 0.0

    def _count_rows(self, rows: slice) -> None:
        a = self._importance[rows].astype(np.float64)
        self._sums[rows, 0] = a.sum(axis=1)
        left = np.where(self._basis.emitters_seen[rows], 0, np.maximum(1 - a, 0))
        self._sums[rows, 1] = left.sum(axis=1)

    def _tiles(self) -> "_Tiles":
        if self._light is None:
            self._light = _Tiles(self._basis, self._image, self._importance)
        return self._light

    def _film(self) -> "_Film":
        if self._display is None:
            self._display = _Film(self._basis, self._image, self._importance)
            self._display.see_through(self._fit.transform)
        return self._display


def untouched(basis: Basis, reduction: Reduction) -> Doubles:
    """The weights (n, 3) nearest to the present ones, of what constraints leave."""
    present = to_present(basis, 1.0)
    return solve_reduced(present, reduction, basis.present_weights).weights


class _Tiles:
    """Equations of what is painted and of the rest, each at weight 1, in linear light."""

    def __init__(self, basis: Basis, image: Floats, importance: Floats) -> None:
        self._importance, self._seen = importance, basis.emitters_seen
        self._left = np.empty(importance.shape, np.float32)
        everything = slice(0, len(importance)), slice(0, importance.shape[1])
        self._leave(everything)
        self._paint = TiledEquations(basis.images, image, importance)
        self._rest = TiledEquations(basis.images, basis.present_look, self._left)

    def _leave(self, region: Region) -> None:
        left = np.maximum(1 - self._importance[region], 0)
        self._left[region] = np.where(self._seen[region], 0, left)

    def painted(self, region: Region, *, with_importance: bool) -> None:
        self._paint.update(region, with_M=with_importance)
        if not with_importance:
            return
        before = self._left[region].copy()
        self._leave(region)
        if not np.array_equal(before, self._left[region]):
            self._rest.update(region)

    def equations(self, rest_weight: float) -> NormalEquations:
        equations, rest = self._paint.equations, self._rest.equations
        if not rest_weight:
            return equations
        return NormalEquations(
            equations.M + rest_weight * rest.M,
            equations.b + rest_weight * rest.b,
            equations.target_norm2 + rest_weight * rest.target_norm2,
        )


class _Film:
    """The picture averaged to few pixels; what is painted of each, by its importance."""

    def __init__(self, basis: Basis, image: Floats, importance: Floats) -> None:
        height, width = importance.shape
        self._side = side = max(1, ceil((height * width / FILM) ** 0.5))
        self._image, self._importance, self._seen = image, importance, basis.emitters_seen
        rows, columns = -(-height // side), -(-width // side)
        self._size = rows, columns
        small = np.stack([_averaged(x, side) for x in basis.images])
        # Singles are enough for what is averaged, and sums of them take half the time.
        planes = small.reshape(len(small), -1, 3).transpose(2, 0, 1)
        self._rows = np.ascontiguousarray(planes, np.float32)
        self._current = _planes(_averaged(basis.present_look, side))
        self._painted = self._current.copy()
        self._transform: ViewTransform | None = None
        self._seen_painted = self._seen_current = self._current
        self._a, self._left = np.zeros((2, rows * columns))
        self.painted((slice(0, height), slice(0, width)))

    def painted(self, region: Region) -> None:
        """Average anew what a rectangle touches."""
        side, (height, width) = self._side, self._importance.shape
        (top, bottom), (left, right) = (
            _around(part, side, length)
            for part, length in zip(region, (height, width), strict=True)
        )
        if top >= bottom or left >= right:
            return
        where = slice(top, bottom), slice(left, right)
        a = self._importance[where].astype(np.float64)
        light = self._image[where] * a[..., None]
        rest = np.where(self._seen[where], 0, np.maximum(1 - a, 0))
        total, lit, unpainted = (_summed(x, side) for x in (a, light, rest))
        rows = slice(top // side, -(-bottom // side))
        columns = slice(left // side, -(-right // side))
        some = total > 0
        mean = lit / np.where(some, total, 1)[..., None]
        painted = self._painted.reshape(3, *self._size)[:, rows, columns]
        current = self._current.reshape(3, *self._size)[:, rows, columns]
        painted[...] = np.where(some, mean.transpose(2, 0, 1), current)
        self._a.reshape(self._size)[rows, columns] = total
        self._left.reshape(self._size)[rows, columns] = unpainted
        if self._transform is not None:
            seen = self._seen_painted.reshape(3, *self._size)[:, rows, columns]
            planes = np.ascontiguousarray(painted).reshape(3, -1)
            seen[...] = self._transform.with_slopes(planes)[0].reshape(seen.shape)

    def see_through(self, transform: ViewTransform | None) -> None:
        """From now on a display is meant that shows light so."""
        if transform is not None and transform != self._transform:
            self._seen_painted, self._seen_current = (
                np.array(transform.with_slopes(x)[0], np.float64)
                for x in (self._painted, self._current)
            )
        self._transform = transform

    def pixels(self, rest_weight: float, transform: ViewTransform | None) -> Pixels:
        """The loss of these pixels; an average counts as much as all that are in it."""
        rest = rest_weight * self._left
        weight = self._a + rest
        share = np.where(weight > 0, rest / np.where(weight > 0, weight, 1), 0)
        seen = self._seen_painted, self._seen_current
        return Pixels(self._painted, weight, share, self._current, None, transform, seen)

    def nearer(
        self,
        pixels: Pixels,
        start: Doubles,
        best: Callable[[NormalEquations, Doubles], Doubles],
        pull: NormalEquations | None,
    ) -> Doubles:
        """One round of reweighting: weights (n, 3) that miss no more than those before.

        As of `reweighted.rounds`, but for singles, and for a step that is halved a few times only.
        """

        def missed(w: Doubles, x: Doubles) -> float:
            value = float(pixels.objective(x).sum())
            return value if pull is None else value + float(pull.objective(w).sum())

        before = self._mixed(start)
        squares = pixels.squares(before, from_clipping=False)
        image, weight = (x.astype(np.float32) for x in squares)
        # Threads of BLAS would wait for each other at few lights.
        with one_thread() if len(start) <= FEW_LIGHTS else nullcontext():
            M = np.stack([(r * w) @ r.T for r, w in zip(self._rows, weight, strict=True)])
        b = np.stack([r @ x for r, x in zip(self._rows, weight * image, strict=True)])
        norm2 = np.square(image) * weight
        equations = NormalEquations(
            M.astype(np.float64), b.astype(np.float64), norm2.sum(axis=1, dtype=np.float64)
        )
        found, value = best(equations, start), missed(start, before)
        for part in PARTS:
            nearer = between(start, found, part)
            if missed(nearer, self._mixed(nearer)) <= value:
                return nearer
        return start

    def _mixed(self, weights: Doubles) -> Doubles:
        """The picture of these weights, (3, p)."""
        w = weights.astype(np.float32)
        mixed = np.stack([w[:, c] @ rows for c, rows in enumerate(self._rows)])
        return mixed.astype(np.float64)


def _around(along: slice, side: int, length: int) -> tuple[int, int]:
    """The pixels of all blocks that a slice touches."""
    start, stop, _ = along.indices(length)
    return start // side * side, min(-(-stop // side) * side, length)


def _summed(values: npt.NDArray[np.float64], side: int) -> Doubles:
    """Sums over blocks; those that the border cuts off are of what there is."""
    height, width = values.shape[:2]
    rows, columns = (np.arange(0, length, side) for length in (height, width))
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1))


def _averaged(image: Floats, side: int) -> Floats:
    """(h, w, 3) means over blocks."""
    height, width = image.shape[:2]
    if side == 1:
        return image
    if not (height % side or width % side):
        return block_mean(image, side)
    ones = _summed(np.ones((height, width)), side)
    return np.asarray(_summed(image.astype(np.float64), side) / ones[..., None], np.float32)


def _planes(image: Floats) -> Doubles:
    return np.ascontiguousarray(image.reshape(-1, 3).T, np.float64)
