"""Penalties on the weights: for changes of emission, of colour alone, or of unpainted parts.

All are quadratics in w, scaled by the pictures of the lights over the whole picture, so that they
are alike for all lights. Pixels in which an emitter is visible do not count.

Images in texels have a penalty of their own. A painting hardly tells neighbouring texels apart, and
without an expectation the best image is a patchwork of saturated colours, whose light adds up to
what was painted. So an image should be smooth, keep the colours that it has, and stay as it is
where nothing is seen of it. All three are measured over what the image covers (the solid angle of a
sky, the area of a wall), in units of the picture that an even image makes, so that their strengths
suit images of any size (docs/image_lights.md has the measurements).
"""

from dataclasses import dataclass
from functools import reduce
from math import ceil
from operator import add
from typing import Self

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis import Lights, light_images, texel_lights
from lightpaint.colour import LUMINANCE, ViewTransform, luminance
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.contrast import ContrastRows, display_amplitude
from lightpaint.lighting.loss.expected_lights import DARK, ExpectedLights, Wash
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the pull to the current colours, of lights of which the painting asks for no other
#: colour, and of lights of which it clearly does: the share of a hue's effect on the picture that
#: counts as an error, scaled by the share of painted pixels.
COLOR_PULL, CLEAR_PULL = 1.5, 0.01

#: Price of what each light by itself does to unpainted pixels, relative to that of what all lights
#: together do: the hold.
RESTRAINT = 0.25

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


@dataclass(frozen=True)
class PaintTerms:
    """The lights that a painting lets one expect, and its terms of the loss in the weights.

    expected: None where colours are free. contrast: of its wishes; restraint: on what each light
    does to unpainted pixels; None without any.
    """

    expected: ExpectedLights | None = None
    contrast: NormalEquations | None = None
    restraint: NormalEquations | None = None

    @classmethod
    def of(cls, wash: Wash, fit: Fit, own: Doubles, *, importance: float, unpainted: float) -> Self:
        """Read the terms of a sketch.

        own: (n, 3), weights with the colours that lights have. importance: of all pixels together.
        unpainted: the weight of each unpainted pixel.
        """
        keeps_colors = fit.colors in ("gentle", "white")
        return cls(
            ExpectedLights.of(wash, own) if keeps_colors else None,
            ContrastRows.of(wash, fit.transform).term(importance),
            restrain_lights(wash, own, fit.transform, unpainted=unpainted),
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
) -> NormalEquations | None:
    """Return the sum of all penalties on the weights; None without any.

    reference: (n, 3), the lighting to start from. tether: a pull to lights at other frames. For the
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
    parts = (pull, near, prior, terms.contrast, terms.restraint, tether)
    pulls = [x for x in parts if x is not None]
    return reduce(add, pulls) if pulls else None


def weight_pull(
    power: Doubles,
    current: Doubles,
    fit: Fit,
    *,
    prefer_current: float,
    painted_share: float,
    keeps_color: Bools,
    expected: ExpectedLights | None = None,
) -> NormalEquations | None:
    """Return the sum of all pulls on the weights; None without any.

    power, current: (n, 3), ‖Φᵢ‖² of the lights' pictures, and their current weights.
    prefer_current: see `Constraints`. painted_share: total importance relative to the number of
    pixels, which scales the pull to the current colours. keeps_color: (n,), lights to which that
    pull applies. expected: the lights that the painting lets one expect; None for the current ones.
    """
    gentle = fit.brightness * painted_share if fit.colors == "gentle" else 0.0
    added = (
        [pull_to_current(prefer_current * fit.brightness * power, current)]
        if prefer_current
        else []
    )
    if gentle:
        expected = expected or ExpectedLights.unchanged(current)
        strength = COLOR_PULL + expected.clarity * (CLEAR_PULL - COLOR_PULL)
        strength *= gentle * dimming_factors(current, expected.emission)
        added.append(pull_to_colors(strength[:, None] * power, current, keeps_color))
    return None if not added else added[0] if len(added) == 1 else added[0] + added[1]


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
    wash: Wash, reference: Doubles, transform: ViewTransform | None, *, unpainted: float
) -> NormalEquations | None:
    """Return the price of what each light by itself does to unpainted pixels; None without a hold.

    A hold counts what all lights together do there: one light may be turned off to make up for what
    another spills, although nobody painted that. So each light also pays for its own change,

        s ū Σᵢ Eᵢ/3 Σ_c (wᵢ/pᵢ − 1)²,     Eᵢ = Σ (1 − D) |A Φᵢ pᵢ / L|²

    with A, the change of a value of the loss with a relative change of the look L. Equal shares of
    all channels cost the same, so that the price is none on a light's colour.

    reference: (n, 3), the weights p that the look has. transform: the view transform of the loss;
    None for linear light. unpainted: ū, the weight of each unpainted pixel.
    """
    if unpainted <= 0:
        return None
    sampled = slice(None, None, ceil(wash.counts.size / RESTRAINT_BLOCKS))
    dark = DARK * float(np.maximum(wash.look, 0).mean()) or 1.0
    look = np.maximum(wash.look[:, sampled], 0).astype(np.float64)
    slope = display_amplitude(look, transform) / (look + dark)
    counts = wash.counts * (1 - np.minimum(wash.importance, 1))
    total, rest = float(counts.sum()), counts[sampled]
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
    expected: ExpectedLights | None = None,
) -> NormalEquations | None:
    """Return the penalty for all images in texels among `lights`; None if there are none.

    power: (n, 3), ‖Φᵢ‖² of the lights' pictures. painted_share, expected: see `weight_pull`.

    For radiances f of an image, energy E of the picture of an even white one and current chroma c,
    it is E times the mean of s |∇f|² + IMAGE_COLOR |f − Y(f) c|² + IMAGE_STAYING (f − f₀)² over the
    image, on which lengths are such that its area is 4π; s is SMOOTHNESS times that of the domain.
    Where the painting asks for other colours, IMAGE_COLOR is smaller.
    """
    images, strength = light_images(lights), fit.brightness * painted_share
    if not images or strength <= 0:
        return None
    n = len(lights)
    M, shares = np.zeros((3, n, n)), np.zeros((n, 3))
    for image in images:
        found = image.index >= 0
        in_image, areas = image.index[found], image.shares[found]
        # Texels of a symmetric image share a light, whose picture is that of both.
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
    expected = expected or ExpectedLights.unchanged(current)
    color = (GENTLE_IMAGE_COLOR + expected.clarity * (IMAGE_COLOR - GENTLE_IMAGE_COLOR))[:, None]
    colors = pull_to_colors(color * shares, current, texel_lights(lights))
    return even + staying + colors
