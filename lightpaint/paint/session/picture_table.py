"""The pictures that a page fetches: planes of the lights, and what helps to see and to paint."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import PaintError
from lightpaint.report.page.figures import resized, thumbnail

#: Pixels of a thumbnail's longer side, about.
THUMBNAIL = 192

#: Points along each side of a lookup table, and the light, in stops, that its ends stand for.
SIDE, LOW, HIGH = 64, -13.0, 7.0

#: Built-in transforms that a page may show through.
TRANSFORMS = ("srgb", "filmic", "agx", "linear")

Picture = npt.NDArray[Any]


class Pictures:
    """Pictures by name, each with the number of its generation; made when they are first asked for.

    Updated in place. Names are those of the protocol: `plane/3`, `lut/agx`, `painting`, and of a
    view that is not the first `painting@1`.
    """

    def __init__(self) -> None:
        self.generations: dict[str, int] = {}
        self._counts: dict[str, int] = {}  # also of those that are withdrawn: none comes twice
        self._made: dict[str, Picture] = {}
        self._makers: dict[str, Callable[[], Picture]] = {}

    def offer(self, name: str, make: Callable[[], Picture]) -> None:
        """From now on there is this picture; what it was before is gone."""
        self.generations[name] = self._counts[name] = self._counts.get(name, 0) + 1
        self._makers[name] = make
        self._made.pop(name, None)

    def put(self, name: str, picture: Picture) -> None:
        """The same, of one that is made already."""
        self.offer(name, lambda: picture)

    def withdraw(self, name: str) -> None:
        """There is none from now on."""
        self.generations.pop(name, None)
        self._makers.pop(name, None)
        self._made.pop(name, None)

    def __getitem__(self, name: str) -> Picture:
        """The picture of that name. Raises PaintError if there is none."""
        make = self._makers.get(name)
        if make is None:
            raise PaintError(f"there is no picture {name[:40]!r}")
        if is_changing(name):
            return make()
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    def named(self) -> dict[str, int]:
        """Generation of each, by name; of what changes under the brush there are none."""
        return {name: k for name, k in self.generations.items() if not is_changing(name)}


def is_changing(name: str) -> bool:
    """Whether it is a picture that changes under the brush."""
    return name.partition("@")[0] in ("painting", "importance")


def small(basis: Basis, k: int) -> Picture:
    """A thumbnail of what light k does, as a display shows it."""
    picture, _ = thumbnail(basis.planes.plane(k), basis.emitters_seen)
    return np.round(picture * 255).astype(np.uint8)


def small_picture(light: Floats, transform: ViewTransform) -> Picture:
    """A thumbnail of a picture (h, w, 3), as a display shows it."""
    factor = min(1, THUMBNAIL / max(light.shape[:2]))
    shown = transform.encode(resized(light, factor) if factor < 1 else light)
    return np.round(shown * 255).astype(np.uint8)


def table_of(transform: ViewTransform) -> Picture:
    """(SIDE, SIDE, SIDE, 3), display values over the logarithm of light, from LOW to HIGH stops.

    The first point of each axis is black, the next stands for LOW + (HIGH - LOW) / (SIDE - 1).
    """
    axis = 2.0 ** np.linspace(LOW, HIGH, SIDE)
    axis[0] = 0.0
    r, g, b = np.meshgrid(axis, axis, axis, indexing="ij")
    light = np.stack([r, g, b], axis=-1).reshape(1, -1, 3)
    shown = transform.encode(light).reshape(SIDE, SIDE, SIDE, 3)
    return np.asarray(shown, np.float16)
