"""Measured illuminance as files: points as CSV, planes as JSON, false-colour pictures."""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import Doubles
from lightpaint.display_text import visible
from lightpaint.files import one_line, write_bytes, write_text
from lightpaint.images.formats import png_bytes
from lightpaint.photometry import illuminance
from lightpaint.photometry.glare import Glare, GlareReading
from lightpaint.storage.json_records import strict_json

FORMAT = "lightpaint-illuminance 1"
#: The remark on a plane that no lamp reaches.
NO_LIGHT = "no lamp reaches it: is it below the floor, or do its points face away?"

#: Files of a measurement; each plane has a picture beside them.
POINTS, PLANES, PICTURE_SUFFIX = "planes.csv", "planes.json", ".png"

#: Relative miss that is none: errors in a solve are those with all lamps at full.
CLOSE = 2e-3

#: Colours from little to much light, evenly spaced: they also differ in lightness, for those who
#: see few colours and for prints without any.
COLOURS = np.array(
    [(38, 14, 74), (59, 60, 138), (42, 110, 142), (32, 156, 137), (98, 200, 98), (248, 230, 60)],
    float,
)

GROUND, TEXT, LINE = (24, 24, 26), (226, 226, 226), 0.55

#: Approximate side of the longer side of a plane's picture, largest side of a cell, and space for
#: the scale at the right and the title above, in pixels.
LONGEST, LARGEST_CELL, SCALE_WIDTH, TITLE_HEIGHT, MARGIN = 640, 96, 120, 40, 16

#: Size of numbers on the picture, in pixels, and the least space between two.
NUMBER_SIZE, NUMBER_GAP = 12, 24

#: Grey of a colour, 0 to 255, above which the number on it is dark.
LIGHT_GROUND = 110

#: Approximate number of isolux lines, and least height of the picture.
STEPS, LEAST_HEIGHT = 10, 240


def readings_files(planes: Iterable[str]) -> list[str]:
    """Return the names of the files that `write_readings` writes. planes: their names."""
    return [POINTS, PLANES, *(name + PICTURE_SUFFIX for name in planes)]


def write_readings(
    folder: Path,
    measured: illuminance.Illuminance,
    weights: Doubles,
    origin: str,
    *,
    glare: Glare | None = None,
) -> None:
    """Write the illuminance on all planes, and the glare if it was measured, into `folder`. origin:
    scene and lighting, as text.
    """
    write_text(folder / POINTS, points_text(measured, weights))
    document = readings_document(measured, weights, glare=glare) | {"origin": origin}
    write_text(folder / PLANES, json.dumps(document, indent=2, allow_nan=False) + "\n")
    for plane in measured.planes:
        values = measured.of(weights)[measured.points_of(plane.name)]
        title = f"{plane.name}, {origin}"
        image = false_colours(plane, values, title)
        write_bytes(folder / (plane.name + PICTURE_SUFFIX), png_bytes(image))


def points_text(measured: illuminance.Illuminance, weights: Doubles) -> str:
    """Return the illuminance at all points as CSV, in lx with standard errors."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("plane", "x", "y", "z", "lux", "standard_error"))
    values, errors = measured.of(weights), measured.standard_errors(weights)
    for plane in measured.planes:
        part = measured.points_of(plane.name)
        for point, value, error in zip(plane.points, values[part], errors[part], strict=True):
            place = (f"{x:.6g}" for x in point)
            writer.writerow((plane.name, *place, f"{value:.6g}", f"{error:.3g}"))
    return text.getvalue()


def readings_document(
    measured: illuminance.Illuminance, weights: Doubles, *, glare: Glare | None = None
) -> dict[str, Any]:
    """Return the readings of all planes and observers for programs (docs/photometry.md)."""
    observers = {} if glare is None else glare.readings(weights)
    return {
        "format": FORMAT,
        "cd_per_unit": measured.cd_per_unit,
        "planes": {
            plane.name: _plane_document(plane, measured, weights) for plane in measured.planes
        },
        "observers": {name: glare_document(x) for name, x in observers.items()},
    }


def glare_document(reading: GlareReading) -> dict[str, Any]:
    """Return the glare that an observer sees for programs."""
    return {
        "ugr": reading.rating,
        "ugr_error": reading.error if reading.rating is not None else None,
        "background_cd_m2": reading.background,
        "strongest": reading.strongest or None,
        "unknown_because": reading.reason or None,
    }


def _plane_document(
    plane: illuminance.MeasuringPlane, measured: illuminance.Illuminance, weights: Doubles
) -> dict[str, Any]:
    """Return the reading of a plane, what was wished for, and the mean that each light gives."""
    by_light = np.einsum("pnc,nc->n", measured.matrix[measured.points_of(plane.name)], weights)
    means = by_light / len(plane)
    return {
        **asdict(measured.reading(plane.name, weights)),
        "area_m2": plane.area_m2,
        "spacing_m": plane.spacing,
        "is_cylindrical": plane.is_cylindrical,
        "wishes": wishes_document(plane.wishes),
        "mean_by_light": dict(zip(measured.lights.names, means.tolist(), strict=True)),
    }


def wishes_document(wishes: illuminance.Wishes) -> dict[str, Any]:
    """Return wishes for programs, without what is not wished for."""
    document = {key: value for key, value in asdict(wishes).items() if value}
    if wishes.preset:
        document["preset_from"] = str(illuminance.PRESETS[wishes.preset])
    return document


def missed_wishes(measured: illuminance.Illuminance, weights: Doubles) -> list[str]:
    """Return a sentence for each wish that is not met at the sure end of its 95 % interval, and for
    each plane that no lamp reaches.
    """
    readings, missed = measured.readings(weights), list[str]()
    for plane in measured.planes:
        wishes, reading = plane.wishes, readings[plane.name]
        least = reading.mean - reading.mean_interval
        if not measured.matrix[measured.points_of(plane.name)].any():
            missed.append(f"{plane.name}: {NO_LIGHT}")
            continue
        if wishes.mean is not None and least < wishes.mean * (1 - CLOSE):
            sure = _sure(reading.mean, least, wishes.mean, " lx")
            missed.append(f"{plane.name}: a mean of {sure}, wished for {wishes.mean:g}")
        missed += _missed_by_points(measured, plane, reading, weights)
        for wish in wishes.ratios:
            other = readings[wish.to].mean
            ratio, sure_ratio = (x / other if other > 0 else np.inf for x in (reading.mean, least))
            if sure_ratio < wish.at_least * (1 - CLOSE):
                of_mean = f" of the mean of {wish.to}"
                sure = _sure(ratio, sure_ratio, wish.at_least, of_mean, is_share=True)
                missed.append(f"{plane.name}: {sure}, wished for {wish.at_least:g}")
    return missed


def _missed_by_points(
    measured: illuminance.Illuminance,
    plane: illuminance.MeasuringPlane,
    reading: illuminance.PlaneReading,
    weights: Doubles,
) -> Iterator[str]:
    """Yield a sentence for a uniformity and a limit that are missed."""
    part, wishes = measured.points_of(plane.name), plane.wishes
    values, errors = measured.of(weights)[part], measured.standard_errors(weights)[part]
    relative = illuminance.relative_intervals(values, errors)
    least = float((values * (1 - relative)).min()) / reading.mean if reading.mean > 0 else 0.0
    if wishes.uniformity is not None and least < wishes.uniformity * (1 - CLOSE):
        sure = _sure(reading.uniformity, least, wishes.uniformity, is_share=True)
        yield f"{plane.name}: a uniformity of {sure}, wished for {wishes.uniformity:g}"
    most = float((values * (1 + relative)).max())
    if wishes.most is not None and most > wishes.most * (1 + CLOSE):
        sure = _sure(reading.most, most, wishes.most, " lx", is_most=True)
        yield f"{plane.name}: up to {sure}, wished for at most {wishes.most:g}"


def _sure(
    value: float,
    end: float,
    asked: float,
    unit: str = "",
    *,
    is_share: bool = False,
    is_most: bool = False,
) -> str:
    """Return a value in words, with the sure end of its interval where that alone misses, in as
    many digits as show that.
    """
    is_enough = value <= asked if is_most else value >= asked
    for digits in range(6):
        shown = f".{2 + digits}f" if is_share else f".{4 + digits}g"
        spoken, spoken_end = format(value, shown), format(end, shown)
        if not is_enough or (float(spoken_end) > asked if is_most else float(spoken_end) < asked):
            break
    bound = "at most" if is_most else "at least"
    return f"{spoken}{unit}" + (f" (for sure {bound} {spoken_end})" if is_enough else "")


def measured_origin(folder: Path) -> str | None:
    """Return the origin of an earlier measurement in `folder`, as `write_readings` had it; None
    without one.
    """
    try:
        document = strict_json((folder / PLANES).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(document, Mapping) or document.get("format") != FORMAT:
        return None
    return one_line(str(document.get("origin", "")))


def isolux_levels(most: float) -> list[float]:
    """Return the levels of isolux lines up to `most` lx: multiples of 1, 2 or 5 times a power of
    ten.
    """
    if not most > 0:
        return [0.0, 1.0]
    raw = most / STEPS
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * k for k in (1, 2, 5, 10) if raw <= power * k * (1 + 1e-9))
    return [step * k for k in range(math.ceil(most / step - 1e-9) + 1)]


def false_colours(
    plane: illuminance.MeasuringPlane, values: Doubles, title: str
) -> npt.NDArray[np.uint8]:
    """Return a picture of the illuminance on a plane, (h, w, 3).

    values: (p,), lx at its points. Between points the light is interpolated; cells without a point
    stay dark. Lines are where it passes a level of the scale. Numbers are in lx, at as many points
    as there is space for. The lengths of the plane follow the title.
    """
    cells = plane.picture(values)[::-1]
    side = max(1, min(LARGEST_CELL, LONGEST // max(cells.shape)))
    levels = isolux_levels(float(values.max()))
    picture = _painted(cells, side, levels)
    height = max(picture.shape[0], LEAST_HEIGHT) + TITLE_HEIGHT + MARGIN
    width = picture.shape[1] + 2 * MARGIN + SCALE_WIDTH
    font = ImageFont.load_default(14)
    sheet = Image.new("RGB", (max(width, 360), height), GROUND)
    sheet.paste(Image.fromarray(picture), (MARGIN, TITLE_HEIGHT))
    draw = ImageDraw.Draw(sheet)
    draw.text((MARGIN, 12), visible(title) + lengths_text(plane), TEXT, font)
    _draw_numbers(draw, cells, side, levels[-1])
    left, top = picture.shape[1] + 2 * MARGIN, TITLE_HEIGHT
    _draw_scale(draw, levels, (left, top, height - top - MARGIN), font)
    return np.asarray(sheet)


def lengths_text(plane: illuminance.MeasuringPlane) -> str:
    """Return the mean lengths of a plane's grid in metres, across and along, after a comma.

    "" for listed points, a single row, and surfaces that lie beside each other in the picture.
    """
    index = plane.picture(np.arange(len(plane), dtype=float))
    lengths = []
    for axis in (1, 0):
        steps = np.diff(plane.points[np.nan_to_num(index).astype(int)], axis=axis)
        are_points = ~np.isnan(np.diff(index, axis=axis))
        has_gap = np.isnan(index).all(axis=1 - axis).any()
        if not plane.spacing or has_gap or not are_points.any():
            return ""
        step = float(np.linalg.norm(steps, axis=-1)[are_points].mean())
        lengths.append(index.shape[axis] * step)
    return f", {lengths[0]:.3g} m x {lengths[1]:.3g} m"


def number_texts(values: Doubles) -> list[str]:
    """Return illuminances as short texts, (n,) in lx: whole numbers from 100 lx on."""
    most = float(np.max(values, initial=0))
    decimals = 0 if most >= 100 else 1 if most >= 10 else 2
    return [f"{x:.{decimals}f}" for x in values]


def numbered_cells(shape: tuple[int, int], side: int, size: tuple[float, float]) -> list[slice]:
    """Return the rows and the columns of cells that have a number, so that no two overlap and none
    leaves the picture.

    side: of a cell, in pixels. size: width and height of the largest number, in pixels.
    """
    width, height = size
    chosen = []
    for count, length in zip(shape, (height, width), strict=True):
        step = math.ceil((length + NUMBER_GAP) / side)
        edge = max(0, math.ceil(length / 2 / side - 0.5))
        inside = count - 2 * edge
        chosen.append(slice(edge + (inside - 1) % step // 2, count - edge, step))
    return chosen


def _draw_numbers(draw: ImageDraw.ImageDraw, cells: Doubles, side: int, most: float) -> None:
    """Write the illuminance into cells, in dark on light ones and the other way round."""
    font = ImageFont.load_default(NUMBER_SIZE)
    rows, columns = np.nonzero(~np.isnan(cells))
    places = zip(rows.tolist(), columns.tolist(), strict=True)
    texts = dict(zip(places, number_texts(cells[rows, columns]), strict=True))
    boxes = {place: draw.textbbox((0, 0), text, font) for place, text in texts.items()}
    size = max(box[2] for box in boxes.values()), max(box[3] for box in boxes.values())
    row_slice, column_slice = numbered_cells(cells.shape, side, size)
    for row in range(cells.shape[0])[row_slice]:
        for column in range(cells.shape[1])[column_slice]:
            if (row, column) not in texts:
                continue
            left, top, right, bottom = boxes[row, column]
            x = MARGIN + (column + 0.5) * side - (left + right) / 2
            y = TITLE_HEIGHT + (row + 0.5) * side - (top + bottom) / 2
            grey = float(colours_of(cells[row, column] / most) @ (0.2126, 0.7152, 0.0722))
            draw.text((x, y), texts[row, column], GROUND if grey > LIGHT_GROUND else TEXT, font)


def _painted(cells: Doubles, side: int, levels: Sequence[float]) -> npt.NDArray[np.uint8]:
    """Return the colours of interpolated cells, with lines at levels, (h, w, 3)."""
    from scipy.ndimage import distance_transform_edt  # late: every command loads this module

    rows, columns = cells.shape
    is_empty = np.isnan(cells)
    # Towards a cell without a point, the light is taken to go on as in the nearest cell with one.
    nearest = distance_transform_edt(is_empty, return_distances=False, return_indices=True)
    light = cells[tuple(nearest)]
    for axis, count in enumerate((rows, columns)):
        light = _interpolated(light, (np.arange(count * side) + 0.5) / side - 0.5, axis=axis)
    band = np.searchsorted(levels, light, side="right") - 1
    picture = colours_of(light / levels[-1])
    is_line = np.zeros(light.shape, bool)
    for axis in (0, 1):
        is_line |= np.diff(band, axis=axis, prepend=np.take(band, [0], axis=axis)) != 0
    picture[is_line] *= LINE
    picture[np.kron(is_empty, np.ones((side, side), bool))] = GROUND
    return np.round(picture).astype(np.uint8)


def _interpolated(cells: Doubles, places: Doubles, axis: int) -> Doubles:
    """Return cells linearly interpolated along an axis. places: in cells, from their centres."""
    last = cells.shape[axis] - 1
    places = np.clip(places, 0, last)
    low = np.minimum(places.astype(int), max(last - 1, 0))
    share = np.expand_dims(places - low, 1 - axis)
    near, far = (np.take(cells, np.minimum(k, last), axis=axis) for k in (low, low + 1))
    return np.asarray((1 - share) * near + share * far)


def colours_of(shares: Doubles) -> Doubles:
    """Return the colours of shares of the scale, 0 to 1, with a last axis of 3, 0 to 255."""
    places = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(shares, places, channel) for channel in COLOURS.T], axis=-1)


def _draw_scale(
    draw: ImageDraw.ImageDraw,
    levels: Sequence[float],
    box: tuple[int, int, int],
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
) -> None:
    """Draw the scale, the brightest above. box: left, top and height."""
    left, top, height = box
    for y in range(height):
        share = 1 - y / max(height - 1, 1)
        r, g, b = (int(v) for v in colours_of(np.array(share)))
        draw.line([(left, top + y), (left + 16, top + y)], (r, g, b))
    for level in levels:
        y = top + round((height - 1) * (1 - level / levels[-1]))
        draw.line([(left, y), (left + 20, y)], TEXT)
        unit = " lx" if level == levels[-1] else ""
        draw.text((left + 26, y - 8), f"{level:g}{unit}", TEXT, font)
