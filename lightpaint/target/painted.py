"""What was painted: where a picture differs from the template it was painted on.

A file that comes back from a paint program was rounded to its format, and maybe compressed; all
that differs by more is paint. Faint paint counts for less, so that a soft brush leaves a soft
importance.
"""

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, JpegImagePlugin

from lightpaint.errors import SizeError
from lightpaint.images.display import to_8_bit
from lightpaint.images.estimate import box_mean
from lightpaint.images.exr import Floats
from lightpaint.images.picture import Picture
from lightpaint.target.template import Template

#: Difference at which paint counts fully: of the display's range; and, about the same for the eye,
#: of the brighter of two linear values.
FULL, FULL_OF_LIGHT = 0.04, 0.09

#: Codes by which programs differ in rounding: half a code each, and dithering.
ROUNDING = 1.6

#: Pixels on either side over which what compressors do differently to single ones averages out,
#: and what is left of it then.
LOSSY_RADIUS, LOSSY = 4, 2.5 / 255

#: Light below this share of display white is compared as if it were that: deep shadows are noise.
DARK = 0.002


def painted_where(path: Path, picture: Picture, template: Template) -> npt.NDArray[np.float32]:
    """(h, w) in [0, 1]: 0 where `picture` is `template` but for rounding, 1 where it surely is not.

    path: the file of the picture, which says how it was compressed. Raises SizeError if the two
    differ in size.
    """
    if picture.size != template.size:
        raise SizeError(
            f"the painting is {picture.size[1]}x{picture.size[0]} but its template is "
            f"{template.size[1]}x{template.size[0]}: export it at that size, or say by alpha or "
            "--mask what was painted"
        )
    if picture.codes is None:
        (difference, tolerance), full = _difference_of_light(picture, template), FULL_OF_LIGHT
    else:
        (difference, tolerance), full = _difference_of_codes(path, picture, template), FULL
    # The slope is smooth at both ends, so that nothing is decided by a hair's breadth.
    share = np.clip((difference - tolerance) / (full - tolerance), 0, 1)
    return _without_pinholes((share * share * (3 - 2 * share)).astype(np.float32))


def _difference_of_light(picture: Picture, template: Template) -> tuple[Floats, float]:
    """Relative difference of linear light, largest of the channels, and what rounding makes."""
    tolerance = 4 * 2.0 ** -(picture.mantissa or 24)
    # It may have been painted on the EXR, or on the PNG and saved as light.
    decoded = template.view.decode(template.shown)
    looks = [(template.image, tolerance), (decoded, tolerance + 1e-4)]
    found = []
    for look, allowed in looks:
        dark = DARK * template.view.white
        size = np.maximum(np.maximum(np.abs(look), np.abs(picture.image)), dark)
        relative = np.max(np.abs(picture.image - look) / size, axis=-1)
        found.append((relative, allowed))
    return min(found, key=lambda pair: float(np.median(np.minimum(pair[0], FULL_OF_LIGHT))))


def _difference_of_codes(path: Path, picture: Picture, template: Template) -> tuple[Floats, float]:
    """Difference of display values, largest of the channels, and what rounding makes."""
    assert picture.codes is not None
    view = picture.view or template.view
    mine, its = view.encode(picture.image), view.encode(template.image)
    if picture.lossy:
        smooth = box_mean(np.asarray(mine - _compressed_like(path, its), np.float64), LOSSY_RADIUS)
        return np.abs(smooth).max(axis=-1), LOSSY
    difference = np.asarray(mine - its, np.float64)
    codes = 255 if _is_8_bit(mine) else picture.codes
    # Some programs reckon in 15 bits when they say 16.
    return np.abs(difference).max(axis=-1), ROUNDING / min(codes, 2**15)


def _compressed_like(path: Path, display: Floats) -> Floats:
    """`display` after the compression that the JPEG at `path` has gone through."""
    eight = Image.fromarray(to_8_bit(display))
    with Image.open(path) as file:
        tables = getattr(file, "quantization", None)
        if file.format != "JPEG" or not tables:
            return display
        sampling = JpegImagePlugin.get_sampling(file)
    buffer = io.BytesIO()
    try:
        eight.save(buffer, "JPEG", qtables=list(tables.values()), subsampling=sampling)
    except (OSError, ValueError):
        return display  # tables that this encoder does not take
    return np.asarray(Image.open(buffer), np.float32) / 255


def _is_8_bit(display: Floats) -> bool:
    """Whether all values are those of 8 bits, whatever the file has."""
    values = display * 255
    return bool(np.abs(values - np.round(values)).max() < 0.02)


def _without_pinholes(share: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Single pixels that paint happened to leave as they were are part of what is around them."""
    return -_largest_around(-_largest_around(share))


def _largest_around(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Maximum over the pixel and its eight neighbours."""
    height, width = values.shape
    padded = np.pad(values, 1, mode="edge")
    return np.asarray(
        np.max([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
    )
