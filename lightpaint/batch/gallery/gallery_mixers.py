"""The mixers of a gallery: one for each basis, which starts from any of its looks."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from markupsafe import Markup

from lightpaint.batch.gallery.small_planes import SUFFIX, read_planes
from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.folder_names import THUMBNAILS
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.report.page.mixer import (
    kelvin_colors,
    lighting_data,
    transform_data,
)

#: Maximum number of mixers of a page (each may take two megabytes), and most lights of a mixer with
#: sliders.
MAX_MIXERS, MAX_LIGHTS = 8, 40


def mixers_html(
    folder: Path, rows: Sequence[SummaryRow], bases: Mapping[str, str]
) -> dict[str, Markup]:
    """Return the first mixers as sections of HTML, by their names.

    folder: of the batch. rows: candidates. bases: name of each row's planes, by the row's folder.
    """
    rows_by_basis: dict[str, list[SummaryRow]] = {}
    for row in rows:
        if row.lights and row.folder in bases:
            rows_by_basis.setdefault(bases[row.folder], []).append(row)
    sections: dict[str, Markup] = {}
    for name, basis_rows in rows_by_basis.items():
        record = read_planes(folder / THUMBNAILS / f"{name}{SUFFIX}")
        if len(sections) < MAX_MIXERS and record:
            # A damaged file costs its mixer, but not the gallery.
            with suppress(LightpaintError, AttributeError, LookupError, TypeError, ValueError):
                sections[name] = _mixer(folder, name, record, basis_rows)
    return sections


def _mixer(
    folder: Path, name: str, record: Mapping[str, Any], rows: Sequence[SummaryRow]
) -> Markup:
    """Return one mixer. record: as `write_planes` wrote it."""
    lights = [
        {**light, "answer": light["present"], "kelvin": {"present": None, "answer": None}}
        for light in record["lights"]
    ]
    # Results of several views have one lighting, in the folder of the look.
    lighting = read_lighting(folder / rows[0].look / "lighting.json")
    data = {
        "size": record["size"],
        "planes": record["planes"],
        "lights": lights,
        "shown": _strongest_lights(record, rows),
        "joint": [
            {**image, "levels": {"answer": 1.0, "present": 1.0}} for image in record["images"]
        ],
        "kelvins": kelvin_colors(),
        "transform": transform_data(ViewTransform()),
        "painting": None,
        "lighting": lighting_data(lighting),
        "command": None,
    }
    section = (
        '<section class="mixer" data-ready data-basis="{}" hidden>'
        '<script type="application/json">{}</script></section>'
    )
    return Markup(section).format(name, Markup(script_json(data)))


def _strongest_lights(record: Mapping[str, Any], rows: Sequence[SummaryRow]) -> list[int]:
    """Return the lights that get sliders, by their index in the basis: all, if they are few, but
    for the texels of images.
    """
    names = [light["name"] for light in record["lights"]]
    texels = {k for image in record["images"] for k in image["members"]}
    singles = [k for k in range(len(names)) if k not in texels]
    if len(singles) <= MAX_LIGHTS:
        return singles
    power = dict.fromkeys(names, 0.0)
    for row in rows:
        for light in row.lights:
            power[light.name] = max(power.get(light.name, 0.0), light.y)
    share = {name: power[name] * total for name, total in zip(names, record["totals"], strict=True)}
    return sorted(sorted(singles, key=lambda k: -share[names[k]])[:MAX_LIGHTS])


def transforms_of(rows: Sequence[SummaryRow]) -> dict[str, Any]:
    """Return the looks' view transforms by name; the exposure belongs to each look."""
    transforms = {"srgb": transform_data(ViewTransform())}
    for name in dict.fromkeys(row.view[0] for row in rows if row.view):
        with suppress(LightpaintError):
            transforms.setdefault(name, transform_data(ViewTransform(name)))
    return transforms


def script_json(record: Any) -> str:
    """Return JSON for a script element, which only `<` can end, and which allows no escapes."""
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
