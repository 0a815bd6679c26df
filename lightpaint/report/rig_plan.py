"""Drawings of the places of lights: a plan from above, and an elevation from the side.

The room is drawn as the camera sees it: its pixels as points, in dimmed colours. Moved lights have
a ring at the old place and an arrow to the new one, and those that turned a dashed line in the old
direction; new lights say so. Spots have their beams.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import RGB, Doubles, Position
from lightpaint.display_text import visible
from lightpaint.images import Features
from lightpaint.report.hung_light import HungLight, ViewGeometry
from lightpaint.scene.properties.site import Site

#: Colours of texts and of changes.
TEXT, FAINT, EDGE = (226, 226, 226), (142, 142, 146), (58, 58, 62)
CHANGED = (255, 176, 66)

#: Brightness of the room's points, and their largest side in pixels of the large drawing.
ROOM, LARGEST = 0.45, 40

#: Approximate number of pixels of the room's points that are drawn at a time.
DRAWN_AT_ONCE = 2**14

#: Length of a beam that meets no visible point, as a share of the panel.
BEAM = 0.3

#: Degrees between the old direction of a light and the new one, from which the old one is drawn.
TURNED = 1.0

#: Maximum number of lights that are all named; of more, only those that changed are.
MOST_NAMES = 24

#: The ground.
GROUND = (24, 24, 26)

#: Supersampling of the drawing, which makes lines smooth.
FINER = 2

#: Margin around the visible points, and the distance up to which lights are drawn, as shares.
MARGIN, MAX_DISTANCE = 0.08, 1.5

#: Maximum height of both drawings, relative to their width.
TALLEST = 1.3


@dataclass(frozen=True)
class Panel:
    """A drawing along one axis. right, up: unit vectors; low, scale: from metres to pixels."""

    title: str
    right: Doubles
    up: Doubles
    low: Doubles
    scale: float
    size: tuple[int, int]

    def at(self, points: Doubles | Position) -> Doubles:
        """Return x and y in pixels, (..., 2)."""
        places = np.asarray(points, dtype=float)
        flat = np.stack([places @ self.right, places @ self.up], axis=-1)
        x, y = np.moveaxis((flat - self.low) * self.scale, -1, 0)
        return np.stack([x, self.size[1] - y], axis=-1)


def rig_drawing(
    features: Features | None,
    lights: Sequence[HungLight],
    *,
    up: Position = (0.0, 1.0, 0.0),
    width: int = 960,
    height: int | None = None,
) -> npt.NDArray[np.uint8] | None:
    """Draw a plan and an elevation below it, (h, w, 3) uint8 sRGB; the camera looks to the right.

    features: of the picture. up: the axis of the scene that is up. height: the most, for both
    beside each other. None if the picture does not
    tell where anything is, or no light has a place.
    """
    geometry = ViewGeometry.of(features)
    lights = [light for light in lights if light.place.position is not None]
    if geometry is None or features is None or not lights:
        return None
    is_whole = np.linalg.norm(features.normal, axis=-1) > 0
    albedo = np.where(is_whole[..., None], features.albedo, 0)
    colors = albedo[tuple((geometry.pixels[:, ::-1] - 0.5).astype(int).T)]
    text = FINER * max(11, width // (72 if height is None else 110))
    row = None if height is None else FINER * height - round(2.4 * text)
    panels = plan_and_elevation(geometry, lights, np.array(up), FINER * width, row)
    pictures = [_drawn(panel, geometry, colors, lights, text) for panel in panels]
    sheet = in_row(pictures, width) if row else in_column(pictures, width)
    small = sheet.resize((width, sheet.height // FINER), Image.Resampling.LANCZOS)
    return np.asarray(small)


def _drawn(
    panel: Panel, geometry: ViewGeometry, colors: Doubles, lights: Sequence[HungLight], text: int
) -> Image.Image:
    """Draw one panel, with its title below it."""
    width, height = panel.size
    picture = Image.fromarray(_room(panel, geometry, colors))
    draw = ImageDraw.Draw(picture, "RGBA")
    if geometry.camera is not None:
        _draw_camera(draw, panel, geometry, text)
    ordered_lights = sorted(lights, key=lambda light: light.is_changed)
    for light in ordered_lights:
        _draw_beam(draw, panel, geometry, light)
        _draw_old_direction(draw, panel, geometry, light, text)
    for light in ordered_lights:
        _draw_light(draw, panel, light, text)
    names = {light.place.name: light for light in lights}
    if len(lights) > MOST_NAMES:
        names = {name: light for name, light in names.items() if light.is_changed}
    _draw_names(draw, panel, names, text)
    sheet_image = Image.new("RGB", (width, height + round(2.4 * text)), GROUND)
    sheet_image.paste(picture, (0, 0))
    label_draw = ImageDraw.Draw(sheet_image)
    font = ImageFont.load_default(text)
    y = height + round(1.2 * text)
    label_draw.text((text, y), panel.title, FAINT, font, anchor="lm")
    length = _round_length(0.25 * width / panel.scale)
    end = width - text
    label_draw.line([(end - length * panel.scale, y), (end, y)], FAINT, max(2, text // 8))
    label = f"{length:g}"
    label_draw.text((end - length * panel.scale - text / 2, y), label, FAINT, font, anchor="rm")
    return sheet_image


def _room(panel: Panel, geometry: ViewGeometry, colors: Doubles) -> npt.NDArray[np.uint8]:
    """Draw the visible surfaces as points, without those that hide the rest."""
    towards = np.cross(panel.right, panel.up)
    # Ceilings from above, the near wall from the side.
    faces = geometry.normals @ towards > -0.3
    width, height = panel.size
    image = np.full((height, width, 3), GROUND, np.uint8)
    display = np.clip(colors, 0, 1) ** (1 / 2.2)
    shade = (np.array(GROUND) + ROOM * display * (255 - np.array(GROUND))).astype(np.uint8)
    x, y = panel.at(geometry.points).T.astype(int)
    sides = np.clip(geometry.spacing * panel.scale, 1, LARGEST).astype(int)
    depth = geometry.points @ towards
    # Coarse points first, so that they only fill gaps between others.
    for side in sorted({*sides[faces].tolist()}, reverse=True):
        shown_faces = np.flatnonzero(faces & (sides == side))
        shown_faces = shown_faces[np.argsort(depth[shown_faces])]
        offsets = np.indices((side, side)).reshape(2, -1, 1) - side // 2
        step = max(1, DRAWN_AT_ONCE // max(1, len(shown_faces)))
        for first in range(0, side * side, step):
            i, j = offsets[:, first : first + step]
            across, down = x[shown_faces] + i, y[shown_faces] + j
            inside = (across >= 0) & (across < width) & (down >= 0) & (down < height)
            image[down[inside], across[inside]] = shade[shown_faces[np.nonzero(inside)[1]]]
    return image


def _draw_camera(
    draw: ImageDraw.ImageDraw, panel: Panel, geometry: ViewGeometry, text: int
) -> None:
    assert geometry.camera is not None
    inside = np.array([1.5 * text, 1.5 * text]), np.array(panel.size) - 1.5 * text
    eye = panel.at(geometry.camera)
    way = panel.at(np.median(geometry.points, axis=0)) - eye
    way = way / max(float(np.hypot(*way)), 1e-9)
    # One that stands farther away is drawn at the edge.
    x, y = np.clip(eye, *inside)
    side = np.array([-way[1], way[0]])
    size = 0.8 * text
    corners = [(x, y), *(tuple((x, y) + size * (1.6 * way + s * side)) for s in (0.7, -0.7))]
    draw.polygon(corners, outline=(*FAINT, 255), width=max(2, text // 10))


def _draw_beam(
    draw: ImageDraw.ImageDraw,
    panel: Panel,
    geometry: ViewGeometry,
    light: HungLight,
) -> None:
    """Draw the cone of a spot, or the direction of a panel, up to the surface that it lights."""
    site = light.place.site
    if site.direction is None or site.position is None:
        return
    if site.cutoff is None and not light.is_changed:
        return
    length = _beam_length(panel, geometry, site)
    half_angle = math.radians(site.cutoff or 12.0)
    way = np.array(site.direction) * length
    start, end = panel.at(site.position), panel.at(np.array(site.position) + way)
    along = end - start
    side = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    half = math.tan(min(half_angle, 1.2)) * length * panel.scale
    corners = [tuple(start), tuple(end + half * side), tuple(end - half * side)]
    r, g, b = _shown(light.color)
    draw.polygon(corners, fill=(r, g, b, 60 if light.is_changed else 26))
    if light.is_changed:
        draw.line(
            [tuple(start), tuple(end)], (*CHANGED, 200), max(1, round(0.0015 * panel.size[0]))
        )


def _draw_old_direction(
    draw: ImageDraw.ImageDraw, panel: Panel, geometry: ViewGeometry, light: HungLight, text: int
) -> None:
    """Draw where a light that turned pointed, from its earlier place to the surface that it lit."""
    old_site, way = light.place.moved_from, light.place.direction
    if old_site is None or old_site.position is None or old_site.direction is None or way is None:
        return
    if float(np.dot(old_site.direction, way)) > math.cos(math.radians(TURNED)):
        return
    length = _beam_length(panel, geometry, old_site)
    end = np.array(old_site.position) + length * np.array(old_site.direction)
    ends = panel.at(old_site.position), panel.at(end)
    dashes(draw, *ends, CHANGED, width=max(2, text // 9), dash=0.45 * text)


def _beam_length(panel: Panel, geometry: ViewGeometry, site: Site) -> float:
    """Return the distance to the surface that a light points at, or of a beam that meets none."""
    aim = geometry.aim_of(site)
    if aim is None or site.position is None:
        return BEAM * panel.size[0] / panel.scale
    return math.dist(aim, site.position)


def _draw_light(draw: ImageDraw.ImageDraw, panel: Panel, light: HungLight, text: int) -> None:
    """Draw a light at its place and, if it moved, its earlier place."""
    assert light.place.position is not None
    centre, radius = panel.at(light.place.position), 0.42 * text
    line_width = max(2, text // 9)
    old_site = light.place.moved_from
    if old_site is not None and old_site.position is not None:
        old_centre = panel.at(old_site.position)
        circle(draw, old_centre, 0.8 * radius, outline=CHANGED, width=line_width)
        if float(np.hypot(*(centre - old_centre))) > 2.2 * radius:
            arrow(draw, old_centre, centre, CHANGED, width=line_width, head=0.8 * text)
    edge = CHANGED if light.is_changed else TEXT
    circle(draw, centre, radius, fill=_shown(light.color), outline=edge, width=line_width)


def _draw_names(
    draw: ImageDraw.ImageDraw, panel: Panel, names: Mapping[str, HungLight], text: int
) -> None:
    """Draw names beside lights, moved down where one would cover another."""
    font, label_boxes = ImageFont.load_default(round(0.9 * text)), list[tuple[float, ...]]()
    for name, light in sorted(names.items(), key=lambda item: not item[1].is_changed):
        assert light.place.position is not None
        x, y = panel.at(light.place.position)
        label = f"{visible(name)} (new)" if light.place.new else visible(name)
        label_width = font.getlength(label)
        left = x + 0.7 * text
        if left + label_width > panel.size[0]:
            left = x - 0.7 * text - label_width
        top = y - 0.5 * text
        for _ in range(len(names)):
            box = (left, top, left + label_width, top + 1.05 * text)
            overlapping_boxes = [b for b in label_boxes if _overlap(box, b)]
            if not overlapping_boxes:
                break
            top = max(b[3] for b in overlapping_boxes)
        if top + text > panel.size[1]:
            continue  # a plan of a hundred lamps has no room for their names
        label_boxes.append((left, top, left + label_width, top + 1.05 * text))
        color = CHANGED if light.is_changed else (190, 190, 194)
        draw.text((left, top), label, color, font, stroke_width=text // 8, stroke_fill=GROUND)


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def circle(
    draw: ImageDraw.ImageDraw,
    middle: Doubles,
    radius: float,
    *,
    outline: tuple[int, ...],
    width: int,
    fill: tuple[int, ...] | None = None,
) -> None:
    """Draw a circle."""
    x, y = middle
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill, outline, width)


def arrow(
    draw: ImageDraw.ImageDraw,
    start: Doubles,
    end: Doubles,
    color: tuple[int, ...],
    *,
    width: int,
    head: float,
) -> None:
    """Draw an arrow from `start` to `end`, in pixels."""
    along = (np.asarray(end) - start) / max(float(np.hypot(*(np.asarray(end) - start))), 1e-9)
    side = np.array([-along[1], along[0]])
    neck = np.asarray(end) - head * along
    draw.line([tuple(start), tuple(neck)], color, width)
    corners = [tuple(end), tuple(neck + 0.4 * head * side), tuple(neck - 0.4 * head * side)]
    draw.polygon(corners, fill=color)


def dashes(
    draw: ImageDraw.ImageDraw,
    start: Doubles,
    end: Doubles,
    color: tuple[int, ...],
    *,
    width: int,
    dash: float,
) -> None:
    """Draw a dashed line, in pixels. dash: length of a dash, and of a gap."""
    way = np.asarray(end) - start
    count = max(1, round(float(np.hypot(*way)) / dash))
    for k in range(0, count, 2):
        first, last = start + way * k / count, start + way * min(k + 1, count) / count
        draw.line([tuple(first), tuple(last)], color, width)


def _shown(color: RGB) -> tuple[int, int, int]:
    """Return the hue of a light for display, with its brightest channel at full."""
    brightest = max(color)
    if brightest <= 0:
        return (70, 70, 74)
    r, g, b = (round(255 * max(v / brightest, 0) ** (1 / 2.2)) for v in color)
    return r, g, b


def _round_length(length: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most `length`."""
    if not length > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(length))
    return max(step * power for step in (1, 2, 5) if step * power <= length)


def in_column(pictures: Sequence[Image.Image], width: int) -> Image.Image:
    """Return pictures one below the other, in the middle of a sheet of that width."""
    sheet = Image.new("RGB", (FINER * width, sum(x.height for x in pictures)), GROUND)
    y = 0
    for picture in pictures:
        sheet.paste(picture, ((sheet.width - picture.width) // 2, y))
        y += picture.height
    return sheet


def in_row(pictures: Sequence[Image.Image], width: int) -> Image.Image:
    """Return pictures beside each other, on one line at the bottom."""
    tallest = max(x.height for x in pictures)
    sheet = Image.new("RGB", (FINER * width, tallest), GROUND)
    gap = (sheet.width - sum(x.width for x in pictures)) // (len(pictures) + 1)
    x = gap
    for picture in pictures:
        sheet.paste(picture, (x, tallest - picture.height))
        x += picture.width + gap
    return sheet


def plan_and_elevation(
    geometry: ViewGeometry, lights: Sequence[HungLight], up: Doubles, width: int, row: int | None
) -> list[Panel]:
    """Return plan and elevation on one scale, `width` pixels wide or less.

    row: largest height of the two side by side; None to draw them below each other.
    """
    forward = _forward_direction(geometry, up)
    left = np.cross(up, forward)
    places = _places_near(geometry, lights)
    low, high = np.percentile(geometry.points, [0.5, 99.5], axis=0)
    points = np.concatenate([places, [low, high]])
    views = [
        ("plan: the camera looks to the right", left),
        ("elevation", up),
    ]
    flat = np.stack([points @ forward, points @ left, points @ up], axis=1)
    lowest, highest = flat.min(axis=0), flat.max(axis=0)
    room = MARGIN * float((highest - lowest).max())
    lowest, extent = lowest - room, highest - lowest + 2 * room
    if row is None:
        scale = min(width / extent[0], TALLEST * width / (extent[1] + extent[2]))
    else:
        scale = min(0.96 * width / (2 * extent[0]), row / max(extent[1], extent[2]))
    return [
        Panel(
            title,
            forward,
            along,
            lowest[[0, k]],
            scale,
            (int(extent[0] * scale), int(extent[k] * scale)),
        )
        for k, (title, along) in enumerate(views, 1)
    ]


def _forward_direction(geometry: ViewGeometry, up: Doubles) -> Doubles:
    """Return the axis of the scene across `up` that leads away from the camera."""
    camera = geometry.camera
    way = np.ptp(geometry.points, axis=0)
    if camera is not None:
        way = np.median(geometry.points, axis=0) - np.array(camera)
    way = np.where(np.abs(up) > 0.5, 0, way)
    axis = np.zeros(3)
    k = int(np.argmax(np.abs(way)))
    axis[k] = 1.0 if way[k] >= 0 else -1.0
    return axis


def _places_near(geometry: ViewGeometry, lights: Sequence[HungLight]) -> Doubles:
    """Return the places of lights, old and new, near the visible points."""
    sites = [light.place.site for light in lights]
    sites += [light.place.moved_from for light in lights if light.place.moved_from is not None]
    places = [site.position for site in sites if site.position is not None]
    low, high = np.percentile(geometry.points, [0.5, 99.5], axis=0)
    margin = MAX_DISTANCE * float((high - low).max())
    positions = np.array(places, dtype=float).reshape(-1, 3)
    is_near = ((positions > low - margin) & (positions < high + margin)).all(axis=1)
    return np.asarray(positions[is_near])
