"""The pictures of a session's views that pages fetch, and what they are told of them."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes, RoughPlanes, as_halves, scale_of
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.paint.protocol import ViewInfo
from lightpaint.paint.session import picture_table as pictures
from lightpaint.paint.session.canvas import Canvas
from lightpaint.paint.session.picture_table import Picture, Pictures
from lightpaint.paint.store.steps import of_view


def offer_transforms(shelf: Pictures, transforms: Sequence[ViewTransform]) -> None:
    """Tables of these from now on."""
    for transform in transforms:
        shelf.offer(f"lut/{transform.name}", partial(pictures.table_of, transform))


def offer_view(
    shelf: Pictures, view: Canvas, transform: ViewTransform, clean: CleanPlanes | None
) -> None:
    """Pictures of a view from now on; clean planes, unless they are there, are rough at first."""
    basis = view.basis

    def offer(name: str, make: Any) -> None:
        shelf.offer(of_view(name, view.view), make)

    rough = RoughPlanes(basis, view.present)
    is_lit = bool(view.present.any())
    for k in range(len(basis.lights)):
        offer(f"plane/{k}", partial(_plane, basis, k))
        offer(f"thumb/{k}", partial(pictures.small, basis, k))
        name = of_view(f"clean/{k}", view.view)
        if clean is not None:
            shelf.put(name, clean.halves[k])
        elif is_lit:
            shelf.offer(name, partial(_rough, rough, k))
        else:
            shelf.withdraw(name)
    offer("present", lambda: as_halves(view.present))
    offer("look", lambda: pictures.small_picture(view.present, transform))
    offer("painting", lambda: view.image.copy())
    offer("importance", lambda: view.importance.copy())
    if basis.features is not None:
        albedo = basis.features.albedo
        offer("albedo", lambda: as_halves(albedo))
    if basis.objects is not None:
        index = basis.objects.index
        offer("objects", lambda: index.astype(np.int16))


def _plane(basis: Basis, k: int) -> Picture:
    plane = basis.planes.plane(k)
    return as_halves(plane, scale_of(plane))


def _rough(planes: RoughPlanes, k: int) -> Picture:
    return as_halves(planes.plane(k), scale_of(planes.basis.planes.plane(k)))


def view_info(view: Canvas) -> ViewInfo:
    """Return what clients are told of a view."""
    objects, (height, width) = view.basis.objects, view.size
    return ViewInfo(
        name=view.name,
        size=(height, width),
        objects=() if objects is None else tuple(objects.names),
        scales=tuple(scale_of(plane) for plane in view.basis.planes),
    )
