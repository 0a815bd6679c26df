"""The emitters of lamps as lights of a render with spectra, which has a picture for each."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.colour import Lamp, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene.lights.light import Light
from lightpaint.scene.properties.emission import MULTIPLE


def lights_of_lamps(
    lights: Sequence[Light], lamps: Mapping[str, Lamp], *, scene: str
) -> tuple[Light, ...]:
    """Return `lights`, with each emitter of a lamp in the place of the lamp's light.

    Such a light is called `LAMP/EMITTER`, has one weight, the luminance of its emission, and shines
    as in the nearest mix to what the scene shows. lamps: by name of light. Raises SceneError for a
    light that is adjusted and has no lamp of spectra, or that is an image.
    """
    found: list[Light] = []
    for light in lights:
        if light.is_fixed:
            found.append(light)
            continue
        _check_lamp(light, lamps.get(light.name), scene)
        lamp = lamps[light.name]
        now = lamp.drives_for(np.array(light.emission))
        for emitter, drive in zip(lamp.emitters, now.tolist(), strict=True):
            level = drive * float(luminance(np.array(emitter.emission)))
            found.append(
                replace(
                    light,
                    name=part_name(light.name, emitter.name),
                    emission=(level, level, level),
                    is_scalar=True,
                    lamp=light.name,
                    spectrum=emitter.spectrum,
                )
            )
    names = [light.name for light in found]
    if repeated := {name for name in names if names.count(name) > 1}:
        raise SceneError(f"{scene} has two lights called {some_names(sorted(repeated))}")
    return tuple(found)


def part_name(lamp: str, emitter: str) -> str:
    """Return the name of the light of an emitter of a lamp."""
    return f"{lamp}/{emitter}"


def _check_lamp(light: Light, lamp: Lamp | None, scene: str) -> None:
    if light.unit == MULTIPLE:
        raise SceneError(
            f"{scene}: light {light.name!r} is an image, or several lights of different colours, "
            "and renders with spectra adjust lights of one colour: keep it as it is, by `lights`"
        )
    missing = [] if lamp is None else [x.name for x in lamp.emitters if x.spectrum is None]
    if lamp is None or missing:
        what = "no emitters" if lamp is None else f"no spectrum of {some_names(missing)}"
        raise SceneError(
            f"{scene}: the lights file has {what} for light {light.name!r}, and a render with "
            "spectra needs them: add them, or keep the light as it is, by `lights`"
        )
