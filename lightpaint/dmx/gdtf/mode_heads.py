"""The parts of a mode that pan and tilt turn, and the axes about which they do.

A geometry with a channel `Pan` turns about its own z axis, one with `Tilt` about its x axis, both
right-handed, with all that hangs on it. At 0° everything is where the geometries say.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.dmx.gdtf.geometry_tree import Placed
from lightpaint.dmx.gdtf.mode_channels import ChannelFunction, ModeChannel

#: Axis of a geometry by the attribute of the channel that turns it.
TURNS = {"Pan": 2, "Tilt": 0}


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
