"""Files of the layers of a view, for other programs: a multilayer OpenEXR, and an OpenRaster.

The EXR holds the layers in numbers, so that nothing of them is lost. The OpenRaster shows what they
look like: each layer as the light that it comes to, through the view transform of the painting.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.formats.exr_streams import PartHead, write_streamed
from lightpaint.images.formats.openraster_stack import RasterGroup, RasterLayer, write_openraster
from lightpaint.images.formats.png import TRANSFORM_KEY
from lightpaint.paint.layers.layer_pixels import is_empty, relative
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.layers.view_layers import LayerPicture, ViewLayers
from lightpaint.paint.store.canvas_pixels import Region, slices

#: Text attribute of the EXR, and its format.
KEY, FORMAT = "lightpaint.layers", "lightpaint-layers 1"

#: Name of the picture below all layers.
LOOK_NAME = "Unpainted"

#: Channels with the importance of a layer of strokes, and with its marks "this or brighter".
IMPORTANCE, MARKS = "W", ("at_least_R", "at_least_G", "at_least_B")

#: Bytes before the pixels of a file beside its headers.
ROOM_BYTES = 256

_Plane = npt.NDArray[np.float32]


def write_layers_exr(path: Path, view: ViewLayers, sensor: str) -> None:
    """Write the layers of a view as an EXR, in linear light, atomically and some rows at a time.

    The first part has a picture for each layer, colour multiplied by alpha. The second part, which
    paint programs ignore, has the importance of strokes and their marks.
    """
    names = exr_names(view.layers.layers)
    look = _numbered(len(view.layers) + 1, LOOK_NAME, len(view.layers))

    def shown(top: int, bottom: int) -> dict[str, _Plane]:
        size = bottom - top, view.size[1]
        rows = _shown_channels(look, view.current[top:bottom], np.ones(size, np.float32))
        for picture in view.pictures((top, bottom)):
            layer = picture.layer
            if layer.id in view.pixels:
                is_painted = layer.kind in ("pixels", "paint")
                light = picture.pixels.image if is_painted else picture.light
                inner = relative(picture.region, (top, bottom, 0, size[1]))
                alpha = _spread(picture.coverage, inner, size)
                rows |= _shown_channels(names[layer.id], _spread(light, inner, size), alpha)
        return rows

    def numbers(top: int, bottom: int) -> dict[str, _Plane]:
        rows: dict[str, _Plane] = {}
        for number in weighted:
            pixels = view.pixels[number].part((top, bottom, 0, view.size[1]))
            rows[f"{names[number]}.{IMPORTANCE}"] = pixels.importance
            if number in marked:
                none = np.zeros(pixels.image.shape, bool)
                marks = none if pixels.at_least is None else pixels.at_least
                rows |= {
                    f"{names[number]}.{channel}": marks[..., k].astype(np.float32)
                    for k, channel in enumerate(MARKS)
                }
        return rows

    kinds = ("pixels", "gradient")
    weighted = [x.id for x in view.layers if x.kind in kinds and x.id in view.pixels]
    marked = {number for number in weighted if view.pixels[number].is_marked}
    layers = [layer.as_json() | {"layer": names[layer.id]} for layer in view.layers]
    text = json.dumps({"format": FORMAT, "sensor": sensor, "layers": layers}, ensure_ascii=True)
    texts = {KEY: text}
    parts = [(PartHead("layers", view.size, _kinds(shown(0, 1)), texts), shown)]
    if weighted:
        parts.append((PartHead("importance", view.size, _kinds(numbers(0, 1))), numbers))
    room = sum(len(head.encoded()) + 8 * head.chunks for head, _ in parts) + ROOM_BYTES
    write_streamed(path, parts, room=room)


def _kinds(rows: Mapping[str, _Plane]) -> dict[str, np.dtype[Any]]:
    return {name: pixels.dtype for name, pixels in rows.items()}


def exr_names(layers: Sequence[Layer]) -> dict[int, str]:
    """Return the names of layers in an EXR, by id: a number, the name of the group, and their own.

    The topmost has 01: an EXR has no order but that of names, and Krita puts the first on top. No
    dot separates a group from its layers, since Krita puts such groups below everything.
    """
    groups = {layer.id: f"{layer.name}/" for layer in layers if layer.kind == "group"}
    return {
        layer.id: _numbered(
            k, groups.get(layer.group or 0, "") + (layer.name or "Layer"), len(layers)
        )
        for k, layer in enumerate(reversed(layers), 1)
    }


def write_layers_openraster(
    path: Path, view: ViewLayers, merged: Floats, transform: ViewTransform
) -> None:
    """Write the layers of a view as an OpenRaster file, atomically.

    merged: (h, w, 3) linear, the target that they come to.
    """
    texts = {TRANSFORM_KEY: f"{transform.name} {transform.stops!r}"}
    items = _raster_items(view, transform)
    write_openraster(path, items, transform.encode(merged), texts)


def _raster_items(
    view: ViewLayers, transform: ViewTransform
) -> Iterator[RasterLayer | RasterGroup]:
    """Yield what an OpenRaster file shows, the lowest first, one picture after the other."""
    opaque = np.ones((*view.size, 1), np.float32)
    yield RasterLayer(LOOK_NAME, np.concatenate([transform.encode(view.current), opaque], axis=-1))

    def group_of(picture: LayerPicture) -> int | None:
        return picture.layer.id if picture.layer.kind == "group" else picture.layer.group

    # The layers of a group follow each other, and lie directly below it.
    for number, pictures in groupby(view.pictures(), group_of):
        layers = (
            _raster_layer(picture, transform)
            for picture in pictures
            # Importance has no look.
            if picture.layer.kind not in ("group", "weigh") and not is_empty(picture.region)
        )
        if number is None:
            yield from layers
        else:
            group = view.layers[number]
            yield RasterGroup(group.name, layers, group.is_visible)


def _numbered(number: int, name: str, count: int) -> str:
    """Return a name without dots that sorts by its number, of so many layers above the look."""
    return f"{number:0{max(2, len(str(count + 1)))}} {name}".replace(".", ",")


def _raster_layer(picture: LayerPicture, transform: ViewTransform) -> RasterLayer:
    layer, (top, _, left, _) = picture.layer, picture.region
    display = np.concatenate([transform.encode(picture.light), picture.coverage[..., None]], -1)
    return RasterLayer(layer.name, display, (top, left), picture.opacity, layer.is_visible)


def _shown_channels(
    name: str, light: Floats, alpha: npt.NDArray[np.float32]
) -> dict[str, npt.NDArray[np.float32]]:
    """Return the channels of a layer, with colour multiplied by alpha."""
    channels = {f"{name}.{c}": _plane(light, k) * alpha for k, c in enumerate("RGB")}
    return channels | {f"{name}.A": np.asarray(alpha, np.float32)}


def _plane(pixels: Floats, k: int) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(pixels[..., k], np.float32)


def _spread(part: Floats, region: Region, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Return pixels of a region in the whole view, with 0 around."""
    whole = np.zeros((*size, *part.shape[2:]), np.float32)
    whole[slices(region)] = part
    return whole
