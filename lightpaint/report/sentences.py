"""Plain sentences on how sure the answer is, and on why it does not look like the painting."""

import re
from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE, luminance
from lightpaint.lighting.analysis.appearance.appearance import Seen
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.appearance.unpainted_change import UnpaintedChange
from lightpaint.lighting.analysis.diagnosis import Diagnosis, Place, error_shares
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.answer.active_bound import Bound
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.solution import Solution
from lightpaint.report.measures import energy_shares
from lightpaint.screen import some_names, some_of

CHANNELS = ("red", "green", "blue")

#: The sentence for an answer without error.
NO_ERROR = "The lights can make what is painted."

#: Share of the error, or of a light, that is too small to mention.
MIN_SHARE = 0.05

#: The same for a light that is switched off, which is easily switched on.
MIN_SWITCHED_OFF_SHARE = 0.01

#: Characters of names in a sentence.
MAX_NAME_CHARACTERS = 120

#: Texts for a light without a meaningful error: in a table, and in a sentence.
UNTOLD = "cannot be told"
UNTOLD_HERE = f"{UNTOLD} at these samples"

#: Difference of painting and light, in chromaticity, that counts as another colour.
COLOR_SHIFT = 0.06


def brightness(uncertainty: Uncertainty) -> tuple[Doubles, Doubles, Doubles]:
    """Return the luminance of each light as solved, and the ends of its 95 % interval, (n,) each.

    Only known channels count.
    """
    # One path carries all channels, so that their errors go together.
    known = np.isfinite(uncertainty.scatter)
    ends = (uncertainty.weights, *uncertainty.interval)
    solved, low, high = (np.where(known, end, 0) @ LUMINANCE for end in ends)
    return solved, low, high


def relative_errors(uncertainty: Uncertainty) -> Doubles:
    """Return the half width of each light's 95 % interval over its luminance, (n,).

    It is not finite if the light is off and may be on; 0 without error.
    """
    solved, low, high = brightness(uncertainty)
    side = np.maximum(solved - low, high - solved)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(side > 0, side / solved, 0.0)


def spoken_errors(uncertainty: Uncertainty | None, count: int) -> list[str]:
    """Return `± 4 %` for each light; empty for unknown errors.

    At a limit it has one side, `0 … +4 %`; a light that is off has `0 … 0.9`, in its unit; a light
    with little but stray pixels in the samples has `cannot be told`.
    """
    if uncertainty is None:
        return [""] * count
    told = zip(*brightness(uncertainty), uncertainty.untold, strict=True)
    return [UNTOLD if untold else _spoken_error(*ends) for *ends, untold in told]


def untold_lights(lighting: Lighting) -> str:
    """Return a sentence on the lights that samples do not determine; "" if there are none."""
    names = [light.name for light in lighting.lights if light.untold]
    if not names:
        return ""
    it = "it" if len(names) == 1 else "them"
    return (
        f"{spoken_lights(names, start=True)} {UNTOLD_HERE}: the samples show little but stray "
        f"bright pixels "
        f"of {it}. Render more samples, or keep {it}."
    )


def _spoken_error(solved: float, low: float, high: float) -> str:
    if low >= high:
        return ""
    if solved == 0:
        return f"0 … {high:.2g}"
    below, above = (spoken_percent(float(side / solved)) for side in (solved - low, high - solved))
    if below == above:
        return f"± {below}"
    return f"{f'−{below}' if low < solved else '0'} … {f'+{above}' if high > solved else '0'}"


def partly_reached(lighting: Lighting) -> list[str]:
    """Return a clause for the lights some of whose channels reach nothing painted."""
    by_channels: dict[str, list[str]] = {}
    for light in lighting.lights:
        if light.is_partly_reached:
            by_channels.setdefault(unreached_channels(light), []).append(light.name)
    return [
        f"no painted pixel shows the {channels} of {some_of(names, room=200)}: kept as it is"
        for channels, names in by_channels.items()
    ]


def unreached_channels(light: LightSetting) -> str:
    """Return `green and blue`: the channels of a light that reach nothing that counts."""
    return " and ".join(c for c, told in zip(CHANNELS, light.reached, strict=True) if not told)


def uncertainty_sentence(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> str:
    """Return a sentence on the light whose error changes the picture most, and on the samples to
    halve it.
    """
    k = most_uncertain(basis, solution, uncertainty)
    untold = untold_lights(solution.lighting)
    if k is None and untold:
        return untold
    if k is None:
        has_noise = any(x.any() for x in basis.noise)
        why = "nothing in it depends on the noise" if has_noise else "the basis has no noise"
        return f"More samples would change no light: {why}."
    shares = energy_shares(basis, solution.lighting)
    errors = relative_errors(uncertainty)
    name = solution.lighting.lights[k].name
    light = f"{spoken_lights([name])}, {spoken_percent(shares[k])} of the picture"
    change = "as much as all of it" if errors[k] > 1 else f"± {spoken_percent(float(errors[k]))}"
    said = (
        f"More samples would change {light}, by {change} (95 %); "
        f"{halving_spp(basis, uncertainty, k)} samples per pixel would halve that."
    )
    return f"{untold} {said}" if untold else said


def most_uncertain(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> int | None:
    """Return the light whose error changes the picture most, if it is determined; None if none
    is."""
    errors = relative_errors(uncertainty)
    effect = np.where(np.isfinite(errors) & ~uncertainty.untold, errors, 0) * energy_shares(
        basis, solution.lighting
    )
    return int(np.argmax(effect)) if effect.any() else None


def halving_spp(basis: Basis, uncertainty: Uncertainty, k: int) -> int:
    """Return samples per pixel that halve the error of light k.

    Scatter falls with the root of the samples, bias with their number.
    """
    scatter, bias = (np.nansum(np.square(x[k])) for x in (uncertainty.scatter, uncertainty.bias))
    # scatter / m + bias / m² = (scatter + bias) / 4
    total = scatter + bias
    times = 2 * (scatter + np.sqrt(scatter**2 + total * bias)) / total if total > 0 else 1.0
    exact = times * basis.origin.spp
    power = 2 ** int(np.floor(np.log2(exact)) - 2)
    return int(np.ceil(exact / power) * power) if power >= 1 else int(np.ceil(exact))


def error_sentences(
    diagnosis: Diagnosis, seen: Seen | None = None, *, holds: Sequence[str] | None = None
) -> list[str]:
    """Return at most four sentences on why it does not look like the painting, the main one first.

    seen: the result of `what_is_seen`, whose reasons go before single bounds. holds: instead of the
    sentences of `bound_sentences`.
    """
    d = diagnosis
    if not (parts := error_shares(d)):
        return [NO_ERROR]
    # What is kept has a bound of its own below.
    which = "the adjusted lights" if any(x.kind == "kept" for x in d.bounds) else "the lights"
    words = {
        "unreachable": f"is out of reach of any mix of {which}{hold_clause(seen)}",
        "forbidden": "would need other limits of the lights or light below zero"
        if d.is_constrained
        else "would need light below zero",
        "compromise": "is given up for the other views",
        "noise": "is noise of the basis",
        "painting_noise": painting_noise_clause(d),
    }
    shares = [f"{spoken_percent(share)} {words[part]}" for part, share in parts.items()]
    sentences = [f"Of what is missed (in energy), {', '.join(shares)}."]
    is_told = seen is not None and seen.place is not None  # by the headline
    if d.place is not None and not is_told and d.share(d.unreachable) >= MIN_SHARE:
        sentences.append(spoken_place(d.place))
    return [*sentences, *(bound_sentences(d, seen) if holds is None else holds)]


def hold_clause(seen: Seen | None) -> str:
    """Return ` while the rest is held` if that keeps the lights from the paint, else ""."""
    is_held = seen is not None and any(reason.kind == "hold" for reason in seen.reasons)
    return " while the rest is held" if is_held else ""


def bound_sentences(diagnosis: Diagnosis, seen: Seen | None = None) -> list[str]:
    """Return at most two sentences on what holds the lights, the most important first.

    seen: the result of `what_is_seen`; its reasons come with their shares, and single bounds only
    if there are none.
    """
    if seen is not None and seen.reasons:
        told = [spoken_cause(reason) for reason in seen.reasons]
        return [sentence for sentence in told if sentence][:2]
    d = diagnosis
    most = [bound for bound in d.bounds[:1] if d.gain_share(bound) >= MIN_SHARE]
    to_switch_on = [
        bound
        for bound in d.bounds
        if bound.is_switched_off and d.gain_share(bound) >= MIN_SWITCHED_OFF_SHARE
    ]
    its = dict.fromkeys([*most, *to_switch_on[:1]])
    return [spoken_bound(bound, d.gain_share(bound)) for bound in its]


#: Clauses on constraints and their release: for one light, and for several.
RELEASE_CLAUSES = {
    "off": ("switched off, as asked; switching it on", "switched off, as asked; switching them on"),
    "lock": ("locked; adjusting it", "locked; adjusting them"),
    "limits": ("at a limit; letting go of that", "at their limits; letting go of these"),
    "colour": ("held to a colour; any other", "held to colours; any others"),
    "tie": (
        "on a dimmer with others; adjusting it by itself",
        "on one dimmer; adjusting each by itself",
    ),
}

#: The same for all lights together.
JOINT_RELEASE_CLAUSES = {
    "colors": 'Lamps keep their colours; colors="free"',
    "sparse": "The number of lights is limited; allowing more",
    "prefer_current": "Lights are pulled towards their present setting; leaving them free",
}


def spoken_cause(reason: Reason, *, weaker: str = "a hold of") -> str:
    """Say what keeps the lights from the paint, and the gain of releasing it; "" for views.

    weaker: the words before the strength of a weaker hold.
    """
    gained = f"would take away {spoken_percent(reason.share)} of the miss"
    if reason.is_joint:
        gained += ", if the other conditions were lifted too"
    if reason.kind in RELEASE_CLAUSES:
        is_one = len(reason.names) == 1
        lights = spoken_lights(reason.names, start=True) + (" is" if is_one else " are")
        return f"{lights} {RELEASE_CLAUSES[reason.kind][not is_one]} {gained}."
    if reason.kind in JOINT_RELEASE_CLAUSES:
        return f"{JOINT_RELEASE_CLAUSES[reason.kind]} {gained}."
    if reason.kind == "views":
        return ""
    held = "Unpainted parts are held near their present look;"
    if (loosening := reason.loosening) is None:
        return f"{held} letting it go {gained}."
    share, rest = spoken_percent(loosening.share), loosening.elsewhere
    cost = "" if rest is None else f", and change {spoken_changed(rest)}"
    return f"{held} {weaker} {loosening.hold:g} would take away {share} of the miss{cost}."


def spoken_changed(rest: UnpaintedChange) -> str:
    """Say which unpainted part changes most, and by how much: `the annex by ΔE 12`."""
    return f"{spoken_part(rest)} by ΔE {spoken_amount(rest.worst)}"


def spoken_elsewhere(rest: UnpaintedChange | None) -> str:
    """Say `Unpainted parts change too, most of all the annex, by ΔE 12.`; "" for None."""
    return f"Unpainted parts change too, most of all {_spoken_most(rest)}." if rest else ""


def _spoken_most(rest: UnpaintedChange) -> str:
    its = spoken_part(rest) if rest.object else spoken_ninth(rest.region)
    return f"{its}, by ΔE {spoken_amount(rest.worst)}"


def spoken_part(rest: UnpaintedChange) -> str:
    """Name the part that changes most: `the annex`, or a region of the picture."""
    if not rest.object:
        return f"what is {spoken_ninth(rest.region)}"
    return f"the {some_names([rest.object.replace('_', ' ').strip()])}"


def spoken_amount(delta_e: float) -> str:
    """Return a ΔE in words: `0.4`, `12`."""
    return f"{delta_e:.0f}" if delta_e >= 9.5 else f"{delta_e:.1f}"


def painting_noise_clause(diagnosis: Diagnosis) -> str:
    """Return a clause on noise of the painting, or of the lights' images if that is unknown."""
    if diagnosis.noise > 0:
        return "is noise of the painting, as renders have"
    return "is noise of the painting or of the lights' images"


def spoken_lights(names: Sequence[str], *, start: bool = False) -> str:
    """Return `light key`, `lights key, fill`, or `light_3` alone if the name says what it is.

    start: of a sentence. Of very many, the first are named, with the number of others.
    """
    listed = some_of([name or "without a name" for name in names], room=MAX_NAME_CHARACTERS)
    if all(re.search("light|lamp", name, re.IGNORECASE) for name in names):
        return listed
    word = "light" if len(names) == 1 else "lights"
    return f"{word.capitalize() if start else word} {listed}"


def spoken_bound(bound: Bound, share: float) -> str:
    """Return a sentence on a bound that holds a light, with its share of the error."""
    is_one = len(bound.lights) == 1
    lights = spoken_lights(bound.lights, start=True) + (" is" if is_one else " are")
    if bound.kind == "zero":
        return (
            f"{lights} {spoken_hold(bound)} and still too much: the painting is darker there than "
            f"the other lights leave it ({spoken_percent(share)} of the miss)."
        )
    it = "it" if is_one else "them"
    if bound.tint:
        return (
            f"{spoken_lights(bound.lights, start=True)} would have to be {bound.tint} than its "
            f"whites ({bound.held_by}): any colour would take away {spoken_percent(share)} of the "
            "miss."
        )
    held = {
        "kept": f"kept as it is; adjusting {it} too",
        "lock": f"locked; adjusting {it}",
        "off": f"switched off, as asked; switching {it} on",
        "left out": f"left out, since their number is limited; switching {it} on too",
        "tie": "on one dimmer; adjusting each by itself",
        "limits": f"at a limit ({bound.held_by}); letting go of that",
        "colour": f"held to a colour ({bound.held_by}); any other",
    }[bound.kind]
    return f"{lights} {held} would take away {spoken_percent(share)} of the miss."


def spoken_hold(bound: Bound) -> str:
    """Return the bound in few words; for a light at zero, with the channels that feel it."""
    if bound.kind == "kept":
        return "kept as it is"
    if bound.kind != "zero":
        tint = f"; would have to be {bound.tint}" if bound.tint else ""
        return f"{bound.held_by}{tint}"
    if len(bound.multiplier) != 3:
        return "off"
    felt = zip(CHANNELS, bound.multiplier, strict=True)
    held = [n for n, m in felt if m > 0.01 * max(bound.multiplier)]
    return "off" if len(held) == 3 else f"off in {' and '.join(held)}"


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
    """Return a sentence on where light is missing, and what it lacks."""
    where = f"{spoken_region(place)} ({spoken_percent(place.share)})"
    change = spoken_difference(place.painted, place.reached)
    return (
        f"Most of that out of reach is {where}: painted {change} than any mix of the lights "
        "makes it."
    )


def spoken_difference(
    painted: tuple[float, float, float], reached: tuple[float, float, float]
) -> str:
    """Return how a painted colour differs from the one that lights reach: `brighter and bluer`."""
    a, b = np.array(painted), np.maximum(np.array(reached), 0)
    bright_a, bright_b = float(luminance(a)), float(luminance(b))
    words = []
    if bright_a > 1.2 * bright_b:
        words.append("brighter")
    elif 1.2 * bright_a < bright_b:
        words.append("darker")
    if a.sum() > 0 and b.sum() > 0:
        shift = a / a.sum() - b / b.sum()
        most = int(np.argmax(np.abs(shift)))
        if abs(shift[most]) > COLOR_SHIFT:
            more, less = ("redder", "greener", "bluer"), ("cooler", "pinker", "yellower")
            words.append(more[most] if shift[most] > 0 else less[most])
    if not words:
        words = ["a little brighter" if bright_a > bright_b else "a little darker"]
    return " and ".join(words)


def spoken_percent(share: float) -> str:
    """Return `0.4 %`, `7 %`, `62 %`."""
    return f"{100 * share:.1f} %" if 0 < share < 0.0095 else f"{100 * share:.0f} %"
