"""The section of the report on lights that moved or are new."""

from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Position
from lightpaint.display_text import visible
from lightpaint.images.denoiser import Features
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import html
from lightpaint.report.rig.drawing_panels import FINER, GROUND
from lightpaint.report.rig.hung_lights import HungLight, HungLights
from lightpaint.report.rig.rig_drawing import CHANGED, arrow, circle, rig_drawing
from lightpaint.report.rig.view_geometry import ViewGeometry
from lightpaint.scene.properties.site import Site

#: Width that narrower pictures are enlarged to.
MIN_WIDTH = 640


def placement_section(
    placement: HungLights | None, picture: npt.NDArray[np.uint8], features: Features | None
) -> Markup:
    """Return the moves with reasons, the picture with arrows, and the room's plan and elevation.

    None gives no section. picture: the answer, (h, w, 3) in 8 bits.
    """
    if placement is None:
        return Markup("")
    pictures = []
    arrows = aim_picture(picture, features, placement.lights)
    if arrows is not None:
        pictures.append(
            _picture(
                arrows,
                "The answer with an arrow for each light that moved",
                "Rings: where lights pointed, or hung; dots: where they do now.",
            )
        )
    drawing = rig_drawing(features, placement.lights, up=placement.up)
    if drawing is not None:
        pictures.append(
            _picture(
                drawing,
                "Plan and elevation of the room with its lights",
                "Rings and dashed lines: where lights hung and pointed before. The room is what "
                "the camera sees of it; lengths are in units of the scene.",
            )
        )
    return html(
        "placement", sentence=placement.sentence, changes=placement.changes, pictures=pictures
    )


def _picture(pixels: npt.NDArray[np.uint8], name: str, caption: str) -> dict[str, Any]:
    """Return a picture of the section, with its name for who cannot see it."""
    height, width = pixels.shape[:2]
    source = data_uri(pixels)
    return {"name": name, "caption": caption, "width": width, "height": height, "source": source}


def aim_picture(
    picture: npt.NDArray[np.uint8], features: Features | None, lights: tuple[HungLight, ...]
) -> npt.NDArray[np.uint8] | None:
    """Draw where changed lights point, or hang if they point nowhere, over an 8-bit picture.

    None if none of that is in the picture.
    """
    geometry = ViewGeometry.of(features)
    changed = [light for light in lights if light.is_changed]
    if geometry is None or not changed:
        return None
    height, width = picture.shape[:2]
    zoom = FINER * max(1.0, MIN_WIDTH / width)
    size = round(zoom * width), round(zoom * height)
    sheet = Image.fromarray(picture).resize(size, Image.Resampling.LANCZOS)
    draw, text = ImageDraw.Draw(sheet), FINER * max(12, round(zoom * width / FINER / 60))
    font, is_any = ImageFont.load_default(text), False
    for light in changed:
        old_site = light.place.moved_from
        new = _shown_point(geometry, light.place.site)
        old_point = None if old_site is None else _shown_point(geometry, old_site)
        if new is None:
            continue
        is_any = True
        tip = zoom * np.array(new)
        if old_point is not None:
            tail = zoom * np.array(old_point)
            circle(draw, tail, 0.35 * text, outline=CHANGED, width=max(2, text // 8))
            if float(np.hypot(*(tip - tail))) > text:
                arrow(draw, tail, tip, CHANGED, width=max(2, text // 8), head=0.8 * text)
        circle(draw, tip, 0.3 * text, outline=CHANGED, width=1, fill=CHANGED)
        label = visible(light.place.name)
        label_width = font.getlength(label)
        x = float(np.clip(tip[0] + 0.6 * text, 0, max(size[0] - label_width - 4, 0)))
        y = float(np.clip(tip[1], text, size[1] - text))
        edge = {"stroke_width": text // 7, "stroke_fill": GROUND}
        draw.text((x, y), label, CHANGED, font, anchor="lm", **edge)
    if not is_any:
        return None
    small_size = (size[0] // FINER, size[1] // FINER)
    return np.asarray(sheet.resize(small_size, Image.Resampling.LANCZOS))


def _shown_point(geometry: ViewGeometry, site: Site) -> tuple[float, float] | None:
    """Return where a light points in the picture or, if it points nowhere, where it hangs."""
    point: Position | None = geometry.aim_of(site) if site.direction else site.position
    return None if point is None else geometry.pixel(point)
