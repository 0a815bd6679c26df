# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of multipliers: weight 1 is the light as rendered.

Power in watts (point, spot, area), irradiance (sun) and strength (world, emission) are all
proportional to the light that arrives, so one rule serves them.
"""

import math
import struct

from .working_space import multiplied

#: Relative distance below which two numbers of Blender, which have float32, are the same.
FLOAT32_ROUNDING = 2.0**-22


def scaled(base, factor, space=None):
    """Return [level, red, green, blue] multiplied by a factor for each channel of Rec.709.

    The level takes the factor's mean and the colour the rest, so that a change of brightness alone
    leaves the colour as it is. A light that goes out keeps its colour. space: see working_space.py.
    """
    level, *colour = base
    mean = sum(factor) / 3
    if not all(map(math.isfinite, factor)) or mean <= 0:
        return [0.0, *colour]
    return [level * mean, *(c / mean for c in multiplied(colour, factor, space))]


def scaled_colour(base, factor, space=None):
    """Return the same for a light without a level of its own: only the colour changes."""
    level, *colour = base
    if not all(map(math.isfinite, factor)):
        factor = (0.0, 0.0, 0.0)
    return [level, *multiplied(colour, [max(f, 0.0) for f in factor], space)]


def checked_factor(values):
    """Return the multipliers of red, green and blue. Raises ValueError for what no light has."""
    factor = tuple(values) if isinstance(values, list | tuple) else ()
    is_number = all(type(value) in (int, float) for value in factor)
    if len(factor) != 3 or not is_number or not all(map(is_amount, factor)):
        raise ValueError(f"a light has the factor {str(values)[:60]}: expected three from 0 on")
    return tuple(map(float, factor))


def is_amount(value):
    """Return whether a number is finite and not negative."""
    return math.isfinite(value) and value >= 0


def are_equal(first, second):
    """Return whether two lists of numbers are the same but for the rounding of float32."""
    return len(first) == len(second) and all(
        abs(a - b) <= FLOAT32_ROUNDING * max(abs(a), abs(b))
        for a, b in zip(first, second, strict=True)
    )


def as_float32(value):
    """Return the number that Blender makes of one."""
    return struct.unpack("<f", struct.pack("<f", value))[0]
