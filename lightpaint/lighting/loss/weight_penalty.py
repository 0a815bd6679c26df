"""Terms of a loss beside its pixels: penalties on changes of emission, of colour alone, or of
unpainted parts, and the contrast of a wish to the rest of the picture.

All are quadratics in w, scaled by the pictures of the lights over the whole picture, so that they
are alike for all lights. Pixels in which an emitter is visible do not count.

Images in texels have a penalty of their own. A painting hardly tells neighbouring texels apart, and
without an expectation the best image is a patchwork of saturated colours, whose light adds up to
what was painted. So an image should be smooth, keep the colours that it has, and stay as it is
where nothing is seen of it. All three are measured over what the image covers (the solid angle of a
sky, the area of a wall), in units of the picture that an even image makes, so that their strengths
suit images of any size (docs/image_lights.md has the measurements).

A subject of two percent of a picture drowns in the other pixels: an answer that gets these right
and leaves the subject grey has a smaller error than one that lifts it. People see the contrast
between the two. So for each wish the ratio of its mean light to the mean light of the rest shall be
as painted:

    F += s Σ_k Σ_c A_kc² (P_o / O − P_r / R)²

with the means P of the answer and O, R of the painting over the wish (o) and over the rest (r), and
A the change of a display value with a relative change of light there. It is a quadratic in the
weights. The paper weighs surfaces so that large unpainted ones do not overwhelm small painted ones;
this does the same between painted ones.

Light beyond the white of the display counts as white: a highlight of four times white looks as one
of twice white does, and a mean of both would hide what the rest of a subject lacks.

A wish may be about several places, as three sculptures are. Then each counts by itself: in their
mean, one that is very bright would stand for all.

A brush is sloppy, and numbers are meant: the more of the rest was adjusted by a number, the
stronger a contrast to it, unless the wish was painted by strokes itself. A subject that cannot be
lifted, as under a locked lamp, must not pull such a rest down instead, so the light of the rest
shall come as painted, too:

    F += s' Σ_k Σ_c A_kc² (P_r / R − 1)²

A wish for a flame in view is a wish for the lamp: what is around the flame may have been painted
otherwise, and a display shows any flame as white. So such a wish in numbers asks for the emitter's
own light, P_e / E = 1, as the rest above, with the A of light of its colour that is just not white.

Texels of an image could meet any contrast by a patchwork of odd colours. So as far as the light of
a wish comes from texels, its contrast stays the contrast of a brush.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from math import ceil
from operator import add
from typing import Self

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.basis import Lights, light_images, texel_lights
from lightpaint.colour import LUMINANCE, ViewTransform, luminance
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import expected_lights
from lightpaint.lighting.loss.footprints import find_footprint, footprint_term
from lightpaint.lighting.loss.painting import unpainted_weight
from lightpaint.lighting.loss.painting_loss import display_amplitude
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the contrast of all wishes together, relative to the importance of all paint: to a
#: rest that was painted with a brush, and to one that was adjusted by a number.
CONTRAST, EXACT_CONTRAST = 0.5, 8.0

#: The same of the light of a rest that was adjusted by a number.
EXACT_REST = 1.5

#: The same of the light of emitters in view that was given by numbers.
FLAME = 0.5

#: Light by which changes of an emitter's are measured, relative to white, beyond which a display
#: shows none.
BELOW_WHITE = 0.9

#: Smallest share of the rest of a picture that must be painted for a contrast to be asked for: an
#: unpainted rest is held to the look, which was not meant as a contrast.
PAINTED_REST = 0.5

#: Largest share of a picture that a wish covers whose contrast counts: it is a subject.
SUBJECT_SHARE = 0.5

#: Light of a mean, relative to the mean of the picture, below which it has no contrast: black.
BLACK = 1e-3

#: Strength of the pull to the current colours, of lights of which the painting asks for no other
#: colour, and of lights of which it clearly does: the share of a hue's effect on the picture that
#: counts as an error, scaled by the share of painted pixels.
COLOR_PULL, CLEAR_PULL = 1.5, 0.01

#: Price of what each light by itself does to unpainted pixels, relative to the price of what all
#: lights together do: the hold.
RESTRAINT = 0.25

#: Least hold by which that price is paid, but where colours are free: with a hold of 0, too, lights
#: that the paint does not ask for stay as they are.
LEAST_HOLD = 0.1

#: Approximate number of blocks of pixels over which that price is summed.
RESTRAINT_BLOCKS = 2**11

#: Least emission of a channel, relative to the brightest, by which its changes are measured.
LEAST_CHANNEL = 0.05

#: Largest factor of dimming that strengthens the pull to a light's colour.
MAX_DIMMING = 100.0

#: Strengths of the pulls to an even image in texels, to its current colours, and to the current
#: image.
SMOOTHNESS, IMAGE_COLOR, IMAGE_STAYING = 1e-4, 1e-3, 1e-3
#: Strength of the pull to an image's current colours where lights keep theirs (`colors` is
#: `gentle`), and the painting asks for no others.
GENTLE_IMAGE_COLOR = 1e-2
#: Strength of the pulls at texels that are split again, relative to those at a level above: as much
#: light in a ninth of the area is nine times as bright, and its square costs nine times as much.
FINER_SHARE = 1 / 9
#: Share in the picture, relative to its share of the image, below which a texel counts as
#: unseen: it stays as it is, however bright its neighbours get.
SEEN_SHARE = 1e-3

#: Share of the loss of contrasts now from which they count as missed.
MISSED_CONTRAST = 0.5


@dataclass(frozen=True)
class ContrastRows:
    """The terms of the contrasts of k places of wishes, rows in the weights of n lights.

    contrast: (k, 3, n), A_o (ō_i / O − r̄_i / R), which shall be 0. rest: (k, 3, n), A_r r̄_i / R,
    whose sum over the lights shall be A_r, (k, 3), `rest_goal`. exact: (k,), the share of the rest
    that was adjusted by a number, without what texels light. by_numbers: (k,), the share of
    the wish that was not painted by strokes. share: (k,), of all contrasts; each wish has the same.
    """

    contrast: Doubles
    rest: Doubles
    rest_goal: Doubles
    exact: Doubles
    by_numbers: Doubles
    share: Doubles

    @classmethod
    @one_thread()
    def of(
        cls,
        wash: expected_lights.Wash,
        transform: ViewTransform | None,
        texel_weights: Doubles | None = None,
    ) -> Self:
        """Make the rows of a painting.

        transform: of the loss; None for linear light. texel_weights: (n, 3), weights of the look,
        0 for all lights but texels; None without any.
        """
        n = wash.rows.shape[1]
        goal = np.where(wash.importance > 0, wash.painted, wash.look)
        total = float(wash.counts.sum())
        pairs = [
            _subjects_and_rests(wash, *wish, total)
            for wish in zip(wash.wishes, wash.places, strict=True)
        ]
        found = [x for x in pairs if x]
        if not found:
            none = np.zeros((0, 3, n))
            return cls(none, none, np.zeros((0, 3)), *np.zeros((3, 0)))
        shares = np.array([x for parts in found for pair in parts for x in pair])  # (2 k, p)
        if transform is not None:
            shares = shares * seen_share(goal, transform)
            shares /= shares.sum(axis=1, keepdims=True)
        black = BLACK * float(np.average(goal.mean(axis=0), weights=wash.counts))
        inside, outside = (shares @ goal.T).reshape(-1, 2, 3).transpose(1, 0, 2)  # (k, 3) each
        # (k, 3, n) each
        own, rest = wash.light_sums(shares).reshape(3, n, -1, 2).transpose(3, 2, 0, 1)
        by_lamps = 1 - _texel_share(own, shares[::2] @ wash.look.T, texel_weights)
        is_lit = (inside > black) & (outside > black)
        own, rest = (
            x / np.where(is_lit, mean, 1)[..., None] for x, mean in ((own, inside), (rest, outside))
        )
        amplitude, rest_amplitude = (
            display_amplitude(mean.T, transform).T * is_lit for mean in (inside, outside)
        )
        stops = wash.asked()
        # What was repainted as it is was not adjusted.
        is_changed = np.abs(stops).max(axis=0) > expected_lights.UNIFORM_STOPS
        exact = np.maximum(wash.exact, expected_lights.adjusted_share(wash, stops)) * is_changed
        return cls(
            amplitude[..., None] * (own - rest),
            rest_amplitude[..., None] * rest,
            rest_amplitude,
            shares[1::2] @ exact * by_lamps,
            1 - np.repeat(_stroke_shares(wash), [len(x) for x in pairs]),
            np.array([1 / len(found) / len(parts) for parts in found for _ in parts]),
        )

    def term(self, strength: float) -> NormalEquations | None:
        """Return the term of the loss; None without any. strength: the importance of all paint."""
        if not len(self.contrast) or strength <= 0:
            return None
        each = strength * self.share
        exact = self.exact * self.by_numbers
        lift = each * (CONTRAST + exact * (EXACT_CONTRAST - CONTRAST))
        keep = each * EXACT_REST * self.exact
        M = _weighted_squares(lift, self.contrast) + _weighted_squares(keep, self.rest)
        b = np.einsum("k,kci,kc->ci", keep, self.rest, self.rest_goal)
        return NormalEquations(M, b, keep @ self.rest_goal**2)


def _weighted_squares(weights: Doubles, rows: Doubles) -> Doubles:
    """Return Σₖ wₖ rₖ rₖᵀ of each channel, (3, n, n). weights: (k,), from 0; rows: (k, 3, n)."""
    scaled = (np.sqrt(np.maximum(weights, 0))[:, None, None] * rows).transpose(1, 0, 2)
    with one_thread():
        return np.asarray(scaled.transpose(0, 2, 1) @ scaled)


def flame_term(
    flames: expected_lights.FlameWishes, transform: ViewTransform | None, strength: float
) -> NormalEquations | None:
    """Return the term of wishes for emitters in view; None without any.

    transform: of the loss; None for linear light, in which their pixels alone ask for as much.
    strength: the importance of all paint.
    """
    light = flames.light[(flames.light > 0).all(axis=1)]
    if transform is None or not len(light) or strength <= 0:
        return None
    brightest = light.max(axis=1, keepdims=True)
    shown = light * np.minimum(1, BELOW_WHITE * transform.white / brightest)
    amplitude = display_amplitude(shown.T, transform).T
    rows = flames.rows[(flames.light > 0).all(axis=1)] * (amplitude / light)[..., None]
    each = strength * FLAME / len(light)
    M = each * np.einsum("kci,kcj->cij", rows, rows)
    b = each * np.einsum("kci,kc->ci", rows, amplitude)
    return NormalEquations(M, b, each * np.square(amplitude).sum(axis=0))


def _subjects_and_rests(
    wash: expected_lights.Wash, area: Doubles, places: Indices, total: float
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


def _stroke_shares(wash: expected_lights.Wash) -> Doubles:
    """Return the share of each wish that layers of strokes paint, (k,)."""
    areas = wash.wishes * wash.counts
    common = np.minimum(areas, wash.strokes * wash.counts).sum(axis=1)
    total = areas.sum(axis=1)
    return np.asarray(common / np.where(total > 0, total, 1))


def _texel_share(own: Doubles, look: Doubles, texel_weights: Doubles | None) -> Doubles:
    """Return the share of the present light of each subject that comes from texels, (k,).

    own: (k, 3, n), its light of each lamp. look: (k, 3), its present light. texel_weights: see
    `ContrastRows.of`.
    """
    if texel_weights is None:
        return np.zeros(len(own))
    light, total = np.einsum("kcn,nc->k", own, texel_weights), look.sum(axis=1)
    return np.asarray(np.clip(light / np.where(total > 0, total, np.inf), 0, 1))


def seen_share(light: Doubles, transform: ViewTransform) -> Doubles:
    """Return the share of light that counts, (p,): 1 up to the white of the display, and beyond it
    as much as makes it white.

    light: (3, p), linear. transform: the view transform of the loss.
    """
    mean = light.mean(axis=0)
    return np.asarray(np.minimum(1, transform.white / np.maximum(mean, transform.white)))


@dataclass(frozen=True)
class PaintTerms:
    """The lights that a painting lets one expect, and its terms of the loss in the weights.

    expected: None where colours are free. contrast: of its wishes; restraint: on what each light
    does to unpainted pixels; None without any.
    """

    expected: expected_lights.ExpectedLights | None = None
    contrast: NormalEquations | None = None
    restraint: NormalEquations | None = None

    @classmethod
    def of(
        cls,
        wash: expected_lights.Wash,
        fit: Fit,
        own: Doubles,
        *,
        importance: float,
        unpainted: float,
        texels: Bools,
        is_free: Bools,
    ) -> Self:
        """Read the terms of a sketch.

        own: (n, 3), weights with the colours that lights have. importance: of all pixels together.
        unpainted: the weight of each unpainted pixel. texels: (n,), lights that are texels.
        is_free: as for `ExpectedLights.of`.
        """
        keeps_colors = fit.colors in ("gentle", "white")
        texel_weights = own * texels[:, None] if texels.any() else None
        contrast = ContrastRows.of(wash, fit.transform, texel_weights)
        footprint = None if texels.any() or importance <= 0 else find_footprint(wash, own)
        # The picture of a footprint has its own contrast.
        left = 1.0 if footprint is None else 1 - footprint.confidence
        return cls(
            expected_lights.ExpectedLights.of(wash, own, is_free) if keeps_colors else None,
            _sum(
                contrast.term(left * importance),
                None
                if footprint is None
                else footprint_term(wash, footprint, fit.transform, importance),
                flame_term(wash.flames, fit.transform, importance),
            ),
            restrain_lights(wash, own, fit, unpainted=unpainted),
        )


def joint_pull(
    lights: Lights,
    power: Doubles,
    reference: Doubles,
    fit: Fit,
    constraints: Constraints,
    terms: PaintTerms,
    *,
    painted_share: float,
    keeps_color: Bools,
    tether: NormalEquations | None = None,
    holding: NormalEquations | None = None,
) -> NormalEquations | None:
    """Return the sum of all penalties on the weights; None without any.

    reference: (n, 3), the lighting to start from. tether: a pull to lights at other frames.
    holding: a pull to the current lights, of an answer that would lead away from the paint. For the
    other arguments see `weight_pull`.
    """
    pull = weight_pull(
        power,
        reference,
        fit,
        prefer_current=constraints.prefer_current,
        painted_share=painted_share,
        keeps_color=keeps_color,
        expected=terms.expected,
    )
    near = pull_near_start(
        power, reference, fit, near=constraints.near, painted_share=painted_share
    )
    prior = image_prior(lights, power, fit, painted_share, terms.expected)
    return _sum(pull, near, prior, terms.contrast, terms.restraint, tether, holding)


def _sum(*terms: NormalEquations | None) -> NormalEquations | None:
    """Return the sum of terms; None without any."""
    given = [x for x in terms if x is not None]
    return reduce(add, given) if given else None


def weight_pull(
    power: Doubles,
    current: Doubles,
    fit: Fit,
    *,
    prefer_current: float,
    painted_share: float,
    keeps_color: Bools,
    expected: expected_lights.ExpectedLights | None = None,
) -> NormalEquations | None:
    """Return the sum of all pulls on the weights; None without any.

    power, current: (n, 3), ‖Φᵢ‖² of the lights' pictures, and their current weights.
    prefer_current: see `Constraints`. painted_share: total importance relative to the number of
    pixels, which scales the pull to the current colours. keeps_color: (n,), lights to which that
    pull applies. expected: the lights that the painting lets one expect; None for the current ones.
    """
    to_current, to_colors = prefer_current * fit.brightness, None
    if fit.colors == "gentle" and (gentle := fit.brightness * painted_share):
        expected = expected or expected_lights.ExpectedLights.unchanged(current)
        strength = COLOR_PULL + expected.clarity * (CLEAR_PULL - COLOR_PULL)
        strength *= gentle * dimming_factors(current, expected.emission)
        to_colors = pull_to_colors(strength[:, None] * power, current, keeps_color)
    return _sum(pull_to_current(to_current * power, current) if to_current else None, to_colors)


def dimming_factors(current: Doubles, weights: Doubles) -> Doubles:
    """Return the factor (n,) by which weights (n, 3) are dimmer than the current ones, or 1.

    The pull to a light's colour is quadratic in its light, and would vanish for one that is
    expected to be dim. This factor makes it linear.
    """
    current_luminance, luminances = (
        np.asarray(luminance(x), np.float64) for x in (current, weights)
    )
    least = np.where(current_luminance > 0, current_luminance / MAX_DIMMING, 1)
    return np.clip(current_luminance / np.maximum(luminances, least), 1, MAX_DIMMING)


def pull_to_current(power: Doubles, current: Doubles) -> NormalEquations:
    """Return the pull Σᵢ powerᵢ (wᵢ − presentᵢ)²; both (n, 3), power s ‖Φᵢ‖² for a strength s.

    The scale is absolute: it does not depend on the painting.
    """
    M = np.einsum("ic,ij->cij", power, np.eye(len(power)))
    return NormalEquations(M, (power * current).T, (power * current**2).sum(axis=0))


def pull_near_start(
    power: Doubles, start: Doubles, fit: Fit, *, near: float, painted_share: float
) -> NormalEquations | None:
    """Return the pull s Σᵢ ‖Φᵢ‖² (wᵢ − startᵢ)² to the lighting to start from; None without any.

    s is `near` times the share of painted pixels, so that it is small beside what the paint asks of
    the lights that reach it, and settles what the paint leaves open. power, start: (n, 3).
    """
    strength = near * fit.brightness * painted_share
    return pull_to_current(strength * power, start) if strength > 0 else None


@one_thread()
def restrain_lights(
    wash: expected_lights.Wash,
    reference: Doubles,
    fit: Fit,
    *,
    unpainted: float,
) -> NormalEquations | None:
    """Return the price of what each light by itself does to unpainted pixels; None without any.

    A hold counts what all lights together do there: one light may be turned off to make up for what
    another spills, although nobody painted that; without a hold, lights may go off for nearly
    nothing. So each light also pays for its own change,

        s ū Σᵢ Eᵢ/3 Σ_c (wᵢ/pᵢ − 1)²,     Eᵢ = Σ (1 − D) |A Φᵢ pᵢ / L|²

    with A, the change of a value of the loss with a relative change of the look L. Equal shares of
    all channels cost the same, so that the price is none on a light's colour.

    reference: (n, 3), the weights p that the look has. unpainted: ū, the weight of each unpainted
    pixel; with a weaker hold than LEAST_HOLD, ū is as with LEAST_HOLD.
    """
    painted = wash.counts * np.minimum(wash.importance, 1)
    counts = wash.counts - painted
    total = float(counts.sum())
    if fit.colors != "free" and not fit.unpainted and (fit.hold or 0) < LEAST_HOLD:
        least = unpainted_weight(float(painted.sum()), total, replace(fit, hold=LEAST_HOLD))
        unpainted = max(unpainted, least)
    if unpainted <= 0:
        return None
    sampled = slice(None, None, ceil(wash.counts.size / RESTRAINT_BLOCKS))
    dark = expected_lights.DARK * float(np.maximum(wash.look, 0).mean()) or 1.0
    look = np.maximum(wash.look[:, sampled], 0).astype(np.float64)
    slope = display_amplitude(look, fit.transform) / (look + dark)
    rest = counts[sampled]
    rest = rest * (total / max(float(rest.sum()), 1e-300))
    rows = np.square(wash.rows[:, :, sampled])
    per_block = (slope**2 * rest).astype(np.float32)
    energy = np.stack([x @ y for x, y in zip(rows, per_block, strict=True)], axis=1)
    change = (energy * np.square(reference)).sum(axis=1, keepdims=True) / 3
    # A light that is off has no level to keep; one without blue pays for blue as for very little.
    scale = np.maximum(reference, LEAST_CHANNEL * reference.max(axis=1, keepdims=True))
    power = change / np.where(scale > 0, np.square(scale), np.inf)
    return pull_to_current(RESTRAINT * unpainted * power, reference)


def pull_to_colors(power: Doubles, current: Doubles, lights: Bools) -> NormalEquations:
    """Return the pull s Σᵢ ‖Φᵢ (wᵢ − Y(wᵢ) cᵢ)‖² of `lights`, (n,), to their current colours.

    power: (n, 3), s ‖Φᵢ‖². cᵢ is the current emission at luminance 1, and white for a light that is
    off. Dimming costs nothing; a change of hue costs its effect in each
    channel.
    """
    n = len(power)
    now = np.asarray(luminance(current), np.float64)[:, None]
    chroma = np.where(now > 0, current / np.where(now > 0, now, 1), 1.0)
    hue = np.eye(3) - chroma[:, :, None] * LUMINANCE
    across = np.einsum("ndc,nd,nde->nce", hue, power * lights[:, None], hue)
    M = np.zeros((3, n, n))
    each = np.arange(n)
    M[:, each, each] = np.einsum("ncc->cn", across)
    across[:, range(3), range(3)] = 0
    return NormalEquations(M, np.zeros((3, n)), np.zeros(3), across)


def image_prior(
    lights: Lights,
    power: Doubles,
    fit: Fit,
    painted_share: float,
    expected: expected_lights.ExpectedLights | None = None,
) -> NormalEquations | None:
    """Return the penalty for all images in texels among `lights`; None if there are none.

    power: (n, 3), ‖Φᵢ‖² of the lights' pictures. painted_share, expected: see `weight_pull`.

    For radiances f of an image, energy E of the picture of an even white one and current chroma c,
    it is E times the mean of s |∇f|² + IMAGE_COLOR |f − Y(f) c|² + IMAGE_STAYING (f − f₀)² over the
    image, on which lengths are such that its area is 4π; s is SMOOTHNESS times the area of the
    domain. Where the painting asks for other colours, IMAGE_COLOR is smaller.
    """
    images, strength = light_images(lights), fit.brightness * painted_share
    if not images or strength <= 0:
        return None
    n = len(lights)
    M, shares = np.zeros((3, n, n)), np.zeros((n, 3))
    for image in images:
        found = image.index >= 0
        in_image, areas = image.index[found], image.shares[found]
        # Texels of a symmetric image share a light, whose picture is the picture of both.
        amplitudes = np.sqrt(power[in_image]) / np.bincount(in_image)[in_image, None]
        # Pictures of texels overlap, so the energy of their sum is about this.
        energy = strength * amplitudes.sum(axis=0) ** 2
        # Light of a sun in a part of a texel is as likely as in all of it.
        levels = np.array([node[0] for node in image.layout.nodes])[found]
        np.add.at(shares, in_image, energy * (areas * FINER_SHARE**levels)[:, None])
        seen_share = amplitudes.sum(axis=1) / amplitudes.sum() / areas
        at = np.where(image.is_split, -1, image.places)
        seen = np.where(np.isin(at, in_image[seen_share > SEEN_SHARE]), at, -1)
        smoothness = SMOOTHNESS * image.domain.smoothness
        for one, other, stiffness in image.domain.neighbours(image.size):
            first, second = int(seen[one]), int(seen[other])
            if first < 0 or second < 0 or first == second:
                continue
            for i, j, sign in ((first, first, 1), (second, second, 1), (first, second, -1)):
                M[:, i, j] += sign * smoothness * stiffness * energy
            M[:, second, first] = M[:, first, second]
    even = NormalEquations(M, np.zeros((3, n)), np.zeros(3))
    current = lights.current_weights
    staying = pull_to_current(IMAGE_STAYING * shares, current)
    if fit.colors != "gentle":
        return even + staying + pull_to_colors(IMAGE_COLOR * shares, current, texel_lights(lights))
    expected = expected or expected_lights.ExpectedLights.unchanged(current)
    color = (GENTLE_IMAGE_COLOR + expected.clarity * (IMAGE_COLOR - GENTLE_IMAGE_COLOR))[:, None]
    colors = pull_to_colors(color * shares, current, texel_lights(lights))
    return even + staying + colors


def is_spoilt_by_contrast(
    contrast: NormalEquations | None,
    weights: Doubles,
    current: Doubles,
    objective: Callable[[Doubles], float],
) -> bool:
    """Return whether weights (n, 3) miss the painting by more than the current lights do, and yet
    most of the contrasts.

    A contrast is a ratio to the rest of the picture. Where no light can lift the subject alone,
    all lights go down for it, as everything that is missed is less in the dark. objective: the
    loss of weights, without contrasts.
    """
    if contrast is None:
        return False
    missed, missed_now = (float(contrast.objective(w).sum()) for w in (weights, current))
    if missed <= MISSED_CONTRAST * missed_now:
        return False
    return objective(weights) > objective(current)
