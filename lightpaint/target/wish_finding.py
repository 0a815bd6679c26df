"""The wishes in a painting without layers: its strokes, and places that ask for something else.

A person who repaints a whole picture darker and three figures in it brighter has asked for four
things. They lie in one picture; what tells them apart is what is asked: the ratio of the painting
to the current look, in stops of each channel. But a stroke on part of the picture asks for one
thing as long as one colour, or one gain, laid over the look explains it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import ceil

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import LUMINANCE
from lightpaint.images import block_sums, enlarged
from lightpaint.target.saturated_paint import extend_saturated
from lightpaint.target.stroke_model import departure_from_one_stroke
from lightpaint.target.target import Target
from lightpaint.target.wish import Wish

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

#: Pixels, about, over which strokes are told apart; larger pictures are averaged. Coarser ones grow
#: neighbouring pools of light together.
MAX_PIXELS = 2**14

#: Importance, or coverage, that counts as painted.
PAINTED = 0.02


def find_wishes(target: Target, current_look: Floats) -> tuple[Wish, ...]:
    """Return the wishes of a painting, the lowest first, with separate strokes told apart.

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
    """Return layers with their separate strokes told apart, the lowest first.

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
    for layer in layers:
        if not layer.has_strokes:
            wishes.append(layer)
            continue
        owners, count = _owners((small(layer.area) >= PAINTED) & (small_importance > 0), painting)
        places = enlarged(owners, side)[:height, :width]
        parts = (np.where(places == k, layer.area, 0) for k in range(1, count + 1))
        found = [replace(layer, area=part.astype(np.float32)) for part in parts]
        wishes += found or [layer]
    return tuple(wishes)


@dataclass(frozen=True)
class _Painting:
    """A painting without layers: its image and the current look, (h, w, 3) linear, its importance,
    (h, w).
    """

    image: Floats
    importance: Floats
    look: Floats

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
        from scipy.ndimage import binary_erosion

        dark = DARK * float(np.mean(self.look))
        if dark > 0 and stroke.mean() <= MAX_STROKE_SHARE:
            radius = _wash_radius(stroke.shape[1])
            departure = departure_from_one_stroke(
                stroke, *self.channels, dark, radius, DISTINCT_STOPS
            )
            # Within a wash of its rim a stroke may end as sharply as it likes.
            within = binary_erosion(stroke, iterations=round(radius), border_value=1)
            return np.asarray(departure * within)
        usual = np.median(self.ratio[:, stroke], axis=1)
        return np.asarray(self.ratio - usual[:, None, None].astype(np.float32))


def asked_ratio(image: Floats, importance: Floats, current_look: Floats) -> Floats:
    """Return what is asked for in stops of each channel, (3, h, w) float32, as a wash.

    For the arguments see `split_wishes`. 0 where the painting is the look, or where both are black.
    """
    from scipy.ndimage import gaussian_filter

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
    wash = gaussian_filter(summed, (0, radius, radius))
    return np.asarray(counts / np.maximum(wash[3], 1e-6) * wash[:3], np.float32)


def _wash_radius(width: int) -> float:
    return max(SMOOTHING * width, MIN_RADIUS)


def _owners(painted: Bools, painting: _Painting) -> tuple[npt.NDArray[np.int64], int]:
    """Number the strokes of a layer, and the places in them that ask for something else.

    painted: (h, w), where the layer is. Returns the number of each pixel, (h, w), 0 for none, and
    the largest.
    """
    least = MIN_SHARE * painted.size
    strokes = _connected(painted, round(JOINING * painted.shape[1]), least)
    strokes = sorted(strokes, key=lambda x: -int(x.sum()))
    owners, count = np.zeros(painted.shape, np.int64), 0
    for stroke in strokes[:MAX_WISHES]:
        count += 1
        owners[stroke] = count
        for place in _distinct_places(stroke, painting.beyond(stroke), least)[
            : max(MAX_WISHES - count, 0)
        ]:
            count += 1
            owners[place] = count
    return owners, count


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
    from scipy.ndimage import binary_dilation, label

    wide = binary_dilation(mask, iterations=radius) if radius > 0 else mask
    parts, count = label(wide, np.ones((3, 3)))
    parts = np.where(mask, parts, 0)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)
    return [parts == k for k in range(1, count + 1) if sizes[k] >= least]
