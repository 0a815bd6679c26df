"""The mix of a lamp's emitters that renders colours best, among those of the same colour."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.spectra.color_rendering import fidelity

#: Places that are tried on the way to a corner, at first and when it is divided again.
PLACES = np.linspace(0, 1, 8)[1:]
#: Most walks over all corners, and the gain of Rf below which no other follows.
ROUNDS, GAIN = 3, 0.1


def best_mix(corners: Doubles, powers: Doubles) -> Doubles:
    """Return drives (e,) of the highest Rf that a search finds between corners (k, e).

    All drives between them mix the same colour. Rf is neither convex nor smooth, so the search
    walks from the best corner, or their mean, towards each corner in turn. powers: (e, 81), the
    spectra of the emitters at full. Of a colour that is far from white, the first corner.
    """
    starts = [*corners, corners.mean(axis=0)]
    values = [fidelity(x @ powers) for x in starts]
    k = int(np.argmax(values))
    drives, best = starts[k], values[k]
    if not np.isfinite(best) or len(corners) < 2:
        return np.asarray(starts[0])
    for _ in range(ROUNDS):
        before = best
        for corner in corners:
            drives, best = _walk(drives, best, corner, powers)
        if best < before + GAIN:
            break
    return np.asarray(drives)


def _walk(drives: Doubles, best: float, corner: Doubles, powers: Doubles) -> tuple[Doubles, float]:
    """Return the best drives, and their Rf, on the way to a corner."""
    reach = 1.0
    for _ in range(2):
        tried = [drives + reach * t * (corner - drives) for t in PLACES]
        values = [fidelity(x @ powers) for x in tried]
        k = int(np.argmax(values))
        if values[k] > best:
            return tried[k], values[k]
        reach *= PLACES[0]
    return drives, best
