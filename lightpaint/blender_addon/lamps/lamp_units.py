# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of multipliers: weight 1 is the light as rendered.

Power in watts (point, spot, area), irradiance (sun) and strength (world, emission) are all
proportional to the light that arrives, so one rule serves them.

Multipliers are colours of linear Rec.709: what a white light becomes. A file works in a space of
its own, which from Blender 5 on may have other primaries, and there each channel is multiplied.
"""

import math
import struct

#: Relative distance below which two numbers of Blender, which have float32, are the same.
FLOAT32_ROUNDING = 2.0**-22

#: The largest multiplier that lightpaint finds, and the largest number of Blender.
LARGEST_FACTOR, LARGEST_FLOAT32 = 1e30, (2 - 2.0**-23) * 2.0**127

#: Working space, as files name it -> the matrix to it from linear Rec.709.
SPACES = {
    "lin_ap1_scene": (
        (0.613097402, 0.339523146, 0.047379451),
        (0.070193722, 0.916353879, 0.013452398),
        (0.020615593, 0.109569773, 0.869814634),
    ),
    "lin_rec2020_scene": (
        (0.627403896, 0.329283038, 0.043313066),
        (0.069097289, 0.919540395, 0.011362316),
        (0.016391439, 0.088013308, 0.895595253),
    ),
}


def scaled(base, factor):
    """Return [level, red, green, blue] multiplied by a factor for each channel.

    The level takes the factor's mean and the colour the rest, so that a change of brightness alone
    leaves the colour as it is. A light that goes out keeps its colour.
    """
    level, *colour = base
    mean = sum(factor) / 3
    if not all(map(math.isfinite, factor)) or mean <= 0:
        return [0.0, *colour]
    made = (c * f / mean for c, f in zip(colour, factor, strict=True))
    return [min(level * mean, LARGEST_FLOAT32), *made]


def scaled_colour(base, factor):
    """Return the same for a light without a level of its own: only the colour changes."""
    level, *colour = base
    if not all(map(math.isfinite, factor)):
        factor = (0.0, 0.0, 0.0)
    return [level, *(c * max(f, 0.0) for c, f in zip(colour, factor, strict=True))]


def checked_factor(values):
    """Return the multipliers of red, green and blue. Raises ValueError for what no light has."""
    factor = tuple(values) if isinstance(values, list | tuple) else ()
    is_number = all(type(value) in (int, float) for value in factor)
    if len(factor) != 3 or not is_number or not all(map(is_amount, factor)):
        raise ValueError(f"a light has the factor {str(values)[:60]}: expected three from 0 on")
    return tuple(map(float, factor))


def is_amount(value):
    """Return whether a number is one that a light can be multiplied by."""
    return 0 <= value <= LARGEST_FACTOR


def are_equal(first, second):
    """Return whether two lists of numbers are the same but for the rounding of float32."""
    return len(first) == len(second) and all(
        abs(a - b) <= FLOAT32_ROUNDING * max(abs(a), abs(b))
        for a, b in zip(first, second, strict=True)
    )


def as_float32(value):
    """Return the number that Blender makes of one."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def working_space(data):
    """Return the matrix from linear Rec.709 to the space of a file; None if that is Rec.709.

    data: bpy.data.
    """
    settings = getattr(data, "colorspace", None)
    return SPACES.get(getattr(settings, "working_space_interop_id", ""))


def in_space(factor, space):
    """Return multipliers of linear Rec.709 as multipliers of a space of `working_space`."""
    if space is None:
        return factor
    return tuple(sum(m * f for m, f in zip(row, factor, strict=True)) for row in space)
