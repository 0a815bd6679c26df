"""comparison.png: target | predicted | verified | residual, side by side."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.images import block_mean, enlarged, whole_factor
from lightpaint.lighting import Appearance, Solution, compare_appearance
from lightpaint.report import answer_pictures
from lightpaint.report.basis_memo import look_reduction
from lightpaint.report.phrases import spoken_progress
from lightpaint.report.verdict_sentences import are_held_back
from lightpaint.target import Target

#: Narrower images are enlarged, pixel by pixel, until their captions can be read, unless they would
#: become higher than that; what they lack in width is grey then.
MIN_WIDTH, MAX_ENLARGED_HEIGHT = 240, 2000
#: Pillow's own font has little beyond Latin-1: no minus, no Greek.
SURROUND, TEXT, FAINT = (38, 38, 38), (230, 230, 230), (165, 165, 165)


@dataclass(frozen=True)
class Tile:
    """A picture of the comparison, (h, w, 3) in 8 bits, with the texts below it.

    limit: end of its false-colour scale, drawn as a bar, if it has one.
    """

    title: str
    detail: str
    picture: npt.NDArray[np.uint8]
    limit: float | None = None


def comparison_image(
    *,
    basis: Basis,
    target: Target,
    solution: Solution,
    predicted: Floats,
    verified: Floats | None,
    verified_spp: int | None = None,
    appearance: Appearance | None = None,
    looks: answer_pictures.CleanLooks | None = None,
    missed: answer_pictures.Residual | None = None,
) -> npt.NDArray[np.uint8]:
    """Draw the pictures in a row, (H, W, 3) uint8 sRGB, all at one exposure, with captions.

    predicted, verified: (h, w, 3) linear, the latter possibly at a multiple of the size; smaller
    pictures are shown with larger pixels, large ones reduced as in a page. Three pictures where
    `verified` is None. The residual is false-coloured luminance of prediction minus target, of raw
    data; pixels that do not count are grey and dim. verified_spp: samples per pixel of `verified`,
    which its caption says, since few show no small patches of light. appearance: the result of
    `compare_appearance`, if known. looks: shown instead of raw renders. missed: the result of
    `residual_of`. Raises SizeError if target and basis differ in size.
    """
    target = target.fitted_to(basis.size, resize=False)
    looks = looks or answer_pictures.CleanLooks.raw(
        basis, predicted, verified, factor=look_reduction(basis.size)
    )
    transform = looks.encoder(answer_pictures.report_transform(target, basis, predicted))
    view_note = (
        f" ({answer_pictures.spoken_view(transform)})"
        if answer_pictures.spoken_view(transform)
        else ""
    )
    tiles = [
        _target_tile(target, looks.current, transform=transform),
        Tile(
            f"predicted{view_note}",
            _short_verdict(appearance or compare_appearance(solution)),
            to_8_bit(transform.encode(looks.predicted)),
        ),
    ]
    if verified is not None and looks.verified is not None:
        difference = _rms_difference(predicted, verified)
        samples = "" if verified_spp is None else f", {verified_spp} spp"
        tiles.append(
            Tile(
                f"verified{view_note}",
                f"independent render{samples}, RMS {difference:.2g} off",
                to_8_bit(transform.encode(looks.verified)),
            )
        )
    missed = missed or answer_pictures.residual_of(solution, predicted, transform=transform)
    picture = answer_pictures.residual_picture(
        missed, solution, looks.current, transform=transform, finish=to_8_bit
    )
    detail = f"luminance, predicted - target{missed.spoken}"
    tiles.append(Tile("residual", detail, picture, missed.limit))
    return compose(tiles)


def _target_tile(target: Target, current: Floats, *, transform: ViewTransform) -> Tile:
    """Return the picture of the target. current: the background of pixels that do not count."""
    is_part = not target.is_whole
    rest = "the current look" if target.over_look else "grey"
    return Tile(
        f"target: {target.name}",
        f"{target.spoken_share} painted{f', the rest {rest}' if is_part else ''}",
        answer_pictures.target_picture(target, current, transform=transform, finish=to_8_bit),
    )


def _rms_difference(predicted: Floats, verified: Floats) -> float:
    """Return the RMS of the difference, (h, w, 3) each, `verified` possibly at a multiple of the
    size.
    """
    factor = whole_factor(verified.shape[:2], predicted.shape[:2])
    assert factor is not None
    gap = predicted.astype(np.float64) - block_mean(verified, factor)
    return float(np.sqrt(np.square(gap).mean()))


def compose(tiles: list[Tile]) -> npt.NDArray[np.uint8]:
    """Draw tiles in a row on neutral grey, captions below. Returns (H, W, 3).

    Pixels of the others are whole blocks of the pixels of the largest tile.
    """
    height, width = max(tile.picture.shape[:2] for tile in tiles)
    zoom = max(1, min(-(-MIN_WIDTH // width), MAX_ENLARGED_HEIGHT // height))
    shown_size = height, width = height * zoom, width * zoom
    width = max(width, MIN_WIDTH)
    # In proportion to the pictures, except for low panoramas, and never too small to read.
    text = gap = max(12, min(width // 24, height // 6))
    lines = 5.5 if any(tile.limit is not None for tile in tiles) else 4
    size = (gap + len(tiles) * (width + gap), gap + height + round(lines * text))
    sheet = Image.new("RGB", size, SURROUND)
    for k, tile in enumerate(tiles):
        x = gap + k * (width + gap)
        factor = whole_factor(shown_size, tile.picture.shape[:2])
        picture = enlarged(tile.picture, factor or zoom)
        sheet.paste(Image.fromarray(picture), (x, gap))
        _caption(sheet, tile, (x, gap + height + text // 2), width, text)
    return np.asarray(sheet)


def _caption(
    sheet: Image.Image, tile: Tile, corner: tuple[int, int], width: int, text: int
) -> None:
    """Draw a line of title, a smaller one of detail and, for a false-colour picture, one of
    scale."""
    (x, y), draw = corner, ImageDraw.Draw(sheet)
    title, small_font = ImageFont.load_default(text), ImageFont.load_default(round(0.8 * text))
    draw.text((x, y), shorten_to_width(tile.title, title, width), TEXT, title)
    draw.text(
        (x, y + round(1.5 * text)),
        shorten_to_width(tile.detail, small_font, width),
        FAINT,
        small_font,
    )
    if tile.limit is not None:
        _scale_bar(sheet, tile.limit, (x, y + round(2.9 * text)), width, small_font)


def _scale_bar(
    sheet: Image.Image, limit: float, corner: tuple[int, int], width: int, font: Any
) -> None:
    """Draw a bar from −limit to +limit between its ends in words, or in numbers if there is no
    room.

    corner: the upper left one of the line, which is `width` long.
    """
    (x, y), draw, gap = corner, ImageDraw.Draw(sheet), round(font.size / 2)
    for low, high in (
        (f"too dark -{limit:g}", f"+{limit:g} too bright"),
        (f"-{limit:g}", f"+{limit:g}"),
    ):
        ends = [round(font.getlength(end)) for end in (low, high)]
        length = min(width - sum(ends) - 2 * gap, width // 3)
        if length >= width // 6:
            break
    bar = to_8_bit(answer_pictures.diverging(np.linspace(-1, 1, length)))[None].repeat(
        round(0.9 * font.size), 0
    )
    draw.text((x, y), low, FAINT, font)
    sheet.paste(Image.fromarray(bar), (x + ends[0] + gap, y + round(0.2 * font.size)))
    draw.text((x + ends[0] + length + 2 * gap, y), high, FAINT, font)


def shorten_to_width(words: str, font: Any, width: int) -> str:
    """Return `words`, cut short with … if they are wider than `width` pixels."""
    if font.getlength(words) <= width:
        return words
    while words and font.getlength(words + "…") > width:
        words = words[:-1]
    return words.rstrip() + "…"


def _short_verdict(appearance: Appearance) -> str:
    word = (
        "close"
        if appearance.is_close
        else ("held back" if are_held_back(appearance) else "out of reach")
        if appearance.is_far and not appearance.is_hidden_by_noise
        else "close on the whole"
        if appearance.is_nearly_equal
        else spoken_progress(appearance.progress).lower()
    )
    delta_e, noise = appearance.delta_e, appearance.noise
    return f"{word}: mean dE {delta_e:.1f} (noise {noise:.1f})"
