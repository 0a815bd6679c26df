"""The sections of the report on uncertainty, on the error, and on what constraints, and the choice
of `colors`, cost the picture.
"""

from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint import lighting
from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, cct_and_duv, hue_name, luminance, to_8_bit
from lightpaint.display_text import some_names
from lightpaint.images import Size, block_mean, by_bands, denoised, whole_factor
from lightpaint.report import answer_pictures, diagnosis_sentences
from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS
from lightpaint.report.measures import brightness, energy_shares, relative_errors, relative_residual
from lightpaint.report.page.figures import PagePicture, figure, signed_scale
from lightpaint.report.page.html import html
from lightpaint.report.phrases import spoken_percent

#: Least width in pixels of reduced pictures; a whole factor gives up to twice as much.
MIN_WIDTH = 320

#: Numbers of lights below and above the answer's that get a picture.
NEIGHBOURS = 2

#: The colours that lamps may have, in few words.
COLOR_MEANINGS: dict[lighting.Colors, str] = {
    "free": "any colour",
    "gentle": "their own colour, unless the painting clearly asks for another",
    "white": "whites, from warm to cool",
    "own": "their own colour; they only dim",
}

#: ΔE by which a closer choice is mentioned at once, and below which it is as close.
MIN_GAIN, SAME_DELTA_E = 1.0, 0.1

#: Rows of both tables that are not folded.
SHOWN_ROWS = 6

#: Bounds with a smaller share of the miss are not worth a row.
SMALLEST_GAIN = 0.002


def constraints_section(
    basis: Basis,
    solution: lighting.Solution,
    free: lighting.Solution | None,
    *,
    transform: ViewTransform,
    looks: answer_pictures.CleanLooks | None = None,
) -> Markup:
    """Return the best answer without constraints, `free`, beside the answer, from the basis.

    With `sparse`, also the errors of other numbers of lights. Empty without constraints.
    """
    if free is None:
        return Markup("")
    without, with_constraints = relative_residual(free), relative_residual(solution)
    used_count, missed_with = _used_count(solution), dict(solution.certificate.curve)
    pictures = [
        (free.weights, "Without constraints", f"{spoken_percent(without)} missed."),
        (solution.weights, "With the constraints", f"{spoken_percent(with_constraints)} missed."),
        *[
            (weights, f"With {_lights(count)}", f"{spoken_percent(missed_with[count])} missed.")
            for count, weights in solution.tried
            if count in missed_with and 0 < abs(count - used_count) <= NEIGHBOURS
        ],
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


def _curve(
    solution: lighting.Solution, free: lighting.Solution
) -> tuple[list[dict[str, Any]], int]:
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


def _figures(
    basis: Basis,
    pictures: list[tuple[Doubles, str, str]],
    transform: ViewTransform,
    looks: answer_pictures.CleanLooks | None,
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


def _used_count(solution: lighting.Solution) -> int:
    """Return the number of lights of the curve that the answer has."""
    most = solution.problem.constraints.sparse or 0
    return max((count for count, _ in solution.certificate.curve if count <= most), default=0)


def _lights(count: int) -> str:
    return f"{count} light{'' if count == 1 else 's'}"


def spoken_choice(choice: lighting.ColorChoice, chosen: lighting.ColorChoice) -> str:
    """Return `free: ΔE 2.1 instead of 2.6, but pendant turns green`."""
    gains = chosen.delta_e - choice.delta_e
    text = f"ΔE {choice.delta_e:.1f} instead of {chosen.delta_e:.1f}"
    if abs(gains) < SAME_DELTA_E:
        text = f"as close (ΔE {choice.delta_e:.1f})"
    turns = spoken_turn(choice)
    joint = ", but " if gains >= SAME_DELTA_E else ", and "
    return f"{choice.colors}: {text}{joint + turns if turns else ''}"


def spoken_turn(choice: lighting.ColorChoice) -> str:
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


def closer_choice(choices: lighting.Choices) -> str:
    """Return `free: ΔE 2.1 …`, if another choice is notably closer; else ""."""
    chosen = next((choice for choice in choices if choice.is_chosen), None)
    best = min(choices, key=lambda choice: choice.delta_e, default=None)
    if chosen is None or best is None or chosen.delta_e - best.delta_e < MIN_GAIN:
        return ""
    return spoken_choice(best, chosen)


def colors_section(choices: lighting.Choices) -> Markup:
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


def _change_cell(choice: lighting.ColorChoice, chosen: lighting.ColorChoice) -> str:
    """Return the text of a cell of the table."""
    if choice is chosen:
        return ""
    gains = chosen.delta_e - choice.delta_e
    closeness = "as close" if abs(gains) < SAME_DELTA_E else "closer" if gains > 0 else "farther"
    return "; ".join(filter(None, (closeness, spoken_turn(choice))))


def sure_section(
    basis: Basis, solution: lighting.Solution, uncertainty: lighting.Uncertainty | None
) -> Markup:
    """Return the section on uncertainty: a sentence, and the lights with notable errors."""
    if uncertainty is None:
        return Markup("")
    shares = energy_shares(basis, solution.lighting)
    errors, spoken = (
        relative_errors(uncertainty),
        diagnosis_sentences.spoken_errors(uncertainty, len(shares)),
    )
    solved, low, high = brightness(uncertainty)
    effect = np.where(np.isfinite(errors) & ~uncertainty.untold, errors, 0) * shares
    # Lights that are off and may be on come last, by their possible brightness.
    order = sorted(range(len(shares)), key=lambda k: (-effect[k], -high[k]))
    lights = [
        {
            "name": basis.names[k],
            "solved": f"{solved[k]:.3g}",
            "interval": f"{low[k]:.3g} … {high[k]:.3g}",
            "error": spoken[k] if np.isfinite(errors[k]) or uncertainty.untold[k] else "–",
            "effect": f"± {spoken_percent(float(effect[k]))}" if effect[k] else "–",
        }
        for k in order
        if errors[k] > 0
    ]
    return html(
        "uncertainty",
        sentence=diagnosis_sentences.uncertainty_sentence(basis, solution, uncertainty),
        excess=uncertainty.relative_excess,
        steps=_steps(solution),
        lights=lights,
        shown_rows=SHOWN_ROWS,
    )


def _steps(solution: lighting.Solution) -> str:
    """Return the measures against noise, besides sampling, in words."""
    steps = []
    if solution.problem.noise_removed:
        steps.append(
            f"{spoken_percent(solution.problem.noise_removed)} of the noise power was "
            "removed from the equations"
        )
    if solution.problem.refinement is not None:
        steps.append(
            "the answer was refined by a render of the mix, which decided "
            f"{spoken_percent(solution.problem.refinement.share)} of the last step"
        )
    text = "; ".join(steps)
    return text[:1].upper() + text[1:]


#: Advice for light that no dimmer can give.
OTHER_PLACES = (
    "What no dimmer reaches, a light that hangs or points elsewhere may. Ask for suggestions: the "
    "best turn of a light and the best new light, with a picture of each and the lines to paste. "
    "Or let lights move, turn or be added, in the lights file or by options."
)


def missed_section(
    solution: lighting.Solution,
    diagnosis: lighting.Diagnosis | None,
    current: Floats,
    *,
    transform: ViewTransform,
    appearance: lighting.Appearance | None = None,
    can_place: bool = False,
) -> Markup:
    """Return the section on the error: sentences, shares, maps and bounds.

    can_place: whether lights of the scene could move, and none was allowed to.
    """
    if diagnosis is None:
        return Markup("")
    sentences = list(diagnosis_sentences.error_sentences(diagnosis, appearance))
    if can_place and appearance is not None and appearance.is_out_of_reach:
        sentences.append(OTHER_PLACES)
    return html(
        "difference",
        sentences=sentences,
        shares=_shares(diagnosis),
        figures=_maps(solution, diagnosis, current, transform=transform),
        bounds=_bounds(diagnosis),
        left_out=diagnosis.bounds_left_out,
        shown_rows=SHOWN_ROWS,
    )


def _shares(diagnosis: lighting.Diagnosis) -> list[dict[str, Any]]:
    """Return the parts of the error, with their shares in words and as numbers."""
    d = diagnosis
    by_what = "by zero or by the constraints" if d.is_constrained else "needs light below zero"
    parts = [
        ("unreachable", "out of reach of any mix", d.unreachable),
        ("forbidden", f"forbidden: {by_what}", d.forbidden),
    ]
    optional_parts = [
        ("compromise", "given up for the other views", d.compromise),
        ("noise", "noise of the basis", d.noise),
        ("painting_noise", "grain, edges and texture of the painting", d.painting_noise),
    ]
    parts += [part for part in optional_parts if part[2] > 0]
    percents = diagnosis_sentences.spoken_shares(d)
    shares: list[dict[str, Any]] = []
    for key, label, energy in parts:
        share = d.share(energy)
        text = percents.get(key, spoken_percent(share))
        shares.append({"label": label, "text": text, "share": share})
    if d.ignored > 0:
        times = d.ignored / d.total if d.total > 0 else np.inf
        text = f"{times:.2g} times as much" if np.isfinite(times) else "all"
        label = "elsewhere, where it does not count"
        shares.append({"label": label, "text": text, "share": None})
    return shares


def _maps(
    solution: lighting.Solution,
    diagnosis: lighting.Diagnosis,
    current: Floats,
    *,
    transform: ViewTransform,
) -> list[Markup]:
    parts = [
        (
            "Out of reach",
            diagnosis.unreachable_map,
            "What no mix of the lights can make, even with negative light.",
        ),
        (
            "Forbidden",
            diagnosis.forbidden_map,
            "Would need light below zero, or beyond the constraints."
            + " Includes what is given up for other views." * (diagnosis.compromise > 0),
        ),
    ]
    limit = maps_limit(solution, diagnosis, transform=transform)
    share, figures = answer_pictures.coverage(solution.importance), []
    for name, image, caption in parts:
        if name == "Forbidden" and diagnosis.share(diagnosis.avoidable) < SMALLEST_GAIN:
            continue  # an empty picture
        # As in the residual's map: predicted − painted, so that bright is too bright.
        shown = answer_pictures.over_unpainted(
            lambda x: answer_pictures.diverging(-luminance(x) / limit),
            image,
            share,
            current,
            transform=transform,
            finish=to_8_bit,
        )
        figures.append(
            figure(
                PagePicture(name, f"False-colour map: {name}.", shown),
                caption,
                signed_scale(limit),
            )
        )
    if diagnosis.ignored > 0:
        figures.append(_ignored_map(diagnosis.ignored_map, limit, current.shape[:2]))
    return figures


def _ignored_map(ignored: Floats, limit: float, size: Size) -> Markup:
    """Return the figure of the error that does not count, at a size. limit: of the scale."""
    small = block_mean(ignored, whole_factor(ignored.shape, size) or 1)
    colours = by_bands(lambda x: to_8_bit(answer_pictures.diverging(-x / limit)), small)
    return figure(
        PagePicture("Not counted", "False-colour map of what does not count.", colours),
        "The difference where the importance is small.",
        signed_scale(limit),
    )


def maps_limit(
    solution: lighting.Solution, diagnosis: lighting.Diagnosis, *, transform: ViewTransform
) -> float:
    """Return the end of the scale of all maps of the error."""
    counted = solution.importance > 0
    maps = (diagnosis.unreachable_map, diagnosis.forbidden_map)
    sizes = np.concatenate([np.abs(by_bands(luminance, image)[counted]) for image in maps])
    return answer_pictures.round_up(
        max(float(np.percentile(sizes, 99)), answer_pictures.FINEST_SCALE * 2.0**-transform.stops)
    )


def _bounds(diagnosis: lighting.Diagnosis) -> list[dict[str, Any]]:
    """Return the rows of the limits whose removal would gain most."""
    units = {"emission": "unit of R, G, B", "luminance": "unit of luminance"}
    return [
        {
            "lights": bound.lights,
            "words": _bound_words(bound),
            "gain": diagnosis.gain_share(bound),
            "slope": _slope(bound),
            "unit": units.get(bound.per, "current brightness"),
        }
        for bound in diagnosis.bounds
        if diagnosis.gain_share(bound) >= SMALLEST_GAIN
    ]


def _bound_words(bound: lighting.Bound) -> str:
    """Return the bound in words; zero is called zero, unlike a wish for off."""
    channels = diagnosis_sentences.spoken_hold(bound)
    return channels.replace("off", "zero") if bound.kind == "zero" else channels


def _slope(bound: lighting.Bound) -> str:
    numbers = [f"{value:+.3g}".replace("-", "−") if value else "0" for value in bound.multiplier]
    return ", ".join(numbers)
