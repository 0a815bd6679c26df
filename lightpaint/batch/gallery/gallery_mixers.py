"""The mixers of a gallery: one for each basis, which starts from any of its looks.

A mixer uses small planes of its basis, which are kept beside the looks and shared by all of them,
so that it works when the basis is gone.
"""

import hashlib
import json
import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from markupsafe import Markup

from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import light_images
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.file_names import THUMBNAILS
from lightpaint.batch.work.item_execution import job_fields
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.colour import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.file_reading import read_text
from lightpaint.files import write_text
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job.sources import content
from lightpaint.report.page.mixer import (
    kelvin_colors,
    light_data,
    lighting_data,
    packed_gels,
    planes_for_page,
    transform_data,
)
from lightpaint.storage.json_records import strict_json
from lightpaint.version import __version__

#: Maximum number of mixers of a page (each may take two megabytes), and most lights of a mixer with
#: sliders.
MAX_MIXERS, MAX_LIGHTS = 8, 40

#: Suffix of the names of files of small planes.
SUFFIX = ".planes.json"

#: Number of their format, which changes with its fields.
FORMAT = 2

#: Longest of them that is read, in bytes.
MAX_BYTES = 2**27


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
        "gels": packed_gels(),
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


def planes_name(folder: Path, key: str) -> str:
    """Return the name of a basis' small planes in the folder of a batch. key: of `bases_of`.

    Paths are relative to the folder, so that a batch finds its planes after a move with its files.
    """
    base = os.path.realpath(folder)
    record = json.dumps(_relative_paths(json.loads(key), base))
    return hashlib.sha256(record.encode()).hexdigest()[:16]


def write_planes(folder: Path, key: str, basis: Basis) -> None:
    """Write a basis' small planes for the gallery in `folder`, unless they exist."""
    path = folder / THUMBNAILS / f"{planes_name(folder, key)}{SUFFIX}"
    identity = _identity(basis)
    if read_planes(path).get("identity") == identity:
        return
    is_noisy = any(x.any() for x in basis.noise)
    size, planes = planes_for_page(basis, is_clean=is_noisy)
    record = {
        "identity": identity,
        "scene": Path(basis.origin.scene).name,
        "sensor": basis.origin.sensor,
        "size": size,
        "totals": [float(sum(total)) for total in basis.totals],
        "lights": [
            {**light_data(x), "present": list(map(float, x.emission))} for x in basis.lights
        ],
        "images": [
            {
                "label": image.name,
                "columns": image.size[0],
                "members": image.lights.tolist(),
                "places": image.map_order,
            }
            for image in light_images(basis.lights)
            if image.is_whole
        ],
        "planes": planes,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(record, ensure_ascii=False, allow_nan=False) + "\n")


def write_task_planes(folder: Path, task: Task, bases: Sequence[Basis], cache: WorkerCache) -> None:
    """Write the small planes of a task's bases. bases: those that were not read from files."""
    if not bases:
        source = content(job_fields(task, cache)["basis"])
        bases = [source.basis if isinstance(source, LightGroups) else source]
    for key, basis in zip(task.bases, bases, strict=True):
        write_planes(folder, key, basis)


def read_planes(path: Path) -> dict[str, Any]:
    """Return the record that `write_planes` wrote; {} if it cannot be read."""
    with suppress(LightpaintError, ValueError):
        record = strict_json(read_text(path, "planes", LightpaintError, limit=MAX_BYTES))
        return record if isinstance(record, dict) else {}
    return {}


def drop_planes(folder: Path, used_names: Collection[str]) -> None:
    """Delete small planes that no look uses. used_names: names of those to keep."""
    for path in (folder / THUMBNAILS).glob(f"*{SUFFIX}"):
        if path.name.removesuffix(SUFFIX) not in used_names:
            path.unlink(missing_ok=True)


def _identity(basis: Basis) -> str:
    """Return a hash of everything that is shown of a basis: equal hashes mean equal samples."""
    lights = [(light.name, light.unit, list(light.emission)) for light in basis.lights]
    record = [__version__, FORMAT, basis.origin.scene_identity, basis.origin.halves, lights]
    text = json.dumps([*record, basis.totals.tolist()], default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _relative_paths(record: Any, base: str) -> Any:
    """Return plain values with their paths relative to `base`."""
    if isinstance(record, dict):
        return {key: _relative_paths(value, base) for key, value in record.items()}
    if isinstance(record, str) and os.sep in record:
        return os.path.relpath(os.path.realpath(record), base)
    return record
