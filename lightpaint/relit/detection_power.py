"""Power of a verification: how likely it was to see an error in each light.

That prediction and render agree says little of a light whose part of the picture drowns in their
noise. So it is computed how likely the render was to find it, had the light been a little off.
"""

from collections.abc import Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.verification import (
    LIMIT,
    Verification,
    block_sums,
    brightness_weights,
    noise_of,
)

#: Relative error of a light that a render is asked to find.
ERROR = 0.05

NORMAL = NormalDist()


def with_power(
    verification: Verification, predicted: Estimate, basis: Basis, lighting: Lighting
) -> Verification:
    """Return `verification` with its power for an error of ERROR in each light that shines.

    predicted: what it was held against, the sum of `basis` under `lighting`.
    """
    factor = whole_factor(verification.verified.size, predicted.size) or 1
    verified = verification.verified.reduced(factor)
    names = [x.name for x in lighting.lights if not x.is_fixed and any(x.weight)]
    places = [basis.names.index(name) for name in names]
    parts = [np.array(lighting[name].weight, np.float32) for name in names]
    found = detection_power(
        predicted,
        verified,
        [
            Estimate(basis.planes.plane(k) * weight, basis.noise.plane(k) * weight)
            for k, weight in zip(places, parts, strict=True)
        ],
    )
    return replace(verification, power=dict(zip(names, found, strict=True)))


def detection_power(
    predicted: Estimate, verified: Estimate, parts: Sequence[Estimate], *, error: float = ERROR
) -> list[float]:
    """Return the probability, for each part, that a relative error in it exceeds LIMIT.

    Both tests of a verification count: the sum of the picture, and the pattern of blocks. Of the
    sums the channel counts that shows most, since one path carries the noise of all. With the error
    d, a block's product of halves has the mean d² and, beside the variance 4 S² of noise alone,
    4 S d², where S is the variance of the block's difference.

    predicted, verified: as of `compare`, of one size. parts: what each light adds to `predicted`,
    with its noise, which is taken out of d².
    """
    squares, magnitude = noise_of(predicted, verified)
    deviation = np.sqrt(squares.sum(axis=(0, 1)))
    blocks, weight = block_sums(squares), brightness_weights(magnitude)
    spread = float(np.square(weight * 2 * blocks.sum(axis=-1)).sum())
    found = []
    for part in parts:
        image, half = (x.astype(np.float64) for x in (part.image, part.half_difference))
        off = float(np.max(np.abs(error * image.sum(axis=(0, 1))) / deviation))
        by_sum = NORMAL.cdf(off - LIMIT) + NORMAL.cdf(-off - LIMIT)
        power: Doubles = error**2 * (np.square(block_sums(image)) - np.square(block_sums(half)))
        mean = max(float((weight[..., None] * power).sum()), 0.0)
        more = max(float((np.square(weight)[..., None] * 4 * blocks * power).sum()), 0.0)
        by_pattern = NORMAL.cdf((mean - LIMIT * spread**0.5) / (spread + more) ** 0.5)
        found.append(1 - (1 - by_sum) * (1 - by_pattern))
    return found
