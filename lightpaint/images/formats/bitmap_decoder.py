"""Decodes a bitmap's numbers to linear Rec.709, through its profile and a view transform."""

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

#: Number of pixels converted at a time.
STRIP_PIXELS = 2**18


def transform_of(bitmap: Bitmap) -> ViewTransform | None:
    """Return the view transform declared in a file; None if it declares none."""
    if bitmap.shown is None:
        return None
    name, _, stops = bitmap.shown.rpartition(" ")
    try:
        return ViewTransform(name, float(stops))
    except ValueError:
        raise ImageError(
            f"declares that it was shown through {bitmap.shown!r}, which is not a view transform"
        ) from None


def light_of_floats(bitmap: Bitmap, alpha: Floats | None) -> Floats:
    """Return floats as linear Rec.709, (h, w, 3) float32, not premultiplied."""
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
    """Return integers as linear Rec.709, converted strip by strip."""
    assert bitmap.codes is not None
    profile = bitmap.profile
    if profile is not None and profile.is_srgb:
        profile = None
    image = np.empty(bitmap.values.shape, np.float32)
    rows = max(1, STRIP_PIXELS // bitmap.values.shape[1])
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
    """Return the function from stored numbers (h, w, 3) to light.

    by_table: whether it takes integers and looks them up in a table; otherwise it takes values in
    [0, 1].
    """

    def curve(function: Callable[[Floats], Floats]) -> Callable[[npt.NDArray[Any]], Floats]:
        if not by_table:
            return function
        # A table is fast, since the same numbers recur.
        table = np.asarray(function(np.arange(codes + 1) / codes), np.float32)
        return lambda values: table[values]

    if profile is None and transform.is_per_channel:
        return curve(transform.decode)
    if profile is None:
        display = curve(lambda values: values)
        return lambda values: transform.decode(display(values))
    curves = [curve(curve_of_channel) for curve_of_channel in profile.curves]

    def through_profile(values: npt.NDArray[Any]) -> Floats:
        light = np.stack(
            [curve_of_channel(values[..., k]) for k, curve_of_channel in enumerate(curves)], axis=-1
        )
        shown = converted(light, profile.matrix)
        return _through(transform, shown, is_linear=profile.is_linear, name=profile.name)

    return through_profile


def _through(transform: ViewTransform, shown: Floats, *, is_linear: bool, name: str) -> Floats:
    """Return scene light, linear Rec.709, from light as shown by a display."""
    scale = np.float32(2.0**transform.stops)
    if transform.name == "srgb" or (transform.name == "linear" and is_linear):
        return (
            shown / scale
        )  # Keeps colours outside Rec.709, which display values cannot represent.
    if transform.name == "linear":
        raise ImageError(
            f"has the colour profile {name!r}, but the view transform is linear: choose another "
            "one, or export it without profile"
        )
    return transform.decode(encode_display(shown))


def unpremultiply(image: Floats, alpha: Floats) -> None:
    """Divide by alpha in place where it is > 0."""
    # Division by a tiny alpha may give Inf, which the caller handles.
    with np.errstate(over="ignore", invalid="ignore"):
        image /= np.where(alpha > 0, alpha, np.float32(1))[..., None]
