"""What is done in a session, step by step: paint, what is asked of lights, looks.

A step has what was before it and what is after it, so that it can be taken back and done again
without asking how it came about. The canvas is what the steps have made of the present look:
`painted_by` finds it from the last step backwards, since a pixel is as the last patch on it left
it, so that a long history costs no more than the patches that are still to be seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices


@dataclass(frozen=True, eq=False)
class Patch:
    """The pixels of one region of a view, before a step and after it.

    region: (top, bottom, left, right). before, after: its pixels. view: by its place in the
    session.
    """

    region: Region
    before: Pixels
    after: Pixels
    view: int = 0


@dataclass(frozen=True, eq=False)
class Step:
    """One thing that was done, and can be taken back.

    kind: "stroke", "asked" (of lights, ties, settings) or "look_loaded". label: what undo
    calls it. fields: plain values before and after, as JSON has them. patches: the pixels that it
    changed, of one view or several.
    """

    kind: str
    label: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    patches: tuple[Patch, ...] = ()


@dataclass(frozen=True, eq=False)
class KeptLook:
    """A look under a name. id: a number that no other look of the session has.

    fields: its name, when it was kept (`stamp`, seconds since 1970) and the wishes, as JSON
    has them. arrays: weights, and of each view image, importance, `at_least` (uint8, where it is so
    anywhere) and thumbnail, called as `of_view` says.
    """

    id: int
    fields: Mapping[str, Any]
    arrays: Mapping[str, npt.NDArray[Any]]


def of_view(name: str, view: int) -> str:
    """What something of a view is called: by its name alone of the first, `name@1` of the next."""
    return name if view == 0 else f"{name}@{view}"


@dataclass(frozen=True)
class SeenFrom:
    """What a view is. sensor: that it is seen through, "" where nobody knows. size: (height, width)
    of its picture.
    """

    sensor: str
    size: tuple[int, int]


@dataclass(frozen=True)
class Identity:
    """What a session is of: steps speak of pixels of its views, and of its lights by their names.

    scene: name of the scene or basis, for people. basis: what the basis says it was made of, which
    may change, as a scene does in which something was moved.
    """

    scene: str
    basis: str
    lights: tuple[str, ...]
    views: tuple[SeenFrom, ...]

    @classmethod
    def of(cls, bases: Sequence[Basis]) -> "Identity":
        """That of a session which paints on `bases`, of one view each."""
        origin, names = bases[0].origin, bases[0].names
        views = tuple(SeenFrom(basis.origin.sensor, basis.size) for basis in bases)
        return cls(origin.scene, f"{origin.scene_identity} {origin.sensor}", names, views)

    @property
    def largest(self) -> int:
        """Pixels of its largest view."""
        return max(prod(view.size) for view in self.views)


def painted_by(steps: Sequence[Step], start: Pixels, view: int = 0) -> Pixels:
    """The canvas of a view after `steps`, which began at `start`.

    The same as every patch put down in order; looks only at those that show.
    """
    image, importance, at_least = start.copy()
    is_open = np.ones(importance.shape, dtype=bool)
    for patch in (patch for step in reversed(steps) for patch in step.patches):
        if patch.view != view:
            continue
        here = slices(patch.region)
        shows = is_open[here]
        if not shows.any():
            continue
        after = patch.after
        image[here][shows] = after.image[shows]
        importance[here][shows] = after.importance[shows]
        if after.at_least is not None:
            at_least = np.zeros(image.shape, bool) if at_least is None else at_least
            at_least[here][shows] = after.at_least[shows]
        is_open[here] = False
    return Pixels(image, importance, at_least)
