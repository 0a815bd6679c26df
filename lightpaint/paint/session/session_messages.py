"""Messages of a session about its answer and its edits: sentences, figures, changed pixels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from lightpaint import report
from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.basis import Basis, BasisLight
from lightpaint.colour import (
    LUMINANCE,
    ColorRendering,
    Lamp,
    LampEmitter,
    color_rendering,
    luminance,
    photometry,
    rgb_to_hex,
)
from lightpaint.lighting import (
    DEFAULT_HOLD,
    INVISIBLE,
    Analysis,
    Appearance,
    Delivery,
    Lighting,
    Reason,
    UnpaintedChange,
    color_of_emitter,
    in_own_color,
    main_deliveries,
    merge_views,
)
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.session.history import History
from lightpaint.paint.session.live_answer import LiveAnswer
from lightpaint.paint.store.history_steps import Region
from lightpaint.paint.store.session_requests import HOLD_KEYS

#: Part of the current light under which one is off.
OFF = 1e-4

#: Number of lamps whose rendering of colours is found with each exact answer, at 30 ms each.
MAX_RENDERED_LAMPS = 32

#: Phrase for an answer that is farther from the paint.
WORSE_TEXT = "Farther from the paint than the current lighting, which undo brings back"

#: Headline while the lights are not rendered yet.
WAITING_HEADLINE = "The lights are being rendered: what you paint is kept, and answered then"

#: Kinds of advice on what limits the answer; a page has a button for each.
ADVICE_TEXTS: dict[str, str] = {
    "hold": "Paint more or loosen the hold.",
    "colors": "The settings allow any colour.",
    "light": report.ALONE_ADVICE,
}

#: How to allow any colour: in the painter it is a setting, not an argument.
ANY_COLOR_TEXT = "any colour"

#: Texts of reasons for an error, for the painter; and their variants with constraints.
MISS_TEXTS = {
    "unreachable": "is out of reach of these lights",
    "forbidden": "would need a light darker than off",
    "compromise": "is given up for the other views",
    "noise": "is render noise, which more samples reduce",
    "painting_noise": "is finer detail than light can show: grain, edges and texture of the paint",
}
CONSTRAINED_MISS_TEXTS = {"forbidden": "would need colours or levels that the lights may not have"}


def light_info(
    light: BasisLight, scale: float, lamp: Lamp | None = None, address: str = ""
) -> protocol.LightInfo:
    """Return the constant properties of a light. scale: as in `LightInfo`. lamp: what mixes it, if
    known. address: as in `LightInfo`.
    """
    members = tuple(light.members)
    return protocol.LightInfo(
        name=light.name,
        label=light.name,
        unit=light.unit,
        parameter=light.parameter,
        plugin=light.plugin,
        form=light.form,
        members=members,
        group=light.name if len(members) > 1 else None,
        present=light.emission,
        is_fixed=light.is_fixed,
        is_scalar=light.is_scalar,
        scale=scale,
        address=address,
        emitters=() if lamp is None else tuple(map(_emitter_info, _own_emitters(light, lamp))),
        lamp=light.lamp,
    )


def _own_emitters(light: BasisLight, lamp: Lamp) -> tuple[LampEmitter, ...]:
    """Return the emitters of a lamp, or the one that a light is, in their own colours."""
    return tuple(map(in_own_color, lamp.emitters)) if light.lamp else lamp.emitters


def _emitter_info(emitter: LampEmitter) -> protocol.EmitterInfo:
    color = np.maximum(np.array(emitter.emission), 0)
    return protocol.EmitterInfo(emitter.name, rgb_to_hex(color))


def answer_findings(
    bases: Sequence[Basis],
    weights: Doubles,
    lamps: Mapping[int, Lamp] | None = None,
    mixed_emissions: Mapping[int, RGB] | None = None,
) -> protocol.Findings:
    """Return the immediate findings on each light: emission, change, colour, share of the picture.

    With several views, `shares` has its part of each. lamps: what mixes a light from emitters, by
    the light's index. mixed_emissions: of lamps with colour wheels before these came to
    their slots.
    """
    lit = [(basis.totals * weights) @ LUMINANCE for basis in bases]
    lights = tuple(
        _light_answer(light, weight, share, (lamps or {}).get(k), (mixed_emissions or {}).get(k))
        for k, (light, weight, share) in enumerate(
            zip(bases[0].lights, weights, _shares(sum(lit)), strict=True)
        )
    )
    shares = tuple(_shares(x) for x in lit) if len(bases) > 1 else None
    return protocol.Findings(lights=lights, shares=shares)


def _shares(lit: Doubles) -> tuple[float, ...]:
    whole = float(lit.sum())
    return tuple(float(x) / whole if whole > 0 else 0.0 for x in lit)


def _light_answer(
    light: BasisLight, weight: Doubles, share: float, lamp: Lamp | None, mixed: RGB | None
) -> protocol.LightAnswer:
    own = weight
    if light.lamp and lamp is not None:
        own = weight[0] * color_of_emitter(lamp.emitters[0])
    colour = photometry(as_rgb(own), unit=light.unit)
    current, answered = (
        float(luminance(np.asarray(x, np.float64))) for x in (light.emission, weight)
    )
    return protocol.LightAnswer(
        emission=as_rgb(weight),
        stops=float(np.log2(answered / current))
        if current > 0 and answered > OFF * current
        else None,
        kelvin=colour.kelvin,
        swatch=colour.hex or rgb_to_hex(np.asarray(light.emission, np.float64)),
        is_on=answered > OFF * current,
        share=share,
        drives=None if lamp is None else tuple(lamp.drives_for(weight).tolist()),
        slot_delta_e=None if lamp is None else _slot_distance(lamp, weight, mixed),
    )


def _slot_distance(lamp: Lamp, weight: Doubles, mixed: RGB | None) -> float | None:
    """Return how far the slot of a wheel that shines is from the mix before it, in CIEDE2000."""
    if mixed is None or not weight.any():
        return None
    return float(lamp.distances(np.array(mixed))[lamp.slot_for(weight)])


@dataclass(frozen=True)
class Judgement:
    """The analysis of an answer, for the page.

    worst: of the view with the largest error. closeness: of each view; None for unpainted ones.
    lights: `error`, `is_constrained`, `is_unreached` and `rendering` of each, as in `LightAnswer`.
    deliveries: of all views together.
    """

    worst: protocol.Closeness
    closeness: tuple[protocol.Closeness | None, ...]
    lights: tuple[tuple[str | None, bool, bool, str | None], ...]
    deliveries: tuple[protocol.WishDelivery, ...] = ()

    def complete(self, findings: protocol.Findings) -> protocol.Findings:
        """Return immediate findings with the results of the analysis."""
        lights = tuple(
            replace(
                light,
                error=error,
                is_constrained=is_held,
                is_unreached=is_unreached,
                rendering=rendering,
            )
            for light, (error, is_held, is_unreached, rendering) in zip(
                findings.lights or (), self.lights, strict=True
            )
        )
        worst = self.worst
        return replace(
            findings,
            lights=lights,
            headline=worst.headline,
            help=worst.help,
            delta_e=worst.delta_e,
            delta_e_present=worst.delta_e_present,
            sentences=worst.sentences,
            closeness=self.closeness,
            deliveries=self.deliveries,
        )


def judge(analyses: Sequence[Analysis], painted: Sequence[int]) -> Judgement:
    """Return the headline, the limiting constraints, and the certainty and lock of each light.

    painted: the view of each analysis. The headline is the headline of the view with the largest
    error, of those that lack a wish if there are any.
    """
    solution = analyses[0].solution
    errors = report.spoken_errors(analyses[0].uncertainty, len(solution.basis.names))
    settings, renderings = solution.lighting.lights, _renderings(solution.lighting)
    by_view = {view: _closeness(entry) for view, entry in zip(painted, analyses, strict=True)}
    return Judgement(
        worst=by_view[_worst_view(painted, analyses)],
        closeness=tuple(by_view.get(k) for k in range(max(painted) + 1)),
        lights=tuple(
            (
                error,
                entry.is_active,
                not any(entry.reached),
                renderings.get(entry.part_of or entry.name),
            )
            for error, entry in zip(errors, settings, strict=True)
        ),
        deliveries=_wish_deliveries(analyses),
    )


def _renderings(lighting: Lighting) -> dict[str, str]:
    """Return how lamps of known spectra render colours, in words, by name."""
    powers = {x.name: x.powers for x in lighting.of_lamps().lights if x.powers is not None}
    known = islice(powers.items(), MAX_RENDERED_LAMPS)
    found = {name: color_rendering(values) for name, values in known}
    return {name: _rendering_text(x) for name, x in found.items() if x is not None}


def _rendering_text(color: ColorRendering) -> str:
    text = (
        f"{color.kelvin:.0f} K, Duv {color.duv:+.3f}, Ra {color.ra:.0f}, R9 {color.r9:.0f}, "
        f"Rf {color.rf:.0f}, Rg {color.rg:.0f}"
    )
    return text.replace("-", "\N{MINUS SIGN}")


def _worst_view(painted: Sequence[int], analyses: Sequence[Analysis]) -> int:
    def lack(k: int) -> tuple[bool, float]:
        appearance = analyses[k].appearance
        return appearance.worst_wish is not None, appearance.delta_e

    return painted[max(range(len(analyses)), key=lack)]


def _wish_deliveries(analyses: Sequence[Analysis]) -> tuple[protocol.WishDelivery, ...]:
    """Return how much of each wish came in all views together, for the list of layers."""
    entries = [entry for analysis in analyses for entry in analysis.appearance.deliveries]
    return tuple(wish_delivery(x) for x in merge_views(entries))


def wish_delivery(delivery: Delivery) -> protocol.WishDelivery:
    """Return one entry of that list."""
    x = delivery
    return protocol.WishDelivery(
        x.name, x.kind, x.layers, x.brightness, x.color, x.delta_e, x.is_darker
    )


def unpainted_text(
    *,
    is_asked: bool,
    is_white: bool,
    is_moved: bool = False,
    is_started: bool = False,
    is_set: bool = False,
) -> str:
    """Describe the answer while nothing is painted, or all paint is undone.

    is_asked: whether there are constraints. is_white: whether all lights have to be white.
    is_moved: whether lights were moved or added. is_started: whether the solve starts from lamps
    that were set by hand. is_set: whether all constraints are levels and colours of lights that
    were set by hand, or painted on the map of an image.
    """
    if is_set and not is_white:
        return (
            "Nothing is painted: lights that you set are as you set them, all others as they were."
        )
    if is_started:
        return "Nothing is painted: the answer is your lamps, as you set them."
    stay = "the answer is the current lighting"
    if is_moved:
        stay += ", from where you put the lights"
    if is_white:
        stay = "every light has the white nearest to its colour, at the same brightness"
    if is_asked:
        also = ", within your constraints" if is_white else ", except for your constraints"
        stay = f"{stay if is_white else 'the lights stay as they are'}{also}"
    return f"Nothing is painted: {stay}."


def sketch_headline(appearance: Appearance) -> str:
    """Describe the progress of a painting, and the best next step, without judging it.

    The first strokes of a sketch can change little on their own. The sentence includes the effect
    on unpainted parts.
    """
    if appearance.is_close:
        return report.headline(appearance)
    phrase = _progress_phrase(appearance)
    if (wish := report.named_worst_wish(appearance)) is not None:
        return _wish_text(appearance, wish, phrase)
    if appearance.place is None:
        return f"{phrase}. Paint what matters most, or give it more importance."
    # One reason at a time: the next one appears once this is resolved.
    first = replace(appearance, reasons=appearance.causes[:1])
    missing = report.spoken_missing(appearance)
    text = f"{missing[0].upper()}{missing[1:]} is missing: {report.spoken_reason(first)}."
    newest = (
        "" if report.is_one_painting(appearance.deliveries) else report.spoken_newest(appearance)
    )
    if len(main_deliveries(appearance.deliveries)) == 1:  # which the phrase is about
        newest = ""
    return " ".join(filter(None, [f"{phrase}.", text, _advice_text(appearance), newest]))


def _wish_text(appearance: Appearance, wish: Delivery, phrase: str) -> str:
    """Describe the wish of which too little came, the newest one, and the progress.

    phrase: the progress, which comes first if the answer is worse than the current lighting, or
    changes the rest by more than it gains.
    """
    first = replace(appearance, reasons=appearance.causes[:1])
    is_warning = appearance.is_worse or appearance.is_at_cost
    lack = report.spoken_lack(first, wish)
    sentences = [lack, _advice_text(appearance) if appearance.causes else ""]
    if report.is_one_painting(appearance.deliveries):
        sentences.insert(0, f"{phrase}." if is_warning else report.spoken_whole(appearance))
    elif is_warning:
        sentences = [f"{phrase}.", *sentences, report.spoken_newest(appearance)]
    else:
        rest = appearance.unpainted_change if appearance.changes_unpainted else None
        whole = report.spoken_on_the_whole(appearance)
        sentences += [report.spoken_newest(appearance), whole, report.spoken_elsewhere(rest)]
    return " ".join(filter(None, sentences))


def _advice_text(appearance: Appearance) -> str:
    """Return what to do about the first reason; "" if its button says it."""
    button = advice(appearance)
    return "" if button is None else ADVICE_TEXTS.get(button.kind, "")


def _progress_phrase(appearance: Appearance) -> str:
    """Return `Most of the way: brightness 98 %, colour 67 %, and changes the annex by ΔE 12`.

    There is no praise if the rest has changed by more than the paint has come closer.
    """
    rest = appearance.unpainted_change if appearance.changes_unpainted else None
    phrase = report.spoken_came(appearance)
    if phrase == report.NO_CLOSER_TEXT:
        phrase = WORSE_TEXT if appearance.is_worse else phrase
    elif rest is not None and appearance.is_at_cost:
        cost = f"{report.spoken_part(rest)} (ΔE {report.spoken_amount(rest.worst)})"
        shares = report.spoken_mean_shares(appearance.deliveries)
        came = shares or f"{report.spoken_percent(appearance.progress)} of the way"
        return f"{came[0].upper()}{came[1:]}, at the cost of {cost}"
    return phrase if rest is None else f"{phrase}, and changes {report.spoken_changed(rest)}"


def why_not_closer(analysis: Analysis) -> list[str]:
    """Return at most five sentences on the reasons that keep the lights from the paint.

    `sketch_headline`, below the pictures, has the place of the largest error.
    """
    appearance, diagnosis = analysis.appearance, analysis.diagnosis
    if not (parts := report.spoken_shares(diagnosis)):
        return [report.NO_ERROR]
    problem = analysis.solution.problem
    words = MISS_TEXTS | (
        CONSTRAINED_MISS_TEXTS if problem.is_constrained or problem.fit.colors != "free" else {}
    )
    words |= {"unreachable": MISS_TEXTS["unreachable"] + report.reach_clause(appearance)}
    shares = [f"{share} {words[part]}" for part, share in parts.items()]
    sentences = [f"Of the difference (large errors count most), {', '.join(shares)}."]
    if appearance.place is None and diagnosis.place is not None:
        sentences.append(report.spoken_place(diagnosis.place))
    return sentences + report.bound_sentences(diagnosis, appearance, any_color=ANY_COLOR_TEXT)


def removable_reason(appearance: Appearance) -> Reason | None:
    """Return the reason in `sketch_headline`, if the user can remove it: neither what other views
    ask for, nor what a lamp is made of.
    """
    if appearance.is_close or appearance.place is None or not appearance.causes:
        return None
    first = appearance.causes[0]
    return None if first.kind in ("views", "emitters") else first


def advice(appearance: Appearance) -> protocol.Advice | None:
    """Return the same as data for a page's button: the obstacle to remove, and the gain."""
    if (cause := removable_reason(appearance)) is None:
        is_missed = not appearance.is_close and appearance.place is not None
        if not is_missed or appearance.causes or appearance.is_hidden_by_noise:
            return None
        is_for_new = appearance.lacks_light_of_its_own and appearance.has_strong_light
        return protocol.Advice("light" if is_for_new else "reach", (), None, None)
    if cause.kind == "hold" and not _helps_to_loosen(appearance, cause):
        return protocol.Advice("light", (), None, None)
    kind, names = cause.kind, tuple(cause.names)
    # The gain of a part of the paint is not the gain of the preview, which is about all of it.
    is_of_all = not appearance.reasons_wish
    if kind != "hold":
        gain = cause.share if is_of_all and not cause.is_joint else None
        return protocol.Advice(kind, names, gain, None, cause.delta_e)
    weaker = cause.loosening
    if weaker is None:
        return protocol.Advice(kind, names, None, 0.0)
    return protocol.Advice(
        kind, names, weaker.share if is_of_all else None, weaker.hold, weaker.delta_e
    )


def _helps_to_loosen(appearance: Appearance, hold: Reason) -> bool:
    """Return whether to loosen the hold: not where every light lights the rest, too, so that it
    would only take the rest along. Below the default it is not loosened once more, and from there
    not where that changes the rest by more than it gains.
    """
    if appearance.lacks_light_of_its_own:
        return False
    weaker = hold.loosening
    if weaker is None or weaker.present_hold is None or weaker.present_hold > DEFAULT_HOLD:
        return True
    return weaker.present_hold == DEFAULT_HOLD and not weaker.is_at_cost


def _closeness(analysis: Analysis) -> protocol.Closeness:
    """Return how close one view is, and why not closer."""
    appearance = analysis.appearance
    if appearance.is_close:
        sentences = report.compensation_sentences(appearance.compensating_lights)
    else:
        sentences = report.bound_sentences(analysis.diagnosis, appearance, any_color=ANY_COLOR_TEXT)
    return protocol.Closeness(
        headline=sketch_headline(appearance),
        help=advice(appearance),
        delta_e=appearance.delta_e,
        delta_e_present=appearance.requested_change,
        sentences=tuple(sentences),
    )


def preview_text(
    delta_e: tuple[float, float], rest: UnpaintedChange | None, *, is_at_cost: bool
) -> tuple[str, bool]:
    """Describe the effect of a change before it is made, and whether it changes more than it gains.

    These are the numbers that the answer after the change has. delta_e: mean over the paint, before
    and after. rest: the change of unpainted parts from the current scene, after it. is_at_cost:
    whether the change does more to the rest than it gains.
    """
    now, then = delta_e
    if round(then, 1) < round(now, 1):
        before, after = report.spoken_amount(now), report.spoken_amount(then)
        text = f"Comes closer to the paint (mean ΔE {after} instead of {before})"
    else:
        text = "The answer comes no closer"
    if rest is None or rest.worst < INVISIBLE:
        return f"{text}.", False
    text = f"{text}, and changes {report.spoken_changed(rest)}."
    more = " That is more than it gains." if is_at_cost else ""
    return text + more, is_at_cost


def edit_state(history: History, live_answer: LiveAnswer, views: Canvases) -> dict[str, Any]:
    """Return steps that can be undone, requests in effect and layers: the fields of `EditState`."""
    requests, fit = live_answer.requests, live_answer.fit
    return {
        "history": history.info(),
        "constraints": {name: dict(constraints) for name, constraints in requests.lights.items()},
        "ties": requests.ties,
        "settings": dict(requests.values),
        "poses": dict(requests.poses),
        "added_lights": tuple(requests.added),
        "places": requests.place_key,
        "effective_settings": protocol.ResolvedFit(fit.space, fit.hold, fit.colors),
        "layers": protocol.LayerList(
            tuple(_layer_info(layer, views) for layer in views.layers), views.next_layer
        ),
        "master": requests.master,
        "earlier": dict(requests.earlier),
        "kept": requests.kept,
        "is_started": bool(requests.start),
        "selection": protocol.SelectionInfo(
            tuple(view.selection.bounds for view in views),
            sum(view.selection.revision for view in views),
        ),
    }


def _layer_info(layer: Layer, views: Canvases) -> protocol.LayerInfo:
    """Return a layer for clients, with the region of its pixels in each view."""
    pixels = [view.layer(layer.id) for view in views]
    return protocol.LayerInfo(
        **vars(layer),
        regions=tuple(one.bounds for one in pixels),
        accents=tuple(view.accent(layer.id) for view in views),
        revision=sum(one.revision for one in pixels),
    )


def unpainted_headline(live_answer: LiveAnswer) -> str:
    """Return the headline while nothing is painted."""
    is_white = live_answer.fit.colors == "white"
    # Constraints from before the session count, too.
    is_other = not np.allclose(live_answer.weights, live_answer.basis.current_weights)
    is_asked = bool(live_answer.requests.lights) or (is_other and not is_white)
    is_moved = bool(live_answer.requests.placed)
    if live_answer.requests.start and not live_answer.requests.lights:
        return unpainted_text(is_asked=False, is_white=False, is_started=True)
    requests = live_answer.requests.lights.values()
    return unpainted_text(
        is_asked=is_asked,
        is_white=is_white,
        is_moved=is_moved,
        is_set=bool(requests) and all(set(x) <= set(HOLD_KEYS) for x in requests),
    )


def canvas_patches(
    canvases: Canvases, regions: Sequence[tuple[int, Region]], **fields: Any
) -> list[protocol.Message]:
    """Return the canvases' pixels there: a message for each view, or one for the first if nowhere.

    fields: the further fields of each.
    """
    views = tuple(view for view, _ in regions)
    messages: list[protocol.Message] = []
    for view, region in regions or ((0, (0, 0, 0, 0)),):
        image, importance, _ = canvases[view].pixels(region)
        messages.append(
            protocol.CanvasPatch(
                region=region,
                view=view,
                views=views,
                image=image,
                importance=importance,
                **fields,
            )
        )
    return messages
