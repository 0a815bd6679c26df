"""A quadratic penalty for images in texels: what they should be where the painting does not tell.

A painting hardly tells neighbouring texels apart. Without an expectation the best image is a
patchwork of saturated colours, whose light adds up to what was painted. So an image should be
smooth, keep the colours that it has, and stay as it is where nothing is seen of it. All three are
measured over what the image covers (the solid angle of a sky, the area of a wall), in units of the
picture that an even image makes, so that their strengths suit images of any size
(docs/image_lights.md has the measurements).
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.light_images import light_images, texel_lights
from lightpaint.basis.lights import Lights
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.expected_lights import ExpectedLights
from lightpaint.lighting.loss.weight_penalty import pull_to_colors, pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations

#: Strengths of the pulls to an even image, to its current colours, and to the current image.
SMOOTHNESS, COLOR, STAYING = 1e-4, 1e-3, 1e-3
#: Strength of the pull to the current colours where lights keep theirs (`colors` is `gentle`), and
#: the painting asks for no others.
GENTLE_COLOR = 1e-2
#: Strength of the pulls at texels that are split again, relative to those at a level above: as much
#: light in a ninth of the area is nine times as bright, and its square costs nine times as much.
FINER_SHARE = 1 / 9
#: Share in the picture, relative to its share of the image, below which a texel counts as
#: unseen: it stays as it is, however bright its neighbours get.
SEEN_SHARE = 1e-3


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
    it is E times the mean of s |∇f|² + COLOR |f − Y(f) c|² + STAYING (f − f₀)² over the image, on
    which lengths are such that its area is 4π; s is SMOOTHNESS times that of the domain. Where the
    painting asks for other colours, c is the chroma of these.
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
    staying = pull_to_current(STAYING * shares, current)
    if fit.colors != "gentle":
        return even + staying + pull_to_colors(COLOR * shares, current, texel_lights(lights))
    expected = expected or ExpectedLights.unchanged(current)
    color = (GENTLE_COLOR + expected.clarity * (COLOR - GENTLE_COLOR))[:, None]
    colors = pull_to_colors(color * shares, expected.emission, texel_lights(lights))
    return even + staying + colors
