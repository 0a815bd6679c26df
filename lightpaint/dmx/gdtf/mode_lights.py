"""The lights of a mode: which channels set them, how bright they are, in which colours.

A channel acts on its geometry and on all that hangs on that. A beam's emitters are the emitters of
the nearest geometry above it which has channels for a colour; its dimmers are all above it.
"""

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Position, as_position
from lightpaint.colour import solid_angle
from lightpaint.dmx.console_rig import DmxChannel, RigEmitter, RigFilter, RigLight, RigWheel
from lightpaint.dmx.gdtf import mode_channels
from lightpaint.dmx.gdtf.color_wheel import SlotColour, slot_combinations, wheel_slots
from lightpaint.dmx.gdtf.emitter_colour import (
    SPACES,
    USUAL_FILTERS,
    EmitterColour,
    colour_space,
    density_of,
    emitter_colour,
    primaries_of,
    rgb_emitters,
    whites_of,
    xy_of_kelvin,
)
from lightpaint.dmx.gdtf.geometry_tree import Placed
from lightpaint.dmx.levels import can_invert
from lightpaint.sentences import Hint, Sentence

#: What is assumed of a fixture whose file does not say it: lumens, degrees at 50 % and at 10 % of
#: the intensity, kelvin.
USUAL_LUMENS, USUAL_BEAM, USUAL_FIELD, USUAL_KELVIN = 1000.0, 25.0, 40.0, 6000.0

#: Least candelas that a file can mean, and largest ratio of two fluxes that agree.
LEAST_CANDELA, AGREEING = 1.0, 3.0

#: Angles of beams in degrees.
NARROWEST, WIDEST = 0.5, 170.0

#: The ways to mix colours, by the attributes of their channels: the first one that a mode has.
_ADDED, _NAMED_RGB = re.compile(r"ColorAdd_(\w+)"), re.compile(r"ColorRGB_(Red|Green|Blue)")
_FILTERED, _XY = re.compile(r"ColorSub_([CMY])"), re.compile(r"CIE_([XY])")
_WAYS = (_ADDED, _NAMED_RGB, _XY, _FILTERED)
#: How many of the channels of a way are needed.
_NEEDED = {_ADDED: 1, _NAMED_RGB: 3, _XY: 2, _FILTERED: 3}

_DIMMER = re.compile(r"(Dimmer|CIE_Brightness|ColorRGB_Dimmer)(\d*)")

#: What to know of a file that some programs write for types that they do not know.
_PLACEHOLDER = Sentence(
    "its GDTF is a placeholder, all of whose channels are dimmers: it has one colour, and nothing "
    "is sent to it; give its own file with ",
    Hint("gdtf_folder"),
)

#: Channels that choose a slot of a colour wheel.
_COLOR_WHEEL = re.compile(r"Color\d+")

#: Channels of the colour temperature, and the kelvin that they can mean.
_WARMTH = re.compile(r"CT[OBC]")
LEAST_KELVIN, MOST_KELVIN = 1000.0, 25_000.0

#: Channels that change the colour, and stay at rest.
_RESTING = re.compile(r"CT[OBC]|Color\d+|ColorMacro\d*|HSB_\w+|Color(Add|Sub|RGB)_\w+|Tint")


@dataclass(frozen=True)
class FixtureMode:
    """A mode: its channels, its lights, where its emission comes from, what to know of it, and what
    turns.

    lights: in the axes of their fixture, in metres; the name of a pixel is its number, like `px1`,
    and "" of the whole fixture. lacking: the colours that its file lacks, for which usual ones
    stand.
    """

    name: str
    channels: tuple[DmxChannel, ...]
    lights: tuple[RigLight, ...]
    emission: str
    remarks: tuple[str, ...] = ()
    heads: tuple[mode_channels.ModeHead, ...] = ()
    lacking: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Beam:
    """A beam: its place in the tree, lumens and watts if the file has them, and full angles.

    widened: its solid angle relative to that at which the file's zoom rests.
    """

    node: int
    placed: Placed
    flux: float | None
    watts: float | None
    kelvin: float
    beam_angle: float
    field_angle: float
    widened: float = 1.0

    @property
    def xy(self) -> tuple[float, float]:
        return xy_of_kelvin(self.kelvin)

    @property
    def solid_angle(self) -> float:
        return solid_angle(self.beam_angle, self.field_angle)


class ModeReader:
    """The lights of one mode, from its geometries and channels.

    elements: returns the elements at a path of the type's physical descriptions. wheels: of the
    type. zoom: wanted beam angle in degrees; None for the one that the file rests at.
    """

    def __init__(
        self,
        name: str,
        tree: Sequence[Placed],
        channels: Sequence[mode_channels.ModeChannel],
        elements: Callable[[str], list[Element]],
        wheels: Sequence[Element] = (),
        *,
        zoom: float | None,
    ) -> None:
        self.name, self.tree, self.channels = name, tree, list(channels)
        self.emitters, self.filters = elements("Emitters/Emitter"), elements("Filters/Filter")
        self.spaces = elements("ColorSpace"), elements("AdditionalColorSpaces/ColorSpace")
        self.profiles = {x.get("Name", ""): x for x in elements("DMXProfiles/DMXProfile")}
        self.remarks: list[str] = []
        self.lacking: list[str] = []
        self.dmx = [x.dmx for x in self.channels]
        # These are asked for each beam, of which there may be hundreds.
        self.emitter_colour = cache(partial(emitter_colour, emitters=tuple(self.emitters)))
        self._with_attribute, self._shape = cache(self._find_attribute), cache(self._set_curve)
        levels, remarks = mode_channels.shutter_levels(self.channels)
        for k, level in levels.items():
            self.dmx[k] = replace(self.dmx[k], default=level)
        for remark in remarks:
            self._remark(remark)
        self.beams = self._beams(zoom)
        self.way = self._way()
        self.whites: list[int] = []
        self.wheels, self.slots = wheels, list[EmitterColour]()
        self.wheel: RigWheel | None = None

    def read(self, *, pixels: bool) -> FixtureMode:
        """Return the mode. pixels: True for a light for each beam that has channels of its own."""
        groups = self._groups(pixels=pixels)
        self.whites = self._white_channels() if len(groups) == 1 else []
        self.wheel = self._wheel() if len(groups) == 1 else None
        candelas, emission = self._candelas()
        if self._is_placeholder():
            lone = self._lone_light(groups[0], candelas)
            remarks = (_PLACEHOLDER, *self.remarks)
            return FixtureMode(self.name, tuple(self.dmx), (lone,), emission, remarks)
        lights, beams = [], []
        dimmers = [[self._dimmers(beam) for beam in group] for group in groups]
        counts = Counter(k for own in dimmers for k in set().union(*own))
        shared = {k for k, count in counts.items() if count > 1}
        for k, (group, own) in enumerate(zip(groups, dimmers, strict=True)):
            number = k + 1 if len(groups) > 1 else 0
            light = self._light(number, group, own, shared, candelas)
            if light is not None:
                lights.append(light)
                beams.append([beam.placed for beam in group])
        if not lights:
            self._remark("no channel of it dims light, so it is left out")
        self._remark_resting(lights)
        heads = mode_channels.mode_heads(self.tree, self.channels, beams)
        known = tuple(self.remarks), heads, tuple(dict.fromkeys(self.lacking))
        return FixtureMode(self.name, tuple(self.dmx), tuple(lights), emission, *known)

    def _is_placeholder(self) -> bool:
        """Return whether the file stands for a type that a program does not know: no beam, and all
        channels, whatever they do, called dimmers.
        """
        has_beam = any(placed.beam is not None for placed in self.tree)
        numbered = {match[0] for _, match in self._with_attribute(_DIMMER) if match[2]}
        return not has_beam and len(numbered) > 1

    def _remark(self, text: str) -> None:
        if text not in self.remarks:
            self.remarks.append(text)

    def _find_attribute(self, pattern: re.Pattern[str]) -> list[tuple[int, re.Match[str]]]:
        """Return places of channels with a function whose attribute matches."""
        return [
            (k, match)
            for k, channel in enumerate(self.channels)
            for attribute in dict.fromkeys(x.attribute for x in channel.functions)
            if (match := pattern.fullmatch(attribute))
        ]

    def _way(self) -> re.Pattern[str] | None:
        """Return the way in which the mode mixes colours; None if it has one colour."""
        for way in _WAYS:
            if len({match[1] for _, match in self._with_attribute(way)}) >= _NEEDED[way]:
                return way
        return None

    # ---- Beams ---------------------------------------------------------------------------------

    def _beams(self, zoom: float | None) -> list[_Beam]:
        found = [k for k, placed in enumerate(self.tree) if placed.beam is not None]
        if not found:
            self._remark(
                f"no beam in its GDTF: {USUAL_BEAM:g}° at 50 % and {USUAL_FIELD:g}° at 10 %"
            )
            root = self.tree[0] if self.tree else Placed("", "", np.eye(4), (0,))
            return [_Beam(0, root, None, None, USUAL_KELVIN, USUAL_BEAM, USUAL_FIELD)]
        return [self._beam(k, self.tree[k], zoom) for k in found]

    def _beam(self, node: int, placed: Placed, zoom: float | None) -> _Beam:
        beam, given = placed.beam, placed.given
        flux = beam.luminous_flux if "LuminousFlux" in given and beam.luminous_flux > 1 else None
        power = beam.power_consumption
        watts = power if "PowerConsumption" in given and power > 0 else None
        angle = min(max(beam.beam_angle, NARROWEST), WIDEST)
        field = min(max(beam.field_angle, angle), WIDEST)
        ratio = field / angle
        rest, angle = self._zoomed(node, zoom) or (angle, angle)
        at_rest, field = (min(x * ratio, WIDEST) for x in (rest, angle))
        widened = solid_angle(angle, field) / solid_angle(rest, at_rest)
        return _Beam(node, placed, flux, watts, beam.color_temperature, angle, field, widened)

    def _zoomed(self, node: int, zoom: float | None) -> tuple[float, float] | None:
        """Return the beam angles at which a zoom rests and that it gives, and set it; None without
        a zoom.
        """
        for k, channel in enumerate(self.channels):
            function = channel.function("Zoom")
            if function is None or channel.node not in self.tree[node].ancestry:
                continue
            start, end = function.physical
            if (start, end) == (0.0, 1.0) or max(start, end) > WIDEST:
                self._remark("its zoom has no angles")
                return None
            if zoom is not None:
                self.dmx[k] = replace(self.dmx[k], default=function.level_of(zoom))
                least, most = sorted((start, end))
                if not least <= zoom <= most:
                    used = min(max(zoom, least), most)
                    self._remark(f"its zoom goes from {least:g}° to {most:g}°: {used:g}° is used")
            rest, used = (function.value_at(x.default) for x in (channel.dmx, self.dmx[k]))
            return max(rest, NARROWEST), max(used, NARROWEST)
        return None

    # ---- Lights --------------------------------------------------------------------------------

    def _colour_channels(self, beam: _Beam) -> dict[str, list[int]]:
        """Return places of the channels that set a beam's colour, by what they set."""
        if self.way is None:
            return {}
        by_node, needed = self._colours_by_node, _NEEDED[self.way]
        nodes = (x for x in reversed(beam.placed.ancestry) if len(by_node.get(x, ())) >= needed)
        return by_node.get(next(nodes, -1), {})

    @cached_property
    def _colours_by_node(self) -> dict[int, dict[str, list[int]]]:
        """The places of the channels that mix colours, by geometry and by what they set."""
        by_node: dict[int, dict[str, list[int]]] = {}
        for k, match in self._with_attribute(self.way) if self.way else ():
            by_node.setdefault(self.channels[k].node, {}).setdefault(match[1], []).append(k)
        return by_node

    def _groups(self, *, pixels: bool) -> list[list[_Beam]]:
        """Return the beams of each light. Beams without colour beside coloured ones are left."""
        coloured = [beam for beam in self.beams if self._colour_channels(beam)]
        if coloured and len(coloured) < len(self.beams):
            self._remark(f"{len(self.beams) - len(coloured)} of its beams mix no colour: left out")
        beams = coloured or self.beams
        if not pixels:
            return [beams]
        groups: dict[Any, list[_Beam]] = {}
        for beam in beams:
            colour = sorted(k for places in self._colour_channels(beam).values() for k in places)
            dimmers = sorted(self._dimmers(beam))
            groups.setdefault((*colour, *dimmers), []).append(beam)
        return [*groups.values()]

    def _dimmers(self, beam: _Beam) -> set[int]:
        """Return the places of the dimmers of a beam."""
        nodes = set(beam.placed.ancestry)
        return {k for k, _ in self._with_attribute(_DIMMER) if self.channels[k].node in nodes}

    def _light(
        self,
        number: int,
        beams: Sequence[_Beam],
        dimmers: Sequence[set[int]],
        shared: Collection[int],
        candelas: Mapping[tuple[int, str], float],
    ) -> RigLight | None:
        """Return the light of some beams; None if no channel dims it.

        dimmers: of each beam. shared: those that other lights have, too.
        """
        whole = set.intersection(*dimmers)
        parts = sorted(set().union(*dimmers) - whole)
        own = sorted(sorted(whole.difference(shared)), key=self._fineness)
        masters = sorted(whole.intersection(shared))
        for k in (*own, *masters, *parts):
            self._shape(k, _DIMMER)
        emitters = self._emitters(beams, candelas)
        filters, chromaticity = self._filters(beams), self._chromaticity(beams)
        is_plain = not (filters or chromaticity or any(x.channels for x in emitters))
        is_plain = is_plain and not (self.whites or self.wheel)
        if is_plain and not own:
            if not parts:
                return None
            # One colour, and dimmers beside each other: these are the channels of its emitter.
            emitters, parts = [replace(x, channels=tuple(parts)) for x in emitters], []
        for k in parts:
            self.dmx[k] = replace(self.dmx[k], default=self._full(k))
        return RigLight(
            f"px{number}" if number else "",
            *_middle(beams),
            max(x.beam_angle for x in beams),
            max(x.field_angle for x in beams),
            tuple(emitters),
            tuple(own),
            tuple(masters),
            filters,
            chromaticity,
            tuple(self.whites),
            self.wheel,
        )

    def _lone_light(
        self, beams: Sequence[_Beam], candelas: Mapping[tuple[int, str], float]
    ) -> RigLight:
        """Return the light of some beams that no channel sets."""
        angles = max(x.beam_angle for x in beams), max(x.field_angle for x in beams)
        emitters = tuple(self._emitters(beams, candelas))
        return RigLight("", *_middle(beams), *angles, emitters)

    def _fineness(self, place: int) -> int:
        """Return the sort key of a dimmer: the finest first, since it carries the level."""
        return -len(self.dmx[place].offsets)

    def _full(self, place: int) -> int:
        curve = self.dmx[place].curve
        return round((curve[-1][0] if curve else 1.0) * self.dmx[place].highest)

    def _set_curve(self, place: int, pattern: re.Pattern[str]) -> mode_channels.ChannelFunction:
        """Set the curve of a channel to the curve of its function, and return the function."""
        channel = self.channels[place]
        function = next(
            channel.function(x.attribute)
            for x in channel.functions
            if pattern.fullmatch(x.attribute)
        )
        assert function is not None
        curve = mode_channels.curve_of(function, self.dmx[place].highest, self.profiles)
        self.dmx[place] = replace(self.dmx[place], curve=curve)
        return function

    def _emitters(
        self, beams: Sequence[_Beam], candelas: Mapping[tuple[int, str], float]
    ) -> list[RigEmitter]:
        """Return the emitters of some beams together."""
        channels: dict[str, set[int]] = {}
        colours: dict[str, EmitterColour] = {}
        totals: dict[str, float] = {}
        for beam in beams:
            for colour, places in self._colours(beam):
                colours.setdefault(colour.name, colour)
                channels.setdefault(colour.name, set()).update(places)
                added = candelas[beam.node, colour.name]
                totals[colour.name] = totals.get(colour.name, 0.0) + added
        watts = [x.watts for x in beams if x.watts is not None]
        parts = len(colours) if self._shine_together else 1
        share = sum(watts) / parts if len(watts) == len(beams) else None
        return [
            RigEmitter(
                name,
                x.xy,
                totals[name],
                tuple(sorted(channels[name])),
                x.curve,
                share,
                spectrum=x.spectrum,
            )
            for name, x in colours.items()
        ]

    def _colours(self, beam: _Beam) -> list[tuple[EmitterColour, list[int]]]:
        """Return the emitters of a beam, with the places of their channels."""
        found = self._colour_channels(beam)
        if self.way is _ADDED:
            colours = []
            for suffix, places in found.items():
                link = self._shape(places[0], _ADDED).element.get("Emitter")
                for k in places[1:]:
                    self._shape(k, _ADDED)
                colour = self.emitter_colour(suffix, link)
                if colour.is_usual:
                    self._remark("its GDTF has no colours of emitters: usual ones are assumed")
                    self.lacking.append(f"the colour of {colour.name}")
                colours.append((colour, places))
            return colours
        if self.way is _NAMED_RGB and found:
            return self._named_rgb([found[name] for name in ("Red", "Green", "Blue")])
        if found and (self.way is _XY or self._filters([beam])):
            space = replace(SPACES["sRGB"], white=beam.xy)
            return [(x, []) for x in primaries_of(space)]
        if self.slots:
            return [(x, []) for x in self.slots]
        if self.whites:
            return [(x, []) for x in whites_of(beam.kelvin, self._white_range())]
        return [(EmitterColour("white", beam.xy, 1.0), [])]

    @property
    def _shine_together(self) -> bool:
        """False for emitters that are all the light of one lamp in turn: whites, slots."""
        return not (self.whites or self.slots)

    def _wheel(self) -> RigWheel | None:
        """Return the colour wheels of all beams; None without one of at least two slots.

        Of a lamp that mixes no colours and can be dimmed the slots become the emitters. In front of
        channels that mix, they filter.
        """
        mixes = bool(self.way or self.whites)
        if self._is_placeholder() or not (mixes or self._common_dimmers):
            return None
        channels, wheels, kelvin = list[int](), list[list[SlotColour]](), self.beams[0].kelvin
        for k, match in self._with_attribute(_COLOR_WHEEL):
            if all(self.channels[k].node in beam.placed.ancestry for beam in self.beams):
                slots = wheel_slots(self.channels[k], match[0], self.wheels, self.filters, kelvin)
                if len(slots) > 1:
                    channels.append(k)
                    wheels.append(slots)
                    turn = "in front of what it mixes" if mixes else "one at a time"
                    self._remark(f"{match[0]} is a wheel of {len(slots)} colours, {turn}")
        if not wheels:
            return None
        found = slot_combinations(wheels, kelvin)
        if mixes:  # the open one comes first
            found.sort(key=lambda x: not x.filter.is_open)
        filters = tuple(x.filter for x in found) if mixes else ()
        self.slots = [] if mixes else [x.colour for x in found]
        return RigWheel(tuple(channels), tuple(x.slots for x in found), filters)

    @property
    def _common_dimmers(self) -> set[int]:
        """The places of the dimmers of all beams."""
        return set.intersection(*(self._dimmers(beam) for beam in self.beams))

    def _white_channels(self) -> list[int]:
        """Return the places of the channels that set the colour temperature of all beams, for a
        lamp that mixes no other colours and can be dimmed.
        """
        if self.way is not None or not self._common_dimmers or self._is_placeholder():
            return []
        for k, _ in self._with_attribute(_WARMTH):
            function = self._warmth_of(k)
            ends = [] if function is None else sorted(function.ends)
            is_range = bool(ends) and LEAST_KELVIN <= ends[0] < ends[1] <= MOST_KELVIN
            above = all(self.channels[k].node in beam.placed.ancestry for beam in self.beams)
            if function is not None and is_range and above:
                levels = (function.first, function.last)
                pairs = zip(levels, function.ends, strict=True)
                curve: mode_channels.Curve = tuple(
                    sorted(((n / self.dmx[k].highest, x) for n, x in pairs), key=lambda p: p[1])
                )
                self.dmx[k] = replace(self.dmx[k], curve=curve)
                return [k]
        return []

    def _warmth_of(self, place: int) -> mode_channels.ChannelFunction | None:
        """Return the function by which a channel sets a colour temperature."""
        channel = self.channels[place]
        found = (channel.function(x.attribute) for x in channel.functions)
        return next((x for x in found if x and _WARMTH.fullmatch(x.attribute)), None)

    def _white_range(self) -> tuple[float, float]:
        """Return the ends of the range of whites, in kelvin."""
        function = self._warmth_of(self.whites[0])
        assert function is not None
        return function.ends

    def _named_rgb(self, channels: Sequence[list[int]]) -> list[tuple[EmitterColour, list[int]]]:
        """Return red, green and blue with the places of their channels: emitters of the file, or
        colours of a space.
        """
        elements = []
        for places in channels:
            elements.append(self._shape(places[0], _NAMED_RGB).element)
            for k in places[1:]:
                self._shape(k, _NAMED_RGB)
        emitters = rgb_emitters([x.get("Emitter") for x in elements], self.emitters)
        if not emitters:
            emitters = primaries_of(colour_space(elements[0].get("ColorSpace"), *self.spaces))
        return [*zip(emitters, channels, strict=True)]

    def _filters(self, beams: Sequence[_Beam]) -> tuple[RigFilter, ...]:
        """Return the filters of some beams together; none if they cannot set all colours."""
        if self.way is not _FILTERED:
            return ()
        channels: dict[str, set[int]] = {}
        for beam in beams:
            for suffix, places in self._colour_channels(beam).items():
                channels.setdefault(suffix, set()).update(places)
        filters = []
        for suffix in (x for x in USUAL_FILTERS if x in channels):
            places = sorted(channels[suffix])
            functions = [self._shape(k, _FILTERED) for k in places]
            name = {"C": "cyan", "M": "magenta", "Y": "yellow"}[suffix]
            density, is_usual = density_of(suffix, self.filters, functions[0].element.get("Filter"))
            if is_usual:
                self._remark("its GDTF has no transmission of filters: usual ones are assumed")
                self.lacking.append(f"the transmission of {name}")
            filters.append(RigFilter(name, density, tuple(places)))
        if len(filters) < 3 or not can_invert([x.density for x in filters]):
            self._remark("its filters do not tell colours apart: it has one colour")
            return ()
        return tuple(filters)

    def _chromaticity(self, beams: Sequence[_Beam]) -> tuple[int, ...]:
        """Return places of the channels of x and y of some beams."""
        if self.way is not _XY:
            return ()
        found = self._colour_channels(beams[0])
        for letter in "XY":
            for k in found[letter]:
                function = self._shape(k, _XY)
                ends = zip((function.first, function.last), function.physical, strict=True)
                curve: mode_channels.Curve = tuple(
                    (level / self.dmx[k].highest, x) for level, x in ends
                )
                self.dmx[k] = replace(self.dmx[k], curve=curve)
        return found["X"][0], found["Y"][0]

    def _remark_resting(self, lights: Sequence[RigLight]) -> None:
        """Remark on channels that change the colour, but rest."""
        used = {k for light in lights for k in (*light.chromaticity, *light.whites)}
        used |= {k for x in lights if x.wheel is not None for k in x.wheel.channels}
        for light in lights:
            used |= {k for x in light.emitters for k in x.channels}
            used |= {k for x in light.filters for k in x.channels}
        resting = {match[0] for k, match in self._with_attribute(_RESTING) if k not in used}
        if resting:
            self._remark(f"at rest: {', '.join(sorted(resting))}")

    # ---- Emission ------------------------------------------------------------------------------

    def _candelas(self) -> tuple[dict[tuple[int, str], float], str]:
        """Return candelas at full by beam and emitter, and where they come from.

        What was measured of emitters is taken if it is more than a candela, and its flux agrees
        with the flux of the beams; else the flux of the beams, in the luminances of the emitters. A
        measurement holds where the zoom rests: in a wider beam the same flux has fewer candelas.
        """
        by_beam = {beam.node: [x for x, _ in self._colours(beam)] for beam in self.beams}
        counts: dict[str, int] = {}
        for colours in by_beam.values():
            for x in colours:
                counts[x.name] = counts.get(x.name, 0) + 1
        measured = {
            (beam.node, x.name): x.candela / counts[x.name] / beam.widened
            for beam in self.beams
            for x in by_beam[beam.node]
            if x.candela is not None and x.candela > LEAST_CANDELA
        }
        fluxes = [beam.flux for beam in self.beams]
        known = sum(x for x in fluxes if x is not None) if None not in fluxes else None
        angles = {beam.node: beam.solid_angle for beam in self.beams}
        if len(measured) == sum(map(len, by_beam.values())):
            lumens = sum(candela * angles[node] for (node, _), candela in measured.items())
            if known is None or 1 / AGREEING <= lumens / known <= AGREEING:
                return measured, "LuminousIntensity"
            self._remark("its LuminousIntensity does not fit its LuminousFlux and beam")
        if known is None:
            self._remark(f"its GDTF has no light: {USUAL_LUMENS:g} lm are assumed")
        candelas = {}
        for beam in self.beams:
            flux = USUAL_LUMENS / len(self.beams) if known is None else beam.flux or 0.0
            together = sum(x.share for x in by_beam[beam.node])
            total = together if self._shine_together else 1.0
            for x in by_beam[beam.node]:
                candelas[beam.node, x.name] = flux * x.share / total / angles[beam.node]
        return candelas, "LuminousFlux" if known is not None else f"{USUAL_LUMENS:g} lm"


def _middle(beams: Sequence[_Beam]) -> tuple[Position, Position, Position]:
    """Return position, direction and up of the middle of some beams, in the fixture's axes."""
    matrices = np.array([beam.placed.matrix for beam in beams])
    direction, up = -matrices[:, :3, 2].mean(axis=0), matrices[:, :3, 1].mean(axis=0)
    if np.linalg.norm(direction) < 1e-3:  # beams all around
        direction, up = -matrices[0, :3, 2], matrices[0, :3, 1]
    position = matrices[:, :3, 3].mean(axis=0)
    return as_position(position), as_position(direction), as_position(up)
