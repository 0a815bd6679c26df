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

A wish may be about several places, as three sculptures are. Then each counts by itself: in their
mean, one that is very bright would stand for all.

A brush is sloppy, and numbers are meant: the more of the rest was adjusted by a number, the
stronger a contrast to it. A subject that cannot be lifted, as under a locked lamp, must not pull
such a rest down instead, so the light of the rest shall come as painted, too:

    F += s' Σ_k Σ_c A_kc² (P_r / R − 1)²
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.colour import ViewTransform
from lightpaint.lighting.loss.expected_lights import UNIFORM_STOPS, Wash, adjusted_share
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the contrast of all wishes together, relative to the importance of all paint: to a
#: rest that was painted with a brush, and to one that was adjusted by a number.
CONTRAST, EXACT_CONTRAST = 0.5, 8.0

#: The same of the light of a rest that was adjusted by a number.
EXACT_REST = 1.5

#: Smallest share of the rest of a picture that must be painted for a contrast to be asked for: an
#: unpainted rest is held to the look, which was not meant as a contrast.
PAINTED_REST = 0.5

#: Largest share of a picture that a wish covers whose contrast counts: it is a subject.
SUBJECT_SHARE = 0.5

#: Light of a mean, relative to that of the picture, below which it has no contrast: black.
BLACK = 1e-3


@dataclass(frozen=True)
class ContrastRows:
    """The terms of the contrasts of k places of wishes, rows in the weights of n lights.

    contrast: (k, 3, n), A_o (ō_i / O − r̄_i / R), which shall be 0. rest: (k, 3, n), A_r r̄_i / R,
    whose sum over the lights shall be A_r, (k, 3), `rest_goal`. exact: (k,), the share of the rest
    that was adjusted by a number. share: (k,), of all contrasts; each wish has the same.
    """

    contrast: Doubles
    rest: Doubles
    rest_goal: Doubles
    exact: Doubles
    share: Doubles

    @classmethod
    @one_thread()
    def of(cls, wash: Wash, transform: ViewTransform | None) -> Self:
        """Make the rows of a painting. transform: of the loss; None for linear light."""
        n = wash.rows.shape[1]
        goal = np.where(wash.importance > 0, wash.painted, wash.look)
        total = float(wash.counts.sum())
        wishes = zip(wash.wishes, wash.places, strict=True)
        found = [x for wish in wishes if (x := _subjects_and_rests(wash, *wish, total))]
        if not found:
            none = np.zeros((0, 3, n))
            return cls(none, none, np.zeros((0, 3)), np.zeros(0), np.zeros(0))
        shares = np.array([x for parts in found for pair in parts for x in pair])  # (2 k, p)
        black = BLACK * float(np.average(goal.mean(axis=0), weights=wash.counts))
        inside, outside = (shares @ goal.T).reshape(-1, 2, 3).transpose(1, 0, 2)  # (k, 3) each
        # (k, 3, n) each
        own, rest = wash.light_sums(shares).reshape(3, n, -1, 2).transpose(3, 2, 0, 1)
        is_lit = (inside > black) & (outside > black)
        own, rest = (
            x / np.where(is_lit, mean, 1)[..., None] for x, mean in ((own, inside), (rest, outside))
        )
        amplitude, rest_amplitude = (
            display_amplitude(mean.T, transform).T * is_lit for mean in (inside, outside)
        )
        stops = wash.asked()
        # What was repainted as it is was not adjusted.
        is_changed = np.abs(stops).max(axis=0) > UNIFORM_STOPS
        exact = np.maximum(wash.exact, adjusted_share(wash, stops)) * is_changed
        return cls(
            amplitude[..., None] * (own - rest),
            rest_amplitude[..., None] * rest,
            rest_amplitude,
            shares[1::2] @ exact,
            np.array([1 / len(found) / len(parts) for parts in found for _ in parts]),
        )

    def term(self, strength: float) -> NormalEquations | None:
        """Return the term of the loss; None without any. strength: the importance of all paint."""
        if not len(self.contrast) or strength <= 0:
            return None
        each = strength * self.share
        lift = each * (CONTRAST + self.exact * (EXACT_CONTRAST - CONTRAST))
        keep = each * EXACT_REST * self.exact
        M = np.einsum("k,kci,kcj->cij", lift, self.contrast, self.contrast)
        M += np.einsum("k,kci,kcj->cij", keep, self.rest, self.rest)
        b = np.einsum("k,kci,kc->ci", keep, self.rest, self.rest_goal)
        return NormalEquations(M, b, keep @ self.rest_goal**2)


def _subjects_and_rests(
    wash: Wash, area: Doubles, places: Indices, total: float
) -> list[tuple[Doubles, Doubles]]:
    """Return the shares of blocks, (p,), whose sums are means over each place of a wish and over
    the rest of the picture; none for a wish without a contrast.

    area, places: (p,), see `Wash`. total: the number of pixels.
    """
    own = wash.counts * area * wash.importance
    rest = wash.counts * (1 - area)
    painted_rest = float(rest @ wash.importance)
    if not 0 < own.sum() <= SUBJECT_SHARE * total:
        return []
    if painted_rest <= 0 or painted_rest < PAINTED_REST * rest.sum():
        return []
    parts = [own * (places == k) for k in range(1, places.max(initial=0) + 1)]
    subjects = [x for x in parts if x.any()] or [own]
    return [(x / x.sum(), rest / rest.sum()) for x in subjects]


def display_amplitude(light: Doubles, transform: ViewTransform | None) -> Doubles:
    """Return how much values of the loss change with a relative change of light, (3, k).

    light: (3, k), linear. transform: the view transform of the loss; None for linear light.
    """
    if transform is None:
        return np.maximum(light, 0)
    low, high = (transform.encode_planes(light * x) for x in (0.98, 1.02))
    return np.asarray(np.abs(high - low) / 0.04, np.float64)
