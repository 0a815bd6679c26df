"""The parts of view transforms: the interface of encodings, and the built-in tone curves: sRGB,
linear, filmic and AgX."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.primaries import decode_display, encode_display


class Encoding(Protocol):
    """An encoding of linear Rec.709 as display values, without exposure. Arrays are (..., 3)."""

    @property
    def white(self) -> float:
        """Light of the grey that the display shows as white."""

    def encode(self, image: Floats) -> Floats:
        """Return linear light as display values in [0, 1]."""

    def decode(self, image_display: Floats) -> Floats:
        """Return display values in [0, 1] as linear light."""

    def encode_planes(self, planes: Floats) -> Floats:
        """Return `encode` of linear light with channels first, (3, p)."""

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        """Return display values (3, p) for linear light (3, p), and their derivatives.

        Derivatives are (3, 3, p), of display value i by linear channel j, and 0 where clipped. If
        channels do not mix, they are (3, p).
        """


#: The range of AgX's logarithm, in stops relative to middle grey.
AGX_STOPS = (-10.0, 6.5)
MIDDLE_GREY = 0.18

#: AgX's inset: Rec.709 in a space whose primaries lie 1/0.8 as far from white. The row is each
#: primary's share of X + Y + Z of white.
AGX_INSET = 0.8 * np.eye(3) + 0.2 * np.array([0.211994645, 0.392150825, 0.395854530])


@dataclass(frozen=True)
class Curve:
    """A tone curve: the same curve for each channel, after an optional matrix.

    forward: from light in [0, white] to display values. inverse: from display values to light.
    with_derivative: from light in [0, white] to display values and their derivatives.
    """

    forward: Callable[[Floats], Floats]
    inverse: Callable[[Floats], Floats]
    with_derivative: Callable[[Floats], tuple[Floats, Floats]]
    white: float = 1.0
    matrix: Floats | None = None

    def encode(self, image: Floats) -> Floats:
        return np.clip(self.forward(np.clip(self._mixed(image), 0, self.white)), 0, 1)

    def decode(self, image_display: Floats) -> Floats:
        light = self.inverse(image_display)
        if self.matrix is None:
            return light
        return np.asarray(light @ np.linalg.inv(self.matrix).T.astype(light.dtype))

    def encode_planes(self, planes: Floats) -> Floats:
        return self.forward(np.clip(self._mixed_planes(planes), 0, self.white))

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        light = self._mixed_planes(planes)
        clipped = np.minimum(np.maximum(light, 0), self.white)
        encoded, slopes = self.with_derivative(clipped)
        slopes *= clipped == light
        if self.matrix is None:
            return encoded, slopes
        return encoded, slopes[:, None] * self.matrix.astype(slopes.dtype)[..., None]

    def _mixed_planes(self, planes: Floats) -> Floats:
        return planes if self.matrix is None else self.matrix.astype(planes.dtype) @ planes

    def _mixed(self, image: Floats) -> Floats:
        return image if self.matrix is None else image @ self.matrix.T.astype(image.dtype)


def _srgb_with_derivative(light: Floats) -> tuple[Floats, Floats]:
    power = 1.055 * light ** (1 / 2.4)
    dark = light <= 0.0031308
    slope = power / (2.4 * np.maximum(light, 1e-6))
    power -= 0.055
    np.multiply(light, 12.92, out=power, where=dark)
    slope[dark] = 12.92
    return power, slope


def _linear_with_derivative(light: Floats) -> tuple[Floats, Floats]:
    return light, np.ones_like(light)


# Narkowicz, ACES Filmic Tone Mapping Curve (2016): y = x (a x + b) / (x (c x + d) + e), a fit to
# the curve of the ACES reference transforms. It reaches 1 at `_FILMIC_WHITE`.
_A, _B, _C, _D, _E = 2.51, 0.03, 2.43, 0.59, 0.14
_FILMIC_WHITE = ((_D - _B) + math.sqrt((_D - _B) ** 2 + 4 * (_A - _C) * _E)) / (2 * (_A - _C))


def _filmic(light: Floats) -> Floats:
    toned = light * (_A * light + _B) / (light * (_C * light + _D) + _E)
    return encode_display(toned)


def _filmic_inverse(display: Floats) -> Floats:
    y = decode_display(display)
    # The positive root of (a - c y) x² - (d y - b) x - e y = 0, in a form without cancellation.
    square, linear, constant = _A - _C * y, _D * y - _B, _E * y
    root = np.sqrt(linear**2 + 4 * square * constant)
    with_derivative = (linear + root) / (2 * square)
    falling = 2 * constant / np.where(linear < 0, root - linear, 1)
    return np.asarray(np.where(linear < 0, falling, with_derivative))


def _filmic_with_derivative(light: Floats) -> tuple[Floats, Floats]:
    below = light * (_C * light + _D) + _E
    above = light * (_A * light + _B)
    encoded, slope = _srgb_with_derivative(np.minimum(above / below, 1))
    steep = ((2 * _A * light + _B) * below - above * (2 * _C * light + _D)) / below**2
    return encoded, slope * steep


class _Sigmoid:
    """AgX's curve: a power of a hyperbola on each side of a pivot, 0 at 0 and 1 at 1.

    Sobotka, AgX (2022), after Siragusano's tunable sigmoid; contrast 2, toe 3, shoulder 3.25. On a
    side with width a and height b the curve is y = h(s v) / s with h(u) = u / (1 + u^p)^(1/p),
    where s is chosen so that it meets the end point.
    """

    pivot = (-AGX_STOPS[0] / (AGX_STOPS[1] - AGX_STOPS[0]), 0.5)
    contrast = 2.0
    powers = (3.0, 3.25)

    def __init__(self) -> None:
        (x, y), k = self.pivot, self.contrast
        self.scales = tuple(
            ((k * a) ** -p * ((k * a / b) ** p - 1)) ** (-1 / p)
            for a, b, p in ((x, y, self.powers[0]), (1 - x, 1 - y, self.powers[1]))
        )

    def forward(self, x: Floats) -> Floats:
        return self.with_derivative(x)[0]

    def inverse(self, y: Floats) -> Floats:
        (start, end), (toe, shoulder) = self.pivot, zip(self.scales, self.powers, strict=True)
        below = start - self._run(np.maximum(end - y, 0), *toe)
        above = start + self._run(np.maximum(y - end, 0), *shoulder)
        return np.where(y < end, below, above)

    def with_derivative(self, x: Floats) -> tuple[Floats, Floats]:
        """Return `forward` and its derivative."""
        below = x < self.pivot[0]
        scale, power = (np.where(below, *ends) for ends in (self.scales, self.powers))
        # Keep float32 if x is float32.
        scale, power = scale.astype(x.dtype), power.astype(x.dtype)
        run = self.contrast * (x - self.pivot[0])
        u = np.abs(run) / scale
        growth = 1 + u**power
        root = growth ** (-1 / power)
        return self.pivot[1] + run * root, self.contrast * root / growth

    def _run(self, away: Floats, scale: float, power: float) -> Floats:
        h = away / scale
        return np.asarray(scale / self.contrast * h / (1 - h**power) ** (1 / power))


_SIGMOID = _Sigmoid()
_AGX_LOW, _AGX_HIGH = (math.log2(MIDDLE_GREY) + stops for stops in AGX_STOPS)
_AGX_RANGE = _AGX_HIGH - _AGX_LOW


def _agx_log(light: Floats) -> Floats:
    return np.asarray(
        np.clip((np.log2(np.maximum(light, 2.0**_AGX_LOW)) - _AGX_LOW) / _AGX_RANGE, 0, 1)
    )


def _agx(light: Floats) -> Floats:
    return _SIGMOID.forward(_agx_log(light))


def _agx_inverse(display: Floats) -> Floats:
    light = np.exp2(_SIGMOID.inverse(display) * _AGX_RANGE + _AGX_LOW)
    # The curve reaches 0 at 10 stops below middle grey, but painted black means no light.
    return np.where(display > 0, light, 0)


def _agx_with_derivative(light: Floats) -> tuple[Floats, Floats]:
    encoded, slope = _SIGMOID.with_derivative(_agx_log(light))
    above = light >= 2.0**_AGX_LOW
    slope *= above
    slope /= np.where(above, light, 1) * (math.log(2) * _AGX_RANGE)
    return encoded, slope


#: The built-in curves by name.
BUILT_IN = {
    "srgb": Curve(encode_display, decode_display, _srgb_with_derivative),
    "linear": Curve(lambda x: x, lambda x: x, _linear_with_derivative),
    "filmic": Curve(_filmic, _filmic_inverse, _filmic_with_derivative, _FILMIC_WHITE),
    "agx": Curve(_agx, _agx_inverse, _agx_with_derivative, 2.0**_AGX_HIGH, AGX_INSET),
}
