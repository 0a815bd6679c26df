"""Measured illuminance as files: points as CSV, planes as JSON, false-colour pictures."""

import csv
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.files import one_line, write_bytes, write_text
from lightpaint.images.formats import png_bytes
from lightpaint.photometry.false_colour import false_colours
from lightpaint.photometry.glare import Glare, GlareReading
from lightpaint.photometry.illuminance import Illuminance
from lightpaint.photometry.measuring_plane import MeasuringPlane, Wishes
from lightpaint.photometry.wish_presets import PRESETS
from lightpaint.storage.json_records import strict_json

FORMAT = "lightpaint-illuminance 1"
#: Files of a measurement; each plane has a picture beside them.
POINTS, PLANES, PICTURE_SUFFIX = "planes.csv", "planes.json", ".png"


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
    """Return a sentence for each wish that the readings miss, noise apart."""
    readings, missed = measured.readings(weights), []
    for plane in measured.planes:
        name, wishes, reading = plane.name, plane.wishes, readings[plane.name]
        if wishes.mean is not None and reading.mean < wishes.mean:
            missed.append(f"{name}: a mean of {reading.mean:.4g} lx, wished for {wishes.mean:g}")
        if wishes.uniformity is not None and reading.uniformity < wishes.uniformity:
            missed.append(
                f"{name}: a uniformity of {reading.uniformity:.2f}, wished for "
                f"{wishes.uniformity:g}"
            )
        if wishes.most is not None and reading.most > wishes.most:
            missed.append(
                f"{name}: up to {reading.most:.4g} lx, wished for at most {wishes.most:g}"
            )
        for wish in wishes.ratios:
            ratio = reading.mean / other if (other := readings[wish.to].mean) > 0 else np.inf
            if ratio < wish.at_least:
                missed.append(
                    f"{name}: {ratio:.2f} of the mean of {wish.to}, wished for {wish.at_least:g}"
                )
    return missed


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
