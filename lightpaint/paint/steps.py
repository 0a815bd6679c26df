"""What is done in a session, step by step: paint, what is asked of lights, looks.

A step has what was before it and what is after it, so that it can be taken back and done again
without asking how it came about. The canvas is what the steps have made of the present look:
`painted_by` finds it from the last step backwards, since a pixel is as the last patch on it left
it, so that a long history costs no more than the patches that are still to be seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis

#: Light (rows, columns, 3) and importance (rows, columns) of one place, both float32.
Pixels = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]

#: Rows and columns of the picture, `(top, bottom, left, right)`, the ends not included.
Region = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False)
class Patch:
    """The pixels of one region, before a step and after it.

    region: (top, bottom, left, right). before, after: light and importance of its pixels.
    """

    region: Region
    before: Pixels
    after: Pixels


@dataclass(frozen=True, eq=False)
class Step:
    """One thing that was done, and can be taken back.

    kind: "stroke", "asked", "ties", "settings", "look_loaded", ...; whoever makes it knows more.
    label: what undo calls it. fields: plain values before and after, as JSON has them.
    patch: the pixels that it changed, or None.
    """

    kind: str
    label: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    patch: Patch | None = None


@dataclass(frozen=True, eq=False)
class KeptLook:
    """A look under a name. id: a number that no other look of the session has.

    fields: name, quality, time and the like, as JSON has them. arrays: image, importance, weights,
    thumbnail.
    """

    id: int
    fields: Mapping[str, Any]
    arrays: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Identity:
    """What a session is of: steps speak of its pixels, and of its lights by their names.

    scene: name of the scene or basis, for people. basis: what the basis says it was made of, which
    may change, as a scene does in which something was moved. size: (height, width). sensor: that
    it is seen through.
    """

    scene: str
    basis: str
    size: tuple[int, int]
    lights: tuple[str, ...]
    sensor: str = ""

    @classmethod
    def of(cls, basis: Basis) -> "Identity":
        """That of a session which paints on `basis`."""
        origin = basis.origin
        return cls(
            origin.scene, f"{origin.scene_identity} {origin.sensor}", basis.size, basis.names
        )


def painted_by(steps: Sequence[Step], start: Pixels) -> Pixels:
    """The canvas after `steps`, which began at `start`: light (h, w, 3), importance (h, w).

    The same as every patch put down in order; looks only at those that show.
    """
    image, importance = start[0].copy(), start[1].copy()
    is_open = np.ones(importance.shape, dtype=bool)
    for patch in (step.patch for step in reversed(steps)):
        if patch is None:
            continue
        top, bottom, left, right = patch.region
        here = np.s_[top:bottom, left:right]
        shows = is_open[here]
        if not shows.any():
            continue
        its_image, its_importance = patch.after
        image[here][shows] = its_image[shows]
        importance[here][shows] = its_importance[shows]
        is_open[here] = False
    return image, importance
