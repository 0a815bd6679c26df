"""Penalties on the weights: for changes of emission, of colour alone, or of unpainted parts.

All are quadratics in w, scaled by the pictures of the lights over the whole picture, so that they
are alike for all lights. Pixels in which an emitter is visible do not count.
"""

from math import ceil

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.colour.color import LUMINANCE, luminance
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.contrast import display_amplitude
from lightpaint.lighting.loss.expected_lights import DARK, ExpectedLights, Wash
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the pull to the current colours, of lights of which the painting asks for no other
#: colour, and of lights of which it clearly does: the share of a hue's effect on the picture that
#: counts as an error, scaled by the share of painted pixels.
COLOR_PULL, CLEAR_PULL = 1.5, 0.02

#: Price of what each light by itself does to unpainted pixels, relative to that of what all lights
#: together do: the hold.
RESTRAINT = 0.25

#: Approximate number of blocks of pixels over which that price is summed.
RESTRAINT_BLOCKS = 2**11

#: Least emission of a channel, relative to the brightest, by which its changes are measured.
LEAST_CHANNEL = 0.05

#: Largest factor of dimming that strengthens the pull to a light's colour.
MAX_DIMMING = 100.0


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
