"""Measured illuminance as files: points as CSV, planes as JSON, false-colour pictures."""

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.files import one_line, write_bytes, write_text
from lightpaint.images.formats import png_bytes
from lightpaint.photometry.false_colour import false_colours
from lightpaint.photometry.glare import Glare, GlareReading
from lightpaint.photometry.illuminance import Illuminance, PlaneReading, relative_intervals
from lightpaint.photometry.measuring_plane import PRESETS, MeasuringPlane, Wishes
from lightpaint.storage.json_records import strict_json

FORMAT = "lightpaint-illuminance 1"
#: Files of a measurement; each plane has a picture beside them.
POINTS, PLANES, PICTURE_SUFFIX = "planes.csv", "planes.json", ".png"

#: Relative miss that is none: errors in a solve are those with all lamps at full.
CLOSE = 2e-3


def readings_files(planes: Iterable[str]) -> list[str]:
    """Return the names of the files that `write_readings` writes. planes: their names."""
    return [POINTS, PLANES, *(name + PICTURE_SUFFIX for name in planes)]


def write_readings(
    folder: Path,
    measured: Illuminance,
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


def points_text(measured: Illuminance, weights: Doubles) -> str:
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
    measured: Illuminance, weights: Doubles, *, glare: Glare | None = None
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
    plane: MeasuringPlane, measured: Illuminance, weights: Doubles
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


def wishes_document(wishes: Wishes) -> dict[str, Any]:
    """Return wishes for programs, without what is not wished for."""
    document = {key: value for key, value in asdict(wishes).items() if value}
    if wishes.preset:
        document["preset_from"] = str(PRESETS[wishes.preset])
    return document


def missed_wishes(measured: Illuminance, weights: Doubles) -> list[str]:
    """Return a sentence for each wish that is not met at the sure end of its 95 % interval."""
    readings, missed = measured.readings(weights), list[str]()
    for plane in measured.planes:
        wishes, reading = plane.wishes, readings[plane.name]
        least = reading.mean - reading.mean_interval
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
    measured: Illuminance, plane: MeasuringPlane, reading: PlaneReading, weights: Doubles
) -> Iterator[str]:
    """Yield a sentence for a uniformity and a limit that are missed."""
    part, wishes = measured.points_of(plane.name), plane.wishes
    values, errors = measured.of(weights)[part], measured.standard_errors(weights)[part]
    relative = relative_intervals(values, errors)
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
