"""Layered OpenRaster and Krita files: zip archives that contain a merged picture as PNG.

An OpenRaster archive (version 0.0.5 of the format) has its media type first, uncompressed;
`stack.xml`, which lists layers and groups with the topmost first; a PNG for each layer, with its
corner in the picture; the merged picture and a thumbnail of it. A layer of ours may have a note, in
attributes that other programs ignore, and drop when they save.
"""

import errno
import hashlib
import lzma
import math
import struct
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import IO
from xml.etree import ElementTree

import numpy as np
from PIL import Image, ImageCms

from lightpaint.arrays import Floats
from lightpaint.colour import to_8_bit
from lightpaint.errors import ImageError
from lightpaint.files import replacing
from lightpaint.images.formats.bitmap import MAX_PIXELS, Bitmap, read_bitmap
from lightpaint.images.formats.file_kinds import kind_of
from lightpaint.images.formats.png import PNG_HEAD, longest_png, png_bytes, png_size, write_png_16

#: Media types of layered zip archives, and the name of their merged picture.
LAYERED = {b"image/openraster": "ora", b"application/x-krita": "kra"}
MERGED_PICTURE = "mergedimage.png"

#: Maximum size in bytes of a merged picture.
MAX_MERGED = 2**30

#: Exceptions raised by a damaged archive, whose offsets, lengths and methods are arbitrary, and
#: error numbers: bzip2 has none, and a position before the file's beginning is an invalid one.
DAMAGE_ERRNOS = (None, errno.EINVAL)
DAMAGES = (
    zipfile.BadZipFile,
    lzma.LZMAError,
    ElementTree.ParseError,
    LookupError,  # an unknown encoding
    NotImplementedError,
    RuntimeError,
    EOFError,
    ValueError,
    OverflowError,
    struct.error,
    zlib.error,
)


def layered_kind(path: Path, head: bytes) -> str:
    """Return `ora` or `kra`, according to the archive's first member, which is uncompressed."""
    length = int.from_bytes(head[26:28], "little") + int.from_bytes(head[28:30], "little")
    media_type = head[30 + length :]
    for mark, kind in LAYERED.items():
        if media_type.startswith(mark):
            return kind
    raise ImageError(
        path, " is a zip archive, but not one of OpenRaster or Krita: export it as PNG or OpenEXR"
    )


def read_merged(path: Path, kind: str) -> Bitmap:
    """Return the merged picture of a layered file. Raises ImageError, without naming the file."""
    with naming_damage(), zipfile.ZipFile(path) as archive:
        if MERGED_PICTURE not in archive.namelist():
            raise ImageError(f"has no merged picture ({MERGED_PICTURE}): save it again")
        with tempfile.TemporaryDirectory() as folder:
            merged = Path(folder) / MERGED_PICTURE
            unpack_png(archive, MERGED_PICTURE, merged, "merged picture")
            return replace(read_bitmap(merged, "png"), kind=kind)


def merged_size(path: Path) -> tuple[int, int]:
    """Return the (height, width) of the merged picture of a layered file, from its head alone.

    Raises ImageError, without naming the file.
    """
    with (
        naming_damage(),
        zipfile.ZipFile(path) as archive,
        archive.open(_member(archive, MERGED_PICTURE)) as packed,
    ):
        return png_size(packed.read(PNG_HEAD))


@contextmanager
def naming_damage() -> Iterator[None]:
    """Turn the errors of a damaged archive, or of a list in it, into an ImageError in one line."""
    try:
        yield
    except KeyError as error:  # of an element
        raise ImageError(f"is damaged: an entry of its list lacks {_foreign(error)}") from None
    except OSError as error:
        if error.errno not in DAMAGE_ERRNOS:
            raise
        raise ImageError(f"is damaged: {_foreign(error)}") from error
    except DAMAGES as error:
        raise ImageError(f"is damaged: {_foreign(error)}") from error


def _member(archive: zipfile.ZipFile, name: str) -> zipfile.ZipInfo:
    """Return a file of an archive. Raises ImageError if there is none of that name."""
    if name not in archive.NameToInfo:
        raise ImageError(f"is damaged: the archive has no file {ascii(name)[:200]}")
    return archive.getinfo(name)


def _foreign(error: Exception) -> str:
    """Return a message that has names from the archive, which may be anything."""
    return ascii(str(error))[1:-1][:200]


def unpack_png(archive: zipfile.ZipFile, name: str, place: Path, kind: str) -> None:
    """Unpack a PNG of an archive to `place`. kind: the word for it in errors.

    Raises ImageError if it is something else or too long, and what `naming_damage` turns into one.
    """
    member = _member(archive, name)
    if member.file_size > MAX_MERGED:
        raise ImageError(f"declares a {kind} that is too large to unpack")
    with archive.open(member) as packed, place.open("wb") as unpacked:
        head = packed.read(PNG_HEAD)
        if kind_of(head) != "png":
            raise ImageError(f"has a {kind} that is not a PNG: save it again")
        if member.file_size > longest_png(head):
            raise ImageError(f"is damaged: a {kind} is longer than it can be")
        unpacked.write(head)
        _copy(packed, unpacked, member.file_size - len(head), kind)


def _copy(source: IO[bytes], target: IO[bytes], length: int, kind: str) -> None:
    """Copy `length` bytes. Raises ImageError if there are more."""
    copied_bytes = 0
    while chunk := source.read(2**20):
        copied_bytes += len(chunk)
        if copied_bytes > length:
            raise ImageError(f"is damaged: a {kind} is longer than declared")
        target.write(chunk)


#: Names and content that the format prescribes.
MEDIA_TYPE, STACK, THUMBNAIL = "image/openraster", "stack.xml", "Thumbnails/thumbnail.png"
VERSION, OVER = "0.0.5", "svg:src-over"

#: Attributes of a layer, in a namespace of their own: its note, and the SHA-256 of the layer to
#: which it belongs.
NAMESPACE = "urn:lightpaint:openraster"
NOTE, DIGEST = f"{{{NAMESPACE}}}note", f"{{{NAMESPACE}}}digest"
ElementTree.register_namespace("lightpaint", NAMESPACE)

#: Largest size of the list of layers in bytes, and largest number in it.
MAX_STACK, MAX_NUMBER = 2**22, 1e6

#: Most layers, most pixels of all layers together, and most groups within each other that are read.
#: Reading so many pixels takes about two minutes.
MAX_LAYERS, MAX_LAYER_PIXELS, MAX_DEPTH = 1000, 2**29, 100

#: Largest side of the thumbnail, in pixels.
THUMBNAIL_SIDE = 256


@dataclass(frozen=True, eq=False)
class RasterLayer:
    """A layer of an OpenRaster file.

    display: (rows, columns, 4), display values and alpha from 0 to 1, colour not multiplied by
    alpha. corner: (y, x) of its first pixel in the picture. note: text for whoever wrote the file;
    of a layer whose picture, place or opacity another program changed, it is read as "".
    """

    name: str
    display: Floats
    corner: tuple[int, int] = (0, 0)
    opacity: float = 1.0
    is_visible: bool = True
    note: str = ""

    @property
    def digest(self) -> str:
        """SHA-256 of the picture in 16 bits, its place and opacity.

        Colour without coverage does not count, since programs drop it.
        """
        codes = np.round(self.display * 65535).astype(">u2")
        codes[codes[..., 3] == 0] = 0
        place = f"{codes.shape} {self.corner} {self.opacity:.6g} "
        return hashlib.sha256(place.encode() + codes.tobytes()).hexdigest()


@dataclass(frozen=True, eq=False)
class RasterGroup:
    """Layers, the lowest first, with a name and an eye of their own. They are written in one go."""

    name: str
    layers: Iterable[RasterLayer]
    is_visible: bool = True


def write_openraster(
    path: Path, layers: Iterable[RasterLayer | RasterGroup], merged: Floats, texts: dict[str, str]
) -> None:
    """Write layers, the lowest first, as an OpenRaster file, atomically.

    layers: one is in memory at a time, if they are made as they are asked for. merged: (h, w, 3),
    display values of what they come to. texts: to store in its PNG.
    """
    height, width = merged.shape[:2]
    image = ElementTree.Element("image", version=VERSION, w=str(width), h=str(height))
    root, numbers = ElementTree.SubElement(image, "stack"), count()
    # Without a profile, Krita asks for one at each layer of 16 bits.
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    with replacing(path) as temporary, tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
            archive.writestr("mimetype", MEDIA_TYPE)
            for parent, layer in _placed(root, layers):
                source = f"data/layer{next(numbers)}.png"
                parent.insert(0, _element(layer, source))
                write_png_16(picture, layer.display, profile=profile)
                archive.write(picture, source)
            write_png_16(picture, merged, texts=texts)
            archive.write(picture, MERGED_PICTURE)
            small = Image.fromarray(to_8_bit(merged))
            small.thumbnail((THUMBNAIL_SIDE, THUMBNAIL_SIDE))
            archive.writestr(THUMBNAIL, png_bytes(np.asarray(small)))
            text = ElementTree.tostring(image, encoding="utf-8", xml_declaration=True)
            archive.writestr(STACK, text, zipfile.ZIP_DEFLATED)


@contextmanager
def opened_openraster(
    path: Path,
) -> Iterator[tuple[tuple[int, int], Iterator[RasterLayer | RasterGroup]]]:
    """Open an OpenRaster file: yield its (height, width) and its layers, the lowest first.

    A layer is decoded when the iterator comes to it, so that one is in memory at a time. Groups
    within groups become one. Raises ImageError, without naming the file; for too many layers or
    pixels before any is decoded.
    """
    with ExitStack() as open_things:
        with naming_damage():
            archive = open_things.enter_context(zipfile.ZipFile(path))
            if _member(archive, STACK).file_size > MAX_STACK:
                raise ImageError(
                    "declares a list of layers that is too long: expected at most "
                    f"{MAX_STACK >> 20} MB; merge some"
                )
            text = archive.read(STACK)
            if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
                raise ImageError("has a list of layers with declarations of its own: save it again")
            image = ElementTree.fromstring(text)
            size = int(image.attrib["h"]), int(image.attrib["w"])
            _check_size(*size)
            root = image.find("stack")
            if root is None:
                raise ImageError("is damaged: it has no stack of layers")
            _check_layers(root, archive)
        folder = open_things.enter_context(tempfile.TemporaryDirectory())
        yield size, _read_items(root, archive, Path(folder) / "layer.png")


def _check_layers(root: ElementTree.Element, archive: zipfile.ZipFile) -> None:
    """Raise ImageError for more layers or pixels than are read.

    Several layers may name one picture, and each is decoded: a short file can be long to read.
    """
    if _depth(root) > MAX_DEPTH:
        raise ImageError(f"has groups in groups, more than {MAX_DEPTH} deep: merge some")
    uses = Counter(element.attrib["src"] for element in root.iter("layer"))
    if uses.total() > MAX_LAYERS:
        raise ImageError(f"has {uses.total()} layers: expected at most {MAX_LAYERS}; merge some")
    pixels = 0
    for source, number in uses.items():
        with archive.open(_member(archive, source)) as packed:
            head = packed.read(PNG_HEAD)
        if kind_of(head) != "png":
            raise ImageError("has a layer that is not a PNG: save it again")
        pixels += number * math.prod(png_size(head))
    if pixels > MAX_LAYER_PIXELS:
        raise ImageError(
            f"has layers of {pixels / 1e6:.0f} million pixels together: expected at most "
            f"{MAX_LAYER_PIXELS / 1e6:.0f} million; merge some"
        )


def _depth(root: ElementTree.Element) -> int:
    """Return how many groups of `root` lie in each other at most."""
    depth, groups = 0, root.findall("stack")
    while groups and depth <= MAX_DEPTH:
        depth, groups = depth + 1, [inner for group in groups for inner in group.findall("stack")]
    return depth


def _read_items(
    stack: ElementTree.Element, archive: zipfile.ZipFile, place: Path
) -> Iterator[RasterLayer | RasterGroup]:
    """Yield what a stack holds, the lowest first. place: where to unpack a picture."""
    for element in reversed(stack):
        if element.tag == "layer":
            yield _read_layer(element, archive, place)
        elif element.tag == "stack":
            layers = _read_group(element, archive, place)
            yield RasterGroup(element.get("name", ""), layers, _is_visible(element))


def _read_group(
    stack: ElementTree.Element, archive: zipfile.ZipFile, place: Path
) -> Iterator[RasterLayer]:
    """Yield the layers of a group and of the groups in it, the lowest first, as it shows them."""
    share = _number(stack, "opacity", 1.0)
    for item in _read_items(stack, archive, place):
        if isinstance(item, RasterLayer):
            yield replace(item, opacity=item.opacity * share)
            continue
        for inner in item.layers:
            is_visible = inner.is_visible and item.is_visible
            yield replace(inner, is_visible=is_visible, opacity=inner.opacity * share)


def _is_visible(element: ElementTree.Element) -> bool:
    return element.get("visibility") != "hidden"


@naming_damage()
def _read_layer(element: ElementTree.Element, archive: zipfile.ZipFile, place: Path) -> RasterLayer:
    unpack_png(archive, element.attrib["src"], place, "layer")
    bitmap = read_bitmap(place, "png")
    if bitmap.profile is not None and not bitmap.profile.is_srgb:
        raise ImageError(
            f"has a layer in the colour space {bitmap.profile.name!r}: convert the image to sRGB"
        )
    codes = float(bitmap.codes or 1)
    height, width = bitmap.values.shape[:2]
    display = np.ones((height, width, 4), np.float32)
    display[..., :3] = bitmap.values / codes
    if bitmap.alpha is not None:
        display[..., 3] = bitmap.alpha / codes
    layer = RasterLayer(
        element.get("name", ""),
        display,
        corner=(round(_number(element, "y", 0.0)), round(_number(element, "x", 0.0))),
        opacity=_number(element, "opacity", 1.0),
        is_visible=_is_visible(element),
        note=element.get(NOTE, ""),
    )
    is_as_written = not layer.note or layer.digest == element.get(DIGEST)
    return layer if is_as_written else replace(layer, note="")


@naming_damage()
def _number(element: ElementTree.Element, key: str, default: float) -> float:
    value = float(element.get(key, default))
    if not abs(value) < MAX_NUMBER:
        raise ImageError(f"is damaged: {key} of a layer is {value:g}")
    return value


def _check_size(height: int, width: int) -> None:
    if min(height, width) < 1 or height * width > MAX_PIXELS:
        raise ImageError(
            f"declares {width}x{height} pixels: expected at least 1, and at most "
            f"{MAX_PIXELS / 1e6:.0f} million"
        )


def _placed(
    root: ElementTree.Element, layers: Iterable[RasterLayer | RasterGroup]
) -> Iterator[tuple[ElementTree.Element, RasterLayer]]:
    """Yield each layer with the element that holds it, the lowest first."""
    for item in layers:
        if isinstance(item, RasterLayer):
            yield root, item
            continue
        inner = ElementTree.Element(
            "stack", name=_xml_text(item.name), opacity="1.0", visibility=_eye(item)
        )
        inner.set("composite-op", OVER)
        root.insert(0, inner)
        for layer in item.layers:
            yield inner, layer


def _element(layer: RasterLayer, source: str) -> ElementTree.Element:
    y, x = layer.corner
    element = ElementTree.Element(
        "layer",
        name=_xml_text(layer.name),
        src=source,
        x=str(x),
        y=str(y),
        opacity=f"{layer.opacity:.6g}",
        visibility=_eye(layer),
    )
    element.set("composite-op", OVER)
    if layer.note:
        element.set(NOTE, layer.note)
        element.set(DIGEST, layer.digest)
    return element


def _eye(item: RasterLayer | RasterGroup) -> str:
    return "visible" if item.is_visible else "hidden"


def _xml_text(name: str) -> str:
    """Return a name without characters that XML cannot hold."""
    return "".join(c if c >= " " and not 0xFFFE <= ord(c) <= 0xFFFF else " " for c in name)
