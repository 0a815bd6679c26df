"""The layers of one view as pictures: the light that each comes to, and where it applies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.composition import (
    MAX_LIGHT,
    adjusted,
    compose_layer,
    effect_of,
    gradient_pixels,
)
from lightpaint.paint.layers.layer_pixels import LayerPixels, is_empty, relative, shared
from lightpaint.paint.layers.layer_stack import MAX_STRENGTH, Layer, LayerStack
from lightpaint.paint.store.history_steps import Pixels, Region, slices

_Array = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class LayerPicture:
    """A layer as a program shows it that only lays pictures over each other.

    layer: the layer, also of a group, which has no pixels. region: the part of the view that it
    covers. pixels: its own pixels there. light: (rows, columns, 3) linear, what it shows where it
    covers fully, over the visible layers below. coverage: (rows, columns), 0 to 1. opacity: the
    rest of its strength, up to 1, that `light` does not include.
    """

    layer: Layer
    region: Region
    pixels: Pixels
    light: _Array
    coverage: _Array
    opacity: float


@dataclass(frozen=True, eq=False)
class ViewLayers:
    """The layers of one view. pixels: of each, by id. current: the look below. albedo: of the
    surfaces, for gradients.
    """

    layers: LayerStack
    pixels: Mapping[int, LayerPixels]
    current: Floats
    albedo: Floats | None = None

    @classmethod
    def of(cls, canvas: Canvas, layers: LayerStack) -> "ViewLayers":
        """Return a copy of the layers of a canvas, which shares the memory of their pixels."""
        pixels = {
            number: canvas.layer(number).copy()
            for number in layers.ids
            if not is_empty(canvas.layer(number).bounds)
        }
        has_gradient = any(layer.gradient is not None for layer in layers)
        return cls(layers, pixels, canvas.current, canvas.albedo if has_gradient else None)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the view."""
        return self.current.shape[0], self.current.shape[1]

    def pictures(self, rows: tuple[int, int] | None = None) -> Iterator[LayerPicture]:
        """Yield each layer, the lowest first; the layers of a group come before it.

        rows: the first row and the end of the part of the view in which to show them; None for all.
        Each picture is made when it is asked for, and used before the next.
        """
        top, bottom = rows or (0, self.size[0])
        part = top, bottom, 0, self.size[1]
        groups = {layer.id: layer for layer in self.layers if layer.kind == "group"}
        below = Pixels.unpainted(np.array(self.current[top:bottom], np.float32))
        for layer in self.layers:
            own = self.pixels.get(layer.id, LayerPixels(self.size))
            region = shared(own.bounds, part)
            region = (top, top, 0, 0) if is_empty(region) else region
            pixels = own.part(region)
            group = groups.get(layer.id if layer.group is None else layer.group)
            strength, is_shown = layer.strength, layer.is_visible
            if group is not None and group is not layer:
                strength = min(MAX_STRENGTH, strength * group.strength)
                is_shown &= group.is_visible
            effective = replace(effect_of(layer), strength=strength)
            inner = relative(region, part)
            shown, area = pixels, below.part(inner)
            if layer.gradient is not None:
                shown = gradient_pixels(layer.gradient, pixels.importance, region, self.albedo)
            light, coverage, opacity = _appearance(effective, shown, area.image)
            yield LayerPicture(layer, region, pixels, light, coverage, opacity)
            if is_shown and strength > 0 and not is_empty(region):
                below.image[slices(inner)] = compose_layer(effective, shown, area).image


def _appearance(layer: Layer, pixels: Pixels, below: _Array) -> tuple[_Array, _Array, float]:
    """Return light, coverage and opacity that show a layer when laid over the light below."""
    strength = layer.strength
    if layer.kind in ("pixels", "paint"):
        light, opacity = pixels.image, min(strength, 1.0)
        if strength > 1:
            light = below + np.float32(strength) * (pixels.image - below)
    else:
        light, opacity = below.copy(), 1.0
        if layer.kind == "adjust":
            tint = layer.tint
            factors = (tint[0] ** strength, tint[1] ** strength, tint[2] ** strength)
            light = adjusted(below, layer.gain**strength, factors)
    counts = pixels.importance
    coverage = (counts > 0).astype(np.float32) if layer.kind == "pixels" else counts
    return np.clip(light, 0, np.float32(MAX_LIGHT)), np.minimum(coverage, 1), opacity
