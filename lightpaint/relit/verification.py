"""Compares a prediction with an independent render, relative to the noise of both.

The predicted image Σ w_i Φ_i and the render of the relit scene estimate the same picture, so their
difference in units of the noise (z) tells whether the prediction is right.

The effect of an error in a light is known: it is proportional to the light's own picture. So the
difference of prediction and render is summed with the weights that bring out this picture best
against the noise, block by block and taking account of correlations between channels (a matched
filter). It detects an error of 5 % with a fraction of the samples that the sum of the picture
needs.

Agreement of prediction and render means little for a light whose contribution drowns in their
noise. So this module also computes the probability that the render would have detected a small
error in the light.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.colour import choose_exposure, delta_e, luminance
from lightpaint.display_text import Shown
from lightpaint.errors import SizeError
from lightpaint.images import Estimate, box_mean, whole_factor
from lightpaint.images import block_sums as whole_block_sums
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting

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

#: Relative error of a light that a verification should detect.
ERROR = 0.05

NORMAL = NormalDist()

#: Radius in blocks over which the noise is averaged before it weights the blocks.
SMOOTH = 1

#: Minimum variance of every mix of channels in a block, as a share of its mean variance, when
#: blocks are weighted: with few pixels, existing colour noise may not show.
FLOOR = 0.01

#: Variance below which it counts as zero.
TINY = 1e-38


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
            Blocks that both show alike and without noise are left out.
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

    The extreme of many lights is larger than the difference of one, so their differences are scaled
    down.
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

    # A block's difference, divided by the standard error estimated from its own pixels. What is the
    # same in both without noise, like a screen in view, says nothing of their noise.
    block_z = block_sums(difference) / np.sqrt(block_sums(squares))
    is_exact = block_sums(squares) < 2 * block_sums(np.square(PRECISION * magnitude))
    noisy_z = block_z[~is_exact | (np.abs(block_z) > 1)]
    z_mean, z_pattern = differences(predicted, verified)

    scale = 2.0 ** choose_exposure(verified.image)
    delta = delta_e(predicted.image * scale, verified.image * scale)
    return Verification(
        verified=verified,
        z=z.astype(np.float32),
        z_rms=float(np.sqrt(np.square(noisy_z).mean())) if noisy_z.size else 0.0,
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


@dataclass(frozen=True)
class LightTests:
    """The results of the tests.

    z: (n,), the difference along the picture of each light, in standard errors. If the prediction
    is true, it has the mean 0 and a standard normal distribution, or a narrower one in pictures
    with few blocks. sensitivity, overlap: (n,), the effect of a relative error of the light; see
    `mean`. freedom: (n,), degrees of freedom of the variance.
    """

    z: Doubles
    sensitivity: Doubles
    overlap: Doubles
    freedom: Doubles

    def mean(self, error: float) -> Doubles:
        """Return the mean of the quotient t behind z, for a relative error of each light."""
        inflation = 1 + np.clip(error**2 * self.overlap, 0, 1)
        return np.asarray(np.maximum(error * self.sensitivity, 0) / np.sqrt(inflation))

    def limits(self, limit: float) -> Doubles:
        """Return the quotient t at which the z of each light reaches `limit`."""
        squares = np.square(limit * (8 * self.freedom + 3) / (8 * self.freedom + 1))
        with np.errstate(over="ignore"):
            return np.sqrt(self.freedom * np.expm1(squares / self.freedom))


def light_tests(
    predicted: Estimate, verified: Estimate, blocks: Floats, half_differences: Floats
) -> LightTests:
    """Test for an error in each of n lights.

    Let D_A and D_B be the differences between the two images' first and second halves, summed over
    blocks. Their noise is independent. The weights of a block, a_A = S_A⁻¹ L_A, are computed from
    the first halves alone: C_A is the scatter of the pixels of D_A, S_A includes the scatter of
    neighbouring blocks, and L_A is the picture of the light. They are applied to D_B, and
    the weights of the second halves to D_A, which gives x = a_A·D_B and y = a_B·D_A:

      t = Σ (x + y) / √(V + W),   V = Σ (a_A·C_B a_A + a_B·C_A a_B),   W = 2 Σ x y in [0, V]

    So weights and noise are independent, and for noise of any distribution Σ (x + y) has mean 0 and
    variance V. W accounts for the correlation of x and y if the same few bright paths of a light
    are in its picture and in the difference. If few pixels contribute to V, t has a Student
    distribution with degrees of freedom according to their number; z is the equally rare normal
    value (Wallace 1959).

    predicted, verified: as in `compare`, of equal size. blocks, half_differences: (n, rows,
    columns, 3), of the picture of each light and of its half difference, as in `LightShares`.
    """
    difference = predicted.image.astype(np.float64) - verified.image
    half = predicted.half_difference.astype(np.float64) - verified.half_difference
    round_off = np.square(PRECISION * (np.abs(predicted.image) + np.abs(verified.image)))
    floor = block_sums(round_off.mean(axis=-1) + TINY)
    floor = floor[..., None, None] * np.eye(3)
    first, second = difference + half, difference - half
    scatter = [_scatter(half_sums) + floor for half_sums in (first, second)]
    counts = [_pixels_that_count(half_sums) for half_sums in (first, second)]
    # Means over neighbours round what is tiny to zero: black blocks need the floor again.
    inverses = [np.linalg.inv(_smooth(x) + floor) for x in scatter]
    sums = block_sums(first), block_sums(second)
    tests = []
    for light_blocks, its_half in zip(blocks.astype(np.float64), half_differences, strict=True):
        half_pair = light_blocks + its_half, light_blocks - its_half
        # Weights from each half, and quantities of the other half to which they are applied.
        a = [_times(x, light) for x, light in zip(inverses, half_pair, strict=True)]
        x, y = _dot(a[0], sums[1]), _dot(a[1], sums[0])
        x_signal, y_signal = _dot(a[0], half_pair[1]), _dot(a[1], half_pair[0])
        x_variance = _dot(a[0], _times(scatter[1], a[0]))
        y_variance = _dot(a[1], _times(scatter[0], a[1]))
        variance = max(float((x_variance + y_variance).sum()), TINY)
        uneven = np.square(x_variance) / counts[1] + np.square(y_variance) / counts[0]
        freedom = max(3 * variance**2 / max(float(uneven.sum()), TINY), 1.0)
        common = min(max(2 * float((x * y).sum()), 0.0), variance)
        t = float((x + y).sum()) / (variance + common) ** 0.5
        rare = freedom * np.log1p(t**2 / freedom)
        z = np.copysign(np.sqrt(rare), t) * (8 * freedom + 1) / (8 * freedom + 3)
        sensitivity = float((x_signal + y_signal).sum()) / variance**0.5
        overlap = 2 * float((x_signal * y_signal).sum()) / variance
        tests.append((z, sensitivity, overlap, freedom))
    return LightTests(*np.reshape(np.array(tests, np.float64), (-1, 4)).T)


def _pixels_that_count(values: Floats) -> Doubles:
    """Return the effective number of pixels in the scatter of each block: (Σ x²)² / Σ x⁴, at least
    1.
    """
    squares = np.square(values).sum(axis=-1)
    fourth = block_sums(np.square(squares))
    return np.maximum(np.square(block_sums(squares)) / np.maximum(fourth, TINY), 1)


def _scatter(values: Floats) -> Doubles:
    """Return Σ x xᵀ over the pixels x of each block, (rows, columns, 3, 3)."""
    pairs = [block_sums(values[..., i] * values[..., j]) for i, j in ((0, 0), (0, 1), (0, 2))]
    pairs += [block_sums(values[..., i] * values[..., j]) for i, j in ((1, 1), (1, 2), (2, 2))]
    return np.stack([pairs[k] for k in (0, 1, 2, 1, 3, 4, 2, 4, 5)], axis=-1).reshape(
        *pairs[0].shape, 3, 3
    )


def _smooth(scatter: Floats) -> Doubles:
    """Return means over neighbouring blocks, with a minimum variance in every mix of channels."""
    mean = np.asarray(box_mean(scatter, SMOOTH), np.float64)
    trace = np.trace(mean, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(mean + FLOOR * trace / 3 * np.eye(3))


def _times(matrices: Floats, vectors: Floats) -> Doubles:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _dot(a: Floats, b: Floats) -> Doubles:
    return np.asarray((a * b).sum(axis=-1))


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

    It is the probability of the most sensitive test: the light's own, the sum of the picture, or
    the pattern of blocks; so all three together have at least this power. For the sum, the most
    sensitive channel counts, since all channels of a path share its noise. With an error d, a
    block's product of halves has the mean d² and, besides the variance 4 S² of pure noise, 4 S d²,
    where S is the variance of the block's difference. The light's own noise is subtracted from d².

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
        of_blocks, of_noise = (
            np.square(x[k], dtype=np.float64) for x in (lights.blocks, lights.noise)
        )
        power = error**2 * (of_blocks - of_noise)
        mean = max(float((weight[..., None] * power).sum()), 0.0)
        variance = max(float((np.square(weight)[..., None] * 4 * blocks * power).sum()), 0.0)
        by_pattern = NORMAL.cdf((mean - limit * spread**0.5) / (spread + variance) ** 0.5)
        power_of[name] = max(by_light, by_sum, by_pattern)
    return power_of


def _two_sided(shift: float, limit: float) -> float:
    """Return the probability that a normal variable with mean `shift` lies beyond ±`limit`."""
    return NORMAL.cdf(shift - limit) + NORMAL.cdf(-shift - limit)
