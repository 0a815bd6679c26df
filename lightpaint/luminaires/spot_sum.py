"""A photometric web as a sum of Mitsuba's spots, of which some are negative.

A spot is bright up to its beam width and falls linearly with the angle to its cutoff. So an axial
web, which is linear between its angles γₖ, is Σₖ (Iₖ − Iₖ₊₁) spot(γₖ, γₖ₊₁).
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.luminaires.web import PhotometricWeb

#: Error of a sum at most, relative to the web's largest intensity.
TOLERANCE = 1e-3

#: The largest cutoff of a spot in degrees.
WIDEST = 90.0


@dataclass(frozen=True)
class SpotPart:
    """A spot of a sum: its candela on the axis, and beam width and cutoff in degrees."""

    candela: float
    beam: float
    cutoff: float


def spots_of(web: PhotometricWeb) -> tuple[SpotPart, ...]:
    """Return the spots that add up to a web; none if it is not axial, or not dark above 90 degrees.

    The error is at most TOLERANCE of the largest intensity.
    """
    if not web.is_axial:
        return ()
    gammas, candela = web.gammas, web.profile()
    slack = TOLERANCE * web.peak
    if np.any(candela[gammas > WIDEST] > slack):
        return ()
    below = gammas <= WIDEST
    above = candela[gammas > WIDEST]
    gammas, candela = gammas[below], candela[below]
    if len(above) and candela[-1] > slack and gammas[-1] < WIDEST:
        # It falls to the dark beyond 90 degrees, from before.
        return ()
    kept = _corners(gammas, candela, slack)
    gammas, candela = gammas[kept], candela[kept]
    parts = [
        SpotPart(float(first - last), float(beam), float(cutoff))
        for first, last, beam, cutoff in zip(
            candela[:-1], candela[1:], gammas[:-1], gammas[1:], strict=True
        )
    ]
    if gammas[0] > 0:
        parts.insert(0, SpotPart(float(-candela[0]), float(gammas[0]), float(gammas[0])))
    parts.append(SpotPart(float(candela[-1]), float(gammas[-1]), float(gammas[-1])))
    return tuple(x for x in parts if x.candela != 0)


def _corners(x: Doubles, y: Doubles, slack: float) -> Indices:
    """Return the points of a polyline that suffice for an error of y of at most `slack`.

    Those of Douglas and Peucker (1973), whose first and last points are kept.
    """
    kept, open_ranges = {0, len(x) - 1}, [(0, len(x) - 1)]
    while open_ranges:
        first, last = open_ranges.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        error = np.abs(y[inner] - np.interp(x[inner], x[[first, last]], y[[first, last]]))
        if error.max() > slack:
            middle = first + 1 + int(error.argmax())
            kept.add(middle)
            open_ranges += [(first, middle), (middle, last)]
    return np.array(sorted(kept))
