"""The painting of one view: its pixels, and the stroke that is not done yet."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import PaintError
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.paint.session.open_stroke import OpenStroke
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices
from lightpaint.paint.store.steps import Patch, Step, painted_by

#: Importance of a pixel beyond which it is a slip, and light, beside the present look's brightest.
MOST, BRIGHTEST = 1e4, 1e9


class Canvas:
    """What is painted of one view. Updated in place.

    Attributes:
        basis: What the lights do in it.
        present: (h, w, 3) linear, the present look without its grain: what shows where nothing is
            painted.
        painting: All that is painted; `at_least` is None as long as nothing has been so.
        live: The sums that follow it.
    """

    def __init__(self, view: int, basis: Basis, present: Floats, steps: Sequence[Step]) -> None:
        self.view = view
        self._open = OpenStroke()
        self.improve(basis, present, steps)

    def improve(self, basis: Basis, present: Floats, steps: Sequence[Step]) -> None:
        """Go on with a basis of more samples, from steps that are done; an open stroke stays."""
        region = self._open.region
        painted = self.pixels(region) if self._open else None
        self.basis, self.present = basis, np.asarray(present, np.float32)
        self.painting = painted_by(steps, Pixels.unpainted(self.present), self.view)
        unpainted = self.importance == 0
        self.image[unpainted] = self.present[unpainted]
        self.live = LiveView(basis, self.image, self.importance)
        self._open = OpenStroke()
        if painted is not None:
            self._lay(region, painted)

    @property
    def image(self) -> npt.NDArray[np.float32]:
        """(h, w, 3) linear; where nothing is painted, the present look."""
        return self.painting.image

    @property
    def importance(self) -> npt.NDArray[np.float32]:
        """(h, w), above 0 where something is painted."""
        return self.painting.importance

    @property
    def name(self) -> str:
        """Of the sensor that it is seen through."""
        return self.basis.origin.sensor

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the picture."""
        return self.basis.size

    @property
    def whole(self) -> Region:
        """All of it."""
        return (0, self.size[0], 0, self.size[1])

    @property
    def is_painted(self) -> bool:
        """Whether any pixel counts."""
        return bool(self.importance.any())

    @property
    def is_open(self) -> bool:
        """Whether a stroke is not done yet."""
        return bool(self._open)

    def pixels(self, region: Region) -> Pixels:
        """What the canvas holds there, as arrays of their own."""
        return self.painting.part(region).copy()

    def put(self, region: Region, pixels: Pixels) -> None:
        """Pixels onto the canvas; what is not painted shows the present look."""
        where = slices(region)
        image, importance, at_least = pixels
        painted = (importance > 0)[..., None]
        self.image[where] = np.where(painted, image, self.present[where])
        same = np.array_equal(self.importance[where], importance)
        self.importance[where] = importance
        if at_least is not None and self.painting.at_least is None:
            self.painting = self.painting._replace(at_least=np.zeros(self.image.shape, bool))
        if self.painting.at_least is not None:
            self.painting.at_least[where] = False if at_least is None else at_least & painted
        self.live.painted(where, with_importance=not same)

    def paint(self, region: Region, pixels: Pixels) -> None:
        """The same, of somebody's hand: part of the stroke that is open from now on."""
        self._lay(region, _marked(pixels, self.painting.part(region)))

    def _lay(self, region: Region, pixels: Pixels) -> None:
        self._open.touches(region, self.painting)
        self.put(region, pixels)

    def drop(self) -> Region:
        """The stroke that is open is forgotten; where it was."""
        region = self._open.region
        self.put(region, self._open.before(self.painting))
        self.close()
        return region

    def stroke(self) -> Patch | None:
        """What the stroke that is open has changed, if anything."""
        if not self._open:
            return None
        region, before = self._open.region, self._open.before(self.painting)
        after = self.pixels(region)
        if before.at_least is not None:
            # A stroke changes its mind as long as it lasts: what it left alone means what it did.
            after = _marked(after, before)
            self.put(region, after)
        # What is sent again, since its answer was lost, is there already.
        if before.same(after):
            return None
        return Patch(region, before, after, self.view)

    def close(self) -> None:
        """The stroke that is open is done."""
        self._open = OpenStroke()

    def checked(self, region: Region, arrays: Mapping[str, npt.NDArray[Any]]) -> Pixels:
        """What a page says of a region. Raises PaintError for what cannot be painted there."""
        top, bottom, left, right = region
        height, width = self.size
        if not (0 <= top <= bottom <= height and 0 <= left <= right <= width):
            raise PaintError(f"paint at {list(region)}, and the picture is {width}x{height}")
        try:
            image, importance = arrays["image"], arrays["importance"]
        except KeyError:
            raise PaintError("paint without its image and importance") from None
        shape = bottom - top, right - left
        if image.shape != (*shape, 3) or importance.shape != shape:
            raise PaintError(
                f"paint of {list(image.shape)} and {list(importance.shape)} at {list(region)}"
            )
        if not (np.isfinite(image).all() and np.isfinite(importance).all()):
            raise PaintError("paint of NaN or Inf")
        if importance.size and not (importance.min() >= 0 and importance.max() <= MOST):
            raise PaintError(f"importance beyond 0 to {MOST:g}")
        if image.size and not (image.min() >= 0 and image.max() <= BRIGHTEST):
            # A target of a cell may hold such light, which a stroke beside it carries along.
            beyond = (image < 0) | (image > BRIGHTEST)
            if not np.array_equal(image[beyond], self.image[slices(region)][beyond]):
                raise PaintError(f"light beyond 0 to {BRIGHTEST:g}")
        return Pixels(image.astype(np.float32), importance.astype(np.float32))


class Canvases:
    """Those of all views of a session: strokes go to one of them at a time, looks to all."""

    def __init__(
        self, bases: Sequence[Basis], presents: Sequence[Floats], steps: Sequence[Step]
    ) -> None:
        self._all = tuple(
            Canvas(k, basis, present, steps)
            for k, (basis, present) in enumerate(zip(bases, presents, strict=True))
        )

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[Canvas]:
        return iter(self._all)

    def __getitem__(self, view: int) -> Canvas:
        """That of a view. Raises PaintError if there is none."""
        if view >= len(self):
            raise PaintError(f"no view {view}: there are {len(self)}")
        return self._all[view]

    def improve(
        self, bases: Sequence[Basis], presents: Sequence[Floats], steps: Sequence[Step]
    ) -> None:
        """As of each."""
        for view, basis, present in zip(self, bases, presents, strict=True):
            view.improve(basis, present, steps)

    @property
    def live(self) -> list[LiveView]:
        """The sums of each."""
        return [view.live for view in self]

    @property
    def is_painted(self) -> bool:
        """Whether any pixel counts."""
        return any(view.is_painted for view in self)

    @property
    def is_open(self) -> bool:
        """Whether a stroke is not done yet."""
        return any(view.is_open for view in self)

    def strokes(self) -> tuple[Patch, ...]:
        """What strokes that are open have changed."""
        return tuple(patch for view in self if (patch := view.stroke()) is not None)

    def close(self) -> None:
        """What is open is done."""
        for view in self:
            view.close()

    def drop(self) -> list[tuple[int, Region]]:
        """What is open is forgotten; in which views, and where."""
        return [(view.view, view.drop()) for view in self if view.is_open]

    def put(self, patches: Sequence[Patch], *, is_back: bool = False) -> None:
        """The pixels after a step, or those before it."""
        for patch in patches:
            self[patch.view].put(patch.region, patch.before if is_back else patch.after)

    def instead(self, paintings: Mapping[int, Pixels]) -> tuple[Patch, ...]:
        """What it changes to have these, by view, instead of all that is painted."""
        made = []
        for k, (image, importance, at_least) in paintings.items():
            view = self[k]
            light, counts = np.asarray(image, np.float32), np.asarray(importance, np.float32)
            given = Pixels(light, counts, at_least).copy()
            made.append(Patch(view.whole, view.pixels(view.whole), given, k))
        return tuple(made)


def _marked(pixels: Pixels, before: Pixels) -> Pixels:
    """Pixels that say "at least" where they are those of before that said so."""
    if before.at_least is None:
        return pixels
    left_alone = (pixels.image == before.image).all(axis=-1) & (pixels.importance > 0)
    return pixels._replace(at_least=before.at_least & left_alone[..., None])
