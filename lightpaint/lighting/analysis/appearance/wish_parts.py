"""The parts of a painting that delivery is measured for: wishes, layers and groups, with names; and
their washes, the patches of light that people compare, instead of pixels.

A wash is a picture as the display shows it, blurred by a fortieth of its width, so that noise, the
texture of paint and the edges of a brush vanish. The wash of an area contains no light from beside
it: it is B(a·x) / B(a) with the blur B, the area a and the picture x.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import ViewTransform, lab
from lightpaint.images import Objects, block_mean, fitting_factor
from lightpaint.lighting.analysis.appearance.display_difference import object_with_most
from lightpaint.lighting.problem import display_light
from lightpaint.target import Wish
from lightpaint.threads import one_thread

#: Standard deviation of the blur, relative to the width of the picture.
BLUR = 1 / 40

#: Largest side of the pictures before they are blurred.
MAX_SIDE = 160

#: L* from which a place is lit.
LIT = 5.0

#: A group of layers, a layer, or a part of a layer or of a painting without layers.
WishKind = Literal["wish", "layer", "group"]

#: Share of the picture from which an area lies in no ninth of it.
LARGE = 0.5

#: Share of an area that an object takes which tells it from other areas nearby.
FAIR_SHARE = 0.25

#: Names of the thirds of a picture, from the top and from the left.
ROWS, COLUMNS = ("top", "middle", "bottom"), ("left", "middle", "right")


class AreaWashes(NamedTuple):
    """The washes of an area.

    now, asked, got: (h, w, 3), light of the current look, the painting and the answer, white = 1.
    weight: (h, w), how much of the area lies there, in pixels of the picture; 0 where it is lit in
    none of the three.
    """

    now: Doubles
    asked: Doubles
    got: Doubles
    weight: Doubles

    @property
    def lit_pixels(self) -> float:
        """The lit part of the area, in pixels of the picture."""
        return float(self.weight.sum())


@dataclass(frozen=True)
class Washes:
    """The pictures of one view before they are blurred.

    light: (3, h, w, 3), of the current look, the painting and the answer, as the display shows
    them. share: (h, w), 0 where an emitter is in view and not painted. factor: pixels of the view
    along the side of one of these.
    """

    light: Doubles
    share: Doubles
    factor: int

    @staticmethod
    def of(
        now: Floats, asked: Floats, got: Floats, *, counts: Bools, transform: ViewTransform
    ) -> "Washes":
        """Return the washes of three pictures, (h, w, 3) linear each.

        counts: (h, w), the pixels that count. transform: of the display.
        """
        height, width = counts.shape
        factor = fitting_factor((height, width), -(-max(height, width) // MAX_SIDE))
        mask = counts.astype(np.float32)
        share = block_mean(mask, factor).astype(np.float64)
        safe = np.where(share > 0, share, 1)[..., None]
        means = [block_mean(mask[..., None] * x, factor) / safe for x in (now, asked, got)]
        return Washes(display_light(np.stack(means), transform), share, factor)

    @cached_property
    def whole(self) -> AreaWashes:
        """The washes of the whole view."""
        return self._washes(*self._whole_sums)

    def of_area(self, area: Floats) -> tuple[AreaWashes, AreaWashes]:
        """Return the washes of an area, (h, w) from 0 to 1 at the size of the view, and of the
        rest.
        """
        sums, weight = self._sums(block_mean(area, self.factor).astype(np.float64))
        whole_sums, whole_weight = self._whole_sums
        rest = np.maximum(whole_sums - sums, 0), np.maximum(whole_weight - weight, 0)
        return self._washes(sums, weight), self._washes(*rest)

    @cached_property
    def _whole_sums(self) -> tuple[Doubles, Doubles]:
        return self._sums(np.ones(self.share.shape))

    @cached_property
    def _blurs(self) -> tuple[Doubles, Doubles]:
        height, width = self.share.shape
        return _blur_matrix(height, BLUR * width), _blur_matrix(width, BLUR * width)

    def _sums(self, area: Doubles) -> tuple[Doubles, Doubles]:
        """Return B(a·x) of the three pictures, (3, h', w', 3), and B(a), (h', w')."""
        rows, columns = self._blurs
        counted = area * self.share
        # One channel after the other, which takes a fifth of the time of one array of all.
        channels = np.ascontiguousarray(np.moveaxis(self.light, -1, 0)) * counted
        planes = [counted, *channels.reshape(-1, *counted.shape)]
        with one_thread():
            weight, *blurred = [rows @ plane @ columns.T for plane in planes]
        sums = np.reshape(blurred, (3, 3, *blurred[0].shape))
        return np.moveaxis(sums, 0, -1), weight

    def _washes(self, sums: Doubles, weight: Doubles) -> AreaWashes:
        known = weight > 1e-6
        now, asked, got = sums / np.where(known, weight, 1)[..., None]
        brightest = np.max([now, asked, got], axis=0)
        is_lit = known & (lab(brightest)[..., 0] >= LIT)
        return AreaWashes(now, asked, got, self.factor**2 * np.where(is_lit, weight, 0))


def _blur_matrix(length: int, sigma: float) -> Doubles:
    """Return the matrix that blurs values, (length,), and samples them once per `sigma`.

    It keeps their sum.
    """
    step = max(int(sigma), 1)
    samples = np.arange((step - 1) / 2, length, step)
    kernel = np.exp(-0.5 * ((samples[:, None] - np.arange(length)) / max(sigma, step / 2)) ** 2)
    return np.asarray(kernel / kernel.sum(axis=0))


@dataclass(frozen=True, eq=False)
class WishPart:
    """A wish, a layer or a group. area: (h, w) from 0 to 1; the other fields as in `Delivery`."""

    name: str
    area: Floats
    layers: tuple[int, ...]
    group: str
    kind: WishKind


def wish_parts(wishes: Sequence[Wish], objects: Objects | None) -> list[WishPart]:
    """Return the wishes, each layer of several after its wishes, and each group after its layers.

    objects: of the picture, by which parts of a layer are named.
    """
    parts: list[WishPart] = []
    names = _names(wishes, objects)
    for k, (wish, name) in enumerate(zip(wishes, names, strict=True)):
        later, layer = wishes[k + 1 :], wish.layer
        siblings = [x for x in wishes if layer is not None and x.layer == layer]
        layers = () if layer is None else (layer,)
        kind: WishKind = "layer" if len(siblings) == 1 else "wish"
        parts.append(WishPart(name, wish.area, layers, wish.group, kind))
        if len(siblings) > 1 and all(x.layer != layer for x in later):
            parts.append(WishPart(wish.name, _joint_area(siblings), layers, wish.group, "layer"))
        if wish.group and all(x.group != wish.group for x in later):
            members = [x for x in wishes if x.group == wish.group]
            ids = tuple(dict.fromkeys(x.layer for x in members if x.layer is not None))
            parts.append(WishPart(wish.group, _joint_area(members), ids, wish.group, "group"))
    return parts


def _joint_area(wishes: Sequence[Wish]) -> Floats:
    return np.asarray(np.minimum(np.sum([wish.area for wish in wishes], axis=0), 1))


def _names(wishes: Sequence[Wish], objects: Objects | None) -> list[str]:
    """Return names that differ: `Strokes, vase` for a part of a layer; only the place, with a
    capital, for a part of a painting without layers. Parts in one ninth of the picture are
    distinguished apart by what is in them, `Right (vase)`, or by numbers.
    """
    counts = Counter((wish.layer, wish.name) for wish in wishes)
    is_part = [counts[wish.layer, wish.name] > 1 for wish in wishes]
    names = [
        _part_name(wish, objects) if part else wish.name
        for wish, part in zip(wishes, is_part, strict=True)
    ]
    alike = Counter(names)
    if objects is not None:
        names = [
            _with_object(name, wish.area, objects) if part and alike[name] > 1 else name
            for name, wish, part in zip(names, wishes, is_part, strict=True)
        ]
    seen: Counter[str] = Counter()
    for k, name in enumerate(names):
        seen[name] += 1
        if is_part[k] and seen[name] > 1:
            names[k] = f"{name} ({seen[name]})"
    return names


def _part_name(wish: Wish, objects: Objects | None) -> str:
    place = _place_name(wish.area, objects)
    return f"{place[:1].upper()}{place[1:]}" if wish.layer is None else f"{wish.name}, {place}"


def _with_object(name: str, area: Floats, objects: Objects) -> str:
    """Return a name with the object that takes most of the area, if one takes a fair part of it;
    with the part of the picture, if the name has this object.
    """
    index = objects.index.ravel().astype(np.intp)
    weights = area.ravel().astype(np.float64)
    found = object_with_most(objects, index, weights, least=FAIR_SHARE).replace("_", " ").strip()
    if found and name.lower().endswith(found.lower()):
        found = _ninth(area)
    return f"{name} ({found})" if found else name


def _place_name(area: Floats, objects: Objects | None) -> str:
    """Return where an area, (h, w), lies: `vase` for an object, `top left` for a ninth."""
    if area.mean() > LARGE:
        return "most of the picture"
    if objects is not None:
        index = objects.index.ravel().astype(np.intp)
        if name := object_with_most(objects, index, area.ravel().astype(np.float64)):
            return name.replace("_", " ").strip()
    return _ninth(area)


def _ninth(area: Floats) -> str:
    """Return the ninth of the picture in which an area, (h, w), lies: `top left`."""
    total = max(float(area.sum()), 1e-12)
    centers = [
        float(area.sum(axis=1 - axis) @ np.arange(length)) / total / length
        for axis, length in enumerate(area.shape)
    ]
    row, column = (min(int(3 * center), 2) for center in centers)
    if row == 1:
        return COLUMNS[column]
    return ROWS[row] if column == 1 else f"{ROWS[row]} {COLUMNS[column]}"
