"""Suggested lights, in words and as a section of the report. Sections are HTML."""

from collections.abc import Sequence
from dataclasses import replace
from html import escape

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.srgb import to_8_bit
from lightpaint.images.denoiser import denoised
from lightpaint.placement.suggestions.suggestion import MoveSuggestion, Suggestion
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import facts
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
) -> str:
    """Return each suggested light: the picture without and with it, its place, and its XML.

    Without any the section is empty. turn: the turn of an existing light, which comes first.
    shown_view: the sensor of the small pictures, if there are several painted views.
    is_clean: whether to denoise the pictures.
    """
    if suggestions is None:
        return ""
    method = (
        "<p>Each is a point light that was tried in free space, with all lights solved again "
        "together with it and those above it. Paste it into <code>&lt;scene&gt;</code> and "
        "solve again; the small pictures are previews.</p>"
        if suggestions
        else ""
    )
    shown = "".join(
        _suggestion_html(
            replace(x, without=denoised(x.without), with_it=denoised(x.with_it)) if is_clean else x,
            before=k > 0,
            transform=transform,
            cd_per_unit=cd_per_unit,
        )
        for k, x in enumerate(suggestions)
    )
    return (
        f"<section><h2>Lights that would help</h2>{_views_html(shown_view)}"
        f"{_turn_html(turn, transform=transform, is_clean=is_clean)}"
        f"<p>{escape(spoken_suggestions(suggestions))}</p>{method}{shown}</section>"
    )


def _views_html(shown_view: str) -> str:
    """Return the remark on views, if there are several."""
    if not shown_view:
        return ""
    return f"<p>All painted views count; the small pictures show {escape(shown_view)}.</p>"


def spoken_turn(turn: MoveSuggestion) -> str:
    """Return the gain of turning a light, in one sentence."""
    gain = spoken_fraction(turn.gain_share)
    part = f"{gain} of the difference (in energy)"
    return f"Turning {turn.name} by {turn.turn:.0f}° would remove {part}."


def _turn_html(turn: MoveSuggestion | None, *, transform: ViewTransform, is_clean: bool) -> str:
    """Return the turn of a light: its pictures, and the lines that let it turn."""
    if turn is None:
        return ""
    pictures = [denoised(x) if is_clean else x for x in (turn.without, turn.with_it)]
    name = escape(turn.name)
    return (
        f"<p>{escape(spoken_turn(turn))} Let it turn in the lights file, and solve again:</p>"
        f"<pre>{escape(turn.toml)}</pre>"
        '<div class="maps">'
        f"{_picture(pictures[0], f'{name} as it is', 'as solved', None, transform)}"
        f"{_picture(pictures[1], f'{name} turned', 'a preview, solved again', None, transform)}"
        "</div>"
    )


def _suggestion_html(
    suggestion: Suggestion, *, before: bool, transform: ViewTransform, cd_per_unit: float | None
) -> str:
    """Return one suggested light. before: whether there are earlier ones, which are in both
    pictures.
    """
    light_photometry = suggestion.photometry(cd_per_unit)
    amounts = ", ".join(filter(None, light_photometry.amounts))
    entries = [
        ("at", spoken_position(suggestion)),
        ("intensity", f"{' '.join(f'{v:.4g}' for v in suggestion.emission)} W/sr"),
        ("colour", light_photometry.color),
        ("amount", amounts),
        ("removes", f"{spoken_percent(suggestion.gain_share)} of the difference"),
        ("leaves", f"{spoken_percent(suggestion.missed_share)} of it"),
    ]
    facts_html = facts((k, v) for k, v in entries if v)
    swatch = (
        f'<span class="swatch" style="background: {light_photometry.hex}"></span>'
        if light_photometry.hex
        else ""
    )
    position = (
        "the ring marks its position, which may be hidden"
        if suggestion.seen_at
        else "its position is outside the picture"
    )
    without = "with those above it" if before else "as solved"
    name = escape(suggestion.name)
    return (
        f'<h3 style="margin-top:24px">{name}</h3><div class="maps">'
        f"{_picture(suggestion.without, f'Without {name}', without, None, transform)}"
        f"{_picture(suggestion.with_it, f'With {name}', position, suggestion.seen_at, transform)}"
        f"<div>{swatch}<dl>{facts_html}</dl></div></div>"
        f'<pre style="margin-top:12px">{escape(suggestion.xml)}</pre>'
    )


def _picture(
    image: Floats,
    name: str,
    caption: str,
    mark: tuple[float, float] | None,
    transform: ViewTransform,
) -> str:
    height, width = image.shape[:2]
    ring = ""
    if mark is not None:
        place = f"left:{100 * mark[0]:.2f}%;top:{100 * mark[1]:.2f}%"
        ring = f'<span style="{RING};{place}" aria-hidden="true"></span>'
    source = data_uri(to_8_bit(transform.encode(image)))
    return (
        f'<figure><div style="position:relative"><img width="{width}" height="{height}" '
        f'alt="{name}: {caption}." src="{source}">{ring}</div>'
        f"<figcaption><strong>{name}</strong>: {caption}.</figcaption></figure>"
    )
