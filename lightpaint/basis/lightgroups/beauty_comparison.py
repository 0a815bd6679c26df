"""Comparison of the sum of light groups with the beauty: do they make up the whole picture?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.colour.color import LUMINANCE

#: Share of the beauty that the groups may lack beyond rounding before it counts as missing.
NEGLIGIBLE_SHARE = 1e-5

#: Share of the beauty by which they may exceed it before that is a warning.
WARNING_EXCESS = 1e-3

#: Largest relative error of one rounding to float16, absolute error below its normal range, and
#: of a sum in float32 over the samples of a renderer, whose order differs from layer to layer.
HALF, SUBNORMAL, SUMMED = 2.0**-11, 2.0**-25, 2.0**-20

#: Most pictures of which the sum of all but two is sought: each is tried with each.
MAX_CANDIDATES = 40

#: Every how many rows and columns a pixel is looked at first, where most pictures are others.
COARSE_STEP = 8


def describe_sum(
    rest: Floats,
    whole: Floats,
    layers: Sequence[RenderLayer],
    missing: float,
    exceeding: float,
    name: str,
) -> tuple[str, bool]:
    """Return a sentence on the sum of the groups, and whether more than rounding is missing.

    name: of the light that represents the missing part. All numbers are in the primaries of the
    file, since light of a wide gamut is negative in others.
    """
    beyond = np.sign(rest) * np.maximum(np.abs(rest) - rounding(layers), 0)
    truly_missing, truly_exceeding = missing_and_exceeding(beyond, whole)
    if truly_missing + truly_exceeding <= NEGLIGIBLE_SHARE:
        deviation = missing + exceeding
        return f"the groups add up to the beauty (to {deviation:.1g} of its light)", False
    text = (
        f"the groups lack {share_text(missing)} of the light of the beauty: "
        f"that is kept as it is, as the light {name}"
    )
    if truly_exceeding > WARNING_EXCESS:
        warning = (
            f"WARNING: in places the groups exceed the beauty, by {share_text(exceeding)} of its "
            f"light in all, which the light {name} takes away: is the beauty denoised or clamped, "
            "a light in two groups, or one of them no light?"
        )
        text = (
            f"{warning} {text[0].upper()}{text[1:]}"
            if truly_missing > NEGLIGIBLE_SHARE
            else warning
        )
    return text, True


def missing_and_exceeding(rest: Floats, whole: Floats) -> tuple[float, float]:
    """Return the luminance that is missing, and that is too much, relative to the beauty."""
    total = float((np.abs(whole) @ LUMINANCE).sum())
    if total == 0:
        return 0.0, float(bool(rest.any()))
    lacking, excess = np.maximum(rest, 0), np.maximum(-rest, 0)
    return float((lacking @ LUMINANCE).sum()) / total, float((excess @ LUMINANCE).sum()) / total


def rounding(layers: Sequence[RenderLayer]) -> Floats:
    """Return the largest rounding error of the sum of the layers, (h, w, 3)."""
    bound: Floats = np.zeros(layers[0].image.shape)
    for layer in layers:
        bound += _rounded(layer.image, is_half=layer.is_half)
    return bound


def _rounded(image: Floats, *, is_half: bool) -> Floats:
    size = np.abs(np.nan_to_num(image.astype(np.float64), posinf=0, neginf=0))
    return np.asarray((size * HALF + SUBNORMAL if is_half else 0) + size * SUMMED)


@dataclass(frozen=True)
class LayerSum:
    """The sum of layers, to compare with several pictures.

    total: (h, w, 3) float64, not finite where one of them is not. bound: largest effect of rounding
    on it.
    """

    total: Floats
    bound: Floats

    @staticmethod
    def of(layers: Sequence[RenderLayer]) -> "LayerSum":
        """Return the sum of at least one layer."""
        total: Floats = np.zeros(layers[0].image.shape)
        with np.errstate(invalid="ignore"):
            for layer in layers:
                total += layer.image
        return LayerSum(total, rounding(layers))

    def and_also(self, layer: RenderLayer) -> "LayerSum":
        """Return the sum with one more layer."""
        with np.errstate(invalid="ignore"):
            total = self.total + layer.image
        return LayerSum(total, self.bound + rounding([layer]))

    def without(self, layer: RenderLayer) -> "LayerSum":
        """Return the sum without one of its layers."""
        with np.errstate(invalid="ignore"):
            return LayerSum(self.total - layer.image, self.bound)

    def lacks(self, beauty: RenderLayer) -> float:
        """Return Σ |beauty − total|, where both are finite."""
        return float(_deviation(beauty.image, self.total).sum())

    def is_of(self, beauty: RenderLayer, *, less_itself: bool = False) -> bool:
        """Return whether the sum equals a picture that is not black.

        less_itself: whether the picture is one of the summed layers and has to be subtracted.
        """
        size = np.nan_to_num(np.abs(beauty.image), posinf=0, neginf=0).sum(dtype=np.float64)
        most = NEGLIGIBLE_SHARE * size
        # Excesses only add up, so that a few pixels are enough to tell that it is another picture.
        coarse = (slice(None, None, COARSE_STEP), slice(None, None, COARSE_STEP))
        return bool(
            size > 0
            and self._excess(beauty, coarse, less_itself=less_itself) <= most
            and self._excess(beauty, (), less_itself=less_itself) <= most
        )

    def _excess(
        self, beauty: RenderLayer, pixels: tuple[slice, ...], *, less_itself: bool
    ) -> float:
        """Return their difference beyond rounding, summed over these pixels."""
        image, bound = beauty.image[pixels], self.bound[pixels]
        if less_itself:
            # x − (total − x); the bound is that of the same layers.
            deviation = _deviation(2 * image.astype(np.float64), self.total[pixels])
        else:
            deviation = _deviation(image, self.total[pixels])
            bound = bound + _rounded(image, is_half=beauty.is_half)
        return float(np.maximum(deviation - bound, 0).sum())


def _deviation(picture: Floats, total: Floats) -> Floats:
    """Return |picture − total|, (h, w, 3) float64, 0 if either is not finite."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nan_to_num(np.abs(picture - total), nan=0, posinf=0, neginf=0))


def find_beauty_of_lights(
    others: Sequence[RenderLayer], lights: Sequence[RenderLayer]
) -> RenderLayer | None:
    """Return the layer of unknown name that is the sum of the lights."""
    if not others or not lights:
        return None
    added = LayerSum.of(lights)
    return next((layer for layer in others if added.is_of(layer)), None)


def find_beauty(layers: Sequence[RenderLayer]) -> RenderLayer | None:
    """Return the layer that is the sum of the others."""
    added = LayerSum.of(layers)
    return next((layer for layer in layers if added.is_of(layer, less_itself=True)), None)


def unrelated_layer(
    layers: Sequence[RenderLayer], beauty: RenderLayer | None
) -> tuple[RenderLayer, RenderLayer] | None:
    """Return the layer without which the others add up to the picture, and that picture.

    beauty: the picture; without one it is sought among the layers. None where all of them are
    needed, where no single one is in the way, and where they are too many to try.
    """
    if len(layers) < (2 if beauty else 4) or (beauty is None and len(layers) > MAX_CANDIDATES):
        return None
    if beauty is not None and LayerSum.of(layers).is_of(beauty):
        return None
    # A few pixels tell that most pairs are none.
    coarse_layers, whole = list(map(_coarsened, layers)), beauty and _coarsened(beauty)
    for k in _unrelated_candidates(coarse_layers, whole):
        others = [*layers[:k], *layers[k + 1 :]]
        if beauty is None and (whole_found := find_beauty(others)) is not None:
            return layers[k], whole_found
        if beauty is not None and LayerSum.of(others).is_of(beauty):
            return layers[k], beauty
    return None


def _unrelated_candidates(layers: Sequence[RenderLayer], beauty: RenderLayer | None) -> list[int]:
    """Return indices of layers without which the others may add up to the picture."""
    added = LayerSum.of(layers)
    candidates = []
    for k, layer in enumerate(layers):
        less = added.without(layer)
        if beauty is not None and less.is_of(beauty):
            candidates.append(k)
        if beauty is None and any(
            less.is_of(other, less_itself=True) for j, other in enumerate(layers) if j != k
        ):
            candidates.append(k)
    return candidates


def _coarsened(layer: RenderLayer) -> RenderLayer:
    return replace(layer, image=layer.image[::COARSE_STEP, ::COARSE_STEP])


def share_text(share: float) -> str:
    """Return a share in words: `0.4 %`, `25 %`."""
    return f"{100 * share:.2g} %" if share < 0.0995 else f"{100 * share:.0f} %"
