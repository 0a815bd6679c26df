"""The state of a session for a client that connects, and the pictures of its views."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis import Basis, DenoisedPlanes, LightImage, RoughPlanes, as_halves, light_images
from lightpaint.colour import ViewTransform
from lightpaint.errors import PaintError
from lightpaint.images import resampled
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_pixels import selection_mask
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.presets.lighting_presets import PRESETS, find_preset, requested_look
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.session import picture_table
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import (
    Picture,
    PictureTable,
    has_mixes,
    look_detail,
    opens_plain,
    page_emitters,
    page_plane,
    plane_scale,
    plane_size,
)
from lightpaint.paint.session.session_messages import light_info
from lightpaint.paint.store.history_steps import name_in_view

#: Pixels of the longer side of a reference's light, of which a page picks paint.
LIGHT_SIDE = 400

#: Width in pixels of a map by which its proportions are given.
ASPECT_PIXELS = 2**12


def offer_transforms(table: PictureTable, transforms: Sequence[ViewTransform]) -> None:
    """Offer the lookup tables of these transforms."""
    for transform in transforms:
        table.offer(f"lut/{transform.name}", partial(picture_table.lookup_table, transform))


def offer_view(
    table: PictureTable,
    view: Canvas,
    basis: Basis,
    transform: ViewTransform,
    clean: DenoisedPlanes | None,
    small: DenoisedPlanes | None = None,
) -> None:
    """Offer the pictures of a view; rough planes replace denoised ones until these are made.

    basis: of the view, with every light at its place in the scene. clean: of the size that the page
    has. small: planes of pixel blocks, which improve the rough ones. Planes of very many lights are
    offered as they were rendered until they are denoised, and none before lights are rendered.
    """
    offer_ground(table, view, transform)
    _offer_painting(table, view)
    if not basis.origin.is_plain_look:
        _offer_lights(table, view, basis, clean, small)


def _offer_painting(table: PictureTable, view: Canvas) -> None:
    """Offer what is painted in a view."""
    table.offer(name_in_view("painting", view.view), lambda: view.image.copy())
    table.offer(name_in_view("importance", view.view), lambda: view.importance.copy())


def _offer_lights(
    table: PictureTable,
    view: Canvas,
    basis: Basis,
    clean: DenoisedPlanes | None,
    small: DenoisedPlanes | None,
) -> None:
    """Offer the lights of a view, and the surfaces and objects that it sees, as `offer_view`."""

    def offer(name: str, make: Any) -> None:
        table.offer(name_in_view(name, view.view), make)

    rough = RoughPlanes(basis, view.current, small)
    is_plain = opens_plain(basis)
    is_lit = not is_plain and bool(view.current.any())
    for k in range(len(basis.lights)):
        # A page fetches all of them, once.
        name = name_in_view(f"plane/{k}", view.view)
        table.offer(name, partial(_plane, basis, k), is_kept=not is_plain)
        name = name_in_view(f"clean/{k}", view.view)
        if clean is not None:
            table.put(name, clean.halves[k])
        elif is_lit:
            table.offer(name, partial(_rough_plane, rough, k))
        else:
            table.withdraw(name)
            name = name_in_view(f"plane/{k}", view.view)
        offer(f"thumb/{k}", partial(_thumbnail, table, name, basis))
    if basis.features is not None:
        albedo = basis.features.albedo
        offer("albedo", lambda: as_halves(albedo))
    if basis.objects is not None:
        index = basis.objects.index
        offer("objects", lambda: index.astype(np.int16))


def offer_ground(table: PictureTable, view: Canvas, transform: ViewTransform) -> None:
    """Offer the look under the painting of a view, in several forms."""

    def offer(name: str, make: Any) -> None:
        table.offer(name_in_view(name, view.view), make)

    offer("present", lambda: as_halves(view.current))
    # Layers lie on it, and the page composes them to the bit.
    offer("ground", lambda: view.current.copy())
    offer("look", lambda: picture_table.display_thumbnail(view.current, transform))
    if has_mixes(view.basis):
        offer("detail", lambda: as_halves(look_detail(view.live, view.current, view.basis)))


def _offer_numbered(
    table: PictureTable,
    prefix: str,
    picture: Callable[..., Picture],
    *,
    count: int = 1,
    has_views: bool = False,
) -> None:
    """Offer pictures that are named by numbers, as `step/12` and `lights_at/ROW,COLUMN@VIEW`.

    picture: returns the picture of `count` numbers and, if `has_views`, the index of a view.
    """

    def named(name: str) -> Picture:
        numbers, _, view = name.partition("@") if has_views else (name, "", "")
        parts = numbers.split(",")
        if len(parts) != count or not all(x.isdecimal() for x in (*parts, view or "0")):
            raise PaintError(f"there is no picture {f'{prefix}/{name}'[:40]!r}")
        views = [int(view or 0)] if has_views else []
        return picture(*map(int, parts), *views)

    table.offer_family(prefix, named)


def offer_layers(table: PictureTable, views: Canvases) -> None:
    """Offer the pixels of the layers, as `layer/3`, and what is selected, as `selection/0`."""
    _offer_numbered(
        table,
        "layer",
        lambda number, view: _layer_picture(views.layers[number], views[view]),
        has_views=True,
    )
    _offer_numbered(table, "selection", lambda view: selection_mask(views[view].selection))


def offer_presets(table: PictureTable, view: Canvas, transform: ViewTransform) -> None:
    """Offer a small picture of what each preset asks of a view, as `preset/noir`."""
    side = picture_table.THUMBNAIL_SIDE

    def picture(name: str) -> Picture:
        light = requested_look(find_preset(name), view, side)
        return picture_table.display_thumbnail(light, transform)

    table.offer_family("preset", picture)


def offer_lights_at(table: PictureTable, views: Canvases) -> None:
    """Offer the light of each lamp around a pixel, as `lights_at/ROW,COLUMN@VIEW`, (n, 3): the
    means over blocks that follow the brush.
    """
    _offer_numbered(
        table,
        "lights_at",
        lambda row, column, view: views[view].live.lights_at(row, column),
        count=2,
        has_views=True,
    )


def offer_steps(table: PictureTable, picture_of: Callable[[int], Picture]) -> None:
    """Offer the small pictures of the history's steps, as `step/12`."""
    _offer_numbered(table, "step", picture_of)


def offer_references(table: PictureTable, references: ReferenceTable) -> None:
    """Offer the references as the session shows them, as `reference/2`, and their light, reduced,
    as `reference_light/2`.
    """

    def light(number: int) -> Picture:
        picture = references.light(references[number])
        height, width = picture.shape[:2]
        factor = min(1.0, LIGHT_SIDE / max(height, width))
        size = max(1, round(height * factor)), max(1, round(width * factor))
        return as_halves(resampled(picture, size))

    _offer_numbered(table, "reference", lambda number: references.picture(references[number]))
    _offer_numbered(table, "reference_light", light)


def _layer_picture(layer: Layer, view: Canvas) -> npt.NDArray[np.float32]:
    """Return the pixels of a layer in its region: (rows, columns, 4), colour and coverage; of a
    mask (rows, columns, 1).
    """
    pixels = view.layer(layer.id)
    image, coverage, _ = pixels.part(pixels.bounds)
    mask = coverage[..., None]
    return mask if layer.is_mask else np.concatenate([image, mask], axis=-1)


def _plane(basis: Basis, k: int) -> Picture:
    return as_halves(page_plane(basis.planes.plane(k), basis), plane_scale(basis, k))


def _thumbnail(table: PictureTable, name: str, basis: Basis) -> Picture:
    """Return a thumbnail of the plane of that name, as the page shows it."""
    return picture_table.plane_thumbnail(table[name].astype(np.float32), page_emitters(basis))


def _rough_plane(planes: RoughPlanes, k: int) -> Picture:
    return as_halves(planes.plane(k), plane_scale(planes.basis, k))


def _view_info(view: Canvas, basis: Basis) -> protocol.ViewInfo:
    """Return the description of a view for clients.

    basis: of the view, with lights at their places in the scene, so that moves change no scale.
    Planes of added lights are sent unscaled.
    """
    objects, (height, width) = basis.objects, view.size
    return protocol.ViewInfo(
        name=view.name,
        size=(height, width),
        objects=() if objects is None else tuple(objects.names),
        scales=tuple(plane_scale(basis, k) for k in range(len(view.basis.lights))),
        plane_size=plane_size(basis),
        has_mixes=has_mixes(basis),
    )


def state_fields(
    session: Session,
    pictures: PictureTable,
    looks: LookLibrary,
    *,
    target_spp: int | None,
    addresses: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return fields of `SessionState`.

    target_spp: the samples per pixel that the basis will have; None if it is finished. addresses:
    the fixture and first channel of lights on a console, by their names.
    """
    basis = session.basis
    views = tuple(map(_view_info, session.views, session.bases))
    lamps = session.live_answer.lamps
    return {
        "size": views[0].size,
        "objects": views[0].objects,
        "lights": tuple(
            light_info(light, scale, lamps.get(k), (addresses or {}).get(light.name, ""))
            for k, (light, scale) in enumerate(zip(basis.lights, views[0].scales, strict=True))
        ),
        "images": tuple(map(_image_info, light_images(basis.lights))),
        "views": views,
        "transforms": tuple(transform.name for transform in offered_transforms(session)),
        "transform": protocol.TransformInfo(session.transform.name, session.transform.stops),
        "lut": protocol.TableInfo(
            picture_table.LUT_SIDE, picture_table.LUT_LOW, picture_table.LUT_HIGH
        ),
        "resources": pictures.stable_generations(),
        "looks": looks.infos(),
        "presets": tuple(
            protocol.PresetInfo(x.name, x.title, x.description, x.has_subject)
            for x in (() if session.is_waiting else PRESETS.values())
        ),
        "references": tuple(protocol.ReferenceInfo(x.id, x.name) for x in session.references),
        "basis": protocol.SampleCount(
            spp=basis.origin.spp,
            target_spp=target_spp or basis.origin.spp,
            is_complete=not session.is_waiting
            and (target_spp is None or basis.origin.spp >= target_spp),
        ),
        "planes": None if (planes := session.live_answer.planes) is None else planes.info,
        "reading": session.live_answer.planes_reading(),
        "is_new": not session.store.steps,
        "stroke": session.stroke,
    }


def _image_info(image: LightImage) -> protocol.ImageInfo:
    """Return the description of an image for clients."""
    width, height = image.domain.picture_size(image.size, ASPECT_PIXELS)
    return protocol.ImageInfo(
        name=image.name,
        places=tuple(map(tuple, image.nearest.tolist())),
        shares=tuple(
            tuple(float(f"{x:.6g}") for x in row) for row in image.nearest_shares.tolist()
        ),
        aspect=width / height,
    )


def offered_transforms(session: Session) -> list[ViewTransform]:
    """Return the view transforms that a page can show, the session's own among them."""
    own = session.transform.name
    names = [*picture_table.TRANSFORMS, *([own] if own not in picture_table.TRANSFORMS else [])]
    return [type(session.transform)(name) for name in names]
