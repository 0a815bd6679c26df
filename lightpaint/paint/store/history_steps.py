"""The history of a session: steps of paint, requests and looks, and the pixels that they exchange.

A step has the state before it and after it, so that undo and redo need no other steps. Patches make
up the pixels of a layer. `replay` goes backwards from the last one, since the last patch on a pixel
decides its value, so that a long history costs no more than the patches still visible.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats
from lightpaint.basis import Basis

#: Rows and columns of the picture, `(top, bottom, left, right)`, the ends not included.
Region = tuple[int, int, int, int]


class Pixels(NamedTuple):
    """Paint in a region.

    image: (rows, columns, 3) float32, linear. importance: (rows, columns) float32. at_least: (rows,
    columns, 3), where brighter is as good, as in `Target`; None for nowhere.
    """

    image: npt.NDArray[np.float32]
    importance: npt.NDArray[np.float32]
    at_least: Bools | None = None

    @classmethod
    def unpainted(cls, image: Floats) -> "Pixels":
        """Return this light with nothing painted on it."""
        return cls(np.asarray(image, np.float32), np.zeros(image.shape[:2], np.float32))

    def part(self, region: Region) -> "Pixels":
        """Return the pixels of a region, as views of the same arrays."""
        area = slices(region)
        at_least = None if self.at_least is None else self.at_least[area]
        return Pixels(self.image[area], self.importance[area], at_least)

    def copy(self) -> "Pixels":
        """Return a copy; `at_least` is None where no mark is set."""
        at_least = self.at_least
        if at_least is not None:
            at_least = at_least.copy() if at_least.any() else None
        return Pixels(self.image.copy(), self.importance.copy(), at_least)

    def equals(self, other: "Pixels") -> bool:
        """Return whether both are equal, to the last bit."""
        if not all(np.array_equal(a, b) for a, b in zip(self[:2], other[:2], strict=True)):
            return False
        return equal_marks(self.at_least, other.at_least)


def mix_pixels(pair: tuple[Pixels, Pixels], shares: tuple[float, float]) -> Pixels:
    """Mix two paintings of a view, each weighted by its share and its importance."""
    counts = [share * pixels.importance for share, pixels in zip(shares, pair, strict=True)]
    total = counts[0] + counts[1]
    whole = np.where(total > 0, total, 1)[..., None]
    image = np.zeros((*total.shape, 3), np.float32)
    for count, pixels in zip(counts, pair, strict=True):
        image += (count[..., None] / whole * pixels.image).astype(np.float32)
    # A pixel is marked "at least" if it is in all paintings that count there.
    unsure = np.zeros(image.shape, bool)
    for count, pixels in zip(counts, pair, strict=True):
        fixed = True if pixels.at_least is None else ~pixels.at_least
        unsure |= fixed & (count > 0)[..., None]
    at_least = ~unsure & (total > 0)[..., None]
    return Pixels(image, total.astype(np.float32), at_least if at_least.any() else None)


def equal_marks(first: Bools | None, second: Bools | None) -> bool:
    """Return whether two paintings have the same "at least" marks; None for none."""
    if first is None or second is None:
        return not any(marks is not None and marks.any() for marks in (first, second))
    return np.array_equal(first, second)


def slices(region: Region) -> tuple[slice, slice]:
    """Return row and column slices, to index an array with."""
    top, bottom, left, right = region
    return slice(top, bottom), slice(left, right)


@dataclass(frozen=True, eq=False)
class Patch:
    """The pixels of one region of a view, before a step and after it.

    region: (top, bottom, left, right). before, after: its pixels. view: index in the session.
    layer: id of the layer whose pixels they are; 0 is the painting that names none, and -1 the
    selection.
    """

    region: Region
    before: Pixels
    after: Pixels
    view: int = 0
    layer: int = 0


@dataclass(frozen=True, eq=False)
class Step:
    """A change that can be undone.

    kind: "stroke", "layers", "selection", "requests" (of lights, ties, settings) or "look_loaded".
    label: shown by undo. fields: plain JSON: requests `before` and `after`, the change of the
    layers, `stack`, and the time, `stamp`, in seconds since 1970. patches: the changed pixels, of
    one view or several.
    """

    kind: str
    label: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    patches: tuple[Patch, ...] = ()

    @property
    def stamp(self) -> float | None:
        """Its time in seconds since 1970; None if the file does not tell."""
        stamp = self.fields.get("stamp")
        return float(stamp) if isinstance(stamp, int | float) else None


@dataclass(frozen=True, eq=False)
class StoredLook:
    """A named look. id: a number that no other look of the session has.

    fields: its name, when it was kept (`stamp`, seconds since 1970), the requests, the drives of
    lamps of emitters and, where there are several, the layers, as JSON. arrays: weights, and of
    each view image, importance, `at_least` (uint8, if any mark is set), thumbnail and the pixels of
    layers, named by `name_in_view`.
    """

    id: int
    fields: Mapping[str, Any]
    arrays: Mapping[str, npt.NDArray[Any]]


def name_in_view(name: str, view: int) -> str:
    """Return the name of a view's item: plain for the first view, `name@1` for the next."""
    return name if view == 0 else f"{name}@{view}"


@dataclass(frozen=True)
class ViewIdentity:
    """Identity of a view. sensor: its name, "" if unknown. size: (height, width) of its picture."""

    sensor: str
    size: tuple[int, int]


@dataclass(frozen=True)
class Identity:
    """Identity of a session: steps refer to pixels of its views, and to its lights by name.

    scene: name of the scene or basis, for people. basis: identity of the scene that the basis was
    made of; it may change, as when something in the scene moves.
    """

    scene: str
    basis: str
    lights: tuple[str, ...]
    views: tuple[ViewIdentity, ...]

    @classmethod
    def of(cls, bases: Sequence[Basis]) -> "Identity":
        """Return the identity of a session on `bases`, of one view each."""
        origin, names = bases[0].origin, bases[0].names
        views = tuple(ViewIdentity(basis.origin.sensor, basis.size) for basis in bases)
        return cls(origin.scene, f"{origin.scene_identity} {origin.sensor}", names, views)

    @property
    def max_pixels(self) -> int:
        """Pixels of its largest view."""
        return max(prod(view.size) for view in self.views)


def replay(patches: Sequence[Patch], start: Pixels, bounds: Region | None = None) -> Pixels:
    """Return the pixels after `patches`, which began at `start`.

    bounds: the region that `start` is of, which holds all patches; None for one from the corner.
    The result equals every patch put down in order; only patches that show are read.
    """
    image, importance, at_least = start.copy()
    down, right = (0, 0) if bounds is None else (bounds[0], bounds[2])
    is_open = np.ones(importance.shape, dtype=bool)
    for patch in reversed(patches):
        top, bottom, left, end = patch.region
        area = slices((top - down, bottom - down, left - right, end - right))
        is_visible = is_open[area]
        if not is_visible.any():
            continue
        after = patch.after
        if after.at_least is None and is_visible.all():  # as the only patch of a layer
            image[area], importance[area] = after.image, after.importance
            is_open[area] = False
            continue
        image[area][is_visible] = after.image[is_visible]
        importance[area][is_visible] = after.importance[is_visible]
        if after.at_least is not None:
            at_least = np.zeros(image.shape, bool) if at_least is None else at_least
            at_least[area][is_visible] = after.at_least[is_visible]
        is_open[area] = False
    return Pixels(image, importance, at_least)
