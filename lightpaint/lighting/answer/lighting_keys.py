"""Lights that change over the frames of a shot: keys at painted frames, and curves between them.

A curve is a cubic Hermite spline that is monotone between its keys (Fritsch & Carlson 1980), so
that no light overshoots, or becomes negative. Before the first and after the last key it rests.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lightpaint.arrays import RGB, Doubles
from lightpaint.errors import LightingError
from lightpaint.validation import BRIGHTEST, is_amount

#: Largest absolute frame number that a key may have, and most frames from the first to the last.
MAX_FRAME, MAX_SPAN = 10**9, 10**5


@dataclass(frozen=True)
class LightingKey:
    """The lights at one frame.

    frame: its number. weights: RGB of each light, in the order of the lighting. target: name of its
    painting.
    """

    frame: int
    weights: tuple[RGB, ...]
    target: str = ""

    def __post_init__(self) -> None:
        if abs(self.frame) > MAX_FRAME:
            raise LightingError(f"a key has the frame {self.frame}: at most {MAX_FRAME}")
        if not all(is_amount(value) for rgb in self.weights for value in rgb):
            raise LightingError(
                f"the key of frame {self.frame} has a weight that is not a number from 0 to "
                f"{BRIGHTEST:g}"
            )


def weights_at(keys: Sequence[LightingKey], frame: float) -> Doubles:
    """Return the weights (n, 3) at a frame, which may lie between two."""
    frames = [key.frame for key in keys]
    values = np.array([key.weights for key in keys], np.float64)
    if frame <= frames[0]:
        return np.asarray(values[0])
    if frame >= frames[-1]:
        return np.asarray(values[-1])
    k = bisect_right(frames, frame) - 1
    slopes, span = key_slopes(keys), frames[k + 1] - frames[k]
    t = (frame - frames[k]) / span
    start = values[k] * (1 + 2 * t) * (1 - t) ** 2 + slopes[k] * span * t * (1 - t) ** 2
    end = values[k + 1] * t**2 * (3 - 2 * t) + slopes[k + 1] * span * t**2 * (t - 1)
    # The curve is monotone, so only rounding can lead out of its keys.
    low, high = np.minimum(values[k], values[k + 1]), np.maximum(values[k], values[k + 1])
    return np.asarray(np.clip(start + end, low, high))


def key_slopes(keys: Sequence[LightingKey]) -> Doubles:
    """Return the slope of each curve at each key, per frame, (keys, n, 3).

    It is 0 at the ends and where the slopes of the two sides differ in sign, else their harmonic
    mean, weighted by the distances of the neighbours (Fritsch & Butland 1984).
    """
    values = np.array([key.weights for key in keys], np.float64)
    slopes = np.zeros_like(values)
    spans = np.diff([key.frame for key in keys]).astype(np.float64)
    sides = np.diff(values, axis=0) / spans[:, None, None]
    for k in range(1, len(keys) - 1):
        before, after = sides[k - 1], sides[k]
        first, second = 2 * spans[k] + spans[k - 1], spans[k] + 2 * spans[k - 1]
        is_turn = before * after <= 0
        safe = np.where(is_turn, 1, before), np.where(is_turn, 1, after)
        mean = (first + second) / (first / safe[0] + second / safe[1])
        slopes[k] = np.where(is_turn, 0, mean)
    return slopes


def key_span(keys: Sequence[LightingKey]) -> range:
    """Return all frames from the first key to the last."""
    return range(keys[0].frame, keys[-1].frame + 1)


def check_keys(keys: Sequence[LightingKey], count: int) -> None:
    """Raise LightingError unless keys are in order and have a weight for each of `count` lights."""
    frames = [key.frame for key in keys]
    if any(later <= earlier for earlier, later in pairwise(frames)):
        raise LightingError(f"the keys are of the frames {frames}: expected each once, in order")
    if frames and frames[-1] - frames[0] > MAX_SPAN:
        raise LightingError(f"the keys span more than {MAX_SPAN} frames: {frames[0]}-{frames[-1]}")
    for key in keys:
        if len(key.weights) != count:
            raise LightingError(
                f"the key of frame {key.frame} has {len(key.weights)} lights, the lighting {count}"
            )
