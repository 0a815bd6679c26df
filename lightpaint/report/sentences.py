"""In plain sentences: how sure the answer is, and why it does not look like the painting."""

import re
from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE, luminance
from lightpaint.lighting.analysis.appearance.appearance import Seen
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.appearance.unpainted_change import Elsewhere
from lightpaint.lighting.analysis.diagnosis import Diagnosis, Place, parts_of_miss
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.answer.active_bound import Bound
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.solution import Solution
from lightpaint.report.measures import energy_shares
from lightpaint.screen import some_names, some_of

CHANNELS = ("red", "green", "blue")

#: Where nothing is missed.
MET = "The lights can do what is painted."

#: Shares of the miss, or of a light, that are too small to speak of.
SMALL = 0.05

#: The same of a light that is switched off: it is easily switched on.
SMALLER = 0.01

#: Characters of names in a sentence.
NAMES = 120

#: Of a light whose error says nothing, instead of one: in a table, and in a sentence.
UNTOLD = "cannot be told"
UNTOLD_HERE = f"{UNTOLD} at these samples"

#: What the painting and the light there must differ by to be called another colour.
SEEN = 0.06


def brightness(uncertainty: Uncertainty) -> tuple[Doubles, Doubles, Doubles]:
    """Luminance of each light as solved, and the ends of its 95 % interval, (n,) each.

    Of the channels of which something is known.
    """
    # One path carries all channels, so that their errors go together.
    known = np.isfinite(uncertainty.scatter)
    ends = (uncertainty.weights, *uncertainty.interval)
    solved, low, high = (np.where(known, end, 0) @ LUMINANCE for end in ends)
    return solved, low, high


def relative_errors(uncertainty: Uncertainty) -> Doubles:
    """How far the 95 % interval of each light's luminance goes, over its luminance, (n,).

    Not finite where the light is off and may be on; 0 where it has no error.
    """
    solved, low, high = brightness(uncertainty)
    side = np.maximum(solved - low, high - solved)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(side > 0, side / solved, 0.0)


def spoken_errors(uncertainty: Uncertainty | None, count: int) -> list[str]:
    """`± 4 %` of each light; empty if nothing is known of it.

    On one side only, `0 … +4 %`, of what is at a limit; `0 … 0.9`, in its unit, of what is off;
    `cannot be told` of a light of which the samples show nothing but stray pixels.
    """
    if uncertainty is None:
        return [""] * count
    told = zip(*brightness(uncertainty), uncertainty.untold, strict=True)
    return [UNTOLD if untold else _spoken_error(*ends) for *ends, untold in told]


def untold_lights(lighting: Lighting) -> str:
    """A sentence on the lights that cannot be told; "" if there are none."""
    names = [light.name for light in lighting.lights if light.untold]
    if not names:
        return ""
    it = "it" if len(names) == 1 else "them"
    return (
        f"{spoken_lights(names, start=True)} {UNTOLD_HERE}: little but stray bright pixels is seen "
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
    """A clause for the lights of which some channels reach nothing painted."""
    by_channels: dict[str, list[str]] = {}
    for light in lighting.lights:
        if light.is_partly_reached:
            by_channels.setdefault(unreached_channels(light), []).append(light.name)
    return [
        f"no painted pixel shows the {channels} of {some_of(names, room=200)}: kept as it is"
        for channels, names in by_channels.items()
    ]


def unreached_channels(light: LightSetting) -> str:
    """`green and blue`: the channels of a light that reach nothing that counts."""
    return " and ".join(c for c, told in zip(CHANNELS, light.reached, strict=True) if not told)


def how_sure(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> str:
    """What more samples would change, of the light whose error changes the picture most."""
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
    """The light whose error changes the picture most, of those that can be told; None if none."""
    errors = relative_errors(uncertainty)
    effect = np.where(np.isfinite(errors) & ~uncertainty.untold, errors, 0) * energy_shares(
        basis, solution.lighting
    )
    return int(np.argmax(effect)) if effect.any() else None


def halving_spp(basis: Basis, uncertainty: Uncertainty, k: int) -> int:
    """Samples per pixel at which the error of light k is half of what it is.

    Scatter falls with the root of the samples, bias with their number.
    """
    scatter, bias = (np.nansum(np.square(x[k])) for x in (uncertainty.scatter, uncertainty.bias))
    # scatter / m + bias / m² = (scatter + bias) / 4
    total = scatter + bias
    times = 2 * (scatter + np.sqrt(scatter**2 + total * bias)) / total if total > 0 else 1.0
    exact = times * basis.origin.spp
    power = 2 ** int(np.floor(np.log2(exact)) - 2)
    return int(np.ceil(exact / power) * power) if power >= 1 else int(np.ceil(exact))


def what_is_missed(
    diagnosis: Diagnosis, seen: Seen | None = None, *, holds: Sequence[str] | None = None
) -> list[str]:
    """Return at most four sentences on why it does not look like the painting, the main one first.

    seen: what `what_is_seen` says, whose reasons go before what holds single lights. holds: other
    words for what `what_holds` says.
    """
    d = diagnosis
    if not (parts := parts_of_miss(d)):
        return [MET]
    # What is kept has a bound of its own below.
    which = "the adjusted lights" if any(x.kind == "kept" for x in d.bounds) else "the lights"
    words = {
        "unreachable": f"no mix of {which} can reach{while_held(seen)}",
        "forbidden": "would need other limits of the lights or light below zero"
        if d.is_constrained
        else "only light below zero could",
        "compromise": "is given up for the other views",
        "noise": "is noise of the basis",
        "painting_noise": noise_of_painting(d),
    }
    shares = [f"{spoken_percent(share)} {words[part]}" for part, share in parts.items()]
    sentences = [f"Of what is missed (in energy), {', '.join(shares)}."]
    is_told = seen is not None and seen.place is not None  # by the headline
    if d.place is not None and not is_told and d.share(d.unreachable) >= SMALL:
        sentences.append(spoken_place(d.place))
    return [*sentences, *(what_holds(d, seen) if holds is None else holds)]


def while_held(seen: Seen | None) -> str:
    """Return ` while the rest is held` where that keeps the lights from the paint, else ""."""
    is_held = seen is not None and any(reason.kind == "hold" for reason in seen.reasons)
    return " while the rest is held" if is_held else ""


def what_holds(diagnosis: Diagnosis, seen: Seen | None = None) -> list[str]:
    """Return at most two sentences on what holds the lights, what would bring most first.

    seen: what `what_is_seen` says: the reasons that its headline names are told with their shares,
    and others only where there are none.
    """
    if seen is not None and seen.reasons:
        told = [spoken_cause(reason) for reason in seen.reasons]
        return [sentence for sentence in told if sentence][:2]
    d = diagnosis
    most = [bound for bound in d.bounds[:1] if d.gained(bound) >= SMALL]
    to_switch_on = [
        bound for bound in d.bounds if bound.is_switched_off and d.gained(bound) >= SMALLER
    ]
    its = dict.fromkeys([*most, *to_switch_on[:1]])
    return [spoken_bound(bound, d.gained(bound)) for bound in its]


#: What is asked of lights, and what would be without it: of one, and of several.
WITHOUT = {
    "off": ("switched off, as asked; switching it on", "switched off, as asked; switching them on"),
    "lock": ("locked; adjusting it", "locked; adjusting them"),
    "limits": ("at a limit; letting go of that", "at their limits; letting go of these"),
    "colour": ("held to a colour; any other", "held to colours; any others"),
    "tie": (
        "on a dimmer with others; adjusting it by itself",
        "on one dimmer; adjusting each by itself",
    ),
}

#: The same of all lights together.
WITHOUT_ALL = {
    "colors": 'Lamps are not free in their colour; colors="free"',
    "sparse": "Only so many lights may be on; allowing more",
    "prefer_current": "Lights are pulled towards how they are now; leaving them free",
}


def spoken_cause(reason: Reason, *, weaker: str = "a hold of") -> str:
    """Say what keeps the lights from the paint, and what letting it go would bring; "" of views.

    weaker: what stands before the strength of a weaker hold.
    """
    gained = f"would take away {spoken_percent(reason.share)} of the miss"
    if reason.is_joint:
        gained += ", if the other conditions were lifted too"
    if reason.kind in WITHOUT:
        is_one = len(reason.names) == 1
        lights = spoken_lights(reason.names, start=True) + (" is" if is_one else " are")
        return f"{lights} {WITHOUT[reason.kind][not is_one]} {gained}."
    if reason.kind in WITHOUT_ALL:
        return f"{WITHOUT_ALL[reason.kind]} {gained}."
    if reason.kind == "views":
        return ""
    held = "What is not painted is held near how it is;"
    if (loosening := reason.loosening) is None:
        return f"{held} letting it go {gained}."
    share, rest = spoken_percent(loosening.share), loosening.elsewhere
    cost = "" if rest is None else f", and change {spoken_changed(rest)}"
    return f"{held} {weaker} {loosening.hold:g} would take away {share} of the miss{cost}."


def spoken_changed(rest: Elsewhere) -> str:
    """Say what changes most of what is not painted, and how much: `the annex by ΔE 12`."""
    return f"{spoken_part(rest)} by ΔE {spoken_amount(rest.worst)}"


def spoken_elsewhere(rest: Elsewhere | None) -> str:
    """Say `What is not painted changes too, most of all the annex, by ΔE 12.`; "" for None."""
    return f"What is not painted changes too, most of all {_spoken_most(rest)}." if rest else ""


def _spoken_most(rest: Elsewhere) -> str:
    its = spoken_part(rest) if rest.object else spoken_ninth(rest.region)
    return f"{its}, by ΔE {spoken_amount(rest.worst)}"


def spoken_part(rest: Elsewhere) -> str:
    """Name what changes most: `the annex`, or what is in that part of the picture."""
    if not rest.object:
        return f"what is {spoken_ninth(rest.region)}"
    return f"the {some_names([rest.object.replace('_', ' ').strip()])}"


def spoken_amount(delta_e: float) -> str:
    """Return a ΔE as it is said: `0.4`, `12`."""
    return f"{delta_e:.0f}" if delta_e >= 9.5 else f"{delta_e:.1f}"


def noise_of_painting(diagnosis: Diagnosis) -> str:
    """Whose that noise is: where nothing is known of the basis' own, it may be its as well."""
    if diagnosis.noise > 0:
        return "is noise of the painting, as renders have"
    return "is noise of the painting or of the lights' images"


def spoken_lights(names: Sequence[str], *, start: bool = False) -> str:
    """`light key`, `lights key, fill`, or `light_3` alone where that says what it is.

    start: of a sentence. Of very many the first are named, and how many there are.
    """
    listed = some_of([name or "without a name" for name in names], room=NAMES)
    if all(re.search("light|lamp", name, re.IGNORECASE) for name in names):
        return listed
    word = "light" if len(names) == 1 else "lights"
    return f"{word.capitalize() if start else word} {listed}"


def spoken_bound(bound: Bound, share: float) -> str:
    """What holds a light, and which share of the miss that is."""
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
        "left out": f"left out, as only so many may be on; switching {it} on too",
        "tie": "on one dimmer; adjusting each by itself",
        "limits": f"at a limit ({bound.held_by}); letting go of that",
        "colour": f"held to a colour ({bound.held_by}); any other",
    }[bound.kind]
    return f"{lights} {held} would take away {spoken_percent(share)} of the miss."


def spoken_hold(bound: Bound) -> str:
    """What holds a light, in few words; of one at zero, in which channels by where it is felt."""
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
    """`in the middle`, `top left`: where in the picture."""
    return spoken_ninth(place.region)


def spoken_ninth(region: tuple[int, int]) -> str:
    """Return the same for a row and a column, 0 to 2 each."""
    rows, columns = ("top", "middle", "bottom"), ("left", "middle", "right")
    row, column = rows[region[0]], columns[region[1]]
    if row == column == "middle":
        return "in the middle"
    if row == "middle":
        return f"on the {column}"
    return f"at the {row}" if column == "middle" else f"at the {row} {column}"


def spoken_where(place: Place) -> str:
    """`on the statue`, or where in the picture."""
    if not place.object:
        return spoken_region(place)
    return f"on the {some_names([place.object.replace('_', ' ').strip()])}"


def spoken_place(place: Place) -> str:
    """Where light is missing, and what it lacks."""
    where = f"{spoken_region(place)} ({spoken_percent(place.share)})"
    change = spoken_difference(place.painted, place.reached)
    return (
        f"Most of that out of reach is {where}: painted {change} than any mix of the lights "
        "makes it."
    )


def spoken_difference(
    painted: tuple[float, float, float], reached: tuple[float, float, float]
) -> str:
    """`brighter and bluer`: how a painted colour differs from the one that lights reach."""
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
        if abs(shift[most]) > SEEN:
            more, less = ("redder", "greener", "bluer"), ("cooler", "pinker", "yellower")
            words.append(more[most] if shift[most] > 0 else less[most])
    if not words:
        words = ["a little brighter" if bright_a > bright_b else "a little darker"]
    return " and ".join(words)


def spoken_percent(share: float) -> str:
    """`0.4 %`, `7 %`, `62 %`."""
    return f"{100 * share:.1f} %" if 0 < share < 0.0095 else f"{100 * share:.0f} %"
