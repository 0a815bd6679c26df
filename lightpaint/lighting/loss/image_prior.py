"""A quadratic penalty for images in texels: what they should be where the painting does not tell.

A painting hardly tells neighbouring texels apart. Without an expectation the best image is a
patchwork of saturated colours, whose light adds up to what was painted. So an image should be
smooth, keep the colours that it has, and stay as it is where nothing is seen of it. All three are
measured over solid angle, in units of the picture that an even sky makes, so that their strengths
suit images of any size (docs/image_lights.md has the measurements).
"""

from collections.abc import Iterator

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.basis.light_images import light_images, texel_lights
from lightpaint.basis.lights import Lights
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.weight_penalty import pull_to_colors, pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.scene.lights.texels import solid_angles

#: Strengths of the pulls to an even image, to its current colours, and to the current image.
SMOOTHNESS, COLOR, STAYING = 1e-4, 1e-3, 1e-3
#: Strength of the pull to the current colours where lights keep theirs (`colors` is `gentle`).
GENTLE_COLOR = 1e-2
#: Share in the picture, relative to its share of all directions, below which a texel counts as
#: unseen: it stays as it is, however bright its neighbours get.
SEEN_SHARE = 1e-3


def image_prior(
    lights: Lights, power: Doubles, fit: Fit, painted_share: float
) -> NormalEquations | None:
    """Return the penalty for all images in texels among `lights`; None if there are none.

    power: (n, 3), ‖Φᵢ‖² of the lights' pictures. painted_share: see `weight_pull`.

    For radiances f of an image, energy E of the picture of an even white sky and current chroma c,
    it is E/4π ∫ (SMOOTHNESS |∇f|² + COLOR |f − Y(f) c|² + STAYING (f − f₀)²) dω.
    """
    images, strength = light_images(lights), fit.brightness * painted_share
    if not images or strength <= 0:
        return None
    n = len(lights)
    M, shares = np.zeros((3, n, n)), np.zeros((n, 3))
    for image in images:
        at, found = image.places, image.places >= 0
        amplitudes, angles = np.sqrt(power[image.lights]), solid_angles(image.size)[found]
        # Pictures of texels overlap, so the energy of their sum is about this.
        energy = strength * amplitudes.sum(axis=0) ** 2 / (4 * np.pi)
        shares[image.lights] = energy * angles[:, None]
        seen_share = amplitudes.sum(axis=1) / amplitudes.sum() * (4 * np.pi) / angles
        seen = np.where(np.isin(at, image.lights[seen_share > SEEN_SHARE]), at, -1)
        for first, second, stiffness in _neighbours(seen):
            for i, j, sign in ((first, first, 1), (second, second, 1), (first, second, -1)):
                M[:, i, j] += sign * SMOOTHNESS * stiffness * energy
            M[:, second, first] = M[:, first, second]
    even = NormalEquations(M, np.zeros((3, n)), np.zeros(3))
    current = lights.current_weights
    staying = pull_to_current(STAYING * shares, current)
    color = GENTLE_COLOR if fit.colors == "gentle" else COLOR
    return even + staying + pull_to_colors(color * shares, current, texel_lights(lights))


def _neighbours(at: Indices) -> Iterator[tuple[int, int, float]]:
    """Yield pairs of lights that are neighbours in an image, and how stiffly they are joined.

    The sum of stiffness times squared difference is the integral of |∇f|² over the sphere.
    """
    rows, columns = at.shape
    height, width = np.pi / (rows - 1), 2 * np.pi / columns
    for y in range(rows):
        # The texels at a pole are half as high, and a quarter of a texel away from it.
        is_pole = y in (0, rows - 1)
        sine = np.sin(height / 4) if is_pole else np.sin(height * y)
        across = height * (0.5 if is_pole else 1.0) / (sine * width)
        down = np.sin(height * (y + 0.5)) * width / height
        for x in range(columns):
            pairs = [(at[y, x], at[y, (x + 1) % columns], across)]
            pairs += [(at[y, x], at[y + 1, x], down)] if y + 1 < rows else []
            yield from ((a, b, float(k)) for a, b, k in pairs if a >= 0 and b >= 0 and a != b)
