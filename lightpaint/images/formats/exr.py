"""Reads and writes OpenEXR files with the OpenEXR project's own module.

A file is a list of `ExrPart`s; a part is a set of named channels of equal size. Faults that the
reference library ignores (truncated files, missing parts, deep pixels) raise ImageError here.
"""

import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR

from lightpaint.arrays import Floats
from lightpaint.display_text import some_names
from lightpaint.errors import ImageError, OutputError
from lightpaint.files import first_line, replacing
from lightpaint.images.formats.file_kinds import head_of, kind_of, name_of
from lightpaint.images.formats.library_output import silenced
from lightpaint.version import __version__

#: Prefix of lightpaint's text attributes, and the attribute that all its files have.
OWN_PREFIX = "lightpaint."
VERSION_KEY = f"{OWN_PREFIX}version"

#: A file is rejected before decoding if its declared size in bytes exceeds both MAX_BYTES and
#: MAX_COMPRESSION times its length. Only empty pictures compress better than that.
MAX_BYTES = 2**29
MAX_COMPRESSION = 64

#: Compression is tried on every 16th line if these have at least this number of bytes, and used if
#: they shrink below this share.
SAMPLE_STEP, MIN_SAMPLE_BYTES, MAX_PACKED_SHARE = 16, 2**16, 0.6

#: Largest error of lossy compressions, as a share of the brightest value in the block of pixels
#: that is compressed at once: measured on smooth, noisy and sparse images, of which 2e-4 of all
#: light lies beyond. Of those in CURVED, which quantise x^(1 / CURVE_POWER) below 1, log x above,
#: it is the share at 1; in the dark it is larger. The figure of DWA is for its default level, to
#: which it is proportional, down to the rounding along its curve. LJ2K of float32 is off by up to
#: LJ2K_LEAST in blocks however dark.
COMPRESSION_LOSS = {
    **{"PXR24": 2.0**-16, "B44": 0.04, "B44A": 0.04},
    **{"DWAA": 0.02, "DWAB": 0.02, "LJ2K": 0.02},
}
CURVED, CURVE_POWER, CURVE_ROUNDING = ("DWAA", "DWAB", "LJ2K"), 2.2, 2.0**-9
LJ2K_LEAST = 2e-3
DWA_LEVEL_KEY, DEFAULT_DWA_LEVEL = "dwaCompressionLevel", 45.0

#: Arrays (height, width) by channel name.
Channels = Mapping[str, npt.NDArray[Any]]

#: OpenEXR's filter for interpolating chroma: weights of the nearest, second nearest, … sample on
#: each side.
CHROMA_FILTER = (0.627123, -0.186077, 0.087929, -0.043159, 0.019597, -0.007540, 0.002128)


@dataclass(frozen=True)
class ExrPart:
    """A part of an EXR file.

    channels: name → (height, width) array, float16 or float32 (uint32 if read as such).
    attributes: text attributes of the header.
    display: (height, width) of the display window, which is the picture; None if equal to `size`.
    offset: (y, x) of the first stored pixel in that window: programs crop empty borders or keep a
    margin.
    origin: (y, x) of that pixel in the coordinates of the file, whose window may begin anywhere.
    primaries: CIE xy of red, green, blue and white, if the header declares `chromaticities`.
    views: names of the views in the part, beginning with the one whose channels have no prefix.
    compression: its name. loss: its largest error, as in COMPRESSION_LOSS; 0 if lossless.
    """

    name: str
    channels: Mapping[str, npt.NDArray[Any]]
    attributes: Mapping[str, str] = field(default_factory=dict)
    display: tuple[int, int] | None = None
    offset: tuple[int, int] = (0, 0)
    origin: tuple[int, int] = (0, 0)
    primaries: tuple[float, ...] | None = None
    views: tuple[str, ...] = ()
    compression: str = ""
    loss: float = 0.0

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        height, width = next(iter(self.channels.values())).shape
        return height, width

    def in_display_window(self) -> "ExrPart":
        """Return the part cropped or padded with zeros to its display window."""
        height, width = self.display or self.size
        if (height, width) == self.size and self.offset == (0, 0):
            return self
        y, x = self.offset
        top, left = max(y, 0), max(x, 0)
        placed = {}
        for name, pixels in self.channels.items():
            canvas = np.zeros((height, width), pixels.dtype)
            stored = pixels[top - y :, left - x :][: max(height - top, 0), : max(width - left, 0)]
            canvas[top : top + stored.shape[0], left : left + stored.shape[1]] = stored
            placed[name] = canvas
        return replace(self, channels=placed, display=None, offset=(0, 0))

    def rgb(self, layer: str = "") -> Floats:
        """Return the R, G and B channels of `layer` as (height, width, 3) float32."""
        prefix = f"{layer}." if layer else ""
        names = [prefix + c for c in "RGB"]
        missing = [n for n in names if n not in self.channels]
        if missing:
            raise ImageError(
                f"no channel {', '.join(missing)} in part {self.name!r}, "
                f"which has {some_names(self.channels)}"
            )
        return np.stack([self.channels[n] for n in names], axis=-1).astype(np.float32, copy=False)


def read_headers(path: Path) -> tuple[list[dict[str, str]], tuple[int, int]]:
    """Return the text attributes of each part of an EXR file, and the file's (height, width)."""
    head_of(path, 16)  # OpenEXR itself would wait forever for a pipe
    with silenced():
        headers = [header for _, header in _declared(path)]
        return [_texts(header) for header in headers], _windows(headers[0])[0]


def read_channels(path: Path) -> set[str]:
    """Return the names of all channels in an EXR file, without reading pixels. Raises
    ImageError.
    """
    with silenced():
        declared = _declared(path)
        return {channel.name for _, header in declared for channel in header["channels"]}


def read_parts(path: Path) -> list[ExrPart]:
    """Return all parts of the EXR file at `path`.

    Channels stored at lower resolution, such as chroma, are interpolated. Of mip maps the largest
    level is read. Raises ImageError if the file is missing, not an EXR, truncated, deep, or
    declares far more pixels than its length makes plausible.
    """
    path = Path(path)
    head = head_of(path, 16)
    if kind_of(head) != "exr":
        name = name_of(head)
        description = f"is a {name} file" if name else "is not an OpenEXR file"
        raise ImageError(path, f" {description}: export it as linear OpenEXR")
    with silenced():
        declared = _declared(path)
        _check_headers(path, declared)
        try:
            parts = OpenEXR.File(str(path), separate_channels=True).parts
        except Exception as error:
            raise ImageError(path, f" is damaged: {first_line(error, path=path)}") from error
    if len(parts) != len(declared):
        raise ImageError(
            path,
            f" is cut off or damaged: only {len(parts)} of its {len(declared)} parts can be "
            "read; export it again",
        )
    return [_part(path, part) for part in parts]


def _declared(path: Path) -> list[tuple[str | None, dict[str, Any]]]:
    """Return the name and header of each part, without pixels. Raises ImageError."""
    try:
        header = OpenEXR.File(str(path), header_only=True)
        declared = [(part.name(), dict(part.header)) for part in header.parts]
        _windows(declared[0][1])
    except Exception as error:
        raise _unreadable(path, first_line(error, path=path)) from error
    return declared


def _unreadable(path: Path, reason: str) -> ImageError:
    """Return the error for a file with an unreadable header. reason: the library's message."""
    if kind_of(head_of(path, 16)) != "exr":
        return ImageError(path, f" is not a readable OpenEXR file: {reason}")
    # The library repeats the file's name, and gives no reason for a truncated file.
    detail = re.sub(r"(^Unable|\s*when attempting) to open .*", "", reason)
    suffix = f" ({detail})" if detail else ""
    return ImageError(path, f" is cut off or damaged in its header{suffix}: export it again")


def _texts(header: Mapping[str, Any]) -> dict[str, str]:
    """Return the text attributes of a header."""
    return {key: value for key, value in header.items() if isinstance(value, str)}


def _part(path: Path, part: Any) -> ExrPart:
    """Convert a part of the library to an `ExrPart`."""
    if not part.channels:
        raise ImageError(path, " has a part without channels")
    (x0, y0), (x1, y1) = ((int(x), int(y)) for x, y in part.header["dataWindow"])
    size = y1 - y0 + 1, x1 - x0 + 1
    channels = {}
    for name, channel in part.channels.items():
        pixels = channel.pixels
        if (channel.ySampling, channel.xSampling) != (1, 1):
            pixels = _interpolated(pixels, size, (channel.ySampling, channel.xSampling))
        if pixels.shape != size:
            raise ImageError(path, f" is damaged: channel {name} has another size than the file")
        channels[name] = pixels
    display, offset = _windows(part.header)
    views = part.header.get("multiView")
    return ExrPart(
        part.name() or "",
        channels,
        _texts(part.header),
        display,
        offset,
        (y0, x0),
        _primaries(part.header),
        tuple(map(str, views)) if isinstance(views, list) else (),
        *_compression(part.header),
    )


def _compression(header: Mapping[str, Any]) -> tuple[str, float]:
    """Return the name of the compression that a header declares, and its loss."""
    name = getattr(header.get("compression"), "name", "").removesuffix("_COMPRESSION")
    loss = COMPRESSION_LOSS.get(name, 0.0)
    level = header.get(DWA_LEVEL_KEY, DEFAULT_DWA_LEVEL)
    if name.startswith("DWA") and isinstance(level, int | float) and level >= 0:
        loss = min(max(loss * float(level) / DEFAULT_DWA_LEVEL, CURVE_ROUNDING), 1.0)
    return name, loss


def compression_errors(
    compression: str, loss: float, brightest: Floats, *, is_half: bool
) -> Floats:
    """Return the largest errors of a compression, (h, w, 3), where the brightest value of each
    block of pixels is `brightest`, at least 0. loss: as in ExrPart. is_half: whether it is of half
    floats.
    """
    if compression in CURVED:  # the inverse of the slope of its curve
        dark = np.power(np.minimum(brightest, 1), 1 - 1 / CURVE_POWER)
        brightest = np.maximum(brightest, dark)
    least = LJ2K_LEAST if compression == "LJ2K" and not is_half else 0.0
    return np.asarray(np.maximum(loss * brightest, least))


def _interpolated(pixels: Floats, size: tuple[int, int], sampling: tuple[int, int]) -> Floats:
    """Return a subsampled channel at full resolution.

    Chroma, stored for every second pixel, is interpolated with OpenEXR's own filter; other steps
    are interpolated linearly. The last sample is extended to the border.
    """
    result = pixels.astype(np.float32)
    for axis, (length, step) in enumerate(zip(size, sampling, strict=True)):
        result = np.moveaxis(result, axis, 0)
        last = len(result) - 1
        position = np.minimum(np.arange(length) / step, last)
        below = position.astype(int)
        share = (position - below).astype(np.float32)[:, None]
        between = np.zeros_like(result[below])
        for k, weight in enumerate(CHROMA_FILTER if step == 2 else (0.5,)):
            left, right = np.maximum(below - k, 0), np.minimum(below + 1 + k, last)
            between += np.float32(weight) * (result[left] + result[right])
        if step == 2:
            result = np.where(share > 0, between, result[below])
        else:
            result = result[below] * (1 - share) + result[np.minimum(below + 1, last)] * share
        result = np.moveaxis(result, 0, axis)
    return result


def write_parts(path: Path, parts: Sequence[ExrPart]) -> None:
    """Write a multi-part EXR file without loss, atomically, compressed with ZIP if that helps.

    The first part records the version of lightpaint, so that the file is not mistaken for another
    program's render. All parts must have the same display window, by default their own size.
    """
    exr_parts = []
    for k, part in enumerate(parts):
        header = {
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION
            if is_worth_packing(part.channels)
            else OpenEXR.NO_COMPRESSION,
            **({} if k else {VERSION_KEY: __version__}),
            **part.attributes,
        }
        if part.display is not None:
            height, width = part.display
            header["displayWindow"] = ((0, 0), (width - 1, height - 1))
        if part.offset != (0, 0):
            (y, x), (height, width) = part.offset, part.size
            first, last = (x, y), (x + width - 1, y + height - 1)
            header["dataWindow"] = (np.array(first, np.int32), np.array(last, np.int32))
        channels = {n: np.ascontiguousarray(c) for n, c in part.channels.items()}
        exr_parts.append(OpenEXR.Part(header, channels, part.name))
    with replacing(path) as temporary:
        try:
            OpenEXR.File(exr_parts).write(str(temporary))
        except RuntimeError as error:  # raised if the disk is full, for example
            raise OutputError(
                "cannot write ", path, f": {first_line(error, path=temporary)}"
            ) from error


def is_worth_packing(channels: Channels) -> bool:
    """Return True if ZIP saves much. Noisy floats hardly shrink, but take long to decompress."""
    lines = [pixels[::SAMPLE_STEP] for pixels in channels.values()]
    if sum(x.nbytes for x in lines) < MIN_SAMPLE_BYTES:
        return True
    # Like EXR's ZIP, grouped by the significance of bytes.
    data = b"".join(
        np.ascontiguousarray(x).view(np.uint8).reshape(-1, x.itemsize).T.tobytes() for x in lines
    )
    return len(zlib.compress(data, 1)) < MAX_PACKED_SHARE * len(data)


def rgb_channels(image: Floats, layer: str = "") -> dict[str, Floats]:
    """Return (height, width, 3) pixels as the float32 channels R, G, B of `layer`."""
    prefix = f"{layer}." if layer else ""
    image = image.astype(np.float32, copy=False)
    return {f"{prefix}{c}": image[..., k] for k, c in enumerate("RGB")}


def write_rgb(path: Path, image: Floats, *, attributes: Mapping[str, str] | None = None) -> None:
    """Write a (height, width, 3) linear image as one float32 RGB part."""
    write_parts(path, [ExrPart("rgb", rgb_channels(image), attributes or {})])


def _windows(header: Mapping[str, Any]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return (height, width) of the display window, and (y, x) of the data window within it."""
    (x0, y0), (x1, y1) = ((int(x), int(y)) for x, y in header["displayWindow"])
    x, y = (int(v) for v in header["dataWindow"][0])
    return (y1 - y0 + 1, x1 - x0 + 1), (y - y0, x - x0)


def _primaries(header: Mapping[str, Any]) -> tuple[float, ...] | None:
    """Return x and y of red, green, blue and white; None if missing or of another type."""
    declared = header.get("chromaticities")
    if not isinstance(declared, tuple) or len(declared) != 8:
        return None
    return tuple(float(v) for v in declared)


def _check_headers(path: Path, declared: list[tuple[str | None, dict[str, Any]]]) -> None:
    size = 0
    for name, header in declared:
        kind = header.get("type")
        if kind in (OpenEXR.deepscanline, OpenEXR.deeptile):
            raise ImageError(
                path, f" holds deep pixels (part {name or 0!r}): flatten it and export it again"
            )
        (x0, y0), (x1, y1) = header["dataWindow"]
        width, height = int(x1) - int(x0) + 1, int(y1) - int(y0) + 1
        if width < 1 or height < 1:
            raise ImageError(path, f" declares an empty image of {width}x{height} pixels")
        (height_shown, width_shown), _ = _windows(header)
        pixels = max(width * height, width_shown * height_shown)
        # Four bytes per number, since half floats are converted to float32 later.
        size += pixels * 4 * max(len(header.get("channels", ())), 1)
    if size > max(MAX_BYTES, MAX_COMPRESSION * path.stat().st_size):
        raise ImageError(
            path,
            f" declares {size:.2g} bytes of pixels, in a file of {path.stat().st_size:.2g}: "
            "too many to read",
        )
