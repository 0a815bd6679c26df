"""The contact sheet of a scene's lights: each light alone, with its name and share.

A light that is an image has its map instead, all texels together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.basis import Basis, LightImage, light_images
from lightpaint.colour import encode_display, to_8_bit
from lightpaint.display_text import visible
from lightpaint.images import block_mean, denoised
from lightpaint.lighting import Lighting
from lightpaint.report.comparison import shorten_to_width
from lightpaint.report.hung_light import HungLight
from lightpaint.report.measures import energy_shares
from lightpaint.report.page.figures import exposure_of
from lightpaint.report.page.lights_table import map_picture, map_stops
from lightpaint.report.phrases import spoken_percent
from lightpaint.report.rig_plan import rig_drawing

#: Maximum number of lights shown; the others, with the smallest shares, are counted.
MAX_LIGHTS = 64

#: Widths of a picture by the largest number of lights; height over width of the sheet to aim at.
WIDTHS, ASPECT = {4: 400, 12: 320, 30: 256, MAX_LIGHTS: 208}, 0.62

#: Height of the plan and the elevation, at least, if they have more room than they need.
PLAN_HEIGHT = 240

#: A dark ground, unlike any picture, the colours of texts on it, and the edge of pictures.
GROUND, TEXT, FAINT, EDGE = (24, 24, 26), (226, 226, 226), (142, 142, 146), (44, 44, 48)


@dataclass(frozen=True)
class _Cell:
    """The cell of a light: its picture, (h, w, 3) in display values, or None if it shows
    nothing.
    """

    name: str
    share: str
    picture: Floats | None


@dataclass(frozen=True)
class _Grid:
    """The layout in pixels: width and height of a picture, gaps, and height of the words below
    it.
    """

    width: int
    height: int
    columns: int
    rows: int

    @property
    def text(self) -> int:
        return 16 if self.width > WIDTHS[MAX_LIGHTS] else 14

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
        """Return (width, height) of the sheet."""
        rows = self.rows * (self.height + self.below + self.gap)
        foot_height = round(1.8 * self.text) if has_foot else 0
        return self.columns * (self.width + self.gap) + self.gap, self.head + rows + foot_height

    def corner(self, k: int) -> tuple[int, int]:
        """Return the upper left corner of the picture of that index."""
        row, column = divmod(k, self.columns)
        x = self.gap + column * (self.width + self.gap)
        return x, self.head + row * (self.height + self.below + self.gap)


def light_sheet(
    basis: Basis,
    *,
    title: str,
    lights: Sequence[HungLight] = (),
    up: Position = (0.0, 1.0, 0.0),
) -> npt.NDArray[np.uint8]:
    """Draw each light alone, (H, W, 3) uint8 sRGB, denoised, with its name and share.

    Each is at its current emission, or at a white one if it is off, with an exposure of its own:
    brightness does not compare between pictures. Lights stand in their order; of more than
    MAX_LIGHTS, those with the largest shares, and a line tells the share of the others. Below them
    is a plan of the room, and an elevation, with `lights`; up: the axis of the scene that is up.
    """
    shown = _lights_and_images(basis)
    light_shares = energy_shares(basis, Lighting.current(basis))
    shares = np.array(
        [
            light_shares[one.lights].sum() if isinstance(one, LightImage) else light_shares[one]
            for one in shown
        ]
    )
    shown_indices = sorted(np.argsort(-shares, kind="stable")[:MAX_LIGHTS].tolist())
    grid = _grid(len(shown_indices), basis.size)
    factor = max(1, min(basis.size[1] // grid.width, min(basis.size)))
    cells = [
        _image_cell(basis, one, share, grid)
        if isinstance(one, LightImage)
        else _cell(basis, one, share, factor)
        for one, share in ((shown[i], float(shares[i])) for i in shown_indices)
    ]
    foot = _rest_sentence(shares, shown_indices)
    sheet = Image.new("RGB", grid.size(has_foot=bool(foot)), GROUND)
    draw, large = ImageDraw.Draw(sheet), ImageFont.load_default(round(1.1 * grid.text))
    small = ImageFont.load_default(round(0.9 * grid.text))
    room = sheet.width - 2 * grid.gap
    head = shorten_to_width(visible(title), large, room)
    baseline = 2 * grid.text
    draw.text((grid.gap, baseline), head, TEXT, large, anchor="ls")
    subtitle = "each alone, exposed by itself; its share of the picture as it is"
    if large.getlength(head) + small.getlength(subtitle) + 2 * grid.gap <= room:
        draw.text((sheet.width - grid.gap, baseline), subtitle, FAINT, small, anchor="rs")
    for k, cell in enumerate(cells):
        _draw(sheet, cell, grid, grid.corner(k))
    if foot:
        y = sheet.height - round(2.2 * grid.text)
        draw.text((grid.gap, y), shorten_to_width(foot, small, room), FAINT, small)
    height = max(sheet.width - sheet.height - 1, PLAN_HEIGHT)
    plan = rig_drawing(basis.features, lights, up=up, width=sheet.width, height=height)
    return np.concatenate([np.asarray(x) for x in (sheet, plan) if x is not None])


def _lights_and_images(basis: Basis) -> list[int | LightImage]:
    """Return lights by their index, and each image at the place of its first texel."""
    images = {int(k): image for image in light_images(basis.lights) for k in image.lights}
    firsts = {int(image.lights[0]): image for image in images.values()}
    return [firsts.get(k, k) for k in range(len(basis.lights)) if k in firsts or k not in images]


def _image_cell(basis: Basis, image: LightImage, share: float, grid: _Grid) -> _Cell:
    """Draw the cell of an image: its map as it is, black where a texel is not adjusted alone."""
    radiances = image.radiances(basis.current_weights)
    columns, rows = image.size
    picture = map_picture(image, radiances, map_stops(radiances), grid.width)
    text = spoken_percent(share) if radiances.any() else "off"
    return _Cell(visible(f"{image.name} ({columns}x{rows})"), text, picture)


def _cell(basis: Basis, k: int, share: float, factor: int) -> _Cell:
    """Draw the cell of light k. factor: of the picture's reduction, which averages much of the
    noise.
    """
    light, weight = basis.lights[k], basis.current_weights[k]
    name = light.name if len(light.members) == 1 else f"{light.name} ({len(light.members)})"
    is_off = not weight.any()
    image = block_mean(np.float32(1 if is_off else weight) * basis.planes.plane(k), factor)
    text = "off" if is_off else spoken_percent(share)
    text = f"kept, {text}" if light.is_fixed else text
    if not image.any():
        return _Cell(visible(name), text, None)
    features = None if basis.features is None else basis.features.reduced(factor)
    clean = denoised(image, features)
    sees_emitter = block_mean(basis.emitters_seen.astype(np.float32), factor) > 0
    stops = exposure_of(clean, sees_emitter)
    return _Cell(visible(name), text, encode_display(clean, stops=stops))


def _rest_sentence(shares: Doubles, shown_indices: list[int]) -> str:
    """Return the number and share of lights that are not shown; "" if all are."""
    if not (hidden_count := len(shares) - len(shown_indices)):
        return ""
    other_share = max(1 - float(shares[shown_indices].sum()), 0.0)
    return f"and {hidden_count} more lights, together {spoken_percent(other_share)} of the picture"


def _grid(count: int, size: tuple[int, int]) -> _Grid:
    """Return the grid for a number of pictures of a size (h, w), as near to ASPECT as possible."""
    width = next(sheet_width for max_count, sheet_width in WIDTHS.items() if count <= max_count)
    # Very wide or tall pictures keep room for text, and at most a screen of height.
    height = min(max(round(width * size[0] / size[1]), width // 4), 2 * width)
    # An empty cell is as bad as a sheet that is far too wide.
    grids = [_Grid(width, height, columns, -(-count // columns)) for columns in range(1, count + 1)]

    def aspect_error(grid: _Grid) -> float:
        sheet_width, high = grid.size(has_foot=False)
        empty_share = (grid.columns * grid.rows - count) / count
        return abs(float(np.log(high / sheet_width / ASPECT))) + 3 * empty_share

    return min(grids, key=aspect_error)


def _draw(sheet: Image.Image, cell: _Cell, grid: _Grid, corner: tuple[int, int]) -> None:
    """Draw a picture with an edge, and below it the name at the left and the share at the right."""
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
        position = x + (grid.width - size[0]) // 2, y + (grid.height - size[1]) // 2
        sheet.paste(picture.resize(size, Image.Resampling.LANCZOS), position)
    baseline = y + grid.height + round(1.4 * grid.text)
    draw.text((x + grid.width, baseline), cell.share, FAINT, small, anchor="rs")
    room = grid.width - round(small.getlength(cell.share)) - grid.text
    draw.text((x, baseline), shorten_to_width(cell.name, font, room), TEXT, font, anchor="ls")
