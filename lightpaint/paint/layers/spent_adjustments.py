"""Adjustments that the lamps already answer: a solve that starts from these lamps hides them.

An adjustment changes the light that lies below it. Once the answer to it is the look under the
painting, it would ask for the same change again. Where paint of its own light lies below an
adjustment, it changes that paint and no look, so there it stays, as a copy.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.composition import effect_of, with_effect
from lightpaint.paint.layers.layer_pixels import is_empty
from lightpaint.paint.layers.layer_stack import Layer, LayerStack
from lightpaint.paint.store.history_steps import Patch, Pixels, Region


@dataclass(frozen=True)
class SpentAdjustments:
    """The layers of a session without its adjustments.

    layers: the stack. patches: that create the copies. copies: by id of a hidden layer or group,
    the id of its copy; None without one.
    """

    layers: LayerStack
    patches: tuple[Patch, ...] = ()
    copies: Mapping[int, int | None] = field(default_factory=dict)

    @classmethod
    def of(cls, views: Canvases) -> "SpentAdjustments":
        """Hide the adjustments of some views; they stay where they change paint below them."""
        stack, next_id = views.layers, views.next_layer
        patches: list[Patch] = []
        copies: dict[int, int | None] = {}
        ordered: list[Layer] = []
        paint: list[Layer] = []
        for layer in stack:
            ordered.append(layer)
            if not _is_shown(layer, stack):
                continue
            kind = effect_of(layer).kind
            if kind in ("pixels", "paint"):
                paint.append(layer)
            if kind != "adjust":
                continue
            found = [x for view in views if (x := _patch_over_paint(layer, next_id, view, paint))]
            ordered[-1] = replace(layer, is_visible=False)
            copies[layer.id] = next_id if found else None
            if found:
                ordered.append(replace(layer, id=next_id))
                next_id += 1
                patches += found
        return cls(LayerStack.of(ordered), tuple(patches), copies)._by_groups()

    def _by_groups(self) -> "SpentAdjustments":
        """Return the same with a group hidden in place of its layers, where all of them are."""
        layers, copies = self.layers, dict(self.copies)
        for group in layers:
            inner = [x for x in layers if x.group == group.id]
            if inner and all(x.id in copies and copies[x.id] is None for x in inner):
                shown = [replace(x, is_visible=True) for x in inner]
                layers = layers.with_layers([*shown, replace(group, is_visible=False)])
                copies = {k: x for k, x in copies.items() if k not in {x.id for x in inner}}
                copies[group.id] = None
        return SpentAdjustments(layers, self.patches, copies)


def without_copies(layers: LayerStack, copies: Mapping[int, int | None]) -> LayerStack:
    """Return a stack in which hidden adjustments are visible again, and their copies are gone.

    copies: see `SpentAdjustments`.
    """
    gone = set(copies.values())
    shown = (replace(x, is_visible=True) if x.id in copies else x for x in layers)
    return LayerStack.of(x for x in shown if x.id not in gone)


def _is_shown(layer: Layer, stack: LayerStack) -> bool:
    group = None if layer.group is None else stack[layer.group]
    return layer.is_visible and (group is None or group.is_visible)


def _patch_over_paint(
    layer: Layer, copy_id: int, view: Canvas, paint: Sequence[Layer]
) -> Patch | None:
    """Return the patch with the mask of an adjustment where some layers of paint lie below it."""
    region = view.layer(layer.id).bounds
    if is_empty(region):
        return None
    mask = view.layer(layer.id).part(region)
    over_paint = mask.importance * _coverage(paint, view, region)
    if not over_paint.any():
        return None
    nothing = Pixels.unpainted(np.zeros((*over_paint.shape, 3), np.float32))
    return Patch(region, nothing, Pixels(mask.image, over_paint), view.view, copy_id)


def _coverage(layers: Sequence[Layer], view: Canvas, region: Region) -> npt.NDArray[np.float32]:
    """Return the part of each pixel of a region that layers of paint cover, 0 to 1."""
    top, bottom, left, right = region
    open_part = np.ones((bottom - top, right - left), np.float32)
    for layer in layers:
        _, pixels = with_effect(layer, view.layer(layer.id), lambda: view.albedo)
        strength = np.float32(min(layer.strength, 1))
        open_part *= 1 - np.clip(strength * pixels.coverage(region), 0, 1)
    return np.float32(1) - open_part
