"""The contact sheet of a scene's lights: what each does alone, with its name and share."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.srgb import encode_display, to_8_bit
from lightpaint.images.denoiser import denoised
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.report.comparison import fitted
from lightpaint.report.measures import energy_shares
from lightpaint.report.page.figures import exposure_of
from lightpaint.report.sentences import spoken_percent
from lightpaint.screen import visible

#: More are not shown but counted: those that do least in the picture.
MOST = 64

#: Width of a picture, of so many lights at most; height over width of the sheet that is aimed at.
WIDTHS, ASPECT = {4: 400, 12: 320, 30: 256, MOST: 208}, 0.62

#: A dark ground, that no picture is taken for, and what is written on it; edge of the pictures.
GROUND, TEXT, FAINT, EDGE = (24, 24, 26), (226, 226, 226), (142, 142, 146), (44, 44, 48)


@dataclass(frozen=True)
class _Cell:
    """One light: its picture, (h, w, 3) in display values or None if it does nothing there."""

    name: str
    share: str
    picture: Floats | None


@dataclass(frozen=True)
class _Grid:
    """Pixels: width and height of a picture, gap between them, height of the words below it."""

    width: int
    height: int
    columns: int
    rows: int

    @property
    def text(self) -> int:
        return 16 if self.width > WIDTHS[MOST] else 14

    @property
    def gap(self) -> int:
        return round(1.25 * self.text)

    @property
    def below(self) -> int:
        return round(1.9 * self.text)

    @property
    def head(self) -> int:
        return 3 * self.text

    def size(self, *, has_foot: bool) -> tuple[int, int]:
        """(width, height) of the sheet."""
        rows = self.rows * (self.height + self.below + self.gap)
        foot = round(1.8 * self.text) if has_foot else 0
        return self.columns * (self.width + self.gap) + self.gap, self.head + rows + foot

    def corner(self, k: int) -> tuple[int, int]:
        """The upper left one of the picture of that index."""
        row, column = divmod(k, self.columns)
        x = self.gap + column * (self.width + self.gap)
        return x, self.head + row * (self.height + self.below + self.gap)


def light_sheet(basis: Basis, *, title: str) -> npt.NDArray[np.uint8]:
    """What each light does alone, (H, W, 3) uint8 sRGB, denoised, with its name and share.

    At its present emission, or at one that is white if it is off, and exposed so that it shows:
    what is equally bright in two pictures is not so in the scene. Lights stand in their order; of
    more than MOST, those that do most in the picture, and a line says what the others do.
    """
    shares = energy_shares(basis, Lighting.present(basis))
    shown = sorted(np.argsort(-shares, kind="stable")[:MOST].tolist())
    grid = _grid(len(shown), basis.size)
    factor = max(1, min(basis.size[1] // grid.width, min(basis.size)))
    cells = [_cell(basis, k, float(shares[k]), factor) for k in shown]
    left = _spoken_rest(shares, shown)
    sheet = Image.new("RGB", grid.size(has_foot=bool(left)), GROUND)
    draw, large = ImageDraw.Draw(sheet), ImageFont.load_default(round(1.1 * grid.text))
    small = ImageFont.load_default(round(0.9 * grid.text))
    room = sheet.width - 2 * grid.gap
    head = fitted(visible(title), large, room)
    baseline = 2 * grid.text
    draw.text((grid.gap, baseline), head, TEXT, large, anchor="ls")
    said = "each alone, exposed by itself; its share of the picture as it is"
    if large.getlength(head) + small.getlength(said) + 2 * grid.gap <= room:
        draw.text((sheet.width - grid.gap, baseline), said, FAINT, small, anchor="rs")
    for k, cell in enumerate(cells):
        _draw(sheet, cell, grid, grid.corner(k))
    if left:
        y = sheet.height - round(2.2 * grid.text)
        draw.text((grid.gap, y), fitted(left, small, room), FAINT, small)
    return np.asarray(sheet)


def _cell(basis: Basis, k: int, share: float, factor: int) -> _Cell:
    """Of light k. factor: of the picture's reduction, which averages much of the noise."""
    light, weight = basis.lights[k], basis.present_weights[k]
    name = light.name if len(light.members) == 1 else f"{light.name} ({len(light.members)})"
    is_off = not weight.any()
    image = block_mean(np.float32(1 if is_off else weight) * basis.planes.plane(k), factor)
    said = "off" if is_off else spoken_percent(share)
    said = f"kept, {said}" if light.is_fixed else said
    if not image.any():
        return _Cell(visible(name), said, None)
    features = None if basis.features is None else basis.features.reduced(factor)
    clean = denoised(image, features)
    seen = block_mean(basis.emitters_seen.astype(np.float32), factor) > 0
    stops = exposure_of(clean, seen)
    return _Cell(visible(name), said, encode_display(clean, stops=stops))


def _spoken_rest(shares: Doubles, shown: list[int]) -> str:
    """How many lights are not shown, and what they do; "" if all are."""
    if not (rest := len(shares) - len(shown)):
        return ""
    others = max(1 - float(shares[shown].sum()), 0.0)
    return f"and {rest} more lights, together {spoken_percent(others)} of the picture"


def _grid(count: int, size: tuple[int, int]) -> _Grid:
    """The grid for so many pictures of the (height, width), as near to ASPECT as can be."""
    width = next(wide for most, wide in WIDTHS.items() if count <= most)
    # Panoramas and towers have room for their words, and no more than a screen of height.
    height = min(max(round(width * size[0] / size[1]), width // 4), 2 * width)
    # An empty place counts as much as a sheet that is far too wide.
    grids = [_Grid(width, height, columns, -(-count // columns)) for columns in range(1, count + 1)]

    def off(grid: _Grid) -> float:
        wide, high = grid.size(has_foot=False)
        empty = (grid.columns * grid.rows - count) / count
        return abs(float(np.log(high / wide / ASPECT))) + 3 * empty

    return min(grids, key=off)


def _draw(sheet: Image.Image, cell: _Cell, grid: _Grid, corner: tuple[int, int]) -> None:
    """A picture with an edge, and below it the name at the left and the share at the right."""
    (x, y), draw = corner, ImageDraw.Draw(sheet)
    font, small = (ImageFont.load_default(size) for size in (grid.text, round(0.9 * grid.text)))
    box = (x - 1, y - 1, x + grid.width, y + grid.height)
    draw.rectangle(box, outline=EDGE)
    if cell.picture is None:
        middle = (x + grid.width // 2, y + grid.height // 2)
        draw.text(middle, "not in the picture", FAINT, small, anchor="mm")
    else:
        picture = Image.fromarray(to_8_bit(cell.picture))
        scale = min(grid.width / picture.width, grid.height / picture.height)
        size = max(1, round(scale * picture.width)), max(1, round(scale * picture.height))
        at = x + (grid.width - size[0]) // 2, y + (grid.height - size[1]) // 2
        sheet.paste(picture.resize(size, Image.Resampling.LANCZOS), at)
    baseline = y + grid.height + round(1.4 * grid.text)
    draw.text((x + grid.width, baseline), cell.share, FAINT, small, anchor="rs")
    room = grid.width - round(small.getlength(cell.share)) - grid.text
    draw.text((x, baseline), fitted(cell.name, font, room), TEXT, font, anchor="ls")
