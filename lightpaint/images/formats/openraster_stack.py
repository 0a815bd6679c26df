"""OpenRaster files of several layers (version 0.0.5 of the format): written, and read back.

An archive has its media type first, uncompressed; `stack.xml`, which lists layers and groups with
the topmost first; a PNG for each layer, with its corner in the picture; the merged picture and a
thumbnail of it.
"""

import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from PIL import Image, ImageCms

from lightpaint.arrays import Floats
from lightpaint.colour.srgb import to_8_bit
from lightpaint.errors import ImageError
from lightpaint.files import replacing
from lightpaint.images.formats.bitmap import MAX_PIXELS, read_bitmap
from lightpaint.images.formats.file_kinds import kind_of
from lightpaint.images.formats.openraster import DAMAGES, MAX_MERGED, MERGED_PICTURE
from lightpaint.images.formats.png import PNG_HEAD, longest_png, png_bytes, write_png_16

#: Names and content that the format prescribes.
MEDIA_TYPE, STACK, THUMBNAIL = "image/openraster", "stack.xml", "Thumbnails/thumbnail.png"
VERSION, OVER = "0.0.5", "svg:src-over"

#: Largest size of the list of layers in bytes, and largest number in it.
MAX_STACK, MAX_NUMBER = 2**22, 1e6

#: Largest side of the thumbnail, in pixels.
THUMBNAIL_SIDE = 256


@dataclass(frozen=True, eq=False)
class RasterLayer:
    """A layer of an OpenRaster file.

    display: (rows, columns, 4), display values and alpha from 0 to 1, colour not multiplied by
    alpha. corner: (y, x) of its first pixel in the picture.
    """

    name: str
    display: Floats
    corner: tuple[int, int] = (0, 0)
    opacity: float = 1.0
    is_visible: bool = True


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
            archive.writestr(THUMBNAIL, _thumbnail(merged))
            text = ElementTree.tostring(image, encoding="utf-8", xml_declaration=True)
            archive.writestr(STACK, text, zipfile.ZIP_DEFLATED)


def read_openraster(path: Path) -> tuple[tuple[int, int], list[RasterLayer | RasterGroup]]:
    """Return (height, width) and the layers of an OpenRaster file, the lowest first.

    Groups within groups become one. Raises ImageError, without naming the file.
    """
    try:
        with zipfile.ZipFile(path) as archive, tempfile.TemporaryDirectory() as folder:
            image = _parsed_stack(archive)
            size = int(image.attrib["h"]), int(image.attrib["w"])
            _check_size(*size)
            root = image.find("stack")
            if root is None:
                raise ImageError("is damaged: it has no stack of layers")
            return size, list(_read_items(root, archive, Path(folder) / "layer.png"))
    except KeyError as error:
        raise ImageError(f"is damaged: it lacks {ascii(str(error))[1:-1][:200]}") from None
    except (*DAMAGES, ElementTree.ParseError) as error:
        raise ImageError(f"is damaged: {ascii(str(error))[1:-1][:200]}") from error


def _parsed_stack(archive: zipfile.ZipFile) -> ElementTree.Element:
    if archive.getinfo(STACK).file_size > MAX_STACK:
        raise ImageError("declares a list of layers that is too long")
    text = archive.read(STACK)
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise ImageError("has a list of layers with declarations of its own: save it again")
    return ElementTree.fromstring(text)


def _read_items(
    stack: ElementTree.Element, archive: zipfile.ZipFile, place: Path
) -> Iterator[RasterLayer | RasterGroup]:
    """Yield what a stack holds, the lowest first. place: where to unpack a picture."""
    for element in reversed(stack):
        name, is_visible = element.get("name", ""), element.get("visibility") != "hidden"
        if element.tag == "layer":
            yield replace(_read_layer(element, archive, place), is_visible=is_visible)
        elif element.tag == "stack":
            share = _number(element, "opacity", 1.0)
            layers: list[RasterLayer] = []
            for item in _read_items(element, archive, place):
                if isinstance(item, RasterLayer):
                    layers.append(item)
                else:
                    layers += [
                        replace(inner, is_visible=inner.is_visible and item.is_visible)
                        for inner in item.layers
                    ]
            inner_layers = [replace(x, opacity=x.opacity * share) for x in layers]
            yield RasterGroup(name, inner_layers, is_visible)


def _read_layer(element: ElementTree.Element, archive: zipfile.ZipFile, place: Path) -> RasterLayer:
    member = archive.getinfo(element.attrib["src"])
    if member.file_size > MAX_MERGED:
        raise ImageError("declares a layer that is too large to unpack")
    with archive.open(member) as packed:
        head = packed.read(PNG_HEAD)
        if kind_of(head) != "png":
            raise ImageError("has a layer that is not a PNG: save it again")
        if member.file_size > longest_png(head):
            raise ImageError("is damaged: a layer is longer than it can be")
        place.write_bytes(head + packed.read())
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
    corner = round(_number(element, "y", 0.0)), round(_number(element, "x", 0.0))
    return RasterLayer(element.get("name", ""), display, corner, _number(element, "opacity", 1.0))


def _number(element: ElementTree.Element, key: str, default: float) -> float:
    value = float(element.get(key, default))
    if not abs(value) < MAX_NUMBER:
        raise ImageError(f"is damaged: {key} of a layer is {value:g}")
    return value


def _check_size(height: int, width: int) -> None:
    if min(height, width) < 1 or height * width > MAX_PIXELS:
        raise ImageError(f"declares {width}x{height} pixels")


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
    return element


def _eye(item: RasterLayer | RasterGroup) -> str:
    return "visible" if item.is_visible else "hidden"


def _xml_text(name: str) -> str:
    """Return a name without characters that XML cannot hold."""
    return "".join(c if c >= " " and not 0xFFFE <= ord(c) <= 0xFFFF else " " for c in name)


def _thumbnail(merged: Floats) -> bytes:
    small = Image.fromarray(to_8_bit(merged))
    small.thumbnail((THUMBNAIL_SIDE, THUMBNAIL_SIDE))
    return png_bytes(np.asarray(small))
