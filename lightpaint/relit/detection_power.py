"""The power of a verification: the probability that it detects an error in each light.

Agreement of prediction and render means little for a light whose contribution drowns in their
noise. So this module computes the probability that the render would have detected a small error in
the light.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import luminance
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.light_tests import LightTests, light_tests
from lightpaint.relit.verification import (
    LIMIT,
    Verification,
    block_sums,
    brightness_weights,
    limit_of_tests,
    noise_of,
)

#: Relative error of a light that a verification should detect.
ERROR = 0.05

NORMAL = NormalDist()


@dataclass(frozen=True)
class LightShares:
    """The contributions of the lit lights to a prediction, summed over blocks.

    names: names of m lights. sums: (m, 3), over all pixels. blocks, noise: (m, rows, columns, 3),
    over blocks, of the contribution and of its half difference.
    """

    names: tuple[str, ...]
    sums: Doubles
    blocks: Floats
    noise: Floats

    @classmethod
    def of(cls, basis: Basis, lighting: Lighting) -> "LightShares":
        """Return the shares of the lights of `basis` that `lighting` adjusts and does not switch
        off.
        """
        adjustable_lights = [x for x in lighting.lights if not x.is_fixed and any(x.weight)]
        names = tuple(x.name for x in adjustable_lights)
        return cls.of_pictures(
            names,
            (
                Estimate(basis.planes.plane(k) * weight, basis.noise.plane(k) * weight)
                for k, weight in (
                    (basis.names.index(x.name), np.array(x.weight, np.float32))
                    for x in adjustable_lights
                )
            ),
        )

    @classmethod
    def of_pictures(cls, names: Sequence[str], pictures: Iterable[Estimate]) -> "LightShares":
        """Return the shares from the contribution of each light, with one picture in memory at a
        time.
        """
        sums, blocks, noise = [], [], []
        for picture in pictures:
            sums.append(picture.image.sum(axis=(0, 1), dtype=np.float64))
            blocks.append(block_sums(picture.image).astype(np.float32))
            noise.append(block_sums(picture.half_difference).astype(np.float32))
        if not sums:
            return cls((), np.zeros((0, 3)), *np.zeros((2, 0, 1, 1, 3), np.float32))
        return cls(tuple(names), np.array(sums), np.array(blocks), np.array(noise))

    def luminance(self) -> dict[str, float]:
        """Return the share of each light in the luminance of all these lights."""
        values = np.maximum(luminance(self.sums), 0) if self.names else np.zeros(0)
        return dict(zip(self.names, (values / max(values.sum(), 1e-300)).tolist(), strict=True))


def with_light_tests(
    verification: Verification, predicted: Estimate, lights: LightShares
) -> Verification:
    """Return `verification` with a test for each lit light, and its power for an error of ERROR.

    predicted: the prediction that was verified.
    """
    factor = whole_factor(verification.verified.size, predicted.size) or 1
    verified = verification.verified.reduced(factor)
    tests = light_tests(predicted, verified, lights.blocks, lights.noise)
    power = detection_power(predicted, verified, lights, tests, limit=verification.limit)
    z = dict(zip(lights.names, tests.z.tolist(), strict=True))
    return replace(verification, z_lights=z, power=power)


def detection_power(
    predicted: Estimate,
    verified: Estimate,
    lights: LightShares,
    tests: LightTests,
    *,
    limit: float = LIMIT,
    error: float = ERROR,
) -> dict[str, float]:
    """Return, for each light, the probability that a relative error in it is detected at `limit`.

    It is that of the most sensitive test: the light's own, the sum of the picture, or the pattern
    of blocks; so all three together have at least this power. For the sum, the most sensitive
    channel counts, since all channels of a path share its noise. With an error d, a block's product
    of halves has the mean d² and, besides the variance 4 S² of pure noise, 4 S d², where S is the
    variance of the block's difference. The light's own noise is subtracted from d².

    predicted, verified: as in `compare`, of equal size. tests: tests of the same pair.
    """
    squares, magnitude = noise_of(predicted, verified)
    deviation = np.sqrt(squares.sum(axis=(0, 1)))
    blocks, weight = block_sums(squares), brightness_weights(magnitude)
    spread = float(np.square(weight * 2 * blocks.sum(axis=-1)).sum())
    mean_shifts = tests.mean(error)
    limits = tests.limits(limit_of_tests(max(len(lights.names), 1), once=limit))
    power_of = {}
    for k, name in enumerate(lights.names):
        by_light = _two_sided(float(mean_shifts[k]), float(limits[k]))
        by_sum = _two_sided(float(np.max(np.abs(error * lights.sums[k]) / deviation)), limit)
        blocks_and_noise = (lights.blocks[k].astype(np.float64), lights.noise[k].astype(np.float64))
        power: Doubles = error**2 * (
            np.square(blocks_and_noise[0]) - np.square(blocks_and_noise[1])
        )
        mean = max(float((weight[..., None] * power).sum()), 0.0)
        variance = max(float((np.square(weight)[..., None] * 4 * blocks * power).sum()), 0.0)
        by_pattern = NORMAL.cdf((mean - limit * spread**0.5) / (spread + variance) ** 0.5)
        power_of[name] = max(by_light, by_sum, by_pattern)
    return power_of


def _two_sided(shift: float, limit: float) -> float:
    """Return the probability that a normal variable with mean `shift` lies beyond ±`limit`."""
    return NORMAL.cdf(shift - limit) + NORMAL.cdf(-shift - limit)
