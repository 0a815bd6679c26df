"""What a picture costs: squares of what it misses, or a loss that squares stand for near an answer.

`Squares` are the linear problem: Σ D (Ψ − x)² in linear light, M and b are made of them. They are
the loss where nothing else is asked. A `PaintingLoss` knows "at least this bright" and what a
display shows; `reweighted.py` finds the squares that stand for it where it is least.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour.transform import ViewTransform
from lightpaint.lighting.pixels import STRIP, Pixels, image_of, planes_of

#: From arrays of all views to the part of one of them.
Cut = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]


@dataclass(frozen=True)
class Squares:
    """Σ weight (image − x)²: a loss, and what stands for one where it was made.

    image: (h, w, 3). weight: (h, w, 1), or (h, w, 3) where channels differ, >= 0. share: of the
    same shape, by how much the image follows the current look.
    """

    image: Floats
    weight: Floats
    share: Floats

    #: Light itself is compared.
    transform = None

    @cached_property
    def importance(self) -> Floats:
        """(h, w), the most that any channel counts."""
        return np.asarray(self.weight.max(axis=-1))

    @cached_property
    def norm2(self) -> Doubles:
        """‖Ψ‖², (3,)."""
        return self.objective(np.zeros_like(self.image))

    def objective(self, x: Floats) -> Doubles:
        """(3,), of a picture x (h, w, 3)."""
        missed = np.subtract(self.image, x, dtype=np.float64)
        return np.asarray((self.weight * np.square(missed)).sum(axis=(0, 1)))

    def meant(self, x: Floats) -> Floats:
        """The image, whatever x is."""
        return self.image

    def missed(self, x: Floats) -> Doubles:
        """What x misses of the image, (h, w, 3)."""
        return np.asarray(np.subtract(self.image, x, dtype=np.float64))

    def cut(self, part: Cut) -> "Squares":
        """Those of some of the pixels."""
        return Squares(part(self.image), part(self.weight), part(self.share))


@dataclass(frozen=True)
class PaintingLoss:
    """With the importance D, the part q of it that is for the current look C, and the view
    transform V:

        F(x) = Σ D [(1 − q) ‖V(ψ) − V(x)‖² + q ‖V(C) − V(x)‖²]

    ψ is the painting Ψ; but where Ψ says only "at least this bright", it is x if that is brighter.
    V is the identity in linear light, and F then is convex.

    painted: (h, w, 3), Ψ, linear. importance: (h, w), D. share: (h, w), q. current: (h, w, 3), C,
    linear. at_least: (h, w, 3), where brighter is as good. transform: V, None for linear light.
    """

    painted: Floats
    importance: Floats
    share: Floats
    current: Floats
    at_least: Bools
    transform: ViewTransform | None = None

    def cut(self, part: Cut) -> "PaintingLoss":
        """That of some of the pixels."""
        return replace(
            self,
            painted=part(self.painted),
            importance=part(self.importance),
            share=part(self.share),
            current=part(self.current),
            at_least=part(self.at_least),
        )

    @cached_property
    def pixels(self) -> Pixels:
        """All of them, channel by channel."""
        return Pixels(
            planes_of(self.painted),
            np.asarray(self.importance, np.float64).ravel(),
            np.asarray(self.share, np.float64).ravel(),
            planes_of(self.current),
            planes_of(self.at_least, bool) if self._may_exceed else None,
            self.transform,
        )

    def shown(self, image: Floats) -> Doubles:
        """V of linear pixels, (…, 3)."""
        if self.transform is None:
            return np.array(image, np.float64)
        planes = planes_of(image)
        out = np.empty_like(planes)
        for start in range(0, planes.shape[1], STRIP):
            where = slice(start, start + STRIP)
            out[:, where] = self.transform.encode_planes(planes[:, where])
        return image_of(out, image.shape[:-1])

    def objective(self, x: Floats) -> Doubles:
        """F less the least that any picture could have, per channel, (3,). x: (h, w, 3)."""
        return self.pixels.objective(planes_of(x))

    @cached_property
    def norm2(self) -> Doubles:
        """The objective of a black picture, (3,): ‖Ψ‖² where nothing else is asked."""
        return self.objective(np.zeros_like(self.painted))

    def meant(self, x: Floats) -> Doubles:
        """What was to be there, (h, w, 3) linear, of a picture x: x itself where that will do."""
        q = self.share[..., None]
        return np.asarray((1 - q) * self._moved(x) + q * self.current, np.float64)

    def missed(self, x: Floats) -> Doubles:
        """V(ψ) − V(x), (h, w, 3): what a picture misses of the painting."""
        return np.asarray(self.shown(self._moved(x)) - self.shown(x))

    def _exceeds(self, x: Floats) -> Bools:
        return self.at_least & (x > self.painted) if self._may_exceed else self.at_least

    @cached_property
    def _may_exceed(self) -> bool:
        return bool(self.at_least.any())

    def _moved(self, x: Floats) -> Doubles:
        """ψ at x, (h, w, 3)."""
        return np.asarray(np.where(self._exceeds(x), x, self.painted), np.float64)


#: F, of pictures x, (h, w, 3) linear; seen through its transform, or as linear light.
Loss = Squares | PaintingLoss
