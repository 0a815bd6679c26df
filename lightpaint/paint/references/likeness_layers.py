"""*Look like this* on the views of a session: layers that ask for the light of a reference."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from lightpaint.arrays import Floats
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_stack import MAX_NAME_LENGTH, Layer
from lightpaint.paint.presets.presets import (
    PRESETS,
    open_group,
    open_preset,
    reduced_areas,
    selected_mask,
)
from lightpaint.paint.presets.view_areas import Mask, ViewAreas
from lightpaint.paint.protocol import ApplyPreset, LookLike
from lightpaint.paint.references.likeness import (
    BAND_AREAS,
    CHANGED_RADIUS,
    PART_AREAS,
    SEEN_RADIUS,
    TONE_AREAS,
    WHOLE_AREA,
    AreaChange,
    LightArea,
    ViewPart,
    changed_light,
    find_changes,
    find_part,
    of_another_place,
    part_areas,
    spot_area,
)
from lightpaint.paint.references.reference_light import (
    FINDING_SIDE,
    LightLayers,
    distance_of,
    find_light,
    is_soft,
)
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.references.tones import Tones
from lightpaint.paint.store.history_steps import Region

#: Correlation of the edges of a reference and of a part of a view from which on they show one
#: place: parts of the shipped scenes under other lightings have .5 to .9, other places .47 at most.
SAME_PLACE = 0.5

#: Most stops by which tones and bands of the picture are made brighter or darker for a reference
#: of another place.
TONE_STOPS, BAND_STOPS = 1.0, 0.45


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
    return _open_likeness(canvases, request, Tones(references.light(reference)), name)


def _open_likeness(
    canvases: Canvases, request: LookLike, reference: Tones, name: str
) -> tuple[list[tuple[int, Region]], str]:
    """Put the group of layers on top which makes a picture look like a reference of a name.

    Returns what changes, and the name of the step, which says what was found. The layers are found
    in one view. Those of pairs apply there, others in all views.
    """
    view, part = request.view, None
    if request.areas != "pairs":
        view, part = _view_shown(canvases, request.view, reference)
    canvas = canvases[view]
    light, areas = reduced_areas(canvas, canvas.image, FINDING_SIDE)
    layers: list[Layer] = []
    makers: list[Callable[[Canvas, ViewAreas], Mask]] = []
    asked = light
    if request.areas in ("whole", "regions") and part is None:
        found = find_light(
            canvas, reference, light, areas, matches_brightness=request.matches_brightness
        )
        if found is not None:
            layers += found.layers
            makers += [partial(_light_mask, found, k) for k in range(len(found.layers))]
            asked = found.image
            if found.strength < 1:
                share = f", {round(100 * found.strength)} %"
                name = name[: MAX_NAME_LENGTH - len(share)] + share
    changes = _changes(canvas, request, reference, asked, areas, part, has_layers=bool(layers))
    layers += [change.layer(1, 1) for change in changes]
    makers += [partial(_area_mask, change.area) for change in changes]
    if not layers:
        raise PaintError(f"{name}: the picture has that light already")
    first = canvases.next_layer
    group = first + len(layers)
    numbered = [replace(x, id=first + k, group=group) for k, x in enumerate(layers)]
    views = [view] if request.areas == "pairs" else range(len(canvases))
    masks = {k: _masks(canvases[k], makers) for k in views}
    return open_group(canvases, [*numbered, Layer(group, "group", name)], masks), name


def _changes(
    canvas: Canvas,
    request: LookLike,
    reference: Tones,
    light: Floats,
    areas: ViewAreas,
    part: ViewPart | None,
    *,
    has_layers: bool,
) -> list[AreaChange]:
    """Return the changes of areas that a request asks for, none that lead away from a reference.

    light: (h, w, 3) linear, with what is asked for so far, reduced. has_layers: whether that
    includes how bright it becomes.
    """
    changes = find_changes(
        reference,
        light,
        areas,
        compared_areas(request, reference, part),
        part=part,
        matches_brightness=request.matches_brightness and not has_layers,
        keeps_brightness=request.areas == "parts" or part is not None,
    )
    if part is not None or request.areas not in ("whole", "regions"):
        return changes
    tones, known = reference.light_tones, areas.whole > 0
    pictures = light, changed_light(light, changes, areas)
    before, after = (distance_of(canvas, tones, x, known) for x in pictures)
    return changes if after <= before else []


def _view_shown(canvases: Canvases, first: int, reference: Tones) -> tuple[int, ViewPart | None]:
    """Return the view whose part a reference shows, and that part; None if it is another place.

    first: number of the view that is looked at first.
    """
    canvases[first]  # raises PaintError if there is no such view
    best: tuple[int, ViewPart | None] = first, None
    highest = SAME_PLACE
    for k in sorted(range(len(canvases)), key=lambda k: k != first):
        light, _ = reduced_areas(canvases[k], canvases[k].image, FINDING_SIDE)
        part = find_part(reference, light)
        if part.likeness >= highest:
            best, highest = (k, part), part.likeness
    return best


def _light_mask(found: LightLayers, number: int, canvas: Canvas, areas: ViewAreas) -> Mask:
    return found.mask(canvas, areas, number)


def _area_mask(area: LightArea, canvas: Canvas, areas: ViewAreas) -> Mask:
    return area.mask(areas)


def _masks(canvas: Canvas, makers: Sequence[Callable[[Canvas, ViewAreas], Mask]]) -> list[Mask]:
    """Return masks in a view, within what is selected."""
    basis = canvas.basis
    found = ViewAreas(canvas.image, basis.emitters_seen, basis.features, basis.objects)
    selected = selected_mask(canvas)
    return [maker(canvas, found) * selected for maker in makers]


def compared_areas(
    request: LookLike, reference: Tones, part: ViewPart | None
) -> Sequence[LightArea]:
    """Return the areas that a request compares, beside key and fill; the lowest layers first.

    part: of the view that the reference shows; None for another place. Raises PaintError for pairs
    without any.
    """
    if request.areas in ("whole", "regions"):
        has_regions = request.areas == "regions"
        if part is not None:
            return (WHOLE_AREA, *TONE_AREAS, *(part_areas(part) if has_regions else ()))
        tones = TONE_AREAS if is_soft(reference.light_tones) else ()
        bands = BAND_AREAS if has_regions else ()
        return (
            *of_another_place(tones, TONE_STOPS),
            *of_another_place(bands, BAND_STOPS),
        )
    if request.areas == "parts":
        return (WHOLE_AREA, *(PART_AREAS if part is None else part_areas(part)))
    if not request.pairs:
        raise PaintError("no places to compare: press one in the reference, then in the picture")
    spots = [
        spot_area(f"Place {k + 1}", pair.reference, pair.picture, SEEN_RADIUS, CHANGED_RADIUS)
        for k, pair in enumerate(request.pairs)
    ]
    return [WHOLE_AREA, *spots]
