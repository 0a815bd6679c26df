"""Sentences on how much of each wish came: `Moonlight: brightness 98 %, colour 43 %.`"""

from collections.abc import Sequence

from lightpaint.display_text import some_names
from lightpaint.lighting.analysis.appearance.appearance import Appearance
from lightpaint.lighting.analysis.appearance.delivery import (
    Delivery,
    main_deliveries,
    mean_shares,
    newest_delivery,
    spoken_share,
)

#: Maximum number of wishes in a list of sentences.
MAX_WISHES = 4

#: What may bring a wish: where no light reaches it, where none reaches it alone, and where a light
#: for it lights something else, too.
REACH_ADVICE = "A light that hangs or points elsewhere may reach it."
ALONE_ADVICE = "Add a light for it, or paint the rest as well."
SAMPLES_ADVICE = "Render more samples."
SPILL_ADVICE = "More importance, or lights that move, may help."


def spoken_deliveries(deliveries: Sequence[Delivery], told: str = "") -> str:
    """Return how much of each wish came, one short sentence each; "" without wishes.

    told: sentences that stand before these; wishes whose shares they say are left out.
    Wishes that ask for nothing visible are left out, and of many those of which most came. Parts of
    a painting without layers are only told apart if one of them lacks something.
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
    spoken = [spoken_delivery(entry) for entry in shown]
    texts = [f"{text}." for text in spoken if f". {text}" not in f". {told}"]
    rest = len(entries) - len(shown)
    if rest > 0:
        texts.append(f"More came of {'one other' if rest == 1 else f'{rest} others'}.")
    return " ".join(texts)


def spoken_mean_shares(deliveries: Sequence[Delivery]) -> str:
    """Return how much of all wishes came, `brightness 95 %, colour 52 %`; "" if none asks for
    anything visible.
    """
    shares = mean_shares(deliveries)
    named = (("brightness", shares.brightness), ("colour", shares.color))
    return ", ".join(f"{part} {spoken_share(x)}" for part, x in named if x is not None)


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
