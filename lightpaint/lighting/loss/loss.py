"""The interface of a loss, and the one that is a linear problem itself.

A solve asks of any other loss two things: what some pixels cost, and squares with the same
gradient there (`PixelLoss`). `reweighting.py` solves such squares again and again, and decides on
the loss itself how far to go. A new loss is a module with a `Loss` and its `PixelLoss`, and a line
in `painting.loss_of`, which chooses one.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.threads import side_by_side

#: Pixels in a strip.
STRIP = 2**13

#: From arrays of all views to the part of one of them.
Cut = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]

Result = TypeVar("Result")


class PixelLoss(ABC):
    """A loss of p pixels, channel by channel.

    A channel of all pixels is a row, and arithmetic goes over strips of them that stay in the
    processor's cache, several at a time; sums are added in order, so that their bits do not depend
    on how many processors there are.
    """

    if TYPE_CHECKING:

        @property
        def importance(self) -> Doubles:
            """(p,), how much each pixel counts."""

    @property
    def has_pieces(self) -> bool:
        """Whether the loss is squares piece by piece.

        A round is exact then, and the last, where no pixel leaves its piece.
        """
        return False

    @property
    def clips(self) -> bool:
        """Whether display values that are clipped may be drawn back (`from_clipping`)."""
        return False

    def __len__(self) -> int:
        return len(self.importance)

    @abstractmethod
    def at(self, which: slice | Indices) -> Self:
        """Return the loss of some of the pixels."""

    @abstractmethod
    def weighed(self, by: Doubles) -> Self:
        """Return the same with `by`, (p,), times as much importance."""

    @abstractmethod
    def objective(self, x: Doubles) -> Doubles:
        """Return what a picture (3, p) costs, per channel, (3,)."""

    @abstractmethod
    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """Return image and weight, (3, p) each, of squares with the loss's gradient at x, (3, p).

        from_clipping: whether a clipped display value is drawn back by a chord, where it has no
        slope.
        """

    def objective_and_gradient(self, x: Doubles) -> tuple[float, Doubles]:
        """Return what few pixels cost, (3, p), and half the gradient, (3, p)."""
        image, weight = self.squares(x, from_clipping=False)
        return float(self.objective(x).sum()), weight * (x - image)

    def shares(self, x: Doubles, weight: Doubles) -> Doubles:
        """Return by how much squares made at x follow the current look, (3, p).

        weight: of these squares, (3, p).
        """
        return np.zeros_like(x)

    def same_squares(self, a: Doubles, b: Doubles) -> bool:
        """Return whether two pictures lie on the same pieces. Asked where there are some."""
        return False

    @cached_property
    def strips(self) -> tuple[tuple[slice, Self], ...]:
        """All pixels by parts, and where each is."""
        if len(self) <= STRIP:
            return ((slice(0, len(self)), self),)
        parts = [slice(k, min(k + STRIP, len(self))) for k in range(0, len(self), STRIP)]
        return tuple((where, self.at(where)) for where in parts)

    def each(self, work: Callable[[slice, Self], Result]) -> list[Result]:
        """Return the result of each strip, in order."""
        if len(self.strips) == 1:
            return [work(*self.strips[0])]
        return side_by_side(lambda strip: work(*strip), self.strips)


class Loss(ABC):
    """A loss of pictures (h, w, 3), linear."""

    #: Whether the loss is a linear problem itself.
    is_linear = False

    if TYPE_CHECKING:

        @property
        def transform(self) -> ViewTransform | None:
            """Through which light is compared; None for light itself."""

        @property
        def importance(self) -> Floats:
            """(h, w), how much each pixel counts."""

        @property
        def pixels(self) -> PixelLoss:
            """The same loss, channel by channel."""

    @abstractmethod
    def cut(self, part: Cut) -> Self:
        """Return the loss of some of the pixels."""

    def objective(self, x: Floats) -> Doubles:
        """Return what a picture x costs, less the least that any costs, per channel, (3,)."""
        return self.pixels.objective(planes_of(x))

    @cached_property
    def norm2(self) -> Doubles:
        """The loss of a black picture, (3,)."""
        return self.objective(np.zeros((*self.importance.shape, 3)))

    def meant(self, x: Floats) -> Floats:
        """Return the light that was to be there, (h, w, 3), given a picture x."""
        image, _ = self.pixels.squares(planes_of(x), from_clipping=False)
        return image_of(image, self.importance.shape)

    def missed(self, x: Floats) -> Doubles:
        """Return what a picture x misses of the painting, (h, w, 3), as it is compared."""
        return np.asarray(np.subtract(self.meant(x), x, dtype=np.float64))

    def exceeds(self, x: Floats | float) -> Bools:
        """Return where light x is more than was painted, and as good, (h, w, 3)."""
        return np.zeros((*self.importance.shape, 3), bool)

    def of_blocks(self, parts: Sequence[tuple[Cut, Doubles]], side: int) -> "Loss | None":
        """Return the loss of means over blocks of side × side pixels, as of a picture of one row.

        parts: of each view its part of the pixels, and (h, w), how much each of these counts. None
        where single pixels are always fitted.
        """
        return None


@dataclass(frozen=True)
class Squares(Loss):
    """Σ weight (image − x)²: a loss, and what stands for one where it was made.

    image: (h, w, 3). weight: (h, w, 1), or (h, w, 3) where channels differ, >= 0. share: of the
    same shape, by how much the image follows the current look.
    """

    image: Floats
    weight: Floats
    share: Floats

    is_linear = True
    transform = None

    @cached_property
    def importance(self) -> Floats:
        """(h, w), the most that any channel counts."""
        return np.asarray(self.weight.max(axis=-1))

    @cached_property
    def pixels(self) -> PixelLoss:
        """The same, channel by channel."""
        weight = np.broadcast_to(self.weight, self.image.shape)
        return SquaredPixels(planes_of(self.image), planes_of(weight))

    def objective(self, x: Floats) -> Doubles:
        missed = np.subtract(self.image, x, dtype=np.float64)
        return np.asarray((self.weight * np.square(missed)).sum(axis=(0, 1)))

    def meant(self, x: Floats) -> Floats:
        return self.image

    def cut(self, part: Cut) -> "Squares":
        return Squares(part(self.image), part(self.weight), part(self.share))


@dataclass(frozen=True)
class SquaredPixels(PixelLoss):
    """Squares of p pixels. image, weight: (3, p)."""

    image: Doubles
    weight: Doubles

    @property
    def has_pieces(self) -> bool:
        return True

    @cached_property
    def importance(self) -> Doubles:
        """(p,), the most that any channel counts."""
        return np.asarray(self.weight.max(axis=0))

    def at(self, which: slice | Indices) -> "SquaredPixels":
        return SquaredPixels(self.image[:, which], self.weight[:, which])

    def weighed(self, by: Doubles) -> "SquaredPixels":
        return SquaredPixels(self.image, self.weight * by)

    def objective(self, x: Doubles) -> Doubles:
        return np.asarray((self.weight * np.square(self.image - x)).sum(axis=1))

    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        return self.image, self.weight

    def same_squares(self, a: Doubles, b: Doubles) -> bool:
        return True


def planes_of(image: npt.NDArray[Any], kind: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
    """Return (3, p) of an image (h, w, 3)."""
    return np.ascontiguousarray(image.reshape(-1, 3).T, dtype=kind)


def image_of(planes: Doubles, size: tuple[int, ...]) -> Doubles:
    """Return (h, w, 3) of (3, p)."""
    return np.ascontiguousarray(planes.T).reshape(*size, 3)
