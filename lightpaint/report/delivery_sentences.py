"""Sentences on how much of each wish came: `Moonlight: brightness 98 %, colour 43 %.`"""

from collections.abc import Sequence

from lightpaint.display_text import some_names
from lightpaint.lighting.analysis.appearance.appearance import Appearance
from lightpaint.lighting.analysis.appearance.delivery import (
    MIN_DELIVERED,
    Delivery,
    main_deliveries,
    newest_delivery,
    spoken_share,
)

#: Maximum number of wishes in a list of sentences.
MAX_WISHES = 6

#: What may bring a wish that no light in its place can bring.
REACH_ADVICE = "A light that hangs or points elsewhere may reach it."


def spoken_deliveries(deliveries: Sequence[Delivery]) -> str:
    """Return how much of each wish came, one short sentence each; "" without wishes.

    Wishes that ask for nothing visible are left out, and of many the last ones.
    """
    entries = [entry for entry in main_deliveries(deliveries) if entry.least is not None]
    if len(entries) == 1 and is_unnamed(entries[0]):
        shares = entries[0].spoken_shares
        return f"{shares[:1].upper()}{shares[1:]} of what was asked for came."
    texts = [f"{wish_name(entry)}: {entry.spoken_shares}." for entry in entries[:MAX_WISHES]]
    rest = len(entries) - MAX_WISHES
    return " ".join([*texts, f"And {rest} more."] if rest > 0 else texts)


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
    """Return `Moonlight came to 98 % in brightness and 43 % in colour`."""
    brightness, color, name = delivery.brightness, delivery.color, wish_name(delivery)
    if brightness is None or color is None:
        return f"{name} came to {delivery.spoken_shares}"
    return (
        f"{name} came to {spoken_share(brightness)} in brightness and {spoken_share(color)} in "
        "colour"
    )


def spoken_unreached(delivery: Delivery) -> str:
    """Return `Lantern is out of reach (8 %)`, or `The colour of Lantern is out of reach (43 %)`."""
    brightness, color = delivery.brightness, delivery.color
    name = wish_name(delivery)
    if brightness is None or color is None:
        return f"{name} is out of reach ({delivery.spoken_shares})"
    if brightness >= MIN_DELIVERED:
        return f"The colour of {name} is out of reach ({spoken_share(color)})"
    if color >= MIN_DELIVERED:
        return f"The brightness of {name} is out of reach ({spoken_share(brightness)})"
    return f"{name} is out of reach ({delivery.spoken_shares})"


def spoken_newest(appearance: Appearance) -> str:
    """Return how much of the newest wish came, `Lantern came to 95 %.`; "" if it is the worst, or
    asks for nothing visible.
    """
    newest, worst = newest_delivery(appearance.deliveries), appearance.worst_wish
    if newest is None or newest.least is None or newest is worst:
        return ""
    if worst is not None and newest.kind == "group" and worst.group == newest.name:
        return ""
    return f"{spoken_delivery(newest)}."


def lacks_only_color(delivery: Delivery) -> bool:
    """Return whether enough of the brightness came, or none was asked, but not of the colour."""
    brightness, color = delivery.brightness, delivery.color
    has_light = brightness is None or brightness >= MIN_DELIVERED
    return has_light and color is not None and color < MIN_DELIVERED
