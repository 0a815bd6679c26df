"""comparison.png: target | predicted | verified | residual, side by side."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display import to_8_bit
from lightpaint.images.blocks import block_mean, enlarged
from lightpaint.lighting.solution import Solution
from lightpaint.report.looks import Looks
from lightpaint.report.pictures import (
    diverging,
    painted,
    residual_of,
    residual_picture,
    spoken_view,
    target_picture,
    transform_of,
)
from lightpaint.report.verdict import relative_residual
from lightpaint.target.target import Target

#: Narrower images are enlarged, pixel by pixel, until their captions can be read.
NARROWEST = 240
#: Pillow's own font has little beyond Latin-1: no minus, no Greek.
SURROUND, TEXT, FAINT = (38, 38, 38), (230, 230, 230), (165, 165, 165)


@dataclass(frozen=True)
class Tile:
    """One of the pictures, (h, w, 3) in display values, and what stands below it.

    limit: end of its false-colour scale, drawn as a bar, if it has one.
    """

    title: str
    detail: str
    picture: Floats
    limit: float | None = None


def comparison_image(
    *,
    basis: Basis,
    target: Target,
    solution: Solution,
    predicted: Floats,
    verified: Floats | None,
    looks: Looks | None = None,
) -> npt.NDArray[np.uint8]:
    """The pictures in a row, (H, W, 3) uint8 sRGB, all at one exposure, with captions.

    predicted, verified: (h, w, 3) linear, the latter possibly larger by a whole factor; what
    is smaller is shown with larger pixels. Three pictures where `verified` is None. The
    residual is false-coloured luminance of prediction minus target, of raw data; pixels that
    do not count are grey, dim and hatched. looks: what to show instead of raw renders.
    Raises SizeError if target and basis differ in size.
    """
    target = target.fitted_to(basis.size, resize=False)
    looks = looks or Looks.raw(basis, predicted, verified)
    transform = transform_of(target, predicted, verified)
    share = float(painted(target, solution).mean())
    at = f" ({spoken_view(transform)})" if spoken_view(transform) else ""
    tiles = [
        Tile(
            f"target: {target.name}",
            f"{_percent(share)} painted{', the rest hatched' if share < 0.995 else ''}",
            target_picture(target, solution, looks.current, transform=transform),
        ),
        Tile(
            f"predicted{at}",
            f"misses {_percent(relative_residual(solution))} of the target (RMS, with noise)",
            transform.encode(looks.predicted),
        ),
    ]
    if verified is not None and looks.verified is not None:
        factor = verified.shape[0] // predicted.shape[0]
        gap = predicted.astype(np.float64) - block_mean(verified, factor)
        rmse = float(np.sqrt(np.square(gap).mean()))
        tiles.append(
            Tile(
                f"verified{at}",
                f"independent render, {rmse:.2g} RMS off the prediction",
                transform.encode(looks.verified),
            )
        )
    missed = residual_of(solution, predicted, transform=transform)
    picture = residual_picture(missed, solution, looks.current, transform=transform)
    detail = f"luminance, predicted - target{missed.spoken}"
    tiles.append(Tile("residual", detail, picture, missed.limit))
    return compose(tiles)


def compose(tiles: list[Tile]) -> npt.NDArray[np.uint8]:
    """Tiles in a row on neutral grey, captions below. Returns (H, W, 3).

    The size of the largest tile is a whole multiple of the others'.
    """
    height, width = max(tile.picture.shape[:2] for tile in tiles)
    zoom = max(1, -(-NARROWEST // width))
    height, width = height * zoom, width * zoom
    text = min(max(width // 24, 12), 28)
    gap = text
    size = (gap + len(tiles) * (width + gap), gap + height + 4 * text)
    sheet = Image.new("RGB", size, SURROUND)
    for k, tile in enumerate(tiles):
        x = gap + k * (width + gap)
        picture = enlarged(to_8_bit(tile.picture), width // tile.picture.shape[1])
        sheet.paste(Image.fromarray(picture), (x, gap))
        _caption(ImageDraw.Draw(sheet), tile, (x, gap + height + text // 2), width, text)
        if tile.limit is not None:
            _scale_bar(sheet, tile.limit, (x, gap + height + text // 2), width, text)
    return np.asarray(sheet)


def _caption(
    draw: ImageDraw.ImageDraw, tile: Tile, corner: tuple[int, int], width: int, text: int
) -> None:
    x, y = corner
    title, small = ImageFont.load_default(text), ImageFont.load_default(round(0.8 * text))
    # The residual's upper line leaves its right half to the scale bar.
    room = width if tile.limit is None else width // 3
    draw.text((x, y), fitted(tile.title, title, room), TEXT, title)
    draw.text((x, y + round(1.5 * text)), fitted(tile.detail, small, width), FAINT, small)


def _scale_bar(
    sheet: Image.Image, limit: float, corner: tuple[int, int], width: int, text: int
) -> None:
    """A bar from −limit to +limit in the right part of the caption, its ends in numbers."""
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(round(0.8 * text))
    low, high = f"too dark -{limit:g}", f"+{limit:g} too bright"
    right = corner[0] + width
    x = right - round(draw.textlength(high, font))
    draw.text((x, corner[1] + text // 5), high, FAINT, font)
    length = width // 6
    bar = to_8_bit(diverging(np.linspace(-1, 1, length)))[None].repeat(round(0.7 * text), axis=0)
    x -= length + text // 3
    sheet.paste(Image.fromarray(bar), (x, corner[1] + round(0.3 * text)))
    x -= round(draw.textlength(low, font)) + text // 3
    draw.text((x, corner[1] + text // 5), low, FAINT, font)


def fitted(words: str, font: Any, width: int) -> str:
    """`words`, cut short with … where they are wider than `width` pixels."""
    if font.getlength(words) <= width:
        return words
    while words and font.getlength(words + "…") > width:
        words = words[:-1]
    return words.rstrip() + "…"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.1f} %"
