"""Presets on the views of a session: the masks of their layers, and what they ask for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import PaintError
from lightpaint.images.object_map import Objects
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.composition import compose_layer
from lightpaint.paint.layers.layer import MAX_NAME_LENGTH, Layer
from lightpaint.paint.layers.selection import FULL, selection_mask
from lightpaint.paint.presets.presets import LightingPreset, find_preset, layers_of
from lightpaint.paint.presets.view_areas import Mask, ViewAreas
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices

#: Steps of coverage in a mask, which are not seen, and which a session file packs well.
MASK_STEPS = 256


def preset_masks(preset: LightingPreset, canvas: Canvas, subject: str | None) -> list[Mask]:
    """Return the mask (h, w) of each of a preset's layers in a view, within its selection.

    subject: name of the object that it is about; None to take the most central one.
    """
    basis = canvas.basis
    areas = ViewAreas(canvas.current, basis.emitters_seen, basis.features, basis.objects, subject)
    selected = selected_mask(canvas)
    return [adjustment.mask(areas) * selected for adjustment in preset.adjustments]


def check_subject(canvases: Sequence[Canvas], subject: str | None) -> None:
    """Raise PaintError for an object that no view sees."""
    if subject is None:
        return
    for canvas in canvases:
        objects = canvas.basis.objects
        if objects is not None and subject in objects.names:
            return
    raise PaintError(f"no view sees an object called {subject!r:.40}")


def open_preset(canvases: Canvases, name: str, subject: str | None) -> list[tuple[int, Region]]:
    """Put the layers of the preset of a name on top, as an open change; return what changes.

    subject: name of the object that it is about; None to take the most central one. Raises
    PaintError for an unknown preset, and for an object that no view sees.
    """
    preset = find_preset(name)
    check_subject(list(canvases), subject)
    title = preset.title if subject is None else f"{preset.title}: {subject}"
    layers = layers_of(preset, canvases.next_layer, title[:MAX_NAME_LENGTH])
    masks = {k: preset_masks(preset, canvas, subject) for k, canvas in enumerate(canvases)}
    return open_group(canvases, layers, masks)


def open_group(
    canvases: Canvases, layers: Sequence[Layer], masks: Mapping[int, Sequence[Mask]]
) -> list[tuple[int, Region]]:
    """Put layers and their group, the last, on top, as an open change; return what changes.

    masks: of each layer but the group, by view.
    """
    # Hidden until all have their masks, so that they are composed once.
    hidden = [replace(layer, is_visible=layer.kind == "group") for layer in layers]
    canvases.open_layers(canvases.layers.with_layers(hidden))
    for view, masks_of_view in masks.items():
        for layer, mask in zip(layers[:-1], masks_of_view, strict=True):
            no_colour = np.broadcast_to(np.float32(0), (*mask.shape, 3))
            region = canvases[view].full_region
            stepped = np.round(mask * MASK_STEPS) / np.float32(MASK_STEPS)
            canvases.paint(view, layer.id, region, Pixels(no_colour, stepped.astype(np.float32)))
    canvases.open_layers(canvases.layers.with_layers(layers))
    return [(view, canvases[view].full_region) for view in masks]


def selected_mask(canvas: Canvas) -> Mask | np.float32:
    """Return the mask of what is selected in a view; 1 if nothing is."""
    bounds = canvas.selection.bounds
    mask = selection_mask(canvas.selection)
    if not mask.any():
        return np.float32(1)
    selected = np.zeros(canvas.size, np.float32)
    selected[slices(bounds)] = mask / np.float32(FULL)
    return selected


def reduced_areas(
    canvas: Canvas, light: Floats, side: int, subject: str | None = None
) -> tuple[Floats, ViewAreas]:
    """Return a picture of a view, (h, w, 3), reduced, and its areas.

    side: approximate pixels of its longer side.
    """
    factor = max(1, round(max(canvas.size) / side))
    basis = canvas.basis
    look = np.asarray(block_mean(light, factor), np.float32)
    height, width = look.shape[:2]
    sample = slice(0, factor * height, factor), slice(0, factor * width, factor)
    features, objects = basis.features, basis.objects
    return look, ViewAreas(
        look,
        basis.emitters_seen[sample],
        None if features is None else features.reduced(factor),
        None if objects is None else Objects(objects.index[sample], objects.names),
        subject,
    )


def requested_look(preset: LightingPreset, canvas: Canvas, side: int) -> Floats:
    """Return what a preset asks of the current look of a view, (h, w, 3) linear, reduced.

    side: approximate pixels of its longer side.
    """
    look, areas = reduced_areas(canvas, canvas.current, side)
    pixels = Pixels.unpainted(look)
    for layer, adjustment in zip(layers_of(preset, 1, "")[:-1], preset.adjustments, strict=True):
        mask = Pixels(np.zeros_like(look), adjustment.mask(areas))
        pixels = compose_layer(layer, mask, pixels)
    return pixels.image
