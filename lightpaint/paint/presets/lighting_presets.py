"""The presets: how bright and which white the light of some lamps becomes, and of all others; the
masks of their layers in the views of a session, and what they ask for.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Floats, as_rgb
from lightpaint.basis import Basis
from lightpaint.colour import kelvin_to_rgb, luminance
from lightpaint.errors import PaintError
from lightpaint.images import block_mean, fitting_factor
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.composition import compose_layer
from lightpaint.paint.layers.layer_pixels import FULL, selection_mask
from lightpaint.paint.layers.layer_stack import MAX_NAME_LENGTH, Layer
from lightpaint.paint.presets.lamp_roles import LampRoles, find_roles, light_share
from lightpaint.paint.presets.view_areas import Mask, ViewAreas
from lightpaint.paint.store.history_steps import Pixels, Region, slices

#: The area in which a layer asks for light where no lamps can be distinguished.
Area = Literal["whole", "lit", "subject"]

#: Least and most stops by which the light of lamps changes.
MIN_STOPS, MAX_STOPS = -6.5, 4.0

#: Steps of coverage in a mask, which are not seen, and which a session file packs well.
MASK_STEPS = 4096


@dataclass(frozen=True)
class LampRequest:
    """A layer of a preset: what the light of some lamps becomes.

    level: light where these lamps shine, relative to the light of the brighter half of the picture
    now. kelvin: their white; None to keep their colours. lamps: those; None for all that no other
    layer is about. area: where it is asked for if a view has one lamp.
    """

    name: str
    level: float
    kelvin: float | None = None
    lamps: Callable[[LampRoles], Bools] | None = None
    area: Area = "lit"


@dataclass(frozen=True)
class LightingPreset:
    """A request for a whole scene. description: what it does, for people.

    rest: the lowest layer, over the whole picture. changes: layers above it. has_subject: whether
    it is about one object.
    """

    name: str
    title: str
    description: str
    rest: LampRequest
    changes: Sequence[LampRequest]
    has_subject: bool = False


def _rest(level: float, kelvin: float | None = None) -> LampRequest:
    return LampRequest("Everything", level, kelvin, area="whole")


def _pools(level: float, kelvin: float, *, is_on_wall: bool = True) -> tuple[LampRequest, ...]:
    """Return layers for pools of light. is_on_wall: whether spots on a wall are among them."""

    def lamps(roles: LampRoles, number: int) -> Bools:
        return roles.pool(number, is_on_wall=is_on_wall)

    return tuple(
        LampRequest(name, level, kelvin, partial(lamps, number=k), "subject")
        for k, name in enumerate(("First pool", "Second pool", "Third pool"))
    )


def _sky(level: float, kelvin: float) -> LampRequest:
    return LampRequest("Sky", level, kelvin, lambda roles: roles.is_wash, "whole")


_ALL = (
    LightingPreset(
        "moonlight",
        "Moonlight",
        "A deep blue night with a cold moon from one side",
        _rest(0.12, 25000),
        (
            _sky(0.22, 25000),
            LampRequest("Disc", 0.8, 12000, lambda roles: roles.disc, "subject"),
            LampRequest("Moon", 0.45, 15000, lambda roles: roles.sun),
        ),
    ),
    LightingPreset(
        "golden_hour",
        "Golden hour",
        "A low golden sun from one side, everything else dim and cool",
        _rest(0.16, 7000),
        (
            LampRequest("Horizon", 0.35, 2500, lambda roles: roles.horizon, "whole"),
            LampRequest(
                "Sky", 0.08, 9000, lambda roles: roles.is_wash & roles.horizon.any(), "whole"
            ),
            _sky(0.35, 3300),
            LampRequest("Low sun", 0.95, 2450, lambda roles: roles.sun),
        ),
    ),
    LightingPreset(
        "overcast",
        "Overcast",
        "Soft, even and cool, with hardly any shadow",
        _rest(0.04, 7000),
        (LampRequest("Soft light", 0.75, 7000, lambda roles: roles.even_daylight, "whole"),),
    ),
    LightingPreset(
        "noir",
        "Noir",
        "A few hard pools of light in the dark",
        _rest(0.025, 6500),
        (*_pools(1.0, 5500), LampRequest("Edge", 0.5, 6000, lambda roles: roles.edge)),
    ),
    LightingPreset(
        "candle",
        "Candlelight",
        "One warm flame at the subject, and a dark room",
        _rest(0.03, 2200),
        (LampRequest("Flame", 0.7, 2000, lambda roles: roles.candle, "subject"),),
        has_subject=True,
    ),
    LightingPreset(
        "gallery",
        "Gallery",
        "Exhibits in clear white accents before quiet walls",
        _rest(0.3, 6500),
        (LampRequest("Exhibits", 0.95, 5400, lambda roles: roles.on_exhibits, "subject"),),
    ),
    LightingPreset(
        "shop_window",
        "Shop window",
        "The subject brilliant and white, its surroundings dim and warm",
        _rest(0.22, 2400),
        (LampRequest("Subject", 1.5, 6500, lambda roles: roles.on_subject, "subject"),),
        has_subject=True,
    ),
    LightingPreset(
        "three_point",
        "Three-point",
        "A warm key on the subject, a cool fill from its other side, a dark background",
        _rest(0.03),
        (
            LampRequest("Fill", 0.45, 14000, lambda roles: roles.fill, "subject"),
            LampRequest("Key", 1.0, 2900, lambda roles: roles.key, "subject"),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "only_object",
        "Only this object",
        "The subject alone in the light, all else nearly dark",
        _rest(0.004),
        (LampRequest("Subject", 0.9, None, lambda roles: roles.on_subject, "subject"),),
        has_subject=True,
    ),
    LightingPreset(
        "night",
        "Day to night",
        "Dusk at half strength, night at full: dark and blue, with pools of warm lamplight",
        _rest(0.08, 20000),
        _pools(0.45, 2700, is_on_wall=False)[:2],
    ),
)

#: The presets by name, in the order in which people see them.
PRESETS: Mapping[str, LightingPreset] = {preset.name: preset for preset in _ALL}


def find_preset(name: str) -> LightingPreset:
    """Return the preset of a name. Raises PaintError if there is none."""
    if name not in PRESETS:
        raise PaintError(f"there is no preset {name!r:.40}: expected {', '.join(PRESETS)}")
    return PRESETS[name]


@dataclass(frozen=True)
class LampGroup:
    """Lamps whose light a layer changes.

    name: of the layer. lamps: (n,). gain: of their light. tint: (3,), of their colour, at
    luminance 1.
    """

    name: str
    lamps: Bools
    gain: float
    tint: Doubles


def layers_of(
    groups: Sequence[LampGroup], rest: LampGroup, first_id: int, title: str
) -> tuple[Layer, ...]:
    """Return a layer for `rest`, one for each group, and last the group of layers that holds them.

    first_id: id of the first. title: name of the group. Upper layers lie on the lowest, so they ask
    for their change relative to it.
    """
    group = first_id + len(groups) + 1
    changes = [(rest.gain, rest.tint)]
    changes += [(x.gain / rest.gain, x.tint / rest.tint) for x in groups]
    layers = [
        Layer(
            first_id + k,
            "adjust",
            name,
            group=group,
            gain=float(gain),
            tint=_normalised(tint),
        )
        for k, (name, (gain, tint)) in enumerate(
            zip((rest.name, *(x.name for x in groups)), changes, strict=True)
        )
    ]
    return (*layers, Layer(group, "group", title))


def masks_of(groups: Sequence[LampGroup], rest: LampGroup, shares: Sequence[Mask]) -> list[Mask]:
    """Return the masks (h, w) of the layers of groups, without the mask of `rest`.

    shares: of the current light of each pixel, by group. Each layer changes what the lower ones
    left, so the share is taken of that: then the light of every group changes by its own gain.
    """
    level: Floats = np.ones((), np.float32)
    masks = []
    for group, share in zip(groups, shares, strict=True):
        masks.append(np.asarray(np.clip(share / level, 0, 1), np.float32))
        level = level + share * np.float32(group.gain / rest.gain - 1)
    return masks


def white_tint(basis: Basis, lamps: Bools, amounts: Doubles, white: Doubles | None) -> Doubles:
    """Return the gains (3,), of luminance 1, that bring the light of lamps to a white.

    amounts: (n,), their light in the picture. white: (3,), of luminance 1; None to keep the
    colour.
    """
    if white is None:
        return np.ones(3)
    light = basis.current_weights
    levels = luminance(light)
    colors = light / np.where(levels > 0, levels, 1)[:, None]
    weights = amounts * lamps * (levels > 0)
    if not weights.any():
        return np.ones(3)
    color = np.maximum((weights[:, None] * colors).sum(axis=0) / weights.sum(), 1e-3)
    gains = white / color
    return np.asarray(gains / luminance(gains))


def is_divided(basis: Basis, lamps: Bools) -> bool:
    """Return True if some lamps that are on belong to a group, and others do not."""
    is_on = basis.current_weights.any(axis=1)
    return bool((is_on & lamps).any() and (is_on & ~lamps).any())


def limited_gain(gain: float) -> float:
    """Return a gain within the stops by which a layer changes light."""
    return float(np.clip(gain, 2.0**MIN_STOPS, 2.0**MAX_STOPS))


def _normalised(tint: Doubles) -> RGB:
    gains = np.maximum(tint, 1e-3)
    return as_rgb(gains / luminance(gains))


@dataclass(frozen=True)
class PresetLayers:
    """A preset for the lamps of a scene: its layers before they have ids, and their areas."""

    rest: LampGroup
    changes: Sequence[LampRequest]
    groups: tuple[LampGroup, ...]
    subject: str | None

    def layers(self, first_id: int, title: str) -> tuple[Layer, ...]:
        """Return the layers, and last the group that holds them, with ids from `first_id`."""
        return layers_of(self.groups, self.rest, first_id, title)

    def masks(self, canvas: Canvas, areas: ViewAreas, factor: int = 1) -> list[Mask]:
        """Return the mask (h, w) of each layer in a view.

        areas: of the view, reduced by `factor`.
        """
        shares = [
            light_share(canvas.basis, group.lamps, factor)
            if is_divided(canvas.basis, group.lamps)
            else _area(areas, change.area)
            for group, change in zip(self.groups, self.changes, strict=True)
        ]
        usable = areas.whole
        return [usable, *(x * usable for x in masks_of(self.groups, self.rest, shares))]


def find_layers(preset: LightingPreset, canvas: Canvas, subject: str | None) -> PresetLayers:
    """Return what a preset asks of the lamps of a scene, as one view shows what each does.

    subject: name of the object that it is about; None to take the most central one.
    """
    roles, name = find_roles(canvas, subject)
    basis = canvas.basis
    usable = roles.lamps(~basis.is_fixed)
    chosen = np.zeros(len(roles.light), bool)
    lamps = []
    for change in preset.changes:
        assert change.lamps is not None
        lamps.append(change.lamps(roles) & usable & ~chosen)
        chosen |= lamps[-1]
    rest = _group(preset.rest, basis, roles, ~chosen)
    found = [(x, k) for x, k in zip(preset.changes, lamps, strict=True) if k.any()]
    if not is_divided(basis, roles.lights(chosen)):
        found = list(zip(preset.changes, lamps, strict=True))[-1:]
    groups = tuple(_group(x, basis, roles, k) for x, k in found)
    return PresetLayers(rest, [x for x, _ in found], groups, name)


def _group(change: LampRequest, basis: Basis, roles: LampRoles, lamps: Bools) -> LampGroup:
    """Return lamps with the gain and the tint that bring them to a level and a white."""
    level = roles.level(lamps) or 1.0
    white = None if change.kelvin is None else kelvin_to_rgb(change.kelvin)
    lights = roles.lights(lamps)
    amounts = roles.amounts if roles.lamp_of is None else roles.amounts[roles.lamp_of]
    tint = white_tint(basis, lights if lights.any() else ~lights, amounts, white)
    return LampGroup(change.name, lights, limited_gain(change.level / level), tint)


def _area(areas: ViewAreas, name: Area) -> Mask:
    """Return the mask (h, w) of an area."""
    return {"whole": areas.whole, "lit": areas.lit, "subject": areas.subject}[name]


def open_preset(canvases: Canvases, name: str, subject: str | None) -> list[tuple[int, Region]]:
    """Put the layers of the preset of a name on top, as an open change; return what changes.

    subject: name of the object that it is about; None to take the most central one. Raises
    PaintError for an unknown preset, and for an object that no view sees.
    """
    preset = find_preset(name)
    view = _view_of(canvases, subject)
    title = preset.title if subject is None else f"{preset.title}: {subject}"
    found = find_layers(preset, view, subject)
    layers = found.layers(canvases.next_layer, title[:MAX_NAME_LENGTH])
    masks = {
        k: [mask * selected_mask(canvas) for mask in found.masks(canvas, areas)]
        for k, canvas in enumerate(canvases)
        for areas in [ViewAreas.of_view(canvas.basis, canvas.current, chosen=found.subject)]
    }
    return open_group(canvases, layers, masks)


def _view_of(canvases: Canvases, subject: str | None) -> Canvas:
    """Return the first view that sees an object, or the first. Raises PaintError if none knows
    it.
    """
    if subject is None:
        return canvases[0]
    maps = [(canvas, canvas.basis.objects) for canvas in canvases]
    known = [(canvas, x) for canvas, x in maps if x is not None and subject in x.names]
    if not known:
        raise PaintError(f"no view sees an object called {subject!r:.40}")
    return next((canvas for canvas, x in known if x.mask(subject).any()), canvases[0])


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


def reduction(canvas: Canvas, side: int) -> int:
    """Return the side of the blocks of pixels that reduce a view to `side` pixels or so."""
    return fitting_factor(canvas.size, round(max(canvas.size) / side))


def reduced_areas(
    canvas: Canvas, light: Floats, side: int, subject: str | None = None
) -> tuple[Floats, ViewAreas]:
    """Return a picture of a view, (h, w, 3), reduced, and its areas.

    side: approximate pixels of its longer side.
    """
    factor = reduction(canvas, side)
    look = np.asarray(block_mean(light, factor), np.float32)
    return look, ViewAreas.of_view(canvas.basis, look, factor, subject)


def with_layers(look: Floats, layers: Sequence[Layer], masks: Sequence[Mask]) -> Floats:
    """Return a picture (h, w, 3) linear under adjustments with these masks (h, w), the lowest
    first.
    """
    pixels, no_colour = Pixels.unpainted(look), np.zeros_like(look)
    for layer, mask in zip(layers, masks, strict=True):
        pixels = compose_layer(layer, Pixels(no_colour, mask), pixels)
    return pixels.image


def requested_look(preset: LightingPreset, canvas: Canvas, side: int) -> Floats:
    """Return what a preset asks of the current look of a view, (h, w, 3) linear, reduced.

    side: approximate pixels of its longer side.
    """
    found = find_layers(preset, canvas, None)
    look, areas = reduced_areas(canvas, canvas.current, side, found.subject)
    masks = found.masks(canvas, areas, reduction(canvas, side))
    return with_layers(look, found.layers(1, "")[:-1], masks)
