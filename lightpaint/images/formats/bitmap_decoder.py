"""From the numbers of a bitmap to linear Rec.709, through its profile and a view transform."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.icc import Profile
from lightpaint.colour.primaries import converted
from lightpaint.colour.srgb import encode_display
from lightpaint.errors import ImageError
from lightpaint.images.formats.bitmap import Bitmap

#: Pixels that are converted at once.
STRIP = 2**18


def transform_of(bitmap: Bitmap) -> ViewTransform | None:
    """The view transform that a file says it was made with."""
    if bitmap.shown is None:
        return None
    name, _, stops = bitmap.shown.rpartition(" ")
    try:
        return ViewTransform(name, float(stops))
    except ValueError:
        raise ImageError(
            f"says that it was shown through {bitmap.shown!r}, no view transform"
        ) from None


def light_of_floats(bitmap: Bitmap, alpha: Floats | None) -> Floats:
    """Linear Rec.709 of floats, (h, w, 3) float32, not premultiplied."""
    image = np.array(bitmap.values, np.float32)
    if bitmap.profile is not None:
        if not bitmap.profile.is_linear:
            raise ImageError(
                f"holds floats of the profile {bitmap.profile.name!r}, which is not linear: "
                "convert it to linear light and export it again"
            )
        image = converted(image, bitmap.profile.matrix)
    if alpha is not None and bitmap.premultiplied:
        unpremultiply(image, alpha)
    return image


def light_of_integers(bitmap: Bitmap, alpha: Floats | None, transform: ViewTransform) -> Floats:
    """Linear Rec.709 of the integers, strip by strip."""
    assert bitmap.codes is not None
    profile = bitmap.profile
    if profile is not None and profile.is_srgb:
        profile = None
    image = np.empty(bitmap.values.shape, np.float32)
    rows = max(1, STRIP // bitmap.values.shape[1])
    decode = _decoder(bitmap.codes, profile, transform, by_table=not bitmap.premultiplied)
    for top in range(0, len(image), rows):
        strip = slice(top, top + rows)
        values = bitmap.values[strip]
        if bitmap.premultiplied and alpha is not None:
            display = values / np.float32(bitmap.codes)
            unpremultiply(display, alpha[strip])
            values = np.clip(display, 0, 1)
        image[strip] = decode(values)
    return image


def _decoder(
    codes: int, profile: Profile | None, transform: ViewTransform, *, by_table: bool
) -> Callable[[npt.NDArray[Any]], Floats]:
    """From numbers (h, w, 3) to light: from integers by table, else from values in [0, 1]."""

    def curve(of: Callable[[Floats], Floats]) -> Callable[[npt.NDArray[Any]], Floats]:
        if not by_table:
            return of
        # The same numbers come again and again.
        table = np.asarray(of(np.arange(codes + 1) / codes), np.float32)
        return lambda values: table[values]

    if profile is None and transform.is_per_channel:
        return curve(transform.decode)
    if profile is None:
        display = curve(lambda values: values)
        return lambda values: transform.decode(display(values))
    curves = [curve(own) for own in profile.curves]

    def through_profile(values: npt.NDArray[Any]) -> Floats:
        light = np.stack([own(values[..., k]) for k, own in enumerate(curves)], axis=-1)
        shown = converted(light, profile.matrix)
        return _through(transform, shown, is_linear=profile.is_linear, name=profile.name)

    return through_profile


def _through(transform: ViewTransform, shown: Floats, *, is_linear: bool, name: str) -> Floats:
    """Scene light of what a display is to show, in linear Rec.709."""
    scale = np.float32(2.0**transform.stops)
    if transform.name == "srgb" or (transform.name == "linear" and is_linear):
        return shown / scale  # Beyond Rec.709 as well, for which display values have no room.
    if transform.name == "linear":
        raise ImageError(f"has the colour profile {name!r}, but its numbers are said to be linear")
    return transform.decode(encode_display(shown))


def unpremultiply(image: Floats, alpha: Floats) -> None:
    """Divide by alpha, in place, where there is some."""
    # Over next to no alpha a colour may become infinite, and is then counted as such.
    with np.errstate(over="ignore", invalid="ignore"):
        image /= np.where(alpha > 0, alpha, np.float32(1))[..., None]
