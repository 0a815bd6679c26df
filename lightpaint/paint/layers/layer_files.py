"""Files of the layers of a view, for other programs: a multilayer OpenEXR, and an OpenRaster.

The EXR holds the layers in numbers, so that nothing of them is lost, and is read back as it was.
The OpenRaster shows what they look like: each layer as the light that it comes to, through the view
transform of the painting; it is read back as layers of paint. A note at an adjustment says what it
does, and holds while no program has changed or dropped it: then it is read back as an adjustment.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats
from lightpaint.colour import ViewTransform
from lightpaint.errors import ImageError, PaintError
from lightpaint.images import formats
from lightpaint.paint.layers.canvas import (
    MAX_IMPORTANCE,
    MAX_PAINTED_LIGHT,
    LayerPicture,
    ViewLayers,
)
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.layer_pixels import is_empty, relative
from lightpaint.paint.layers.layer_stack import MAX_NAME_LENGTH, PAINTING_ID, Layer, LayerStack
from lightpaint.paint.store.history_steps import Pixels, Region, slices
from lightpaint.storage.json_records import read_record, strict_json

#: Text attribute of the EXR, and its format.
KEY, FORMAT = "lightpaint.layers", "lightpaint-layers 1"

#: Properties of an adjustment that its note in an OpenRaster file has.
NOTED = ("gain", "tint", "strength", "importance")

#: Name of the picture below all layers.
LOOK_NAME = "Unpainted"

#: Channels with the importance of a layer of strokes, and with its marks "this or brighter".
IMPORTANCE, MARKS = "W", ("at_least_R", "at_least_G", "at_least_B")

#: Bytes before the pixels of a file beside its headers.
ROOM_BYTES = 256

_Plane = npt.NDArray[np.float32]

#: Number of bytes that tell the kind of a file.
HEAD_BYTES = 128

#: Most pixels that the layers of a file may cover together: while the painter takes them in, each
#: needs some 60 bytes.
MAX_KEPT_PIXELS = 2**26

_Channels = Mapping[str, npt.NDArray[Any]]


def write_layers_exr(path: Path, view: ViewLayers, sensor: str) -> None:
    """Write the layers of a view as an EXR, in linear light, atomically and some rows at a time.

    The first part has a picture for each layer, colour multiplied by alpha. The second part, which
    paint programs ignore, has the importance of strokes and their marks.
    """
    names = _exr_names(view.layers.layers)
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
    parts = [(formats.PartHead("layers", view.size, _kinds(shown(0, 1)), texts), shown)]
    if weighted:
        parts.append((formats.PartHead("importance", view.size, _kinds(numbers(0, 1))), numbers))
    room = sum(len(head.encoded()) + 8 * head.chunks for head, _ in parts) + ROOM_BYTES
    formats.write_streamed(path, parts, room=room)


def _kinds(rows: Mapping[str, _Plane]) -> dict[str, np.dtype[Any]]:
    return {name: pixels.dtype for name, pixels in rows.items()}


def _exr_names(layers: Sequence[Layer]) -> dict[int, str]:
    """Return the names of layers in an EXR, by id: a number, the name of the group, and their own.

    The topmost has 01: an EXR has no order but the order of names, and Krita puts the first on top.
    No dot separates a group from its layers, since Krita puts such groups below everything.
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
    texts = {formats.TRANSFORM_KEY: f"{transform.name} {transform.stops!r}"}
    items = _raster_items(view, transform)
    formats.write_openraster(path, items, transform.encode(merged), texts)


def _raster_items(
    view: ViewLayers, transform: ViewTransform
) -> Iterator[formats.RasterLayer | formats.RasterGroup]:
    """Yield what an OpenRaster file shows, the lowest first, one picture after the other."""
    opaque = np.ones((*view.size, 1), np.float32)
    yield formats.RasterLayer(
        LOOK_NAME, np.concatenate([transform.encode(view.current), opaque], axis=-1)
    )

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
            yield formats.RasterGroup(group.name, layers, group.is_visible)


def _numbered(number: int, name: str, count: int) -> str:
    """Return a name without dots that sorts by its number, of so many layers above the look."""
    return f"{number:0{max(2, len(str(count + 1)))}} {name}".replace(".", ",")


def _raster_layer(picture: LayerPicture, transform: ViewTransform) -> formats.RasterLayer:
    layer, (top, _, left, _) = picture.layer, picture.region
    display = np.concatenate([transform.encode(picture.light), picture.coverage[..., None]], -1)
    return formats.RasterLayer(
        layer.name, display, (top, left), picture.opacity, layer.is_visible, _note(picture.effect)
    )


def _note(effect: Layer) -> str:
    """Return what an adjustment does, as JSON; "" for other layers, which their picture shows."""
    if effect.kind != "adjust":
        return ""
    factors = {k: v for k, v in effect.as_json().items() if k in NOTED}
    return json.dumps({"format": FORMAT, "kind": effect.kind, **factors})


def _noted(note: str) -> Layer:
    """Return the adjustment of a note, with no name or place. Raises ImageError."""
    try:
        about = strict_json(note)
        kind = about.pop("format"), about.pop("kind")
        if kind != (FORMAT, "adjust") or not about.keys() <= set(NOTED):
            raise ValueError(f"{kind} with {', '.join(about)}")
        return read_record(Layer, {"id": PAINTING_ID, "kind": "adjust", **about})
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise ImageError(f"is damaged: the note of a layer: {ascii(error)[:200]}") from None


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


def read_layers(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    """Return the layers in an EXR of the painter, or in an OpenRaster file of any program.

    size: (height, width) of the view, which the file must have. transform: by which the display
    values of an OpenRaster file become light. Raises PaintError or ImageError.
    """
    is_exr = check_kind(path)
    try:
        layered = _of_exr(path, size) if is_exr else _of_openraster(path, size, transform)
    except OSError as error:
        raise PaintError("cannot read ", path, f": {error.strerror or error}") from error
    if not layered.pixels:
        raise PaintError(path, " has no layer with anything on it")
    return layered


def check_kind(path: Path) -> bool:
    """Return whether a file of layers is an EXR, and not an OpenRaster; pixels are not read.

    Raises PaintError or ImageError for any other file.
    """
    head = formats.head_of(path, HEAD_BYTES)
    kind = formats.kind_of(head)
    if kind == "zip" and formats.layered_kind(path, head) == "ora":
        return False
    if kind != "exr":
        raise PaintError(path, " has no layers to open: expected a .ora file, or layers.exr")
    if not any(KEY in texts for texts in formats.read_headers(path)[0]):
        raise PaintError(
            path,
            " does not say what its layers mean, as an EXR saved again by another program: "
            "open the painter's own file, or an .ora file",
        )
    return True


def _of_exr(path: Path, size: tuple[int, int]) -> LayeredPaintings:
    texts, file_size = formats.read_headers(path)
    _check_size(path, file_size, size)
    try:
        stack, names = _exr_layers(next(each[KEY] for each in texts if KEY in each))
        parts = [part.in_display_window() for part in formats.read_parts(path)]
        channels = {name: pixels for part in parts for name, pixels in part.channels.items()}
        found = _Found(path)
        for layer in stack:
            if f"{names.get(layer.id)}.A" in channels:
                found.add(layer.id, *_cropped(_exr_pixels(layer, names[layer.id], channels)))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise PaintError(path, f": its layers are damaged: {ascii(error)[:200]}") from None
    return LayeredPaintings(stack, found.pixels)


def _exr_layers(text: str) -> tuple[LayerStack, dict[int, str]]:
    """Return the layers that an EXR lists, and the names of their channels by id.

    Raises LookupError, TypeError, ValueError or AttributeError; PaintError for too many.
    """
    about = strict_json(text)
    if about["format"] != FORMAT:
        raise ValueError(f"format {about['format']!r}, expected {FORMAT!r}")
    layers = [
        read_record(Layer, {k: v for k, v in entry.items() if k != "layer"})
        for entry in about["layers"]
    ]
    names = [entry["layer"] for entry in about["layers"]]
    if len(set(names)) < len(names):
        raise ValueError("two layers have the same channels")
    stack = LayerStack.of(layers)
    return stack, dict(zip((layer.id for layer in layers), names, strict=True))


class _Found:
    """Pixels of the layers of a file, by view and id. Raises PaintError where they are too many."""

    def __init__(self, path: Path) -> None:
        self.pixels: dict[tuple[int, int], tuple[Region, Pixels]] = {}
        self._path, self._count = path, 0

    def add(self, number: int, region: Region, pixels: Pixels) -> None:
        """Keep the pixels of a layer."""
        self._count += pixels.importance.size
        if self._count > MAX_KEPT_PIXELS:
            raise PaintError(
                self._path,
                f" has layers that cover more than {MAX_KEPT_PIXELS / 1e6:.0f} million "
                "pixels together: merge some",
            )
        self.pixels[0, number] = region, pixels


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
    for values, bound in ((image, MAX_PAINTED_LIGHT), (coverage, most)):
        if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= bound):
            raise ValueError(f"{name} has values beyond 0 to {bound:g}")
    return Pixels(image, coverage, marks)


def _of_openraster(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    layers: list[Layer] = []
    found = _Found(path)

    def add(item: formats.RasterLayer, group: int | None = None) -> None:
        number = len(layers) + 1
        region, pixels = _raster_pixels(item, size, transform)
        if pixels.importance.any():
            layer = _layer(number, item, group)
            image = np.zeros_like(pixels.image) if layer.is_mask else pixels.image
            layers.append(layer)
            found.add(number, region, pixels._replace(image=image))

    try:
        with formats.opened_openraster(path) as (file_size, items):
            _check_size(path, file_size, size)
            for k, item in enumerate(items):
                if isinstance(item, formats.RasterGroup):
                    number = len(layers) + 1
                    name = item.name[:MAX_NAME_LENGTH]
                    layers.append(Layer(number, "group", name, is_visible=item.is_visible))
                    for inner in item.layers:
                        add(inner, number)
                elif k or item.name != LOOK_NAME:
                    add(item)
    except ImageError as error:
        raise ImageError(path, " ", error) from error
    return LayeredPaintings(LayerStack.of(layers), found.pixels)


def _layer(number: int, item: formats.RasterLayer, group: int | None) -> Layer:
    opacity = min(max(item.opacity, 0.0), 1.0)
    layer = _noted(item.note) if item.note else Layer(number, "paint", strength=opacity)
    name = item.name[:MAX_NAME_LENGTH]
    return replace(layer, id=number, name=name, is_visible=item.is_visible, group=group)


def _raster_pixels(
    item: formats.RasterLayer, size: tuple[int, int], transform: ViewTransform
) -> tuple[Region, Pixels]:
    """Return the region of the view that a layer covers, and its pixels there.

    The layer's picture may be larger than the view, or beside it.
    """
    (y, x), (rows, columns) = item.corner, item.display.shape[:2]
    top, left = max(y, 0), max(x, 0)
    bottom, right = max(min(y + rows, size[0]), top), max(min(x + columns, size[1]), left)
    display = item.display[top - y : bottom - y, left - x : right - x]
    inner = _covered(display[..., 3])
    display = display[slices(inner)]
    light = np.asarray(transform.decode(display[..., :3]), np.float32)
    pixels = Pixels(np.minimum(light, np.float32(MAX_PAINTED_LIGHT)), display[..., 3].copy())
    return (top + inner[0], top + inner[1], left + inner[2], left + inner[3]), pixels


def _cropped(pixels: Pixels) -> tuple[Region, Pixels]:
    """Return the smallest region with all covered pixels, and these."""
    region = _covered(pixels.importance)
    return region, pixels.part(region).copy()


def _covered(coverage: npt.NDArray[np.float32]) -> Region:
    """Return the smallest region with all pixels above 0."""
    rows, columns = (np.flatnonzero(coverage.any(axis=k)) for k in (1, 0))
    if not rows.size:
        return 0, 0, 0, 0
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1


def _check_size(path: Path, found: tuple[int, int], expected: tuple[int, int]) -> None:
    if found != expected:
        (height, width), (rows, columns) = found, expected
        raise PaintError(
            path,
            f" has {width}x{height} pixels, and the view {columns}x{rows}: export its layers again",
        )
