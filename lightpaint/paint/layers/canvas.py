"""The painting of one view: its pixels, the open stroke, and its layers as pictures: the light that
each comes to, and where it applies.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis import Basis, as_halves
from lightpaint.colour import ViewTransform
from lightpaint.errors import PaintError
from lightpaint.lighting import LiveView
from lightpaint.paint.layers import layer_pixels
from lightpaint.paint.layers.composed_layers import Change, ComposedLayers
from lightpaint.paint.layers.composition import (
    MAX_LIGHT,
    AlbedoSource,
    adjusted,
    compose_layer,
    effect_of,
    gradient_pixels,
)
from lightpaint.paint.layers.layer_stack import Layer, LayerStack
from lightpaint.paint.store.history_steps import Patch, Pixels, Region, Step, slices
from lightpaint.paint.store.session_file import StoredComposition
from lightpaint.target import Target

#: Side, in pixels, of the squares that are saved when a stroke first touches them.
SQUARE_SIDE = 64

#: Largest importance, and largest light, that a page may paint.
MAX_IMPORTANCE, MAX_PAINTED_LIGHT = 1e4, 1e9

_Array = npt.NDArray[np.float32]


class OpenStroke:
    """The pixels under a stroke, saved once however often it passes. Updated in place.

    Attributes:
        region: The smallest that holds the whole stroke.
    """

    def __init__(self) -> None:
        self.region: Region = (0, 0, 0, 0)
        self._before: dict[Region, Pixels | None] = {}  # None for no coverage

    def __bool__(self) -> bool:
        """Return whether the stroke has touched anything."""
        return bool(self._before)

    def touch(self, region: Region, layer: layer_pixels.LayerPixels) -> None:
        """Save the pixels of a region of a layer, which is about to change there."""
        if layer_pixels.is_empty(region):
            return
        for square in _squares(region, layer.size):
            if square not in self._before:
                self._before[square] = None if layer.is_empty_in(square) else layer.part(square)
        self.region = layer_pixels.enclosing([self.region, region])

    def pixels_before(self, layer: layer_pixels.LayerPixels) -> Pixels:
        """Return the pixels in `region` before the stroke. layer: the current one."""
        before = layer.part(self.region)
        marks = before.at_least
        saved_marks = [pixels.at_least for pixels in self._before.values() if pixels is not None]
        if marks is None and any(x is not None for x in saved_marks):
            marks = np.zeros(before.image.shape, bool)
        for square, pixels in self._before.items():
            area = layer_pixels.shared(square, self.region)
            to = slices(layer_pixels.relative(area, self.region))
            saved = None if pixels is None else pixels.part(layer_pixels.relative(area, square))
            before.image[to] = 0 if saved is None else saved.image
            before.importance[to] = 0 if saved is None else saved.importance
            if marks is not None:
                marks[to] = False if saved is None or saved.at_least is None else saved.at_least
        has_marks = marks is not None and marks.any()
        return before._replace(at_least=marks if has_marks else None)


def _squares(region: Region, size: tuple[int, ...]) -> Iterator[Region]:
    """Yield the squares of a fixed grid that a region touches, within the picture."""
    top, bottom, left, right = region
    for y in range(top - top % SQUARE_SIDE, bottom, SQUARE_SIDE):
        for x in range(left - left % SQUARE_SIDE, right, SQUARE_SIDE):
            yield y, min(y + SQUARE_SIDE, size[0]), x, min(x + SQUARE_SIDE, size[1])


class Canvas:
    """The painting of one view: its layers, and the target composed of them. Updated in place.

    Attributes:
        basis: The planes of its lights.
        live: The sums that follow the target.
        selection: The mask that strokes keep to; without coverage there is none.
    """

    def __init__(
        self,
        view: int,
        basis: Basis,
        current: Floats,
        layers: LayerStack,
        steps: Sequence[Step],
        stored: StoredComposition | None = None,
    ) -> None:
        """Open the painting of a view after some steps.

        layers, stored: as for `ComposedLayers`.
        """
        self.view, self.basis = view, basis
        self._open_strokes: dict[int, OpenStroke] = {}
        self._restore(current, layers, steps, stored)

    def _restore(
        self,
        current: Floats,
        layers: LayerStack,
        steps: Sequence[Step],
        stored: StoredComposition | None = None,
    ) -> None:
        masks = [
            patch
            for step in steps
            for patch in step.patches
            if patch.layer == layer_pixels.SELECTION_ID and patch.view == self.view
        ]
        self.selection = layer_pixels.LayerPixels.replayed(self.basis.size, masks)
        albedo = _albedo_source(self.basis)
        self._layers = ComposedLayers(self.view, current, layers, steps, stored, albedo)
        self.live = self._live_view()

    def _live_view(self) -> LiveView:
        """Return the sums that follow the target."""
        return LiveView(
            self.basis,
            self.image,
            self.importance,
            self._layers.loaded_wishes,
            lambda: self.painting.at_least,
        )

    def improve(self, basis: Basis, current: Floats) -> None:
        """Replace the basis by one of more samples; open strokes stay open."""
        self.basis = basis
        self._layers.replace_current(current, _albedo_source(basis))
        self.live = self._live_view()

    def rebuild(self, layers: LayerStack, steps: Sequence[Step]) -> None:
        """Continue with the layers after these steps; open strokes are dropped."""
        self.close()
        self._restore(self.current, layers, steps)

    def replace_lights(self, basis: Basis) -> None:
        """Continue with a basis of other lights."""
        self.basis = basis
        self.live = self._live_view()

    def replace_planes(self, basis: Basis, lights: Collection[int]) -> None:
        """Continue with a basis in which the planes of some lights, by number, were replaced.

        The current look stays as it was before these lights moved.
        """
        self.basis = basis
        self.live.replace_planes(basis, lights)

    @property
    def current(self) -> Floats:
        """(h, w, 3) linear, the current look, denoised: it shows where nothing is painted."""
        return self._layers.current

    @property
    def albedo(self) -> Floats | None:
        """(h, w, 3), the albedo of the surfaces, as pages have it; None where it is unknown."""
        return self._layers.albedo()

    @property
    def painting(self) -> Pixels:
        """The target; `at_least` is None while no pixel is marked."""
        return self._layers.target

    @property
    def image(self) -> npt.NDArray[np.float32]:
        """(h, w, 3) linear; where nothing is painted, the current look."""
        return self.painting.image

    @property
    def importance(self) -> npt.NDArray[np.float32]:
        """(h, w), above 0 where something is painted."""
        return self.painting.importance

    @property
    def name(self) -> str:
        """Name of its sensor."""
        return self.basis.origin.sensor

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the picture."""
        return self.basis.size

    @property
    def full_region(self) -> Region:
        """Region of the whole picture."""
        return (0, self.size[0], 0, self.size[1])

    @property
    def is_painted(self) -> bool:
        """True if any pixel counts."""
        return bool(self.importance.any())

    @property
    def is_open(self) -> bool:
        """True while a stroke is open."""
        return any(self._open_strokes.values())

    def layer(self, number: int) -> layer_pixels.LayerPixels:
        """Return the pixels of a layer. Raises PaintError if there is none."""
        return self._layers.layer(number)

    def accent(self, number: int) -> float:
        """Return the accent of a layer, by which its paint counts more; 1 for a hidden one."""
        return self._layers.accent(number)

    def composition(self) -> StoredComposition:
        """Return a copy of the target, and what is known of the layers without their pixels."""
        return self._layers.composition()

    def pixels(self, region: Region) -> Pixels:
        """Return a copy of the pixels of a region."""
        return self.painting.part(region).copy()

    def target(self, name: str, transform: ViewTransform, *, is_sketch: bool) -> Target | None:
        """Return a copy of the painting as a target; None if nothing is painted.

        Solved elsewhere it has the same answer: a literal painting is light, painted over nothing.
        """
        if not self.is_painted:
            return None
        image, importance, at_least = self.pixels(self.full_region)
        return Target(
            name,
            image,
            importance,
            everything=False,
            at_least=at_least,
            transform=transform,
            through_view=is_sketch,
            over_look=is_sketch,
            wishes=self._layers.wishes(),
        )

    def put(self, layer: int, region: Region, pixels: Pixels) -> None:
        """Put pixels into a layer."""
        self._follow(self._layers.put(layer, region, pixels))

    def paint(self, layer: int, region: Region, pixels: Pixels) -> None:
        """Paint pixels by hand: they belong to the open stroke on that layer."""
        stroke = self._open_strokes.setdefault(layer, OpenStroke())
        target = self.layer(layer)
        stroke.touch(region, target)
        self.put(layer, region, _with_marks(pixels, target.part(region)))

    def show(
        self, layers: LayerStack, steps: Sequence[Step] = (), *, at_rest: bool = True
    ) -> Region:
        """Show other layers, or layers with other properties; return the region that changed.

        steps: steps after which to take the pixels of layers that come back. at_rest: whether to
        update accents to what the layers cover now; under the brush they stay.
        """
        change = self._layers.show(layers, steps, at_rest=at_rest)
        self._follow(change)
        return change.region

    def _follow(self, change: Change) -> None:
        """Update the sums after a change of the target."""
        if not layer_pixels.is_empty(change.region):
            area = slices(change.region)
            self.live.update(area, with_importance=change.with_importance)

    def drop(self) -> Region:
        """Drop the open strokes, and return their region."""
        for number, stroke in self._open_strokes.items():
            self.put(number, stroke.region, stroke.pixels_before(self.layer(number)))
        region = layer_pixels.enclosing([stroke.region for stroke in self._open_strokes.values()])
        self.close()
        return region

    def stroke_patches(self) -> list[Patch]:
        """Return the changes of the open strokes; strokes that changed nothing have none."""
        patches = []
        for number, stroke in self._open_strokes.items():
            layer = self.layer(number)
            region, before = stroke.region, stroke.pixels_before(layer)
            after = layer.part(region)
            if before.at_least is not None:
                # A stroke may take pixels back while it lasts: unchanged ones keep their marks.
                after = _with_marks(after, before)
                self.put(number, region, after)
            # A page that lost the answer to a stroke sends it again, which changes nothing.
            if not layer_pixels.is_empty(region) and not before.equals(after):
                patches.append(Patch(region, before, after, self.view, number))
        return patches

    def close(self) -> None:
        """Close the open strokes."""
        self._open_strokes = {}

    def check_pixels(
        self, layer: Layer, region: Region, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> Pixels:
        """Return the pixels that a page sent for a region of a layer. Raises PaintError if invalid.

        Pixels of a mask have no colour, and their `importance` is its coverage.
        """
        top, bottom, left, right = region
        height, width = self.size
        if not (0 <= top <= bottom <= height and 0 <= left <= right <= width):
            raise PaintError(f"paint at {list(region)}, and the picture is {width}x{height}")
        shape = bottom - top, right - left
        if layer.is_mask:
            arrays = {**arrays, "image": np.broadcast_to(np.float32(0), (*shape, 3))}
        try:
            image, importance = arrays["image"], arrays["importance"]
        except KeyError:
            raise PaintError("paint without its image and importance") from None
        if image.shape != (*shape, 3) or importance.shape != shape:
            raise PaintError(
                f"paint of {list(image.shape)} and {list(importance.shape)} at {list(region)}"
            )
        if not (np.isfinite(image).all() and np.isfinite(importance).all()):
            raise PaintError("paint of NaN or Inf")
        most = MAX_IMPORTANCE if layer.kind == "pixels" else 1.0
        if importance.size and not (importance.min() >= 0 and importance.max() <= most):
            what = "importance" if layer.kind == "pixels" else "coverage"
            raise PaintError(f"{what} beyond 0 to {most:g}")
        if image.size and not (image.min() >= 0 and image.max() <= MAX_PAINTED_LIGHT):
            # A target set in a notebook may hold such light, and a stroke beside it resends it.
            beyond = (image < 0) | (image > MAX_PAINTED_LIGHT)
            if not np.array_equal(image[beyond], self.layer(layer.id).part(region).image[beyond]):
                raise PaintError(f"light beyond 0 to {MAX_PAINTED_LIGHT:g}")
        return Pixels(image.astype(np.float32), importance.astype(np.float32))


def _albedo_source(basis: Basis) -> AlbedoSource:
    """Return what gives the albedo of a view, rounded to halves as pages have it, when asked."""

    @cache
    def albedo() -> Floats | None:
        features = basis.features
        return None if features is None else as_halves(features.albedo).astype(np.float32)

    return albedo


def _with_marks(pixels: Pixels, before: Pixels) -> Pixels:
    """Return `pixels`, marked "at least" where they equal pixels of `before` that are."""
    if before.at_least is None:
        return pixels
    left_alone = (pixels.image == before.image).all(axis=-1) & (pixels.importance > 0)
    return pixels._replace(at_least=before.at_least & left_alone[..., None])


@dataclass(frozen=True, eq=False)
class LayerPicture:
    """A layer as a program shows it that only lays pictures over each other.

    layer: the layer, also of a group, which has no pixels. effect: what it does, a gradient as
    paint or as an adjustment, with the strength and importance of its group. region: the part of
    the view that it covers. pixels: its own pixels there. light: (rows, columns, 3) linear, what it
    shows where it covers fully, over the visible layers below. coverage: (rows, columns), 0 to 1.
    opacity: the rest of its strength, up to 1, that `light` does not include.
    """

    layer: Layer
    effect: Layer
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
    pixels: Mapping[int, layer_pixels.LayerPixels]
    current: Floats
    albedo: Floats | None = None

    @classmethod
    def of(cls, canvas: Canvas, layers: LayerStack) -> "ViewLayers":
        """Return a copy of the layers of a canvas, which shares the memory of their pixels."""
        pixels = {
            number: canvas.layer(number).copy()
            for number in layers.ids
            if not layer_pixels.is_empty(canvas.layer(number).bounds)
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
            own = self.pixels.get(layer.id, layer_pixels.LayerPixels(self.size))
            region = layer_pixels.shared(own.bounds, part)
            region = (top, top, 0, 0) if layer_pixels.is_empty(region) else region
            pixels = own.part(region)
            group = groups.get(layer.id if layer.group is None else layer.group)
            effect, is_shown = effect_of(layer), layer.is_visible
            if group is not None and group is not layer:
                effect = effect.within(group)
                is_shown &= group.is_visible
            inner = layer_pixels.relative(region, part)
            shown, area = pixels, below.part(inner)
            if layer.gradient is not None:
                shown = gradient_pixels(layer.gradient, pixels.importance, region, self.albedo)
            light, coverage, opacity = _appearance(effect, shown, area.image)
            yield LayerPicture(layer, effect, region, pixels, light, coverage, opacity)
            if is_shown and effect.strength > 0 and not layer_pixels.is_empty(region):
                below.image[slices(inner)] = compose_layer(effect, shown, area).image


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
