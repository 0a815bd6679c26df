"""The history of a session: steps of paint, requests and looks.

A step has the state before it and after it, so that it can be undone and redone without knowing how
it came about. The canvas is the present look with all steps applied: `replay` works from the last
step backwards, since a pixel is as the last patch on it left it, so that a long history costs no
more than the patches that still show.
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

    region: (top, bottom, left, right). before, after: its pixels. view: index in the session.
    """

    region: Region
    before: Pixels
    after: Pixels
    view: int = 0


@dataclass(frozen=True, eq=False)
class Step:
    """A change that can be undone.

    kind: "stroke", "asked" (of lights, ties, settings) or "look_loaded". label: shown by undo.
    fields: plain JSON values before and after. patches: the changed pixels, of one view or several.
    """

    kind: str
    label: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    patches: tuple[Patch, ...] = ()


@dataclass(frozen=True, eq=False)
class StoredLook:
    """A named look. id: a number that no other look of the session has.

    fields: its name, when it was kept (`stamp`, seconds since 1970) and the requests, as JSON.
    arrays: weights, and of each view image, importance, `at_least` (uint8, if any mark is set) and
    thumbnail, named by `name_in_view`.
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


def replay(steps: Sequence[Step], start: Pixels, view: int = 0) -> Pixels:
    """Return the canvas of a view after `steps`, which began at `start`.

    The result equals every patch put down in order; only patches that show are read.
    """
    image, importance, at_least = start.copy()
    is_open = np.ones(importance.shape, dtype=bool)
    for patch in (patch for step in reversed(steps) for patch in step.patches):
        if patch.view != view:
            continue
        area = slices(patch.region)
        is_visible = is_open[area]
        if not is_visible.any():
            continue
        after = patch.after
        image[area][is_visible] = after.image[is_visible]
        importance[area][is_visible] = after.importance[is_visible]
        if after.at_least is not None:
            at_least = np.zeros(image.shape, bool) if at_least is None else at_least
            at_least[area][is_visible] = after.at_least[is_visible]
        is_open[area] = False
    return Pixels(image, importance, at_least)
