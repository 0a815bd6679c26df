"""Lights that mix a colour otherwise than by adding emitters: by filters, or by naming x and y.

Their emitters are red, green and blue of Rec.709, which add up to all their light. A drive is the
share of that light which is left.
"""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.dmx.console_rig import RigLight

#: Least share of light that counts as more than none.
_DARK = 1e-6

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


def _tristimulus(light: RigLight) -> Doubles:
    """Return X, Y and Z of each emitter at full, (3, e), relative to one candela."""
    columns = []
    for emitter in light.emitters:
        x, y = emitter.xy
        columns.append(emitter.candela * np.array([x / y, 1.0, (1 - x - y) / y]))
    return np.array(columns).T
