"""Layers with their pixels in every view, independent of a session, for looks and files."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_pixels import LayerPixels, enclosing, is_empty
from lightpaint.paint.layers.layer_stack import PAINTING_ID, Layer, LayerStack
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.history_steps import Patch, name_in_view


@dataclass(frozen=True, eq=False)
class LayeredPaintings:
    """A stack of layers, and the pixels of each by view and id, in its region.

    view: index of the view on whose layers they are to lie, if they are of one view; None to
    replace all layers. source: digest of the file that they are from; "" for none.
    """

    layers: LayerStack
    pixels: Mapping[tuple[int, int], tuple[Region, Pixels]]
    view: int | None = None
    source: str = ""

    @classmethod
    def of(cls, views: Canvases) -> "LayeredPaintings":
        """Return the layered paintings of a session."""
        pixels = {}
        for view in views:
            for number in views.layers.ids:
                layer = view.layer(number)
                if not is_empty(bounds := layer.bounds):
                    pixels[view.view, number] = bounds, layer.part(bounds)
        return cls(views.layers, pixels)

    def patches(self, views: Canvases) -> tuple[LayerStack, tuple[Patch, ...]]:
        """Return the layers under new ids in `views`, and the patches that create them."""
        if self.view is not None:
            return self._patches_on_top(views, self.view)
        stack, ids = self.layers, {PAINTING_ID: PAINTING_ID}
        for layer in stack:
            ids.setdefault(layer.id, views.next_layer - 1 + len(ids))
        renamed = [
            replace(x, id=ids[x.id], group=None if x.group is None else ids[x.group]) for x in stack
        ]
        patches = []
        for (view, number), (region, pixels) in self.pixels.items():
            if number != PAINTING_ID and view < len(views):
                patches.append(Patch(region, _no_pixels(pixels), pixels, view, ids[number]))
        for canvas in views:
            # The layer of paint without an id exists already, with other pixels.
            painting, after = canvas.layer(PAINTING_ID), LayerPixels(canvas.size)
            if (canvas.view, PAINTING_ID) in self.pixels:
                after.put(*self.pixels[canvas.view, PAINTING_ID])
            bounds = enclosing([painting.bounds, after.bounds])
            if not is_empty(bounds):
                before, then = painting.part(bounds), after.part(bounds)
                patches.append(Patch(bounds, before, then, canvas.view))
        return LayerStack.of(renamed), tuple(patches)

    def _patches_on_top(self, views: Canvases, view: int) -> tuple[LayerStack, tuple[Patch, ...]]:
        """Return all layers of `views` with these on top, and the patches that create them."""
        numbers = {number for _, number in self.pixels}
        added = [x for x in self.layers if x.id != PAINTING_ID or x.id in numbers]
        ids = {layer.id: views.next_layer + k for k, layer in enumerate(added)}
        renamed = [
            replace(x, id=ids[x.id], group=None if x.group is None else ids[x.group]) for x in added
        ]
        patches = [
            Patch(region, _no_pixels(pixels), pixels, view, ids[number])
            for (_, number), (region, pixels) in self.pixels.items()
        ]
        return LayerStack.of([*views.layers, *renamed]), tuple(patches)

    def as_fields(self) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
        """Return JSON and arrays, which `from_fields` reads."""
        regions = {
            name_in_view(str(n), view): list(at) for (view, n), (at, _) in self.pixels.items()
        }
        arrays: dict[str, npt.NDArray[Any]] = {}
        for (view, number), (_, pixels) in self.pixels.items():
            image, coverage, marks = pixels
            arrays[name_in_view(f"layer/{number}", view)] = np.concatenate(
                [image, coverage[..., None]], axis=-1
            )
            if marks is not None:
                arrays[name_in_view(f"layer_marks/{number}", view)] = marks.view(np.uint8)
        return {"stack": [x.as_json() for x in self.layers], "regions": regions}, arrays

    @classmethod
    def from_fields(
        cls, fields: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]
    ) -> "LayeredPaintings":
        """Return what `as_fields` wrote. Raises PaintError for something else."""
        try:
            layers = LayerStack.of(Layer.of(data) for data in fields["stack"])
            pixels, names = {}, set(arrays)
            for key, region in fields["regions"].items():
                number, _, view = key.partition("@")
                top, bottom, left, right = map(int, region)
                data = np.asarray(arrays[f"layer/{key}"])
                marks = f"layer_marks/{key}"
                pixels[int(view or 0), int(number)] = (
                    (top, bottom, left, right),
                    Pixels(
                        np.ascontiguousarray(data[..., :3]),
                        np.ascontiguousarray(data[..., 3]),
                        arrays[marks] > 0 if marks in names else None,
                    ),
                )
        except (LookupError, TypeError, ValueError) as error:
            raise PaintError(f"damaged layers: {error}") from None
        return cls(layers, pixels)


def _no_pixels(pixels: Pixels) -> Pixels:
    """Return pixels of the same size without coverage."""
    return Pixels.unpainted(np.zeros((*pixels.importance.shape, 3), np.float32))
