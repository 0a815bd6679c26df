"""Phrases of sentences: lights, colours, shares and parts of the picture in words."""

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from lightpaint.basis import TEXELS, is_of_texels, joined_texels
from lightpaint.colour import luminance
from lightpaint.display_text import some_names, some_of
from lightpaint.lighting import LightRendering, LightSetting, Place, UnpaintedChange

CHANNELS = ("red", "green", "blue")

#: Characters of names in a sentence.
MAX_NAME_CHARACTERS = 120

#: Difference of painting and light, in chromaticity, that counts as another colour.
COLOR_SHIFT = 0.06

#: Phrases for the part of the requested change that the answer achieves, with their least percents.
PROGRESS_PHRASES = (
    (85, "Nearly there"),
    (60, "Most of the way"),
    (40, "About half way"),
    (15, "Part of the way"),
    (1, "A first step"),
)

#: Phrase for an answer that is no closer to the paint than the current look.
NO_CLOSER_TEXT = "No closer than the current lighting"


def spoken_progress(share: float) -> str:
    """Return how far an answer has come, `Most of the way`. share: achieved of the request."""
    percents = round(100 * share)  # as the number beside it is rounded
    return next((words for least, words in PROGRESS_PHRASES if percents >= least), NO_CLOSER_TEXT)


def spoken_changed(unpainted_change: UnpaintedChange) -> str:
    """Say which unpainted part changes most, and by how much: `the annex by ΔE 12`."""
    return f"{spoken_part(unpainted_change)} by ΔE {spoken_amount(unpainted_change.worst)}"


def spoken_elsewhere(unpainted_change: UnpaintedChange | None) -> str:
    """Say `Unpainted parts change too, most of all the annex, by ΔE 12.`; "" for None."""
    return (
        f"Unpainted parts change too, most of all {_spoken_most(unpainted_change)}."
        if unpainted_change
        else ""
    )


def _spoken_most(unpainted_change: UnpaintedChange) -> str:
    place = (
        spoken_part(unpainted_change)
        if unpainted_change.object
        else spoken_ninth(unpainted_change.region)
    )
    return f"{place}, by ΔE {spoken_amount(unpainted_change.worst)}"


def spoken_part(unpainted_change: UnpaintedChange) -> str:
    """Name the part that changes most: `the annex`, or a region of the picture."""
    if not unpainted_change.object:
        return f"what is {spoken_ninth(unpainted_change.region)}"
    return f"the {some_names([unpainted_change.object.replace('_', ' ').strip()])}"


def spoken_amount(delta_e: float) -> str:
    """Return a ΔE in words: `0.4`, `12`."""
    return f"{delta_e:.0f}" if delta_e >= 9.5 else f"{delta_e:.1f}"


def spoken_lights(names: Sequence[str], *, start: bool = False) -> str:
    """Return `light key`, `lights key, fill`, `texel sky.x0.y1`, `3 texels of sky, key`, or
    `light_3` alone if the name already says "light".

    start: whether it begins a sentence. A long list is cut, with the number of other lights.
    """
    names = joined_texels(names)
    names_text = some_of([name or "without a name" for name in names], room=MAX_NAME_CHARACTERS)
    if len(names) == 1 and TEXELS not in names[0] and is_of_texels(names[0]):
        return f"{'Texel' if start else 'texel'} {names_text}"
    if any(map(is_of_texels, names)):
        return names_text
    if all(re.search("light|lamp", name, re.IGNORECASE) for name in names):
        return names_text
    noun = "light" if len(names) == 1 else "lights"
    return f"{noun.capitalize() if start else noun} {names_text}"


def spoken_region(place: Place) -> str:
    """Return the region of the picture: `in the middle`, `top left`."""
    return spoken_ninth(place.region)


def spoken_ninth(region: tuple[int, int]) -> str:
    """Return the region of a row and a column, 0 to 2 each."""
    rows, columns = ("top", "middle", "bottom"), ("left", "middle", "right")
    row, column = rows[region[0]], columns[region[1]]
    if row == column == "middle":
        return "in the middle"
    if row == "middle":
        return f"on the {column}"
    return f"at the {row}" if column == "middle" else f"at the {row} {column}"


def spoken_where(place: Place) -> str:
    """Return `on the statue`, or the region of the picture."""
    if not place.object:
        return spoken_region(place)
    return f"on the {some_names([place.object.replace('_', ' ').strip()])}"


def spoken_place(place: Place) -> str:
    """Return a sentence on where light is missing, and which light."""
    place_text = f"{spoken_region(place)} ({spoken_percent(place.share)} of it)"
    change = spoken_difference(place.painted, place.reached)
    return (
        f"Most of what is out of reach is {place_text}: the paint is {change} than any mix of the "
        "lights."
    )


def spoken_difference(
    painted: tuple[float, float, float], reached: tuple[float, float, float]
) -> str:
    """Return how a painted colour differs from the reached one: `brighter and bluer`."""
    a, b = np.array(painted), np.maximum(np.array(reached), 0)
    bright_a, bright_b = float(luminance(a)), float(luminance(b))
    words = []
    if bright_a > 1.2 * bright_b:
        words.append("brighter")
    elif 1.2 * bright_a < bright_b:
        words.append("darker")
    if a.sum() > 0 and b.sum() > 0:
        shift = a / a.sum() - b / b.sum()
        main_channel = int(np.argmax(np.abs(shift)))
        if abs(shift[main_channel]) > COLOR_SHIFT:
            increase_words, decrease_words = (
                ("redder", "greener", "bluer"),
                ("cooler", "pinker", "yellower"),
            )
            words.append(
                increase_words[main_channel]
                if shift[main_channel] > 0
                else decrease_words[main_channel]
            )
    if not words:
        words = ["a little brighter" if bright_a > bright_b else "a little darker"]
    return " and ".join(words)


def spoken_percent(share: float) -> str:
    """Return `0.4 %`, `7 %`, `62 %`."""
    return f"{100 * share:.1f} %" if 0.0005 <= share < 0.0095 else f"{100 * share:.0f} %"


def spoken_drives(drives: Mapping[str, float]) -> str:
    """Return the drives of emitters, `red 100 %, white 8 %`, without those that are off."""
    lit = [f"{name} {spoken_percent(drive)}" for name, drive in drives.items() if drive > 0]
    return ", ".join(lit) or "all emitters off"


def spoken_lamp(light: LightSetting) -> str:
    """Return what a lamp of emitters does, `red 100 %, white 8 %`; of one with a colour wheel also
    how far its slot is from the colour that was solved for.
    """
    note = _slot_note(light)
    return f"{spoken_drives(light.drives)}{note and f' ({note})'}"


def _slot_note(light: LightSetting) -> str:
    return "" if light.slot_delta_e is None else f"ΔE {light.slot_delta_e:.1f} off"


def spoken_wheels(lights: Iterable[LightSetting]) -> str:
    """Return which slots were chosen for colour wheels, in a sentence; "" if none was."""
    slots = []
    for light in (x for x in lights if not x.part_of):
        if light.slot_delta_e is not None:
            slots.append(f"{light.name} at {light.slot}, {_slot_note(light)}")
        elif light.lamp is not None and light.lamp.behind:
            slots.append(f"{light.name} behind {light.lamp.behind}")
    if not slots:
        return ""
    return f"Colour wheels: {some_of(slots, '; ')}."


#: Which of several mixes of a lamp's emitters an answer has, by the preference.
PREFERENCE_TEXTS = {
    "watts": "the one that needs the least power",
    "white": "the one with the most light from white emitters",
    "fewest": "the one of the fewest emitters",
    "rf": "the one that renders colours best, as far as their spectra are known",
}


def spoken_preference(lights: Iterable[LightSetting]) -> str:
    """Return which mix of emitters lamps have, in a sentence; "" without lamps."""
    lamps = [x.lamp for x in lights if x.lamp is not None and not x.part_of and x.mix is None]
    preferences = [lamp.prefer for lamp in lamps if not lamp.is_wheel]
    if not preferences:
        return ""
    return (
        "Of the mixes of emitters that give the same light, each lamp has "
        f"{PREFERENCE_TEXTS[preferences[0]]}"
        + (", of those that have its Rf." if any(x.least_rf for x in lamps) else ".")
    )


#: Sentences about the highest Rf that was found.
OUT_OF_REACH = "is the most these emitters give at this colour"


def rendering_sentences(renderings: Mapping[str, LightRendering]) -> list[str]:
    """Return what lamps reach of the Rf that was asked for, and what it costs, a sentence each."""
    return [
        f"{name}: {_spoken_rendering(x)}."
        for name, x in renderings.items()
        if x.wanted_rf is not None
    ]


def _spoken_rendering(found: LightRendering) -> str:
    assert found.wanted_rf is not None
    if found.color is None:
        return "its light is coloured, and Rf compares whites"
    rf, most = (f"{round(x, 1):g}" for x in (found.color.rf, found.best_rf or found.color.rf))
    if found.color.rf >= found.wanted_rf:
        return f"Rf {rf}, as asked for" + _spoken_cost(found)
    is_held = found.held_mix_change is not None
    reason = "leaves the picture as it is" if is_held else OUT_OF_REACH
    text = f"Rf {rf} {reason}"
    if found.wanted_rf < 100:
        text += f"; {found.wanted_rf:g} was asked for"
    if is_held:
        text += (
            f". Rf {most} {OUT_OF_REACH}; the mix that was asked for changes the picture by "
            f"{found.held_mix_change:.1f} ΔE"
        )
        if found.wanted_rf < 100:
            text += ". Give the lamp a colour (color) to put Rf before the picture"
    return text + _spoken_cost(found)


def _spoken_cost(found: LightRendering) -> str:
    """Return what the Rf of a lamp costs, with what joins it to a sentence; "" for nothing."""
    watts, plain, rf = found.watts, found.plain_watts, found.plain_rf
    if watts is None or plain is None or rf is None or found.color is None:
        return ""
    spoken, spoken_plain = f"{watts:.3g} W", f"{plain:.3g} W"
    if spoken == spoken_plain:
        return f". It takes {spoken}, with that or without"
    return f". It takes {spoken}, instead of {spoken_plain} for Rf {round(rf, 1):g}"


def spoken_percents(shares: Iterable[float]) -> list[str]:
    """Return whole percentages of parts of a whole, which add up to the rounded sum.

    Each is at least 1 %. The parts that rounding changes most are adjusted.
    """
    exact = [100 * share for share in shares]
    percents = [max(1, round(x)) for x in exact]
    excess = sum(percents) - round(sum(exact))
    step = 1 if excess > 0 else -1
    for _ in range(abs(excess)):
        by_error = sorted(range(len(exact)), key=lambda k: step * (exact[k] - percents[k]))
        percents[next(k for k in by_error if percents[k] - step >= 1)] -= step
    return [f"{percent} %" for percent in percents]
