"""The pictures of comparison and report: the painting, the error, and its place.

All are (h, w, 3) in display values [0, 1]. Pixels that do not count are shown as the
current look, grey and dim, so that they cannot be taken for paint; in the map of importance they
are hatched, too.

The current look that a picture is laid over decides its size: where it has one pixel for a block of
pixels of the film, so has the picture.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint import images
from lightpaint.arrays import Doubles, Floats, Indices, largest
from lightpaint.basis import Basis, denoise_current_look, denoise_mix, denoise_mixes, meter_exposure
from lightpaint.colour import ViewTransform, luminance
from lightpaint.lighting import Solution
from lightpaint.report.basis_memo import cached_clean_planes, look_reduction
from lightpaint.target import Target

#: Conversion of a band of display values into its final form.
Finish = Callable[[Floats], npt.NDArray[Any]]

#: False colours of a signed quantity from −1 to +1, in display values. Their lightness
#: rises all the way, so that the sign also shows without colour.
DIVERGING = np.array(
    [
        (0.02, 0.12, 0.40),
        (0.13, 0.33, 0.63),
        (0.45, 0.45, 0.45),
        (0.90, 0.60, 0.22),
        (1.00, 0.89, 0.60),
    ]
)

#: A residual below this part of display white cannot be seen, so no scale is finer.
FINEST_SCALE = 0.01

#: Share of the largest importance from which on a pixel is shown as it was painted.
PAINT_SHOWN = 0.1

#: Pixels on either side over which a residual may be averaged, and the part of its scale that
#: noise may have then.
RADII, NOISE_SHARE = (0, 1, 2, 3, 4, 6, 8), 0.1


def report_transform(target: Target, basis: Basis, predicted: Floats) -> ViewTransform:
    """Return the one transform for all pictures of a result.

    That is the transform of the painting or, without one, sRGB at an exposure metered on the
    prediction, whose emitters in view the basis knows.
    """
    return target.transform or ViewTransform("srgb", meter_exposure(predicted, basis))


def brighter_than_white(image: Floats, transform: ViewTransform) -> float:
    """Return the share of pixels of a linear picture that exceed what a display can show."""
    return float((largest(image) > transform.white).mean())


def coverage(importance: Floats) -> Floats:
    """Return the share of each pixel to show as painted, (h, w) in [0, 1].

    Importance itself, as alpha; where all of it is below 1, relative to its largest.
    """
    peak = float(importance.max(initial=0))
    return np.clip(importance / min(1.0, peak), 0, 1) if peak > 0 else 0 * importance


def paint_coverage(importance: Floats) -> Floats:
    """Return the share of each pixel to show as painted, (h, w) in [0, 1].

    Paint is shown whole, however little it counts; the fringe of soft paint fades.
    """
    return np.asarray(np.clip(coverage(importance) / PAINT_SHOWN, 0, 1))


def unpainted_look(current: Floats, *, transform: ViewTransform) -> Floats:
    """Return the current look as a background: grey and dim."""
    return np.repeat(_dim_look(current, transform, hatched=False)[..., None], 3, axis=-1)


def _dim_look(current: Floats, transform: ViewTransform, *, hatched: bool) -> Floats:
    """Return the grey of `unpainted_look`, (h, w), with diagonal lines if `hatched`."""
    height, width = current.shape[:2]
    period = max(6, width // 80)

    def dim(look: Floats, y: Indices) -> Floats:
        lines = hatched & ((np.arange(width) + y) % period < max(1, period // 5))
        return np.asarray(0.07 + 0.28 * luminance(transform.encode(look)) + 0.08 * lines)

    return np.asarray(images.by_bands(dim, current, np.arange(height)[:, None]))


def over_unpainted(
    encode: Callable[[Floats], Floats],
    picture: Floats,
    share: Floats,
    current: Floats,
    *,
    transform: ViewTransform,
    hatched: bool = False,
    finish: Finish = np.asarray,
) -> npt.NDArray[Any]:
    """Return a picture, laid over `unpainted_look` by its share of each pixel, (h, w).

    encode: makes display values of a band of `picture`, (h, w, …). finish: converts each band,
    for example by `to_8_bit`. Picture and share may be larger than the look, by whole blocks.
    """
    picture, share = _reduced(picture, share, current.shape[:2])

    def lay(band: Floats, share: Floats, dim: Floats) -> npt.NDArray[Any]:
        share = share[..., None]
        return finish(np.asarray(share * encode(band) + (1 - share) * dim[..., None]))

    rest = _dim_look(current, transform, hatched=hatched)
    return np.asarray(images.by_bands(lay, picture, share, rest))


def _reduced(picture: Floats, share: Floats, size: images.Size) -> tuple[Floats, Floats]:
    """Return a picture, (h, w, …), and its share of each pixel, (h, w), as means over the blocks
    that are pixels of a picture of `size`.

    A pixel of the picture counts by its share. A picture that has that size is left as it is.
    """
    factor = images.whole_factor(share.shape, size) or 1
    if factor == 1:
        return picture, share
    small = images.block_mean(share, factor)
    if picture.shape[:2] != share.shape:
        return picture, small
    by_share = (..., *(None,) * (picture.ndim - 2))
    total = images.block_mean(picture * share[by_share], factor)
    nothing = np.zeros_like(total)
    return np.divide(total, small[by_share], out=nothing, where=small[by_share] > 0), small


def target_picture(
    target: Target,
    current: Floats,
    *,
    transform: ViewTransform,
    finish: Finish = np.asarray,
) -> npt.NDArray[Any]:
    """Return the painting, as it was painted.

    What is not painted asks for the current look, if the painting was made over that, and is shown
    so; else it is `unpainted_look`. current: (h, w, 3) linear, the current scene. Painted pixels
    are exactly the display encoding of the target.
    """
    share = paint_coverage(target.importance)
    if not target.over_look:
        options: Any = {"transform": transform, "finish": finish}
        return over_unpainted(transform.encode, target.image, share, current, **options)

    def lay(paint: Floats, share: Floats, look: Floats) -> npt.NDArray[Any]:
        share = share[..., None]
        return finish(share * transform.encode(paint) + (1 - share) * transform.encode(look))

    image, share = _reduced(target.image, share, current.shape[:2])
    return np.asarray(images.by_bands(lay, image, share, current))


def importance_picture(
    importance: Floats,
    current: Floats,
    *,
    transform: ViewTransform,
    finish: Finish = np.asarray,
) -> npt.NDArray[Any]:
    """Return the current look in pale yellow where it counts; dimmed and hatched where not.

    finish: see `over_unpainted`.
    """
    peak = max(1.0, float(importance.max(initial=0)))

    def yellow(look: Floats) -> Floats:
        grey = luminance(transform.encode(look))[..., None]
        return np.asarray((0.35 + 0.65 * grey) * np.array([1.0, 0.93, 0.70]))

    options: Any = {"transform": transform, "hatched": True, "finish": finish}
    return over_unpainted(yellow, current, coverage(importance / peak), current, **options)


@dataclass(frozen=True)
class Residual:
    """The error of the prediction, as a map.

    values: (h, w), luminance of prediction minus goal, in scene units, averaged over
    (2 radius + 1)² pixels. limit: end of its scale, its 99th percentile where it counts, rounded
    up.
    """

    values: Floats
    limit: float
    radius: int

    @property
    def spoken(self) -> str:
        """The text `, averaged over 5x5 pixels`, or "" without averaging."""
        side = 2 * self.radius + 1
        return f", averaged over {side}x{side} pixels" if self.radius else ""


def residual_of(solution: Solution, predicted: Floats, *, transform: ViewTransform) -> Residual:
    """Return the residual of raw data, averaged over as few pixels as its noise allows.

    The average is as wide as it takes for the noise's standard deviation to be a tenth of the
    scale, so that the map shows the error and no grain.
    """
    counts = (solution.importance > 0).astype(np.float64)
    goal = solution.goal(predicted)
    exact = images.by_bands(lambda x, y: luminance(x.astype(np.float64) - y), predicted, goal)
    del goal

    def mean_over(radius: int) -> tuple[Floats, float]:
        if radius == 0:
            values = exact
        else:
            # Only pixels that count, so that nothing bleeds into paint from beside it.
            share = images.box_mean(counts, radius)
            values = images.box_mean(exact * counts, radius) / np.where(share > 0, share, 1)
            values = np.where(counts > 0, values, exact)
        end = float(np.percentile(np.abs(values[counts > 0]), 99))
        return values, round_up(max(end, FINEST_SCALE * 2.0**-transform.stops))

    half = solution.basis.predict(solution.weights).half_difference
    noise = images.by_bands(lambda x: luminance(x.astype(np.float64)), half)
    spread = float(np.sqrt((np.square(noise) * counts).sum() / max(counts.sum(), 1)))
    if spread == 0:
        return Residual(*mean_over(0), 0)
    aim = NOISE_SHARE * mean_over(RADII[len(RADII) // 2])[1]
    sufficient_radii = (radius for radius in RADII if spread <= aim * (2 * radius + 1))
    radius = next(sufficient_radii, RADII[-1])
    return Residual(*mean_over(radius), radius)


def residual_picture(
    residual: Residual,
    solution: Solution,
    current: Floats,
    *,
    transform: ViewTransform,
    finish: Finish = np.asarray,
) -> npt.NDArray[Any]:
    """Return false colours of the residual over its scale, dimmed where it does not count.

    finish: see `over_unpainted`.
    """
    options: Any = {"transform": transform, "finish": finish}
    share = coverage(solution.importance)
    return over_unpainted(
        lambda x: diverging(x / residual.limit), residual.values, share, current, **options
    )


def diverging(values: Floats) -> Floats:
    """Return the false colours, (…, 3), of values from −1 to +1; values beyond get the colours of
    the ends.
    """
    places = np.linspace(-1, 1, len(DIVERGING))
    channels = [np.interp(values, places, DIVERGING[:, c]) for c in range(3)]
    return np.stack(channels, axis=-1)


def round_up(value: float) -> float:
    """Return the next number >= value > 0 of the form 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    for step in (1, 2, 5):
        # Within round-off, 0.2 is not above 2 x 0.1.
        if value <= step * power * (1 + 1e-9):
            return step * power
    return 10 * power


def spoken_view(transform: ViewTransform) -> str:
    """Return `agx, exposure +1.5 stops`, or "" for plain sRGB."""
    name = [] if transform.name == "srgb" else [transform.name]
    return ", ".join(
        [*name, *([f"exposure {transform.stops:+.1f} stops"] if transform.stops else [])]
    )


@dataclass(frozen=True)
class Encoder(ViewTransform):
    """A view transform that encodes each picture once, wherever it is shown.

    encoded: pictures and their display values, by the identity of the picture, which must not
    change.
    """

    encoded: dict[int, tuple[Floats, Floats]] = field(
        default_factory=dict, compare=False, repr=False
    )

    def encode(self, image: Floats) -> Floats:
        """Return the display values of `ViewTransform.encode`, read-only."""
        if image.size >= 3 * images.LARGE_PICTURE:
            # Which would be kept as long as the report is made.
            return np.asarray(images.by_bands(super().encode, image))
        if isinstance(image.base, np.ndarray) and image.base.size > image.size:
            return super().encode(image)  # a band of a large picture
        if id(image) not in self.encoded:
            shown = super().encode(image)
            shown.flags.writeable = False
            self.encoded[id(image)] = image, shown
        return self.encoded[id(image)][1]


@dataclass(frozen=True)
class MixesOfBlocks:
    """Mixes of lights whose pictures are reduced. weights: (n, 3) each. factor: side of the blocks
    of pixels that become one.
    """

    weights: Sequence[Doubles]
    factor: int


def _verified_factor(verified: Floats, basis: Basis, factor: int) -> int:
    """Return the side of the blocks of a verification, which has as many pixels as the other looks
    or, where there is room for more, a multiple. factor: side of the blocks of the other looks.
    """
    side = factor * (images.whole_factor(verified.shape[:2], basis.size) or 1)
    least = min(look_reduction(verified.shape[:2]), side)
    return next(x for x in range(least, side + 1) if side % x == 0)


@dataclass(frozen=True)
class CleanLooks:
    """Current look, prediction and verification, (h, w, 3) linear.

    verified: None without one. texts: texts for a PNG of them; none for raw renders. others: of
    the mixes that were denoised in the same walk; none without. encoders: by transform.
    """

    current: Floats
    predicted: Floats
    verified: Floats | None
    texts: dict[str, str]
    others: tuple[Floats, ...] = ()
    encoders: dict[ViewTransform, Encoder] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def clean(
        cls,
        basis: Basis,
        weights: Doubles,
        predicted: Floats,
        verified: Floats | None,
        *,
        larger: images.Features | None = None,
        factor: int = 1,
        others: MixesOfBlocks | None = None,
    ) -> "CleanLooks":
        """Make the looks without their grain.

        weights: (n, 3), of which `predicted` is the sum. larger: of a verification that has another
        size than the basis. factor: side of the blocks of pixels that become one; the looks of a
        page are denoised coarsely. others: mixes that are to be denoised in the same walk over the
        planes.
        """
        features = basis.features
        raw = "predicted.exr" + ("" if verified is None else ", verified.exr")
        texts = images.denoiser_text(features, raw=raw)
        if verified is not None:
            side = _verified_factor(verified, basis, factor)
            guides = larger or features
            verified = images.denoised(
                images.block_mean(verified, side), guides and guides.reduced(side)
            )
        planes = cached_clean_planes(basis)
        if planes is None and basis.former is None:
            others = others or MixesOfBlocks((), 1)
            now, answer, *rest = denoise_mixes(
                basis,
                [basis.current_weights, weights, *others.weights],
                mixed=[basis.current_look, predicted],
                factor=[factor, factor, *(others.factor for _ in others.weights)],
                quality="coarse",
            )
            return cls(now, answer, verified, texts, tuple(rest))
        size = images.blocks_in(basis.size, factor)
        known = None if planes is None or basis.former is not None else planes.look(size)
        now = (
            denoise_current_look(basis, factor=factor, quality="coarse") if known is None else known
        )
        if planes is None or not planes.is_whole:
            answer = denoise_mix(basis, weights, mixed=predicted, factor=factor, quality="coarse")
        else:
            answer = images.block_mean(planes.mix(weights), factor)
        return cls(now, answer, verified, texts)

    @classmethod
    def raw(
        cls, basis: Basis, predicted: Floats, verified: Floats | None, *, factor: int = 1
    ) -> "CleanLooks":
        """Make the looks as rendered. factor: side of the blocks of pixels that become one."""
        if verified is not None:
            verified = images.block_mean(verified, _verified_factor(verified, basis, factor))
        now, answer = (images.block_mean(x, factor) for x in (basis.current_look, predicted))
        return cls(now, answer, verified, {})

    def encoder(self, transform: ViewTransform) -> Encoder:
        """Return the encoder of a transform, which encodes each look once for all places."""
        return self.encoders.setdefault(transform, Encoder(transform.name, transform.stops))

    @property
    def is_clean(self) -> bool:
        """True if they were denoised."""
        return bool(self.texts)

    @property
    def denoiser(self) -> str:
        """Name of the denoiser, for people."""
        return self.texts.get(images.DENOISED_KEY, "").partition(";")[0]
