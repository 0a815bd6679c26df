"""The sections of the report on what constraints, and the choice of `colors`, cost the picture."""

from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint.arrays import Doubles
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, cct_and_duv, hue_name, to_8_bit
from lightpaint.display_text import some_names
from lightpaint.images import block_mean, denoised
from lightpaint.lighting import Choices, ColorChoice, Colors, Solution
from lightpaint.report.answer_pictures import CleanLooks
from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS
from lightpaint.report.measures import relative_residual
from lightpaint.report.page.figures import PagePicture, figure
from lightpaint.report.page.html import html
from lightpaint.report.phrases import spoken_percent

#: Least width in pixels of reduced pictures; a whole factor gives up to twice as much.
MIN_WIDTH = 320

#: Numbers of lights below and above the answer's that get a picture.
NEIGHBOURS = 2

#: The colours that lamps may have, in few words.
COLOR_MEANINGS: dict[Colors, str] = {
    "free": "any colour",
    "gentle": "their own colour, unless the painting clearly asks for another",
    "white": "whites, from warm to cool",
    "own": "their own colour; they only dim",
}

#: ΔE by which a closer choice is mentioned at once, and below which it is as close.
MIN_GAIN, SAME_DELTA_E = 1.0, 0.1


def constraints_section(
    basis: Basis,
    solution: Solution,
    free: Solution | None,
    *,
    transform: ViewTransform,
    looks: CleanLooks | None = None,
) -> Markup:
    """Return the best answer without constraints, `free`, beside the answer, from the basis.

    With `sparse`, also the errors of other numbers of lights. Empty without constraints.
    """
    if free is None:
        return Markup("")
    without, with_constraints = relative_residual(free), relative_residual(solution)
    pictures = [
        (free.weights, "Without constraints", f"{spoken_percent(without)} missed."),
        (solution.weights, "With the constraints", f"{spoken_percent(with_constraints)} missed."),
        *_neighbours(solution),
    ]
    curve, shown_rows = _curve(solution, free)
    return html(
        "constraints",
        without=without,
        with_constraints=with_constraints,
        curve=curve,
        shown_rows=shown_rows,
        figures=_figures(basis, pictures, transform, looks),
    )


def _curve(solution: Solution, free: Solution) -> tuple[list[dict[str, Any]], int]:
    """Return, with `sparse`, the errors by number of lights, and how many of them to show."""
    curve = solution.certificate.curve
    if not curve:
        return [], 0
    used_count, points = _used_count(solution), list(curve)
    if len(curve) > ROWS_SHOWN + SPARE_ROWS:
        nearest = sorted(curve, key=lambda point: abs(point[0] - used_count))
        points = sorted(nearest[: ROWS_SHOWN - 1])
    entries = [
        *(
            (_lights(count) + ", as asked" * (count == used_count), missed)
            for count, missed in points
        ),
        ("without constraints", relative_residual(free)),
        *((_lights(count), missed) for count, missed in curve if (count, missed) not in points),
    ]
    return [{"label": label, "missed": missed} for label, missed in entries], len(points) + 1


def _neighbours(solution: Solution) -> list[tuple[Doubles, str, str]]:
    """Return, with `sparse`, pictures with fewer and with more lights, as `_figures` takes them."""
    used_count, missed_with = _used_count(solution), dict(solution.certificate.curve)
    return [
        (weights, f"With {_lights(count)}", f"{spoken_percent(missed_with[count])} missed.")
        for count, weights in solution.tried
        if count in missed_with and 0 < abs(count - used_count) <= NEIGHBOURS
    ]


def _figures(
    basis: Basis,
    pictures: list[tuple[Doubles, str, str]],
    transform: ViewTransform,
    looks: CleanLooks | None,
) -> list[Markup]:
    """Return pictures of weights (n, 3), each with its name and a caption."""
    factor = max(1, min(basis.size[1] // MIN_WIDTH, *basis.size))
    figures = []
    for weights, name, caption in pictures:
        # Reduced it is quick to denoise, and needs no features.
        image = np.asarray(block_mean(basis.mix(weights), factor), np.float32)
        pixels = transform.encode(denoised(image) if looks and looks.is_clean else image)
        picture = PagePicture(name, f"{name}, predicted.", to_8_bit(pixels))
        figures.append(figure(picture, caption))
    return figures


def _used_count(solution: Solution) -> int:
    """Return the number of lights of the curve that the answer has."""
    most = solution.problem.constraints.sparse or 0
    return max((count for count, _ in solution.certificate.curve if count <= most), default=0)


def _lights(count: int) -> str:
    return f"{count} light{'' if count == 1 else 's'}"


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
