"""The channels of a mode, where references put them, and what their functions do at which level.

pygdtf leaves channels of geometries below a reference out, and does not follow the `s` of values
such as `128/1s`; so offsets and values are read here.

A geometry with a channel `Pan` turns about its own z axis, one with `Tilt` about its x axis, both
right-handed, with all that hangs on it. At 0° everything is where the geometries say.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.dmx.console_rig import DmxChannel
from lightpaint.dmx.gdtf.geometry_tree import Placed
from lightpaint.errors import RigError
from lightpaint.sentences import Hint, Sentence
from lightpaint.storage.rig_archive import library

#: Largest number of channels of a mode.
MAX_CHANNELS = 10_000

#: Most bytes of a channel.
MAX_BYTES = 4

#: Points of a curve between levels and light.
CURVE_POINTS = 33

#: Pairs of a share of a channel's highest level and a share of what it does.
Curve = tuple[tuple[float, float], ...]

#: Functions of shutters, which let light through as far as they say, and those that flash.
_SHUTTER, _STROBE = re.compile(r"Shutter\d+"), re.compile(r"Shutter\d+Strobe\w*|StrobeMode\w*")

#: What to know of a shutter that stays as its file has it.
_CLOSED = Sentence(
    "its shutter rests closed, so that no light would leave it: give a file whose default opens it "
    "with ",
    Hint("gdtf_folder"),
)

#: Axis of a geometry by the attribute of the channel that turns it.
TURNS = {"Pan": 2, "Tilt": 0}


@dataclass(frozen=True)
class ChannelFunction:
    """A range of a channel's levels with one function.

    attribute: what it controls. first, last: its levels. physical: what it does at these, such as
    degrees. element: the rest of it.
    """

    attribute: str
    first: int
    last: int
    physical: tuple[float, float]
    element: Element

    @property
    def ends(self) -> tuple[float, float]:
        """The values at its first and its last level, also if it is inverted."""
        start, end = self.physical
        return (end, start) if self.element.get("DMXInvert") == "Yes" else (start, end)

    @property
    def open_level(self) -> int:
        """The level at which its value is largest: the middle of its levels if it is equal."""
        start, end = self.ends
        if start == end:
            return (self.first + self.last) // 2
        return self.first if start > end else self.last

    def value_at(self, level: int) -> float:
        """Return what it does at a level."""
        span = max(self.last - self.first, 1)
        share = min(max((level - self.first) / span, 0.0), 1.0)
        start, end = self.ends
        return start + share * (end - start)

    def level_of(self, value: float) -> int:
        """Return the level at which it does `value`, or what is closest to that."""
        start, end = self.ends
        share = (value - start) / (end - start) if end != start else 0.0
        return self.first + round(min(max(share, 0.0), 1.0) * (self.last - self.first))


@dataclass(frozen=True)
class ModeChannel:
    """A channel, the place of its geometry in the tree, and its functions."""

    dmx: DmxChannel
    node: int
    functions: tuple[ChannelFunction, ...]

    def function_at(self, level: int) -> ChannelFunction | None:
        """Return the function that a level is in; None if there is none."""
        return next((x for x in self.functions if x.first <= level <= x.last), None)

    def function(self, attribute: str) -> ChannelFunction | None:
        """Return the function with this attribute that has most levels; None if there is none."""
        having = [x for x in self.functions if x.attribute == attribute]
        return max(having, key=lambda x: x.last - x.first, default=None)


def mode_channels(mode: Element, tree: Sequence[Placed], name: str) -> list[ModeChannel]:
    """Return the channels of a mode that have an address. Raises RigError if they are too many."""
    by_geometry: dict[str, list[Element]] = {}
    for element in mode.iterfind("DMXChannels/DMXChannel"):
        if element.get("Offset") not in (None, "", "None"):
            by_geometry.setdefault(element.get("Geometry", ""), []).append(element)
    places = list(enumerate(tree)) or [(0, Placed("", "", np.eye(4), (0,)))]
    if not tree:  # a file without geometry: all channels are of the fixture
        by_geometry = {"": [x for elements in by_geometry.values() for x in elements]}
    channels = []
    for node, geometry in places:
        for element in by_geometry.get(geometry.source, ()):
            channels.append(_channel(element, node, geometry))
            if len(channels) > MAX_CHANNELS:
                raise RigError(f"{name} has more than {MAX_CHANNELS} channels in a mode")
    return channels


def _channel(element: Element, node: int, geometry: Placed) -> ModeChannel:
    number = element.get("DMXBreak", "1")
    if number == "Overwrite":
        dmx_break, added = geometry.overwrite
    else:
        dmx_break, added = int(number), geometry.offsets.get(int(number), 0)
    offsets = tuple(int(x) + added for x in element.get("Offset", "").split(",") if x.strip())
    offsets = offsets[:MAX_BYTES]
    functions = _functions(element, len(offsets))
    initial, initial_function = _initial(element, functions)
    default = element.get("Default")
    if default is None and initial_function is not None:
        default = initial_function.get("Default")
    channel = DmxChannel(
        initial, geometry.name, offsets, dmx_break, dmx_value(default or "0/1", len(offsets))
    )
    return ModeChannel(channel, node, tuple(functions))


def _functions(element: Element, byte_count: int) -> list[ChannelFunction]:
    functions = []
    for logical in element.findall("LogicalChannel"):
        found = logical.findall("ChannelFunction")
        starts = [dmx_value(x.get("DMXFrom", "0/1"), byte_count, is_shifted=True) for x in found]
        for x, first in zip(found, starts, strict=True):
            # Functions that begin together are alternatives, which another channel chooses.
            later = [start for start in starts if start > first]
            last = min(later) - 1 if later else int(256**byte_count) - 1
            attribute = x.get("Attribute") or logical.get("Attribute") or "NoFeature"
            physical = float(x.get("PhysicalFrom", 0)), float(x.get("PhysicalTo", 1))
            functions.append(ChannelFunction(attribute, first, last, physical, x))
    return functions


def _initial(element: Element, functions: Sequence[ChannelFunction]) -> tuple[str, Element | None]:
    """Return the attribute and the element of the function that a channel rests in."""
    wanted = element.get("InitialFunction", "").split(".")
    logical = element.find("LogicalChannel")
    attribute = "NoFeature" if logical is None else logical.get("Attribute", "NoFeature")
    for x in functions:
        if len(wanted) > 1 and x.element.get("Name") == wanted[-1]:
            return x.attribute, x.element
    return attribute, functions[0].element if functions else None


def dmx_value(text: str, byte_count: int, *, is_shifted: bool = False) -> int:
    """Return a value of GDTF, such as `128/1`, for a channel of so many bytes.

    A value of fewer bytes is repeated, so that 255/1 is at full in any channel; with an `s` behind
    it, or if `is_shifted`, which is for where ranges begin, zeros follow instead. One of more bytes
    loses its finest. `None` is 0. Raises ValueError for other text.
    """
    if text.strip().lower() in ("", "none"):
        return 0
    number, _, size = text.strip().partition("/")
    has_shift = is_shifted or size.endswith("s")
    own_count = int(size.rstrip("s") or 1)
    if not 1 <= own_count <= MAX_BYTES or not 0 <= int(number) < 256**own_count:
        raise ValueError(f"{text!r} is not a value of a channel")
    own = int(number).to_bytes(own_count, "big")
    filled = own + bytes(byte_count) if has_shift else own * byte_count
    return int.from_bytes(filled[:byte_count], "big")


def curve_of(function: ChannelFunction, highest: int, profiles: Mapping[str, Element]) -> Curve:
    """Return how a channel's levels become shares of what a function does; empty if that is equal.

    highest: level of the channel. profiles: of the type, by name.
    """
    shares = np.linspace(0.0, 1.0, CURVE_POINTS)
    values = _profile(profiles.get(function.element.get("DMXProfile", "")), shares)
    if function.element.get("DMXInvert") == "Yes":
        values = values[::-1]
    if function.physical[0] > function.physical[1]:
        values = -values
    values = np.clip((values - values.min()) / max(float(np.ptp(values)), 1e-9), 0, 1)
    levels = (function.first + shares * (function.last - function.first)) / highest
    if np.allclose(values, levels, rtol=0, atol=1e-4):
        return ()
    if values[0] > values[-1]:
        levels, values = levels[::-1], values[::-1]
    rising = np.maximum.accumulate(values)
    kept = [0, *(k for k in range(1, CURVE_POINTS) if rising[k] > rising[k - 1])]
    return tuple((float(levels[k]), float(rising[k])) for k in kept)


def _profile(element: Element | None, shares: Doubles) -> Doubles:
    """Return the output of a DMX profile, piecewise cubic, at shares of its input."""
    if element is None:
        return shares
    points = sorted(library("pygdtf").DmxProfile(xml_node=element).points, key=_start)
    if not points:
        return shares
    # Files have percentages of 100 or of 1: the right one ends at full.
    outputs = {scale: _cubics(points, shares * scale) / scale for scale in (1.0, 100.0)}
    return min(outputs.values(), key=lambda output: abs(float(output[-1]) - 1))


def _start(point: object) -> float:
    return float(getattr(point, "dmx_percentage", 0.0))


def _cubics(points: Sequence[object], inputs: Doubles) -> Doubles:
    starts = np.array([_start(point) for point in points])
    which = np.clip(np.searchsorted(starts, inputs, side="right") - 1, 0, None)
    factors = np.array([[getattr(x, f"cfc{k}") for k in range(4)] for x in points], float)[which]
    if not (np.isfinite(factors).all() and np.isfinite(starts).all()):
        raise ValueError("a DMXProfile that is not finite")
    away = inputs - starts[which]
    return np.asarray((factors * away[:, None] ** np.arange(4)).sum(axis=1))


def shutter_levels(channels: Sequence[ModeChannel]) -> tuple[dict[int, int], list[str]]:
    """Return levels for channels that would flash at rest, by their places, and what to know of
    these and of shutters that rest closed.
    """
    levels, remarks = dict[int, int](), []
    for k, channel in enumerate(channels):
        level = channel.dmx.default
        resting = channel.function_at(level)
        if resting is None:
            continue
        opening = max(channel.functions, key=_openness)
        if _STROBE.fullmatch(resting.attribute):
            levels[k] = opening.open_level if _openness(opening) >= 0 else 0
            remarks.append(f"{resting.attribute}, where it rests, flashes: it is sent open")
        elif _openness(resting) >= 0 and resting.value_at(level) <= 0 < _openness(opening):
            remarks.append(_CLOSED)
    return levels, remarks


def _openness(function: ChannelFunction) -> float:
    """Return how far a function opens a shutter; -1 if it is none of a shutter."""
    return max(function.ends) if _SHUTTER.fullmatch(function.attribute) else -1.0


@dataclass(frozen=True)
class ModeAxis:
    """An axis of a head, in the axes of its fixture while all angles are 0.

    name: pan or tilt. channel: place of the channel that turns it. axis: of length 1.
    levels, degrees: the ends of the channel's range, and the angles there.
    """

    name: str
    channel: int
    axis: Doubles
    levels: tuple[int, int]
    degrees: tuple[float, float]


@dataclass
class ModeHead:
    """A part that turns. Updated in place while beams are found on it.

    axes: one or two, the outer one first. beams: directions of its beams at 0°, in the axes of the
    fixture. lights: places of their lights in the mode.
    """

    axes: tuple[ModeAxis, ...]
    beams: list[Doubles] = field(default_factory=list)
    lights: list[int] = field(default_factory=list)

    @property
    def direction(self) -> Doubles:
        """The direction of its beams together at 0°."""
        mean = np.mean(self.beams, axis=0)
        return mean if np.linalg.norm(mean) > 1e-3 else self.beams[0]


def mode_heads(
    tree: Sequence[Placed], channels: Sequence[ModeChannel], lights: Sequence[Sequence[Placed]]
) -> tuple[ModeHead, ...]:
    """Return the heads of a mode. lights: the beams of each."""
    heads: dict[tuple[int, ...], ModeHead] = {}
    for number, beams in enumerate(lights):
        for beam in beams:
            axes = tuple(_axes(tree, channels, beam))
            if not axes:
                continue
            head = heads.setdefault(tuple(x.channel for x in axes), ModeHead(axes))
            head.beams.append(-beam.matrix[:3, 2])
            if number not in head.lights:
                head.lights.append(number)
    return tuple(heads.values())


def _axes(
    tree: Sequence[Placed], channels: Sequence[ModeChannel], beam: Placed
) -> Iterator[ModeAxis]:
    """Yield the axes that a beam hangs on, the outer one first; of each kind the innermost."""
    found: dict[str, tuple[int, int, ChannelFunction]] = {}
    for k, channel in enumerate(channels):
        if channel.node not in beam.ancestry:
            continue
        for attribute in TURNS:
            function = channel.function(attribute)
            if function is not None and has_angles(function):
                depth = beam.ancestry.index(channel.node)
                if attribute not in found or depth > found[attribute][0]:
                    found[attribute] = depth, k, function
    # Of two axes in one geometry, pan carries tilt.
    for attribute, (_, k, function) in sorted(found.items(), key=lambda x: (x[1][0], x[0])):
        column = tree[channels[k].node].matrix[:3, TURNS[attribute]]
        axis = column / np.linalg.norm(column)
        levels = function.first, function.last
        yield ModeAxis(attribute.lower(), k, axis, levels, function.ends)


def has_angles(function: ChannelFunction) -> bool:
    """Return whether a function says which angles its levels are: 0 to 1 stands for nothing."""
    start, end = function.physical
    return start != end and (start, end) != (0.0, 1.0)
