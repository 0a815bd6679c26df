"""The loss of a painting with "at least this bright", in light or as a display shows it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.bands import BAND_PIXELS, by_bands
from lightpaint.images.pixel_blocks import block_sums
from lightpaint.lighting.loss.channel_loss import PaintedPixels
from lightpaint.lighting.loss.loss import STRIP_PIXELS, Cut, Loss, image_of, planes_of
from lightpaint.threads import parallel_map

#: Fields of a loss that are pictures.
PICTURES = ("painted", "importance", "share", "current", "at_least")


@dataclass(frozen=True)
class PaintingLoss(Loss):
    """The loss of pictures against a painting, as a display shows both, or as light.

    With the importance D, the part q of it that is for the current look C, and the view
    transform V:

        F(x) = Σ D [(1 − q) ‖V(ψ) − V(x)‖² + q ‖V(C) − V(x)‖²]

    ψ is the painting Ψ; where Ψ means only "at least this bright", it is x if that is brighter.
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
        pictures: dict[str, Any] = {name: part(getattr(self, name)) for name in PICTURES}
        return replace(self, **pictures)

    @cached_property
    def pixels(self) -> PaintedPixels:
        """All pixels, channel by channel: of many, in the memory of the pictures."""
        is_long = self.importance.size > STRIP_PIXELS  # strips of them are copied

        def planes(image: npt.NDArray[Any]) -> npt.NDArray[Any]:
            return image.reshape(-1, 3).T if is_long else planes_of(image, image.dtype)

        return PaintedPixels(
            planes(self.painted),
            np.asarray(self.importance, np.float64).ravel(),
            np.asarray(self.share, np.float64).ravel(),
            planes(self.current),
            planes(self.at_least) if self._may_exceed else None,
            self.transform,
        )

    def encode(self, image: Floats) -> Doubles:
        """Return V of linear pixels, (…, 3)."""
        if self.transform is None:
            return np.array(image, np.float64)
        planes = planes_of(image)
        encoded = np.empty_like(planes)
        for start in range(0, planes.shape[1], STRIP_PIXELS):
            strip = slice(start, start + STRIP_PIXELS)
            encoded[:, strip] = self.transform.encode_planes(planes[:, strip])
        return image_of(encoded, image.shape[:-1])

    def goal(self, x: Floats) -> Doubles:
        """Return (1 − q) ψ + q C at a picture x, (h, w, 3) linear."""

        def mean(q: Floats, x: Floats, painted: Floats, at_least: Bools, current: Floats) -> Floats:
            q, psi = q[..., None], np.where(at_least & (x > painted), x, painted)
            return np.asarray((1 - q) * psi.astype(np.float64) + q * current, np.float64)

        arrays = self.share, x, self.painted, self.at_least, self.current
        return np.asarray(by_bands(mean, *arrays))

    def residual(self, x: Floats) -> Doubles:
        """Return V(ψ) − V(x), (h, w, 3)."""
        return np.asarray(self.encode(self._psi(x)) - self.encode(x))

    def exceeds(self, x: Floats | float) -> Bools:
        return self.at_least & (x > self.painted) if self._may_exceed else self.at_least

    @cached_property
    def _may_exceed(self) -> bool:
        return bool(self.at_least.any())

    def _psi(self, x: Floats) -> Doubles:
        """Return ψ at x, (h, w, 3)."""
        return np.asarray(np.where(self.exceeds(x), x, self.painted), np.float64)

    def block_means(self, parts: Sequence[tuple[Cut, Doubles]], side: int) -> "PaintingLoss":
        averages = [self.cut(cut)._block_average(counts, side) for cut, counts in parts]

        def row(name: str) -> npt.NDArray[Any]:
            arrays = [getattr(part, name) for part in averages]
            return np.concatenate([x.reshape(-1, *x.shape[2:]) for x in arrays])[None]

        rows: dict[str, Any] = {name: row(name) for name in PICTURES}
        return replace(self, **rows)

    def _block_average(self, counts: Doubles, side: int) -> "PaintingLoss":
        """Return the loss of means over blocks of one view. counts: (h, w), the importance."""

        def band_average(rows: slice) -> PaintingLoss:
            part = self.cut(lambda image: image[rows])
            return part._whole_block_average(counts[rows], side)

        height, step = len(counts), side * max(1, BAND_PIXELS // (side * counts.shape[1]))
        tops = range(0, height, step)
        bands = parallel_map(lambda top: band_average(slice(top, top + step)), tops)

        def joined(name: str) -> npt.NDArray[Any]:
            return np.concatenate([getattr(band, name) for band in bands])

        rows: dict[str, Any] = {name: joined(name) for name in PICTURES}
        return replace(self, **rows)

    def _whole_block_average(self, counts: Doubles, side: int) -> "PaintingLoss":
        """Return the loss of means over blocks of one view, all at once."""
        total = block_sums(counts, side)
        painted_weight, current_weight = (1 - self.share) * counts, self.share * counts

        def mean(image: Floats, weight: Floats) -> Doubles:
            total = block_sums(weight.astype(np.float64), side)
            sums = block_sums(image * weight[..., None].astype(np.float64), side)
            return np.asarray(sums / np.where(total > 0, total, 1)[..., None])

        return replace(
            self,
            painted=mean(self.painted, painted_weight),
            importance=total,
            share=block_sums(current_weight.astype(np.float64), side)
            / np.where(total > 0, total, 1),
            current=mean(self.current, current_weight),
            at_least=mean(self.at_least.astype(np.float64), painted_weight) > 0.5,
        )
