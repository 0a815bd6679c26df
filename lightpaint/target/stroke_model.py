"""A stroke as a brush makes it: one colour laid over the look, or one gain, that comes and fades.

A person who lays one soft stroke of blue over a vase and the wall behind it has asked for one
thing. Its ratio to the look is not uniform: it falls off to the rim, and over the dark vase it is
larger than over the wall. What is uniform is the stroke.
"""

from collections.abc import Callable, Iterator

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import decode_display, encode_display

#: Weight that holds the colour of a stroke near what is painted, where the look alone does not tell
#: how much of it covers; relative to all changes.
HOLD = 1e-3


#: Share of a stroke that it need not explain.
NEGLIGIBLE = 0.01

Encoding = Callable[[Floats], Floats]
Wash = Callable[[Floats], Doubles]

#: Values in which brushes mix, from linear light and back: editors of 8-bit pictures mix display
#: values, those of EXR files mix light.
SPACES: tuple[tuple[Encoding, Encoding], ...] = (
    (encode_display, decode_display),
    (np.asarray, np.asarray),
)


def departure_from_one_stroke(
    stroke: Bools, painted: Floats, look: Floats, dark: float, radius: float, tolerance: float
) -> Floats:
    """Return how far a painting departs from the best single stroke, in stops of each channel.

    stroke: (h, w), where it is. painted, look: (3, h, w) linear. dark: light that is added to both
    before they are compared. radius: of the wash over which the stroke may come and fade, in
    pixels. tolerance: departure up to which a stroke explains a pixel; the best explains most.
    Returns (3, h, w), 0 outside.
    """
    rows, columns = (
        slice(int(x[0]), int(x[-1]) + 1)
        for x in (np.flatnonzero(stroke.any(axis=1)), np.flatnonzero(stroke.any(axis=0)))
    )
    inside = stroke[rows, columns]
    wash = _wash(inside, radius)
    now, asked = (np.maximum(x[:, rows, columns], 0) for x in (look, painted))
    brushes: list[_Brush] = [_Blend(*space, inside, asked, now, dark, wash) for space in SPACES]
    brushes.append(_Gain(inside, asked, now, dark, wash))

    def unexplained(departure: Doubles) -> tuple[float, float]:
        stops = np.abs(departure[:, inside]).max(axis=0)
        return float((stops > tolerance).mean()), float(stops.mean())

    best = min((brush.departure(inside.astype(np.float64)) for brush in brushes), key=unexplained)
    if unexplained(best)[0] > NEGLIGIBLE:  # perhaps two strokes that touch
        halves = (x for brush in brushes for x in brush.halves())
        best = min((best, *halves), key=unexplained)
    result = np.zeros(painted.shape, np.float32)
    result[:, rows, columns] = inside * best
    return result


def _wash(inside: Bools, radius: float) -> Wash:
    """Return a function that averages (…, h, w) over a radius, within a mask alone."""
    from scipy.ndimage import gaussian_filter

    counts = inside.astype(np.float64)
    coverage = np.maximum(gaussian_filter(counts, radius), 1e-6)

    def washed(values: Floats) -> Doubles:
        around = (0,) * (values.ndim - 2) + (radius, radius)
        return np.asarray(gaussian_filter(values * counts, around) / coverage)

    return washed


class _Brush:
    """A kind of stroke, to be fitted to the change of values that it makes, (3, h, w)."""

    def __init__(self, inside: Bools, change: Doubles) -> None:
        self.inside = inside
        self.change = change
        self.changes = change[:, inside]

    def departure(self, weights: Doubles) -> Doubles:
        """Return the departure, (3, h, w), in stops, from the stroke that fits best by weights,
        (h, w).
        """
        raise NotImplementedError

    def halves(self) -> Iterator[Doubles]:
        """Yield the departures from strokes that fit one half of the changes, told apart by their
        directions.
        """
        lengths = np.sqrt(np.square(self.changes).sum(axis=0))
        directions = self.changes / (lengths + 1e-12)
        away = directions - (directions @ lengths / (lengths.sum() + 1e-12))[:, None]
        axis = np.linalg.eigh((away * lengths) @ away.T)[1][:, -1]
        side = axis @ away > 0
        for half in (side, ~side):
            weights = np.zeros(self.inside.shape)
            weights[self.inside] = half
            yield self.departure(weights)


class _Blend(_Brush):
    """A colour c over the look n: a c + (1 − a) n, with a from 0 to 1.

    encode, decode: to the values that are mixed, from linear light and back.
    """

    def __init__(
        self,
        encode: Encoding,
        decode: Encoding,
        inside: Bools,
        painted: Floats,
        look: Floats,
        dark: float,
        wash: Wash,
    ) -> None:
        self.decode, self.dark, self.wash = decode, dark, wash
        self.asked, self.now = wash(encode(painted)), wash(encode(look))
        super().__init__(inside, self.asked - self.now)

    def departure(self, weights: Doubles) -> Doubles:
        """See `_Brush.departure`."""
        to_color = self._color(weights)[:, None, None] - self.now
        toward = self.wash((to_color * self.change).sum(axis=0))
        cover = toward / (self.wash(np.square(to_color).sum(axis=0)) + 1e-12)
        model = self.now + np.clip(cover, 0, 1) * to_color
        asked, reached = (np.maximum(self.decode(x), 0) + self.dark for x in (self.asked, model))
        return np.asarray(np.log2(asked / reached))

    def _color(self, weights: Doubles) -> Doubles:
        """Return the colour: each changed pixel is on the line from its n to c, so c is the point
        nearest to all lines.
        """
        points, changes = self.asked[:, self.inside], self.changes
        weighted = weights[self.inside]
        amounts = weighted * np.square(changes).sum(axis=0)
        total = amounts.sum()
        hold = HOLD * total + 1e-12
        across = total * np.eye(3) - (changes * weighted) @ changes.T
        along = (changes * weighted) @ (changes * points).sum(axis=0)
        mean = points @ amounts / (total + 1e-12)
        return np.linalg.solve(across + hold * np.eye(3), points @ amounts - along + hold * mean)


class _Gain(_Brush):
    """A direction of gain, in stops, by amounts of at least 0."""

    def __init__(
        self, inside: Bools, painted: Floats, look: Floats, dark: float, wash: Wash
    ) -> None:
        self.wash = wash
        super().__init__(inside, wash(np.log2((painted + dark) / (look + dark))))

    def departure(self, weights: Doubles) -> Doubles:
        """See `_Brush.departure`."""
        lengths = np.sqrt(np.square(self.changes).sum(axis=0))
        direction = self.changes @ (weights[self.inside] * lengths)
        direction /= np.linalg.norm(direction) + 1e-12
        amount = np.maximum(self.wash(np.tensordot(direction, self.change, 1)), 0)
        return np.asarray(self.change - amount * direction[:, None, None])
