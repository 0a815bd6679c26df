"""Whether light groups are all of the picture: their sum, held against the beauty."""

from collections.abc import Sequence

import numpy as np

from lightpaint.basis.layers import Layer
from lightpaint.images.color import LUMINANCE
from lightpaint.images.exr import Floats

#: Share of the beauty that the groups may lack beyond rounding before it counts as missing.
NOTHING = 1e-5

#: Share of the beauty by which they may exceed it before that is a warning.
EXCEEDING = 1e-3

#: Largest relative error of one rounding to float16, absolute error below its normal range, and
#: of a sum in float32 over the samples of a renderer, whose order differs from layer to layer.
HALF, SUBNORMAL, SUMMED = 2.0**-11, 2.0**-25, 2.0**-20


def spoken_sum(
    rest: Floats, whole: Floats, layers: Sequence[Layer], missing: float, exceeding: float
) -> tuple[str, bool]:
    """A sentence on the sum of the groups, and whether what they lack is more than rounding.

    All of it in the primaries of the file: in others, light of a wide gamut is negative.
    """
    beyond = np.sign(rest) * np.maximum(np.abs(rest) - rounding(layers), 0)
    truly_missing, truly_exceeding = shares(beyond, whole)
    if truly_missing + truly_exceeding <= NOTHING:
        off = missing + exceeding
        return f"the groups add up to the beauty (to {off:.1g} of its light)", False
    told = (
        f"the groups lack {_percent(missing)} of the light of the beauty: "
        "that is kept as it is, as the light rest"
    )
    if truly_exceeding > EXCEEDING:
        warning = (
            f"WARNING: in places the groups exceed the beauty, by {_percent(exceeding)} of its "
            "light in all, which the light rest takes away: is the beauty denoised or clamped, or "
            "a light in two groups?"
        )
        told = f"{warning} {told[0].upper()}{told[1:]}" if truly_missing > NOTHING else warning
    return told, True


def shares(rest: Floats, whole: Floats) -> tuple[float, float]:
    """Luminance that is missing, and that is too much, over that of the beauty."""
    total = float((np.abs(whole) @ LUMINANCE).sum())
    if total == 0:
        return 0.0, float(bool(rest.any()))
    lacking, excess = np.maximum(rest, 0), np.maximum(-rest, 0)
    return float((lacking @ LUMINANCE).sum()) / total, float((excess @ LUMINANCE).sum()) / total


def rounding(layers: Sequence[Layer]) -> Floats:
    """By how much the sum of the layers may be off its true value for rounding, (h, w, 3)."""
    bound: Floats = np.zeros(layers[0].image.shape)
    for layer in layers:
        size = np.abs(np.nan_to_num(layer.image.astype(np.float64), posinf=0, neginf=0))
        bound = bound + (size * HALF + SUBNORMAL if layer.is_half else 0) + size * SUMMED
    return bound


def lacking(beauty: Layer, lights: Sequence[Layer]) -> float:
    """Σ |beauty − Σ lights|, where both are finite."""
    return float(_off(beauty, lights).sum())


def adds_up(beauty: Layer, lights: Sequence[Layer]) -> bool:
    """Whether the lights add up to just that picture, which then is not black."""
    size = np.nan_to_num(np.abs(beauty.image.astype(np.float64)), posinf=0, neginf=0).sum()
    beyond = np.maximum(_off(beauty, lights) - rounding([*lights, beauty]), 0)
    return bool(size > 0 and beyond.sum() <= NOTHING * size)


def _off(beauty: Layer, lights: Sequence[Layer]) -> Floats:
    """|beauty − Σ lights|, (h, w, 3) float64, 0 where one is not finite."""
    with np.errstate(invalid="ignore"):
        total = sum(layer.image.astype(np.float64) for layer in lights)
        off = np.nan_to_num(np.abs(beauty.image - total), nan=0, posinf=0, neginf=0)
    return np.asarray(off)


def beauty_by_sum(others: Sequence[Layer], lights: Sequence[Layer]) -> Layer | None:
    """The layer that the lights add up to, where it has a name that nobody knows."""
    return next((layer for layer in others if adds_up(layer, lights)), None)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.0995 else f"{100 * share:.0f} %"
