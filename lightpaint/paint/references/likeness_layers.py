"""*Look like this* on the views of a session: layers that ask for the light of a reference."""

from collections.abc import Sequence

from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer import MAX_NAME_LENGTH, Layer
from lightpaint.paint.presets.preset_masks import (
    open_group,
    open_preset,
    reduced_areas,
    selected_mask,
)
from lightpaint.paint.presets.presets import PRESETS
from lightpaint.paint.presets.view_areas import Mask, ViewAreas
from lightpaint.paint.protocol import ApplyPreset, LookLike
from lightpaint.paint.references.likeness import (
    BAND_AREAS,
    CHANGED_RADIUS,
    PART_AREAS,
    SEEN_RADIUS,
    WHOLE_AREAS,
    LightArea,
    find_changes,
    spot_area,
)
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.references.tones import Tones
from lightpaint.paint.store.canvas_pixels import Region

#: Approximate pixels of the longer side of the picture in which changes are found.
FINDING_SIDE = 160


def open_request(
    canvases: Canvases, request: ApplyPreset | LookLike, references: ReferenceTable
) -> tuple[list[tuple[int, Region]], str]:
    """Put the layers that a request asks for on top, as an open change.

    Returns what changes, and the name of the step. Raises PaintError if it cannot be met.
    """
    if isinstance(request, ApplyPreset):
        changes = open_preset(canvases, request.preset, request.subject)
        return changes, PRESETS[request.preset].title
    reference = references[request.reference]
    name = f"Like {reference.name}"[:MAX_NAME_LENGTH]
    return _open_likeness(canvases, request, Tones(references.light(reference)), name), name


def _open_likeness(
    canvases: Canvases, request: LookLike, reference: Tones, name: str
) -> list[tuple[int, Region]]:
    """Put the group of layers of a name on top, which makes a picture look like a reference.

    The layers are found in one view. Those of pairs apply there, others in all views.
    """
    canvas = canvases[request.view]
    light, areas = reduced_areas(canvas, canvas.image, FINDING_SIDE)
    changes = find_changes(
        reference,
        light,
        areas,
        compared_areas(request),
        matches_brightness=request.matches_brightness,
        keeps_brightness=request.areas == "parts",
    )
    if not changes:
        raise PaintError(f"{name}: the picture has that light already")
    first = canvases.next_layer
    group = first + len(changes)
    layers = [change.layer(first + k, group) for k, change in enumerate(changes)]
    views = [request.view] if request.areas == "pairs" else range(len(canvases))
    masks = {k: _masks(canvases[k], [change.area for change in changes]) for k in views}
    return open_group(canvases, [*layers, Layer(group, "group", name)], masks)


def _masks(canvas: Canvas, areas: Sequence[LightArea]) -> list[Mask]:
    """Return the masks of areas in a view, within what is selected."""
    basis = canvas.basis
    found = ViewAreas(canvas.image, basis.emitters_seen, basis.features, basis.objects)
    selected = selected_mask(canvas)
    return [area.mask(found) * selected for area in areas]


def compared_areas(request: LookLike) -> Sequence[LightArea]:
    """Return the areas that a request compares, those of the lowest layers first.

    Raises PaintError for pairs without any.
    """
    if request.areas == "whole":
        return WHOLE_AREAS
    if request.areas == "regions":
        return (*WHOLE_AREAS, *BAND_AREAS)
    if request.areas == "parts":
        return (WHOLE_AREAS[0], *PART_AREAS)
    if not request.pairs:
        raise PaintError("no places to compare: press one in the reference, then in the picture")
    spots = [
        spot_area(f"Place {k + 1}", pair.reference, pair.picture, SEEN_RADIUS, CHANGED_RADIUS)
        for k, pair in enumerate(request.pairs)
    ]
    return [WHOLE_AREAS[0], *spots]
