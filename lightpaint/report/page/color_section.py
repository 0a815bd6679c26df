"""The answers of all choices of `colors`, in words and as a part of the report."""

import numpy as np
from markupsafe import Markup

from lightpaint.colour.color import cct_and_duv
from lightpaint.colour.hue_names import hue_name
from lightpaint.display_text import some_names
from lightpaint.lighting.analysis.appearance.color_choices import Choices, ColorChoice
from lightpaint.lighting.fit import Colors
from lightpaint.report.page.html import html

#: The colours that lamps may have, in few words.
COLOR_MEANINGS: dict[Colors, str] = {
    "free": "any colour",
    "gentle": "their own colour, unless the painting clearly asks for another",
    "white": "whites, from warm to cool",
    "own": "their own colour; they only dim",
}

#: ΔE by which a closer choice is mentioned at once, and below which it is as close.
MIN_GAIN, SAME_DELTA_E = 1.0, 0.1


def spoken_choice(choice: ColorChoice, chosen: ColorChoice) -> str:
    """Return `free: ΔE 2.1 instead of 2.6, but pendant turns green`."""
    gains = chosen.delta_e - choice.delta_e
    text = f"ΔE {choice.delta_e:.1f} instead of {chosen.delta_e:.1f}"
    if abs(gains) < SAME_DELTA_E:
        text = f"as close (ΔE {choice.delta_e:.1f})"
    turns = spoken_turn(choice)
    joint = ", but " if gains >= SAME_DELTA_E else ", and "
    return f"{choice.colors}: {text}{joint + turns if turns else ''}"


def spoken_turn(choice: ColorChoice) -> str:
    """Return `pendant turns green`; "" if no light visibly changes its hue."""
    if not choice.light:
        return ""
    before, after = (np.array(x) for x in (choice.before, choice.color))
    words = [hue_name(x) for x in (before, after)]
    whites = [cct_and_duv(x) for x in (before, after)]
    if words[0] != words[1]:
        word = words[1]
    elif words[0].endswith("white") and whites[0] and whites[1]:
        word = "warmer" if whites[1][0] < whites[0][0] else "cooler"
    else:
        deeper = np.ptp(after) / after.max() > np.ptp(before) / before.max()
        word = f"a {'deeper' if deeper else 'paler'} {words[1]}"
    return f"{some_names([choice.light])} turns {word}"


def closer_choice(choices: Choices) -> str:
    """Return `free: ΔE 2.1 …`, if another choice is notably closer; else ""."""
    chosen = next((choice for choice in choices if choice.is_chosen), None)
    best = min(choices, key=lambda choice: choice.delta_e, default=None)
    if chosen is None or best is None or chosen.delta_e - best.delta_e < MIN_GAIN:
        return ""
    return spoken_choice(best, chosen)


def colors_section(choices: Choices) -> Markup:
    """Return the section on the choices; empty if there are none."""
    chosen = next((choice for choice in choices if choice.is_chosen), None)
    if chosen is None:
        return Markup("")
    shown = [
        {
            "name": choice.colors,
            "meaning": COLOR_MEANINGS[choice.colors],
            "is_chosen": choice.is_chosen,
            "delta_e": choice.delta_e,
            "change": _change_cell(choice, chosen),
        }
        for choice in choices
    ]
    return html("colors", choices=shown)


def _change_cell(choice: ColorChoice, chosen: ColorChoice) -> str:
    """Return the text of a cell of the table."""
    if choice is chosen:
        return ""
    gains = chosen.delta_e - choice.delta_e
    closeness = "as close" if abs(gains) < SAME_DELTA_E else "closer" if gains > 0 else "farther"
    return "; ".join(filter(None, (closeness, spoken_turn(choice))))
