"""Named variations of a look: one word, and what it changes."""

from collections.abc import Collection, Iterable
from dataclasses import replace
from math import ceil

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.colour.photometry import photometry
from lightpaint.errors import BatchError
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import HOLD
from lightpaint.pipeline.settings import Settings

#: Words that ask for another solve, and for what.
SOLVED = ("fewer lights", "white only", "held harder")

#: Words that change an answer, and by how many mireds; more is warmer.
SHIFTED = {"warmer": 60.0, "cooler": -60.0}

VARIATIONS = (*SHIFTED, *SOLVED)

#: Part of the lights that `fewer lights` leaves on, and how much harder `held harder` holds.
FEWER, HARDER = 0.5, 4.0

#: Between which colour temperatures a light is moved, in kelvin: below, lamps have no blue.
WARMEST, COOLEST = 2000.0, 15000.0

#: Colour temperature of what has none of its own, in kelvin.
NEUTRAL = 6504.0


def words_of(given: Iterable[str]) -> tuple[str, ...]:
    """Variations by their words, each once; hyphens may stand for spaces.

    Raises BatchError for a word that is none.
    """
    words = dict.fromkeys(word.replace("-", " ") for word in given)
    if unknown := [word for word in words if word not in VARIATIONS]:
        known = ", ".join(word.replace(" ", "-") for word in VARIATIONS)
        raise BatchError(f"there is no variation {unknown[0]!r}: known are {known}")
    return tuple(words)


def varied(
    word: str, settings: Settings, constraints: Constraints, lights: int
) -> tuple[Settings, Constraints]:
    """What is asked for instead. lights: how many are adjusted."""
    if word == "fewer lights":
        few = max(1, ceil(FEWER * lights))
        most = few if constraints.sparse is None else min(few, constraints.sparse)
        return settings, replace(constraints, sparse=most)
    if word == "white only":
        return replace(settings, colors="white"), constraints
    hold = HARDER * (HOLD if not settings.hold else settings.hold)
    return replace(settings, hold=hold, unpainted=0.0), constraints


def shifted(lighting: Lighting, mireds: float, dimmed: Collection[str] = ()) -> Lighting:
    """Every light so much warmer, as bright as it was.

    dimmed: names of lights that have a dimmer and no colour, and stay as they are.
    """
    lights = tuple(
        light if light.name in dimmed else _warmer(light, mireds) for light in lighting.lights
    )
    return replace(lighting, lights=lights, certificate=None)


def _warmer(light: LightSetting, mireds: float) -> LightSetting:
    if light.is_fixed or not any(light.emission) or not all(light.reached):
        return light
    kelvin = photometry(light.emission, unit=light.unit).kelvin or NEUTRAL
    ends = [kelvin_to_rgb(min(max(x, WARMEST), COOLEST)) for x in (kelvin, _moved(kelvin, mireds))]
    ratio = np.array(ends[1]) / np.maximum(ends[0], 1e-6)
    return with_emission(light, np.array(light.emission) * ratio, keeps_luminance=True)


def _moved(kelvin: float, mireds: float) -> float:
    return 1e6 / max(1e6 / kelvin + mireds, 1e6 / COOLEST)


def with_emission(
    light: LightSetting, emission: object, *, keeps_luminance: bool = False
) -> LightSetting:
    """`light` at another emission, of which nothing is claimed."""
    given = np.asarray(emission, dtype=np.float64)
    if keeps_luminance and (now := float(luminance(given))) > 0:
        given = given * float(luminance(np.array(light.emission))) / now
    rgb: RGB = (float(given[0]), float(given[1]), float(given[2]))
    return replace(
        light,
        emission=rgb,
        weight=rgb,
        constraint="",
        is_active=False,
        standard_error=None,
        interval=None,
        untold=False,
    )
