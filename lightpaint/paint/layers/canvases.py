"""The paintings of all views, which share one stack of layers; their layers as data, for looks."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.errors import PaintError
from lightpaint.lighting import LiveView
from lightpaint.paint.layers import layer_pixels, layer_stack
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.store.history_steps import Patch, Pixels, Region, Step, name_in_view
from lightpaint.paint.store.session_file import StoredComposition


class Canvases:
    """The canvases of all views, which share one stack of layers.

    A stroke changes one view, a look all of them.

    Attributes:
        layers: The current layers.
        next_layer: The first id that no layer has had.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        current_looks: Sequence[Floats],
        steps: Sequence[Step],
        stored: Sequence[StoredComposition] | None = None,
    ) -> None:
        """Open the canvases after some steps. stored: their compositions, if they are known."""
        self.layers = self._layers_at_rest = layer_stack.stack_after(steps)
        self.next_layer = layer_stack.next_layer_id(steps)
        self._canvases = tuple(
            Canvas(k, basis, current, self.layers, steps, stored[k] if stored else None)
            for k, (basis, current) in enumerate(zip(bases, current_looks, strict=True))
        )

    def __len__(self) -> int:
        return len(self._canvases)

    def __iter__(self) -> Iterator[Canvas]:
        return iter(self._canvases)

    def __getitem__(self, view: int) -> Canvas:
        """Return the canvas of a view. Raises PaintError if there is none."""
        if not 0 <= view < len(self):
            raise PaintError(f"no view {view}: there are {len(self)}")
        return self._canvases[view]

    def improve(self, bases: Sequence[Basis], current_looks: Sequence[Floats]) -> None:
        """Improve each canvas."""
        for view, basis, current in zip(self, bases, current_looks, strict=True):
            view.improve(basis, current)

    def rebuild(self, steps: Sequence[Step]) -> None:
        """Continue with the layers and pixels after these steps; what is open is dropped."""
        self.layers = self._layers_at_rest = layer_stack.stack_after(steps)
        for view in self:
            view.rebuild(self.layers, steps)

    def replace_lights(self, bases: Sequence[Basis]) -> None:
        """Continue with bases of other lights."""
        for view, basis in zip(self, bases, strict=True):
            view.replace_lights(basis)

    def replace_planes(self, bases: Sequence[Basis], lights: Collection[int]) -> None:
        """Continue with bases in which the planes of some lights, by number, were replaced."""
        for view, basis in zip(self, bases, strict=True):
            view.replace_planes(basis, lights)

    @property
    def live(self) -> list[LiveView]:
        """Live sums of each view."""
        return [view.live for view in self]

    @property
    def is_painted(self) -> bool:
        """True if any pixel counts."""
        return any(view.is_painted for view in self)

    @property
    def is_open(self) -> bool:
        """True while a stroke, or a change of the layers, is open."""
        return self.layers != self._layers_at_rest or any(view.is_open for view in self)

    def open_layers(self, layers: layer_stack.LayerStack) -> None:
        """Show other layers until the change is closed or dropped. Raises PaintError for an id
        that another layer had.
        """
        if used := [n for n in layers.ids if n not in self.layers.ids and n < self.next_layer]:
            raise PaintError(f"layer {used[0]} was another one: the next is {self.next_layer}")
        if layers == self.layers:
            return
        self.layers = layers
        self.next_layer = max(self.next_layer, 1 + max(layers.ids))
        for view in self:
            view.show(layers, at_rest=False)

    def paint(self, view: int, layer: int, region: Region, pixels: Pixels) -> None:
        """Paint pixels of a layer by hand: they belong to the open stroke on it."""
        canvas = self[view]
        canvas.paint(layer, region, pixels)
        if layer not in self._layers_at_rest.ids:  # its accent follows its coverage
            canvas.show(self.layers)

    def copy_layer(self, source: int, number: int) -> None:
        """Copy the pixels of a layer into a new one that is shown already: open strokes."""
        for view in self:
            pixels = view.layer(source)
            if not layer_pixels.is_empty(pixels.bounds):
                view.paint(number, pixels.bounds, pixels.part(pixels.bounds))

    def clear_painting(self) -> None:
        """Clear the painting that names no layer, which is always there: open strokes."""
        for view in self:
            top, bottom, left, right = bounds = view.layer(layer_stack.PAINTING.id).bounds
            if not layer_pixels.is_empty(bounds):
                empty = Pixels.unpainted(np.zeros((bottom - top, right - left, 3), np.float32))
                view.paint(layer_stack.PAINTING.id, bounds, empty)

    def open_change(self) -> tuple[layer_stack.StackChange, tuple[Patch, ...]]:
        """Return the open change of the layers, and the changes of open strokes on them."""
        patches = tuple(patch for view in self for patch in view.stroke_patches())
        kept = tuple(patch for patch in patches if patch.layer in self.layers.ids)
        return self._layers_at_rest.change_to(self.layers), kept

    def close(self) -> None:
        """Close the open strokes and the open change; update accents to what layers cover now."""
        for view in self:
            view.close()
        self._layers_at_rest = self.layers
        for view in self:
            view.show(self.layers)

    def drop(self) -> list[tuple[int, Region]]:
        """Drop open strokes and changes; return the views and regions that changed."""
        regions = [view.drop() for view in self]
        self.layers = self._layers_at_rest
        shown = [view.show(self.layers) for view in self]
        both = [layer_pixels.enclosing(pair) for pair in zip(regions, shown, strict=True)]
        return [(k, region) for k, region in enumerate(both) if not layer_pixels.is_empty(region)]

    def move(
        self,
        layers: layer_stack.LayerStack,
        patches: Sequence[Patch],
        steps: Sequence[Step],
        *,
        is_back: bool = False,
    ) -> list[tuple[int, Region]]:
        """Go to the layers and pixels after a step, or before it; return the regions that changed.

        steps: the steps done at that point, from which returning layers get their pixels.
        """
        for patch in patches:
            if patch.layer == layer_pixels.SELECTION_ID:
                layer_pixels.put_selection(self[patch.view].selection, patch, is_back=is_back)
            elif patch.layer in self.layers.ids:
                pixels = patch.before if is_back else patch.after
                self[patch.view].put(patch.layer, patch.region, pixels)
        self.layers = self._layers_at_rest = layers
        self.next_layer = max(self.next_layer, 1 + max(layers.ids))
        regions = []
        for view in self:
            put = [
                patch.region
                for patch in patches
                if patch.view == view.view and patch.layer != layer_pixels.SELECTION_ID
            ]
            region = layer_pixels.enclosing([view.show(layers, steps), *put])
            if not layer_pixels.is_empty(region):
                regions.append((view.view, region))
        return regions

    def repeat(self, further: Sequence[Step], steps: Sequence[Step]) -> None:
        """Go to the state after further steps. steps: all until then."""
        self.move(
            layer_stack.stack_after(steps), [x for step in further for x in step.patches], steps
        )
        self.next_layer = layer_stack.next_layer_id(steps)

    def replacement_patches(self, paintings: Mapping[int, Pixels]) -> tuple[Patch, ...]:
        """Return the patches that replace all layers by these paintings, by view.

        A view without one keeps the composition of its layers.
        """
        patches, whole = [], dict(paintings)
        if self.layers != layer_stack.LayerStack():
            whole = {k: view.pixels(view.full_region) for k, view in enumerate(self)} | whole
        for k, (image, importance, at_least) in whole.items():
            view = self[k]
            light, counts = np.asarray(image, np.float32), np.asarray(importance, np.float32)
            pixels = Pixels(light, counts, at_least).copy()
            before = view.layer(layer_stack.PAINTING.id).part(view.full_region)
            patches.append(Patch(view.full_region, before, pixels, k))
        return tuple(patches)


@dataclass(frozen=True, eq=False)
class LayeredPaintings:
    """A stack of layers, and the pixels of each by view and id, in its region.

    view: index of the view on whose layers they are to lie, if they are of one view; None to
    replace all layers. source: digest of the file that they are from; "" for none.
    """

    layers: layer_stack.LayerStack
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
                if not layer_pixels.is_empty(bounds := layer.bounds):
                    pixels[view.view, number] = bounds, layer.part(bounds)
        return cls(views.layers, pixels)

    def new_ids(self, views: Canvases) -> dict[int, int]:
        """Return the ids in `views` of the layers that replace all others, by their own."""
        ids = {layer_stack.PAINTING_ID: layer_stack.PAINTING_ID}
        for layer in self.layers:
            ids.setdefault(layer.id, views.next_layer - 1 + len(ids))
        return ids

    def patches(self, views: Canvases) -> tuple[layer_stack.LayerStack, tuple[Patch, ...]]:
        """Return the layers under new ids in `views`, and the patches that create them."""
        if self.view is not None:
            return self._patches_on_top(views, self.view)
        stack, ids = self.layers, self.new_ids(views)
        renamed = [
            replace(x, id=ids[x.id], group=None if x.group is None else ids[x.group]) for x in stack
        ]
        patches = []
        for (view, number), (region, pixels) in self.pixels.items():
            if number != layer_stack.PAINTING_ID and view < len(views):
                patches.append(Patch(region, _no_pixels(pixels), pixels, view, ids[number]))
        for canvas in views:
            # The layer of paint without an id exists already, with other pixels.
            painting, after = (
                canvas.layer(layer_stack.PAINTING_ID),
                layer_pixels.LayerPixels(canvas.size),
            )
            if (canvas.view, layer_stack.PAINTING_ID) in self.pixels:
                after.put(*self.pixels[canvas.view, layer_stack.PAINTING_ID])
            bounds = layer_pixels.enclosing([painting.bounds, after.bounds])
            if not layer_pixels.is_empty(bounds):
                before, then = painting.part(bounds), after.part(bounds)
                patches.append(Patch(bounds, before, then, canvas.view))
        return layer_stack.LayerStack.of(renamed), tuple(patches)

    def _patches_on_top(
        self, views: Canvases, view: int
    ) -> tuple[layer_stack.LayerStack, tuple[Patch, ...]]:
        """Return all layers of `views` with these on top, and the patches that create them."""
        numbers = {number for _, number in self.pixels}
        added = [x for x in self.layers if x.id != layer_stack.PAINTING_ID or x.id in numbers]
        ids = {layer.id: views.next_layer + k for k, layer in enumerate(added)}
        renamed = [
            replace(x, id=ids[x.id], group=None if x.group is None else ids[x.group]) for x in added
        ]
        patches = [
            Patch(region, _no_pixels(pixels), pixels, view, ids[number])
            for (_, number), (region, pixels) in self.pixels.items()
        ]
        return layer_stack.LayerStack.of([*views.layers, *renamed]), tuple(patches)

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
            layers = layer_stack.LayerStack.of(
                layer_stack.Layer.of(data) for data in fields["stack"]
            )
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
