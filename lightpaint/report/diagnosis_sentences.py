"""Sentences on an answer: why it does not look like the painting, how certain it is, which samples
would make it more certain, and which options of the fit influence it.
"""

from collections.abc import Sequence
from typing import Any

from lightpaint.basis import Basis, joined_texels
from lightpaint.display_text import some_names, some_of
from lightpaint.lighting import (
    Appearance,
    Bound,
    Delivery,
    Diagnosis,
    Lighting,
    LightSetting,
    Loosening,
    Reason,
    Solution,
    Uncertainty,
    error_shares,
    main_deliveries,
    mean_shares,
    newest_delivery,
    spoken_share,
)
from lightpaint.report.measures import (
    brightness,
    energy_shares,
    halving_spp,
    is_by_painting,
    most_uncertain,
    relative_errors,
)
from lightpaint.report.phrases import (
    CHANNELS,
    NO_CLOSER_TEXT,
    spoken_changed,
    spoken_lights,
    spoken_percent,
    spoken_percents,
    spoken_place,
    spoken_progress,
)
from lightpaint.sentences import Hint, Sentence, Word

#: The sentence for an answer without error.
NO_ERROR = "The lights can make what is painted."

#: The argument that lets lights have any colour, for `bound_sentences`.
ANY_COLOR = Hint("colors", Word("free"))

#: Share of the error, or of a light, that is too small to mention.
MIN_SHARE = 0.05

#: The same for a light that is switched off, which is easily switched on.
MIN_SWITCHED_OFF_SHARE = 0.01

#: Clauses on constraints and their release: for one light, and for several.
RELEASE_CLAUSES = {
    "off": ("switched off, as asked; switching it on", "switched off, as asked; switching them on"),
    "lock": ("locked; adjusting it", "locked; adjusting them"),
    "limits": ("at a limit; removing it", "at their limits; removing them"),
    "colour": ("limited in colour; any other colour", "limited in colour; other colours"),
    "emitters": (
        "at the limits of its emitters; stronger or other ones",
        "at the limits of their emitters; stronger or other ones",
    ),
    "tie": (
        "tied to other lights; adjusting it by itself",
        "tied together; adjusting each by itself",
    ),
}

#: The same for all lights together.
JOINT_RELEASE_CLAUSES = {
    "colors": "Lights keep their colours; ",
    "sparse": "The number of lights is limited; allowing more",
    "prefer_current": "Lights are pulled towards their current setting; leaving them free",
    "near": "Lights stay near the lighting that you started from; leaving them free",
    "planes": "Wishes for measuring planes come first; leaving them out",
}

#: Texts for a light without a meaningful error: in a table, and in a sentence.
UNDETERMINED = "undetermined"

#: Upper end of an interval, relative to the light, beyond which percents say nothing.
MAX_TIMES = 10.0

UNTOLD_HERE = f"{UNDETERMINED} at this number of samples"

#: Maximum number of wishes in a list of sentences.
MAX_WISHES = 4

#: Share of an only wish below which a headline begins with its being out of reach.
HALF = 0.5

#: What may bring a wish: where no light reaches it, where none reaches it alone (in a picture that
#: is painted everywhere, and in others), where samples hide it, where a light for it lights
#: something else, too, and where the light that makes it is not adjusted.
REACH_ADVICE = "A light that hangs or points elsewhere may reach it."
NEW_LIGHT_ADVICE = "Add a light for it."
ALONE_ADVICE = "Add a light for it, or paint the rest as well."
SAMPLES_ADVICE = "Render more samples."
SPILL_ADVICE = "More importance, or lights that move, may help."
FIXED_ADVICE = "Importance cannot help, as this light stays as it is: adjust it, too."


def error_sentences(
    diagnosis: Diagnosis,
    appearance: Appearance | None = None,
    *,
    holds: Sequence[str] | None = None,
) -> list[str]:
    """Return at most five sentences on why it does not look like the painting, the main one first.

    appearance: the result of `compare_appearance`, whose reasons go before single bounds. holds:
    instead of the sentences of `bound_sentences`.
    """
    d = diagnosis
    if not (parts := spoken_shares(d)):
        return [NO_ERROR]
    # Fixed lights have a separate bound below.
    lights = "the adjusted lights" if any(x.kind == "kept" for x in d.bounds) else "the lights"
    words = {
        "unreachable": f"is out of reach of any mix of {lights}{reach_clause(appearance)}",
        "forbidden": "would need other limits of the lights or light below zero"
        if d.is_constrained
        else "would need light below zero",
        "compromise": "is given up for the other views",
        "noise": "is noise of the basis",
        "painting_noise": painting_noise_clause(d),
    }
    shares = [f"{share} {words[part]}" for part, share in parts.items()]
    sentences = [f"Of the difference (in energy), {', '.join(shares)}."]
    is_told = appearance is not None and appearance.place is not None  # by the headline
    if d.place is not None and not is_told and d.share(d.unreachable) >= MIN_SHARE:
        sentences.append(spoken_place(d.place))
    return [*sentences, *(bound_sentences(d, appearance) if holds is None else holds)]


def spoken_shares(diagnosis: Diagnosis) -> dict[str, str]:
    """Return the percentage of each part of the error that counts, the largest first.

    Rounding is adjusted so that they add up; sentences and tables show these same numbers.
    """
    parts = error_shares(diagnosis)
    return dict(zip(parts, spoken_percents(parts.values()), strict=True))


def reach_clause(appearance: Appearance | None) -> str:
    """Return on what it depends that light is out of reach; "" if on nothing but the lights.

    ` as these samples show them` of lights, if samples do not determine a light for it; ` while the
    rest is held` if that keeps the lights from the paint.
    """
    if appearance is None:
        return ""
    is_held = any(reason.kind == "hold" for reason in appearance.reasons)
    shown = " as these samples show them" if appearance.is_hidden_by_noise else ""
    return f"{shown} while the rest is held" if is_held else shown


def bound_sentences(
    diagnosis: Diagnosis, appearance: Appearance | None = None, *, any_color: str | Hint = ANY_COLOR
) -> list[str]:
    """Return at most two sentences on limits of the lights, the most important first, and one on
    lights that are down for unpainted parts alone.

    appearance: the result of `compare_appearance`; its reasons come with their shares, and single
    bounds only without reasons. any_color: how to allow any colour.
    """
    compensating = () if appearance is None else appearance.compensating_lights
    down = compensation_sentences(compensating)
    if appearance is not None and appearance.reasons:
        about = spoken_about(appearance)
        sentences = [
            spoken_cause(reason, any_color=any_color, about=about) for reason in appearance.reasons
        ]
        return [sentence for sentence in sentences if sentence][:2] + down
    d = diagnosis
    most = [
        bound
        for bound in d.bounds[:1]
        if d.gain_share(bound) >= MIN_SHARE and not set(bound.lights) <= set(compensating)
    ]
    to_switch_on = [
        bound
        for bound in d.bounds
        if bound.is_switched_off and d.gain_share(bound) >= MIN_SWITCHED_OFF_SHARE
    ]
    bounds = dict.fromkeys([*most, *to_switch_on[:1]])
    return [spoken_bound(bound, d.gain_share(bound)) for bound in bounds] + down


def compensation_sentences(names: Sequence[str]) -> list[str]:
    """Return a sentence on lights that are down for unpainted parts alone, and on what helps.

    names: see `Appearance.compensating_lights`; none for no sentence.
    """
    if not names:
        return []
    is_one = len(names) == 1
    return [
        f"{spoken_lights(names, start=True)} {'is' if is_one else 'are'} off or nearly off only "
        "because unpainted parts are held, and other lights would brighten them: paint what "
        f"{'it lights, or lock it' if is_one else 'they light, or lock them'}."
    ]


def alone_advice(appearance: Appearance) -> str:
    """Return what may bring light to a place that no light reaches alone."""
    return NEW_LIGHT_ADVICE if appearance.is_painted_everywhere else ALONE_ADVICE


def spoken_about(appearance: Appearance) -> str:
    """Return ` in Moonlight`, the wish that shares of reasons are about; "" for all paint."""
    return f" in {some_names([appearance.reasons_wish])}" if appearance.reasons_wish else ""


def spoken_cause(
    reason: Reason, *, weaker: str = "a hold of", any_color: str | Hint = ANY_COLOR, about: str = ""
) -> str:
    """Name a cause that limits the answer, and the gain of releasing it; "" for views.

    The gain is the mean ΔE without it or, if it is not known, the share of the error that the fit
    minimises. weaker: the words before the strength of a weaker hold. any_color: as in
    `bound_sentences`. about: ` in Moonlight` if the share is the share of one wish.
    """
    gain_text = spoken_gain(reason, about)
    if reason.is_joint:
        gain_text += ", if the other constraints were lifted too"
    if reason.kind in RELEASE_CLAUSES:
        is_one = len(reason.names) == 1
        lights = spoken_lights(reason.names, start=True) + (" is" if is_one else " are")
        return f"{lights} {RELEASE_CLAUSES[reason.kind][not is_one]} {gain_text}."
    if reason.kind in JOINT_RELEASE_CLAUSES:
        argument = any_color if reason.kind == "colors" else ""
        return Sentence(JOINT_RELEASE_CLAUSES[reason.kind], argument, f" {gain_text}.")
    if reason.kind == "views":
        return ""
    if (loosening := reason.loosening) is None:
        return f"Releasing unpainted parts {gain_text}."
    rest, present = loosening.unpainted_change, loosening.present_hold
    instead_of = "" if present is None else f" instead of {present:g}"
    cost = "" if rest is None else f", and change {spoken_changed(rest)}"
    return (
        f"A weaker hold on unpainted parts ({weaker} {loosening.hold:g}{instead_of}) "
        f"{spoken_gain(loosening, about)}{cost}."
    )


def spoken_gain(release: Reason | Loosening, about: str = "") -> str:
    """Return the gain of removing a reason: `would bring the mean ΔE from 5.9 to 4.5`.

    about: as in `spoken_cause`.
    """
    if release.delta_e is not None:
        now, then = (f"{x:.1f}" for x in release.delta_e)
        if float(then) < float(now):
            return f"would bring the mean ΔE from {now} to {then}"
    difference = f"difference{about}" if about else "difference from the painting"
    return f"would remove {spoken_percent(release.share)} of the {difference}"


def painting_noise_clause(diagnosis: Diagnosis) -> str:
    """Return a clause on grain of the painting, or of the lights' images if that is unknown."""
    if diagnosis.noise > 0:
        return "is finer detail of the painting than light can show (grain, edges, texture)"
    return "is noise of the painting or of the lights' images"


def spoken_bound(bound: Bound, share: float) -> str:
    """Return a sentence on a bound that holds a light, with its share of the error."""
    is_one = len(bound.lights) == 1
    lights = spoken_lights(bound.lights, start=True) + (" is" if is_one else " are")
    if bound.kind == "zero":
        return (
            f"{lights} {spoken_hold(bound)} and still too much: the painting is darker there than "
            f"the other lights leave it ({spoken_percent(share)} of the difference from "
            "the painting)."
        )
    it = "it" if is_one else "them"
    if bound.tint:
        return (
            f"{spoken_lights(bound.lights, start=True)} would have to be {bound.tint} than its "
            f"whites ({bound.held_by}): any colour would remove {spoken_percent(share)} of the "
            "difference from the painting."
        )
    effect = {
        "kept": f"fixed; adjusting {it} too",
        "lock": f"locked; adjusting {it}",
        "off": f"switched off, as asked; switching {it} on",
        "left out": f"left out, since their number is limited; switching {it} on too",
        "tie": "tied together; adjusting each by itself",
        "limits": f"at a limit ({bound.held_by}); removing it",
        "colour": f"limited in colour ({bound.held_by}); any other colour",
    }[bound.kind]
    gain_text = f"would remove {spoken_percent(share)} of the difference from the painting"
    return f"{lights} {effect} {gain_text}."


def spoken_hold(bound: Bound) -> str:
    """Return the bound in few words; for a light at zero, with the channels that feel it."""
    if bound.kind == "kept":
        return "fixed"
    if bound.kind != "zero":
        tint = f"; would have to be {bound.tint}" if bound.tint else ""
        return f"{bound.held_by}{tint}"
    if len(bound.multiplier) != 3:
        return "off"
    multipliers = zip(CHANNELS, bound.multiplier, strict=True)
    channels = [n for n, m in multipliers if m > 0.01 * max(bound.multiplier)]
    return "off" if len(channels) == 3 else f"off in {' and '.join(channels)}"


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
    sides = solved - max(low, 0), high - solved  # there is no less light than none
    below, above = (spoken_percent(float(side / solved)) for side in sides)
    if below == above:
        return f"± {below}"
    none = spoken_percent(0)
    return f"{'0' if below == none else f'−{below}'} … {'0' if above == none else f'+{above}'}"


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
        cause, advice = "Noise of the painting", "more samples would not change that"
        if uncertainty.is_filtered:
            cause = "The reconstruction filter of the painting, which is a render,"
            advice = "render it with a box filter"
        sentence = f"{cause} leaves {light}, open by {change} (95 %): {advice}."
        return f"{is_undetermined} {sentence}".lstrip()
    sentence = (
        f"More samples would change {light}, by {change} (95 %); "
        f"{halving_spp(basis, uncertainty, k)} samples per pixel would halve that."
    )
    return f"{is_undetermined} {sentence}" if is_undetermined else sentence


def fit_clauses(solution: Solution) -> tuple[str, ...]:
    """Return clauses on the options of the fit; none for a literal fit."""
    certificate, fit = solution.certificate, solution.problem.fit
    has_unpainted = any(not x.is_whole for x in solution.problem.views.targets)
    clauses = []
    if certificate.display:
        clauses.append(f"fitted as the eye sees it ({certificate.display})")
    if has_unpainted and fit.unpainted:
        clauses.append(f"each unpainted pixel counts {fit.unpainted:g} times a painted one")
    elif has_unpainted and fit.hold:
        clauses.append(f"unpainted parts are held ({fit.hold:g} times the weight of the paint)")
    if fit.colors == "gentle":
        clauses.append("lights are pulled to their own colour (gentle)")
    elif fit.colors == "white":
        clauses.append("lights are white")
    elif fit.colors == "own":
        clauses.append("lights keep their own colour (own)")
    if certificate.noise_removed:
        clauses.append("noise is corrected")
    return tuple(clauses)


def fit_sentence(solution: Solution, *, instead: str = "") -> str:
    """Return a sentence on the options of the fit. instead: a clause on how to switch them off."""
    if not (clauses := fit_clauses(solution)):
        return "The painting is fitted literally: linear light, nothing held, any colour."
    text = "; ".join([*clauses, *([instead] if instead else [])])
    return f"{text[0].upper()}{text[1:]}."


def fit_options(solution: Solution) -> dict[str, Any]:
    """Return the options of the fit as data, resolved by the painting."""
    fit, certificate = solution.problem.fit, solution.certificate
    return {
        "space": solution.space,
        "display": certificate.display or None,
        "hold": fit.hold,
        "unpainted": fit.unpainted,
        "colors": fit.colors,
        "literal": fit.literal,
        "noise_correction": certificate.noise_removed > 0,
    }


def spoken_deliveries(deliveries: Sequence[Delivery], told: str = "") -> str:
    """Return how much of each wish came, one short sentence each; "" without wishes.

    told: sentences that stand before these; wishes whose shares they say are left out.
    Wishes that ask for nothing visible are left out, and of many the wishes of which most came.
    Parts of a painting without layers are only listed if one of them lacks something.
    """
    entries = [entry for entry in main_deliveries(deliveries) if entry.least is not None]
    if len(entries) == 1 and is_unnamed(entries[0]):
        shares = entries[0].spoken_shares
        end = "" if entries[0].is_overdone else " of what was asked for came"
        return f"{shares[:1].upper()}{shares[1:]}{end}."
    if len(entries) > 1 and all(entry.is_met and not entry.layers for entry in entries):
        least = min(entry.least for entry in entries if entry.least is not None)
        text = f"Of each of {len(entries)} wishes at least {spoken_share(least)} came."
        overdone = [entry for entry in entries if entry.is_overdone][:MAX_WISHES]
        return " ".join([text, *(f"{spoken_delivery(entry)}." for entry in overdone)])
    by_share = sorted(entries, key=lambda entry: entry.least or 0.0)
    shown = [entry for entry in entries if entry in by_share[:MAX_WISHES]]
    spoken = [_untold_delivery(entry, told) for entry in shown]
    texts = [f"{text}." for text in spoken if text]
    rest = len(entries) - len(shown)
    if rest > 0:
        texts.append(f"More came of {'one other' if rest == 1 else f'{rest} others'}.")
    return " ".join(texts)


def _untold_delivery(delivery: Delivery, told: str) -> str:
    """Return `Moonlight: brightness 98 %, colour 43 %`, or the part that is not in the sentences
    before it; "" if they have all of it.
    """
    before, text = f". {told}", spoken_delivery(delivery)
    if f". {text}" in before:
        return ""
    if f". {spoken_unreached(delivery)}" not in before:
        return text
    if delivery.lacks_brightness == delivery.lacks_color:
        return ""
    part, share = (
        ("brightness", delivery.brightness) if delivery.lacks_color else ("colour", delivery.color)
    )
    return "" if share is None else f"{wish_name(delivery)}: {part} {spoken_share(share)}"


def spoken_mean_shares(deliveries: Sequence[Delivery]) -> str:
    """Return how much of all wishes came, `brightness 95 %, colour 52 %`; "" if none asks for
    anything visible.
    """
    entries = [entry for entry in main_deliveries(deliveries) if entry.least is not None]
    if len(entries) == 1:
        return entries[0].spoken_shares
    shares = mean_shares(deliveries)
    named = (("brightness", shares.brightness), ("colour", shares.color))
    return ", ".join(f"{part} {spoken_share(x)}" for part, x in named if x is not None)


def spoken_came(appearance: Appearance) -> str:
    """Return how much of all wishes came, `Most of the way: brightness 98 %, colour 67 %`; as a
    share of ΔE, `Most of the way (70 %)`, if none asks for anything visible. Of an only wish that
    no light can bring, if less than half of it came, `Out of reach (8 % came)`.
    """
    far, shares = spoken_progress(appearance.progress), spoken_mean_shares(appearance.deliveries)
    if far == NO_CLOSER_TEXT:
        return far
    if lacks_only_wish(appearance) and appearance.progress < HALF:
        return f"Out of reach ({shares} came)"
    return f"{far}: {shares}" if shares else f"{far} ({spoken_percent(appearance.progress)})"


def lacks_only_wish(appearance: Appearance) -> bool:
    """Return whether the painting has one wish, and no light can bring it."""
    is_only = len(main_deliveries(appearance.deliveries)) == 1
    return is_only and appearance.needs_another_light and not appearance.is_worse


def is_one_painting(deliveries: Sequence[Delivery]) -> bool:
    """Return whether wishes are parts of one painting, which nobody named, and not of layers."""
    main = main_deliveries(deliveries)
    return all(x.kind == "wish" for x in main) and len({x.layers for x in main}) == 1


def named_worst_wish(appearance: Appearance) -> Delivery | None:
    """Return the wish of which too little came, if a headline names it.

    Not the only wish of a painting: then the headline says where light is missing.
    """
    worst = appearance.worst_wish
    is_only = len(main_deliveries(appearance.deliveries)) == 1
    return None if worst is None or (is_only and is_unnamed(worst)) else worst


def is_unnamed(delivery: Delivery) -> bool:
    """Return whether a wish has no name that a person gave: a painting, or its only stroke."""
    return delivery.kind != "group" and not delivery.group


def wish_name(delivery: Delivery) -> str:
    """Return `Moonlight`, or `Shadows of Moonlight` for a layer of a group."""
    is_member = delivery.group and delivery.kind != "group"
    name = some_names([delivery.name.strip() or "A wish"])
    return f"{name} of {some_names([delivery.group])}" if is_member else name


def spoken_delivery(delivery: Delivery) -> str:
    """Return `Moonlight: brightness 98 %, colour 43 %`."""
    return f"{wish_name(delivery)}: {delivery.spoken_shares}"


def spoken_unreached(delivery: Delivery) -> str:
    """Return `Lantern: out of reach (8 % came)`, or `Night: out of reach in colour (43 % came)`."""
    brightness, color, name = delivery.brightness, delivery.color, wish_name(delivery)
    if brightness is None or color is None or delivery.lacks_brightness == delivery.lacks_color:
        return f"{name}: out of reach ({delivery.spoken_shares} came)"
    part, share = ("colour", color) if delivery.lacks_color else ("brightness", brightness)
    return f"{name}: out of reach in {part} ({spoken_share(share)} came)"


def spoken_newest(appearance: Appearance) -> str:
    """Return how much of the newest wish came, `Lantern: 95 %.`; "" if it is the worst, or
    asks for nothing visible.
    """
    newest, worst = newest_delivery(appearance.deliveries), appearance.worst_wish
    if newest is None or newest.least is None or newest is worst:
        return ""
    if worst is not None and newest.layers == worst.layers:  # another part of the same
        return ""
    if worst is not None and newest.kind == "group" and worst.group == newest.name:
        return ""
    return f"{spoken_delivery(newest)}."
