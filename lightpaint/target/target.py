"""A painting as the solve sees it: linear pixels and how much each of them counts."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from lightpaint.errors import ImageError, SizeError, TargetError
from lightpaint.images.blocks import block_mean, whole_factor
from lightpaint.images.exr import Floats, Part, read_parts

#: Channel that holds importance in a file whose RGB is not premultiplied.
WEIGHT_CHANNEL = "W"

#: CIE xy of red, green, blue and white of Rec.709, the colours of every image here.
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


@dataclass(frozen=True)
class Target:
    """The painted image Ψ and its importance D.

    image: (h, w, 3) float32, linear Rec.709, finite.
    importance: (h, w) float32 >= 0, the weight of each pixel's squared residual.
    everything: whether nobody said what was painted, so that every pixel counts 1.
    not_finite: number of pixels with NaN or Inf, which have no importance.
    """

    name: str
    image: Floats
    importance: Floats
    everything: bool
    not_finite: int = 0

    def __post_init__(self) -> None:
        if self.image.shape != (*self.importance.shape, 3):
            raise SizeError(
                f"target {self.name}: image {self.image.shape} and importance "
                f"{self.importance.shape} differ in size"
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
        return replace(self, image=image, importance=importance)

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
        return replace(self, image=image.astype(np.float32), importance=importance)

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


def read_target(path: str | Path, *, mask: str | Path | None = None) -> Target:
    """Read a painted EXR: R, G, B in linear Rec.709.

    What counts is, in this order: `mask` (its Y, W, A or R channel); the file's W channel;
    its alpha, by which RGB is then taken to be premultiplied, as OpenEXR prescribes;
    without any of them, every pixel alike. Where such an alpha is 0 no colour was painted,
    and a mask does not make one.

    Raises ImageError for files that cannot be read or declare other primaries, TargetError
    for what cannot be solved for, SizeError if target and mask differ in size.
    """
    path = Path(path)
    stored = _single_part(path)
    part = stored.in_display_window()
    try:
        image = part.rgb()
    except ImageError as error:
        raise ImageError(f"{path} is no RGB image: {error}") from None
    _check_primaries(path, part)
    importance, alpha = None, part.channels.get("A")
    if mask is not None:
        importance = _read_mask(Path(mask))
        if importance.shape != part.size:
            raise SizeError(
                f"mask {mask} is {importance.shape[1]}x{importance.shape[0]} but the target {path} "
                f"is {part.size[1]}x{part.size[0]}: export both at one size"
            )
    elif WEIGHT_CHANNEL in part.channels:
        importance = part.channels[WEIGHT_CHANNEL].astype(np.float32)
    elif alpha is not None:
        importance = alpha.astype(np.float32)
    if alpha is not None and WEIGHT_CHANNEL not in part.channels:
        image = _unpremultiplied(image, alpha.astype(np.float32))
        if mask is not None and importance is not None:
            # Premultiplied black over nothing is the absence of a colour, not black.
            importance = np.where(alpha > 0, importance, np.float32(0))

    finite = np.asarray(np.isfinite(image).all(axis=-1))
    # Pixels that the file does not store were not painted.
    stored_ones = replace(stored, channels={"Y": np.ones(stored.size, np.float32)})
    everywhere = stored_ones.in_display_window().channels["Y"]
    weights = everywhere if importance is None else importance
    return Target(
        name=path.stem,
        image=np.where(finite[..., None], image, 0).astype(np.float32),
        importance=np.where(finite, weights, 0).astype(np.float32),
        everything=importance is None,
        not_finite=int(finite.size - finite.sum()),
    )


def _check_primaries(path: Path, part: Part) -> None:
    # Files round the numbers: to three decimals, or to float16.
    if part.primaries is None or np.allclose(part.primaries, REC709, rtol=0, atol=1e-3):
        return
    xy = [f"({x:.4g}, {y:.4g})" for x, y in zip(*[iter(part.primaries)] * 2, strict=True)]
    raise ImageError(
        f"{path} declares the primaries {', '.join(xy[:3])} and the white {xy[3]} (chromaticities "
        "in CIE xy), but linear Rec.709 is expected: convert it and export it again"
    )


def _unpremultiplied(image: Floats, alpha: Floats) -> Floats:
    safe = np.where(alpha > 0, alpha, 1)
    # Over next to no alpha a colour may become infinite, and is then counted as such.
    with np.errstate(over="ignore"):
        return image / safe[..., None]


def _read_mask(path: Path) -> npt.NDArray[np.float32]:
    part = _single_part(path).in_display_window()
    for name in ("Y", WEIGHT_CHANNEL, "A", "R"):
        if name in part.channels:
            return part.channels[name].astype(np.float32)
    raise ImageError(
        f"mask {path} has none of the channels Y, W, A, R: it has {', '.join(part.channels)}"
    )


def _single_part(path: Path) -> Part:
    parts = read_parts(path)
    if len(parts) > 1:
        raise ImageError(
            f"{path} has {len(parts)} parts ({', '.join(p.name for p in parts)}), and which of "
            "them is the painting cannot be told: export a single image"
        )
    return parts[0]
