"""The sections of the report on uncertainty and on the error."""

from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, luminance, to_8_bit
from lightpaint.images import by_bands
from lightpaint.lighting import Appearance, Bound, Diagnosis, Solution, Uncertainty
from lightpaint.report.answer_pictures import (
    FINEST_SCALE,
    coverage,
    diverging,
    over_unpainted,
    round_up,
)
from lightpaint.report.diagnosis_sentences import (
    error_sentences,
    spoken_errors,
    spoken_hold,
    spoken_shares,
    uncertainty_sentence,
)
from lightpaint.report.measures import brightness, energy_shares, relative_errors
from lightpaint.report.page.figures import PagePicture, figure, signed_scale
from lightpaint.report.page.html import html
from lightpaint.report.phrases import spoken_percent

#: Rows of both tables that are not folded.
SHOWN_ROWS = 6

#: Bounds with a smaller share of the miss are not worth a row.
SMALLEST_GAIN = 0.002


def sure_section(basis: Basis, solution: Solution, uncertainty: Uncertainty | None) -> Markup:
    """Return the section on uncertainty: a sentence, and the lights with notable errors."""
    if uncertainty is None:
        return Markup("")
    shares = energy_shares(basis, solution.lighting)
    errors, spoken = relative_errors(uncertainty), spoken_errors(uncertainty, len(shares))
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
        sentence=uncertainty_sentence(basis, solution, uncertainty),
        excess=uncertainty.relative_excess,
        steps=_steps(solution),
        lights=lights,
        shown_rows=SHOWN_ROWS,
    )


def _steps(solution: Solution) -> str:
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
    solution: Solution,
    diagnosis: Diagnosis | None,
    current: Floats,
    *,
    transform: ViewTransform,
    appearance: Appearance | None = None,
    can_place: bool = False,
) -> Markup:
    """Return the section on the error: sentences, shares, maps and bounds.

    can_place: whether lights of the scene could move, and none was allowed to.
    """
    if diagnosis is None:
        return Markup("")
    sentences = list(error_sentences(diagnosis, appearance))
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


def _shares(diagnosis: Diagnosis) -> list[dict[str, Any]]:
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
        ("painting_noise", "noise of the painting", d.painting_noise),
    ]
    parts += [part for part in optional_parts if part[2] > 0]
    percents = spoken_shares(d)
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
    solution: Solution, diagnosis: Diagnosis, current: Floats, *, transform: ViewTransform
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
    share, figures = coverage(solution.importance), []
    for name, image, caption in parts:
        if name == "Forbidden" and diagnosis.share(diagnosis.avoidable) < SMALLEST_GAIN:
            continue  # an empty picture
        # As in the residual's map: predicted − painted, so that bright is too bright.
        shown = over_unpainted(
            lambda x: diverging(-luminance(x) / limit),
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
        figures.append(_ignored_map(diagnosis, limit))
    return figures


def _ignored_map(diagnosis: Diagnosis, limit: float) -> Markup:
    """Return the figure of the error that does not count. limit: of the scale."""
    colours = by_bands(lambda x: to_8_bit(diverging(-x / limit)), diagnosis.ignored_map)
    return figure(
        PagePicture("Not counted", "False-colour map of what does not count.", colours),
        "The difference where the importance is small.",
        signed_scale(limit),
    )


def maps_limit(solution: Solution, diagnosis: Diagnosis, *, transform: ViewTransform) -> float:
    """Return the end of the scale of all maps of the error."""
    counted = solution.importance > 0
    maps = (diagnosis.unreachable_map, diagnosis.forbidden_map)
    sizes = np.concatenate([np.abs(by_bands(luminance, image)[counted]) for image in maps])
    return round_up(max(float(np.percentile(sizes, 99)), FINEST_SCALE * 2.0**-transform.stops))


def _bounds(diagnosis: Diagnosis) -> list[dict[str, Any]]:
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


def _bound_words(bound: Bound) -> str:
    """Return the bound in words; zero is called zero, unlike a wish for off."""
    channels = spoken_hold(bound)
    return channels.replace("off", "zero") if bound.kind == "zero" else channels


def _slope(bound: Bound) -> str:
    numbers = [f"{value:+.3g}".replace("-", "−") if value else "0" for value in bound.multiplier]
    return ", ".join(numbers)
