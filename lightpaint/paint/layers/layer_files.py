"""Files of the layers of a view, for other programs: a multilayer OpenEXR, and an OpenRaster.

The EXR holds the layers in numbers, so that nothing of them is lost. The OpenRaster shows what they
look like: each layer as the light that it comes to, through the view transform of the painting.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.formats.exr import ExrPart, write_parts
from lightpaint.images.formats.openraster_stack import RasterGroup, RasterLayer, write_openraster
from lightpaint.images.formats.png import TRANSFORM_KEY
from lightpaint.paint.layers.layer import Layer
from lightpaint.paint.layers.layer_pixels import is_empty
from lightpaint.paint.layers.view_layers import LayerPicture, ViewLayers
from lightpaint.paint.store.canvas_pixels import Region, slices

#: Text attribute of the EXR, and its format.
KEY, FORMAT = "lightpaint.layers", "lightpaint-layers 1"

#: Name of the picture below all layers.
LOOK_NAME = "Unpainted"

#: Channels with the importance of a layer of strokes, and with its marks "this or brighter".
IMPORTANCE, MARKS = "W", ("at_least_R", "at_least_G", "at_least_B")


def write_layers_exr(path: Path, view: ViewLayers, sensor: str) -> None:
    """Write the layers of a view as an EXR, in linear light, atomically.

    The first part has a picture for each layer, colour multiplied by alpha. The second part, which
    paint programs ignore, has the importance of strokes and their marks.
    """
    names = exr_names(view.layers.layers)
    look = _numbered(len(view.layers) + 1, LOOK_NAME, len(view.layers))
    pictures = _shown_channels(look, view.current, np.ones(view.size, np.float32))
    numbers: dict[str, npt.NDArray[np.float32]] = {}
    for picture in view.pictures():
        if is_empty(picture.region):
            continue
        name, pixels, kind = names[picture.layer.id], picture.pixels, picture.layer.kind
        light = pixels.image if kind in ("pixels", "paint") else picture.light
        alpha = _spread(picture.coverage, picture.region, view.size)
        pictures |= _shown_channels(name, _spread(light, picture.region, view.size), alpha)
        if kind == "pixels":
            numbers[f"{name}.{IMPORTANCE}"] = _spread(pixels.importance, picture.region, view.size)
        if pixels.at_least is not None:
            marks = _spread(pixels.at_least.astype(np.float32), picture.region, view.size)
            numbers |= {f"{name}.{MARKS[k]}": _plane(marks, k) for k in range(3)}
    layers = [layer.as_json() | {"layer": names[layer.id]} for layer in view.layers]
    text = json.dumps({"format": FORMAT, "sensor": sensor, "layers": layers}, ensure_ascii=True)
    parts = [ExrPart("layers", pictures, {KEY: text})]
    write_parts(path, [*parts, ExrPart("importance", numbers)] if numbers else parts)


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
    groups: dict[int, list[RasterLayer]] = {
        layer.id: [] for layer in view.layers if layer.kind == "group"
    }
    opaque = np.ones((*view.size, 1), np.float32)
    display = np.concatenate([transform.encode(view.current), opaque], axis=-1)
    items: list[RasterLayer | RasterGroup] = [RasterLayer(LOOK_NAME, display)]
    for picture in view.pictures():
        layer = picture.layer
        if layer.kind == "group":
            items.append(RasterGroup(layer.name, groups[layer.id], layer.is_visible))
        elif not is_empty(picture.region) and layer.kind != "weigh":  # importance has no look
            siblings = items if layer.group is None else groups[layer.group]
            siblings.append(_raster_layer(picture, transform))
    texts = {TRANSFORM_KEY: f"{transform.name} {transform.stops!r}"}
    write_openraster(path, items, transform.encode(merged), texts)


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
