"""The curves that displays and tone mappers are built of: sRGB, linear, filmic and AgX's."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.display import decode_display, encode_display

#: AgX's log range, in stops about middle grey.
AGX_STOPS = (-10.0, 6.5)
MIDDLE_GREY = 0.18

#: AgX's inset: Rec.709's primaries seen in a space whose primaries lie 1/0.8 as far from white.
#: The row is each primary's share X + Y + Z of white.
AGX_INSET = 0.8 * np.eye(3) + 0.2 * np.array([0.211994645, 0.392150825, 0.395854530])


@dataclass(frozen=True)
class Curve:
    """One curve for each channel, after a matrix. forward and slope take light in [0, white]."""

    forward: Callable[[Floats], Floats]
    inverse: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats]
    white: float = 1.0
    matrix: Floats | None = None

    def encode(self, image: Floats) -> Floats:
        return np.clip(self.forward(np.clip(self._mixed(image), 0, self.white)), 0, 1)

    def decode(self, image_display: Floats) -> Floats:
        light = self.inverse(image_display)
        if self.matrix is None:
            return light
        return np.asarray(light @ np.linalg.inv(self.matrix).T.astype(light.dtype))

    def jacobian(self, image: Floats) -> Floats:
        light = self._mixed(image)
        shown = (light >= 0) & (light <= self.white)
        slope = np.where(shown, self.slope(np.clip(light, 0, self.white)), 0)
        matrix = np.eye(3) if self.matrix is None else self.matrix
        return np.asarray(slope[..., None] * matrix.astype(slope.dtype))

    def _mixed(self, image: Floats) -> Floats:
        return image if self.matrix is None else image @ self.matrix.T.astype(image.dtype)


def _srgb_slope(light: Floats) -> Floats:
    power = 1.055 / 2.4 * np.maximum(light, 1e-6) ** (1 / 2.4 - 1)
    return np.where(light <= 0.0031308, 12.92, power)


# Narkowicz, ACES Filmic Tone Mapping Curve (2016): y = x (a x + b) / (x (c x + d) + e), a fit of
# the curve of the ACES reference transforms. It reaches 1 at `_FILMIC_WHITE`.
_A, _B, _C, _D, _E = 2.51, 0.03, 2.43, 0.59, 0.14
_FILMIC_WHITE = ((_D - _B) + math.sqrt((_D - _B) ** 2 + 4 * (_A - _C) * _E)) / (2 * (_A - _C))


def _filmic(light: Floats) -> Floats:
    toned = light * (_A * light + _B) / (light * (_C * light + _D) + _E)
    return encode_display(toned)


def _filmic_inverse(display: Floats) -> Floats:
    y = decode_display(display)
    # The positive root of (a - c y) x² - (d y - b) x - e y = 0, in the form without cancellation.
    square, linear, constant = _A - _C * y, _D * y - _B, _E * y
    root = np.sqrt(linear**2 + 4 * square * constant)
    rising = (linear + root) / (2 * square)
    falling = 2 * constant / np.where(linear < 0, root - linear, 1)
    return np.asarray(np.where(linear < 0, falling, rising))


def _filmic_slope(light: Floats) -> Floats:
    below = light * (_C * light + _D) + _E
    above = light * (_A * light + _B)
    toned = above / below
    steep = ((2 * _A * light + _B) * below - above * (2 * _C * light + _D)) / below**2
    return np.asarray(_srgb_slope(toned) * steep)


class _Sigmoid:
    """AgX's curve: a power of a hyperbola on each side of a pivot, 0 at 0 and 1 at 1.

    Sobotka, AgX (2022), after Siragusano's tunable sigmoid; contrast 2, toe 3, shoulder 3.25.
    On a side that reaches a and rises to b, with y = h(s v) / s h(u) = u / (1 + u^p)^(1/p),
    s is such that h's end is met.
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
        return self._by_side(x, self.pivot[0], self.pivot[1], self._rise)

    def inverse(self, y: Floats) -> Floats:
        return self._by_side(y, self.pivot[1], self.pivot[0], self._run)

    def slope(self, x: Floats) -> Floats:
        away = np.abs(x - self.pivot[0])
        toe, shoulder = (
            self.contrast * (1 + (self.contrast * away / s) ** p) ** (-1 / p - 1)
            for s, p in zip(self.scales, self.powers, strict=True)
        )
        return np.asarray(np.where(x < self.pivot[0], toe, shoulder))

    def _rise(self, away: Floats, scale: float, power: float) -> Floats:
        u = self.contrast * away / scale
        return np.asarray(scale * u / (1 + u**power) ** (1 / power))

    def _run(self, away: Floats, scale: float, power: float) -> Floats:
        h = away / scale
        return np.asarray(scale / self.contrast * h / (1 - h**power) ** (1 / power))

    def _by_side(
        self, v: Floats, start: float, end: float, side: Callable[[Floats, float, float], Floats]
    ) -> Floats:
        toe = end - side(np.maximum(start - v, 0), self.scales[0], self.powers[0])
        shoulder = end + side(np.maximum(v - start, 0), self.scales[1], self.powers[1])
        return np.where(v < start, toe, shoulder)


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
    # Black is where the range ends, 10 stops below middle grey, and what is painted black is none.
    return np.where(display > 0, light, 0)


def _agx_slope(light: Floats) -> Floats:
    above = light >= 2.0**_AGX_LOW
    of_log = 1 / (np.where(above, light, 1) * math.log(2) * _AGX_RANGE)
    return np.where(above, _SIGMOID.slope(_agx_log(light)) * of_log, 0)


#: By the name that a person gives.
BUILT_IN = {
    "srgb": Curve(encode_display, decode_display, _srgb_slope),
    "linear": Curve(lambda x: x, lambda x: x, np.ones_like),
    "filmic": Curve(_filmic, _filmic_inverse, _filmic_slope, _FILMIC_WHITE),
    "agx": Curve(_agx, _agx_inverse, _agx_slope, 2.0**_AGX_HIGH, AGX_INSET),
}
