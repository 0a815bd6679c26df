"""The presets: how bright and which white the light of some lamps becomes, and of all others."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from lightpaint.arrays import Bools
from lightpaint.errors import PaintError
from lightpaint.paint.presets.lamp_roles import LampRoles

#: The area in which a layer asks for light where no lamps can be told apart.
Area = Literal["whole", "lit", "subject"]


@dataclass(frozen=True)
class LampRequest:
    """A layer of a preset: what the light of some lamps becomes.

    level: light where these lamps shine, relative to that of the brighter half of the picture now.
    kelvin: their white; None to keep their colours. lamps: those; None for all that no other layer
    is about. area: where it is asked for if a view has one lamp.
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
        "Exhibits in clear accents before quiet walls",
        _rest(0.12),
        (LampRequest("Exhibits", 0.85, 4000, lambda roles: roles.on_exhibits, "subject"),),
    ),
    LightingPreset(
        "shop_window",
        "Shop window",
        "The subject brilliant and white, its surroundings dim and warm",
        _rest(0.16, 2900),
        (LampRequest("Subject", 1.4, 5600, lambda roles: roles.on_subject, "subject"),),
        has_subject=True,
    ),
    LightingPreset(
        "three_point",
        "Three-point",
        "A warm key on the subject, a cool fill from its other side, a dark background",
        _rest(0.06),
        (
            LampRequest("Fill", 0.25, 8500, lambda roles: roles.fill, "subject"),
            LampRequest("Key", 1.0, 3600, lambda roles: roles.key, "subject"),
        ),
        has_subject=True,
    ),
    LightingPreset(
        "only_object",
        "Only this object",
        "The subject alone in the light, all else nearly dark",
        _rest(0.02),
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
