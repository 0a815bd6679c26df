"""Sentences on why the answer does not look like the painting."""

from collections.abc import Sequence

from lightpaint.display_text import some_names
from lightpaint.lighting.analysis.appearance.appearance import Appearance
from lightpaint.lighting.analysis.appearance.limiting_reasons import Loosening, Reason
from lightpaint.lighting.analysis.diagnosis import Diagnosis, error_shares
from lightpaint.lighting.answer.certificate import Bound
from lightpaint.report.phrases import (
    CHANNELS,
    spoken_changed,
    spoken_lights,
    spoken_percent,
    spoken_percents,
    spoken_place,
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
        "unreachable": f"is out of reach of any mix of {lights}{hold_clause(appearance)}",
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


def hold_clause(appearance: Appearance | None) -> str:
    """Return ` while the rest is held` if that keeps the lights from the paint, else ""."""
    is_held = appearance is not None and any(reason.kind == "hold" for reason in appearance.reasons)
    return " while the rest is held" if is_held else ""


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


#: Clauses on constraints and their release: for one light, and for several.
RELEASE_CLAUSES = {
    "off": ("switched off, as asked; switching it on", "switched off, as asked; switching them on"),
    "lock": ("locked; adjusting it", "locked; adjusting them"),
    "limits": ("at a limit; removing it", "at their limits; removing them"),
    "colour": ("limited in colour; any other colour", "limited in colour; other colours"),
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
}


def spoken_about(appearance: Appearance) -> str:
    """Return ` in Moonlight`, the wish that shares of reasons are about; "" for all paint."""
    return f" in {some_names([appearance.reasons_wish])}" if appearance.reasons_wish else ""


def spoken_cause(
    reason: Reason, *, weaker: str = "a hold of", any_color: str | Hint = ANY_COLOR, about: str = ""
) -> str:
    """Name a cause that limits the answer, and the gain of releasing it; "" for views.

    The gain is the mean ΔE without it or, if it is not known, the share of the error that the fit
    minimises. weaker: the words before the strength of a weaker hold. any_color: as in
    `bound_sentences`. about: ` in Moonlight` if the share is that of one wish.
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
    """Return a clause on noise of the painting, or of the lights' images if that is unknown."""
    if diagnosis.noise > 0:
        return "is noise of the painting, as renders have"
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
