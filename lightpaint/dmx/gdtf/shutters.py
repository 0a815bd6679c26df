"""Shutters at rest: as their file has them, but never flashing."""

import re
from collections.abc import Sequence

from lightpaint.dmx.gdtf.mode_channels import ChannelFunction, ModeChannel
from lightpaint.sentences import Hint, Sentence

#: Functions of shutters, which let light through as far as they say, and those that flash.
_SHUTTER, _STROBE = re.compile(r"Shutter\d+"), re.compile(r"Shutter\d+Strobe\w*|StrobeMode\w*")

#: What to know of a shutter that stays as its file has it.
_CLOSED = Sentence(
    "its shutter rests closed, so that no light would leave it: give a file whose default opens it "
    "with ",
    Hint("gdtf_folder"),
)


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
