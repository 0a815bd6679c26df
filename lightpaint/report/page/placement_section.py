"""The sections of the report on lights that moved or are new, and on lights that it suggests."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Floats, Position
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.display_text import visible
from lightpaint.images import Features, denoised
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.report.hung_light import HungLight, HungLights, ViewGeometry, spoken_fraction
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import html
from lightpaint.report.phrases import spoken_percent
from lightpaint.report.rig_plan import CHANGED, FINER, GROUND, arrow, circle, rig_drawing
from lightpaint.scene.properties.site import Site

#: Width that narrower pictures are enlarged to.
MIN_WIDTH = 640

#: Ring around the place of a light in the picture, dark on bright and bright on dark.
RING = (
    "position:absolute;width:22px;height:22px;margin:-11px 0 0 -11px;border:2px solid #fff;"
    "border-radius:50%;box-shadow:0 0 0 1.5px #000,inset 0 0 0 1.5px #000"
)


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


def spoken_suggestions(suggestions: Sequence[Suggestion]) -> str:
    """Return the gain of the suggested lights in one sentence."""
    if not suggestions:
        return "No point light would certainly remove a hundredth of the difference."
    first, last = suggestions[0], suggestions[-1]
    first_words = f"A light at {spoken_position(first)} would remove "
    share = f"{spoken_percent(first.gain_share)} of the difference (in energy)"
    if len(suggestions) == 1:
        return f"{first_words}{share}."
    joint_percent = spoken_percent(1 - last.missed_share)
    return (
        f"{first_words}{share}; all {len(suggestions)} suggested lights together, {joint_percent}."
    )


def spoken_position(suggestion: Suggestion) -> str:
    """Return `(1.02, 2.03, 3.57)`, in units of the scene."""
    return f"({', '.join(f'{v:.4g}' for v in suggestion.position)})".replace("-", "−")


def suggestion_section(
    suggestions: Sequence[Suggestion] | None,
    *,
    transform: ViewTransform,
    turn: MoveSuggestion | None = None,
    shown_view: str = "",
    cd_per_unit: float | None = None,
    is_clean: bool = False,
) -> Markup:
    """Return each suggested light: the picture without and with it, its place, and its XML.

    Without any the section is empty. turn: the turn of an existing light, which comes first.
    shown_view: the sensor of the small pictures, if there are several painted views.
    is_clean: whether to denoise the pictures.
    """
    if suggestions is None:
        return Markup("")

    def pictures(entry: Suggestion | MoveSuggestion) -> dict[str, Any]:
        pair = {"without": entry.without, "with_it": entry.with_it}
        return {
            name: _encoded_picture(denoised(image) if is_clean else image, transform)
            for name, image in pair.items()
        }

    shown_turn = None
    if turn is not None:
        words = {"name": turn.name, "sentence": spoken_turn(turn), "toml": turn.toml}
        shown_turn = {**words, **pictures(turn)}
    return html(
        "suggestions",
        ring=RING,
        shown_view=shown_view,
        turn=shown_turn,
        sentence=spoken_suggestions(suggestions),
        suggestions=[{**_light_entry(x, cd_per_unit), **pictures(x)} for x in suggestions],
    )


def spoken_turn(turn: MoveSuggestion) -> str:
    """Return the gain of turning a light, in one sentence."""
    gain = spoken_fraction(turn.gain_share)
    part = f"{gain} of the difference (in energy)"
    return f"Turning {turn.name} by {turn.turn:.0f}° would remove {part}."


def _light_entry(suggestion: Suggestion, cd_per_unit: float | None) -> dict[str, Any]:
    """Return one suggested light for the section, without its pictures."""
    light_photometry = suggestion.photometry(cd_per_unit)
    entries = [
        ("at", spoken_position(suggestion)),
        ("intensity", f"{' '.join(f'{v:.4g}' for v in suggestion.emission)} W/sr"),
        ("colour", light_photometry.color),
        ("amount", ", ".join(filter(None, light_photometry.amounts))),
        ("removes", f"{spoken_percent(suggestion.gain_share)} of the difference"),
        ("leaves", f"{spoken_percent(suggestion.missed_share)} of it"),
    ]
    return {
        "name": suggestion.name,
        "seen_at": suggestion.seen_at,
        "hex": light_photometry.hex,
        "facts": [(term, value) for term, value in entries if value],
        "xml": suggestion.xml,
    }


def _encoded_picture(image: Floats, transform: ViewTransform) -> dict[str, Any]:
    """Return a picture of linear light, (h, w, 3), for the section."""
    height, width = image.shape[:2]
    source = data_uri(to_8_bit(transform.encode(image)))
    return {"width": width, "height": height, "source": source}
