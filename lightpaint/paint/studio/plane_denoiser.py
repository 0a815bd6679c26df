"""Denoised planes, computed one after the other while the user paints."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache.denoised_planes import (
    DenoisedPlanes,
    cache_denoised_planes,
    denoise_to_halves,
    read_denoised_planes,
)
from lightpaint.basis.denoised_mixes import denoise_current_look
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.session.picture_table import Picture, plane_thumbnail
from lightpaint.paint.session.session import Session
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.report.basis_memo import page_reduction


@dataclass(frozen=True)
class _ViewPlanes:
    """Denoised planes of one view. basis: their source. is_cached: whether a file has them."""

    basis: Basis
    planes: DenoisedPlanes
    is_cached: bool = False

    def matches(self, basis: Basis) -> bool:
        return self.basis.planes is basis.planes

    def scaled_to(self, basis: Basis) -> DenoisedPlanes:
        """Return planes that stand in until those of `basis` are denoised."""
        return self.planes if self.matches(basis) else self.planes.scaled_as(basis)


class PlaneDenoiser:
    """Denoises the planes of a studio's views.

    publish: receives each plane, by its name. is_needed: whether a page still shows them.
    use_cache: whether they are cached for the next session.
    """

    def __init__(
        self,
        publish: Callable[[str, Picture], None],
        is_needed: Callable[[], bool],
        *,
        use_cache: bool,
    ) -> None:
        self._publish, self._is_needed, self._use_cache = publish, is_needed, use_cache
        self._by_view: dict[int, _ViewPlanes] = {}
        self._small: dict[int, _ViewPlanes] = {}  # of blocks of pixels, as pages of results have

    def load_cached(self, bases: Sequence[Basis]) -> list[Floats]:
        """Load cached planes. Returns the current look of each view, denoised."""
        current_looks = []
        for k, basis in enumerate(bases):
            factor = page_reduction(basis, len(basis.lights))
            cached = read_denoised_planes(basis, factor=factor) if self._use_cache else None
            if cached is None:
                current_looks.append(denoise_current_look(basis))
            else:
                current_looks.append(cached.current)
                planes_by_view = self._by_view if cached.is_whole else self._small
                planes_by_view[k] = _ViewPlanes(basis, cached, is_cached=True)
        return current_looks

    def planes_for(self, bases: Sequence[Basis]) -> list[DenoisedPlanes | None]:
        """Return each view's denoised planes, of fewer samples if need be; None if it has none."""
        return [
            self._by_view[k].scaled_to(basis) if k in self._by_view else None
            for k, basis in enumerate(bases)
        ]

    def clean_planes(self, bases: Sequence[Basis]) -> Sequence[DenoisedPlanes | None]:
        """Return the denoised planes of these bases; None for each that has none yet.

        Bases with moved lights have none.
        """
        if any(basis.former is not None for basis in bases):
            return [None] * len(bases)
        return self.planes_for(bases)

    def small_planes_for(self, bases: Sequence[Basis]) -> list[DenoisedPlanes | None]:
        """Return each view's denoised planes of blocks of pixels, which a result has left."""
        small = [self._small.get(k) for k in range(len(bases))]
        return [
            view_planes.planes if view_planes is not None and view_planes.matches(basis) else None
            for view_planes, basis in zip(small, bases, strict=True)
        ]

    def denoise(self, session: Session) -> None:
        """Denoise the planes that are missing, one view after the other.

        Of moved lights they are those of before, which undo brings back.
        """
        for view, basis in zip(session.views, session.bases, strict=True):
            planes_of_view = self._by_view.get(view.view)
            if planes_of_view is None or not planes_of_view.matches(basis):
                self._denoise_view(session, view, basis)

    def _denoise_view(self, session: Session, view: Canvas, basis: Basis) -> None:
        halves, scales = (
            np.empty((len(basis.lights), *basis.size, 3), np.float16),
            np.ones(len(basis.lights)),
        )
        planes = DenoisedPlanes(halves, scales, view.current)
        for k in range(len(basis.lights)):
            if not self._is_needed() or session.bases[view.view] is not basis:
                return
            planes.halves[k], planes.scales[k] = denoise_to_halves(basis, k)
            if basis.names[k] not in session.requests.placed:
                self._publish(name_in_view(f"clean/{k}", view.view), planes.halves[k])
                thumbnail = plane_thumbnail(planes.plane(k), basis.emitters_seen)
                self._publish(name_in_view(f"thumb/{k}", view.view), thumbnail)
        self._by_view[view.view] = _ViewPlanes(basis, planes)

    def write_cache(self) -> None:
        """Cache the planes of the final basis for the next session."""
        if self._use_cache:
            for view, planes_of_view in list(self._by_view.items()):
                if not planes_of_view.is_cached:
                    cache_denoised_planes(planes_of_view.basis, planes_of_view.planes)
                    self._by_view[view] = replace(planes_of_view, is_cached=True)
