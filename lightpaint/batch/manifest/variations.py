"""Named variations of a look: each word, and the settings that it changes."""

from collections.abc import Collection, Iterable
from dataclasses import replace
from math import ceil

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour import kelvin_to_rgb, luminance, photometry
from lightpaint.errors import BatchError
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import DEFAULT_HOLD
from lightpaint.pipeline.job.settings import Settings

#: Variations that are solved.
SOLVED_WORDS = ("fewer lights", "white only", "held harder")

#: Variations that shift an answer, and their mireds; positive is warmer.
SHIFTED_WORDS = {"warmer": 60.0, "cooler": -60.0}

VARIATIONS = (*SHIFTED_WORDS, *SOLVED_WORDS)

#: Share of the lights that `fewer lights` leaves on, and the factor on hold of `held harder`.
FEWER, HARDER = 0.5, 4.0

#: Limits of a shifted colour temperature, in kelvin: below the lower, lamps have no blue.
WARMEST, COOLEST = 2000.0, 15000.0

#: Colour temperature that is assumed for a colour without one, in kelvin.
NEUTRAL = 6504.0


def parse_variations(names: Iterable[str]) -> tuple[str, ...]:
    """Return variations by their words, each once; hyphens may stand for spaces.

    Raises BatchError for an unknown word.
    """
    words = dict.fromkeys(word.replace("-", " ") for word in names)
    if unknown_words := [word for word in words if word not in VARIATIONS]:
        known_names = ", ".join(word.replace(" ", "-") for word in VARIATIONS)
        raise BatchError(f"there is no variation {unknown_words[0]!r}: known are {known_names}")
    return tuple(words)


def vary(
    word: str, settings: Settings, constraints: Constraints, lights: int
) -> tuple[Settings, Constraints]:
    """Return the settings and constraints of a variation. lights: number of adjusted lights."""
    if word == "fewer lights":
        limit = max(1, ceil(FEWER * lights))
        sparse = limit if constraints.sparse is None else min(limit, constraints.sparse)
        return settings, replace(constraints, sparse=sparse)
    if word == "white only":
        return replace(settings, colors="white"), constraints
    hold = HARDER * (DEFAULT_HOLD if not settings.hold else settings.hold)
    return replace(settings, hold=hold, unpainted=0.0), constraints


def shift(lighting: Lighting, mireds: float, dimmer_lights: Collection[str] = ()) -> Lighting:
    """Return a lighting with every light warmer by `mireds`, at its luminance.

    dimmer_lights: names of lights with a dimmer but no colour; they do not change.
    """
    lights = tuple(
        light if light.name in dimmer_lights else _shift_light(light, mireds)
        for light in lighting.lights
    )
    return replace(lighting, lights=lights, certificate=None)


def _shift_light(light: LightSetting, mireds: float) -> LightSetting:
    if light.is_fixed or not any(light.emission) or not all(light.reached):
        return light
    kelvin = photometry(light.emission, unit=light.unit).kelvin or NEUTRAL
    ends = [
        kelvin_to_rgb(min(max(x, WARMEST), COOLEST))
        for x in (kelvin, _shift_kelvin(kelvin, mireds))
    ]
    ratio = np.array(ends[1]) / np.maximum(ends[0], 1e-6)
    return with_emission(light, np.array(light.emission) * ratio, keeps_luminance=True)


def _shift_kelvin(kelvin: float, mireds: float) -> float:
    return 1e6 / max(1e6 / kelvin + mireds, 1e6 / COOLEST)


def with_emission(
    light: LightSetting, emission: object, *, keeps_luminance: bool = False
) -> LightSetting:
    """Return `light` at another emission, without claims on its accuracy."""
    values = np.asarray(emission, dtype=np.float64)
    if keeps_luminance and (current := float(luminance(values))) > 0:
        values = values * float(luminance(np.array(light.emission))) / current
    rgb: RGB = (float(values[0]), float(values[1]), float(values[2]))
    return light.with_emission(rgb)
