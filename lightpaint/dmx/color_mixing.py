"""Lights that mix a colour otherwise than by adding emitters: by filters, or by naming it.

Emitters of lights with filters, or with x and y, are red, green and blue of Rec.709, which add up
to all their light. A drive is the share of that light which is left. Emitters of lights with a
colour temperature are the two ends of its range; between them light is taken to change evenly.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import REC709, cct_and_duv, rgb_to_xyz
from lightpaint.dmx.console_rig import RigLight

#: Least share of light that counts as more than none.
_DARK = 1e-6

#: Steps between two whites.
WHITE_STEPS = 65

#: Condition number up to which three filters set red, green and blue.
MAX_CONDITION = 50.0


def can_invert(densities: Sequence[Sequence[float]]) -> bool:
    """Return whether three filters, by their densities for red, green and blue, set all colours."""
    return float(np.linalg.cond(np.array(densities, float))) <= MAX_CONDITION


def filters_for_drives(light: RigLight, drives: Sequence[float]) -> tuple[float, list[float]]:
    """Return the dimmer, and how far in each filter is, 0 to 1, for drives of red, green and blue.

    Densities add: −log d = A t + δ, where a column of A is the density of a filter, t how far it
    is in, and e^−δ the dimmer. The dimmer dims as much as it can, so that the filters are out as
    far as they can be. Drives that they cannot reach are clipped.
    """
    density = _densities(light)
    largest = max(drives)
    if largest <= _DARK:
        return 0.0, [0.0] * 3 if light.dimmers else [1.0] * 3
    deepest = density.sum(axis=1) - np.log(largest)
    wanted = np.minimum(-np.log(np.maximum(drives, _DARK)), deepest)
    places, slope = np.linalg.solve(density, wanted), np.linalg.solve(density, np.ones(3))
    dimmed = 0.0
    if light.dimmers:
        limits = [t / s for t, s in zip(places, slope, strict=True) if s > 0]
        dimmed = min(max(min(limits, default=0.0), 0.0), -float(np.log(largest)))
    return float(np.exp(-dimmed)), np.clip(places - dimmed * slope, 0, 1).tolist()


def drives_of_filters(light: RigLight, dimmer: float, places: Sequence[float]) -> list[float]:
    """Return the drives of red, green and blue behind filters that are so far in."""
    return [float(x) for x in dimmer * np.exp(-_densities(light) @ np.array(places))]


def _densities(light: RigLight) -> Doubles:
    return np.array([x.density for x in light.filters], float).T


def xy_for_drives(light: RigLight, drives: Sequence[float]) -> tuple[float, list[float]]:
    """Return the luminance relative to full, and x and y, for drives of red, green and blue.

    Dark light keeps the x and y of all its emitters.
    """
    columns = _tristimulus(light)
    level = float(columns[1] @ drives / columns[1].sum())
    xyz = columns @ (drives if level > _DARK else np.ones(3))
    return level, (xyz[:2] / xyz.sum()).tolist()


def drives_of_xy(light: RigLight, level: float, xy: Sequence[float]) -> list[float]:
    """Return the drives of red, green and blue for a luminance relative to full, and x and y.

    Colours outside Rec.709 are clipped.
    """
    columns, (x, y) = _tristimulus(light), xy
    if level <= _DARK or y <= 0:
        return [0.0] * 3
    xyz = level * columns[1].sum() * np.array([x / y, 1.0, (1 - x - y) / y])
    return [float(d) for d in np.clip(np.linalg.solve(columns, xyz), 0.0, 1.0)]


def white_for_drives(light: RigLight, drives: Sequence[float]) -> tuple[float, float]:
    """Return the dimmer and the colour temperature in kelvin for drives of both whites.

    Two whites mix a colour on the line between them, which is a little more purple than the black
    body of its temperature. Drives of more than 1 together are clipped.
    """
    level, (shares, kelvins) = sum(drives), _whites(light)
    if level <= _DARK:
        return 0.0, float(kelvins[0])
    return min(level, 1.0), float(np.interp(drives[1] / level, shares, kelvins))


def drives_of_white(light: RigLight, level: float, kelvin: float) -> list[float]:
    """Return the drives of both whites for a dimmer and a colour temperature."""
    shares, kelvins = _whites(light)
    share = float(np.interp(kelvin, kelvins[::-1], shares[::-1]))
    return [level * (1 - share), level * share]


@lru_cache(256)
def _whites(light: RigLight) -> tuple[Doubles, Doubles]:
    """Return shares of the warmer white, rising, and kelvin of their mixes, falling, (k,)."""
    shares, (cool, warm) = np.linspace(0.0, 1.0, WHITE_STEPS), _tristimulus(light).T
    mixes = cool + shares[:, None] * (warm - cool)
    known = [cct_and_duv(rgb) for rgb in np.linalg.solve(rgb_to_xyz(REC709), mixes.T).T]
    assert None not in known  # both are whites, and what lies between them is nearly one
    kelvins = np.array([x[0] for x in known if x is not None])
    return shares, np.minimum.accumulate(kelvins)


def _tristimulus(light: RigLight) -> Doubles:
    """Return X, Y and Z of each emitter at full, (3, e), relative to one candela."""
    columns = []
    for emitter in light.emitters:
        x, y = emitter.xy
        columns.append(emitter.candela * np.array([x / y, 1.0, (1 - x - y) / y]))
    return np.array(columns).T
