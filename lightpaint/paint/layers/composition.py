"""Composition of layers into a target: light and importance of each pixel, lowest layer first.

Everything is float32 arithmetic on single pixels, in NumPy, so that any partition of the picture
into regions gives the same bits. Only a layer's accent depends on more than its pixel. If the whole
picture is painted (darkened as a whole, say), a layer over a small part counts more than the rest,
so that it has the same effect as over a picture whose rest is held.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import RGB, Bools, Floats
from lightpaint.colour import LUMINANCE
from lightpaint.paint.layers import layer_pixels
from lightpaint.paint.layers.layer_stack import Gradient, Layer, LayerKind
from lightpaint.paint.store.history_steps import Pixels, Region, slices

#: Lower and upper bound of importance under repeated weighing.
MIN_WEIGHED, MAX_WEIGHED = 0.01, 1000.0

#: Square of the shortest gradient, in pixels; a shorter one has not begun to fall off.
MIN_GRADIENT = 1e-6

#: Brightest light that a layer makes: the largest half float, so that both views can show it.
MAX_LIGHT = 65504.0

_Array = npt.NDArray[np.float32]

#: Returns the albedo of a view, (h, w, 3) float32; None where there is none.
AlbedoSource = Callable[[], Floats | None]


class GradientPixels:
    """The pixels of a gradient within its mask, which `compose` uses as the pixels of a layer."""

    def __init__(
        self, gradient: Gradient, mask: layer_pixels.LayerPixels, albedo: AlbedoSource
    ) -> None:
        self._values = gradient, mask, albedo
        self._summary: tuple[int, float, bool] | None = None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, GradientPixels) and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    @property
    def bounds(self) -> Region:
        """Bounds of the mask."""
        return self._values[1].bounds

    @property
    def bands(self) -> list[Region]:
        """The bounds of the mask in each row of tiles, in whole tiles."""
        return self._values[1].bands

    @property
    def revision(self) -> int:
        """Revision of the mask."""
        return self._values[1].revision

    @property
    def mean_coverage(self) -> float:
        """Mean coverage of the view."""
        return self._totals()[0]

    @property
    def covers_all(self) -> bool:
        """True if no pixel of the view is uncovered."""
        return self._totals()[1]

    def part(self, region: Region) -> Pixels:
        """Return the pixels of a region."""
        gradient, mask, albedo = self._values
        surface = albedo() if gradient.is_incident else None
        return gradient_pixels(gradient, mask.part(region).importance, region, surface)

    def coverage(self, region: Region) -> _Array:
        """Return the coverage of a region."""
        return self.part(region).importance

    def _totals(self) -> tuple[float, bool]:
        gradient, mask, _ = self._values
        if self._summary is None or self._summary[0] != mask.revision:
            share = mask.part(mask.bounds).importance
            coverage = gradient_pixels(gradient, share, mask.bounds, None).importance
            height, width = mask.size
            least = coverage.min() if coverage.size == height * width else 0
            total = float(np.minimum(coverage, 1).sum(dtype=np.float64))
            mean = total / (height * width)
            self._summary = mask.revision, mean, bool(least >= layer_pixels.MIN_COVERAGE)
        return self._summary[1:]


class ShownLayer(NamedTuple):
    """A visible layer, with its pixels and accent in one view. A gradient is one of `paint` or
    `adjust`, by what it does.
    """

    layer: Layer
    pixels: layer_pixels.LayerPixels | GradientPixels
    accent: float


def with_effect(
    layer: Layer, pixels: layer_pixels.LayerPixels, albedo: AlbedoSource
) -> tuple[Layer, layer_pixels.LayerPixels | GradientPixels]:
    """Return a layer and its pixels as `compose` takes them: a gradient as what it does."""
    if layer.gradient is None:
        return layer, pixels
    return effect_of(layer), GradientPixels(layer.gradient, pixels, albedo)


def effect_of(layer: Layer) -> Layer:
    """Return a gradient as a layer of paint, or as an adjustment; others as they are."""
    if layer.gradient is None:
        return layer
    kind: LayerKind = "adjust" if layer.gradient.light is None else "paint"
    return replace(layer, kind=kind, gradient=None)


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
        if layer_pixels.is_empty(area := layer_pixels.shared(shown.pixels.bounds, region)):
            continue
        # A layer changes nothing where it has no pixels, so that small ones cost their area alone.
        inner = layer_pixels.relative(area, region)
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


def compose_importance(
    layers: Sequence[ShownLayer], below: _Array | None, region: Region
) -> _Array:
    """Return the importance that `compose_over` gives in a region, for a fraction of its time.

    Light and marks do not depend on importance. below: in that region, changed; None for zeros.
    """
    top, bottom, left, right = region
    result = np.zeros((bottom - top, right - left), np.float32) if below is None else below
    for layer, pixels, own_accent in layers:
        if layer_pixels.is_empty(area := layer_pixels.shared(pixels.bounds, region)):
            continue
        inner = slices(layer_pixels.relative(area, region))
        if _counts_nowhere(layer, result[inner], own_accent):
            continue  # before its coverage is put together
        result[inner] = _counts(layer, pixels.coverage(area), result[inner], own_accent)
    return result


def compose_layer(layer: Layer, pixels: Pixels, below: Pixels, accent: float = 1.0) -> Pixels:
    """Return the pixels below a layer with the layer applied."""
    coverage = pixels.importance
    counts = _counts(layer, coverage, below.importance, accent)
    if layer.kind == "pixels":
        return _replace(layer, pixels, below, counts)
    if layer.kind == "weigh":
        return below._replace(importance=counts)
    covered = coverage >= np.float32(layer_pixels.MIN_COVERAGE)
    if layer.kind == "paint":
        to, share = pixels.image, coverage * np.float32(layer.strength)
    else:
        gain, tint = layer.gain**layer.strength, [t**layer.strength for t in layer.tint]
        to, share = adjusted(below.image, gain, (tint[0], tint[1], tint[2])), coverage
    light = below.image + share[..., None] * (to - below.image)
    light = np.minimum(np.maximum(light, np.float32(0)), np.float32(MAX_LIGHT))
    image = np.where(covered[..., None], light, below.image)
    return Pixels(image, counts, _unmarked(below.at_least, covered))


def _counts(layer: Layer, coverage: _Array, below: _Array, accent: float) -> _Array:
    """Return the importance with a layer applied. coverage: of the layer; below: without it."""
    if _counts_nowhere(layer, below, accent):
        return below
    factor = np.float32(accent * layer.importance)
    if layer.kind == "pixels":
        return np.where(coverage > 0, coverage * factor, below)
    covered = coverage >= np.float32(layer_pixels.MIN_COVERAGE)
    if layer.kind == "weigh":
        times = np.float32(layer.times**layer.strength)
        base = np.where(below > 0, below, np.float32(1))
        return np.where(covered, below + coverage * (_weighed(base, times) - below), below)
    grown = below + coverage * (factor - below)
    return np.where(covered & (below < factor), grown, below)


def _counts_nowhere(layer: Layer, below: _Array, accent: float) -> bool:
    """Return whether all pixels below a layer count as much as it does: then it raises none.

    So most layers over the whole picture are, above another one.
    """
    raises = layer.kind in ("paint", "adjust")
    return raises and bool(below.min() >= np.float32(accent * layer.importance))


def _replace(layer: Layer, pixels: Pixels, below: Pixels, counts: _Array) -> Pixels:
    """Return the pixels with the pixels of a `pixels` layer, where it is painted. counts: of
    all."""
    painted = pixels.importance > 0
    image = pixels.image
    if layer.strength != 1:
        light = below.image + np.float32(layer.strength) * (image - below.image)
        image = np.maximum(light, np.float32(0))
    marks = _unmarked(below.at_least, painted)
    if pixels.at_least is not None:
        own = pixels.at_least & painted[..., None]
        marks = own if marks is None else marks | own
    return Pixels(np.where(painted[..., None], image, below.image), counts, marks)


def gradient_pixels(
    gradient: Gradient, mask: _Array, region: Region, albedo: Floats | None
) -> Pixels:
    """Return colour and coverage of a gradient in a region.

    mask: (rows, columns), where it applies. albedo: (h, w, 3), of the view.
    """
    share = _ramp(gradient, region)
    fades = gradient.end_light is None
    coverage = mask * (np.float32(1) - share) if fades else mask
    if gradient.light is None:
        return Pixels(np.broadcast_to(np.float32(0), (*mask.shape, 3)), coverage)
    first, last = (
        np.array(x or gradient.light, np.float32) for x in (gradient.light, gradient.end_light)
    )
    light = first + share[..., None] * (last - first)
    if gradient.is_incident and albedo is not None:
        surface = np.asarray(albedo[slices(region)], np.float32)
        light = light * surface
        # Surfaces without diffuse reflection ignore light.
        coverage = np.where(surface.any(axis=-1), coverage, np.float32(0))
    return Pixels(light, coverage)


def _ramp(gradient: Gradient, region: Region) -> _Array:
    """Return 0 at the start of a gradient to 1 at its end, smoothly, at each pixel of a region."""
    top, bottom, left, right = region
    dx, dy = (end - start for start, end in zip(gradient.start, gradient.end, strict=True))
    square = dx * dx + dy * dy
    if square < MIN_GRADIENT:
        return np.zeros((bottom - top, right - left), np.float32)
    half, (x, y) = np.float32(0.5), np.array(gradient.start, np.float32)
    across = np.arange(left, right, dtype=np.float32) + half - x
    down = np.arange(top, bottom, dtype=np.float32) + half - y
    if gradient.shape == "linear":
        along = (across * np.float32(dx))[None] + (down * np.float32(dy))[:, None]
        place = along * np.float32(1 / square)
    else:
        distance = np.sqrt((across * across)[None] + (down * down)[:, None])
        place = distance * np.float32(1 / math.sqrt(square))
    place = np.minimum(np.maximum(place, np.float32(0)), np.float32(1))
    return np.asarray(place * place * (np.float32(3) - np.float32(2) * place), np.float32)


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
