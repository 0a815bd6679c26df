"""OpenEXR files in and out, over the OpenEXR project's own module.

A file is a list of `ExrPart`s; a part is a set of named channels of one size. What the
reference library lets pass silently (a cut-off file, missing parts, deep pixels) is an
ImageError here.
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
from lightpaint.errors import ImageError, OutputError
from lightpaint.files import first_line, replacing
from lightpaint.images.formats.file_kinds import head_of, kind_of, name_of
from lightpaint.images.formats.silence import silenced
from lightpaint.screen import some_names
from lightpaint.version import __version__

#: How the names of lightpaint's own text attributes begin, and the one that every file of its has.
OWN = "lightpaint."
VERSION_KEY = f"{OWN}version"

#: A file that declares more bytes of pixels than this, and more than 64 for each of its own bytes,
#: is refused before any is decoded. Pictures compress to less only where they are empty.
MAX_BYTES = 2**29
MAX_COMPRESSION = 64

#: Every so-many-th line, and their bytes from which on they tell how well a part packs; and the
#: share of them that may be left for it to be worth the time.
SAMPLED, TELLING, SAVED = 16, 2**16, 0.6

#: Pixels (height, width) by the name of their channel.
Channels = Mapping[str, npt.NDArray[Any]]

#: OpenEXR's filter between two samples of chroma: weights of the nearest, the next, … on each side.
CHROMA_FILTER = (0.627123, -0.186077, 0.087929, -0.043159, 0.019597, -0.007540, 0.002128)


@dataclass(frozen=True)
class ExrPart:
    """One part of an EXR file.

    channels: name → (height, width) array, float16 or float32 (uint32 when read so).
    attributes: text attributes of the header.
    display: (height, width) of the display window, the picture; None if it is `size`.
    offset: (y, x) of the first stored pixel in it: programs crop what is empty or keep a margin.
    primaries: CIE xy of red, green, blue and white, if the header declares `chromaticities`.
    views: names of the views whose channels the part holds, the one without prefix first.
    """

    name: str
    channels: Mapping[str, npt.NDArray[Any]]
    attributes: Mapping[str, str] = field(default_factory=dict)
    display: tuple[int, int] | None = None
    offset: tuple[int, int] = (0, 0)
    primaries: tuple[float, ...] | None = None
    views: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        height, width = next(iter(self.channels.values())).shape
        return height, width

    def in_display_window(self) -> "ExrPart":
        """The part cut or filled with zeros to its display window."""
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
        """The R, G and B channels of `layer` as (height, width, 3) float32."""
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
    """Text attributes of each part of an EXR file, and its (height, width), without pixels."""
    head_of(path, 16)  # OpenEXR itself would wait for ever at what never answers
    with silenced():
        headers = [header for _, header in _declared(path)]
        return [_texts(header) for header in headers], _windows(headers[0])[0]


def read_channels(path: Path) -> set[str]:
    """Names of the channels of all parts of an EXR file, without pixels. Raises ImageError."""
    with silenced():
        declared = _declared(path)
        return {channel.name for _, header in declared for channel in header["channels"]}


def read_parts(path: Path) -> list[ExrPart]:
    """All parts of the EXR file at `path`.

    Channels that are stored at a part of the resolution, as chroma is, are interpolated. Of
    mip maps the largest is read. Raises ImageError if the file is missing, no EXR, cut off,
    deep, or declares more pixels than its length makes likely.
    """
    path = Path(path)
    head = head_of(path, 16)
    if kind_of(head) != "exr":
        name = name_of(head)
        is_a = f"is a {name} file" if name else "is no OpenEXR file"
        raise ImageError(f"{path} {is_a}: export it as linear OpenEXR")
    with silenced():
        declared = _declared(path)
        _check_headers(path, declared)
        try:
            parts = OpenEXR.File(str(path), separate_channels=True).parts
        except Exception as error:
            raise ImageError(f"{path} is damaged: {first_line(error, path=path)}") from error
    if len(parts) != len(declared):
        raise ImageError(
            f"{path} is cut off or damaged: only {len(parts)} of its {len(declared)} parts can be "
            "read; export it again"
        )
    return [_part(path, part) for part in parts]


def _declared(path: Path) -> list[tuple[str | None, dict[str, Any]]]:
    """Name and header of each part, without its pixels. Raises ImageError."""
    try:
        header = OpenEXR.File(str(path), header_only=True)
        declared = [(part.name(), dict(part.header)) for part in header.parts]
        _windows(declared[0][1])
    except Exception as error:
        raise ImageError(_why_unreadable(path, first_line(error, path=path))) from error
    return declared


def _why_unreadable(path: Path, reason: str) -> str:
    """What is wrong with a file whose header cannot be read. reason: the library's."""
    if kind_of(head_of(path, 16)) != "exr":
        return f"{path} is not a readable OpenEXR file: {reason}"
    # The library names the file again, and says of one that ends too soon no more than that.
    said = re.sub(r"(^Unable|\s*when attempting) to open .*", "", reason)
    which = f" ({said})" if said else ""
    return f"{path} is cut off or damaged in its header{which}: export it again"


def _texts(header: Mapping[str, Any]) -> dict[str, str]:
    """The text attributes of a header."""
    return {key: value for key, value in header.items() if isinstance(value, str)}


def _part(path: Path, part: Any) -> ExrPart:
    """What is kept of a part as the library reads it."""
    if not part.channels:
        raise ImageError(f"{path} has a part without channels")
    (x0, y0), (x1, y1) = ((int(x), int(y)) for x, y in part.header["dataWindow"])
    size = y1 - y0 + 1, x1 - x0 + 1
    channels = {}
    for name, channel in part.channels.items():
        pixels = channel.pixels
        if (channel.ySampling, channel.xSampling) != (1, 1):
            pixels = _interpolated(pixels, size, (channel.ySampling, channel.xSampling))
        if pixels.shape != size:
            raise ImageError(f"{path} is damaged: channel {name} has another size than the file")
        channels[name] = pixels
    display, offset = _windows(part.header)
    views = part.header.get("multiView")
    return ExrPart(
        part.name() or "",
        channels,
        _texts(part.header),
        display,
        offset,
        _primaries(part.header),
        tuple(map(str, views)) if isinstance(views, list) else (),
    )


def _interpolated(pixels: Floats, size: tuple[int, int], sampling: tuple[int, int]) -> Floats:
    """A channel stored for every so-manieth pixel, at all of them.

    Of every other pixel, as chroma is stored, by the filter that OpenEXR reads it with; else
    linearly. Beyond the last it is constant.
    """
    result = pixels.astype(np.float32)
    for axis, (length, step) in enumerate(zip(size, sampling, strict=True)):
        result = np.moveaxis(result, axis, 0)
        last = len(result) - 1
        at = np.minimum(np.arange(length) / step, last)
        below = at.astype(int)
        share = (at - below).astype(np.float32)[:, None]
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
    """Write a multi-part EXR without loss, by ZIP where that helps, whole or not at all.

    The first part says which version of lightpaint wrote it, so that nobody takes it for a render
    of another program. All parts must have one display window; its size is that of the part where
    it says none.
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
    with replacing(path) as beside:
        try:
            OpenEXR.File(exr_parts).write(str(beside))
        except RuntimeError as error:  # the library's word for a full disk and the like
            raise OutputError(f"cannot write {path}: {first_line(error, path=beside)}") from error


def is_worth_packing(channels: Channels) -> bool:
    """Return whether ZIP saves much: noise in floats it hardly packs, and takes long to unpack."""
    lines = [pixels[::SAMPLED] for pixels in channels.values()]
    if sum(x.nbytes for x in lines) < TELLING:
        return True
    # As ZIP does it: bytes of one rank together.
    data = b"".join(
        np.ascontiguousarray(x).view(np.uint8).reshape(-1, x.itemsize).T.tobytes() for x in lines
    )
    return len(zlib.compress(data, 1)) < SAVED * len(data)


def rgb_channels(image: Floats, layer: str = "") -> dict[str, Floats]:
    """(height, width, 3) pixels as the float32 channels R, G, B of `layer`."""
    prefix = f"{layer}." if layer else ""
    image = image.astype(np.float32, copy=False)
    return {f"{prefix}{c}": image[..., k] for k, c in enumerate("RGB")}


def write_rgb(path: Path, image: Floats, *, attributes: Mapping[str, str] | None = None) -> None:
    """Write a (height, width, 3) linear image as one float32 RGB part."""
    write_parts(path, [ExrPart("rgb", rgb_channels(image), attributes or {})])


def _windows(header: Mapping[str, Any]) -> tuple[tuple[int, int], tuple[int, int]]:
    """(height, width) of the display window and the data window's (y, x) in it."""
    (x0, y0), (x1, y1) = ((int(x), int(y)) for x, y in header["displayWindow"])
    x, y = (int(v) for v in header["dataWindow"][0])
    return (y1 - y0 + 1, x1 - x0 + 1), (y - y0, x - x0)


def _primaries(header: Mapping[str, Any]) -> tuple[float, ...] | None:
    """x and y of red, green, blue and white. An attribute of that name and another type is none."""
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
                f"{path} holds deep pixels (part {name or 0!r}): flatten it and export it again"
            )
        (x0, y0), (x1, y1) = header["dataWindow"]
        width, height = int(x1) - int(x0) + 1, int(y1) - int(y0) + 1
        if width < 1 or height < 1:
            raise ImageError(f"{path} declares an empty image of {width}x{height} pixels")
        (height_shown, width_shown), _ = _windows(header)
        pixels = max(width * height, width_shown * height_shown)
        # Half is read as half; what is made of it later, in float32, is counted here.
        size += pixels * 4 * max(len(header.get("channels", ())), 1)
    if size > max(MAX_BYTES, MAX_COMPRESSION * path.stat().st_size):
        raise ImageError(
            f"{path} declares {size:.2g} bytes of pixels, in a file of {path.stat().st_size:.2g}: "
            "too many to read"
        )
