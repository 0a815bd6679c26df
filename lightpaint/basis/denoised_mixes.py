"""Denoised mixes of lights.

Direct light is nearly clean after few samples, and has edges of shadows and highlights that a
denoiser would blur; indirect light is noisy and smooth. So indirect light is denoised fully, and
direct light only as far as its own noise demands. Where that is quick, direct light is averaged
along surfaces instead, in a tenth of the time and with equal errors; if Open Image Denoise is not
installed, both are.

Where many pictures are shown beside each other, indirect light is denoised in blocks of pixels, and
brought back to the surfaces.
"""

from collections.abc import Sequence
from functools import reduce
from itertools import product
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, largest, mean_square, read_only
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.plane_results import array_name, make_once
from lightpaint.images import (
    Quality,
    block_mean,
    box_mean,
    denoised,
    edge_padded,
    enlarged,
    oidn_is_installed,
    shifted,
)

#: `coarse` takes less than half of the time of `fast`, with 5 to 8 % more error, where surfaces and
#: noise are known; elsewhere it is `fast`.
MixQuality = Quality | Literal["coarse"]

#: Side of the blocks of pixels whose indirect light is denoised together if that is coarse.
COARSE_BLOCK = 2

#: Standard errors beyond which detail is surely lost.
SURE_ERRORS = 2.0

#: Radius in pixels over which noise and the change made by the denoiser are averaged.
RADIUS = 3
#: The same if the noise is estimated from the picture alone, which takes more pixels.
GRAIN_RADIUS = 5

#: Smallest ratio of a stray pixel to its surroundings.
OUTSTANDING = 1.25
#: Largest ratio of its excess to the difference between the halves of a pixel nearby.
LARGEST_CHANCE = 1.5
#: Four windows are searched for such pixels: half the side of each, and the distance of its center
#: from the pixel in x and in y. They leave out direct neighbours, which a highlight may cover.
WINDOW_RADIUS, WINDOW_DISTANCE = 3, 5

#: Side of the blocks of pixels of which noise is taken out for readers of larger blocks: it takes a
#: quarter of the time.
READ_SIDE = 2

_NEIGHBOURS = [offset for offset in product((-1, 0, 1), repeat=2) if offset != (0, 0)]


def denoise_mix(
    basis: Basis,
    weights: Doubles,
    *,
    mixed: Floats | None = None,
    factor: int = 1,
    quality: MixQuality = "fast",
) -> Floats:
    """Return Σ w_i Φ_i denoised, (h, w, 3) float32.

    weights: (n, 3). mixed: the sum, if it is already computed. factor: side of the blocks of pixels
    that are averaged to one.
    """
    known = None if mixed is None else [mixed]
    [mix] = denoise_mixes(basis, [weights], mixed=known, factor=factor, quality=quality)
    return mix


def denoise_mixes(
    basis: Basis,
    weights: Sequence[Doubles],
    *,
    mixed: Sequence[Floats] | None = None,
    factor: int | Sequence[int] = 1,
    quality: MixQuality = "fast",
) -> list[Floats]:
    """Return several mixes denoised, in one walk over each set of planes.

    weights: (n, 3) each. mixed: the sums of the first ones. factor: of all mixes, or of each. For
    the others see `denoise_mix`.
    """
    together, known = np.array(weights), list(mixed or ())
    rest = together[len(known) :]
    sets = [[*known, *(basis.mixes(rest) if len(rest) else ())]]
    if (parts := basis.indirect) is not None:
        sets += [list(x.mixes(together)) for x in (basis.noise, parts.planes, parts.noise)]
    factors = [factor] * len(weights) if isinstance(factor, int) else factor
    return [
        _denoise_pictures(basis, pictures, side, quality)
        for side, pictures in zip(factors, zip(*sets, strict=True), strict=True)
    ]


def denoise_current_look(basis: Basis, *, factor: int = 1, quality: MixQuality = "fast") -> Floats:
    """Return the scene in its current state, denoised, (h, w, 3) float32.

    factor: as in `denoise_mix`.
    """
    mixed = basis.current_look
    if basis.former is not None:
        return _denoise_whole(basis, block_mean(mixed, factor), factor, quality)
    return denoise_mix(basis, basis.current_weights, mixed=mixed, factor=factor, quality=quality)


def read_look(basis: Basis) -> Floats:
    """Return the current look as paintings are compared with it, (h, w, 3) float32.

    Its means over blocks of pixels have little noise, so that a painting of few samples is read as
    one of many. Single pixels keep their own noise. It is the current look itself where indirect
    light, surfaces or noise are unknown, and before lights were moved.
    """
    if not _can_read(basis):
        return basis.current_look

    def make() -> Floats:
        weights, look = basis.current_weights, basis.current_look
        clean = denoise_mix(basis, weights, mixed=look, factor=READ_SIDE)
        change = enlarged(clean - block_mean(look, READ_SIDE), READ_SIDE)
        return read_only(look + edge_padded(change, basis.size))

    return make_once(basis.planes, array_name("read look", basis.current_weights), make)


def read_look_noise(basis: Basis) -> Floats:
    """Return half of what the halves of the samples change in `read_look`, (h, w, 3) float32.

    The average along surfaces is linear; where a denoiser replaces it, it is asked twice, with the
    half difference of either sign.
    """
    noise, indirect = basis.current_noise, basis.indirect
    if not _can_read(basis) or indirect is None:
        return noise
    features, along_surfaces = basis.surfaces(READ_SIDE)
    assert along_surfaces is not None

    def make() -> Floats:
        parts = (x.mix(basis.current_weights) for x in (indirect.planes, indirect.noise))
        pictures = basis.current_look, noise, *parts
        total, half, smooth, smooth_half = (block_mean(x, READ_SIDE) for x in pictures)
        left: Floats = along_surfaces(smooth_half)
        if oidn_is_installed():
            more, less = (denoised(smooth + x, features) for x in (smooth_half, -smooth_half))
            left = (more - less) / 2
        direct, direct_half = total - smooth, half - smooth_half
        clean = _within_neighbours(along_surfaces(direct), direct)
        share = share_of_clean(direct, direct_half, clean)
        left = left + direct_half + share * (along_surfaces(direct_half) - direct_half)
        change = enlarged(left - half, READ_SIDE)
        return read_only(noise + edge_padded(change, basis.size))

    return make_once(basis.planes, array_name("read noise", basis.current_weights), make)


def read_look_side(basis: Basis) -> int:
    """Return the side of the squares of pixels of whose mean `read_look` takes noise out; 1 where
    it takes none.
    """
    return READ_SIDE if _can_read(basis) else 1


def _can_read(basis: Basis) -> bool:
    """Return whether `read_look` has less noise than the current look."""
    if min(basis.planes.size) < READ_SIDE or basis.former is not None or not basis.knows_noise:
        return False
    return basis.indirect is not None and basis.surfaces(READ_SIDE)[1] is not None


def denoise_plane(basis: Basis, k: int, *, factor: int = 1, quality: MixQuality = "fast") -> Floats:
    """Return the image of light k at unit emission, denoised, (h, w, 3) float32.

    factor: as in `denoise_mix`.
    """
    pictures = [basis.planes.plane(k)]
    if (parts := basis.indirect) is not None:
        pictures += [planes.plane(k) for planes in (basis.noise, parts.planes, parts.noise)]
    return _denoise_pictures(basis, pictures, factor, quality)


def _denoise_whole(basis: Basis, picture: Floats, factor: int, quality: MixQuality) -> Floats:
    """Return a picture of blocks of `factor` pixels denoised, without knowing its parts."""
    features, _ = basis.surfaces(factor)
    return denoised(picture, features, quality="fast" if quality == "coarse" else quality)


def _denoise_pictures(
    basis: Basis, pictures: Sequence[Floats], factor: int, quality: MixQuality
) -> Floats:
    """Return all light denoised: direct and indirect light separately, if both are known.

    pictures: (h, w, 3) each: all light; then, if known, its noise, indirect light, and the noise of
    that.
    """
    pictures = [block_mean(picture, factor) for picture in pictures]
    if basis.indirect is None:
        return _denoise_whole(basis, pictures[0], factor, quality)
    total, noise, indirect, indirect_noise = pictures
    smooth = _denoise_indirect(basis, indirect, indirect_noise, factor, quality)
    direct = np.maximum(total - indirect, 0)
    clean = _denoise_direct(basis, direct, factor, quality)
    if not basis.knows_noise:
        return smooth + blend_by_grain(direct, clean)
    return smooth + blend_by_noise(direct, noise - indirect_noise, clean)


def _denoise_direct(basis: Basis, direct: Floats, factor: int, quality: MixQuality) -> Floats:
    """Return direct light without its grain, (h, w, 3)."""
    _, along_surfaces = basis.surfaces(factor)
    if along_surfaces is not None:
        if factor > 1 or (quality != "high" and along_surfaces.is_quick):
            return _within_neighbours(along_surfaces(direct), direct)
        if not oidn_is_installed():
            return along_surfaces(direct)
    return _denoise_whole(basis, direct, factor, quality)


def _denoise_indirect(
    basis: Basis, indirect: Floats, noise: Floats, factor: int, quality: MixQuality
) -> Floats:
    """Return indirect light without its grain, (h, w, 3). noise: half the difference of halves."""
    _, along_surfaces = basis.surfaces(factor)
    if along_surfaces is not None:
        if not oidn_is_installed():
            return along_surfaces(indirect)
        is_coarse = quality == "coarse" and min(along_surfaces.size) >= COARSE_BLOCK
        if is_coarse and along_surfaces.is_quick and basis.knows_noise:
            coarse_factor = factor * COARSE_BLOCK
            small = _denoise_whole(basis, block_mean(indirect, COARSE_BLOCK), coarse_factor, "fast")
            clean = along_surfaces.enlarged(small, COARSE_BLOCK)
            # What a mirror shows has edges that its surface has not.
            return blend_where_sure(indirect, noise, clean)
    return _denoise_whole(basis, indirect, factor, quality)


def _within_neighbours(clean: Floats, raw: Floats) -> Floats:
    """Return a filtered picture within the range of the raw one in the pixels around, (h, w, 3).

    The filter would spread highlights and reflections of lamps, whose edges no surface has.
    """
    return np.clip(clean, -_window_maximum(-raw, 1), _window_maximum(raw, 1))


def blend_by_noise(raw: Floats, half_difference: Floats, clean: Floats) -> Floats:
    """Return the mean of a picture and its denoised form that has the least expected error.

    All are (h, w, 3), as in `share_of_clean`.
    """
    return _mean_of(raw, clean, share_of_clean(raw, half_difference, clean))


def share_of_clean(raw: Floats, half_difference: Floats, clean: Floats) -> Floats:
    """Return the share of the denoised form in the mean with the least expected error, (h, w, 1)
    float32.

    raw: (h, w, 3), whose variance V is estimated from `half_difference`. clean: its denoised form,
    whose squared bias is B = E[(clean − raw)²] − V. Both are averaged over a window of pixels and
    over channels. The error of (1 − t) raw + t clean is (1 − t)² V + t² B, hence t = V / (V + B).
    Stray pixels, whose halves agree by chance, do not count for B, and are taken from the denoised
    form.
    """
    is_stray = stray_pixels(raw, half_difference, clean)
    noise, change = mean_square(half_difference), mean_square(clean - raw)
    variance = box_mean(noise, RADIUS)
    lost_energy = np.maximum(box_mean(np.where(is_stray, 0, change - noise), RADIUS), 0)
    share = _quotient(variance, variance + lost_energy)
    return np.where(is_stray, 1, share)[..., None].astype(np.float32)


def blend_where_sure(raw: Floats, half_difference: Floats, clean: Floats) -> Floats:
    """Return a denoised picture, (h, w, 3) float32, and the raw one as far as that surely lost
    detail.

    As `blend_by_noise`, with the squared bias of each window less two standard errors of its own.
    The estimate itself, above 0 by chance in half of all windows, would leave specks of grain.
    """
    noise = mean_square(half_difference)
    lost = mean_square(clean - raw) - noise
    error = np.sqrt(box_mean(np.square(lost), RADIUS)) / (2 * RADIUS + 1)
    variance = box_mean(noise, RADIUS)
    total = variance + np.maximum(box_mean(lost, RADIUS) - SURE_ERRORS * error, 0)
    return _mean_of(raw, clean, _quotient(variance, total)[..., None].astype(np.float32))


def _quotient(part: Floats, total: Floats) -> Floats:
    return np.divide(part, total, out=np.zeros_like(total), where=total > 0)


def _mean_of(raw: Floats, clean: Floats, share: Floats) -> Floats:
    """Return (1 − t) raw + t clean, (h, w, 3) float32. share: t, (h, w, 1) float32."""
    return np.asarray(raw + share * (clean - raw), np.float32)


def stray_pixels(raw: Floats, half_difference: Floats, clean: Floats) -> npt.NDArray[np.bool_]:
    """Return where a picture is bright by chance, (h, w).

    A light that one sample in ten finds is found by both samples of one pixel in a hundred. The two
    halves of such a pixel agree, so its half difference shows no noise; the half differences of its
    neighbours do.

    raw: (h, w, 3) linear, the mean of two halves. half_difference: half of their difference. clean:
    the picture, denoised. A stray pixel is brighter than its denoised form and than all of its
    neighbours but one, which excludes lines. And in two of the four windows around it the halves of
    a pixel differ by about its excess, so single samples do have such values.
    """
    brightness, expected = largest(raw), largest(clean)
    second = _second_largest([shifted(brightness, *offset) for offset in _NEIGHBOURS])
    is_outstanding = brightness > OUTSTANDING * np.maximum(second, expected)
    most = _window_maximum(2 * largest(np.abs(half_difference)), WINDOW_RADIUS)
    corners = product((-WINDOW_DISTANCE, WINDOW_DISTANCE), repeat=2)
    by_chance = LARGEST_CHANCE * _second_largest([shifted(most, *corner) for corner in corners])
    is_stray = is_outstanding & (brightness - expected <= by_chance)
    return np.asarray(is_stray, np.bool_)


def _second_largest(pictures: Sequence[Floats]) -> Floats:
    """Return the second largest value of each pixel."""
    most, second = pictures[0], np.full_like(pictures[0], -np.inf)
    for picture in pictures[1:]:
        np.maximum(second, np.minimum(most, picture), out=second)
        most = np.maximum(most, picture)
    return second


def _window_maximum(values: Floats, radius: int) -> Floats:
    """Return the largest value of the window around each pixel, of the shape of `values`."""
    for axis in (1, 0):
        steps = (step for step in range(-radius, radius + 1) if step)
        offsets = [(0, step) if axis else (step, 0) for step in steps]
        values = reduce(np.maximum, (shifted(values, *offset) for offset in offsets), values)
    return values


def blend_by_grain(raw: Floats, clean: Floats) -> Floats:
    """Return the mean of a picture of unknown noise and its denoised form, (h, w, 3) float32.

    Noise differs from pixel to pixel, while neighbours along an edge lose alike. So take r = clean
    − raw in a window of pixels, and its correlation with the pixels two away in the direction in
    which that is largest. The correlated part counts as detail lost by denoising, the remainder V
    as noise: t = V / ⟨r²⟩, as in `share_of_clean`. The distance is two pixels because renderers
    that filter correlate the noise of neighbours.
    """
    changed = (clean - raw).astype(np.float64)

    def pooled(values: Doubles) -> Doubles:
        return np.asarray(box_mean(values.mean(axis=-1), GRAIN_RADIUS), np.float64)

    total = pooled(np.square(changed))
    shared = np.zeros_like(total)
    for step in ((0, 2), (2, 0), (2, 2), (2, -2)):
        others = np.roll(changed, step, (0, 1)) + np.roll(changed, (-step[0], -step[1]), (0, 1))
        np.maximum(shared, pooled(changed * others / 2), out=shared)
    share = _quotient(np.maximum(total - shared, 0), total)
    return _mean_of(raw, clean, share[..., None].astype(np.float32))
