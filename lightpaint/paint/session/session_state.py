"""The state of a session for a client that connects: lights, views, pictures and looks."""

from typing import Any

from lightpaint.basis.light_images import LightImage, light_images
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.paint.presets.presets import PRESETS
from lightpaint.paint.protocol import (
    ImageInfo,
    PresetInfo,
    ReferenceInfo,
    SampleCount,
    TableInfo,
    TransformInfo,
)
from lightpaint.paint.session import picture_table
from lightpaint.paint.session.answer_messages import light_info
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.view_pictures import view_info

#: Width in pixels of a map whose proportions are told.
ASPECT_PIXELS = 2**12


def state_fields(
    session: Session, pictures: PictureTable, looks: LookLibrary, *, target_spp: int | None
) -> dict[str, Any]:
    """Return fields of `SessionState`.

    target_spp: the samples per pixel that the basis will have; None if it is finished.
    """
    basis = session.basis
    views = tuple(map(view_info, session.views, session.bases))
    return {
        "size": views[0].size,
        "objects": views[0].objects,
        "lights": tuple(map(light_info, basis.lights, views[0].scales)),
        "images": tuple(map(image_info, light_images(basis.lights))),
        "views": views,
        "transforms": tuple(transform.name for transform in offered_transforms(session)),
        "transform": TransformInfo(session.transform.name, session.transform.stops),
        "lut": TableInfo(picture_table.LUT_SIDE, picture_table.LUT_LOW, picture_table.LUT_HIGH),
        "resources": pictures.stable_generations(),
        "looks": looks.infos(),
        "presets": tuple(
            PresetInfo(x.name, x.title, x.description, x.has_subject) for x in PRESETS.values()
        ),
        "references": tuple(ReferenceInfo(x.id, x.name) for x in session.references),
        "basis": SampleCount(
            spp=basis.origin.spp,
            target_spp=target_spp or basis.origin.spp,
            is_complete=target_spp is None or basis.origin.spp >= target_spp,
        ),
        "is_new": not session.store.steps,
        "stroke": session.stroke,
    }


def image_info(image: LightImage) -> ImageInfo:
    """Return the description of an image for clients."""
    width, height = image.domain.picture_size(image.size, ASPECT_PIXELS)
    return ImageInfo(
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
