"""Compares a prediction with an independent render, relative to the noise of both.

The predicted image Σ w_i Φ_i and the render of the relit scene estimate the same picture, so their
difference in units of the noise (z) tells whether the prediction is right.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import choose_exposure, delta_e, luminance
from lightpaint.display_text import Shown
from lightpaint.errors import SizeError
from lightpaint.images import Estimate, box_mean, whole_factor
from lightpaint.images import block_sums as whole_block_sums
from lightpaint.keywords import keywords

#: Side of the blocks of pixels over which differences are summed before the tests.
BLOCK = 8
#: Standard errors beyond which a difference counts as real: so many that correct renders pass
#: thousands of times in a row.
LIMIT = 5.0

#: Power below which an error would probably not have been detected.
LOW_POWER = 0.5

#: Share of the render's values around a pixel that must not be exactly 0 for their spread to tell
#: how noisy the pixel is: where light arrives rarely, most halves miss it, and miss it alike.
LIT_SHARE = 0.5

#: Hits of light that a render must expect around a pixel for their absence to be an error.
ENOUGH_HITS = 16

#: Pixels on either side over which noise is pooled.
POOL_RADIUS = 2

#: Relative round-off of float32 sums; smaller differences are meaningless.
PRECISION = 1e-5


@keywords()
@dataclass(frozen=True)
class Verification(Shown):
    """The difference between prediction and verification.

    Attributes:
        verified: The independent render. If each pixel of the prediction is a block of its pixels,
            everything else refers to its block means, at the size (h, w) of the prediction.
        z: (h, w, 3), difference in each pixel in standard errors, with noise pooled over
            neighbours.
        z_rms: Root mean square of the differences of 8x8 blocks in their own standard errors. About
            1 if there is only noise; slightly more if the noise consists of rare bright samples.
        z_mean: (3,), difference of the sums over the whole image, in standard errors.
        z_pattern: Correlation between the differences of the two halves, block by block, in
            standard errors: 0 on average for noise, larger for a local error.
        rmse: Root mean square difference of the pixels, in radiance.
        noise_rmse: The value of `rmse` expected from noise alone.
        delta_e_mean: Mean CIEDE2000, at an exposure metered on the render.
        delta_e_95: 95th percentile of the same.
        z_lights: For each lit light, the difference along its picture in standard errors;
            empty if not computed.
        power: For each lit light, the probability that this render would have disagreed with an
            error of 5 % in it; None if not computed.
        is_measured: (h, w), False where the render is exactly 0 in most halves of the neighbours,
            and the noise of the prediction says that it may well be: too few samples found light
            to tell how noisy they are, so `z` says nothing there. None if not computed.
        limit: Standard errors beyond which a difference counts as real; larger if the render was
            examined several times, so that correct renders pass as often.
        spp: Samples per pixel that were rendered; None if unknown.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> lighting = lp.read_lighting("lighting.json")
        >>> relit = lp.relight(scene, lighting, "relit.xml")
        >>> lp.verify(lp.combine(basis, lighting), relit, spp=4)
        Verification(agrees, ...)
    """

    verified: Estimate
    z: Floats
    z_rms: float
    z_mean: tuple[float, float, float]
    z_pattern: float
    rmse: float
    noise_rmse: float
    delta_e_mean: float
    delta_e_95: float
    z_lights: Mapping[str, float] = field(default_factory=dict)
    power: Mapping[str, float] | None = None
    is_measured: Bools | None = None
    limit: float = LIMIT
    spp: int | None = None

    def __repr__(self) -> str:
        (height, width), word = self.verified.size, "agrees" if self.agrees else "DISAGREES"
        return (
            f"Verification({word}, {self.difference:.1f} standard errors apart, "
            f"limit {self.limit:.3g}; ΔE {self.delta_e_mean:.2f}; {width}x{height})"
        )

    @property
    def difference(self) -> float:
        """The largest of the differences in standard errors, to be compared with `limit`."""
        return largest_difference(self.z_mean, self.z_pattern, self.z_lights, limit=self.limit)

    @property
    def agrees(self) -> bool:
        """True if noise alone can explain the difference."""
        return self.difference <= self.limit

    @property
    def unseen(self) -> tuple[str, ...]:
        """Lights in which an error of 5 % would probably not have been detected, least likely
        first.
        """
        power = self.power or {}
        return tuple(sorted((x for x in power if power[x] < LOW_POWER), key=power.__getitem__))

    @property
    def is_blind(self) -> bool:
        """True if it would probably have detected an error of 5 % in no light."""
        return bool(self.power) and len(self.unseen) == len(self.power or {})


def limit_of_tests(count: int, *, once: float = LIMIT) -> float:
    """Return the limit, in standard errors, at which `count` tests pass correct renders as often as
    one test does at `once`.

    By Bonferroni's inequality the probability of a false alarm is at most the sum over the tests,
    however they are correlated and whichever of them are made.
    """
    return -NormalDist().inv_cdf(NormalDist().cdf(-once) / count)


def largest_difference(
    z_mean: Iterable[float], z_pattern: float, z_lights: Mapping[str, float], *, limit: float
) -> float:
    """Return the largest of the differences in standard errors, to be compared with `limit`.

    The extreme of many lights is larger than that of one, so their differences are scaled down.
    """
    lights = max(map(abs, z_lights.values()), default=0.0)
    lights *= limit / limit_of_tests(max(len(z_lights), 1), once=limit)
    return max(*map(abs, z_mean), z_pattern, lights)


def differences(
    predicted: Estimate, verified: Estimate
) -> tuple[tuple[float, float, float], float]:
    """Return `z_mean` and `z_pattern` of two estimates of equal size."""
    squares, magnitude = noise_of(predicted, verified)
    difference = predicted.image.astype(np.float64) - verified.image
    red, green, blue = difference.sum(axis=(0, 1)) / np.sqrt(squares.sum(axis=(0, 1)))
    pattern = _pattern(predicted, verified, squares, magnitude)
    return (float(red), float(green), float(blue)), pattern


def compare(predicted: Estimate, verified: Estimate) -> Verification:
    """Test the difference of two independent estimates of the same picture.

    verified: of the size of `predicted`, or with a block of pixels for each of its pixels. Raises
    SizeError otherwise.
    """
    factor = whole_factor(verified.size, predicted.size)
    if factor is None:
        raise SizeError(f"sizes of {predicted.size} and {verified.size} cannot be compared")
    judged = _judge(predicted, verified.reduced(factor))
    return replace(judged, verified=verified)


def _judge(predicted: Estimate, verified: Estimate) -> Verification:
    difference = predicted.image.astype(np.float64) - verified.image
    squares, magnitude = noise_of(predicted, verified)

    pooled = sum(estimate.variance(radius=POOL_RADIUS) for estimate in (predicted, verified))
    pooled += np.square(PRECISION * magnitude)
    z = difference / np.sqrt(pooled + np.finfo(np.float32).tiny)

    # A block's difference, divided by the standard error estimated from its own pixels.
    block_z = block_sums(difference) / np.sqrt(block_sums(squares))
    z_mean, z_pattern = differences(predicted, verified)

    scale = 2.0 ** choose_exposure(verified.image)
    delta = delta_e(predicted.image * scale, verified.image * scale)
    return Verification(
        verified=verified,
        z=z.astype(np.float32),
        z_rms=float(np.sqrt(np.square(block_z).mean())),
        z_mean=z_mean,
        z_pattern=z_pattern,
        rmse=float(np.sqrt(np.square(difference).mean())),
        noise_rmse=float(np.sqrt(squares.mean())),
        delta_e_mean=float(delta.mean()),
        delta_e_95=float(np.percentile(delta, 95)),
        is_measured=_is_measured(predicted, verified),
    )


def _is_measured(predicted: Estimate, verified: Estimate) -> Bools:
    """Return `Verification.is_measured`, (h, w).

    A mean m with the variance v is as noisy as m²/v equal hits are. So the noise of the prediction
    says how many hits the render has to expect around a pixel, relative to its noise elsewhere:
    if many, then finding none is an error and no matter of chance.
    """
    halves = (verified.image + verified.half_difference, verified.image - verified.half_difference)
    # A half is a difference of float32, which round-off keeps from being exactly 0.
    zero = PRECISION * np.abs(verified.image)
    lit_halves = np.mean([(np.abs(half) > zero).any(axis=-1) for half in halves], axis=0)
    is_lit = box_mean(lit_halves, POOL_RADIUS) >= LIT_SHARE
    is_dark = np.asarray(~(predicted.image.any(axis=-1) | verified.image.any(axis=-1)), np.float64)
    of_prediction, of_render = (
        luminance(estimate.variance(radius=POOL_RADIUS)) for estimate in (predicted, verified)
    )
    is_noisy = is_lit & (of_prediction > 0) & (of_render > 0)
    noise_ratio = (
        float(np.median(of_prediction[is_noisy] / of_render[is_noisy])) if is_noisy.any() else 1.0
    )
    mean = box_mean(luminance(predicted.image), POOL_RADIUS)
    hits = (2 * POOL_RADIUS + 1) ** 2 * noise_ratio * np.square(mean)
    is_expected = hits >= ENOUGH_HITS * of_prediction
    is_black = box_mean(is_dark, POOL_RADIUS) == 1
    return np.asarray(is_lit | (is_expected & (mean > 0)) | is_black)


def noise_of(predicted: Estimate, verified: Estimate) -> tuple[Doubles, Doubles]:
    """Return the variance of the difference, and the summed brightness of both, (h, w, 3) each."""
    squares = np.square(predicted.half_difference, dtype=np.float64)
    squares += np.square(verified.half_difference, dtype=np.float64)
    # Round-off counts as noise, too; it avoids 0/0 where no light falls.
    magnitude = np.abs(predicted.image).astype(np.float64) + np.abs(verified.image)
    squares += np.square(PRECISION * magnitude) + np.finfo(np.float32).tiny
    return squares, magnitude


def brightness_weights(magnitude: Floats) -> Doubles:
    """Return the weight of each block in the pattern, (rows, columns), which decreases with
    brightness.
    """
    brightness = block_sums(magnitude.sum(axis=-1, dtype=np.float64))
    typical = brightness.mean()
    return np.square(typical / (brightness + typical)) if typical > 0 else np.ones_like(brightness)


def _pattern(predicted: Estimate, verified: Estimate, squares: Floats, magnitude: Floats) -> float:
    """Return Σ_blocks d_A d_B in standard errors, where d_A and d_B are the differences of the
    halves.

    The halves A and B of both images are independent, so with noise of any distribution the sum is
    0 on average, and a true difference adds its square. Blocks are weighted relative to their
    brightness. squares: variance per pixel. magnitude: brightness.
    """
    difference = predicted.image.astype(np.float64) - verified.image
    half = predicted.half_difference.astype(np.float64) - verified.half_difference
    weight = brightness_weights(magnitude)
    products = (block_sums(difference + half) * block_sums(difference - half)).sum(axis=-1)
    # A half has twice the variance of the mean, and the channels may be fully correlated.
    spread = 2 * block_sums(squares).sum(axis=-1)
    return float((weight * products).sum() / np.sqrt(np.square(weight * spread).sum()))


def block_sums(image: Floats) -> Doubles:
    """Return sums over blocks of BLOCK × BLOCK pixels in float64; remainders join the last
    blocks.
    """
    sums = whole_block_sums(image, BLOCK)
    height, width = image.shape[:2]
    if height % BLOCK and height > BLOCK:
        sums[-2] += sums[-1]
        sums = sums[:-1]
    if width % BLOCK and width > BLOCK:
        sums[:, -2] += sums[:, -1]
        sums = sums[:, :-1]
    return sums
