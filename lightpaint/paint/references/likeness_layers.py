"""*Look like this* on the views of a session: layers that ask for the light of a reference."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.composition import compose_layer
from lightpaint.paint.layers.layer import MAX_NAME_LENGTH, Layer
from lightpaint.paint.presets.lamp_roles import LampRoles
from lightpaint.paint.presets.light_layers import LampGroup, is_divided, layers_of, masks_of
from lightpaint.paint.presets.preset_masks import (
    open_group,
    open_preset,
    reduced_areas,
    reduction,
    selected_mask,
)
from lightpaint.paint.presets.presets import PRESETS
from lightpaint.paint.presets.view_areas import MIN_ALBEDO, Mask, ViewAreas
from lightpaint.paint.presets.view_light import find_roles, light_share
from lightpaint.paint.protocol import ApplyPreset, LookLike
from lightpaint.paint.references.light_match import (
    gains_of,
    has_pool,
    has_two_keys,
    is_even,
    is_soft,
    match_light,
)
from lightpaint.paint.references.likeness import (
    BAND_AREAS,
    CHANGED_RADIUS,
    PART_AREAS,
    SEEN_RADIUS,
    TONE_AREAS,
    WHOLE_AREA,
    LightArea,
    find_changes,
    of_another_place,
    spot_area,
)
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.references.tones import LightTones, Tones
from lightpaint.paint.store.canvas_pixels import Pixels, Region

#: Correlation of the edges of two pictures from which on they show one place: pictures of the
#: shipped scenes under other lightings have .8 and more, those of other places .15 at most.
SAME_PLACE = 0.5

#: Most stops by which tones and bands of the picture are made brighter or darker for a reference
#: of another place.
TONE_STOPS, BAND_STOPS = 1.5, 0.45

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
    first = canvases.next_layer
    layers: list[Layer] = []
    makers: list[Callable[[Canvas, ViewAreas], Mask]] = []
    seen = Tones(light, areas.whole > 0).light_tones
    is_same_place = reference.light_tones.resembles(seen) >= SAME_PLACE
    if request.areas in ("whole", "regions") and not is_same_place:
        light = _add_light(canvas, request, reference, light, areas, layers, makers)
    changes = find_changes(
        reference,
        light,
        areas,
        compared_areas(request, reference, is_same_place=is_same_place),
        matches_brightness=request.matches_brightness,
        keeps_brightness=request.areas == "parts",
    )
    layers += [change.layer(1, 1) for change in changes]
    makers += [partial(_area_mask, change.area) for change in changes]
    if not layers:
        raise PaintError(f"{name}: the picture has that light already")
    group = first + len(layers)
    numbered = [replace(x, id=first + k, group=group) for k, x in enumerate(layers)]
    views = [request.view] if request.areas == "pairs" else range(len(canvases))
    masks = {k: _masks(canvases[k], makers) for k in views}
    return open_group(canvases, [*numbered, Layer(group, "group", name)], masks)


def _add_light(
    canvas: Canvas,
    request: LookLike,
    reference: Tones,
    light: Floats,
    areas: ViewAreas,
    layers: list[Layer],
    makers: list[Callable[[Canvas, ViewAreas], Mask]],
) -> Floats:
    """Add the layers of key and fill, and what makes their masks; return the picture with them.

    light: (h, w, 3) linear, the picture now, and `areas` its areas, both reduced.
    """
    basis, factor, there = canvas.basis, reduction(canvas, FINDING_SIDE), reference.light_tones
    roles, _ = find_roles(canvas)
    keys = key_lamps(canvas, roles, there)
    lamps = np.any(keys, axis=0)
    known = areas.whole > 0
    match = match_light(
        there,
        Tones(light, known).light_tones,
        Tones(_without_surfaces(canvas, light, factor), known).light_tones,
        roles.level(lamps),
        roles.level(~lamps),
    )
    if request.matches_brightness:
        level = reference.level - Tones(light, known).level
        match = replace(
            match, key_stops=match.key_stops + level, fill_stops=match.fill_stops + level
        )
    if not match.is_visible:
        return light
    fill = LampGroup("Fill light", ~lamps, 2.0**match.fill_stops, gains_of(match.fill_tint))
    names = ("Key light",) if len(keys) == 1 else ("Key light, left", "Key light, right")
    groups = [
        LampGroup(name, key, 2.0**match.key_stops, gains_of(tint))
        for name, key, tint in zip(names, keys, match.key_tints, strict=True)
    ]
    added = layers_of(groups, fill, 1, "")[:-1]
    layers += added
    makers += [_whole_mask, *(partial(_key_mask, groups, fill, k) for k in range(len(groups)))]
    shares = [_share(basis, group.lamps, areas, factor) for group in groups]
    pixels = Pixels.unpainted(np.asarray(light, np.float32))
    for layer, mask in zip(added, [areas.whole, *masks_of(groups, fill, shares)], strict=True):
        pixels = compose_layer(layer, Pixels(np.zeros_like(light), mask), pixels)
    return pixels.image


def key_lamps(canvas: Canvas, roles: LampRoles, reference: LightTones) -> list[Bools]:
    """Return the lamps (n,) that make the key of a view: the likeliest for a reference.

    Two groups, at the left and at the right, for a reference with a key of each.
    """
    basis = canvas.basis
    usable = basis.current_weights.any(axis=1) & ~basis.is_fixed
    if has_two_keys(reference):
        left = roles.middles < 0
        pair = [roles.hard & usable & side for side in (left, ~left)]
        if all(x.any() for x in pair):
            return pair
        pair = [usable & side for side in (left, ~left)]
        if all(x.any() for x in pair):
            return pair
    key = roles.sun & usable
    if has_pool(reference):
        key = roles.candle & usable
    elif is_even(reference) and (roles.hard & usable).any():
        key = roles.hard & usable
    keys = [key, key] if has_two_keys(reference) else [key]
    return keys


def _without_surfaces(canvas: Canvas, light: Floats, factor: int) -> Floats:
    """Return the light (h, w, 3) that arrives at surfaces; as it is where these are unknown."""
    features = canvas.basis.features
    if features is None:
        return light
    albedo = features.reduced(factor).albedo
    return np.asarray(light / np.maximum(albedo, MIN_ALBEDO), np.float32)


def _share(basis: Basis, lamps: Bools, areas: ViewAreas, factor: int = 1) -> Mask:
    """Return the share (h, w) of the light that comes from lamps; lit parts for all or none."""
    return light_share(basis, lamps, factor) if is_divided(basis, lamps) else areas.lit


def _whole_mask(canvas: Canvas, areas: ViewAreas) -> Mask:
    return areas.whole


def _key_mask(
    groups: Sequence[LampGroup], fill: LampGroup, number: int, canvas: Canvas, areas: ViewAreas
) -> Mask:
    shares = [_share(canvas.basis, group.lamps, areas) for group in groups]
    return np.asarray(masks_of(groups, fill, shares)[number] * areas.whole, np.float32)


def _area_mask(area: LightArea, canvas: Canvas, areas: ViewAreas) -> Mask:
    return area.mask(areas)


def _masks(canvas: Canvas, makers: Sequence[Callable[[Canvas, ViewAreas], Mask]]) -> list[Mask]:
    """Return masks in a view, within what is selected."""
    basis = canvas.basis
    found = ViewAreas(canvas.image, basis.emitters_seen, basis.features, basis.objects)
    selected = selected_mask(canvas)
    return [maker(canvas, found) * selected for maker in makers]


def compared_areas(
    request: LookLike, reference: Tones, *, is_same_place: bool
) -> Sequence[LightArea]:
    """Return the areas that a request compares, beside key and fill; the lowest layers first.

    Raises PaintError for pairs without any.
    """
    if request.areas in ("whole", "regions"):
        bands = BAND_AREAS if request.areas == "regions" else ()
        if is_same_place:
            return (WHOLE_AREA, *TONE_AREAS, *bands)
        tones = TONE_AREAS if is_soft(reference.light_tones) else ()
        other_tones = of_another_place(tones, TONE_STOPS)
        return (*other_tones, *of_another_place(bands, BAND_STOPS))
    if request.areas == "parts":
        return (WHOLE_AREA, *PART_AREAS)
    if not request.pairs:
        raise PaintError("no places to compare: press one in the reference, then in the picture")
    spots = [
        spot_area(f"Place {k + 1}", pair.reference, pair.picture, SEEN_RADIUS, CHANGED_RADIUS)
        for k, pair in enumerate(request.pairs)
    ]
    return [WHOLE_AREA, *spots]
