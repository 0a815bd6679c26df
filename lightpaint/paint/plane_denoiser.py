"""Planes without their grain, made one after the other while somebody paints."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes, clean_plane, keep_planes, kept_planes
from lightpaint.images.denoiser import denoised
from lightpaint.paint.session.canvas import Canvas
from lightpaint.paint.session.picture_table import Picture
from lightpaint.paint.store.steps import of_view


@dataclass(frozen=True)
class _Clean:
    """Those of a view. basis: that they were made of. is_kept: whether a file has them."""

    basis: Basis
    planes: CleanPlanes
    is_kept: bool = False

    def is_of(self, basis: Basis) -> bool:
        return self.basis.planes is basis.planes

    def shown_of(self, basis: Basis) -> CleanPlanes:
        """What does for the eye until there are those of `basis`."""
        return self.planes if self.is_of(basis) else self.planes.scaled_as(basis)


class Cleaning:
    """Those of the views of one studio.

    put: receives each plane, by its name. is_wanted: whether anybody is still there to see them.
    use_cache: whether they are kept for the next session.
    """

    def __init__(
        self,
        put: Callable[[str, Picture], None],
        is_wanted: Callable[[], bool],
        *,
        use_cache: bool,
    ) -> None:
        self._put, self._is_wanted, self._use_cache = put, is_wanted, use_cache
        self._by_view: dict[int, _Clean] = {}

    def begin(self, bases: Sequence[Basis]) -> list[Floats]:
        """Take what an earlier session kept. Returns how each view looks now, without its grain."""
        presents = []
        for k, basis in enumerate(bases):
            kept = kept_planes(basis) if self._use_cache else None
            if kept is None:
                presents.append(denoised(basis.present_look, basis.features))
            else:
                self._by_view[k] = _Clean(basis, kept, is_kept=True)
                presents.append(kept.present)
        return presents

    def shown(self, bases: Sequence[Basis]) -> list[CleanPlanes | None]:
        """What there is by now for each view: those of fewer samples do for the eye."""
        return [
            self._by_view[k].shown_of(basis) if k in self._by_view else None
            for k, basis in enumerate(bases)
        ]

    def make(self, views: Iterable[Canvas]) -> None:
        """Those that are missing, of one view after the other."""
        for view in views:
            its = self._by_view.get(view.view)
            if its is None or not its.is_of(view.basis):
                self._make_of(view)

    def _make_of(self, view: Canvas) -> None:
        basis = view.basis
        halves, scales = (
            np.empty((len(basis.lights), *basis.size, 3), np.float16),
            np.ones(len(basis.lights)),
        )
        planes = CleanPlanes(halves, scales, view.present)
        for k in range(len(basis.lights)):
            if not self._is_wanted() or view.basis is not basis:
                return
            planes.halves[k], planes.scales[k] = clean_plane(basis, k)
            self._put(of_view(f"clean/{k}", view.view), planes.halves[k])
        self._by_view[view.view] = _Clean(basis, planes)

    def keep(self) -> None:
        """Keep those of the whole basis for the next session."""
        if self._use_cache:
            for its in self._by_view.values():
                if not its.is_kept:
                    keep_planes(its.basis, its.planes)
