"""Checks whether the sum of the light groups equals the beauty, the whole picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.colour import LUMINANCE
from lightpaint.images.formats import compression_errors

#: Share of the beauty that may be missing beyond rounding without being reported.
NEGLIGIBLE_SHARE = 1e-5

#: The same where the compression of the file changes light: what its errors are beyond their
#: typical largest.
LOSSY_SHARE = 2e-4

#: Side of the blocks of pixels whose errors of compression depend on the brightest of them.
BLOCK_SIDE = 8

#: Share of the beauty by which the groups may exceed it without a warning.
WARNING_EXCESS = 1e-3

#: Largest relative error of rounding to float16; its absolute error below the normal range;
#: relative error of a renderer's float32 sum over samples, whose order differs between layers.
HALF_PRECISION, SUBNORMAL, SUM_PRECISION = 2.0**-11, 2.0**-25, 2.0**-20

#: Maximum number of layers for which every pair is tried as the sum and the one left out.
MAX_CANDIDATES = 40

#: Step between pixels of the first, coarse comparison, which rules out most pictures.
COARSE_STEP = 8

#: Least number of pixels of a coarse comparison that finds a coefficient for each layer.
MIN_COARSE_PIXELS = 256


def describe_sum(
    rest: Floats,
    whole: Floats,
    layers: Sequence[RenderLayer],
    missing: float,
    exceeding: float,
    name: str,
) -> tuple[str, bool]:
    """Return a sentence on the sum of the groups, and whether more than rounding is missing.

    rest, whole: the beauty minus the groups, and the beauty, (h, w, 3), both in the primaries of
    the file: in others, light of a wide gamut would be negative. missing, exceeding: as in
    `missing_and_exceeding`. name: name of the light that holds `rest`.
    """
    beyond = np.sign(rest) * np.maximum(np.abs(rest) - rounding(layers), 0)
    truly_missing, truly_exceeding = missing_and_exceeding(beyond, whole)
    lossy = ", ".join(dict.fromkeys(layer.compression for layer in layers if _is_lossy(layer)))
    if truly_missing + truly_exceeding <= negligible_share(layers):
        sentence = "the groups add up to the beauty"
        if (deviation := missing + exceeding) <= NEGLIGIBLE_SHARE:
            return sentence, False
        if not lossy:
            return f"{sentence} (but for {share_text(deviation)}, which is rounding)", False
        return (
            f"{sentence} (but for {share_text(deviation)}), as exactly as the lossy compression "
            f"{lossy} stores them, which may hide a lamp of up to "
            f"{share_text(hidden_share(layers, whole))} of it",
            False,
        )
    text = (
        f"the groups lack {share_text(missing)} of the light of the beauty: "
        f"the missing part becomes the fixed light {name}"
    )
    if lossy:
        text += f"; some of it is the loss of the compression {lossy}: ZIP has none"
    if truly_exceeding > WARNING_EXCESS:
        warning = (
            f"WARNING: in places the groups exceed the beauty, by {share_text(exceeding)} of its "
            f"light in all, which the light {name} subtracts: is the beauty denoised or clamped, "
            "is a light in two groups, or is one of them not a light?"
        )
        text = (
            f"{warning} {text[0].upper()}{text[1:]}"
            if truly_missing > negligible_share(layers)
            else warning
        )
    return text, True


def missing_and_exceeding(rest: Floats, whole: Floats) -> tuple[float, float]:
    """Return the missing and the excess luminance of the groups, as shares of the beauty."""
    total = float((np.abs(whole) @ LUMINANCE).sum())
    if total == 0:
        return 0.0, float(bool(rest.any()))
    missing_light, excess = np.maximum(rest, 0), np.maximum(-rest, 0)
    return float((missing_light @ LUMINANCE).sum()) / total, float(
        (excess @ LUMINANCE).sum()
    ) / total


def rounding(layers: Sequence[RenderLayer]) -> Floats:
    """Return an upper bound of the rounding error of the sum of the layers, (h, w, 3)."""
    bound: Floats = np.zeros(layers[0].image.shape)
    for layer in layers:
        bound += _rounded(layer.image, layer)
    return bound


def negligible_share(layers: Sequence[RenderLayer]) -> float:
    """Return the share of the beauty that may be missing beyond rounding without being
    reported.
    """
    return LOSSY_SHARE if any(map(_is_lossy, layers)) else NEGLIGIBLE_SHARE


def hidden_share(layers: Sequence[RenderLayer], whole: Floats) -> float:
    """Return the largest share of the beauty, (h, w, 3), that a lamp in none of the layers may have
    where the layers seem to add up to it.

    Its light may be as large as the rounding of the sum everywhere, and `negligible_share` beyond.
    """
    total = float((np.abs(whole) @ LUMINANCE).sum())
    rounded = float((rounding(layers) @ LUMINANCE).sum())
    return min(rounded / total, 1.0) + negligible_share(layers) if total > 0 else 0.0


def _is_lossy(layer: RenderLayer) -> bool:
    """Return True if the compression of a layer changes it by more than half floats do."""
    return layer.loss > HALF_PRECISION


def _rounded(image: Floats, layer: RenderLayer) -> Floats:
    """Return an upper bound of the rounding error of pixels of a layer, (h, w, 3)."""
    size = np.abs(np.nan_to_num(image.astype(np.float64), posinf=0, neginf=0))
    bound = (size * HALF_PRECISION + SUBNORMAL if layer.is_half else 0) + size * SUM_PRECISION
    if layer.loss:
        brightest = _brightest_in_block(size)
        losses = layer.compression, layer.loss, brightest
        bound = bound + compression_errors(*losses, is_half=layer.is_half)
    return np.asarray(bound)


def _brightest_in_block(size: Floats) -> Floats:
    """Return the largest value of the block that each pixel is in, (h, w, 3)."""
    height, width, _ = size.shape
    padded = np.pad(size, ((0, -height % BLOCK_SIDE), (0, -width % BLOCK_SIDE), (0, 0)))
    rows, columns = (side // BLOCK_SIDE for side in padded.shape[:2])
    largest = padded.reshape(rows, BLOCK_SIDE, columns, BLOCK_SIDE, 3).max(axis=(1, 3))
    spread = largest.repeat(BLOCK_SIDE, axis=0).repeat(BLOCK_SIDE, axis=1)
    return np.asarray(spread[:height, :width])


@dataclass(frozen=True)
class LayerSum:
    """A sum of layers, computed once to be compared with many pictures.

    total: (h, w, 3) float64, not finite where a layer is not finite. bound: upper bound of its
    rounding error. share: what may be missing beyond it, as a share of all light.
    """

    total: Floats
    bound: Floats
    share: float

    @staticmethod
    def of(layers: Sequence[RenderLayer]) -> "LayerSum":
        """Return the sum of one or more layers."""
        total: Floats = np.zeros(layers[0].image.shape)
        with np.errstate(invalid="ignore"):
            for layer in layers:
                total += layer.image
        return LayerSum(total, rounding(layers), negligible_share(layers))

    def and_also(self, layer: RenderLayer) -> "LayerSum":
        """Return the sum with one layer added."""
        with np.errstate(invalid="ignore"):
            total = self.total + layer.image
        share = max(self.share, negligible_share([layer]))
        return LayerSum(total, self.bound + rounding([layer]), share)

    def without(self, layer: RenderLayer) -> "LayerSum":
        """Return the sum with one of its layers removed."""
        with np.errstate(invalid="ignore"):
            return LayerSum(self.total - layer.image, self.bound, self.share)

    def lacks(self, beauty: RenderLayer) -> float:
        """Return Σ |beauty − total| over the pixels where both are finite."""
        return float(_deviation(beauty.image, self.total).sum())

    def exceeds(self, beauty: RenderLayer) -> float:
        """Return Σ max(total − beauty, 0) as a share of Σ |beauty|; infinite if that is 0."""
        with np.errstate(invalid="ignore"):
            excess = np.nan_to_num(self.total - beauty.image, nan=0, posinf=0, neginf=0)
        size = np.nan_to_num(np.abs(beauty.image), posinf=0, neginf=0).sum(dtype=np.float64)
        return float(np.maximum(excess, 0).sum() / size) if size else float("inf")

    def is_of(self, beauty: RenderLayer, *, less_itself: bool = False) -> bool:
        """Return True if the layers of the sum add up to a picture that is not black.

        less_itself: whether the picture itself is among these layers, so that the others are to add
        up to it.
        """
        size = np.nan_to_num(np.abs(beauty.image), posinf=0, neginf=0).sum(dtype=np.float64)
        largest_share = max(self.share, negligible_share([beauty])) * size
        # The excess only grows with more pixels, so a few of them can rule a picture out.
        coarse = (slice(None, None, COARSE_STEP), slice(None, None, COARSE_STEP))
        return bool(
            size > 0
            and self._excess(beauty, coarse, less_itself=less_itself) <= largest_share
            and self._excess(beauty, (), less_itself=less_itself) <= largest_share
        )

    def _excess(
        self, beauty: RenderLayer, pixels: tuple[slice, ...], *, less_itself: bool
    ) -> float:
        """Return the difference beyond rounding, summed over these pixels."""
        image, bound = beauty.image[pixels], self.bound[pixels]
        if less_itself:
            # x − (total − x); the layers and hence the bound are the same.
            deviation = _deviation(2 * image.astype(np.float64), self.total[pixels])
        else:
            deviation = _deviation(image, self.total[pixels])
            # The loss at a pixel depends on its whole block.
            whole = _rounded(beauty.image, beauty)[pixels] if beauty.loss else None
            bound = bound + (_rounded(image, beauty) if whole is None else whole)
        return float(np.maximum(deviation - bound, 0).sum())


def _deviation(picture: Floats, total: Floats) -> Floats:
    """Return |picture − total|, (h, w, 3) float64, 0 if either is not finite."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nan_to_num(np.abs(picture - total), nan=0, posinf=0, neginf=0))


def find_beauty_of_lights(
    others: Sequence[RenderLayer], lights: Sequence[RenderLayer]
) -> RenderLayer | None:
    """Return the layer among `others` that is the sum of the lights; None if there is none."""
    if not others or not lights:
        return None
    layer_sum = LayerSum.of(lights)
    return next((layer for layer in others if layer_sum.is_of(layer)), None)


def find_beauty(layers: Sequence[RenderLayer]) -> RenderLayer | None:
    """Return the layer that is the sum of the others; None if there is none."""
    layer_sum = LayerSum.of(layers)
    return next((layer for layer in layers if layer_sum.is_of(layer, less_itself=True)), None)


def layers_needed(
    beauty: RenderLayer, lights: Sequence[RenderLayer], others: Mapping[str, RenderLayer]
) -> list[str]:
    """Return the names of the `others` with which the lights add up to the beauty; [] if no
    choice of them does.
    """
    # Least squares finds a coefficient for each on few pixels; the sum of the chosen confirms it.
    compared = (beauty, *lights, *others.values())
    is_small = beauty.image[..., 0].size < MIN_COARSE_PIXELS * COARSE_STEP**2
    coarse = compared if is_small else [_coarsened(layer) for layer in compared]
    pixels = np.nan_to_num(
        np.stack([layer.image.astype(np.float64).ravel() for layer in coarse]), posinf=0, neginf=0
    )
    lacking = pixels[0] - pixels[1 : 1 + len(lights)].sum(axis=0)
    coefficients = np.linalg.lstsq(pixels[1 + len(lights) :].T, lacking, rcond=None)[0]
    needed = [name for name, x in zip(others, coefficients, strict=True) if x > 0.5]
    chosen = [*lights, *(others[name] for name in needed)]
    return needed if needed and LayerSum.of(chosen).is_of(beauty) else []


def unrelated_layer(
    layers: Sequence[RenderLayer], beauty: RenderLayer | None
) -> tuple[RenderLayer, RenderLayer] | None:
    """Return the layer without which the others add up to the picture, and that picture.

    beauty: the picture; None to search for it among the layers. Returns None if all layers are
    needed, if leaving out one of them does not help, or if there are too many to try.
    """
    if len(layers) < (2 if beauty else 4) or (beauty is None and len(layers) > MAX_CANDIDATES):
        return None
    if beauty is not None and LayerSum.of(layers).is_of(beauty):
        return None
    # A coarse selection of pixels rules out most pairs.
    # What compression loses at a pixel depends on pixels that such a selection leaves out.
    coarse_layers, whole = list(layers), beauty
    if not any(layer.loss for layer in layers):
        coarse_layers, whole = list(map(_coarsened, layers)), beauty and _coarsened(beauty)
    for k in _unrelated_candidates(coarse_layers, whole):
        others = [*layers[:k], *layers[k + 1 :]]
        if beauty is None and (whole_found := find_beauty(others)) is not None:
            return layers[k], whole_found
        if beauty is not None and LayerSum.of(others).is_of(beauty):
            return layers[k], beauty
    return None


def _unrelated_candidates(layers: Sequence[RenderLayer], beauty: RenderLayer | None) -> list[int]:
    """Return the indices of layers without which the others may add up to the picture."""
    layer_sum = LayerSum.of(layers)
    candidates = []
    for k, layer in enumerate(layers):
        remaining_sum = layer_sum.without(layer)
        if beauty is not None and remaining_sum.is_of(beauty):
            candidates.append(k)
        if beauty is None and any(
            remaining_sum.is_of(other, less_itself=True) for j, other in enumerate(layers) if j != k
        ):
            candidates.append(k)
    return candidates


def _coarsened(layer: RenderLayer) -> RenderLayer:
    return replace(layer, image=layer.image[::COARSE_STEP, ::COARSE_STEP])


def share_text(share: float) -> str:
    """Return a share as a percentage: `0.4 %`, `25 %`."""
    return f"{100 * share:.2g} %" if share < 0.0995 else f"{100 * share:.0f} %"
