"""Remarks on emitters in view: the painted pixels that they exclude, and their brightness in the
answer.
"""

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.colour.color import luminance
from lightpaint.images.bands import sum_by_bands
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.loss.painting import ignored_paint
from lightpaint.lighting.solution import Solution
from lightpaint.screen import some_of
from lightpaint.target.target import Target

#: Ratio to the painted brightness from which an emitter that does not count is worth a warning.
MIN_RATIO = 4.0

#: Share of the painted energy from which emitters that count dominate the answer.
DOMINANT_SHARE = 0.5


def emitter_remarks(target: Target, solution: Solution, predicted: Estimate) -> list[str]:
    """Return sentences for people. target: of one view, as it was given to the solve."""
    seen = solution.basis.emitters_seen
    painted = target.importance > 0
    out = ignored_paint(target, seen, solution.problem.fit.emitters)
    if out.any():
        return [
            f"{_share(out, painted)}, and count nothing; "
            'emitters="count" holds the emitters themselves to how bright they were painted',
            *_too_bright(target, solution, predicted, out),
        ]
    counted = seen & painted
    [read] = solution.problem.views.targets
    if read.at_least is not None:
        counted &= ~read.at_least.all(axis=-1)
    if not counted.any():
        return []

    def energies(D: Floats, image: Floats, its: Bools) -> Floats:
        energy = D[..., None] * np.square(image, dtype=np.float64)
        return np.array([energy[its].sum(), energy.sum()])

    own, every = sum_by_bands(energies, target.importance, target.image, counted).tolist()
    if (part := own / (every or 1)) >= DOMINANT_SHARE:
        return [
            f"{_share(counted, painted)}, which make up {100 * part:.0f} % of the painted energy "
            'and rule the fit: emitters="skip" leaves them out'
        ]
    return []


def _share(some: Bools, painted: Bools) -> str:
    count, every = int(some.sum()), int(painted.sum())
    return (
        f"emitters are seen in {count} of {every} painted pixels "
        f"({100 * count / every:.{1 if count < 0.1 * every else 0}f} %)"
    )


def _too_bright(target: Target, solution: Solution, predicted: Estimate, out: Bools) -> list[str]:
    """Return a warning of lights that come out far brighter in view than they were painted."""
    basis = solution.basis
    # Where the painting means "at least", nothing is too bright.
    if target.at_least is not None:
        out = out & ~target.at_least.any(axis=-1)
    images = basis.planes.pixels(np.flatnonzero(out)) * solution.weights[:, None].astype(np.float32)
    whose = np.argmax(luminance(images), axis=0) if out.any() else np.zeros(0, np.intp)
    here, meant = (np.asarray(luminance(x[out])) for x in (predicted.image, target.image))
    told = []
    for k in np.unique(whose):
        there, wanted = here[whose == k].sum(), np.maximum(meant[whose == k], 0).sum()
        if there > MIN_RATIO * wanted and not basis.is_fixed[k]:
            told.append(f"{basis.names[k]} ({_times(float(there), float(wanted))})")
    if not told:
        return []
    return [
        f"WARNING: brighter than painted where they are seen: {some_of(told, room=300)}; "
        'emitters="count" holds them to the painting'
    ]


def _times(there: float, meant: float) -> str:
    if meant <= 0:
        return "painted black"
    return f"{there / meant:,.{0 if there >= 10 * meant else 1}f} times"
