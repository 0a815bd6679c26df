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
from lightpaint.colour import ViewTransform
from lightpaint.lighting.loss.expected_lights import Wash
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the contrast of all wishes together, relative to the importance of all paint.
CONTRAST = 0.5

#: Smallest share of the rest of a picture that must be painted for a contrast to be asked for: an
#: unpainted rest is held to the look, which was not meant as a contrast.
PAINTED_REST = 0.5

#: Largest share of a picture that a wish covers whose contrast counts: it is a subject.
SUBJECT_SHARE = 0.5

#: Light of a mean, relative to that of the picture, below which it has no contrast: black.
BLACK = 1e-3


@one_thread()
def contrast_rows(wash: Wash, transform: ViewTransform | None) -> Doubles:
    """Return A (ō_i / O − r̄_i / R) for each wish and channel, (k, 3, n).

    transform: the view transform of the loss; None for linear light.
    """
    n = wash.rows.shape[1]
    goal = np.where(wash.importance > 0, wash.painted, wash.look)
    total = float(wash.counts.sum())
    parts = [x for area in wash.wishes for x in _subject_and_rest(wash, area, total)]
    if not parts:
        return np.zeros((0, 3, n))
    shares = np.array(parts)  # (2 k, p)
    black = BLACK * float(np.average(goal.mean(axis=0), weights=wash.counts))
    inside, outside = (shares @ goal.T).reshape(-1, 2, 3).transpose(1, 0, 2)  # (k, 3) each
    own, rest = wash.light_sums(shares).reshape(3, n, -1, 2).transpose(3, 2, 0, 1)  # (k, 3, n) each
    is_lit = (inside > black) & (outside > black)
    o, r = (np.where(is_lit, x, 1)[..., None] for x in (inside, outside))
    amplitude = display_amplitude(inside.T, transform).T
    return np.asarray((amplitude * is_lit)[..., None] * (own / o - rest / r))


def _subject_and_rest(wash: Wash, area: Doubles, total: float) -> list[Doubles]:
    """Return the shares of blocks, (p,), whose sums are means over a wish and over the rest; none
    for a wish without a contrast.

    total: the number of pixels.
    """
    own = wash.counts * area * wash.importance
    rest = wash.counts * (1 - area)
    painted_rest = float(rest @ wash.importance)
    if not 0 < own.sum() <= SUBJECT_SHARE * total:
        return []
    if painted_rest <= 0 or painted_rest < PAINTED_REST * rest.sum():
        return []
    return [own / own.sum(), rest / rest.sum()]


def contrast_term(rows: Doubles, strength: float) -> NormalEquations | None:
    """Return the term of rows (k, 3, n); None without any.

    strength: the importance of all paint.
    """
    if not len(rows) or strength <= 0:
        return None
    M = CONTRAST * strength / len(rows) * np.einsum("kci,kcj->cij", rows, rows)
    return NormalEquations(M, np.zeros(M.shape[:2]), np.zeros(3))


def display_amplitude(light: Doubles, transform: ViewTransform | None) -> Doubles:
    """Return how much values of the loss change with a relative change of light, (3, k).

    light: (3, k), linear. transform: the view transform of the loss; None for linear light.
    """
    if transform is None:
        return np.maximum(light, 0)
    low, high = (transform.encode_planes(light * x) for x in (0.98, 1.02))
    return np.asarray(np.abs(high - low) / 0.04, np.float64)
