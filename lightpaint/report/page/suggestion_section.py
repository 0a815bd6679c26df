"""Suggested lights, in words and as a section of the report."""

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.srgb import to_8_bit
from lightpaint.images.denoiser import denoised
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import html
from lightpaint.report.phrases import spoken_percent
from lightpaint.report.rig.hung_lights import spoken_fraction

#: Ring around the place of a light in the picture, dark on bright and bright on dark.
RING = (
    "position:absolute;width:22px;height:22px;margin:-11px 0 0 -11px;border:2px solid #fff;"
    "border-radius:50%;box-shadow:0 0 0 1.5px #000,inset 0 0 0 1.5px #000"
)


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
            name: _picture(denoised(image) if is_clean else image, transform)
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
        suggestions=[{**_light(x, cd_per_unit), **pictures(x)} for x in suggestions],
    )


def spoken_turn(turn: MoveSuggestion) -> str:
    """Return the gain of turning a light, in one sentence."""
    gain = spoken_fraction(turn.gain_share)
    part = f"{gain} of the difference (in energy)"
    return f"Turning {turn.name} by {turn.turn:.0f}° would remove {part}."


def _light(suggestion: Suggestion, cd_per_unit: float | None) -> dict[str, Any]:
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


def _picture(image: Floats, transform: ViewTransform) -> dict[str, Any]:
    """Return a picture of linear light, (h, w, 3), for the section."""
    height, width = image.shape[:2]
    source = data_uri(to_8_bit(transform.encode(image)))
    return {"width": width, "height": height, "source": source}
