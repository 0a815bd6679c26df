"""The section of the report on lights that moved or are new."""

from html import escape

import numpy as np
import numpy.typing as npt

from lightpaint.images.denoiser import Features
from lightpaint.report.page.figures import data_uri
from lightpaint.report.rig.aim_picture import aim_picture
from lightpaint.report.rig.hung_lights import HungLights
from lightpaint.report.rig.rig_drawing import rig_drawing


def placement_section(
    placement: HungLights | None, picture: npt.NDArray[np.uint8], features: Features | None
) -> str:
    """Return the moves with reasons, the picture with arrows, and the room's plan and elevation.

    None gives no section. picture: the answer, (h, w, 3) in 8 bits.
    """
    if placement is None:
        return ""
    items = "".join(f"<li>{escape(change.text)}</li>" for change in placement.changes)
    items = f"<ul>{items}</ul>" if items else ""
    figures = ""
    arrows = aim_picture(picture, features, placement.lights)
    if arrows is not None:
        figures += _figure(
            arrows,
            "The answer with an arrow for each light that moved",
            "Rings: where lights pointed, or hung; dots: where they do now.",
        )
    drawing = rig_drawing(features, placement.lights, up=placement.up)
    if drawing is not None:
        figures += _figure(
            drawing,
            "Plan and elevation of the room with its lights",
            "The room is what the camera sees of it; lengths are in units of the scene.",
        )
    return (
        f"<section><h2>Where the lights hang</h2><p>{escape(placement.sentence)}</p>{items}"
        f'<div class="rig">{figures}</div></section>'
    )


def _figure(picture: npt.NDArray[np.uint8], name: str, caption: str) -> str:
    height, width = picture.shape[:2]
    return (
        f'<figure style="margin:16px 0"><img style="max-width:100%;height:auto" width="{width}" '
        f'height="{height}" alt="{name}." src="{data_uri(picture)}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
