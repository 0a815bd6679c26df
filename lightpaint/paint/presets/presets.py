"""The presets: what each asks for, in stops and mired, and where."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import RGB, as_rgb
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.errors import PaintError
from lightpaint.paint.layers.layer import Layer
from lightpaint.paint.presets.view_areas import Mask, ViewAreas

#: Neutral white of warmer and cooler adjustments, in mired, and the range of whites.
NEUTRAL_MIRED, MIRED_RANGE = 200.0, (1e6 / 15000, 500.0)


@dataclass(frozen=True)
class Adjustment:
    """A layer of a preset. stops: brighter. mired: warmer. mask: of its area in a view."""

    name: str
    stops: float
    mired: float
    mask: Callable[[ViewAreas], Mask]


@dataclass(frozen=True)
class LightingPreset:
    """A request for a whole scene. description: what it does, for people.

    adjustments: the lowest first. has_subject: whether it is about one object.
    """

    name: str
    title: str
    description: str
    adjustments: Sequence[Adjustment]
    has_subject: bool = False


def _whole(stops: float, mired: float = 0.0) -> Adjustment:
    return Adjustment("Everything", stops, mired, lambda view: view.whole)


def _shadows(stops: float, mired: float = 0.0) -> Adjustment:
    return Adjustment("Shadows", stops, mired, lambda view: view.shadows)


def _lit(stops: float, mired: float = 0.0) -> Adjustment:
    return Adjustment("Lit parts", stops, mired, lambda view: view.lit)


_ALL = (
    LightingPreset(
        "moonlight",
        "Moonlight",
        "Dark and blue, with deep shadows",
        (_whole(-1.6, -110), _shadows(-0.8, -20)),
    ),
    LightingPreset(
        "golden_hour",
        "Golden hour",
        "Low warm sun: lit parts bright and golden, shadows cool",
        (_whole(-0.2, 50), _lit(0.6, 40), _shadows(-0.4, -50)),
    ),
    LightingPreset(
        "overcast",
        "Overcast",
        "Soft and even, hardly any shadow",
        (_whole(-0.1, -15), _shadows(0.8), _lit(-0.8)),
    ),
    LightingPreset(
        "noir",
        "Noir",
        "Hard contrast: little light, and much darkness",
        (_whole(-0.8), _shadows(-2.6), _lit(0.8)),
    ),
    LightingPreset(
        "candle",
        "Candlelight",
        "A warm pool around the subject in a dark room",
        (
            _whole(-1.8, 150),
            Adjustment("Around the subject", 1.6, 30, lambda view: view.around_subject),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "gallery",
        "Gallery",
        "Objects stand out from quiet walls",
        (
            Adjustment("Surroundings", -0.7, 0, lambda view: view.surroundings),
            Adjustment("Exhibits", 0.7, 10, lambda view: view.exhibits),
        ),
    ),
    LightingPreset(
        "shop_window",
        "Shop window",
        "The subject brilliant, its surroundings half as bright",
        (
            Adjustment("The rest", -1.0, 10, lambda view: view.rest),
            Adjustment("Subject", 1.2, -10, lambda view: view.subject),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "three_point",
        "Three-point",
        "Key from the left, fill from the right, a quiet background",
        (
            Adjustment("Background", -1.3, 0, lambda view: view.rest),
            Adjustment("Key", 1.0, 15, lambda view: view.subject_left),
            Adjustment("Fill", 0.2, -20, lambda view: view.subject_right),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "only_object",
        "Only this object",
        "The subject as it is, all else nearly dark",
        (
            Adjustment("The rest", -3.0, 0, lambda view: view.rest),
            Adjustment("Subject", 0.3, 0, lambda view: view.subject),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "night",
        "Day to night",
        "Dusk at half strength, night at full: dark and blue, lit parts warm",
        (_whole(-2.4, -90), _lit(1.4, 110)),
    ),
)

#: The presets by name, in the order in which people see them.
PRESETS: Mapping[str, LightingPreset] = {preset.name: preset for preset in _ALL}


def find_preset(name: str) -> LightingPreset:
    """Return the preset of a name. Raises PaintError if there is none."""
    if name not in PRESETS:
        raise PaintError(f"there is no preset {name!r:.40}: expected {', '.join(PRESETS)}")
    return PRESETS[name]


def layers_of(preset: LightingPreset, first_id: int, title: str) -> tuple[Layer, ...]:
    """Return the layers of a preset, and last the group that holds them, with ids from `first_id`.

    title: name of the group.
    """
    group = first_id + len(preset.adjustments)
    layers = [
        Layer(
            first_id + k,
            "adjust",
            adjustment.name,
            group=group,
            gain=2.0**adjustment.stops,
            tint=warmer(adjustment.mired),
        )
        for k, adjustment in enumerate(preset.adjustments)
    ]
    return (*layers, Layer(group, "group", title))


def warmer(mired: float) -> RGB:
    """Return the gains of luminance 1 that make neutral white warmer, or cooler below 0."""
    low, high = MIRED_RANGE
    target = kelvin_to_rgb(1e6 / float(np.clip(NEUTRAL_MIRED + mired, low, high)))
    gains = target / kelvin_to_rgb(1e6 / NEUTRAL_MIRED)
    return as_rgb(gains / luminance(gains))
