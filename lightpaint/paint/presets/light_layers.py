"""Layers that ask for other light of groups of lamps, and their masks in a view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Floats, as_rgb
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import luminance
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.presets.view_areas import Mask

#: Least and most stops by which the light of lamps changes.
MIN_STOPS, MAX_STOPS = -6.5, 4.0


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
    """Return the masks (h, w) of the layers of groups, without that of `rest`.

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
