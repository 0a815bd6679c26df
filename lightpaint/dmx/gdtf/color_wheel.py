"""Colour wheels: the slots that a channel can choose, and the colour that each gives a lamp.

Only levels at which a slot stands in the beam count: between two slots a wheel shows both.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import C2, MAX_SLOTS, REC2020, matching_functions, rgb_to_xyz, xy_of
from lightpaint.dmx.console_rig import RigSlot
from lightpaint.dmx.gdtf.emitter_colour import (
    Chromaticity,
    EmitterColour,
    bounded,
    filter_spectrum,
    parsed_colour,
    possible_kelvin,
    xy_of_kelvin,
)
from lightpaint.dmx.gdtf.mode_channels import ChannelFunction, ModeChannel, dmx_value

#: What stands between the names of two slots that share the beam.
_SPLIT = re.compile(r"\s*[/+|&]\s*")

#: PhysicalFrom and PhysicalTo of a set that does not say how far a wheel is from a slot.
_NOT_SAID = (0.0, 1.0)


@dataclass(frozen=True)
class SlotColour:
    """A slot as a channel chooses it, and the light behind it.

    colour: its share is relative to the lamp's light without a wheel.
    """

    slot: RigSlot
    colour: EmitterColour


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
    that of two slots shows both, and so does one that says it is not at the middle of its slot.
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
) -> EmitterColour:
    """Return the light of a lamp behind a slot: by the measured transmission of its filter, or else
    by the colour that the file gives it or the filter.
    """
    kelvin = possible_kelvin(kelvin)
    linked = next((x for x in filters if x.get("Name") == element.get("Filter")), None)
    if linked is not None and (measured := filter_spectrum(linked)) is not None:
        waves, transmission, level = measured
        xyz = _light_through(waves, transmission, kelvin)
        if xyz[1] > 0:
            return EmitterColour(name, bounded(xy_of(xyz)), level)
    colour = parsed_colour(element.get("Color"))
    if linked is not None and element.get("Color") is None:
        colour = parsed_colour(linked.get("Color"))
    if colour is None:
        return EmitterColour(name, xy_of_kelvin(kelvin), 1.0)
    return _filtered(name, *colour, kelvin)


def _light_through(nanometres: Doubles, transmission: Doubles, kelvin: float) -> Doubles:
    """Return XYZ, (3,), in any unit, of a black body behind a filter, which is straight between its
    points (k,) and opaque beyond them.
    """
    metres, observer = matching_functions()
    passed = np.interp(metres * 1e9, nanometres, transmission, left=0, right=0)
    black_body = (metres * 1e7) ** -5 / np.expm1(C2 / (metres * kelvin))
    return np.asarray((passed * black_body) @ observer)


def _filtered(name: str, xy: Chromaticity, percent: float, kelvin: float) -> EmitterColour:
    """Return the light of a lamp behind a filter, whose colour, as under D65, has a Y of so many
    percent of the light; of 0, as bright as a filter of this colour can be.

    It lets red, green and blue of BT.2020, between which filters' colours lie, through in
    proportion.
    """
    passed = np.clip(np.linalg.solve(rgb_to_xyz(REC2020), _xyz(xy)), 0, None)
    lamp = np.linalg.solve(rgb_to_xyz(REC2020), _xyz(xy_of_kelvin(kelvin)))
    most = 1 / float(passed.max())
    level = min(percent / 100, most) if percent > 0 else most
    return EmitterColour(name, bounded(xy_of(rgb_to_xyz(REC2020) @ (passed * lamp))), level)


def _xyz(xy: Chromaticity) -> Doubles:
    x, y = xy
    return np.array([x / y, 1.0, (1 - x - y) / y])
