"""A painting as the solve sees it: linear pixels and how much each of them counts."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from PIL import Image

from lightpaint.errors import SizeError, TargetError
from lightpaint.images.blocks import block_any, block_mean, whole_factor
from lightpaint.images.exr import Floats
from lightpaint.images.view import View


@dataclass(frozen=True)
class Target:
    """The painted image Ψ and its importance D.

    image: (h, w, 3) float32, linear Rec.709, finite.
    importance: (h, w) float32 >= 0, the weight of each pixel's squared residual.
    everything: whether nobody said what was painted, so that every pixel counts 1.
    not_finite: number of pixels with NaN or Inf, which have no importance.
    at_least: (h, w, 3) bool, where the painting was at the top of what its file can say, so that
        this or anything brighter was meant; None if it can say everything.
    notes: what a person should know of how it was read, a sentence each.
    content, sensor: of the scene and view that it was painted on, where a template says.
    view: what a display showed it through when it was painted; None if nobody knows.
    """

    name: str
    image: Floats
    importance: Floats
    everything: bool
    not_finite: int = 0
    at_least: npt.NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()
    content: str = ""
    sensor: str = ""
    view: View | None = None

    def __post_init__(self) -> None:
        if self.image.shape != (*self.importance.shape, 3):
            raise SizeError(
                f"target {self.name}: image {self.image.shape} and importance "
                f"{self.importance.shape} differ in size"
            )
        if self.at_least is not None and self.at_least.shape != self.image.shape:
            raise SizeError(
                f"target {self.name}: image {self.image.shape} and at_least {self.at_least.shape} "
                "differ in size"
            )
        if not np.isfinite(self.image).all():
            raise TargetError(f"target {self.name} holds NaN or Inf")
        if not np.isfinite(self.importance).all() or (self.importance < 0).any():
            raise TargetError(
                f"target {self.name}: importance must be finite and not negative; it is between "
                f"{np.min(self.importance):g} and {np.max(self.importance):g}"
            )
        if not self.importance.any():
            if self.not_finite == self.importance.size:
                raise TargetError(f"target {self.name} holds NaN or Inf in every pixel")
            raise TargetError(
                f"target {self.name} has importance 0 everywhere, so nothing in it counts: "
                "paint with some alpha, or give a mask that is not black"
            )

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.image.shape[0], self.image.shape[1]

    def resized(self, size: tuple[int, int]) -> "Target":
        """Resampled to `size` (height, width), in linear light, weighted by importance."""
        if size == self.size:
            return self
        height, width = size
        weighted = np.dstack([self.image * self.importance[..., None], self.importance])
        shrinks = width <= self.size[1]
        kernel = Image.Resampling.BOX if shrinks else Image.Resampling.BILINEAR
        planes = [
            Image.fromarray(np.ascontiguousarray(plane, dtype=np.float32)).resize(
                (width, height), kernel
            )
            for plane in np.moveaxis(weighted, -1, 0)
        ]
        *rgb, importance = (np.asarray(p) for p in planes)
        image = np.dstack(rgb) / np.where(importance > 0, importance, 1)[..., None]
        return replace(self, image=image, importance=importance, at_least=self._at_least(size))

    def reduced(self, factor: int) -> "Target":
        """One pixel for each block of factor x factor: their mean, weighted by importance.

        The importance of a block is the mean of its pixels'. For images that are constant in
        each block, the squared residual is then the same as before but for a constant.
        """
        if factor == 1:
            return self
        importance = block_mean(self.importance, factor)
        weighted = block_mean(self.image * self.importance[..., None].astype(np.float64), factor)
        image = weighted / np.where(importance > 0, importance, 1)[..., None]
        at_least = None if self.at_least is None else block_any(self._counted(), factor)
        return replace(
            self, image=image.astype(np.float32), importance=importance, at_least=at_least
        )

    def _counted(self) -> npt.NDArray[np.bool_]:
        """`at_least` where it counts: elsewhere it says nothing about the means over blocks."""
        assert self.at_least is not None
        return self.at_least & (self.importance > 0)[..., None]

    def _at_least(self, size: tuple[int, int]) -> npt.NDArray[np.bool_] | None:
        """Resampled: whether any pixel that overlaps, or is interpolated from, is at least."""
        if self.at_least is None:
            return None
        rows, columns = (_overlap(n, m) for n, m in zip(self.size, size, strict=True))
        counted = self._counted().astype(np.float32)
        touched = np.einsum("Hh,hwc,Ww->HWc", rows, counted, columns, optimize=True)
        return np.asarray(touched > 0)

    def fitted_to(self, size: tuple[int, int], *, resize: bool) -> "Target":
        """This target at `size` (height, width) of the basis.

        A whole multiple of that is reduced: so is one that was painted at full size, for a
        basis on a reduced film. Raises SizeError if it has another size and may not be
        resampled.
        """
        if factor := whole_factor(self.size, size):
            return self.reduced(factor)
        if self.size != size and not resize:
            raise SizeError(
                f"target {self.name} is {self.size[1]}x{self.size[0]} but the basis is "
                f"{size[1]}x{size[0]}: export it at that size, or pass --resize"
            )
        (height, width), (mine_h, mine_w) = size, self.size
        if abs(width * mine_h / (height * mine_w) - 1) > 0.02:
            raise SizeError(
                f"target {self.name} is {mine_w}x{mine_h}, of another shape than the basis with "
                f"{width}x{height}: crop it to that shape, --resize does not stretch"
            )
        return self.resized(size)


def _overlap(old: int, new: int) -> Floats:
    """(new, old): 1 where an old pixel is part of a new one, in one direction of an image.

    A new pixel that is narrower than an old one is interpolated from the two nearest.
    """
    reach = max(old / new / 2, 1.0)
    centres = (np.arange(new) + 0.5) * old / new
    if new <= old:
        # Boxes touch pixels that they overlap: half a pixel more than to the centres.
        reach += 0.5
    distance = np.abs(np.arange(old) + 0.5 - centres[:, None])
    return (distance < reach - 1e-9).astype(np.float32)
