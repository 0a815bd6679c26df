"""The contrast of a wish to the rest of the picture, as a term of its own in the loss.

A subject of two percent of a picture drowns in the other pixels: an answer that gets these right
and leaves the subject grey has a smaller error than one that lifts it. People see the contrast
between the two. So for each wish the ratio of its mean light to that of the rest shall be as
painted:

    F += s Σ_k Σ_c A_kc² (P_o / O − P_r / R)²

with the means P of the answer and O, R of the painting over the wish (o) and over the rest (r), and
A the change of a display value with a relative change of light there. It is a quadratic in the
weights. The paper weighs surfaces so that large unpainted ones do not overwhelm small painted ones;
this does the same between painted ones.
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.loss.expected_lights import Wash
from lightpaint.lighting.normal_equations import NormalEquations

#: Strength of the contrast of all wishes together, relative to the importance of all paint.
CONTRAST = 0.5

#: Smallest share of the rest of a picture that must be painted for a contrast to be asked for: an
#: unpainted rest is held to the look, which was not meant as a contrast.
PAINTED_REST = 0.5

#: Largest share of a picture that a wish covers whose contrast counts: it is a subject.
SUBJECT_SHARE = 0.5

#: Light of a mean, relative to that of the picture, below which it has no contrast: black.
BLACK = 1e-3


def contrast_rows(wash: Wash, transform: ViewTransform | None) -> Doubles:
    """Return A (ō_i / O − r̄_i / R) for each wish and channel, (k, 3, n).

    transform: the view transform of the loss; None for linear light.
    """
    rows = []
    goal = np.where(wash.importance > 0, wash.painted, wash.look)
    total = float(wash.counts.sum())
    black = BLACK * float(np.average(goal.mean(axis=0), weights=wash.counts)) if total else 0.0
    for area in wash.wishes:
        own = wash.counts * area * wash.importance
        rest = wash.counts * (1 - area)
        painted_rest = float((rest * wash.importance).sum())
        if not 0 < own.sum() <= SUBJECT_SHARE * total:
            continue
        if painted_rest <= 0 or painted_rest < PAINTED_REST * rest.sum():
            continue
        means = [[(x @ part) / part.sum() for part in (own, rest)] for x in goal]
        lights = [[(x @ part) / part.sum() for part in (own, rest)] for x in wash.rows]
        row = np.zeros((3, wash.rows.shape[1]))
        for c, ((inside, outside), (o, r)) in enumerate(zip(means, lights, strict=True)):
            if inside > black and outside > black:
                row[c] = o / inside - r / outside
        rows.append(_amplitude(np.array([x[0] for x in means]), transform)[:, None] * row)
    return np.array(rows).reshape(-1, 3, wash.rows.shape[1])


def contrast_term(rows: Doubles, strength: float) -> NormalEquations | None:
    """Return the term of rows (k, 3, n); None without any.

    strength: the importance of all paint.
    """
    if not len(rows) or strength <= 0:
        return None
    M = CONTRAST * strength / len(rows) * np.einsum("kci,kcj->cij", rows, rows)
    return NormalEquations(M, np.zeros(M.shape[:2]), np.zeros(3))


def _amplitude(light: Doubles, transform: ViewTransform | None) -> Doubles:
    """Return how much a value of the loss changes with a relative change of light, (3,)."""
    if transform is None:
        return np.maximum(light, 0)
    low, high = (transform.encode_planes(light[:, None] * x)[:, 0] for x in (0.98, 1.02))
    return np.asarray(np.abs(high - low) / 0.04, np.float64)
