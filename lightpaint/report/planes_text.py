"""Measuring planes of an answer in words, and in rows of tables."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from lightpaint import photometry
from lightpaint.lighting import PlanesAnswer, WishOutcome

#: Headings of a table of observers.
GLARE_HEADINGS = ("observer", "UGR", "background cd/m²", "most from")

#: Headings of a table of planes.
HEADINGS = ("plane", "Em lx", "U0", "least lx", "most lx", "wished for", "W/m² per 100 lx")

#: A step of what is asked for that people think in, for prices: lx, a share, and watts.
STEPS = {"mean": (10.0, "last 10 lx on"), "uniformity": (0.01, "last .01 of uniformity on")}

#: Price in watts below which it is not worth a sentence.
LEAST_PRICE = 0.05

#: Cost of wishes in CIEDE2000 below which they cost the picture nothing that shows.
LEAST_COST = 0.05


def glare_rows(readings: Mapping[str, photometry.GlareReading]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each observer, in the order of `GLARE_HEADINGS`. readings: by title."""
    for title, reading in readings.items():
        yield title, rating_text(reading), f"{reading.background:.3g}", reading.strongest


def rating_text(reading: photometry.GlareReading) -> str:
    """Return the UGR with half of its 95 % interval."""
    if reading.rating is None:
        return "unknown"
    if reading.rating < photometry.LEAST_RATING:
        return f"< {photometry.LEAST_RATING:g}"
    return f"{reading.rating:.1f} ± {max(reading.interval, 0.1):.1f}"


def glare_sentences(readings: Mapping[str, photometry.GlareReading]) -> Iterator[str]:
    """Yield what readers of the table have to know. readings: by title."""
    for title, reading in readings.items():
        if reading.rating is None:
            yield f"The UGR of {title} cannot be told: {reading.reason}."
        elif reading.rating >= photometry.LEAST_RATING and reading.is_of_unusual_size:
            yield (
                f"The UGR of {title} comes from {reading.strongest}, which fills "
                f"{reading.solid_angle:.2g} sr: it is made for {photometry.LEAST_ANGLE:g} to "
                f"{photometry.LARGEST_ANGLE:g} sr."
            )


def plane_rows(answer: PlanesAnswer) -> Iterator[tuple[str, ...]]:
    """Yield a row for each plane, in the order of `HEADINGS`."""
    planes = {plane.name: plane for plane in answer.wished.illuminance.planes}
    for (case, name), reading in answer.readings.items():
        yield (
            photometry.plane_title(name, case),
            f"{reading.mean:.0f} ± {photometry.NORMAL_95 * reading.mean_error:.1g}",
            f"{reading.uniformity:.2f} ± {photometry.NORMAL_95 * reading.uniformity_error:.1g}",
            f"{reading.least:.0f}",
            f"{reading.most:.0f}",
            wishes_text(planes[name]),
            _density(answer, reading),
        )


def wishes_text(plane: photometry.MeasuringPlane) -> str:
    """Return what is wished for on a plane in few words; "" for nothing."""
    wishes = plane.wishes
    parts = [] if wishes.mean is None else [f"{wishes.mean:g} lx"]
    parts += [] if wishes.uniformity is None else [f"U0 {wishes.uniformity:g}"]
    parts += [] if wishes.most is None else [f"at most {wishes.most:g} lx"]
    parts += [f"{x.at_least:g} of {x.to}" for x in wishes.ratios]
    return ", ".join(parts)


def glare_by_title(answer: PlanesAnswer) -> dict[str, photometry.GlareReading]:
    """Return the glare that observers see, by name of the observer and case."""
    return {
        photometry.plane_title(name, case): x for (case, name), x in answer.glare_readings.items()
    }


def planes_sentences(answer: PlanesAnswer) -> list[str]:
    """Return what is missed, what the power is, what the wishes cost, what glare is unknown, and
    where the figures of presets come from.
    """
    sentences = ["The wishes and limits did not bind this answer."] if answer.are_ignored else []
    sentences += [_missed(answer, outcome) for outcome in answer.missed]
    if not answer.missed and answer.outcomes:
        what = "All wishes for the planes are" if answer.readings else "The limit of power is"
        sentences.append(f"{what} met.")
    if answer.watts is not None:
        power = f"The lamps take {answer.watts:.4g} W"
        if answer.floor_m2:
            power += f", {answer.watts / answer.floor_m2:.3g} W/m²"
        sentences.append(f"{power}.")
    sentences += _prices(answer)
    if answer.cost_delta_e is not None:
        cost = answer.cost_delta_e
        text = f"is by ΔE {cost:.1f} further from" if cost >= LEAST_COST else "comes as near to"
        sentences.append(f"With these wishes the answer {text} what was painted.")
    if answer.budget_delta_e is not None and answer.budget_delta_e >= LEAST_COST:
        limit, cost = answer.binding_limit, answer.budget_delta_e
        sentences.append(f"Of that, the limit of {limit:.4g} W costs ΔE {cost:.1f}.")
    return [*sentences, *glare_sentences(glare_by_title(answer)), *_preset_sentences(answer)]


def planes_numbers(answer: PlanesAnswer) -> dict[str, Any]:
    """Return the planes as numbers of report.json."""
    planes = {}
    for (case, name), reading in answer.readings.items():
        planes[photometry.plane_title(name, case)] = {
            "mean_lx": reading.mean,
            "mean_error_lx": reading.mean_error,
            "uniformity": reading.uniformity,
            "uniformity_error": reading.uniformity_error,
            "least_lx": reading.least,
            "most_lx": reading.most,
            "points": reading.points,
            "wishes": [
                _outcome_numbers(x)
                for x in answer.outcomes
                if (x.wish.case, x.wish.plane) == (case, name)
            ],
        }
    budget = [x.wish.asked for x in answer.outcomes if x.wish.kind == "power"]
    return {
        "planes": planes,
        "observers": {
            name: photometry.glare_document(x) for name, x in glare_by_title(answer).items()
        },
        "watts": answer.watts,
        "budget_watts": min(budget, default=None),
        "floor_m2": answer.floor_m2 or None,
        "cost_delta_e": answer.cost_delta_e,
        "budget_delta_e": answer.budget_delta_e,
    }


def _preset_sentences(answer: PlanesAnswer) -> Iterator[str]:
    """Yield where the figures of presets come from."""
    presets = {plane.wishes.preset for plane in answer.wished.illuminance.planes} - {""}
    for name in sorted(presets):
        yield f"{name}: {photometry.PRESETS[name]}."


def _outcome_numbers(outcome: WishOutcome) -> dict[str, Any]:
    wish = outcome.wish
    return {
        "kind": wish.kind,
        "asked": wish.asked,
        "to": wish.to or None,
        "reached": outcome.reached,
        "is_met": outcome.is_met,
        "watts_per_unit": outcome.price,
    }


def _density(answer: PlanesAnswer, reading: photometry.PlaneReading) -> str:
    """Return the power per m² and 100 lx; "" where something of that is unknown."""
    if answer.watts is None or not answer.floor_m2 or not reading.mean:
        return ""
    return f"{answer.watts / answer.floor_m2 / (reading.mean / 100):.2f}"


def _missed(answer: PlanesAnswer, outcome: WishOutcome) -> str:
    wish, reached = outcome.wish, outcome.reached
    title = photometry.plane_title(wish.plane, wish.case)
    if wish.kind == "mean":
        text = f"{title}: {reached:.0f} of {wish.asked:g} lx"
        if answer.are_ignored:
            return f"{text}."
        if not answer.is_reached(wish.plane):
            return f"{text}: none of the lamps that the answer adjusts reaches it."
        if (limit := answer.binding_limit) is not None:
            return f"{text}, as much as the limit of {limit:.4g} W leaves."
        if not answer.all_at_full:
            return f"{text}, as much as the other wishes leave."
        advice = _more_lamps(answer, outcome)
        return f"{text}: all lamps are at full{advice}."
    if wish.kind == "uniformity":
        return f"{title}: a uniformity of {reached:.2f}, wished for {wish.asked:g}."
    if wish.kind == "max":
        return f"{title}: up to {reached:.0f} lx, wished for at most {wish.asked:g}."
    if wish.kind == "ratio":
        return f"{title}: {reached:.2f} of the mean of {wish.to}, wished for {wish.asked:g}."
    if answer.are_ignored:  # what they take follows
        return f"Only {wish.asked:g} W are allowed."
    return f"The lamps take {reached:.4g} W, where {wish.asked:g} W are allowed."


def _more_lamps(answer: PlanesAnswer, outcome: WishOutcome) -> str:
    """Return how many more lamps a plane needs, by a linear estimate."""
    wish, reached, count = outcome.wish, outcome.reached, answer.lamps
    if (found := answer.more_luminaires(outcome)) is not None:
        more, name = found
        return f"; about {more} more of {name} would do"
    more = math.ceil(count * (wish.asked / reached - 1)) if reached > 0 else 0
    these = "this one" if count == 1 else f"these {count}"
    lamps = "one more lamp" if more == 1 else f"{more} more lamps"
    return f"; about {lamps} like {these} would do" if more else ""


def _prices(answer: PlanesAnswer) -> Iterator[str]:
    """Yield what the last steps of wishes cost, where they cost power."""
    for outcome in () if answer.missed else answer.outcomes:
        if outcome.price is None or outcome.wish.kind not in STEPS:
            continue
        step, text = STEPS[outcome.wish.kind]
        if (watts := step * outcome.price) >= LEAST_PRICE:
            title = photometry.plane_title(outcome.wish.plane, outcome.wish.case)
            yield f"The {text} {title} cost {watts:.2g} W."
