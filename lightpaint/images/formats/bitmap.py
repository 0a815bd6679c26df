"""The stored numbers of a picture, and the linear light that they mean: of PNG, TIFF, JPEG, PSD,
WebP and Radiance HDR.

OpenImageIO decodes them with the formats' own libraries. Files that declare more than MAX_PIXELS,
or that it would misread (CMYK, Lab, several pages, Photoshop files without a merged picture), are
rejected here.

It also fills in missing fields of TIFF and Photoshop files by its own rules: a header that lost a
field, or lists fewer strips than the picture needs, would be read as a different picture. So these
headers are checked first.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour import Profile, ViewTransform, converted, encode_display, read_icc
from lightpaint.errors import ImageError
from lightpaint.files import first_line
from lightpaint.images.formats.library_output import silenced
from lightpaint.images.formats.png import PNG_HEAD, longest_png, read_png_head

#: Maximum number of pixels that are decoded: 8192x4096, for which decoding takes about 1 GB.
MAX_PIXELS = 2**25

#: Maximum size in bytes of a file that is opened.
MAX_FILE = 2**31

#: TIFF's PhotometricInterpretation: supported values, and names of unsupported ones.
TIFF_COLOURS = {0: "grey", 1: "grey", 2: "RGB", 3: "palette", 6: "YCbCr"}
TIFF_OTHERS = {4: "a mask", 5: "CMYK", 8: "Lab", 9: "Lab", 10: "Lab", 32844: "LogLuv"}

#: Number of pixels converted at a time.
STRIP_PIXELS = 2**18

#: Fields of a directory (TIFF 6.0, section 8), and their value types: format and size.
WIDTH, HEIGHT, BITS, COMPRESSION, SAMPLES, PLANAR = 256, 257, 258, 259, 277, 284
STRIPS = (273, 279)  # offsets, lengths
TILES = (324, 325)
ROWS_PER_STRIP, TILE_WIDTH, TILE_HEIGHT = 278, 322, 323
TYPES = {1: ("B", 1), 3: ("H", 2), 4: ("I", 4), 16: ("Q", 8)}

#: Maximum number of values in a field; supported pictures have fewer.
MAX_COUNT = 2**22

Fields = dict[int, tuple[int, ...]]

#: Supported colour modes, and names of unsupported ones.
PSD_COLOURS = {1: "grey", 3: "RGB"}
PSD_OTHERS = {0: "black and white", 2: "indexed colours", 4: "CMYK", 7: "multichannel", 9: "Lab"}


#: EXIF's orientations in which a picture's rows are its columns.
TURNED = (5, 6, 7, 8)


@dataclass(frozen=True)
class Bitmap:
    """A picture as stored numbers.

    kind: `png`, `tiff`, `jpeg`, `psd`, `webp` or `hdr`. values: (h, w, 3) uint8, uint16, float16 or
    float32; grey is repeated. alpha: (h, w) of the same type; None if absent or opaque everywhere.
    premultiplied: whether `values` are multiplied by alpha. codes: largest possible integer; None
    for floats. profile: meaning of the numbers; None for sRGB. lossy: whether compression changed
    them. shown: the view transform declared in the file, as `name stops`.
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


def bitmap_size(path: Path, kind: str) -> tuple[int, int]:
    """Return the (height, width) of a picture from the head of its file, as `read_bitmap` has it.

    Raises ImageError, without naming the file, if the head is damaged.
    """
    _read_head(path, kind)
    file = _opened(path)
    try:
        spec = file.spec()
        _check_size(spec)
        turned = spec.get_int_attribute("Orientation", 1) in TURNED
        return (spec.width, spec.height) if turned else (spec.height, spec.width)
    finally:
        file.close()


def _opened(path: Path) -> Any:
    """Return a file opened by OpenImageIO. Raises ImageError, without naming the file."""
    import OpenImageIO

    OpenImageIO.geterror()  # clears the error of an earlier file
    spec = OpenImageIO.ImageSpec()
    spec["oiio:UnassociatedAlpha"] = 1  # otherwise OpenImageIO multiplies display values by alpha
    file = OpenImageIO.ImageInput.open(str(path), spec)
    if file is None:
        raise ImageError(f"is damaged: {first_line(OpenImageIO.geterror(), path=path)}")
    return file


def _decoded(path: Path, kind: str) -> tuple[Any, npt.NDArray[Any]]:
    file = _opened(path)
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
    if orientation in TURNED:
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


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


def check_tiff(path: Path) -> None:
    """Raise ImageError unless the first picture of a TIFF is complete."""
    size = path.stat().st_size
    try:
        with path.open("rb") as file:
            fields = _first_directory(file)
    except (struct.error, ValueError, OverflowError, OSError):
        # Truncated, or with an impossible offset.
        raise ImageError("is cut off or damaged") from None
    if not {WIDTH, HEIGHT, BITS} <= fields.keys():
        raise ImageError("is damaged: its header lacks width, height or bits: export it again")
    width, height = _single_value(fields, WIDTH), _single_value(fields, HEIGHT)
    samples, planar = _single_value(fields, SAMPLES, 1), _single_value(fields, PLANAR, 1)
    bits = fields[BITS]
    if len(set(bits)) != 1 or len(bits) not in (1, samples):
        raise ImageError(f"has {len(bits)} depths for {samples} channels: expected one for all")
    if bits[0] not in ((8, 16, 32) if samples > 1 else (1, 2, 4, 8, 16, 32)):
        raise ImageError(f"has {bits[0]} bits: export it with 8 or 16")
    _check_chunks(fields, (height, width), samples, planar, bits[0], size)


def _check_chunks(
    fields: Fields, image: tuple[int, int], samples: int, planar: int, bits: int, size: int
) -> None:
    """Check that all strips or tiles exist, lie within the file, and hold all their pixels."""
    height, width = image
    if TILE_WIDTH in fields:
        chunk = _single_value(fields, TILE_HEIGHT), _single_value(fields, TILE_WIDTH)
        names = TILES if TILES[0] in fields else STRIPS
    else:
        chunk = min(_single_value(fields, ROWS_PER_STRIP, height), height), width
        names = STRIPS
    if min(*chunk, width, height, samples) < 1 or planar not in (1, 2):
        raise ImageError("is damaged: the numbers in its header are impossible")
    count = -(-height // chunk[0]) * -(-width // chunk[1]) * (samples if planar == 2 else 1)
    offsets, lengths = (fields.get(name, ()) for name in names)
    if not len(offsets) == len(lengths) == count:
        raise ImageError(
            f"is damaged: it needs {count} strips or tiles, but lists {len(offsets)} offsets and "
            f"{len(lengths)} lengths"
        )
    if any(start + length > size for start, length in zip(offsets, lengths, strict=True)):
        raise ImageError("is cut off")
    if _single_value(fields, COMPRESSION, 1) != 1:
        return
    row = -(-chunk[1] * bits * (samples if planar == 1 else 1) // 8)
    for k, length in enumerate(lengths):
        rows = chunk[0]
        if names == STRIPS:
            strips = -(-height // chunk[0])
            rows = min(rows, height - k % strips * chunk[0])
        if length < rows * row:
            raise ImageError("is damaged: a strip or tile is too short for its pixels")


def _single_value(fields: Fields, name: int, default: int = 0) -> int:
    return fields.get(name, (default,))[0]


def _first_directory(file: BinaryIO) -> Fields:
    head = file.read(16)
    order = {b"II": "<", b"MM": ">"}[head[:2]]
    big = struct.unpack(order + "H", head[2:4]) == (43,)
    offset = struct.unpack(order + ("Q" if big else "I"), head[8:16] if big else head[4:8])[0]
    file.seek(offset)
    entry, inline = (20, 8) if big else (12, 4)
    (count,) = struct.unpack(order + ("Q" if big else "H"), file.read(8 if big else 2))
    if count > 4096:
        raise ImageError("is damaged: its head has too many fields")
    entries = file.read(count * entry)
    fields: Fields = {}
    for k in range(count):
        name, kind = struct.unpack_from(order + "HH", entries, k * entry)
        (length,) = struct.unpack_from(order + ("Q" if big else "I"), entries, k * entry + 4)
        if kind not in TYPES or length > MAX_COUNT:
            continue
        letter, width = TYPES[kind]
        value = entries[(k + 1) * entry - inline : (k + 1) * entry]
        if length * width > inline:
            (offset,) = struct.unpack(order + ("Q" if big else "I"), value)
            file.seek(offset)
            value = file.read(length * width)
        if length and name not in fields:
            fields[name] = struct.unpack_from(f"{order}{length}{letter}", value)
    return fields


def check_psd(path: Path, *, max_pixels: int) -> bool:
    """Reject Photoshop files in other colour modes or without a merged picture, with ImageError.

    max_pixels: maximum number of pixels. Returns True if an extra channel is transparency rather
    than a saved selection.
    """
    with path.open("rb") as file:
        head = file.read(26)
        if len(head) < 26:
            raise ImageError("is cut off")
        mode = int.from_bytes(head[24:26], "big")
        if mode not in PSD_COLOURS:
            named = PSD_OTHERS.get(mode, f"colours of kind {mode}")
            raise ImageError(f"holds {named}: convert it to RGB and save it again")
        height, width = struct.unpack(">II", head[14:22])
        if height * width > max_pixels:
            raise ImageError(f"declares {width}x{height} pixels: too many to read")
        file.seek(int.from_bytes(file.read(4), "big"), 1)
        length = int.from_bytes(file.read(4), "big")
        resources = file.read(min(length, 2**26))
        file.seek(length - len(resources), 1)
        length = int.from_bytes(file.read(4), "big")
        layers = file.read(min(length, 6))
        file.seek(length - len(layers), 1)
        _check_packed_rows(file, head)
    for ident, data in _resources(resources):
        # VersionInfo: a version number, then a flag for the merged picture.
        if ident == 1057 and len(data) >= 5 and not data[4]:
            raise ImageError(
                "has no merged picture: save it with maximised compatibility, or export a PNG"
            )
    # The number of layers is negative if there is transparency.
    return len(layers) == 6 and layers[4] >= 0x80


def _check_packed_rows(file: BinaryIO, head: bytes) -> None:
    """Reject rows that are too short for their pixels, which the library skips silently."""
    if file.read(2) != b"\0\1":
        return
    channels, height, width, depth = struct.unpack(">HIIH", head[12:24])
    table = file.read(2 * channels * height)
    lengths = np.frombuffer(table[: len(table) // 2 * 2], ">u2")
    shortest = 2 * -(-width * depth // 8 // 128)
    if lengths.size < channels * height or (lengths < shortest).any():
        raise ImageError("is damaged: rows of its merged picture are missing")


def _resources(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield number and content of each image resource block of a Photoshop file."""
    position = 0
    while data[position : position + 4] == b"8BIM" and position + 12 <= len(data):
        ident = int.from_bytes(data[position + 4 : position + 6], "big")
        position += 6 + (data[position + 6] // 2 + 1) * 2  # a name, padded to an even length
        length = int.from_bytes(data[position : position + 4], "big")
        yield ident, data[position + 4 : position + 4 + length]
        position += 4 + length + length % 2
