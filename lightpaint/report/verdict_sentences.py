"""The verdict on a result, in sentences: whether the lights produce the painting."""

import numpy as np

from lightpaint import lighting
from lightpaint.basis import TEXELS, is_of_texels, joined_texels
from lightpaint.colour import luminance
from lightpaint.display_text import some_names
from lightpaint.images import Estimate
from lightpaint.keywords import keywords
from lightpaint.relit.verification import ERROR, Verification
from lightpaint.report import diagnosis_sentences, phrases
from lightpaint.scene.lights.texels import image_of

#: Maximum number of barely visible lights that a sentence names.
MAX_UNSEEN_NAMES = 2

#: Clauses on reasons that hold the lights back: for one light, and for several.
REASON_CLAUSES: dict[str, tuple[str, str]] = {
    "hold": ("unpainted parts are held near their current look",) * 2,
    "colors": ("lights keep their colours",) * 2,
    "off": ("{} is switched off", "{} are switched off"),
    "lock": ("{} is locked", "{} are locked"),
    "limits": ("{} is at a limit", "{} are at their limits"),
    "colour": ("the colour of {} is limited", "the colours of {} are limited"),
    "emitters": ("the emitters of {} are at their limits",) * 2,
    "tie": ("{} is tied to other lights", "{} are tied together"),
    "sparse": ("the number of lights is limited",) * 2,
    "prefer_current": ("lights are pulled towards their current setting",) * 2,
    "near": ("lights stay near the lighting that you started from",) * 2,
    "planes": ("wishes for measuring planes come first",) * 2,
    "views": ("view {} asks for different light", "views {} ask for different light"),
}

#: What keeps the lights from a painting, with its verb.
LIMIT_SUBJECTS: dict[lighting.LimitGroup, str] = {
    "hold": "Unpainted parts keep",
    "colors": "The colours that lights may have keep",
    "constraints": "Constraints keep",
    "views": "Other views keep",
}

#: Maximum number of names in one clause; of more it tells the number.
MAX_NAMES = 3

#: Samples per pixel of a render below which its denoised picture may lack small bright patches.
FEW_SPP = 16

#: The clause if no cause has a third of the error.
NO_MAIN_CAUSE = "for several reasons, none of which accounts for a third of it"


@keywords()
def verdict(
    solution: lighting.Solution,
    predicted: Estimate,
    verification: Verification | None,
    *,
    appearance: lighting.Appearance | None = None,
) -> str:
    """Return sentences on how close the answer is, and whether a render equals it.

    Args:
        solution: The answer.
        predicted: The result of `combine`.
        verification: The result of `verify`; None without a render.
        appearance: The result of `compare_appearance`, if known.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> lp.verdict(solution, lp.combine(basis, solution.lighting), None)
        'Close: it looks as painted. Mean ΔE 0.0 over what was painted (... as the scene is now...'
    """
    appearance = appearance or _appearance_of(solution, predicted)
    sentences = [
        (start := headline(appearance)),
        f"{spoken_delta_e(appearance, known=bool(predicted.half_difference.any()))}.",
    ]
    is_only = len(lighting.main_deliveries(appearance.deliveries)) == 1
    is_told = (
        is_only
        and (shares := diagnosis_sentences.spoken_mean_shares(appearance.deliveries))
        and shares in start
    )
    if (
        deliveries := diagnosis_sentences.spoken_deliveries(appearance.deliveries, start)
    ) and not is_told:
        sentences.append(deliveries)
    if not solution.certificate.converged:
        sentences.append("The solve stopped before it converged.")
    if verification is None:
        sentences.append("Not checked by a render.")
    elif verification.agrees:
        sentences.append(f"{spoken_agreement(verification)}.")
        if verification.unseen:
            sentences.append(f"{spoken_blindness(verification)}.")
    else:
        sentences.append(f"Rendered again: NOT equal; {agreement(verification)}.")
    return " ".join(sentences)


def _appearance_of(solution: lighting.Solution, predicted: Estimate) -> lighting.Appearance:
    """Compare an answer with its painting, and find out what its samples cannot tell there."""
    appearance = lighting.compare_appearance(solution, predicted)
    uncertainty = lighting.error_bars(solution) if appearance.has_miss else None
    if uncertainty is None:
        return appearance
    return lighting.with_undetermined(appearance, solution, uncertainty)


def headline(appearance: lighting.Appearance) -> str:
    """Return sentences on whether the answer is close, what it lacks and why, and side effects.

    A cause is named only if it accounts for a third of the error.
    """
    addition = (
        phrases.spoken_elsewhere(appearance.unpainted_change)
        if appearance.changes_unpainted
        else ""
    )
    current = f"{spoken_current(appearance)} " if appearance.is_worse else ""
    return f"{current}{_paint_headline(appearance)} {addition}".rstrip()


def spoken_current(appearance: lighting.Appearance) -> str:
    """Say that the current lighting comes closer than the answer, and offer it unless measuring
    planes have wishes.
    """
    if any(reason.kind == "planes" for reason in appearance.reasons):
        return (
            "What is wished for on measuring planes leads away from the paint (mean ΔE "
            f"{appearance.requested_change:.1f} as the scene is, {appearance.delta_e:.1f} in this "
            "answer)."
        )
    return (
        "The current lighting comes closer to the paint (mean ΔE "
        f"{appearance.requested_change:.1f}) than this answer ({appearance.delta_e:.1f}): keep the "
        "scene as it is."
    )


def _wish_headline(appearance: lighting.Appearance, wish: lighting.Delivery) -> str:
    """Return sentences on the wish of which least came, on the newest one, and on the whole.

    Of one painting without named wishes the whole goes first.
    """
    if diagnosis_sentences.is_one_painting(appearance.deliveries):
        return f"{spoken_whole(appearance)} {spoken_lack(appearance, wish)}"
    newest, whole = diagnosis_sentences.spoken_newest(appearance), spoken_on_the_whole(appearance)
    return " ".join(filter(None, [spoken_lack(appearance, wish), newest, whole]))


def spoken_on_the_whole(appearance: lighting.Appearance) -> str:
    """Return `On the whole: about half way.`, after the shares of wishes; "" if there is only one,
    and it is not close.
    """
    if appearance.is_nearly_equal:
        return "On the whole it is close."
    if len(lighting.main_deliveries(appearance.deliveries)) == 1:
        return ""
    progress = phrases.spoken_progress(appearance.progress)
    return f"On the whole: {progress[:1].lower()}{progress[1:]}."


def spoken_whole(appearance: lighting.Appearance) -> str:
    """Return a sentence on how much of all that was painted came."""
    if not appearance.is_nearly_equal:
        return f"{diagnosis_sentences.spoken_came(appearance)}."
    shares = diagnosis_sentences.spoken_mean_shares(appearance.deliveries)
    return f"Close on the whole: {shares}." if shares else "Close on the whole."


def spoken_lack(appearance: lighting.Appearance, wish: lighting.Delivery) -> str:
    """Return sentences on a wish of which too little came: how much, why, and what may help.

    The place, lights and reasons of the appearance are about the wish alone.
    """
    if appearance.causes:
        return f"{diagnosis_sentences.spoken_delivery(wish)}, since {_spoken_causes(appearance)}."
    if appearance.place is None:
        return f"{diagnosis_sentences.spoken_delivery(wish)}."
    is_of_color = wish.lacks_color and not wish.lacks_brightness
    if appearance.is_hidden_by_noise:
        delivery = diagnosis_sentences.spoken_delivery(wish)
        return f"{delivery}: {_spoken_hidden(appearance)}. {diagnosis_sentences.SAMPLES_ADVICE}"
    reason = _spoken_reach(appearance, is_of_color=is_of_color)
    is_reached = bool(appearance.local_lights) and appearance.has_strong_light
    advice = (
        diagnosis_sentences.SPILL_ADVICE
        if is_reached and appearance.reasons_wish
        else diagnosis_sentences.REACH_ADVICE
    )
    if is_reached and appearance.lacks_light_of_its_own:
        advice = diagnosis_sentences.alone_advice(appearance)
    if appearance.local_lights[:1] == appearance.fixed_lights[:1] != ():
        advice = diagnosis_sentences.FIXED_ADVICE
    return f"{diagnosis_sentences.spoken_unreached(wish)}, since {reason}. {advice}"


def _paint_headline(appearance: lighting.Appearance) -> str:
    if appearance.is_close and not appearance.has_miss:
        # A mean ΔE of more than CLOSE is shown beside it, if noise is what is above.
        is_noisy = round(appearance.delta_e, 1) > lighting.CLOSE
        return f"Close: {'apart from noise, ' if is_noisy else ''}it looks as painted."
    if (wish := diagnosis_sentences.named_worst_wish(appearance)) is not None:
        return _wish_headline(appearance, wish)
    if appearance.place is None:
        return f"{_headline_start(appearance)}: too much of what was painted is out of reach."
    if diagnosis_sentences.lacks_only_wish(appearance) and not appearance.is_nearly_equal:
        missing = spoken_missing(appearance)
        text = f"{missing[0].upper()}{missing[1:]} is missing: {spoken_reason(appearance)}."
        came = diagnosis_sentences.spoken_came(appearance)
        return " ".join(filter(None, [f"{came}.", text, _advice_on_paint(appearance)]))
    if appearance.is_far:
        where = phrases.spoken_where(appearance.place)
        change = phrases.spoken_difference(appearance.place.painted, appearance.place.reached)
        painted = f"{where} the paint is {change} than the lights make it"
        return f"{_headline_start(appearance)}: {painted}; {spoken_reason(appearance)}."
    state = (
        "is out of reach" if not appearance.causes and appearance.is_out_of_reach else "is missing"
    )
    start, missing = _headline_start(appearance), spoken_missing(appearance)
    return f"{start} the {missing} {state}: {spoken_reason(appearance)}."


def _advice_on_paint(appearance: lighting.Appearance) -> str:
    """Return what may bring the only wish; "" if nothing is known to."""
    if appearance.is_hidden_by_noise and not appearance.causes:
        return diagnosis_sentences.SAMPLES_ADVICE
    is_alone = appearance.lacks_light_of_its_own
    return diagnosis_sentences.alone_advice(appearance) if is_alone else ""


def _headline_start(appearance: lighting.Appearance) -> str:
    if appearance.is_nearly_equal:
        return "Close, but"
    if not appearance.is_far:
        far = phrases.spoken_progress(appearance.progress)
        return f"{far}, and" if far == phrases.NO_CLOSER_TEXT else f"{far}, but"
    # "The lights cannot" would not be true if something else holds them.
    if appearance.causes:
        return f"{LIMIT_SUBJECTS[appearance.limit_groups[0]]} the lights from this"
    if _are_kept(appearance):
        return f"{LIMIT_SUBJECTS['constraints']} the lights from this"
    return (
        "These lights cannot match this"
        if appearance.is_out_of_reach
        else "The lights do not match this"
    )


def spoken_missing(appearance: lighting.Appearance) -> str:
    """Return the main error in words: `brighter light on the floor`. It must have a place."""
    assert appearance.place is not None
    change = phrases.spoken_difference(appearance.place.painted, appearance.place.reached)
    light = "shadow" if is_darker(appearance) else "light"
    return (
        f"{change.replace('a little', 'slightly')} {light} {phrases.spoken_where(appearance.place)}"
    )


def spoken_reason(appearance: lighting.Appearance) -> str:
    """Return the causes of the largest error as text: the main cause first."""
    assert appearance.place is not None
    if appearance.causes:
        return _spoken_causes(appearance)
    if appearance.is_hidden_by_noise:
        return _spoken_hidden(appearance)
    if not appearance.is_out_of_reach:
        return spoken_noise(appearance) or NO_MAIN_CAUSE
    return _spoken_reach(appearance)


def _spoken_causes(appearance: lighting.Appearance) -> str:
    *first_phrases, last = (_spoken_cause(appearance, reason) for reason in appearance.causes)
    return f"{', '.join(first_phrases)}, and {last}" if first_phrases else last


def _spoken_cause(appearance: lighting.Appearance, reason: lighting.Reason) -> str:
    """Return a reason as text: a hold matters where no light reaches the paint alone."""
    if reason.kind == "hold" and appearance.lacks_light_of_its_own:
        return _spoken_spill(appearance)
    return spoken_holding(reason)


def _spoken_reach(appearance: lighting.Appearance, *, is_of_color: bool = False) -> str:
    """Return why no light brings what is missing in the place of most error.

    is_of_color: whether it is colour and not brightness.
    """
    if not appearance.local_lights:
        return "no light reaches it"
    names, is_one = _spoken_some(appearance.local_lights)
    if not is_of_color:
        if is_darker(appearance) and is_of_texels(names):
            return f"{names} {'shines' if is_one else 'shine'} there, too"
        if is_darker(appearance):
            return f"{names} {'lights' if is_one else 'light'} it too"
        if not appearance.has_strong_light:
            return f"{names} {'does' if is_one else 'do'} little there"
        if _are_kept(appearance):
            reason = "is limited by its constraints"
            return f"{names} {reason if is_one else 'are limited by their constraints'}"
    if spill := _spoken_spill(appearance):
        return spill
    free_lights = tuple(
        name for name in appearance.local_lights if name not in appearance.held_lights
    )
    free_names = _spoken_some(free_lights or appearance.local_lights)[0]
    if is_of_color:
        return f"{free_names} would colour too much else"
    # The lights of several texels are one, in a sentence.
    if all(map(image_of, free_lights)):
        return f"more light from {free_names} would fall on too much else"
    return f"{free_names} would light too much else"


def _spoken_hidden(appearance: lighting.Appearance) -> str:
    """Return which lights that reach the place the samples do not determine."""
    names = _spoken_some(appearance.hidden_lights)[0]
    return f"too few samples tell what {names} can do there"


def _spoken_spill(appearance: lighting.Appearance) -> str:
    """Return what the lights of the paint light, too; "" if that is not known."""
    area = appearance.area_lights
    if area is None or (area.is_alone and not area.also):
        return ""
    names, is_one = _spoken_some(area.names)
    also = f"the {some_names([area.also.replace('_', ' ').strip()])}" if area.also else "the rest"
    spill = f"{names} {'lights' if is_one else 'light'} {also}, too"
    return f"no light reaches it alone; {spill}" if appearance.lacks_light_of_its_own else spill


def spoken_holding(reason: lighting.Reason) -> str:
    """Return a reason that keeps the lights from the paint: `annex_window is switched off`."""
    singular, plural = REASON_CLAUSES[reason.kind]
    if len(reason.names) > MAX_NAMES and reason.kind == "views":
        return "other views ask for different light"
    names = joined_texels(reason.names)
    if len(names) > MAX_NAMES:
        texels = [name for name in names if TEXELS in name]
        others = len(names) - len(texels)
        lights = " and ".join([*texels, f"{others} light{'s' if others > 1 else ''}"])
    else:
        *first_phrases, last = [some_names([name]) for name in names] or [""]
        lights = f"{', '.join(first_phrases)} and {last}" if first_phrases else last
    return (singular if len(reason.names) == 1 else plural).format(lights)


def spoken_noise(appearance: lighting.Appearance) -> str:
    """Return a clause on noise, if it is a third of the error; else "".

    Only a share of ΔE, which stands beside it, is a share of "the difference" without more words.
    """
    if appearance.main_noise == "noise":
        share = phrases.spoken_percent(appearance.noise_share)
        return f"{share} of the difference from the painting is render noise"
    if appearance.main_noise == "painting_noise":
        share = phrases.spoken_percent(appearance.error_shares["painting_noise"])
        return f"{share} of the difference (in energy) is finer detail than light can show"
    if appearance.main_noise == "energy":
        return "much of the difference (in energy) is render noise, which more samples reduce"
    return ""


def are_held_back(appearance: lighting.Appearance) -> bool:
    """Return whether something that may be loosened keeps the lights from a painting."""
    return bool(appearance.causes) or _are_kept(appearance)


def _are_kept(appearance: lighting.Appearance) -> bool:
    """Return whether constraints hold back all lights that contribute much to the place."""
    is_short = (
        appearance.place is not None and appearance.has_strong_light and not is_darker(appearance)
    )
    return (
        is_short
        and bool(appearance.local_lights)
        and set(appearance.local_lights) <= set(appearance.held_lights)
    )


def _spoken_some(names: tuple[str, ...]) -> tuple[str, bool]:
    """Return the first two names, texels of an image as one, and whether there is one light."""
    return some_names(joined_texels(names)[:2], joint=" and "), len(names) == 1


def is_darker(appearance: lighting.Appearance) -> bool:
    """Return whether the worst place is painted darker than the lights make it."""
    assert appearance.place is not None
    painted, reached = (
        luminance(np.array(x)) for x in (appearance.place.painted, appearance.place.reached)
    )
    return bool(painted < reached)


def spoken_delta_e(appearance: lighting.Appearance, *, known: bool) -> str:
    """Return `Mean ΔE 4.2 over what was painted (11.3 as the scene is now; noise explains 0.8)`."""
    noise = f"noise explains {appearance.noise:.1f}" if known else "noise included"
    now = f"{appearance.requested_change:.1f} as the scene is now"
    return f"Mean ΔE {appearance.delta_e:.1f} over what was painted ({now}; {noise})"


def spoken_agreement(verification: Verification) -> str:
    """Return that a render agrees, as far as it could have shown otherwise."""
    if not verification.is_blind:
        return "Rendered again: equal within noise"
    return f"Rendered again{_with_samples(verification.spp)}: nothing found against it"


def _with_samples(spp: int | None) -> str:
    """Return ` with 8 samples per pixel`; "" if it is not known."""
    return "" if spp is None else f" with {spp} sample{'s' if spp > 1 else ''} per pixel"


def spoken_blindness(verification: Verification) -> str:
    """Name the least detectable lights: `An error of 5 % in bulb would probably not show …`."""
    power = verification.power or {}
    other_names = joined_texels(name for name in power if name not in verification.unseen)
    unseen = joined_texels(verification.unseen)
    unnamed = len(unseen) - MAX_UNSEEN_NAMES
    if unnamed > 0 and len(other_names) <= MAX_UNSEEN_NAMES:
        names = "any light" + (
            f" but {some_names(other_names, joint=' and ')}" if other_names else ""
        )
    else:
        visible_names = [
            f"any of {name}" if TEXELS in name else some_names([name])
            for name in unseen[:MAX_UNSEEN_NAMES]
        ] + [f"{unnamed} more"] * (unnamed > 0)
        *first_phrases, last = visible_names
        names = f"{', '.join(first_phrases)} and {last}" if first_phrases else last
    return f"An error of {100 * ERROR:.0f} % in {names} would probably not show in this render"


def spoken_samples(spp: int | None) -> str:
    """Return how many samples a verification took, and what few of them mean for its picture."""
    text = _with_samples(spp)
    is_few = spp is not None and spp < FEW_SPP
    return f"{text}; so few may leave out small bright patches" if is_few else text


def agreement(verification: Verification | None) -> str:
    """Return whether prediction and verification agree, as a clause with its numbers."""
    if verification is None:
        return "the prediction is not verified by a render"
    distance = spoken_distance(verification)
    if verification.agrees and verification.is_blind:
        return (
            f"nothing found against the prediction{_with_samples(verification.spp)}, but an error "
            f"of {100 * ERROR:.0f} % would probably not show in this render ({distance})"
        )
    state = "agree within noise" if verification.agrees else "DISAGREE by more than their noise"
    return f"prediction and verification {state} ({distance})"


def spoken_distance(verification: Verification) -> str:
    """Return `1.8 standard errors apart, limit 5`."""
    return f"{verification.difference:.1f} standard errors apart, limit {verification.limit:.3g}"
