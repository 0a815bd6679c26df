"""PNG, TIFF, JPEG and PSD: the stored numbers of a picture, and the linear light that they mean.

OpenImageIO decodes them with the formats' own libraries. Files that declare more than MAX_PIXELS,
or that it would misread (CMYK, Lab, several pages, Photoshop files without a merged picture), are
rejected here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.icc import Profile, read_icc
from lightpaint.colour.primaries import converted
from lightpaint.colour.srgb import encode_display
from lightpaint.errors import ImageError
from lightpaint.files import first_line
from lightpaint.images.formats.header_checks import check_psd, check_tiff
from lightpaint.images.formats.library_output import silenced
from lightpaint.images.formats.png import PNG_HEAD, longest_png, read_png_head

#: Maximum number of pixels that are decoded: 8192x4096, for which decoding takes about 1 GB.
MAX_PIXELS = 2**25

#: Maximum size in bytes of a file that is opened.
MAX_FILE = 2**31

#: TIFF's PhotometricInterpretation: supported values, and names of unsupported ones.
TIFF_COLOURS = {0: "grey", 1: "grey", 2: "RGB", 3: "palette", 6: "YCbCr"}
TIFF_OTHERS = {4: "a mask", 5: "CMYK", 8: "Lab", 9: "Lab", 10: "Lab", 32844: "LogLuv"}


@dataclass(frozen=True)
class Bitmap:
    """A picture as stored numbers.

    kind: `png`, `tiff`, `jpeg` or `psd`. values: (h, w, 3) uint8, uint16, float16 or float32; grey
    is repeated. alpha: (h, w) of the same type; None if absent or opaque everywhere. premultiplied:
    whether `values` are multiplied by alpha. codes: largest possible integer; None for floats.
    profile: meaning of the numbers; None for sRGB. lossy: whether compression changed them. shown:
    the view transform declared in the file, as `name stops`.
    """

    kind: str
    values: npt.NDArray[Any]
    alpha: npt.NDArray[Any] | None
    premultiplied: bool
    codes: int | None
    profile: Profile | None
    lossy: bool
    shown: str | None = None


def read_bitmap(path: Path, kind: str) -> Bitmap:
    """Return the picture in a file of this kind, upright. Raises ImageError, without naming the
    file.
    """
    if path.stat().st_size > MAX_FILE:
        raise ImageError("is too long to be a picture")
    head = _read_head(path, kind)
    with silenced():
        spec, pixels = _decoded(path, kind)
    if kind == "tiff":
        _check_tiff(spec)
    if kind == "jpeg" and spec.getattribute("jpeg:ColorSpace") == "CMYK":
        raise ImageError("holds CMYK: convert it to RGB and export it again")
    icc = spec.getattribute("ICCProfile")
    profile = head.profile if icc is None else read_icc(np.asarray(icc, np.uint8).tobytes())
    pixels = _upright(pixels, int(spec.get_int_attribute("Orientation", 1)))
    alpha = _alpha(spec, pixels)
    if alpha is not None and not head.has_transparency:
        raise ImageError(
            "has an extra channel that is not transparency: delete it, or export a PNG"
        )
    integer = np.issubdtype(pixels.dtype, np.integer)
    return Bitmap(
        kind,
        _rgb(spec, pixels),
        alpha,
        premultiplied=alpha is not None
        and kind == "tiff"
        and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0),
        codes=_largest(pixels.dtype) if integer else None,
        profile=profile,
        lossy=kind == "jpeg" or spec.get_int_attribute("tiff:Compression", 1) in (6, 7, 34887),
        shown=head.shown,
    )


@dataclass(frozen=True)
class _Head:
    """Facts that OpenImageIO does not tell. shown, profile: as in `Bitmap`, from a PNG.

    has_transparency: False if an extra channel of a PSD is not transparency.
    """

    shown: str | None = None
    profile: Profile | None = None
    has_transparency: bool = True


def _read_head(path: Path, kind: str) -> _Head:
    """Check a file before it is decoded, and read what the decoder skips."""
    match kind:
        case "png":
            with path.open("rb") as file:
                longest = longest_png(file.read(PNG_HEAD))
            if path.stat().st_size > longest:
                raise ImageError(
                    f"is {path.stat().st_size} bytes long, and a PNG of its size has at most "
                    f"{longest}: save it again"
                )
            return _Head(*read_png_head(path))
        case "psd":
            return _Head(has_transparency=check_psd(path, max_pixels=MAX_PIXELS))
        case "tiff":
            check_tiff(path)
    return _Head()


def _decoded(path: Path, kind: str) -> tuple[Any, npt.NDArray[Any]]:
    import OpenImageIO

    OpenImageIO.geterror()  # clears the error of an earlier file
    spec = OpenImageIO.ImageSpec()
    spec["oiio:UnassociatedAlpha"] = 1  # otherwise OpenImageIO multiplies display values by alpha
    file = OpenImageIO.ImageInput.open(str(path), spec)
    if file is None:
        raise ImageError(f"is damaged: {first_line(OpenImageIO.geterror(), path=path)}")
    try:
        if file.format_name() != kind:
            raise ImageError(f"is damaged: it begins like {kind.upper()} but is not")
        spec = file.spec()
        _check_size(spec)
        pixels = file.read_image(0, 0, 0, spec.nchannels, spec.format)
        error = file.geterror()
        if pixels is None or error:
            raise ImageError(f"is damaged or cut off: {first_line(error, path=path)}")
        if kind == "tiff":
            _check_pages(file, spec)
    finally:
        file.close()
    return spec, np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)


def _check_size(spec: Any) -> None:
    if min(spec.width, spec.height) < 1 or spec.width * spec.height > MAX_PIXELS:
        raise ImageError(
            f"declares {spec.width}x{spec.height} pixels: expected at most "
            f"{MAX_PIXELS / 1e6:.0f} million"
        )
    if spec.nchannels > 8 or spec.depth > 1 or spec.deep:
        raise ImageError(f"has {spec.nchannels} channels: expected grey or RGB, with alpha or not")
    if str(spec.format) not in ("uint8", "uint16", "half", "float"):
        raise ImageError(f"holds numbers of type {spec.format}: export it with 8 or 16 bits")


def _check_pages(file: Any, first: Any) -> None:
    """Reject a second page of the same size: it is a layer that would be lost silently."""
    size = first.width, first.height
    for page in range(1, 64):
        if not file.seek_subimage(page, 0):
            file.geterror()
            return
        spec = file.spec()
        is_small = spec.get_int_attribute("tiff:subfiletype", 0) & 1
        if (spec.width, spec.height) == size and not is_small:
            raise ImageError("has several pages or layers: flatten it and export it again")


def _check_tiff(spec: Any) -> None:
    colours = spec.get_int_attribute("tiff:PhotometricInterpretation", 2)
    if colours not in TIFF_COLOURS:
        named = TIFF_OTHERS.get(colours, f"colours of kind {colours}")
        raise ImageError(f"holds {named}: convert it to RGB and export it again")
    if (TIFF_COLOURS[colours] == "grey") != (spec.channelnames[0] == "Y"):
        raise ImageError(f"is damaged: {spec.nchannels} channels of {TIFF_COLOURS[colours]}")


def _rgb(spec: Any, pixels: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if spec.channelnames[0] == "R" and spec.nchannels >= 3:
        return np.ascontiguousarray(pixels[..., :3])
    return np.repeat(pixels[..., :1], 3, axis=-1)


def _alpha(spec: Any, pixels: npt.NDArray[Any]) -> npt.NDArray[Any] | None:
    if spec.alpha_channel < 0:
        return None
    alpha = pixels[..., spec.alpha_channel]
    opaque = 1 if np.issubdtype(alpha.dtype, np.floating) else _largest(alpha.dtype)
    return None if (alpha == opaque).all() else alpha.copy()


def _largest(dtype: np.dtype[Any]) -> int:
    return int(np.iinfo(dtype).max)


def _upright(pixels: npt.NDArray[Any], orientation: int) -> npt.NDArray[Any]:
    """Return pixels rotated and mirrored according to EXIF's Orientation."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


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
