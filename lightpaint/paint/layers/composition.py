"""Composition of layers into a target: light and importance of each pixel, lowest layer first.

Everything is float32 arithmetic on single pixels, in NumPy, so that any partition of the picture
into regions gives the same bits. Only a layer's accent depends on more than its pixel. If the whole
picture is painted (darkened as a whole, say), a layer over a small part counts more than the rest,
so that it has the same effect as over a picture whose rest is held.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import RGB, Bools, Floats
from lightpaint.colour.color import LUMINANCE
from lightpaint.paint.layers.layer import Layer
from lightpaint.paint.layers.layer_pixels import (
    MIN_COVERAGE,
    LayerPixels,
    is_empty,
    relative,
    shared,
)
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices

#: Importance of the rest of a fully painted picture relative to one layer, and the largest accent,
#: which compensates for a layer over a fortieth of the picture.
REST_SHARE, MAX_ACCENT = 4.0, 10.0

#: Lower and upper bound of importance under repeated weighing.
MIN_WEIGHED, MAX_WEIGHED = 0.01, 1000.0

#: Brightest light that a layer makes: the largest half float, so that both views can show it.
MAX_LIGHT = 65504.0

_Array = npt.NDArray[np.float32]


class ShownLayer(NamedTuple):
    """A visible layer, with its pixels and accent in one view."""

    layer: Layer
    pixels: LayerPixels
    accent: float


def accent(part: float) -> float:
    """Return the factor by which a layer over that part of a fully painted picture counts more."""
    if part <= 0:
        return MAX_ACCENT
    return min(MAX_ACCENT, max(1.0, (1 - part) / (REST_SHARE * part)))


def accents(layers: Sequence[tuple[Layer, LayerPixels]]) -> list[float]:
    """Return the accent of each visible layer, in one view.

    It depends on their coverage alone, and not on when they were made.
    """
    covering = [layer.id for layer, pixels in layers if pixels.covers_all]
    return [
        accent(pixels.mean_coverage) if set(covering) - {layer.id} else 1.0
        for layer, pixels in layers
    ]


def compose(layers: Sequence[ShownLayer], current: Floats, region: Region) -> Pixels:
    """Return the target in a region.

    layers: the visible ones, the lowest first. current: (h, w, 3) linear, the current look.
    """
    on_look = Pixels.unpainted(np.array(current[slices(region)], np.float32))
    return compose_over(layers, on_look, region)


def compose_over(layers: Sequence[ShownLayer], below: Pixels, region: Region) -> Pixels:
    """Return the target of layers over the composition of those below them, in a region.

    below: in that region; changed.
    """
    result = below
    for shown in layers:
        if is_empty(area := shared(shown.pixels.bounds, region)):
            continue
        # A layer changes nothing where it has no pixels, so that small ones cost their area alone.
        inner = relative(area, region)
        pixels, below = shown.pixels.part(area), result.part(inner)
        composed = compose_layer(shown.layer, pixels, below, shown.accent)
        result.image[slices(inner)] = composed.image
        result.importance[slices(inner)] = composed.importance
        if (marks := composed.at_least) is not None:
            at_least = result.at_least
            at_least = np.zeros(result.image.shape, bool) if at_least is None else at_least
            at_least[slices(inner)] = marks
            result = result._replace(at_least=at_least)
    return result


def compose_layer(layer: Layer, pixels: Pixels, below: Pixels, accent: float = 1.0) -> Pixels:
    """Return the pixels below a layer with the layer applied."""
    factor = np.float32(accent * layer.importance)
    if layer.kind == "pixels":
        return _replace(layer, pixels, below, factor)
    coverage = pixels.importance
    covered = coverage >= np.float32(MIN_COVERAGE)
    if layer.kind == "weigh":
        times = np.float32(layer.times**layer.strength)
        base = np.where(below.importance > 0, below.importance, np.float32(1))
        weighed = below.importance + coverage * (_weighed(base, times) - below.importance)
        return below._replace(importance=np.where(covered, weighed, below.importance))
    if layer.kind == "paint":
        to, share = pixels.image, coverage * np.float32(layer.strength)
    else:
        gain, tint = layer.gain**layer.strength, [t**layer.strength for t in layer.tint]
        to, share = adjusted(below.image, gain, (tint[0], tint[1], tint[2])), coverage
    light = below.image + share[..., None] * (to - below.image)
    light = np.minimum(np.maximum(light, np.float32(0)), np.float32(MAX_LIGHT))
    grown = below.importance + coverage * (factor - below.importance)
    counts = np.where(covered & (below.importance < factor), grown, below.importance)
    image = np.where(covered[..., None], light, below.image)
    return Pixels(image, counts, _unmarked(below.at_least, covered))


def _replace(layer: Layer, pixels: Pixels, below: Pixels, factor: np.float32) -> Pixels:
    """Return the pixels with those of a `pixels` layer, where it is painted."""
    painted = pixels.importance > 0
    image = pixels.image
    if layer.strength != 1:
        light = below.image + np.float32(layer.strength) * (image - below.image)
        image = np.maximum(light, np.float32(0))
    marks = _unmarked(below.at_least, painted)
    if pixels.at_least is not None:
        own = pixels.at_least & painted[..., None]
        marks = own if marks is None else marks | own
    counts = np.where(painted, pixels.importance * factor, below.importance)
    return Pixels(np.where(painted[..., None], image, below.image), counts, marks)


def adjusted(light: Floats, gain: float, tint: RGB) -> _Array:
    """Return light (..., 3) with its luminance scaled by `gain` and its colour tinted."""
    tinted = np.asarray(light, np.float32) * np.asarray(tint, np.float32)
    before, after = _luminance(light), _luminance(tinted)
    lit = after > 0
    level = np.where(
        lit, np.float32(gain) * before / np.where(lit, after, np.float32(1)), np.float32(gain)
    )
    return np.asarray(tinted * level[..., None], np.float32)


def _luminance(light: Floats) -> _Array:
    r, g, b = (np.float32(x) for x in LUMINANCE)
    return np.asarray(r * light[..., 0] + g * light[..., 1] + b * light[..., 2], np.float32)


def _weighed(importance: _Array, times: np.float32) -> _Array:
    """Return importance times a factor, within bounds; values already beyond them stay."""
    least = np.minimum(importance, np.float32(MIN_WEIGHED))
    most = np.maximum(importance, np.float32(MAX_WEIGHED))
    return np.asarray(np.minimum(most, np.maximum(least, importance * times)), np.float32)


def _unmarked(marks: Bools | None, covered: Bools) -> Bools | None:
    return None if marks is None else marks & ~covered[..., None]
