"""The painting of one view: its pixels, and the open stroke."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import PaintError
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.paint.session.open_stroke import OpenStroke
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices
from lightpaint.paint.store.steps import Patch, Step, replay
from lightpaint.target.target import Target

#: Largest importance, and largest light, that a page may paint.
MAX_IMPORTANCE, MAX_LIGHT = 1e4, 1e9


class Canvas:
    """The painting of one view. Updated in place.

    Attributes:
        basis: The planes of its lights.
        present: (h, w, 3) linear, the present look, denoised: it shows where nothing is painted.
        painting: All paint; `at_least` is None as long as none is marked so.
        live: The sums that follow the paint.
    """

    def __init__(self, view: int, basis: Basis, present: Floats, steps: Sequence[Step]) -> None:
        self.view = view
        self._open_stroke = OpenStroke()
        self.improve(basis, present, steps)

    def improve(self, basis: Basis, present: Floats, steps: Sequence[Step]) -> None:
        """Replace the basis by one of more samples, and replay the steps; the open stroke stays."""
        region = self._open_stroke.region
        painted = self.pixels(region) if self._open_stroke else None
        self.basis, self.present = basis, np.asarray(present, np.float32)
        self.painting = replay(steps, Pixels.unpainted(self.present), self.view)
        unpainted = self.importance == 0
        self.image[unpainted] = self.present[unpainted]
        self.live = LiveView(basis, self.image, self.importance)
        self._open_stroke = OpenStroke()
        if painted is not None:
            self._paint_over(region, painted)

    def replace_planes(self, basis: Basis, lights: Collection[int]) -> None:
        """Continue with a basis in which the planes of some lights, by number, are others.

        The present look stays that of before these lights moved.
        """
        self.basis = basis
        self.live.replace_planes(basis, lights)

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
        """Name of its sensor."""
        return self.basis.origin.sensor

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the picture."""
        return self.basis.size

    @property
    def full_region(self) -> Region:
        """Region of the whole picture."""
        return (0, self.size[0], 0, self.size[1])

    @property
    def is_painted(self) -> bool:
        """True if any pixel counts."""
        return bool(self.importance.any())

    @property
    def is_open(self) -> bool:
        """True while a stroke is open."""
        return bool(self._open_stroke)

    def pixels(self, region: Region) -> Pixels:
        """Return a copy of the pixels of a region."""
        return self.painting.part(region).copy()

    def target(self, name: str, transform: ViewTransform, *, is_sketch: bool) -> Target | None:
        """Return a copy of the painting as a target; None where nothing is painted.

        Solved elsewhere it has the same answer: a literal painting, which is no sketch, is light
        over nothing.
        """
        if not self.is_painted:
            return None
        image, importance, at_least = self.pixels(self.full_region)
        return Target(
            name,
            image,
            importance,
            everything=False,
            at_least=at_least,
            transform=transform,
            through_view=is_sketch,
            over_look=is_sketch,
        )

    def put(self, region: Region, pixels: Pixels) -> None:
        """Put pixels onto the canvas; unpainted ones show the present look."""
        area = slices(region)
        image, importance, at_least = pixels
        painted = (importance > 0)[..., None]
        self.image[area] = np.where(painted, image, self.present[area])
        is_same_importance = np.array_equal(self.importance[area], importance)
        self.importance[area] = importance
        if at_least is not None and self.painting.at_least is None:
            self.painting = self.painting._replace(at_least=np.zeros(self.image.shape, bool))
        if self.painting.at_least is not None:
            self.painting.at_least[area] = False if at_least is None else at_least & painted
        self.live.update(area, with_importance=not is_same_importance)

    def paint(self, region: Region, pixels: Pixels) -> None:
        """Paint pixels by hand: they belong to the open stroke."""
        self._paint_over(region, _with_marks(pixels, self.painting.part(region)))

    def _paint_over(self, region: Region, pixels: Pixels) -> None:
        self._open_stroke.touch(region, self.painting)
        self.put(region, pixels)

    def drop(self) -> Region:
        """Drop the open stroke, and return its region."""
        region = self._open_stroke.region
        self.put(region, self._open_stroke.pixels_before(self.painting))
        self.close()
        return region

    def stroke_patch(self) -> Patch | None:
        """Return the change of the open stroke; None if it changed nothing."""
        if not self._open_stroke:
            return None
        region, before = self._open_stroke.region, self._open_stroke.pixels_before(self.painting)
        after = self.pixels(region)
        if before.at_least is not None:
            # A stroke may take pixels back while it lasts: unchanged ones keep their marks.
            after = _with_marks(after, before)
            self.put(region, after)
        # A page sends a stroke again if its answer was lost; that changes nothing.
        if before.equals(after):
            return None
        return Patch(region, before, after, self.view)

    def close(self) -> None:
        """Close the open stroke."""
        self._open_stroke = OpenStroke()

    def check_pixels(self, region: Region, arrays: Mapping[str, npt.NDArray[Any]]) -> Pixels:
        """Return the pixels that a page sent for a region. Raises PaintError if invalid."""
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
        if importance.size and not (importance.min() >= 0 and importance.max() <= MAX_IMPORTANCE):
            raise PaintError(f"importance beyond 0 to {MAX_IMPORTANCE:g}")
        if image.size and not (image.min() >= 0 and image.max() <= MAX_LIGHT):
            # A target set in a notebook may hold such light, and a stroke beside it resends it.
            beyond = (image < 0) | (image > MAX_LIGHT)
            if not np.array_equal(image[beyond], self.image[slices(region)][beyond]):
                raise PaintError(f"light beyond 0 to {MAX_LIGHT:g}")
        return Pixels(image.astype(np.float32), importance.astype(np.float32))


class Canvases:
    """The canvases of all views: a stroke goes to one of them, a look to all."""

    def __init__(
        self, bases: Sequence[Basis], presents: Sequence[Floats], steps: Sequence[Step]
    ) -> None:
        self._canvases = tuple(
            Canvas(k, basis, present, steps)
            for k, (basis, present) in enumerate(zip(bases, presents, strict=True))
        )

    def __len__(self) -> int:
        return len(self._canvases)

    def __iter__(self) -> Iterator[Canvas]:
        return iter(self._canvases)

    def __getitem__(self, view: int) -> Canvas:
        """Return the canvas of a view. Raises PaintError if there is none."""
        if view >= len(self):
            raise PaintError(f"no view {view}: there are {len(self)}")
        return self._canvases[view]

    def improve(
        self, bases: Sequence[Basis], presents: Sequence[Floats], steps: Sequence[Step]
    ) -> None:
        """Improve each canvas."""
        for view, basis, present in zip(self, bases, presents, strict=True):
            view.improve(basis, present, steps)

    def replace_planes(self, bases: Sequence[Basis], lights: Collection[int]) -> None:
        """Continue with bases in which the planes of some lights, by number, are others."""
        for view, basis in zip(self, bases, strict=True):
            view.replace_planes(basis, lights)

    @property
    def live(self) -> list[LiveView]:
        """Live sums of each view."""
        return [view.live for view in self]

    @property
    def is_painted(self) -> bool:
        """True if any pixel counts."""
        return any(view.is_painted for view in self)

    @property
    def is_open(self) -> bool:
        """True while a stroke is open."""
        return any(view.is_open for view in self)

    def stroke_patches(self) -> tuple[Patch, ...]:
        """Return the changes of the open strokes."""
        return tuple(patch for view in self if (patch := view.stroke_patch()) is not None)

    def close(self) -> None:
        """Close the open strokes."""
        for view in self:
            view.close()

    def drop(self) -> list[tuple[int, Region]]:
        """Drop the open strokes; return their views and regions."""
        return [(view.view, view.drop()) for view in self if view.is_open]

    def put(self, patches: Sequence[Patch], *, is_back: bool = False) -> None:
        """Put the pixels after a step, or those before it."""
        for patch in patches:
            self[patch.view].put(patch.region, patch.before if is_back else patch.after)

    def replacement_patches(self, paintings: Mapping[int, Pixels]) -> tuple[Patch, ...]:
        """Return the patches that replace all paint by these paintings, by view."""
        patches = []
        for k, (image, importance, at_least) in paintings.items():
            view = self[k]
            light, counts = np.asarray(image, np.float32), np.asarray(importance, np.float32)
            pixels = Pixels(light, counts, at_least).copy()
            patches.append(Patch(view.full_region, view.pixels(view.full_region), pixels, k))
        return tuple(patches)


def _with_marks(pixels: Pixels, before: Pixels) -> Pixels:
    """Return `pixels`, marked "at least" where they equal pixels of `before` that are."""
    if before.at_least is None:
        return pixels
    left_alone = (pixels.image == before.image).all(axis=-1) & (pixels.importance > 0)
    return pixels._replace(at_least=before.at_least & left_alone[..., None])
