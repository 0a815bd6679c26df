"""Reads files of layers back: the EXR as it was written, an OpenRaster as layers of paint."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import ImageError, PaintError
from lightpaint.images.formats.exr import read_headers, read_parts
from lightpaint.images.formats.file_kinds import head_of, kind_of
from lightpaint.images.formats.openraster import layered_kind
from lightpaint.images.formats.openraster_stack import (
    RasterGroup,
    RasterLayer,
    opened_openraster,
)
from lightpaint.paint.layers.canvas import MAX_IMPORTANCE, MAX_LIGHT
from lightpaint.paint.layers.layer_files import FORMAT, IMPORTANCE, KEY, LOOK_NAME, MARKS
from lightpaint.paint.layers.layer_stack import MAX_NAME_LENGTH, Layer, LayerStack
from lightpaint.paint.layers.layered_paintings import LayeredPaintings
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices
from lightpaint.storage.json_records import read_record, strict_json

#: Number of bytes that tell the kind of a file.
HEAD_BYTES = 128

#: Most pixels that the layers of a file may cover together: 16 bytes each stay in memory.
MAX_KEPT_PIXELS = 2**27

_Channels = Mapping[str, npt.NDArray[Any]]


def read_layers(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    """Return the layers in an EXR of the painter, or in an OpenRaster file of any program.

    size: (height, width) of the view, which the file must have. transform: by which the display
    values of an OpenRaster file become light. Raises PaintError or ImageError.
    """
    is_exr = check_kind(path)
    try:
        layered = _of_exr(path, size) if is_exr else _of_openraster(path, size, transform)
    except OSError as error:
        raise PaintError(f"cannot read {path}: {error.strerror or error}") from error
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
    texts, file_size = read_headers(path)
    _check_size(path, file_size, size)
    try:
        stack, names = _exr_layers(next(each[KEY] for each in texts if KEY in each))
        parts = [part.in_display_window() for part in read_parts(path)]
        channels = {name: pixels for part in parts for name, pixels in part.channels.items()}
        found = _Found(path)
        for layer in stack:
            if f"{names.get(layer.id)}.A" in channels:
                found.add(layer.id, *_cropped(_exr_pixels(layer, names[layer.id], channels)))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise PaintError(f"{path}: its layers are damaged: {ascii(error)[:200]}") from None
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
                f"{self._path} has layers that cover more than {MAX_KEPT_PIXELS / 1e6:.0f} million "
                "pixels together: merge some"
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
    for values, bound in ((image, MAX_LIGHT), (coverage, most)):
        if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= bound):
            raise ValueError(f"{name} has values beyond 0 to {bound:g}")
    return Pixels(image, coverage, marks)


def _of_openraster(path: Path, size: tuple[int, int], transform: ViewTransform) -> LayeredPaintings:
    layers: list[Layer] = []
    found = _Found(path)

    def add(item: RasterLayer, group: int | None = None) -> None:
        number = len(layers) + 1
        region, pixels = _raster_pixels(item, size, transform)
        if pixels.importance.any():
            layers.append(_layer(number, item, group))
            found.add(number, region, pixels)

    try:
        with opened_openraster(path) as (file_size, items):
            _check_size(path, file_size, size)
            for k, item in enumerate(items):
                if isinstance(item, RasterGroup):
                    number = len(layers) + 1
                    name = item.name[:MAX_NAME_LENGTH]
                    layers.append(Layer(number, "group", name, is_visible=item.is_visible))
                    for inner in item.layers:
                        add(inner, number)
                elif k or item.name != LOOK_NAME:
                    add(item)
    except ImageError as error:
        raise ImageError(f"{path} {error}") from error
    return LayeredPaintings(LayerStack.of(layers), found.pixels)


def _layer(number: int, item: RasterLayer, group: int | None) -> Layer:
    return Layer(
        number,
        "paint",
        item.name[:MAX_NAME_LENGTH],
        is_visible=item.is_visible,
        strength=min(max(item.opacity, 0.0), 1.0),
        group=group,
    )


def _raster_pixels(
    item: RasterLayer, size: tuple[int, int], transform: ViewTransform
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
    pixels = Pixels(np.minimum(light, np.float32(MAX_LIGHT)), display[..., 3].copy())
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
            f"{path} has {width}x{height} pixels, and the view {columns}x{rows}: export its layers "
            "again"
        )
