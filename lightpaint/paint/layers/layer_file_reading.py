"""Reads files of layers back: the EXR as it was written, an OpenRaster as layers of paint."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import ImageError, PaintError
from lightpaint.images.formats.exr import ExrPart, read_headers, read_parts
from lightpaint.images.formats.file_kinds import head_of, kind_of
from lightpaint.images.formats.openraster import layered_kind
from lightpaint.images.formats.openraster_stack import RasterGroup, RasterLayer, read_openraster
from lightpaint.paint.layers.canvas import MAX_IMPORTANCE, MAX_LIGHT
from lightpaint.paint.layers.layer import MAX_NAME_LENGTH, Layer
from lightpaint.paint.layers.layer_files import FORMAT, IMPORTANCE, KEY, LOOK_NAME, MARKS
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.layers.layered_paintings import LayeredPaintings
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.storage.json_records import read_record, strict_json

#: Number of bytes that tell the kind of a file.
HEAD_BYTES = 128

_Channels = Mapping[str, npt.NDArray[Any]]


def read_layers(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    """Return the layers in an EXR of the painter, or in an OpenRaster file of any program.

    size: (height, width) of the view, which the file must have. transform: by which the display
    values of an OpenRaster file become light. Raises PaintError or ImageError.
    """
    is_exr = check_kind(path)
    layered = _of_exr(path, size) if is_exr else _of_openraster(path, size, transform)
    if not layered.pixels:
        raise PaintError(f"{path} has no layer with anything on it")
    return layered


def check_kind(path: Path) -> bool:
    """Return whether a file of layers is an EXR, and not an OpenRaster; pixels are not read.

    Raises PaintError or ImageError for any other file.
    """
    head = head_of(path, HEAD_BYTES)
    kind = kind_of(head)
    if kind == "zip" and layered_kind(path, head) == "ora":
        return False
    if kind != "exr":
        raise PaintError(f"{path} has no layers to open: expected a .ora file, or layers.exr")
    if not any(KEY in texts for texts in read_headers(path)[0]):
        raise PaintError(
            f"{path} does not say what its layers mean, as an EXR saved again by another program: "
            "open the painter's own file, or an .ora file"
        )
    return True


def _of_exr(path: Path, size: tuple[int, int]) -> LayeredPaintings:
    parts = [part.in_display_window() for part in read_parts(path)]
    texts = [part.attributes[KEY] for part in parts if KEY in part.attributes]
    _check_size(path, parts[0].size, size)
    channels = {name: pixels for part in parts for name, pixels in part.channels.items()}
    try:
        about = strict_json(texts[0])
        if about["format"] != FORMAT:
            raise ValueError(f"format {about['format']!r}, expected {FORMAT!r}")
        names: dict[int, str] = {}
        layers = []
        for entry in about["layers"]:
            layers.append(read_record(Layer, {k: v for k, v in entry.items() if k != "layer"}))
            names[layers[-1].id] = entry["layer"]
        stack = LayerStack.of(layers)
        found = {
            (0, layer.id): _cropped(_exr_pixels(layer, names[layer.id], channels))
            for layer in layers
            if f"{names[layer.id]}.A" in channels
        }
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise PaintError(f"{path}: its layers are damaged: {ascii(error)[:200]}") from None
    return LayeredPaintings(stack, found)


def _exr_pixels(layer: Layer, name: str, channels: _Channels) -> Pixels:
    """Return the pixels of a layer. Raises LookupError or ValueError."""
    alpha = np.asarray(channels[f"{name}.A"], np.float32)
    coverage, most = alpha, 1.0
    if layer.kind in ("pixels", "gradient"):
        coverage = np.asarray(channels[f"{name}.{IMPORTANCE}"], np.float32)
        most = MAX_IMPORTANCE if layer.kind == "pixels" else 1.0
    image = np.zeros((*alpha.shape, 3), np.float32)
    if not layer.is_mask:
        planes = [np.asarray(channels[f"{name}.{c}"], np.float32) for c in "RGB"]
        divisor = np.where(alpha > 0, alpha, np.float32(1))
        image = np.stack([plane / divisor for plane in planes], axis=-1)
    marks: Bools | None = None
    if f"{name}.{MARKS[0]}" in channels:
        marks = np.stack([channels[f"{name}.{c}"] > 0 for c in MARKS], axis=-1)
    for values, bound in ((image, MAX_LIGHT), (coverage, most)):
        if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= bound):
            raise ValueError(f"{name} has values beyond 0 to {bound:g}")
    return Pixels(image, coverage, marks)


def _of_openraster(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    try:
        file_size, items = read_openraster(path)
    except ImageError as error:
        raise ImageError(f"{path} {error}") from error
    _check_size(path, file_size, size)
    layers: list[Layer] = []
    found: dict[tuple[int, int], tuple[Region, Pixels]] = {}

    def add(item: RasterLayer, group: int | None = None) -> None:
        number = len(layers) + 1
        pixels = _raster_pixels(item, size, transform)
        if pixels.importance.any():
            layers.append(_layer(number, item, group))
            found[0, number] = _cropped(pixels)

    for k, item in enumerate(items):
        if isinstance(item, RasterGroup):
            number = len(layers) + 1
            layers.append(
                Layer(number, "group", item.name[:MAX_NAME_LENGTH], is_visible=item.is_visible)
            )
            for inner in item.layers:
                add(inner, number)
        elif k or item.name != LOOK_NAME:
            add(item)
    return LayeredPaintings(LayerStack.of(layers), found)


def _layer(number: int, item: RasterLayer, group: int | None) -> Layer:
    return Layer(
        number,
        "paint",
        item.name[:MAX_NAME_LENGTH],
        is_visible=item.is_visible,
        strength=min(max(item.opacity, 0.0), 1.0),
        group=group,
    )


def _raster_pixels(item: RasterLayer, size: tuple[int, int], transform: ViewTransform) -> Pixels:
    """Return a layer's picture in the view, which it may be larger than, or beside."""
    part = ExrPart(
        "layer", {str(k): item.display[..., k] for k in range(4)}, display=size, offset=item.corner
    ).in_display_window()
    planes = [part.channels[str(k)] for k in range(4)]
    light = np.asarray(transform.decode(np.stack(planes[:3], axis=-1)), np.float32)
    return Pixels(np.minimum(light, np.float32(MAX_LIGHT)), planes[3].astype(np.float32))


def _cropped(pixels: Pixels) -> tuple[Region, Pixels]:
    """Return the smallest region with all covered pixels, and these."""
    rows, columns = (np.flatnonzero(pixels.importance.any(axis=k)) for k in (1, 0))
    if not rows.size:
        return (0, 0, 0, 0), pixels.part((0, 0, 0, 0))
    region = (int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1)
    return region, pixels.part(region).copy()


def _check_size(path: Path, found: tuple[int, int], expected: tuple[int, int]) -> None:
    if found != expected:
        (height, width), (rows, columns) = found, expected
        raise PaintError(
            f"{path} has {width}x{height} pixels, and the view {columns}x{rows}: export its layers "
            "again"
        )
