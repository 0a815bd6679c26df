"""Mixes of lamps of one colour at the brightness of an answer, where each emitter has a picture.

There such a lamp, or several on one dimmer, is one unknown, which moves all emitters together. In
the first solve they are in the mix at full. A dimmed lamp has a choice of others, of which it
prefers one (`Lamp.drives_for`).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import Lamp
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction

#: Change of a drive, relative to full, below which two mixes count as one.
SAME = 1e-3


def with_mixes_at(
    weights: Doubles,
    reduction: Reduction,
    lamps: Mapping[tuple[int, ...], Lamp],
    *,
    within: bool = False,
) -> Reduction:
    """Return the reduction with the mixes that lamps of one colour prefer at weights (n, 3); itself
    where these are the same.

    lamps: by the lights that are their emitters. within: whether to limit these unknowns to the
    drives that the new mixes allow, also of mixes that are the same.
    """
    knobs = tuple(_remixed(knob, weights, lamps, within=within) for knob in reduction.knobs)
    is_same = all(a is b for a, b in zip(knobs, reduction.knobs, strict=True))
    return reduction if is_same else replace(reduction, knobs=knobs)


def _remixed(
    knob: Knob, weights: Doubles, lamps: Mapping[tuple[int, ...], Lamp], *, within: bool
) -> Knob:
    """Return a knob with the mixes of its lamps at weights (n, 3)."""
    if len(knob.unknowns) != 1:
        return knob
    [unknown] = knob.unknowns
    columns = {k: float(rgb[0]) for k, rgb in unknown.columns}
    shining = [(k, x) for k, x in columns.items() if x > 0]
    level = float(weights[shining[0][0], 0]) / shining[0][1] if shining else 0.0
    change, room = 0.0, np.inf
    for parts, lamp in lamps.items():
        if level <= 0 or not columns.keys() >= set(parts):
            continue
        now = level * np.array([columns[k] for k in parts]) / lamp.levels
        drives = lamp.drives_for(lamp.mix(now))
        change = max(change, float(np.abs(drives - now).max()))
        room = min(room, lamp.room(drives))
        columns |= dict(zip(parts, (drives * lamp.levels / level).tolist(), strict=True))
    if change <= SAME and not (within and room < np.inf):
        return knob
    upper = min(unknown.upper, room * level) if within else unknown.upper
    mixed = tuple((k, np.full(3, x)) for k, x in columns.items())
    unknown = replace(unknown, columns=mixed, upper=max(upper, unknown.lower))
    return replace(knob, unknowns=(unknown,))
