"""The wishes in a painting without layers: its strokes, and places that ask for something else.

A person who repaints a whole picture darker and three figures in it brighter has asked for four
things. They lie in one picture; what tells them apart is what is asked: the ratio of the painting
to the current look, in stops of each channel. But a stroke on part of the picture asks for one
thing as long as one colour, or one gain, laid over the look explains it.

One soft stroke of blue over a vase and the wall behind it asks for one thing. Its ratio to the look
is not uniform: it falls off to the rim, and over the dark vase it is larger than over the wall.
What is uniform is the stroke.

Eight bits end at the white of a display, so a wash that makes a room warmer ends there at a lamp
that is white already. Read as it stands, that place asks for less than the paint around it: a wish
that nobody had. Such paint means at least its light, so it asks for the change that the rest of its
layer does where that is more.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from hashlib import blake2b
from math import ceil
from threading import Lock

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, in_any_channel
from lightpaint.colour import LUMINANCE, decode_display, encode_display
from lightpaint.images import block_sums, dilated, enlarged, gaussian_mean, number_parts
from lightpaint.progress import cancellation_check
from lightpaint.target.painted_target import Target, Wish

#: Stops by which a place must ask for something else than what is around it, to be a wish.
DISTINCT_STOPS = 0.5

#: Least share of the picture of a wish, and largest share of the paint of one within other paint.
MIN_SHARE, MAX_INNER_SHARE = 0.001, 0.5

#: Largest share of the picture that one stroke of a brush covers.
MAX_STROKE_SHARE = 0.5

#: Largest number of wishes in one layer; places that ask for less stay with their surroundings.
MAX_WISHES = 8

#: Radius over which the ratio is averaged, and that joins strokes, in widths of the picture.
SMOOTHING, JOINING = 1 / 160, 1 / 80

#: Least radius of averaging, in pixels: single pixels of the look are noisy, as the painting's are
#: not.
MIN_RADIUS = 2.0

#: Quantile of the amounts in a place, softened by the wash at its border, that is the one within.
WITHIN = 0.7

#: Light below which a ratio says little, relative to the mean of the look.
DARK = 0.01

#: Pixels, about, over which strokes are separated; larger pictures are averaged. Coarser ones grow
#: neighbouring pools of light together.
MAX_PIXELS = 2**14

#: Importance, or coverage, that counts as painted.
PAINTED = 0.02

#: Coverage, relative to the largest of a wish, from which a pixel is within one of its places: soft
#: edges of two places meet.
WITHIN_PLACE = 0.5

#: Least share of a wish of one of its places: smaller ones are crumbs.
PLACE_SHARE = 0.1

#: Number of layers whose strokes are remembered: under the brush all but a few stay as they are.
MAX_REMEMBERED = 2**8

#: Weight that holds the colour of a stroke near what is painted, where the look alone does not tell
#: how much of it covers; relative to all changes.
HOLD = 1e-3


#: Share of a stroke that it need not explain.
NEGLIGIBLE = 0.01

Encoding = Callable[[Floats], Floats]
Wash = Callable[[Floats], Doubles]

#: Values in which brushes mix, from linear light and back: editors of 8-bit pictures mix display
#: values, editors of EXR files mix light.
SPACES: tuple[tuple[Encoding, Encoding], ...] = (
    (encode_display, decode_display),
    (np.asarray, np.asarray),
)

#: Coverage from which a pixel belongs to a layer, and the approximate number of pixels of one that
#: are compared.
COVERED, SAMPLES = 0.5, 2**14


def find_wishes(target: Target, current_look: Floats) -> tuple[Wish, ...]:
    """Return the wishes of a painting, the lowest first, each stroke by itself.

    current_look: (h, w, 3) linear, the current look at the size of the target. The areas of all
    wishes together add up to at most 1 in each pixel.
    """
    layers = target.wishes or (
        Wish(target.name, np.minimum(target.importance, 1), has_strokes=True),
    )
    image = extend_saturated(target, current_look)
    return split_wishes(layers, image, target.importance, current_look)


def split_wishes(
    layers: Sequence[Wish], image: Floats, importance: Floats, current_look: Floats
) -> tuple[Wish, ...]:
    """Return layers with their separate strokes as wishes of their own, the lowest first.

    image, current_look: (h, w, 3) linear, painted and now; importance: (h, w).
    """
    if not any(layer.has_strokes for layer in layers):
        return tuple(layers)
    height, width = importance.shape
    side = max(1, ceil((height * width / MAX_PIXELS) ** 0.5))
    small = partial(_block_means, side=side)
    small_importance = small(importance)
    painting = _Painting(small(image), small_importance, small(current_look))
    wishes: list[Wish] = []
    check = cancellation_check()
    for layer in layers:
        check()
        if not layer.has_strokes:
            wishes.append(layer)
            continue
        owners, count = _REMEMBERED.owners(
            (small(layer.area) >= PAINTED) & (small_importance > 0), painting
        )
        places = enlarged(owners, side)[:height, :width]
        parts = (np.where(places == k, layer.area, 0) for k in range(1, count + 1))
        found = [replace(layer, area=part.astype(np.float32)) for part in parts]
        wishes += found or [layer]
    return tuple(wishes)


def number_places(area: Doubles) -> Indices:
    """Return the number of the separate place of a wish to which each pixel belongs, (h, w).

    area: (h, w), from 0 to 1. 0 is for pixels outside of its largest `MAX_WISHES` places, and for
    all if it has only one.
    """
    mask = area > WITHIN_PLACE * max(float(area.max(initial=0)), PAINTED)
    radius = round(JOINING * area.shape[1])
    least = max(MIN_SHARE * area.size, PLACE_SHARE * float(mask.sum()))
    places = _connected(mask, radius, least)
    numbers = np.zeros(area.shape, np.intp)
    if len(places) > 1:
        for k, place in enumerate(sorted(places, key=lambda x: -int(x.sum()))[:MAX_WISHES]):
            numbers[place] = k + 1
    return numbers


@dataclass(frozen=True)
class _Painting:
    """A painting without layers: its image and the current look, (h, w, 3) linear, its importance,
    (h, w).
    """

    image: Floats
    importance: Floats
    look: Floats

    def digest(self, painted: Bools) -> bytes:
        """Return a digest of all that the strokes of a layer, (h, w), follow from."""
        mean = np.mean(self.look)
        is_local = mean > 0 and painted.mean() <= MAX_STROKE_SHARE
        where = painted if is_local else np.ones_like(painted)
        read = painted, self.image[where], self.look[where], self.importance[where], mean
        digest = blake2b(repr(painted.shape).encode(), digest_size=16)
        for values in read:
            digest.update(np.ascontiguousarray(values).tobytes())
        return digest.digest()

    @cached_property
    def ratio(self) -> Floats:
        """See `asked_ratio`."""
        return asked_ratio(self.image, self.importance, self.look)

    @cached_property
    def channels(self) -> tuple[Floats, Floats]:
        """The image and the look, (3, h, w)."""
        return self.image.transpose(2, 0, 1), self.look.transpose(2, 0, 1)

    def beyond(self, stroke: Bools) -> Floats:
        """Return by how many stops of each channel, (3, h, w), a place asks for something else than
        the stroke, (h, w), that it is in.
        """
        dark = DARK * float(np.mean(self.look))
        if dark > 0 and stroke.mean() <= MAX_STROKE_SHARE:
            radius = _wash_radius(stroke.shape[1])
            departure = departure_from_one_stroke(
                stroke, *self.channels, dark, radius, DISTINCT_STOPS
            )
            # Within a wash of its rim a stroke may end as sharply as it likes.
            within = ~dilated(~stroke, round(radius))
            return np.asarray(departure * within)
        usual = np.median(self.ratio[:, stroke], axis=1)
        return np.asarray(self.ratio - usual[:, None, None].astype(np.float32))


def asked_ratio(image: Floats, importance: Floats, current_look: Floats) -> Floats:
    """Return what is asked for in stops of each channel, (3, h, w) float32, as a wash.

    For the arguments see `split_wishes`. 0 where the painting is the look, or where both are black.
    """
    dark = DARK * float(np.mean(current_look))
    if not dark > 0:
        return np.zeros((3, *importance.shape), np.float32)
    asked, now = (
        np.maximum(x.transpose(2, 0, 1), 0, dtype=np.float32) + np.float32(dark)
        for x in (image, current_look)
    )
    counts = (importance > 0).astype(np.float32)
    stops = np.log2(asked / now) * counts
    summed = np.concatenate([stops, counts[None]])
    radius = _wash_radius(importance.shape[1])
    wash = gaussian_mean(summed, radius)
    return np.asarray(counts / np.maximum(wash[3], 1e-6) * wash[:3], np.float32)


def _wash_radius(width: int) -> float:
    return max(SMOOTHING * width, MIN_RADIUS)


def _owners(painted: Bools, painting: _Painting) -> tuple[npt.NDArray[np.uint8], int]:
    """Number the strokes of a layer, and the places in them that ask for something else.

    painted: (h, w), where the layer is. Returns the number of each pixel, (h, w), 0 for none, and
    the largest.
    """
    least = MIN_SHARE * painted.size
    strokes = _connected(painted, round(JOINING * painted.shape[1]), least)
    strokes = sorted(strokes, key=lambda x: -int(x.sum()))
    owners, count = np.zeros(painted.shape, np.uint8), 0
    for stroke in strokes[:MAX_WISHES]:
        count += 1
        owners[stroke] = count
        for place in _distinct_places(stroke, painting.beyond(stroke), least)[
            : max(MAX_WISHES - count, 0)
        ]:
            count += 1
            owners[place] = count
    return owners, count


class _RememberedStrokes:
    """The strokes of the layers that were looked at last, by what they follow from."""

    def __init__(self) -> None:
        self._found: OrderedDict[bytes, tuple[npt.NDArray[np.uint8], int]] = OrderedDict()
        self._lock = Lock()

    def owners(self, painted: Bools, painting: _Painting) -> tuple[npt.NDArray[np.uint8], int]:
        """Return the same as `_owners`."""
        key = painting.digest(painted)
        with self._lock:
            if key in self._found:
                self._found.move_to_end(key)
                return self._found[key]
        found = _owners(painted, painting)
        with self._lock:
            self._found[key] = found
            while len(self._found) > MAX_REMEMBERED:
                self._found.popitem(last=False)
        return found


_REMEMBERED = _RememberedStrokes()


def _block_means(image: Floats, *, side: int) -> Doubles:
    """Return means over blocks of pixels of an image, (h, w, …)."""
    if side == 1:
        return np.asarray(image, np.float64)
    counts = block_sums(np.ones(image.shape[:2]), side)
    return np.asarray(
        block_sums(image, side) / counts.reshape(*counts.shape, *[1] * (image.ndim - 2))
    )


def _distinct_places(stroke: Bools, beyond: Floats, least: float) -> list[Bools]:
    """Return connected places in a stroke that ask for something else than it, (h, w) each, those
    that ask for most first. beyond: see `_Painting.beyond`.
    """
    light = np.tensordot(LUMINANCE.astype(np.float32), beyond, 1)
    differs = np.abs(light) > DISTINCT_STOPS
    differs |= beyond.max(axis=0) - beyond.min(axis=0) > DISTINCT_STOPS
    amount = np.abs(beyond).sum(axis=0)
    places = [
        # At an edge a wash is half of the amount within.
        x & (amount > np.quantile(amount[x], WITHIN) / 2)
        for x in _connected(stroke & differs, 0, least)
    ]
    most = MAX_INNER_SHARE * stroke.sum()
    places = [x for x in places if x.sum() <= most]
    return sorted(places, key=lambda x: -float(amount[x].sum()))


def _connected(mask: Bools, radius: int, least: float) -> list[Bools]:
    """Return the connected parts of a mask of at least so many pixels, joined over gaps up to about
    twice a radius.
    """
    parts, count = number_parts(dilated(mask, radius))
    parts = np.where(mask, parts, 0)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)
    return [parts == k for k in range(1, count + 1) if sizes[k] >= least]


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
    counts = inside.astype(np.float64)
    coverage = np.maximum(gaussian_mean(counts, radius), 1e-6)

    def wash(values: Floats) -> Doubles:
        return np.asarray(gaussian_mean(values * counts, radius) / coverage)

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
        """Yield the departures from strokes that fit one half of the changes, separated by their
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


def extend_saturated(target: Target, current_look: Floats) -> Floats:
    """Return the painting, (h, w, 3) linear, with what its saturated values ask for at least.

    current_look: (h, w, 3) linear, the current look at the size of the target. Paint that lies over
    no look stays as it is. See `extend_marked`.
    """
    if target.at_least is None or not target.over_look:
        return target.image
    return extend_marked(
        target.image, target.importance, target.at_least, target.wishes, current_look
    )


def extend_marked(
    image: Floats,
    importance: Floats,
    at_least: Bools,
    layers: Sequence[Wish],
    current_look: Floats,
) -> Floats:
    """Return an image, (h, w, 3) linear, with what its values at the top of their range ask for.

    Such a value becomes the look times the median ratio of painting to look of the other pixels of
    its layer, where that is brighter; without layers, of all paint.

    importance: (h, w). at_least: (h, w, 3), where the values are. current_look: (h, w, 3) linear.
    """
    dark = DARK * float(np.mean(current_look))
    if not at_least.any() or not dark > 0:
        return image
    extended, painted, is_plain = image.copy(), importance > 0, ~in_any_channel(at_least)
    areas = (wish.area > COVERED for wish in layers) if layers else (painted,)
    check = cancellation_check()
    for area in areas:
        check()
        own = painted & area
        lifted = np.nonzero(own[..., None] & at_least)
        if not lifted[0].size:
            continue
        usual = _median_ratio(image, current_look, own & is_plain, dark)
        asked = (current_look[lifted] * usual[lifted[2]]).astype(np.float32)
        extended[lifted] = np.maximum(extended[lifted], asked)
    return extended


def _median_ratio(image: Floats, look: Floats, pixels: Bools, dark: float) -> Floats:
    """Return the median ratio of a painting to the look in `pixels`, (3,); 0 where there are none.

    dark: light that is added to both.
    """
    chosen = np.flatnonzero(pixels)
    if not chosen.size:
        return np.zeros(3, np.float32)
    chosen = chosen[:: 1 + chosen.size // SAMPLES]
    painted, now = (np.maximum(x.reshape(-1, 3)[chosen], 0) + dark for x in (image, look))
    return np.asarray(np.median(painted / now, axis=0), np.float32)
