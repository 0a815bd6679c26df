"""Sentences on the certainty of the answer, and on the samples that would raise it."""

from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import joined_texels
from lightpaint.display_text import some_of
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.solution import Solution
from lightpaint.report.measures import (
    brightness,
    energy_shares,
    halving_spp,
    is_by_painting,
    most_uncertain,
    relative_errors,
)
from lightpaint.report.phrases import CHANNELS, spoken_lights, spoken_percent

#: Texts for a light without a meaningful error: in a table, and in a sentence.
UNDETERMINED = "undetermined"

#: Upper end of an interval, relative to the light, beyond which percents say nothing.
MAX_TIMES = 10.0

UNTOLD_HERE = f"{UNDETERMINED} at this number of samples"


def spoken_errors(uncertainty: Uncertainty | None, count: int) -> list[str]:
    """Return `± 4 %` for each light; empty for unknown errors.

    At a limit it has one side, `0 … +4 %`; a light that is off has `0 … 0.9`, in its unit; a light
    that samples do not determine has `undetermined`.
    """
    if uncertainty is None:
        return [""] * count
    lights = zip(*brightness(uncertainty), uncertainty.untold, strict=True)
    return [
        UNDETERMINED if is_undetermined else _spoken_error(*ends)
        for *ends, is_undetermined in lights
    ]


def untold_lights(lighting: Lighting) -> str:
    """Return a sentence on the lights that samples do not determine; "" if there are none."""
    names = [light.name for light in lighting.lights if light.untold]
    if not names:
        return ""
    is_one = len(names) == 1
    verb, pronoun, clause = ("is", "it", "it shines") if is_one else ("are", "them", "they shine")
    return (
        f"{spoken_lights(names, start=True)} {verb} {UNTOLD_HERE}: what was painted shows too "
        f"little of {pronoun} beside noise. Render more samples, paint where {clause}, or keep "
        f"{pronoun}."
    )


def _spoken_error(solved: float, low: float, high: float) -> str:
    if low >= high:
        return ""
    if solved == 0:
        return f"0 … {high:.2g}"
    if high > MAX_TIMES * solved:
        return UNDETERMINED
    below, above = (spoken_percent(float(side / solved)) for side in (solved - low, high - solved))
    if below == above:
        return f"± {below}"
    return f"{f'−{below}' if low < solved else '0'} … {f'+{above}' if high > solved else '0'}"


def partly_reached(lighting: Lighting) -> list[str]:
    """Return a clause for the lights some of whose channels reach nothing painted."""
    by_channels: dict[str, list[str]] = {}
    for light in lighting.lights:
        if light.is_partly_reached:
            by_channels.setdefault(unreached_channels(light), []).append(light.name)
    return [
        f"no painted pixel shows the {channels} of {some_of(names, room=200)}: left unchanged"
        for channels, names in ((x, joined_texels(y)) for x, y in by_channels.items())
    ]


def unreached_channels(light: LightSetting) -> str:
    """Return `green and blue`: the channels of a light that reach nothing that counts."""
    return " and ".join(
        c for c, is_reached in zip(CHANNELS, light.reached, strict=True) if not is_reached
    )


def uncertainty_sentence(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> str:
    """Return a sentence on the light whose error changes the picture most, and on the samples to
    halve it.
    """
    k = most_uncertain(basis, solution, uncertainty)
    is_undetermined = untold_lights(solution.lighting)
    if k is None and is_undetermined:
        return is_undetermined
    if k is None:
        has_noise = any(x.any() for x in basis.noise)
        reason = "nothing in it depends on the noise" if has_noise else "the basis has no noise"
        return f"More samples would change no light: {reason}."
    shares = energy_shares(basis, solution.lighting)
    errors = relative_errors(uncertainty)
    name = solution.lighting.lights[k].name
    light = f"{spoken_lights([name])}, {spoken_percent(shares[k])} of the picture"
    change = "as much as all of it" if errors[k] > 1 else f"± {spoken_percent(float(errors[k]))}"
    if is_by_painting(uncertainty, k):
        return (
            f"{is_undetermined} Noise of the painting leaves {light}, open by {change} (95 %): "
            "more samples would not change that."
        ).lstrip()
    sentence = (
        f"More samples would change {light}, by {change} (95 %); "
        f"{halving_spp(basis, uncertainty, k)} samples per pixel would halve that."
    )
    return f"{is_undetermined} {sentence}" if is_undetermined else sentence
