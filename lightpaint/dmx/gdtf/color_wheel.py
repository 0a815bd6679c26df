"""Colour wheels: the slots that a channel can choose, and the colour that each gives a lamp.

Only levels at which a slot stands in the beam count: between two slots a wheel shows both.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, count, pairwise, product
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Doubles, as_rgb
from lightpaint.colour import (
    C2,
    MAX_SLOTS,
    OPAQUE,
    REC2020,
    SlotFilter,
    ciede2000,
    lab_of_lights,
    matching_functions,
    rgb_to_xyz,
    xy_of,
)
from lightpaint.dmx.console_rig import RigSlot
from lightpaint.dmx.gdtf import emitter_colour
from lightpaint.dmx.gdtf.mode_channels import ChannelFunction, ModeChannel, dmx_value

#: What stands between the names of two slots that share the beam.
_SPLIT = re.compile(r"\s*[/+|&]\s*")

#: Least share of light of a slot that is open.
CLEAR = 0.9

#: Least share of light of two slots together, and the CIEDE2000 below which colours are alike.
DARKEST, ALIKE = 0.005, 2.0

#: Combinations of slots up to which combinations of several wheels count.
MAX_COMBINATIONS = 2**12

#: PhysicalFrom and PhysicalTo of a set that does not say how far a wheel is from a slot.
_NOT_SAID = (0.0, 1.0)


@dataclass(frozen=True)
class SlotColour:
    """A slot as a channel chooses it, and the light behind it.

    colour: its share is relative to the lamp's light without a wheel.
    """

    slot: RigSlot
    colour: emitter_colour.EmitterColour


@dataclass(frozen=True)
class _Set:
    """A range of levels of a channel. number: of its slot, from 1; 0 for none."""

    name: str
    number: int
    first: int
    last: int
    physical: tuple[float, float]


def wheel_slots(
    channel: ModeChannel,
    attribute: str,
    wheels: Sequence[Element],
    filters: Sequence[Element],
    kelvin: float,
) -> list[SlotColour]:
    """Return the slots of the wheel that a channel turns; none if its file names no wheel for it.

    attribute: of the channel's functions that choose slots, such as Color1. wheels, filters: of the
    file. kelvin: of the lamp, whose light is taken to be a black body's.
    """
    functions = [x for x in channel.functions if x.attribute == attribute]
    names = {x.element.get("Wheel") for x in functions}
    wheel = next((x for x in wheels if x.get("Name") in names), None)
    if wheel is None:
        return []
    elements = wheel.findall("Slot")[:MAX_SLOTS]
    sets = [x for f in functions for x in _sets_of(f, len(channel.dmx.offsets))]
    chosen = {k: _seated(k, element, sets, elements) for k, element in enumerate(elements, start=1)}
    found: list[SlotColour] = []
    for k, slot in chosen.items():
        if slot is not None:
            name = _free_name(elements[k - 1], k, {x.colour.name for x in found})
            found.append(SlotColour(slot, _colour(name, elements[k - 1], filters, kelvin)))
    return found


@dataclass(frozen=True)
class SlotCombination:
    """Slots of wheels one behind the other, one of each: the light behind them, and what they let
    through of light that is mixed before.
    """

    slots: tuple[RigSlot, ...]
    colour: emitter_colour.EmitterColour
    filter: SlotFilter


def slot_combinations(
    wheels: Sequence[Sequence[SlotColour]], kelvin: float
) -> list[SlotCombination]:
    """Return the combinations of slots of wheels, of which the slots of a single wheel come first.

    Transmissions multiply. Of the others, the brightest remain whose colour no brighter one has;
    of very many combinations, none. kelvin: of the lamp. The open slot of a wheel is its brightest.
    """
    opens = [int(np.argmax([x.colour.share for x in slots])) for slots in wheels]
    if math.prod(map(len, wheels)) <= MAX_COMBINATIONS:
        every = [*product(*(range(len(x)) for x in wheels))]
    else:
        alone = ((j, k) for j, slots in enumerate(wheels) for k in range(len(slots)))
        every = [*dict.fromkeys((*opens[:j], k, *opens[j + 1 :]) for j, k in alone)]
    turned = {c: [j for j, k in enumerate(c) if k != opens[j]] for c in every}
    found = {c: _combined(c, wheels, opens, kelvin) for c in every}
    # Of a single wheel they keep its order.
    single = [c for c in every if len(turned[c]) <= 1]
    kept = sorted(single, key=lambda c: turned[c] if len(wheels) > 1 else c)[:MAX_SLOTS]
    several = [c for c in every if len(turned[c]) > 1]
    for c in sorted(several, key=lambda c: -found[c].colour.share):
        if len(kept) < MAX_SLOTS and _is_new(found[c], [found[x] for x in kept]):
            kept.append(c)
    return _with_own_names([found[c] for c in kept])


def _combined(
    places: Sequence[int],
    wheels: Sequence[Sequence[SlotColour]],
    opens: Sequence[int],
    kelvin: float,
) -> SlotCombination:
    """Return a combination by the place of each wheel's slot. opens: places of open slots."""
    chosen = [wheel[k] for k, wheel in zip(places, wheels, strict=True)]
    others = [
        x
        for x, k, own in zip(chosen, places, opens, strict=True)
        if k != own or x.colour.share < CLEAR
    ]
    lamp = _bt2020(emitter_colour.xy_of_kelvin(kelvin))
    passed = np.ones(3)
    for x in others:
        passed = passed * np.clip(x.colour.share * _bt2020(x.colour.xy) / lamp, 0, 1)
    slots = tuple(x.slot for x in chosen)
    if len(others) <= 1:
        colour = (others or chosen)[0].colour
    else:
        xyz = rgb_to_xyz(REC2020) @ (np.maximum(passed, OPAQUE) * lamp)
        name = " + ".join(x.colour.name for x in others)
        colour = emitter_colour.EmitterColour(
            name, emitter_colour.bounded(xy_of(xyz)), float(xyz[1])
        )
    return SlotCombination(slots, colour, SlotFilter(colour.name, as_rgb(passed.round(4))))


def _is_new(found: SlotCombination, brighter: Sequence[SlotCombination]) -> bool:
    """Return whether a combination is bright enough to serve, and of another colour than brighter
    ones.
    """
    if found.colour.share < DARKEST:
        return False
    looks = lab_of_lights(np.array([emitter_colour.rgb_of_xy(x.colour.xy) for x in brighter]))
    own = lab_of_lights(emitter_colour.rgb_of_xy(found.colour.xy))
    bright = np.array([x.colour.share >= found.colour.share for x in brighter])
    return not (bright & (ciede2000(looks, own) < ALIKE)).any()


def _with_own_names(found: Sequence[SlotCombination]) -> list[SlotCombination]:
    """Return combinations whose names do not repeat: slots of two wheels may be called alike."""
    named: list[SlotCombination] = []
    for x in found:
        names = {own.colour.name for own in named}
        free = chain([x.colour.name], (f"{x.colour.name} ({k})" for k in count(2)))
        name = next(text for text in free if text not in names)
        colour, slot = replace(x.colour, name=name), replace(x.filter, name=name)
        named.append(replace(x, colour=colour, filter=slot))
    return named


def _bt2020(xy: emitter_colour.Chromaticity) -> Doubles:
    """Return the linear BT.2020 colour (3,) of luminance 1."""
    return np.asarray(np.linalg.solve(rgb_to_xyz(REC2020), _xyz(xy)))


def _sets_of(function: ChannelFunction, byte_count: int) -> list[_Set]:
    """Return the sets of a function, each of which ends where the next begins."""
    elements = function.element.findall("ChannelSet")
    starts = [
        max(dmx_value(x.get("DMXFrom", "0/1"), byte_count, is_shifted=True), function.first)
        for x in elements
    ]
    ends = [later - 1 for _, later in pairwise(starts)] + [function.last]
    return [
        _Set(
            x.get("Name", ""),
            int(x.get("WheelSlotIndex") or 0),
            first,
            min(last, function.last),
            (float(x.get("PhysicalFrom", 0)), float(x.get("PhysicalTo", 1))),
        )
        for x, first, last in zip(elements, starts, ends, strict=True)
        if first <= last
    ]


def _seated(
    number: int, element: Element, sets: Sequence[_Set], elements: Sequence[Element]
) -> RigSlot | None:
    """Return the levels at which a slot stands in the beam; None if it does not.

    Of several sets with its number the one of its name counts, then the first. A set whose name is
    the name of two slots shows both, and so does one that says it is not at the middle of its slot.
    """
    name, own = _plain(element), [x for x in sets if x.number == number]
    known = {_plain(x) for x in elements} | {x.name.casefold().strip() for x in sets}
    whole = [x for x in own if not _shows_two(x, known)]
    named = [x for x in whole if x.name.casefold().strip() == name]
    if not whole:
        return None
    best = (named or whole)[0]
    (start, end), (first, last) = best.physical, (best.first, best.last)
    if (start, end) == _NOT_SAID or start == end:
        return RigSlot((first + last) // 2, first, last)
    # It turns from one side of the slot to the other: the slot itself is where that is 0.
    level = first + round((0 - start) / (end - start) * (last - first))
    return RigSlot(level, level, level)


def _shows_two(found: _Set, known: set[str]) -> bool:
    low, high = sorted(found.physical)
    if found.physical != _NOT_SAID and not low <= 0 <= high:
        return True
    parts = [x for x in _SPLIT.split(found.name.casefold().strip()) if x]
    return len(parts) > 1 and all(part in known for part in parts)


def _plain(element: Element) -> str:
    return element.get("Name", "").casefold().strip()


def _free_name(element: Element, number: int, used: set[str]) -> str:
    """Return the name of a slot, with its number where another has it or it has none."""
    name = " ".join(element.get("Name", "").lower().split())
    return name if name and name not in used else f"{name or 'slot'} {number}"


def _colour(
    name: str, element: Element, filters: Sequence[Element], kelvin: float
) -> emitter_colour.EmitterColour:
    """Return the light of a lamp behind a slot: by the measured transmission of its filter, or else
    by the colour that the file gives it or the filter.
    """
    kelvin = emitter_colour.possible_kelvin(kelvin)
    linked = next((x for x in filters if x.get("Name") == element.get("Filter")), None)
    if linked is not None and (measured := emitter_colour.filter_spectrum(linked)) is not None:
        waves, transmission, level = measured
        xyz = _light_through(waves, transmission, kelvin)
        if xyz[1] > 0:
            return emitter_colour.EmitterColour(name, emitter_colour.bounded(xy_of(xyz)), level)
    colour = emitter_colour.parsed_colour(element.get("Color"))
    if linked is not None and element.get("Color") is None:
        colour = emitter_colour.parsed_colour(linked.get("Color"))
    if colour is None:
        return emitter_colour.EmitterColour(name, emitter_colour.xy_of_kelvin(kelvin), 1.0)
    return _filtered(name, *colour, kelvin)


def _light_through(nanometres: Doubles, transmission: Doubles, kelvin: float) -> Doubles:
    """Return XYZ, (3,), in any unit, of a black body behind a filter, which is straight between its
    points (k,) and opaque beyond them.
    """
    metres, observer = matching_functions()
    passed = np.interp(metres * 1e9, nanometres, transmission, left=0, right=0)
    black_body = (metres * 1e7) ** -5 / np.expm1(C2 / (metres * kelvin))
    return np.asarray((passed * black_body) @ observer)


def _filtered(
    name: str, xy: emitter_colour.Chromaticity, percent: float, kelvin: float
) -> emitter_colour.EmitterColour:
    """Return the light of a lamp behind a filter, whose colour, as under D65, has a Y of so many
    percent of the light; of 0, as bright as a filter of this colour can be.

    It lets red, green and blue of BT.2020, between which filters' colours lie, through in
    proportion.
    """
    passed, lamp = np.clip(_bt2020(xy), 0, None), _bt2020(emitter_colour.xy_of_kelvin(kelvin))
    most = 1 / float(passed.max())
    level = min(percent / 100, most) if percent > 0 else most
    return emitter_colour.EmitterColour(
        name, emitter_colour.bounded(xy_of(rgb_to_xyz(REC2020) @ (passed * lamp))), level
    )


def _xyz(xy: emitter_colour.Chromaticity) -> Doubles:
    x, y = xy
    return np.array([x / y, 1.0, (1 - x - y) / y])
