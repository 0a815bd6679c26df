"""The interface of a loss, and the one that is a linear problem itself.

A solve needs two things of any other loss: the loss of some pixels, and squares with the same
gradient there (`PixelLoss`). `reweighting.py` solves such squares repeatedly, and chooses the
length of each step by the loss itself. A new loss is a module with a `Loss` and its `PixelLoss`,
and a line in `painting.choose_loss`, which chooses one.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.colour import ViewTransform
from lightpaint.threads import parallel_map

#: Pixels in a strip, and in all strips that keep what they compute: of 1920 x 1080 pixels. With
#: more, the painting is encoded again each time.
STRIP_PIXELS, MAX_KEPT_PIXELS = 2**13, 2**21

#: Cuts one view's part out of an array of all views.
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
            """(p,), the weight of each pixel."""

    @property
    def has_pieces(self) -> bool:
        """True if the loss is squares piece by piece.

        A round is exact then, and the last, where no pixel leaves its piece.
        """
        return False

    @property
    def has_clipping(self) -> bool:
        """True if clipped display values may be drawn back (`from_clipping`)."""
        return False

    @property
    def has_curvature(self) -> bool:
        """True if `curved_squares` are nearer to the loss than `squares`."""
        return False

    @property
    def guide(self) -> Floats | None:
        """(3, p), a picture without noise that shows what the light shows; 0 where unknown."""
        return None

    def __len__(self) -> int:
        return len(self.importance)

    @abstractmethod
    def subset(self, which: slice | Indices) -> Self:
        """Return the loss of some of the pixels."""

    @abstractmethod
    def scaled(self, factors: Doubles) -> Self:
        """Return the same loss with importance multiplied by `factors`, (p,)."""

    @abstractmethod
    def objective(self, x: Doubles) -> Doubles:
        """Return the loss of a picture (3, p), per channel, (3,)."""

    @abstractmethod
    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """Return image and weight, (3, p) each, of squares with the loss's gradient at x, (3, p).

        from_clipping: whether a clipped display value is drawn back by a chord, where it has no
        slope.
        """

    def curved_squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        """Return `squares` whose weights are nearly the curvature of the loss at x."""
        return self.squares(x, from_clipping=from_clipping)

    def over_look(self, look: Doubles) -> Self:
        """Return the same loss over another current look, (3, p)."""
        return self

    def objective_and_gradient(self, x: Doubles) -> tuple[float, Doubles]:
        """Return the loss of few pixels, (3, p), and half the gradient, (3, p)."""
        image, weight = self.squares(x, from_clipping=False)
        return float(self.objective(x).sum()), weight * (x - image)

    def shares(self, x: Doubles, weight: Doubles) -> Doubles:
        """Return the share of squares made at x that follow the current look, (3, p).

        weight: of these squares, (3, p).
        """
        return np.broadcast_to(0.0, x.shape)

    def has_same_squares(self, a: Doubles, b: Doubles) -> bool:
        """Return whether two pictures lie on the same pieces. Called if `has_pieces`."""
        return False

    @cached_property
    def _kept_strips(self) -> list[tuple[slice, Self]]:
        """All pixels in parts, which cache their computations."""
        return [(strip, self.subset(strip)) for strip in self._parts]

    @property
    def _parts(self) -> list[slice]:
        return [
            slice(k, min(k + STRIP_PIXELS, len(self))) for k in range(0, len(self), STRIP_PIXELS)
        ]

    def map_strips(self, work: Callable[[slice, Self], Result]) -> list[Result]:
        """Return the result of each strip, in order."""
        if len(self) <= STRIP_PIXELS:
            return [work(slice(0, len(self)), self)]
        if len(self) > MAX_KEPT_PIXELS:
            return parallel_map(
                lambda part: work(part, self.subset(part)), self._parts, unit="strips"
            )
        return parallel_map(lambda strip: work(*strip), self._kept_strips, unit="strips")


class Loss(ABC):
    """A loss of pictures (h, w, 3), linear."""

    #: Whether the loss is a linear problem itself.
    is_linear = False

    if TYPE_CHECKING:

        @property
        def transform(self) -> ViewTransform | None:
            """The view transform of the comparison; None for light itself."""

        @property
        def importance(self) -> Floats:
            """(h, w), the weight of each pixel."""

        @property
        def pixels(self) -> PixelLoss:
            """The same loss, channel by channel."""

    @abstractmethod
    def cut(self, part: Cut) -> Self:
        """Return the loss of some of the pixels."""

    def objective(self, x: Floats) -> Doubles:
        """Return the loss of a picture x, less the least loss of any picture, per channel, (3,)."""
        return self.pixels.objective(_channels_of(x))

    @cached_property
    def norm2(self) -> Doubles:
        """The loss of a black picture, (3,)."""
        return self.objective(np.broadcast_to(0.0, (*self.importance.shape, 3)))

    def goal(self, x: Floats) -> Floats:
        """Return the light that would be best at picture x, (h, w, 3)."""
        image, _ = self.pixels.squares(_channels_of(x), from_clipping=False)
        return image_of(image, self.importance.shape)

    def residual(self, x: Floats) -> Doubles:
        """Return the residual of a picture x, (h, w, 3), in the space of the comparison."""
        return np.asarray(np.subtract(self.goal(x), x, dtype=np.float64))

    def exceeds(self, x: Floats | float) -> Bools:
        """Return where light x is brighter than the paint, and as good, (h, w, 3)."""
        return np.zeros((*self.importance.shape, 3), bool)

    def block_means(self, parts: Sequence[tuple[Cut, Doubles]], side: int) -> "Loss | None":
        """Return the loss of means over blocks of side × side pixels, in a picture of one row.

        parts: of each view its part of the pixels, and their weights (h, w). None for a loss that
        only fits single pixels.
        """
        return None


@dataclass(frozen=True)
class Squares(Loss):
    """The loss Σ weight (image − x)², by itself or as an approximation of another loss.

    image: (h, w, 3). weight: (h, w, 1), or (h, w, 3) where channels differ, >= 0. share: of
    the same shape, the share of the image that follows the current look.
    """

    image: Floats
    weight: Floats
    share: Floats

    is_linear = True
    transform = None

    @cached_property
    def importance(self) -> Floats:
        """(h, w), the largest weight of any channel."""
        return np.asarray(self.weight.max(axis=-1))

    @cached_property
    def pixels(self) -> PixelLoss:
        """The same loss, channel by channel."""
        weight = np.broadcast_to(self.weight, self.image.shape)
        return SquaredPixels(planes_of(self.image), planes_of(weight))

    def objective(self, x: Floats) -> Doubles:
        missed = np.subtract(self.image, x, dtype=np.float64)
        return np.asarray((self.weight * np.square(missed)).sum(axis=(0, 1)))

    def goal(self, x: Floats) -> Floats:
        return self.image

    def cut(self, part: Cut) -> "Squares":
        return Squares(part(self.image), part(self.weight), part(self.share))

    def release(self) -> None:
        """Forget arrays that can be made again: none of these."""


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
        """(p,), the largest weight of any channel."""
        return np.asarray(self.weight.max(axis=0))

    def subset(self, which: slice | Indices) -> "SquaredPixels":
        return SquaredPixels(self.image[:, which], self.weight[:, which])

    def scaled(self, factors: Doubles) -> "SquaredPixels":
        return SquaredPixels(self.image, self.weight * factors)

    def objective(self, x: Doubles) -> Doubles:
        return np.asarray((self.weight * np.square(self.image - x)).sum(axis=1))

    def squares(self, x: Doubles, *, from_clipping: bool) -> tuple[Doubles, Doubles]:
        return self.image, self.weight

    def has_same_squares(self, a: Doubles, b: Doubles) -> bool:
        return True


def planes_of(image: npt.NDArray[Any], kind: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
    """Return an image (h, w, 3) as planes (3, p)."""
    return np.ascontiguousarray(image.reshape(-1, 3).T, dtype=kind)


def _channels_of(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return an image (h, w, 3) as planes (3, p) in the same memory."""
    return image.reshape(-1, 3).T


def contiguous_rows(planes: npt.NDArray[Any], which: slice | Indices) -> npt.NDArray[Any]:
    """Return some pixels of planes (3, p), each channel contiguous: arithmetic on others is slow.

    Planes may be an image (h, w, 3) as it lies in memory.
    """
    part = planes[:, which]
    return part if part.strides[-1] == part.itemsize else np.ascontiguousarray(part)


def image_in_place(planes: Doubles, size: tuple[int, ...]) -> Doubles:
    """Return planes (3, p) as an image (h, w, 3) in the same memory."""
    return planes.T.reshape(*size, 3)


def image_of(planes: Doubles, size: tuple[int, ...]) -> Doubles:
    """Return planes (3, p) as an image (h, w, 3)."""
    return np.ascontiguousarray(planes.T).reshape(*size, 3)
