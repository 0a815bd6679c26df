"""The pixels of a target: which are painted, as they differ from its template, and their means.

A file from a paint program was rounded to its format, and perhaps compressed; pixels that differ by
more are paint. Faint paint counts less, so a soft brush leaves a soft importance.

The rounding tolerance is the rounding of 8 bits for all formats, because a file does not record the
history of its pixels: GIMP writes half floats into a float EXR, and 16-bit PNGs from 8-bit layers,
and profiles are converted back and forth. So a painting counts the same in every format.
"""

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats, largest
from lightpaint.colour import to_8_bit
from lightpaint.errors import SizeError
from lightpaint.images import Picture, block_mean, box_mean, grown, resampled
from lightpaint.images.formats import without_pillow_warnings
from lightpaint.sentences import Hint
from lightpaint.target.template import Template

#: Difference in display values from which paint counts fully.
FULL = 0.04

#: Tolerance in display values between the 8-bit roundings of two programs: half a code each; some
#: truncate instead of rounding, some dither (Mitsuba does, always).
ROUNDING = 1.6 / 255

#: Weight of a relative change of light above display white, in display values: about the slope of
#: display curves there.
BEYOND_WHITE = 0.44

#: Radius in pixels of the mean that hides differences between compressors, the tolerance after it,
#: and a radius at which paint is still localised.
LOSSY_RADIUS, LOSSY, SHARP_RADIUS = 4, 2.5 / 255, 1


def painted_where(path: Path, picture: Picture, template: Template) -> npt.NDArray[np.float32]:
    """Return the paint in each pixel, (h, w): 0 if `picture` equals `template` up to rounding, 1 if
    it certainly does not.

    path: the file of the picture, for its compression settings. Pixels that it does not store are
    unpainted. Raises SizeError if the two differ in size.
    """
    if picture.size != template.size:
        raise SizeError(
            f"the painting is {picture.size[1]}x{picture.size[0]} but its template is "
            f"{template.size[1]}x{template.size[0]}: export it at that size, or mark what "
            "was painted by alpha or ",
            Hint("mask"),
        )
    difference, tolerance = _difference(path, picture, template)
    # The slope is smooth at both ends, so that no pixel is decided by a hair's breadth.
    share = np.clip((difference - tolerance) / (FULL - tolerance), 0, 1)
    painted = (share * share * (3 - 2 * share)).astype(np.float32)
    if picture.stored is None:
        return _without_pinholes(painted)
    return np.where(picture.stored, _without_pinholes(painted * picture.stored), 0)


def _difference(path: Path, picture: Picture, template: Template) -> tuple[Floats, float]:
    """Return the largest difference over channels, (h, w), in display values, and the file's
    tolerance.
    """
    if picture.codes is None:
        # Its template may be the EXR, or the PNG, which ends at white.
        looks = [*template.looks, template.transform.decode(template.shown)]
        differences = [_difference_of_light(picture, look, template) for look in looks]
        return _closest(differences, ROUNDING), ROUNDING
    differences = [_difference_of_codes(path, picture, look) for look in template.looks]
    tolerance = LOSSY if picture.lossy else ROUNDING
    return _closest(differences, tolerance), tolerance


def _closest(differences: Sequence[Floats], tolerance: float) -> Floats:
    """Return the difference with the most unpainted pixels, among the looks that may be the
    template.
    """
    return max(differences, key=lambda difference: float((difference <= tolerance).mean()))


def _difference_of_codes(path: Path, picture: Picture, look: Floats) -> Floats:
    """Return the difference as shown by the painting's own display."""
    transform = picture.transform
    assert transform is not None  # A file of integers always has one.
    codes, look_codes = transform.encode(picture.image), transform.encode(look)
    if picture.lossy:
        return lossy_difference(codes, compressed_like(path, look_codes))
    return np.asarray(largest(np.abs(codes - look_codes)), np.float64)


def _difference_of_light(picture: Picture, look: Floats, template: Template) -> Floats:
    """Return the difference as shown by a display; beyond white, the relative difference."""
    transform = template.transform
    shown = np.abs(transform.encode(picture.image) - transform.encode(look))
    size = np.maximum(np.maximum(np.abs(look), np.abs(picture.image)), transform.white)
    relative = BEYOND_WHITE * np.abs(picture.image - look) / size
    return np.asarray(largest(np.maximum(shown, relative)), np.float64)


def lossy_difference(codes: Floats, look_codes: Floats) -> Floats:
    """Return the difference of display values (h, w, 3) beyond the effect of compression, (h,
    w).
    """
    rough = np.asarray(codes - look_codes, np.float64)
    small_step, large_step = (
        largest(np.abs(box_mean(rough, radius))) for radius in (SHARP_RADIUS, LOSSY_RADIUS)
    )
    return np.asarray(np.minimum(small_step, large_step))


def compressed_like(path: Path, display: Floats) -> Floats:
    """Return `display` compressed with the settings of the JPEG at `path`."""
    from PIL import Image, JpegImagePlugin

    eight = Image.fromarray(to_8_bit(display))
    with without_pillow_warnings(), Image.open(path) as file:
        tables = getattr(file, "quantization", None)
        if file.format != "JPEG" or not tables:
            return display
        sampling = JpegImagePlugin.get_sampling(file)
    buffer = io.BytesIO()
    try:
        eight.save(buffer, "JPEG", qtables=list(tables.values()), subsampling=sampling)
    except (OSError, ValueError):
        return display  # the encoder does not accept these tables
    return np.asarray(Image.open(buffer), np.float32) / 255


def _without_pinholes(share: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the paint without single-pixel holes, where paint happened to equal the template."""
    return -_largest_around(-_largest_around(share))


def _largest_around(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the maximum over each pixel and its eight neighbours."""
    height, width = values.shape
    padded = np.pad(values, 1, mode="edge")
    return np.asarray(
        np.max([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
    )


#: Margin above one half by which a share prevails, beyond float32 rounding.
TIE = 1e-5


class TargetPixels(NamedTuple):
    """The painted image with the weight of each pixel, and where brighter is as good.

    image: (h, w, 3) float32, linear. importance: (h, w) float32 >= 0. at_least: (h, w, 3) bool, or
    None for nowhere.
    """

    image: Floats
    importance: Floats
    at_least: Bools | None

    def resampled(self, size: tuple[int, int]) -> "TargetPixels":
        """Return these pixels at `size` (height, width), in linear light, weighted by importance.

        The importance is resampled too.
        """
        weighted = np.dstack([self.image * self.importance[..., None], self.importance])
        *rgb, importance = np.moveaxis(resampled(weighted, size), -1, 0)
        image = np.dstack(rgb) / np.where(importance > 0, importance, 1)[..., None]
        at_least = self._mean_at_least(lambda planes: resampled(planes, size))
        return TargetPixels(image, importance, at_least)

    def averaged(self, factor: int) -> "TargetPixels":
        """Return the means over blocks of factor × factor pixels, weighted by importance.

        The importance of a block is the mean over its pixels. For images that are constant in each
        block, the squared residual stays the same up to a constant.
        """
        importance = block_mean(self.importance, factor)
        weighted = block_mean(self.image * self.importance[..., None].astype(np.float64), factor)
        image = weighted / np.where(importance > 0, importance, 1)[..., None]
        at_least = self._mean_at_least(lambda planes: block_mean(planes, factor))
        return TargetPixels(image.astype(np.float32), importance, at_least)

    def cropped(self, height: int, width: int) -> "TargetPixels":
        """Return the top left part, of this size."""
        part = (slice(height), slice(width))
        at_least = None if self.at_least is None else self.at_least[part]
        return TargetPixels(self.image[part], self.importance[part], at_least)

    def _mean_at_least(self, mean: Callable[[Floats], Floats]) -> Bools | None:
        """Return `at_least` at another size, whose pixels are the `mean` of these.

        Light brighter than such a mean is acceptable if most of its pixels mean "at least", or if
        it contains part of a patch that does: then the excess lies in the patch, since a lamp
        outshines its surroundings. Single pixels are texture: there, light brighter than the mean
        would exceed the exact pixels between them.
        """
        if self.at_least is None:
            return None
        importance = self.importance[..., None]
        share = mean(self.at_least * importance)
        prevails = share > (0.5 + TIE) * mean(importance)
        patch = _patches(self.at_least) & (importance > 0)
        return np.asarray(prevails | (mean(patch.astype(np.float32)) > 0))


def _patches(mask: Bools) -> Bools:
    """Return `mask` (h, w, n) without parts narrower than three pixels: its opening by 3 × 3."""
    core = ~grown(~mask)
    return grown(core) & mask
